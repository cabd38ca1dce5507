//! The measure: PSNR of encoded pictures over the subject.
//!
//! Pictures are compared where the matte exceeds [`SUBJECT`]. An HDRI has no absolute scale, so one factor for all
//! frames of an environment matches the mean luminance to the truth's. Each frame's exposure is e = 0.5 / (95th
//! percentile of the truth's values); both pictures become clip(e·x, 0, 1)^(1/2.2). PSNR is over all channels with peak
//! 1, and the mean is over frames.

use base::error::{Error, Result};
use imaging::color::{luminance, unit};
use imaging::{Encoded, Image, Mask, Raster};

/// Coverage above which a pixel belongs to the subject.
pub const SUBJECT: f32 = 0.98;

/// Exponent that encodes pictures before the comparison.
const GAMMA: f64 = 2.2;

/// Upper limit of PSNR: closer pictures count as equal, so that reports hold only finite numbers.
pub const MAX_DECIBELS: f64 = 120.0;

/// Pictures of one frame that are measured together, with their truths: one relit picture, or the frame under every
/// lamp. All have the matte's size.
#[derive(Clone, Copy, Debug)]
pub struct Compared<'a> {
    pub pictures: &'a [Image],
    pub truths: &'a [Image],
    pub mask: &'a Mask,
}

/// Result of a measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct Psnr {
    /// Mean over frames in decibels.
    pub mean_db: f64,
    /// Each frame in decibels.
    pub frames_db: Vec<f64>,
    /// Each of a frame's pictures in decibels, at the frame's exposure.
    pub pictures_db: Vec<Vec<f64>>,
    /// Factor applied to all pictures.
    pub scale: f64,
}

/// PSNR of the frames. The pictures of one frame share an exposure, and the error is pooled over them: the bright OLATs
/// of a frame count, while a mean of decibels would reward black ones.
///
/// # Errors
/// When there is no frame, shapes differ, or no pixel belongs to the subject.
pub fn psnr(frames: &[Compared]) -> Result<Psnr> {
    if frames.is_empty() {
        return Err(Error::missing("the truth has no frames", "Give another truth folder"));
    }
    frames.iter().try_for_each(check)?;
    let total = |[pictures, truths]: [f64; 2], [p, t]: [f64; 2]| [pictures + p, truths + t];
    let luminances = frames.iter().map(Compared::luminances).fold([0.0; 2], total);
    let scale = scale(luminances);
    let pictures_db: Vec<Vec<f64>> = frames.iter().map(|f| f.pictures_db(scale)).collect();
    // All pictures of a frame have the same number of pixels, so the mean of their errors is the frame's.
    let frames_db: Vec<f64> = pictures_db.iter().map(|p| pooled(p.iter().copied())).collect();
    Ok(Psnr { mean_db: frames_db.iter().sum::<f64>() / frames_db.len() as f64, frames_db, pictures_db, scale })
}

/// Subject pixels of all pictures; NaN counts as black.
fn subject(pictures: &[Image], mask: &Mask) -> Vec<[f32; 3]> {
    let inside = |image: &Image| {
        let pairs = image.pixels.iter().zip(&mask.pixels);
        pairs.filter(|&(_, &alpha)| alpha > SUBJECT).map(|(&pixel, _)| pixel).collect::<Vec<_>>()
    };
    let finite = |v: f32| if v.is_finite() { v } else { 0.0 };
    pictures.iter().flat_map(inside).map(|pixel| pixel.map(finite)).collect()
}

impl Compared<'_> {
    /// Sum of the subject's luminance over the pictures, and over the truths.
    pub(super) fn luminances(&self) -> [f64; 2] {
        [self.pictures, self.truths].map(|pictures| {
            let pixels = subject(pictures, self.mask);
            pixels.iter().map(|&p| f64::from(luminance(p))).sum()
        })
    }

    /// Exposure that encodes the truths.
    pub fn exposure(&self) -> f64 {
        let truths = subject(self.truths, self.mask);
        0.5 / percentile(truths.as_flattened(), 95.0)
    }

    /// PSNR of each picture, at the frame's exposure.
    pub(super) fn pictures_db(&self, scale: f64) -> Vec<f64> {
        let truths = subject(self.truths, self.mask);
        let exposure = self.exposure();
        let encode = |v: f64| code(exposure * v);
        let pictures = subject(self.pictures, self.mask);
        let pixels = truths.len() / self.truths.len().max(1);
        let pairs = pictures.chunks(pixels).zip(truths.chunks(pixels));
        pairs
            .map(|(picture, truth)| {
                let values = picture.as_flattened().iter().zip(truth.as_flattened());
                let squares = values.map(|(&p, &t)| (encode(f64::from(p) * scale) - encode(f64::from(t))).powi(2));
                decibels(squares.sum::<f64>() / (3 * pixels) as f64)
            })
            .collect()
    }
}

/// Code of a value at its exposure.
pub(super) fn code(exposed: f64) -> f64 {
    exposed.clamp(0.0, 1.0).powf(1.0 / GAMMA)
}

/// Factor of the pictures, from the luminances of pictures and truths.
pub(super) fn scale([pictures, truths]: [f64; 2]) -> f64 {
    let ratio = truths / pictures;
    // A black prediction cannot be scaled.
    if ratio.is_finite() && ratio > 0.0 { ratio } else { 1.0 }
}

/// A picture encoded for the measure, over black: clip(gain·x, 0, 1)^(1/2.2) where it is covered. NaN counts as black.
pub fn encoded(picture: &Image, mask: &Mask, gain: f32) -> Encoded {
    let pairs = picture.pixels.iter().zip(&mask.pixels);
    let code = |v: f32| unit(v).powf(1.0 / GAMMA as f32);
    let pixels = pairs.map(|(p, &alpha)| p.map(|v| code(v * gain * alpha))).collect();
    Encoded(Raster { pixels, ..*picture })
}

/// Pooled PSNR of several pictures of one size.
pub(super) fn pooled(decibels_of: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = decibels_of.len();
    let errors = decibels_of.map(|db| 10f64.powf(-db / 10.0));
    decibels(errors.sum::<f64>() / count as f64)
}

/// A mean square error as PSNR, with 1 as the peak.
pub(super) fn decibels(error: f64) -> f64 {
    (-10.0 * error.log10()).min(MAX_DECIBELS)
}

/// Percentile of the values, interpolated linearly as in numpy. At least the smallest normal number, so that a black
/// truth has an exposure.
fn percentile(values: &[f32], percent: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f32::total_cmp);
    // A frame may show no subject.
    let Some(last) = sorted.len().checked_sub(1) else { return f64::from(f32::MIN_POSITIVE) };
    let place = percent / 100.0 * last as f64;
    let (low, share) = (place.floor() as usize, place.fract());
    let high = (low + 1).min(last);
    let value = f64::from(sorted[low]) * (1.0 - share) + f64::from(sorted[high]) * share;
    value.max(f64::from(f32::MIN_POSITIVE))
}

/// Mean of a map over the subject's pixels of a matte.
///
/// # Errors
/// When the matte has another size or no such pixel.
pub fn mean_inside(map: &Raster<f32>, mask: &Mask) -> Result<f64> {
    let size = |(w, h): (usize, usize)| format!("{w} × {h} pixels");
    if map.size() != mask.size() {
        return Err(Error::invalid(
            format!("a matte has {}, but its picture has {}", size(mask.size()), size(map.size())),
            "Give the matte that belongs to this picture",
        ));
    }
    let (mut sum, mut count) = (0f64, 0u64);
    for (&value, _) in (map.pixels.iter().zip(&mask.pixels)).filter(|&(_, &alpha)| alpha > SUBJECT) {
        sum += f64::from(value);
        count += 1;
    }
    if count == 0 {
        return Err(no_subject());
    }
    Ok(sum / count as f64)
}

/// Refuses pictures that cannot be compared pixel by pixel.
pub(super) fn check_pair(reference: &Encoded, test: &Encoded) -> Result<()> {
    let size = |(w, h): (usize, usize)| format!("{w} × {h} pixels");
    if test.0.size() == reference.0.size() && !test.0.pixels.is_empty() {
        return Ok(());
    }
    Err(Error::invalid(
        format!("a picture of {} cannot be compared with one of {}", size(test.0.size()), size(reference.0.size())),
        "Compare pictures of one size, with at least one pixel",
    ))
}

fn no_subject() -> Error {
    Error::invalid(
        format!("a frame to compare has no subject: no pixel is covered by more than {SUBJECT}"),
        "Check the mattes of the interview, or use a larger working size",
    )
}

pub(super) fn check(frame: &Compared) -> Result<()> {
    let remedy = "Give the truth that belongs to this shoot";
    if frame.pictures.len() != frame.truths.len() {
        return Err(Error::invalid(
            format!("{} pictures cannot be compared with {} truths", frame.pictures.len(), frame.truths.len()),
            remedy,
        ));
    }
    let size = frame.mask.size();
    if let Some(other) = frame.pictures.iter().chain(frame.truths).find(|p| p.size() != size) {
        let say = |(w, h): (usize, usize)| format!("{w} × {h} pixels");
        return Err(Error::invalid(
            format!("a picture to compare has {}, but the matte has {}", say(other.size()), say(size)),
            remedy,
        ));
    }
    if frame.truths.is_empty() || !frame.mask.pixels.iter().any(|&alpha| alpha > SUBJECT) {
        return Err(no_subject());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn picture(seed: usize) -> Image {
        let value = |i: usize| ((i + seed).wrapping_mul(2_654_435_761) >> 8 & 0xffff) as f32 / 65536.0;
        Raster::from_fn(12, 9, |x, y| std::array::from_fn(|c| value(c + 3 * (x + 12 * y))))
    }

    fn one(picture: &Image, truth: &Image, mask: &Mask) -> Psnr {
        let (pictures, truths) = ([picture.clone()], [truth.clone()]);
        psnr(&[Compared { pictures: &pictures, truths: &truths, mask }]).unwrap()
    }

    proptest! {
        #[test]
        fn the_pictures_units_do_not_matter(unit in 1e-4f32..1e4) {
            let (truth, mask) = (picture(0), Mask::filled(12, 9, 1.0));
            let there = one(&picture(77), &truth, &mask);
            let scaled = one(&picture(77).map(|p| p.map(|v| v * unit)), &truth, &mask);
            prop_assert!((there.mean_db - scaled.mean_db).abs() < 1e-3);
            prop_assert!((there.scale / scaled.scale / f64::from(unit) - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn a_known_error_has_its_decibels() {
        // The 95th percentile of a uniform truth is its value, so it encodes to 0.5^(1/2.2). With equal means, pixels
        // that are half at 0.9 and half at 1.1 encode to 0.45 and 0.55 to that power.
        let truth = Image::filled(10, 10, [3.0; 3]);
        let wrong = Raster::from_fn(10, 10, |x, _| [if x % 2 == 0 { 0.9 } else { 1.1 }; 3]);
        let found = one(&wrong, &truth, &Mask::filled(10, 10, 1.0));
        let encode = |v: f64| v.powf(1.0 / 2.2);
        let error = [0.45, 0.55].map(|v| (encode(v) - encode(0.5)).powi(2)).iter().sum::<f64>() / 2.0;
        assert!((found.mean_db + 10.0 * error.log10()).abs() < 1e-4, "{found:?}");
        assert!((found.scale - 3.0).abs() < 1e-5);
    }

    #[test]
    fn only_the_subject_counts() {
        let mask = Raster::from_fn(12, 9, |x, _| if x < 6 { 1.0 } else { 0.97 });
        let mut spoilt = picture(3);
        for y in 0..9 {
            spoilt.pixels[y * 12 + 8] = [f32::NAN, 1e9, -5.0];
        }
        assert_eq!(one(&spoilt, &picture(3), &mask).mean_db, MAX_DECIBELS);
    }

    #[test]
    fn black_and_broken_pictures_have_finite_scores() {
        let mask = Mask::filled(12, 9, 1.0);
        for value in [0.0, f32::NAN, f32::INFINITY, -1.0] {
            assert!(one(&Image::filled(12, 9, [value; 3]), &picture(0), &mask).mean_db.is_finite());
            assert!(one(&picture(0), &Image::filled(12, 9, [value; 3]), &mask).mean_db.is_finite());
        }
    }

    #[test]
    fn percentiles_are_those_of_numpy() {
        assert_eq!(percentile(&[4.0, 1.0, 3.0, 2.0], 50.0), 2.5);
        assert!((percentile(&[0.0, 1.0, 2.0, 3.0, 10.0], 95.0) - 8.6).abs() < 1e-12);
        assert_eq!(percentile(&[7.0], 95.0), 7.0);
        assert!(percentile(&[], 95.0) > 0.0);
    }

    #[test]
    fn nothing_to_compare_is_an_error() {
        assert!(psnr(&[]).is_err());
        let (a, small) = ([picture(0)], [Image::filled(2, 2, [0.0; 3])]);
        let mask = Mask::filled(12, 9, 1.0);
        assert!(psnr(&[Compared { pictures: &a, truths: &small, mask: &mask }]).is_err());
        let empty = Mask::filled(12, 9, 0.5);
        assert!(psnr(&[Compared { pictures: &a, truths: &a, mask: &empty }]).is_err());
    }
}
