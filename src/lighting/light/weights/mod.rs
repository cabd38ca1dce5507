//! Weights: an environment as one factor per lamp and channel.
//!
//! A picture under the environment is Σ_i w_i · OLAT_i with w_i = (energy of the environment given to lamp i) /
//! e_i. A [`Partition`] of the sphere decides which lamps get the energy from a direction. It is made once per rig;
//! a yaw of the environment then only shifts columns.
//!
//! | kind | energy | a small sun that turns | sums of environments |
//! |---|---|---|---|
//! | [`Partition::cells`] | kept | jumps from lamp to lamp | linear |
//! | [`Partition::smooth`] | kept | moves continuously | linear |
//! | [`Partition::fit`] | kept | moves continuously | not linear: what a viewer sees depends on the rest |

mod fit;
mod heat;
mod hull;
pub mod least_squares;
mod nodes;
mod points;
mod sitter;
mod turned;

use super::latlong::{texel_direction, texel_solid_angle};
use super::{Environment, Rig};
use fit::{Fit, Reach};
use glam::DVec3;
use hull::Hull;
use nodes::Nodes;
use points::POINTS;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
pub use turned::rotation;

/// Kind of [`Partition`] that distributes an environment over the lamps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum Weighting {
    /// All light from a direction to the nearest lamp.
    Cells,
    /// Light from a direction to the three lamps around it.
    Smooth,
    /// Sum of lamps under which the subject looks most like it would in the environment, including dim light. Also
    /// stands in for `soft`, removed in an earlier version, in old projects and scripts.
    #[default]
    #[serde(alias = "soft")]
    #[value(alias = "soft")]
    Fit,
}

/// Largest weight. Keeps sums of lamps, brightened by an exposure, within f32.
pub const MOST: f32 = 1e25;

/// An environment expressed in a rig's lamps.
#[derive(Clone, Debug, PartialEq)]
pub struct LightWeights {
    /// Factor on each lamp's OLAT per channel, 0 to [`MOST`].
    pub per_lamp: Vec<[f32; 3]>,
    /// Share of the environment's luminance energy, 0 to 1, from directions without lamps.
    pub uncovered: f32,
}

/// Division of the sphere among lamps, for every texel of a panorama.
pub struct Partition {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Nodes that share each texel's energy, texel by texel. Shares are not negative and add up to 1; in a fit they
    /// are per steradian.
    shares: Vec<(u16, f32)>,
    /// End of each texel's range in `shares`.
    ends: Vec<u32>,
    /// True for texels that lamps surround.
    covered: Vec<bool>,
    pub(super) division: Arc<LampDivision>,
}

/// Distributes the energy of the nodes over the lamps.
pub(super) struct LampDivision {
    rule: Rule,
    lamp_energy: Vec<[f32; 3]>,
}

enum Rule {
    /// Lamps that share each node's energy; shares add up to 1.
    Shares(Vec<Vec<(usize, f64)>>),
    /// Nodes are points of the sphere; their values are the blurred radiance there.
    Fit(Box<Fit>),
}

/// Energies of a partition's nodes under a panorama.
pub(super) struct NodeEnergies {
    /// Σ share · energy per node.
    pub nodes: Vec<[f64; 3]>,
    /// Energy from directions without lamps.
    pub uncovered: [f64; 3],
    /// Energy of the full panorama.
    pub total: [f64; 3],
}

impl Partition {
    /// The partition of a kind, at [`Self::WIDTH`].
    pub fn new(weighting: Weighting, rig: &Rig) -> Self {
        let kind = match weighting {
            Weighting::Cells => Self::cells,
            Weighting::Smooth => Self::smooth,
            Weighting::Fit => Self::fit,
        };
        kind(rig, Self::WIDTH)
    }

    /// Width of the panorama that weights are computed from: 1.4° a texel, a tenth of the spacing of 100 lamps.
    /// Small enough for a rotation of the environment in well under a millisecond.
    pub const WIDTH: usize = 256;

    /// Barycentric shares on the convex hull of the lamps' directions. Lamps in one direction share equally. Energy
    /// from a gap in the rig goes to the lamps around it and counts as uncovered.
    pub fn smooth(rig: &Rig, width: usize) -> Self {
        let nodes = Nodes::from_rig(rig);
        Self::build(rig, width, &nodes, None, |_, _, corners, shares| {
            [0, 1, 2].map(|i| (corners[i] as u16, shares[i] as f32)).to_vec()
        })
    }

    /// Spherical Voronoi cells of the lamps' directions: a texel goes fully to the nearest lamp. A small sun jumps
    /// from lamp to lamp as it turns.
    pub fn cells(rig: &Rig, width: usize) -> Self {
        let nodes = Nodes::from_rig(rig);
        Self::build(rig, width, &nodes, None, |nodes, direction, _, _| {
            let nearest =
                nodes.real().enumerate().max_by(|(_, a), (_, b)| a.dot(direction).total_cmp(&b.dot(direction)));
            vec![(nearest.map_or(0, |(node, _)| node as u16), 1.0)]
        })
    }

    /// The default: the lamp energies under which simple subjects look to a viewer most like they do under the
    /// environment, per channel. The environment's energy is kept, so light in a gap of the rig is not lost. A lamp
    /// is a round blur of its spread around its direction. Unlike the other kinds it is linear only in the
    /// environment's brightness.
    pub fn fit(rig: &Rig, width: usize) -> Self {
        let nodes = Nodes::from_rig(rig);
        let reach = Reach::new();
        let fit = Fit::new(rig, &nodes);
        Self::build(rig, width, &nodes, Some(fit), |_, direction, _, _| reach.amounts(direction))
    }

    fn build(
        rig: &Rig,
        width: usize,
        nodes: &Nodes,
        fit: Option<Fit>,
        share: impl Fn(&Nodes, DVec3, [usize; 3], [f64; 3]) -> Vec<(u16, f32)> + Sync,
    ) -> Self {
        let width = width.max(1);
        let height = (width / 2).max(1);
        let lamp_energy = rig.lamps.iter().map(|lamp| lamp.energy).collect();
        let (shares, ends, covered, rule) = if nodes.lamps.is_empty() {
            (vec![], vec![], vec![], Rule::Shares(vec![]))
        } else {
            let hull = Hull::from_points(&nodes.directions);
            let (texels, covered): (Vec<_>, Vec<_>) = (0..width * height)
                .into_par_iter()
                .map(|i| {
                    let direction = texel_direction(i % width, i / width, width, height).as_dvec3();
                    let (facet, shares) = hull.locate(direction);
                    let covered = facet.corners.iter().all(|&corner| corner < nodes.lamps.len());
                    (share(nodes, direction, facet.corners, shares), covered)
                })
                .unzip();
            let ends = texels.iter().scan(0, |end, shares| {
                *end += shares.len() as u32;
                Some(*end)
            });
            let rule = match fit {
                Some(fit) => Rule::Fit(Box::new(fit)),
                None => Rule::Shares(nodes.lamp_shares(&hull)),
            };
            (texels.concat(), ends.collect(), covered, rule)
        };
        Self { width, height, shares, ends, covered, division: Arc::new(LampDivision { rule, lamp_energy }) }
    }

    /// Weights of an environment rotated by `yaw_deg`; positive moves its content towards larger u. An environment
    /// that differs in size from the partition is resized first. For a live rotation do that once, with
    /// [`Environment::reduced`] to [`Self::WIDTH`], or keep a [`super::YawTable`].
    pub fn weights(&self, environment: &Environment, yaw_deg: f32) -> LightWeights {
        if environment.radiance.size() != (self.width, self.height) {
            return self.weights(&environment.reduced(self.width), yaw_deg);
        }
        let (shift, fraction) = columns(yaw_deg, self.width);
        self.division.weights(&self.gather(|y, energies| {
            let row = &environment.radiance.pixels[y * self.width..(y + 1) * self.width];
            let solid_angle = texel_solid_angle(y, self.width, self.height);
            // A rotation by a fraction of a column splits each texel's light between two columns.
            let mut from = (2 * self.width - shift - 1) % self.width;
            for energy in energies {
                let before = row[from];
                from = if from + 1 == self.width { 0 } else { from + 1 };
                *energy = std::array::from_fn(|c| {
                    solid_angle * (fraction * f64::from(before[c]) + (1.0 - fraction) * f64::from(row[from][c]))
                });
            }
        }))
    }

    /// Energies of the nodes when `row` writes the energies of each row's texels.
    fn gather(&self, mut row: impl FnMut(usize, &mut [[f64; 3]])) -> NodeEnergies {
        let mut gathered =
            NodeEnergies { nodes: vec![[0.0f64; 3]; self.division.nodes()], uncovered: [0.0; 3], total: [0.0; 3] };
        let mut energies = vec![[0.0f64; 3]; self.width];
        for y in 0..self.height {
            row(y, &mut energies);
            for (x, energy) in energies.iter().enumerate() {
                for &(node, share) in self.texel(x, y) {
                    add(&mut gathered.nodes[usize::from(node)], f64::from(share), energy);
                }
                add(&mut gathered.total, 1.0, energy);
                if !self.is_covered(x, y) {
                    add(&mut gathered.uncovered, 1.0, energy);
                }
            }
        }
        gathered
    }

    /// Nodes that share the texel's energy; empty without lamps.
    pub(super) fn texel(&self, x: usize, y: usize) -> &[(u16, f32)] {
        let texel = y * self.width + x;
        let Some(&end) = self.ends.get(texel) else { return &[] };
        let start = if texel == 0 { 0 } else { self.ends[texel - 1] };
        &self.shares[start as usize..end as usize]
    }

    /// True if lamps surround the texel.
    pub(super) fn is_covered(&self, x: usize, y: usize) -> bool {
        self.covered.get(y * self.width + x) == Some(&true)
    }
}

impl LampDivision {
    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        match &self.rule {
            Rule::Shares(nodes) => nodes.len(),
            Rule::Fit(_) => POINTS,
        }
    }

    /// Lamp weights for the energies of the nodes.
    pub fn weights(&self, gathered: &NodeEnergies) -> LightWeights {
        let mut energy = vec![[0.0f64; 3]; self.lamp_energy.len()];
        match &self.rule {
            Rule::Shares(nodes) => {
                for (node, from) in nodes.iter().zip(&gathered.nodes) {
                    for &(lamp, share) in node {
                        add(&mut energy[lamp], share, from);
                    }
                }
            }
            Rule::Fit(fit) => {
                let solved = fit.energies(&gathered.nodes, gathered.total);
                for (lamps, from) in fit.lamps().iter().zip(&solved) {
                    for &lamp in lamps {
                        add(&mut energy[lamp], 1.0 / lamps.len() as f64, from);
                    }
                }
            }
        }
        let mut per_lamp = vec![[0.0; 3]; self.lamp_energy.len()];
        for ((weight, energy), lamp) in per_lamp.iter_mut().zip(&energy).zip(&self.lamp_energy) {
            for c in 0..3 {
                if energy[c] > 0.0 {
                    weight[c] = (energy[c] / f64::from(lamp[c])).min(f64::from(MOST)) as f32;
                }
            }
        }
        let (all, uncovered) = (luminance(gathered.total), luminance(gathered.uncovered));
        LightWeights { per_lamp, uncovered: if all > 0.0 { (uncovered / all).min(1.0) as f32 } else { 0.0 } }
    }
}

/// A yaw as whole columns of a panorama `width` wide, plus the remaining fraction of a column. A NaN or infinite
/// yaw counts as 0.
pub(super) fn columns(yaw_deg: f32, width: usize) -> (usize, f64) {
    let turn = f64::from(yaw_deg).rem_euclid(360.0) / 360.0 * width as f64;
    let turn = if turn.is_finite() { turn } else { 0.0 };
    (turn as usize % width, turn - turn.floor())
}

/// Adds a share of an energy to `to`.
fn add(to: &mut [f64; 3], share: f64, energy: &[f64; 3]) {
    for c in 0..3 {
        to[c] += share * energy[c];
    }
}

/// Relative luminance (ITU-R BT.709) of an energy.
fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

#[cfg(test)]
pub(super) mod tests;
