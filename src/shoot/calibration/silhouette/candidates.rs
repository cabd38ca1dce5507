//! Candidate circles of the ball: searched in reduced pictures, measured at full size, best first.

use super::circle::Circle;
use super::edges::Edges;
use super::rim::{self, Rim};
use super::search;
use glam::DVec2;
use imaging::Raster;
use rayon::prelude::*;
use std::ops::RangeInclusive;

/// Longer side in pixels of the picture searched for large circles.
const COARSE_PX: usize = 320;
/// Longer side in pixels of the pictures searched for small circles.
const FINE_PX: usize = 1280;
/// Number of circles that are refined.
const PROMISING: usize = 6;
/// Radius in pixels at which the rim is resolved from reflections close to it.
const AMPLE_PX: f64 = 110.0;
/// Smallest radius in pixels that is clear in a searched picture; smaller circles use the next finer picture.
const WELL_SHOWN_PX: f32 = 10.0;
/// Smallest searched radius, so that too small a ball is recognised as such.
const BARELY_SHOWN_PX: f32 = 4.0;

/// A rim and its rank: higher is better.
pub(super) type Ranked = (Rim, f64);

/// Circles with a rim, found anywhere, best first.
pub(super) fn anywhere(pyramid: &[Raster<[f32; 3]>]) -> Vec<Rim> {
    let mut found = Vec::new();
    let coarsest = pyramid.len() - 1;
    for (level, picture) in pyramid.iter().enumerate().rev() {
        let longer = picture.width.max(picture.height);
        if level != coarsest && longer > FINE_PX {
            break;
        }
        let is_finest = level == 0 || 2 * longer > FINE_PX;
        let least = if is_finest { BARELY_SHOWN_PX } else { WELL_SHOWN_PX };
        let most = if level == coarsest { 0.75 * longer as f32 } else { 2.2 * WELL_SHOWN_PX };
        let edges = Edges::find(picture);
        let circles = search::circles(&edges, least..most, None);
        found.extend((circles.iter()).filter_map(|circle| {
            let to = ample_level(pyramid, &circle.scaled((1 << level) as f64));
            measured(pyramid, &edges, circle, to.min(level)..=level, DVec2::ZERO)
        }));
    }
    // One edge in a small picture may be two in a larger one: the rim, and a reflection close to it.
    let promising = distinct(found).into_iter().take(PROMISING);
    distinct(promising.flat_map(|rim| nearby(pyramid, &rim.circle, 0.1)).collect())
}

/// Pyramid level in which a circle is large enough to resolve its edges.
fn ample_level(pyramid: &[Raster<[f32; 3]>], circle: &Circle) -> usize {
    let halvings = (circle.radius_px / AMPLE_PX).log2().ceil().max(0.0) as usize;
    halvings.min(pyramid.len() - 1)
}

/// Circles with a rim near a given one, measured at full size: centres and radii off by up to `share` of the
/// radius.
pub(super) fn nearby(pyramid: &[Raster<[f32; 3]>], circle: &Circle, share: f64) -> Vec<Ranked> {
    let level = ample_level(pyramid, circle);
    let picture = &pyramid[level];
    let local = circle.scaled(1.0 / (1 << level) as f64);
    // The part of the picture that may contain the circle.
    let reach = DVec2::splat((1.0 + 2.5 * share) * local.radius_px + 4.0);
    let size = DVec2::new(picture.width as f64, picture.height as f64);
    let from = (local.center() - reach).floor().clamp(DVec2::ZERO, size);
    let to = (local.center() + reach).ceil().clamp(DVec2::ZERO, size);
    let part = Raster::from_fn((to.x - from.x) as usize, (to.y - from.y) as usize, |x, y| {
        picture.at(x + from.x as usize, y + from.y as usize)
    });
    if part.width < 8 || part.height < 8 {
        return Vec::new();
    }
    let edges = Edges::find(&part);
    let here = Circle { center_px: (local.center() - from).to_array(), ..local };
    let radii = (1.0 - share) * local.radius_px..(1.0 + 1.2 * share) * local.radius_px;
    let radii = radii.start as f32..radii.end as f32;
    let found = search::circles(&edges, radii, Some((here, share)));
    (std::iter::once(&here).chain(&found))
        .filter_map(|circle| measured(pyramid, &edges, circle, 0..=level, from))
        .collect()
}

/// Rim of a circle found among `edges` of the smallest picture of `levels` from place `from` on, measured up to the
/// largest.
fn measured(
    pyramid: &[Raster<[f32; 3]>],
    edges: &Edges,
    circle: &Circle,
    levels: RangeInclusive<usize>,
    from: DVec2,
) -> Option<Ranked> {
    let scale = (1 << *levels.end()) as f64;
    let moved = |circle: &Circle, by: DVec2| Circle { center_px: (circle.center() + by).to_array(), ..*circle };
    let rim = rim::fit(pyramid, &moved(circle, from).scaled(scale), levels)?;
    let rank = rank(&rim, edges, &moved(&rim.circle.scaled(1.0 / scale), -from));
    Some((rim, rank))
}

/// Circles without duplicates, best first.
pub(super) fn distinct(mut found: Vec<Ranked>) -> Vec<Rim> {
    found.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut rims: Vec<Rim> = Vec::new();
    for (rim, _) in found {
        if !rims.iter().any(|r| search::same_circle(&r.circle, &rim.circle)) {
            rims.push(rim);
        }
    }
    rims
}

/// Rank of a circle: the evidence for its rim, reduced if its steps are as faint as code steps (whose contours in a
/// lamp's glare are circles too), and up to doubled for clear edges inside, as in a mirror and unlike a grey ball
/// or a disc.
fn rank(rim: &Rim, edges: &Edges, circle: &Circle) -> f64 {
    /// Three 8-bit code values.
    const FAINT: f64 = 0.012;
    /// Edges per pixel: a few windows' worth in a ball of 30 pixels.
    const BUSY: f64 = 0.03;
    let within = 0.85 * circle.radius_px;
    let clear =
        (edges.list.iter()).filter(|e| e.weight > 0.5 && e.place.as_dvec2().distance(circle.center()) < within).count();
    let density = clear as f64 / (std::f64::consts::PI * within * within);
    let clarity = rim.contrast.powi(2) / (rim.contrast.powi(2) + FAINT.powi(2));
    rim.evidence() * clarity * (1.0 + (density / BUSY).min(1.0))
}

/// The picture, halved repeatedly until its longer side is at most [`COARSE_PX`].
pub(super) fn pyramid(picture: &Raster<[f32; 3]>) -> Vec<Raster<[f32; 3]>> {
    let mut levels = vec![picture.clone()];
    while let Some(last) = levels.last().filter(|l| l.width.max(l.height) > COARSE_PX) {
        let half = halved(last);
        levels.push(half);
    }
    levels
}

/// Means of 2×2 pixels; an odd last row or column is dropped, so that places scale by exactly two.
fn halved(picture: &Raster<[f32; 3]>) -> Raster<[f32; 3]> {
    let (width, height) = ((picture.width / 2).max(1), (picture.height / 2).max(1));
    let below = |i: usize, n: usize| (2 * i + 1).min(n - 1);
    let pixels = (0..height)
        .into_par_iter()
        .flat_map_iter(|y| {
            (0..width).map(move |x| {
                let four = [
                    picture.at(2 * x, 2 * y),
                    picture.at(below(x, picture.width), 2 * y),
                    picture.at(2 * x, below(y, picture.height)),
                    picture.at(below(x, picture.width), below(y, picture.height)),
                ];
                [0, 1, 2].map(|c| 0.25 * four.iter().map(|p| p[c]).sum::<f32>())
            })
        })
        .collect();
    Raster { width, height, pixels }
}
