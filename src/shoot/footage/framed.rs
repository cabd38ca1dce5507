//! Reader for pictures of the subject, cropped to the project's framing.

use super::mended::remember;
use super::shoot::contents;
use base::error::{Error, Result};
use imaging::color::luminance;
use imaging::picture::{self, About, Coding};
use imaging::{Encoded, Image, Mask, Raster, Response, file};
use project::{Axis, Framing, Framings, Matte, Padding, Picture, Project};
use std::path::Path;

/// Reads a full picture of 8 or 16 bits, or a frame of a movie.
///
/// # Errors
/// When the file cannot be read.
pub fn read_picture(picture: &Picture) -> Result<Encoded> {
    match picture {
        Picture::File(file) => file::read_encoded(file),
        Picture::Movie { file, frame } => Ok(movies::open(file)?.frame(*frame)?.encoded()),
        Picture::Mirrored(picture, axis) => Ok(Encoded(mirrored(&read_picture(picture)?.0, *axis))),
    }
}

fn mirrored<T: Copy>(picture: &Raster<T>, axis: Axis) -> Raster<T> {
    let (width, height) = picture.size();
    Raster::from_fn(width, height, |x, y| match axis {
        Axis::LeftRight => picture.at(width - 1 - x, y),
        Axis::UpDown => picture.at(x, height - 1 - y),
    })
}

/// Reads a full picture as light in the camera's units: as its file holds it if that is scene-linear, otherwise its codes
/// linearised by `response`.
///
/// # Errors
/// When the file cannot be read.
pub fn read_light(picture: &Picture, response: &Response) -> Result<Image> {
    let own = match picture {
        Picture::File(file) => picture::read(file)?,
        Picture::Movie { file, frame } => {
            let source = movies::open(file)?;
            match source.picture(*frame)? {
                Some(own) => own,
                None => return Ok(response.decode(&source.frame(*frame)?.encoded())),
            }
        }
        Picture::Mirrored(picture, axis) => {
            return Ok(mirrored(&read_light(picture, response)?, *axis));
        }
    };
    Ok(match own.into_scene_light() {
        Ok((light, mended)) => {
            remember(picture.display().to_string(), mended);
            light
        }
        Err(codes) => response.decode(&codes.into_encoded()),
    })
}

/// True if a picture's file holds scene-linear light, so that no response applies.
///
/// # Errors
/// When the file cannot be read.
pub fn is_scene_linear(picture: &Picture) -> Result<bool> {
    Ok(about(picture)?.is_some_and(|about| matches!(about.coding, Coding::Light(_))))
}

/// Properties of a picture's file. None for a movie's frame and for DPX.
pub(super) fn about(picture: &Picture) -> Result<Option<About>> {
    match picture {
        Picture::File(file) => picture::about(file).map(Some),
        Picture::Movie { file, frame } => movies::open(file)?.about(*frame),
        Picture::Mirrored(picture, _) => about(picture),
    }
}

/// Reads a full matte.
///
/// # Errors
/// When it does not exist or cannot be read.
pub fn read_matte(matte: &Matte) -> Result<Mask> {
    match matte {
        Matte::Grey(Picture::File(file)) if !file.exists() => Err(no_matte(file)),
        Matte::Grey(Picture::File(file)) => file::read_mask(file),
        Matte::Grey(picture) => Ok(read_picture(picture)?.0.map(luminance)),
        Matte::Alpha(Picture::File(file)) => file::read_alpha(file),
        Matte::Alpha(Picture::Movie { file, frame }) => {
            let alpha = movies::open(file)?.frame(*frame)?.alpha();
            alpha.ok_or_else(|| no_matte(file))
        }
        Matte::Alpha(Picture::Mirrored(picture, axis)) => {
            Ok(mirrored(&read_matte(&Matte::Alpha((**picture).clone()))?, *axis))
        }
    }
}

/// The first matte of a pose or frame whose file does not exist, as an error with its remedy.
pub fn missing_matte(project: &Project) -> Option<Error> {
    let shoot = &project.settings.shoot;
    let poses = (0..shoot.poses.len()).map(|pose| project.exemplar_matte(pose));
    let frames = (0..shoot.frames.len()).map(|frame| project.frame_matte(frame));
    let lack = poses.chain(frames).find(|matte| !matte.file().exists())?;
    Some(no_matte(lack.file()))
}

pub(super) fn no_matte(file: &Path) -> Error {
    let folder = file.parent().filter(|folder| folder.is_dir());
    let there = folder.map_or_else(String::new, |folder| format!(": its folder {}", contents(folder)));
    Error::missing(
        format!("no matte {}{there}", file.display()),
        ("Make the mattes, or add your own as grey pictures of the same size", "afterlight matte PROJECT"),
    )
}

/// Width and height of a picture.
///
/// # Errors
/// When the file cannot be read.
pub fn dimensions(picture: &Picture) -> Result<(usize, usize)> {
    match picture {
        Picture::File(file) => file::dimensions(file),
        Picture::Movie { file, .. } => Ok(movies::open(file)?.size()),
        Picture::Mirrored(picture, _) => dimensions(picture),
    }
}

/// Reads a picture of 8 or 16 bits and crops it to its square, at the picture's own resolution.
///
/// # Errors
/// When the file cannot be read.
pub fn read_encoded(picture: &Picture, framings: &Framings) -> Result<Encoded> {
    Ok(Encoded(framed(read_picture(picture)?.0, framings)))
}

/// Reads a picture as light and crops it to its square, at the picture's own resolution: [`read_light`].
///
/// # Errors
/// When the file cannot be read.
pub fn read_framed_light(picture: &Picture, framings: &Framings, response: &Response) -> Result<Image> {
    Ok(framed(read_light(picture, response)?, framings))
}

/// Reads and crops a linear picture.
///
/// # Errors
/// When the file cannot be read.
pub fn read_linear(path: &Path, framings: &Framings) -> Result<Image> {
    Ok(framed(file::read_linear(path)?, framings))
}

/// Reads and crops a matte, with coverage 0 outside.
///
/// # Errors
/// When the file cannot be read.
pub fn read_mask(matte: &Matte, framings: &Framings) -> Result<Mask> {
    let mask = read_matte(matte)?;
    let framing = framings.for_size(mask.size());
    Ok(cut_mask(mask, &framing))
}

/// Crops a matte to the square, with coverage 0 outside.
pub(super) fn cut_mask(mask: Mask, framing: &Framing) -> Mask {
    cut(mask, framing, Some(0.0))
}

fn framed(picture: Image, framings: &Framings) -> Image {
    let framing = framings.for_size(picture.size());
    cut_picture(picture, &framing)
}

/// Crops a picture to the square at its own resolution, padded beyond its edges.
pub fn cut_picture(picture: Image, framing: &Framing) -> Image {
    let outside = match framing.padding {
        Padding::Black => Some([0.0; 3]),
        Padding::Edge => None,
    };
    cut(picture, framing, outside)
}

/// Crops a picture to the square and fills the outside with `outside`; `None` repeats the edge.
fn cut<T: Copy>(picture: Raster<T>, framing: &Framing, outside: Option<T>) -> Raster<T> {
    let (width, height) = picture.size();
    let side = framing.side;
    if (framing.x, framing.y) == (0, 0) && (width, height) == (side, side) {
        return picture;
    }
    let place = |i: usize, from: i32, length: usize| {
        let at = i as i64 + i64::from(from);
        let inside = at.clamp(0, length as i64 - 1);
        (inside as usize, inside == at)
    };
    Raster::from_fn(side, side, |x, y| {
        let ((x, x_inside), (y, y_inside)) = (place(x, framing.x, width), place(y, framing.y, height));
        match outside {
            Some(outside) if !(x_inside && y_inside) => outside,
            _ => picture.at(x, y),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Exemplar, Frame, ImportSettings, import};
    use base::progress::Progress;
    use project::Project;
    use virtual_stage::{StageSettings, write_shoot};

    #[test]
    fn a_square_beyond_the_edge_is_padded() {
        let picture = Raster::from_fn(3, 2, |x, y| (10 * y + x) as f32);
        let framing = Framing { x: -1, y: -1, ..Framing::whole((3, 2)) };
        let black = cut(picture.clone(), &framing, Some(0.5));
        assert_eq!(black.pixels, [0.5, 0.5, 0.5, 0.5, 0.0, 1.0, 0.5, 10.0, 11.0]);
        let edge = cut(picture.clone(), &framing, None);
        assert_eq!(edge.pixels, [0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 10.0, 10.0, 11.0]);
        let middle = cut(picture, &Framing::largest((3, 2)), None);
        assert_eq!(middle.pixels, [0.0, 1.0, 10.0, 11.0]);
    }

    /// Pads a picture's file to 58 × 32 pixels, centred.
    fn widen(path: &Path) {
        let narrow = image::open(path).unwrap();
        assert_eq!((narrow.width(), narrow.height()), (32, 32));
        let mut wide = image::DynamicImage::new(58, 32, narrow.color());
        image::imageops::replace(&mut wide, &narrow, 13, 0);
        wide.save(path).unwrap();
    }

    #[test]
    fn a_wide_shoot_is_the_square_one_in_its_middle_and_a_box_moves_it() -> Result<()> {
        let folder = tempfile::tempdir().unwrap();
        let (shoot, silent) = (folder.path().join("shoot"), Progress::silent());
        let stage = StageSettings { frames: 2, size: 32, lamps: 4, ..StageSettings::default() };
        write_shoot(&shoot, &stage, &silent)?;
        let settings = ImportSettings { size: 16, seed: 1, layer: None };
        let square = import(&folder.path().join("square"), &shoot, &settings, &silent)?;
        let read = |project: &Project| -> Result<(Frame, Exemplar)> {
            let frame = Frame::load(project, &Response::Srgb, 1)?;
            Ok((frame, Exemplar::load(project, &Response::Srgb, 0)?))
        };
        let (frame, exemplar) = read(&square)?;

        for part in ["interview", "interview_masks", "exemplars", "exemplar_masks"] {
            let files = test_support::files(&shoot.join(part)).into_iter();
            let pngs = files.filter(|path| path.extension().is_some_and(|e| e == "png"));
            pngs.for_each(|path| widen(&path));
        }
        let wide = import(&folder.path().join("wide"), &shoot, &settings, &silent)?;
        let (wide_frame, wide_exemplar) = read(&wide)?;
        assert_eq!((&wide_frame.plate, &wide_frame.mask), (&frame.plate, &frame.mask));
        assert_eq!((&wide_exemplar.olats, &wide_exemplar.mask), (&exemplar.olats, &exemplar.mask));

        // Two pixels of the source are one of the picture: the square moves down by 6, so the picture moves up by
        // 3.
        let lower = Framing { y: 6, ..Framing::largest((58, 32)) };
        let reframed = |framing| -> Result<(Frame, Exemplar)> {
            Project::change(&wide.root, |project| project.frame(framing))?;
            read(&Project::open(&wide.root)?)
        };
        let (moved, moved_exemplar) = reframed(lower)?;
        for (before, after) in [(&frame.plate, &moved.plate), (&exemplar.olats[2], &moved_exemplar.olats[2])] {
            for (x, y) in [(0, 0), (7, 3), (15, 12)] {
                assert_eq!(after.at(x, y), before.at(x, y + 3));
            }
            assert_eq!(after.at(7, 15), [0.0; 3]);
        }
        let below = (0..16).flat_map(|x| (13..16).map(move |y| (x, y)));
        assert!(below.clone().all(|(x, y)| moved.mask.at(x, y) == 0.0));
        assert!(below.clone().any(|(x, y)| frame.mask.at(x, y) > 0.0));
        let (edge, _) = reframed(Framing { padding: Padding::Edge, ..lower })?;
        let last = |x| edge.plate.at(x, 12);
        // Only the source's last row, where the picture's row 12 has the mean of the last two.
        assert!((0..16).all(|x| edge.plate.at(x, 14) == edge.plate.at(x, 15)));
        assert!((0..16).any(|x| last(x) != [0.0; 3] && edge.plate.at(x, 15) != [0.0; 3]));
        assert!(below.clone().all(|(x, y)| edge.mask.at(x, y) == 0.0));
        Ok(())
    }
}
