//! Poses predicted from the others: their error estimates the error on new pictures.

use super::cells::{Differences, covered, mean_of_cells};
use super::lamps::LampErrors;
use super::relation::{PoseErrors, Sign};
use base::error::Result;
use base::median::median;
use calibration::Calibration;
use footage::{Exemplar, Frame};
use imaging::{Image, Mask};
use project::Project;
use transfer::Carried;

/// A pose as an interview frame would show it, and as it was photographed.
pub struct Photographed {
    pub frame: Frame,
    pub olats: Vec<Image>,
}

impl Photographed {
    /// Reads pose `pose` and lights it as in the interview.
    ///
    /// # Errors
    /// When a picture cannot be read.
    pub fn load(project: &Project, calibration: &Calibration, pose: usize) -> Result<Self> {
        let response = &calibration.response;
        let exemplar = Exemplar::load(project, response, pose)?;
        let light = calibration.interview_light();
        Ok(Self {
            frame: Frame { index: 0, plate: exemplar.relit_by_all(project, response, &light)?, mask: exemplar.mask },
            olats: exemplar.olats,
        })
    }
}

/// Mean square distance from the best exemplar for each subject cell, from [`Carried::unlike`](transfer::Carried).
pub fn squares(unlike: &Mask, mask: &Mask) -> Vec<(usize, f64)> {
    let square = Mask {
        pixels: (unlike.pixels.iter().zip(&mask.pixels)).map(|(unlike, alpha)| alpha * unlike * unlike).collect(),
        ..*mask
    };
    over_alpha(&square, mask)
}

/// Mean over each subject cell of values that are 0 outside the matte.
fn over_alpha(values: &Mask, mask: &Mask) -> Vec<(usize, f64)> {
    let alpha = mean_of_cells(mask, |alpha| f64::from(*alpha));
    let means = mean_of_cells(values, |value| f64::from(*value));
    let shown = covered(mask).into_iter().enumerate();
    shown.filter(|(_, shown)| *shown).map(|(cell, _)| (cell, means[cell] / alpha[cell])).collect()
}

/// Distance and spread of each subject cell.
pub fn signs(carried: &Carried, mask: &Mask) -> Vec<(usize, Sign)> {
    let squares = squares(&carried.unlike, mask);
    let spreads = over_alpha(&carried.spread, mask);
    let pairs = squares.into_iter().zip(spreads);
    pairs
        .map(|((cell, square), (_, spread))| {
            let sign = Sign { distance: square.sqrt(), spread: spread.max(0.0).sqrt() };
            (cell, sign)
        })
        .collect()
}

/// Distance of a whole picture from the best exemplar: the median over the subject's pixels of
/// [`Carried::unlike`](transfer::Carried). Borders of the matte, where few pixels hold most of the square, do not count.
/// 0 without a subject.
pub fn distance(unlike: &Mask, mask: &Mask) -> f32 {
    let pixels = unlike.pixels.iter().zip(&mask.pixels);
    median(pixels.filter(|(_, alpha)| **alpha > 0.5).map(|(unlike, _)| *unlike))
}

/// Root mean square of cells.
pub fn root_mean(squares: impl Iterator<Item = f64>) -> f32 {
    let (sum, count) = squares.fold((0.0, 0usize), |(sum, count), square| (sum + square, count + 1));
    (sum / count.max(1) as f64).sqrt() as f32
}

/// Errors of a picture with known OLATs, cell by cell.
pub fn errors(carried: &Carried, photographed: &Photographed) -> PoseErrors {
    let field = &carried.field;
    let pictures: Vec<Image> = (0..field.lamps).map(|lamp| field.olat(lamp)).collect();
    let off = Differences::new(&pictures, &photographed.olats, &photographed.frame.mask);
    let (cells, signs): (Vec<usize>, Vec<Sign>) = signs(carried, &photographed.frame.mask).into_iter().unzip();
    PoseErrors {
        signs,
        squared_errors: cells.iter().map(|&cell| off.cells[cell]).collect(),
        lamps: LampErrors {
            squared_errors: off.lamps,
            squared_spreads: carried.lamp_spreads.iter().map(|v| f64::from(*v)).collect(),
        },
    }
}
