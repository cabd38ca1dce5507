//! Motion of the subject, if any, and its path in each pose, from the aligned shifts of all poses together.
//!
//! The sizes of false shifts and of the noise are those of greatest likelihood. Paths of all sizes and smoothnesses
//! are averaged, weighted by likelihood, so that the result includes the uncertainty of their size.

use super::likelihood::{Place, Problem, Series, Sizes};
use glam::Vec3;
use rayon::prelude::*;

/// Positions of the subject over time, with mean 0.
pub type Path = Vec<Place>;

/// Smallest log odds for motion. Of 73 virtual stages with a still subject (64 and 128 pixels, with and without
/// noise, JPEG and single lamps) one had 8.2, and all others less than 1.
const LOG_ODDS: f64 = 12.0;
/// Smallest number of pictures of a pose that separates a path from chance.
const LEAST: usize = 4;
/// One pixel of 256.
const PIXEL: f64 = 1.0 / 256.0;

/// A size of the model: its candidate values and its setter.
type Parameter = (&'static [f64], fn(&mut Sizes, f64));

const FACTORS: [f64; 13] = [0.01, 0.03, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0];
/// In pixels of 256.
const PRETENDED: [f64; 13] = [0.0, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8, 1.1, 1.6, 2.2, 3.5, 5.0, 8.0];
const PATHS: [f64; 6] = [0.1, 0.2, 0.4, 0.8, 1.6, 3.2];
const LENGTHS: [f64; 5] = [0.08, 0.15, 0.3, 0.6, 1.2];

const NOISE: Parameter = (&FACTORS, |sizes, v| sizes.noise = v);
const PRETENCE: [Parameter; 5] = [
    (&PRETENDED, |sizes, v| sizes.own[0] = v * PIXEL),
    (&PRETENDED, |sizes, v| sizes.own[1] = v * PIXEL),
    (&PRETENDED, |sizes, v| sizes.pose[0] = v * PIXEL),
    (&PRETENDED, |sizes, v| sizes.pose[1] = v * PIXEL),
    (&[0.0, 0.15, 0.3, 0.6, 0.85], |sizes, v| sizes.near = v),
];
const PATH: [Parameter; 2] = [(&PATHS, |sizes, v| sizes.path = v * PIXEL), (&LENGTHS, |sizes, v| sizes.length = v)];

/// Paths of all poses at times `at`, with mean 0 over these. Without certain motion they are 0, and their variances
/// cover unseen motion. `None` if the data are insufficient. `lamps` holds the direction of each picture's lamp
/// (`None` if unknown); it is `None` itself if all pictures have the same light.
pub fn find(series: &[Series], at: &[f32], lamps: Option<&[Option<Vec3>]>) -> Option<Vec<Path>> {
    if series.iter().any(|s| s.times != series.first().map_or(&[][..], |f| f.times)) {
        // Poses taken at different times, each treated separately.
        let each = series.iter().map(|one| find(std::slice::from_ref(one), at, lamps));
        let paths: Option<Vec<Vec<Path>>> = each.collect();
        return paths.map(|paths| paths.into_iter().flatten().collect());
    }
    if series.first()?.times.len() < LEAST {
        return None;
    }
    let problem = Problem::new(series, lamps)?;
    let (still, moving) = most_likely(&problem, lamps.is_some())?;
    let (log_odds, mut paths) = averaged(&problem, &still, &moving, at)?;
    if log_odds <= LOG_ODDS {
        // Possible unseen motion, including motion mistaken for the lamps' false shifts.
        let [body, head] = moving.1.pose.map(|size| size.powi(2));
        for place in paths.iter_mut().flatten() {
            for axis in 0..2 {
                place.variance[0][axis] += body;
                place.variance[1][axis] += body + head;
            }
            for (way, variance) in (place.way.iter_mut().flatten()).zip(place.variance.iter_mut().flatten()) {
                *variance += way.powi(2);
                *way = 0.0;
            }
        }
    }
    Some(paths)
}

/// Most likely sizes without a path, and with one.
fn most_likely(problem: &Problem, lit_in_turn: bool) -> Option<((f64, Sizes), (f64, Sizes))> {
    let mut start = Sizes { noise: 1.0, own: [0.0; 2], pose: [0.0; 2], near: 0.0, path: 0.0, length: 0.3 };
    let mut parameters = vec![NOISE];
    if lit_in_turn {
        start.noise = 8.0;
        start.near = 0.3;
        (start.own, start.pose) = ([0.6 * PIXEL, 1.1 * PIXEL], [0.1 * PIXEL, 0.2 * PIXEL]);
        parameters.extend(PRETENCE);
    }
    let still = climbed(problem, start, &parameters)?;
    let start = Sizes { path: 0.2 * PIXEL, ..still.1 };
    let moving = climbed(problem, start, &[&PATH, &parameters[..]].concat())?;
    Some((still, moving))
}

/// Log likelihood and sizes after each parameter in turn was set to its most likely value.
fn climbed(problem: &Problem, start: Sizes, parameters: &[Parameter]) -> Option<(f64, Sizes)> {
    const TURNS: usize = 4;
    /// Smallest gain worth another round.
    const GAIN: f64 = 0.05;
    let mut best = (problem.log_likelihood(&start)?, start);
    for _ in 0..TURNS {
        let before = best.0;
        for (values, set) in parameters {
            let tried: Vec<(f64, Sizes)> = (values.par_iter())
                .filter_map(|&value| {
                    let mut sizes = best.1;
                    set(&mut sizes, value);
                    Some((problem.log_likelihood(&sizes)?, sizes))
                })
                .collect();
            for one in tried {
                if one.0 > best.0 {
                    best = one;
                }
            }
        }
        if best.0 - before < GAIN {
            break;
        }
    }
    Some(best)
}

/// Log odds for a path, with equal prior probabilities of all sizes and lengths, and the paths averaged over them.
fn averaged(problem: &Problem, still: &(f64, Sizes), moving: &(f64, Sizes), at: &[f32]) -> Option<(f64, Vec<Path>)> {
    /// Smallest relative probability of sizes that affect the result.
    const LEAST_SHARE: f64 = 1e-3;
    let at: Vec<f64> = at.iter().map(|&t| f64::from(t)).collect();
    let all: Vec<Sizes> = PATHS
        .iter()
        .flat_map(|path| LENGTHS.map(|length| (path * PIXEL, length)))
        .map(|(path, length)| Sizes { path, length, ..moving.1 })
        .collect();
    let likelihoods: Vec<f64> =
        (all.par_iter()).map(|sizes| problem.log_likelihood(sizes).unwrap_or(f64::NEG_INFINITY)).collect();
    let most = likelihoods.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if !most.is_finite() {
        return None;
    }
    let sum: f64 = likelihoods.iter().map(|l| (l - most).exp()).sum();
    let log_odds = most + (sum / all.len() as f64).ln() - still.0;
    let probable: Vec<(f64, Vec<Path>)> = (all.par_iter().zip(&likelihoods))
        .map(|(sizes, l)| ((l - most).exp() / sum, sizes))
        .filter(|(share, _)| *share >= LEAST_SHARE)
        .filter_map(|(share, sizes)| Some((share, problem.places(sizes, &at)?)))
        .collect();
    let whole: f64 = probable.iter().map(|(share, _)| share).sum();
    let place = |pose: usize, i: usize| {
        let mut mean = Place::default();
        for which in 0..2 {
            for axis in 0..2 {
                let (mut way, mut square) = (0.0, 0.0);
                for (share, paths) in &probable {
                    let one = &paths[pose][i];
                    let share = share / whole;
                    way += share * one.way[which][axis];
                    square += share * (one.way[which][axis].powi(2) + one.variance[which][axis]);
                }
                mean.way[which][axis] = way;
                mean.variance[which][axis] = (square - way * way).max(0.0);
            }
        }
        mean
    };
    let paths = (0..problem.poses()).map(|pose| (0..at.len()).map(|i| place(pose, i)).collect()).collect();
    Some((log_odds, paths))
}

#[cfg(test)]
mod tests {
    use super::*;

    const POSES: usize = 5;
    const LAMPS: usize = 20;

    /// Shifts of all poses: the same false shifts in each, noise, and a sway of the body by `sway` pixels of 256.
    fn shifts(sway: f64) -> Vec<Vec<[f64; 4]>> {
        // Uniform in -1..1 (a multiplicative hash after Knuth).
        let chance = |i: usize| {
            let mixed = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
            (mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9) as f64 / 2f64.powi(63) - 1.0
        };
        let at = |pose: usize, lamp: usize| {
            [0, 1, 2, 3].map(|k| {
                let own = 1.5 * chance(lamp * 4 + k);
                let noise = 0.5 * chance(1000 + (pose * LAMPS + lamp) * 4 + k);
                let body = if k == 0 { sway * way(pose, lamp) } else { 0.0 };
                (own + noise + body) * PIXEL
            })
        };
        (0..POSES).map(|pose| (0..LAMPS).map(|lamp| at(pose, lamp)).collect()).collect()
    }

    fn way(pose: usize, lamp: usize) -> f64 {
        (std::f64::consts::TAU * lamp as f64 / LAMPS as f64 + 1.3 * pose as f64).sin()
    }

    fn found(shifts: &[Vec<[f64; 4]>]) -> Vec<Path> {
        let times: Vec<f32> = (0..LAMPS).map(|i| (i as f32 + 0.5) / LAMPS as f32).collect();
        let n = 4 * LAMPS;
        let noise: Vec<f64> = (0..n * n).map(|i| f64::from(i / n == i % n) * 0.1 * PIXEL * PIXEL).collect();
        let series: Vec<Series> =
            (shifts.iter()).map(|shifts| Series { times: &times, shifts, noise: &noise }).collect();
        find(&series, &times, Some(&[None; LAMPS])).unwrap()
    }

    #[test]
    fn what_every_pose_shows_alike_is_no_motion() {
        for place in found(&shifts(0.0)).iter().flatten() {
            assert_eq!(place.way, [[0.0; 2]; 2]);
            let unseen = place.variance[0][0].sqrt() / PIXEL;
            assert!((0.001..0.5).contains(&unseen), "{unseen}");
        }
    }

    #[test]
    fn a_sway_is_found_under_larger_pretence_and_within_its_deviation() {
        let (mut square, mut within) = (0.0, 0);
        for (pose, path) in found(&shifts(1.0)).iter().enumerate() {
            for (lamp, place) in path.iter().enumerate() {
                // The body's sway carries the face.
                for which in 0..2 {
                    let off = place.way[which][0] / PIXEL - way(pose, lamp);
                    let deviation = place.variance[which][0].sqrt() / PIXEL;
                    square += off * off;
                    within += usize::from(off.abs() < 2.0 * deviation);
                }
            }
        }
        let places = (2 * POSES * LAMPS) as f64;
        let left = (square / places).sqrt();
        assert!(left < 0.35, "{left} of 0.71 pixels are left");
        assert!(within as f64 > 0.85 * places, "{within} of {places}");
    }

    #[test]
    fn few_pictures_and_values_that_are_nan_tell_nothing() {
        let times = [0.1, 0.5, 0.9];
        let series = |times, shifts, noise| Series { times, shifts, noise };
        let (three, noise) = ([[0.0; 4]; 3], [0.0; 144]);
        assert!(find(&[series(&times, &three, &noise)], &times, None).is_none());
        assert!(find(&[], &times, None).is_none());
        let times = [0.1, 0.3, 0.5, 0.7, 0.9];
        let (five, noise) = ([[f64::NAN; 4]; 5], [1.0; 400]);
        assert!(find(&[series(&times, &five, &noise)], &times, None).is_none());
    }
}
