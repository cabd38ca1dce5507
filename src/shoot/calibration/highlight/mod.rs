//! Detection of lamps on mirror balls in a series of photographs, with confidence.
//!
//! The light common to all photographs of a series is the room. The extra light in one photograph is its lamp and
//! anything the lamp lights. Among the parts as bright as the brightest, the lamp is the one with the most light: a
//! reflection is never brighter than its lamp. A bank of lamps shows several such parts side by side. Thin streaks,
//! from scratches and dust, are cut off, so that a clipped lamp is found by its outline.

mod bank;
mod grid;
mod photograph;
mod shape;
#[cfg(test)]
mod tests;
mod trust;

pub(super) use grid::{Grid, Levels};
pub(super) use photograph::{Highlight, clipped_weight};
#[cfg(test)]
pub(super) use tests::{apart_from_published, real_balls};
pub(super) use trust::{NEAR_DEG, weigh};

use bank::{BANK, Part, alike, bank};
use base::median::median;
use photograph::{FAINT, Photograph};
use rayon::prelude::*;

/// Parts in more than this share of the other photographs belong to the room.
const SHARED: f32 = 0.5;

/// Lamps of a series of photographs; `None` for a photograph with only room light and noise.
pub(super) fn find(grid: &Grid, series: &[Levels], room: &[f32]) -> Vec<Option<Highlight>> {
    let photographs: Vec<Option<Photograph>> =
        series.par_iter().map(|levels| Photograph::new(grid, levels, room)).collect();
    let is_shared = |number: usize, part: &Part| {
        let others = || photographs.iter().enumerate().filter(|(i, _)| *i != number);
        let count = others().filter(|(_, other)| other.as_ref().is_some_and(|other| other.shows(part))).count();
        count as f32 > SHARED * others().count() as f32
    };
    // The lamps of a bank may be far apart. One photograph cannot tell them from reflections, but most photographs
    // with several alike can.
    let glints: Vec<Vec<Part>> = photographs
        .par_iter()
        .enumerate()
        .map(|(i, photograph)| {
            let glints = photograph.iter().flat_map(|p| p.find_bright(FAINT));
            alike(glints.filter(|part| !is_shared(i, part)).collect())
        })
        .collect();
    let shown = || glints.iter().filter(|glints| !glints.is_empty());
    let apart = shown().filter(|glints| !bank(glints.iter().collect()).1.is_empty());
    let is_apart = 2 * apart.count() > shown().count();
    let usual = median(shown().map(|glints| glints.len() as f32));
    let is_bank = is_apart && usual >= BANK as f32;
    (photographs.par_iter().zip(&glints).enumerate())
        .map(|(i, (photograph, glints))| {
            let photograph = photograph.as_ref()?;
            if is_bank && !glints.is_empty() {
                return Some(photograph.bank_apart(glints, usual));
            }
            photograph.highlight(|part| is_shared(i, part))
        })
        .collect()
}
