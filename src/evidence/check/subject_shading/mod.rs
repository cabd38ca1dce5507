//! Agreement of the lamps with the subject: each OLAT's shading against its lamp's direction, by mirror balls or a list.
//!
//! A matt point with normal n reflects max(n·l, 0) of a distant lamp l (Woodham 1980). Over all normals in view of the
//! camera, OLATs of lamps l and m therefore correlate by k(l, m) = E[max(n·l, 0) · max(n·m, 0)] · (1 − θ/π), with θ
//! between the lamps: shading times a shadow's edge, as in the interview's light. With Gaussian pixels of that
//! covariance K, a hypothesis on the OLATs' order costs tr(K⁻¹·G), G the measured correlations, so that orders are
//! compared without the pictures (Rasmussen and Williams 2006, section 5.4). Turned or mirrored balls keep K: these
//! show in the place of the light on the subject, which is convex as a whole.

mod fault;
mod measured;
mod order;

pub(super) use measured::Shading;

use super::check::{Check, Level, Subject};
use super::pictures::Pictures;
use base::files::natural_order;
use calibration::Calibration;
use fault::{Fault, Kind};
use footage::scan::counted;
use glam::{DVec2, DVec3};
use imaging::color::luminance;
use light::Lamp;
use order::Kernel;

/// Fewest lamps whose order shows.
const FEWEST: usize = 5;
/// Share of its predicted light below which an OLAT is black, in front of the subject and where it hides the lamp.
const BLACK: f64 = 0.1;
const BLACK_HIDDEN: f64 = 0.02;
/// Share of the median OLAT's light above which no OLAT is black: a lamp may graze the subject.
const DARK: f64 = 0.003;
/// Share of its light in other poses below which an OLAT is black. The subject may shade a lamp in some poses.
const BESIDE: f64 = 0.02;
const BESIDE_HIDDEN: f64 = 0.005;
/// Share of the median OLAT's light below which no lamp is on.
const NOTHING: f64 = 5e-4;
/// Correlation of the lamps with the places of their light below which left and right are exchanged.
const MIRRORED: f64 = -0.5;
/// Least standard deviation of the lamps' directions along an axis to compare them with places.
const SPREAD: f64 = 0.1;

/// Checks that the poses' shading agrees with the lamps.
pub(super) fn check(pictures: &Pictures, calibration: &Calibration) -> Check {
    let lamps = &calibration.rig.lamps;
    let poses: Vec<&Shading> = pictures.poses.iter().map(|pose| &pose.shading).collect();
    let Some(faults) = faults(lamps, &poses) else {
        let sentence =
            format!("OLATs not compared with the lamps' directions: needs {FEWEST} lamps and the poses' mattes");
        return Check::new(Subject::Shading, Level::Unknown, sentence)
            .remedy("Photograph more lamps, and check the mattes");
    };
    let names: Vec<&str> = pictures.poses.iter().map(|pose| pose.name.as_str()).collect();
    judged(&faults, lamps, &names)
}

/// The check of some disagreements.
fn judged(faults: &[Fault], lamps: &[Lamp], poses: &[&str]) -> Check {
    const MOST: usize = 4;
    let Some(first) = faults.first() else {
        let sentence =
            format!("The subject's shading in {} agrees with the lamps' directions", counted(poses.len(), "pose"));
        return Check::new(Subject::Shading, Level::Good, sentence);
    };
    let mut sentences: Vec<String> = faults.iter().take(MOST).map(|fault| fault.sentence(lamps, poses)).collect();
    if let more @ 1.. = faults.len().saturating_sub(MOST) {
        sentences.push(format!("{more} more"));
    }
    let certain = faults.iter().any(|fault| fault.certain);
    let level = if certain { Level::Bad } else { Level::Doubtful };
    let all = first.poses.len() == poses.len();
    let check = Check::new(Subject::Shading, level, sentences.join("; "));
    Check { correction: first.correction(lamps, poses), ..check.remedy(first.kind.remedy(all)) }
}

/// All disagreements, the gravest first; None if the poses cannot tell.
fn faults(lamps: &[Lamp], poses: &[&Shading]) -> Option<Vec<Fault>> {
    let known = poses.iter().map(|pose| pose.light.len()).fold(lamps.len(), usize::min);
    let mut order: Vec<usize> = (0..known).filter(|&lamp| lamps[lamp].is_usable()).collect();
    order.sort_by(|&a, &b| natural_order(&lamps[a].name, &lamps[b].name));
    if order.len() < FEWEST || poses.is_empty() {
        return None;
    }
    let directions: Vec<DVec3> = order.iter().map(|&lamp| lamps[lamp].direction.as_dvec3()).collect();
    let energies: Vec<f64> = order.iter().map(|&lamp| f64::from(luminance(lamps[lamp].energy))).collect();
    let given: Vec<Shading> = poses.iter().map(|pose| pose.lit_by(&order, &energies)).collect();
    let is_lit = |pose: &Shading| pose.light.iter().sum::<f64>() > 0.0;
    if !given.iter().all(is_lit) {
        return None;
    }
    let kernel = Kernel::new(&directions)?;
    // The OLATs in the order found without the black ones.
    let ordered = |black: &[Vec<bool>]| {
        let (faults, places) = kernel.faults(&order, &given, black);
        let pose = |(pose, places): (&&Shading, &Vec<usize>)| {
            let lamps: Vec<usize> = places.iter().map(|&place| order[place]).collect();
            pose.lit_by(&lamps, &energies)
        };
        (faults, poses.iter().zip(&places).map(pose).collect::<Vec<Shading>>())
    };
    // A weak lamp in the place of a strong one looks black, until they are exchanged.
    let usual = black(&given, &kernel);
    let count = |black: &[Vec<bool>]| black.concat().iter().filter(|black| **black).count();
    let lit = ordered(&given.iter().map(|pose| pose.relative().map(|l| l < NOTHING).collect()).collect::<Vec<_>>());
    let (mut faults, sorted) = if count(&black(&lit.1, &kernel)) < count(&usual) { lit } else { ordered(&usual) };
    if !faults.iter().any(|fault| fault.kind == Kind::Disordered) {
        let black = black(&sorted, &kernel);
        faults.extend(mirrored(&directions, &sorted, &black));
        for (i, &lamp) in order.iter().enumerate() {
            let poses: Vec<usize> = (0..poses.len()).filter(|&pose| black[pose][i]).collect();
            if !poses.is_empty() {
                let certain = !kernel.hidden[i];
                faults.push(Fault { kind: Kind::Black(lamp), poses, certain });
            }
        }
    }
    // Lamps that no ball shows have no direction, but light in other poses.
    let relative: Vec<Vec<f64>> = poses.iter().map(|pose| pose.relative().collect()).collect();
    for lamp in (0..known).filter(|&lamp| !lamps[lamp].is_usable()) {
        let light: Vec<f64> = relative.iter().map(|relative| relative[lamp]).collect();
        let is_black = |&pose: &usize| light[pose] < NOTHING && is_dark_beside(&light, pose, true);
        let poses: Vec<usize> = (0..poses.len()).filter(is_black).collect();
        if !poses.is_empty() {
            faults.push(Fault { kind: Kind::Black(lamp), poses, certain: false });
        }
    }
    faults.sort_by_key(|fault| !fault.certain);
    Some(faults)
}

/// Black OLATs of each pose: dark beside those of other poses, or in all poses beside those of other lamps.
fn black(poses: &[Shading], kernel: &Kernel) -> Vec<Vec<bool>> {
    let lamps = 0..kernel.deviations.len();
    let relative: Vec<Vec<f64>> = poses.iter().map(|pose| pose.relative().collect()).collect();
    let shares: Vec<Vec<f64>> = poses.iter().map(|pose| kernel.shares(&pose.products)).collect();
    let hidden = &kernel.hidden;
    let never = |lamp: usize| {
        let limit = if hidden[lamp] { BLACK_HIDDEN } else { BLACK };
        shares.iter().all(|shares| shares[lamp] < limit)
    };
    let is_dark = |pose: usize, lamp: usize| relative[pose][lamp] < if hidden[lamp] { NOTHING } else { DARK };
    (0..poses.len())
        .map(|pose| {
            let beside = |lamp: usize| {
                let light: Vec<f64> = relative.iter().map(|light| light[lamp]).collect();
                is_dark_beside(&light, pose, hidden[lamp])
            };
            let is_black = |lamp| is_dark(pose, lamp) && (never(lamp) || beside(lamp));
            lamps.clone().map(is_black).collect()
        })
        .collect()
}

/// True if a lamp gives a pose much less light than the others; `light` is that of each pose. `hidden`: the subject may
/// hide the lamp.
fn is_dark_beside(light: &[f64], pose: usize, hidden: bool) -> bool {
    let others = light.iter().enumerate().filter(|(other, _)| *other != pose);
    let others: Vec<f64> = others.map(|(_, light)| *light).collect();
    let mean = others.iter().sum::<f64>() / others.len() as f64;
    let limit = if hidden { BESIDE_HIDDEN } else { BESIDE };
    // A lamp that the subject hides in another pose too is not black.
    let shown = !hidden || others.iter().all(|light| *light >= NOTHING);
    shown && light[pose] < limit * mean
}

/// Mirrored balls or poses: light from the right is found on the left of the subject, or light from above below. By the mean
/// of all poses, or in a pose while the others have it on the right side.
fn mirrored(directions: &[DVec3], poses: &[Shading], black: &[Vec<bool>]) -> Vec<Fault> {
    let along = |axis: usize| -> Vec<f64> {
        (poses.iter().zip(black))
            .map(|(pose, black)| {
                let lit = (0..directions.len()).filter(|&i| !black[i] && pose.places[i].is_finite());
                correlation(lit.map(|i| DVec2::new(directions[i][axis], pose.places[i][axis])))
            })
            .collect()
    };
    let mut faults = Vec::new();
    for (axis, kind) in [(0, Kind::Mirrored), (1, Kind::UpsideDown)] {
        let along = along(axis);
        let all: f64 = along.iter().sum();
        let count = along.len() as f64;
        let is_mirrored = |&pose: &usize| {
            let others = (all - along[pose]) / (count - 1.0);
            all / count < MIRRORED || (along[pose] < MIRRORED && others > -MIRRORED)
        };
        let poses: Vec<usize> = (0..along.len()).filter(is_mirrored).collect();
        if !poses.is_empty() {
            faults.push(Fault { kind, poses, certain: true });
        }
    }
    faults
}

/// Correlation of two quantities; 0 if the first hardly varies.
fn correlation(pairs: impl Iterator<Item = DVec2>) -> f64 {
    let pairs: Vec<DVec2> = pairs.collect();
    let mean = pairs.iter().sum::<DVec2>() / pairs.len().max(1) as f64;
    let (mut square, mut product) = (DVec2::ZERO, 0.0);
    for pair in &pairs {
        let off = *pair - mean;
        square += off * off;
        product += off.x * off.y;
    }
    let varies = (square.x / pairs.len() as f64).sqrt() > SPREAD && square.y > 0.0;
    if varies { product / (square.x * square.y).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests;
