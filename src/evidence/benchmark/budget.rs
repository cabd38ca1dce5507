//! Number of timed runs, and their times.

use base::error::Result;
use serde::{Deserialize, Serialize};
use std::time::{Duration, Instant};

/// Limits on the number and the time of timed runs.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// Fewest runs, whatever the time, and most runs.
    pub runs: (usize, usize),
    /// Time after the first run from which no new run starts.
    pub time: Duration,
}

/// Times of many runs in milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    pub median_ms: f64,
    /// 5th and 95th percentiles.
    pub low_ms: f64,
    pub high_ms: f64,
    /// Number of timed runs.
    pub runs: usize,
}

impl Spread {
    /// Median and percentiles of times in milliseconds, in any order.
    pub fn from_times(mut times: Vec<f64>) -> Self {
        times.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| {
            let last = times.len().saturating_sub(1) as f64;
            let place = (share * last).round() as usize;
            times.get(place).copied().unwrap_or(f64::NAN)
        };
        Self { median_ms: at(0.5), low_ms: at(0.05), high_ms: at(0.95), runs: times.len() }
    }
}

impl Budget {
    /// At least three runs, at most `most`, for about `seconds`.
    pub fn seconds(seconds: f64, most: usize) -> Self {
        Self { runs: (3.min(most), most), time: Duration::from_secs_f64(seconds.max(0.0)) }
    }

    /// Times each run of `work`, in milliseconds.
    ///
    /// # Errors
    /// When a run fails.
    pub fn time<T>(&self, mut work: impl FnMut() -> Result<T>) -> Result<Vec<f64>> {
        let mut times = Vec::new();
        let began = Instant::now();
        let (least, most) = self.runs;
        while times.len() < least || (times.len() < most && began.elapsed() < self.time) {
            times.push(timed(&mut work)?.0);
        }
        Ok(times)
    }
}

/// Milliseconds that `work` took, and its result.
pub fn timed<T>(mut work: impl FnMut() -> Result<T>) -> Result<(f64, T)> {
    let started = Instant::now();
    let made = std::hint::black_box(work()?);
    Ok((started.elapsed().as_secs_f64() * 1e3, made))
}
