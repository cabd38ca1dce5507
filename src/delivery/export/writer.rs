//! Writes the frames of one export, whatever files they go to.

use super::clip::Movie;
use super::codec::{Codec, Container};
use super::colors::{Encoding, check_config, check_linear};
use super::format::{Bits, Existing, Files, MovieAlpha};
use super::interview::Interview;
use super::join::is_whole;
use super::layers::LightLayers;
use super::movie_frames::MovieFrames;
use super::provenance::provenance_of;
use super::rebuild::Rebuild;
use super::relight::Part;
use super::scaled::{fitted, scaled};
use super::sound::Sound;
use super::still::{About, write_still};
use super::{ClipWriter, Destination, untaken};
use base::error::{Error, Result};
use base::files::remove_left_over;
use base::progress::Progress;
use compositor::{Picture, view};
use footage::scan::counted;
use scene::{Effects, Inspection, Output, Pass};
use std::path::PathBuf;

/// Writer of the frames, in order.
pub(super) struct Writer {
    /// Destination, as it was written out.
    pub to: String,
    files: Files,
    destination: Destination,
    clip: Option<ClipWriter>,
    /// The movie's sound, while it is written.
    sound: Option<Sound>,
    interview: Interview,
    encoding: Encoding,
    /// The frames of a movie that is joined later.
    parts: Option<MovieFrames>,
    /// Frames that are there already are kept.
    goes_on: bool,
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
    /// When the destination is not understood or cannot hold the request, a look-up table or the interview's sound
    /// cannot be read, or a movie cannot be begun.
    pub fn open(
        files: &Files,
        (first, last): (usize, usize),
        size: (usize, usize),
        interview: &Interview,
        part: Option<&Part>,
        progress: &Progress,
    ) -> Result<Self> {
        let to = match files.existing {
            Existing::Keep if part.is_none() => untaken(&files.to, first, last)?,
            _ => files.to.clone(),
        };
        let destination = check(files, &to, last - first + 1)?;
        let config = files.ocio.transform()?;
        let is_linear = destination.output() == Output::Linear;
        check_linear(config.as_ref(), &to, is_linear)?;
        let encoding = Encoding::open(files.space, files.lut.as_deref())?.with_config(config);
        let written = files.size.map_or(size, |longest| fitted(size, longest));
        // What exports to this folder left when they were killed. Beside other workers nothing is removed: whether their
        // files are left over, another machine's clock and locks cannot say for sure.
        if let (None, Some(folder)) = (part, destination.files(first, last).next().and_then(folder))
        {
            remove_left_over(&folder);
        }
        let (mut clip, mut sound, mut parts) = (None, None, None);
        if let (Destination::Clip(path), Some(part)) = (&destination, part) {
            let codec = Codec::of(files.codec, path)?;
            parts = Some(MovieFrames::new(&part.folder, codec, files.movie_alpha));
        } else if let Destination::Clip(path) = &destination {
            let codec = Codec::of(files.codec, path)?;
            if !files.no_sound {
                sound = Sound::extract(interview, (first, last), path, progress)?;
            }
            // A movie for review has a time code only if the interview has.
            let counted = Container::of(path) != Some(Container::Mp4);
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
                    "{} has even sizes: the last column or row is repeated, {width} × {height}",
                    codec.name()
                ));
            }
        }
        Ok(Self {
            to: match (&parts, part) {
                (Some(_), Some(part)) => part.folder.display().to_string(),
                _ => to,
            },
            files: files.clone(),
            destination,
            clip,
            sound,
            interview: interview.clone(),
            encoding,
            parts,
            goes_on: files.resume || part.is_some(),
            size: (written != size).then_some(written),
            done: 0,
        })
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
        made_of: Option<&str>,
        progress: &Progress,
    ) -> Result<Option<Rebuild>> {
        let check = self.put(frame, picture, lights, made_of, progress);
        let check = check.map_err(|e| self.kept(e))?;
        self.done += 1;
        Ok(check)
    }

    fn put(
        &mut self,
        frame: usize,
        picture: &Picture,
        lights: Option<Lights>,
        made_of: Option<&str>,
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
                let lights = lights.map(|lights| self.prepared(lights, &shown));
                let about = About {
                    time_code: self.interview.time_code(frame),
                    frame_rate: self.interview.frame_rate,
                    bits: self.files.bits,
                    exr: self.files.exr,
                    encoding: &self.encoding,
                    reel: self.interview.reel(),
                    provenance: made_of,
                    layers: lights.as_ref().map(|lights| &lights.layers),
                };
                write_still(&path, &shown, &about)?;
                let check = lights.as_ref().map(|lights| {
                    let subject =
                        Picture { linear: lights.subject.linear.clone(), ..shown.clone() };
                    Rebuild::of_written(&path, &subject, &about)
                });
                check.transpose()
            }
            (Destination::Clip(_), Some(clip)) => clip.push(&shown, progress).map(|()| None),
            (Destination::Clip(_), None) => {
                let mut parts = self.parts.iter();
                parts
                    .try_for_each(|parts| parts.write(frame, &shown, &self.encoding, made_of))
                    .map(|()| None)
            }
        }
    }

    /// Lamps at the size of the picture `shown` and with what it has besides them, as the file's primaries need them.
    fn prepared(&self, Lights { layers, subject }: Lights, shown: &Picture) -> Lights {
        let size = shown.alpha.size();
        let subject = scaled(&subject, size);
        let mut layers = layers.scaled(size);
        if let (Some(picture), Some(subject)) = (&shown.linear, &subject.linear) {
            layers = layers.with_rest(picture, subject);
        }
        let layers = layers.in_space(self.encoding.keeps_light());
        Lights { layers, subject }
    }

    /// True if each frame has a file of its own.
    pub fn writes_stills(&self) -> bool {
        matches!(self.destination, Destination::Stills(_)) || self.parts.is_some()
    }

    /// True if frames that are there already are kept.
    pub fn goes_on(&self) -> bool {
        self.goes_on
    }

    /// True if frame `frame` is there already, whole and made of the same; then it counts as written.
    pub fn keeps_frame(&mut self, frame: usize, made_of: &str) -> bool {
        let path = match (&self.destination, &self.parts) {
            (Destination::Stills(stills), _) => stills.path(frame),
            (Destination::Clip(_), Some(parts)) => parts.path(frame),
            (Destination::Clip(_), None) => return false,
        };
        let same = self.goes_on
            && provenance_of(&path).as_deref() == Some(made_of)
            && is_whole(&path, self.files.layers);
        self.done += usize::from(same);
        same
    }

    /// Adds a frame of a movie as ffmpeg takes it.
    ///
    /// # Errors
    /// As [`ClipWriter::feed`].
    pub fn feed(&mut self, bytes: Vec<u8>, progress: &Progress) -> Result<()> {
        (self.clip.as_mut()).map_or(Ok(()), |clip| clip.feed(bytes, progress))
    }

    /// Ends a movie.
    ///
    /// # Errors
    /// When it cannot be ended; then there is none.
    pub fn finish(&mut self, progress: &Progress) -> Result<()> {
        let finished = (self.clip.take()).map_or(Ok(()), |clip| clip.finish(progress));
        self.sound = None;
        finished
    }

    /// Files that remain if it ends now, in words.
    pub fn keeps(&self) -> String {
        match self.writes_stills() {
            true => {
                let are = if self.done == 1 { "is" } else { "are" };
                format!("{} {are} kept: {}", counted(self.done, "frame"), self.to)
            }
            false => "no movie was written".to_owned(),
        }
    }

    /// The error, which says what is kept.
    fn kept(&self, error: Error) -> Error {
        error.with_note(&self.keeps())
    }
}

/// Output that a scene has to make. Light that is to be shown in more than 8 bits is encoded by the writer, without the
/// dither of 8 bits, unless an effect on codes is asked for.
pub(super) fn output(
    files: &Files,
    destination: &Destination,
    encoding: &Encoding,
    effects: &Effects,
) -> Output {
    let deep = match destination {
        Destination::Stills(stills) => files.bits == Bits::Sixteen || stills.is_tiff(),
        Destination::Clip(path) => Codec::of(files.codec, path).is_ok_and(Codec::is_deep),
    };
    // The dither of 8 bits is for codes that stay as they are.
    let deep = deep || !encoding.is_plain();
    let plain = !effects.asks(Pass::Grain) && effects.inspection == Inspection::Picture;
    match destination.output() {
        Output::Display if deep && plain => Output::Linear,
        output => output,
    }
}

/// The folder that holds a file.
fn folder(file: PathBuf) -> Option<PathBuf> {
    let folder = file.parent()?;
    let here = folder.as_os_str().is_empty();
    Some(if here { ".".into() } else { folder.to_path_buf() })
}

/// Refuses files that their destination cannot hold.
///
/// # Errors
/// Then; the sentence says why.
pub fn check_files(files: &Files, frames: usize) -> Result<()> {
    check(files, &files.to, frames).map(drop)
}

/// The destination `to`, as far as `frames` frames can be written there as `files` says.
///
/// # Errors
/// When it is not understood, or cannot hold the files.
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
    let is_linear = destination.output() == Output::Linear;
    let table = files.lut.as_deref();
    Encoding::check(files.space, table, to, is_linear)?;
    check_config(&files.ocio, (files.space, table), to, is_linear)?;
    match &destination {
        Destination::Clip(path) => {
            let codec = Codec::of(files.codec, path)?;
            if files.movie_alpha == MovieAlpha::Premultiplied && !codec.has_alpha() {
                return Err(Error::invalid(
                    format!("{} keeps no alpha: {to} cannot be premultiplied", codec.name()),
                    (
                        "Write ProRes 4444 (.mov) or FFV1 (.mkv), or no alpha of a movie",
                        "leave --movie-alpha out",
                    ),
                ));
            }
        }
        Destination::Stills(_) => {
            if let Some(codec) = files.codec {
                return Err(Error::invalid(
                    format!("{} is a movie's, and {to} are stills", codec.name()),
                    format!(
                        "Write a movie, such as clip{}, or leave the codec out",
                        codec.ending()
                    ),
                ));
            }
        }
    }
    if files.resume && files.existing == Existing::Keep {
        return Err(Error::invalid(
            "an export that resumes cannot keep existing files under their names",
            ("Leave one of both out", "--resume or --keep"),
        ));
    }
    if files.resume && matches!(destination, Destination::Clip(_)) {
        return Err(Error::invalid(
            format!("{to} is a movie, which is written whole: it cannot resume"),
            ("Write stills, such as out.%04d.png, or start over", "leave --resume out"),
        ));
    }
    if files.layers && !is_linear {
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
