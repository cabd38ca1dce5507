//! The matte of a subject in a box, before any background: GrabCut at a reduced size, soft edges at the picture's own.

use super::grab_cut::{grab_cut, rectangle};
use super::parts::{clean, drop_loose};
use super::refine::guided;
use super::{Matte, linear, window};
use base::error::{Error, Result};
use imaging::color::srgb_from_linear;
use imaging::resample::{resize, resize_area};
use imaging::{Encoded, Mask, Raster};
use rayon::prelude::*;

/// The longer side that is cut; finer edges are found afterwards.
const CUT_SIDE: usize = 480;
/// Rounds of fitting colours and cutting.
const ROUNDS: usize = 8;

/// The matte of a subject that lies wholly in a box, given as left, top, width and height in pixels. What is behind it is
/// told from the subject by the colours outside of the box, so some of these must be there.
///
/// # Errors
/// If the box is empty or holds the whole picture, or nothing in it differs from what is outside.
pub fn boxed(picture: &Encoded, [left, top, columns, rows]: [usize; 4]) -> Result<Matte> {
    let size = picture.0.size();
    let light = Raster {
        width: size.0,
        height: size.1,
        pixels: linear(picture),
    };
    let longer = size.0.max(size.1).max(1);
    let side = |full: usize| (full * longer.min(CUT_SIDE)).div_ceil(longer);
    let small = (side(size.0), side(size.1));
    let reduced = match small == size {
        true => picture.clone(),
        false => Encoded(resize_area(&light, small.0, small.1).map(|p| p.map(srgb_from_linear))),
    };
    // A box at the reduced size that leaves out no pixel which the box touches.
    let (right, bottom) = (left.saturating_add(columns), top.saturating_add(rows));
    let before = |at: usize, full: usize, small: usize| at.min(full) * small / full.max(1);
    let after = |at: usize, full: usize, small: usize| (at.min(full) * small).div_ceil(full.max(1));
    let (x, y) = (before(left, size.0, small.0), before(top, size.1, small.1));
    let (to_x, to_y) = (
        after(right, size.0, small.0),
        after(bottom, size.1, small.1),
    );
    let marks = rectangle(small, [x, y, to_x - x, to_y - y]);
    let found = grab_cut(&reduced, &marks, ROUNDS).map_err(|_| {
        Error::invalid(
            format!(
                "a box at {left}, {top} of {columns} × {rows} pixels holds nothing or all of a picture of {} × {}",
                size.0, size.1
            ),
            "Draw the box around the subject, with some of the background outside of it",
        )
    })?;
    let mut cut = found.subject.pixels;
    clean(&mut cut, small, |_| true);
    if !cut.contains(&true) {
        return Err(Error::missing(
            "nothing in the box can be told from what is outside of it by its colour",
            "Draw the box closer around the subject, or put mattes of your own beside the pictures",
        ));
    }
    let cut = Mask {
        width: small.0,
        height: small.1,
        pixels: cut.into_iter().map(|s| f32::from(u8::from(s))).collect(),
    };
    let inside: Vec<bool> = (resize(&cut, size.0, size.1).pixels.iter())
        .map(|&share| share >= 0.5)
        .collect();
    // As far as the reduced cut may be off, and an edge may be soft.
    let reach = 2 + size.0.max(size.1) / CUT_SIDE;
    Ok(soft(&light.pixels, &inside, size, reach))
}

/// Soft edges of a hard cut: within `reach` pixels of its border, coverage is how far a pixel's colour is on the way from the
/// background's to the subject's nearby.
fn soft(light: &[[f32; 3]], inside: &[bool], size: (usize, usize), reach: usize) -> Matte {
    let binary: Vec<[f32; 1]> = inside.iter().map(|&i| [f32::from(u8::from(i))]).collect();
    let near = window::sums(&binary, size, reach);
    let count = window::counts(size, reach);
    let places = 0..light.len();
    let core: Vec<bool> = (places.clone().map(|i| near[i][0] > count(i) - 0.5)).collect();
    let behind: Vec<bool> = near.iter().map(|[n]| *n < 0.5).collect();
    let around = |certain: &[bool], side: bool| {
        // A subject thinner than the reach has no core: what is on its side stands for it.
        let some = certain.contains(&true);
        let known: Vec<bool> = match some {
            true => certain.to_vec(),
            false => inside.iter().map(|&i| i == side).collect(),
        };
        let total = known.iter().filter(|k| **k).count().max(1) as f32;
        let mut mean = [0.0_f32; 3];
        for (_, p) in known.iter().zip(light).filter(|(known, _)| **known) {
            for (mean, v) in mean.iter_mut().zip(p) {
                *mean += v / total;
            }
        }
        window::means(
            |i| light[i],
            &known,
            size,
            2 * reach,
            vec![mean; light.len()],
        )
    };
    let (subject, background) = (around(&core, true), around(&behind, false));
    let mixed: Vec<f32> = (places.clone().into_par_iter())
        .map(|i| {
            if core[i] || behind[i] {
                return f32::from(u8::from(core[i]));
            }
            let (to, from, at) = (subject[i], background[i], light[i]);
            let along: f32 = (0..3).map(|c| (at[c] - from[c]) * (to[c] - from[c])).sum();
            let length: f32 = (0..3).map(|c| (to[c] - from[c]).powi(2)).sum();
            // Where both sides have one colour, the cut decides.
            match length > 1e-4 {
                true => (along / length).clamp(0.0, 1.0),
                false => f32::from(u8::from(inside[i])),
            }
        })
        .collect();
    let smooth = guided(light, &mixed, size, 2);
    let in_doubt = |i: usize| !core[i] && !behind[i];
    let mut alpha: Vec<f32> = (places.clone())
        .map(|i| if in_doubt(i) { smooth[i] } else { mixed[i] })
        .collect();
    drop_loose(&mut alpha, size, inside);
    let uncertain = places.filter(|&i| in_doubt(i)).count() as f32 / alpha.len().max(1) as f32;
    Matte {
        mask: Mask {
            width: size.0,
            height: size.1,
            pixels: alpha,
        },
        uncertain,
    }
}
