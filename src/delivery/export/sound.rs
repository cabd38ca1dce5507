//! The interview's sound under the exported frames.
//!
//! It is extracted before pictures are made, so that unreadable sound is reported at once, and cut to
//! the sample from the first frame's own time on: silence fills gaps. Sound keeps its pace, also under frames of uneven
//! times.

use super::encoder::{Encoder, PATIENCE, Unanswered, file_url};
use super::interview::{Interview, Source};
use super::rational_rate;
use base::error::{Error, Result};
use base::files::Unfinished;
use base::progress::Progress;
use serde::Deserialize;
use std::ffi::OsString;
use std::path::Path;
use std::process::Command;

/// Sound file beside its movie; removed on drop.
#[derive(Debug)]
pub struct Sound(Unfinished);

/// Inaudible difference in seconds: less than a frame.
const UNHEARD_S: f64 = 0.02;
const REMEDY: (&str, &str) = ("Check that the interview's movie is complete, or export without sound", "--no-sound");

/// Streams and times of a movie, from ffprobe.
#[derive(Deserialize)]
struct Probed {
    streams: Vec<Stream>,
    format: Times,
}

#[derive(Deserialize)]
struct Stream {
    codec_type: Option<String>,
    #[serde(flatten)]
    times: Times,
}

/// In seconds, as text; missing or "N/A" if unknown.
#[derive(Deserialize)]
struct Times {
    start_time: Option<String>,
    duration: Option<String>,
}

impl Sound {
    /// Sound of frames `first` to `last`, in a file beside the movie `path`. None without sound. Gaps and uneven times
    /// are reported.
    ///
    /// # Errors
    /// When the interview's movie cannot be read, the file cannot be written, or the user stops.
    pub fn extract(
        interview: &Interview,
        (first, last): (usize, usize),
        path: &Path,
        progress: &Progress,
    ) -> Result<Option<Self>> {
        let Some(source) = &interview.source else { return Ok(None) };
        let probed = probe(source)?;
        let is = |kind: &'static str| move |s: &&Stream| s.codec_type.as_deref() == Some(kind);
        let Some(sound) = probed.streams.iter().find(is("audio")) else {
            progress.say(format!("{} has no sound", source.file.display()));
            return Ok(None);
        };
        let (frames, seconds) = rational_rate(interview.frame_rate);
        let at = |frame: usize| frame as f64 * f64::from(seconds) / f64::from(frames);
        let whole = probed.format.start();
        let pictures = probed.streams.iter().find(is("video"));
        let even = pictures.map_or(0.0, |video| video.times.start()) + at(source.first_frame + first);
        let begins = match &*movies::open(&source.file)? {
            movies::Source::Movie(movie) => {
                let from = source.first_frame as u64;
                let drift = movie.drift((from + first as u64, from + last as u64), interview.frame_rate)?;
                if drift >= 1.0 {
                    progress.say(format!(
                        "{} has a variable frame rate, not {:.3} frames per second: sound starts in sync with the \
                         first frame, but drifts by up to {drift:.1} frames. Make the movie's rate constant \
                         before the import: ffmpeg -i FILE -fps_mode cfr NEW.mov",
                        source.file.display(),
                        interview.frame_rate
                    ));
                }
                movie.time_s(from + first as u64)?
            }
            movies::Source::Sequence(_) => None,
        };
        // ffmpeg counts from the start of the earliest stream.
        let start = (begins.unwrap_or(even) - whole).max(0.0);
        let length = at(last - first + 1);
        let sounds = sound.times.start() - whole..sound.times.end(whole);
        if sounds.start > start + UNHEARD_S || sounds.end < start + length - UNHEARD_S {
            progress.say(format!(
                "{}: the sound runs from {:.2} s to {:.2} s, the exported frames from {start:.2} s to {:.2} s; silence \
                 fills the gaps",
                source.file.display(),
                sounds.start,
                sounds.end,
                start + length
            ));
        }
        let fail = |e| Error::io("write", path, e, "Check that the folder can be written");
        let unfinished = Unfinished::beside(path).map_err(fail)?;
        let output = unfinished.path().to_path_buf();
        let line = arguments(source, start, length);
        let mut ffmpeg = Encoder::start("ffmpeg", line, output, PATIENCE)
            .map_err(|e| Error::io("start ffmpeg for", path, e, REMEDY))?;
        let cause = match ffmpeg.end(progress) {
            Ok(status) if status.success() => return Ok(Some(Self(unfinished))),
            Err(Unanswered::Stopped) => {
                return Err(Error::Cancelled { kept: "no movie was written".to_owned() });
            }
            Ok(status) => {
                format!("ffmpeg ended with {status}. ffmpeg says: {}", ffmpeg.complaints())
            }
            Err(Unanswered::Hung(patience)) => {
                format!("ffmpeg did not respond for {} s", patience.as_secs())
            }
            Err(Unanswered::Io(e)) => format!("ffmpeg cannot be waited for: {e}"),
        };
        Err(Error::codec("read the sound of", &source.file, cause, REMEDY))
    }

    /// Path of the file.
    pub fn path(&self) -> &Path {
        self.0.path()
    }
}

fn probe(source: &Source) -> Result<Probed> {
    let mut ffprobe = Command::new("ffprobe");
    ffprobe.args(["-v", "error", "-protocol_whitelist", "file"]);
    let entries = "stream=codec_type,start_time,duration:format=start_time,duration";
    ffprobe.args(["-show_entries", entries, "-of", "json", "-i"]);
    let fail = |cause: String| Error::codec("read the sound of", &source.file, cause, REMEDY);
    let output = (ffprobe.arg(file_url(&source.file)).output())
        .map_err(|e| Error::io("start ffprobe for", &source.file, e, REMEDY))?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        return Err(fail(said.split_whitespace().collect::<Vec<_>>().join(" ")));
    }
    serde_json::from_slice(&output.stdout).map_err(|e| fail(e.to_string()))
}

impl Times {
    fn start(&self) -> f64 {
        seconds(self.start_time.as_deref()).unwrap_or(0.0)
    }

    /// Seconds from `from` to the stream's end; infinite if unknown.
    fn end(&self, from: f64) -> f64 {
        let duration = seconds(self.duration.as_deref());
        duration.map_or(f64::INFINITY, |duration| self.start() - from + duration)
    }
}

fn seconds(text: Option<&str>) -> Option<f64> {
    text?.parse().ok().filter(|s: &f64| s.is_finite())
}

/// ffmpeg's arguments, up to the name of the output.
fn arguments(source: &Source, start: f64, length: f64) -> Vec<OsString> {
    let words = |line: &str| -> Vec<OsString> { line.split_whitespace().map(OsString::from).collect() };
    let mut line =
        words(&format!("-hide_banner -loglevel error -nostats -nostdin -y -ss {start:.6} -protocol_whitelist file -i"));
    line.push(file_url(&source.file));
    line.extend(words(&format!(
        "-map 0:a -vn -sn -dn -af aresample=async=1:first_pts=0,apad=whole_dur={length:.6} -t {length:.6} \
         -c:a pcm_s24le -f matroska"
    )));
    line
}

#[cfg(test)]
#[path = "sound_tests.rs"]
mod tests;
