//! Time limit of a run, and the share of the processor taken by other work.

use serde_json::{Value, json};
use std::time::Instant;

/// Clock of a run.
pub struct Clock {
    began: Instant,
    minutes: f64,
    ticks: Option<Ticks>,
}

/// Clock ticks of all the processor's threads since the machine started.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Ticks {
    all: f64,
    /// Busy ticks of all processes …
    busy: f64,
    /// … and of this process and its children that were waited for.
    own: f64,
}

impl Clock {
    /// Starts a run with a limit in minutes.
    pub fn start(minutes: f64) -> Self {
        Self { began: Instant::now(), minutes, ticks: Ticks::now() }
    }

    /// Minutes left, at least 0.
    pub fn left(&self) -> f64 {
        (self.minutes - self.spent()).max(0.0)
    }

    /// True if the time is up.
    pub fn is_over(&self) -> bool {
        self.left() <= 0.0
    }

    fn spent(&self) -> f64 {
        self.began.elapsed().as_secs_f64() / 60.0
    }

    /// Record of the run: its minutes, the share of the processor's time taken by other work (null if the system does
    /// not report it), and the program's build.
    pub fn record(&self, build: &str) -> Value {
        let others = self.ticks.zip(Ticks::now());
        let others = others.and_then(|(before, now)| now.others_since(before));
        json!({"minutes": self.spent(), "others": others, "build": build})
    }
}

impl Ticks {
    /// None if the system does not report it.
    fn now() -> Option<Self> {
        let read = |path| std::fs::read_to_string(path).ok();
        Self::new(&read("/proc/stat")?, &read("/proc/self/stat")?)
    }

    /// Parses the texts of `/proc/stat` and `/proc/self/stat`.
    fn new(machine: &str, process: &str) -> Option<Self> {
        let line = machine.lines().find(|line| line.starts_with("cpu "))?;
        let counts: Vec<f64> = line.split_whitespace().skip(1).map_while(|count| count.parse().ok()).take(8).collect();
        let idle = counts.get(3)? + counts.get(4)?;
        let all: f64 = counts.iter().sum();
        // The name, in brackets, may contain spaces. The third field follows it; the 14th to 17th are ticks of the
        // process and of the children that it waited for.
        let fields: Vec<&str> = process.rsplit_once(')')?.1.split_whitespace().collect();
        let own = fields.get(11..15)?.iter().map(|ticks| ticks.parse::<f64>());
        Some(Self { all, busy: all - idle, own: own.sum::<Result<f64, _>>().ok()? })
    }

    /// Share of the time since `before` taken by other processes; None if no time has passed.
    fn others_since(self, before: Self) -> Option<f64> {
        let all = self.all - before.all;
        let others = (self.busy - before.busy) - (self.own - before.own);
        (all > 0.0).then(|| (others / all).clamp(0.0, 1.0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_work_is_what_was_busy_and_not_ours() {
        let process = |own: [u64; 4]| {
            let [a, b, c, d] = own;
            format!("42 (a name) with) S 1 42 42 0 -1 0 0 0 0 0 {a} {b} {c} {d} 20 0 3 0 99")
        };
        let before = Ticks::new("cpu  100 0 100 700 100 0 0 0 0 0\ncpu0 1 2", &process([1, 2, 3, 4]));
        let after = Ticks::new("cpu  500 50 150 1100 200 0 0 0 0 0\n", &process([101, 52, 53, 104]));
        // Of 1,000 ticks 500 were busy, of which 300 are ours.
        let others = after.unwrap().others_since(before.unwrap()).unwrap();
        assert!((others - 0.2).abs() < 1e-12, "{others}");
        assert_eq!(before.unwrap().others_since(before.unwrap()), None);
        assert_eq!(Ticks::new("", ""), None);
    }

    #[test]
    fn a_run_without_time_is_over_at_once() {
        let clock = Clock::start(0.0);
        assert!(clock.is_over());
        assert!(!Clock::start(1.0).is_over());
        assert_eq!(clock.record("1234")["build"], "1234");
    }
}
