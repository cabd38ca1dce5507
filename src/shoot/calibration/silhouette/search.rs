//! Circle search in a reduced picture. Edges vote along their normals for centres (the Hough transform with
//! directions, Kimme, Ballard and Sklansky 1975). The winners are ranked by the improbability of their agreeing
//! edges under chance (Desolneux, Moisan and Morel 2000), which depends neither on contrast nor on exposure.

use super::circle::Circle;
use super::edges::Edges;
use glam::{DVec2, Vec2};
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::ops::Range;

/// A circle with edges along it.
struct Candidate {
    circle: Circle,
    /// −ln of the expected number of such circles among edges of random direction.
    evidence: f64,
}

/// Ratio of radii in one round of votes.
const BAND: f32 = 1.4;
/// Range of centres outside the picture, relative to its longer side.
const MARGIN: f32 = 0.25;
/// Centres examined per round.
const PEAKS: usize = 8;
/// Radii examined per centre.
const RADII: usize = 3;
/// Number of returned candidates.
const CANDIDATES: usize = 12;
/// Largest angle between an edge's direction and the circle's radius there: a sixteenth of a half turn, so that a
/// random edge agrees once in eight times.
const AGREE_RAD: f64 = std::f64::consts::PI / 16.0;
/// Probability that a random edge within a pixel of a place on the circle agrees. One in eight where edges are
/// everywhere. Noise leaves no edge at half of the places or more, but clutter's edges are longer than one place.
const CHANCE: f64 = 0.125;

/// Circles with radii within `radii` pixels that stand out, best first. `near` limits them to the surroundings of a
/// circle: the second value is the allowed offset of centres, relative to its radius.
pub(super) fn circles(edges: &Edges, radii: Range<f32>, near: Option<(Circle, f64)>) -> Vec<Circle> {
    let bands: Vec<Range<f32>> = std::iter::successors(Some(radii.start), |r| Some(r * BAND))
        .take_while(|&r| r < radii.end)
        .map(|r| r..(r * BAND).min(radii.end))
        .collect();
    let allowed = |center: Vec2| {
        near.is_none_or(|(circle, share)| center.as_dvec2().distance(circle.center()) < share * circle.radius_px)
    };
    let mut found: Vec<Candidate> = bands
        .into_par_iter()
        .flat_map_iter(|band| {
            centers(edges, &band)
                .into_iter()
                .filter(|&center| allowed(center))
                .flat_map(|center| about(edges, center, &band))
                .collect::<Vec<_>>()
        })
        .filter(|candidate| candidate.evidence > 0.0)
        .collect();
    found.sort_by(|a, b| b.evidence.total_cmp(&a.evidence));
    let mut distinct: Vec<Candidate> = Vec::new();
    for candidate in found {
        let same = |other: &Candidate| same_circle(&candidate.circle, &other.circle);
        if distinct.len() < CANDIDATES && !distinct.iter().any(same) {
            distinct.push(candidate);
        }
    }
    distinct.into_iter().map(|c| c.circle).collect()
}

/// True if two circles are duplicates.
pub(super) fn same_circle(a: &Circle, b: &Circle) -> bool {
    let apart = a.center().distance(b.center()) + (a.radius_px - b.radius_px).abs();
    apart < 1.5 + 0.02 * a.radius_px.min(b.radius_px)
}

/// Places where most edges' normals of a band's length end.
fn centers(edges: &Edges, band: &Range<f32>) -> Vec<Vec2> {
    let margin = (MARGIN * edges.width.max(edges.height) as f32).min(band.end).ceil();
    // Votes spread with the radius, because the edges' directions are known to a few degrees: larger circles need
    // fewer cells and steps.
    let cell = (0.04 * band.start).max(1.0);
    let columns = ((edges.width as f32 + 2.0 * margin) / cell).ceil() as usize + 1;
    let rows = ((edges.height as f32 + 2.0 * margin) / cell).ceil() as usize + 1;
    let mut votes = vec![0.0f32; columns * rows];
    for edge in &edges.list {
        let mut along = band.start;
        while along < band.end {
            for reach in [-along, along] {
                let p = (edge.place + reach * edge.across + Vec2::splat(margin)) / cell;
                if p.x >= 0.0 && p.y >= 0.0 && (p.x as usize) < columns && (p.y as usize) < rows {
                    votes[p.y as usize * columns + p.x as usize] += edge.weight;
                }
            }
            along += cell;
        }
    }
    // Two means over 3×3 cells: about a Gaussian of 1.2 cells, or 5 % of the radius.
    let votes = mean_of_nine(&mean_of_nine(&votes, columns, rows), columns, rows);
    // A peak is the highest within a quarter of the radius.
    let apart = (0.25 * band.start / cell).max(1.0) as usize;
    let mut order: Vec<usize> = (0..votes.len())
        .filter(|&i| {
            let (x, y) = (i % columns, i / columns);
            votes[i] > 0.0
                && x > 0
                && y > 0
                && x + 1 < columns
                && y + 1 < rows
                && [i - 1, i + 1, i - columns, i + columns].iter().all(|&j| votes[j] <= votes[i])
        })
        .collect();
    order.sort_by(|&a, &b| votes[b].total_cmp(&votes[a]));
    let mut peaks: Vec<usize> = Vec::new();
    for i in order {
        let clear =
            |&&j: &&usize| (i % columns).abs_diff(j % columns) <= apart && (i / columns).abs_diff(j / columns) <= apart;
        if peaks.iter().find(clear).is_none() {
            peaks.push(i);
            if peaks.len() == PEAKS {
                break;
            }
        }
    }
    let place = |i: usize| Vec2::new((i % columns) as f32 + 0.5, (i / columns) as f32 + 0.5);
    peaks.into_iter().map(|i| place(i) * cell - Vec2::splat(margin)).collect()
}

fn mean_of_nine(votes: &[f32], columns: usize, rows: usize) -> Vec<f32> {
    let mut rowwise = votes.to_vec();
    for row in 0..rows {
        for x in 1..columns.saturating_sub(1) {
            let i = row * columns + x;
            rowwise[i] = (votes[i - 1] + votes[i] + votes[i + 1]) / 3.0;
        }
    }
    let mut mean = rowwise.clone();
    for i in columns..votes.len().saturating_sub(columns) {
        mean[i] = (rowwise[i - columns] + rowwise[i] + rowwise[i + columns]) / 3.0;
    }
    mean
}

/// Circles about a rough centre: the distances at which most edges face it, each circle then fitted to its edges.
fn about(edges: &Edges, center: Vec2, band: &Range<f32>) -> Vec<Candidate> {
    let (least, most) = (0.8 * band.start, 1.25 * band.end);
    // The centre is known to 5 % of the radius, and so are distances; steps of 2 %.
    let step = (0.02 * band.start).max(0.5);
    let mut histogram = vec![0.0f32; ((most - least) / step).ceil() as usize + 3];
    // The edges' own directions are off by a few degrees, plus the effect of the centre's error.
    let facing = (AGREE_RAD as f32 + 0.07).cos();
    for edge in &edges.list {
        let offset = edge.place - center;
        let distance = offset.length();
        if distance >= least && distance < most && offset.dot(edge.across).abs() > facing * distance {
            // The number of a circle's edges grows with its radius.
            histogram[((distance - least) / step) as usize + 1] += edge.weight / distance;
        }
    }
    let smooth: Vec<f32> =
        (1..histogram.len() - 1).map(|i| histogram[i - 1] + 2.0 * histogram[i] + histogram[i + 1]).collect();
    let mut peaks: Vec<usize> = (0..smooth.len())
        .filter(|&i| {
            smooth[i] > 0.0
                && (i == 0 || smooth[i] > smooth[i - 1])
                && smooth.get(i + 1).is_none_or(|&next| smooth[i] >= next)
        })
        .collect();
    peaks.sort_by(|&a, &b| smooth[b].total_cmp(&smooth[a]));
    peaks
        .into_iter()
        .take(RADII)
        .filter_map(|i| {
            let rough = Circle {
                center_px: center.as_dvec2().to_array(),
                radius_px: f64::from(least + (i as f32 + 0.5) * step),
            };
            fitted(edges, rough)
        })
        .collect()
}

/// Best-fitting circle of the edges along a rough one, and its evidence.
fn fitted(edges: &Edges, rough: Circle) -> Option<Candidate> {
    let mut circle = rough;
    for share in [0.08, 0.04, 0.02, 0.01] {
        let reach = (share * rough.radius_px).max(1.5);
        let points: Vec<DVec2> = along(edges, &circle, reach).into_iter().flatten().collect();
        circle = circle.agreed(&points, reach)?.0;
        let longest = edges.width.max(edges.height) as f64;
        if circle.radius_px > longest || circle.radius_px < 0.5 * rough.radius_px {
            return None;
        }
    }
    Some(Candidate { circle, evidence: evidence(edges, &circle) })
}

/// Nearest agreeing edge within `reach`, if any, for every place on the circle (a pixel apart) inside the picture.
fn along(edges: &Edges, circle: &Circle, reach: f64) -> Vec<Option<DVec2>> {
    let places = (TAU * circle.radius_px).ceil().max(8.0);
    let steps = reach.ceil() as i32;
    let bounds = DVec2::new(edges.width as f64, edges.height as f64);
    (0..places as usize)
        .map(|i| DVec2::from_angle(TAU * i as f64 / places))
        .filter(|towards| {
            let place = circle.center() + circle.radius_px * *towards;
            place.cmpge(DVec2::splat(2.0)).all() && place.cmple(bounds - 2.0).all()
        })
        .map(|towards| {
            // From the circle outwards and inwards, a pixel at a time.
            let offsets = (0..=2 * steps).map(|k| if k % 2 == 0 { -(k / 2) } else { (k + 1) / 2 });
            offsets
                .filter_map(|k| edges.in_pixel(circle.center() + (circle.radius_px + f64::from(k)) * towards))
                .find(|edge| {
                    let place = edge.place.as_dvec2();
                    let radial = (place - circle.center()).normalize_or_zero();
                    circle.distance(place).abs() <= reach && radial.dot(edge.across.as_dvec2()).abs() > AGREE_RAD.cos()
                })
                .map(|edge| edge.place.as_dvec2())
        })
        .collect()
}

/// −ln of the expected number of equally good circles by chance: Hoeffding's bound of the binomial tail times the
/// number of circles in a picture. Neighbouring places share the blur, so every second one counts.
fn evidence(edges: &Edges, circle: &Circle) -> f64 {
    let places = along(edges, circle, 1.0);
    let agreeing = places.iter().flatten().count();
    let tests = 3.0 * (edges.width.max(edges.height) as f64).ln();
    0.5 * places.len() as f64 * divergence(agreeing as f64 / places.len().max(1) as f64, CHANCE) - tests
}

/// Improbability per trial of a share of `share` when `chance` is expected (the Kullback–Leibler divergence of two
/// coins); 0 if it is less than expected.
pub(super) fn divergence(share: f64, chance: f64) -> f64 {
    let term = |p: f64, q: f64| if p > 0.0 { p * (p / q).ln() } else { 0.0 };
    if share <= chance {
        return 0.0;
    }
    term(share, chance) + term(1.0 - share, 1.0 - chance)
}
