//! Review of a trained network: a score for each predicted OLAT by lamp and frame, a reviewer's marks, and a page to
//! share.

mod fingerprint;
mod heat;
mod layout;
mod marks;
mod measure;
mod page;
mod pictures;
mod report;
mod reviewer;

pub use fingerprint::Fingerprint;
pub use heat::{badness, heat};
pub use layout::{SheetLayout, place_by_direction};
pub use marks::{Mark, MarkedOlat, Marks};
pub use measure::{ReviewReport, ReviewSettings, own_truth, review};
pub use pictures::ScoredPictures;
pub use reviewer::with_and_without_network;

use super::flicker::ClipFlicker;
use super::metrics::pooled;
use base::error::{Error, Result};
use base::files::{self, write_beside};
use clap::ValueEnum;
use project::Project;
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::PathBuf;

/// Format version of `measured.json`.
const FORMAT: u32 = 1;

/// Size limit of `measured.json` in bytes: a million scores.
const MOST_FIGURES: u64 = 128 << 20;

/// Kind of case that a network is measured on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Case {
    /// Interview frame with true OLATs.
    Frame(usize),
    /// Pose of the OLAT session, relit as the interview.
    Pose(usize),
}

/// Scores of one predicted OLAT.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct OlatScore {
    /// PSNR of the encoded subject in decibels, at the exposure of its case.
    pub psnr_db: f64,
    /// Mean SSIM over the subject, −1 to 1.
    pub ssim: f64,
    /// Mean FLIP over the subject, 0 to 1.
    pub flip: f64,
}

/// A case with every lamp's scores.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CaseScores {
    pub case: Case,
    /// Name of the frame or pose, as in its files.
    pub name: String,
    /// True if the network was trained on it.
    pub seen: bool,
    /// Factor on predictions: one for all frames, and one for all poses.
    pub scale: f64,
    /// One for each lamp of the network.
    pub cells: Vec<OlatScore>,
}

/// Mean scores of several cases under every lamp.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Means {
    pub cases: usize,
    #[serde(flatten)]
    pub over_cells: OlatScore,
}

impl Means {
    /// Means over all OLATs of `cases`; None without a case.
    pub fn from_cases(cases: &[&CaseScores]) -> Option<Self> {
        Some(Self {
            cases: cases.len(),
            over_cells: OlatScore {
                psnr_db: Review::mean(Metric::Psnr, cases)?,
                ssim: Review::mean(Metric::Ssim, cases)?,
                flip: Review::mean(Metric::Flip, cases)?,
            },
        })
    }
}

/// All measurements, as in `measured.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Review {
    /// Format version of the file.
    format: u32,
    /// Fingerprint of the files behind the scores.
    pub basis: Fingerprint,
    /// Folder with the truth of frames, if given.
    pub truth: Option<PathBuf>,
    /// Steps and seconds of the network's training.
    pub training_steps: u64,
    pub training_seconds: f64,
    /// Flicker of the relit interview. None if unknown, and in files of older versions.
    #[serde(default)]
    pub flicker: Option<ClipFlicker>,
    /// Names of the network's lamps.
    pub lamps: Vec<String>,
    /// Frames first, then poses. At least one.
    pub cases: Vec<CaseScores>,
}

/// Metric of a predicted OLAT.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Metric {
    Psnr,
    Ssim,
    /// Visible difference.
    #[default]
    Flip,
}

impl Metric {
    pub const ALL: [Self; 3] = [Self::Flip, Self::Psnr, Self::Ssim];

    pub fn name(self) -> &'static str {
        match self {
            Self::Psnr => "PSNR",
            Self::Ssim => "SSIM",
            Self::Flip => "FLIP",
        }
    }

    /// Score by this metric.
    pub fn score(self, cell: &OlatScore) -> f64 {
        match self {
            Self::Psnr => cell.psnr_db,
            Self::Ssim => cell.ssim,
            Self::Flip => cell.flip,
        }
    }

    /// Score of several OLATs: the mean, or for PSNR the value of the pooled error.
    pub fn mean<'a>(self, cells: impl ExactSizeIterator<Item = &'a OlatScore>) -> f64 {
        let count = cells.len();
        let values = cells.map(|cell| self.score(cell));
        match self {
            Self::Psnr => pooled(values),
            Self::Ssim | Self::Flip => values.sum::<f64>() / count as f64,
        }
    }

    /// Badness of a score: larger is worse.
    fn order(self, value: f64) -> f64 {
        match self {
            Self::Psnr | Self::Ssim => -value,
            Self::Flip => value,
        }
    }

    /// Score with its unit.
    pub fn text(self, value: f64) -> String {
        match self {
            Self::Psnr => format!("{value:.1} dB"),
            Self::Ssim | Self::Flip => format!("{value:.3}"),
        }
    }
}

impl Review {
    /// Relevant cases: those held out of training, or all if there are none.
    pub fn judged(&self) -> Vec<&CaseScores> {
        let unseen: Vec<&CaseScores> = self.cases.iter().filter(|c| !c.seen).collect();
        if unseen.is_empty() { self.cases.iter().collect() } else { unseen }
    }

    /// Indices of cases and lamps, the worst first.
    pub fn worst(&self, metric: Metric) -> Vec<(usize, usize)> {
        let figure = |&(case, lamp): &(usize, usize)| metric.order(metric.score(&self.cases[case].cells[lamp]));
        let lamps = 0..self.lamps.len();
        let mut cells: Vec<(usize, usize)> =
            (0..self.cases.len()).flat_map(|case| lamps.clone().map(move |lamp| (case, lamp))).collect();
        cells.sort_by(|a, b| figure(b).total_cmp(&figure(a)));
        cells
    }

    /// Next cell without a verdict: the worst after `after` in the order of [`Self::worst`], wrapping around. None if
    /// every cell has a verdict.
    pub fn next_unmarked(
        &self,
        metric: Metric,
        marks: &Marks,
        after: Option<(usize, usize)>,
    ) -> Option<(usize, usize)> {
        let order = self.worst(metric);
        let place = after.and_then(|after| order.iter().position(|&cell| cell == after));
        let (before, rest) = order.split_at(place.map_or(0, |place| place + 1));
        let is_unmarked = |&(case, lamp): &(usize, usize)| {
            let marked = marks.get(&self.cases[case].name, &self.lamps[lamp]);
            marked.is_none_or(|marked| marked.mark.is_none())
        };
        rest.iter().chain(before).copied().find(is_unmarked)
    }

    /// Score of each lamp over the relevant cases.
    pub fn lamp_means(&self, metric: Metric) -> Vec<f64> {
        let judged = self.judged();
        (0..self.lamps.len()).map(|lamp| metric.mean(judged.iter().map(|case| &case.cells[lamp]))).collect()
    }

    /// The lamps, the worst first.
    pub fn worst_lamps(&self, metric: Metric) -> Vec<usize> {
        let means = self.lamp_means(metric);
        let mut lamps: Vec<usize> = (0..means.len()).collect();
        lamps.sort_by(|&a, &b| metric.order(means[b]).total_cmp(&metric.order(means[a])));
        lamps
    }

    /// Score of each case over all lamps.
    pub fn case_means(&self, metric: Metric) -> Vec<f64> {
        let mean = |case: &CaseScores| metric.mean(case.cells.iter());
        self.cases.iter().map(mean).collect()
    }

    /// Indices of the cases and their scores over all lamps, the worst first.
    pub fn worst_cases(&self, metric: Metric) -> Vec<(usize, f64)> {
        let mut cases: Vec<(usize, f64)> = self.case_means(metric).into_iter().enumerate().collect();
        cases.sort_by(|a, b| metric.order(b.1).total_cmp(&metric.order(a.1)));
        cases
    }

    /// Lamp with the worst score in a case. None if there is no such case.
    pub fn worst_lamp(&self, metric: Metric, case: usize) -> Option<usize> {
        let cells = &self.cases.get(case)?.cells;
        let order = |lamp: usize| metric.order(metric.score(&cells[lamp]));
        (0..cells.len()).max_by(|&a, &b| order(a).total_cmp(&order(b)))
    }

    /// Score over all OLATs of `cases`; None without a case.
    pub fn mean(metric: Metric, cases: &[&CaseScores]) -> Option<f64> {
        let cells: Vec<&OlatScore> = cases.iter().flat_map(|case| &case.cells).collect();
        (!cells.is_empty()).then(|| metric.mean(cells.into_iter()))
    }

    /// Reads the last measurement; None if there is none. [`Fingerprint::difference`] tells whether it is up to date.
    ///
    /// # Errors
    /// When the file cannot be read or is damaged.
    pub fn load(project: &Project) -> Result<Option<Self>> {
        const REMEDY: (&str, &str) = ("Measure again", "afterlight review PROJECT --fresh");
        let path = project.measured_path();
        let text = match files::read_text(&path, MOST_FIGURES) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(Error::io("open", path, e, REMEDY)),
        };
        let review: Self = serde_json::from_str(&text).map_err(|e| Error::codec("read", &path, e, REMEDY))?;
        let lamps = review.lamps.len();
        let whole = review.format == FORMAT
            && lamps > 0
            && !review.cases.is_empty()
            && review.cases.iter().all(|case| case.cells.len() == lamps);
        if whole {
            return Ok(Some(review));
        }
        Err(Error::invalid(
            format!(
                "{} is incomplete or of another version: it has format {}, {} cases and {lamps} lamps, where format \
                 {FORMAT} needs figures for each case and lamp",
                path.display(),
                review.format,
                review.cases.len()
            ),
            REMEDY,
        ))
    }

    /// Writes the review into the project.
    pub fn save(&self, project: &Project) -> Result<()> {
        let path = project.measured_path();
        let text =
            serde_json::to_string(self).map_err(|e| Error::bug(format!("cannot write {}: {e}", path.display())))?;
        write_beside(&path, |out| out.write_all(text.as_bytes()))
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Three lamps; a frame and a pose held out of training, and a pose seen in training.
    pub fn example() -> Review {
        let cell = |psnr_db: f64, flip: f64| OlatScore { psnr_db, ssim: 1.0 - flip, flip };
        let measured = |case, name: &str, seen, cells: [OlatScore; 3]| CaseScores {
            case,
            name: name.to_owned(),
            seen,
            scale: 1.0,
            cells: cells.to_vec(),
        };
        Review {
            format: FORMAT,
            basis: Fingerprint::default(),
            truth: None,
            training_steps: 1200,
            training_seconds: 600.0,
            flicker: None,
            lamps: ["olat_00", "olat_01", "olat_02"].map(str::to_owned).to_vec(),
            cases: vec![
                measured(Case::Frame(5), "frame_005", false, [cell(30.0, 0.1), cell(20.0, 0.3), cell(25.0, 0.2)]),
                measured(Case::Pose(0), "pose00", true, [cell(50.0, 0.5), cell(40.0, 0.02), cell(45.0, 0.01)]),
                measured(Case::Pose(1), "pose01", false, [cell(40.0, 0.05), cell(22.0, 0.15), cell(19.0, 0.25)]),
            ],
        }
    }

    #[test]
    fn the_worst_comes_first_by_any_figure() {
        let review = example();
        assert_eq!(review.worst(Metric::Flip)[..3], [(1, 0), (0, 1), (2, 2)]);
        assert_eq!(review.worst(Metric::Psnr)[..3], [(2, 2), (0, 1), (2, 1)]);
        assert_eq!(review.worst(Metric::Ssim), review.worst(Metric::Flip));
        assert_eq!(review.worst(Metric::Flip).len(), 9);
    }

    #[test]
    fn cases_are_ordered_by_their_means_and_know_their_worst_lamp() {
        let review = example();
        let order = |metric| {
            let cases = review.worst_cases(metric);
            cases.into_iter().map(|(case, _)| case).collect::<Vec<_>>()
        };
        assert_eq!(order(Metric::Flip), [0, 1, 2]);
        assert_eq!(order(Metric::Psnr), [2, 0, 1], "the lowest PSNR is the worst");
        assert_eq!(review.worst_lamp(Metric::Flip, 1), Some(0));
        assert_eq!(review.worst_lamp(Metric::Psnr, 1), Some(1));
        assert_eq!(review.worst_lamp(Metric::Psnr, 9), None);
    }

    #[test]
    fn the_next_worst_cell_without_a_verdict_follows_the_chosen_one_and_goes_around() {
        let review = example();
        let mut marks = Marks::default();
        let next = |marks: &Marks, after| review.next_unmarked(Metric::Flip, marks, after);
        let mark = |marks: &mut Marks, (case, lamp): (usize, usize), mark| {
            let (case, lamp) = (&review.cases[case].name, &review.lamps[lamp]);
            marks.set(MarkedOlat::new(case, lamp, mark, "seen"));
        };
        let order = review.worst(Metric::Flip);
        assert_eq!(next(&marks, None), Some(order[0]));
        assert_eq!(next(&marks, Some(order[0])), Some(order[1]));
        assert_eq!(next(&marks, Some(order[8])), Some(order[0]));
        assert_eq!(next(&marks, Some((7, 7))), Some(order[0]), "no such cell");
        mark(&mut marks, order[1], Some(Mark::Good));
        assert_eq!(next(&marks, Some(order[0])), Some(order[2]));
        mark(&mut marks, order[2], None);
        assert_eq!(next(&marks, Some(order[0])), Some(order[2]), "a note alone");
        for &cell in &order {
            mark(&mut marks, cell, Some(Mark::Bad));
        }
        assert_eq!(next(&marks, Some(order[0])), None);
    }

    #[test]
    fn lamps_are_judged_by_what_training_has_not_seen() {
        let review = example();
        let near = |a: &[f64], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(near(&review.lamp_means(Metric::Flip), [0.075, 0.225, 0.225]));
        assert_eq!(review.worst_lamps(Metric::Flip)[2], 0);
        let pooled = |a: f64, b: f64| -10.0 * ((10f64.powf(-a / 10.0) + 10f64.powf(-b / 10.0)) / 2.0).log10();
        let wanted = [pooled(30.0, 40.0), pooled(20.0, 22.0), pooled(25.0, 19.0)];
        assert!(near(&review.lamp_means(Metric::Psnr), wanted));
        assert!(near(&review.case_means(Metric::Flip), [0.2, 0.53 / 3.0, 0.15]));
        let mut trained = review;
        trained.cases.iter_mut().for_each(|case| case.seen = true);
        assert_eq!(trained.judged().len(), 3);
    }

    #[test]
    fn it_survives_its_file_and_a_broken_one_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let project = project::Project::without_shoot(folder.path());
        assert_eq!(Review::load(&project).unwrap(), None);
        let review = example();
        review.save(&project).unwrap();
        assert_eq!(Review::load(&project).unwrap(), Some(review.clone()));
        let torn = Review { lamps: vec!["olat_00".into()], ..review };
        torn.save(&project).unwrap();
        for text in [None, Some("{"), Some("{\"format\": 1}")] {
            if let Some(text) = text {
                std::fs::write(project.measured_path(), text).unwrap();
            }
            let refused = Review::load(&project).unwrap_err().for_terminal();
            assert!(refused.contains("measured.json") && refused.contains("--fresh"), "{refused}");
        }
    }
}
