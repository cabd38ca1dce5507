//! Photographs of the mirror ball: traced once, bank by bank, then weighted into each.

use super::ball::{BallLight, reflect};
use super::ball_view::{Around, Surroundings};
use super::dome::{Dome, LAMP_RADIUS_M, RADIUS_M};
use glam::Vec3;
use imaging::{Image, Raster};
use light::latlong::uv_from_direction;
use rayon::prelude::*;

/// Rays across a photograph: a lamp's image is about a hundredth of the ball wide, so this many capture its energy to
/// about a percent.
const RAYS_ACROSS: usize = 2048;

/// View of the ball: coverage per pixel, and the share of lamps in it per bank.
pub struct Probe {
    size: usize,
    coverage: Vec<f32>,
    /// Banks visible in each pixel, with the share of the pixel that their lamps fill.
    seen: Vec<Vec<(u32, f32)>>,
    /// Other reflections in the ball; `None` on the plain stage.
    around: Option<Around>,
    /// Radiance of a lamp whose share of the sphere has a mean radiance of 1.
    lamp_radiance: f32,
}

impl Probe {
    /// Traces the ball in a photograph of `size × size` pixels, with `surroundings` if there is more than lamps.
    pub fn trace(dome: &Dome, size: usize, surroundings: Option<&Surroundings>) -> Self {
        let rays = (RAYS_ACROSS / size).max(4);
        let lamps = LampMap::new(dome);
        let around = surroundings.map(|s| s.trace(size, rays));
        let traced: Vec<(f32, Vec<(u32, f32)>)> = (0..size * size)
            .into_par_iter()
            .map(|i| {
                let mut covered = 0;
                let mut hits: Vec<(u32, u32)> = Vec::new();
                for sub in 0..rays * rays {
                    let dx = ((sub % rays) as f32 + 0.5) / rays as f32;
                    let dy = ((sub / rays) as f32 + 0.5) / rays as f32;
                    let Some((place, direction)) = reflect((i % size) as f32 + dx, (i / size) as f32 + dy, size) else {
                        continue;
                    };
                    covered += 1;
                    if let Some(bank) = lamps.seen_from(dome, place, direction) {
                        match hits.iter_mut().find(|(b, _)| *b == bank) {
                            Some((_, count)) => *count += 1,
                            None => hits.push((bank, 1)),
                        }
                    }
                }
                let share = |count: u32| count as f32 / (rays * rays) as f32;
                (share(covered), hits.into_iter().map(|(bank, count)| (bank, share(count))).collect())
            })
            .collect();
        let (coverage, seen) = traced.into_iter().unzip();
        let disc = std::f32::consts::PI * (LAMP_RADIUS_M / RADIUS_M).powi(2);
        Self { size, coverage, seen, around, lamp_radiance: dome.lamp_solid_angle() / disc }
    }

    /// Radiance of the ball under `light`, and a dim `ambient` on the ball.
    pub fn image(&self, light: &BallLight, ambient: f32) -> Image {
        let add = self.around.as_ref().map(|around| around.under(light));
        Raster::from_fn(self.size, self.size, |x, y| {
            let i = y * self.size + x;
            let mirrored = [0, 1, 2].map(|c| {
                let lamps: f32 = self.seen[i].iter().map(|&(bank, share)| light.banks[bank as usize][c] * share).sum();
                self.lamp_radiance * lamps + ambient * self.coverage[i]
            });
            add.as_ref().map_or(mirrored, |add| add(i, mirrored))
        })
    }

    /// Pixels of a photograph, and the number that show the ball.
    pub fn pixels(&self) -> (usize, usize) {
        (self.coverage.len(), self.coverage.iter().filter(|&&c| c > 0.0).count())
    }

    /// Brightest pixel under `light`, without ambient light.
    pub fn brightest(&self, light: &BallLight) -> f32 {
        let image = self.image(light, 0.0);
        image.pixels.iter().flatten().copied().fold(0.0, f32::max)
    }
}

/// Lamps near a direction: a list for each cell of a coarse panorama.
struct LampMap {
    cells: Vec<Vec<u32>>,
}

const MAP_WIDTH: usize = 128;
const MAP_HEIGHT: usize = 64;

impl LampMap {
    fn new(dome: &Dome) -> Self {
        // Half a cell's diagonal, plus the lamp's own radius.
        let reach = (std::f32::consts::PI / MAP_HEIGHT as f32) * 0.75 + LAMP_RADIUS_M / RADIUS_M;
        let cells = (0..MAP_WIDTH * MAP_HEIGHT)
            .map(|i| {
                let centre = light::latlong::texel_direction(i % MAP_WIDTH, i / MAP_WIDTH, MAP_WIDTH, MAP_HEIGHT);
                let near = |lamp: &Vec3| lamp.dot(centre) > reach.cos();
                (0..dome.lamps.len() as u32).filter(|&l| near(&dome.lamps[l as usize])).collect()
            })
            .collect();
        Self { cells }
    }

    /// Bank of the lamp that a ray hits.
    fn seen_from(&self, dome: &Dome, place: Vec3, direction: Vec3) -> Option<u32> {
        // From inside, the ray hits the dome where |place + t·direction| is its radius.
        let half = place.dot(direction);
        let t = (half * half + RADIUS_M * RADIUS_M - place.length_squared()).sqrt() - half;
        let on_dome = place + direction * t;
        let (u, v) = uv_from_direction(on_dome);
        let column = ((u * MAP_WIDTH as f32) as usize).min(MAP_WIDTH - 1);
        let row = ((v * MAP_HEIGHT as f32) as usize).min(MAP_HEIGHT - 1);
        self.cells[row * MAP_WIDTH + column]
            .iter()
            .find(|&&lamp| {
                (dome.lamps[lamp as usize] * RADIUS_M).distance_squared(on_dome) < LAMP_RADIUS_M * LAMP_RADIUS_M
            })
            .map(|&lamp| dome.bank_of_lamp[lamp as usize] as u32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ball::ball_radius_px;

    /// Direction that an ideal, infinitely distant ball shows at a place of its picture (R = 2(n·v)n − v, with v
    /// towards the camera), without the tracer.
    fn far_ball_direction(x: f64, y: f64) -> [f64; 3] {
        let z = (1.0 - x * x - y * y).max(0.0).sqrt();
        [2.0 * z * x, 2.0 * z * y, 2.0 * z * z - 1.0]
    }

    /// The expected banks, at radiance 1.
    fn only(lit: impl Fn(usize) -> bool, banks: usize) -> BallLight {
        BallLight { banks: (0..banks).map(|b| [f32::from(u8::from(lit(b))); 3]).collect(), interview: 0.0 }
    }

    #[test]
    fn a_banks_glint_is_where_the_ball_mirrors_its_direction() {
        let (dome, size) = (Dome::new(41), 128);
        let probe = Probe::trace(&dome, size, None);
        let mut checked = 0;
        for (bank, direction) in dome.banks.iter().enumerate() {
            // Towards the rim a pixel spans many degrees; the test stays where it spans few.
            if direction.z < 0.0 {
                continue;
            }
            let image = probe.image(&only(|b| b == bank, 41), 0.0);
            let mut sum = [0.0f64; 3];
            for y in 0..size {
                for x in 0..size {
                    let weight = f64::from(image.at(x, y)[0]);
                    let radius = ball_radius_px(size);
                    let from_centre = |i: usize| (i as f64 + 0.5 - size as f64 / 2.0) / radius;
                    let d = far_ball_direction(from_centre(x), -from_centre(y));
                    sum.iter_mut().zip(d).for_each(|(s, d)| *s += weight * d);
                }
            }
            let found = glam::DVec3::from(sum).normalize();
            let degrees = found.dot(direction.as_dvec3()).clamp(-1.0, 1.0).acos().to_degrees();
            // A pixel spans 2·asin(1/58) = 2°. The ball's own size relative to the dome (0.075/4, one degree) and the
            // camera's distance (another) shift the reflection from that of a distant ball.
            assert!(degrees < 2.5, "bank {bank}: {degrees}°");
            checked += 1;
        }
        assert!(checked > 10);
    }

    #[test]
    fn the_same_energy_is_seen_at_any_size() {
        let dome = Dome::new(12);
        let energy = |size: usize| {
            let image = Probe::trace(&dome, size, None).image(&only(|_| true, 12), 0.0);
            image.pixels.iter().map(|p| p[0]).sum::<f32>() / (size * size) as f32
        };
        let (small, large) = (energy(32), energy(96));
        assert!((small / large - 1.0).abs() < 0.02, "{small} and {large}");
    }

    #[test]
    fn a_ball_among_lamps_everywhere_mirrors_the_mean_radiance() {
        // All lamps together are a sphere of radiance 1, seen mirrored: mean over the ball is 1.
        let probe = Probe::trace(&Dome::new(41), 128, None);
        let image = probe.image(&only(|_| true, 41), 0.0);
        let mean = image.pixels.iter().map(|p| p[0]).sum::<f32>() / probe.coverage.iter().sum::<f32>();
        assert!((mean - 1.0).abs() < 0.03, "{mean}");
    }
}
