//! Python script for Blender: the compositor that rebuilds the picture, the world and the lamps.
//!
//! The script is `blender.py`, the same for all shots, with the numbers of the shot inserted. They are written as
//! JSON, which is valid Python for numbers, texts and lists.

use crate::group::Group;
use crate::lamps::{LampLayer, Layers};
use crate::light::{ENVIRONMENT, FrameLight, Light};
use crate::media::{Media, Stills};
use crate::shot::Shot;
use base::error::{Error, Result};
use export::{ExrAlpha, LayerFiles};
use glam::{EulerRot, Mat3, Quat, Vec3};
use serde::Serialize;
use std::path::Path;

const SCRIPT: &str = include_str!("blender.py");
/// Line of `blender.py` that the shot's numbers replace.
const PLACE: &str = "SHOT = {}\n";
/// Blender's largest frame number.
const MOST_FRAMES: i64 = 1_048_574;

/// Numbers of the shot for the script. Lists over frames have one entry if nothing changes.
#[derive(Serialize)]
struct Numbers<'a> {
    name: &'a str,
    /// File of the first frame.
    picture: String,
    /// 1 for a file for each frame, 0 for a single file.
    sequence: u8,
    frames: [i64; 2],
    rate: [f64; 2],
    size: [usize; 2],
    /// 1 for straight alpha.
    straight: u8,
    lamps: Vec<Lamp<'a>>,
    /// Layers that are not a lamp's; empty if there are none.
    rest: Vec<Part>,
    world: World,
    placed: Vec<Sun<'a>>,
}

/// Layer in the picture's file, or in a file of its own.
#[derive(Serialize)]
struct Part {
    layer: String,
    file: String,
}

#[derive(Serialize)]
struct Lamp<'a> {
    #[serde(flatten)]
    sun: Sun<'a>,
    group: &'a str,
    #[serde(flatten)]
    part: Part,
    weights: Vec<[f32; 3]>,
}

/// Blender light for a lamp of the stage or a light placed by hand.
#[derive(Serialize)]
struct Sun<'a> {
    name: &'a str,
    /// From the subject to the light, in Blender's axes.
    direction: Vec<[f32; 3]>,
    /// From edge to edge, in radians.
    angle: Vec<f32>,
    /// Irradiance per channel on a surface facing the light.
    light: Vec<[f32; 3]>,
}

#[derive(Serialize)]
struct World {
    file: String,
    /// Rotation of the Mapping node, in radians.
    rotation: Vec<[f32; 3]>,
    strength: Vec<[f32; 3]>,
}

/// Refuses files that Blender would not find.
///
/// # Errors
/// When layers are parts, frame numbers are negative or too large, or the name ends in digits other than the frame number.
pub fn check(media: &Media, (first, last): (i64, i64), place: LayerFiles) -> Result<()> {
    if place == LayerFiles::Parts {
        return Err(Error::invalid(
            "Blender reads only the first part of an EXR, but the layers are separate parts",
            ("Write them as channels or as files", "--layer-files channels"),
        ));
    }
    if first < 0 || last > MOST_FRAMES {
        return Err(Error::invalid(
            format!("Blender counts frames from 0 to {MOST_FRAMES}, but the files have the numbers {first} to {last}"),
            (
                "Choose another first number, export a part of the interview, or do not hand over to Blender",
                "--first-number or --frames, or leave blender out of --hand-over",
            ),
        ));
    }
    let Media::Stills(stills) = media else { return Ok(()) };
    let files = match place {
        LayerFiles::Files => {
            let layer = export::beside(Path::new(&stills.name(last)), "light_00");
            stills.like(&layer.to_string_lossy(), last)
        }
        _ => stills.clone(),
    };
    let is_number = |c: char| c.is_ascii_digit();
    if files.digits.is_some() && files.after.contains(is_number) {
        return Err(Error::invalid(
            format!(
                "Blender reads the last digits of a name as the frame number, but {} has other digits after it",
                files.name(last)
            ),
            "Put the number last, with a dot before it, such as shot.%04d.exr",
        ));
    }
    Ok(())
}

/// Script of a shot, to be stored beside its files.
pub fn script(shot: &Shot) -> String {
    let (Some(layers), Some(light), Media::Stills(stills)) = (&shot.layers, &shot.light, &shot.media) else {
        return SCRIPT.to_owned();
    };
    let numbers = Numbers::new(shot, layers, light, stills);
    // Numbers and texts can always be serialised.
    let numbers = serde_json::to_string(&numbers).unwrap_or_default();
    // One lamp per line.
    let numbers = numbers.replace(",{\"name\":", ",\n{\"name\":");
    SCRIPT.replacen(PLACE, &format!("SHOT = {numbers}\n"), 1)
}

impl<'a> Numbers<'a> {
    fn new(shot: &'a Shot, layers: &'a Layers, light: &'a Light, stills: &Stills) -> Self {
        let (first, last) = shot.frames;
        let rate = shot.frame_rate();
        let whole = rate.round().max(1.0);
        let part = |layer: &str, files: &Option<Stills>| Part {
            layer: layer.to_owned(),
            file: files.as_ref().map_or(String::new(), |files| files.name(first)),
        };
        let lamp = |(index, lamp): (usize, &'a LampLayer)| Lamp {
            sun: Sun {
                name: &lamp.lamp,
                direction: vec![in_blender(lamp.direction).into()],
                // The edge of a disc is √2 times as far from its middle as the root mean square.
                angle: vec![disc(2.0 * 2f32.sqrt() * lamp.spread_deg)],
                light: shortened(light.frames.iter().map(|frame| frame.lamps[index])),
            },
            group: lamp.group.name(),
            part: part(&lamp.layer, &lamp.files),
            weights: shortened(lamp.weights.iter().copied()),
        };
        let placed = |(index, name): (usize, &'a String)| {
            let lamps = || light.frames.iter().map(move |frame| &frame.placed[index]);
            Sun {
                name,
                direction: shortened(lamps().map(|lamp| in_blender(lamp.direction).into())),
                angle: shortened(lamps().map(|lamp| disc(lamp.size_deg))),
                light: shortened(lamps().map(|lamp| lamp.light)),
            }
        };
        let mut lamps: Vec<_> = layers.lamps.iter().enumerate().map(lamp).collect();
        let order = |lamp: &Lamp| Group::ALL.iter().position(|group| group.name() == lamp.group);
        lamps.sort_by_key(order);
        Self {
            name: &shot.name,
            picture: stills.name(first),
            sequence: u8::from(stills.digits.is_some()),
            frames: [first, last],
            rate: [whole, whole / rate],
            size: layers.size.into(),
            straight: u8::from(layers.alpha == ExrAlpha::Straight),
            lamps,
            rest: layers.rest.iter().map(|rest| part("rest", &rest.files)).collect(),
            world: World {
                file: format!("{}{ENVIRONMENT}", shot.name),
                rotation: shortened(light.frames.iter().map(rotation)),
                strength: shortened(light.frames.iter().map(|frame| frame.strength)),
            },
            placed: light.placed.iter().enumerate().map(placed).collect(),
        }
    }
}

/// Angle of a disc in radians, at most half the sphere.
fn disc(degrees: f32) -> f32 {
    degrees.clamp(0.0, 180.0).to_radians()
}

/// One entry if all are equal.
fn shortened<T: PartialEq>(values: impl Iterator<Item = T>) -> Vec<T> {
    let mut all: Vec<T> = values.collect();
    if all.windows(2).all(|pair| pair[0] == pair[1]) {
        all.truncate(1);
    }
    all
}

/// Our axes converted to Blender's, where +Z is up and the camera looks along +Y.
fn in_blender(d: Vec3) -> Vec3 {
    Vec3::new(d.x, -d.z, d.y)
}

/// Rotation of the Mapping node (type Point) that turns the panorama as in this frame, as Euler angles XYZ in
/// radians. The node turns the lookup direction, and Blender's middle column is +X.
fn rotation(frame: &FrameLight) -> [f32; 3] {
    let ours = Mat3::from_cols(in_blender(Vec3::X), in_blender(Vec3::Y), in_blender(Vec3::Z));
    let middle = Mat3::from_rotation_z(-std::f32::consts::FRAC_PI_2);
    let looked_up = middle * ours * Mat3::from_quat(frame.turn.inverse()) * ours.transpose();
    let (z, y, x) = Quat::from_mat3(&looked_up).to_euler(EulerRot::ZYX);
    [x, y, z]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::light::tests::lit;
    use crate::media::tests::media;
    use crate::shot::tests::shot;
    use light::conventions::Tool;
    use light::weights::rotation as turned;

    #[test]
    fn a_yaw_is_the_value_that_the_window_shows_for_blender() {
        for yaw_deg in [-170.0, -90.0, 0.0, 30.0, 179.0, 400.0] {
            let frame = FrameLight {
                yaw_deg,
                turn: turned(yaw_deg, 0.0, 0.0),
                strength: [1.0; 3],
                lamps: vec![],
                placed: vec![],
            };
            let [x, y, z] = rotation(&frame).map(f32::to_degrees);
            let apart = (z - Tool::Blender.value_of_yaw(yaw_deg)).rem_euclid(360.0);
            assert!(apart.min(360.0 - apart) < 1e-3 && x.abs() < 1e-3 && y.abs() < 1e-3);
        }
    }

    #[test]
    fn a_tilted_panorama_shows_what_ours_shows() {
        for (yaw, pitch, roll) in [(20.0, 35.0, 0.0), (-130.0, -10.0, 50.0), (0.0, 0.0, 80.0)] {
            let turn = turned(yaw, pitch, roll);
            let frame = FrameLight { yaw_deg: yaw, turn, strength: [1.0; 3], lamps: vec![], placed: vec![] };
            let [x, y, z] = rotation(&frame);
            // Blender's Euler XYZ: X first.
            let node = Mat3::from_rotation_z(z) * Mat3::from_rotation_y(y) * Mat3::from_rotation_x(x);
            for d in [Vec3::X, Vec3::Y, Vec3::NEG_Z, Vec3::new(0.6, -0.64, 0.48)] {
                let ours = light::latlong::uv_from_direction(turn.inverse() * d);
                let v = node * in_blender(d);
                // The shader's mapping, as in `light::conventions`.
                let theirs = (
                    -v.y.atan2(v.x) / std::f32::consts::TAU + 0.5,
                    0.5 - v.z.atan2(v.x.hypot(v.y)) / std::f32::consts::PI,
                );
                let apart = (ours.0 - theirs.0 + 0.5).rem_euclid(1.0) - 0.5;
                // At a pole every column is the same point.
                let at_pole = (turn.inverse() * d).y.abs() > 0.999;
                assert!(at_pole || apart.abs() < 1e-4, "{d}: {ours:?} {theirs:?}");
                assert!((ours.1 - theirs.1).abs() < 1e-4, "{d}: {ours:?} {theirs:?}");
            }
        }
    }

    #[test]
    fn what_blender_would_not_find_is_refused() {
        let said = |to: &str, last, place| {
            let checked = check(&media(to), (0, last), place);
            checked.map_or_else(|e| e.for_terminal(), |()| String::new())
        };
        assert_eq!(said("a1/shot2.%04d.exr", 99, LayerFiles::Channels), "");
        assert!(said("shot.%04d.v2.exr", 99, LayerFiles::Files).contains("number last"));
        assert!(said("shot%04d.exr", 7, LayerFiles::Files).contains("dot before it"));
        assert_eq!(said("shot%04d.exr", 7, LayerFiles::Channels), "");
        assert_eq!(said("shot_%04d.exr", 7, LayerFiles::Files), "");
        assert!(said("shot.%04d.exr", 4_320_000, LayerFiles::Files).contains("--frames"));
        assert!(said("shot.%04d.exr", 9, LayerFiles::Parts).contains("channels"));
        let below = check(&media("shot.%04d.exr"), (-1, 9), LayerFiles::Channels).unwrap_err();
        assert!(below.to_string().contains("the numbers -1 to 9"), "{below}");
    }

    #[test]
    fn a_light_that_moves_has_a_value_for_each_frame_and_one_that_stays_has_one() {
        let layers = Layers {
            lamps: vec![],
            rest: None,
            place: LayerFiles::Channels,
            alpha: ExrAlpha::Straight,
            size: (64, 48),
        };
        let light = lit();
        let shot = shot("shot.%04d.exr");
        let Media::Stills(stills) = &shot.media else {
            panic!("{:?}", shot.media);
        };
        let numbers = Numbers::new(&shot, &layers, &light, stills);
        let [moves, stays] = &numbers.placed[..] else {
            panic!("{} lights", numbers.placed.len());
        };
        assert_eq!((moves.name, stays.name), ("Light 1", "Point"));
        let near = |a: &[f32], b: &[f32]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-4);
        // From camera-left past the back of the stage to camera-right, and up.
        let up = 20f32.to_radians();
        assert_eq!(moves.direction.len(), 5);
        assert!(near(&moves.direction[0], &[-1.0, 0.0, 0.0]));
        assert!(near(&moves.direction[2], &[0.0, up.cos(), up.sin()]));
        let degrees = [10.0f32, 20.0, 30.0, 40.0, 50.0];
        assert!(near(&moves.angle, &degrees.map(f32::to_radians)));
        assert_eq!(moves.angle.len(), 5);
        // Twice the intensity, and a stop brighter with each frame.
        let red: Vec<f32> = moves.light.iter().map(|light| light[0]).collect();
        assert!(near(&red, &[2.0, 8.0, 24.0, 64.0, 160.0]) && red.len() == 5);
        // At the camera.
        assert_eq!((stays.direction.len(), &stays.angle[..]), (1, &[0.0][..]));
        assert!(near(&stays.direction[0], &[0.0, -1.0, 0.0]));
        assert_eq!(stays.light.len(), 5, "the exposure changes");
    }

    #[test]
    fn the_script_has_a_place_for_the_numbers() {
        assert_eq!(SCRIPT.matches(PLACE).count(), 1);
    }
}
