//! Motion of the subject while the lamps went round: the estimate against the truth.

use crate::results::Row;
use footage::{Motion, PoseMotion};
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Least distance of the face from its middle, in picture pixels, that counts as motion. Less blurs the sum of the
/// OLATs by less than the pixels do.
pub const MOVES_PX: f64 = 0.3;

/// Columns of a shoot's row, over the poses with a motion estimate. Pixels are those of the pictures.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct MotionColumns {
    pub poses: usize,
    /// Poses that move by more than [`MOVES_PX`], and those among them that were not corrected.
    pub moving: usize,
    pub missed: usize,
    /// Corrected poses of a still subject.
    pub false_alarms: usize,
    /// Poses whose true largest motion is within one and two stated deviations of the estimate.
    pub within_one: usize,
    pub within_two: usize,
    /// Root mean square over poses and lamps of the face's distance from its middle, before and after the correction.
    pub moved_px: f64,
    pub left_px: f64,
}

/// Position of the face per lamp, right and down.
type Way = Vec<[f64; 2]>;

impl MotionColumns {
    /// Columns for the motion estimated in pictures of `size` pixels, against the truth: the face's position per pose
    /// (by the numbers at the end of their names) and lamp (in the order of `lamps`); empty if the subject sat still.
    pub fn new(found: &Motion, truth: &Value, lamps: &[&str], size: usize) -> Self {
        let mut columns = Self::default();
        let (mut moved, mut left) = (0.0, 0.0);
        for pose in &found.poses {
            let number = pose.pose.trim_start_matches(|c: char| !c.is_ascii_digit()).parse().unwrap_or(usize::MAX);
            let is = way(&truth[number], lamps.len());
            let largest = is.iter().map(|[x, y]| x.hypot(*y)).fold(0.0, f64::max);
            let off = (f64::from(pose.largest_px) - largest).abs();
            let stated = f64::from(pose.deviation_px);
            columns.poses += 1;
            columns.within_one += usize::from(off <= stated);
            columns.within_two += usize::from(off <= 2.0 * stated);
            columns.false_alarms += usize::from(largest == 0.0 && pose.corrected);
            columns.moving += usize::from(largest > MOVES_PX);
            columns.missed += usize::from(largest > MOVES_PX && !pose.corrected);
            for (is, found) in is.iter().zip(face(pose, &found.lamps, lamps, size)) {
                moved += is[0].powi(2) + is[1].powi(2);
                left += (is[0] - found[0]).powi(2) + (is[1] - found[1]).powi(2);
            }
        }
        let places = (columns.poses * lamps.len()).max(1) as f64;
        columns.moved_px = (moved / places).sqrt();
        columns.left_px = (left / places).sqrt();
        columns
    }
}

/// A true path, less its mean; zero for a still subject.
fn way(truth: &Value, lamps: usize) -> Way {
    let mut way: Way = (0..lamps).map(|lamp| [0, 1].map(|axis| truth[lamp][axis].as_f64().unwrap_or(0.0))).collect();
    let mean = [0, 1].map(|k: usize| way.iter().map(|p| p[k]).sum::<f64>() / lamps.max(1) as f64);
    for place in &mut way {
        *place = [place[0] - mean[0], place[1] - mean[1]];
    }
    way
}

/// The path that the correction removes from the exemplars.
fn face(pose: &PoseMotion, order: &[String], lamps: &[&str], size: usize) -> Way {
    let at = |lamp: &&str| {
        let place = order.iter().position(|name| name == lamp);
        let shift = place.and_then(|place| pose.shifts.get(place));
        shift.map_or([0.0; 2], |s| [0, 1].map(|axis| size as f64 * f64::from(s[axis] + s[axis + 2])))
    };
    lamps.iter().map(at).collect()
}

/// Section of the page, if motion was estimated.
pub fn section(rows: &[&Row]) -> String {
    let columns = |belongs: fn(&Row) -> bool| -> Vec<&MotionColumns> {
        let rows = rows.iter().copied().filter(|row| belongs(row));
        (rows.map(|row| &row.motion)).filter(|m| m.poses > 0).collect()
    };
    let (swaying, still) = (columns(|row| row.sway > 0.0), columns(|row| row.sway == 0.0));
    if swaying.is_empty() && still.is_empty() {
        return String::new();
    }
    type Count = fn(&MotionColumns) -> usize;
    let sum = |of: &[&MotionColumns], count: Count| of.iter().map(|m| count(m)).sum::<usize>();
    let share = |of: &[&MotionColumns], count: Count| 100.0 * sum(of, count) as f64 / sum(of, |m| m.poses) as f64;
    let mean_square = |of: fn(&MotionColumns) -> f64| {
        let squares = swaying.iter().map(|m| m.poses as f64 * of(m).powi(2));
        (squares.sum::<f64>() / sum(&swaying, |m| m.poses) as f64).sqrt()
    };
    let mut page = format!(
        "\n## The subject's motion

The face swayed in {} of {} poses. A pose moves if its face is ever more than {MOVES_PX} pixels from its middle.

| | aim | found |
|---|---:|---:|
",
        sum(&swaying, |m| m.poses),
        sum(&swaying, |m| m.poses) + sum(&still, |m| m.poses),
    );
    if !still.is_empty() {
        page += &format!(
            "| still poses (of {}) corrected: false alarms | 0 | {} |
| still poses: largest motion within one / two stated deviations | 68 / 95 % or more | {:.0} / {:.0} % |
",
            sum(&still, |m| m.poses),
            sum(&still, |m| m.false_alarms),
            share(&still, |m| m.within_one),
            share(&still, |m| m.within_two),
        );
    }
    if !swaying.is_empty() {
        page += &format!(
            "| swaying poses (of {}): largest motion within one / two stated deviations | 68 / 95 % | {:.0} / {:.0} % |
| moving poses (of {}) not corrected: missed | 0 | {} |
| root mean square of the face's way, before and after | at most half after | {:.2} and {:.2} |
",
            sum(&swaying, |m| m.poses),
            share(&swaying, |m| m.within_one),
            share(&swaying, |m| m.within_two),
            sum(&swaying, |m| m.moving),
            sum(&swaying, |m| m.missed),
            mean_square(|m| m.moved_px),
            mean_square(|m| m.left_px),
        );
    }
    page
}
