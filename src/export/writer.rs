//! Writes the frames of one export, whatever files they go to.

use super::format::{Bits, Existing, Files};
use super::layers::{LightLayers, Rebuild};
use super::scaled::{fitted, scaled};
use super::still::{About, no_light, write_still};
use super::{ClipWriter, Destination, untaken};
use base::error::{Error, Result};
use base::files::remove_left_over;
use base::progress::Progress;
use compositor::{Picture, view};
use scene::{Effects, Inspection, Output, Pass};
use std::path::PathBuf;

/// What takes the frames, in order.
pub(super) struct Writer {
    /// Where they go, as it was written out.
    pub to: String,
    files: Files,
    destination: Destination,
    clip: Option<ClipWriter>,
    frame_rate: f64,
    /// Columns and rows that are asked for; None if they are the pictures' own.
    size: Option<(usize, usize)>,
    /// Frames that were written.
    done: usize,
}

/// The lamps of a frame, and the subject that they add up to.
pub(super) struct Lights {
    pub layers: LightLayers,
    pub subject: Picture,
}

impl Writer {
    /// Makes ready for frames `first` to `last` of so many columns and rows.
    ///
    /// # Errors
    /// When the destination is not understood or cannot hold what is asked for, or a movie cannot be begun.
    pub fn open(
        files: &Files,
        (first, last): (usize, usize),
        size: (usize, usize),
        frame_rate: f64,
    ) -> Result<Self> {
        let to = match files.existing {
            Existing::Replace => files.to.clone(),
            Existing::Keep => untaken(&files.to, first, last)?,
        };
        let destination = check(files, &to, last - first + 1)?;
        let written = files.size.map_or(size, |longest| fitted(size, longest));
        // What exports to this folder left when they were killed.
        if let Some(folder) = destination.files(first, last).next().and_then(folder) {
            remove_left_over(&folder);
        }
        let clip = match &destination {
            Destination::Clip(path) => Some(ClipWriter::create(path, written, frame_rate, first)?),
            Destination::Stills(_) => None,
        };
        Ok(Self {
            to,
            files: files.clone(),
            destination,
            clip,
            frame_rate,
            size: (written != size).then_some(written),
            done: 0,
        })
    }

    /// What a scene has to make. Light that is to be shown in more than 8 bits is encoded here, without the
    /// dither of 8 bits, unless an effect on codes is asked for.
    pub fn output(&self, effects: &Effects) -> Output {
        let movie = match &self.destination {
            Destination::Clip(path) => path.extension(),
            Destination::Stills(_) => None,
        };
        let deep = self.files.bits == Bits::Sixteen
            || movie.is_some_and(|ending| ending.eq_ignore_ascii_case("mov"));
        let plain = !effects.asks(Pass::Grain) && effects.inspection == Inspection::Picture;
        match self.destination.output() {
            Output::Display if deep && plain => Output::Linear,
            output => output,
        }
    }

    /// Writes frame `frame`, and its lamps where there are any; tells how well they gave back their sum.
    ///
    /// # Errors
    /// When it cannot be written; says what is kept.
    pub fn write(
        &mut self,
        frame: usize,
        picture: &Picture,
        lights: Option<Lights>,
        progress: &Progress,
    ) -> Result<Option<Rebuild>> {
        let check = (self.put(frame, picture, lights, progress)).map_err(|e| self.kept(e))?;
        self.done += 1;
        Ok(check)
    }

    fn put(
        &mut self,
        frame: usize,
        picture: &Picture,
        lights: Option<Lights>,
        progress: &Progress,
    ) -> Result<Option<Rebuild>> {
        let mut shown = match self.size {
            Some(size) => scaled(picture, size),
            None => picture.clone(),
        };
        if self.destination.output() == Output::Display && shown.display.is_none() {
            shown.display = (shown.linear.as_ref()).map(|linear| view(linear, shown.view));
        }
        match (&self.destination, &mut self.clip) {
            (Destination::Stills(stills), _) => {
                let path = stills.path(frame);
                let lights = lights.map(|Lights { layers, subject }| match self.size {
                    Some(size) => (layers.scaled(size), scaled(&subject, size)),
                    None => (layers, subject),
                });
                let about = About {
                    frame,
                    frame_rate: self.frame_rate,
                    bits: self.files.bits,
                    layers: lights.as_ref().map(|(layers, _)| layers),
                };
                write_still(&path, &shown, &about)?;
                let check = lights.map(|(layers, subject)| {
                    let subject = subject.linear.as_ref().ok_or_else(|| no_light(&path))?;
                    Rebuild::check(&path, layers.0.len(), subject)
                });
                check.transpose()
            }
            (Destination::Clip(_), Some(clip)) => clip.push(&shown, progress).map(|()| None),
            (Destination::Clip(_), None) => Ok(None),
        }
    }

    /// Ends a movie.
    ///
    /// # Errors
    /// When it cannot be ended; then there is none.
    pub fn finish(&mut self, progress: &Progress) -> Result<()> {
        (self.clip.take()).map_or(Ok(()), |clip| clip.finish(progress))
    }

    /// What there is if it ends now.
    pub fn keeps(&self) -> String {
        match self.destination {
            Destination::Stills(_) => format!("{} frames are kept: {}", self.done, self.to),
            Destination::Clip(_) => "no movie was written".to_owned(),
        }
    }

    /// The error, which says what is kept.
    fn kept(&self, error: Error) -> Error {
        error.with_note(&self.keeps())
    }
}

/// The folder that holds a file.
fn folder(file: PathBuf) -> Option<PathBuf> {
    let folder = file.parent()?;
    let here = folder.as_os_str().is_empty();
    Some(if here {
        ".".into()
    } else {
        folder.to_path_buf()
    })
}

/// The destination `to`, as far as `frames` frames can be written there as `files` says.
///
/// # Errors
/// When it is not understood, or cannot hold what is asked for.
pub(super) fn check(files: &Files, to: &str, frames: usize) -> Result<Destination> {
    let destination = Destination::parse(to)?;
    destination.check_frames(frames)?;
    if let Some(size) = files.size.filter(|size| !Files::SIZES.contains(size)) {
        let (least, most) = (Files::SIZES.start(), Files::SIZES.end());
        return Err(Error::invalid(
            format!("pictures of {size} pixels cannot be written, only {least} to {most}"),
            "Leave the size out for the pictures' own",
        ));
    }
    if files.layers && destination.output() != Output::Linear {
        return Err(Error::invalid(
            format!("light layers cannot be written to {to}, which is not an EXR"),
            "Write for example out.%04d.exr, or leave the layers out",
        ));
    }
    Ok(destination)
}

#[cfg(test)]
#[path = "writer_tests.rs"]
mod tests;
