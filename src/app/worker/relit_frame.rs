//! The relit picture's counterparts: other pictures, made under the same view settings.

use super::behind::Behind;
use super::comparison::Comparison;
use super::prediction::PredictedFrame;
use base::error::Result;
use compositor::reference::scale;
use compositor::{EnvironmentLight, Extra, Field, Ingredients, Picture, compose, viewed};
use imaging::{Encoded, Image, Mask};
use light::{Environment, LightWeights, Rig};
use scene::{Background, Inspection, Output, Scene};
use std::sync::Arc;

/// The relit picture, as far as it sets the level and view of its counterparts.
#[derive(Clone, Copy)]
pub(super) struct RelitFrame<'a> {
    pub scene: &'a Scene,
    pub predicted: &'a PredictedFrame,
    pub light: &'a EnvironmentLight,
    /// Weights of the soloed lamps; None if all lamps light it.
    pub solo: Option<&'a LightWeights>,
    pub rig: &'a Rig,
    pub behind: &'a Behind,
    /// Field and matte of the reference frame, which sets the level of every light.
    pub reference: (&'a Field, &'a Mask),
}

impl RelitFrame<'_> {
    /// Makes the counterpart of a picture. `olats` are those that `comparison` names; without them the result is
    /// None. `own_light` caches the light between pictures.
    ///
    /// # Errors
    /// As [`compose`].
    pub fn compared(
        &self,
        comparison: &Comparison,
        olats: Option<&PredictedFrame>,
        own_light: &mut Option<EnvironmentLight>,
    ) -> Result<Option<Encoded>> {
        let mut scene = self.scene.clone();
        as_a_picture(&mut scene);
        let picture = match (comparison, olats) {
            (Comparison::Plate, _) => {
                let filmed = self.predicted.plate.as_ref().map(|plate| plate.filmed());
                let filmed = filmed.as_ref().unwrap_or(&self.predicted.frame.plate);
                return Ok(Some(plate(filmed, &scene)));
            }
            (Comparison::Olats(_), None) => return Ok(None),
            (Comparison::Olats(_), Some(olats)) => {
                if self.solo.is_some() {
                    scene.background = Background::None;
                }
                let all = self.light.on(&olats.field, &olats.frame.mask);
                let weights = self.solo.unwrap_or(all.weights);
                let extra = extra(olats, self.behind.picture(&scene.background));
                compose(&scene, &Ingredients { weights, extra, ..all })?
            }
            (Comparison::Light(environment, yaw_deg), _) => {
                scene.yaw_deg = *yaw_deg;
                self.in_light(&scene, environment, own_light)?
            }
            (Comparison::Look(view), _) => {
                let mut scene = Scene { frame: scene.frame, output: Output::Display, ..view.scene.clone() };
                scene.effects.inspection = self.scene.effects.inspection;
                as_a_picture(&mut scene);
                self.in_light(&scene, &view.environment, own_light)?
            }
        };
        Ok(picture.display)
    }

    /// The same frame in another scene, under all lamps.
    fn in_light(
        &self,
        scene: &Scene,
        environment: &Arc<Environment>,
        own_light: &mut Option<EnvironmentLight>,
    ) -> Result<Picture> {
        let (light, _) = EnvironmentLight::update(own_light, environment, self.rig, scene, self.reference)?;
        let PredictedFrame { field, frame, .. } = self.predicted;
        let all = light.on(field, &frame.mask);
        let extra = extra(self.predicted, self.behind.picture(&scene.background));
        compose(scene, &Ingredients { extra, ..all })
    }
}

/// Switches off inspections that need a second picture.
fn as_a_picture(scene: &mut Scene) {
    if matches!(scene.effects.inspection, Inspection::Difference { .. }) {
        scene.effects.inspection = Inspection::Picture;
    }
}

/// Extra input for a picture of this frame: its plate, the frame as filmed, and the picture behind it.
pub(super) fn extra<'a>(predicted: &'a PredictedFrame, behind: Option<(u64, &'a Image)>) -> Extra<'a> {
    Extra {
        plate: predicted.plate.as_deref(),
        filmed: Some(&predicted.frame.plate),
        behind: behind.map(|(_, picture)| picture),
        ..Extra::default()
    }
}

/// The interview's frame at the exposure and inspection of a scene.
fn plate(plate: &Image, scene: &Scene) -> Encoded {
    let mut exposed = plate.clone();
    scale(&mut exposed, scene.exposure_stops.exp2());
    viewed(&exposed, scene)
}

#[cfg(test)]
mod tests {
    use super::*;
    use imaging::color::byte_from_unit;
    use scene::Viewing;

    #[test]
    fn a_plate_is_shown_at_the_scene_s_exposure() {
        let grey = Image::filled(2, 1, [0.25; 3]);
        let code = |stops| {
            let scene = Scene { exposure_stops: stops, ..Scene::default() };
            byte_from_unit(plate(&grey, &scene).0.pixels[0][0])
        };
        // sRGB of 1/4 and 1/2.
        assert_eq!((code(0.0), code(1.0)), (137, 188));
        let viewing = Viewing { exposure_stops: 1.0, ..Viewing::default() };
        let scene = Scene { viewing, ..Scene::default() };
        let seen = byte_from_unit(plate(&grey, &scene).0.pixels[0][0]);
        assert_eq!(seen, 188, "shown like the picture");
    }
}
