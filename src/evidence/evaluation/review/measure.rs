//! One review: from a project to scores, and to a page if requested.

use super::super::Truth;
use super::report::{WORST, write_report};
use super::reviewer::Reviewer;
use super::{Fingerprint, Marks, Means, Metric, OlatScore, Review};
use base::error::Result;
use base::progress::Progress;
use gpu::DeviceChoice;
use project::Project;
use serde::Serialize;
use std::path::PathBuf;

/// Settings of a review and its output files.
#[derive(Clone, Debug, PartialEq, clap::Args)]
pub struct ReviewSettings {
    /// Folder with truth.json and truth/. Without it only poses are compared.
    #[arg(long, value_name = "DIR")]
    pub truth: Option<PathBuf>,
    /// Measure again even if nothing has changed since the last time.
    #[arg(long)]
    pub fresh: bool,
    /// Also write a self-contained page for sharing.
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    /// Device of the network, if one is trained.
    #[arg(long, value_enum, default_value_t)]
    pub device: DeviceChoice,
}

/// Summary of the scores.
#[derive(Clone, Debug, Serialize)]
pub struct ReviewReport {
    /// Means over cases held out of training; None if there are none.
    pub unseen: Option<Means>,
    /// Means over cases seen in training.
    pub seen: Option<Means>,
    /// OLATs with the largest visible difference, the worst first.
    pub worst: Vec<WorstOlat>,
    /// Number of verdicts and notes by a reviewer.
    pub marks: usize,
    /// The written page.
    pub report: Option<PathBuf>,
}

/// A lamp in a frame or pose.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WorstOlat {
    pub case: String,
    pub lamp: String,
    #[serde(flatten)]
    pub cell: OlatScore,
}

/// Truth supplied with a shoot.
pub fn own_truth(project: &Project) -> Option<PathBuf> {
    let folder = project.shoot_path("truth");
    Truth::open(project, &folder).is_ok().then_some(folder)
}

/// Measures the project's network unless the saved scores are up to date, saves the scores, and writes the page if
/// requested.
///
/// # Errors
/// When the calibration or network is missing, there is neither a pose nor a truth, a file cannot be read or written,
/// or the user stops it.
pub fn review(project: &Project, settings: &ReviewSettings, progress: &Progress) -> Result<ReviewReport> {
    let basis = Fingerprint::from_project(project)?;
    let folder = settings.truth.as_ref().map(|folder| {
        // The project may be opened from another working directory next time.
        std::path::absolute(folder).unwrap_or_else(|_| folder.clone())
    });
    // Unreadable scores are measured again.
    let kept = Review::load(project)
        .ok()
        .flatten()
        .filter(|kept| !settings.fresh && kept.truth == folder && kept.basis.difference(&basis).is_none());
    if kept.is_some() && settings.report.is_none() {
        progress
            .advise("Nothing has changed since the last measurement; showing its figures", "--fresh measures again");
    }
    let open = || Reviewer::open(project, settings.truth.as_deref(), settings.device);
    let mut reviewer = None;
    let review = match kept {
        Some(review) => review,
        None => {
            let reviewer = reviewer.insert(open()?);
            let review = reviewer.measure(basis, folder, progress)?;
            review.save(project)?;
            review
        }
    };
    let marks = Marks::load(project)?;
    if let Some(path) = &settings.report {
        let reviewer = match &reviewer {
            Some(reviewer) => reviewer,
            None => reviewer.insert(open()?),
        };
        write_report(path, &review, &marks, reviewer, progress)?;
    }
    let (seen, unseen): (Vec<_>, Vec<_>) = review.cases.iter().partition(|case| case.seen);
    let worst = review.worst(Metric::Flip).into_iter().take(WORST);
    Ok(ReviewReport {
        unseen: Means::from_cases(&unseen),
        seen: Means::from_cases(&seen),
        worst: worst
            .map(|(case, lamp)| WorstOlat {
                case: review.cases[case].name.clone(),
                lamp: review.lamps[lamp].clone(),
                cell: review.cases[case].cells[lamp],
            })
            .collect(),
        marks: marks.all().len(),
        report: settings.report.clone(),
    })
}
