//! Reflections in a mirror ball other than the stage's lamps: the interview's own lamps, the room, the photographer,
//! and dust.

use super::ball::{BALL_RADIUS_M, BallLight, reflect};
use super::dome::Dome;
use super::interview_light::InterviewLight;
use super::room::{self, Room};
use super::shape::{noise, ramp};
use super::trouble::Trouble;
use glam::Vec3;
use rayon::prelude::*;
use std::f32::consts::PI;

/// Share of the light that dust scatters back, out of what it blocks from the mirror.
const DUST_ALBEDO: f32 = 0.5;

/// Surroundings of the ball. The room emits light only in the interview.
pub struct Surroundings<'a> {
    pub dome: &'a Dome,
    pub light: &'a InterviewLight,
    pub room: &'a Room,
    pub trouble: &'a Trouble,
}

/// View of the surroundings in each pixel of the ball's photograph.
pub struct Around {
    pixels: Vec<Pixel>,
    /// Direction of each bank, and the solid angle of its lamps.
    banks: Vec<(Vec3, f32)>,
    /// Irradiance that dust receives from the interview's own lamps and room, per pixel.
    irradiance: Vec<Vec3>,
}

/// One pixel, weighted by the share of it that the ball covers.
#[derive(Clone, Copy, Default)]
struct Pixel {
    covered: f32,
    /// Radiance of the interview's lamps and room.
    interview: Vec3,
    /// Reflectance of the room and the photographer, and its product with the viewing direction.
    reflectance: Vec3,
    moments: [Vec3; 3],
    /// Share of the light that dust blocks.
    dust: f32,
    normal: Vec3,
}

/// Light of a bank reflected by a room, `reflectance · (1 − bank · direction) · solid angle / 4π`: walls opposite the
/// bank are lit most, and a white room under all banks is a sphere of radiance 1.
pub fn bounce(reflectance: Vec3, bank: Vec3, direction: Vec3, solid_angle: f32) -> Vec3 {
    reflectance * ((1.0 - bank.dot(direction)) * solid_angle / (4.0 * PI))
}

/// Solid angle of each bank's lamps.
pub fn bank_solid_angles(dome: &Dome) -> Vec<f32> {
    let counts = dome.bank_counts().into_iter();
    counts.map(|n| n as f32 * dome.lamp_solid_angle()).collect()
}

impl Surroundings<'_> {
    /// Traces `rays × rays` rays through each pixel of a photograph of `size × size`.
    pub fn trace(&self, size: usize, rays: usize) -> Around {
        let share = 1.0 / (rays * rays) as f32;
        let pixels: Vec<Pixel> = (0..size * size)
            .into_par_iter()
            .map(|i| {
                let mut pixel = Pixel::default();
                for sub in 0..rays * rays {
                    let dx = ((sub % rays) as f32 + 0.5) / rays as f32;
                    let dy = ((sub / rays) as f32 + 0.5) / rays as f32;
                    let ray = reflect((i % size) as f32 + dx, (i / size) as f32 + dy, size);
                    let Some((place, direction)) = ray else { continue };
                    let person = (self.trouble.photographer).then(|| room::photographer(direction)).flatten();
                    let reflectance =
                        person.unwrap_or_else(|| self.trouble.room * room::seen(&self.room.reflectance, direction));
                    pixel.covered += share;
                    pixel.interview += share * self.interview(place, direction, person.is_some());
                    pixel.reflectance += share * reflectance;
                    for (moment, along) in pixel.moments.iter_mut().zip(direction.to_array()) {
                        *moment += share * along * reflectance;
                    }
                    pixel.dust += share * self.dust(place);
                    pixel.normal += share * place / BALL_RADIUS_M;
                }
                pixel
            })
            .collect();
        let irradiance = if self.trouble.dust > 0.0 {
            pixels
                .par_iter()
                .map(|p| {
                    if p.covered > 0.0 {
                        self.light.irradiance(self.dome, p.normal.normalize_or_zero())
                    } else {
                        Vec3::ZERO
                    }
                })
                .collect()
        } else {
            vec![Vec3::ZERO; pixels.len()]
        };
        Around {
            pixels,
            banks: (self.dome.banks.iter().copied()).zip(bank_solid_angles(self.dome)).collect(),
            irradiance,
        }
    }

    /// Radiance of the interview's own lamps, or otherwise the room's, along a reflected ray.
    fn interview(&self, place: Vec3, direction: Vec3, hidden: bool) -> Vec3 {
        let nearest = (self.light.panels.iter())
            .filter_map(|panel| panel.seen(place, direction))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        match (nearest, &self.light.ambient) {
            (Some((_, radiance)), _) => Vec3::from(radiance),
            (None, Some(ambient)) if !hidden => room::seen(ambient, direction),
            _ => Vec3::ZERO,
        }
    }

    /// Share of the light that dust blocks at a place on the ball: an even film, smears, and grains.
    fn dust(&self, place: Vec3) -> f32 {
        let dust = self.trouble.dust;
        if dust == 0.0 {
            return 0.0;
        }
        let p = place / BALL_RADIUS_M;
        let film = dust * (0.7 + 0.5 * noise(p * 3.0)).max(0.0);
        // More dust is more grains, not larger ones.
        let least = 0.9 - 0.5 * dust;
        let grain = 0.7 * ramp(least, least + 0.05, noise(p * 60.0));
        (film + grain).min(0.95)
    }
}

impl Around {
    /// The photograph under `light`, from a pixel's place and the clean ball's reflection of the lamps there.
    pub fn under(&self, light: &BallLight) -> impl Fn(usize, [f32; 3]) -> [f32; 3] {
        // The room's reflection of the banks is linear in its direction, so it can be summed.
        let (mut level, mut slope) = (Vec3::ZERO, [Vec3::ZERO; 3]);
        for ((direction, solid_angle), weight) in self.banks.iter().zip(&light.banks) {
            let share = Vec3::from(*weight) * (solid_angle / (4.0 * PI));
            level += share;
            for (slope, along) in slope.iter_mut().zip(direction.to_array()) {
                *slope += share * along;
            }
        }
        let lit: Vec<(Vec3, Vec3)> = (self.banks.iter().zip(&light.banks))
            .filter(|(_, weight)| **weight != [0.0; 3])
            .map(|((direction, solid_angle), weight)| (*direction, Vec3::from(*weight) * *solid_angle))
            .collect();
        let interview = light.interview;
        move |i, mirrored| {
            let pixel = &self.pixels[i];
            let reflected =
                level * pixel.reflectance - (slope.iter().zip(&pixel.moments)).map(|(s, m)| *s * *m).sum::<Vec3>();
            let clean = Vec3::from(mirrored) + reflected + interview * pixel.interview;
            if pixel.dust == 0.0 {
                return clean.to_array();
            }
            let normal = pixel.normal.normalize_or_zero();
            let from_banks: Vec3 = (lit.iter()).map(|(direction, flux)| normal.dot(*direction).max(0.0) * *flux).sum();
            let received = from_banks + interview * self.irradiance[i];
            let dust = pixel.dust / pixel.covered.max(1e-6);
            ((1.0 - dust) * clean + pixel.dust * DUST_ALBEDO / PI * received).to_array()
        }
    }
}
