//! A measure in its own process, seen from its parent.

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

/// A measuring process. Dropping it ends the process.
pub struct Measuring {
    child: Child,
    figures: Receiver<Figure>,
    errors: Option<JoinHandle<String>>,
}

/// End of a process. Figures reported before are kept in any case.
pub enum Ended {
    /// Everything was measured.
    Done,
    /// Failed; a sentence gives the cause.
    Failed(String),
    /// Time limit exceeded.
    Late,
    /// Stopped by the user.
    Stopped,
}

impl Measuring {
    /// Starts `program` for one measure. Tuned kernels are cached in `kernels` if given, instead of the user's cache
    /// folder.
    ///
    /// # Errors
    /// When the process cannot be started.
    pub fn start(program: &Path, request: &Request, kernels: Option<&Path>) -> error::Result<Self> {
        let request = serde_json::to_string(request).map_err(|e| Error::bug(format!("a request is not JSON: {e}")))?;
        let mut command = Command::new(program);
        command.args([OsString::from("device"), REQUEST.into(), request.into()]);
        if let Some(folder) = kernels {
            command.env(gpu::KERNELS_FOLDER, folder);
        }
        Self::spawn(command)
    }

    /// Starts a process that prints figures as [`super::answer`] does.
    ///
    /// # Errors
    /// When the process cannot be started.
    pub fn spawn(mut command: Command) -> error::Result<Self> {
        // The process ends when its input closes, so none is left over however this program ends.
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        // Ctrl-C goes to this program, which ends its children and keeps what was measured.
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

    /// Waits at most this long, then ends the process; `found` receives each figure as it arrives.
    pub fn wait(mut self, most: Duration, progress: &Progress, mut found: impl FnMut(Figure)) -> Ended {
        let until = Instant::now() + most;
        let early = loop {
            match self.figures.recv_timeout(LOOK) {
                Ok(figure) => found(figure),
                // Its output is closed: the process has ended or is about to.
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
        // Its last output.
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
        // The process has already ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Drop for Measuring {
    fn drop(&mut self) {
        self.end();
    }
}

/// Reads the figures from the output on a thread, so that the process never waits for a reader.
fn listen(from: Option<impl Read + Send + 'static>) -> Receiver<Figure> {
    let (say, figures) = channel();
    std::thread::spawn(move || {
        let lines = from.map(|from| BufReader::new(from).lines());
        for line in lines.into_iter().flatten().map_while(|line| line.ok()) {
            // Drivers may print other lines.
            if let Ok(figure) = serde_json::from_str(&line)
                && say.send(figure).is_err()
            {
                return;
            }
        }
    });
    figures
}

/// Reads the whole output, also on a thread.
fn drain(from: Option<impl Read + Send + 'static>) -> JoinHandle<String> {
    std::thread::spawn(move || {
        let mut bytes = Vec::new();
        if let Some(mut from) = from {
            // After a read error, keep what was read.
            let _ = from.read_to_end(&mut bytes);
        }
        String::from_utf8_lossy(&bytes).into_owned()
    })
}

/// Sentence that explains why a process did not answer.
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
