//! Movie writer: the system's ffmpeg as a child process that reads raw frames.

use super::codec::{Codec, Container};
use super::colors::Encoding;
use super::encoder::{Encoder, PATIENCE, Unanswered, file_url};
use super::format::MovieAlpha;
use super::rational_rate;
use super::still::{no_display, no_light, over_black, straight, word_from_unit};
use super::time_code::TimeCode;
use base::error::{Error, Result};
use base::files::Unfinished;
use base::progress::Progress;
use compositor::Picture;
use imaging::color::byte_from_unit;
use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Properties of a movie besides its pictures.
#[derive(Clone, Debug)]
pub struct Movie {
    pub codec: Codec,
    /// In frames per second; 23.976 and similar values mean 24000/1001.
    pub frame_rate: f64,
    /// Time code of the first frame. None for a movie without time code.
    pub time_code: Option<TimeCode>,
    /// Reel name of the interview's movie.
    pub reel: Option<String>,
    pub encoding: Encoding,
    /// Alpha mode of a codec that keeps alpha.
    pub alpha: MovieAlpha,
    /// File with the sound of exactly these frames.
    pub sound: Option<PathBuf>,
}

/// Writes a movie frame by frame. The file gets its name when [`ClipWriter::finish`] returns;
/// a writer that is dropped earlier leaves no file.
#[derive(Debug)]
pub struct ClipWriter {
    path: PathBuf,
    // Drop order: ffmpeg must have ended when its file is removed.
    encoder: Encoder,
    /// File that ffmpeg writes; `None` once it is renamed.
    unfinished: Option<Unfinished>,
    size: (usize, usize),
    codec: Codec,
    encoding: Encoding,
    alpha: MovieAlpha,
}

impl ClipWriter {
    /// Starts a movie of `width × height` pixels. Odd sizes are padded by repeating the last column or
    /// row, except in FFV1.
    ///
    /// # Errors
    /// When ffmpeg is not installed, the size or rate is invalid, or the folder cannot be created.
    pub fn create(path: &Path, size: (usize, usize), movie: &Movie) -> Result<Self> {
        Self::create_with(("ffmpeg", PATIENCE), path, size, movie)
    }

    fn create_with(
        (program, patience): (&str, Duration),
        path: &Path,
        (width, height): (usize, usize),
        movie: &Movie,
    ) -> Result<Self> {
        let impossible = |problem: String| {
            Error::invalid(
                format!("cannot write {}: {problem}", path.display()),
                "Check the project's size and frame rate, or choose another codec",
            )
        };
        if width == 0 || height == 0 {
            return Err(impossible(format!("the picture is empty: {width} × {height} pixels")));
        }
        let frame_rate = movie.frame_rate;
        if !(0.01..=1000.0).contains(&frame_rate) {
            return Err(impossible(format!("the frame rate {frame_rate} is outside 0.01 to 1000")));
        }
        let container = Container::from_path(path).unwrap_or(Container::Mp4);
        let rate = rational_rate(frame_rate);
        if let Some(obstacle) = (movie.codec).obstacle((width, height), container, rate) {
            return Err(impossible(obstacle));
        }
        let fail = |e: std::io::Error| Error::io("write", path, e, "Check that the folder can be written");
        let unfinished = Unfinished::beside(path).map_err(fail)?;
        let line = arguments((width, height), container, movie);
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
            codec: movie.codec,
            encoding: movie.encoding.clone(),
            alpha: movie.alpha,
        })
    }

    /// Adds a frame.
    ///
    /// # Errors
    /// When the picture has a different size or no display codes, ffmpeg has stopped or does not answer, or the user
    /// stops.
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
        let bytes = frame_bytes(&self.path, (self.codec, self.alpha), &self.encoding, picture)?;
        self.feed(bytes, progress)
    }

    /// Adds a frame in the layout of [`frame_bytes`].
    ///
    /// # Errors
    /// When ffmpeg has stopped or does not answer, or the user stops.
    pub(super) fn feed(&mut self, bytes: Vec<u8>, progress: &Progress) -> Result<()> {
        match self.encoder.feed(bytes, progress) {
            Ok(()) => Ok(()),
            // A closed pipe carries no reason; ffmpeg's own messages do.
            Err(Unanswered::Io(_)) => Err(match self.encoder.end(progress) {
                Ok(status) => self.failure(&format!("ffmpeg ended with {status}")),
                Err(why) => self.unanswered(&why),
            }),
            Err(why) => Err(self.unanswered(&why)),
        }
    }

    /// Ends the movie and renames it to its final name.
    ///
    /// # Errors
    /// When ffmpeg fails or does not end, or the user stops. No file remains then.
    pub fn finish(mut self, progress: &Progress) -> Result<()> {
        match self.encoder.end(progress) {
            Ok(status) if status.success() => (),
            Ok(status) => return Err(self.failure(&format!("ffmpeg ended with {status}"))),
            Err(why) => return Err(self.unanswered(&why)),
        }
        let unfinished = self.unfinished.take();
        unfinished.map_or(Ok(()), |unfinished| unfinished.finish(&self.path)).map_err(|e| {
            Error::io("write", &self.path, e, "Check that the folder can be written and the disk has room")
        })
    }

    /// Error for an ffmpeg that did not answer, which is killed.
    fn unanswered(&mut self, why: &Unanswered) -> Error {
        self.encoder.kill();
        match why {
            Unanswered::Stopped => Error::Cancelled { kept: "no movie was written".to_owned() },
            Unanswered::Hung(patience) => self.failure(&format!(
                "ffmpeg neither took a frame nor wrote anything for {} s and was killed",
                patience.as_secs()
            )),
            Unanswered::Io(e) => self.failure(&format!("ffmpeg cannot be waited for: {e}")),
        }
    }

    /// Error for an ffmpeg that has ended, with its own message if there is one.
    fn failure(&self, ending: &str) -> Error {
        let said = self.encoder.complaints();
        let cause = match &*said {
            "" => ending.to_owned(),
            _ => format!("{ending}. ffmpeg says: {said}"),
        };
        Error::codec("write", &self.path, cause, remedy(&said))
    }
}

/// A picture in ffmpeg's layout for the movie at `path`, padded to a size that the codec accepts: codes row by row, or
/// luma, both chromas and alpha plane by plane.
///
/// # Errors
/// When the picture has no display codes, or no light for its alpha.
pub(super) fn frame_bytes(
    path: &Path,
    (codec, alpha): (Codec, MovieAlpha),
    encoding: &Encoding,
    picture: &Picture,
) -> Result<Vec<u8>> {
    if picture.display.is_none() {
        return Err(no_display(path));
    }
    let size = picture.alpha.size();
    let (from, to) = (size, codec.padded(size));
    let pixels: Vec<[f32; 4]> = if codec.has_alpha() {
        let straight = straight(picture, encoding).ok_or_else(|| no_light(path))?;
        straight.map(|pixel| alpha.of_straight(pixel)).collect()
    } else {
        let codes = over_black(picture, encoding).ok_or_else(|| no_light(path))?;
        codes.into_iter().map(|[r, g, b]| [r, g, b, 1.0]).collect()
    };
    Ok(if codec.is_planar() {
        let matrix = codec.tags(encoding.space).matrix;
        let codes: Vec<_> = pixels.into_iter().map(|pixel| limited_codes(pixel, matrix)).collect();
        let planes = 0..if codec.has_alpha() { 4 } else { 3 };
        let plane = |plane: usize| padded(&codes, from, to).flat_map(move |p| p[plane].to_le_bytes());
        planes.flat_map(plane).collect()
    } else if codec.has_alpha() {
        let word = |v: f32| word_from_unit(v).to_le_bytes();
        padded(&pixels, from, to).flat_map(|p| p.map(word)).flatten().collect()
    } else {
        padded(&pixels, from, to).flat_map(|[r, g, b, _]| [r, g, b].map(byte_from_unit)).collect()
    })
}

/// Luma and both chromas in 10 bits of limited range (ITU-R BT.709 and BT.2020), and alpha in 10 bits of full range, from
/// codes in `[0, 1]`.
fn limited_codes([r, g, b, alpha]: [f32; 4], matrix: &str) -> [u16; 4] {
    let (red, blue) = if matrix == "bt2020nc" { (0.2627, 0.0593) } else { (0.2126, 0.0722) };
    let luma = red * r + (1.0 - red - blue) * g + blue * b;
    let chroma = |value: f32, share: f32| 512.0 + 896.0 * (value - luma) / (2.0 * (1.0 - share));
    let codes = [64.0 + 876.0 * luma, chroma(b, blue), chroma(r, red), 1023.0 * alpha];
    codes.map(|code| code.round() as u16)
}

/// Remedy for an error message of ffmpeg.
fn remedy(said: &str) -> &'static str {
    let says = |words: &[&str]| words.iter().any(|word| said.contains(word));
    if says(&["No space left", "Disk quota exceeded", "File too large"]) {
        "Make room on the disk, or write to another one"
    } else if says(&["Permission denied", "Read-only file system", "not permitted"]) {
        "Check that the folder can be written, also by ffmpeg, or write elsewhere"
    } else if says(&["ncoder", "codec"]) {
        "Check that this ffmpeg can encode H.264 and ProRes, choose another codec, or write stills"
    } else {
        "Check that this ffmpeg works (ffmpeg -version), or write stills, such as out.%04d.png"
    }
}

/// ffmpeg's arguments, up to the name of the output. Frames come through stdin.
fn arguments(size: (usize, usize), container: Container, movie: &Movie) -> Vec<OsString> {
    let codec = movie.codec;
    let (width, height) = codec.padded(size);
    let (frames, seconds) = rational_rate(movie.frame_rate);
    // Without `-xerror` ffmpeg reports success after a full disk.
    let mut line = words(&format!(
        "-hide_banner -loglevel error -xerror -nostats -y -protocol_whitelist file,pipe -f rawvideo -pixel_format {} \
         -video_size {width}x{height} -framerate {frames}/{seconds} -i pipe:0",
        codec.input(),
    ));
    match &movie.sound {
        Some(sound) => {
            line.extend(words("-protocol_whitelist file -i"));
            line.push(file_url(sound));
            line.extend(words("-map 0:v -map 1:a -c:a"));
            line.extend(words(match container {
                Container::Mp4 => "aac -b:a 256k",
                Container::Mov | Container::Mkv | Container::Mxf => "pcm_s24le",
            }));
        }
        None => line.push("-an".into()),
    }
    line.extend(["-vf".into(), codec.filter(movie.encoding.space).into()]);
    // Below one frame per second there is no time code.
    if let Some(time) = movie.time_code.filter(|_| movie.frame_rate >= 1.0) {
        line.extend(["-timecode".into(), time.to_string().into()]);
        if container == Container::Mp4 {
            line.extend(words("-write_tmcd on"));
        }
    }
    if let Some(reel) = &movie.reel {
        let plain = |c: char| if c.is_control() { '_' } else { c };
        let reel: String = reel.chars().map(plain).collect();
        let key = match container {
            Container::Mxf => "-metadata",
            _ => "-metadata:s:v:0",
        };
        line.extend([key.into(), format!("reel_name={reel}").into()]);
    }
    if codec.has_alpha() {
        line.extend(["-metadata".into(), format!("comment={}", movie.alpha.words()).into()]);
    }
    line.extend(words(codec.encoder()));
    if container == Container::Mp4 {
        line.extend(words("-movflags +faststart"));
    }
    line.extend(words(&format!("-f {}", container.muxer())));
    line
}

fn words(line: &str) -> Vec<OsString> {
    line.split_whitespace().map(OsString::from).collect()
}

/// Pixels row by row, with the last column and the last row repeated up to the size `to`.
fn padded<T: Copy>(pixels: &[T], (width, height): (usize, usize), to: (usize, usize)) -> impl Iterator<Item = T> + '_ {
    (0..to.1).flat_map(move |y| {
        let row = &pixels[y.min(height - 1) * width..][..width];
        (0..to.0).map(move |x| row[x.min(width - 1)])
    })
}

#[cfg(test)]
#[path = "clip_tests.rs"]
mod tests;
