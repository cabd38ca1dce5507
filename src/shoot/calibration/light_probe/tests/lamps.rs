//! Clipped lamps, compared with unclipped ground truth.

use super::*;
use imaging::file;

/// A dim ball with lamps, photographed by a camera that clips at 1.
fn clipped(lamps: &[(DVec3, f64, f64)], blur: impl Fn(f64, f64) -> f64 + Sync) -> (Image, Photograph) {
    let view = near_ball();
    let light = photographed(&view, (256, 256), |d| {
        let glow = lamps.iter().map(|(at, peak, width)| peak * blur(d.angle_between(*at), *width));
        let sum = 0.02 + glow.sum::<f64>();
        [sum, 0.9 * sum, 0.7 * sum].map(|v| v as f32)
    });
    let shown = light.map(|p| p.map(|v| v.min(1.0)));
    (light, Photograph::from_linear(shown, Some(1.0)))
}

fn energy(probe: &LightProbe) -> f64 {
    let energy = Mapping::LatLong.energy(&probe.panorama).unwrap();
    f64::from(luminance(energy.map(|e| e as f32)))
}

/// Energies relative to the truth without and with an estimate, and the estimating probe.
fn compared(truth: Image, photograph: &Photograph) -> ([f64; 3], LightProbe) {
    let size = (64, 32);
    let view = near_ball();
    let truth = light_probe(&linear(truth), &view, ClippedLight::Keep, size).unwrap();
    let kept = light_probe(photograph, &view, ClippedLight::Keep, size).unwrap();
    let estimated = light_probe(photograph, &view, ClippedLight::Estimate, size).unwrap();
    assert_eq!(kept.estimated_energy_share, 0.0);
    assert_eq!(kept.clipped_pixels, estimated.clipped_pixels);
    let energies = [energy(&truth), energy(&kept), energy(&estimated)];
    let share = 1.0 - energies[1] / energies[2];
    assert!((f64::from(estimated.estimated_energy_share) - share).abs() < 0.01);
    (energies, estimated)
}

fn gaussian(angle: f64, width: f64) -> f64 {
    (-0.5 * (angle / width).powi(2)).exp()
}

/// A uniform disc with a soft edge a third of its radius wide.
fn disc(angle: f64, width: f64) -> f64 {
    let t = ((1.15 - angle / width) / 0.3).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[test]
fn lobes_that_are_clipped_are_estimated_well() {
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z).normalize();
    for peak in [2.0, 5.0, 20.0] {
        let lamps =
            [(at(0.3, 0.6, 0.7), peak, 0.12), (at(-0.8, 0.1, 0.3), 0.5 * peak, 0.15), (at(0.5, -0.5, 0.4), peak, 0.1)];
        let (light, photograph) = clipped(&lamps, gaussian);
        let ([truth, kept, estimated], probe) = compared(light, &photograph);
        let error = estimated / truth - 1.0;
        println!("peak {peak}: kept {:.3}, estimated {:.3} of the truth", kept / truth, estimated / truth);
        assert!(error.abs() < 0.1, "peak {peak}: {error}");
        assert!(10 * probe.unestimated_pixels < probe.clipped_pixels);
    }
}

#[test]
fn flat_lamps_are_not_taken_for_much_brighter_ones() {
    // The lobe's assumption is wrong here: the added light must stay small, and rejected lamps must be counted.
    for peak in [1.2, 2.0, 4.0, 20.0] {
        for width in [0.08, 0.2] {
            let lamps = [(DVec3::new(0.3, 0.6, 0.7).normalize(), peak, width)];
            let (light, photograph) = clipped(&lamps, disc);
            let ([truth, kept, estimated], probe) = compared(light, &photograph);
            println!(
                "flat lamp of {peak}, {width} wide: kept {:.3}, estimated {:.3}, {} of {} unestimated",
                kept / truth,
                estimated / truth,
                probe.unestimated_pixels,
                probe.clipped_pixels
            );
            assert!(estimated >= kept * 0.9999 && estimated < 1.25 * truth);
            let much_is_missing = probe.clipped_pixels > 0 && estimated < 0.75 * truth;
            assert!(!much_is_missing || probe.unestimated_pixels > 0);
        }
    }
}

#[test]
fn a_lamp_without_a_flank_is_left_and_counted() {
    // A jump from background to clipped within a pixel carries no information about the lamp's brightness.
    let mut light = Image::filled(256, 256, [0.02; 3]);
    for y in 100..110 {
        for x in 100..110 {
            light.pixels[y * 256 + x] = [1.0; 3];
        }
    }
    let photograph = Photograph::from_linear(light, Some(1.0));
    let probe = light_probe(&photograph, &near_ball(), ClippedLight::Estimate, (64, 32)).unwrap();
    assert_eq!((probe.clipped_pixels, probe.unestimated_pixels), (100, 100));
    assert_eq!(probe.estimated_energy_share, 0.0);
}

#[test]
fn the_shared_stages_hot_lamps_are_too_sharp_to_be_estimated() {
    // The hot photographs have ten times the light of the others. Their lamps are uniform discs of a pixel or two.
    // The true response is used to judge only the estimate.
    let Some(stage) = test_support::shared("data/stage") else { return };
    let truth: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(stage.join("truth.json")).unwrap()).unwrap();
    let gamma = |key: &str| truth[key].as_f64().unwrap() as f32;
    let response = Response::from(DualGamma::new(gamma("g1"), gamma("g2")).unwrap());
    let view = BallView { radius_px: 256.0 / 2.2, ..near_ball() };
    for lamp in (0..41).step_by(4) {
        let read = |folder: &str| {
            let path = stage.join(folder).join(format!("olat_{lamp:02}.png"));
            Photograph::from_encoded(&file::read_encoded(&path).unwrap(), &response)
        };
        let size = (64, 32);
        let dim = light_probe(&read("probes"), &view, ClippedLight::Keep, size).unwrap();
        let hot = read("probes_hot");
        let kept = light_probe(&hot, &view, ClippedLight::Keep, size).unwrap();
        let estimated = light_probe(&hot, &view, ClippedLight::Estimate, size).unwrap();
        let truth = 10.0 * energy(&dim);
        println!(
            "lamp {lamp}: {} clipped, {} unestimated, kept {:.3}, estimated {:.3}",
            kept.clipped_pixels,
            estimated.unestimated_pixels,
            energy(&kept) / truth,
            energy(&estimated) / truth
        );
        assert!(energy(&kept) <= energy(&estimated) * 1.0001 && energy(&estimated) < 1.1 * truth);
        assert!(2 * estimated.unestimated_pixels > kept.clipped_pixels);
    }
}
