//! Results as data and in words.

use super::lamps::LampShares;
use super::relation::{PoseErrors, Relation, Sign};
use base::Fnv;
use base::error::{Error, Result};
use base::files::{self, write_beside};
use base::median::median;
use calibration::Calibration;
use project::Project;
use serde::{Deserialize, Serialize};
use std::io::Write;
use std::path::PathBuf;

const FORMAT: u32 = 4;
const NAME: &str = "confidence.json";
/// Share of the interview's light from directions without a lamp above which poses cannot predict the errors of frames.
const MOST_UNCOVERED: f32 = 0.1;
/// A frame is unlike the poses beyond this multiple of the median distance between poses.
const UNLIKE: f32 = 2.0;
/// Share of a picture's cells for which an error bound holds.
pub const SAID_SHARE: f64 = 0.8;

/// Confidence in the frames of an interview.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ConfidenceReport {
    pub format: u32,
    /// Fingerprint of the calibration, the poses, the frames and their mattes behind the report.
    pub calibration: String,
    /// Share of the interview's light from directions without a lamp.
    pub uncovered: f32,
    /// Distance of each pose predicted from the others: median over its pixels of the logarithm of pose over best
    /// prediction, root mean square in a small window.
    pub pose_distances: Vec<f32>,
    /// Twice the median pose distance: a frame farther from all poses is unlike them. 0 if
    /// the poses show no subject.
    pub far: f32,
    pub frames: Vec<FrameConfidence>,
    /// Interval between examined frames.
    pub every: usize,
    /// Frames that, photographed as poses, would leave the least uncovered, the most useful first.
    pub missing: Vec<usize>,
    /// Error as a function of distance and spread, its distribution over lamps, and the data behind both.
    pub relation: Option<Relation>,
    pub lamps: Option<LampShares>,
    #[serde(default)]
    pub left_out: Vec<PoseErrors>,
    /// Test of the predicted errors, if a truth was given.
    #[serde(default)]
    pub judged: Option<Judged>,
}

/// Test of the predicted errors on frames whose truth is known.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Judged {
    pub frames: usize,
    /// Share of cells within the bound for the usual frame, and within that for all but one of k + 1; the target is
    /// [`SAID_SHARE`].
    pub cells_within: [f64; 2],
    /// The cells in four groups of equal size, by predicted error, smallest first: shows whether small and large bounds
    /// hold alike.
    #[serde(default)]
    pub quarters: [Quarter; 4],
    /// Share of frames in which the second bound holds for the required share of cells.
    pub frames_within: f64,
    /// Share of frames that reach the PSNR predicted for all but one of k + 1.
    pub frames_reaching: f64,
    /// Mean of actual less expected PSNR in decibels: above 0, errors were smaller than expected.
    pub better_by_db: f64,
    /// Agreement of expected and actual errors of cells, as the correlation of their logarithms.
    pub correlation: f64,
    /// Agreement over the lamps within each frame; None without [`LampShares`].
    pub lamp_correlation: Option<f64>,
}

/// Cells with about the same predicted error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Quarter {
    /// Smallest and largest error predicted for the usual frame, as shares of encoded white.
    pub said: [f64; 2],
    /// Share of cells within the bound for the usual frame, and within that for all but one of k + 1.
    pub within: [f64; 2],
    pub cells: usize,
}

impl Quarter {
    /// Groups cells by predicted error; each cell has its prediction and its error.
    fn all(mut cells: Vec<([f64; 2], f64)>) -> [Self; 4] {
        cells.sort_unstable_by(|a, b| a.0[0].total_cmp(&b.0[0]));
        let bound = |quarter: usize| quarter * cells.len() / 4;
        [0, 1, 2, 3].map(|quarter| {
            let cells = &cells[bound(quarter)..bound(quarter + 1)];
            let (Some(first), Some(last)) = (cells.first(), cells.last()) else { return Self::default() };
            let within = |which: usize| {
                let holds = cells.iter().filter(|(said, error)| *error <= said[which]);
                holds.count() as f64 / cells.len() as f64
            };
            Self { said: [first.0[0], last.0[0]], within: [within(0), within(1)], cells: cells.len() }
        })
    }
}

impl Judged {
    /// Computes the test; None without frames or cells.
    pub(super) fn new(relation: &Relation, lamps: Option<&LampShares>, frames: &[PoseErrors]) -> Option<Self> {
        let frames: Vec<&PoseErrors> = (frames.iter()).filter(|frame| !frame.signs.is_empty()).collect();
        let cells = |frame: &PoseErrors| -> Vec<(Sign, f64)> {
            let pairs = frame.signs.iter().zip(&frame.squared_errors);
            pairs.map(|(sign, square)| (*sign, square.sqrt())).collect()
        };
        let within = |frame: &PoseErrors, which: usize| {
            let cells = cells(frame);
            let holds = cells.iter().filter(|(sign, e)| *e <= relation.cells(*sign)[which]);
            holds.count() as f64 / cells.len() as f64
        };
        let count = frames.len() as f64;
        let mean = |value: &dyn Fn(&PoseErrors) -> f64| frames.iter().map(|frame| value(frame)).sum::<f64>() / count;
        let share = |holds: bool| f64::from(u8::from(holds));
        let real = |frame: &PoseErrors| {
            let squares = &frame.squared_errors;
            -10.0 * (squares.iter().sum::<f64>() / squares.len() as f64).log10()
        };
        let reached = |frame: &PoseErrors| {
            let decibels = relation.decibels(frame.signs.iter().copied());
            decibels.unwrap_or([f64::NAN; 2])
        };
        let logs: Vec<(f64, f64)> = (frames.iter())
            .flat_map(|frame| cells(frame))
            .map(|(sign, error)| (relation.cells(sign)[0].ln(), error.max(1e-6).ln()))
            .collect();
        let lamp_correlation = |lamps: &LampShares| {
            let frames = frames.iter().flat_map(|frame| {
                let lamp_errors = &frame.lamps;
                let mean =
                    lamp_errors.squared_errors.iter().sum::<f64>() / lamp_errors.squared_errors.len().max(1) as f64;
                let spreads = (!lamp_errors.squared_spreads.is_empty()).then_some(&lamp_errors.squared_spreads[..]);
                let said = lamps.decibels(0.0, spreads).into_iter();
                let real = lamp_errors.squared_errors.iter().map(move |e| -10.0 * (e / mean).max(1e-9).log10());
                said.zip(real)
            });
            correlation(&frames.collect::<Vec<_>>())
        };
        let said = |(sign, error)| (relation.cells(sign), error);
        let all_cells = frames.iter().flat_map(|frame| cells(frame)).map(said);
        let quarters = Quarter::all(all_cells.collect());
        (count > 0.0).then(|| Self {
            quarters,
            lamp_correlation: lamps.map(lamp_correlation),
            frames: frames.len(),
            cells_within: [0, 1].map(|which| mean(&|frame| within(frame, which))),
            frames_within: mean(&|frame| share(within(frame, 1) >= SAID_SHARE)),
            frames_reaching: mean(&|frame| share(real(frame) >= reached(frame)[1])),
            better_by_db: mean(&|frame| real(frame) - reached(frame)[0]),
            correlation: correlation(&logs),
        })
    }
}

/// Folder of the report.
fn folder(project: &Project) -> PathBuf {
    project.result_path("confidence")
}

/// Fingerprint of the calibration: FNV-1a of the file's text, or an empty text without a file.
///
/// # Errors
/// When the file cannot be read.
pub fn mark(project: &Project) -> Result<String> {
    let path = project.calibration_path();
    if !path.exists() {
        return Ok(String::new());
    }
    let text = files::read_text(&path, files::MOST_TEXT)
        .map_err(|e| Error::io("read", &path, e, "Calibrate the project again"))?;
    let mut mark = Fnv::from_bytes(text.as_bytes());
    let shoot = &project.settings.shoot;
    mark.text(&format!("{:?} {:?}", shoot.poses, shoot.frames));
    let poses = (0..shoot.poses.len()).map(|pose| project.exemplar_matte(pose));
    let frames = (0..shoot.frames.len()).map(|frame| project.frame_matte(frame));
    let pictures = (0..shoot.frames.len()).map(|frame| project.frame_picture(frame));
    let files = poses.chain(frames).map(|matte| matte.file().to_owned());
    for file in files.chain(pictures.map(|picture| picture.file().to_owned())) {
        let bytes = std::fs::metadata(file).map_or(0, |about| about.len());
        mark.bytes(&bytes.to_le_bytes());
    }
    Ok(mark.to_string())
}

/// Median distance of the poses that show a subject; 0 without such poses.
fn median_distance(poses: &[f32]) -> f32 {
    median(poses.iter().copied().filter(|distance| *distance > 0.0))
}

/// Correlation of pairs; 0 where one side is constant.
fn correlation(pairs: &[(f64, f64)]) -> f64 {
    let count = pairs.len().max(1) as f64;
    let mean = |value: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(value).sum::<f64>() / count;
    let (x, y) = (mean(&|p| p.0), mean(&|p| p.1));
    let together = mean(&|p| (p.0 - x) * (p.1 - y));
    let apart = (mean(&|p| (p.0 - x).powi(2)) * mean(&|p| (p.1 - y).powi(2))).sqrt();
    if apart > 0.0 { together / apart } else { 0.0 }
}

/// Confidence in a frame.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FrameConfidence {
    pub frame: usize,
    /// Distance to the nearest poses, 0 without a subject; above [`ConfidenceReport::far`] is far.
    pub distance: f32,
    /// The most similar pose.
    pub pose: Option<usize>,
    /// Expected error; None without two poses that show the subject.
    pub expected: Option<Expected>,
    /// Distance of each of [`SIDE`](super::SIDE) × [`SIDE`](super::SIDE) cells, row by row; 0 outside the subject.
    pub cells: Vec<f32>,
    /// Expected error of the OLATs in each of these cells, as a share of encoded white; empty if unknown.
    pub errors: Vec<f32>,
    /// Expected PSNR in decibels of the OLAT of each lamp; empty if unknown.
    pub lamps: Vec<f32>,
}

impl FrameConfidence {
    /// Lamp with the worst expected OLAT, and its PSNR in decibels.
    pub fn worst_lamp(&self) -> Option<(usize, f32)> {
        let lamps = self.lamps.iter().copied().enumerate();
        lamps.min_by(|a, b| a.1.total_cmp(&b.1))
    }
}

/// The expected error of a frame's OLATs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Expected {
    /// PSNR in decibels.
    pub psnr_db: f64,
    /// PSNR in decibels that all but one of k + 1 frames reach, with k poses.
    pub at_least_db: f64,
}

impl ConfidenceReport {
    pub(super) fn new(
        project: &Project,
        calibration: &Calibration,
        pose_distances: Vec<f32>,
        every: usize,
    ) -> Result<Self> {
        Ok(Self {
            format: FORMAT,
            calibration: mark(project)?,
            uncovered: calibration.uncovered_energy,
            far: UNLIKE * median_distance(&pose_distances),
            pose_distances,
            frames: Vec::new(),
            every,
            missing: Vec::new(),
            relation: None,
            lamps: None,
            left_out: Vec::new(),
            judged: None,
        })
    }

    /// Path of the report's file.
    pub fn path(project: &Project) -> PathBuf {
        folder(project).join(NAME)
    }

    /// Writes the report into the project.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn save(&self, project: &Project) -> Result<()> {
        let path = Self::path(project);
        std::fs::create_dir_all(folder(project))
            .map_err(|e| Error::io("write", folder(project), e, "Check that the project's folder can be written"))?;
        let text = serde_json::to_string(self).map_err(|e| Error::bug(format!("the confidence is not JSON: {e}")))?;
        write_beside(&path, |out| out.write_all(text.as_bytes()))
    }

    /// The project's report, if there is one, and true if the calibration has not changed since.
    ///
    /// # Errors
    /// When the file cannot be read, or was not written by this program.
    pub fn load(project: &Project) -> Result<Option<(Self, bool)>> {
        let path = Self::path(project);
        if !path.exists() {
            return Ok(None);
        }
        let remedy = ("Remove the file and estimate again", "afterlight confidence PROJECT");
        let text = files::read_text(&path, files::MOST_TEXT).map_err(|e| Error::io("read", &path, e, remedy))?;
        let found: Self = serde_json::from_str(&text)
            .map_err(|e| Error::invalid(format!("{} cannot be read: {e}", path.display()), remedy))?;
        if found.format != FORMAT {
            return Err(Error::invalid(
                format!("{} has format {}, not {FORMAT}", path.display(), found.format),
                remedy,
            ));
        }
        let fits = mark(project).is_ok_and(|mark| mark == found.calibration);
        Ok(Some((found, fits)))
    }

    /// PSNR in decibels that all but one of k + 1 frames reach; None for a frame that is unlike every pose, or lit by
    /// directions that the poses do not cover.
    pub fn promised(&self, frame: &FrameConfidence) -> Option<f64> {
        let holds = frame.distance <= self.far && self.uncovered <= MOST_UNCOVERED;
        Some(frame.expected?.at_least_db).filter(|_| holds)
    }

    /// Distance of a frame as a multiple of the median distance between poses.
    pub fn times(&self, frame: &FrameConfidence) -> f32 {
        frame.distance / median_distance(&self.pose_distances).max(f32::MIN_POSITIVE)
    }

    /// Frames farther than [`Self::far`] from all poses, the farthest first.
    pub fn unlike(&self) -> Vec<&FrameConfidence> {
        let mut all: Vec<&FrameConfidence> = self.frames.iter().collect();
        all.retain(|frame| self.far > 0.0 && frame.distance > self.far);
        all.sort_by(|a, b| b.distance.total_cmp(&a.distance));
        all
    }

    /// Summary in a few sentences.
    pub fn sentence(&self) -> String {
        let names = |frames: &mut dyn Iterator<Item = usize>| {
            let names: Vec<String> = frames.map(|frame| frame.to_string()).collect();
            names.join(", ")
        };
        let unlike = self.unlike();
        let mut text = match unlike.len() {
            0 => format!("None of {} frames is unlike every pose", self.frames.len()),
            count => format!(
                "{count} of {} frames {} unlike every pose, the most unlike first: {}",
                self.frames.len(),
                if count == 1 { "is" } else { "are" },
                names(&mut unlike.iter().take(10).map(|frame| frame.frame))
            ),
        };
        if let (Some(relation), Some((frame, expected))) = (&self.relation, self.worst()) {
            text += &format!(
                "\nOLATs: {:.1} dB expected in the median frame, {:.1} dB at worst, frame {}",
                self.usual().unwrap_or_default(),
                expected.psnr_db,
                frame.frame
            );
            text += &match self.promised(frame) {
                Some(at_least) => format!(
                    "; {} in {} frames like it reach at least {at_least:.1} dB",
                    relation.poses,
                    relation.poses + 1
                ),
                None if self.uncovered > MOST_UNCOVERED => format!(
                    ". They may be worse: {:.0} % of the interview's light comes from \
                     directions without a lamp, which poses do not show",
                    100.0 * self.uncovered
                ),
                None => ". It may be worse: this frame is unlike every pose".to_owned(),
            };
            if let Some((frame, lamp, decibels)) = self.worst_olats().first() {
                text += &format!(
                    "\nThe worst OLAT is expected in frame {} under lamp {lamp}: {decibels:.1} dB",
                    frame.frame
                );
            }
        }
        if let Some(judged) = &self.judged {
            text += &format!(
                "\nCompared with the truth of {} frames: {:.0} % reach their predicted minimum, {:.0} % of their \
                 parts are within the predicted error (target {:.0} %), and the frames are {:+.1} dB better than expected",
                judged.frames,
                100.0 * judged.frames_reaching,
                100.0 * judged.cells_within[1],
                100.0 * SAID_SHARE,
                judged.better_by_db
            );
            let quarters = judged.quarters.iter().filter(|quarter| quarter.cells > 0);
            let quarters = quarters.map(|quarter| {
                format!("at most {:.1} % of white, {:.0} %", 100.0 * quarter.said[1], 100.0 * quarter.within[0])
            });
            text += &format!(
                "\nParts within their expected error, by quarters. Where it was {}",
                quarters.collect::<Vec<_>>().join("; ")
            );
        }
        if !self.missing.is_empty() {
            text += &format!("\nPhotograph these next: frames {}", names(&mut self.missing.iter().copied()));
        }
        text
    }

    /// Each frame with its worst expected lamp and the PSNR of that OLAT in decibels, the worst first.
    pub fn worst_olats(&self) -> Vec<(&FrameConfidence, usize, f32)> {
        let worst = |frame| {
            let (lamp, decibels) = FrameConfidence::worst_lamp(frame)?;
            Some((frame, lamp, decibels))
        };
        let mut all: Vec<_> = self.frames.iter().filter_map(worst).collect();
        all.sort_by(|a, b| a.2.total_cmp(&b.2));
        all
    }

    /// Frame with the largest expected error.
    pub fn worst(&self) -> Option<(&FrameConfidence, Expected)> {
        let all = (self.frames.iter()).filter_map(|frame| Some((frame, frame.expected?)));
        all.min_by(|a, b| a.1.psnr_db.total_cmp(&b.1.psnr_db))
    }

    /// Median of the frames' expected PSNR.
    pub fn usual(&self) -> Option<f64> {
        let mut all: Vec<f64> = (self.frames.iter()).filter_map(|frame| Some(frame.expected?.psnr_db)).collect();
        all.sort_unstable_by(f64::total_cmp);
        all.get(all.len() / 2).copied()
    }
}
