//! Cost of a training preset, before it has run.

use super::checkpoints;
use super::config::{Preset, TrainingConfig};
use super::schedule::Schedule;
use project::Project;
use reflectance::UNetConfig;

/// This machine's speed in training a network.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pace {
    pub seconds_per_step: f64,
    /// Multiply-adds per prediction of the timed network.
    pub multiply_adds: u64,
}

/// Cost of a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunCost {
    /// Seconds of training. None without a timing, if the run is not limited by time.
    pub seconds: Option<f64>,
    /// Number of steps. None without a timing, if the run is limited by time.
    pub steps: Option<u64>,
    /// True if a network of exactly this cost was timed; otherwise the time is scaled by the multiply-adds.
    pub timed: bool,
}

/// Disk space of a run's checkpoints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DiskCost {
    /// Bytes of one checkpoint, with the state for continuing.
    pub checkpoint: u64,
    /// Most bytes of all kept checkpoints.
    pub most: u64,
}

impl TrainingConfig {
    /// Space of the checkpoints of a run of this many `seconds`; None if unknown. With a `held_out` pose a checkpoint
    /// holds the best network beside the newest.
    pub fn disk(&self, project: &Project, held_out: usize, seconds: Option<f64>) -> DiskCost {
        // The network, the one that trains, and the optimiser's two moments; with a held-out pose the average too.
        let networks = if held_out > 0 { 5 } else { 4 };
        let checkpoint = 4 * networks * self.network(project).cost().parameters;
        let saves = seconds.map(|seconds| (seconds / self.checkpoint_seconds.max(1.0)).ceil() as u64);
        DiskCost { checkpoint, most: checkpoints::most_bytes(saves, checkpoint) }
    }

    /// Network that this configuration trains for a project.
    pub fn network(&self, project: &Project) -> UNetConfig {
        let settings = &project.settings;
        self.network_of(settings.size, settings.shoot.lamps.len())
    }

    /// Network that this configuration trains for pictures of `size` pixels along each side and this many lamps.
    pub fn network_of(&self, size: usize, lamps: usize) -> UNetConfig {
        UNetConfig {
            size,
            lamps,
            depth: self.depth,
            width: self.width,
            most_channels: self.most_channels,
            normalization: self.normalization,
            statistics: self.statistics,
            formulation: self.formulation,
            precision: self.precision,
        }
    }

    /// The same for a network of another shape.
    pub fn with_network(self, network: &UNetConfig) -> Self {
        Self {
            depth: network.depth,
            width: network.width,
            most_channels: network.most_channels,
            normalization: network.normalization,
            statistics: network.statistics,
            formulation: network.formulation,
            precision: network.precision,
            ..self
        }
    }

    /// Cost of a run from the start at this pace, with all of the interview's frames and all but `held_out` poses.
    pub fn cost(&self, project: &Project, held_out: usize, pace: Option<Pace>) -> RunCost {
        let shoot = &project.settings.shoot;
        let poses = shoot.poses.len().saturating_sub(held_out).max(1);
        let seed = project.settings.seed;
        let scheduled = Schedule::new(self, poses, shoot.frames.len(), seed).steps();
        let multiply_adds = self.network(project).cost().multiply_adds;
        let limit = self.minutes.map(|minutes| 60.0 * minutes);
        let Some(pace) = pace else {
            return RunCost { seconds: limit, steps: limit.is_none().then_some(scheduled), timed: false };
        };
        let ratio = multiply_adds as f64 / pace.multiply_adds.max(1) as f64;
        let step = (pace.seconds_per_step * ratio).max(1e-9);
        let seconds = limit.unwrap_or(f64::INFINITY).min(scheduled as f64 * step);
        RunCost {
            seconds: Some(seconds),
            steps: Some(((seconds / step).round() as u64).min(scheduled)),
            timed: multiply_adds == pace.multiply_adds,
        }
    }
}

impl Preset {
    /// Name of the preset.
    pub fn name(self) -> &'static str {
        match self {
            Self::Quick => "quick",
            Self::Paper => "paper",
            Self::FastGpu => "fast-gpu",
        }
    }

    /// Display name of the preset.
    pub fn label(self) -> &'static str {
        match self {
            Self::Quick => "Quick",
            Self::Paper => "Paper",
            Self::FastGpu => "Fast GPU",
        }
    }

    /// Purpose of the preset.
    pub fn purpose(self) -> &'static str {
        match self {
            Self::Quick => "Best picture in ten minutes on two cores",
            Self::Paper => "As in the paper; takes hours without a GPU",
            Self::FastGpu => "A wider network; slower on a CPU",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use project::Project;
    use std::path::Path;

    fn project() -> Project {
        let names = |count: usize| (0..count).map(|i| i.to_string()).collect::<Vec<_>>();
        let mut project = Project::without_shoot(Path::new("film"));
        project.settings.size = 64;
        let shoot = &mut project.settings.shoot;
        (shoot.poses, shoot.lamps, shoot.frames) = (names(6), names(12), names(100).into());
        project
    }

    #[test]
    fn a_run_takes_its_steps_at_the_pace_or_its_minutes() {
        let (project, paper) = (project(), Preset::Paper.config());
        let network = paper.network(&project);
        let pace = Pace { seconds_per_step: 0.5, multiply_adds: network.cost().multiply_adds };
        let unknown = paper.cost(&project, 0, None);
        assert_eq!((unknown.seconds, unknown.steps), (None, Some(10_000)));
        let known = paper.cost(&project, 1, Some(pace));
        assert_eq!((known.seconds, known.steps), (Some(4500.0), Some(9000)));
        assert!(known.timed);

        let quick = Preset::Quick.config().with_network(&network);
        let unknown = quick.cost(&project, 0, None);
        assert_eq!((unknown.seconds, unknown.steps), (Some(600.0), None));
        let known = quick.cost(&project, 0, Some(pace));
        assert_eq!((known.seconds, known.steps), (Some(600.0), Some(1200)));
    }

    #[test]
    fn checkpoints_take_what_is_kept_of_them_and_at_most_4_gb() {
        let (project, quick) = (project(), Preset::Quick.config());
        let one = 16 * quick.network(&project).cost().parameters;
        // 20 saves in ten minutes, of which at most ten are kept.
        let disk = quick.disk(&project, 0, Some(600.0));
        assert_eq!((disk.checkpoint, disk.most), (one, 10 * one));
        assert_eq!(quick.disk(&project, 1, Some(10.0)).most, 5 * one / 4);
        let unknown = Preset::Paper.config().disk(&project, 0, None);
        assert_eq!(unknown.most, 4 << 30);
    }

    #[test]
    fn a_network_of_fewer_multiplications_takes_less_time() {
        let project = project();
        let [quick, paper] = [Preset::Quick, Preset::Paper].map(Preset::config);
        let [small, large] = [&quick, &paper].map(|c| c.network(&project).cost().multiply_adds);
        let pace = Pace { seconds_per_step: 1.0, multiply_adds: large };
        let cost = quick.cost(&project, 0, Some(pace));
        assert!(!cost.timed && small < large);
        let expected = 600.0 * large as f64 / small as f64;
        assert!((cost.steps.unwrap() as f64 - expected).abs() < 1.0);
    }
}
