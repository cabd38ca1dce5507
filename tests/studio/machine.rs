//! Performance of this machine, in the window.

use super::{snapshot, until_labelled};
use afterlight::benchmark::MachineReport;
use afterlight::studio::Phase;
use egui::Key;
use egui_kittest::kittest::{NodeT, Queryable};
use serde_json::json;

/// A machine with a GPU, and one measurement that is missing.
pub fn report() -> MachineReport {
    let row = |what: &str, network: Option<&str>, size: usize, ms: f64| {
        json!({
            "what": what, "network": network, "size": size,
            "median_ms": ms, "low_ms": 0.9 * ms, "high_ms": 1.2 * ms, "runs": 40,
            "first_ms": 12.0, "copy_ms": network.is_none().then_some(ms / 1.2),
            "peak_bytes": 900_000_000, "gpu_bytes": 700_000_000, "predicted_ms": null,
            "left_out": null, "goal": null, "reached": null,
        })
    };
    let rows = |slow: f64| {
        let mut missing = row("training step", Some("paper"), 512, 1.0);
        missing["median_ms"] = json!(null);
        missing["predicted_ms"] = json!(40.0 * slow);
        missing["left_out"] = json!("the time was up; give it more minutes");
        json!([
            row("relight", None, 512, 0.3 * slow),
            row("relit frame, network included", Some("quick"), 512, 9.0 * slow),
            row("turn of the light in the window", Some("quick"), 512, 0.8 * slow),
            row("training step", Some("quick"), 128, 6.0 * slow),
            row("prediction", Some("quick"), 128, 1.5 * slow),
            missing,
        ])
    };
    let device = |kind: &str, name: &str, slow: f64| {
        json!({
            "kind": kind, "name": name, "self_test": (kind == "gpu").then_some("passed"),
            "copied_per_second": 4e11 / slow, "rows": rows(slow),
        })
    };
    let report = json!({
        "machine": { "processor": "A processor", "threads": 8, "system": "linux", "version": "0.1.0" },
        "adapters": [{
            "name": "A card", "backend": "vulkan", "driver": "1.2", "kind": "discrete GPU",
            "largest_buffer_bytes": 8_000_000_000_u64, "largest_binding_bytes": 2_000_000_000_u64,
        }],
        "minutes": 8.0, "seconds": 300.0, "stopped": false,
        "devices": [device("gpu", "A card", 1.0), device("cpu", "A processor", 20.0)],
    });
    serde_json::from_value(report).unwrap()
}

#[test]
fn the_sentence_of_the_device_opens_what_the_machine_can_do() {
    let (_folder, mut window) = crate::new_window();
    let Phase::Ready { device } = window.state().status().phase.clone() else {
        panic!("it is live");
    };
    window.get_by_label(&device).click();
    window.run();
    let enabled = |window: &super::Window, label: &str| {
        let node = window.get_by_label(label);
        !node.accesskit_node().is_disabled()
    };
    assert!(enabled(&window, "Measure this machine"));
    assert!(!enabled(&window, "Save…"), "nothing was measured");

    window.state().show_machine(report());
    until_labelled(&mut window, "In short");
    assert!(enabled(&window, "Save…"));
    window.get_by_label("ten minutes of training quick, 128 pixels");
    window.get_by_label("100000 steps");
    window.get_by_label("about 15000 steps");
    snapshot(&mut window, "studio_machine");

    // It covers the picture until closed; other shortcuts still work.
    window.key_press(Key::ArrowRight);
    window.run();
    assert_eq!(window.state().state().frame, 1);
    window.key_press(Key::Escape);
    window.run();
    assert!(window.query_by_label("Measure this machine").is_none());
    assert!(!window.state().state().covers.machine);

    // It leads to the passes of the picture, which stays beside them.
    let picture = window.get_by_label("Relit picture").rect();
    window.get_by_label(&device).click();
    window.run();
    window.get_by_label("Render passes").click();
    window.run();
    assert!(!window.state().state().covers.machine);
    window.get_by_label("Relighting group");
    assert_eq!(window.get_by_label("Relit picture").rect(), picture);
}
