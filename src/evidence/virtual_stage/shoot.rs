//! Writes a whole shoot: poses under every bank, the interview, the mirror balls, the environments, the truth, and last
//! the manifest, whose presence means that the rest is complete.

use super::ball::BallLight;
use super::ball_view::Surroundings;
use super::camera::green_screen;
use super::effects::Tally;
use super::film::{WrittenAs, film};
use super::jpeg::decode;
use super::manifest::{Manifest, Tracking};
use super::picture::Pictures;
use super::probe::Probe;
use super::session::{Session, lamp_time};
use super::shipped::{FRAMES, ShippedFrame};
use super::span::NearestSum;
use super::trouble::Trouble;
use super::{StageReport, StageSettings};
use base::error::{Error, Result};
use base::files::write_beside;
use base::progress::Progress;
use imaging::file::{write_exr, write_mask_png, write_png};
use imaging::{Image, Mask};
use rayon::prelude::*;
use serde::Serialize;
use std::io::Write;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::Instant;

/// Level of the brightest thousandth of the subject's pixels in the brightest OLAT.
const OLAT_PEAK: f32 = 0.5;
/// The same level for the interview.
const INTERVIEW_PEAK: f32 = 0.75;
/// Level of the brightest pixel of all probe photographs.
const PROBE_PEAK: f32 = 0.8;
/// Ambient light on the mirror ball.
pub const PROBE_AMBIENT: f32 = 2e-4;

/// Writes a shoot into `folder`, which is created if missing. Files of an earlier shoot with the same names are
/// replaced.
///
/// # Errors
/// When a setting is out of range, a file cannot be written, or the user stops it.
pub fn write_shoot(folder: &Path, settings: &StageSettings, progress: &Progress) -> Result<StageReport> {
    settings.check()?;
    let start = Instant::now();
    let session = Session::new(folder, settings, progress);
    session.write_environments()?;
    let exposures = session.write_exemplars()?;
    let nearest = session.write_interview(&exposures)?;
    let neutral_density = session.write_probes(&exposures)?;
    let truth = session.truth(&exposures, neutral_density, nearest);
    session.json("truth.json", &truth)?;
    let names: Vec<&str> = session.environments.iter().map(|e| e.0).collect();
    let manifest = Manifest::new(
        &session.dome,
        settings.size,
        settings.frames,
        session.poses.len(),
        &names,
        session.tracking_times().map(|before_lamp| Tracking {
            files: "tracking/poseNN/frame_KK.png (8 bit, encoded, black background)",
            before_lamp,
        }),
    );
    session.json("manifest.json", &manifest)?;
    if settings.written_as == WrittenAs::Movies {
        let before_lamp = session.tracking_times().unwrap_or_default();
        film(folder, settings, session.poses.len(), &before_lamp)?;
    }
    Ok(StageReport {
        files: session.files.into_inner(),
        seconds: start.elapsed().as_secs_f64(),
        effects: session.tally.into_inner().unwrap_or_else(|broken| broken.into_inner()).effects(),
    })
}

/// Factors from radiance units to linear sensor values.
pub struct Exposures {
    pub olat: f32,
    pub interview: f32,
    pub tracking: f32,
}

impl Session<'_> {
    fn write_environments(&self) -> Result<()> {
        for (name, image) in &self.environments {
            self.exr(&format!("environments/{name}.exr"), image)?;
        }
        Ok(())
    }

    /// The poses under every bank. The first one determines the exposures.
    fn write_exemplars(&self) -> Result<Exposures> {
        let mut exposures = None;
        let size = (self.settings.size, self.settings.size);
        for (i, pose) in self.poses.iter().enumerate() {
            // A swaying pose is traced again under each lamp; its still pictures are only truth.
            let banks = i == 0 || self.sways.is_empty();
            let grid = self.bake(pose);
            let pictures = self.take(pose, &grid, size, (i == 0, banks), &format!("pose {i}"))?;
            let exposures = exposures.get_or_insert_with(|| Exposures {
                olat: exposure(OLAT_PEAK, &pictures.banks, &pictures.coverage),
                interview: exposure(INTERVIEW_PEAK, &pictures.sums[..1], &pictures.coverage),
                tracking: exposure(INTERVIEW_PEAK, &[sum(&pictures.banks)], &pictures.coverage),
            });
            self.mask(&format!("exemplar_masks/pose{i:02}.png"), &pictures.coverage)?;
            let olat = |bank: usize, light: &Image| {
                let name = format!("exemplars/pose{i:02}/{}.png", self.olat_name(bank));
                self.photograph(&name, &scaled(light, exposures.olat))
            };
            let lit = self.all_banks();
            match self.sways.get(i) {
                None => {
                    (pictures.banks.par_iter().enumerate()).try_for_each(|(bank, light)| olat(bank, light))?;
                    self.write_tracking(i, exposures.tracking, |_| self.trace(pose, &grid, size, false, &[&lit]))?;
                }
                Some(sway) => {
                    let grids = sway.grids(pose, &self.trouble.look, grid);
                    let at = |time: f32, lit: &[[f32; 3]]| {
                        let grid = grids.at(sway.face_m(time));
                        self.trace(&sway.pose(pose, time), &grid, size, false, &[lit])
                    };
                    for bank in 0..self.dome.banks.len() {
                        let time = lamp_time(bank, self.dome.banks.len());
                        olat(bank, &at(time, &self.lit_bank(bank))?.sums[0])?;
                    }
                    self.write_tracking(i, exposures.tracking, |time| at(time, &lit))?;
                }
            }
            self.photograph(
                &format!("truth/pose{i:02}_under_interview_light_black_bg.png"),
                &scaled(&pictures.sums[0], exposures.interview),
            )?;
            if i == 0 {
                self.write_truth_pictures("pose00", "pose00_olat_exr", &pictures)?;
            }
        }
        exposures.ok_or_else(|| Error::bug("the virtual stage has no pose"))
    }

    /// Radiances of all lamps with all banks on.
    fn all_banks(&self) -> Vec<[f32; 3]> {
        let mut lit = vec![[0.0f32; 3]; self.dome.lamps.len()];
        for bank in 0..self.dome.banks.len() {
            for (sum, light) in lit.iter_mut().zip(self.lit_bank(bank)) {
                *sum = [0, 1, 2].map(|c| sum[c] + light[c]);
            }
        }
        lit
    }

    /// Pose `i` under all banks, at the moments `taken` between the lamps (from 0 to 1).
    fn write_tracking(&self, i: usize, exposure: f32, taken: impl Fn(f32) -> Result<Pictures>) -> Result<()> {
        let lamps = self.dome.banks.len();
        for (k, before) in self.tracking_times().into_iter().flatten().enumerate() {
            let pictures = taken(before as f32 / lamps as f32)?;
            self.photograph(&format!("tracking/pose{i:02}/frame_{k:02}.png"), &scaled(&pictures.sums[0], exposure))?;
        }
        Ok(())
    }

    /// The interview, and with trouble the sum of banks nearest to its first truth frame.
    fn write_interview(&self, exposures: &Exposures) -> Result<Option<NearestSum>> {
        let mut nearest = None;
        let size = self.settings.frame_size();
        for (i, pose) in self.frames.iter().enumerate() {
            let place = self.truth_frames.iter().position(|&t| t == i);
            // The last truth frame is used only to test pictures under environments.
            let banks = place.is_some_and(|p| p < 3);
            if let Some(shipped) = self.shipped(i) {
                // As PNG, like any shoot of stills.
                let picture = self.folder.join(format!("interview/frame_{i:03}.png"));
                self.written(write_png(&picture, &decode(shipped.picture)?))?;
                self.bytes(&format!("interview_masks/frame_{i:03}.png"), shipped.matte)?;
                if place.is_none() {
                    continue;
                }
            }
            let grid = self.bake(pose);
            let note = format!("frame {i}");
            let pictures = self.take(pose, &grid, size, (place.is_some(), banks), &note)?;
            if banks && nearest.is_none() && self.trouble != Trouble::default() {
                nearest = Some(NearestSum::fit(&pictures.banks, &pictures.sums[0], &pictures.coverage));
            }
            if self.shipped(i).is_none() {
                let plate = before_screen(&pictures, exposures.interview);
                self.photograph(&format!("interview/frame_{i:03}.png"), &plate)?;
                self.mask(&format!("interview_masks/frame_{i:03}.png"), &pictures.coverage)?;
            }
            if place.is_some() {
                let frame = format!("frame_{i:03}");
                self.write_truth_pictures(&frame, &format!("{frame}_olat"), &pictures)?;
                self.exr(&format!("truth/{frame}_normal.exr"), &pictures.normals)?;
                if self.trouble != Trouble::default() {
                    // Then it cannot be computed from the banks' pictures.
                    self.exr(&format!("truth/{frame}_interview.exr"), &pictures.sums[0])?;
                }
            }
        }
        Ok(nearest)
    }

    /// Frame `i` of the interview that comes with the program; None if it must be traced.
    fn shipped(&self, i: usize) -> Option<&'static ShippedFrame> {
        self.settings.shipped.then(|| FRAMES.get(i)).flatten()
    }

    /// Linear pictures in radiance units: under the environments, and of every bank.
    fn write_truth_pictures(&self, name: &str, olats: &str, pictures: &Pictures) -> Result<()> {
        for ((environment, _), relit) in self.environments.iter().zip(&pictures.sums[1..]) {
            self.exr(&format!("truth/{name}_relit_{environment}.exr"), relit)?;
        }
        (0..pictures.banks.len()).into_par_iter().try_for_each(|bank| {
            self.exr(&format!("truth/{olats}/{}.exr", self.olat_name(bank)), &pictures.banks[bank])
        })
    }

    /// The mirror ball under the interview's light and under every bank, through one neutral density filter strong
    /// enough that nothing clips. Returns the filter's factor.
    fn write_probes(&self, exposures: &Exposures) -> Result<f32> {
        self.progress.check("the pictures of the subject")?;
        let surroundings =
            Surroundings { dome: &self.dome, light: &self.light, room: &self.room, trouble: &self.trouble };
        let is_plain = self.light.is_of_banks()
            && (self.trouble.room, self.trouble.dust, self.trouble.photographer) == (0.0, 0.0, false);
        let probe = Probe::trace(&self.dome, self.settings.size, (!is_plain).then_some(&surroundings));
        let (probe_pixels, ball) = probe.pixels();
        self.count(&Tally { probe_pixels: probe_pixels as u64, ball: ball as u64, ..Tally::default() });
        let filmed = BallLight { banks: self.light.banks.clone(), interview: 1.0 };
        // The camera's exposure changes only after the balls.
        let filmed = filmed.times(exposures.interview / self.trouble.exposure_change);
        let one = |bank: usize| BallLight {
            banks: (0..self.dome.banks.len()).map(|b| if b == bank { [exposures.olat; 3] } else { [0.0; 3] }).collect(),
            interview: 0.0,
        };
        let brightest = (0..self.dome.banks.len())
            .into_par_iter()
            .map(|bank| probe.brightest(&one(bank)))
            .reduce(|| probe.brightest(&filmed), f32::max);
        let density = PROBE_PEAK * self.trouble.ball_exposure / brightest;
        self.photograph("probes/interview.png", &probe.image(&filmed.times(density), PROBE_AMBIENT))?;
        (0..self.dome.banks.len()).into_par_iter().try_for_each(|bank| {
            let image = probe.image(&one(bank).times(density), PROBE_AMBIENT);
            self.photograph(&format!("probes/{}.png", self.olat_name(bank)), &image)
        })?;
        Ok(density)
    }

    /// Name of a bank's OLAT without extension, zero-padded so that names sort.
    fn olat_name(&self, bank: usize) -> String {
        let digits = if self.dome.banks.len() > 100 { 3 } else { 2 };
        format!("olat_{bank:0digits$}")
    }

    fn photograph(&self, name: &str, light: &Image) -> Result<()> {
        self.written(write_png(&self.folder.join(name), &self.sensor.photograph(light, name)?))
    }

    fn mask(&self, name: &str, mask: &Mask) -> Result<()> {
        self.written(write_mask_png(&self.folder.join(name), mask))
    }

    fn exr(&self, name: &str, image: &Image) -> Result<()> {
        self.written(write_exr(&self.folder.join(name), image))
    }

    fn bytes(&self, name: &str, bytes: &[u8]) -> Result<()> {
        self.written(write_beside(&self.folder.join(name), |out| out.write_all(bytes)))
    }

    fn json(&self, name: &str, value: &impl Serialize) -> Result<()> {
        let text = serde_json::to_vec_pretty(value).map_err(|e| Error::bug(format!("cannot write {name}: {e}")))?;
        self.bytes(name, &text)
    }

    fn written(&self, result: Result<()>) -> Result<()> {
        result.inspect(|()| {
            self.files.fetch_add(1, Ordering::Relaxed);
        })
    }
}

/// The subject under the interview's light before the green screen, as linear light on the sensor.
pub fn before_screen(pictures: &Pictures, exposure: f32) -> Image {
    let mut plate = scaled(&pictures.sums[0], exposure);
    let screen = green_screen(plate.size());
    for ((pixel, behind), coverage) in (plate.pixels.iter_mut()).zip(&screen.pixels).zip(&pictures.coverage.pixels) {
        for (level, green) in pixel.iter_mut().zip(behind) {
            *level += (1.0 - coverage) * green;
        }
    }
    plate
}

/// Sum of at least one picture of one size.
fn sum(pictures: &[Image]) -> Image {
    let (width, height) = pictures[0].size();
    imaging::Raster::from_fn(width, height, |x, y| {
        pictures.iter().fold([0.0; 3], |sum, picture| {
            let pixel = picture.at(x, y);
            [0, 1, 2].map(|c| sum[c] + pixel[c])
        })
    })
}

/// Factor that brings the brightest thousandth of the subject in the brightest picture to `peak`.
fn exposure(peak: f32, pictures: &[Image], coverage: &Mask) -> f32 {
    let brightest = pictures
        .iter()
        .map(|picture| {
            let mut levels: Vec<f32> = picture
                .pixels
                .iter()
                .zip(&coverage.pixels)
                .filter(|(_, c)| **c > 0.98)
                .map(|(p, _)| p[0].max(p[1]).max(p[2]))
                .collect();
            levels.sort_by(f32::total_cmp);
            levels.get(levels.len().saturating_sub(1 + levels.len() / 1000)).copied().unwrap_or(0.0)
        })
        .fold(0.0, f32::max);
    if brightest > 0.0 { peak / brightest } else { 1.0 }
}

fn scaled(image: &Image, factor: f32) -> Image {
    image.map(|pixel| pixel.map(|v| v * factor))
}
