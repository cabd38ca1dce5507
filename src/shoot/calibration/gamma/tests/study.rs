//! Views of a fit: other curves, the cost surface, the pictures under a response.

use super::small_shoot::{SmallShoot, dual};
use super::*;
use imaging::{Response, file};

#[test]
fn the_dual_gamma_beats_others_where_the_camera_has_one_and_ties_with_a_power() {
    let compare = |response: Response| {
        let (subject, probes) = SmallShoot { response, ..SmallShoot::default() }.load();
        let fitted = fit(&subject, &probes, None, &Progress::silent()).unwrap();
        fitted.compare(&Progress::silent()).unwrap()
    };
    let curves = compare(dual(2.8, 1.8));
    assert_eq!(curves.len(), 5);
    assert_eq!(curves[0].evidence, 0.0);
    for other in &curves[1..] {
        assert!(other.evidence > 100.0 && other.ball_psnr() < curves[0].ball_psnr() - 2.0, "{other:?}");
    }
    let curves = compare(Response::Power(2.2));
    let Response::Power(gamma) = curves[1].response else {
        panic!("the second is the power");
    };
    assert!((gamma - 2.2).abs() < 0.1 && curves[1].evidence.abs() < 4.0, "{curves:?}");
    assert!(curves[2..].iter().all(|other| other.evidence > 100.0));
}

#[test]
fn the_surface_is_lowest_at_the_fit_and_its_valley_holds_the_truth() {
    let (subject, probes) = SmallShoot::default().load();
    let fitted = fit(&subject, &probes, None, &Progress::silent()).unwrap();
    let surface = fitted.surface(7, &Progress::silent()).unwrap();
    assert_eq!(surface.gammas, [1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0]);
    assert_eq!(surface.cost.len(), 49);
    // No place of a coarse grid beats the fit by more than the walk's accuracy.
    assert!(surface.cost.iter().all(|cost| *cost > -0.1));
    let at = |gamma1: usize, gamma2: usize| surface.cost[gamma2 * 7 + gamma1];
    // (2.5, 2.0) is the place nearest to the truth: the valley runs along equal changes of both exponents and falls
    // to it from all sides.
    for beside in [at(2, 2), at(4, 2), at(3, 1), at(3, 3)] {
        assert!(at(3, 2) < beside, "{:?}", surface.cost);
    }
    assert!(at(2, 3) > 10.0 * at(3, 2) && at(5, 5) > 10.0 * at(3, 2));
    assert!(surface.exposure.iter().all(|e| e.is_finite() && *e > 0.0));
}

#[test]
fn a_study_shows_what_a_response_makes_of_the_pictures() {
    let folder = tempfile::tempdir().unwrap();
    let project = SmallShoot { turn: 0.0, ..SmallShoot::default() }.shoot(folder.path());
    let mut study = GammaStudy::load(&project, 1, &Progress::silent()).unwrap();
    let right = dual(2.5, 1.9);
    let weights = study.weights(&right);
    let picture = study.relit(&right, 1.0, &weights);
    assert_eq!(picture.0.size(), (32, 32));
    // Pose 1 and frame 1 are the same, so their pixels agree within noise and the weights' error.
    let frame = file::read_encoded(project.frame_picture(1).file()).unwrap();
    for (x, y) in [(16, 16), (12, 20), (20, 9)] {
        let (found, is) = (picture.0.at(x, y), frame.0.at(3 * x + 1, 3 * y + 1));
        for c in 0..3 {
            assert!((found[c] - is[c]).abs() < 0.02, "{found:?} is not {is:?}");
        }
    }
    assert_eq!(picture.0.at(0, 0), [0.0; 3]);
    // Histograms count every sample once, and those of the right response are nearer to each other.
    let interview = study.interview_histogram();
    let distance = |response: &Response| -> f64 {
        let relit = study.relit_histogram(response, 1.0, &study.weights(response));
        let total = |counts: &[u32; 256]| f64::from(counts.iter().sum::<u32>());
        let mut distance = 0.0;
        for (a, b) in interview.iter().zip(&relit) {
            assert!(total(a) > 1000.0 && total(b) > 1000.0);
            let (mut below_a, mut below_b) = (0.0, 0.0);
            for (x, y) in a.iter().zip(b) {
                below_a += f64::from(*x) / total(a);
                below_b += f64::from(*y) / total(b);
                distance += (below_a - below_b).abs();
            }
        }
        distance
    };
    assert!(4.0 * distance(&right) < distance(&dual(2.0, 2.4)));
    // A higher exposure gives a brighter picture.
    let brighter = study.relit(&right, 1.3, &weights);
    assert!(brighter.0.at(16, 16)[1] > picture.0.at(16, 16)[1]);
    study.show_pose(&project, 2).unwrap();
    assert_ne!(study.relit(&right, 1.0, &weights), picture);
    assert!(study.show_pose(&project, 4).is_err());
}

#[test]
fn the_drawn_curve_follows_its_asymptotes_at_the_ends() {
    let points = curve(&DualGamma::new(2.6, 2.1).unwrap(), 101);
    assert_eq!((points.len(), points[0].linear, points[100].linear), (101, 0.0, 1.0));
    assert!((points[2].linear / points[2].dark - 1.0).abs() < 0.15);
    assert!((points[98].linear / points[98].bright - 1.0).abs() < 1e-3);
    for point in &points {
        let (low, high) = (point.dark.min(point.bright), point.dark.max(point.bright));
        assert!((low - 1e-6..=high + 1e-6).contains(&point.linear));
    }
}
