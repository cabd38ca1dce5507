//! Look and provenance of each frame of an export, without the network.

use super::colors::Encoding;
use super::provenance::Provenance;
use super::relight::{RelightSettings, frame_range};
use super::writer::output;
use base::error::Result;
use base::progress::Progress;
use footage::{picture_behind, picture_size};
use light::Environment;
use light::conventions::Front;
use project::{Picture, Project};
use scene::{Background, Output, Scene};
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
    pub fn open(
        project: &'a Project,
        settings: &'a RelightSettings,
        progress: &Progress,
    ) -> Result<Self> {
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

/// Source pictures of frame `frame`: its plate, its matte, and the picture behind it if the background is a file.
///
/// # Errors
/// When a movie behind it cannot be opened.
pub(super) fn sources(
    project: &Project,
    frame: usize,
    background: &Background,
) -> Result<Vec<Picture>> {
    let matte = project.frame_matte(frame);
    let mut sources = vec![project.frame_picture(frame), matte.picture().clone()];
    if let Some(file) = background.file() {
        sources.push(picture_behind(file, frame, project.settings.shoot.frame_rate)?);
    }
    Ok(sources)
}
