//! The second picture: what the relit one is compared with, made under the same view settings.

use super::PredictedFrame;
use super::srgb_picture::SrgbPicture;
use base::error::Result;
use compositor::reference::scale;
use compositor::{CameraView, Extra, Ingredients, Levels, Upstream, compose, difference, view};
use imaging::{Encoded, Image};
use light::{Environment, LightWeights};
use scene::{Inspection, Scene};
use std::path::PathBuf;
use std::sync::Arc;

/// What the relit picture is compared with.
#[derive(Clone, Debug)]
pub enum Comparison {
    /// The interview's frame as it was filmed.
    Plate,
    /// The same frame under another environment, turned by a yaw in degrees.
    Light(Arc<Environment>, f32),
    /// Other OLATs under the same light.
    Olats(ComparisonSource),
}

impl PartialEq for Comparison {
    /// Environments are equal where they are one and the same.
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Plate, Self::Plate) => true,
            (Self::Light(one, yaw), Self::Light(other, turned)) => {
                Arc::ptr_eq(one, other) && yaw == turned
            }
            (Self::Olats(one), Self::Olats(other)) => one == other,
            _ => false,
        }
    }
}

/// OLATs that were not predicted by the network at hand.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum ComparisonSource {
    /// Those that were photographed in this pose.
    Exemplar(usize),
    /// The true ones of the shown frame, in a folder as [`evaluation::Truth`] reads it.
    Truth(PathBuf),
    /// Those that a network in this folder predicts.
    Checkpoint(PathBuf),
}

/// The interview's frame under the exposure and the view transform of a scene.
pub(super) fn plate(plate: &Image, scene: &Scene) -> Encoded {
    let mut exposed = plate.clone();
    scale(&mut exposed, scene.exposure_stops.exp2());
    view(&exposed, scene.effects.view)
}

/// Other OLATs in the light of `weights`, at the level of the picture that they are compared with.
///
/// # Errors
/// As [`compose`].
pub(super) fn rival(
    scene: &Scene,
    rival: &PredictedFrame,
    weights: &LightWeights,
    environment: &Environment,
    levels: Levels,
) -> Result<Option<Encoded>> {
    let picture = compose(
        scene,
        &Ingredients {
            field: &rival.field,
            mask: &rival.frame.mask,
            weights,
            environment,
            levels,
            view: CameraView::default(),
            upstream: Upstream::default(),
            extra: Extra::default(),
        },
    )?;
    Ok(picture.display)
}

/// The first of two pictures as it is shown: where a scene asks for their difference, that.
///
/// # Errors
/// When the pictures differ in size.
pub(super) fn differing(
    first: Option<(Comparison, Encoded)>,
    second: Option<&(Comparison, Encoded)>,
    scene: &Scene,
) -> Result<Option<(Comparison, SrgbPicture)>> {
    let Some((of, mut picture)) = first else {
        return Ok(None);
    };
    if let (Inspection::Difference { gain }, Some((_, second))) = (scene.effects.inspection, second)
    {
        difference(&mut picture, second, gain)?;
    }
    Ok(Some((of, SrgbPicture::of(&picture))))
}

/// A scene as the second picture has it: nothing is inspected in it that needs a second one.
pub(super) fn plain(scene: &Scene) -> Scene {
    let mut plain = scene.clone();
    if matches!(plain.effects.inspection, Inspection::Difference { .. }) {
        plain.effects.inspection = Inspection::Picture;
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plate_is_shown_at_the_scene_s_exposure() {
        let grey = Image::filled(2, 1, [0.25; 3]);
        let code = |stops| {
            let scene = Scene {
                exposure_stops: stops,
                ..Scene::default()
            };
            SrgbPicture::of(&plate(&grey, &scene)).rgb[0]
        };
        // sRGB of 1/4 and 1/2.
        assert_eq!((code(0.0), code(1.0)), (137, 188));
    }
}
