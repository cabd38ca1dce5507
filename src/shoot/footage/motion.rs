//! Motion of the subject during the lamp cycle, and its correction in OLATs.
//!
//! A motion is a shift of the full subject plus a rotation of the head, which shifts the face further and leaves
//! the head's outline nearly in place.

use base::error::{Error, Result};
use imaging::{Image, Mask, Raster};
use project::Project;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// Position of the subject: the body's shift to the right and down, and the additional shift of the face's middle,
/// relative to the picture's side.
pub type Shift = [f32; 4];

/// Motion of the subject measured by the calibration, stored in `calibration.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Motion {
    /// Frames used for the measurement.
    pub seen_in: SeenIn,
    /// Names of the lamps in the order of lighting.
    pub lamps: Vec<String>,
    /// Motion of each pose with enough information.
    pub poses: Vec<PoseMotion>,
}

/// Frames used to measure motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum SeenIn {
    /// The OLATs themselves.
    Olats,
    /// Fully lit frames between the OLATs.
    Tracking,
}

/// The motion in one pose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseMotion {
    /// Name of the pose.
    pub pose: String,
    /// Largest distance of body or face from their middle, in pixels of the OLATs. Significant from about three
    /// deviations.
    pub largest_px: f32,
    /// Standard deviation of `largest_px`.
    pub deviation_px: f32,
    /// True if exemplars are corrected on loading.
    pub corrected: bool,
    /// Position of the subject for each lamp; empty without correction.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub shifts: Vec<Shift>,
}

impl Motion {
    /// Summary of the correction; `None` without one.
    pub fn sentence(&self) -> Option<String> {
        let poses: Vec<String> = (self.poses.iter().filter(|pose| pose.corrected))
            .map(|p| format!("{} {:.1} ± {:.1}", p.pose, p.largest_px, p.deviation_px.max(0.05)))
            .collect();
        let seen_in = match self.seen_in {
            SeenIn::Olats => "the OLATs",
            SeenIn::Tracking => "the tracking frames",
        };
        (!poses.is_empty()).then(|| {
            format!(
                "The subject moved during the lamp cycle (seen in {seen_in}). Corrected, in pixels at most: {}",
                poses.join(", ")
            )
        })
    }
}

/// Correction of one pose.
pub(super) struct Correction {
    head: Mask,
    /// Position of the subject per lamp.
    shifts: HashMap<String, Shift>,
}

/// The part of `calibration.toml` used by exemplars.
#[derive(Deserialize)]
struct Kept {
    #[serde(default)]
    motion: Option<Motion>,
}

impl Correction {
    /// Correction of a pose from the project's calibration; `None` without one.
    ///
    /// # Errors
    /// When the calibration or the pose's matte cannot be read.
    pub fn new(project: &Project, pose: usize) -> Result<Option<Self>> {
        const REMEDY: (&str, &str) = ("Calibrate the project again", "afterlight calibrate PROJECT");
        let path = project.calibration_path();
        if !path.exists() {
            return Ok(None);
        }
        let text = project::read_sealed(&path, REMEDY)?;
        let kept: Kept = toml::from_str(&text).map_err(|e| Error::codec("read", &path, e.message(), REMEDY))?;
        let name = &project.settings.shoot.poses[pose];
        let found = kept.motion.and_then(|motion| {
            let is_corrected = |p: &PoseMotion| p.pose == *name && p.corrected;
            let shifts = motion.poses.into_iter().find(is_corrected)?.shifts;
            Some((motion.lamps, shifts))
        });
        let Some((lamps, shifts)) = found else { return Ok(None) };
        let is_sound = |shift: &Shift| shift.iter().all(|v| v.abs() < 1.0);
        if shifts.len() != lamps.len() || !shifts.iter().all(is_sound) {
            return Err(Error::invalid(
                format!(
                    "{} has {} shifts of {name} for {} lamps, or one outside the picture",
                    path.display(),
                    shifts.len(),
                    lamps.len()
                ),
                REMEDY,
            ));
        }
        let matte = project.exemplar_matte(pose);
        let matte = super::read_mask(&matte, &project.settings.framing)?;
        Ok(Some(Self { head: head_turn(&matte), shifts: lamps.into_iter().zip(shifts).collect() }))
    }

    /// OLAT of lamp `lamp` with the subject in its middle place.
    pub fn still(&self, olat: &Image, lamp: &str) -> Image {
        match self.shifts.get(lamp) {
            Some(&shift) => unmoved(olat, &self.head, shift),
            None => olat.clone(),
        }
    }
}

/// Head weight of each place, 0 to 1, from the matte only. It fades out at the neck. Without a neck above
/// shoulders, the full subject counts as head.
pub fn head_share(matte: &Mask) -> Mask {
    let Outline { head, .. } = Outline::from_matte(matte);
    Raster::from_fn(matte.width, matte.height, |_, y| head[y])
}

/// Weight of the face's shift at each place when the head rotates, 0 to 1, from the matte only: depth as if each
/// row of the head were the front of an ellipse, times [`head_share`].
pub fn head_turn(matte: &Mask) -> Mask {
    let Outline { rows, head, widest } = Outline::from_matte(matte);
    Raster::from_fn(matte.width, matte.height, |x, y| {
        let Some([left, right]) = rows[y] else { return 0.0 };
        let half = 0.5 * (right - left);
        let across = (x as f32 + 0.5 - 0.5 * (left + right)) / half.max(0.5);
        let depth = (1.0 - across * across).max(0.0).sqrt() * (half / widest).min(1.0);
        depth * head[y]
    })
}

/// Rows of a matte.
struct Outline {
    /// Extent of each covered row.
    rows: Vec<Option<[f32; 2]>>,
    /// Head weight of each row.
    head: Vec<f32>,
    /// Largest half width of the head.
    widest: f32,
}

impl Outline {
    fn from_matte(matte: &Mask) -> Self {
        let rows: Vec<_> = (0..matte.height).map(|y| extent(matte, y)).collect();
        let half = |row: &Option<[f32; 2]>| row.map_or(0.0, |[left, right]| 0.5 * (right - left));
        let (neck, widest) = neck(&rows.iter().map(half).collect::<Vec<_>>());
        // The fade spans a fifth of a head's height, which is about half of its width.
        let fade = (0.5 * widest).max(1.0);
        let above = |y: usize| ((neck as f32 - y as f32) / fade + 0.5).clamp(0.0, 1.0);
        Self { head: (0..matte.height).map(above).collect(), rows, widest }
    }
}

/// Covered extent of a row of the matte.
fn extent(matte: &Mask, y: usize) -> Option<[f32; 2]> {
    let covered = |x: &usize| matte.at(*x, y) > 0.5;
    let left = (0..matte.width).find(covered)?;
    let right = (0..matte.width).rev().find(covered)?;
    Some([left as f32, right as f32 + 1.0])
}

/// Row of the neck and largest half width of the head, from the half width of every row. The neck is the narrowest
/// row between the head and the first row wider than the head, or the picture's end without such a row.
fn neck(half: &[f32]) -> (usize, f32) {
    let (mut widest, mut best) = (1.0f32, None);
    // The narrowest row since the widest part of the head.
    let (mut row, mut narrowest) = (0, f32::MAX);
    for (y, &h) in half.iter().enumerate() {
        if h < narrowest && widest > 1.0 {
            (row, narrowest) = (y, h);
        }
        if h > widest {
            // After a narrowing this is the shoulder.
            if narrowest < 0.85 * widest {
                best = Some(row);
                break;
            }
            (widest, narrowest) = (h, f32::MAX);
        }
    }
    (best.unwrap_or(2 * half.len()), widest)
}

/// The picture with `shift` undone: each pixel is read at its surface's shifted place (Catmull–Rom cubic, clamped
/// to non-negative light).
pub fn unmoved(picture: &Image, head: &Mask, shift: Shift) -> Image {
    let (width, height) = picture.size();
    let side = width.max(height) as f32;
    let place = |i: i64, length: usize| i.clamp(0, length as i64 - 1) as usize;
    Raster::from_fn(width, height, |x, y| {
        let turn = head.at(x, y);
        let [dx, dy] = [0, 1].map(|axis| side * (shift[axis] + turn * shift[axis + 2]));
        let (at_x, at_y) = (x as f32 + dx, y as f32 + dy);
        let (left, top) = (at_x.floor(), at_y.floor());
        let (across, down) = (cubic(at_x - left), cubic(at_y - top));
        let mut sum = [0.0f32; 3];
        for (j, wy) in down.into_iter().enumerate() {
            let row = place(top as i64 + j as i64 - 1, height);
            for (i, wx) in across.into_iter().enumerate() {
                let pixel = picture.at(place(left as i64 + i as i64 - 1, width), row);
                for c in 0..3 {
                    sum[c] += wx * wy * pixel[c];
                }
            }
        }
        sum.map(|v| v.max(0.0))
    })
}

/// Weights of four neighbours for a place `t` between the middle two (Catmull and Rom 1974).
fn cubic(t: f32) -> [f32; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [0.5 * (-t3 + 2.0 * t2 - t), 0.5 * (3.0 * t3 - 5.0 * t2 + 2.0), 0.5 * (-3.0 * t3 + 4.0 * t2 + t), 0.5 * (t3 - t2)]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A head 12 pixels in half width, above a narrower neck and shoulders.
    fn bust() -> Mask {
        Raster::from_fn(64, 64, |x, y| {
            let off = (x as f32 - 31.5).abs();
            let half = match y {
                8..=31 => (144.0 - (y as f32 - 20.0).powi(2)).max(0.0).sqrt(),
                32..=39 => 6.0,
                40.. => 24.0,
                _ => 0.0,
            };
            f32::from(off < half)
        })
    }

    #[test]
    fn a_head_ends_at_the_neck_and_without_one_all_is_head() {
        let share = head_share(&bust());
        for (y, expected) in [(0, 1.0), (20, 1.0), (50, 0.0), (63, 0.0)] {
            assert_eq!(share.at(31, y), expected, "row {y}");
        }
        assert!((29..34).any(|y| (0.2..0.8).contains(&share.at(31, y))), "the neck");
        assert!((1..64).all(|y| share.at(31, y) <= share.at(31, y - 1)));
        let ball = Raster::from_fn(64, 64, |x, y| f32::from((x as f32 - 31.5).hypot(y as f32 - 31.5) < 20.0));
        for whole in [ball, Raster::filled(64, 64, 0.0), Raster::filled(0, 0, 0.0)] {
            assert!(head_share(&whole).pixels.iter().all(|&share| share == 1.0));
        }
    }

    #[test]
    fn a_turn_of_the_head_moves_the_face_and_not_outline_or_shoulders() {
        let turn = head_turn(&bust());
        assert!(turn.at(31, 20) > 0.95, "the face's middle");
        assert!(turn.at(21, 20) < 0.65 * turn.at(31, 20), "beside the outline");
        assert!((40..64).all(|y| (0..64).all(|x| turn.at(x, y) < 0.1)), "the shoulders");
        let ball = Raster::from_fn(64, 64, |x, y| f32::from((x as f32 - 31.5).hypot(y as f32 - 31.5) < 20.0));
        assert!(head_turn(&ball).at(31, 45) > 0.5, "without shoulders everything is head");
        assert!(head_turn(&Raster::filled(8, 8, 0.0)).pixels.iter().all(|v| *v == 0.0));
    }

    #[test]
    fn a_moved_picture_comes_back() {
        let wave = |x: f32, y: f32| [0.5 + 0.3 * (0.3 * x).sin() + 0.2 * (0.25 * y).cos(); 3];
        let head = Raster::filled(64, 64, 0.5);
        let shift = [0.02, -0.01, 0.01, 0.03];
        // Half of the head's shift is added to the body's.
        let (dx, dy) = (64.0 * 0.025, 64.0 * 0.005);
        let moved = Raster::from_fn(64, 64, |x, y| wave(x as f32 - dx, y as f32 - dy));
        let back = unmoved(&moved, &head, shift);
        for y in 8..56 {
            for x in 8..56 {
                let off = back.at(x, y)[1] - wave(x as f32, y as f32)[1];
                assert!(off.abs() < 2e-3, "{x}, {y}: {off}");
            }
        }
        assert_eq!(unmoved(&moved, &head, [0.0; 4]), moved);
    }
}
