//! Pass `vignette`: a lens darkens towards its corners. The light of a rectilinear lens falls off as cos⁴ of the angle
//! of incidence (Kingslake, *Optics in Photography*, 1992); the corner angle follows from the
//! requested loss of light.

use super::descriptor::{Descriptor, LightStep, Run, decide};
use super::facts::key;
use super::passes::{GpuPicture, Recording, Shader};
use base::error::Result;
use imaging::Image;
use rayon::prelude::*;
use scene::Pass;

const SHADER: Shader = Shader::new("vignette", include_str!("../../../shaders/vignette.wgsl"));

pub(crate) const VIGNETTE: Descriptor = Descriptor {
    settings: |context| key(context.effects.vignette.to_bits()),
    shader: Some(&SHADER),
    run: Run::Light(LightStep {
        in_memory: |context, picture| vignette(picture, context.effects.vignette),
        on_gpu: |context, recording, picture| recording.vignette(picture, context.effects.vignette),
        cached: false,
    }),
    ..Descriptor::new(Pass::Vignette, |context| {
        context.asked(Pass::Vignette)?;
        let lost = context.effects.vignette;
        decide(
            lost > UNSEEN,
            || format!("the corners lose {:.1} % of their light", 100.0 * lost),
            "the corners would lose no more than 0.2 % of their light",
        )
    })
};

/// A loss up to this changes no code by a quarter of a step of 8 bits: an sRGB code changes by less than 0.45 times the
/// share that its light does.
const UNSEEN: f32 = 0.002;

/// Multiplies light by cos⁴θ, where θ is 0 in the middle of the picture and tan θ grows with the distance from it, so
/// that the corners lose `lost` (`[0, 1)`) of their light. Does nothing if `lost` is 0 or NaN.
pub fn vignette(picture: &mut Image, lost: f32) {
    let (width, height) = picture.size();
    let spread = spread((width, height), lost);
    let rows = picture.pixels.par_chunks_mut(width.max(1)).enumerate();
    rows.with_min_len(16).for_each(|(y, row)| {
        let down = y as f32 + 0.5 - 0.5 * height as f32;
        for (x, pixel) in row.iter_mut().enumerate() {
            let across = x as f32 + 0.5 - 0.5 * width as f32;
            let cos2 = 1.0 / (1.0 + spread * (across * across + down * down));
            *pixel = pixel.map(|v| v * cos2 * cos2);
        }
    });
}

/// tan²θ at a distance of one pixel from the middle. In the corners 1 / (1 + tan²θ)² is 1 − `lost`.
fn spread((width, height): (usize, usize), lost: f32) -> f32 {
    let corner = 0.25 * (width * width + height * height) as f32;
    // NaN is not above 0.
    let lost = if lost > 0.0 { lost.min(LARGEST) } else { 0.0 };
    let kept = 1.0 - lost;
    (1.0 / kept.sqrt() - 1.0) / corner.max(1.0)
}

/// A larger loss would need a field of view of half a turn.
const LARGEST: f32 = 0.999;

impl Recording<'_> {
    /// [`vignette`] on the GPU. The fourth values stay.
    ///
    /// # Errors
    /// When the GPU cannot hold the result.
    pub fn vignette(&mut self, picture: &GpuPicture, lost: f32) -> Result<GpuPicture> {
        let values = [spread(picture.size(), lost).to_bits(), 0];
        self.plain((&SHADER, "vignette"), values, picture, None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compose::tests::{Set, largest_difference, scene};
    use crate::passes::agreement_tests::on_every_size;
    use crate::{Picture, compose, execute, plan};
    use scene::{Background, Effects, Forced, Inspection, Output, Scene};

    #[test]
    fn the_middle_stays_and_a_corner_loses_its_share() {
        for (width, height) in [(401, 401), (601, 201)] {
            let mut picture = Image::filled(width, height, [2.0; 3]);
            vignette(&mut picture, 0.6);
            assert!((picture.at(width / 2, height / 2)[0] - 2.0).abs() < 1e-4);
            // The corner's pixel lies half a pixel inside.
            assert!((picture.at(0, 0)[0] - 0.8).abs() < 0.02);
            assert_eq!(picture.at(0, 0), picture.at(width - 1, height - 1));
            let row: Vec<f32> = (width / 2..width).map(|x| picture.at(x, 0)[0]).collect();
            assert!(row.windows(2).all(|pair| pair[1] < pair[0]));
        }
    }

    #[test]
    fn hard_pictures_and_strengths_stay_finite() {
        for (width, height) in [(0, 0), (1, 1), (1, 9), (16, 3)] {
            for lost in [f32::NAN, f32::INFINITY, -1.0, 0.0, 1.0, 5.0] {
                let mut picture = Image::filled(width, height, [1e6; 3]);
                vignette(&mut picture, lost);
                assert!(picture.pixels.iter().flatten().all(|v| v.is_finite()));
                let nothing = lost.is_nan() || lost <= 0.0;
                assert!(!nothing || picture.pixels.iter().all(|p| *p == [1e6; 3]));
            }
        }
    }

    #[test]
    fn the_gpu_agrees_with_its_twin() {
        on_every_size(|set| {
            for lost in [0.0, 0.3, 0.9] {
                let mut here = set.image.clone();
                vignette(&mut here, lost);
                let there = set.there(|recording| recording.vignette(&set.on_gpu, lost));
                // The square of a quotient, which GPUs find within 2.5 units in the last place, and two products.
                set.assert_same("vignette", &there, &here, 2e-6);
            }
        });
    }

    fn with(effects: Effects) -> Picture {
        let scene = Scene { effects, ..scene(Background::Environment, Output::Display, 0.0) };
        compose(&scene, &Set::new(64).ingredients()).unwrap()
    }

    fn report(picture: &Picture) -> (bool, &str) {
        let report = &picture.passes[Pass::Vignette as usize];
        (report.ran, report.reason.as_str())
    }

    #[test]
    fn it_runs_where_it_is_asked_for_and_else_says_why_not() {
        let off = Effects::default();
        let plain = with(off);
        assert_eq!(report(&plain), (false, "off"));
        let dark = with(Effects { vignette: 0.5, ..off });
        assert_eq!(report(&dark), (true, "the corners lose 50.0 % of their light"));
        let [plain, dark] = [&plain, &dark].map(|picture| picture.light().at(0, 0)[2]);
        assert!((dark / plain - 0.5).abs() < 0.02, "{dark} of {plain}");
        // It acts on light: exposure tools show it.
        let zones = |vignette| {
            let inspection = Inspection::FalseColor;
            let effects = Effects { vignette, inspection, ..off };
            with(effects).display
        };
        assert_ne!(zones(0.9), zones(0.0));
    }

    #[test]
    fn skipping_a_loss_that_cannot_be_seen_stays_within_its_bound() {
        let set = Set::new(64);
        let scene = Scene {
            effects: Effects { vignette: UNSEEN, ..Effects::default() },
            ..scene(Background::Environment, Output::Display, 0.0)
        };
        let skipped = compose(&scene, &set.ingredients()).unwrap();
        assert!(!report(&skipped).0, "{skipped:?}");
        let mut all = plan(&scene, &crate::Facts::default());
        all.iter_mut().for_each(|planned| {
            let own = skipped.passes[planned.pass as usize].ran;
            planned.run = own || planned.pass == Pass::Vignette;
        });
        let made = execute(&scene, &set.ingredients(), &all).unwrap();
        assert!(made.passes[Pass::Vignette as usize].ran);
        let pairs = skipped.light().pixels.iter().zip(&made.light().pixels);
        for (skipped, made) in pairs {
            (0..3).for_each(|c| assert!((skipped[c] - made[c]).abs() <= UNSEEN * skipped[c]));
        }
        let [skipped, made] = [skipped, made].map(|picture| picture.display.unwrap().0);
        let apart = largest_difference(&skipped, &made);
        assert!(0.0 < apart && apart <= 0.25 / 255.0, "{}", 255.0 * apart);
    }

    #[test]
    fn forced_on_without_a_strength_it_changes_nothing_and_forced_off_it_is_skipped() {
        let forced = |vignette, run| {
            let forced = Forced::default().with(Pass::Vignette, Some(run));
            with(Effects { vignette, forced, ..Effects::default() })
        };
        let plain = with(Effects::default());
        let on = forced(0.0, true);
        assert_eq!(report(&on), (true, "on by hand; not needed here"));
        assert_eq!((&on.linear, &on.display), (&plain.linear, &plain.display));
        let off = forced(0.9, false);
        assert_eq!(report(&off), (false, "off by hand"));
        assert_eq!((&off.linear, &off.display), (&plain.linear, &plain.display));
    }
}
