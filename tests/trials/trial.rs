//! One trial: a shoot of a seed, written, imported and calibrated as by a user, and compared with its truth.

use crate::motion::MotionColumns;
use crate::results::{OUTSIDE, Row};
use base::progress::Progress;
use base::{Error, Result};
use calibration::gamma::Interval;
use calibration::{CalibrateSettings, Calibration};
use footage::ImportSettings;
use glam::Vec3;
use imaging::Image;
use imaging::file::{read_linear, read_mask};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::time::Instant;
use tempfile::TempDir;
use virtual_stage::{StageSettings, TroubleSettings, write_shoot};

/// Default width and height of the pictures.
pub const SIZE: usize = 64;
/// Direction error in degrees above which a lamp must not be trusted.
const MISLEADING_DEG: f64 = 5.0;

/// The shoot of a seed, with everything random.
pub fn settings(seed: u64, size: usize) -> StageSettings {
    StageSettings {
        frames: 4,
        size,
        seed,
        // From 9 to 24, in a patternless order (a multiplicative hash after Knuth).
        lamps: 9 + (seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 60) as usize,
        trouble: TroubleSettings { trouble: true, ..TroubleSettings::NONE },
        ..StageSettings::default()
    }
}

/// Calibrates the shoot of a seed and compares the result with its truth. Shoots are kept in the folder `shoots`; a
/// missing one is written.
///
/// # Errors
/// When the shoot cannot be written or read. A refused calibration is a result.
pub fn run(seed: u64, size: usize, shoots: &Path) -> Result<Row> {
    let start = Instant::now();
    let shoot = shoot(seed, size, shoots)?;
    let shoot_seconds = start.elapsed().as_secs_f64();
    let truth = Truth::read(&shoot, size)?;
    let lamps = settings(seed, size).lamps;
    let row = Row { seed, size, lamps, shoot_seconds, ..truth.row() };
    let folder = temporary_folder()?;
    let project = folder.path().join("project");
    let import = ImportSettings { size, seed, layer: None };
    let start = Instant::now();
    let silent = Progress::silent();
    let calibrated = footage::import(&project, &shoot, &import, &silent)
        .and_then(|mut project| calibration::calibrate(&mut project, &CalibrateSettings::default(), &silent));
    let seconds = start.elapsed().as_secs_f64();
    Ok(match calibrated {
        Ok(found) => truth.compare(&found, Row { seconds, ..row }),
        Err(error) => Row { refused: error.to_string(), seconds, ..row },
    })
}

/// Folder of the shoot of a seed in `shoots`; a missing one is written.
///
/// # Errors
/// When it cannot be written.
pub fn shoot(seed: u64, size: usize, shoots: &Path) -> Result<PathBuf> {
    let shoot = shoots.join(format!("{size}/{seed}"));
    if !shoot.exists() {
        let unfinished = shoots.join(format!("{size}/unfinished-{seed}"));
        remove(&unfinished)?;
        write_shoot(&unfinished, &settings(seed, size), &Progress::silent())?;
        std::fs::rename(&unfinished, &shoot)
            .map_err(|e| Error::io("rename", &unfinished, e, "Run the trials again"))?;
    }
    Ok(shoot)
}

/// Removes a folder, if it exists.
///
/// # Errors
/// When it cannot be removed.
pub fn remove(folder: &Path) -> Result<()> {
    match std::fs::remove_dir_all(folder) {
        Err(e) if e.kind() != std::io::ErrorKind::NotFound => Err(Error::io("remove", folder, e, "Remove it by hand")),
        _ => Ok(()),
    }
}

/// A temporary folder for the trial.
///
/// # Errors
/// When it cannot be made.
pub fn temporary_folder() -> Result<TempDir> {
    tempfile::tempdir().map_err(|e| Error::io("make", Path::new("a temporary folder"), e, "Make room on the disk"))
}

/// Reads a JSON file.
///
/// # Errors
/// When the file cannot be read.
pub fn json(path: &Path) -> Result<Value> {
    const REMEDY: &str = "Run the trial again";
    let bytes = std::fs::read(path).map_err(|e| Error::io("read", path, e, REMEDY))?;
    serde_json::from_slice(&bytes).map_err(|e| Error::codec("read", path, e, REMEDY))
}

/// Truth of a shoot.
struct Truth {
    facts: Value,
    directions: Vec<Vec3>,
    /// For one frame: the OLATs, the picture under the interview's light, both in the camera's linear units, and the
    /// pixels that the subject covers.
    olats: Vec<Image>,
    interview: Image,
    covered: Vec<usize>,
}

impl Truth {
    fn read(shoot: &Path, size: usize) -> Result<Self> {
        let (facts, manifest) = (json(&shoot.join("truth.json"))?, json(&shoot.join("manifest.json"))?);
        let directions: Vec<Vec3> =
            list(&manifest["bank_directions"]).map(|d| Vec3::from(numbers(d).map(|v| v as f32))).collect();
        let frame = facts["truth_frames"][0].as_u64().unwrap_or(0);
        let truth = shoot.join("truth");
        let scaled = |image: Image, exposure: &str| {
            let exposure = facts[exposure].as_f64().unwrap_or(0.0) as f32;
            image.map(|pixel| pixel.map(|v| v * exposure))
        };
        let olats = (0..directions.len())
            .map(|lamp| {
                let path = truth.join(format!("frame_{frame:03}_olat/olat_{lamp:02}.exr"));
                Ok(scaled(read_linear(&path)?, "exposure_olat"))
            })
            .collect::<Result<_>>()?;
        let interview = read_linear(&truth.join(format!("frame_{frame:03}_interview.exr")))?;
        let mask = read_mask(&shoot.join(format!("interview_masks/frame_{frame:03}.png")))?;
        Ok(Self {
            directions,
            olats,
            interview: scaled(interview, "exposure_interview"),
            covered: (0..size * size).filter(|&i| mask.pixels[i] > 0.98).collect(),
            facts,
        })
    }

    /// A row with everything that is known without a calibration.
    fn row(&self) -> Row {
        let trouble = &self.facts["trouble"];
        let number = |key: &str| trouble[key].as_f64().unwrap_or(0.0);
        let response = &trouble["response"];
        let kind = match (&response["curve"], &response["log"]) {
            (Value::String(name), _) => name.as_str(),
            (_, Value::Number(_)) => "log",
            _ => "dual",
        };
        Row {
            light: trouble["interview_light"].as_str().unwrap_or_default().to_owned(),
            response: kind.to_owned(),
            ambient: number("ambient"),
            off_span: number("off_span"),
            exposure_change: number("exposure_change"),
            ball_exposure: number("ball_exposure"),
            dust: number("dust"),
            room: number("room"),
            sway: number("sway"),
            skin: number("skin"),
            gamma1: self.facts["g1"].as_f64().unwrap_or(0.0),
            gamma2: self.facts["g2"].as_f64().unwrap_or(0.0),
            ..Row::default()
        }
    }

    /// The row completed with a calibration's results.
    fn compare(&self, found: &Calibration, row: Row) -> Row {
        let (curve, _) = found.response.nearest_dual_gamma();
        let [within1, within2, within_exposure] = within(&found.gamma_evidence.intervals, &row);
        let light: Vec<[f64; 3]> = found.interview_light().iter().map(|w| w.map(f64::from)).collect();
        let is: Vec<[f64; 3]> = list(&self.facts["weights_linear_interview_per_olat"]).map(numbers).collect();
        let (mut off, mut sum) = (0.0, 0.0);
        for (light, is) in light.iter().flatten().zip(is.iter().flatten()) {
            off += (light - is).abs();
            sum += is;
        }
        let (mut angles, mut trusted) = (Vec::new(), Vec::new());
        for (lamp, &direction) in found.rig.lamps.iter().zip(&self.directions) {
            if lamp.is_usable() {
                let angle = f64::from(lamp.direction.angle_between(direction).to_degrees());
                angles.push(angle);
                if lamp.confidence > 0.5 {
                    trusted.push(angle);
                }
            }
        }
        angles.sort_by(f64::total_cmp);
        let names: Vec<&str> = found.rig.lamps.iter().map(|l| l.name.as_str()).collect();
        let sway = &self.facts["trouble"]["sway_px"];
        Row {
            found1: f64::from(curve.gamma1),
            found2: f64::from(curve.gamma2),
            deviation1: f64::from(found.gamma_deviation[0]),
            deviation2: f64::from(found.gamma_deviation[1]),
            found_exposure: f64::from(found.exposure),
            exposure_deviation: f64::from(found.gamma_evidence.exposure_deviation),
            within1,
            within2,
            within_exposure,
            said_changed: f64::from(found.gamma_evidence.changed_exposure),
            weights_error: off / sum,
            light_error: self.light_error(&light),
            direction_median: angles.get(angles.len() / 2).copied().unwrap_or(180.0),
            direction_worst: trusted.iter().copied().fold(0.0, f64::max),
            misled: trusted.iter().filter(|a| **a > MISLEADING_DEG).count(),
            motion: (found.motion.as_ref())
                .map_or_else(MotionColumns::default, |motion| MotionColumns::new(motion, sway, &names, row.size)),
            ..row
        }
    }

    /// Relative root mean square difference between the sum of the true OLATs under `light` and the true picture.
    fn light_error(&self, light: &[[f64; 3]]) -> f64 {
        let (mut error, mut power) = (0.0, 0.0);
        for &i in &self.covered {
            for c in 0..3 {
                let lamps = self.olats.iter().zip(light);
                let sum: f64 = lamps.map(|(olat, w)| w[c] * f64::from(olat.pixels[i][c])).sum();
                let is = f64::from(self.interview.pixels[i][c]);
                error += (sum - is).powi(2);
                power += is.powi(2);
            }
        }
        (error / power).sqrt()
    }
}

/// Smallest interval that holds the truth, for γ1, γ2 and the exposure of a shoot, as in [`Row::within1`].
fn within(intervals: &[Interval], truth: &Row) -> [f64; 3] {
    if intervals.is_empty() {
        return [0.0; 3];
    }
    let smallest = |range: fn(&Interval) -> [f32; 2], truth: f64| {
        let holds = |interval: &&Interval| {
            let [low, high] = range(interval).map(f64::from);
            (low..=high).contains(&truth)
        };
        (intervals.iter().find(holds)).map_or(OUTSIDE, |i| (f64::from(i.probability) * 1e4).round() / 1e4)
    };
    [
        smallest(|i| i.gamma1, truth.gamma1),
        smallest(|i| i.gamma2, truth.gamma2),
        smallest(|i| i.exposure, truth.exposure_change),
    ]
}

fn list(value: &Value) -> impl Iterator<Item = &Value> {
    value.as_array().into_iter().flatten()
}

fn numbers(value: &Value) -> [f64; 3] {
    [0, 1, 2].map(|i: usize| value[i].as_f64().unwrap_or(f64::NAN))
}
