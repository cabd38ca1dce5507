//! Look and provenance of each frame of an export, without the network.

use super::codec::Codec;
use super::colors::Encoding;
use super::destination::Destination;
use super::format::{Bits, Files};
use super::provenance::Provenance;
use super::relight::{RelightSettings, frame_range};
use super::scaled::fitted;
use base::FileFormat;
use base::error::Result;
use base::progress::Progress;
use footage::picture_size;
use light::Environment;
use light::conventions::Front;
use project::Project;
use scene::{Effects, Inspection, Output, Pass, Scene};
use std::sync::Arc;

/// An export's look.
pub(super) struct Look<'a> {
    pub project: &'a Project,
    pub settings: &'a RelightSettings,
    /// First and last frame.
    pub frames: (usize, usize),
    pub environment: Arc<Environment>,
    /// Front direction of the environment.
    pub front: Front,
    /// Conversion to the codes of the files.
    pub encoding: Encoding,
    /// Scene output to render.
    output: Output,
}

impl<'a> Look<'a> {
    /// Reads the environment.
    ///
    /// # Errors
    /// When the environment, the look-up table, the colour configuration or the first frame cannot be read, or the
    /// destination cannot hold the colours.
    pub fn open(project: &'a Project, settings: &'a RelightSettings, progress: &Progress) -> Result<Self> {
        let files = &settings.files;
        let encoding = Encoding::for_files(files)?;
        let (environment, front) = settings.find_environment(project, progress)?;
        let size = picture_size(project, files.at)?;
        Ok(Self {
            project,
            settings,
            frames: frame_range(project, settings.frames)?,
            environment,
            front,
            output: output(files, size, &encoding, &settings.largest_effects()),
            encoding,
        })
    }

    /// Scene of frame `index`.
    pub fn scene(&self, index: usize) -> Scene {
        let (first, last) = self.frames;
        let share = (index - first) as f32 / (last - first + 1) as f32;
        (self.settings).scene(index, share, self.front, self.output)
    }

    /// Provenance written into the files of this export.
    ///
    /// # Errors
    /// When calibration, network or look-up table cannot be read.
    pub fn provenance(&self) -> Result<Provenance> {
        Provenance::new(
            self.project,
            &self.environment,
            self.settings,
            (self.front, self.frames.0),
            self.encoding.identity(),
        )
    }
}

/// Scene output to render from pictures of `size` columns and rows. For more than 8 bits, and for another size, the
/// writer encodes display light itself, without the dither of 8 bits, unless an effect needs codes: light is
/// averaged before the view cuts off highlights.
pub(super) fn output(files: &Files, size: (usize, usize), encoding: &Encoding, effects: &Effects) -> Output {
    let deep = match &files.to {
        Destination::Stills(stills) => files.bits == Bits::Sixteen || stills.format() == Some(FileFormat::Tiff),
        Destination::Clip(path) => Codec::for_path(files.codec, path).is_ok_and(Codec::is_deep),
    };
    // The dither of 8 bits is for codes that stay unchanged.
    let resized = files.size.is_some_and(|longest| fitted(size, longest) != size);
    let deep = deep || resized || !encoding.is_plain();
    let plain = !effects.asks(Pass::Grain) && effects.inspection == Inspection::Picture;
    if files.to.is_linear() || deep && plain { Output::Linear } else { Output::Display }
}
