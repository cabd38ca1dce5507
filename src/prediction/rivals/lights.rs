//! Random lights for a rig: training input of a network that accepts any light.

use glam::Vec3;
use light::weights::{Partition, Weighting};
use light::{Environment, Rig, YawTable, built_in};
use rand::{Rng, RngExt};

/// Columns of the panoramas from which lights are drawn.
const WIDTH: usize = 256;
/// Yaws of each panorama, in degrees.
const STEP_DEG: usize = 15;
/// Number of lamps that a lobe of light covers.
const MOST_LOBES: usize = 3;

/// Source of random lights.
pub struct Lights {
    /// Weights under the built-in environments, at many yaws.
    environments: Vec<Vec<[f32; 3]>>,
    /// Direction of each lamp and the inverse of its energy, 0 if the lamp is unusable.
    lamps: Vec<(Vec3, [f32; 3])>,
}

impl Lights {
    pub fn new(rig: &Rig) -> Self {
        let partition = Partition::new(Weighting::default(), rig);
        let mut environments = Vec::new();
        for own in built_in::all() {
            let environment = Environment::from_radiance(own.name, (own.make)(WIDTH));
            let table = YawTable::new(&partition, &environment);
            let yaws = (0..360).step_by(STEP_DEG);
            environments.extend(yaws.map(|yaw| table.at(yaw as f32).per_lamp));
        }
        let lamp = |lamp: &light::Lamp| {
            let inverse = lamp.energy.map(|e| if lamp.is_usable() { 1.0 / e } else { 0.0 });
            (lamp.direction, inverse)
        };
        Self { environments, lamps: rig.lamps.iter().map(lamp).collect() }
    }

    /// In half of the draws a single lamp; otherwise a built-in environment at a random yaw and colour, or lobes of light from
    /// random directions. Weights on OLATs, in any unit.
    pub fn draw(&self, rng: &mut impl Rng) -> Vec<[f32; 3]> {
        match rng.random_range(0..4) {
            0 => self.environment(rng),
            1 => self.lobes(rng),
            _ => self.lamp(rng.random_range(0..self.lamps.len())),
        }
    }

    /// An environment or lobes.
    pub fn draw_surrounding(&self, rng: &mut impl Rng) -> Vec<[f32; 3]> {
        if rng.random_range(0..2) == 0 { self.environment(rng) } else { self.lobes(rng) }
    }

    /// One single lamp.
    pub fn lamp(&self, lamp: usize) -> Vec<[f32; 3]> {
        let mut weights = vec![[0.0; 3]; self.lamps.len()];
        weights[lamp] = [1.0; 3];
        weights
    }

    fn environment(&self, rng: &mut impl Rng) -> Vec<[f32; 3]> {
        let tint = colour(rng, 0.5);
        let weights = &self.environments[rng.random_range(0..self.environments.len())];
        let tinted = |weight: &[f32; 3]| std::array::from_fn(|c| weight[c] * tint[c]);
        weights.iter().map(tinted).collect()
    }

    fn lobes(&self, rng: &mut impl Rng) -> Vec<[f32; 3]> {
        let ambient = rng.random_range(0.0..0.3f32);
        let mut radiance = vec![[ambient; 3]; self.lamps.len()];
        for _ in 0..rng.random_range(1..=MOST_LOBES) {
            let up = rng.random_range(-1.0..=1.0f32);
            let (sin, cos) = rng.random_range(0.0..std::f32::consts::TAU).sin_cos();
            let across = (1.0 - up * up).max(0.0).sqrt();
            let towards = Vec3::new(across * sin, up, across * cos);
            let narrow = rng.random_range(0.0..4.0f32).exp();
            let tint = colour(rng, 1.0);
            for (radiance, (direction, _)) in radiance.iter_mut().zip(&self.lamps) {
                let falloff = (narrow * (direction.dot(towards) - 1.0)).exp();
                for c in 0..3 {
                    radiance[c] += tint[c] * falloff;
                }
            }
        }
        let weights = radiance.iter().zip(&self.lamps);
        weights.map(|(radiance, (_, inverse))| std::array::from_fn(|c| radiance[c] * inverse[c])).collect()
    }
}

/// Random factor of up to `stops` up or down.
fn colour(rng: &mut impl Rng, stops: f32) -> [f32; 3] {
    std::array::from_fn(|_| rng.random_range(-stops..=stops).exp2())
}

/// Network input for a light: for each lamp and channel the square root of its share of the subject's light, and
/// the total per channel. `levels` are the subject's means under each lamp. Relighting is linear, so a network of
/// shares has to learn neither exposure nor white balance.
pub struct Shares {
    pub roots: Vec<f32>,
    pub total: [f32; 3],
}

impl Shares {
    pub fn new(weights: &[[f32; 3]], levels: &[[f32; 3]]) -> Self {
        let given = |(weight, level): (&[f32; 3], &[f32; 3])| -> [f32; 3] {
            std::array::from_fn(|c| weight[c].max(0.0) * level[c])
        };
        let given: Vec<[f32; 3]> = weights.iter().zip(levels).map(given).collect();
        let total: [f32; 3] = std::array::from_fn(|c| given.iter().map(|g| g[c]).sum());
        let root = |given: &[f32; 3]| -> [f32; 3] {
            std::array::from_fn(|c| match total[c] {
                t if t > 0.0 && t.is_finite() => (given[c] / t).sqrt(),
                _ => 0.0,
            })
        };
        Self { roots: given.iter().flat_map(root).collect(), total }
    }

    /// The light scaled to a total of 1 per channel; a channel without light stays black.
    pub fn normal(&self, weights: &[[f32; 3]]) -> Vec<[f32; 3]> {
        let factor = self.total.map(|t| if t > 0.0 { 1.0 / t } else { 0.0 });
        let scaled = |w: &[f32; 3]| std::array::from_fn(|c| w[c].max(0.0) * factor[c]);
        weights.iter().map(scaled).collect()
    }
}
