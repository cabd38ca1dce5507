//! Light of an environment on a rig: the lamps' weights under any lighting, at a level that is set once.

use super::field::Field;
use super::levels::Levels;

use super::picture::Ingredients;
use base::error::Result;
use imaging::Mask;
use light::EnvironmentWeights;
use light::{Environment, LightWeights, Lighting, Rig};
use scene::Scene;
use std::sync::Arc;
use std::time::Instant;

/// An environment in front of a rig, and its weights under the latest scene.
pub struct EnvironmentLight {
    environment: Arc<Environment>,
    lit: EnvironmentWeights,
    levels: Levels,
    /// Lighting of `weights`.
    lighting: Lighting,
    yaw_deg: f32,
    weights: LightWeights,
}

impl EnvironmentLight {
    /// Updates `light` to `scene` and an environment of any size. `reference` is the field and the matte of
    /// one frame, which sets the level of every picture: with one level per frame a clip would
    /// flicker. The rig's part is computed once, and so is the level under one environment. Returns the
    /// light and the time it took in milliseconds, or None if nothing had changed.
    ///
    /// # Errors
    /// When the GPU of the field fails; then `light` is None.
    pub fn update<'a>(
        light: &'a mut Option<Self>,
        environment: &Arc<Environment>,
        rig: &Rig,
        scene: &Scene,
        (field, mask): (&Field, &Mask),
    ) -> Result<(&'a mut Self, Option<f64>)> {
        let started = Instant::now();
        let (lighting, yaw_deg) = (&scene.lighting, scene.yaw_deg);
        let updated = match light.take() {
            Some(same) if same.is_of(environment) && same.yaw_deg == yaw_deg && same.lighting == *lighting => {
                return Ok((light.insert(same), None));
            }
            Some(mut turned) if turned.is_of(environment) => {
                turned.weights = turned.lit.weights(lighting, yaw_deg, turned.levels.unit());
                (turned.lighting, turned.yaw_deg) = (lighting.clone(), yaw_deg);
                turned
            }
            other => {
                let mut lit = match other {
                    Some(other) => other.lit.environment(environment),
                    None => EnvironmentWeights::new(environment, rig, lighting.weighting),
                };
                let levels = Levels::balanced(environment, &lit.even(), field, mask)?;
                Self {
                    environment: environment.clone(),
                    weights: lit.weights(lighting, yaw_deg, levels.unit()),
                    lit,
                    levels,
                    lighting: lighting.clone(),
                    yaw_deg,
                }
            }
        };
        let ms = started.elapsed().as_secs_f64() * 1e3;
        Ok((light.insert(updated), Some(ms)))
    }

    /// True if this is the light of that environment, compared by identity and not by value.
    pub fn is_of(&self, environment: &Arc<Environment>) -> bool {
        Arc::ptr_eq(&self.environment, environment)
    }

    pub fn environment(&self) -> &Environment {
        &self.environment
    }

    pub fn levels(&self) -> Levels {
        self.levels
    }

    /// The lamps' weights under the latest scene.
    pub fn weights(&self) -> &LightWeights {
        &self.weights
    }

    /// The lamps' weights of each part of the latest lighting, as [`Lighting::parts`]. A fit of several lights is not the sum
    /// of their fits, so each lamp's weight is shared in proportion to them; then the parts add up exactly.
    pub fn parts(&mut self) -> Vec<(String, Vec<[f32; 3]>)> {
        let unit = self.levels.unit();
        let mut parts: Vec<(String, Vec<[f32; 3]>)> = Vec::new();
        for (name, part) in self.lighting.parts() {
            let dark = vec![[0.0; 3]; self.weights.per_lamp.len()];
            let lit = part.map(|part| self.lit.weights(&part, self.yaw_deg, unit).per_lamp);
            parts.push((name, lit.unwrap_or(dark)));
        }
        let Some(((_, environment), lights)) = parts.split_first_mut() else { return parts };
        let total = |light: &Vec<[f32; 3]>, c: usize| light.iter().map(|w| w[c]).sum::<f32>();
        let totals: Vec<[f32; 3]> = lights.iter().map(|(_, light)| [0, 1, 2].map(|c| total(light, c))).collect();
        for (lamp, whole) in self.weights.per_lamp.iter().enumerate() {
            for c in 0..3 {
                let placed = whole[c] - environment[lamp][c];
                let own: f32 = lights.iter().map(|(_, light)| light[lamp][c]).sum();
                let all: f32 = totals.iter().map(|total| total[c]).sum();
                for ((_, light), total) in lights.iter_mut().zip(&totals) {
                    let share = match (own > 0.0, all > 0.0) {
                        (true, _) => light[lamp][c] / own,
                        (false, true) => total[c] / all,
                        (false, false) => 0.0,
                    };
                    light[lamp][c] = placed * share;
                }
            }
        }
        parts
    }

    /// Weights of only some lamps, each with half of the energy of an even light from all of them.
    pub fn solo(&self, lamps: &[usize]) -> LightWeights {
        let mut weights = self.lit.even();
        let share = 0.5 * weights.per_lamp.len() as f32 * self.levels.of_unit_light();
        for (lamp, weight) in weights.per_lamp.iter_mut().enumerate() {
            let on = if lamps.contains(&lamp) { share } else { 0.0 };
            *weight = weight.map(|w| w * on);
        }
        weights
    }

    /// A frame in this light, for [`super::compose`].
    pub fn on<'a>(&'a self, field: &'a Field, mask: &'a Mask) -> Ingredients<'a> {
        Ingredients { levels: self.levels, ..Ingredients::new(field, mask, &self.weights, &self.environment) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use imaging::Image;
    use light::{Lamp, LightGroup, PlacedLight};
    use reflectance::ReflectanceField;

    /// Two lamps, left and right, and a frame lit half by each.
    fn stage() -> (Rig, Field, Mask) {
        let lamp = |x: f32| Lamp::new(format!("lamp {x}"), glam::Vec3::new(x, 0.0, 0.0));
        let rig = Rig { lamps: vec![lamp(-1.0), lamp(1.0)] };
        let field = ReflectanceField::from_olats(&vec![Image::filled(8, 8, [0.5; 3]); 2]);
        (rig, field.into(), Mask::filled(8, 8, 1.0))
    }

    fn environment(left: f32, right: f32) -> Arc<Environment> {
        let radiance = |x, _| [if x < 32 { left } else { right }; 3];
        Arc::new(Environment::from_radiance("two sides", Image::from_fn(64, 32, radiance)))
    }

    fn at(yaw_deg: f32) -> Scene {
        Scene { yaw_deg, ..Scene::default() }
    }

    #[test]
    fn a_turn_changes_the_weights_and_not_the_level() {
        let (rig, field, mask) = stage();
        let sky = environment(1.0, 0.2);
        let mut light = None;
        let mut update = |scene: &Scene, field: &Field| {
            let updated = EnvironmentLight::update(&mut light, &sky, &rig, scene, (field, &mask));
            let (light, ms) = updated.unwrap();
            (ms, light.levels(), light.weights().clone())
        };
        let (ms, levels, first) = update(&at(0.0), &field);
        assert!(ms.is_some());
        assert_eq!(update(&at(0.0), &field), (None, levels, first.clone()));
        let darker = ReflectanceField::from_olats(&vec![Image::filled(8, 8, [0.1; 3]); 2]).into();
        let (ms, same, turned) = update(&at(180.0), &darker);
        assert!(ms.is_some() && same == levels);
        let ratio = |weights: &LightWeights| weights.per_lamp[0][1] / weights.per_lamp[1][1];
        assert!(ratio(&first) > 1.5 && ratio(&turned) < 1.0 / 1.5);
    }

    #[test]
    fn another_environment_is_as_bright_as_if_it_were_the_first() {
        let (rig, field, mask) = stage();
        let reference = (&field, &mask);
        let (mut changed, mut fresh) = (None, None);
        let other = environment(3.0, 40.0);
        for sky in [&environment(1.0, 0.2), &other] {
            EnvironmentLight::update(&mut changed, sky, &rig, &at(30.0), reference).unwrap();
        }
        EnvironmentLight::update(&mut fresh, &other, &rig, &at(30.0), reference).unwrap();
        let (changed, fresh) = (changed.unwrap(), fresh.unwrap());
        assert!(changed.is_of(&other));
        assert_eq!(changed.levels(), fresh.levels());
        assert_eq!(changed.weights(), fresh.weights());
    }

    #[test]
    fn a_lamp_alone_gives_its_light_and_the_others_none() {
        let (rig, field, mask) = stage();
        let (sky, mut light) = (environment(1.0, 0.2), None);
        let lit = EnvironmentLight::update(&mut light, &sky, &rig, &at(0.0), (&field, &mask));
        let solo = lit.unwrap().0.solo(&[1]);
        assert_eq!(solo.per_lamp[0], [0.0; 3]);
        assert!(solo.per_lamp[1].iter().all(|&w| w > 0.0 && w.is_finite()));
    }

    #[test]
    fn the_parts_of_a_lighting_add_up_lamp_by_lamp() {
        let (few, _, mask) = stage();
        let direction = |i: usize| {
            let (x, z) = (i as f32 * 0.7).sin_cos();
            glam::Vec3::new(x, 0.3, z)
        };
        let lamp = |i: usize| Lamp { direction: direction(i).normalize(), ..few.lamps[0].clone() };
        let rig = Rig { lamps: (0..12).map(lamp).collect() };
        let field = ReflectanceField::from_olats(&vec![Image::filled(8, 8, [0.5; 3]); 12]).into();
        let placed = |name: &str, group: &str, yaw_deg: f32| PlacedLight {
            name: name.to_owned(),
            group: group.to_owned(),
            yaw_deg,
            intensity: 2.0,
            ..PlacedLight::default()
        };
        let key = LightGroup { name: "Key".to_owned(), gain_stops: 1.0, ..LightGroup::default() };
        let mut scene = at(0.0);
        scene.lighting.groups = vec![key];
        scene.lighting.placed = vec![placed("a", "Key", -80.0), placed("", "", 90.0), placed("b", "Key", 70.0)];
        let sky = environment(1.0, 0.2);
        let mut light = None;
        let mut sums = |scene: &Scene| {
            let (light, _) = EnvironmentLight::update(&mut light, &sky, &rig, scene, (&field, &mask)).unwrap();
            let parts = light.parts();
            let names: Vec<_> = parts.iter().map(|(name, _)| name.clone()).collect();
            assert_eq!(names, ["environment", "Key", "Light 2"]);
            for (lamp, whole) in light.weights().per_lamp.iter().enumerate() {
                for c in 0..3 {
                    let sum: f32 = parts.iter().map(|(_, part)| part[lamp][c]).sum();
                    assert!((sum - whole[c]).abs() <= 1e-5 * whole[c], "{lamp}: {sum} {whole:?}");
                }
            }
            let is_lit = |part: &Vec<[f32; 3]>| part.iter().flatten().any(|weight| *weight > 0.0);
            parts.iter().map(|(_, part)| is_lit(part)).collect::<Vec<_>>()
        };
        assert_eq!(sums(&scene), [true, true, true]);
        scene.lighting.placed[1].enabled = false;
        assert_eq!(sums(&scene), [true, true, false]);
        scene.lighting.placed[2].solo = true;
        assert_eq!(sums(&scene), [false, true, false]);
        scene.lighting.groups[0].muted = true;
        assert_eq!(sums(&scene), [true, false, false]);
    }
}
