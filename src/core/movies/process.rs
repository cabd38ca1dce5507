//! ffmpeg and ffprobe as processes: file names are never parsed as options, and processes are killed when they
//! must end.

use base::error::{Error, Result};
use std::ffi::{OsStr, OsString};
use std::io::{BufRead, BufReader, ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Interval between checks that a process is still alive.
pub(crate) const TICK: Duration = Duration::from_millis(50);
/// Number of characters of error output to keep.
const TAIL: usize = 600;
/// Maximum size of ffprobe's output about a file's streams, in bytes.
const MOST_SAID: u64 = 4 << 20;

/// The programs, and the folder of the indices.
#[derive(Clone, Debug)]
pub struct Tools {
    /// The program that decodes.
    pub ffmpeg: OsString,
    /// The program that lists a file's contents.
    pub ffprobe: OsString,
    /// The folder of the indices; `None` caches none.
    pub cache: Option<PathBuf>,
    /// Longest time in which a process may neither read nor write.
    pub patience: Duration,
}

impl Default for Tools {
    fn default() -> Self {
        Self {
            ffmpeg: "ffmpeg".into(),
            ffprobe: "ffprobe".into(),
            cache: dirs::cache_dir().map(|folder| folder.join("afterlight/movies")),
            patience: Duration::from_secs(120),
        }
    }
}

/// The file's name as an ffmpeg argument. A colon, dash, quote or line break in it has no special meaning, and
/// only local files are opened, whatever a playlist or a reference inside the file names.
pub(crate) fn input(file: &Path) -> Vec<OsString> {
    let mut name = OsString::from("file:");
    name.push(file);
    let words = ["-protocol_whitelist", "file,pipe", "-i"];
    words.iter().map(OsString::from).chain([name]).collect()
}

/// A running process. Dropping it kills it and all its children.
#[derive(Debug)]
pub(crate) struct Process {
    child: Child,
    /// Grows with each sign of life.
    pub signs: Arc<AtomicU64>,
    program: OsString,
}

impl Process {
    /// Starts `program` with its output and its error stream piped.
    ///
    /// # Errors
    /// When it cannot be started.
    pub fn start(program: &OsStr, arguments: Vec<OsString>) -> Result<Self> {
        let mut command = Command::new(program);
        command.args(arguments);
        #[cfg(unix)]
        {
            // A separate process group can be killed with all its children, and Ctrl-C in a terminal reaches only
            // us.
            use std::os::unix::process::CommandExt;
            command.process_group(0);
        }
        command.stdin(Stdio::null());
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let child = command.spawn().map_err(|e| refused(program, e))?;
        Ok(Self { child, signs: Arc::default(), program: program.to_owned() })
    }

    /// Its output, once.
    pub fn output(&mut self) -> Option<ChildStdout> {
        self.child.stdout.take()
    }

    /// Sends each line of its error stream to `line`, on a separate thread, and sends the last words at its end.
    pub fn listen(&mut self, mut line: impl FnMut(&str) + Send + 'static) -> Receiver<String> {
        let (say, words) = channel();
        let (stream, signs) = (self.child.stderr.take(), self.signs.clone());
        std::thread::spawn(move || {
            let mut last = String::new();
            for said in stream.into_iter().flat_map(lines) {
                signs.fetch_add(1, Ordering::Relaxed);
                line(&said);
                if !said.starts_with("[Parsed_showinfo") && !said.contains('=') {
                    last.push_str(said.trim());
                    last.push(' ');
                    let excess = last.len().saturating_sub(TAIL);
                    let start = (excess..=last.len()).find(|&at| last.is_char_boundary(at));
                    last.drain(..start.unwrap_or(0));
                }
            }
            let _ = say.send(last.trim().to_owned());
        });
        words
    }

    /// Next value from `arrives`; `None` once nothing can arrive. The process may be silent for at most
    /// `patience`.
    ///
    /// # Errors
    /// When it is silent for longer: the process is killed.
    pub fn wait<T>(&mut self, arrives: &Receiver<T>, patience: Duration) -> Result<Option<T>> {
        let (mut signs, mut since) = (self.signs.load(Ordering::Relaxed), Instant::now());
        loop {
            match arrives.recv_timeout(TICK) {
                Ok(got) => return Ok(Some(got)),
                Err(RecvTimeoutError::Disconnected) => return Ok(None),
                Err(RecvTimeoutError::Timeout) => {}
            }
            let now = self.signs.load(Ordering::Relaxed);
            if now != signs {
                (signs, since) = (now, Instant::now());
            } else if since.elapsed() >= patience {
                kill_group(&mut self.child);
                return Err(Error::busy(
                    format!(
                        "{} neither read nor wrote anything for {} s and was ended",
                        self.program.to_string_lossy(),
                        patience.as_secs_f32()
                    ),
                    "Check that the disk with the movie answers, then try again",
                ));
            }
        }
    }

    /// True if it ended successfully. Waits for its end.
    pub fn ended_well(&mut self) -> bool {
        self.child.wait().is_ok_and(|status| status.success())
    }
}

/// Kills a program and its children, unless it has ended.
pub fn kill_group(child: &mut Child) {
    if !matches!(child.try_wait(), Ok(None)) {
        return;
    }
    #[cfg(unix)]
    if let Ok(group) = i32::try_from(child.id()) {
        use nix::sys::signal::{Signal, killpg};
        // A process that ended meanwhile has not been reaped yet, so its number is still its own.
        let _ = killpg(nix::unistd::Pid::from_raw(group), Signal::SIGKILL);
    }
    let _ = child.kill();
    let _ = child.wait();
}

impl Drop for Process {
    fn drop(&mut self) {
        kill_group(&mut self.child);
    }
}

/// The lines of a stream, of at most 64 KiB each; bytes that are not UTF-8 are replaced.
fn lines(stream: impl Read) -> impl Iterator<Item = String> {
    let mut stream = BufReader::new(stream);
    std::iter::from_fn(move || {
        let mut line = Vec::new();
        match stream.by_ref().take(1 << 16).read_until(b'\n', &mut line) {
            Ok(1..) => Some(String::from_utf8_lossy(&line).trim_end().to_owned()),
            _ => None,
        }
    })
}

/// Returns a process's whole output, at most 4 MiB.
///
/// # Errors
/// When it cannot be started, is silent for too long, or fails: its last words.
pub(crate) fn run(
    program: &OsStr,
    arguments: Vec<OsString>,
    patience: Duration,
) -> Result<std::result::Result<Vec<u8>, String>> {
    let mut process = Process::start(program, arguments)?;
    let words = process.listen(|_| {});
    let (say, said) = channel();
    let (output, signs) = (process.output(), process.signs.clone());
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        let mut output = output.into_iter().map(|output| output.take(MOST_SAID));
        let mut piece = [0; 1 << 14];
        if let Some(output) = &mut output.next() {
            while let Ok(n @ 1..) = output.read(&mut piece) {
                bytes.extend_from_slice(&piece[..n]);
                signs.fetch_add(1, Ordering::Relaxed);
            }
        }
        let _ = say.send(bytes);
    });
    let bytes = process.wait(&said, patience)?.unwrap_or_default();
    if process.ended_well() {
        Ok(Ok(bytes))
    } else {
        Ok(Err(words.recv_timeout(Duration::from_secs(1)).unwrap_or_default()))
    }
}

fn refused(program: &OsStr, e: std::io::Error) -> Error {
    if e.kind() != ErrorKind::NotFound {
        return Error::io("start", program, e, "Check that it can be run");
    }
    Error::missing(
        format!("movies need {}, which was not found", program.to_string_lossy()),
        "Install ffmpeg (it brings ffprobe), for example with your package manager or from ffmpeg.org",
    )
}

/// True if ffmpeg has `-fps_mode`, new in 5.1, in place of `-vsync`.
pub(crate) fn knows_fps_mode(tools: &Tools) -> Result<bool> {
    let said = run(&tools.ffmpeg, vec!["-version".into()], tools.patience)?.unwrap_or_default();
    let said = String::from_utf8_lossy(&said);
    let version = said.split_whitespace().nth(2).unwrap_or_default();
    let mut numbers = version.trim_start_matches('n').split(['.', '-']).map_while(|n| n.parse::<u32>().ok());
    // Versions without a number are built from newer sources.
    Ok(numbers.next().is_none_or(|major| (major, numbers.next().unwrap_or(0)) >= (5, 1)))
}
