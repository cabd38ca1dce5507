//! Lamp weights under a rotated and graded environment with placed lights.

use super::lighting::Lighting;
use super::weights::{self, LightWeights, Partition, Weighting};
use super::{Environment, Rig, YawTable};
use glam::Quat;
use imaging::{Image, color::luminance};

/// Weights of a rig's lamps from an environment, under any lighting.
pub struct EnvironmentWeights {
    weighting: Weighting,
    partition: Partition,
    reduced: Environment,
    yaws: YawTable,
    rig: Rig,
}

impl EnvironmentWeights {
    /// Prepares an environment (any size) for a rig.
    pub fn new(environment: &Environment, rig: &Rig, weighting: Weighting) -> Self {
        let partition = Partition::new(weighting, rig);
        let reduced = environment.reduced(Partition::WIDTH);
        Self { weighting, yaws: YawTable::new(&partition, &reduced), partition, reduced, rig: rig.clone() }
    }

    /// Replaces the environment and keeps everything that depends only on the rig.
    pub fn environment(self, environment: &Environment) -> Self {
        let reduced = environment.reduced(Partition::WIDTH);
        Self { yaws: YawTable::new(&self.partition, &reduced), reduced, ..self }
    }

    /// Lamp weights of the rotated and graded environment and the placed lights. `unit` is the radiance in the
    /// environment that equals one unit of a placed light. A yaw is a look-up. With pitch or roll the environment
    /// is resampled, in about ten milliseconds.
    pub fn weights(&mut self, lighting: &Lighting, yaw_deg: f32, unit: f32) -> LightWeights {
        if lighting.weighting != self.weighting {
            *self = Self::new(&self.reduced, &self.rig, lighting.weighting);
        }
        let mut weights = if lighting.tilt() == Quat::IDENTITY {
            self.yaws.at(yaw_deg)
        } else {
            self.partition.turned_weights(&self.reduced, lighting.turn(yaw_deg))
        };
        let gains = lighting.gains();
        scale(&mut weights, gains);
        if lighting.placed.is_empty() {
            return weights;
        }
        let (width, height) = self.reduced.radiance.size();
        let mut lights = Image::filled(width, height, [0.0; 3]);
        for light in (lighting.placed.iter()).filter(|light| lighting.shines(light)) {
            lighting.with_group_gain(light).add_to(&mut lights);
        }
        let lights = Environment::from_radiance("placed", lights);
        let mut placed = self.partition.weights(&lights, 0.0);
        scale(&mut placed, [unit; 3]);
        // Average of both uncovered shares, weighted by energy.
        let energies = [(&self.reduced, gains, weights.uncovered), (&lights, [unit; 3], placed.uncovered)].map(
            |(environment, gains, uncovered)| {
                let energy = environment.energy();
                let graded = std::array::from_fn(|c| energy[c] as f32 * gains[c]);
                (luminance(graded), uncovered)
            },
        );
        let total: f32 = energies.iter().map(|(energy, _)| energy).sum();
        if total > 0.0 && total.is_finite() {
            weights.uncovered = energies.iter().map(|(energy, share)| energy * share).sum::<f32>() / total;
        }
        for (weight, placed) in weights.per_lamp.iter_mut().zip(&placed.per_lamp) {
            *weight = std::array::from_fn(|c| (weight[c] + placed[c]).min(weights::MOST));
        }
        weights
    }

    /// Weights of an environment with radiance 1 everywhere.
    pub fn even(&self) -> LightWeights {
        let (width, height) = self.reduced.radiance.size();
        let even = Environment::from_radiance("even", Image::filled(width, height, [1.0; 3]));
        self.partition.weights(&even, 0.0)
    }
}

/// Multiplies weights by `gains`, up to the largest weight.
fn scale(weights: &mut LightWeights, gains: [f32; 3]) {
    for weight in &mut weights.per_lamp {
        *weight = std::array::from_fn(|c| (weight[c] * gains[c]).min(weights::MOST));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Lamp, LightGroup, PlacedLight, white};
    use glam::Vec3;

    /// Lamps in all directions with energy 1.
    fn rig() -> Rig {
        let lamp = |i: usize| {
            let y = 1.0 - (2 * i + 1) as f32 / 24.0;
            let (turn, across) = (2.399_963 * i as f32, (1.0 - y * y).sqrt());
            let direction = Vec3::new(across * turn.sin(), y, across * turn.cos());
            Lamp::new(format!("olat_{i:02}"), direction)
        };
        Rig { lamps: (0..24).map(lamp).collect() }
    }

    fn sky() -> Environment {
        let radiance = Image::from_fn(256, 128, |x, y| {
            let sun = if (60..64).contains(&x) && (30..34).contains(&y) { 900.0 } else { 0.0 };
            [0.4 + sun, 0.5 + sun, 0.7 + sun - 0.002 * y as f32]
        });
        Environment::from_radiance("sky", radiance)
    }

    fn energy(weights: &LightWeights) -> [f32; 3] {
        [0, 1, 2].map(|c| weights.per_lamp.iter().map(|w| w[c]).sum())
    }

    #[test]
    fn the_default_changes_nothing_and_a_turn_keeps_the_light() {
        for weighting in [Weighting::Fit, Weighting::Smooth, Weighting::Cells] {
            let (rig, sky) = (rig(), sky());
            let mut lit = EnvironmentWeights::new(&sky, &rig, weighting);
            let plain = Lighting { weighting, ..Lighting::default() };
            let table = YawTable::new(&Partition::new(weighting, &rig), &sky);
            assert_eq!(lit.weights(&plain, 33.0, 1.0), table.at(33.0));
            let all = energy(&lit.weights(&plain, 0.0, 1.0));
            for (pitch_deg, roll_deg) in [(30.0, 0.0), (0.0, -75.0), (180.0, 20.0)] {
                let turned = Lighting { pitch_deg, roll_deg, ..plain.clone() };
                let turned = energy(&lit.weights(&turned, 10.0, 1.0));
                (0..3).for_each(|c| assert!((turned[c] / all[c] - 1.0).abs() < 1e-4));
            }
        }
    }

    #[test]
    fn a_grade_scales_every_channel() {
        let mut lit = EnvironmentWeights::new(&sky(), &rig(), Weighting::Fit);
        let plain = lit.weights(&Lighting::default(), 5.0, 1.0);
        let graded = Lighting { intensity_stops: 2.0, temperature_k: 3200.0, tint: 10.0, ..Lighting::default() };
        let gains = white::gains(3200.0, 10.0);
        let warm = lit.weights(&graded, 5.0, 1.0);
        for (warm, plain) in warm.per_lamp.iter().zip(&plain.per_lamp) {
            (0..3).for_each(|c| assert!((warm[c] - 4.0 * gains[c] * plain[c]).abs() <= 1e-4 * warm[c]));
        }
        assert!(gains[0] > 1.2 && gains[2] < 0.6, "{gains:?}");
    }

    #[test]
    fn a_placed_light_adds_its_energy_and_stays_where_it_is() {
        let mut lit = EnvironmentWeights::new(&sky(), &rig(), Weighting::Fit);
        let light = PlacedLight { yaw_deg: 90.0, pitch_deg: 10.0, ..PlacedLight::default() };
        let with = Lighting { placed: vec![light.clone()], ..Lighting::default() };
        let added = |lit: &mut EnvironmentWeights, yaw: f32| -> Vec<f32> {
            let (a, b) = (lit.weights(&with, yaw, 3.0), lit.weights(&Lighting::default(), yaw, 3.0));
            a.per_lamp.iter().zip(&b.per_lamp).map(|(a, b)| a[1] - b[1]).collect()
        };
        let here = added(&mut lit, 0.0);
        // Lamps have energy 1, so weights are energies: 3 units of π.
        assert!((here.iter().sum::<f32>() / (3.0 * std::f32::consts::PI) - 1.0).abs() < 1e-3);
        let brightest = (0..24).max_by(|&a, &b| here[a].total_cmp(&here[b])).unwrap();
        let nearest = |i: usize| rig().lamps[i].direction.dot(light.direction());
        let nearest = (0..24).max_by(|&a, &b| nearest(a).total_cmp(&nearest(b))).unwrap();
        assert_eq!(brightest, nearest);
        for (a, b) in here.iter().zip(added(&mut lit, 77.0)) {
            assert!((a - b).abs() < 1e-3, "{a} became {b}");
        }
    }

    #[test]
    fn solo_lights_shine_alone_and_without_the_environment() {
        let mut lit = EnvironmentWeights::new(&sky(), &rig(), Weighting::Fit);
        let at =
            |yaw_deg: f32, solo: bool, enabled: bool| PlacedLight { yaw_deg, solo, enabled, ..PlacedLight::default() };
        let mut weights = |placed: Vec<PlacedLight>, intensity_stops: f32| {
            let lighting = Lighting { placed, intensity_stops, ..Lighting::default() };
            lit.weights(&lighting, 20.0, 1.0)
        };
        let all = weights(vec![at(90.0, false, true), at(-90.0, false, true)], 0.0);
        let one = weights(vec![at(90.0, true, true), at(-90.0, false, true)], 0.0);
        // Lamps have energy 1, so weights are energies.
        assert!((energy(&one)[1] / std::f32::consts::PI - 1.0).abs() < 1e-3);
        assert!(energy(&all)[1] > energy(&one)[1] + std::f32::consts::PI);
        let alone = weights(vec![at(90.0, true, true)], 3.0);
        assert_eq!(one, alone, "regardless of other lights");
        let both = weights(vec![at(90.0, true, true), at(-90.0, true, true)], 0.0);
        assert!((energy(&both)[1] / (2.0 * std::f32::consts::PI) - 1.0).abs() < 1e-3);
        // A disabled solo light silences nothing.
        let off = weights(vec![at(90.0, true, false), at(-90.0, false, true)], 0.0);
        assert_eq!(off, weights(vec![at(-90.0, false, true)], 0.0));
    }

    #[test]
    fn a_group_turns_its_lights_up_mutes_them_and_shows_them_alone() {
        let mut lit = EnvironmentWeights::new(&sky(), &rig(), Weighting::Fit);
        let light =
            |yaw_deg: f32, group: &str| PlacedLight { yaw_deg, group: group.to_owned(), ..PlacedLight::default() };
        let group = LightGroup { name: "Left".to_owned(), ..LightGroup::default() };
        let plain = Lighting {
            placed: vec![light(-90.0, "Left"), light(90.0, ""), light(0.0, "gone")],
            groups: vec![group.clone()],
            ..Lighting::default()
        };
        let mut green = |group: LightGroup| {
            let lighting = Lighting { groups: vec![group], ..plain.clone() };
            energy(&lit.weights(&lighting, 0.0, 1.0))[1]
        };
        // Lamps have energy 1, so weights are energies.
        let one = std::f32::consts::PI;
        let all = green(group.clone());
        let louder = green(LightGroup { gain_stops: 1.0, ..group.clone() });
        let muted = green(LightGroup { muted: true, solo: true, ..group.clone() });
        let alone = green(LightGroup { solo: true, ..group.clone() });
        let wild = green(LightGroup { gain_stops: f32::NAN, ..group.clone() });
        assert!((louder - all - one).abs() < 1e-2, "{louder} {all}");
        assert!((all - muted - one).abs() < 1e-2, "{all} {muted}");
        assert!((alone - one).abs() < 1e-2, "{alone}");
        assert_eq!(wild, all);
        let text = serde_json::to_string(&plain).unwrap();
        assert_eq!(serde_json::from_str::<Lighting>(&text).unwrap(), plain);
        // A file without groups keeps its old form.
        let bare = serde_json::to_string(&Lighting::default()).unwrap();
        assert!(!bare.contains("groups"), "{bare}");
        let mut named = Lighting { groups: vec![LightGroup { solo: true, ..group }], ..plain };
        assert_eq!(named.solo_titles(), ["Light 1"]);
        assert!(named.is_solo());
        named.clear_solo();
        assert!(!named.is_solo());
    }

    #[test]
    fn numbers_that_make_no_sense_give_finite_light() {
        let mut lit = EnvironmentWeights::new(&sky(), &rig(), Weighting::Fit);
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e30] {
            let lighting = Lighting {
                pitch_deg: bad,
                roll_deg: bad,
                intensity_stops: bad,
                temperature_k: bad,
                tint: bad,
                placed: vec![PlacedLight { intensity: bad, yaw_deg: bad, ..PlacedLight::default() }],
                ..Lighting::default()
            };
            let weights = lit.weights(&lighting, 3.0, 1.0);
            assert!(weights.per_lamp.iter().flatten().all(|w| w.is_finite() && *w >= 0.0), "{bad}");
            assert!(weights.uncovered.is_finite());
        }
        let mut none = EnvironmentWeights::new(&sky(), &Rig::default(), Weighting::Fit);
        assert!(none.weights(&Lighting::default(), 0.0, 1.0).per_lamp.is_empty());
    }
}
