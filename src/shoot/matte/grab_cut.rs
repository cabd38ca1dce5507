//! GrabCut (Rother, Kolmogorov and Blake 2004, "GrabCut: interactive foreground extraction using iterated graph cuts").

use super::flow_network::{FlowNetwork, NEIGHBOURS};
use super::mixture::Mixture;
use base::error::{Error, Result};
use imaging::color::unit;
use imaging::{Encoded, Raster};
use rayon::prelude::*;

/// Cost of a border without a colour change (section 2 of the paper).
const GAMMA: f64 = 50.0;
/// Scale of the integer costs, which make the cut exact.
const SCALE: f64 = 1024.0;
/// Cost of a sure mark, which no cut overrides.
const SURE: i32 = 1 << 28;
/// Largest cost of a colour, far above all links of a pixel together.
const MOST: f64 = 1e4;
/// Largest number of pixels; the cut takes about 100 bytes for each.
const MAX_PIXELS: usize = 1 << 22;

/// Prior knowledge of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// Certainly background.
    Background,
    /// Certainly subject.
    Subject,
    /// Background at first; the cut may change it.
    MaybeBackground,
    /// Subject at first; the cut may change it.
    MaybeSubject,
}

impl Mark {
    pub(super) fn is_subject(self) -> bool {
        matches!(self, Self::Subject | Self::MaybeSubject)
    }
}

/// Result of a cut.
#[derive(Clone, Debug)]
pub struct GrabCut {
    /// True for pixels of the subject.
    pub subject: Raster<bool>,
    /// Difference of the log densities of a pixel's colour between its side and the other. Below 0, neighbours and
    /// edges overrode the colour. Infinity for sure marks.
    pub margin: Raster<f32>,
    /// Rounds until convergence, or the allowed number.
    pub rounds: usize,
}

/// Marks a rectangle around the full subject: background outside, possible subject inside. Given as left, top,
/// width and height in pixels, and clipped to the picture.
pub fn rectangle((width, height): (usize, usize), [left, top, columns, rows]: [usize; 4]) -> Raster<Mark> {
    let (right, bottom) = (left.saturating_add(columns), top.saturating_add(rows));
    Raster::from_fn(width, height, |x, y| {
        if (left..right).contains(&x) && (top..bottom).contains(&y) { Mark::MaybeSubject } else { Mark::Background }
    })
}

/// Cuts the subject out in at most `rounds` rounds of fitting colours and cutting. NaN counts as black.
///
/// # Errors
/// If picture and marks differ in size or are too large, or if no pixel is marked as background, or none as
/// subject.
pub fn grab_cut(picture: &Encoded, marks: &Raster<Mark>, rounds: usize) -> Result<GrabCut> {
    grab_cut_knowing(picture, marks, &Known::default(), rounds)
}

/// Additional knowledge of each pixel besides its mark and colour.
#[derive(Clone, Copy, Default)]
pub struct Known<'a> {
    /// Log odds of the subject; negative for the background.
    pub odds: Option<&'a [f32]>,
    /// Cost of its colour as background, in place of the cost from the background's colour mixture: minus the
    /// logarithm of its density in codes, without the constant that [`Mixture::cost`] omits.
    pub behind: Option<&'a [f32]>,
}

/// GrabCut with additional knowledge of each pixel.
///
/// # Errors
/// As [`grab_cut`].
pub fn grab_cut_knowing(picture: &Encoded, marks: &Raster<Mark>, known: &Known, rounds: usize) -> Result<GrabCut> {
    let (width, height) = picture.0.size();
    if marks.size() != (width, height) {
        return Err(Error::invalid(
            format!("the marks have {} × {} pixels, the picture {width} × {height}", marks.width, marks.height),
            "Draw the marks on this picture",
        ));
    }
    if width * height > MAX_PIXELS {
        return Err(Error::invalid(
            format!("a picture of {width} × {height} pixels is too large to cut at once"),
            format!("Reduce it to at most {MAX_PIXELS} pixels"),
        ));
    }
    let colors: Vec<[f64; 3]> =
        (picture.0.pixels.iter()).map(|pixel| pixel.map(|v| f64::from(unit(v)) * 255.0)).collect();
    let mut subject: Vec<bool> = marks.pixels.iter().map(|mark| mark.is_subject()).collect();
    let side = |subject: &[bool], wanted: bool| -> Vec<[f64; 3]> {
        let sides = colors.iter().zip(subject);
        sides.filter(|s| *s.1 == wanted).map(|s| *s.0).collect()
    };
    let nothing = |what: &str, remedy: &str| Error::invalid(format!("no pixel is marked as {what}"), remedy.to_owned());
    let mut front = Mixture::split(&side(&subject, true))
        .ok_or_else(|| nothing("subject", "Mark a part of the subject to keep"))?;
    let mut back = Mixture::split(&side(&subject, false))
        .ok_or_else(|| nothing("background", "Mark a part of the background to remove"))?;
    let links = links(&colors, width, height);
    let mut costs = Vec::new();
    let mut done = 0;
    while done < rounds.max(1) {
        done += 1;
        // A side without pixels keeps its previous colours.
        let now = |wanted| {
            let sides = colors.iter().zip(&subject);
            sides.filter(move |s| *s.1 == wanted).map(|s| *s.0)
        };
        front = front.refitted(now(true)).unwrap_or(front);
        back = back.refitted(now(false)).unwrap_or(back);
        costs = (colors.par_iter().enumerate())
            .map(|(i, &color)| {
                let odds = known.odds.map_or(0.0, |odds| f64::from(odds[i]));
                let behind = known.behind.map(|behind| f64::from(behind[i]));
                let behind = behind.unwrap_or_else(|| back.cost(color)) + odds.max(0.0);
                let subject = front.cost(color) - odds.min(0.0);
                (behind.min(MOST), subject.min(MOST))
            })
            .collect();
        let cut = cut(&costs, marks, &links);
        let same = cut == subject;
        subject = cut;
        if same {
            break;
        }
    }
    let margin = (costs.iter().zip(&subject).zip(&marks.pixels))
        .map(|((&(back, front), &subject), mark)| match mark {
            Mark::Background | Mark::Subject => f32::INFINITY,
            _ if subject => (back - front) as f32,
            _ => (front - back) as f32,
        })
        .collect();
    let raster = |pixels| Raster { width, height, pixels };
    Ok(GrabCut { subject: raster(subject), margin: Raster { width, height, pixels: margin }, rounds: done })
}

/// Costs of separating each pixel from its neighbours to the right and below (directions 4 to 7), equation 11:
/// lower where colours differ more than average.
fn links(colors: &[[f64; 3]], width: usize, height: usize) -> Vec<[i32; 4]> {
    let difference = |pixel: usize, d: usize| {
        let (across, down) = NEIGHBOURS[d];
        let (x, y) = ((pixel % width) as isize + across, (pixel / width) as isize + down);
        if !(0..width as isize).contains(&x) || y >= height as isize {
            return None;
        }
        let other = colors[y as usize * width + x as usize];
        Some((0..3).map(|c| (colors[pixel][c] - other[c]).powi(2)).sum::<f64>())
    };
    let (sum, count) = (0..colors.len())
        .flat_map(|pixel| (4..8).map(move |d| (pixel, d)))
        .filter_map(|(pixel, d)| difference(pixel, d))
        .fold((0.0, 0usize), |(sum, count), d| (sum + d, count + 1));
    // Uniform pictures have no edges to follow.
    let beta = if sum > 0.0 { count as f64 / (2.0 * sum) } else { 0.0 };
    (0..colors.len())
        .into_par_iter()
        .map(|pixel| {
            std::array::from_fn(|i| {
                let d = i + 4;
                let length = if NEIGHBOURS[d].0 != 0 && NEIGHBOURS[d].1 != 0 { std::f64::consts::SQRT_2 } else { 1.0 };
                difference(pixel, d).map_or(0, |apart| ((GAMMA / length) * (-beta * apart).exp() * SCALE) as i32)
            })
        })
        .collect()
}

fn cut(costs: &[(f64, f64)], marks: &Raster<Mark>, links: &[[i32; 4]]) -> Vec<bool> {
    let (width, height) = marks.size();
    let mut network = FlowNetwork::new(width, height);
    for (pixel, ((&(back, front), mark), links)) in costs.iter().zip(&marks.pixels).zip(links).enumerate() {
        let (x, y) = (pixel % width, pixel / width);
        // A cost common to both sides changes nothing.
        let least = back.min(front);
        let whole = |cost: f64| ((cost - least) * SCALE) as i32;
        let (to_sink, to_source) = match mark {
            Mark::Background => (0, SURE),
            Mark::Subject => (SURE, 0),
            _ => (whole(back), whole(front)),
        };
        network.set_terminal(x, y, to_sink, to_source);
        for (i, &cost) in links.iter().enumerate().filter(|link| *link.1 > 0) {
            network.link(x, y, i + 4, cost);
        }
    }
    network.source_side()
}

#[cfg(test)]
#[path = "grab_cut_tests.rs"]
mod tests;
