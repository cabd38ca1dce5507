//! Writes a whole shoot: poses under every bank, the interview, the mirror balls, the environments, the truth, and
//! last the manifest, whose presence means that the rest is complete.

use super::camera::{Sensor, green_screen};
use super::dome::Dome;
use super::effects::Tally;
use super::manifest::{HDRI_NOTE, INTERVIEW_KIND, Manifest, NOISE, Truth, WEIGHTS_NOTE};
use super::motion::{Pose, exemplar_poses, interview};
use super::picture::{Pictures, Request, take};
use super::probe::Probe;
use super::transport::Effort;
use super::{StageReport, StageSettings, environments};
use base::error::{Error, Result};
use base::progress::Progress;
use imaging::file::{write_beside, write_exr, write_mask_png, write_png};
use imaging::{Image, Mask};
use rayon::prelude::*;
use serde::Serialize;
use std::io::Write;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

/// Level that the brightest thousandth of the subject's pixels has in the brightest OLAT.
const OLAT_PEAK: f32 = 0.5;
/// The same for the interview.
const INTERVIEW_PEAK: f32 = 0.75;
/// The brightest pixel of all probe photographs.
const PROBE_PEAK: f32 = 0.8;
/// Ambient light on the mirror ball.
const PROBE_AMBIENT: f32 = 2e-4;
/// The name of the progress bar.
const STAGE: &str = "virtual stage";

/// Writes a shoot into `folder`, which is made where it is missing. Files of an earlier shoot with
/// the same names are replaced.
///
/// # Errors
/// When a setting is out of range, a file cannot be written, or the job was stopped.
pub fn write_shoot(
    folder: &Path,
    settings: &StageSettings,
    progress: &Progress,
) -> Result<StageReport> {
    settings.check()?;
    let start = Instant::now();
    let session = Session::new(folder, settings, progress);
    session.write_environments()?;
    let exposures = session.write_exemplars()?;
    session.write_interview(&exposures)?;
    let neutral_density = session.write_probes(&exposures)?;
    session.write_truth(&exposures, neutral_density)?;
    let names: Vec<&str> = session.environments.iter().map(|e| e.0).collect();
    let manifest = Manifest::new(
        &session.dome,
        settings.size,
        settings.frames,
        session.poses.len(),
        &names,
    );
    session.json("manifest.json", &manifest)?;
    Ok(StageReport {
        files: session.files.into_inner(),
        seconds: start.elapsed().as_secs_f64(),
        effects: session
            .tally
            .into_inner()
            .unwrap_or_else(|broken| broken.into_inner())
            .effects(),
    })
}

/// Factors from unit radiance to linear sensor values.
struct Exposures {
    olat: f32,
    interview: f32,
}

/// Everything that one shoot's pictures share.
struct Session<'a> {
    folder: &'a Path,
    settings: &'a StageSettings,
    progress: &'a Progress<'a>,
    dome: Dome,
    sensor: Sensor,
    poses: [Pose; 6],
    frames: Vec<Pose>,
    truth_frames: Vec<usize>,
    environments: Vec<(&'static str, Image)>,
    /// Per environment a weight for every lamp.
    environment_weights: Vec<Vec<[f32; 3]>>,
    bank_weights: Vec<f32>,
    interview_weights: Vec<[f32; 3]>,
    files: AtomicUsize,
    pictures: AtomicUsize,
    tally: std::sync::Mutex<Tally>,
}

impl<'a> Session<'a> {
    fn new(folder: &'a Path, settings: &'a StageSettings, progress: &'a Progress<'a>) -> Self {
        let dome = Dome::new(settings.lamps);
        let bank_weights = dome.interview_bank_weights();
        let interview_weights = dome
            .bank_of_lamp
            .iter()
            .map(|&b| [bank_weights[b]; 3])
            .collect();
        let environments = environments::all();
        Self {
            folder,
            settings,
            progress,
            sensor: Sensor::new(settings.seed),
            poses: exemplar_poses(),
            frames: interview(settings.frames, settings.seed),
            truth_frames: truth_frames(settings.frames),
            environment_weights: environments
                .iter()
                .map(|(_, image)| dome.lamp_weights(image))
                .collect(),
            environments,
            dome,
            bank_weights,
            interview_weights,
            files: AtomicUsize::new(0),
            pictures: AtomicUsize::new(0),
            tally: std::sync::Mutex::default(),
        }
    }

    /// Traces one pose: the interview's light first, then, where asked for, the environments and the
    /// banks.
    fn take(&self, pose: &Pose, environments: bool, banks: bool, note: &str) -> Result<Pictures> {
        self.progress.check("the pictures written so far")?;
        let mut sums: Vec<&[[f32; 3]]> = vec![&self.interview_weights];
        if environments {
            sums.extend(self.environment_weights.iter().map(Vec::as_slice));
        }
        let request = Request { banks, sums: &sums };
        let pictures = take(
            &self.dome,
            pose,
            self.settings.size,
            &request,
            Effort::Needed,
        );
        self.count(&pictures.tally);
        let done = self.pictures.fetch_add(1, Ordering::Relaxed) + 1;
        self.progress.step(
            STAGE,
            done as u64,
            (self.poses.len() + self.frames.len()) as u64,
            note,
        );
        Ok(pictures)
    }

    fn count(&self, tally: &Tally) {
        // A poisoned lock only means that another thread failed; the counts are still counts.
        self.tally
            .lock()
            .unwrap_or_else(|broken| broken.into_inner())
            .add(tally);
    }

    fn write_environments(&self) -> Result<()> {
        for (name, image) in &self.environments {
            self.exr(&format!("environments/{name}.exr"), image)?;
        }
        Ok(())
    }

    /// The poses under every bank. The first one sets the exposures.
    fn write_exemplars(&self) -> Result<Exposures> {
        let mut exposures = None;
        for (i, pose) in self.poses.iter().enumerate() {
            let pictures = self.take(pose, i == 0, true, &format!("pose {i}"))?;
            let exposures = exposures.get_or_insert_with(|| Exposures {
                olat: exposure(OLAT_PEAK, &pictures.banks, &pictures.coverage),
                interview: exposure(INTERVIEW_PEAK, &pictures.sums[..1], &pictures.coverage),
            });
            self.mask(
                &format!("exemplar_masks/pose{i:02}.png"),
                &pictures.coverage,
            )?;
            (0..pictures.banks.len())
                .into_par_iter()
                .try_for_each(|bank| {
                    let name = format!("exemplars/pose{i:02}/{}.png", self.olat_name(bank));
                    self.photograph(&name, &scaled(&pictures.banks[bank], exposures.olat))
                })?;
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

    fn write_interview(&self, exposures: &Exposures) -> Result<()> {
        let screen = green_screen(self.settings.size);
        for (i, pose) in self.frames.iter().enumerate() {
            let place = self.truth_frames.iter().position(|&t| t == i);
            // The last truth frame is only used to judge pictures under environments.
            let banks = place.is_some_and(|p| p < 3);
            let pictures = self.take(pose, place.is_some(), banks, &format!("frame {i}"))?;
            let mut plate = scaled(&pictures.sums[0], exposures.interview);
            for ((pixel, behind), coverage) in plate
                .pixels
                .iter_mut()
                .zip(&screen.pixels)
                .zip(&pictures.coverage.pixels)
            {
                for (level, green) in pixel.iter_mut().zip(behind) {
                    *level += (1.0 - coverage) * green;
                }
            }
            self.photograph(&format!("interview/frame_{i:03}.png"), &plate)?;
            self.mask(
                &format!("interview_masks/frame_{i:03}.png"),
                &pictures.coverage,
            )?;
            if place.is_some() {
                let frame = format!("frame_{i:03}");
                self.write_truth_pictures(&frame, &format!("{frame}_olat"), &pictures)?;
                self.exr(&format!("truth/{frame}_normal.exr"), &pictures.normals)?;
            }
        }
        Ok(())
    }

    /// Linear pictures in units of radiance: under the environments, and of every bank.
    fn write_truth_pictures(&self, name: &str, olats: &str, pictures: &Pictures) -> Result<()> {
        for ((environment, _), relit) in self.environments.iter().zip(&pictures.sums[1..]) {
            self.exr(&format!("truth/{name}_relit_{environment}.exr"), relit)?;
        }
        (0..pictures.banks.len())
            .into_par_iter()
            .try_for_each(|bank| {
                self.exr(
                    &format!("truth/{olats}/{}.exr", self.olat_name(bank)),
                    &pictures.banks[bank],
                )
            })
    }

    /// The mirror ball under the interview's light and under every bank, through one grey filter
    /// that is chosen so that nothing clips. Returns the filter's factor.
    fn write_probes(&self, exposures: &Exposures) -> Result<f32> {
        self.progress.check("the pictures of the subject")?;
        let probe = Probe::trace(&self.dome, self.settings.size);
        let (probe_pixels, ball) = probe.pixels();
        self.count(&Tally {
            probe_pixels: probe_pixels as u64,
            ball: ball as u64,
            ..Tally::default()
        });
        let in_interview = |bank: usize| exposures.interview * self.bank_weights[bank];
        let one = |bank: usize| move |b: usize| if b == bank { exposures.olat } else { 0.0 };
        let brightest = (0..self.dome.banks.len())
            .into_par_iter()
            .map(|bank| probe.brightest(one(bank)))
            .reduce(|| probe.brightest(in_interview), f32::max);
        let density = PROBE_PEAK / brightest;
        self.photograph(
            "probes/interview.png",
            &probe.image(|b| density * in_interview(b), PROBE_AMBIENT),
        )?;
        (0..self.dome.banks.len())
            .into_par_iter()
            .try_for_each(|bank| {
                let image = probe.image(|b| density * one(bank)(b), PROBE_AMBIENT);
                self.photograph(&format!("probes/{}.png", self.olat_name(bank)), &image)
            })?;
        Ok(density)
    }

    fn write_truth(&self, exposures: &Exposures, neutral_density: f32) -> Result<()> {
        let per_olat = exposures.interview / exposures.olat;
        let counts = self.dome.bank_counts();
        let bank_means = |weights: &Vec<[f32; 3]>| {
            let mut means = vec![[0.0f32; 3]; counts.len()];
            for (weight, &bank) in weights.iter().zip(&self.dome.bank_of_lamp) {
                means[bank]
                    .iter_mut()
                    .zip(weight)
                    .for_each(|(m, w)| *m += w / counts[bank] as f32);
            }
            means
        };
        let truth = Truth {
            g1: self.sensor.response.gamma1,
            g2: self.sensor.response.gamma2,
            exposure_interview: exposures.interview,
            exposure_olat: exposures.olat,
            probe_neutral_density: neutral_density,
            probe_ambient_linear: PROBE_AMBIENT,
            noise: NOISE,
            interview_kind: INTERVIEW_KIND,
            weights_linear_interview_per_olat: self
                .bank_weights
                .iter()
                .map(|w| [w * per_olat; 3])
                .collect(),
            weights_note: WEIGHTS_NOTE,
            bank_weights_unit_radiance: self.bank_weights.iter().map(|w| [*w; 3]).collect(),
            interview_lamp_weights: self.interview_weights.clone(),
            hdri_bank_weights: self
                .environments
                .iter()
                .zip(&self.environment_weights)
                .map(|((name, _), weights)| ((*name).to_owned(), bank_means(weights)))
                .collect(),
            hdri_note: HDRI_NOTE,
            poses: self.poses.to_vec(),
            frames: self.frames.clone(),
            truth_frames: self.truth_frames.clone(),
        };
        self.json("truth.json", &truth)
    }

    /// The name of a bank's OLAT without extension. All have as many digits, so that they sort.
    fn olat_name(&self, bank: usize) -> String {
        let digits = if self.dome.banks.len() > 100 { 3 } else { 2 };
        format!("olat_{bank:0digits$}")
    }

    fn photograph(&self, name: &str, light: &Image) -> Result<()> {
        self.written(write_png(
            &self.folder.join(name),
            &self.sensor.photograph(light, name),
        ))
    }

    fn mask(&self, name: &str, mask: &Mask) -> Result<()> {
        self.written(write_mask_png(&self.folder.join(name), mask))
    }

    fn exr(&self, name: &str, image: &Image) -> Result<()> {
        self.written(write_exr(&self.folder.join(name), image))
    }

    fn json(&self, name: &str, value: &impl Serialize) -> Result<()> {
        let path = self.folder.join(name);
        let text = serde_json::to_vec_pretty(value)
            .map_err(|e| Error::bug(format!("cannot write {}: {e}", path.display())))?;
        self.written(write_beside(&path, |out| out.write_all(&text)))
    }

    fn written(&self, result: Result<()>) -> Result<()> {
        result.inspect(|()| {
            self.files.fetch_add(1, Ordering::Relaxed);
        })
    }
}

/// Up to four frames spread over the clip.
fn truth_frames(frames: usize) -> Vec<usize> {
    let mut chosen: Vec<usize> = (0..4).map(|i| (2 * i + 1) * frames / 8).collect();
    chosen.dedup();
    chosen
}

/// The factor that brings the brightest thousandth of the subject in the brightest picture to `peak`.
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
            levels
                .get(levels.len().saturating_sub(1 + levels.len() / 1000))
                .copied()
                .unwrap_or(0.0)
        })
        .fold(0.0, f32::max);
    if brightest > 0.0 {
        peak / brightest
    } else {
        1.0
    }
}

fn scaled(image: &Image, factor: f32) -> Image {
    image.map(|pixel| pixel.map(|v| v * factor))
}
