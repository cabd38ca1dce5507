//! A measure in a process of its own, as whoever started it sees it.

use super::child::REQUEST;
use super::measure::{Figure, Request};
use base::error::{self, Error};
use base::progress::Progress;
use std::ffi::OsString;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Interval of the checks that may end a process.
const LOOK: Duration = Duration::from_millis(20);

/// A process that measures. Dropped, it is ended.
pub struct Measuring {
    child: Child,
    figures: Receiver<Figure>,
    errors: Option<JoinHandle<String>>,
}

/// End of a process. The figures that it said before are known either way.
pub enum Ended {
    /// All was measured.
    Done,
    /// A sentence says what went wrong.
    Failed(String),
    /// It took longer than it may.
    Late,
    /// A stop was asked for.
    Stopped,
}

impl Measuring {
    /// Starts `program` for one measure; kernels that it times are kept in `kernels`, if that is another folder than the
    /// person's.
    ///
    /// # Errors
    /// When it cannot be started.
    pub fn start(program: &Path, request: &Request, kernels: Option<&Path>) -> error::Result<Self> {
        let request = serde_json::to_string(request)
            .map_err(|e| Error::bug(format!("a request is no JSON: {e}")))?;
        let mut command = Command::new(program);
        command.args([OsString::from("device"), REQUEST.into(), request.into()]);
        if let Some(folder) = kernels {
            command.env(gpu::KERNELS_FOLDER, folder);
        }
        Self::spawn(command)
    }

    /// Starts a process that says figures as [`super::answer`] does.
    ///
    /// # Errors
    /// When it cannot be started.
    pub fn spawn(mut command: Command) -> error::Result<Self> {
        // The process ends when this end of its input does: however this program ends, none is left over.
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        // Ctrl-C is for the program that asked: it ends what it started, and keeps what was measured.
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        let mut child = command.spawn().map_err(|e| {
            Error::io(
                "start",
                command.get_program(),
                e,
                "Each measure is a process of this program: check that it is still there",
            )
        })?;
        let figures = listen(child.stdout.take());
        let errors = Some(drain(child.stderr.take()));
        Ok(Self { child, figures, errors })
    }

    /// Waits for it for at most so long, and ends it then; `found` is told each figure as soon as it was said.
    pub fn wait(
        mut self,
        most: Duration,
        progress: &Progress,
        mut found: impl FnMut(Figure),
    ) -> Ended {
        let until = Instant::now() + most;
        let early = loop {
            match self.figures.recv_timeout(LOOK) {
                Ok(figure) => found(figure),
                // Its output is closed: it has ended, or is about to.
                Err(RecvTimeoutError::Disconnected) => match self.child.try_wait() {
                    Ok(None) => std::thread::sleep(LOOK),
                    _ => break None,
                },
                Err(RecvTimeoutError::Timeout) => {}
            }
            if progress.cancelled() {
                break Some(Ended::Stopped);
            }
            if Instant::now() > until {
                break Some(Ended::Late);
            }
        };
        if early.is_some() {
            self.end();
        }
        // What it said last.
        self.figures.iter().for_each(&mut found);
        if let Some(early) = early {
            return early;
        }
        let status = self.child.wait().ok();
        if status.is_some_and(|status| status.success()) {
            return Ended::Done;
        }
        let errors = self.errors.take().map(JoinHandle::join);
        Ended::Failed(why(status, &errors.and_then(Result::ok).unwrap_or_default()))
    }

    fn end(&mut self) {
        // One that has ended by itself needs no ending.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Measuring {
    fn drop(&mut self) {
        self.end();
    }
}

/// The figures among the lines that come out, read on a thread so that the process never waits for a reader.
fn listen(from: Option<impl Read + Send + 'static>) -> Receiver<Figure> {
    let (say, figures) = channel();
    std::thread::spawn(move || {
        let lines = from.map(|from| BufReader::new(from).lines());
        for line in lines.into_iter().flatten().map_while(|line| line.ok()) {
            // A driver may say other things.
            if let Ok(figure) = serde_json::from_str(&line)
                && say.send(figure).is_err()
            {
                return;
            }
        }
    });
    figures
}

/// All that comes out, read on a thread too.
fn drain(from: Option<impl Read + Send + 'static>) -> JoinHandle<String> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        if let Some(mut from) = from {
            // What was read until it broke off is what there is.
            let _ = from.read_to_end(&mut bytes);
        }
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

/// A sentence of why a process did not answer.
fn why(status: Option<std::process::ExitStatus>, errors: &str) -> String {
    let said = errors.lines().map(str::trim).find_map(|line| line.strip_prefix("afterlight: "));
    if let Some(said) = said {
        return said.trim_end_matches('.').to_owned();
    }
    #[cfg(unix)]
    if let Some(signal) = status.and_then(|s| std::os::unix::process::ExitStatusExt::signal(&s)) {
        return match signal {
            9 => "the system ended it: memory has probably run out".to_owned(),
            _ => format!("it crashed (signal {signal}), probably in the driver"),
        };
    }
    let panicked = errors.lines().skip_while(|line| !line.contains("panicked"));
    let last = panicked
        .map(str::trim)
        .find(|line| !line.is_empty() && !line.contains("panicked") && !line.starts_with("note:"));
    match (last, status) {
        (Some(line), _) => format!("it stopped with: {line}"),
        (None, Some(status)) => format!("it ended without an answer ({status})"),
        (None, None) => "it ended without an answer".to_owned(),
    }
}
