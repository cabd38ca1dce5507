//! One frame of the interview.

use crate::error::{Error, Result};
use crate::imaging::{Image, Mask, Response, file, resample::resize_area};
use crate::project::Project;
use std::path::Path;

/// A frame of the interview, linear, at the working size.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Its number in the project, from 0.
    pub index: usize,
    /// Linear radiance in the interview session's units, background included.
    pub plate: Image,
    /// The subject's coverage.
    pub mask: Mask,
}

impl Frame {
    /// Reads frame `index` of the project, linearised by `response`.
    ///
    /// # Errors
    /// When the frame does not exist, or a file cannot be read or has another shape than its matte.
    pub fn load(project: &Project, response: &Response, index: usize) -> Result<Self> {
        let frames = project.settings.shoot.frames.len();
        if index >= frames {
            return Err(Error::unexpected(
                "the frame range",
                format!("frames from 0 to {}", frames.saturating_sub(1)),
                index.to_string(),
                "Ask for frames that the interview has",
            ));
        }
        let size = project.settings.size;
        Ok(Self {
            index,
            plate: load_linear(&project.frame_path(index), response, size)?,
            mask: load_mask(&project.frame_mask_path(index), size)?,
        })
    }
}

/// Reads an encoded picture, linearises it and averages it down to `size × size` in linear light.
pub(super) fn load_linear(path: &Path, response: &Response, size: usize) -> Result<Image> {
    let linear = response.decode(&file::read_encoded(path)?);
    Ok(resize_area(&linear, size, size))
}

/// Reads a matte and averages it down to `size × size`.
pub(super) fn load_mask(path: &Path, size: usize) -> Result<Mask> {
    Ok(resize_area(&file::read_mask(path)?, size, size))
}
