//! Borders between crates: the crates that may depend on the window toolkit, the network framework and the GPU. Imports
//! among our own crates are checked by the compiler.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Names of every crate's dependencies, without those of its tests.
fn dependencies() -> BTreeMap<String, BTreeSet<String>> {
    let sources = Path::new(&std::env::var("CARGO_MANIFEST_DIR").unwrap()).join("src");
    let folders = |path: &Path| std::fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path());
    let groups = folders(&sources).filter(|path| path.is_dir());
    let mut found = BTreeMap::new();
    for folder in groups.flat_map(|group| folders(&group)) {
        let Ok(text) = std::fs::read_to_string(folder.join("Cargo.toml")) else { continue };
        let table: toml::Table = text.parse().unwrap();
        let names = table["dependencies"].as_table().unwrap().keys().cloned();
        let name = folder.file_name().unwrap().to_str().unwrap().to_owned();
        found.insert(name, names.collect());
    }
    found
}

fn who_knows(prefixes: &[&str]) -> Vec<String> {
    dependencies()
        .into_iter()
        .filter(|(_, names)| names.iter().any(|name| prefixes.iter().any(|p| name.starts_with(p))))
        .map(|(name, _)| name)
        .collect()
}

#[test]
fn the_window_alone_knows_egui() {
    assert_eq!(who_knows(&["egui", "eframe"]), ["studio"]);
}

#[test]
fn burn_stays_with_the_network_its_training_and_its_device() {
    assert_eq!(who_knows(&["burn", "cubecl"]), ["gpu", "person", "reflectance", "rivals", "training"]);
}

#[test]
fn wgpu_stays_with_the_passes_the_fields_and_the_device() {
    assert_eq!(who_knows(&["wgpu"]), ["compositor", "gpu", "reflectance"]);
}

#[test]
fn one_crate_knows_open_color_io() {
    assert_eq!(who_knows(&["ocio"]), ["color_config"]);
}

/// Other crates hand over through the export's settings.
#[test]
fn only_who_runs_exports_hands_them_over() {
    assert_eq!(who_knows(&["handover"]), ["farm", "studio", "worker"]);
}

/// The reference for the network and the compositor must be independent of both.
#[test]
fn the_virtual_stage_uses_neither_calibration_nor_compositor() {
    let ours: BTreeSet<String> = dependencies().into_keys().collect();
    let used = &dependencies()["virtual_stage"];
    let used: Vec<&String> = used.intersection(&ours).collect();
    assert_eq!(used, ["base", "imaging", "light"]);
}
