//! Every shader is valid WGSL and named after its pass.

use afterlight::compositor::Pass;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use std::path::{Path, PathBuf};

fn shaders(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    entries
        .flat_map(|path| {
            if path.is_dir() {
                shaders(&path)
            } else {
                vec![path]
            }
        })
        .collect()
}

#[test]
fn every_shader_is_valid() {
    let found = shaders(&test_support::repository("shaders"));
    assert!(!found.is_empty());
    for path in found {
        let name = path.display();
        assert_eq!(path.extension().unwrap(), "wgsl", "{name} is no shader");
        let source = std::fs::read_to_string(&path).unwrap();
        let module = naga::front::wgsl::parse_str(&source)
            .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&source)));
        // Halves are unpacked to f32, which every WebGPU device can do.
        let capabilities = Capabilities::SHADER_FLOAT16_IN_FLOAT32;
        Validator::new(ValidationFlags::all(), capabilities)
            .validate(&module)
            .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&source)));
    }
}

#[test]
fn every_shader_is_named_after_its_pass() {
    for path in shaders(&test_support::repository("shaders")) {
        let name = path.file_stem().unwrap().to_str().unwrap().to_owned();
        // What several passes stand on has a name of its own.
        let shared = ["edges", "measure", "pyramid"].contains(&name.as_str());
        let known = shared || Pass::ALL.iter().any(|pass| pass.name() == name);
        assert!(known, "there is no pass {name}");
    }
}
