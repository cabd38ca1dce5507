//! A window on the GPU that makes its pictures.

use super::{MIDDLE, Window, clay, click_on, pointer, until, until_shown};
use afterlight::compositor::Field;
use afterlight::gpu::{ComputeDevice, DeviceChoice, Gpu, WgpuSetup, device_descriptor};
use afterlight::reflectance::FieldBuffer;
use afterlight::studio::StudioApp;
use afterlight::worker::{Blocked, Source};
use eframe::egui_wgpu::{self, WgpuSetupExisting};
use egui::vec2;
use egui_kittest::Harness;
use std::path::Path;
use test_support::{Need, found};

/// The clay, with its frames on this process's GPU.
fn on_gpu() -> Result<Source, Blocked> {
    let gpu = ComputeDevice::choose(DeviceChoice::Gpu).gpu;
    let gpu = gpu.expect("the window shares its GPU");
    let source = clay::source()?;
    let mut predict = source.predict;
    Ok(Source {
        predict: Box::new(move |index| {
            let mut made = predict(index)?;
            let Field::Memory(olats) = &made.field else { unreachable!("clay is made in memory") };
            let there = FieldBuffer::upload(olats, &gpu.device);
            made.field = Field::Gpu(there, gpu.passes.clone());
            Ok(made)
        }),
        ..source
    })
}

/// A GPU for the window of a test; None without one.
pub fn own_gpu() -> Option<WgpuSetupExisting> {
    let instance = wgpu::Instance::new(wgpu::InstanceDescriptor::new_without_display_handle());
    let adapters = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::VULKAN));
    let adapter = adapters.into_iter().next();
    let adapter = found(Need::Gpu, adapter.ok_or("no Vulkan adapter to draw with"))?;
    let (device, queue) = pollster::block_on(adapter.request_device(&device_descriptor(&adapter))).unwrap();
    Some(WgpuSetupExisting { instance, adapter, device, queue })
}

/// A window that draws with the GPU that makes its pictures; None without a GPU.
fn sharing_window(folder: &Path) -> Option<Window> {
    let gpu = own_gpu()?;
    Gpu::share(WgpuSetup {
        instance: gpu.instance.clone(),
        backend: gpu.adapter.get_info().backend,
        adapter: gpu.adapter.clone(),
        device: gpu.device.clone(),
        queue: gpu.queue.clone(),
    });
    let setup = egui_wgpu::WgpuSetup::Existing(gpu);
    let project = clay::project(folder, clay::environments(folder));
    let window = Harness::builder()
        .with_size(vec2(1280.0, 720.0))
        .with_step_dt(0.25)
        .with_max_steps(60)
        .wgpu_setup(setup)
        .build_eframe(|cc| {
            let app = StudioApp::over(&cc.egui_ctx, project, on_gpu);
            app.drawn_with(cc.wgpu_render_state.clone().unwrap())
        });
    Some(window)
}

/// The part of the window around the centre of the picture.
fn middle(window: &mut Window) -> image::RgbaImage {
    let drawn = window.render().unwrap();
    let [x, y] = [MIDDLE.x, MIDDLE.y].map(|at| at as u32 - 100);
    image::imageops::crop_imm(&drawn, x, y, 200, 200).to_image()
}

/// Drags the light to `to` points from the centre with the pointer down. Waits for the picture of that rotation.
fn turn(window: &mut Window, to: f32) {
    pointer(window, to, None);
    window.step();
    until(window, "the turned picture", |app| {
        let relit = app.relit();
        relit.is_some_and(|relit| relit.scene.yaw_deg == app.state().look.yaw_deg)
    });
}

#[test]
fn a_drag_is_drawn_from_the_gpu_and_what_rests_has_its_codes_too() {
    let folder = crate::temporary();
    let Some(mut window) = sharing_window(folder.path()) else { return };
    until(&mut window, "the first picture", |app| {
        app.relit().is_some() && app.environments().iter().all(|e| e.panorama.is_done())
    });
    until_shown(&mut window);
    let still = window.state().relit().unwrap();
    assert!(still.texture.is_some() && !still.rgb.is_empty());
    let before = middle(&mut window);

    pointer(&window, 0.0, None);
    window.step();
    pointer(&window, 0.0, Some(true));
    window.run_steps(2);
    turn(&mut window, 200.0);
    let turned = middle(&mut window);
    assert_ne!(turned, before, "the rotation is visible");

    // At rest, the codes arrive, and the visible picture stays the same.
    pointer(&window, 200.0, Some(false));
    until(&mut window, "the codes", |app| app.relit().is_some_and(|relit| !relit.rgb.is_empty()));
    window.run_steps(4);
    let relit = window.state().relit().unwrap();
    assert!(relit.passes.iter().all(|pass| !pass.reason.is_empty()));
    assert_eq!(middle(&mut window), turned);

    // Viewing settings are drawn on the GPU too.
    let plain = window.state().relit().unwrap().rgb.clone();
    window.key_press(egui::Key::E);
    until(&mut window, "the brighter picture", |app| {
        let relit = app.relit().filter(|relit| !relit.rgb.is_empty());
        relit.is_some_and(|relit| relit.scene.viewing.exposure_stops == 0.5)
    });
    let brighter = window.state().relit().unwrap();
    assert!(brighter.texture.is_some());
    let sum = |rgb: &[u8]| rgb.iter().map(|&code| u64::from(code)).sum::<u64>();
    assert!(sum(&brighter.rgb) > sum(&plain));
    window.key_press_modifiers(egui::Modifiers::COMMAND, egui::Key::R);
    until(&mut window, "the picture as it is exported", |app| {
        app.relit().is_some_and(|relit| relit.scene.viewing.is_neutral())
    });

    // With visible scopes, codes arrive during a drag too.
    click_on(&mut window, "Scopes");
    pointer(&window, 0.0, Some(true));
    window.run_steps(2);
    for to in [-40.0, -80.0] {
        turn(&mut window, to);
        assert!(!window.state().relit().unwrap().rgb.is_empty());
    }
}
