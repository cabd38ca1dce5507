//! Pictures and panoramas.

use super::files;
use fuzz::{Outcome, Target, png_checksums};
use imaging::file;
use light::Mapping;
use light::panorama::{self, ReadSettings};
use std::path::Path;
use test_support::shown;

/// Reads a panorama under every mapping that a user may choose.
fn panorama(path: &Path) -> Outcome {
    let mappings = [Some(Mapping::MirrorBall), Some(Mapping::CubeCross), None];
    let mut said = Ok(());
    for mapping in mappings {
        let settings = ReadSettings { width: 64, mapping };
        said = panorama::read(path, &settings).map(drop);
    }
    said.map_err(|e| e.to_string())
}

#[test]
fn panoramas_of_any_content_are_read_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let panoramas = [files::radiance(), files::openexr()].concat();
    let target = Target::of_bytes("panorama", folder.path().join("sky.exr"), panoramas);
    let measured = fuzz::run!(target, panorama);
    shown!(Strangers, "Panoramas (Radiance HDR, OpenEXR) with arbitrary content",
        bound: "4 GiB at once", measured: measured);
}

#[test]
fn encoded_panoramas_of_any_content_are_read_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    let target = Target {
        repair: png_checksums,
        ..Target::of_bytes("encoded", folder.path().join("sky.png"), files::encoded())
    };
    let measured = fuzz::run!(target, panorama);
    shown!(Strangers, "Panoramas (PNG, JPEG, TIFF) with arbitrary content",
        bound: "4 GiB at once", measured: measured);
}

#[test]
fn pictures_of_any_content_are_read_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    // The second decoder reads only one of eight orientations, and no XYZE.
    let radiance = files::radiance().into_iter().filter(|file| !file.ends_with(b"\x01\x01\x01\x03"));
    // Neither layers by name nor grey ones.
    let openexr = files::openexr().into_iter().take(7);
    let pictures = [files::encoded(), radiance.collect(), openexr.collect()].concat();
    let target =
        Target { repair: png_checksums, ..Target::of_bytes("pictures", folder.path().join("frame.png"), pictures) };
    let measured = fuzz::run!(target, |path: &Path| {
        let said = file::dimensions(path).map(drop);
        let read = file::read_linear(path).map(drop);
        let coverage = file::read_mask(path).map(drop);
        said.and(read).and(coverage).and(file::read_encoded(path).map(drop)).map_err(|e| e.to_string())
    });
    shown!(Strangers, "Pictures and mattes with arbitrary content",
        bound: "4 GiB at once", measured: measured);
}
