//! Measures in order, with their allowed and expected times.

use super::LAMPS;
use super::measure::Measure;
use super::names::{FIRST, PASSES, PICTURES, PREDICTION, SELF_TEST, STEP, first_again};
use super::report::Row;
use training::Preset;

/// Working size of a network for pictures in the window and for export.
const WORKING: usize = 512;

/// Size at which the first use of a network is timed.
const FIRST_SIZE: usize = 128;

/// A measure on a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Planned {
    pub on_gpu: bool,
    pub measure: Measure,
}

/// Measures, the most important first, GPU before CPU, so that a short budget still covers what matters most.
pub fn plan(gpu: bool) -> Vec<Planned> {
    use Preset::{FastGpu, Paper, Quick};
    let network = |preset, size| Measure::Network { preset, size };
    let picture = |preset, size| Measure::Picture { preset, working: WORKING, size };
    let passes = |size| Measure::Passes { size };
    let order = [
        Measure::SelfTest,
        // Passes need no kernel tuning, so they always fit.
        passes(512),
        picture(Quick, 512),
        network(Quick, FIRST_SIZE),
        network(Quick, 256),
        Measure::FirstUse { size: FIRST_SIZE },
        // Cheap measures come first because they predict the expensive ones.
        picture(Quick, 1024),
        network(FastGpu, 128),
        network(Paper, 128),
        network(FastGpu, 256),
        network(Paper, 256),
        network(Quick, 512),
        passes(1024),
        network(FastGpu, 512),
        network(Paper, 512),
        picture(FastGpu, 512),
    ];
    let on_both = order.into_iter().flat_map(|measure| [true, false].map(|on_gpu| Planned { on_gpu, measure }));
    on_both.filter(|planned| if planned.on_gpu { gpu } else { !planned.for_gpus() }).collect()
}

impl Planned {
    /// True for measures that only apply to GPUs.
    fn for_gpus(&self) -> bool {
        let picture = matches!(self.measure, Measure::Picture { preset: Preset::FastGpu, .. });
        picture || matches!(self.measure, Measure::SelfTest | Measure::FirstUse { .. })
    }

    /// True if the process must find no cached kernels, or only those of another such process.
    pub fn starts_fresh(&self) -> bool {
        let first = Measure::Network { preset: Preset::Quick, size: FIRST_SIZE };
        self.on_gpu && (self.measure == first || self.measure == Measure::FirstUse { size: FIRST_SIZE })
    }

    /// Share of the time in seconds, for dividing the budget. A GPU spends most of it on compiling and tuning kernels,
    /// whatever the size; a CPU on the timed work.
    pub fn need(&self) -> f64 {
        match (self.on_gpu, self.measure) {
            (_, Measure::SelfTest) => 10.0,
            (true, Measure::Network { .. }) => 30.0,
            (true, Measure::FirstUse { .. }) => 15.0,
            (true, Measure::Picture { .. }) => 25.0,
            (true, Measure::Passes { size }) => {
                if size > 512 {
                    20.0
                } else {
                    10.0
                }
            }
            (false, Measure::Network { preset, size }) => {
                let adds = |preset: Preset, size| preset.config().network_of(size, LAMPS).cost().multiply_adds as f64;
                4.0 + 0.75 * adds(preset, size) / adds(Preset::Quick, FIRST_SIZE)
            }
            (false, Measure::FirstUse { .. }) => 2.0,
            (false, Measure::Picture { size, .. }) => {
                if size > 512 {
                    20.0
                } else {
                    15.0
                }
            }
            (false, Measure::Passes { size }) => {
                if size > 512 {
                    25.0
                } else {
                    15.0
                }
            }
        }
    }
}

impl Measure {
    /// Name and size of the network.
    pub fn shape(&self) -> (Option<Preset>, Option<usize>) {
        match *self {
            Self::SelfTest => (None, None),
            Self::Network { preset, size } | Self::Picture { preset, size, .. } => (Some(preset), Some(size)),
            Self::FirstUse { size } => (Some(Preset::Quick), Some(size)),
            Self::Passes { size } => (None, Some(size)),
        }
    }

    /// Names of the rows that the measure fills, in timing order.
    pub fn rows(&self) -> Vec<String> {
        let owned = |names: &[&str]| names.iter().map(|&name| name.to_owned()).collect();
        match self {
            Self::SelfTest => owned(&[SELF_TEST]),
            Self::Network { .. } => owned(&[STEP, PREDICTION]),
            Self::FirstUse { .. } => FIRST.iter().map(first_again).collect(),
            Self::Passes { .. } => owned(&[PASSES]),
            Self::Picture { .. } => owned(&PICTURES),
        }
    }

    /// Description of the measure in words.
    pub fn words(&self) -> String {
        let (preset, size) = self.shape();
        let network = preset.map_or(String::new(), |preset| format!("{} ", preset.name()));
        let size = size.map_or(String::new(), |size| format!(" at {size} pixels"));
        format!("{network}{}{size}", self.rows().join(", "))
    }

    /// Approximate memory needed, in bytes.
    pub fn bytes(&self) -> u64 {
        let field = |size: usize| (12 * LAMPS * size * size) as u64;
        match *self {
            Self::SelfTest => 0,
            Self::Network { preset, size } => {
                let network = preset.config().network_of(size, LAMPS);
                network.cost().training_bytes() + 3 * field(size)
            }
            Self::FirstUse { size } => 8 * field(size),
            // The field in three formats, and two blocks for copying.
            Self::Passes { size } => 5 * field(size),
            Self::Picture { working, size, .. } => 6 * field(working) + 400 * (size * size) as u64,
        }
    }

    /// Milliseconds of each row as predicted from known rows, in the order of [`Self::rows`].
    pub fn predicted(&self, measured: &[Row]) -> Option<Vec<f64>> {
        match *self {
            Self::SelfTest | Self::FirstUse { .. } => None,
            Self::Network { preset, size } => {
                let adds = |preset: Preset, size| preset.config().network_of(size, LAMPS).cost().multiply_adds as f64;
                let estimate = |what: &str| {
                    let known = |preset: Preset, size: usize| {
                        let found = median(measured, what, Some(preset), size)?;
                        Some((found, adds(preset, size)))
                    };
                    let smaller = [size / 2, size / 4].into_iter().find_map(|s| known(preset, s));
                    let other = || Preset::ALL.into_iter().find_map(|p| known(p, size));
                    let (ms, known) = smaller.or_else(other)?;
                    Some(ms * adds(preset, size) / known)
                };
                Some(vec![estimate(STEP)?, estimate(PREDICTION)?])
            }
            Self::Passes { size } => {
                let smaller = measured
                    .iter()
                    .filter(|row| row.size == Some(size / 2) && row.copy_ms.is_some() && row.network.is_none());
                let whole: Vec<f64> = smaller.filter_map(|row| row.median_ms).collect();
                // Rows with four times as many bytes.
                (!whole.is_empty()).then(|| vec![4.0 * whole.iter().sum::<f64>()])
            }
            Self::Picture { preset, working, size } => {
                let other = measured.iter().find_map(|row| {
                    let like = row.what == PICTURES[1] && row.median_ms.is_some();
                    row.size.filter(|_| like)
                })?;
                let area = ((size * size) as f64) / ((other * other) as f64);
                let relit = |what| Some(area * median(measured, what, None, other)?);
                let network = median(measured, PREDICTION, Some(preset), working).or_else(|| {
                    let whole = median(measured, PICTURES[0], Some(preset), other)?;
                    Some(whole - median(measured, PICTURES[1], Some(preset), other)?)
                })?;
                let (frame, turn) = (relit(PICTURES[1])?, relit(PICTURES[2])?);
                Some(vec![network + frame, frame, turn])
            }
        }
    }
}

/// Median of a row; of any network if none is named.
fn median(measured: &[Row], what: &str, preset: Option<Preset>, size: usize) -> Option<f64> {
    let name = preset.map(Preset::name);
    let mut rows = measured
        .iter()
        .filter(|row| row.what == what && row.size == Some(size) && (name.is_none() || row.network.as_deref() == name));
    rows.find_map(|row| row.median_ms)
}
