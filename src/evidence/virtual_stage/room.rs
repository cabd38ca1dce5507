//! The room around the stage: its reflection of the lamps, and its own light.

use super::camera;
use chacha20::ChaCha8Rng;
use glam::Vec3;
use imaging::{Image, Raster};
use light::built_in::pattern::{noise, ramp, wall};
use light::latlong::{texel_direction, uv_from_direction};
use rand::RngExt;

/// Columns of the panoramas.
const WIDTH: usize = 256;

/// A room with walls of different colours, as panoramas.
pub struct Room {
    /// Diffuse reflectance in each direction.
    pub reflectance: Image,
    /// Emitted light, with a mean radiance of 1: lamps elsewhere and a doorway, on the walls' colours.
    pub glow: Image,
}

impl Room {
    /// A random room.
    pub fn draw(random: &mut ChaCha8Rng) -> Self {
        let mut within = |low: f32, high: f32| random.random_range(low..high);
        let low = Vec3::new(-within(2.0, 4.0), -within(1.1, 1.4), -within(2.5, 5.0));
        let high = Vec3::new(within(2.0, 4.0), within(1.2, 2.5), within(4.2, 6.0));
        let mut paint = |low: f32, high: f32| {
            let level = within(low, high);
            Vec3::new(level * within(0.9, 1.15), level, level * within(0.75, 1.1))
        };
        let walls = [paint(0.1, 0.7), paint(0.1, 0.7), paint(0.1, 0.5), paint(0.1, 0.5)];
        let (floor, ceiling) = (paint(0.1, 0.4), paint(0.4, 0.8));
        let reflect = |direction: Vec3| {
            let (place, axis) = wall(direction, low, high);
            let ahead = direction.to_array()[axis] > 0.0;
            let colour = match (axis, ahead) {
                (1, true) => ceiling,
                (1, false) => floor,
                (0, side) => walls[usize::from(side)],
                (_, side) => walls[2 + usize::from(side)],
            };
            // Furniture and shadows below, smooth walls above.
            let clutter = ramp(0.3, -0.6, place.y) * (0.45 * noise(place * 2.3) + 0.25 * noise(place * 7.0));
            colour * (1.0 + 0.06 * noise(place * 3.0) + clutter).max(0.05)
        };
        // A doorway or a screen on one side, and lamps on the ceiling.
        let (azimuth, doorway) = (within(0.0, std::f32::consts::TAU), within(2.0, 15.0));
        let door = Vec3::new(azimuth.sin(), 0.0, azimuth.cos());
        let spot = Vec3::new(within(-0.5, 0.5), 1.0, within(-0.5, 0.5)).normalize();
        let (bright, from_above) = (within(0.0, 20.0), within(0.0, 1.0));
        let glow = |direction: Vec3| {
            let flat = Vec3::new(direction.x, 0.0, direction.z).normalize_or(Vec3::Z);
            let in_door = ramp(0.96, 0.985, flat.dot(door)) * ramp(0.45, 0.35, direction.y.abs());
            let lamp = ramp(0.975, 0.99, direction.dot(spot));
            let falling = 1.0 + from_above * direction.y;
            reflect(direction) * falling
                + Vec3::new(0.7, 0.85, 1.0) * (in_door * doorway)
                + Vec3::new(1.0, 0.85, 0.65) * (lamp * bright)
        };
        Self { reflectance: panorama(reflect), glow: normalized(panorama(glow)) }
    }
}

/// Reflection of photographer and camera in the ball: the reflectance of a dark suit, a face and hands, in directions
/// from the ball; `None` elsewhere.
pub fn photographer(direction: Vec3) -> Option<Vec3> {
    if direction.z <= 0.0 {
        return None;
    }
    let place = direction * (camera::POSITION.z / direction.z);
    let side = place.x + 0.28;
    let head = Vec3::new(side, (place.y - 0.12) * 0.8, 0.0).length() < 0.11;
    let trunk = side.abs() < 0.24 - 0.1 * ramp(-0.15, -0.02, place.y) && place.y < -0.02;
    let lens = place.x.hypot(place.y) < 0.07;
    let tripod = place.x.abs() < 0.02 + 0.25 * (-place.y).max(0.0)
        && place.x.abs() > 0.2 * (-place.y).max(0.0) - 0.02
        && place.y < 0.0;
    if lens || tripod {
        return Some(Vec3::splat(0.02));
    }
    if head {
        return Some(Vec3::new(0.35, 0.22, 0.16));
    }
    (trunk && place.y > -1.2).then_some(Vec3::new(0.05, 0.05, 0.06))
}

/// Colour of a panorama in a direction, without interpolation.
pub fn seen(panorama: &Image, direction: Vec3) -> Vec3 {
    let (u, v) = uv_from_direction(direction);
    let x = ((u * panorama.width as f32) as usize).min(panorama.width - 1);
    let y = ((v * panorama.height as f32) as usize).min(panorama.height - 1);
    Vec3::from(panorama.at(x, y))
}

fn panorama(radiance: impl Fn(Vec3) -> Vec3) -> Image {
    Raster::from_fn(WIDTH, WIDTH / 2, |x, y| radiance(texel_direction(x, y, WIDTH, WIDTH / 2)).to_array())
}

/// The panorama scaled to a mean radiance of 1 over sphere and channels.
fn normalized(image: Image) -> Image {
    let mean = mean_radiance(&image);
    let factor = 3.0 / (mean.x + mean.y + mean.z).max(f32::MIN_POSITIVE);
    image.map(|pixel| pixel.map(|v| v * factor))
}

/// Mean radiance over the sphere.
pub fn mean_radiance(image: &Image) -> Vec3 {
    let mut sum = glam::DVec3::ZERO;
    for (i, pixel) in image.pixels.iter().enumerate() {
        let share = light::latlong::texel_solid_angle(i / image.width, image.width, image.height);
        sum += Vec3::from(*pixel).as_dvec3() * share;
    }
    (sum / (4.0 * std::f64::consts::PI)).as_vec3()
}
