//! Mattes of full projects.

use super::*;
use crate::{BrushSide, Stroke};
use crate::{ImportSettings, import};
use imaging::Mask;
use imaging::color::{linear_from_srgb, srgb_from_linear};
use test_support::shown;
use virtual_stage::{StageSettings, write_shoot};

fn again_all() -> MatteSettings {
    MatteSettings { replace: true, ..MatteSettings::default() }
}

#[test]
fn what_a_shoot_lacks_is_made_and_what_it_has_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let (shoot, silent) = (folder.path().join("shoot"), Progress::silent());
    let stage = StageSettings { frames: 3, size: 64, lamps: 6, ..StageSettings::default() };
    write_shoot(&shoot, &stage, &silent).unwrap();
    let settings = ImportSettings { size: 16, seed: 1, layer: None };
    let root = folder.path().join("project");
    let project = import(&root, &shoot, &settings, &silent).unwrap();
    let poses = project.settings.shoot.poses.len();
    let nothing = make_mattes(&root, &again_all(), None, &silent).unwrap();
    assert_eq!((nothing.frames, nothing.poses, nothing.kept), (0, 0, 3 + poses));
    assert!(nothing.uncertain.is_none() && !root.join("mattes").exists());

    let truth = |from: &Path| file::read_mask(from).unwrap();
    let mut missing = Vec::new();
    for (matte, own) in [
        (project.frame_matte(0), project.frame_matte_path(0)),
        (project.frame_matte(2), project.frame_matte_path(2)),
        (project.exemplar_matte(1), project.exemplar_matte_path(1)),
    ] {
        missing.push((truth(matte.file()), own));
        std::fs::remove_file(matte.file()).unwrap();
    }
    let made = make_mattes(&root, &MatteSettings::default(), None, &silent).unwrap();
    assert_eq!((made.frames, made.poses, made.kept), (2, 1, poses));
    assert_eq!(made.screen, Some("green"));
    let said = "2 interview mattes and 1 pose matte made. Green screen found.";
    assert_eq!(made.sentence(), said);
    for (truth, own) in &missing {
        let found = file::read_mask(own).unwrap();
        let off = found.pixels.iter().zip(&truth.pixels);
        let off = off.map(|(a, b)| (a - b).abs()).sum::<f32>() / found.pixels.len() as f32;
        assert!(off < 0.02, "{}: {off}", own.display());
    }
    assert!(!project.frame_matte_path(1).exists());

    // Painted by hand: kept, until all are remade.
    let own = &missing[0].1;
    let painted = Mask::filled(64, 64, 1.0);
    file::write_mask_png(own, &painted).unwrap();
    assert_eq!(make_mattes(&root, &MatteSettings::default(), None, &silent).unwrap().kept, 3 + poses);
    assert_eq!(file::read_mask(own).unwrap(), painted);
    let again = make_mattes(&root, &again_all(), None, &silent).unwrap();
    assert_eq!((again.frames, again.poses, again.kept), (2, 1, poses));
    assert_ne!(file::read_mask(own).unwrap(), painted);

    // A frame without a screen is named.
    std::fs::remove_file(own).unwrap();
    let picture = project.frame_picture(0).file().to_owned();
    let grey = Encoded(imaging::Raster::filled(64, 64, [0.5; 3]));
    file::write_png(&picture, &grey).unwrap();
    let said = make_mattes(&root, &MatteSettings::default(), None, &silent).unwrap_err().to_string();
    assert!(said.contains("frame_000.png") && said.contains("screen"), "{said}");
    // Unless a detector finds the person.
    let middle = |_: &Encoded| {
        let inside = |at: usize| (4..12).contains(&at);
        Ok(Mask::from_fn(16, 16, |x, y| f32::from(u8::from(inside(x) && inside(y)))))
    };
    let found = make_mattes(&root, &MatteSettings::default(), Some(Box::new(middle)), &silent).unwrap();
    assert_eq!((found.frames, found.guessed, found.screen), (1, 1, None));
    assert!(found.sentence().contains("found the person in 1"), "{}", found.sentence());
    let matte = file::read_mask(own).unwrap();
    assert_eq!((matte.at(32, 32), matte.at(4, 32)), (1.0, 0.0));
    // And unless it finds none.
    std::fs::remove_file(own).unwrap();
    let nobody = |_: &Encoded| Ok(Mask::filled(16, 16, 0.1));
    let said = make_mattes(&root, &MatteSettings::default(), Some(Box::new(nobody)), &silent).unwrap_err();
    let said = said.to_string();
    assert!(said.contains("frame_000.png") && said.contains("nor a person"), "{said}");
}

/// A project of a stage's shoot without its frames' mattes, and the true mattes.
struct Stage {
    folder: tempfile::TempDir,
    project: Project,
    truths: Vec<Mask>,
}

impl Stage {
    fn new(seed: u64, frames: usize) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let (shoot, silent) = (folder.path().join("shoot"), Progress::silent());
        let stage = StageSettings { frames, size: 128, lamps: 6, seed, ..StageSettings::default() };
        write_shoot(&shoot, &stage, &silent).unwrap();
        let settings = ImportSettings { size: 16, seed: 1, layer: None };
        let project = import(&folder.path().join("project"), &shoot, &settings, &silent).unwrap();
        let take = |frame| {
            let file = project.frame_matte(frame).file().to_owned();
            let truth = file::read_mask(&file).unwrap();
            std::fs::remove_file(file).unwrap();
            truth
        };
        let truths = (0..frames).map(take).collect();
        Self { folder, project, truths }
    }

    /// Repaints the frames: the new value of each pixel, from its frame, place, coverage and light.
    fn repaint(&self, change: impl Fn(usize, (usize, usize), f32, [f32; 3]) -> [f32; 3]) {
        for (frame, truth) in self.truths.iter().enumerate() {
            let picture = self.project.frame_picture(frame);
            let mut codes = read_picture(&picture).unwrap();
            let width = codes.0.width;
            for (i, (pixel, alpha)) in codes.0.pixels.iter_mut().zip(&truth.pixels).enumerate() {
                let light = pixel.map(linear_from_srgb);
                let after = change(frame, (i % width, i / width), *alpha, light);
                *pixel = after.map(srgb_from_linear);
            }
            file::write_png(picture.file(), &codes).unwrap();
        }
    }

    /// Replaces the screen by a wall with pictures; returns that wall as a clean plate at another exposure with
    /// some noise.
    fn before_a_wall(&self) -> PathBuf {
        let screen = read_picture(&self.project.frame_picture(0)).unwrap();
        let screen = screen.0.at(3, 3).map(linear_from_srgb);
        self.repaint(|_, at, alpha, light| {
            let wall = wall(at);
            std::array::from_fn(|c| (light[c] + (1.0 - alpha) * (wall[c] - screen[c])).max(0.0))
        });
        let plate = imaging::Raster::from_fn(128, 128, |x, y| {
            let grain = ((x * 7919 + y * 104_729) % 97) as f32 / 97.0 - 0.5;
            wall((x, y)).map(|v| (srgb_from_linear(0.8 * v) + 0.02 * grain).clamp(0.0, 1.0))
        });
        let file = self.folder.path().join("plate.png");
        file::write_png(&file, &Encoded(plate)).unwrap();
        file
    }

    /// Makes the mattes and returns the smallest overlap and the largest mean error over all frames.
    fn made(&self, settings: &MatteSettings) -> (MattesReport, f32, f32) {
        let report = make_mattes(&self.project.root, settings, None, &Progress::silent()).unwrap();
        let mut worst = (1.0_f32, 0.0_f32);
        for (frame, truth) in self.truths.iter().enumerate() {
            let found = file::read_mask(&self.project.frame_matte_path(frame)).unwrap();
            let pairs = || found.pixels.iter().zip(&truth.pixels);
            let both = pairs().filter(|(a, b)| **a >= 0.5 && **b >= 0.5).count();
            let any = pairs().filter(|(a, b)| **a >= 0.5 || **b >= 0.5).count();
            let off = pairs().map(|(a, b)| (a - b).abs()).sum::<f32>() / found.pixels.len() as f32;
            let overlap = both as f32 / any.max(1) as f32;
            println!("frame {frame}: IoU {overlap:.4}, error {off:.5}");
            worst = (worst.0.min(overlap), worst.1.max(off));
        }
        println!("{}", report.sentence());
        (report, worst.0, worst.1)
    }

    /// Smallest box around the subject in all frames, with a few pixels of margin.
    fn subject_box(&self) -> [usize; 4] {
        let (mut left, mut top, mut right) = (128, 128, 0);
        for truth in &self.truths {
            for (i, _) in truth.pixels.iter().enumerate().filter(|p| *p.1 > 0.0) {
                (left, right) = (left.min(i % 128), right.max(i % 128));
                top = top.min(i / 128);
            }
        }
        let (left, top) = (left.saturating_sub(4), top.saturating_sub(4));
        [left, top, (right + 5).min(128) - left, 128 - top]
    }

    /// A place well inside the subject in a frame: the middle of its upper part.
    fn face(&self, frame: usize) -> [f32; 2] {
        let truth = &self.truths[frame];
        let top = truth.pixels.iter().position(|a| *a > 0.5).unwrap() / 128;
        let row = top + 22;
        let inside: Vec<usize> = (0..128).filter(|x| truth.at(*x, row) > 0.5).collect();
        [inside.iter().sum::<usize>() as f32 / inside.len() as f32, row as f32]
    }
}

/// Light of a wall.
fn wall((x, y): (usize, usize)) -> [f32; 3] {
    let (u, v) = (x as f32 / 128.0, y as f32 / 128.0);
    let stripes = 0.02 * (38.0 * u).sin() + 0.02 * (23.0 * v + 9.0 * u).sin();
    let base = match () {
        () if (0.05..0.25).contains(&u) && (0.15..0.5).contains(&v) => [0.1, 0.2, 0.35],
        () if (0.7..0.95).contains(&u) && (0.1..0.4).contains(&v) => [0.5, 0.55, 0.6],
        () => [0.12, 0.2, 0.14],
    };
    base.map(|b: f32| (b + stripes).max(0.01))
}

#[test]
fn every_frame_of_two_stages_has_its_matte_and_little_flicker() {
    let mut said = Vec::new();
    for seed in [5, 23] {
        let stage = Stage::new(seed, 6);
        let plain = MatteSettings { no_steady: true, replace: true, ..MatteSettings::default() };
        let (raw, ..) = stage.made(&plain);
        assert_eq!(raw.flicker, raw.flicker_before);
        let (report, iou, off) = stage.made(&again_all());
        assert!(iou >= 0.985 && off <= 0.01, "stage {seed}: {iou}, {off}");
        let (after, before) = (report.flicker.unwrap(), report.flicker_before.unwrap());
        assert!(after < before, "stage {seed}: flicker {before} to {after}");
        assert_eq!(report.flicker_before, raw.flicker_before);
        said.push(format!("IoU {iou:.4}, mean error {off:.4}, flicker {before:.4} to {after:.4}"));
    }
    shown!(Pictures, "All frames of two virtual stages, keyed and averaged over time",
        bound: "IoU 0.985, mean error 0.01",
        measured: said.join("; "));
}

/// Smallest overlap and largest mean error that `make` reaches in two stages.
fn worst(frames: usize, make: impl Fn(&Stage) -> (f32, f32)) -> (f32, f32) {
    let [a, b] = [5, 23].map(|seed| make(&Stage::new(seed, frames)));
    (a.0.min(b.0), a.1.max(b.1))
}

#[test]
fn a_box_serves_a_whole_project() {
    let (iou, off) = worst(3, |stage| {
        let within = Some(stage.subject_box());
        let (report, iou, off) = stage.made(&MatteSettings { within, ..MatteSettings::default() });
        assert_eq!((report.frames, report.screen), (3, None));
        (iou, off)
    });
    assert!(iou >= 0.985 && off <= 0.01, "{iou}, {off}");
    shown!(Pictures, "Two virtual stages cut out of one box, their screen not used",
        bound: "IoU 0.985, mean error 0.01",
        measured: format!("IoU {iou:.4}, mean error {off:.4}"));
}

#[test]
fn a_clean_plate_serves_a_whole_project() {
    let (iou, off) = worst(3, |stage| {
        let clean_plate = Some(stage.before_a_wall());
        let said = make_mattes(&stage.project.root, &MatteSettings::default(), None, &Progress::silent());
        let said = said.unwrap_err().for_terminal();
        assert!(said.contains("--clean-plate") && said.contains("paint"), "{said}");
        let settings = MatteSettings { clean_plate, ..MatteSettings::default() };
        let (report, iou, off) = stage.made(&settings);
        assert_eq!((report.frames, report.screen), (3, None));
        (iou, off)
    });
    assert!(iou >= 0.985 && off <= 0.01, "{iou}, {off}");
    shown!(Pictures, "Two virtual stages before a wall with pictures on it, with a clean plate of another exposure",
        bound: "IoU 0.985, mean error 0.01",
        measured: format!("IoU {iou:.4}, mean error {off:.4}"));
}

#[test]
fn strokes_on_one_frame_serve_the_others() {
    // A patch of the subject has the screen's colour and moves along.
    let stage = Stage::new(5, 5);
    let screen = read_picture(&stage.project.frame_picture(0)).unwrap();
    let screen = screen.0.at(3, 3).map(linear_from_srgb);
    let faces: Vec<_> = (0..5).map(|frame| stage.face(frame)).collect();
    stage.repaint(|frame, (x, y), _, light| {
        let [cx, cy] = faces[frame];
        let off = (x as f32 - cx).abs().max((y as f32 - cy).abs());
        if off < 10.0 { screen.map(|v| 1.3 * v) } else { light }
    });
    let (_, without, _) = stage.made(&again_all());
    let stroke = Stroke {
        frame: 2,
        side: BrushSide::Keep,
        radius: 3.0,
        points: vec![[faces[2][0] - 4.0, faces[2][1]], [faces[2][0] + 4.0, faces[2][1]]],
    };
    let strokes = Strokes { strokes: vec![stroke] };
    strokes.save(&stage.project).unwrap();
    assert_eq!(Strokes::load(&stage.project).unwrap(), strokes);
    let kept = make_mattes(&stage.project.root, &MatteSettings::default(), None, &Progress::silent());
    assert!(kept.unwrap().sentence().contains("kept their old mattes"));
    let (report, iou, off) = stage.made(&again_all());
    assert_eq!((report.painted, report.followed), (1, 0));
    assert!(without < 0.97 && iou >= 0.985 && off <= 0.01, "{without} to {iou}, {off}");
    shown!(Pictures, "A hole in the key of every frame, painted shut in one",
        bound: "IoU 0.985, mean error 0.01",
        measured: format!("IoU {without:.3} without, {iou:.4} with it, mean error {off:.4}"));
}

#[test]
fn frames_before_a_wall_follow_the_painted_one() {
    let (iou, off) = worst(5, |stage| {
        stage.before_a_wall();
        let [x, y] = stage.face(2);
        let stroke = |side, points| Stroke { frame: 2, side, radius: 3.0, points };
        let strokes = Strokes {
            strokes: vec![
                stroke(BrushSide::Keep, vec![[x, y - 14.0], [x, 124.0], [x - 25.0, 124.0], [x + 25.0, 124.0]]),
                stroke(BrushSide::Remove, vec![[4.0, 80.0], [4.0, 4.0], [124.0, 4.0], [124.0, 80.0]]),
                stroke(BrushSide::Remove, vec![[20.0, 20.0], [20.0, 70.0]]),
                stroke(BrushSide::Remove, vec![[106.0, 20.0], [106.0, 70.0]]),
            ],
        };
        strokes.save(&stage.project).unwrap();
        let (report, iou, off) = stage.made(&MatteSettings::default());
        assert_eq!((report.frames, report.painted, report.followed), (5, 1, 4));
        (iou, off)
    });
    assert!(iou >= 0.95 && off <= 0.02, "{iou}, {off}");
    shown!(Pictures, "A wall with pictures on it, no clean plate, strokes on one frame of five",
        bound: "IoU 0.95, mean error 0.02",
        measured: format!("IoU {iou:.3}, mean error {off:.4}"));
}

#[test]
fn strokes_that_no_brush_can_paint_are_refused_by_a_sentence() {
    let stage = Stage::new(5, 1);
    let path = Strokes::path(&stage.project);
    assert_eq!(Strokes::load(&stage.project).unwrap(), Strokes::default());
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    let good = "[[stroke]]\nframe = 0\nside = \"keep\"\nradius = 4.0\npoints = [[1.0, 2.0]]\n";
    for (from, to, says) in [
        ("frame = 0", "frame = 1", "1 frames"),
        ("frame = 0", "frame = -1", "strokes.toml"),
        ("keep", "perhaps", "perhaps"),
        ("4.0", "nan", "radius"),
        ("4.0", "1e9", "radius"),
        ("[[1.0, 2.0]]", "[]", "no points"),
        ("[[1.0, 2.0]]", "[[inf, 2.0]]", "NaN or too far"),
        ("[[1.0, 2.0]]", "[[1.0]]", "strokes.toml"),
        ("frame", "frames", "strokes.toml"),
    ] {
        std::fs::write(&path, good.replace(from, to)).unwrap();
        let said = Strokes::load(&stage.project).unwrap_err().to_string();
        assert!(said.contains(says) && said.contains("strokes.toml"), "{to}: {said}");
    }
    std::fs::write(&path, good).unwrap();
    let mut strokes = Strokes::load(&stage.project).unwrap();
    assert_eq!(strokes.seeds(0, (8, 8)).values().at(1, 2), 1.0);
    strokes.strokes.clear();
    strokes.save(&stage.project).unwrap();
    assert!(!path.exists());
    shown!(Strangers, "A file with impossible strokes",
        done: "refused, with the names of file and stroke and the fault");
}

/// A project whose interview is these pictures.
fn filmed(pictures: &[Encoded], truths: Vec<Mask>) -> Stage {
    let folder = tempfile::tempdir().unwrap();
    let (shoot, silent) = (folder.path().join("shoot"), Progress::silent());
    let stage = StageSettings { frames: pictures.len(), size: 16, lamps: 4, ..StageSettings::default() };
    write_shoot(&shoot, &stage, &silent).unwrap();
    std::fs::remove_dir_all(shoot.join("interview_masks")).unwrap();
    let settings = ImportSettings { size: 16, seed: 1, layer: None };
    let project = import(&folder.path().join("project"), &shoot, &settings, &silent).unwrap();
    for (frame, picture) in pictures.iter().enumerate() {
        file::write_png(project.frame_picture(frame).file(), picture).unwrap();
    }
    Stage { folder, project, truths }
}

#[test]
fn mattes_of_filmed_frames_flicker_less_than_each_by_itself() {
    let mut said = Vec::new();
    if let Some(shoot) = test_support::shared("data/stage") {
        let named = |frame: usize| format!("frame_{frame:03}.png");
        let pictures: Vec<_> =
            (0..40).map(|i| file::read_encoded(&shoot.join("interview").join(named(i))).unwrap()).collect();
        let truths = (0..40).map(|i| file::read_mask(&shoot.join("interview_masks").join(named(i))).unwrap()).collect();
        let (report, iou, off) = filmed(&pictures, truths).made(&MatteSettings::default());
        assert!(iou >= 0.985 && off <= 0.01, "{iou}, {off}");
        let (after, before) = (report.flicker.unwrap(), report.flicker_before.unwrap());
        assert!(after < before, "{before} to {after}");
        said.push(format!("a shoot of 40 frames {before:.4} to {after:.4}, IoU {iou:.4}, mean error {off:.4}"));
    }
    if let Some(footage) = test_support::shared("data/footage") {
        let movie = movies::open(&footage.join("d0.mp4")).unwrap();
        let pictures: Vec<_> = (0..12).map(|i| movie.frame(i).unwrap().encoded()).collect();
        let (report, ..) = filmed(&pictures, Vec::new()).made(&MatteSettings::default());
        let (after, before) = (report.flicker.unwrap(), report.flicker_before.unwrap());
        assert!(after < before, "{before} to {after}");
        said.push(format!("a filmed man {before:.4} to {after:.4}"));
    }
    if !said.is_empty() {
        shown!(Pictures, "Filmed frames before a green screen, one after the other",
            bound: "less than each frame's own, on the same frames",
            measured: said.join("; "));
    }
}
