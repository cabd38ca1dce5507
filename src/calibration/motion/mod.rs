//! Did the subject move while the lamps went round, and how?
//!
//! `alignment` finds for each pose where the subject is in each OLAT (or tracking frame), relative to what the others
//! predict. `path` takes these places of all poses together, tells motion, which is smooth in time and different in each
//! pose, from what a lamp's own shadows pretend in every pose, and says how sure it is.

mod alignment;
mod cholesky;
mod path;

use alignment::{Alignment, Pictures, Prediction};
use base::error::{Error, Result};
use base::progress::Progress;
use footage::TrackingFrames;
use footage::motion::{Motion, PoseMotion, SeenIn, Shift};
use imaging::resample::resize_area;
use imaging::{Image, Mask, Raster, Response, color::luminance};
use path::{Path, Series};
use project::Project;
use rayon::prelude::*;
use std::path::PathBuf;

/// Side of the pictures in which the subject is aligned: a shift of a twentieth of their pixels is still seen.
const SIDE: usize = 64;
/// Lamps at most whose OLATs are aligned; the path says where the subject is under those between them.
const LAMPS: usize = 32;
/// Motion below this share of the picture's side is left: a fifth of a pixel of 256 costs less than resampling.
const LEAST: f32 = 0.0008;
/// Deviations from which on motion is sure.
const SURE: f32 = 3.0;
/// What remains of a motion, as a share of what is found: alignment by other OLATs, which moved too, finds too little,
/// and a body has more joints than two. Measured on swaying stages.
const REMAINS: f32 = 0.8;

/// The motion in every pose.
///
/// # Errors
/// When a picture cannot be read, or the job was stopped.
pub(super) fn find(project: &Project, response: &Response, progress: &Progress) -> Result<Motion> {
    let shoot = &project.settings.shoot;
    let order = order_lit(project);
    let (paths, seen_in) = paths(project, response, &order, progress)?;
    let side_px = side_px(project)?;
    let poses = shoot.poses.iter().enumerate();
    Ok(Motion {
        seen_in,
        lamps: order.iter().map(|&lamp| shoot.lamp(lamp).clone()).collect(),
        poses: poses
            .filter_map(|(pose, name)| paths.motion(pose, name, side_px))
            .collect(),
    })
}

/// The paths of all poses under the lamps in the order `order`, and what shows them.
fn paths(
    project: &Project,
    response: &Response,
    order: &[usize],
    progress: &Progress,
) -> Result<(Paths, SeenIn)> {
    let (shoot, framing) = (&project.settings.shoot, &project.settings.framing);
    let tracked = (0..shoot.poses.len())
        .map(|pose| TrackingFrames::of(project, pose))
        .collect::<Result<Vec<_>>>()?;
    // Poses are compared with each other, so all are seen in the same way.
    let tracked: Option<Vec<_>> = tracked.into_iter().collect();
    let seen_in = match tracked {
        Some(_) => SeenIn::Tracking,
        None => SeenIn::Olats,
    };
    let lamp_times: Vec<f32> = (0..order.len())
        .map(|place| lamp_time(place, order.len()))
        .collect();
    let (mut times, mut aligned) = (Vec::new(), Vec::new());
    for pose in 0..shoot.poses.len() {
        progress.check("nothing was changed")?;
        progress.step(
            "motion",
            pose as u64 + 1,
            shoot.poses.len() as u64,
            shoot.poses[pose].clone(),
        );
        let matte = footage::read_mask(&project.exemplar_mask_path(pose), framing)?;
        let (files, at, prediction): (Vec<PathBuf>, Vec<f32>, _) = match &tracked {
            Some(tracked) => {
                let frames = &tracked[pose];
                (frames.files.clone(), frames.times.clone(), Prediction::Mean)
            }
            None => {
                let (files, at) = evenly(order.len(), LAMPS)
                    .into_iter()
                    .map(|place| (project.olat_path(pose, order[place]), lamp_times[place]))
                    .unzip();
                (files, at, Prediction::OtherLamps)
            }
        };
        let read = |path: &PathBuf| -> Result<Vec<f32>> {
            let encoded = footage::read_encoded(path, framing)?;
            Ok(small(&response.decode(&encoded)))
        };
        let pictures = files.par_iter().map(read).collect::<Result<Vec<_>>>()?;
        let side = matte.width.min(SIDE);
        let is_odd = |picture: &Vec<f32>| picture.len() != side * side;
        if let Some(odd) = pictures.iter().position(is_odd) {
            return Err(Error::invalid(
                format!(
                    "{} has another size than the matte {}",
                    files[odd].display(),
                    project.exemplar_mask_path(pose).display()
                ),
                "Bring all pictures of the poses to one size",
            ));
        }
        let pictures = Pictures::new(pictures, &resize_area(&matte, side, side));
        aligned.push(pictures.align(prediction));
        times.push(at);
    }
    Ok((Paths::new(&aligned, &times, &lamp_times, seen_in), seen_in))
}

/// Pixels along the side of the exemplars' square.
fn side_px(project: &Project) -> Result<f32> {
    let size = imaging::file::dimensions(&project.exemplar_mask_path(0))?;
    Ok(project.settings.framing.of(size).side as f32)
}

/// The lamps in the order in which they were lit: that of the numbers at the end of their names, or of the names.
fn order_lit(project: &Project) -> Vec<usize> {
    let shoot = &project.settings.shoot;
    let number = |name: &str| -> Option<u64> {
        let digits = name.trim_end_matches(|c: char| c.is_ascii_digit()).len();
        name[digits..].parse().ok()
    };
    let mut order: Vec<usize> = (0..shoot.all_lamps().len()).collect();
    let all_numbered = shoot.all_lamps().all(|name| number(name).is_some());
    order.sort_by_key(|&lamp| {
        let name = shoot.lamp(lamp);
        (number(name).filter(|_| all_numbered), name.clone())
    });
    order
}

/// When a lamp is lit, from 0 (before the first) to 1 (after the last).
fn lamp_time(place: usize, lamps: usize) -> f32 {
    (place as f32 + 0.5) / lamps as f32
}

/// At most `most` of `count` places, evenly spaced.
fn evenly(count: usize, most: usize) -> Vec<usize> {
    let some = count.min(most);
    (0..some)
        .map(|i| (2 * i + 1) * count / (2 * some))
        .collect()
}

/// Luminances of a picture at the size in which it is aligned.
fn small(picture: &Image) -> Vec<f32> {
    let side = picture.width.min(SIDE);
    let grey: Mask = Raster {
        width: picture.width,
        height: picture.height,
        pixels: picture.pixels.iter().map(|p| luminance(*p)).collect(),
    };
    resize_area(&grey, side, side).pixels
}

/// The paths of all poses.
struct Paths {
    /// For each component of a shift the paths of the poses that could be aligned; `None` if too little is known.
    components: [Option<Vec<Path>>; 4],
    /// Per pose its place among those that could be aligned.
    places: Vec<Option<usize>>,
    lamps: usize,
}

impl Paths {
    fn new(
        aligned: &[Option<Alignment>],
        times: &[Vec<f32>],
        lamp_times: &[f32],
        seen_in: SeenIn,
    ) -> Self {
        let components = [0, 1, 2, 3].map(|component| {
            let series: Vec<Series> = (aligned.iter().zip(times))
                .filter_map(|(alignment, times)| Some((alignment.as_ref()?, times)))
                .map(|(alignment, times)| Series {
                    times,
                    values: alignment.shifts.iter().map(|s| s[component]).collect(),
                    variances: alignment.variances.iter().map(|v| v[component]).collect(),
                })
                .collect();
            path::find(&series, lamp_times, seen_in == SeenIn::Olats)
        });
        let mut place = 0..;
        Self {
            components,
            places: (aligned.iter())
                .map(|alignment| alignment.as_ref().and_then(|_| place.next()))
                .collect(),
            lamps: lamp_times.len(),
        }
    }

    /// Where the subject is under a lamp, and the standard deviations of that; `None` if that is not known.
    fn at(&self, pose: usize, lamp: usize) -> Option<(Shift, Shift)> {
        let place = self.places[pose]?;
        let (mut shift, mut off) = ([0.0; 4], [0.0; 4]);
        for (k, paths) in self.components.iter().enumerate() {
            let path = &paths.as_ref()?[place];
            (shift[k], off[k]) = (path.mean[lamp] as f32, path.deviation[lamp] as f32);
        }
        Some((shift, off))
    }

    /// What is stated of a pose.
    fn motion(&self, pose: usize, name: &str, side_px: f32) -> Option<PoseMotion> {
        let all: Vec<(Shift, Shift)> = (0..self.lamps)
            .map(|lamp| self.at(pose, lamp))
            .collect::<Option<_>>()?;
        let (mut largest, mut deviation, mut sure) = (0.0f32, 0.0f32, false);
        for (shift, off) in &all {
            let wide = stated(*shift, *off);
            for part in [body, face] {
                let (way, narrow) = part(shift, off);
                let far = way[0].hypot(way[1]);
                sure |= far > LEAST && far > SURE * along(way, narrow);
                let off = along(way, part(shift, &wide).1);
                if far > largest || (largest == 0.0 && off > deviation) {
                    (largest, deviation) = (far, off);
                }
            }
        }
        Some(PoseMotion {
            pose: name.to_owned(),
            largest_px: largest * side_px,
            deviation_px: deviation * side_px,
            corrected: sure,
            shifts: match sure {
                true => all.iter().map(|(shift, _)| *shift).collect(),
                false => vec![],
            },
        })
    }
}

/// The deviations of a shift with what the alignment leaves of it.
fn stated(shift: Shift, off: Shift) -> Shift {
    [0, 1, 2, 3].map(|k| off[k].hypot(REMAINS * shift[k]))
}

/// A way in the picture and its deviations, to the right and down.
type Way = ([f32; 2], [f32; 2]);

fn body(shift: &Shift, off: &Shift) -> Way {
    ([shift[0], shift[1]], [off[0], off[1]])
}

fn face(shift: &Shift, off: &Shift) -> Way {
    (
        [0, 1].map(|axis| shift[axis] + shift[axis + 2]),
        [0, 1].map(|axis| off[axis].hypot(off[axis + 2])),
    )
}

/// The deviation along a way, or of the place if there is none.
fn along(way: [f32; 2], off: [f32; 2]) -> f32 {
    match way[0].hypot(way[1]) {
        0.0 => off[0].hypot(off[1]),
        far => (way[0] * off[0]).hypot(way[1] * off[1]) / far,
    }
}

#[cfg(test)]
mod tests;
