//! Undisturbed duration of training steps.

/// Steps timed as a group: methods alternate between several kinds of samples.
const TOGETHER: u64 = 4;

/// Counts every step at the duration of the fastest group, so that other work on the machine costs a method no steps compared
/// with a network that is trained for a number of steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quiet {
    steps: u64,
    /// Seconds by the clock.
    passed: f64,
    /// Seconds of the current group.
    now: f64,
    /// Smallest mean duration of a group.
    least: f64,
}

impl Default for Quiet {
    fn default() -> Self {
        Self { steps: 0, passed: 0.0, now: 0.0, least: f64::INFINITY }
    }
}

impl Quiet {
    /// Adds a step with its seconds by the clock.
    pub fn add(&mut self, seconds: f64) {
        self.steps += 1;
        self.passed += seconds;
        self.now += seconds;
        if self.steps.is_multiple_of(TOGETHER) {
            self.least = self.least.min(self.now / TOGETHER as f64);
            self.now = 0.0;
        }
    }

    /// Number of steps.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Seconds of the steps without other load.
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
            // Every fourth step is slower than the others.
            let seconds = if step % 4 == 3 { 2.0 } else { 1.0 };
            quiet.add(seconds);
            busy.add(if step < 60 { 3.0 * seconds } else { seconds });
        }
        assert!((quiet.seconds() - 125.0).abs() < 1e-9);
        assert_eq!(busy.seconds(), quiet.seconds());
        assert_eq!(busy.steps(), 100);
        // Before the first complete group, the clock counts.
        let mut first = Quiet::default();
        first.add(5.0);
        assert_eq!(first.seconds(), 5.0);
    }
}
