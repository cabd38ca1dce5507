//! Weights: an environment as one number per lamp and channel.
//!
//! A picture under the environment is Σ_i w_i · OLAT_i with w_i = (energy of the environment given to
//! lamp i) / e_i. Who gets the energy from a direction is a [`Partition`] of the sphere, made once for
//! a rig: a yaw of the environment then only shifts columns.

mod hull;

use super::latlong::{texel_direction, texel_solid_angle};
use super::{Environment, Rig};
use glam::DVec3;
use hull::Hull;
use rayon::prelude::*;
use std::f64::consts::PI;

/// An environment in terms of a rig.
#[derive(Clone, Debug, PartialEq)]
pub struct LightWeights {
    /// For each lamp and channel the factor on its OLAT: finite and not negative.
    pub per_lamp: Vec<[f32; 3]>,
    /// Share of the environment's luminance energy that comes from where the rig has no lamp, 0 to 1.
    pub uncovered: f32,
}

impl LightWeights {
    /// Weights by [`Partition::soft`]. Where many yaws are asked for, make the partition once.
    pub fn soft(environment: &Environment, rig: &Rig, yaw_deg: f32) -> Self {
        Partition::soft(rig, Partition::WIDTH).weights(environment, yaw_deg)
    }
}

/// Which lamps stand for which direction, for every texel of a panorama.
pub struct Partition {
    width: usize,
    height: usize,
    /// The nodes that share each texel's energy, texel after texel: shares are not negative and add up
    /// to 1 for each.
    shares: Vec<(u16, f32)>,
    /// Where each texel's part of `shares` ends.
    ends: Vec<u32>,
    /// Per texel whether lamps surround it.
    covered: Vec<bool>,
    /// Per node the lamps that its energy goes to; shares add up to 1.
    nodes: Vec<Vec<(usize, f64)>>,
    lamp_energy: Vec<[f32; 3]>,
}

impl Partition {
    /// Columns of the panorama that weights are computed at: 1.4° a texel, a tenth of the spacing of 100
    /// lamps, and small enough for a turn of the environment to cost well under a millisecond.
    pub const WIDTH: usize = 256;

    /// The default. Spherical Voronoi cells whose borders are soft: a lamp at angle θ from a texel gets a
    /// share ∝ exp(−(θ² − θ₀²) / 2σ²), where θ₀ is the nearest lamp's angle and σ a fifth of the lamps'
    /// spacing. A small light goes to one bank of lamps, as in [`Self::cells`], and moves on continuously
    /// as it turns, as in [`Self::smooth`], which spreads it over three banks.
    pub fn soft(rig: &Rig, width: usize) -> Self {
        let nodes = Nodes::of(rig);
        let sigma = 0.2 * nodes.spacing();
        Self::build(rig, width, &nodes, |nodes, direction, _, _| {
            let angles: Vec<f64> = nodes
                .real()
                .map(|lamp| direction.angle_between(*lamp))
                .collect();
            let nearest = angles.iter().copied().fold(f64::INFINITY, f64::min);
            let softness =
                |angle: f64| (-(angle * angle - nearest * nearest) / (2.0 * sigma * sigma)).exp();
            // What is left out below falls to 0 continuously.
            let raw = angles
                .iter()
                .map(|&angle| (softness(angle) - 1e-4).max(0.0));
            let raw: Vec<(usize, f64)> =
                raw.enumerate().filter(|(_, share)| *share > 0.0).collect();
            let sum: f64 = raw.iter().map(|(_, share)| share).sum();
            raw.into_iter()
                .map(|(node, share)| (node as u16, (share / sum) as f32))
                .collect()
        })
    }

    /// Barycentric shares on the convex hull of the lamps' directions. Lamps in one direction share
    /// equally. Where a rig leaves a gap, the gap's energy goes to the lamps around it and counts as
    /// uncovered.
    pub fn smooth(rig: &Rig, width: usize) -> Self {
        let nodes = Nodes::of(rig);
        Self::build(rig, width, &nodes, |_, _, corners, shares| {
            [0, 1, 2]
                .map(|i| (corners[i] as u16, shares[i] as f32))
                .to_vec()
        })
    }

    /// The spherical Voronoi cells of the lamps' directions: all of a texel goes to the nearest lamp, and
    /// a small sun jumps from lamp to lamp as it turns.
    pub fn cells(rig: &Rig, width: usize) -> Self {
        let nodes = Nodes::of(rig);
        Self::build(rig, width, &nodes, |nodes, direction, _, _| {
            let nearest = nodes
                .real()
                .enumerate()
                .max_by(|(_, a), (_, b)| a.dot(direction).total_cmp(&b.dot(direction)));
            vec![(nearest.map_or(0, |(node, _)| node as u16), 1.0)]
        })
    }

    fn build(
        rig: &Rig,
        width: usize,
        nodes: &Nodes,
        share: impl Fn(&Nodes, DVec3, [usize; 3], [f64; 3]) -> Vec<(u16, f32)> + Sync,
    ) -> Self {
        let height = (width / 2).max(1);
        let lamp_energy = rig.lamps.iter().map(|lamp| lamp.energy).collect();
        if nodes.lamps.is_empty() {
            let (shares, ends, covered) = (vec![], vec![], vec![]);
            return Self {
                width,
                height,
                shares,
                ends,
                covered,
                nodes: vec![],
                lamp_energy,
            };
        }
        let hull = Hull::of(&nodes.directions);
        let (texels, covered): (Vec<_>, Vec<_>) = (0..width * height)
            .into_par_iter()
            .map(|i| {
                let direction = texel_direction(i % width, i / width, width, height).as_dvec3();
                let (facet, shares) = hull.locate(direction);
                let covered = facet
                    .corners
                    .iter()
                    .all(|&corner| corner < nodes.lamps.len());
                (share(nodes, direction, facet.corners, shares), covered)
            })
            .unzip();
        let ends = texels.iter().scan(0, |end, shares| {
            *end += shares.len() as u32;
            Some(*end)
        });
        let (ends, shares) = (ends.collect(), texels.concat());
        Self {
            width,
            height,
            shares,
            ends,
            covered,
            nodes: nodes.lamp_shares(&hull),
            lamp_energy,
        }
    }

    /// The weights of an environment turned by `yaw_deg`; positive moves its content towards larger u.
    /// An environment of another size than the partition is brought to it first: for a live turn do that
    /// once, with [`Environment::reduced`] to [`Self::WIDTH`].
    pub fn weights(&self, environment: &Environment, yaw_deg: f32) -> LightWeights {
        let mut per_lamp = vec![[0.0; 3]; self.lamp_energy.len()];
        if environment.radiance.size() != (self.width, self.height) {
            return self.weights(&environment.reduced(self.width), yaw_deg);
        }
        if self.nodes.is_empty() {
            let dark = environment.energy().into_iter().all(|e| e == 0.0);
            return LightWeights {
                per_lamp,
                uncovered: if dark { 0.0 } else { 1.0 },
            };
        }
        let (node_energy, uncovered_energy) = self.gather(environment, yaw_deg);
        let mut energy = vec![[0.0f64; 3]; self.lamp_energy.len()];
        let mut total = [0.0f64; 3];
        for (node, from) in self.nodes.iter().zip(&node_energy) {
            for c in 0..3 {
                total[c] += from[c];
                for &(lamp, share) in node {
                    energy[lamp][c] += share * from[c];
                }
            }
        }
        for ((weight, energy), lamp) in per_lamp.iter_mut().zip(&energy).zip(&self.lamp_energy) {
            for c in 0..3 {
                if energy[c] > 0.0 {
                    weight[c] = (energy[c] / f64::from(lamp[c])).min(f64::from(f32::MAX)) as f32;
                }
            }
        }
        let (all, uncovered) = (luminance(total), luminance(uncovered_energy));
        LightWeights {
            per_lamp,
            uncovered: if all > 0.0 {
                (uncovered / all).min(1.0) as f32
            } else {
                0.0
            },
        }
    }

    /// Each node's energy, and the energy from uncovered directions.
    fn gather(&self, environment: &Environment, yaw_deg: f32) -> (Vec<[f64; 3]>, [f64; 3]) {
        let turn = f64::from(yaw_deg).rem_euclid(360.0) / 360.0 * self.width as f64;
        let turn = if turn.is_finite() { turn } else { 0.0 };
        let (shift, fraction) = (turn as usize, (turn - turn.floor()) as f32);
        let mut node_energy = vec![[0.0f64; 3]; self.nodes.len()];
        let mut uncovered = [0.0f64; 3];
        let mut start = 0;
        for (y, row) in environment
            .radiance
            .pixels
            .chunks_exact(self.width)
            .enumerate()
        {
            let solid_angle = texel_solid_angle(y, self.width, self.height);
            // A turn by part of a column shares each texel's light between two columns.
            let mut from = (2 * self.width - shift - 1) % self.width;
            for x in 0..self.width {
                let before = row[from];
                from = if from + 1 == self.width { 0 } else { from + 1 };
                let energy: [f64; 3] = std::array::from_fn(|c| {
                    solid_angle
                        * (f64::from(fraction * before[c])
                            + f64::from((1.0 - fraction) * row[from][c]))
                });
                let texel = y * self.width + x;
                let end = self.ends[texel] as usize;
                for &(node, share) in &self.shares[start..end] {
                    for c in 0..3 {
                        node_energy[node as usize][c] += f64::from(share) * energy[c];
                    }
                }
                start = end;
                if !self.covered[texel] {
                    for c in 0..3 {
                        uncovered[c] += energy[c];
                    }
                }
            }
        }
        (node_energy, uncovered)
    }
}

/// Relative luminance (ITU-R BT.709) of an energy.
fn luminance([r, g, b]: [f64; 3]) -> f64 {
    0.2126 * r + 0.7152 * g + 0.0722 * b
}

/// The corners of the hull: first the directions that hold lamps, then points that fill the gaps.
struct Nodes {
    directions: Vec<DVec3>,
    /// For each direction that holds lamps, which: more than one where lamps coincide.
    lamps: Vec<Vec<usize>>,
}

impl Nodes {
    /// Lamps closer together than this are in one direction: the ball does not tell them apart.
    const SAME_DEG: f64 = 0.5;

    fn of(rig: &Rig) -> Self {
        let mut nodes = Self {
            directions: vec![],
            lamps: vec![],
        };
        let same = Self::SAME_DEG.to_radians().cos();
        for (i, lamp) in rig
            .lamps
            .iter()
            .enumerate()
            .filter(|(_, lamp)| lamp.is_usable())
        {
            let direction = lamp.direction.as_dvec3().normalize();
            match nodes
                .directions
                .iter()
                .position(|d| d.dot(direction) > same)
            {
                Some(node) => nodes.lamps[node].push(i),
                None => {
                    nodes.directions.push(direction);
                    nodes.lamps.push(vec![i]);
                }
            }
        }
        if !nodes.lamps.is_empty() {
            nodes.fill_gaps();
        }
        nodes
    }

    /// The directions that hold lamps.
    fn real(&self) -> impl Iterator<Item = &DVec3> {
        self.directions[..self.lamps.len()].iter()
    }

    /// The median angle from a lamp to its nearest neighbour in radians; a right angle for a lone lamp or none.
    fn spacing(&self) -> f64 {
        let nearest = |lamp: &DVec3| {
            let others = self.real().filter(|other| *other != lamp);
            others
                .map(|other| lamp.angle_between(*other))
                .fold(PI / 2.0, f64::min)
        };
        let mut spacings: Vec<f64> = self.real().map(nearest).collect();
        spacings.sort_by(f64::total_cmp);
        let median = spacings.get(spacings.len() / 2).copied();
        median.unwrap_or(PI / 2.0)
    }

    /// Adds points until no gap is left. A gap is an empty cap of twice the radius that N caps have which
    /// share the sphere evenly, or of 75° if that is less: caps under 90° keep the origin inside the hull.
    fn fill_gaps(&mut self) {
        let even = (1.0 - 2.0 / self.lamps.len() as f64).acos();
        let limit = (2.0 * even).min(75.0 * PI / 180.0).cos();
        let candidates: Vec<DVec3> = (0..96 * 48)
            .map(|i| texel_direction(i % 96, i / 96, 96, 48).as_dvec3())
            .collect();
        // The cosine of the angle to the nearest node, for each candidate.
        let mut nearest = vec![-1.0f64; candidates.len()];
        let mut known = 0;
        loop {
            for node in &self.directions[known..] {
                for (nearest, candidate) in nearest.iter_mut().zip(&candidates) {
                    *nearest = nearest.max(node.dot(*candidate));
                }
            }
            known = self.directions.len();
            let emptiest = (0..candidates.len())
                .min_by(|&i, &j| nearest[i].total_cmp(&nearest[j]))
                .unwrap_or(0);
            if nearest[emptiest] >= limit {
                return;
            }
            self.directions.push(candidates[emptiest]);
        }
    }

    /// Where each node's energy goes. A point that fills a gap hands its own on in equal parts to its
    /// neighbours on the hull, and so on until lamps have it all.
    fn lamp_shares(&self, hull: &Hull) -> Vec<Vec<(usize, f64)>> {
        let (all, real) = (self.directions.len(), self.lamps.len());
        let mut neighbours = vec![vec![]; all];
        for [a, b, c] in hull.facets.iter().map(|facet| facet.corners) {
            // Around a node every neighbour follows once in the sense of rotation.
            for (from, to) in [(a, b), (b, c), (c, a)] {
                neighbours[from].push(to);
            }
        }
        let mut shares = vec![vec![0.0; real]; all];
        for (node, shares) in shares.iter_mut().enumerate().take(real) {
            shares[node] = 1.0;
        }
        // Gauss–Seidel on "each filler is the mean of its neighbours": a thousand rounds are more than
        // gaps of a few hundred fillers need, and the sums are made exact below.
        for _ in 0..1000 {
            let mut change = 0.0f64;
            for node in real..all {
                let mut mean = vec![0.0; real];
                for &neighbour in &neighbours[node] {
                    mean.iter_mut()
                        .zip(&shares[neighbour])
                        .for_each(|(sum, share)| *sum += share);
                }
                let count = neighbours[node].len().max(1) as f64;
                for (share, sum) in shares[node].iter_mut().zip(mean) {
                    change = change.max((sum / count - *share).abs());
                    *share = sum / count;
                }
            }
            if change < 1e-9 {
                break;
            }
        }
        shares
            .iter()
            .map(|shares| {
                let sum: f64 = shares.iter().sum();
                let given = self
                    .lamps
                    .iter()
                    .zip(shares)
                    .filter(|(_, share)| **share > 0.0);
                given
                    .flat_map(|(lamps, share)| {
                        lamps
                            .iter()
                            .map(move |&l| (l, share / sum / lamps.len() as f64))
                    })
                    .collect()
            })
            .collect()
    }
}

#[cfg(test)]
mod tests;
