//! Pictures of a case for a page and for the window.

use super::super::flip::{PIXELS_PER_DEGREE, flip};
use super::super::metrics::encoded;
use super::reviewer::{CasePictures, Reviewer};
use super::{Case, heat};
use base::error::{Error, Result};
use base64::prelude::{BASE64_STANDARD, Engine};
use gpu::DeviceChoice;
use imaging::file::png_bytes;
use imaging::resample::resize_area;
use imaging::{Encoded, Image, Raster};
use project::Project;
use std::path::Path;

/// Longest side of a picture in a page.
const SIDE_PX: usize = 256;
/// Side of a thumbnail in the contact sheet.
const SMALL_PX: usize = 96;

/// Pictures of a case in the scored codes.
pub struct ScoredPictures {
    pictures: CasePictures,
    exposure: f64,
    scale: f64,
}

impl ScoredPictures {
    /// Predicts a case with the project's network, and reads its truth: the photographs of a pose, or a frame's OLATs
    /// in `truth`. `scale` is the scale of the case's scores.
    ///
    /// # Errors
    /// When there is no calibration, network or truth, or a file cannot be read.
    pub fn open(
        project: &Project,
        truth: Option<&Path>,
        device: DeviceChoice,
        (case, scale): (Case, f64),
    ) -> Result<Self> {
        // Poses need no truth.
        let truth = truth.filter(|_| matches!(case, Case::Frame(_)));
        let reviewer = Reviewer::open(project, truth, device)?;
        Ok(Self::new(reviewer.predict(case)?, scale))
    }

    /// `scale` converts predictions to the truth's units.
    pub(super) fn new(pictures: CasePictures, scale: f64) -> Self {
        Self { exposure: pictures.compared().exposure(), pictures, scale }
    }

    fn code(&self, olat: &Image, scale: f64) -> Encoded {
        encoded(olat, &self.pictures.mask, (self.exposure * scale) as f32)
    }

    fn predicted(&self, lamp: usize) -> Encoded {
        self.code(&self.pictures.predicted[lamp], self.scale)
    }

    /// True and predicted picture of a lamp, and the FLIP of each pixel, 0 to 1.
    ///
    /// # Errors
    /// When there is no such lamp, or the pictures differ in size.
    pub fn compare(&self, lamp: usize) -> Result<([Encoded; 2], Raster<f32>)> {
        let Some(truth) = self.pictures.truths.get(lamp) else {
            return Err(Error::missing(format!("the measurement has no lamp {lamp}"), "Measure again"));
        };
        let truth = self.code(truth, 1.0);
        let predicted = self.predicted(lamp);
        let errors = flip(&truth, &predicted, PIXELS_PER_DEGREE)?.error;
        Ok(([truth, predicted], errors))
    }

    /// The same with FLIP as heat, as data URIs.
    pub(super) fn row(&self, lamp: usize) -> Result<[String; 3]> {
        let ([truth, predicted], errors) = self.compare(lamp)?;
        let errors = Encoded(errors.map(heat));
        Ok([data_uri(&truth, SIDE_PX)?, data_uri(&predicted, SIDE_PX)?, data_uri(&errors, SIDE_PX)?])
    }

    /// Predicted thumbnail of every lamp, as data URIs.
    pub(super) fn sheet(&self) -> Result<Vec<String>> {
        (0..self.pictures.predicted.len()).map(|lamp| data_uri(&self.predicted(lamp), SMALL_PX)).collect()
    }
}

/// PNG of at most `side` pixels a side, as a data URI.
fn data_uri(picture: &Encoded, side: usize) -> Result<String> {
    let (width, height) = picture.0.size();
    let longest = width.max(height).max(1);
    let bytes = if longest <= side {
        png_bytes(picture)?
    } else {
        let reduce = |length: usize| (length * side / longest).max(1);
        // Averaging codes is good enough for a picture that is only viewed.
        let small = resize_area(&picture.0, reduce(width), reduce(height));
        png_bytes(&Encoded(small))?
    };
    Ok(format!("data:image/png;base64,{}", BASE64_STANDARD.encode(bytes)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use imaging::Mask;

    #[test]
    fn pictures_of_a_page_are_small_and_where_nothing_differs_the_third_is_dark() {
        let olat = |seed: usize| -> Image {
            Raster::from_fn(600, 300, |x, y| [((x * 3 + y * 5 + seed) % 17) as f32 / 17.0; 3])
        };
        let pictures = CasePictures {
            mask: Mask::filled(600, 300, 1.0),
            predicted: vec![olat(0), olat(9)],
            truths: vec![olat(0), olat(0)],
        };
        let pictures = ScoredPictures::new(pictures, 1.0);
        let [truth, predicted, same] = pictures.row(0).unwrap();
        assert_eq!(truth, predicted);
        let [.., different] = pictures.row(1).unwrap();
        assert!(different.len() > same.len(), "an even picture packs well");
        assert!(pictures.sheet().unwrap().iter().all(|uri| uri.len() < truth.len()));
    }
}
