//! Presentation time of each frame of a movie.
//!
//! A header with a frame count and a constant frame duration is trusted, and each decoded frame is checked
//! against it. Otherwise ffprobe lists the movie's packets in the background, in storage order; the index holds
//! their times in presentation order. It is a file of eight bytes per frame, so that a movie of twenty hours
//! takes no more memory than a short one. It is kept until the movie's size or modification time changes.

use super::info::{EvenTimes, Info};
use super::process::{self, Process, TICK, Tools};
use base::error::{Error, Result};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::mpsc::sync_channel;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::SystemTime;

/// The file's first bytes: its kind and version.
const MAGIC: &[u8; 8] = b"ALMOVIE1";
/// Size of the header in bytes: magic, stamp of three numbers, number of frames.
const HEADER: u64 = 40;
/// Maximum number of frames stored before one with an earlier time: codecs allow 16.
const REORDERED: usize = 64;
/// Maximum number of indices in the folder.
const MOST_KEPT: usize = 200;
/// Frames per piece of the list.
const PIECE: usize = 512;

/// Stamp that distinguishes a movie from another with the same name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Stamp {
    pub bytes: u64,
    changed: u128,
}

impl Stamp {
    /// The stamp of a file.
    ///
    /// # Errors
    /// When it is missing or not a file.
    pub fn from_path(path: &Path) -> Result<Self> {
        let file = base::files::open(path).and_then(|file| file.metadata());
        let data = file.map_err(|e| Error::io("open", path, e, "Check that the movie is there and can be read"))?;
        let changed = data.modified().ok();
        let since = changed.and_then(|at| at.duration_since(SystemTime::UNIX_EPOCH).ok());
        Ok(Self { bytes: data.len(), changed: since.map_or(0, |since| since.as_nanos()) })
    }

    fn to_bytes(self) -> [u8; 24] {
        let mut all = [0; 24];
        all[..8].copy_from_slice(&self.bytes.to_le_bytes());
        all[8..].copy_from_slice(&self.changed.to_le_bytes());
        all
    }
}

/// The times of a movie's frames, in units of its time base.
#[derive(Clone, Debug)]
pub(crate) enum Index {
    /// Frame n is shown at start + n · step, and is a key frame.
    Even { start: i64, step: i64, count: u64 },
    /// Listed packet by packet.
    Listed(Arc<Listed>),
}

#[derive(Debug)]
pub(crate) struct Listed {
    file: Mutex<File>,
    state: Mutex<State>,
    grown: Condvar,
    name: PathBuf,
}

#[derive(Debug, Default)]
struct State {
    /// Number of frames listed so far.
    count: u64,
    /// End of the list: Ok when all frames are known, or the reason that there are no more.
    ended: Option<std::result::Result<(), String>>,
}

impl Index {
    /// The movie's index: its header's, the cached one, or one that is being made.
    ///
    /// # Errors
    /// When ffprobe cannot be started, or the file cannot be created.
    pub fn new(path: &Path, info: &Info, stamp: Stamp, tools: &Tools) -> Result<Self> {
        if let Some(EvenTimes { start, step, count }) = info.even {
            return Ok(Self::Even { start, step, count });
        }
        Self::listed(path, info, stamp, tools)
    }

    /// The index packet by packet.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn listed(path: &Path, info: &Info, stamp: Stamp, tools: &Tools) -> Result<Self> {
        let kept = tools.cache.as_ref().map(|folder| kept_at(folder, path, info.stream));
        if let Some(listed) = kept.as_ref().and_then(|kept| Listed::open(kept, path, stamp)) {
            return Ok(Self::Listed(Arc::new(listed)));
        }
        Ok(Self::Listed(Listed::make(path, info, stamp, kept, tools)?))
    }

    /// Number of frames. Waits until all are known.
    ///
    /// # Errors
    /// When the movie cannot be listed.
    pub fn count(&self) -> Result<u64> {
        match self {
            Self::Even { count, .. } => Ok(*count),
            Self::Listed(listed) => listed.wait(u64::MAX),
        }
    }

    /// Time of frame `frame`; `None` beyond the last. Waits until it is known.
    ///
    /// # Errors
    /// When the movie cannot be listed.
    pub fn time(&self, frame: u64) -> Result<Option<i64>> {
        match self {
            Self::Even { start, step, count } => Ok((frame < *count).then(|| start + frame as i64 * step)),
            Self::Listed(listed) => {
                let there = listed.wait(frame.saturating_add(1))? > frame;
                there.then(|| listed.read(frame).map(|(time, _)| time)).transpose()
            }
        }
    }

    /// The last key frame up to `frame`, from which all later ones can be decoded, and its time; `None` if
    /// decoding starts with the file.
    ///
    /// # Errors
    /// When the index cannot be read.
    pub fn key_before(&self, frame: u64) -> Result<Option<(u64, i64)>> {
        match self {
            Self::Even { start, step, .. } => Ok((frame > 0).then(|| (frame, start + frame as i64 * step))),
            Self::Listed(listed) => {
                for at in (1..=frame).rev() {
                    if let (time, true) = listed.read(at)? {
                        return Ok(Some((at, time)));
                    }
                }
                Ok(None)
            }
        }
    }
}

/// Path of the index of a movie's stream: unique for each path.
fn kept_at(folder: &Path, path: &Path, stream: usize) -> PathBuf {
    let full = path.canonicalize().unwrap_or_else(|_| path.to_path_buf());
    let hash = base::Fnv::from_bytes(full.as_os_str().as_encoded_bytes());
    folder.join(format!("{hash}-{stream}.index"))
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Listed {
    /// The cached index, if it is complete and the movie has not changed since.
    fn open(kept: &Path, movie: &Path, stamp: Stamp) -> Option<Self> {
        let mut file = base::files::open_own(kept, OpenOptions::new().read(true)).ok()?;
        let mut head = [0; HEADER as usize];
        file.read_exact(&mut head).ok()?;
        let (magic, said) = head.split_at(8);
        let count = u64::from_le_bytes(said[24..].try_into().ok()?);
        let is_whole = count.checked_mul(8)?.checked_add(HEADER)? == file.metadata().ok()?.len();
        let is_same = magic == MAGIC && said[..24] == stamp.to_bytes();
        (is_whole && is_same).then(|| Self {
            file: Mutex::new(file),
            state: Mutex::new(State { count, ended: Some(Ok(())) }),
            grown: Condvar::new(),
            name: movie.to_path_buf(),
        })
    }

    /// Starts listing the movie's packets in the background.
    fn make(path: &Path, info: &Info, stamp: Stamp, kept: Option<PathBuf>, tools: &Tools) -> Result<Arc<Self>> {
        let unfinished = kept.as_ref().and_then(|kept| {
            remove_old(kept.parent()?);
            base::files::Unfinished::beside(kept).ok()
        });
        let refuse = |e| Error::io("write", std::env::temp_dir(), e, "Check that the disk has room");
        let (file, mut out) = match &unfinished {
            Some(unfinished) => {
                let open = || OpenOptions::new().read(true).write(true).open(unfinished.path());
                (open().map_err(refuse)?, open().map_err(refuse)?)
            }
            None => {
                let file = tempfile::NamedTempFile::new().map_err(refuse)?;
                (file.reopen().map_err(refuse)?, file.into_file())
            }
        };
        let listed = Arc::new(Self {
            file: Mutex::new(file),
            state: Mutex::default(),
            grown: Condvar::new(),
            name: path.to_path_buf(),
        });
        // The thread ends when the index is no longer used.
        let weak = Arc::downgrade(&listed);
        let (path, stream, tools) = (path.to_path_buf(), info.stream, tools.clone());
        std::thread::spawn(move || {
            let mut add = |source| -> std::result::Result<u64, String> {
                let mut count = 0;
                let say = |e: std::io::Error| format!("its index cannot be written: {e}");
                out.seek(SeekFrom::Start(HEADER)).map_err(say)?;
                list(&path, stream, source, &tools, |piece| {
                    let bytes: Vec<u8> = (piece.iter().flat_map(|packed| packed.to_le_bytes())).collect();
                    out.write_all(&bytes).map_err(say)?;
                    count += piece.len() as u64;
                    let listed = weak.upgrade().ok_or("the index is no longer used")?;
                    locked(&listed.state).count = count;
                    listed.grown.notify_all();
                    Ok(())
                })?;
                let mut head = MAGIC.to_vec();
                head.extend(stamp.to_bytes());
                head.extend(count.to_le_bytes());
                (out.seek(SeekFrom::Start(0)).and_then(|_| out.write_all(&head))).map_err(say)?;
                Ok(count)
            };
            let mut ended = add(Times::Packets);
            let is_new = |listed: Arc<Self>| locked(&listed.state).count == 0;
            if ended.as_ref().is_err_and(|e| e == NO_TIMES) && weak.upgrade().is_some_and(is_new) {
                ended = add(Times::Frames);
            }
            if let (Ok(1..), Some(unfinished), Some(kept)) = (&ended, unfinished, &kept) {
                // Without it the movie is listed again next time.
                let _ = unfinished.finish(kept);
            }
            if let Some(listed) = weak.upgrade() {
                locked(&listed.state).ended = Some(ended.map(|_| ()));
                listed.grown.notify_all();
            }
        });
        Ok(listed)
    }

    /// Waits until `count` frames are known, or all; returns the number of known frames.
    fn wait(&self, count: u64) -> Result<u64> {
        let mut state = locked(&self.state);
        loop {
            if state.count >= count {
                return Ok(state.count);
            }
            match &state.ended {
                Some(Ok(())) => return Ok(state.count),
                Some(Err(cause)) => {
                    return Err(Error::codec(
                        "list the frames of",
                        &self.name,
                        cause,
                        "Check that the file is whole, or rewrite it: ffmpeg -i FILE -c copy NEW.mov",
                    ));
                }
                None => {}
            }
            // ffprobe's own watchdog ends the wait; this only guards against a missed wake.
            let waited = self.grown.wait_timeout(state, 20 * TICK);
            state = waited.unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Time of a known frame, and true if it is a key frame.
    fn read(&self, frame: u64) -> Result<(i64, bool)> {
        let mut bytes = [0; 8];
        let mut file = locked(&self.file);
        let read = (file.seek(SeekFrom::Start(HEADER + 8 * frame))).and_then(|_| file.read_exact(&mut bytes));
        read.map_err(|e| Error::io("read the index of", &self.name, e, "Try again"))?;
        let packed = i64::from_le_bytes(bytes);
        Ok((packed >> 1, packed & 1 == 1))
    }
}

/// Source of the times.
#[derive(Clone, Copy, PartialEq)]
enum Times {
    /// Packet time stamps: nothing is decoded.
    Packets,
    /// Decoded frames, for packets without time stamps (MPEG program streams, AVI). Such a movie is always
    /// decoded from its start, since decoders guess the times after a seek.
    Frames,
}

const NO_TIMES: &str = "its pictures have no time stamps";

/// Sends the times of a movie's frames, in presentation order.
fn list(
    path: &Path,
    stream: usize,
    times: Times,
    tools: &Tools,
    mut add: impl FnMut(Vec<i64>) -> std::result::Result<(), String>,
) -> std::result::Result<(), String> {
    let entries = match times {
        Times::Packets => "packet=pts,dts,flags",
        Times::Frames => "frame=best_effort_timestamp",
    };
    let stream = stream.to_string();
    let words = ["-v", "error", "-of", "csv=p=0", "-select_streams", &stream, "-show_entries", entries];
    let mut arguments: Vec<std::ffi::OsString> = words.map(Into::into).to_vec();
    arguments.extend(process::input(path));
    let mut process = Process::start(&tools.ffprobe, arguments).map_err(|e| e.to_string())?;
    let words = process.listen(|_| {});
    let (send, pieces) = sync_channel(16);
    let (output, signs) = (process.output(), process.signs.clone());
    std::thread::spawn(move || {
        let mut sorted = Sorted::default();
        let lines = output.into_iter().flat_map(|output| BufReader::new(output).lines());
        for line in lines {
            signs.fetch_add(1, Ordering::Relaxed);
            let piece = line.map_err(|e| e.to_string()).and_then(|line| sorted.take(&line, times));
            let failed = piece.is_err();
            if let Some(piece) = piece.transpose()
                && (send.send(piece).is_err() || failed)
            {
                return;
            }
        }
        let _ = send.send(sorted.rest());
    });
    let mut found = false;
    while let Some(piece) = process.wait(&pieces, tools.patience).map_err(|e| e.to_string())? {
        let piece = piece?;
        found |= !piece.is_empty();
        add(piece)?;
    }
    if process.ended_well() || found { Ok(()) } else { Err(words.recv_timeout(TICK).unwrap_or_default()) }
}

/// Sorts packets into presentation order.
#[derive(Default)]
struct Sorted {
    heap: BinaryHeap<Reverse<i64>>,
    last: Option<i64>,
    ready: Vec<i64>,
    /// The last time, and the step before it.
    newest: i64,
    step: i64,
}

impl Sorted {
    /// Takes a line from ffprobe: `pts,dts,flags` or a frame's time. Returns a piece of the index when one is
    /// full.
    fn take(&mut self, line: &str, times: Times) -> std::result::Result<Option<Vec<i64>>, String> {
        let mut parts = line.split(',');
        let first = parts.next().unwrap_or_default();
        let flags = match times {
            Times::Packets => parts.nth(1),
            Times::Frames => (!first.is_empty()).then_some(""),
        };
        // Frames before an edit list's start are decoded, but not shown.
        let Some(flags) = flags.filter(|flags| !flags.contains('D')) else { return Ok(None) };
        let time: i64 = match first.parse() {
            Ok(time) => time,
            // Decoders do not know the last frame's time.
            Err(_) if times == Times::Frames => self.newest.saturating_add(self.step),
            Err(_) => return Err(NO_TIMES.to_owned()),
        };
        (self.step, self.newest) = (time.saturating_sub(self.newest), time);
        let packed = time.checked_mul(2).ok_or("its time stamps are too large")?;
        self.heap.push(Reverse(packed | i64::from(flags.contains('K'))));
        if self.heap.len() > REORDERED {
            self.pop()?;
        }
        Ok((self.ready.len() >= PIECE).then(|| std::mem::take(&mut self.ready)))
    }

    fn pop(&mut self) -> std::result::Result<(), String> {
        let Some(Reverse(packed)) = self.heap.pop() else { return Ok(()) };
        match self.last {
            Some(last) if packed >> 1 == last => return Ok(()),
            Some(last) if packed >> 1 < last => {
                return Err("its time stamps jump backwards".to_owned());
            }
            _ => {}
        }
        self.last = Some(packed >> 1);
        self.ready.push(packed);
        Ok(())
    }

    /// The remaining times at the end.
    fn rest(&mut self) -> std::result::Result<Vec<i64>, String> {
        while !self.heap.is_empty() {
            self.pop()?;
        }
        Ok(std::mem::take(&mut self.ready))
    }
}

/// Keeps the newest indices of a folder, and removes unfinished files.
fn remove_old(folder: &Path) {
    base::files::remove_left_over(folder);
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let is_index = |path: &PathBuf| path.extension().is_some_and(|e| e == "index");
    let mut kept: Vec<(SystemTime, PathBuf)> = (entries.map(|entry| entry.path()).filter(is_index))
        .filter_map(|path| Some((path.metadata().ok()?.modified().ok()?, path)))
        .collect();
    kept.sort();
    let excess = kept.len().saturating_sub(MOST_KEPT);
    for (_, path) in kept.drain(..excess) {
        let _ = std::fs::remove_file(path);
    }
}
