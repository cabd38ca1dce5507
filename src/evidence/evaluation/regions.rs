//! Error by region of the subject: lit, shadow, highlights and edge.

use super::metrics::{Compared, SUBJECT, code, decibels};
use imaging::Mask;
use imaging::color::luminance;
use serde::{Deserialize, Serialize};

/// Luminance limits at the truth's exposure, where 95 of 100 values are below 0.5: highlights are above the first,
/// shadow is below the second, a tenth of it.
const HIGHLIGHT: f32 = 0.5;
const SHADOW: f32 = 0.05;
/// Width of the edge as a share of the picture's longer side; at least a pixel.
const EDGE: f64 = 1.0 / 64.0;

/// Part of the subject. The regions are disjoint and cover the subject.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Region {
    /// Neither bright nor dark in the truth.
    Lit,
    /// Less than a tenth of the highlights' luminance in the truth.
    Shadow,
    /// Brightest in the truth.
    Highlights,
    /// Along the matte's edge, whatever the luminance.
    Edge,
}

impl Region {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Lit, Self::Shadow, Self::Highlights, Self::Edge];

    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lit => "lit",
            Self::Shadow => "shadow",
            Self::Highlights => "highlights",
            Self::Edge => "edge",
        }
    }
}

/// Accuracy of pictures in a region.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RegionScore {
    pub region: Region,
    /// Share of the subject's pixels, over all frames.
    pub share: f64,
    /// PSNR over the region's pixels in all frames, in decibels.
    pub psnr_db: f64,
}

/// Regions present in the frames under one environment. `scale` is the factor on the pictures.
pub fn regions(frames: &[Compared], scale: f64) -> Vec<RegionScore> {
    let mut sums = [(0.0f64, 0u64); Region::ALL.len()];
    for frame in frames {
        let exposure = frame.exposure();
        let edge = edge(frame.mask);
        for (picture, truth) in frame.pictures.iter().zip(frame.truths) {
            let pixels = picture.pixels.iter().zip(&truth.pixels);
            let inside = (frame.mask.pixels.iter().zip(&edge)).zip(pixels);
            for ((_, &at_edge), (picture, truth)) in inside.filter(|((a, _), _)| **a > SUBJECT) {
                let finite = |v: f32| if v.is_finite() { f64::from(v) } else { 0.0 };
                let squares = picture.iter().zip(truth).map(|(&p, &t)| {
                    let (p, t) = (exposure * scale * finite(p), exposure * finite(t));
                    (code(p) - code(t)).powi(2)
                });
                let light = exposure as f32 * luminance(*truth);
                let region = match light {
                    _ if at_edge => Region::Edge,
                    light if light > HIGHLIGHT => Region::Highlights,
                    light if light >= SHADOW => Region::Lit,
                    _ => Region::Shadow,
                };
                let (sum, count) = &mut sums[region as usize];
                *sum += squares.sum::<f64>() / 3.0;
                *count += 1;
            }
        }
    }
    let all: u64 = sums.iter().map(|(_, count)| count).sum();
    let found = Region::ALL.into_iter().zip(sums);
    found
        .filter(|(_, (_, count))| *count > 0)
        .map(|(region, (sum, count))| RegionScore {
            region,
            share: count as f64 / all as f64,
            psnr_db: decibels(sum / count as f64),
        })
        .collect()
}

/// True for each pixel near one outside the subject. The picture's border does not count as an edge.
fn edge(mask: &Mask) -> Vec<bool> {
    let (width, height) = mask.size();
    let reach = ((EDGE * width.max(height) as f64).round() as usize).max(1);
    let outside: Vec<bool> = mask.pixels.iter().map(|&alpha| alpha <= SUBJECT).collect();
    // A square neighbourhood is a row of columns.
    let near = |at: usize, count: usize| at.saturating_sub(reach)..(at + reach + 1).min(count);
    let across: Vec<bool> =
        (0..width * height).map(|i| near(i % width, width).any(|x| outside[i / width * width + x])).collect();
    (0..width * height).map(|i| near(i / width, height).any(|y| across[y * width + i % width])).collect()
}

#[cfg(test)]
mod tests {
    use super::super::metrics::psnr;
    use super::*;
    use imaging::{Image, Raster};

    /// A subject that leaves a border of two pixels, brighter from left to right, with a glint.
    fn scene() -> (Image, Mask) {
        let mask = Raster::from_fn(40, 20, |x, y| {
            let inside = (2..38).contains(&x) && (2..18).contains(&y);
            f32::from(u8::from(inside))
        });
        let truth = Raster::from_fn(40, 20, |x, y| {
            let glint = (30..33).contains(&x) && (9..12).contains(&y);
            let level = if glint { 0.01 } else { 0.001 };
            [level * 1.2f32.powi(x as i32); 3]
        });
        (truth, mask)
    }

    #[test]
    fn regions_cover_the_subject_once_and_their_errors_are_its_error() {
        let (truth, mask) = scene();
        let wrong =
            Raster::from_fn(40, 20, |x, y| truth.at(x, y).map(|v| v * (1.0 + 0.02 * ((x * 7 + y * 3) % 11) as f32)));
        let (pictures, truths) = ([wrong], [truth]);
        let frame = Compared { pictures: &pictures, truths: &truths, mask: &mask };
        let found = psnr(&[frame]).unwrap();
        let regions = regions(&[frame], found.scale);
        assert_eq!(regions.len(), Region::ALL.len(), "{regions:?}");
        let shares: f64 = regions.iter().map(|region| region.share).sum();
        assert!((shares - 1.0).abs() < 1e-12);
        let error = |db: f64| 10f64.powf(-db / 10.0);
        let pooled: f64 = regions.iter().map(|r| r.share * error(r.psnr_db)).sum();
        let whole = error(found.mean_db);
        assert!((pooled / whole - 1.0).abs() < 1e-9, "{pooled} {whole}");
    }

    #[test]
    fn an_error_is_found_where_it_is() {
        let (truth, mask) = scene();
        // Errors at the edge, in the shadow and in the light, one at a time.
        for (at, worst) in [
            ((20, 2), Region::Edge),
            ((4, 10), Region::Shadow),
            ((25, 10), Region::Lit),
            ((31, 10), Region::Highlights),
        ] {
            let mut wrong = truth.clone();
            wrong.pixels[at.1 * 40 + at.0] = [0.0; 3];
            let (pictures, truths) = ([wrong], [truth.clone()]);
            let frame = Compared { pictures: &pictures, truths: &truths, mask: &mask };
            let regions = regions(&[frame], 1.0);
            let lowest = regions.iter().min_by(|a, b| a.psnr_db.total_cmp(&b.psnr_db));
            assert_eq!(lowest.unwrap().region, worst, "{regions:?}");
        }
    }
}
