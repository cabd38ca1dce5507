//! Trust in the lamps of a series.

use super::super::median::median;
use super::{BRIGHT, Grid, Highlight, headroom};
use glam::Vec3;

/// For each lamp of a series how far its direction can be trusted, 0 to 1: the chance that it is right within five
/// degrees, with errors taken for larger than they mostly are. `None` was not seen: 0. `room` is per cell the light
/// that all photographs share.
pub(super) fn weigh(lamps: &[Option<Highlight>], grid: &Grid, room: &[f32]) -> Vec<f32> {
    let seen = || lamps.iter().flatten();
    let energy = median(seen().map(|lamp| lamp.energy));
    let peak = median(seen().map(|lamp| lamp.peak));
    // Lamps of one kind are about as wide; ten degrees more are still a lamp.
    let size = median(seen().map(|lamp| lamp.spread_deg)) + 10.0;
    // Before a window as bright as itself a lamp does not show. Then what is weaker than nearly all of the others may be
    // something else.
    let window: f32 = (0..room.len())
        .filter(|&cell| grid.is_ball(cell) && headroom(room[cell]) < BRIGHT * peak)
        .map(|cell| grid.solid_angle[cell])
        .sum();
    let weak = if window > LEAST_WINDOW {
        // 1.48 turns the median deviation into a normal distribution's standard deviation.
        let apart = median(seen().map(|lamp| (lamp.energy / energy).ln().abs()));
        (-2.0 * 1.48 * apart).exp().clamp(0.15, 0.5)
    } else {
        WEAK
    };
    let chance = |lamp: &Highlight| {
        let place_px = grid.circle_error_px.hypot(PLACE_PX);
        let geometry = pixel_deg(lamp.outline, grid.radius_px) * place_px;
        // Both are wider than the errors of most photographs, because some are not like most. Errors spread evenly in
        // two dimensions.
        let variance = (2.0 * lamp.deviation_deg).powi(2) + (1.4 * geometry).powi(2);
        let near = 1.0 - (-0.5 * NEAR_DEG.powi(2) / variance.max(1e-6)).exp();
        // A part that has a third of the lamp's light may as well be the lamp.
        let alone = plausibility(lamp.rival / 0.3);
        // A lamp that is out of sight or off leaves what others reflect of it: little light, dim and wide.
        let as_strong =
            plausibility(weak * energy / lamp.energy) * plausibility(WEAK * peak / lamp.peak);
        let as_small = plausibility((lamp.spread_deg - size).max(0.0) / 15.0);
        let together = 1.0 - 0.8 * lamp.elsewhere.powi(2);
        near * alone * as_strong * as_small * together
    };
    // What stays where it is under most lamps is not a lamp.
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

/// A larger error is a wrong direction.
pub(crate) const NEAR_DEG: f32 = 5.0;
/// Possible error in pixels of the middle of a lamp where pixels sample it.
const PLACE_PX: f32 = 0.25;
/// A lamp with less than this share of the median's light or radiance is likelier something else.
const WEAK: f32 = 0.05;
/// Windows of this many steradians can hide a lamp: a disc of two degrees.
const LEAST_WINDOW: f32 = 0.004;

/// 1 for 0, a half for 1, little for much more.
fn plausibility(ratio: f32) -> f32 {
    1.0 / (1.0 + ratio * ratio)
}

/// By how many degrees the mirrored direction changes from one pixel to the next along the radius: on a far ball the
/// angle ψ from the camera is seen at R·sin(ψ/2).
fn pixel_deg(direction: Vec3, radius_px: f32) -> f32 {
    let cosine = (0.5 * (1.0 + direction.z)).max(1e-4).sqrt();
    (2.0 / (radius_px * cosine)).to_degrees()
}
