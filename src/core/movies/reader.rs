//! A decoder that runs ahead on its own threads.

use super::Pixels;
use super::info::{Info, bits, is_grey};
use super::process::{self, Process, Tools, knows_fps_mode};
use base::error::Result;
use std::collections::BTreeMap;
use std::ffi::OsString;
use std::io::Read;
use std::path::Path;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, channel, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// Maximum number of bytes decoded ahead.
const AHEAD: usize = 64 << 20;
/// Bytes per read.
const PIECE: usize = 1 << 18;

/// A decoded frame with its presentation time.
pub(crate) struct Decoded {
    pub time: i64,
    /// True if the decoder reported damage.
    pub is_damaged: bool,
    pub pixels: Pixels,
}

/// Decodes a movie from a given time on.
#[derive(Debug)]
pub(crate) struct Reader {
    process: Process,
    frames: Receiver<Decoded>,
    words: Receiver<String>,
    patience: Duration,
    /// The frame after the last returned one.
    pub next: u64,
}

impl Reader {
    /// Starts to decode the frames at `from` or later. `key`: time of the key frame from which they can be
    /// decoded; `None` for the file's start.
    ///
    /// # Errors
    /// When ffmpeg cannot be started.
    pub fn start(path: &Path, info: &Info, key: Option<i64>, (next, from): (u64, i64), tools: &Tools) -> Result<Self> {
        let mut arguments: Vec<OsString> = ["-nostdin", "-hide_banner", "-loglevel", "info"].map(Into::into).to_vec();
        arguments.extend(["-progress", "pipe:2", "-copyts", "-noaccurate_seek"].map(Into::into));
        let (seconds, per) = info.time_base;
        if let Some(key) = key {
            // Times are rounded to microseconds: one more keeps the seek from landing before the key frame.
            let at = i128::from(key) * i128::from(seconds) * 1_000_000 / i128::from(per) + 1;
            arguments.extend(["-seek_timestamp", "1", "-ss"].map(Into::into));
            arguments.push(format!("{at}us").into());
        }
        if let Some(decoder) = info.decoder {
            arguments.extend(["-c:v", decoder].map(Into::into));
        }
        arguments.extend(process::input(path));
        let (width, height) = info.size;
        let start = (from as f64 - 0.5) * seconds as f64 / per as f64;
        let input = if info.is_rgb {
            String::new()
        } else {
            format!(":in_color_matrix={}:in_range={}", info.matrix, if info.is_full_range { "full" } else { "limited" })
        };
        let format = if info.has_alpha { "rgba64le" } else { "rgb48le" };
        let filters = format!(
            "showinfo=checksum=0,select=gte(t\\,{start:.9}),scale={width}:{height}:{CONVERT}{input}:out_range=full,format={format}"
        );
        arguments.extend(["-map", &format!("0:{}", info.stream), "-vf", &filters].map(Into::into));
        let (color_gain, alpha_gain) = gains(info, tools)?;
        let mode = if knows_fps_mode(tools)? { "-fps_mode" } else { "-vsync" };
        arguments.extend([mode, "passthrough", "-f", "rawvideo", "pipe:1"].map(Into::into));
        let mut process = Process::start(&tools.ffmpeg, arguments)?;
        let (tell, times) = channel();
        let mut seen = Seen::new(info.time_base);
        let words = process.listen(move |line| {
            if let Some((time, is_damaged)) = seen.line(line)
                && time >= from
            {
                let _ = tell.send((time, is_damaged));
            }
        });
        let channels = 3 + usize::from(info.has_alpha);
        let bytes = 2 * channels * width * height;
        let (send, frames) = sync_channel((AHEAD / bytes).clamp(1, 16));
        let (output, signs, has_alpha) = (process.output(), process.signs.clone(), info.has_alpha);
        std::thread::spawn(move || {
            let Some(mut output) = output else { return };
            loop {
                let mut codes = vec![0u8; bytes];
                for piece in codes.chunks_mut(PIECE) {
                    if output.read_exact(piece).is_err() {
                        return;
                    }
                    signs.fetch_add(1, Ordering::Relaxed);
                }
                // ffmpeg prints a frame's time before it writes the frame.
                let Ok((time, is_damaged)) = times.recv() else { return };
                let codes = codes.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]]));
                let codes = codes.enumerate().map(|(i, code)| {
                    let gain = if i % channels == 3 { alpha_gain } else { color_gain };
                    // Values beyond 65535 saturate.
                    (f32::from(code) * gain).round() as u16
                });
                let pixels = Pixels { size: (width, height), has_alpha, codes: codes.collect() };
                let decoded = Decoded { time, is_damaged, pixels };
                if send.send(decoded).is_err() {
                    return;
                }
            }
        });
        Ok(Self { process, frames, words, patience: tools.patience, next })
    }

    /// The next frame; `None` at the movie's end.
    ///
    /// # Errors
    /// When ffmpeg gives no sign of life.
    pub fn frame(&mut self) -> Result<Option<Decoded>> {
        self.process.wait(&self.frames, self.patience)
    }

    /// ffmpeg's last words.
    pub fn words(&self) -> String {
        self.words.recv_timeout(Duration::from_secs(1)).unwrap_or_default()
    }
}

/// Factors for ffmpeg's codes of colour and of alpha, so that white and opaque are 65535: its converter (up to 7.0 at
/// least) fills the lower bits with zeros, and nothing would ever count as clipped.
///
/// # Errors
/// When ffmpeg cannot be started.
fn gains(info: &Info, tools: &Tools) -> Result<(f32, f32)> {
    let (format, bits) = (&*info.format, bits(&info.format));
    let color_gain = match is_grey(format) || info.is_full_range && !info.is_rgb {
        true => 65535.0 / (((1 << bits) - 1) << (16 - bits)) as f32,
        false if info.is_rgb && bits > 8 => 1.0,
        false => measured("yuv420p", 0, tools)?,
    };
    let alpha_gain = if info.has_alpha { measured(format, 3, tools)? } else { 1.0 };
    Ok((color_gain, alpha_gain))
}

/// Factor for channel `channel` of an opaque white in limited range, measured once for each pixel format.
///
/// # Errors
/// When ffmpeg cannot be started.
fn measured(format: &str, channel: usize, tools: &Tools) -> Result<f32> {
    static KNOWN: Mutex<BTreeMap<(String, usize), f32>> = Mutex::new(BTreeMap::new());
    let key = (format.to_owned(), channel);
    if let Some(&gain) = KNOWN.lock().unwrap_or_else(PoisonError::into_inner).get(&key) {
        return Ok(gain);
    }
    let filters = format!(
        "color=white:s=16x16:r=1:d=1,format={format},scale=16:16:{CONVERT}:in_range=limited:out_range=full,format=rgba64le"
    );
    let words =
        ["-nostdin", "-v", "error", "-f", "lavfi", "-i", &filters, "-frames:v", "1", "-f", "rawvideo", "pipe:1"];
    let said = process::run(&tools.ffmpeg, words.map(Into::into).to_vec(), tools.patience)?.unwrap_or_default();
    let code = said.chunks_exact(2).nth(channel);
    let code = code.map_or(0.0, |b| f32::from(u16::from_le_bytes([b[0], b[1]])));
    let gain = Some(65535.0 / code).filter(|gain| (1.0..1.02).contains(gain)).unwrap_or(1.0);
    KNOWN.lock().unwrap_or_else(PoisonError::into_inner).insert(key, gain);
    Ok(gain)
}

/// Flags of the conversion of codes.
const CONVERT: &str = "flags=bicubic+accurate_rnd+full_chroma_int+full_chroma_inp";

/// Parser for the frame times in the output of ffmpeg's `showinfo`.
struct Seen {
    /// Seconds per unit of the movie's time stamps.
    base: (i64, i64),
    /// Seconds per unit of the filter's time stamps.
    filter_base: (i64, i64),
    is_damaged: bool,
}

impl Seen {
    fn new(base: (i64, i64)) -> Self {
        Self { base, filter_base: base, is_damaged: false }
    }

    /// A frame's time, and true if it is damaged, if the line is about a frame.
    fn line(&mut self, line: &str) -> Option<(i64, bool)> {
        if line.contains("corrupt decoded frame") || line.contains("error while decoding") {
            self.is_damaged = true;
        }
        if !line.starts_with("[Parsed_showinfo") {
            return None;
        }
        if let Some((_, rest)) = line.split_once("config in time_base: ") {
            let said = rest.split([',', ' ']).next().and_then(|said| said.split_once('/'));
            if let Some((Ok(a), Ok(b @ 1..))) = said.map(|(a, b)| (a.parse(), b.parse::<i64>())) {
                self.filter_base = (a, b);
            }
        }
        let time: i64 = line.split_once("pts:")?.1.split_whitespace().next()?.parse().ok()?;
        let damaged = std::mem::take(&mut self.is_damaged);
        let up = i128::from(time) * i128::from(self.filter_base.0) * i128::from(self.base.1);
        let down = i128::from(self.filter_base.1) * i128::from(self.base.0);
        let rounded = (2 * up + down).div_euclid(2 * down);
        Some((i64::try_from(rounded).ok()?, damaged))
    }
}
