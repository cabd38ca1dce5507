//! Mattes from brush strokes: corrected ones, ones from strokes only, and ones that follow another frame's matte.

use super::Matte;
use super::cut::{ROUNDS, Reduced};
use super::grab_cut::{Known, Mark, grab_cut_knowing};
use super::mixture::Mixture;
use super::parts::{clean, drop_loose, parts};
use super::seeds::Seeds;
use super::window;
use base::error::{Error, Result};
use imaging::color::unit;
use imaging::resample::resize_area;
use imaging::{Encoded, Mask, Raster};
use std::collections::VecDeque;

/// Largest weight of a seed carried from another frame, as log odds.
const MOST_ODDS: f32 = 10.0;
/// Smallest weight of a seed that starts a change.
const LEAST_SEED: f32 = 0.25;
/// Colour difference in codes, and distance relative to the picture's longer side, within which a stroke initially
/// selects similar pixels.
const ALIKE: f32 = 14.0;
const NEAR: f32 = 0.15;
/// Uncertain band around the edge of a followed matte: the longer side divided by this.
const BAND: usize = 16;

/// A matte corrected by strokes.
#[derive(Clone, Debug, PartialEq)]
pub struct Correction {
    pub matte: Matte,
    /// Seeds for other frames at the size of the cut: places and effects of the strokes.
    pub seeds: Seeds,
}

/// Corrects a matte with seeds of the picture's size. Changes are connected to a seed and decided by GrabCut,
/// starting from the matte. Painted pixels get exactly their painted value.
///
/// # Errors
/// If the sizes differ.
pub fn corrected(picture: &Encoded, start: &Matte, seeds: &Seeds) -> Result<Correction> {
    let size = picture.0.size();
    seeds.check(size)?;
    if start.mask.size() != size {
        return Err(Error::other_size(
            ("the matte", start.mask.size()),
            ("the picture", size),
            "Remake the matte of this picture",
        ));
    }
    let reduced = Reduced::from_picture(picture);
    let small = reduced.small.0.size();
    let told = seeds.resized(small);
    let told = &told.values().pixels;
    let before: Vec<bool> =
        (resize_area(&start.mask, small.0, small.1).pixels.iter()).map(|&alpha| alpha >= 0.5).collect();
    let supposed = supposed(&reduced.small, &before, told);
    let marks = marks(small, told, &supposed);
    let odds: Vec<f32> = told.iter().map(|v| MOST_ODDS * v).collect();
    let known = Known { odds: Some(&odds), ..Known::default() };
    let sides = |subject| marks.pixels.iter().any(|m| m.is_subject() == subject);
    // An empty side leaves nothing to cut.
    let cut = if sides(true) && sides(false) {
        grab_cut_knowing(&reduced.small, &marks, &known, ROUNDS)?.subject.pixels
    } else {
        supposed
    };
    let mut after = before.clone();
    for part in parts(small, |i| cut[i] != before[i]) {
        let asked = |i: &usize| told[*i].abs() >= LEAST_SEED && (told[*i] > 0.0) == cut[*i];
        if part.iter().any(asked) {
            part.iter().for_each(|&i| after[i] = cut[i]);
        }
    }
    let changed = |i: usize| after[i] != before[i];
    let mut matte = if (0..after.len()).any(changed) {
        let new = reduced.matte(&after, None);
        // Moved edges, over the width of their softness.
        let places: Vec<[f32; 1]> = (0..after.len()).map(|i| [f32::from(u8::from(changed(i)))]).collect();
        let near = window::sums(&places, small, 3);
        let zone: Vec<bool> = near.iter().map(|n| n[0] > 0.5).collect();
        let zone = reduced.enlarged(&zone);
        let mixed = |i: usize| if zone[i] { new.mask.pixels[i] } else { start.mask.pixels[i] };
        Matte {
            mask: Mask { pixels: (0..zone.len()).map(mixed).collect(), ..start.mask },
            uncertain: start.uncertain.max(new.uncertain),
        }
    } else {
        start.clone()
    };
    force(&mut matte.mask, seeds);
    let kept = (0..after.len()).map(|i| match (told[i].abs() >= 1.0, changed(i)) {
        (true, _) => told[i],
        (_, true) => {
            if after[i] {
                1.0
            } else {
                -1.0
            }
        }
        _ => 0.0,
    });
    Ok(Correction {
        matte,
        seeds: Seeds::from_values(Mask { width: small.0, height: small.1, pixels: kept.collect() }),
    })
}

/// Matte of a picture from strokes only. With a box, everything outside it is removed. Parts not connected to a
/// stroke with Keep are removed.
///
/// # Errors
/// If strokes and box do not cover both sides, or the sizes differ.
pub fn painted(picture: &Encoded, seeds: &Seeds, within: Option<[usize; 4]>) -> Result<Matte> {
    let size = picture.0.size();
    seeds.check(size)?;
    let reduced = Reduced::from_picture(picture);
    let small = reduced.small.0.size();
    let mut told = seeds.resized(small).values().pixels.clone();
    if let Some(within) = within {
        let [left, top, columns, rows] = super::boxed::reduced_box(within, size, small);
        for (i, told) in told.iter_mut().enumerate().filter(|t| *t.1 == 0.0) {
            let (x, y) = (i % small.0, i / small.0);
            let inside = (left..left + columns).contains(&x) && (top..top + rows).contains(&y);
            *told = if inside { 0.0 } else { -1.0 };
        }
    }
    let colors = codes(&reduced.small);
    let side = |wanted: f32| -> Vec<[f64; 3]> {
        let told = colors.iter().zip(&told);
        told.filter(|t| *t.1 * wanted >= 1.0).map(|t| *t.0).collect()
    };
    let (Some(front), Some(back)) = (Mixture::split(&side(1.0)), Mixture::split(&side(-1.0))) else {
        return Err(Error::missing(
            "the strokes do not show both what to keep and what to remove",
            "Paint over a part of the person with Keep and a part of the background with Remove",
        ));
    };
    let supposed: Vec<bool> = (colors.iter()).map(|&color| front.cost(color) < back.cost(color)).collect();
    let odds: Vec<f32> = told.iter().map(|v| MOST_ODDS * v).collect();
    let known = Known { odds: Some(&odds), ..Known::default() };
    let found = grab_cut_knowing(&reduced.small, &marks(small, &told, &supposed), &known, ROUNDS)?;
    let mut cut = found.subject.pixels;
    clean(&mut cut, small, |i| told[i] < 0.0);
    for part in parts(small, |i| cut[i]) {
        if !part.iter().any(|&i| told[i] >= 1.0) {
            part.iter().for_each(|&i| cut[i] = false);
        }
    }
    let mut matte = reduced.matte(&cut, None);
    force(&mut matte.mask, seeds);
    Ok(matte)
}

/// Matte of a picture from a neighbouring frame's matte, carried here: `start` in `[0, 1]` and its confidence
/// `trusted`, both of any size. Far from the edge and where it is trusted it stays; near the edge colours and edges
/// decide.
///
/// # Errors
/// If seeds and picture differ in size, or the start has no subject or no background.
pub fn followed(picture: &Encoded, start: &Mask, trusted: &Mask, seeds: &Seeds) -> Result<Matte> {
    let size = picture.0.size();
    seeds.check(size)?;
    let reduced = Reduced::from_picture(picture);
    let small = reduced.small.0.size();
    let told = seeds.resized(small);
    let told = &told.values().pixels;
    let at = |mask: &Mask| resize_area(mask, small.0, small.1).pixels;
    let (start, trusted) = (at(start), at(trusted));
    let supposed: Vec<bool> = start.iter().map(|&alpha| alpha >= 0.5).collect();
    let subject: Vec<[f32; 1]> = supposed.iter().map(|&s| [f32::from(u8::from(s))]).collect();
    let band = (small.0.max(small.1) / BAND / 2).max(2);
    let near = window::sums(&subject, small, band);
    let count = window::counts(small, band);
    let mut marks = marks(small, told, &supposed);
    for (i, mark) in marks.pixels.iter_mut().enumerate() {
        let open = matches!(mark, Mark::MaybeBackground | Mark::MaybeSubject);
        if open && trusted[i] >= 0.5 && near[i][0] < 0.5 {
            *mark = Mark::Background;
        }
        if open && trusted[i] >= 0.5 && near[i][0] > count(i) - 0.5 {
            *mark = Mark::Subject;
        }
    }
    let odds: Vec<f32> = told.iter().map(|v| MOST_ODDS * v).collect();
    let known = Known { odds: Some(&odds), ..Known::default() };
    let mut cut = grab_cut_knowing(&reduced.small, &marks, &known, ROUNDS)?.subject.pixels;
    clean(&mut cut, small, |i| !supposed[i]);
    let mut matte = reduced.matte(&cut, None);
    force(&mut matte.mask, seeds);
    Ok(matte)
}

/// First guess for each pixel: the matte, except near a contradicting stroke with a similar colour.
fn supposed(picture: &Encoded, before: &[bool], told: &[f32]) -> Vec<bool> {
    let (width, height) = picture.0.size();
    let reach = NEAR * width.max(height) as f32;
    let color = |i: usize| picture.0.pixels[i].map(|v| unit(v) * 255.0);
    let mut supposed = before.to_vec();
    let mut seen = vec![false; before.len()];
    let mut open: VecDeque<(usize, usize)> = VecDeque::new();
    for (i, &told) in told.iter().enumerate() {
        if told.abs() >= LEAST_SEED {
            seen[i] = true;
            supposed[i] = told > 0.0;
            if before[i] != supposed[i] {
                open.push_back((i, i));
            }
        }
    }
    while let Some((place, origin)) = open.pop_front() {
        let (x, y) = (place % width, place / width);
        let (origin_x, origin_y) = (origin % width, origin / width);
        for (x, y) in [(x.wrapping_sub(1), y), (x + 1, y), (x, y.wrapping_sub(1)), (x, y + 1)] {
            if x >= width || y >= height || seen[y * width + x] {
                continue;
            }
            let next = y * width + x;
            let away = (x.abs_diff(origin_x) as f32).hypot(y.abs_diff(origin_y) as f32);
            let (a, b) = (color(next), color(origin));
            let apart: f32 = (0..3).map(|c| (a[c] - b[c]).powi(2)).sum();
            if away <= reach && apart <= ALIKE * ALIKE && before[next] != supposed[origin] {
                seen[next] = true;
                supposed[next] = supposed[origin];
                open.push_back((next, origin));
            }
        }
    }
    supposed
}

/// Sure marks at strokes, open ones elsewhere.
fn marks((width, height): (usize, usize), told: &[f32], supposed: &[bool]) -> Raster<Mark> {
    let mark = |(&told, &supposed): (&f32, &bool)| match supposed {
        _ if told >= 1.0 => Mark::Subject,
        _ if told <= -1.0 => Mark::Background,
        true => Mark::MaybeSubject,
        false => Mark::MaybeBackground,
    };
    Raster { width, height, pixels: told.iter().zip(supposed).map(mark).collect() }
}

/// Sets painted pixels exactly, and removes soft pixels cut off by this.
fn force(alpha: &mut Mask, seeds: &Seeds) {
    seeds.force(alpha);
    if seeds.values().pixels.contains(&-1.0) {
        let solid: Vec<bool> = alpha.pixels.iter().map(|a| *a >= 0.5).collect();
        let size = alpha.size();
        drop_loose(&mut alpha.pixels, size, &solid);
    }
}

fn codes(picture: &Encoded) -> Vec<[f64; 3]> {
    let pixels = picture.0.pixels.iter();
    pixels.map(|p| p.map(|v| f64::from(unit(v)) * 255.0)).collect()
}

#[cfg(test)]
#[path = "brushed_tests.rs"]
mod tests;
