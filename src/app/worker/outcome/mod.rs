//! Results of long actions: figures for scripts, and sentences for people.

mod report;
mod sentence;

pub use report::{EnvironmentsReport, ImportReport};

use crate::demo::DemoReport;
use benchmark::MachineReport;
use calibration::Calibration;
use calibration::develop::DevelopReport;
use check::CheckReport;
use confidence::ConfidenceReport;
use evaluation::EvaluateReport;
use evaluation::blind::{AnswersReport, BlindReport};
use evaluation::review::ReviewReport;
use export::relight::RelightReport;
use farm::{AssembleReport, ChunkReport, JobReport};
use footage::{FrameReport, LampReport, MattesReport};
use imaging::DualGamma;
use reflectance::checkpoint::CheckpointInfo;
use sentence::{developed, evaluated, for_so_long, imported, listed, reviewed, staged, trained};
use serde::{Serialize, Serializer};
use tradeoff::{Applied, TradeoffReport};
use training::TrainReport;
use virtual_stage::StageReport;

/// Result of a job. Only the figures are serialised.
#[derive(Clone, Debug, Serialize)]
#[serde(untagged)]
pub enum Outcome {
    Staged(StageReport),
    Imported(ImportReport),
    Listed(EnvironmentsReport),
    Developed(DevelopReport),
    Calibrated(#[serde(serialize_with = "calibrated")] Box<Calibration>),
    Checked(CheckReport),
    Trained(TrainReport),
    Relit(RelightReport),
    Evaluated(EvaluateReport),
    Reviewed(ReviewReport),
    Compared(BlindReport),
    Answered(AnswersReport),
    Trusted(Box<ConfidenceReport>),
    Measured(Box<TradeoffReport>),
    Applied(Applied),
    Shown(Box<DemoReport>),
    Machine(Box<MachineReport>),
    Packed(CheckpointInfo),
    WentBack(WentBack),
    Farmed(JobReport),
    Chunk(ChunkReport),
    Assembled(Box<AssembleReport>),
    Framed(FrameReport),
    Lamps(LampReport),
    Matted(MattesReport),
}

/// The checkpoint from which training continues.
#[derive(Clone, Debug, Serialize)]
pub struct WentBack {
    pub info: CheckpointInfo,
    /// True if it has the optimiser's state, so that training continues as if it had not stopped.
    pub optimizer: bool,
}

impl Outcome {
    /// Sentences about the job's result.
    pub fn sentence(&self) -> String {
        match self {
            Self::Staged(report) => staged(report),
            Self::Imported(found) => imported(found),
            Self::Listed(report) => listed(report),
            Self::Developed(report) => developed(report),
            Self::Calibrated(found) => format!(
                "{} lamps found; camera response {}, exposure {:.3}; {:.1} % of the interview's light comes \
                 from directions without a lamp",
                found.rig.lamps.len(),
                found.response,
                found.exposure,
                100.0 * found.uncovered_energy
            ),
            Self::Checked(report) => report.sentence(),
            Self::Trained(report) => trained(report),
            Self::Relit(report) => report.sentence(),
            Self::Evaluated(report) => evaluated(report),
            Self::Reviewed(report) => reviewed(report),
            Self::Compared(report) => report.sentence(),
            Self::Answered(report) => report.sentence(),
            Self::Trusted(report) => report.sentence(),
            Self::Measured(report) => report.sentence(),
            Self::Applied(applied) => applied.sentence(),
            Self::Shown(report) => report.sentence(),
            Self::Machine(report) => report.sentence(),
            Self::Farmed(report) => report.sentence(),
            Self::Chunk(report) => report.sentence(),
            Self::Assembled(report) => report.sentence(),
            Self::WentBack(WentBack { info, optimizer }) => format!(
                "Step {} restored, after {} of training. The previous checkpoint stays in the list. {}",
                info.step,
                for_so_long(info.seconds),
                if *optimizer {
                    "Training resumes there."
                } else {
                    "Training resumes from its weights, with a new optimiser."
                }
            ),
            Self::Framed(report) => report.sentence(),
            Self::Lamps(report) => report.sentence(),
            Self::Matted(report) => report.sentence(),
            Self::Packed(info) => {
                format!("A network for {} lamps at {} pixels", info.network.lamps, info.network.size)
            }
        }
    }
}

/// For a response without exponents, adds those of the nearest dual gamma, which scripts read.
fn calibrated<S: Serializer>(found: &Calibration, to: S) -> std::result::Result<S::Ok, S::Error> {
    #[derive(Serialize)]
    struct Figures<'a> {
        #[serde(flatten)]
        nearest: Option<DualGamma>,
        #[serde(flatten)]
        found: &'a Calibration,
    }
    let response = &found.response;
    let has_exponents = response.exponents().is_some();
    Figures { nearest: (!has_exponents).then(|| response.nearest_dual_gamma().0), found }.serialize(to)
}
