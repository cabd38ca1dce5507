//! Studios: softboxes in a room whose walls, paper and floor show the light they receive.
//!
//! Energies are those at the subject: at π, white facing a box has radiance 1.

use super::panorama::panorama;
use super::pattern::{noise, ramp, wall};
use crate::patch::{Outline, Patch};
use crate::white;
use glam::Vec3;
use imaging::Image;
use std::f32::consts::PI;

/// A softbox facing the subject.
struct Softbox {
    /// Azimuth and elevation of its middle in degrees: 0 is behind the subject, ±180 at the camera.
    at: (f32, f32),
    /// Half width and half height in degrees.
    half: (f32, f32),
    kelvin: f32,
    /// Luminance of ∫ L dω.
    energy: f32,
}

/// Materials and lights of the room.
struct Room {
    walls: Vec3,
    /// The paper roll behind the subject.
    paper: Vec3,
    /// Light on the paper from its own lamp, as the radiance of white.
    glow: f32,
}

/// Half the room's width, its floor, its ceiling, and its depth behind and in front of the subject in metres.
const LOW: Vec3 = Vec3::new(-4.0, -1.4, -3.2);
const HIGH: Vec3 = Vec3::new(4.0, 2.6, 4.5);
/// Distance from the subject to a box in metres.
const DISTANCE: f32 = 1.8;

/// A warm key, a neutral fill at a quarter of it, and a rim.
pub fn three_point(width: usize) -> Image {
    let room = Room { walls: Vec3::splat(0.10), paper: Vec3::splat(0.32), glow: 0.35 };
    let boxes = [
        Softbox { at: (-135.0, 36.0), half: (15.0, 15.0), kelvin: 4300.0, energy: PI },
        Softbox { at: (138.0, 14.0), half: (19.0, 19.0), kelvin: 6504.0, energy: 0.25 * PI },
        Softbox { at: (42.0, 42.0), half: (5.0, 13.0), kelvin: 6504.0, energy: 0.6 * PI },
    ];
    studio(width, &room, &boxes)
}

/// A large box above the camera, a weaker one below, and bright paper.
pub fn clamshell(width: usize) -> Image {
    let room = Room { walls: Vec3::splat(0.30), paper: Vec3::splat(0.75), glow: 0.8 };
    let boxes = [
        Softbox { at: (180.0, 42.0), half: (22.0, 12.0), kelvin: 6000.0, energy: PI },
        Softbox { at: (180.0, -38.0), half: (22.0, 9.0), kelvin: 6000.0, energy: 0.45 * PI },
    ];
    studio(width, &room, &boxes)
}

/// One tall box from the side and a cool edge from behind, in a black room.
pub fn side_light(width: usize) -> Image {
    let room = Room { walls: Vec3::splat(0.025), paper: Vec3::new(0.05, 0.055, 0.065), glow: 0.12 };
    let boxes = [
        Softbox { at: (-98.0, 18.0), half: (8.0, 19.0), kelvin: 5000.0, energy: PI },
        Softbox { at: (50.0, 26.0), half: (3.5, 16.0), kelvin: 8000.0, energy: 0.5 * PI },
    ];
    studio(width, &room, &boxes)
}

fn studio(width: usize, room: &Room, boxes: &[Softbox]) -> Image {
    let lamps: Vec<Lamp> = boxes.iter().map(Softbox::lamp).collect();
    let mut image = panorama(width, |direction| room.radiance(direction, &lamps));
    for (softbox, lamp) in boxes.iter().zip(&lamps) {
        let radians = |degrees: f32| f64::from(degrees).to_radians();
        let (half_width, half_height) = softbox.half;
        let mut add = |outline, softness, share: f64| {
            let patch = Patch { azimuth: radians(softbox.at.0), elevation: radians(softbox.at.1), outline, softness };
            let energy = lamp.light.to_array().map(|v| share * f64::from(v));
            patch.add(&mut image, energy);
        };
        let cloth = Outline::Rectangle(radians(half_width), radians(half_height));
        // A sixth of the light is the bulb's glow, brightest in the middle of the cloth.
        add(cloth, 0.06, 5.0 / 6.0);
        add(cloth, 1.0, 1.0 / 6.0);
    }
    image
}

/// A softbox as seen from the room.
struct Lamp {
    /// Unit direction from the subject to it.
    axis: Vec3,
    /// ∫ L dω at the subject.
    light: Vec3,
}

impl Softbox {
    fn lamp(&self) -> Lamp {
        let (sin_yaw, cos_yaw) = self.at.0.to_radians().sin_cos();
        let (sin_up, cos_up) = self.at.1.to_radians().sin_cos();
        Lamp {
            axis: Vec3::new(cos_up * sin_yaw, sin_up, -cos_up * cos_yaw),
            light: Vec3::from(white::gains(self.kelvin, 0.0)) * self.energy,
        }
    }
}

impl Lamp {
    /// Irradiance at a place of the room with a normal. A box throws its light forward, by cos³ of the angle from
    /// its axis.
    fn irradiance(&self, place: Vec3, normal: Vec3) -> Vec3 {
        let away = self.axis * DISTANCE - place;
        let square = away.length_squared().max(0.3);
        let towards = away / square.sqrt();
        let ahead = self.axis.dot(towards).max(0.0).powi(3);
        self.light * (ahead * normal.dot(towards).max(0.0) * DISTANCE * DISTANCE / square)
    }
}

impl Room {
    fn radiance(&self, direction: Vec3, lamps: &[Lamp]) -> Vec3 {
        let (p, axis) = wall(direction, LOW, HIGH);
        let mut normal = [Vec3::X, Vec3::Y, Vec3::Z][axis];
        if p.to_array()[axis] > 0.0 {
            normal = -normal;
        }
        // The paper hangs on the wall behind the subject and sweeps seamlessly over the floor.
        let across = 1.0 - ramp(2.25, 2.28, p.x.abs());
        let on_paper = match axis {
            2 if p.z < 0.0 => across * (1.0 - ramp(2.3, 2.34, p.y)),
            1 if p.y < 0.0 => across * (1.0 - ramp(0.2, 0.24, p.z)),
            _ => 0.0,
        };
        if on_paper > 0.0 && (axis == 2 || p.z < 0.0) {
            let bend = if axis == 2 { LOW.y + 0.9 - p.y } else { LOW.z + 0.9 - p.z }.max(0.0) / 0.9;
            let other = if axis == 2 { Vec3::Y } else { Vec3::Z };
            normal = normal.lerp(other, 0.5 * bend * bend).normalize();
        }
        let floor = if axis == 1 && p.y < 0.0 { 1.6 } else { 1.0 };
        let grain = 1.0 + 0.06 * noise(p * 2.3) + 0.04 * noise(p * 9.0);
        let albedo = (self.walls * (floor * grain)).lerp(self.paper, on_paper);
        let light: Vec3 = lamps.iter().map(|lamp| lamp.irradiance(p, normal)).sum();
        let ambient: Vec3 = lamps.iter().map(|lamp| lamp.light).sum::<Vec3>() * 0.04;
        let spot = Vec3::new(p.x, p.y - 0.1, 0.5 * (p.z - LOW.z));
        let glow = self.glow * (-spot.length_squared() / 2.2).exp();
        albedo * ((light + ambient) / PI) + Vec3::splat(glow * on_paper) * self.paper
    }
}
