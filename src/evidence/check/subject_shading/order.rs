//! The OLATs' order, by the correlations that the lamps' directions let expect.

use super::fault::{Fault, Kind};
use super::measured::Shading;
use calibration::cholesky::Cholesky;
use glam::DVec3;
use std::f64::consts::PI;

/// Number of normals in view of the camera.
const NORMALS: usize = 400;
/// Variance that the kernel does not explain: share of an OLAT's own, and absolute, where a lamp that faces all
/// normals has about 1/2.
const UNEXPLAINED: [f64; 2] = [0.03, 1e-4];
/// Least gains of another order, in units of the median OLAT's cost: in all poses together, and in one.
const GAIN: [f64; 2] = [1.0, 2.5];
/// Least gain by the lamps' directions of an order that the other poses let expect, in the same units. A lamp that shoulder
/// or hand shades in one pose has less. From shoots drawn at random (seeds 101 to 160).
const BY_DIRECTIONS: f64 = 0.5;
/// Share of the brightest lamp's light on a convex subject below which a lamp is behind it.
const BEHIND: f64 = 0.1;
/// Height of the directions of lamps below the subject.
const BELOW: f64 = -0.85;
/// Most changes of order that are named singly.
const CHANGES: usize = 4;

/// Covariance of the OLATs of some lamps.
pub struct Kernel {
    /// Standard deviation of each OLAT.
    pub deviations: Vec<f64>,
    /// True for lamps behind or below the subject, which head and shoulders hide in ways that are not known: behind, a lamp
    /// lights a convex subject less than a tenth as much as the brightest.
    pub hidden: Vec<bool>,
    /// Correlations, row by row.
    correlations: Vec<f64>,
    /// Inverse of the correlations and the unexplained variance.
    inverse: Vec<f64>,
}

/// A change of the order, of places `from` to `to`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Change {
    from: usize,
    to: usize,
    turn: Turn,
}

/// A pose in an order of its OLATs.
struct Ordered {
    /// Correlations of the OLATs, row by row.
    measured: Vec<f64>,
    /// True for black OLATs, which tell nothing of their order.
    black: Vec<bool>,
    /// Place of each lamp's OLAT in the given order.
    places: Vec<usize>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Turn {
    /// The first and the last of them are exchanged.
    Exchange,
    /// All move one place on; the last takes the first place.
    On,
    /// All move one place back; the first takes the last place.
    Back,
}

impl Kernel {
    /// The covariance of lamps in these directions; None if it is singular.
    pub fn new(directions: &[DVec3]) -> Option<Self> {
        let count = directions.len();
        let lit: Vec<Vec<f64>> = directions.iter().map(|lamp| matt(*lamp)).collect();
        let pairs = || (0..count).flat_map(|i| (0..count).map(move |j| (i, j)));
        let shadow = |i: usize, j: usize| 1.0 - directions[i].angle_between(directions[j]) / PI;
        let covariance: Vec<f64> = pairs().map(|(i, j)| dot(&lit[i], &lit[j])).collect();
        // A lamp exactly behind the subject lights no normal.
        let deviations: Vec<f64> = (0..count).map(|i| covariance[i * count + i].max(1e-9).sqrt()).collect();
        let correlations: Vec<f64> = pairs()
            .map(|(i, j)| {
                let explained = covariance[i * count + j] / (deviations[i] * deviations[j]);
                if i == j { 1.0 } else { explained * shadow(i, j) }
            })
            .collect();
        let brightest = deviations.iter().fold(0.0, |a: f64, b| a.max(*b));
        let is_behind = |lamp: usize| deviations[lamp].powi(2) < BEHIND * brightest.powi(2);
        let hidden = (0..count).map(|lamp| is_behind(lamp) || directions[lamp].y < BELOW).collect();
        Self::inverted(deviations, hidden, correlations)
    }

    fn inverted(deviations: Vec<f64>, hidden: Vec<bool>, correlations: Vec<f64>) -> Option<Self> {
        let [share, least] = UNEXPLAINED;
        let count = deviations.len();
        let mut noisy = correlations.clone();
        for (i, deviation) in deviations.iter().enumerate() {
            noisy[i * count + i] += share + least / deviation.powi(2);
        }
        let inverse = Cholesky::new(noisy, count)?.inverse();
        Some(Self { deviations, hidden, correlations, inverse })
    }

    /// The covariance by the other poses: sharper than by the directions, as it has the subject's own shape and shadows.
    /// None with too few to tell which pose is at fault.
    fn beside(&self, poses: &[Ordered], pose: usize) -> Option<Self> {
        const FEWEST: usize = 3;
        let others = poses.iter().enumerate().filter(|(other, _)| *other != pose);
        let others: Vec<&Ordered> = others.map(|(_, other)| other).collect();
        if others.len() < FEWEST {
            return None;
        }
        Self::inverted(self.deviations.clone(), self.hidden.clone(), mean(others))
    }

    fn count(&self) -> usize {
        self.deviations.len()
    }

    /// Each OLAT's root-mean-square light, as a share of the one that the others let expect (Rasmussen and Williams
    /// 2006, section 5.4.2). `products` are sums of the products of two OLATs.
    pub fn shares(&self, products: &[f64]) -> Vec<f64> {
        let n = self.count();
        let weights = |i: usize| {
            let weight = move |j: usize| {
                let weight = -self.inverse[i * n + j] * self.deviations[i] / self.deviations[j];
                if i == j { 0.0 } else { weight / self.inverse[i * n + i] }
            };
            (0..n).map(weight).collect::<Vec<f64>>()
        };
        let expected = |i: usize| {
            let weights = weights(i);
            let rows = products.chunks(n).zip(&weights);
            rows.map(|(row, weight)| weight * dot(row, &weights)).sum::<f64>()
        };
        (0..n).map(|i| (products[i * n + i] / expected(i).max(f64::MIN_POSITIVE)).sqrt()).collect()
    }

    /// Correlations of the OLATs of a pose from sums of the products of two. Black OLATs are filled in.
    fn measured(&self, products: &[f64], black: &[bool]) -> Vec<f64> {
        let n = self.count();
        let filled = |i: usize| black[i] || products[i * n + i] <= 0.0;
        let norm = |i: usize| products[i * n + i].sqrt();
        let value = |i: usize, j: usize| {
            if filled(i) || filled(j) {
                self.correlations[i * n + j]
            } else {
                products[i * n + j] / (norm(i) * norm(j))
            }
        };
        (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).map(|(i, j)| value(i, j)).collect()
    }

    /// Faults of the OLATs' order, and for each pose the place of every lamp's OLAT. `lamps` are the lamps' indices in
    /// the rig.
    pub fn faults(&self, lamps: &[usize], poses: &[Shading], black: &[Vec<bool>]) -> (Vec<Fault>, Vec<Vec<usize>>) {
        let places: Vec<usize> = (0..self.count()).collect();
        let mut poses: Vec<Ordered> = (poses.iter().zip(black))
            .map(|(pose, black)| Ordered {
                measured: self.measured(&pose.products, black),
                black: black.clone(),
                places: places.clone(),
            })
            .collect();
        let all: Vec<usize> = (0..poses.len()).collect();
        let [together, single] = GAIN;
        let least = if all.len() > 1 { together } else { single };
        let mut faults = self.changes(self, lamps, &mut poses, &all, least);
        if all.len() > 1 {
            for &pose in &all {
                let beside = self.beside(&poses, pose);
                let kernel = beside.as_ref().unwrap_or(self);
                let found = self.changes(kernel, lamps, &mut poses[pose..=pose], &[pose], single);
                for fault in found {
                    match faults.iter_mut().find(|f: &&mut Fault| f.kind == fault.kind) {
                        Some(same) => same.poses.extend(fault.poses),
                        None => faults.push(fault),
                    }
                }
            }
        }
        (faults, poses.into_iter().map(|pose| pose.places).collect())
    }

    /// Finds changes of order that all of these poses share by a kernel, and by the directions too, and undoes them.
    fn changes(
        &self,
        kernel: &Self,
        lamps: &[usize],
        ordered: &mut [Ordered],
        poses: &[usize],
        least: f64,
    ) -> Vec<Fault> {
        let mut faults = Vec::new();
        for round in 0.. {
            let mean = mean(ordered.iter().collect());
            let black: Vec<bool> = (0..self.count()).map(|i| ordered.iter().all(|pose| pose.black[i])).collect();
            let (change, gain) = kernel.best(&mean, &black);
            let changed = change.applied(&mean, self.count());
            let unit = kernel.median_cost(&changed);
            let against = |pose: &Ordered| kernel.gain(&pose.measured, change) < -least * unit;
            let by_directions = self.gain(&mean, change) / self.median_cost(&changed);
            if gain < least * unit || by_directions < BY_DIRECTIONS || ordered.iter().any(against) {
                break;
            }
            let disordered = round == CHANGES;
            if disordered {
                faults.clear();
            }
            let kind = if disordered { Kind::Disordered } else { change.kind(lamps) };
            let certain = disordered || gain > 2.0 * least * unit;
            faults.push(Fault { kind, poses: poses.to_vec(), certain });
            if disordered {
                break;
            }
            for pose in &mut *ordered {
                pose.measured = change.applied(&pose.measured, self.count());
                pose.black = (0..self.count()).map(|i| pose.black[change.source(i)]).collect();
                pose.places = (0..self.count()).map(|i| pose.places[change.source(i)]).collect();
            }
        }
        faults
    }

    /// The change of order with the largest gain.
    fn best(&self, measured: &[f64], black: &[bool]) -> (Change, f64) {
        let n = self.count();
        let exchanges = (0..n).flat_map(|from| (from + 1..n).map(move |to| Change { from, to, turn: Turn::Exchange }));
        let exchanges = exchanges.filter(|change| !black[change.from] && !black[change.to]);
        // A picture too few or too many moves all before or after it.
        let ends = (2..n).map(|to| (0, to)).chain((1..n - 2).map(|from| (from, n - 1)));
        let turns = ends.flat_map(|(from, to)| [Turn::On, Turn::Back].map(|turn| Change { from, to, turn }));
        let gains = exchanges.chain(turns).map(|change| (change, self.gain(measured, change)));
        gains.max_by(|a, b| a.1.total_cmp(&b.1)).expect("several lamps")
    }

    /// Fall of tr(K⁻¹·G) by a change of G's order.
    fn gain(&self, measured: &[f64], change: Change) -> f64 {
        let n = self.count();
        let Change { from, to, turn } = change;
        if turn == Turn::Exchange {
            let rows = |matrix: &'_ [f64], k: usize| matrix[from * n + k] - matrix[to * n + k];
            let others = (0..n).filter(|&k| k != from && k != to);
            return 2.0 * others.map(|k| rows(&self.inverse, k) * rows(measured, k)).sum::<f64>();
        }
        dot(&self.inverse, measured) - dot(&self.inverse, &change.applied(measured, n))
    }

    /// Median over the OLATs of the squared error of predicting each from the others, over its expectation.
    fn median_cost(&self, measured: &[f64]) -> f64 {
        let n = self.count();
        let cost = |i: usize| {
            let row = &self.inverse[i * n..(i + 1) * n];
            let through = measured.chunks(n).zip(row).map(|(m, weight)| weight * dot(m, row));
            through.sum::<f64>() / row[i]
        };
        let mut costs: Vec<f64> = (0..n).map(cost).collect();
        costs.sort_by(f64::total_cmp);
        costs[n / 2]
    }
}

impl Change {
    /// The place whose OLAT takes place `i`.
    fn source(self, i: usize) -> usize {
        let Self { from, to, turn } = self;
        match turn {
            _ if i < from || i > to => i,
            Turn::Exchange if i == from => to,
            Turn::Exchange if i == to => from,
            Turn::Exchange => i,
            Turn::On if i == from => to,
            Turn::On => i - 1,
            Turn::Back if i == to => from,
            Turn::Back => i + 1,
        }
    }

    /// A matrix of `n` rows in the changed order.
    fn applied(self, matrix: &[f64], n: usize) -> Vec<f64> {
        let source: Vec<usize> = (0..n).map(|i| self.source(i)).collect();
        source.iter().flat_map(|i| source.iter().map(move |j| matrix[i * n + j])).collect()
    }

    /// The fault that the change undoes.
    fn kind(self, lamps: &[usize]) -> Kind {
        let (from, to) = (lamps[self.from], lamps[self.to]);
        match self.turn {
            Turn::Exchange => Kind::Exchanged(from, to),
            Turn::On => Kind::Early(from, to),
            Turn::Back => Kind::Late(from, to),
        }
    }
}

/// Shading of even normals in view of the camera, by Lambert's law; the sum of squares is a mean.
fn matt(lamp: DVec3) -> Vec<f64> {
    // The golden angle.
    const GOLDEN: f64 = 2.399_963_229_728_653;
    let normal = |i: usize| {
        let square = (i as f64 + 0.5) / NORMALS as f64;
        let (sin, cos) = (GOLDEN * i as f64).sin_cos();
        DVec3::new(square.sqrt() * cos, square.sqrt() * sin, (1.0 - square).sqrt())
    };
    let scale = (NORMALS as f64).sqrt().recip();
    (0..NORMALS).map(|i| scale * normal(i).dot(lamp).max(0.0)).collect()
}

/// Mean of the correlations of some poses.
fn mean(poses: Vec<&Ordered>) -> Vec<f64> {
    let mut mean = vec![0.0; poses[0].measured.len()];
    for pose in &poses {
        for (sum, value) in mean.iter_mut().zip(&pose.measured) {
            *sum += value / poses.len() as f64;
        }
    }
    mean
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
