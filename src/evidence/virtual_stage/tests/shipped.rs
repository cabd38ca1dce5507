use crate::jpeg::decode;
use crate::session::Session;
use crate::shipped::FRAMES;
use crate::shoot::before_screen;
use crate::{StageSettings, write_shoot};
use base::progress::Progress;
use imaging::file::{read_encoded, read_mask};
use imaging::resample::resize_area;
use std::path::Path;

/// The interview that comes with the program equals what the stage traces now, so it matches the demo's poses. If this
/// fails after a change of the stage, run `make demo-interview` again.
#[test]
fn the_shipped_interview_is_what_the_stage_traces() {
    let folder = tempfile::tempdir().unwrap();
    let (settings, silent) = (StageSettings::demo(), Progress::silent());
    let session = Session::new(folder.path(), &settings, &silent);
    let size = (135, 240);
    for i in [0, 11, 23] {
        let put = |name: &str, bytes| {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            path
        };
        let shipped = session.sensor.response.decode(&decode(FRAMES[i].picture).unwrap());
        assert_eq!(shipped.size(), (540, 960));
        let matte = read_mask(&put("frame.png", FRAMES[i].matte)).unwrap();
        let (shipped, matte) = (resize_area(&shipped, 135, 240), resize_area(&matte, 135, 240));
        let pose = &session.frames[i];
        let traced = session.take(pose, &session.bake(pose), size, (false, false), "").unwrap();
        let missed = |pairs: &mut dyn Iterator<Item = (f32, f32)>| {
            let (mut off, mut level) = (0.0, 0.0);
            pairs.for_each(|(a, b)| (off, level) = (off + (a - b).abs(), level + b));
            off / level
        };
        let off = missed(&mut matte.pixels.iter().copied().zip(traced.coverage.pixels.iter().copied()));
        assert!(off < 0.01, "frame {i}: the matte is off by {off}");
        // The exposure depends on poses that are not traced here, so the subject's level fixes it.
        let inside = |pixels: &[[f32; 3]]| -> f32 {
            let pairs = pixels.iter().zip(&traced.coverage.pixels);
            pairs.filter(|(_, alpha)| **alpha == 1.0).map(|(pixel, _)| pixel[1]).sum()
        };
        let exposure = inside(&shipped.pixels) / inside(&traced.sums[0].pixels);
        let plate = before_screen(&traced, exposure);
        let channels = |pixels: &[[f32; 3]]| pixels.iter().flatten().copied().collect::<Vec<_>>();
        let pairs = channels(&shipped.pixels).into_iter().zip(channels(&plate.pixels));
        let off = missed(&mut pairs.into_iter());
        assert!(off < 0.02, "frame {i} is off by {off}");
    }
}

#[test]
fn the_demo_asks_for_the_shipped_interview_and_traces_its_truth() {
    let folder = tempfile::tempdir().unwrap();
    let small = StageSettings { frames: 2, size: 16, lamps: 4, plate: Some((18, 32)), ..StageSettings::demo() };
    let report = write_shoot(folder.path(), &small, &Progress::silent()).unwrap();
    let there = |name: &str| folder.path().join(name).is_file();
    assert!(there("interview_masks/frame_001.png") && there("truth/frame_001_relit_nave.exr"));
    let frame = read_encoded(&folder.path().join("interview/frame_001.png")).unwrap();
    assert_eq!(frame, decode(FRAMES[1].picture).unwrap());
    assert_eq!(report.files, super::contents(Path::new(folder.path())).len());
}
