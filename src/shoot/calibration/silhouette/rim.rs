//! The rim of a ball, measured along rays from the centre at full size.

use super::circle::Circle;
use super::search::divergence;
use glam::DVec2;
use imaging::Raster;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::ops::RangeInclusive;

/// Measurements of a circle's rim.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rim {
    pub circle: Circle,
    /// Root-mean-square distance in pixels of the rim's places from the circle.
    pub residual: f64,
    /// Share of the circumference with a rim beyond chance.
    pub share: f64,
    /// Share of the circumference inside the picture.
    pub framed: f64,
    /// Median change of the encoded values across the rim.
    pub contrast: f64,
    /// Largest distance (in pixels) of a place from the circle that counts as rim.
    pub tolerance: f64,
}

impl Rim {
    /// Visible share of the rim's places inside the picture.
    pub fn share_within_frame(&self) -> f64 {
        if self.framed > 0.0 { self.share / self.framed } else { 0.0 }
    }

    /// Evidence for the rim: −ln of the chance of its agreement, summed over its places.
    pub fn evidence(&self) -> f64 {
        let share = self.share_within_frame();
        let raw = share + (1.0 - share) * CHANCE;
        self.framed * self.circle.radius_px * divergence(raw, CHANCE)
    }
}

/// Length of rays on either side of the circle in tolerances, so that a random edge on a ray is within one
/// tolerance with a probability of one in four.
const REACH: f64 = 4.0;
const CHANCE: f64 = 1.0 / REACH;
/// Allowed distance of places from the circle relative to the radius: a silhouette off the optical axis is an
/// ellipse, and lenses distort.
const OUT_OF_ROUND: f64 = 0.008;
/// Smallest evidence at the first size; below it larger sizes are skipped.
const HOPELESS: f64 = 2.0;
/// Samples per pixel along a ray.
const SAMPLES: f64 = 2.0;
/// Largest number of samples side by side across a ray.
const MAX_SAMPLES: f64 = 6.0;
/// Standard deviation in pixels of the Gaussian whose derivative finds edges along a ray.
const BLUR: f64 = 0.7;
/// Smallest strength of rim edges relative to a ray's strongest. The outermost of them is the rim; the inner ones
/// are reflections.
const OUTER: f64 = 0.35;
/// Smallest change (in encoded values) above rounding errors.
const MIN_CONTRAST: f64 = 2e-6;
/// An edge found on a ray.
#[derive(Clone, Copy)]
struct Crossing {
    place: DVec2,
    contrast: f64,
}

/// Fits the circle to the rim near `rough` (both in pixels of the full size): from the smallest of the pictures
/// `levels` of the `pyramid` (full size first, each half of the one before) to the largest in which the rim still
/// stands out from the noise. `None` without a rim.
pub(super) fn fit(pyramid: &[Raster<[f32; 3]>], rough: &Circle, levels: RangeInclusive<usize>) -> Option<Rim> {
    let mut best: Option<Rim> = None;
    let mut circle = *rough;
    let mut band = f64::INFINITY;
    for level in levels.rev() {
        let scale = (1 << level) as f64;
        let local = circle.scaled(1.0 / scale);
        let Some(rim) = fit_at(&pyramid[level], &local, band) else { break };
        // Noise or soft focus hides the rim at this size; the coarser one was better.
        if best.is_some_and(|before| rim.share < 0.75 * before.share) {
            break;
        }
        let is_hopeless = best.is_none() && rim.evidence() < HOPELESS;
        circle = rim.circle.scaled(scale);
        // Sharp edges are twice as wide in the next picture, plus a margin.
        band = 3.0 * rim.tolerance;
        best = Some(Rim { circle, residual: scale * rim.residual, tolerance: scale * rim.tolerance, ..rim });
        if is_hopeless {
            break;
        }
    }
    best
}

/// Fits the circle at one size: to the outermost edges, which exclude reflections, or to all edges, in case objects
/// behind the ball are outermost.
fn fit_at(picture: &Raster<[f32; 3]>, rough: &Circle, band: f64) -> Option<Rim> {
    let to_outermost = fit_to(picture, rough, band, true);
    let to_all = fit_to(picture, rough, band, false);
    match (to_outermost, to_all) {
        (Some(a), Some(b)) if b.evidence() > 1.1 * a.evidence() => Some(b),
        (a, b) => a.or(b),
    }
}

/// First within a wide tolerance, `band` at most, then within one as narrow as the rim is sharp.
fn fit_to(picture: &Raster<[f32; 3]>, rough: &Circle, band: f64, outermost: bool) -> Option<Rim> {
    let mut circle = *rough;
    let mut tolerance = (2.0 * widest_tolerance(&circle)).min(0.3 * circle.radius_px / REACH).min(band);
    for _ in 0..5 {
        let rays = crossings(picture, &circle, REACH * tolerance);
        let places: Vec<DVec2> = (rays.iter())
            .flat_map(|ray| &ray[if outermost { ray.len().saturating_sub(1) } else { 0 }..])
            .map(|crossing| crossing.place)
            .collect();
        let (better, deviation) = circle.agreed(&places, 2.0 * tolerance)?;
        if better.center().distance(rough.center()) > 0.3 * rough.radius_px {
            return None;
        }
        circle = better;
        tolerance = (3.0 * deviation).clamp(MIN_TOLERANCE, widest_tolerance(&circle));
    }
    Some(measured(picture, &circle, tolerance))
}

/// Smallest tolerance in pixels, the sharpest rim of any camera.
const MIN_TOLERANCE: f64 = 0.8;

/// Largest possible distance of the rim from a circle.
pub(super) fn widest_tolerance(circle: &Circle) -> f64 {
    (OUT_OF_ROUND * circle.radius_px).max(MIN_TOLERANCE)
}

/// Measures the rim in the picture at a circle.
pub(super) fn measured(picture: &Raster<[f32; 3]>, circle: &Circle, tolerance: f64) -> Rim {
    let rays = crossings(picture, circle, REACH * tolerance);
    let on_rim: Vec<&Crossing> =
        (rays.iter()).filter_map(|ray| ray.last()).filter(|c| circle.distance(c.place).abs() <= tolerance).collect();
    let raw = on_rim.len() as f64 / (rays.len() as f64).max(1.0);
    let framed = rays.len() as f64 / ray_count(circle) as f64;
    let squares: f64 = on_rim.iter().map(|c| circle.distance(c.place).powi(2)).sum();
    let mut contrasts: Vec<f64> = on_rim.iter().map(|c| c.contrast).collect();
    contrasts.sort_by(f64::total_cmp);
    Rim {
        circle: *circle,
        residual: (squares / (on_rim.len() as f64).max(1.0)).sqrt(),
        share: framed * ((raw - CHANCE) / (1.0 - CHANCE)).max(0.0),
        framed,
        contrast: contrasts.get(contrasts.len() / 2).copied().unwrap_or(0.0),
        tolerance,
    }
}

/// Number of rays: one for every other pixel of the circumference, up to a limit.
fn ray_count(circle: &Circle) -> usize {
    (0.5 * TAU * circle.radius_px).ceil().clamp(48.0, 720.0) as usize
}

/// Edges on rays across the circle, from `reach` pixels inside to as many outside, for each ray inside the picture.
fn crossings(picture: &Raster<[f32; 3]>, circle: &Circle, reach: f64) -> Vec<Vec<Crossing>> {
    let rays = ray_count(circle);
    let bounds = DVec2::new(picture.width as f64, picture.height as f64);
    (0..rays)
        .into_par_iter()
        .with_min_len(16)
        .filter(|&i| {
            let towards = DVec2::from_angle(TAU * i as f64 / rays as f64);
            // An edge is visible if a pixel on either side of it is in the picture; farther out the border is
            // repeated.
            [circle.radius_px - 1.0, circle.radius_px + 1.0].iter().all(|&r| {
                let p = circle.center() + r * towards;
                p.cmpge(DVec2::ZERO).all() && p.cmple(bounds).all()
            })
        })
        .map(|i| edges_on_ray(picture, circle, reach, i, rays))
        .collect()
}

/// Edges on ray `index` that can be the rim, from the inside out.
fn edges_on_ray(picture: &Raster<[f32; 3]>, circle: &Circle, reach: f64, index: usize, rays: usize) -> Vec<Crossing> {
    // A ray is as wide as its part of the circumference, plus a pixel. Its samples are means along the circle,
    // which lifts faint rims above the noise.
    let spacing = TAU / rays as f64;
    let width = spacing + 1.0 / circle.radius_px;
    let side_by_side = (width * circle.radius_px).round().clamp(1.0, MAX_SAMPLES) as usize;
    // Room for the filter's tails at both ends.
    let tail = (3.0 * BLUR * SAMPLES) as usize;
    let half = (reach * SAMPLES).ceil() as usize + tail;
    let mut encoded = vec![[0.0f64; 3]; 2 * half + 1];
    let mut linear = encoded.clone();
    for side in 0..side_by_side {
        let aside = (side as f64 + 0.5) / side_by_side as f64 - 0.5;
        let towards = DVec2::from_angle(spacing * index as f64 + width * aside);
        for (k, (encoded, linear)) in encoded.iter_mut().zip(&mut linear).enumerate() {
            let offset = (k as f64 - half as f64) / SAMPLES;
            // A ray never passes the centre of a small ball.
            let radius = (circle.radius_px + offset).max(0.0);
            let (e, l) = sample(picture, circle.center() + radius * towards);
            for c in 0..3 {
                encoded[c] += f64::from(e[c]) / side_by_side as f64;
                linear[c] += f64::from(l[c]) / side_by_side as f64;
            }
        }
    }
    let encoded = steepness(&encoded);
    let linear = steepness(&linear);
    let range = tail..encoded.len() - tail;
    let is_peak = |s: &[f64], k: usize| s[k] > s[k - 1] && s[k] >= s[k + 1];
    let peaks = || range.clone().filter(|&k| is_peak(&encoded, k));
    let strongest = peaks().map(|k| encoded[k]).fold(MIN_CONTRAST, f64::max);
    // An edge lies where linear light, not its code value, changes fastest.
    let near = (1.5 * SAMPLES) as usize;
    let brightest_change = |peak: usize| {
        (peak.saturating_sub(near).max(1)..=(peak + near).min(linear.len() - 2))
            .filter(|&k| is_peak(&linear, k))
            .min_by_key(|k| k.abs_diff(peak))
    };
    let towards = DVec2::from_angle(spacing * index as f64);
    peaks()
        .filter(|&k| encoded[k] > OUTER * strongest)
        .filter_map(|peak| {
            let light = brightest_change(peak)?;
            let [before, at, after] = [linear[light - 1], linear[light], linear[light + 1]];
            let shift = 0.5 * (before - after) / (before - 2.0 * at + after);
            let offset = (light as f64 + shift.clamp(-0.5, 0.5) - half as f64) / SAMPLES;
            Some(Crossing {
                place: circle.center() + (circle.radius_px + offset) * towards,
                // Height of a step with this slope, as a mean over the three channels.
                contrast: encoded[peak] * BLUR * TAU.sqrt() / 3f64.sqrt(),
            })
        })
        .collect()
}

/// Encoded values at a place (bilinear between pixel centres, the border repeated), and the light of the four
/// pixels likewise. Light is approximated by the square of the code, near enough to any camera's curve to find the
/// middle of an edge a pixel or two wide.
fn sample(picture: &Raster<[f32; 3]>, place: DVec2) -> ([f32; 3], [f32; 3]) {
    let inside = |v: f64, n: usize| (v - 0.5).clamp(0.0, (n - 1) as f64);
    let (x, y) = (inside(place.x, picture.width), inside(place.y, picture.height));
    let (x0, y0) = (x as usize, y as usize);
    let (x1, y1) = ((x0 + 1).min(picture.width - 1), (y0 + 1).min(picture.height - 1));
    let (fx, fy) = ((x - x0 as f64) as f32, (y - y0 as f64) as f32);
    let corners = [
        (picture.at(x0, y0), (1.0 - fx) * (1.0 - fy)),
        (picture.at(x1, y0), fx * (1.0 - fy)),
        (picture.at(x0, y1), (1.0 - fx) * fy),
        (picture.at(x1, y1), fx * fy),
    ];
    let (mut encoded, mut linear) = ([0.0; 3], [0.0; 3]);
    for (pixel, weight) in corners {
        for c in 0..3 {
            encoded[c] += weight * pixel[c];
            linear[c] += weight * pixel[c] * pixel[c];
        }
    }
    (encoded, linear)
}

/// Size of the change per pixel along a ray: the derivative of a Gaussian, over all channels.
fn steepness(profile: &[[f64; 3]]) -> Vec<f64> {
    let reach = (3.0 * BLUR * SAMPLES) as isize;
    let last = profile.len() as isize - 1;
    (0..=last)
        .map(|k| {
            let mut slope = [0.0; 3];
            for step in -reach..=reach {
                let t = step as f64 / SAMPLES;
                let weight = t * (-0.5 * (t / BLUR).powi(2)).exp() / (TAU.sqrt() * BLUR.powi(3) * SAMPLES);
                let value = profile[(k + step).clamp(0, last) as usize];
                (slope.iter_mut().zip(value)).for_each(|(s, v)| *s += weight * v);
            }
            slope.iter().map(|s| s * s).sum::<f64>().sqrt()
        })
        .collect()
}
