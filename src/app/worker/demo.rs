//! The demo: the complete workflow on a shoot of the virtual stage, without data or downloads.

use base::error::Result;
use base::files::write_beside;
use base::progress::Progress;
use calibration::{CalibrateSettings, Calibration, calibrate};
use compositor::Storage;
use evaluation::{EvaluateReport, EvaluateSettings, Method, Truth, evaluate};
use export::Files;
use export::relight::{RelightReport, RelightSettings, relight};
use footage::{ImportSettings, PictureSize, dimensions, import};
use gpu::DeviceChoice;
use light::weights::Weighting;
use project::{Framing, Project};
use scene::Look;
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use training::{Preset, TrainReport, TrainSettings, train};
use virtual_stage::{StageSettings, write_shoot};

/// Default training time in minutes.
pub const MINUTES: f64 = 0.75;

/// Results of the demo.
#[derive(Clone, Debug, Serialize)]
pub struct DemoReport {
    pub project: PathBuf,
    pub clip: PathBuf,
    pub sheet: PathBuf,
    pub report: PathBuf,
    pub training: TrainReport,
    pub prediction: EvaluateReport,
    pub transfer: EvaluateReport,
    pub network: EvaluateReport,
    pub ratio: EvaluateReport,
    pub relight: RelightReport,
    /// Name of the clip's environment.
    #[serde(skip)]
    pub environment: String,
}

/// Folder of the demo's project.
pub fn project_folder(folder: &Path) -> PathBuf {
    folder.join("project")
}

/// Makes the demo's project in `folder` if it is missing: shoot, import and calibration.
pub fn prepare(folder: &Path, progress: &Progress) -> Result<Project> {
    let (shoot, root) = (folder.join("shoot"), project_folder(folder));
    if !shoot.join("manifest.json").exists() {
        write_shoot(&shoot, &StageSettings::demo(), progress)?;
    }
    let mut project = if root.join("project.toml").exists() {
        Project::open(&root)?
    } else {
        let settings = ImportSettings { size: StageSettings::demo().size, seed: 1, layer: None };
        let project = import(&root, &shoot, &settings, progress)?;
        let plate = dimensions(&project.frame_picture(0))?;
        Project::change(&root, |project| project.frame(Framing::whole(plate)))?;
        Project::open(&root)?
    };
    if !project.calibration_path().exists() {
        calibrate(&mut project, &CalibrateSettings::default(), progress)?.save(&project)?;
    }
    Ok(project)
}

/// Prepares the demo, trains for `minutes`, measures, and writes a relit clip, a contact sheet and a report.
pub fn run(folder: &Path, minutes: f64, device: DeviceChoice, progress: &Progress) -> Result<DemoReport> {
    let project = prepare(folder, progress)?;
    let shoot = folder.join("shoot");
    let truth = Truth::open(&project, &shoot)?;
    let calibration = Calibration::load(&project)?;
    let mut config = Preset::Quick.config();
    config.minutes = Some(minutes);
    let settings = TrainSettings { config, exclude_frames: truth.frames.clone(), hold_out: None, fresh: false, device };
    let training = train(&project, &calibration, &settings, progress)?;
    let sheet = folder.join("olats.png");
    let measure = |method, sheet| {
        let settings = EvaluateSettings {
            truth: shoot.clone(),
            method,
            at: PictureSize::default(),
            weighting: Weighting::default(),
            minutes: None,
            seed: None,
            table: None,
            sheet,
            worst: None,
            pictures: None,
            device,
        };
        evaluate(&project, &settings, progress)
    };
    let prediction = measure(Method::Prediction, Some(sheet.clone()))?;
    let transfer = measure(Method::Transfer, None)?;
    let network = measure(Method::Network, None)?;
    let ratio = measure(Method::Ratio, None)?;
    let clip = folder.join("relit.mp4");
    let environment = project.settings.shoot.environments.first().map_or(String::new(), |e| e.name.clone());
    let relight = relight(
        &project,
        &RelightSettings {
            environment: PathBuf::from(&environment),
            front: None,
            read: None,
            mapping: None,
            environment_layer: None,
            look: Look::default(),
            turntable: true,
            solo: Vec::new(),
            frames: None,
            files: Files::to(clip.display().to_string())?,
            hand_over: Vec::new(),
            profile: false,
            device,
            storage: Storage::default(),
        },
        progress,
    )?;
    let report = folder.join("report.md");
    let made = DemoReport {
        project: project.root.clone(),
        clip,
        sheet,
        report: report.clone(),
        training,
        prediction,
        transfer,
        network,
        ratio,
        relight,
        environment,
    };
    let text = made.text(&calibration);
    write_beside(&report, |out| out.write_all(text.as_bytes()))?;
    Ok(made)
}

impl DemoReport {
    fn text(&self, calibration: &Calibration) -> String {
        let mut text = format!(
            "# Afterlight demo\n\n\
             Camera response: {}. Lamps found: {}.\n\n\
             Training took {:.0} s, {} steps; the network ran on the {}.\n\n\
             | environment | prediction, dB | poses carried over, dB | network, dB | ratio image, dB |\n\
             |---|---:|---:|---:|---:|\n",
            calibration.response,
            calibration.rig.lamps.len(),
            self.training.seconds,
            self.training.steps,
            self.training.device,
        );
        for name in self.prediction.scores.relit_psnr_db.keys() {
            text += &format!("| {name} |");
            for method in [&self.prediction, &self.transfer, &self.network, &self.ratio] {
                let db = method.scores.relit_psnr_db.get(name);
                text += &format!(" {:.1} |", db.copied().unwrap_or(f64::NAN));
            }
            text.push('\n');
        }
        text += &format!(
            "\nThe clip has {} frames and took {:.0} ms for each:\n\n| pass | ran | why | ms |\n|---|---|---|---:|\n",
            self.relight.frames, self.relight.ms_per_frame
        );
        for pass in &self.relight.passes {
            let ran = if pass.ran { "yes" } else { "no" };
            let ms = match pass.ms {
                Some(ms) => format!("{ms:.2}"),
                None => "not timed".to_owned(),
            };
            text += &format!("| {} | {ran} | {} | {ms} |\n", pass.name, pass.reason);
        }
        text += "\n![Predicted and true OLATs](olats.png)\n";
        text
    }

    /// Message at the end of the demo: its results, their quality, and the next step.
    pub fn sentence(&self) -> String {
        let folder = self.report.parent().unwrap_or(Path::new("."));
        let scores = &self.prediction.scores.relit_psnr_db;
        let mut others = scores.keys().filter(|name| **name != self.environment);
        let other = others.next().unwrap_or(&self.environment);
        let (project, program) = (self.project.display(), program());
        format!(
            "The interview under a turning environment, {} frames: {}\n\
             Predicted OLATs beside the true ones: {}\n\
             All figures: {}\n\
             Accuracy of relit frames kept out of training (PSNR, higher is better):\n{}\n\
             Next steps:\n  \
             Open it in the studio, where there is a display:\n    {program} studio {project}\n  \
             Train for ten minutes more:\n    {program} train {project} --preset quick --exclude-truth {}\n  \
             Relight under another environment:\n    {program} relight {project} --environment {other} --to {}\n  \
             Make a project of your own shoot:\n    {program} import film --shoot FOLDER",
            self.relight.frames,
            self.clip.display(),
            self.sheet.display(),
            self.report.display(),
            quality(scores, &self.ratio.scores.relit_psnr_db),
            folder.join("shoot").display(),
            folder.join(format!("{other}.mp4")).display(),
        )
    }
}

/// One line for each environment: PSNR of the network and of a ratio image, in dB.
fn quality(network: &BTreeMap<String, f64>, ratio: &BTreeMap<String, f64>) -> String {
    let mut lines = String::new();
    for (name, db) in network {
        lines += &format!("  {name}: {db:.1} dB");
        if let Some(ratio) = ratio.get(name) {
            lines += &format!(" (by a ratio image, without a network: {ratio:.1} dB)");
        }
        lines += "\n";
    }
    lines
}

/// The program's name as it was called, so that printed commands can be run.
fn program() -> String {
    let called = std::env::args_os().next().filter(|name| !name.is_empty());
    called.map_or("afterlight".into(), |name| name.to_string_lossy().into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_environment_is_said_with_its_decibels_beside_the_ratio_images() {
        let decibels = |pairs: &[(&str, f64)]| -> BTreeMap<String, f64> {
            pairs.iter().map(|&(name, db)| (name.into(), db)).collect()
        };
        let network = decibels(&[("nave", 31.26), ("courtyard", 26.04)]);
        let said = quality(&network, &decibels(&[("courtyard", 20.0)]));
        assert_eq!(said, "  courtyard: 26.0 dB (by a ratio image, without a network: 20.0 dB)\n  nave: 31.3 dB\n");
    }
}
