//! The brightest areas of a panorama: the sun, windows, lamps, one by one.
//!
//! Texels are visited from the brightest down. Each joins the area it touches, or starts a new one. Where two areas
//! meet, the dimmer one is merged unless its peak is twice as bright as the saddle between them (the component tree
//! with persistence; Edelsbrunner, Letscher and Zomorodian 2002). Texels below a quarter of an area's peak belong
//! to its surroundings.

use super::latlong::{texel_direction, texel_solid_angle};
use super::{Environment, Rig};
use glam::{DVec3, Quat, Vec3};
use imaging::color::luminance;
use rayon::prelude::*;

/// Largest width of the search, 0.7° a texel. Lamps are many degrees apart; a finer panorama would split the star
/// around a sun into its rays.
const WIDTH: usize = 512;
/// Largest ratio of the saddle to a peak that stands out from a higher one.
const SADDLE: f32 = 0.5;
/// Luminance at the edge of an area, relative to its peak.
const EDGE: f32 = 0.25;

/// A bright area of a panorama.
#[derive(Clone, Debug, PartialEq)]
pub struct Area {
    /// Unit direction towards the light's centre.
    pub direction: Vec3,
    /// Extent in steradians; at least one texel.
    pub solid_angle: f32,
    /// ∫ L dω over the area, per channel.
    pub energy: [f64; 3],
    /// Share of the panorama's luminance energy, 0 to 1.
    pub share: f32,
    /// Mean radiance, linear Rec. 709.
    pub color: [f32; 3],
}

impl Area {
    /// Radius in degrees of a disc with the same solid angle.
    pub fn radius_deg(&self) -> f32 {
        let cosine = 1.0 - self.solid_angle / std::f32::consts::TAU;
        cosine.clamp(-1.0, 1.0).acos().to_degrees()
    }

    /// The nearest usable lamp in the rotated environment and the angle to it in degrees; `None` if no lamp is
    /// usable.
    pub fn lamp(&self, rig: &Rig, turn: Quat) -> Option<(usize, f32)> {
        let direction = turn * self.direction;
        let usable = rig.lamps.iter().enumerate().filter(|(_, lamp)| lamp.is_usable());
        usable
            .map(|(i, lamp)| (i, direction.angle_between(lamp.direction).to_degrees()))
            .min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// The `count` areas with the most luminance energy, in descending order; fewer if the panorama has fewer. They do
/// not overlap, so their shares add up to at most 1. Deterministic.
pub fn areas(environment: &Environment, count: usize) -> Vec<Area> {
    if environment.radiance.width > WIDTH {
        return areas(&environment.reduced(WIDTH), count);
    }
    let (width, height) = environment.radiance.size();
    let pixels = &environment.radiance.pixels;
    let levels: Vec<f32> = pixels.iter().map(|&p| luminance(p)).collect();
    let peaks = peaks(&levels, width);
    let mut sums: Vec<Sum> = Vec::new();
    // The index of each peak's sum.
    let mut of_peak = vec![usize::MAX; pixels.len()];
    let mut total = 0.0;
    for (i, (&level, &peak)) in levels.iter().zip(&peaks).enumerate() {
        let solid_angle = texel_solid_angle(i / width, width, height);
        total += solid_angle * f64::from(level);
        if level <= 0.0 || level < EDGE * levels[peak] {
            continue;
        }
        if of_peak[peak] == usize::MAX {
            of_peak[peak] = sums.len();
            sums.push(Sum::default());
        }
        let sum = &mut sums[of_peak[peak]];
        let energy = pixels[i].map(|v| solid_angle * f64::from(v));
        let towards = texel_direction(i % width, i / width, width, height);
        sum.solid_angle += solid_angle;
        sum.luminance += solid_angle * f64::from(level);
        sum.middle += solid_angle * f64::from(level) * towards.as_dvec3();
        sum.energy = std::array::from_fn(|c| sum.energy[c] + energy[c]);
    }
    sums.sort_by(|a, b| b.luminance.total_cmp(&a.luminance));
    sums.into_iter()
        .take(count)
        .map(|sum| Area {
            // A uniform sky has no centre.
            direction: sum.middle.normalize_or(DVec3::Y).as_vec3(),
            solid_angle: sum.solid_angle as f32,
            energy: sum.energy,
            share: (sum.luminance / total) as f32,
            color: sum.energy.map(|v| (v / sum.solid_angle) as f32),
        })
        .collect()
}

/// Sums over an area.
#[derive(Default)]
struct Sum {
    energy: [f64; 3],
    luminance: f64,
    solid_angle: f64,
    middle: DVec3,
}

/// Peak of the area that each texel belongs to.
fn peaks(levels: &[f32], width: usize) -> Vec<usize> {
    let height = levels.len() / width.max(1);
    let mut order: Vec<usize> = (0..levels.len()).collect();
    order.par_sort_unstable_by(|&a, &b| levels[b].total_cmp(&levels[a]).then(a.cmp(&b)));
    // A forest whose roots are peaks. Texels not visited yet are `usize::MAX`.
    let mut parent = vec![usize::MAX; levels.len()];
    for &texel in &order {
        let mut touched = [usize::MAX; 8];
        let mut count = 0;
        for neighbour in neighbours(texel, width, height) {
            if parent[neighbour] != usize::MAX {
                let root = root(&mut parent, neighbour);
                if !touched[..count].contains(&root) {
                    touched[count] = root;
                    count += 1;
                }
            }
        }
        let higher = |&a: &usize, &b: &usize| levels[a].total_cmp(&levels[b]).then(b.cmp(&a));
        let Some(highest) = touched[..count].iter().copied().max_by(higher) else {
            parent[texel] = texel;
            continue;
        };
        parent[texel] = highest;
        for &other in touched[..count].iter().filter(|&&other| other != highest) {
            if levels[texel] >= SADDLE * levels[other] {
                parent[other] = highest;
            }
        }
    }
    (0..levels.len()).map(|texel| root(&mut parent, texel)).collect()
}

fn root(parent: &mut [usize], mut texel: usize) -> usize {
    while parent[texel] != texel {
        parent[texel] = parent[parent[texel]];
        texel = parent[texel];
    }
    texel
}

/// The eight neighbours, wrapped across the seam and the poles.
fn neighbours(texel: usize, width: usize, height: usize) -> impl Iterator<Item = usize> {
    let (x, y) = (texel % width, texel / width);
    [-1i64, 0, 1].into_iter().flat_map(move |dy| {
        [width - 1, 0, 1].into_iter().filter(move |dx| dy != 0 || *dx != 0).map(move |dx| {
            let row = y as i64 + dy;
            let over_pole = row < 0 || row >= height as i64;
            let row = row.clamp(0, height as i64 - 1) as usize;
            let turn = if over_pole { width / 2 } else { 0 };
            row * width + (x + dx + turn) % width
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::placed::{Kind, with_lights};
    use crate::weights::rotation;
    use crate::{Lamp, PlacedLight};
    use imaging::Image;
    use proptest::prelude::*;

    fn black(width: usize) -> Environment {
        Environment::from_radiance("", Image::filled(width, width / 2, [0.0; 3]))
    }

    fn disc(yaw_deg: f32, pitch_deg: f32, radius_deg: f32, intensity: f32) -> PlacedLight {
        PlacedLight { kind: Kind::Disc, yaw_deg, pitch_deg, radius_deg, intensity, ..PlacedLight::default() }
    }

    #[test]
    fn a_sun_is_one_area_on_the_seam_and_on_the_poles_too() {
        for (yaw, pitch) in [(180.0, 10.0), (0.0, 90.0), (12.0, -90.0), (-179.9, 80.0), (40.0, 0.0)] {
            let sun = disc(yaw, pitch, 5.0, 2.0);
            let found = areas(&with_lights(&black(512), std::slice::from_ref(&sun)), 5);
            assert_eq!(found.len(), 1, "at {yaw} {pitch}");
            let area = &found[0];
            assert!(area.direction.angle_between(sun.direction()) < 2e-3, "{area:?}");
            assert!((area.share - 1.0).abs() < 0.02 && (area.energy[0] - 2.0).abs() < 0.04);
            // Rim texels, 0.7° wide, may or may not be counted.
            assert!((area.radius_deg() - 5.0).abs() < 0.4, "{}", area.radius_deg());
        }
    }

    #[test]
    fn three_windows_are_three_areas_in_the_order_of_their_energy() {
        let windows = [disc(-100.0, 20.0, 6.0, 1.0), disc(30.0, 40.0, 3.0, 4.0), disc(170.0, -10.0, 9.0, 2.0)];
        let mut room = with_lights(&black(512), &windows);
        room.radiance.pixels.iter_mut().flatten().for_each(|v| *v += 0.01);
        let found = areas(&room, 3);
        for (area, i) in found.iter().zip([1, 2, 0]) {
            assert!(area.direction.angle_between(windows[i].direction()) < 5e-3, "{area:?}");
        }
        assert!((found[0].energy[1] / 4.0 - 1.0).abs() < 0.03, "{:?}", found[0]);
        assert_eq!(areas(&room, 1).len(), 1);
    }

    #[test]
    fn a_sun_and_its_halo_are_one_area() {
        let image = Image::from_fn(512, 256, |x, y| {
            let off = texel_direction(x, y, 512, 256).angle_between(Vec3::new(0.3, 0.5, -0.8));
            // With a grain of a tenth.
            [(1.0 + 0.1 * ((x * 7 + y * 13) % 3) as f32) * (100.0 * (-off / 0.05).exp() + 1.0); 3]
        });
        let found = areas(&Environment::from_radiance("", image), 9);
        assert_eq!(found.len(), 1, "{found:?}");
    }

    #[test]
    fn areas_fall_on_the_lamps_before_them() {
        let lamp = |at: &PlacedLight, confidence| Lamp { confidence, ..Lamp::new("", at.direction()) };
        let spots = [disc(-120.0, 0.0, 3.0, 1.0), disc(0.0, 0.0, 3.0, 1.0), disc(120.0, 0.0, 3.0, 1.0)];
        let mut rig = Rig { lamps: spots.iter().map(|spot| lamp(spot, 1.0)).collect() };
        let area = &areas(&with_lights(&black(256), &spots[1..2]), 1)[0];
        let yaw = |degrees| rotation(degrees, 0.0, 0.0);
        assert_eq!(area.lamp(&rig, yaw(0.0)).unwrap().0, 1);
        assert_eq!(area.lamp(&rig, yaw(120.0)).unwrap().0, 2);
        let (on, off) = area.lamp(&rig, yaw(-110.0)).unwrap();
        assert!(on == 0 && (off - 10.0).abs() < 0.2, "{off}");
        // A pitch over the top and down behind: 60° from both lamps, 180° from the original place.
        let (on, off) = area.lamp(&rig, rotation(0.0, 180.0, 0.0)).unwrap();
        assert!(on != 1 && (off - 60.0).abs() < 0.2, "{off}");
        rig.lamps[1].confidence = 0.0;
        assert_ne!(area.lamp(&rig, yaw(0.0)).unwrap().0, 1);
        assert_eq!(area.lamp(&Rig::default(), yaw(0.0)), None);
    }

    #[test]
    fn darkness_has_no_areas_and_an_even_sky_is_one() {
        assert!(areas(&black(64), 4).is_empty());
        let even = Environment::from_radiance("", Image::filled(64, 32, [0.5; 3]));
        let found = areas(&even, 4);
        assert!(found.len() == 1 && (found[0].share - 1.0).abs() < 1e-6);
        assert_eq!(areas(&Environment::from_radiance("", Image::filled(1, 1, [1.0; 3])), 2).len(), 1);
    }

    proptest! {
        #[test]
        fn a_turn_moves_the_areas(shift in 0usize..96, seed in 0u32..20) {
            let image = Image::from_fn(96, 48, |x, y| {
                let hash = (x as u32 / 6 + 31 * (y as u32 / 6) + 7 * seed).wrapping_mul(2_654_435_761) >> 16;
                // All texels differ, so position never breaks a tie.
                [(hash % 100) as f32 / 10.0 + (x * 48 + y) as f32 * 1e-5; 3]
            });
            let turned = Image::from_fn(96, 48, |x, y| image.at((x + 96 - shift) % 96, y));
            let (a, b) = (Environment::from_radiance("", image), Environment::from_radiance("", turned));
            let (a, b) = (areas(&a, 400), areas(&b, 400));
            prop_assert_eq!(a.len(), b.len());
            let energy = |areas: &[Area]| areas.iter().map(|a| a.energy[1]).sum::<f64>();
            prop_assert!((energy(&a) - energy(&b)).abs() < 1e-9 * energy(&a));
            prop_assert!(a.iter().map(|a| f64::from(a.share)).sum::<f64>() <= 1.0 + 1e-5);
            // The first area, where it leads by more than rounding.
            if a[0].share > 1.001 * a.get(1).map_or(0.0, |a| a.share) {
                let turn = Quat::from_rotation_y(-(shift as f32) / 96.0 * std::f32::consts::TAU);
                prop_assert!((turn * a[0].direction).angle_between(b[0].direction) < 1e-3);
            }
        }
    }
}
