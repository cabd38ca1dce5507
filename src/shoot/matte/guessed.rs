//! Matte of a person found by an external detector, such as a network, before any background.

use super::Matte;
use super::cut::{ROUNDS, Reduced};
use super::grab_cut::{Mark, grab_cut};
use super::key::Shown;
use super::parts::clean;
use base::error::{Error, Result};
use imaging::resample::resize;
use imaging::{Encoded, Mask, Raster};

/// Smallest certainty of a fixed guess; elsewhere colours and edges decide.
const SURE: f32 = 0.95;
/// Smallest share of the picture that the certain part of a person fills.
const LEAST: f32 = 0.01;

/// Matte of the person detected by `find`, which gets the picture without its black bars and returns a probability
/// at any size. Where the guess is uncertain, GrabCut separates the person from the background by colour. Edges are
/// softened as for a box.
///
/// # Errors
/// When no person is found, and the errors of `find`.
pub fn guessed(picture: &Encoded, find: impl Fn(&Encoded) -> Result<Mask>) -> Result<Matte> {
    let shown = Shown::from_picture(picture);
    let (left, top) = (shown.columns.start, shown.rows.start);
    let without_bars =
        Encoded(Raster::from_fn(shown.columns.len(), shown.rows.len(), |x, y| picture.0.at(left + x, top + y)));
    let found = find(&without_bars)?;
    let reduced = Reduced::from_picture(&without_bars);
    let small = reduced.small.0.size();
    let guess = resize(&found, small.0, small.1);
    let share = |wanted: &dyn Fn(f32) -> bool| {
        let count = guess.pixels.iter().filter(|p| wanted(**p)).count();
        count as f32 / guess.pixels.len().max(1) as f32
    };
    if share(&|p| p > SURE) < LEAST {
        return Err(Error::missing(
            "neither a green or blue screen nor a person was found",
            (
                "Draw a box around the person, paint what to keep and to remove (Footage, Paint matte), or add your own mattes \
                 beside the pictures",
                "afterlight matte PROJECT --box",
            ),
        ));
    }
    let marks = guess.map(|p| match p {
        p if p > SURE => Mark::Subject,
        p if p >= 0.5 => Mark::MaybeSubject,
        p if p >= 1.0 - SURE => Mark::MaybeBackground,
        _ => Mark::Background,
    });
    let mut cut: Vec<bool> = guess.pixels.iter().map(|p| *p >= 0.5).collect();
    // With no background there is nothing to cut.
    if cut.contains(&false) {
        cut = grab_cut(&reduced.small, &marks, ROUNDS)?.subject.pixels;
    }
    clean(&mut cut, small, |i| guess.pixels[i] < 0.5);
    let inner = reduced.matte(&cut, None);
    let mut mask = picture.0.map(|_| 0.0);
    for (row, from) in shown.rows.zip(inner.mask.pixels.chunks(shown.columns.len())) {
        let start = row * mask.width + left;
        mask.pixels[start..start + from.len()].copy_from_slice(from);
    }
    let unsure = share(&|p| (1.0 - SURE..=SURE).contains(&p));
    Ok(Matte { mask, uncertain: inner.uncertain.max(unsure) })
}
