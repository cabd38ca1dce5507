//! A movie with random access to its frames.

use super::index::{Index, Stamp};
use super::info::Info;
use super::process::Tools;
use super::raw::refuse_raw;
use super::reader::Reader;
use super::{Pixels, cache};
use base::error::{Error, Result};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Maximum number of open decoders per movie, at different positions.
const READERS: usize = 3;
/// Largest distance that is decoded through instead of seeking, in frames.
const FORWARD: u64 = 24;

/// A movie with random access to its frames, from any number of threads.
#[derive(Debug)]
pub struct Movie {
    path: PathBuf,
    info: Info,
    stamp: Stamp,
    index: Mutex<Index>,
    /// The least recently used first.
    readers: Mutex<Vec<Reader>>,
    tools: Tools,
    /// Its number in this process, for the cache.
    number: u64,
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Movie {
    /// Opens a movie: reads its header, and starts to list its frames if the header has no times for them.
    ///
    /// # Errors
    /// When ffmpeg cannot read the file, or ffmpeg is missing.
    pub fn open(path: &Path, tools: &Tools) -> Result<Self> {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        refuse_raw(path)?;
        let stamp = Stamp::from_path(path)?;
        let info = Info::read(path, tools)?;
        let index = Index::new(path, &info, stamp, tools)?;
        Ok(Self {
            path: path.to_path_buf(),
            info,
            stamp,
            index: Mutex::new(index),
            readers: Mutex::default(),
            tools: tools.clone(),
            number: COUNT.fetch_add(1, Ordering::Relaxed),
        })
    }

    /// Content of its header.
    pub fn info(&self) -> &Info {
        &self.info
    }

    /// Number of frames. Waits until they are listed.
    ///
    /// # Errors
    /// When they cannot be listed, or there are none.
    pub fn count(&self) -> Result<u64> {
        match self.index().count()? {
            0 => Err(Error::codec("read", &self.path, "it has no frames", "Check that the file is whole")),
            count => Ok(count),
        }
    }

    /// Presentation time of frame `frame` in seconds, by the file's own clock, which need not start at 0; None beyond
    /// the last frame. Waits until it is listed.
    ///
    /// # Errors
    /// When the frames cannot be listed.
    pub fn time_s(&self, frame: u64) -> Result<Option<f64>> {
        let (numerator, denominator) = self.info.time_base;
        let seconds = |time| time as f64 * numerator as f64 / denominator as f64;
        Ok(self.index().time(frame)?.map(seconds))
    }

    /// Largest deviation of frames `first` to `last` from a constant rate of `frame_rate` frames per second, in
    /// frames: below 1 for a steady rate. Checks up to two thousand of them.
    ///
    /// # Errors
    /// When they cannot be listed.
    pub fn drift(&self, (first, last): (u64, u64), frame_rate: f64) -> Result<f64> {
        let index = self.index();
        let (numerator, denominator) = self.info.time_base;
        let frames_a_unit = frame_rate * numerator as f64 / denominator.max(1) as f64;
        let start = index.time(first)?.unwrap_or(0);
        let mut drift = 0f64;
        for frame in (first..=last).step_by((last.saturating_sub(first) / 1000 + 1) as usize) {
            let Some(time) = index.time(frame)? else { break };
            let even = (frame - first) as f64;
            drift = drift.max(((time - start) as f64 * frames_a_unit - even).abs());
        }
        Ok(drift)
    }

    /// True if the file has not changed since it was opened.
    pub(crate) fn is_current(&self) -> bool {
        Stamp::from_path(&self.path).is_ok_and(|now| now == self.stamp)
    }

    fn index(&self) -> Index {
        locked(&self.index).clone()
    }

    /// Frame `frame`, counted from 0 in presentation order.
    ///
    /// # Errors
    /// When the frame does not exist or cannot be decoded, or the file has changed since it was opened.
    pub fn frame(&self, frame: u64) -> Result<Arc<Pixels>> {
        if !self.is_current() {
            return Err(replaced(&self.path));
        }
        if let Some(pixels) = cache::get((self.number, frame)) {
            return Ok(pixels);
        }
        let found = self.find(frame)?;
        match found {
            Found::Frame(pixels) => Ok(pixels),
            Found::Missing { words, .. } => Err(self.failed(frame, &words)),
            // The header's constant step was wrong.
            Found::Elsewhere => {
                *locked(&self.index) = Index::listed(&self.path, &self.info, self.stamp, &self.tools)?;
                cache::forget(self.number);
                locked(&self.readers).clear();
                match self.find(frame)? {
                    Found::Frame(pixels) => Ok(pixels),
                    Found::Missing { words, .. } => Err(self.failed(frame, &words)),
                    Found::Elsewhere => Err(self.failed(frame, "not at its place in the file's index")),
                }
            }
        }
    }

    /// Drops all decoded frames and all decoders.
    #[cfg(test)]
    pub(crate) fn forget(&self) {
        cache::forget(self.number);
        locked(&self.readers).clear();
    }

    fn failed(&self, frame: u64, words: &str) -> Error {
        let words = if words.is_empty() { "no output from the decoder" } else { words };
        Error::codec("decode", &self.path, format!("frame {frame} is missing or damaged ({words})"), "Replace the file")
    }

    fn find(&self, frame: u64) -> Result<Found> {
        let index = self.index();
        let Some(time) = index.time(frame)? else {
            let count = index.count()?;
            return Err(Error::missing(
                format!(
                    "{} has no frame {frame}: its frames are 0 to {}",
                    self.path.display(),
                    count.saturating_sub(1)
                ),
                "Choose frames of the movie; if it was cut, import it again",
            ));
        };
        let mut reader = match self.take_reader(frame) {
            Some(reader) => reader,
            None => self.start(&index, frame, time, true)?,
        };
        let mut found = self.advance(&mut reader, &index, frame, time)?;
        // A seek may have come too late: the next one starts further back.
        if let (Found::Missing { .. }, true) = (&found, index.key_before(frame)?.is_some()) {
            let earlier = frame.saturating_sub(FORWARD);
            let from = index.time(earlier)?.unwrap_or(time);
            reader = self.start(&index, earlier, from, true)?;
            found = self.advance(&mut reader, &index, frame, time)?;
            // Decoding from the file's start misses nothing, but may take hours; key-frame codecs do not need it.
            if matches!(found, Found::Missing { is_sure: false, .. } if !self.info.is_intra) {
                reader = self.start(&index, frame, time, false)?;
                found = self.advance(&mut reader, &index, frame, time)?;
            }
        }
        if let Found::Frame(_) = found {
            let mut readers = locked(&self.readers);
            readers.push(reader);
            let excess = readers.len().saturating_sub(READERS);
            readers.drain(..excess);
        }
        Ok(found)
    }

    /// Takes a decoder that is close to the frame.
    fn take_reader(&self, frame: u64) -> Option<Reader> {
        let mut readers = locked(&self.readers);
        let ahead = |reader: &Reader| frame.checked_sub(reader.next).filter(|&way| way <= FORWARD);
        let nearest = (0..readers.len()).filter_map(|i| Some((ahead(&readers[i])?, i))).min();
        nearest.map(|(_, i)| readers.remove(i))
    }

    fn start(&self, index: &Index, frame: u64, time: i64, seek: bool) -> Result<Reader> {
        let key = if seek { index.key_before(frame)? } else { None };
        let key = key.map(|(_, time)| time);
        Reader::start(&self.path, &self.info, key, (frame, time), &self.tools)
    }

    /// Decodes up to the frame with this `time`.
    fn advance(&self, reader: &mut Reader, index: &Index, frame: u64, time: i64) -> Result<Found> {
        let mut is_sure = false;
        let missing = |words: &str, is_sure| Found::Missing { words: words.to_owned(), is_sure };
        while let Some(decoded) = reader.frame()? {
            is_sure |= decoded.time < time;
            // Skips frames that the decoder left out.
            while reader.next <= frame && index.time(reader.next)?.is_some_and(|next| next < decoded.time) {
                reader.next += 1;
            }
            if index.time(reader.next)? != Some(decoded.time) {
                if let Index::Even { .. } = index {
                    return Ok(Found::Elsewhere);
                }
                if decoded.time < time {
                    continue;
                }
                return Ok(missing("later frames follow", is_sure));
            }
            let number = reader.next;
            reader.next += 1;
            if decoded.is_damaged {
                if number == frame {
                    return Ok(missing("its data are damaged", true));
                }
                continue;
            }
            let pixels = Arc::new(decoded.pixels);
            cache::put((self.number, number), pixels.clone());
            match number.cmp(&frame) {
                std::cmp::Ordering::Less => {}
                std::cmp::Ordering::Equal => return Ok(Found::Frame(pixels)),
                std::cmp::Ordering::Greater => {
                    return Ok(missing("later frames follow", is_sure));
                }
            }
        }
        Ok(missing(&reader.words(), is_sure))
    }
}

impl Drop for Movie {
    fn drop(&mut self) {
        cache::forget(self.number);
    }
}

enum Found {
    Frame(Arc<Pixels>),
    /// Message of the decoder; and true if the frame is certainly missing, since one before it was decoded.
    Missing {
        words: String,
        is_sure: bool,
    },
    /// Frames are not at the times in the header.
    Elsewhere,
}

/// Error for a file that has changed since it was opened.
pub(crate) fn replaced(path: &Path) -> Error {
    Error::invalid(
        format!("{} was replaced or changed while it was open", path.display()),
        "Wait until it is written, then try again; if it is another movie, import it again",
    )
}
