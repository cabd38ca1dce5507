//! The time that steps take when nothing slows them down.

/// Steps that are timed together: methods take samples of several kinds in turn.
const TOGETHER: u64 = 4;

/// Counts steps as if all had taken what the fastest did, so that other work on the machine costs a method no steps beside a
/// network that is trained by steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quiet {
    steps: u64,
    /// Seconds as the clock had them.
    passed: f64,
    /// Seconds of the steps that are timed together now.
    now: f64,
    /// The least mean of steps that were timed together.
    least: f64,
}

impl Default for Quiet {
    fn default() -> Self {
        Self { steps: 0, passed: 0.0, now: 0.0, least: f64::INFINITY }
    }
}

impl Quiet {
    /// Adds a step that took so many seconds by the clock.
    pub fn add(&mut self, seconds: f64) {
        self.steps += 1;
        self.passed += seconds;
        self.now += seconds;
        if self.steps.is_multiple_of(TOGETHER) {
            self.least = self.least.min(self.now / TOGETHER as f64);
            self.now = 0.0;
        }
    }

    /// Steps that were made.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Seconds that they would have taken.
    pub fn seconds(&self) -> f64 {
        self.passed.min(self.steps as f64 * self.least)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_work_costs_no_time() {
        let (mut quiet, mut busy) = (Quiet::default(), Quiet::default());
        for step in 0..100 {
            // Every fourth step is dearer than the others.
            let seconds = if step % 4 == 3 { 2.0 } else { 1.0 };
            quiet.add(seconds);
            busy.add(if step < 60 { 3.0 * seconds } else { seconds });
        }
        assert!((quiet.seconds() - 125.0).abs() < 1e-9);
        assert_eq!(busy.seconds(), quiet.seconds());
        assert_eq!(busy.steps(), 100);
        // Before anything was timed together, the clock counts.
        let mut first = Quiet::default();
        first.add(5.0);
        assert_eq!(first.seconds(), 5.0);
    }
}
