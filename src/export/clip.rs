//! A movie, encoded by the system's ffmpeg as a child process that reads raw frames.

use super::rational_rate;
use super::still::{no_display, no_light, straight, word_from_unit};
use super::time_code::TimeCode;
use base::error::{Error, Result};
use base::files::Unfinished;
use compositor::Picture;
use imaging::color::byte_from_unit;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::thread::JoinHandle;

/// How much of ffmpeg's complaints is kept.
const TAIL: usize = 2000;

/// Writes a movie frame by frame. `.mp4` is H.264 for review; `.mov` is ProRes 4444 with straight alpha.
/// Both are tagged Rec.709. The file appears under its name when [`ClipWriter::finish`] has returned;
/// a writer that is dropped before leaves nothing.
#[derive(Debug)]
pub struct ClipWriter {
    path: PathBuf,
    /// What ffmpeg writes; `None` once it has its name.
    unfinished: Option<Unfinished>,
    size: (usize, usize),
    alpha: bool,
    child: Child,
    frames: Option<ChildStdin>,
    complaints: Option<JoinHandle<String>>,
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
        Self::create_with("ffmpeg", path, size, frame_rate, first)
    }

    fn create_with(
        program: &str,
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
        let mut child = Command::new(program)
            .args(arguments((width, height), frame_rate, first, alpha))
            // Without the scheme a colon in the name would be read as one.
            .arg({
                let mut file = std::ffi::OsString::from("file:");
                file.push(unfinished.path());
                file
            })
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|e| {
                let remedy = "Movies need ffmpeg: install it (apt install ffmpeg) or write stills, such as out.%04d.png";
                Error::io("start ffmpeg for", path, e, remedy)
            })?;
        let stderr = child.stderr.take();
        // Read while frames are written: a full pipe of complaints would stop ffmpeg for good.
        let complaints = std::thread::spawn(move || stderr.map(tail).unwrap_or_default());
        Ok(Self {
            path: path.to_path_buf(),
            unfinished: Some(unfinished),
            size: (width, height),
            alpha,
            frames: child.stdin.take(),
            child,
            complaints: Some(complaints),
        })
    }

    /// Adds a frame.
    ///
    /// # Errors
    /// When the picture has another size or no display codes, or ffmpeg has stopped.
    pub fn push(&mut self, picture: &Picture) -> Result<()> {
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
        match self.frames.as_mut().map(|frames| frames.write_all(&bytes)) {
            Some(Ok(())) => Ok(()),
            // A closed pipe says nothing: the reason is among ffmpeg's own words.
            _ => Err(self.failure()),
        }
    }

    /// Ends the movie and gives it its name.
    ///
    /// # Errors
    /// When ffmpeg fails; then there is no file.
    pub fn finish(mut self) -> Result<()> {
        drop(self.frames.take());
        match self.child.wait() {
            Ok(status) if status.success() => (),
            _ => return Err(self.failure()),
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

    /// The error that ffmpeg explains.
    fn failure(&mut self) -> Error {
        drop(self.frames.take());
        // It ends by itself once its input is closed; one that has ended cannot be waited for twice.
        let status = self
            .child
            .wait()
            .map_or_else(|e| e.to_string(), |s| s.to_string());
        let said = self
            .complaints
            .take()
            .and_then(|thread| thread.join().ok())
            .unwrap_or_default();
        let said = said.split_whitespace().collect::<Vec<_>>().join(" ");
        let cause = if said.is_empty() {
            format!("ffmpeg ended with {status}")
        } else {
            format!("ffmpeg says: {said}")
        };
        let remedy = if cause.contains("No space left") {
            "Make room on the disk, or write to another one"
        } else {
            "Check that this ffmpeg can encode H.264 and ProRes, or write stills"
        };
        Error::codec("write", &self.path, cause, remedy)
    }
}

impl Drop for ClipWriter {
    fn drop(&mut self) {
        // After `finish` the child has ended: then these find nothing to do. The unfinished file goes with this.
        drop(self.frames.take());
        let _ = self.child.kill();
        let _ = self.child.wait();
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

/// The last words of a stream.
fn tail(mut stream: impl Read) -> String {
    let (mut kept, mut buffer) = (Vec::new(), [0u8; 1024]);
    // A stream that breaks has said what it had to say.
    while let Ok(n @ 1..) = stream.read(&mut buffer) {
        kept.extend_from_slice(&buffer[..n]);
        kept.drain(..kept.len().saturating_sub(TAIL));
    }
    String::from_utf8_lossy(&kept).into_owned()
}

#[cfg(test)]
#[path = "clip_tests.rs"]
mod tests;
