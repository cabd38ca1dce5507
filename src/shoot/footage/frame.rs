//! One frame of the interview.

use super::damaged::{offer, readable_frame};
use super::framed;
use base::error::{Error, Result};
use imaging::{Image, Mask, Response, resample::resize_area};
use project::{Matte, Picture, Project};

/// A frame of the interview, linear, at the working size.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Index in the project, from 0.
    pub index: usize,
    /// Linear radiance in the interview session's units, background included.
    pub plate: Image,
    /// Coverage of the subject.
    pub mask: Mask,
}

impl Frame {
    /// Reads frame `index` of the project, linearised by `response`. If its picture is unreadable and the project
    /// continues at damaged frames, reads its stand-in.
    ///
    /// # Errors
    /// When the frame does not exist, or a file cannot be read or differs in shape from its matte.
    pub fn load(project: &Project, response: &Response, index: usize) -> Result<Self> {
        Self::check_index(project, index)?;
        let read = readable_frame(project, index)?;
        Ok(Self {
            index,
            plate: load_linear(project, &project.frame_picture(read), response)
                .map_err(|e| offer(project, index, e))?,
            mask: load_mask(project, &project.frame_matte(read))?,
        })
    }

    /// Refuses a frame outside the interview.
    pub(super) fn check_index(project: &Project, index: usize) -> Result<()> {
        let frames = project.settings.shoot.frames.len();
        if index < frames {
            return Ok(());
        }
        Err(Error::missing(
            format!("no frame {index}: the interview has frames 0 to {}", frames.saturating_sub(1)),
            "Choose frames of the interview",
        ))
    }
}

/// Reads and crops an encoded picture, linearises it and averages it down to the working size in linear light.
pub(super) fn load_linear(project: &Project, picture: &Picture, response: &Response) -> Result<Image> {
    let settings = &project.settings;
    let linear = framed::read_framed_light(picture, &settings.framing, response)?;
    Ok(resize_area(&linear, settings.size, settings.size))
}

/// Reads and crops a matte and averages it down to the working size.
pub(super) fn load_mask(project: &Project, matte: &Matte) -> Result<Mask> {
    let settings = &project.settings;
    let mask = framed::read_mask(matte, &settings.framing)?;
    Ok(resize_area(&mask, settings.size, settings.size))
}
