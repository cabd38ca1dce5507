//! A movie, encoded by the system's ffmpeg as a child process that reads raw frames.

use super::encoder::{Encoder, PATIENCE, Unanswered};
use super::rational_rate;
use super::still::{no_display, no_light, straight, word_from_unit};
use super::time_code::TimeCode;
use base::error::{Error, Result};
use base::files::Unfinished;
use base::progress::Progress;
use compositor::Picture;
use imaging::color::byte_from_unit;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Writes a movie frame by frame. `.mp4` is H.264 for review; `.mov` is ProRes 4444 with straight alpha.
/// Both are tagged Rec.709. The file appears under its name when [`ClipWriter::finish`] has returned;
/// a writer that is dropped before leaves nothing.
#[derive(Debug)]
pub struct ClipWriter {
    path: PathBuf,
    // In this order: ffmpeg has ended when its file is removed.
    encoder: Encoder,
    /// What ffmpeg writes; `None` once it has its name.
    unfinished: Option<Unfinished>,
    size: (usize, usize),
    alpha: bool,
}

impl ClipWriter {
    /// Starts a movie of `width × height` pixels (odd sizes are padded by repeating the last column or
    /// row, since H.264 halves its colour) at `frame_rate` frames per second. Its first frame is number
    /// `first` of the interview, which a `.mov` keeps as its time code.
    ///
    /// # Errors
    /// When ffmpeg is not installed, the size or rate is impossible, or the folder cannot be made.
    pub fn create(
        path: &Path,
        size: (usize, usize),
        frame_rate: f64,
        first: usize,
    ) -> Result<Self> {
        Self::create_with(("ffmpeg", PATIENCE), path, size, frame_rate, first)
    }

    fn create_with(
        (program, patience): (&str, Duration),
        path: &Path,
        (width, height): (usize, usize),
        frame_rate: f64,
        first: usize,
    ) -> Result<Self> {
        let impossible = |problem: String| {
            Error::invalid(
                format!("cannot write {}: {problem}", path.display()),
                "Check the project's size and frame rate",
            )
        };
        if width == 0 || height == 0 {
            return Err(impossible(format!(
                "a picture of {width} × {height} pixels is empty"
            )));
        }
        if !(0.01..=1000.0).contains(&frame_rate) {
            return Err(impossible(format!(
                "the frame rate {frame_rate} is outside 0.01 to 1000"
            )));
        }
        let fail =
            |e: std::io::Error| Error::io("write", path, e, "Check that the folder can be written");
        let unfinished = Unfinished::beside(path).map_err(fail)?;
        let alpha = path
            .extension()
            .is_some_and(|e| e.eq_ignore_ascii_case("mov"));
        let line = arguments((width, height), frame_rate, first, alpha);
        let output = unfinished.path().to_path_buf();
        let encoder = Encoder::start(program, line, output, patience).map_err(|e| {
            let remedy = "Movies need ffmpeg: install it (apt install ffmpeg) or write stills, such as out.%04d.png";
            Error::io("start ffmpeg for", path, e, remedy)
        })?;
        Ok(Self {
            path: path.to_path_buf(),
            encoder,
            unfinished: Some(unfinished),
            size: (width, height),
            alpha,
        })
    }

    /// Adds a frame.
    ///
    /// # Errors
    /// When the picture has another size or no display codes, ffmpeg has stopped or does not answer, or a stop was asked
    /// for.
    pub fn push(&mut self, picture: &Picture, progress: &Progress) -> Result<()> {
        if picture.alpha.size() != self.size {
            let say = |(w, h): (usize, usize)| format!("{w} × {h} pixels");
            return Err(Error::invalid(
                format!(
                    "cannot add a picture of {} to {}, whose frames have {}",
                    say(picture.alpha.size()),
                    self.path.display(),
                    say(self.size)
                ),
                "Keep one size for all frames",
            ));
        }
        let display = picture
            .display
            .as_ref()
            .ok_or_else(|| no_display(&self.path))?;
        let bytes: Vec<u8> = if self.alpha {
            let word = |v: f32| word_from_unit(v).to_le_bytes();
            let straight = straight(picture).ok_or_else(|| no_light(&self.path))?;
            let pixels: Vec<_> = straight.map(|p| p.map(word)).collect();
            padded(&pixels, self.size).flatten().flatten().collect()
        } else {
            let pixels: Vec<[u8; 3]> = display
                .0
                .pixels
                .iter()
                .map(|p| p.map(byte_from_unit))
                .collect();
            padded(&pixels, self.size).flatten().collect()
        };
        match self.encoder.feed(bytes, progress) {
            Ok(()) => Ok(()),
            // A closed pipe says nothing: the reason is among ffmpeg's own words.
            Err(Unanswered::Io(_)) => Err(match self.encoder.end(progress) {
                Ok(status) => self.failure(&format!("ffmpeg ended with {status}")),
                Err(why) => self.unanswered(&why),
            }),
            Err(why) => Err(self.unanswered(&why)),
        }
    }

    /// Ends the movie and gives it its name.
    ///
    /// # Errors
    /// When ffmpeg fails or does not end, or a stop was asked for; then there is no file.
    pub fn finish(mut self, progress: &Progress) -> Result<()> {
        match self.encoder.end(progress) {
            Ok(status) if status.success() => (),
            Ok(status) => return Err(self.failure(&format!("ffmpeg ended with {status}"))),
            Err(why) => return Err(self.unanswered(&why)),
        }
        let unfinished = self.unfinished.take();
        unfinished
            .map_or(Ok(()), |unfinished| unfinished.finish(&self.path))
            .map_err(|e| {
                Error::io(
                    "write",
                    &self.path,
                    e,
                    "Check that the folder can be written and the disk has room",
                )
            })
    }

    /// The error of an ffmpeg that did not answer, which is killed.
    fn unanswered(&mut self, why: &Unanswered) -> Error {
        self.encoder.kill();
        match why {
            Unanswered::Stopped => Error::Cancelled {
                kept: "no movie was written".to_owned(),
            },
            Unanswered::Hung(patience) => self.failure(&format!(
                "ffmpeg neither took a frame nor wrote anything for {} s and was ended",
                patience.as_secs()
            )),
            Unanswered::Io(e) => self.failure(&format!("ffmpeg cannot be waited for: {e}")),
        }
    }

    /// The error of an ffmpeg that has ended, as it explains it itself, if it does.
    fn failure(&self, ending: &str) -> Error {
        let said = self.encoder.complaints();
        let cause = match &*said {
            "" => ending.to_owned(),
            _ => format!("{ending}. ffmpeg says: {said}"),
        };
        Error::codec("write", &self.path, cause, remedy(&said))
    }
}

/// What to do about what ffmpeg says.
fn remedy(said: &str) -> &'static str {
    let says = |words: &[&str]| words.iter().any(|word| said.contains(word));
    if says(&["No space left", "Disk quota exceeded", "File too large"]) {
        "Make room on the disk, or write to another one"
    } else if says(&[
        "Permission denied",
        "Read-only file system",
        "not permitted",
    ]) {
        "Check that the folder can be written, also by ffmpeg, or write elsewhere"
    } else if says(&["ncoder", "codec"]) {
        "Check that this ffmpeg can encode H.264 and ProRes, or write stills"
    } else {
        "Check that this ffmpeg works (ffmpeg -version), or write stills, such as out.%04d.png"
    }
}

fn arguments(
    (width, height): (usize, usize),
    frame_rate: f64,
    first: usize,
    alpha: bool,
) -> Vec<String> {
    let even = |n: usize| n.next_multiple_of(2);
    let (frames, seconds) = rational_rate(frame_rate);
    let input = if alpha { "rgba64le" } else { "rgb24" };
    // ffmpeg would use the matrix of standard definition unless told, and leaves ProRes without tags
    // unless the frames carry them.
    let colors = "scale=out_color_matrix=bt709:out_range=tv,\
                  setparams=range=tv:color_primaries=bt709:color_trc=bt709:colorspace=bt709";
    // Without `-xerror` a movie that the disk had no room for would end as if nothing had happened.
    let mut line = format!(
        "-hide_banner -loglevel error -xerror -nostats -y -f rawvideo -pixel_format {input} \
         -video_size {}x{} -framerate {frames}/{seconds} -i pipe:0 -an -vf {colors} ",
        even(width),
        even(height),
    );
    // A second of less than one frame has no time code.
    if alpha && frame_rate >= 1.0 {
        line += &format!("-timecode {} ", TimeCode::of(first, frame_rate));
    }
    line += if alpha {
        "-c:v prores_ks -profile:v 4444 -pix_fmt yuva444p10le -alpha_bits 16 -f mov"
    } else {
        "-c:v libx264 -preset medium -crf 16 -pix_fmt yuv420p -movflags +faststart -f mp4"
    };
    line.split_whitespace().map(str::to_owned).collect()
}

/// Pixels row by row, with the last column and the last row repeated where their number is odd.
fn padded<T: Copy>(pixels: &[T], (width, height): (usize, usize)) -> impl Iterator<Item = T> + '_ {
    (0..height.next_multiple_of(2)).flat_map(move |y| {
        let row = &pixels[y.min(height - 1) * width..][..width];
        (0..width.next_multiple_of(2)).map(move |x| row[x.min(width - 1)])
    })
}

#[cfg(test)]
#[path = "clip_tests.rs"]
mod tests;
