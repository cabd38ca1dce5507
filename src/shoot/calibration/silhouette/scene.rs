//! Rendered photographs of mirror balls for tests: a perspective mirror sphere in an environment that the camera
//! also sees around the ball.

use super::Circle;
use glam::{DVec2, DVec3};
use imaging::{Encoded, Raster};

/// Surroundings of the ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Surroundings {
    /// Black surroundings.
    Dark,
    /// A room: walls, windows, furniture, a horizon.
    Room,
    /// A room, with rectangles and discs in front of it, beside and partly behind the ball.
    Clutter,
}

/// A photograph of a mirror ball to render.
#[derive(Clone, Copy, Debug)]
pub struct Scene {
    pub size: (usize, usize),
    pub ball: Option<Circle>,
    pub around: Surroundings,
    /// True for a pole under the ball.
    pub pole: bool,
    /// Direction of a lamp far brighter than white, if any: visible on the ball, shaded from the camera.
    pub lamp: Option<DVec3>,
    /// Ambient light, so that the ball is not black.
    pub ambient: f64,
    /// Factor on all light.
    pub exposure: f64,
    /// Standard deviation of the noise in encoded values.
    pub noise: f64,
    pub seed: u64,
}

/// Deterministic random number in [0, 1) (splitmix64).
pub fn random(seed: u64, index: u64) -> f64 {
    let mut z = seed.wrapping_add(index.wrapping_mul(0x9e37_79b9_7f4a_7c15)).wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// Ratio of the ball's radius to the camera's distance.
const NEARNESS: f64 = 0.03;
const REFLECTIVITY: [f64; 3] = [0.62, 0.6, 0.56];

impl Scene {
    /// Renders the photograph: 8 bits, encoded with a power of 2.2.
    pub fn photograph(&self) -> Encoded {
        let (width, height) = self.size;
        let mut picture = Raster::from_fn(width, height, |x, y| {
            let corner = DVec2::new(x as f64, y as f64);
            // Sixty-four rays at the rim, four elsewhere.
            let is_rim = self.ball.is_some_and(|b| b.distance(corner + 0.5).abs() < 1.5);
            let n = if is_rim { 8 } else { 2 };
            let mut sum = DVec3::ZERO;
            for i in 0..n * n {
                let sub = DVec2::new((i % n) as f64 + 0.5, (i / n) as f64 + 0.5) / f64::from(n);
                sum += self.light(corner + sub).min(DVec3::splat(50.0));
            }
            sum / f64::from(n * n) * self.exposure
        });
        self.add_glare(&mut picture);
        let mut index = 0;
        Encoded(picture.map(|light| {
            light.to_array().map(|l| {
                index += 2;
                let gaussian = (-2.0 * (1.0 - random(self.seed, index)).ln()).sqrt()
                    * (std::f64::consts::TAU * random(self.seed, index + 1)).cos();
                let code = l.max(0.0).powf(1.0 / 2.2) + self.noise * gaussian;
                ((code.clamp(0.0, 1.0) * 255.0).round() / 255.0) as f32
            })
        }))
    }

    /// Glare: a thousandth of the light above white, spread with the inverse square of the distance.
    fn add_glare(&self, picture: &mut Raster<DVec3>) {
        let bright: Vec<(DVec2, DVec3)> = (0..picture.pixels.len())
            .filter(|&i| picture.pixels[i].max_element() > 4.0)
            .map(|i| (DVec2::new((i % picture.width) as f64, (i / picture.width) as f64), picture.pixels[i]))
            .collect();
        let step = bright.len().div_ceil(24).max(1);
        let width = picture.width;
        for (i, pixel) in picture.pixels.iter_mut().enumerate() {
            let place = DVec2::new((i % width) as f64, (i / width) as f64);
            for (lamp, light) in bright.iter().step_by(step) {
                *pixel += 1e-3 * step as f64 * *light / (1.0 + place.distance_squared(*lamp) / 4.0);
            }
        }
    }

    fn light(&self, at: DVec2) -> DVec3 {
        let ball = self.ball.unwrap_or(Circle {
            center_px: [0.5 * self.size.0 as f64, 0.5 * self.size.1 as f64],
            radius_px: 0.3 * self.size.0 as f64,
        });
        // In units of the ball's radius; rays through the silhouette touch the ball.
        let distance = 1.0 / NEARNESS;
        let slope = NEARNESS.asin().tan();
        let off = (at - ball.center()) / ball.radius_px * slope;
        let ray = DVec3::new(off.x, -off.y, -1.0).normalize();
        let camera = DVec3::Z * distance;
        let along = camera.dot(ray);
        let inside = along * along - distance * distance + 1.0;
        if self.ball.is_some() && inside > 0.0 {
            let hit = camera - ray * (along + inside.sqrt());
            let mirrored = ray.reflect(hit);
            let is_lamp = self.lamp.is_some_and(|lamp| mirrored.dot(lamp) > 0.996);
            let lamp = DVec3::new(40.0, 38.0, 34.0) * f64::from(is_lamp);
            return DVec3::from(REFLECTIVITY) * (lamp + self.environment(mirrored));
        }
        let u = off / slope;
        if self.pole && u.y > 0.0 && u.x.abs() < 0.12 {
            return DVec3::splat(0.08 + 0.1 * (20.0 * u.x).sin().abs());
        }
        if self.around == Surroundings::Dark {
            return DVec3::ZERO;
        }
        if self.around == Surroundings::Clutter {
            for thing in 0..14u64 {
                let r = |k: u64| random(self.seed, 1000 + 10 * thing + k);
                let (x, y) = (r(0) * self.size.0 as f64, r(1) * self.size.1 as f64);
                let scale = ball.radius_px.min(0.25 * self.size.0.min(self.size.1) as f64);
                let (w, h) = ((0.1 + 0.7 * r(2)) * scale, (0.1 + 0.7 * r(3)) * scale);
                let d = (at - DVec2::new(x, y)).abs();
                let is_disc = thing % 5 == 0;
                let hit = if is_disc { d.length() < 0.6 * w } else { d.x < w && d.y < h };
                if hit {
                    return DVec3::new(r(4), r(5), r(6)).powf(2.2) * 0.9;
                }
            }
        }
        self.environment(ray)
    }

    /// Light from a direction.
    fn environment(&self, d: DVec3) -> DVec3 {
        let mut light = DVec3::splat(self.ambient);
        if self.around == Surroundings::Dark {
            return light;
        }
        let r = |k: u64| random(self.seed, 500 + k);
        // Walls with brightness by height, a floor, windows and furniture in panels.
        let wall = 0.06 + 0.25 * r(0) + 0.1 * d.y;
        light += wall * DVec3::new(0.8 + 0.4 * r(1), 0.8 + 0.4 * r(2), 0.8 + 0.4 * r(3));
        if d.y < -0.35 {
            light = DVec3::splat(self.ambient + 0.03 + 0.2 * r(4));
        }
        let (azimuth, height) = (d.x.atan2(d.z), d.y);
        for panel in 0..7u64 {
            let p = |k: u64| random(self.seed, 600 + 10 * panel + k);
            let turn = (azimuth - std::f64::consts::TAU * p(0)).sin().abs();
            if turn < 0.1 + 0.2 * p(1) && (height - 1.4 * (p(2) - 0.5)).abs() < 0.1 + 0.2 * p(3) && azimuth.cos() > -0.8
            {
                light = DVec3::splat(self.ambient) + DVec3::new(p(4), p(5), p(6)) * if panel < 2 { 3.0 } else { 0.6 };
            }
        }
        light
    }
}
