//! Matte of a picture with a dark background, such as the maximum of a pose over all lamps.

use super::parts::{clean, drop_loose};
use super::refine::guided;
use super::{Matte, linear, otsu, window};
use base::error::{Error, Result};
use imaging::{Encoded, Mask};
use rayon::prelude::*;

/// Light below which a pixel counts as black.
const BLACK: f32 = 1e-4;
/// Smallest explained share of the variance of log light for two classes to be subject and background.
const LEAST_EXPLAINED: f32 = 0.6;

/// Matte of a subject brighter than its background. The threshold is the best split of the logarithm of light into
/// two classes.
///
/// # Errors
/// When there is no clear split.
pub fn lit(picture: &Encoded) -> Result<Matte> {
    let size = picture.0.size();
    let light = linear(picture);
    let log: Vec<f32> = (light.par_iter()).map(|p| p.iter().copied().fold(BLACK, f32::max).log2()).collect();
    let (threshold, explained) = otsu(&log, (BLACK.log2(), 0.01)).unwrap_or((0.0, 0.0));
    if explained < LEAST_EXPLAINED {
        return Err(Error::missing(
            "the subject does not differ from the background in brightness, and there is no green or blue screen",
            "Add your own mattes beside the pictures, as grey PNGs of their size",
        ));
    }
    let mut inside: Vec<bool> = log.iter().map(|&v| v > threshold).collect();
    clean(&mut inside, size, |_| false);
    let reach = 2;
    let binary: Vec<[f32; 1]> = inside.iter().map(|&i| [f32::from(u8::from(i))]).collect();
    let near = window::sums(&binary, size, reach);
    let count = window::counts(size, reach);
    let core: Vec<bool> = (0..near.len()).map(|i| near[i][0] > count(i) - 0.5).collect();
    let behind: Vec<bool> = near.iter().map(|[n]| *n < 0.5).collect();
    let brightest = |i: usize| [light[i].iter().copied().fold(0.0, f32::max)];
    let around = |certain: &[bool]| {
        let known = certain.iter().filter(|c| **c).count().max(1) as f32;
        let all = (0..certain.len()).filter(|&i| certain[i]);
        let mean = all.map(|i| brightest(i)[0]).sum::<f32>() / known;
        window::means(brightest, certain, size, reach, vec![[mean]; certain.len()])
    };
    let (subject, background) = (around(&core), around(&behind));
    let mixed: Vec<f32> = (0..core.len())
        .map(|i| match (core[i], behind[i]) {
            (true, _) => 1.0,
            (_, true) => 0.0,
            _ => {
                let [from, to] = [background[i][0], subject[i][0]];
                ((brightest(i)[0] - from) / (to - from).max(BLACK)).clamp(0.0, 1.0)
            }
        })
        .collect();
    let soft = guided(&light, &mixed, size, reach);
    let in_doubt = |i: usize| !core[i] && !behind[i];
    let mut alpha: Vec<f32> = (0..mixed.len()).map(|i| if in_doubt(i) { soft[i] } else { mixed[i] }).collect();
    drop_loose(&mut alpha, size, &inside);
    let uncertain = (0..alpha.len()).filter(|&i| in_doubt(i)).count() as f32 / alpha.len() as f32;
    Ok(Matte { mask: Mask { width: size.0, height: size.1, pixels: alpha }, uncertain })
}
