//! Motion of the subject during the lamp cycle.
//!
//! For each pose `alignment` measures the subject's position in each OLAT (or tracking frame), relative to a
//! prediction from the others. `likelihood` and `path` take these positions of all poses together. They separate
//! motion, which is smooth in time and different in each pose, from false shifts by lamps' shadows, and give the
//! certainty of the result.

mod alignment;
mod helmert;
mod likelihood;
mod path;
mod pixels;

use super::settings::CalibrateSettings;
use alignment::{Alignment, Pictures, Prediction};
use base::error::{Error, Result};
use base::progress::Progress;
use footage::TrackingFrames;
use footage::motion::{Motion, PoseMotion, SeenIn, Shift};
use glam::Vec3;
use imaging::resample::resize_area;
use imaging::{Image, Mask, Raster, Response, color::luminance};
use light::{Lamp, Rig};
use likelihood::{Place, Series};
use path::Path;
use project::{Picture, Project};
use rayon::prelude::*;

/// Side of the alignment pictures. A shift of a twentieth of their pixels is still visible.
const SIDE: usize = 64;
/// Largest number of lamps with aligned OLATs; the path gives the subject's position under those between them.
const LAMPS: usize = 32;
/// Smallest corrected motion, relative to the picture's side. A fifth of a pixel of 256 costs less than resampling.
const LEAST: f64 = 0.0008;
/// Smallest motion of a corrected pose in a moving shoot, in deviations of its path from the middle.
const SEEN: f64 = 1.5;

/// Share of the measured motion that the alignment may have missed, because rotated heads differ from the matte's
/// shape, and the predicting pictures moved too. Measured on swaying stages.
const MISSED: f64 = 0.25;

/// Motion of the subject between the lamps of `rig`, unless the settings skip it.
///
/// # Errors
/// As [`find`].
pub(super) fn measure(
    project: &Project,
    settings: &CalibrateSettings,
    response: &Response,
    rig: &Rig,
    progress: &Progress,
) -> Result<Option<Motion>> {
    if settings.keep_motion {
        return Ok(None);
    }
    let direction = |lamp: &Lamp| lamp.is_usable().then_some(lamp.direction);
    let directions: Vec<_> = rig.lamps.iter().map(direction).collect();
    let motion = find(project, response, &directions, progress)?;
    if let Some(sentence) = motion.sentence() {
        progress.say(sentence);
    }
    Ok(Some(motion))
}

/// Measures the motion in every pose. `directions` holds each lamp's direction, `None` if unknown.
///
/// # Errors
/// When a picture cannot be read, or the job was stopped.
fn find(project: &Project, response: &Response, directions: &[Option<Vec3>], progress: &Progress) -> Result<Motion> {
    let shoot = &project.settings.shoot;
    let order = order_lit(project);
    let (paths, seen_in) = paths(project, response, &order, directions, progress)?;
    let side_px = side_px(project)?;
    let poses = shoot.poses.iter().enumerate();
    Ok(Motion {
        seen_in,
        lamps: order.iter().map(|&lamp| shoot.lamp(lamp).clone()).collect(),
        poses: poses.filter_map(|(pose, name)| paths.motion(pose, name, side_px)).collect(),
    })
}

/// Paths of all poses under the lamps in the order `order`, and the pictures used.
fn paths(
    project: &Project,
    response: &Response,
    order: &[usize],
    directions: &[Option<Vec3>],
    progress: &Progress,
) -> Result<(Paths, SeenIn)> {
    let (shoot, framing) = (&project.settings.shoot, &project.settings.framing);
    let tracked = (0..shoot.poses.len()).map(|pose| TrackingFrames::new(project, pose)).collect::<Result<Vec<_>>>()?;
    // Poses are compared with each other, so all use the same kind of picture.
    let tracked: Option<Vec<_>> = tracked.into_iter().collect();
    let seen_in = match tracked {
        Some(_) => SeenIn::Tracking,
        None => SeenIn::Olats,
    };
    let lamp_times: Vec<f32> = (0..order.len()).map(|place| lamp_time(place, order.len())).collect();
    // Lamps that every pose has.
    let has_all = |&place: &usize| (0..shoot.poses.len()).all(|p| project.has_olat(p, order[place]));
    let common: Vec<usize> = (0..order.len()).filter(has_all).collect();
    let chosen: Vec<usize> = evenly(common.len(), LAMPS).into_iter().map(|i| common[i]).collect();
    let (mut times, mut aligned) = (Vec::new(), Vec::new());
    for pose in 0..shoot.poses.len() {
        progress.check("nothing was changed")?;
        progress.step("motion", pose as u64 + 1, shoot.poses.len() as u64, shoot.poses[pose].clone());
        let matte = footage::read_mask(&project.exemplar_matte(pose), framing)?;
        let (files, at, prediction): (Vec<Picture>, Vec<f32>, _) = match &tracked {
            Some(tracked) => {
                let frames = &tracked[pose];
                (frames.pictures.clone(), frames.times.clone(), Prediction::Mean)
            }
            None => {
                let (files, at) =
                    (chosen.iter()).map(|&place| (project.olat_picture(pose, order[place]), lamp_times[place])).unzip();
                (files, at, Prediction::OtherLamps)
            }
        };
        let read = |picture: &Picture| -> Result<Vec<f32>> {
            Ok(small(&footage::read_framed_light(picture, framing, response)?))
        };
        let pictures = files.par_iter().map(read).collect::<Result<Vec<_>>>()?;
        let side = matte.width.min(SIDE);
        let is_odd = |picture: &Vec<f32>| picture.len() != side * side;
        if let Some(odd) = pictures.iter().position(is_odd) {
            return Err(Error::invalid(
                format!(
                    "{} differs in size from the matte {}",
                    files[odd].display(),
                    project.exemplar_matte(pose).display()
                ),
                "Bring all pictures of the poses to one size",
            ));
        }
        let pictures = Pictures::new(pictures, &resize_area(&matte, side, side));
        aligned.push(pictures.align(prediction));
        times.push(at);
    }
    let lamps: Vec<Option<Vec3>> =
        (chosen.iter()).map(|&place| directions.get(order[place]).copied().flatten()).collect();
    let lamps = (seen_in == SeenIn::Olats).then_some(&lamps[..]);
    Ok((Paths::new(&aligned, &times, &lamp_times, lamps), seen_in))
}

/// Pixels along the side of the exemplars' square.
fn side_px(project: &Project) -> Result<f32> {
    let size = footage::dimensions(&project.first_olat(0))?;
    Ok(project.settings.framing.for_size(size).side as f32)
}

/// Lamps in the order of lighting: by the numbers at the end of their names, or by the names.
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

/// Time of a lamp, from 0 (before the first) to 1 (after the last).
fn lamp_time(place: usize, lamps: usize) -> f32 {
    (place as f32 + 0.5) / lamps as f32
}

/// At most `most` of `count` indices, evenly spaced.
fn evenly(count: usize, most: usize) -> Vec<usize> {
    let some = count.min(most);
    (0..some).map(|i| (2 * i + 1) * count / (2 * some)).collect()
}

/// Luminances of a picture at the alignment size.
fn small(picture: &Image) -> Vec<f32> {
    let side = picture.width.min(SIDE);
    let grey: Mask = Raster {
        width: picture.width,
        height: picture.height,
        pixels: picture.pixels.iter().map(|p| luminance(*p)).collect(),
    };
    resize_area(&grey, side, side).pixels
}

/// Paths of all poses.
struct Paths {
    /// Paths of the aligned poses; `None` if too little is known.
    paths: Option<Vec<Path>>,
    /// Index of each pose among these.
    places: Vec<Option<usize>>,
}

impl Paths {
    fn new(
        aligned: &[Option<Alignment>],
        times: &[Vec<f32>],
        lamp_times: &[f32],
        lamps: Option<&[Option<Vec3>]>,
    ) -> Self {
        let series: Vec<Series> = (aligned.iter().zip(times))
            .filter_map(|(alignment, times)| Some((alignment.as_ref()?, times)))
            .map(|(alignment, times)| Series { times, shifts: &alignment.shifts, noise: &alignment.noise })
            .collect();
        let mut place = 0..;
        Self {
            paths: path::find(&series, lamp_times, lamps),
            places: (aligned.iter()).map(|alignment| alignment.as_ref().and_then(|_| place.next())).collect(),
        }
    }

    /// Position of the subject in a pose under each lamp; `None` if unknown.
    fn path(&self, pose: usize) -> Option<&Path> {
        self.paths.as_ref()?.get(self.places[pose]?)
    }

    /// Summary of a pose's motion. The true distance of the farthest place exceeds the measured one on average by
    /// √2 of the error's deviation, as measured on swaying stages.
    fn motion(&self, pose: usize, name: &str, side_px: f32) -> Option<PoseMotion> {
        let path = self.path(pose)?;
        let (mut largest, mut deviation, mut seen) = (0.0f64, 0.0f64, false);
        for (way, variance) in path.iter().flat_map(|p| p.way.iter().zip(&p.variance)) {
            let far = way[0].hypot(way[1]);
            let along = (way[0] * way[0] * variance[0] + way[1] * way[1] * variance[1]).sqrt();
            seen |= far > LEAST && far * far > SEEN * along;
            let whole = variance[0] + variance[1] + (MISSED * far).powi(2);
            let reach = (far * far + 2.0 * whole).sqrt();
            if reach > largest {
                (largest, deviation) = (reach, whole.sqrt());
            }
        }
        if path.iter().all(|place| place.way == [[0.0; 2]; 2]) {
            (largest, deviation) = (0.0, largest);
        }
        let px = |share: f64| share as f32 * side_px;
        Some(PoseMotion {
            pose: name.to_owned(),
            largest_px: px(largest),
            deviation_px: px(deviation),
            corrected: seen,
            shifts: if seen { path.iter().map(shift).collect() } else { vec![] },
        })
    }
}

/// Shift removed from the exemplars.
fn shift(place: &Place) -> Shift {
    let [body, face] = place.way;
    [body[0], body[1], face[0] - body[0], face[1] - body[1]].map(|v| v as f32)
}

#[cfg(test)]
mod tests;
