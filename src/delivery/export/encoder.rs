//! ffmpeg as a child process: fed with frames, watched for signs of life, and killed when it hangs.

use base::progress::Progress;
use std::ffi::OsString;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, SystemTime};

/// Longest time without ffmpeg taking or writing a byte. A slow disk or a large frame takes seconds.
pub const PATIENCE: Duration = Duration::from_secs(120);
/// Time between two checks for a stop.
const TICK: Duration = Duration::from_millis(10);
/// Length of ffmpeg's messages that is kept, in bytes.
pub const TAIL: usize = 2000;
/// Bytes fed to ffmpeg at a time; each piece counts as a sign of life.
const PIECE: usize = 1 << 16;
/// Wait for the last messages of an ended process; a process that it started may keep its stderr open.
const LAST_WORDS: Duration = Duration::from_secs(1);

/// The child process.
#[derive(Debug)]
pub struct Encoder {
    child: Child,
    /// Frames for the feeding thread; None once there are no more.
    frames: Option<Sender<Vec<u8>>>,
    /// Result of writing each frame.
    taken: Receiver<io::Result<()>>,
    /// Number of bytes taken.
    bytes: Arc<AtomicU64>,
    complaints: Receiver<String>,
    /// Output file of ffmpeg.
    output: PathBuf,
    patience: Duration,
}

/// Reason to stop waiting for ffmpeg.
#[derive(Debug)]
pub enum Unanswered {
    /// The user stopped.
    Stopped,
    /// No sign of life for this long.
    Hung(Duration),
    /// The system refused.
    Io(io::Error),
}

impl Encoder {
    /// Starts `program`, which reads frames from stdin and writes `output`. It may be silent for `patience`.
    ///
    /// # Errors
    /// When the program cannot be started.
    pub fn start(program: &str, arguments: Vec<OsString>, output: PathBuf, patience: Duration) -> io::Result<Self> {
        let mut command = Command::new(program);
        command.args(arguments);
        command.arg(file_url(&output));
        #[cfg(unix)]
        {
            // A process group can be killed with all its children, and Ctrl-C in a terminal then reaches only us.
            use std::os::unix::process::CommandExt;
            command.process_group(0);
        }
        command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = command.spawn()?;
        let (stdin, stderr) = (child.stdin.take(), child.stderr.take());
        let (say, complaints) = channel();
        // Read while frames are written: a full pipe of messages would block ffmpeg for good. These threads are never
        // joined: a child of ffmpeg may keep its pipes open.
        std::thread::spawn(move || say.send(stderr.map(tail).unwrap_or_default()));
        let (frames, queue) = channel::<Vec<u8>>();
        let (tell, taken) = channel();
        let bytes = Arc::new(AtomicU64::new(0));
        let count = bytes.clone();
        std::thread::spawn(move || {
            let mut stdin = stdin;
            for frame in queue {
                let fed = stdin.as_mut().map_or(Err(io::ErrorKind::BrokenPipe.into()), |stdin| {
                    frame.chunks(PIECE).try_for_each(|piece| {
                        stdin.write_all(piece)?;
                        count.fetch_add(piece.len() as u64, Ordering::Relaxed);
                        Ok(())
                    })
                });
                if tell.send(fed).is_err() {
                    break;
                }
            }
        });
        Ok(Self { child, frames: Some(frames), taken, bytes, complaints, output, patience })
    }

    /// Waits until ffmpeg has taken the bytes of a frame.
    ///
    /// # Errors
    /// When ffmpeg does not take them; [`Unanswered::Io`] if it takes no more.
    pub fn feed(&mut self, frame: Vec<u8>, progress: &Progress) -> Result<(), Unanswered> {
        if let Some(frames) = &self.frames {
            // Without the thread there is no answer either.
            let _ = frames.send(frame);
        }
        self.wait(progress, |encoder| match encoder.taken.recv_timeout(TICK) {
            Ok(fed) => Some(fed),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => Some(Err(io::ErrorKind::BrokenPipe.into())),
        })
    }

    /// Closes ffmpeg's input and waits for its end.
    ///
    /// # Errors
    /// When ffmpeg does not end.
    pub fn end(&mut self, progress: &Progress) -> Result<ExitStatus, Unanswered> {
        self.frames = None;
        self.wait(progress, |encoder| match encoder.child.try_wait() {
            Ok(Some(status)) => Some(Ok(status)),
            Ok(None) => {
                std::thread::sleep(TICK);
                None
            }
            Err(e) => Some(Err(e)),
        })
    }

    /// Last messages of an ended ffmpeg; "" without any.
    pub fn complaints(&self) -> String {
        let said = self.complaints.recv_timeout(LAST_WORDS);
        let said = said.unwrap_or_default();
        said.split_whitespace().collect::<Vec<_>>().join(" ")
    }

    /// Kills ffmpeg and its children, unless it has ended.
    pub fn kill(&mut self) {
        self.frames = None;
        movies::kill_group(&mut self.child);
    }

    /// Polls `get` until it has a value, the user stops, or the patience ends.
    fn wait<T>(
        &mut self,
        progress: &Progress,
        mut get: impl FnMut(&mut Self) -> Option<io::Result<T>>,
    ) -> Result<T, Unanswered> {
        let mut signs = self.signs();
        // Counts polls instead of time: while we are suspended, ffmpeg may be too.
        let mut silence = Duration::ZERO;
        loop {
            if let Some(got) = get(self) {
                return got.map_err(Unanswered::Io);
            }
            if progress.cancelled() {
                return Err(Unanswered::Stopped);
            }
            silence += TICK;
            let now = self.signs();
            if now != signs {
                (signs, silence) = (now, Duration::ZERO);
            } else if silence >= self.patience {
                return Err(Unanswered::Hung(self.patience));
            }
        }
    }

    /// Signs of life: the number of bytes taken, and the length and time of the output file.
    fn signs(&self) -> (u64, Option<(u64, SystemTime)>) {
        let file = std::fs::metadata(&self.output).ok();
        let file = file.and_then(|data| Some((data.len(), data.modified().ok()?)));
        (self.bytes.load(Ordering::Relaxed), file)
    }
}

impl Drop for Encoder {
    fn drop(&mut self) {
        self.kill();
    }
}

/// File name for ffmpeg. Without the scheme ffmpeg reads a colon as a scheme and a dash as an option.
pub fn file_url(path: &Path) -> OsString {
    let mut url = OsString::from("file:");
    url.push(path);
    url
}

/// Last messages of a stream.
pub fn tail(mut stream: impl Read) -> String {
    let (mut kept, mut buffer) = (Vec::new(), [0u8; 1024]);
    // A broken stream has no more messages.
    while let Ok(n @ 1..) = stream.read(&mut buffer) {
        kept.extend_from_slice(&buffer[..n]);
        kept.drain(..kept.len().saturating_sub(TAIL));
    }
    String::from_utf8_lossy(&kept).into_owned()
}
