//! Light of a shot for other renderers: the panorama with its rotation, and the light of each lamp.

use base::error::{Error, Result};
use base::files::write_beside;
use base::progress::Progress;
use compositor::Levels;
use export::relight::{RelightSettings, lamps_named};
use exr::prelude::{Encoding, Image, Layer, LayerAttributes, SpecificChannels, Vec2, WritableImage};
use glam::{Quat, Vec3};
use light::EnvironmentWeights;
use light::conventions::Front;
use light::placed::Kind;
use light::{Environment, Lighting, PlacedLight, Rig};
use project::Project;
use scene::{Output, Scene};
use std::io::{Cursor, Write};
use std::path::Path;
use std::sync::Arc;

/// Ending of the panorama's file name, after the shot's name.
pub const ENVIRONMENT: &str = ".environment.exr";

/// Light of the shot, at the level of the picture's background: a surface of albedo 0.35 in the panorama's mean
/// light is middle grey.
pub struct Light {
    /// Panorama as in its file, not rotated.
    pub environment: Arc<Environment>,
    pub frames: Vec<FrameLight>,
    /// Names of the lights placed by hand that are on.
    pub placed: Vec<String>,
}

/// Light of one frame.
pub struct FrameLight {
    /// Yaw of the panorama, in degrees.
    pub yaw_deg: f32,
    /// Rotation from a direction in the panorama to one on the stage.
    pub turn: Quat,
    /// Factor on the panorama's radiance, per channel.
    pub strength: [f32; 3],
    /// Irradiance per channel that each lamp gives a surface facing it, in the order of the rig. Together they
    /// give the light of the panorama and of the lights placed by hand.
    pub lamps: Vec<[f32; 3]>,
    /// In the order of [`Light::placed`].
    pub placed: Vec<PlacedLamp>,
}

/// Light placed by hand, in one frame. The panorama's rotation does not move it.
pub struct PlacedLamp {
    /// Unit vector from the subject to the light.
    pub direction: Vec3,
    /// Apparent size from edge to edge.
    pub size_deg: f32,
    /// Irradiance per channel on a surface facing the light.
    pub light: [f32; 3],
}

impl Light {
    /// Light of frames `first` to `last`.
    ///
    /// # Errors
    /// When the environment cannot be read, or a lamp is unknown.
    pub fn new(
        project: &Project,
        settings: &RelightSettings,
        (first, last): (usize, usize),
        rig: &Rig,
    ) -> Result<Self> {
        // Guesses about the file were reported during relighting.
        let (environment, front) = settings.find_environment(project, &Progress::silent())?;
        Self::under(environment, front, settings, (first, last), rig)
    }

    /// Light of frames `first` to `last` under an environment with this front.
    ///
    /// # Errors
    /// When a lamp is unknown.
    fn under(
        environment: Arc<Environment>,
        front: Front,
        settings: &RelightSettings,
        (first, last): (usize, usize),
        rig: &Rig,
    ) -> Result<Self> {
        let solo = lamps_named(rig, &settings.solo)?;
        let levels = Levels { subject: 1.0, background: Levels::of_environment(&environment) };
        let mut lit = EnvironmentWeights::new(&environment, rig, settings.look.lighting.weighting);
        let even = lit.even().per_lamp;
        // Neither on nor solo can have keys.
        let Lighting { placed, .. } = &settings.look.lighting;
        let shines = |i: &usize| solo.is_empty() && settings.look.lighting.shines(&placed[*i]);
        let shining: Vec<usize> = (0..placed.len()).filter(shines).collect();
        let frame = |frame| {
            let share = (frame - first) as f32 / (last - first + 1) as f32;
            let Scene { yaw_deg, lighting, exposure_stops, .. } = settings.scene(frame, share, front, Output::Linear);
            let exposure = exposure_stops.exp2();
            let (weights, gains) = if solo.is_empty() {
                let weights = lit.weights(&lighting, yaw_deg, levels.unit());
                (weights.per_lamp, lighting.gains())
            } else {
                // As in `EnvironmentLight::solo`.
                let share = 0.5 * even.len() as f32 * levels.of_unit_light();
                let on = |(lamp, weight): (usize, &[f32; 3])| {
                    weight.map(|w| if solo.contains(&lamp) { w * share } else { 0.0 })
                };
                (even.iter().enumerate().map(on).collect(), [0.0; 3])
            };
            let level = levels.background * exposure;
            let given =
                |(lamp, weight): (&light::Lamp, &[f32; 3])| std::array::from_fn(|c| lamp.energy[c] * weight[c] * level);
            FrameLight {
                yaw_deg,
                turn: lighting.turn(yaw_deg),
                strength: gains.map(|gain| gain * level),
                lamps: rig.lamps.iter().zip(&weights).map(given).collect(),
                placed: (shining.iter()).map(|&i| PlacedLamp::new(&lighting.placed[i], &lighting, exposure)).collect(),
            }
        };
        let frames = (first..=last).map(frame).collect();
        Ok(Self { environment, frames, placed: shining.iter().map(|&i| placed[i].title(i)).collect() })
    }

    /// Writes the panorama as an EXR: half floats, or 32-bit floats if it exceeds their range.
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

impl PlacedLamp {
    /// Light placed by hand, in a picture with the factor `exposure`.
    fn new(light: &PlacedLight, lighting: &Lighting, exposure: f32) -> Self {
        Self {
            direction: light.direction(),
            size_deg: match light.kind {
                Kind::Point => 0.0,
                Kind::Disc | Kind::Area => 2.0 * light.radius_deg,
            },
            light: (lighting.with_group_gain(light).energy()).map(|energy| energy as f32 * exposure),
        }
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use compositor::Storage;
    use export::Files;
    use light::keyframes::{Interpolation, Keyframes};
    use light::{Lamp, LightGroup};
    use scene::{Animation, LightSetting, Look, Setting};
    use std::path::PathBuf;

    /// Identical keys at frames 10 and 14.
    fn keys(from: f64, to: f64) -> Keyframes {
        let mut keys = Keyframes::NONE;
        keys.interpolation = Interpolation::Linear;
        keys.insert(10.0, from).unwrap();
        keys.insert(14.0, to).unwrap();
        keys
    }

    /// Settings for frames 10 to 14: a moving light, one that is off, and a fixed point light. The exposure
    /// rises by a stop per frame.
    pub fn moving() -> RelightSettings {
        let group = LightGroup { name: "Left".to_owned(), gain_stops: 1.0, ..LightGroup::default() };
        let moves = PlacedLight { id: 1, group: group.name.clone(), ..PlacedLight::default() };
        let off = PlacedLight { id: 2, enabled: false, ..PlacedLight::default() };
        let stays = PlacedLight {
            id: 3,
            kind: Kind::Point,
            yaw_deg: 180.0,
            pitch_deg: 0.0,
            intensity: 2.0,
            name: "Point".to_owned(),
            ..PlacedLight::default()
        };
        let mut animation = Animation::default();
        animation.set(Setting::Exposure, keys(0.0, 4.0));
        for (setting, from, to) in [
            (LightSetting::Yaw, -90.0, 90.0),
            (LightSetting::Pitch, 0.0, 40.0),
            (LightSetting::Radius, 5.0, 25.0),
            (LightSetting::Intensity, 1.0, 5.0),
            (LightSetting::Blue, 0.0, 1.0),
        ] {
            animation.set(Setting::Light(1, setting), keys(from, to));
        }
        RelightSettings {
            environment: PathBuf::new(),
            front: None,
            read: None,
            mapping: None,
            environment_layer: None,
            look: Look {
                yaw_deg: 30.0,
                lighting: Lighting { placed: vec![moves, off, stays], groups: vec![group], ..Lighting::default() },
                animation,
                ..Look::default()
            },
            turntable: false,
            solo: Vec::new(),
            frames: None,
            files: Files::to("shot.%04d.exr").unwrap(),
            hand_over: Vec::new(),
            profile: false,
            device: Default::default(),
            storage: Storage::default(),
        }
    }

    /// Light of frames 10 to 14 with lamps on all six sides.
    fn under(settings: &RelightSettings) -> Light {
        let lamp =
            |direction: Vec3| Lamp { energy: [1.0, 2.0, 0.5], ..Lamp::new(format!("lamp {direction}"), direction) };
        let sides = Vec3::AXES.into_iter().flat_map(|axis| [axis, -axis]);
        let rig = Rig { lamps: sides.map(lamp).collect() };
        let radiance = imaging::Image::from_fn(256, 128, |x, _| [0.5, 0.6, 0.002 * x as f32]);
        let sky = Arc::new(Environment::from_radiance("sky", radiance));
        Light::under(sky, Front::default(), settings, (10, 14), &rig).unwrap()
    }

    /// Light of frames 10 to 14 with two lights placed by hand: one moves, one is fixed.
    pub fn lit() -> Light {
        under(&moving())
    }

    #[test]
    fn placed_lights_follow_their_keys_and_the_exposure() {
        let light = lit();
        assert_eq!(light.placed, ["Light 1", "Point"]);
        for (k, frame) in (0u8..).map(f32::from).zip(&light.frames) {
            let [moves, stays] = &frame.placed[..] else {
                panic!("{} lights", frame.placed.len());
            };
            let (yaw, pitch) = ((45.0 * k - 90.0).to_radians(), (10.0 * k).to_radians());
            let there = Vec3::new(pitch.cos() * yaw.sin(), pitch.sin(), -pitch.cos() * yaw.cos());
            assert!(moves.direction.distance(there) < 1e-5);
            assert!((moves.size_deg - 10.0 * (k + 1.0)).abs() < 1e-4);
            // Its group has a gain of one stop.
            let given = 2.0 * (k + 1.0) * k.exp2();
            for (light, part) in moves.light.into_iter().zip([1.0, 1.0, k / 4.0]) {
                assert!((light - given * part).abs() <= 1e-5 * given);
            }
            assert!(stays.direction.distance(Vec3::Z) < 1e-5);
            assert_eq!((stays.size_deg, stays.light), (0.0, [2.0 * k.exp2(); 3]));
        }
    }

    #[test]
    fn a_light_follows_the_keys_of_its_group() {
        let mut settings = moving();
        let still = under(&settings);
        settings.look.lighting.number_lights();
        // From -1 to 3 stops, formerly 1.
        settings.look.animation.set(Setting::Group(1), keys(-1.0, 3.0));
        let light = under(&settings);
        for (k, (now, before)) in light.frames.iter().zip(&still.frames).enumerate() {
            let gain = (k as f32 - 2.0).exp2();
            for (now, before) in now.placed[0].light.iter().zip(before.placed[0].light) {
                assert!((now - gain * before).abs() <= 1e-5 * now, "{now} {before}");
            }
            assert_eq!(now.placed[1].light, before.placed[1].light, "not in a group");
        }
    }

    #[test]
    fn lamps_give_the_light_of_the_panorama_and_of_placed_lights_once() {
        let light = lit();
        let sky = light.environment.energy();
        for frame in &light.frames {
            for c in 0..3 {
                let lamps: f32 = frame.lamps.iter().map(|lamp| lamp[c]).sum();
                let placed: f32 = frame.placed.iter().map(|lamp| lamp.light[c]).sum();
                let wanted = sky[c] as f32 * frame.strength[c] + placed;
                // Within the energy tolerance of placed lights in `light::lighting`.
                assert!((lamps / wanted - 1.0).abs() < 1e-3, "{lamps} {wanted}");
                assert!(placed > 0.1 * wanted);
            }
        }
    }

    #[test]
    fn lamps_that_light_alone_leave_no_placed_lights() {
        let alone = RelightSettings { solo: vec![format!("lamp {}", Vec3::X)], ..moving() };
        let light = under(&alone);
        assert!(light.placed.is_empty());
        assert!(light.frames.iter().all(|frame| frame.placed.is_empty()));
    }
}
