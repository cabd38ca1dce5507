//! Subjects that move during the lamp cycle, and subjects that do not.

use super::*;
use footage::{Exemplar, ImportSettings};
use imaging::DualGamma;
use std::path::Path as File;
use virtual_stage::{StageSettings, TroubleSettings, write_shoot};

const SIZE: usize = 64;

/// A project of a stage in `folder`, with ground truth.
fn stage(folder: &File, seed: u64, lamps: usize, trouble: TroubleSettings) -> (Project, Truth) {
    let settings = StageSettings { frames: 1, size: SIZE, seed, lamps, trouble, ..StageSettings::default() };
    let shoot = folder.join("shoot");
    write_shoot(&shoot, &settings, &Progress::silent()).unwrap();
    let import = ImportSettings { size: SIZE, seed: 1, layer: None };
    let project = footage::import(&folder.join("project"), &shoot, &import, &Progress::silent());
    let truth = std::fs::read(shoot.join("truth.json")).unwrap();
    (project.unwrap(), serde_json::from_slice(&truth).unwrap())
}

#[derive(serde::Deserialize)]
struct Truth {
    g1: f32,
    g2: f32,
    #[serde(default)]
    trouble: Trouble,
}

#[derive(Default, serde::Deserialize)]
struct Trouble {
    /// Position of the face per pose and lamp.
    sway_px: Vec<Vec<[f32; 2]>>,
}

impl Truth {
    fn response(&self) -> Response {
        Response::Dual(DualGamma { gamma1: self.g1, gamma2: self.g2 })
    }
}

/// Errors of the measured paths in pixels of 256 over all poses and lamps.
#[derive(Debug, Default)]
struct Comparison {
    /// Root mean square of the face's true motion, and of the rest after correction.
    moved: f32,
    left: f32,
}

fn compared(project: &Project, truth: &Truth) -> Comparison {
    let order = order_lit(project);
    let (paths, _) = paths(project, &truth.response(), &order, &directions(project), &Progress::silent()).unwrap();
    let (mut moved, mut left, mut places) = (0.0, 0.0, 0.0);
    for (pose, sway) in truth.trouble.sway_px.iter().enumerate() {
        let mean =
            [0, 1].map(|axis: usize| sway.iter().map(|s| s[axis]).sum::<f32>() / sway.len() as f32 / SIZE as f32);
        for (lamp, way) in sway.iter().enumerate() {
            let shift = shift(&paths.path(pose).unwrap()[lamp]);
            places += 1.0;
            for axis in 0..2 {
                let face = way[axis] / SIZE as f32 - mean[axis];
                moved += face * face;
                left += (shift[axis] + shift[axis + 2] - face).powi(2);
            }
        }
    }
    Comparison { moved: 256.0 * (moved / places).sqrt(), left: 256.0 * (left / places).sqrt() }
}

/// Measured motion with the lamps at the manifest's directions.
fn found(project: &Project, response: &Response) -> Result<Motion> {
    find(project, response, &directions(project), &Progress::silent())
}

fn directions(project: &Project) -> Vec<Option<Vec3>> {
    let layout = &project.settings.shoot.lamp_layout;
    layout.iter().copied().map(Some).collect()
}

/// Calibrations store more than the motion; the exemplars read only this.
fn keep(project: &Project, motion: &Motion) {
    let kept = toml::to_string(&std::collections::BTreeMap::from([("motion", motion)])).unwrap();
    std::fs::write(project.calibration_path(), kept).unwrap();
}

/// Mean squared difference of two sets of exemplars, with the codes' gamma so that dark lamps count.
fn difference(a: &[Exemplar], b: &[Exemplar]) -> f64 {
    let pixels = |exemplars: &[Exemplar]| -> Vec<[f32; 3]> {
        let images = exemplars.iter().flat_map(|e| &e.olats);
        images.flat_map(|image| image.pixels.clone()).collect()
    };
    let (a, b) = (pixels(a), pixels(b));
    let code = |v: f32| v.max(0.0).powf(1.0 / 2.2);
    let squares = a.iter().zip(&b).map(|(a, b)| f64::from(code(a[1]) - code(b[1])).powi(2));
    squares.sum::<f64>() / a.len() as f64
}

#[test]
fn a_subject_that_sits_still_stays_bit_for_bit() {
    for (seed, trouble) in [
        (3, TroubleSettings::NONE),
        // One lamp per bank, coarse noise and blocks.
        (
            4,
            TroubleSettings {
                bank_lamps: Some(1),
                noise: Some(4.0),
                jpeg: Some(80),
                tracking: Some(3),
                ..TroubleSettings::NONE
            },
        ),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let (project, truth) = stage(folder.path(), seed, 12, trouble);
        let response = truth.response();
        let before = Exemplar::load_all(&project, &response).unwrap();
        // With tracking frames and without.
        for _ in 0..2 {
            let motion = found(&project, &response).unwrap();
            assert!(motion.poses.iter().all(|p| !p.corrected), "{seed}: {motion:?}");
            assert_eq!(motion.sentence(), None);
            keep(&project, &motion);
            let after = Exemplar::load_all(&project, &response).unwrap();
            for (a, b) in before.iter().zip(&after) {
                assert_eq!(a.olats, b.olats);
            }
            std::fs::remove_dir_all(project.shoot_path("tracking")).ok();
        }
    }
}

#[test]
fn a_sway_is_found_in_the_olats_and_in_tracking_frames_and_taken_back() {
    let sways = TroubleSettings { sway: Some(3.0), tracking: Some(2), ..TroubleSettings::NONE };
    let folders = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let (project, truth) = stage(folders[0].path(), 21, 16, sways);
    let (still, _) = stage(folders[1].path(), 21, 16, TroubleSettings::NONE);
    let response = truth.response();
    let true_olats = Exemplar::load_all(&still, &response).unwrap();
    let before = difference(&Exemplar::load_all(&project, &response).unwrap(), &true_olats);
    for seen_in in [SeenIn::Tracking, SeenIn::Olats] {
        let comparison = compared(&project, &truth);
        println!("{seen_in:?}: {comparison:?}");
        // More than half of the motion is gone.
        assert!(comparison.left < 0.5 * comparison.moved, "{seen_in:?}: {comparison:?}");
        let motion = found(&project, &response).unwrap();
        assert_eq!(motion.seen_in, seen_in);
        assert!(motion.sentence().is_some_and(|s| s.contains("pose00")), "{motion:?}");
        keep(&project, &motion);
        let after = difference(&Exemplar::load_all(&project, &response).unwrap(), &true_olats);
        println!("{before} and then {after}");
        // Pictures as small as the working size lose detail to resampling.
        assert!(after < 0.8 * before, "{seen_in:?}: {before} and then {after}");
        std::fs::remove_dir_all(project.shoot_path("tracking")).ok();
        std::fs::remove_file(project.calibration_path()).unwrap();
    }
}
