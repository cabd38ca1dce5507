//! Successive pictures of a clip or a window, with the data that one leaves for the next.

use super::compose::{compose_reusing, make};
use super::facts::Grain;
use super::picture::{Extra, Ingredients, Picture};
use super::reuse::Reuse;
use super::shown::ShownPicture;
use super::smoothing::Steady;
use base::error::Result;
use imaging::{Image, Mask};
use scene::{Pass, Scene, ViewTransform, Viewing};

/// Pictures of one clip or window, in order.
#[derive(Debug, Default)]
pub struct Series {
    reuse: Reuse,
    grain: Option<(GrainKey, Grain)>,
    steady: Option<Steady>,
}

/// Everything that a plate's grain depends on.
#[derive(Clone, Debug, PartialEq)]
struct GrainKey {
    /// Numbered as in [`super::Identity`].
    frame: u64,
    view: ViewTransform,
    viewing: Viewing,
}

impl Series {
    /// Makes the next picture. `plate` is the frame at the working size, with its matte, for the passes
    /// `background` and `grain` of a picture of that size. Their input and that of the pass `smoothing` are filled in here;
    /// `ingredients.extra.identity` states changes.
    ///
    /// # Errors
    /// As [`super::compose`].
    pub fn compose(&mut self, scene: &Scene, plate: (&Image, &Mask), ingredients: &Ingredients) -> Result<Picture> {
        Ok(self.next(scene, plate, ingredients, false)?.picture)
    }

    /// Makes the next picture for a window: a GPU's picture stays there. Like [`Self::compose`].
    ///
    /// # Errors
    /// As [`super::compose`].
    pub fn show(&mut self, scene: &Scene, plate: (&Image, &Mask), ingredients: &Ingredients) -> Result<ShownPicture> {
        self.next(scene, plate, ingredients, true)
    }

    fn next(
        &mut self,
        scene: &Scene,
        plate: (&Image, &Mask),
        ingredients: &Ingredients,
        may_stay: bool,
    ) -> Result<ShownPicture> {
        let mut reuse = std::mem::take(&mut self.reuse);
        let ingredients = self.fill_in(scene, plate, ingredients);
        let shown = make(scene, &ingredients, None, Some(&mut reuse), may_stay);
        self.reuse = reuse;
        let shown = shown?;
        self.steady.clone_from(&shown.picture.steady);
        Ok(shown)
    }

    /// A smaller picture in place of the next one, with its own cache `reuse`. It does not affect
    /// the picture after it.
    ///
    /// # Errors
    /// As [`super::compose`].
    pub fn compose_stand_in(
        &mut self,
        scene: &Scene,
        plate: (&Image, &Mask),
        ingredients: &Ingredients,
        reuse: &mut Reuse,
    ) -> Result<Picture> {
        compose_reusing(scene, &self.fill_in(scene, plate, ingredients), reuse)
    }

    /// Adds the input of the passes `background`, `grain` and `smoothing`.
    fn fill_in<'a>(
        &'a mut self,
        scene: &Scene,
        (plate, mask): (&'a Image, &Mask),
        ingredients: &Ingredients<'a>,
    ) -> Ingredients<'a> {
        let key = GrainKey {
            frame: ingredients.extra.identity.frame,
            view: scene.effects.view,
            viewing: scene.viewing.clone(),
        };
        self.grain = match self.grain.take() {
            _ if !scene.effects.asks(Pass::Grain) => None,
            Some(known) if known.0 == key => Some(known),
            _ => Some((
                key,
                match ingredients.plate() {
                    Some(plate) => Grain::from_plate(&plate.filmed(), &plate.matte, scene),
                    None => Grain::from_plate(plate, mask, scene),
                },
            )),
        };
        let extra = Extra {
            filmed: Some(plate),
            before: self.steady.as_ref(),
            grain: self.grain.as_ref().map(|(_, grain)| grain),
            ..ingredients.extra
        };
        Ingredients { extra, ..*ingredients }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Identity;
    use super::*;
    use crate::Field;
    use light::{Environment, LightWeights};
    use reflectance::ReflectanceField;
    use scene::Effects;

    /// Frames of 64 × 64 pixels whose brightness jumps from one to the next.
    struct Clip {
        plate: Image,
        mask: Mask,
        environment: Environment,
        weights: LightWeights,
    }

    impl Clip {
        fn new() -> Self {
            let mut state = 1u32;
            let mut noise = || {
                state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                0.1 * ((state >> 8) as f32 / (1 << 24) as f32 - 0.5)
            };
            Self {
                plate: Image::from_fn(64, 64, |_, _| [0.3 + noise(); 3]),
                mask: Mask::filled(64, 64, 1.0),
                environment: Environment::from_radiance("grey", Image::filled(8, 4, [0.5; 3])),
                weights: LightWeights { per_lamp: vec![[0.5; 3]; 2], uncovered: 0.0 },
            }
        }

        fn field(brightness: f32) -> Field {
            let olat = Image::filled(64, 64, [brightness; 3]);
            ReflectanceField::from_olats(&[olat.clone(), olat]).into()
        }

        fn ingredients<'a>(&'a self, field: &'a Field, frame: u64) -> Ingredients<'a> {
            Ingredients {
                extra: Extra { identity: Identity { frame, ..Identity::default() }, ..Extra::default() },
                ..Ingredients::new(field, &self.mask, &self.weights, &self.environment)
            }
        }

        fn scene(frame: usize) -> Scene {
            Scene { frame, effects: Effects { smoothing: 0.8, grain: 1.0, ..Effects::default() }, ..Scene::default() }
        }
    }

    #[test]
    fn a_picture_hands_its_brightness_on_and_a_stand_in_does_not() {
        let clip = Clip::new();
        let fields = [0.5, 0.6, 0.2].map(Clip::field);
        let plate = (&clip.plate, &clip.mask);
        let (mut series, mut with_stand_in) = (Series::default(), Series::default());
        for (frame, field) in fields.iter().take(2).enumerate() {
            let ingredients = clip.ingredients(field, frame as u64);
            let scene = Clip::scene(frame);
            let picture = series.compose(&scene, plate, &ingredients).unwrap();
            // A smaller picture of another brightness comes in between.
            let between = clip.ingredients(&fields[2], 9);
            let mut reuse = Reuse::default();
            with_stand_in.compose_stand_in(&Clip::scene(frame), plate, &between, &mut reuse).unwrap();
            let again = with_stand_in.compose(&scene, plate, &ingredients).unwrap();
            assert_eq!(picture.display, again.display, "frame {frame}");
            let gain = picture.steady.unwrap().gain[1];
            if frame == 0 {
                assert_eq!(gain, 1.0);
            } else {
                assert!(gain < 0.95, "the jump is held back: {gain}");
            }
        }
    }

    #[test]
    fn the_plate_s_grain_is_measured_where_it_is_asked_for_and_once_a_frame() {
        let clip = Clip::new();
        let field = Clip::field(0.5);
        let plate = (&clip.plate, &clip.mask);
        let mut series = Series::default();
        let ingredients = clip.ingredients(&field, 1);
        series.compose(&Clip::scene(0), plate, &ingredients).expect("a picture with grain");
        let (key, grain) = series.grain.clone().unwrap();
        let (view, viewing) = (ViewTransform::Srgb, Viewing::default());
        assert_eq!(key, GrainKey { frame: 1, view, viewing });
        assert!(grain.most() > 0.0);
        assert_eq!(grain, Grain::from_plate(&clip.plate, &clip.mask, &Scene::default()));
        // Another plate under the same number is ignored.
        let flat = Image::filled(64, 64, [0.3; 3]);
        series.compose(&Clip::scene(0), (&flat, &clip.mask), &ingredients).unwrap();
        assert_eq!(series.grain, Some((key, grain)));
        series.compose(&Clip::scene(0), (&flat, &clip.mask), &clip.ingredients(&field, 2)).unwrap();
        assert_ne!(series.grain.as_ref().map(|(_, grain)| *grain), Some(grain));
        series.compose(&Scene::default(), plate, &ingredients).unwrap();
        assert_eq!(series.grain, None);
    }
}
