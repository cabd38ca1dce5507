//! Matte of a subject in a box, before any background.

use super::Matte;
use super::cut::{ROUNDS, Reduced};
use super::grab_cut::{grab_cut, rectangle};
use super::parts::clean;
use base::error::{Error, Result};
use imaging::Encoded;

/// A box in a picture of size `full`, scaled to the size `small` and rounded outwards.
pub fn reduced_box([left, top, columns, rows]: [usize; 4], full: (usize, usize), small: (usize, usize)) -> [usize; 4] {
    let (right, bottom) = (left.saturating_add(columns), top.saturating_add(rows));
    let before = |at: usize, full: usize, small: usize| at.min(full) * small / full.max(1);
    let after = |at: usize, full: usize, small: usize| (at.min(full) * small).div_ceil(full.max(1));
    let (x, y) = (before(left, full.0, small.0), before(top, full.1, small.1));
    let (to_x, to_y) = (after(right, full.0, small.0), after(bottom, full.1, small.1));
    [x, y, to_x - x, to_y - y]
}

/// Matte of a subject fully inside a box, given as left, top, width and height in pixels. The colours outside the
/// box separate the background from the subject, so some of it must be outside.
///
/// # Errors
/// If the box is empty or contains the full picture, or nothing in it differs from the outside.
pub fn boxed(picture: &Encoded, [left, top, columns, rows]: [usize; 4]) -> Result<Matte> {
    let size = picture.0.size();
    let reduced = Reduced::from_picture(picture);
    let small = reduced.small.0.size();
    let marks = rectangle(small, reduced_box([left, top, columns, rows], size, small));
    let found = grab_cut(&reduced.small, &marks, ROUNDS).map_err(|_| {
        Error::invalid(
            format!(
                "a box at {left}, {top} of {columns} × {rows} pixels contains nothing or all of the {} × {} picture",
                size.0, size.1
            ),
            "Draw the box around the subject, with some of the background outside",
        )
    })?;
    let mut cut = found.subject.pixels;
    clean(&mut cut, small, |_| true);
    if !cut.contains(&true) {
        return Err(Error::missing(
            "the colours inside the box do not differ from those outside",
            "Draw the box closer around the subject, or add your own mattes beside the pictures",
        ));
    }
    Ok(reduced.matte(&cut, None))
}
