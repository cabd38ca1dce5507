//! The light of a shot for other renderers: the panorama with its turn, and what each lamp gives.

use base::error::{Error, Result};
use base::files::write_beside;
use base::progress::Progress;
use compositor::Levels;
use export::relight::{RelightSettings, find_environment, lamps_named};
use exr::prelude::{
    Encoding, Image, Layer, LayerAttributes, SpecificChannels, Vec2, WritableImage,
};
use glam::{Quat, Vec3};
use light::conventions::Front;
use light::lighting::EnvironmentWeights;
use light::{Environment, Rig};
use project::Project;
use scene::{Output, Scene};
use std::io::{Cursor, Write};
use std::path::Path;
use std::sync::Arc;

/// What stands behind the shot's name in that of the panorama.
pub const ENVIRONMENT: &str = ".environment.exr";

/// What lights the shot. The picture's level is that of the background in it: a surface of albedo 0.35 in the panorama's mean
/// light is middle grey.
pub struct Light {
    /// As its file has it, not turned.
    pub environment: Arc<Environment>,
    pub frames: Vec<FrameLight>,
    /// Lights placed by hand, which no turn moves.
    pub placed: Vec<PlacedLamp>,
}

/// The light of one frame.
pub struct FrameLight {
    /// The yaw at which the panorama is shown, in degrees.
    pub yaw_deg: f32,
    /// What takes a direction in the panorama to one on the stage.
    pub turn: Quat,
    /// Times the panorama's radiance, per channel.
    pub strength: [f32; 3],
    /// What each lamp of the rig gives to a surface that faces it: irradiance per channel, in the order of the rig.
    pub lamps: Vec<[f32; 3]>,
}

/// A light that was placed by hand.
pub struct PlacedLamp {
    pub name: String,
    /// From the subject to the light, of length 1.
    pub direction: Vec3,
    /// How large it looks from edge to edge.
    pub size_deg: f32,
    /// Irradiance per channel of a surface that faces it.
    pub light: [f32; 3],
}

impl Light {
    /// The light of frames `first` to `last`.
    ///
    /// # Errors
    /// When the environment cannot be read, or a lamp is unknown.
    pub fn of(
        project: &Project,
        settings: &RelightSettings,
        (first, last): (usize, usize),
        rig: &Rig,
    ) -> Result<Self> {
        let (environment, known_front) = match &settings.read {
            Some(read) => (read.clone(), Front::default()),
            None => {
                // What had to be guessed of the file was said while it was relit.
                let (wanted, silent) = (&settings.environment, Progress::silent());
                let (found, front) = find_environment(project, wanted, settings.mapping, &silent)?;
                (Arc::new(found), front)
            }
        };
        let front = settings.front.unwrap_or(known_front);
        let solo = lamps_named(rig, &settings.solo)?;
        let levels = Levels {
            subject: 1.0,
            background: Levels::of_environment(&environment),
        };
        let mut lit = EnvironmentWeights::new(&environment, rig, settings.lighting.weighting);
        let even = lit.even().per_lamp;
        let frame = |frame| {
            let share = (frame - first) as f32 / (last - first + 1) as f32;
            let Scene {
                yaw_deg,
                lighting,
                exposure_stops,
                ..
            } = settings.scene(frame, share, front, Output::Linear);
            let exposure = exposure_stops.exp2();
            let (weights, gains) = if solo.is_empty() {
                let weights = lit.weights(&lighting, yaw_deg, levels.unit());
                (weights.per_lamp, lighting.gains())
            } else {
                // As `EnvironmentLight::solo`.
                let share = 0.5 * even.len() as f32 * levels.of_unit_light();
                let on = |(lamp, weight): (usize, &[f32; 3])| {
                    weight.map(|w| if solo.contains(&lamp) { w * share } else { 0.0 })
                };
                (even.iter().enumerate().map(on).collect(), [0.0; 3])
            };
            let level = levels.background * exposure;
            let given = |(lamp, weight): (&light::Lamp, &[f32; 3])| {
                std::array::from_fn(|c| lamp.energy[c] * weight[c] * level)
            };
            FrameLight {
                yaw_deg,
                turn: lighting.turn(yaw_deg),
                strength: gains.map(|gain| gain * level),
                lamps: rig.lamps.iter().zip(&weights).map(given).collect(),
            }
        };
        let frames = (first..=last).map(frame).collect();
        let Scene {
            lighting,
            exposure_stops,
            ..
        } = settings.scene(first, 0.0, front, Output::Linear);
        let lights = lighting.placed.iter().enumerate();
        let placed = lights
            .filter(|(_, light)| solo.is_empty() && lighting.shines(light))
            .map(|(index, light)| PlacedLamp {
                name: light.title(index),
                direction: light.direction(),
                size_deg: 2.0 * light.radius_deg,
                light: (lighting.with_group_gain(light).energy())
                    .map(|energy| energy as f32 * exposure_stops.exp2()),
            })
            .collect();
        Ok(Self {
            environment,
            frames,
            placed,
        })
    }

    /// Writes the panorama as an EXR: half floats, or whole ones if it is brighter than half floats can say.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn write_environment(&self, path: &Path) -> Result<()> {
        let radiance = &self.environment.radiance;
        if radiance.pixels.iter().flatten().all(|v| *v <= 65504.0) {
            return imaging::file::write_exr(path, radiance);
        }
        let pixels = SpecificChannels::rgb(|at: Vec2<usize>| {
            let [r, g, b] = radiance.at(at.x(), at.y());
            (r, g, b)
        });
        let (attributes, encoding) = (LayerAttributes::default(), Encoding::SMALL_LOSSLESS);
        let layer = Layer::new(radiance.size(), attributes, encoding, pixels);
        let mut bytes = Vec::new();
        Image::from_layer(layer)
            .write()
            .to_buffered(Cursor::new(&mut bytes))
            .map_err(|e| Error::codec("encode", path, e, "Check the size of the panorama"))?;
        write_beside(path, |out| out.write_all(&bytes))
    }
}
