//! Curves of a run, live or from its log, of bounded size for any length of run.

use super::log::{HELD_OUT, STEPS};
use base::error::{Error, Result};
use base::files;
use base::progress::LossPoint;
use std::collections::HashMap;
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::path::Path;

/// Most points of a history: more than a window is wide.
pub const MAX_POINTS: usize = 2048;
/// Number of last steps that give the pace of a run.
const PACE_STEPS: usize = 64;

/// Points of a run in the order of their steps. When there are too many, neighbours are merged
/// in pairs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct History {
    points: Vec<LossPoint>,
    /// Number of merges so far.
    halvings: u32,
    /// Number of original points in the last one.
    last: u32,
    /// Seconds per step over the last steps.
    seconds_per_step: Option<f64>,
}

impl History {
    /// The points, by ascending step.
    pub fn points(&self) -> &[LossPoint] {
        &self.points
    }

    /// Seconds per step over the last steps in the project's log.
    pub fn seconds_per_step(&self) -> Option<f64> {
        self.seconds_per_step
    }

    /// Adds a point. Points of later steps, from before the run went back or started over, are dropped.
    pub fn push(&mut self, point: LossPoint) {
        let each = 1 << self.halvings.min(31);
        while self.points.last().is_some_and(|last| last.step >= point.step) {
            self.points.pop();
            self.last = each;
        }
        match self.points.last_mut() {
            Some(last) if self.last < each => {
                *last = last.joined(point, self.last);
                self.last += 1;
            }
            _ => {
                self.points.push(point);
                self.last = 1;
            }
        }
        if self.points.len() > MAX_POINTS {
            self.points = halved(&self.points, |a, b| a.joined(*b, 1));
            self.halvings += 1;
        }
    }

    /// Reads the logs of the project in `root`. Incomplete lines are skipped: the last one may still be in progress. An
    /// untrained project has no points.
    ///
    /// # Errors
    /// When a log exists and cannot be read.
    pub fn read(root: &Path) -> Result<Self> {
        let mut judged = HashMap::new();
        whole_lines(&root.join(HELD_OUT), |fields| {
            if let [step, _, decibels] = fields
                && let (Ok(step), Ok(decibels)) = (step.parse::<u64>(), decibels.parse::<f32>())
                && decibels.is_finite()
            {
                judged.insert(step, decibels);
            }
        })?;
        let mut history = Self::default();
        let mut pace = std::collections::VecDeque::new();
        whole_lines(&root.join(STEPS), |fields| {
            if let Some(mut point) = point(fields) {
                point.held_out_db = judged.get(&point.step).copied();
                if pace.back().is_some_and(|&(step, _)| point.step.checked_sub(1) != Some(step)) {
                    pace.clear();
                }
                pace.push_back((point.step, point.seconds));
                if pace.len() > PACE_STEPS {
                    pace.pop_front();
                }
                history.push(point);
            }
        })?;
        if let (Some(first), Some(last)) = (pace.front(), pace.back())
            && last.0 > first.0
        {
            history.seconds_per_step = Some((last.1 - first.1) / (last.0 - first.0) as f64);
        }
        Ok(history)
    }
}

/// Merges neighbours in pairs; the last of an odd number stays.
pub fn halved<T: Clone>(points: &[T], join: impl Fn(&T, &T) -> T) -> Vec<T> {
    let pairs = points.chunks(2);
    pairs
        .map(|pair| match pair {
            [a, b] => join(a, b),
            alone => alone[0].clone(),
        })
        .collect()
}

/// A line of the log of steps; None if it is malformed.
fn point(fields: &[&str]) -> Option<LossPoint> {
    let &[step, seconds, reconstruction, rendering, _, _, taken] = fields else { return None };
    taken.parse::<bool>().ok()?;
    // A step without a loss has an empty field; NaN and infinite losses are not drawn.
    let loss = |text: &str| text.parse::<f32>().ok().filter(|loss| loss.is_finite());
    Some(LossPoint {
        step: step.parse().ok()?,
        // Differences of larger values may be infinite.
        seconds: (seconds.parse().ok()).filter(|s: &f64| (0.0..=1e12).contains(s))?,
        reconstruction: loss(reconstruction),
        rendering: loss(rendering),
        held_out_db: None,
    })
}

/// Longest line that is read, in bytes.
const LONGEST_LINE: u64 = 4096;

/// Passes the fields of each complete line to `take`; a missing file has no lines.
fn whole_lines(path: &Path, mut take: impl FnMut(&[&str])) -> Result<()> {
    let fail = |e: std::io::Error| {
        let remedy = "Check that it can be read, or move it away: training writes a new one";
        Error::io("read", path, e, remedy)
    };
    let file = match files::open(path) {
        Err(e) if e.kind() == ErrorKind::NotFound => return Ok(()),
        file => file.map_err(fail)?,
    };
    let mut lines = BufReader::new(file);
    let mut line = Vec::new();
    loop {
        line.clear();
        // A longer line is not from our log, and may have no end.
        let mut one = lines.by_ref().take(LONGEST_LINE);
        one.read_until(b'\n', &mut line).map_err(fail)?;
        if line.pop() != Some(b'\n') {
            return Ok(());
        }
        if let Ok(line) = std::str::from_utf8(&line) {
            let fields: Vec<&str> = line.split(',').collect();
            take(&fields);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::{HELD_OUT_HEADER, STEPS_HEADER};

    fn point(step: u64) -> LossPoint {
        LossPoint {
            step,
            seconds: step as f64 / 8.0,
            reconstruction: Some(1.0 / step as f32),
            rendering: (!step.is_multiple_of(3)).then_some(2.0 / step as f32),
            held_out_db: step.is_multiple_of(100).then_some(step as f32 / 100.0),
        }
    }

    #[test]
    fn a_long_run_keeps_a_bounded_curve_of_even_resolution() {
        let mut history = History::default();
        const STEPS: u64 = 100_000;
        for step in 1..=STEPS {
            history.push(point(step));
            assert!(history.points().len() <= MAX_POINTS);
        }
        let points = history.points();
        assert!(points.len() > MAX_POINTS / 2);
        assert_eq!(points.last().unwrap().step, STEPS);
        let apart: Vec<u64> = points.windows(2).map(|w| w[1].step - w[0].step).collect();
        let even = apart[0];
        assert!(apart[..apart.len() - 1].iter().all(|&gap| gap == even));
        // The mean over neighbours of 1/step lies between its first and its last.
        let bounded = |p: &LossPoint| {
            let (least, most) = (1.0 / p.step as f32, 1.0 / (p.step - even + 1) as f32);
            (0.999 * least..=1.001 * most).contains(&p.reconstruction.unwrap())
        };
        assert!(points[..points.len() - 1].iter().all(bounded));
        let judged = points.iter().filter(|p| p.held_out_db.is_some()).count();
        assert_eq!(judged as u64, STEPS / 100);
    }

    #[test]
    fn a_run_that_goes_back_forgets_what_came_after() {
        let mut history = History::default();
        (1..=50).for_each(|step| history.push(point(step)));
        (21..=30).for_each(|step| history.push(point(step)));
        let steps: Vec<u64> = history.points().iter().map(|p| p.step).collect();
        assert_eq!(steps, (1..=30).collect::<Vec<_>>());
        history.push(point(1));
        assert_eq!(history.points(), [point(1)]);
    }

    #[cfg(unix)]
    #[test]
    fn a_log_without_an_end_is_not_waited_for() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("training.csv");
        std::os::unix::fs::symlink("/dev/zero", &path).unwrap();
        let said = History::read(folder.path()).unwrap_err().to_string();
        assert!(said.contains("training.csv") && said.contains("device"), "{said}");
        std::fs::remove_file(&path).unwrap();
        let step = "1,0.250,0.5,0.25,1e-3,2.5,true";
        let endless = "9".repeat(1 << 20);
        std::fs::write(&path, format!("{STEPS_HEADER}\n{step}\n{endless}\n{step}\n")).unwrap();
        assert_eq!(History::read(folder.path()).unwrap().points().len(), 1);
        test_support::shown!(
            Strangers,
            "`training.csv` is a device, or has a line without an end",
            done: "only files are read, and lines of up to 4096 bytes",
        );
    }

    #[test]
    fn a_log_is_read_as_far_as_it_is_whole() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(History::read(folder.path()).unwrap(), History::default());
        let steps = format!(
            "{STEPS_HEADER}\n1,0.250,0.5,0.25,1e-3,2.5,true\n\n2,0.500,,0.125,1e-3,2.5,true\nrubbish\n\
             3,0.750,NaN,0.0625,1e-3,NaN,false\n4,1.000,0.25,0.031,1e-3,2.5,tr"
        );
        std::fs::write(folder.path().join(STEPS), steps).unwrap();
        let judged = format!("{HELD_OUT_HEADER}\n2,0.500,21.5\n3,0.750,2");
        std::fs::write(folder.path().join(HELD_OUT), judged).unwrap();
        let history = History::read(folder.path()).unwrap();
        let read: Vec<_> =
            (history.points().iter()).map(|p| (p.step, p.reconstruction, p.rendering, p.held_out_db)).collect();
        assert_eq!(
            read,
            [(1, Some(0.5), Some(0.25), None), (2, None, Some(0.125), Some(21.5)), (3, None, Some(0.0625), None)]
        );
        assert_eq!(history.seconds_per_step(), Some(0.25));
    }
}
