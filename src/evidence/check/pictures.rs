//! Small pictures of the poses and mattes of some frames, so that all fit into memory.

use super::subject_shading::Shading;
use base::error::Result;
use base::progress::Progress;
use calibration::Calibration;
use footage::{OlatReader, dimensions};
use imaging::resample::resize_area;
use imaging::{Image, Mask};
use project::{Framing, Project};
use rayon::prelude::*;

/// Side of the small pictures: a motion of a thirtieth of the picture is one pixel.
const SIDE: usize = 32;
/// Number of checked frames, spread evenly over the interview.
const FRAMES: usize = 48;

/// Small poses and frames.
pub(super) struct Pictures {
    pub poses: Vec<Pose>,
    pub frames: Vec<Filmed>,
    /// Area that both frames and poses show: a plate may end within the square.
    pub shown: Mask,
}

/// A pose under every lamp that the network learns.
pub(super) struct Pose {
    pub olats: Vec<Image>,
    /// The brightest value of each channel under each pixel of [`Self::olats`].
    pub peaks: Vec<Image>,
    pub mask: Mask,
    /// Name of the matte in sentences.
    pub matte: String,
    pub name: String,
    /// Shading under every lamp of the shoot.
    pub shading: Shading,
}

/// A frame of the interview.
pub(super) struct Filmed {
    pub mask: Mask,
    /// Name of the matte in sentences.
    pub matte: String,
}

impl Pictures {
    /// Reads all poses and some frames of a calibrated project.
    ///
    /// # Errors
    /// When a picture is missing or cannot be read, or the job was stopped.
    pub fn read(project: &Project, calibration: &Calibration, progress: &Progress) -> Result<Self> {
        project.check_shoot()?;
        project.check_parts()?;
        let shoot = &project.settings.shoot;
        let poses = shoot.poses.len();
        let chosen = evenly(shoot.frames.len(), FRAMES);
        let total = (poses + chosen.len()) as u64;
        let side = SIDE.min(project.settings.size);
        let framings = &project.settings.framing;
        let [filmed, lit] = [project.frame_picture(0), project.first_olat(0)]
            .map(|picture| Ok(within(&framings.for_size(dimensions(&picture)?), side)));
        let (mut shown, lit): (Mask, Mask) = (filmed?, lit?);
        for (share, other) in shown.pixels.iter_mut().zip(lit.pixels) {
            *share = share.min(other);
        }
        let mut read = Self { shown, poses: Vec::new(), frames: Vec::new() };
        for (pose, name) in shoot.poses.iter().enumerate() {
            progress.check("nothing was changed")?;
            progress.step("looking at the pictures", pose as u64, total, name);
            read.poses.push(Pose::read(project, calibration, pose)?);
        }
        for (i, frame) in chosen.into_iter().enumerate() {
            progress.check("nothing was changed")?;
            let name = shoot.frames.name(frame);
            progress.step("looking at the pictures", (poses + i) as u64, total, &*name);
            let matte = project.frame_matte(frame);
            let mask = footage::read_mask(&matte, framings)?;
            read.frames.push(Filmed { mask: resize_area(&mask, side, side), matte: matte.display().to_string() });
        }
        progress.step("looking at the pictures", total, total, "");
        Ok(read)
    }
}

impl Pose {
    fn read(project: &Project, calibration: &Calibration, pose: usize) -> Result<Self> {
        let settings = &project.settings;
        let side = SIDE.min(settings.size);
        let reader = OlatReader::new(project, &calibration.response, pose)?;
        let pictures = (0..settings.shoot.all_lamps().len())
            .into_par_iter()
            .map(|lamp| {
                let olat = reader.read(lamp)?;
                Ok((resize_area(&olat, side, side), peaks(&olat, side)))
            })
            .collect::<Result<Vec<_>>>()?;
        let (mut olats, mut peaks): (Vec<Image>, Vec<Image>) = pictures.into_iter().unzip();
        let matte = project.exemplar_matte(pose);
        let mask = footage::read_mask(&matte, &settings.framing)?;
        let mask = resize_area(&mask, side, side);
        let shading = Shading::from_olats(&olats, &mask);
        // The other lamps light the interview, but no environment.
        olats.truncate(settings.shoot.lamps.len());
        peaks.truncate(settings.shoot.lamps.len());
        let (matte, name) = (matte.display().to_string(), settings.shoot.poses[pose].clone());
        Ok(Self { olats, peaks, mask, matte, name, shading })
    }
}

/// Σ weights · pictures; black if there are none.
pub(super) fn sum(pictures: &[Image], weights: &[[f32; 3]]) -> Image {
    let (width, height) = pictures.first().map_or((0, 0), Image::size);
    let mut sum = Image::filled(width, height, [0.0; 3]);
    for (picture, weight) in pictures.iter().zip(weights) {
        for (sum, pixel) in sum.pixels.iter_mut().zip(&picture.pixels) {
            *sum = [0, 1, 2].map(|c| sum[c] + weight[c] * pixel[c]);
        }
    }
    sum
}

/// Share of each of `side` × `side` blocks of a square that lies within the pictures.
fn within(framing: &Framing, side: usize) -> Mask {
    let block = framing.side as f32 / side as f32;
    let share = |i: usize, from: i32, length: usize| {
        let start = from as f32 + i as f32 * block;
        let end = (start + block).min(length as f32);
        ((end - start.max(0.0)) / block).clamp(0.0, 1.0)
    };
    let [width, height] = framing.source;
    Mask::from_fn(side, side, |x, y| share(x, framing.x, width) * share(y, framing.y, height))
}

/// The brightest values in `side` × `side` blocks of a picture.
fn peaks(picture: &Image, side: usize) -> Image {
    let mut peaks = Image::filled(side, side, [0.0; 3]);
    for y in 0..picture.height {
        for x in 0..picture.width {
            let at = (y * side / picture.height) * side + x * side / picture.width;
            let pixel = picture.at(x, y);
            peaks.pixels[at] = [0, 1, 2].map(|c| pixel[c].max(peaks.pixels[at][c]));
        }
    }
    peaks
}

/// At most `most` of `count` numbers from 0, spread evenly, including the first and the last.
fn evenly(count: usize, most: usize) -> Vec<usize> {
    if count <= most {
        return (0..count).collect();
    }
    (0..most).map(|i| i * (count - 1) / (most - 1)).collect()
}
