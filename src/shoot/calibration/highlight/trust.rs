//! Confidence in the lamps of a series.

use super::grid::Grid;
use super::photograph::{BRIGHT, Highlight, headroom};
use base::median::median;
use glam::Vec3;

/// Confidence in each lamp's direction, 0 to 1: the probability that it is right within five degrees, with errors
/// taken as larger than usual. `None` was not seen: 0. `room` is the common light of all photographs per cell.
pub(crate) fn weigh(lamps: &[Option<Highlight>], grid: &Grid, room: &[f32]) -> Vec<f32> {
    let seen = || lamps.iter().flatten();
    let energy = median(seen().map(|lamp| lamp.energy));
    let peak = median(seen().map(|lamp| lamp.peak));
    // Lamps of one kind have similar widths; ten degrees more still count.
    let size = median(seen().map(|lamp| lamp.spread_deg)) + 10.0;
    // A lamp in front of an equally bright window is invisible. A part weaker than nearly all other lamps may then
    // be something else.
    let window: f32 = (0..room.len())
        .filter(|&cell| grid.is_ball(cell) && headroom(room[cell]) < BRIGHT * peak)
        .map(|cell| grid.solid_angle[cell])
        .sum();
    let weak = if window > LEAST_WINDOW {
        // 1.48 converts the median deviation to a normal distribution's standard deviation.
        let apart = median(seen().map(|lamp| (lamp.energy / energy).ln().abs()));
        (-2.0 * 1.48 * apart).exp().clamp(0.15, 0.5)
    } else {
        WEAK
    };
    let chance = |lamp: &Highlight| {
        let place_px = grid.circle_error_px.hypot(PLACE_PX);
        let geometry = pixel_deg(lamp.outline, grid.radius_px) * place_px;
        // Both are wider than the errors of most photographs, because of exceptions. The errors are uniform in two
        // dimensions.
        let variance = (2.0 * lamp.deviation_deg).powi(2) + (1.4 * geometry).powi(2);
        let near = 1.0 - (-0.5 * NEAR_DEG.powi(2) / variance.max(1e-6)).exp();
        // A part with a third of the lamp's light may be the lamp instead.
        let alone = plausibility(lamp.rival / 0.3);
        // A hidden or disabled lamp leaves only reflections: little light, dim and wide.
        let as_strong = plausibility(weak * energy / lamp.energy) * plausibility(WEAK * peak / lamp.peak);
        let as_small = plausibility((lamp.spread_deg - size).max(0.0) / 15.0);
        let together = 1.0 - 0.8 * lamp.elsewhere.powi(2);
        near * alone * as_strong * as_small * together
    };
    // A part that stays in place under most lamps is not a lamp.
    let moves = |i: usize, lamp: &Highlight| {
        let reach = 3.0 + 0.7 * lamp.spread_deg;
        let others = || lamps.iter().enumerate().filter(|(j, _)| *j != i);
        let same = others()
            .filter_map(|(_, other)| other.as_ref())
            .filter(|other| other.outline.angle_between(lamp.outline).to_degrees() < reach)
            .count();
        1.0 - same as f32 / others().count().max(1) as f32
    };
    (lamps.iter().enumerate())
        .map(|(i, lamp)| lamp.as_ref().map_or(0.0, |lamp| moves(i, lamp) * chance(lamp)))
        .collect()
}

/// Smallest error that counts as a wrong direction.
pub(crate) const NEAR_DEG: f32 = 5.0;
/// Error in pixels of the middle of a sampled lamp.
const PLACE_PX: f32 = 0.25;
/// Below this share of the median light or radiance, a lamp is more likely something else.
const WEAK: f32 = 0.05;
/// Total window size in steradians that can hide a lamp: a disc of two degrees.
const LEAST_WINDOW: f32 = 0.004;

/// 1 for ratio 0, a half for 1, near 0 for much more.
fn plausibility(ratio: f32) -> f32 {
    1.0 / (1.0 + ratio * ratio)
}

/// Change of the mirrored direction in degrees from one pixel to the next along the radius. On a far ball the angle
/// ψ from the camera is at R·sin(ψ/2).
fn pixel_deg(direction: Vec3, radius_px: f32) -> f32 {
    let cosine = (0.5 * (1.0 + direction.z)).max(1e-4).sqrt();
    (2.0 / (radius_px * cosine)).to_degrees()
}
