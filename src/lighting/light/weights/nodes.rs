//! Nodes of the hull: the rig's directions, and points that fill the gaps between them.

use super::super::Rig;
use super::super::latlong::texel_direction;
use super::hull::Hull;
use glam::DVec3;
use std::f64::consts::PI;

/// Nodes of the hull: first the directions with lamps, then the gap fillers.
pub(super) struct Nodes {
    pub directions: Vec<DVec3>,
    /// Lamps of each direction; several if lamps coincide.
    pub lamps: Vec<Vec<usize>>,
}

impl Nodes {
    /// Lamps closer than this count as one direction, because the ball cannot resolve them.
    const SAME_DEG: f64 = 0.5;

    pub fn from_rig(rig: &Rig) -> Self {
        let mut nodes = Self { directions: vec![], lamps: vec![] };
        let same = Self::SAME_DEG.to_radians().cos();
        for (i, lamp) in rig.lamps.iter().enumerate().filter(|(_, lamp)| lamp.is_usable()) {
            let direction = lamp.direction.as_dvec3().normalize();
            match nodes.directions.iter().position(|d| d.dot(direction) > same) {
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

    /// Directions with lamps.
    pub fn real(&self) -> impl Iterator<Item = &DVec3> {
        self.directions[..self.lamps.len()].iter()
    }

    /// Median angle from a lamp to its nearest neighbour in radians; a right angle for at most one lamp.
    pub fn spacing(&self) -> f64 {
        let nearest = |lamp: &DVec3| {
            let others = self.real().filter(|other| *other != lamp);
            others.map(|other| lamp.angle_between(*other)).fold(PI / 2.0, f64::min)
        };
        let mut spacings: Vec<f64> = self.real().map(nearest).collect();
        spacings.sort_by(f64::total_cmp);
        let median = spacings.get(spacings.len() / 2).copied();
        median.unwrap_or(PI / 2.0)
    }

    /// Adds points until no gap is left. A gap is an empty cap of twice the radius of N caps that share the sphere
    /// evenly, or of 75° if that is smaller: caps under 90° keep the origin inside the hull.
    fn fill_gaps(&mut self) {
        let even = (1.0 - 2.0 / self.lamps.len() as f64).acos();
        let limit = (2.0 * even).min(75.0 * PI / 180.0).cos();
        let candidates: Vec<DVec3> = (0..96 * 48).map(|i| texel_direction(i % 96, i / 96, 96, 48).as_dvec3()).collect();
        // Cosine of the angle from each candidate to its nearest node.
        let mut nearest = vec![-1.0f64; candidates.len()];
        let mut known = 0;
        loop {
            for node in &self.directions[known..] {
                for (nearest, candidate) in nearest.iter_mut().zip(&candidates) {
                    *nearest = nearest.max(node.dot(*candidate));
                }
            }
            known = self.directions.len();
            let emptiest = (0..candidates.len()).min_by(|&i, &j| nearest[i].total_cmp(&nearest[j])).unwrap_or(0);
            if nearest[emptiest] >= limit {
                return;
            }
            self.directions.push(candidates[emptiest]);
        }
    }

    /// Lamps that get each node's energy. A gap filler passes its energy on in equal parts to its neighbours on the
    /// hull, until all of it is in lamps.
    pub fn lamp_shares(&self, hull: &Hull) -> Vec<Vec<(usize, f64)>> {
        let (all, real) = (self.directions.len(), self.lamps.len());
        let mut neighbours = vec![vec![]; all];
        for [a, b, c] in hull.facets.iter().map(|facet| facet.corners) {
            // Every neighbour follows exactly once in the sense of rotation around a node.
            for (from, to) in [(a, b), (b, c), (c, a)] {
                neighbours[from].push(to);
            }
        }
        let mut shares = vec![vec![0.0; real]; all];
        for (node, shares) in shares.iter_mut().enumerate().take(real) {
            shares[node] = 1.0;
        }
        // Gauss–Seidel on "each filler is the mean of its neighbours". A few hundred fillers need fewer than a
        // thousand rounds, and the sums are made exact below.
        for _ in 0..1000 {
            let mut change = 0.0f64;
            for node in real..all {
                let mut mean = vec![0.0; real];
                for &neighbour in &neighbours[node] {
                    mean.iter_mut().zip(&shares[neighbour]).for_each(|(sum, share)| *sum += share);
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
                let given = self.lamps.iter().zip(shares).filter(|(_, share)| **share > 0.0);
                given
                    .flat_map(|(lamps, share)| lamps.iter().map(move |&l| (l, share / sum / lamps.len() as f64)))
                    .collect()
            })
            .collect()
    }
}
