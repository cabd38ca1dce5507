//! A frame of the interview at its own resolution.

use super::damaged::{offer, readable_frame, stand_in};
use super::frame::Frame;
use super::framed::{cut_mask, cut_picture, dimensions, read_light, read_matte};
use base::error::{Error, Result};
use clap::ValueEnum;
use imaging::{Image, Mask, Response, resample::resize_area};
use project::{Framing, Project};
use serde::{Deserialize, Serialize};

/// Part of the plate shown by a picture, and its resolution.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "lowercase")]
pub enum PictureSize {
    /// The full plate at its own resolution.
    #[default]
    Plate,
    /// The square used by the network, at the plate's resolution.
    Box,
    /// The square used by the network, at the working size.
    Square,
}

/// A frame of the interview at full resolution.
#[derive(Clone, Debug, PartialEq)]
pub struct FilmedFrame {
    /// Linear radiance in the interview session's units, background included.
    pub plate: Image,
    /// Coverage of the subject, at the plate's size.
    pub mask: Mask,
    /// Crop of the plate used by the network.
    pub framing: Framing,
}

impl Frame {
    /// Reads frame `index` of the project, linearised by `response`, at the working size and at full size. If its
    /// picture is unreadable and the project continues at damaged frames, reads its stand-in, or black with an
    /// empty matte.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn load_filmed(project: &Project, response: &Response, index: usize) -> Result<(Self, FilmedFrame)> {
        Self::check_index(project, index)?;
        let stand_in = stand_in(project, index)?;
        let read = stand_in.as_ref().map_or(index, |stand_in| stand_in.held);
        let (picture, matte) = (project.frame_picture(read), project.frame_matte(read));
        let plate = read_light(&picture, response).map_err(|e| offer(project, index, e))?;
        if stand_in.is_some_and(|stand_in| stand_in.is_black) {
            let (width, height) = plate.size();
            let filmed = FilmedFrame {
                framing: project.settings.framing.for_size((width, height)),
                plate: Image::filled(width, height, [0.0; 3]),
                mask: Mask::filled(width, height, 0.0),
            };
            return Ok((filmed.at_working_size(index, project.settings.size), filmed));
        }
        let mask = read_matte(&matte)?;
        if plate.size() != mask.size() {
            let ((width, height), (wide, high)) = (plate.size(), mask.size());
            return Err(Error::invalid(
                format!(
                    "{} has {width} × {height} pixels, but its matte {} has {wide} × {high}",
                    picture.display(),
                    matte.display()
                ),
                "Provide a matte of the frame's size",
            ));
        }
        let filmed = FilmedFrame { framing: project.settings.framing.for_size(mask.size()), plate, mask };
        Ok((filmed.at_working_size(index, project.settings.size), filmed))
    }
}

/// Width and height of the interview's pictures at this size.
///
/// # Errors
/// When the first frame cannot be read.
pub fn picture_size(project: &Project, size: PictureSize) -> Result<(usize, usize)> {
    let working = project.settings.size;
    if size == PictureSize::Square {
        return Ok((working, working));
    }
    let plate = dimensions(&project.frame_picture(readable_frame(project, 0)?))?;
    let side = project.settings.framing.for_size(plate).side;
    Ok(match size {
        PictureSize::Plate => plate,
        _ => (side, side),
    })
}

impl FilmedFrame {
    /// The crop at the network's working size.
    fn at_working_size(&self, index: usize, size: usize) -> Frame {
        let square = self.square();
        Frame { index, plate: resize_area(&square.plate, size, size), mask: resize_area(&square.mask, size, size) }
    }

    /// The square used by the network, at the plate's resolution; padded beyond the plate.
    #[must_use]
    pub fn square(&self) -> Self {
        let side = self.framing.side;
        Self {
            plate: cut_picture(self.plate.clone(), &self.framing),
            mask: cut_mask(self.mask.clone(), &self.framing),
            framing: Framing { source: [side, side], x: 0, y: 0, ..self.framing },
        }
    }

    /// The frame cropped for a picture of this size; None at the working size.
    #[must_use]
    pub fn shown(self, size: PictureSize) -> Option<Self> {
        match size {
            PictureSize::Plate => Some(self),
            PictureSize::Box => Some(self.square()),
            PictureSize::Square => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ImportSettings, import};
    use base::progress::Progress;
    use project::Padding;
    use virtual_stage::{StageSettings, write_shoot};

    #[test]
    fn a_filmed_frame_holds_the_frame_that_the_network_sees() -> Result<()> {
        let folder = tempfile::tempdir().unwrap();
        let (shoot, silent) = (folder.path().join("shoot"), Progress::silent());
        let stage = StageSettings { frames: 2, size: 48, lamps: 4, ..StageSettings::default() };
        write_shoot(&shoot, &stage, &silent)?;
        let settings = ImportSettings { size: 16, seed: 1, layer: None };
        let project = import(&folder.path().join("p"), &shoot, &settings, &silent)?;
        for framing in [
            Framing::whole((48, 48)),
            Framing { x: -9, y: 12, side: 40, padding: Padding::Edge, ..Framing::whole((48, 48)) },
        ] {
            Project::change(&project.root, |project| project.frame(framing))?;
            let project = Project::open(&project.root)?;
            let plain = Frame::load(&project, &Response::Srgb, 1)?;
            let (frame, filmed) = Frame::load_filmed(&project, &Response::Srgb, 1)?;
            assert_eq!((&frame.plate, &frame.mask), (&plain.plate, &plain.mask));
            assert_eq!((frame.index, filmed.plate.size()), (1, (48, 48)));
            let square = filmed.clone().shown(PictureSize::Box).unwrap();
            let side = framing.side;
            assert_eq!((square.plate.size(), square.mask.size()), ((side, side), (side, side)));
            assert_eq!(square.square(), square);
            assert_eq!(picture_size(&project, PictureSize::Box)?, (side, side));
            assert_eq!(resize_area(&square.plate, 16, 16), frame.plate);
            assert_eq!(filmed.clone().shown(PictureSize::Plate), Some(filmed.clone()));
            assert_eq!(filmed.shown(PictureSize::Square), None);
        }
        Ok(())
    }
}
