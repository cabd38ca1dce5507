//! Writer of an export's frames, for every kind of destination.

use super::about::About;
use super::clip::Movie;
use super::codec::{Codec, Container};
use super::colors::{Encoding, check_colors};
use super::format::{Existing, Files, MovieAlpha};
use super::interview::Interview;
use super::layers::LightLayers;
use super::movie_frames::MovieFrames;
use super::provenance::provenance_of;
use super::rebuild::Rebuild;
use super::scaled::{fitted, scaled};
use super::sound::Sound;
use super::still::write_still;
use super::whole::is_whole;
use super::{ClipWriter, Destination};
use base::error::{Error, Result};
use base::files::remove_left_over;
use base::progress::Progress;
use compositor::{Picture, view};
use footage::FRAME_NUMBERS;
use footage::scan::counted;
use std::path::{Path, PathBuf};

/// Writer of the frames, in order.
pub(super) struct Writer {
    /// With the destination under which no file exists yet, if existing files are kept.
    pub files: Files,
    clip: Option<ClipWriter>,
    /// Sound of the movie, while it is written.
    sound: Option<Sound>,
    interview: Interview,
    encoding: Encoding,
    /// Frames of a movie that is joined later.
    parts: Option<MovieFrames>,
    /// True if existing frames are kept.
    goes_on: bool,
    /// Requested columns and rows; None for the pictures' own.
    size: Option<(usize, usize)>,
    /// Number of written frames.
    done: usize,
}

impl Writer {
    /// Prepares for frames `first` to `last` at this number of columns and rows. `part_folder` holds the frames of a movie
    /// whose export is made in parts.
    ///
    /// # Errors
    /// When the interview's sound cannot be read, or a movie cannot be started.
    pub fn open(
        files: &Files,
        encoding: &Encoding,
        (first, last): (usize, usize),
        size: (usize, usize),
        interview: &Interview,
        part_folder: Option<&Path>,
        progress: &Progress,
    ) -> Result<Self> {
        let numbers = files.numbers(interview, (first, last));
        let mut files = files.clone();
        if files.existing == Existing::Keep && part_folder.is_none() {
            files.to = files.to.untaken(numbers.0, numbers.1)?;
        }
        let written = files.size.map_or(size, |longest| fitted(size, longest));
        // Leftovers of killed exports in this folder. With other workers around nothing is removed: another machine's
        // clock and locks cannot tell for sure whether their files are leftovers.
        if let (None, Some(folder)) = (part_folder, files.to.files(numbers.0, numbers.1).next().and_then(folder)) {
            remove_left_over(&folder);
        }
        let (mut clip, mut sound, mut parts) = (None, None, None);
        if let (Destination::Clip(path), Some(folder)) = (&files.to, part_folder) {
            let codec = Codec::for_path(files.codec, path)?;
            parts = Some(MovieFrames::new(folder, codec, files.movie_alpha));
        } else if let Destination::Clip(path) = &files.to {
            let codec = Codec::for_path(files.codec, path)?;
            if !files.no_sound {
                sound = Sound::extract(interview, (first, last), path, progress)?;
            }
            // A movie for review has a time code only if the interview has one.
            let counted = Container::from_path(path) != Some(Container::Mp4);
            let counted = counted.then(|| interview.time_code(first));
            let movie = Movie {
                codec,
                frame_rate: interview.frame_rate,
                time_code: interview.filmed_time_code(first).or(counted),
                reel: interview.reel().map(str::to_owned),
                encoding: encoding.clone(),
                alpha: files.movie_alpha,
                sound: sound.as_ref().map(|sound| sound.path().to_path_buf()),
            };
            clip = Some(ClipWriter::create(path, written, &movie)?);
            if codec.padded(written) != written {
                let (width, height) = codec.padded(written);
                progress.say(format!(
                    "{} needs even sizes: the last column or row is repeated, {width} × {height}",
                    codec.name()
                ));
            }
        }
        Ok(Self {
            goes_on: files.resume || part_folder.is_some(),
            files,
            clip,
            sound,
            interview: interview.clone(),
            encoding: encoding.clone(),
            parts,
            size: (written != size).then_some(written),
            done: 0,
        })
    }

    /// Writes frame `frame`, with its light layers if there are any; returns the accuracy of their sum.
    ///
    /// # Errors
    /// When the frame cannot be written; the message names the files that are kept.
    pub fn write(
        &mut self,
        frame: usize,
        picture: &Picture,
        layers: Option<LightLayers>,
        made_of: Option<&str>,
        progress: &Progress,
    ) -> Result<Option<Rebuild>> {
        let check = self.put(frame, picture, layers, made_of, progress);
        let check = check.map_err(|e| self.kept(e))?;
        self.done += 1;
        Ok(check)
    }

    fn put(
        &mut self,
        frame: usize,
        picture: &Picture,
        layers: Option<LightLayers>,
        made_of: Option<&str>,
        progress: &Progress,
    ) -> Result<Option<Rebuild>> {
        let mut shown = match self.size {
            Some(size) => scaled(picture, size),
            None => picture.clone(),
        };
        if !self.files.to.is_linear() && shown.display.is_none() {
            shown.display = (shown.linear.as_ref()).map(|linear| view(linear, shown.view));
        }
        match (&self.files.to, &mut self.clip) {
            (Destination::Stills(stills), _) => {
                let path = stills.path(self.number(frame));
                let layers = layers.map(|layers| self.prepared(layers, &shown));
                let about = About {
                    time_code: self.interview.time_code(frame),
                    frame_rate: self.interview.frame_rate,
                    bits: self.files.bits,
                    exr: self.files.exr,
                    encoding: &self.encoding,
                    reel: self.interview.reel(),
                    provenance: made_of,
                    layers: layers.as_ref(),
                };
                write_still(&path, &shown, &about)
            }
            (Destination::Clip(_), Some(clip)) => clip.push(&shown, progress).map(|()| None),
            (Destination::Clip(_), None) => {
                let mut parts = self.parts.iter();
                parts.try_for_each(|parts| parts.write(frame, &shown, &self.encoding, made_of)).map(|()| None)
            }
        }
    }

    /// Layers at the size of the picture `shown`, with its rest, in the primaries of the file.
    fn prepared(&self, layers: LightLayers, shown: &Picture) -> LightLayers {
        let mut layers = layers.scaled(shown.alpha.size());
        if let Some(picture) = &shown.linear {
            layers = layers.with_rest(picture);
        }
        layers.in_space(self.encoding.keeps_light())
    }

    /// Number of frame `frame` in the name of its file.
    fn number(&self, frame: usize) -> i64 {
        self.files.numbers(&self.interview, (frame, frame)).0
    }

    /// True if each frame has its own file.
    pub fn writes_stills(&self) -> bool {
        matches!(self.files.to, Destination::Stills(_)) || self.parts.is_some()
    }

    /// True if existing frames are kept.
    pub fn goes_on(&self) -> bool {
        self.goes_on
    }

    /// True if frame `frame` exists, is complete and has the same provenance; it then counts as written.
    pub fn keeps_frame(&mut self, frame: usize, made_of: &str) -> bool {
        let path = match (&self.files.to, &self.parts) {
            (Destination::Stills(stills), _) => stills.path(self.number(frame)),
            (Destination::Clip(_), Some(parts)) => parts.path(frame),
            (Destination::Clip(_), None) => return false,
        };
        let same =
            self.goes_on && provenance_of(&path).as_deref() == Some(made_of) && is_whole(&path, self.files.layers);
        self.done += usize::from(same);
        same
    }

    /// Adds a movie frame in ffmpeg's layout.
    ///
    /// # Errors
    /// As [`ClipWriter::feed`].
    pub fn feed(&mut self, bytes: Vec<u8>, progress: &Progress) -> Result<()> {
        (self.clip.as_mut()).map_or(Ok(()), |clip| clip.feed(bytes, progress))
    }

    /// Ends a movie.
    ///
    /// # Errors
    /// When the movie cannot be finished; no file remains then.
    pub fn finish(&mut self, progress: &Progress) -> Result<()> {
        let finished = (self.clip.take()).map_or(Ok(()), |clip| clip.finish(progress));
        self.sound = None;
        finished
    }

    /// Message on the files that remain if the export ends now.
    pub fn keeps(&self) -> String {
        match self.writes_stills() {
            true if self.done == 0 => "nothing was written".to_owned(),
            true => {
                let are = if self.done == 1 { "is" } else { "are" };
                let to = match &self.parts {
                    Some(parts) => parts.folder.display().to_string(),
                    None => self.files.to.to_string(),
                };
                format!("{} {are} kept: {to}", counted(self.done, "frame"))
            }
            false => "no movie was written".to_owned(),
        }
    }

    /// The error with the files that are kept.
    fn kept(&self, error: Error) -> Error {
        error.with_note(&self.keeps())
    }
}

/// Folder of a file.
fn folder(file: PathBuf) -> Option<PathBuf> {
    let folder = file.parent()?;
    let here = folder.as_os_str().is_empty();
    Some(if here { ".".into() } else { folder.to_path_buf() })
}

/// Refuses settings that the destination cannot hold.
///
/// # Errors
/// When they do not fit; the message gives the reason.
pub fn check_files(files: &Files, frames: usize) -> Result<()> {
    let to = &files.to;
    to.check_frames(frames)?;
    if let Some(size) = files.size.filter(|size| !Files::SIZES.contains(size)) {
        let (least, most) = (Files::SIZES.start(), Files::SIZES.end());
        return Err(Error::invalid(
            format!("the size {size} is outside {least} to {most} pixels"),
            "Leave the size out to keep the pictures' own",
        ));
    }
    if let Some(number) = files.first_number.filter(|number| !FRAME_NUMBERS.contains(number)) {
        let (least, most) = (FRAME_NUMBERS.start(), FRAME_NUMBERS.end());
        return Err(Error::invalid(
            format!("the first number {number} is outside {least} to {most}"),
            "Leave the first number out to keep the plate's own",
        ));
    }
    check_colors(files)?;
    match to {
        Destination::Clip(path) => {
            let codec = Codec::for_path(files.codec, path)?;
            if files.movie_alpha == MovieAlpha::Premultiplied && !codec.has_alpha() {
                return Err(Error::invalid(
                    format!("{} keeps no alpha: {to} cannot be premultiplied", codec.name()),
                    ("Write ProRes 4444 (.mov) or FFV1 (.mkv), or leave the alpha out", "leave --movie-alpha out"),
                ));
            }
        }
        Destination::Stills(_) => {
            if let Some(codec) = files.codec {
                return Err(Error::invalid(
                    format!("{} is a movie codec, but {to} are stills", codec.name()),
                    format!("Write a movie, such as clip{}, or leave the codec out", codec.ending()),
                ));
            }
        }
    }
    if files.resume && files.existing == Existing::Keep {
        return Err(Error::invalid(
            "an export cannot both resume and keep existing files",
            ("Leave one of the two out", "--resume or --keep"),
        ));
    }
    if files.resume && matches!(to, Destination::Clip(_)) {
        return Err(Error::invalid(
            format!("{to} is a movie, and an export to a movie cannot resume"),
            ("Write stills, such as out.%04d.png, or start over", "leave --resume out"),
        ));
    }
    if files.layers && !to.is_linear() {
        return Err(Error::invalid(
            format!("light layers cannot be written to {to}, which is not an EXR"),
            "Write for example out.%04d.exr, or leave the layers out",
        ));
    }
    Ok(())
}

#[cfg(test)]
#[path = "writer_tests.rs"]
mod tests;
