//! Data for inspecting a response: the pictures are read once, then any response takes milliseconds to try.

use super::objective::Objective;
use super::subject::{sample_olat, scale};
use super::{Comparison, InspectableFit, Subject, fit};
use crate::code_values::{CodeValues, ResponseTable, STEPS};
use crate::probe::Probes;
use base::error::{Error, Result};
use base::progress::Progress;
use footage;
use imaging::{DualGamma, Encoded, Mask, Raster, Response, resample::resize_area};
use project::Project;
use rayon::prelude::*;

/// Counts of each of 256 encoded levels, for red, green and blue.
pub type Histogram = [[u32; 256]; 3];

/// A point of a curve for drawing, all in `[0, 1]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CurvePoint {
    /// Encoded value.
    pub encoded: f32,
    /// Linear light under the dual gamma.
    pub linear: f32,
    /// I^γ1, the asymptote in the darks.
    pub dark: f32,
    /// I^γ2, the asymptote in the brights.
    pub bright: f32,
}

/// A shoot's pictures in memory.
pub struct GammaStudy {
    subject: Subject,
    probes: Probes,
    picture: PosePicture,
    interview: Histogram,
}

/// One pose at the working size: `codes[pixel · lamps + lamp]`.
struct PosePicture {
    codes: Vec<CodeValues>,
    lamps: usize,
    mask: Mask,
}

impl GammaStudy {
    /// Reads the shoot and pose `pose` for display.
    ///
    /// # Errors
    /// As [`crate::calibrate`], and when the pose does not exist.
    pub fn load(project: &Project, pose: usize, progress: &Progress) -> Result<Self> {
        project.check_parts()?;
        if project.settings.shoot.without_balls {
            return Err(Error::missing(
                "This shoot has no mirror balls, so responses cannot be compared here",
                ("Calibrate with the camera's response", "afterlight calibrate PROJECT --gamma srgb"),
            ));
        }
        let probes = Probes::load(project, progress)?;
        let subject = Subject::load(project, &probes, progress)?;
        let interview =
            histogram(subject.frames.iter().flatten().map(|code| code.map(|c| f32::from(c) / f32::from(STEPS))));
        Ok(Self { picture: PosePicture::load(project, pose)?, subject, probes, interview })
    }

    /// Reads another pose for display.
    ///
    /// # Errors
    /// When the pose does not exist, or a file cannot be read or does not match the others.
    pub fn show_pose(&mut self, project: &Project, pose: usize) -> Result<()> {
        self.picture = PosePicture::load(project, pose)?;
        Ok(())
    }

    /// Fits the response as in [`crate::calibrate`], for [`InspectableFit::surface`] and
    /// [`InspectableFit::compare`].
    ///
    /// # Errors
    /// When pixels are to be compared and no frame shows a pose, or the job was stopped.
    pub fn fit(&self, wanted: Option<Comparison>, progress: &Progress) -> Result<InspectableFit<'_>> {
        fit(&self.subject, &self.probes, wanted, progress)
    }

    /// Interview weights under a response: the share of each lamp per channel, including the light seen on the
    /// subject.
    pub fn weights(&self, response: &Response) -> Vec<[f32; 3]> {
        Objective::known_light(&self.subject, &self.probes, response, Some(1.0)).weights
    }

    /// Root-mean-square encoded distances (0 to 1) of the subject's quantiles and on the mirror balls, under a
    /// response and an exposure.
    pub fn distances(&self, response: &Response, exposure: f32) -> [f32; 2] {
        Objective::known_light(&self.subject, &self.probes, response, Some(exposure)).distances
    }

    /// Levels of the interview's frames inside the subject.
    pub fn interview_histogram(&self) -> &Histogram {
        &self.interview
    }

    /// Levels of all relit poses inside the subject, in the camera's encoding: under a response, the exposure and a
    /// weight for each lamp (missing ones are 0).
    pub fn relit_histogram(&self, response: &Response, exposure: f32, weights: &[[f32; 3]]) -> Histogram {
        let table = ResponseTable::from_response(response);
        let relit = self.subject.all_relit(&table, weights);
        histogram(relit.into_iter().map(|light| light.map(|l| table.encode(exposure * l))))
    }

    /// The chosen pose relit, in the camera's encoding, at the working size; black where its matte is black. Pixels
    /// are picked, not averaged, so each is a sum of real code values.
    pub fn relit(&self, response: &Response, exposure: f32, weights: &[[f32; 3]]) -> Encoded {
        let PosePicture { codes, lamps, mask } = &self.picture;
        let table = ResponseTable::from_response(response);
        let pixels = codes
            .par_chunks_exact(*lamps)
            .zip(&mask.pixels)
            .with_min_len(1024)
            .map(|(codes, coverage)| {
                let mut light = [0.0f32; 3];
                for (code, weight) in codes.iter().zip(weights) {
                    for c in 0..3 {
                        light[c] += weight[c] * table.light(code[c]);
                    }
                }
                light.map(|l| table.encode(exposure * l * coverage))
            })
            .collect();
        Encoded(Raster { width: mask.width, height: mask.height, pixels })
    }
}

impl PosePicture {
    fn load(project: &Project, pose: usize) -> Result<Self> {
        let shoot = &project.settings.shoot;
        if pose >= shoot.poses.len() {
            return Err(Error::missing(
                format!("no pose {pose}: the shoot has poses 0 to {}", shoot.poses.len().saturating_sub(1)),
                "Choose a pose of the shoot",
            ));
        }
        let matte = project.exemplar_matte(pose);
        let framing = &project.settings.framing;
        let mask = footage::read_mask(&matte, framing)?;
        let size = project.settings.size;
        let places = picked(mask.size(), size);
        let lamps = shoot.all_lamps().len();
        let scale = scale(project)?;
        let olats = (0..lamps)
            .into_par_iter()
            .map(|lamp| sample_olat(project, (pose, lamp), (&mask, &matte), &places, scale))
            .collect::<Result<Vec<_>>>()?;
        Ok(Self {
            codes: (0..places.len()).flat_map(|i| olats.iter().map(move |olat| olat[i])).collect(),
            lamps,
            mask: resize_area(&mask, size, size),
        })
    }
}

/// Pixels at the middles of `size` × `size` equal parts of a picture.
fn picked((width, height): (usize, usize), size: usize) -> Vec<usize> {
    let middle = |i: usize, length: usize| (2 * i + 1) * length / (2 * size);
    (0..size).flat_map(|y| (0..size).map(move |x| middle(y, height) * width + middle(x, width))).collect()
}

fn histogram(pixels: impl Iterator<Item = [f32; 3]>) -> Histogram {
    let mut counts = [[0; 256]; 3];
    for pixel in pixels {
        for (counts, value) in counts.iter_mut().zip(pixel) {
            counts[usize::from(imaging::color::byte_from_unit(value))] += 1;
        }
    }
    counts
}

/// A dual gamma at `count` evenly spaced encoded values (at least 2), with its two asymptotes.
pub fn curve(response: &DualGamma, count: usize) -> Vec<CurvePoint> {
    let count = count.max(2);
    let power = |gamma: f32, x: f32| Response::Power(gamma).decode_value(x);
    (0..count)
        .map(|i| {
            let encoded = i as f32 / (count - 1) as f32;
            CurvePoint {
                encoded,
                linear: response.decode_value(encoded),
                dark: power(response.gamma1, encoded),
                bright: power(response.gamma2, encoded),
            }
        })
        .collect()
}
