//! Blind comparison after the paper's user study: two clips side by side, in random order and on random sides, beside a
//! photograph of the subject in that light, and two questions.
//!
//! The page is one file that loads nothing else. Its clips have codes; only the project's key, which is not in the
//! page, tells whose they are. Answers come back as files.

mod answers;
mod clips;
mod interval;
mod key;
mod page;
mod result;
mod settings;
#[cfg(test)]
mod tests;

pub use answers::Question;
pub use interval::exact_interval;
pub use result::{AnswersReport, MethodShare, PairShare, QuestionResult, Share, StudyResult, answers};
pub use settings::BlindSettings;

use super::Method;
use base::error::{Error, Result};
use base::files::write_beside;
use base::progress::Progress;
use calibration::Calibration;
use key::Key;
use project::Project;
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::PathBuf;

/// The written page.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BlindReport {
    /// Name of the study, as in files of answers.
    pub study: String,
    pub page: PathBuf,
    pub bytes: u64,
    /// Path of the key to the clips.
    pub key: PathBuf,
    pub methods: Vec<Method>,
    /// Names of the lamps.
    pub lamps: Vec<String>,
    /// Number of pairs that a person sees, with two questions each.
    pub pairs: usize,
    /// Frames of each clip, and the number of them that the project's network was trained on.
    pub frames: usize,
    pub seen_frames: usize,
    /// Method → minutes of training.
    pub minutes: BTreeMap<String, f64>,
}

/// Writes the page and its key.
///
/// # Errors
/// When there are fewer than two methods, a requirement of one is missing, or a file cannot be written.
pub fn blind(project: &Project, settings: &BlindSettings, progress: &Progress) -> Result<BlindReport> {
    let mut settings = settings.clone();
    let mut methods: Vec<Method> = Vec::new();
    for method in settings.methods.drain(..) {
        if !methods.contains(&method) {
            methods.push(method);
        }
    }
    settings.methods = methods;
    if settings.methods.len() < 2 {
        return Err(Error::invalid("a comparison needs two methods", "Name two or more: --with network,ratio"));
    }
    let calibration = Calibration::load(project)?;
    let clips = clips::make(project, &calibration, &settings, progress)?;
    let (key, html) = page::page(project, &clips)?;
    key.save(project)?;
    let default = || Key::path(project, &key.study).with_extension("html");
    let page = settings.page.clone().unwrap_or_else(default);
    write_beside(&page, |out| out.write_all(html.as_bytes()))?;
    let lamps = (clips.references.keys()).map(|&lamp| project.settings.shoot.lamps[lamp].clone());
    Ok(BlindReport {
        page,
        bytes: html.len() as u64,
        key: Key::path(project, &key.study),
        methods: settings.methods,
        lamps: lamps.collect(),
        pairs: key.trials.len(),
        frames: clips.frames.len(),
        seen_frames: clips.seen,
        minutes: clips.minutes,
        study: key.study,
    })
}

impl BlindReport {
    /// Summary of the page.
    pub fn sentence(&self) -> String {
        let methods: Vec<String> = self.methods.iter().map(|m| result::name(*m)).collect();
        let mut text = format!(
            "{} ({:.1} MB) compares {} in {} pairs of {} frames under {}. Open it in a browser or pass it on. The key to the \
             clips, {}, must stay here. Add returned answers with afterlight blind PROJECT --answers FILE...",
            self.page.display(),
            self.bytes as f64 / 1e6,
            methods.join(", "),
            self.pairs,
            self.frames,
            self.lamps.join(", "),
            self.key.display()
        );
        for (method, minutes) in &self.minutes {
            text += &format!("\n{method} was trained for {minutes:.1} min");
        }
        if self.seen_frames > 0 {
            text += &format!(
                "\nThe network was trained on {} of the {} frames, which gives it an advantage: train with --exclude-frames",
                self.seen_frames, self.frames
            );
        }
        text
    }
}
