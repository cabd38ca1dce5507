//! Cost of the calibration in the picture: networks trained with the estimated and with the true response, on the same
//! shoot and with equal steps, compared with the truth. All through the program, as a user would run it.

use crate::trial;
use base::progress::Progress;
use base::{Error, Result};
use measuring::Program;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fmt;
use std::path::Path;
use virtual_stage::{StageSettings, write_shoot};

/// Frames of the interview; every third is held out of training and compared with the truth.
const FRAMES: usize = 12;

/// A shoot under an environment.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Pair {
    pub seed: u64,
    pub size: usize,
    pub epochs: u64,
    /// Steps of each network.
    pub steps: u64,
    pub environment: String,
    /// PSNR in dB of the relit frames: by the network with the estimated response, by that with the true one, and by
    /// the true OLATs.
    pub found: f64,
    pub exact: f64,
    pub limit: f64,
    /// PSNR in dB of the predicted OLATs.
    pub olats_found: f64,
    pub olats_exact: f64,
}

impl Pair {
    /// Cost of the calibration, in dB.
    pub fn loss(&self) -> f64 {
        self.exact - self.found
    }
}

impl fmt::Display for Pair {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(
            f,
            "seed {:3}: {:9} {:.1} dB, with the true response {:.1}, at best {:.1}; OLATs {:.1}, {:.1}; {} steps",
            self.seed,
            self.environment,
            self.found,
            self.exact,
            self.limit,
            self.olats_found,
            self.olats_exact,
            self.steps
        )
    }
}

/// Settings for training the networks.
#[derive(Clone, Copy, Debug)]
pub struct Training<'a> {
    /// The program `afterlight`.
    pub program: &'a Path,
    pub size: usize,
    pub epochs: u64,
}

impl Training<'_> {
    /// Writes the shoot of a seed and trains both networks: a pair for each environment of its truth.
    ///
    /// # Errors
    /// When the shoot cannot be written, or a command fails.
    pub fn run(&self, seed: u64) -> Result<Vec<Pair>> {
        let folder = trial::temporary_folder()?;
        let (shoot, found) = (folder.path().join("shoot"), folder.path().join("found"));
        let settings = StageSettings { frames: FRAMES, ..trial::settings(seed, self.size) };
        write_shoot(&shoot, &settings, &Progress::silent())?;
        let truth = trial::json(&shoot.join("truth.json"))?;
        let [found, limit] = [
            self.network(&shoot, &found, None)?,
            Program(self.program).json(&[
                "evaluate",
                &text(&found),
                "--truth",
                &text(&shoot),
                "--with",
                "truth-olats",
            ])?,
        ];
        let exact = folder.path().join("exact");
        let exact = self.network(&shoot, &exact, Some(&response(&truth)))?;
        let relit = |scores: &Value, environment: &str| number(&scores["relit_psnr_db"][environment]);
        let environments = found["relit_psnr_db"].as_object();
        let environments = environments.ok_or_else(|| Error::bug("evaluate --json lists no environment"))?;
        Ok(environments
            .keys()
            .map(|environment| Pair {
                seed,
                size: self.size,
                epochs: self.epochs,
                steps: found["training_steps"].as_u64().unwrap_or(0),
                environment: environment.clone(),
                found: relit(&found, environment),
                exact: relit(&exact, environment),
                limit: relit(&limit, environment),
                olats_found: number(&found["olat_psnr_db"]),
                olats_exact: number(&exact["olat_psnr_db"]),
            })
            .collect())
    }

    /// Imports a shoot into a project, calibrates it, with `response` if given, trains, and scores the result against
    /// the truth.
    fn network(&self, shoot: &Path, project: &Path, response: Option<&str>) -> Result<Value> {
        let (shoot, project) = (text(shoot), text(project));
        let (size, epochs) = (self.size.to_string(), self.epochs.to_string());
        Program(self.program).json(&["import", &project, "--shoot", &shoot, "--size", &size])?;
        let by_hand = response.map_or(vec![], |response| vec!["--gamma", response]);
        Program(self.program).json(&[&["calibrate", &project], &by_hand[..]].concat())?;
        Program(self.program).json(&["train", &project, "--epochs", &epochs, "--exclude-truth", &shoot])?;
        Program(self.program).json(&["evaluate", &project, "--truth", &shoot])
    }
}

/// True response and exposure in the form of `calibrate --gamma`; a log-like camera gets the nearest dual gamma.
fn response(truth: &Value) -> String {
    let trouble = &truth["trouble"];
    let exposure = trouble["exposure_change"].as_f64().unwrap_or(1.0);
    match trouble["response"]["curve"].as_str() {
        Some(curve) if curve != "dual" => format!("{curve},{exposure}"),
        _ => format!("{},{},{exposure}", number(&truth["g1"]), number(&truth["g2"])),
    }
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or(f64::NAN)
}

fn text(path: &Path) -> String {
    path.to_string_lossy().into_owned()
}
