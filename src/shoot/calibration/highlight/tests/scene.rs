//! A synthetic series of photographs of a mirror ball, with a room, reflecting objects, scratches, dust, a
//! photographer, noise, clipping and JPEG.

use super::far;
use glam::{DVec2, DVec3, Vec3};
use image::codecs::jpeg::JpegEncoder;
use imaging::{Encoded, Image, Raster};
use project::Ball;
use rayon::prelude::*;

/// Random numbers (SplitMix64, Steele and others 2014).
pub(super) struct Draw(pub u64);

impl Draw {
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Log-uniform draw.
    pub fn factor(&mut self, low: f64, high: f64) -> f64 {
        self.between(low.ln(), high.ln()).exp()
    }

    pub fn chance(&mut self, p: f64) -> bool {
        self.unit() < p
    }

    pub fn normal(&mut self) -> f64 {
        let r = (-2.0 * (1.0 - self.unit()).ln()).sqrt();
        r * (std::f64::consts::TAU * self.unit()).cos()
    }

    /// A direction with z between `low` and `high`.
    pub fn direction(&mut self, low: f64, high: f64) -> DVec3 {
        let z = self.between(low, high);
        let (sin, cos) = self.between(0.0, std::f64::consts::TAU).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, r * sin, z)
    }

    /// A direction at an angle of `radians` to another.
    fn beside(&mut self, from: DVec3, radians: f64) -> DVec3 {
        let side = from.any_orthonormal_vector();
        let (sin, cos) = self.between(0.0, std::f64::consts::TAU).sin_cos();
        radians.cos() * from + radians.sin() * (cos * side + sin * from.cross(side))
    }
}

/// A luminous shape: its direction, half width in radians, and radiance.
#[derive(Clone, Copy)]
enum Shine {
    /// A disc.
    Disc(DVec3, f64),
    /// A square.
    Square(DVec3, f64),
}

impl Shine {
    fn covers(&self, d: DVec3) -> bool {
        match *self {
            Self::Disc(at, radius) => d.dot(at) > radius.cos(),
            Self::Square(at, half) => {
                let up = at.any_orthonormal_vector();
                let along = d.dot(at);
                along > 0.0
                    && (d.dot(up) / along).abs() < half.tan()
                    && (d.dot(up.cross(at)) / along).abs() < half.tan()
            }
        }
    }

    /// Approximate solid angle in steradians.
    fn solid_angle(&self) -> f64 {
        match *self {
            Self::Disc(_, radius) => std::f64::consts::PI * radius * radius,
            Self::Square(_, half) => 4.0 * half * half,
        }
    }
}

/// A series of photographs with ground truth.
pub(super) struct Scene {
    pub series: Vec<Encoded>,
    /// The detected circle, slightly wrong.
    pub ball: Ball,
    /// Directions of the lamps; `None` if a lamp was off.
    pub lamps: Vec<Option<Vec3>>,
}

impl Scene {
    /// A random scene from a seed, on a ball with a radius in pixels within a range.
    pub fn sized(seed: u64, radius: (f64, f64)) -> Self {
        Self::with(seed, radius, false)
    }

    /// A random scene whose lamps are banks of four lamps far apart.
    pub fn with_wide_banks(seed: u64, radius: (f64, f64)) -> Self {
        Self::with(seed, radius, true)
    }

    fn with(seed: u64, (least, most): (f64, f64), wide_banks: bool) -> Self {
        let mut draw = Draw(seed.wrapping_mul(0x2545_F491_4F6C_DD1D) ^ 77);
        let radius = draw.factor(least, most);
        // A pixel averages its light: small balls need more rays per pixel.
        let rays = ((120.0 / radius).ceil() as usize).max(3);
        let size = (2.3 * radius) as usize;
        let centre = [0, 1].map(|_| 0.5 * size as f64 + draw.between(-3.0, 3.0));
        let count = 3 + (draw.unit() * 16.0) as usize;
        // Lamps all around, or only in front.
        let lowest = if draw.chance(0.5) { -1.0 } else { 0.5 };
        let kind = draw.unit();
        let lamps: Vec<(DVec3, Vec<Shine>)> = (0..count)
            .map(|_| {
                let at = draw.direction(lowest, 1.0);
                if wide_banks {
                    return wide_bank(at, &mut draw);
                }
                let shines = if kind < 0.5 {
                    vec![Shine::Disc(at, draw.factor(0.01, 0.06))]
                } else if kind < 0.75 {
                    vec![Shine::Square(at, draw.factor(0.06, 0.3))]
                } else {
                    bank(at, draw.between(0.06, 0.12))
                };
                (at, shines)
            })
            .collect();
        let exposure = draw.factor(0.2, 200.0);
        let warm = [1.0, draw.between(0.6, 1.0), draw.between(0.3, 1.0)];
        // The room: windows and bulbs that are always on.
        let room: Vec<(Shine, f64)> = (0..(draw.unit() * 5.0) as usize)
            .map(|_| {
                let at = draw.direction(-0.8, 0.9);
                let width = draw.factor(0.02, 0.3);
                let radiance = draw.factor(0.01, 3.0);
                if draw.chance(0.5) { (Shine::Disc(at, width), radiance) } else { (Shine::Square(at, width), radiance) }
            })
            .collect();
        let ambient = draw.factor(1e-4, 0.03);
        // Lit objects: walls, a table, the subject, the photographer.
        let things: Vec<(Shine, f64)> = (0..(draw.unit() * 5.0) as usize)
            .map(|_| {
                let thing = Shine::Disc(draw.direction(-0.9, 0.95), draw.factor(0.05, 0.4));
                (thing, draw.between(0.05, 0.8))
            })
            .collect();
        let mut photographer = DVec3::Z;
        // Another ball shows each lamp's glint at nearly the same place.
        let glint = draw.chance(0.6).then(|| draw.direction(-0.5, 0.5));
        let (halo, streak) = (draw.factor(1e-4, 1e-2), draw.factor(1e-5, 2e-2));
        let (scratch, streak_width) = (draw.between(-0.5, 0.5), draw.between(0.01, 0.06));
        let dust: Vec<(usize, f64)> = (0..(draw.unit() * 200.0) as usize)
            .map(|_| ((draw.unit() * (size * size) as f64) as usize, draw.factor(1e-3, 0.1)))
            .collect();
        let noise = draw.between(0.0, 2.0);
        let jpeg = draw.chance(0.6).then(|| draw.between(60.0, 96.0) as u8);
        let off_chance = if draw.chance(0.3) { 0.2 } else { 0.0 };
        let mut truth = Vec::new();
        let mut series = Vec::new();
        for (at, shines) in &lamps {
            let is_on = !draw.chance(off_chance);
            truth.push(is_on.then(|| at.as_vec3()));
            photographer = (photographer + 0.3 * draw.direction(-1.0, 1.0)).normalize();
            let photographer = Shine::Disc(photographer.with_z(photographer.z.abs() + 1.0).normalize(), 0.25);
            let flux: f64 = shines.iter().map(Shine::solid_angle).sum();
            let power = if is_on { exposure * draw.factor(0.5, 2.0) } else { 0.0 };
            let glint = glint.map(|at| Shine::Disc(draw.beside(at, 0.01), 0.015));
            let glint_power = draw.factor(0.02, 0.3);
            let lit: Vec<f64> = things
                .iter()
                .map(|(thing, albedo)| {
                    let (Shine::Disc(to, _) | Shine::Square(to, _)) = *thing;
                    // It faces the ball, and the lamp's light arrives at some angle.
                    albedo * power * flux / std::f64::consts::PI * (0.6 - 0.4 * at.dot(to)).max(0.0)
                })
                .collect();
            // A lamp behind the ball also lights the room, and all of it a little.
            let stray = 0.02 * power * flux / std::f64::consts::PI;
            let ball_place = |d: DVec3| {
                let half = (d + DVec3::Z).normalize_or(DVec3::X);
                DVec2::new(centre[0] + radius * half.x, centre[1] - radius * half.y)
            };
            let glow = ball_place(*at);
            let radiance = |x: f64, y: f64| -> f64 {
                let (dx, dy) = ((x - centre[0]) / radius, (centre[1] - y) / radius);
                let flat = dx * dx + dy * dy;
                if flat >= 1.0 {
                    return 0.3 * (ambient + stray);
                }
                let n = DVec3::new(dx, dy, (1.0 - flat).sqrt());
                let d = 2.0 * n.z * n - DVec3::Z;
                let mut sum = ambient * (1.3 + d.y) + stray;
                if photographer.covers(d) {
                    sum *= 0.3;
                }
                sum += room.iter().filter(|(shine, _)| shine.covers(d)).map(|(_, r)| r).sum::<f64>();
                let seen = things.iter().zip(&lit).filter(|((thing, _), _)| thing.covers(d));
                sum += seen.map(|(_, light)| light).sum::<f64>();
                if glint.is_some_and(|glint| glint.covers(d)) {
                    sum += glint_power * power;
                }
                if shines.iter().any(|shine| shine.covers(d)) {
                    sum += power;
                }
                // Glare of the lens and of scratches, around the lamp's place if the ball shows it.
                if at.z > -0.97 {
                    let from = (DVec2::new(x, y) - glow) / radius;
                    let size = (flux / std::f64::consts::PI).sqrt();
                    sum += halo * power * size * size / (from.length_squared() + 0.02 * size + 1e-3);
                    let across = from.x + scratch * from.y + 0.5 * from.y * from.y;
                    let along = (-0.5 * (from.y / 0.35).powi(2)).exp();
                    sum += streak * power * along * (-0.5 * (across / streak_width).powi(2)).exp();
                }
                sum
            };
            let sharp: Vec<f64> = (0..size * size)
                .into_par_iter()
                .map(|i| {
                    let at = |p: usize, sub: usize| p as f64 + (sub as f64 + 0.5) / rays as f64;
                    let light = (0..rays * rays).map(|s| radiance(at(i % size, s % rays), at(i / size, s / rays)));
                    light.sum::<f64>() / (rays * rays) as f64
                })
                .collect();
            let mut light = blurred(&sharp, size);
            for (place, strength) in &dust {
                light[*place] += strength * power * flux;
            }
            let noisy: Vec<[f32; 3]> = light
                .iter()
                .map(|l| {
                    warm.map(|w| {
                        let code = (l * w).clamp(0.0, 1.0).powf(1.0 / 2.2);
                        ((code + noise * draw.normal() / 255.0).clamp(0.0, 1.0) * 255.0).round() as f32 / 255.0
                    })
                })
                .collect();
            let picture = Image { width: size, height: size, pixels: noisy };
            series.push(match jpeg {
                Some(quality) => through_jpeg(&picture, quality),
                None => Encoded(picture),
            });
        }
        let off = 0.2 + 0.002 * radius;
        let ball = far(centre.map(|c| (c + off * draw.normal()) as f32), (radius + off * draw.normal()) as f32);
        Self { series, ball, lamps: truth }
    }
}

/// Lamps on a small lattice.
fn bank(at: DVec3, spacing: f64) -> Vec<Shine> {
    let right = at.any_orthonormal_vector();
    let up = at.cross(right);
    let places = (-2..=2).flat_map(|i| (-1..=1).map(move |j| (f64::from(i), f64::from(j))));
    places
        .map(|(i, j)| {
            let to = at + spacing * (i * right + j * up);
            Shine::Disc(to.normalize(), 0.02)
        })
        .collect()
}

/// Four lamps, each 10 to 20 degrees from the middle, and their mean direction.
fn wide_bank(at: DVec3, draw: &mut Draw) -> (DVec3, Vec<Shine>) {
    let right = at.any_orthonormal_vector();
    let up = at.cross(right);
    let lamps = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)].map(|(x, y)| {
        let far = draw.between(0.18, 0.36);
        (at + far * (x * right + y * up)).normalize()
    });
    let mean = lamps.iter().sum::<DVec3>().normalize();
    (mean, lamps.map(|lamp| Shine::Disc(lamp, 0.03)).to_vec())
}

/// The lens: a three-pixel binomial blur.
fn blurred(light: &[f64], size: usize) -> Vec<f64> {
    let near = |i: usize, by: isize| (i as isize + by).clamp(0, size as isize - 1) as usize;
    let pass = |light: &[f64], dx: isize, dy: isize| -> Vec<f64> {
        (0..size * size)
            .map(|i| {
                let (x, y) = (i % size, i / size);
                let at = |by: isize| light[near(y, dy * by) * size + near(x, dx * by)];
                0.25 * at(-1) + 0.5 * at(0) + 0.25 * at(1)
            })
            .collect()
    };
    pass(&pass(light, 1, 0), 0, 1)
}

/// The picture after JPEG compression.
pub(super) fn through_jpeg(picture: &Image, quality: u8) -> Encoded {
    let bytes: Vec<u8> = (picture.pixels.iter().flatten()).map(|v| (v * 255.0).round() as u8).collect();
    let mut file = Vec::new();
    let (width, height) = (picture.width as u32, picture.height as u32);
    JpegEncoder::new_with_quality(&mut file, quality)
        .encode(&bytes, width, height, image::ExtendedColorType::Rgb8)
        .unwrap();
    let read = image::load_from_memory_with_format(&file, image::ImageFormat::Jpeg).unwrap();
    Encoded(Raster {
        width: picture.width,
        height: picture.height,
        pixels: (read.to_rgb8().pixels()).map(|p| p.0.map(|v| f32::from(v) / 255.0)).collect(),
    })
}
