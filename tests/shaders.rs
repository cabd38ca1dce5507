//! Every shader is valid WGSL with its prelude, and named after its pass.

use afterlight::compositor::{Pass, shaders};
use naga::valid::{Capabilities, ValidationFlags, Validator};
use std::collections::BTreeSet;

#[test]
fn every_shader_is_valid() {
    for shader in shaders() {
        let (name, source) = (shader.name, shader.source());
        let module =
            naga::front::wgsl::parse_str(&source).unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&source)));
        // Halves are unpacked to f32, which every WebGPU device supports.
        let capabilities = Capabilities::SHADER_FLOAT16_IN_FLOAT32;
        Validator::new(ValidationFlags::all(), capabilities)
            .validate(&module)
            .unwrap_or_else(|e| panic!("{name}: {}", e.emit_to_string(&source)));
        assert!(!module.entry_points.is_empty(), "{name} does nothing");
    }
}

#[test]
fn every_shader_s_file_is_used_and_named_after_its_pass() {
    let folder = test_support::repository("shaders");
    let mut files: BTreeSet<String> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    assert!(files.remove("prelude.wgsl"), "{files:?}");
    for shader in shaders() {
        let name = shader.name;
        assert!(files.remove(&format!("{name}.wgsl")), "{name}: {files:?}");
        // Code shared by several passes, or run after them, has a name of its own.
        let shared = ["display_texture", "edges", "measure", "pyramid"].contains(&name);
        let known = shared || Pass::ALL.iter().any(|pass| pass.name() == name);
        assert!(known, "there is no pass {name}");
    }
    assert!(files.is_empty(), "nothing uses {files:?}");
}
