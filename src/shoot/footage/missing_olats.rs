//! Stand-ins for OLATs that a pose lacks.
//!
//! In the poses that have the lamp its OLAT is fitted by the others, by least squares with no negative weight; the pose's own
//! others with these weights stand in. On four people of Extended Yale B (each of 41 OLATs left out of two poses, code values of
//! gamma 2.2) 24 dB, where the nearest lamp's OLAT has 19 dB.

use super::framed::{read_framed_light, read_mask};
use base::error::{Error, Result};
use imaging::resample::resize_area;
use imaging::{Image, Mask, Response};
use light::weights::least_squares::Normal;
use project::Project;
use rayon::prelude::*;
use std::collections::{BTreeMap, BTreeSet};

/// Side of the fitted pictures.
const SIDE: usize = 32;
/// Least coverage of a fitted pixel.
const SOLID: f32 = 0.99;

/// An OLAT that a pose lacks, as a sum of its others.
#[derive(Clone, Debug, PartialEq)]
pub struct MissingOlat {
    /// The lamp, counted over all lamps.
    pub lamp: usize,
    /// Other lamps and their weights per channel.
    pub weights: Vec<(usize, [f32; 3])>,
}

/// Sentences on the lamps that poses lack.
pub(super) fn lacks(missing: &BTreeMap<String, BTreeSet<String>>) -> impl Iterator<Item = String> {
    missing.iter().map(|(pose, lamps)| {
        let lamps: Vec<&str> = lamps.iter().map(String::as_str).collect();
        format!("{pose} lacks {}: its other lamps stand in", lamps.join(", "))
    })
}

/// The stand-ins of a pose.
///
/// # Errors
/// When a picture cannot be read, or no pose has the lamp.
pub fn find(project: &Project, response: &Response, pose: usize) -> Result<Vec<MissingOlat>> {
    let all = 0..project.settings.shoot.all_lamps().len();
    let lacking = all.filter(|&lamp| !project.has_olat(pose, lamp));
    lacking.map(|lamp| fit(project, response, pose, lamp)).collect()
}

/// Fills in the OLATs that a pose lacks, of all lamps of the shoot.
///
/// # Errors
/// When a picture cannot be read, or no pose has a missing lamp.
pub fn fill_missing(project: &Project, response: &Response, pose: usize, olats: &mut [Image]) -> Result<()> {
    for missing in find(project, response, pose)? {
        let mut sum = Image::filled(olats[0].width, olats[0].height, [0.0; 3]);
        for &(other, weight) in &missing.weights {
            add(&mut sum, &olats[other], weight);
        }
        olats[missing.lamp] = sum;
    }
    Ok(())
}

/// `sum` += `weight` · `olat`.
pub(super) fn add(sum: &mut Image, olat: &Image, weight: [f32; 3]) {
    for (out, pixel) in sum.pixels.iter_mut().zip(&olat.pixels) {
        for c in 0..3 {
            out[c] += weight[c] * pixel[c];
        }
    }
}

fn fit(project: &Project, response: &Response, pose: usize, lamp: usize) -> Result<MissingOlat> {
    let shoot = &project.settings.shoot;
    let teachers: Vec<usize> = (0..shoot.poses.len()).filter(|&other| project.has_olat(other, lamp)).collect();
    let mut used = project.pose_lamps(pose);
    used.retain(|&other| teachers.iter().all(|&teacher| project.has_olat(teacher, other)));
    if teachers.is_empty() || used.is_empty() {
        let (pose, lamp) = (&shoot.poses[pose], shoot.lamp(lamp));
        return Err(Error::missing(
            format!("no pose shows which other lamps can stand in for {lamp} in {pose}"),
            "Leave the lamp out of all poses",
        ));
    }
    let framings = &project.settings.framing;
    let small = |teacher: usize, lamp: usize| -> Result<Image> {
        let light = read_framed_light(&project.olat_picture(teacher, lamp), framings, response)?;
        Ok(resize_area(&light, SIDE, SIDE))
    };
    let mut problems = [0, 1, 2].map(|_| Normal::new(used.len()));
    for teacher in teachers {
        let target = small(teacher, lamp)?;
        let others = used.par_iter().map(|&other| small(teacher, other)).collect::<Result<Vec<_>>>()?;
        let mask: Mask = resize_area(&read_mask(&project.exemplar_matte(teacher), framings)?, SIDE, SIDE);
        for at in (0..SIDE * SIDE).filter(|&at| mask.pixels[at] > SOLID) {
            for (c, problem) in problems.iter_mut().enumerate() {
                let row: Vec<f64> = others.iter().map(|o| f64::from(o.pixels[at][c])).collect();
                problem.add(&row, f64::from(target.pixels[at][c]), 1.0);
            }
        }
    }
    let weights = problems.map(|mut problem| {
        let mut weights = vec![0.0; used.len()];
        problem.least(&mut weights);
        weights
    });
    let weight = |i: usize| [0, 1, 2].map(|c| weights[c][i] as f32);
    let weights = used.iter().enumerate().map(|(i, &other)| (other, weight(i)));
    Ok(MissingOlat { lamp, weights: weights.filter(|(_, weight)| *weight != [0.0; 3]).collect() })
}
