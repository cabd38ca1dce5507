//! Accuracy of relit pictures by several metrics, all on the exposure and codes of the [measure](super::metrics).

use super::flip::{PIXELS_PER_DEGREE, flip};
use super::metrics::{Compared, check, encoded, mean_inside, psnr};
use super::ssim::ssim;
use base::error::Result;
use imaging::{Encoded, Image};
use serde::{Deserialize, Serialize};

/// Accuracy of pictures, as means over frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Fidelity {
    /// PSNR over the subject in decibels.
    pub psnr_db: f64,
    /// SSIM over the subject, 1 for equal pictures.
    pub ssim: f64,
    /// FLIP over the subject, from 0 for equal pictures to 1.
    pub flip: f64,
    /// LPIPS of the subject over black, 0 for equal pictures; None without its weights.
    pub lpips: Option<f64>,
}

/// Perceptual distance from the truth, the first picture, to the second.
pub type Distance<'a> = &'a dyn Fn(&Encoded, &Encoded) -> Result<f64>;

/// Compares the frames under one environment, one picture each.
///
/// # Errors
/// When there is no frame, sizes differ, a frame has no subject, or `lpips` fails.
pub fn fidelity(frames: &[Compared], lpips: Option<Distance>) -> Result<Fidelity> {
    let found = psnr(frames)?;
    let mut all = Fidelity { psnr_db: found.mean_db, ..Fidelity::default() };
    let mut perceived = 0.0;
    for frame in frames {
        check(frame)?;
        let exposure = frame.exposure();
        let codes = |picture: &Image, gain: f64| encoded(picture, frame.mask, gain as f32);
        for (picture, truth) in frame.pictures.iter().zip(frame.truths) {
            let (truth, picture) = (codes(truth, exposure), codes(picture, exposure * found.scale));
            let share = 1.0 / (frames.len() * frame.truths.len()) as f64;
            all.ssim += share * mean_inside(&ssim(&truth, &picture)?, frame.mask)?;
            let visible = flip(&truth, &picture, PIXELS_PER_DEGREE)?;
            all.flip += share * mean_inside(&visible.error, frame.mask)?;
            if let Some(distance) = lpips {
                perceived += share * distance(&truth, &picture)?;
            }
        }
    }
    all.lpips = lpips.map(|_| perceived);
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use imaging::{Mask, Raster};

    #[test]
    fn equal_pictures_are_perfect_in_any_unit_and_noise_costs_by_every_measure() -> Result<()> {
        let mask = Mask::filled(32, 32, 1.0);
        let picture = |level: f32, noise: f32| {
            Raster::from_fn(32, 32, |x, y| {
                let sign = if (x * 7 + y * 13) % 5 < 2 { 1.0 } else { -1.0 };
                [level * (0.3 + 0.01 * x as f32 + sign * noise); 3]
            })
        };
        let measured = |level: f32, noise: f32| {
            let (pictures, truths) = ([picture(level, noise)], [picture(1.0, 0.0)]);
            let frame = Compared { pictures: &pictures, truths: &truths, mask: &mask };
            fidelity(&[frame, frame], Some(&|a, b| Ok(f64::from(a != b))))
        };
        let equal = measured(3.0, 0.0)?;
        assert!(equal.psnr_db > 100.0 && equal.ssim > 0.9999 && equal.flip < 1e-3);
        let (little, much) = (measured(1.0, 0.01)?, measured(1.0, 0.05)?);
        assert!(much.psnr_db < little.psnr_db && little.psnr_db < equal.psnr_db);
        assert!(much.ssim < little.ssim && much.flip > little.flip);
        assert_eq!(much.lpips, Some(1.0));
        Ok(())
    }
}
