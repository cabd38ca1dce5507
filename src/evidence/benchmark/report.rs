//! Results for a machine.

use super::names::PICTURES;
use base::machine::Machine;
use gpu::Adapter;
use serde::{Deserialize, Serialize};

/// A machine.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MachineReport {
    pub machine: Machine,
    /// Adapters that the system offers.
    pub adapters: Vec<Adapter>,
    /// Allowed minutes, and seconds taken.
    pub minutes: f64,
    pub seconds: f64,
    /// True if the run was stopped early.
    pub stopped: bool,
    pub devices: Vec<DeviceReport>,
}

/// One of the machine's devices.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DeviceReport {
    /// `gpu` or `cpu`.
    pub kind: String,
    pub name: String,
    /// Result of the self-test as a sentence; None on the CPU, or if the test did not finish.
    pub self_test: Option<String>,
    /// Bytes copied per second, counting reads and writes.
    pub copied_per_second: Option<f64>,
    pub rows: Vec<Row>,
}

/// A timed piece of work, or the reason why it was left out.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Row {
    pub what: String,
    /// Preset of the network.
    pub network: Option<String>,
    /// Width and height in pixels.
    pub size: Option<usize>,
    pub median_ms: Option<f64>,
    /// 5th and 95th percentiles.
    pub low_ms: Option<f64>,
    pub high_ms: Option<f64>,
    pub runs: usize,
    /// Milliseconds of the first run beyond the median; its whole time if it was the only one.
    pub first_ms: Option<f64>,
    /// Time in which the device copies the bytes that the work must read and write.
    pub copy_ms: Option<f64>,
    /// The goal in words, and true if it is reached.
    pub goal: Option<String>,
    pub reached: Option<bool>,
    /// Time predicted from smaller sizes, if the row was left out.
    pub predicted_ms: Option<f64>,
    /// Reason for missing times.
    pub left_out: Option<String>,
    /// Peak memory of the measure's process by then, in bytes.
    pub peak_bytes: Option<u64>,
    /// GPU memory allocated by then, in bytes.
    pub gpu_bytes: Option<u64>,
}

/// Target rate of relit frames of this size, network included, per second.
const GOAL_SIZE: usize = 512;
const GOAL_PER_SECOND: f64 = 60.0;
/// Target time of the sum of lamps, as a multiple of copying.
const GOAL_COPIES: f64 = 1.3;

impl MachineReport {
    /// One-sentence summary.
    pub fn sentence(&self) -> String {
        let rows = || self.devices.iter().flat_map(|device| &device.rows);
        let missing = rows().filter(|row| row.left_out.is_some()).count();
        format!(
            "Measured this machine in {:.1} minutes{}: {} figures, {missing} left out",
            self.seconds / 60.0,
            if self.stopped { ", and stopped" } else { "" },
            rows().count() - missing,
        )
    }
}

impl Row {
    /// Adds the goal, if the row has one.
    pub fn with_goal(mut self) -> Self {
        let Some(ms) = self.median_ms else { return self };
        if self.what == PICTURES[0] && self.size == Some(GOAL_SIZE) {
            self.goal = Some(format!("at least {GOAL_PER_SECOND:.0} a second"));
            self.reached = Some(1e3 / ms >= GOAL_PER_SECOND);
        } else if let Some(copy) = self.copy_ms.filter(|_| self.is_sum()) {
            self.goal = Some(format!("at most {GOAL_COPIES} times copying"));
            self.reached = Some(ms <= GOAL_COPIES * copy);
        }
        self
    }

    /// True for the sum of lamps of a full field; false for its components.
    pub fn is_sum(&self) -> bool {
        self.what.starts_with("relight") || self.what.starts_with("sum, f")
    }

    /// Name of the measure, with its network and its size.
    pub fn name(&self) -> String {
        let network = self.network.as_deref();
        let network = network.map_or(String::new(), |name| format!(" ({name})"));
        let size = self.size.map_or(String::new(), |size| format!(" at {size} pixels"));
        format!("{}{network}{size}", self.what)
    }

    /// Median and spread, or the predicted time.
    pub fn time(&self) -> String {
        match (self.median_ms, self.low_ms, self.high_ms) {
            (Some(median), Some(low), Some(high)) if self.runs > 1 => {
                format!("{} ({}–{})", ms(median), ms(low), ms(high))
            }
            (Some(median), ..) => format!("{} (once)", ms(median)),
            _ => match (self.predicted_ms, self.first_ms, &self.left_out) {
                (_, Some(first), _) => format!("first run {}", ms(first)),
                (Some(predicted), ..) => format!("left out, about {}", ms(predicted)),
                (None, None, Some(_)) => "left out".to_owned(),
                (None, None, None) => "–".to_owned(),
            },
        }
    }

    pub fn aim(&self) -> String {
        match (&self.goal, self.reached) {
            (Some(goal), Some(true)) => format!("{goal}: yes"),
            (Some(goal), Some(false)) => format!("{goal}: **no**"),
            _ => String::new(),
        }
    }
}

/// Milliseconds with three significant digits.
pub fn ms(value: f64) -> String {
    match value {
        v if v >= 100.0 => format!("{v:.0}"),
        v if v >= 10.0 => format!("{v:.1}"),
        v => format!("{v:.2}"),
    }
}
