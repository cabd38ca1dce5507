//! Output of a command: bars on stderr, figures on stdout.

use base::error::{Error, Result};
use base::progress::{Control, Progress, Report};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;
use std::fmt::Display;
use std::io::{ErrorKind, IsTerminal, Write};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// A command's console. Shows one bar at a time, or a line every few seconds if stderr is not a terminal.
pub struct Console {
    json: bool,
    control: Control,
    bar: Mutex<Bar>,
}

struct Bar {
    stage: &'static str,
    bar: ProgressBar,
    terminal: bool,
    printed: Instant,
}

/// Interval between lines without a terminal.
const LINE_INTERVAL: Duration = Duration::from_secs(5);

impl Console {
    /// Creates a console that prints its figures as JSON if `json` is set. Ctrl-C stops running work; a second
    /// one ends the program.
    pub fn new(json: bool) -> Self {
        let control = Control::default();
        let asked = control.clone();
        let handler = ctrlc::set_handler(move || {
            if asked.stopped() {
                std::process::exit(130);
            }
            asked.stop();
            say("Stopping after this step; press Ctrl-C again to stop at once");
        });
        if let Err(e) = handler {
            say(format_args!("Ctrl-C will end the program at once: {e}"));
        }
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
        let terminal = std::io::stderr().is_terminal();
        Self { json, control, bar: Mutex::new(Bar { stage: "", bar, terminal, printed: Instant::now() }) }
    }

    /// Runs `work` with its progress shown here.
    pub fn run<T>(&self, work: impl FnOnce(&Progress) -> T) -> T {
        let sink = |report: Report| self.show(report);
        let result = work(&Progress::new(&sink, self.control.clone()));
        if let Ok(bar) = self.bar.lock() {
            bar.bar.finish_and_clear();
        }
        result
    }

    fn show(&self, report: Report) {
        // A panic elsewhere while the bar was drawn must not hide this report's own cause.
        let mut bar = self.bar.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        match report {
            Report::Saved | Report::Training(_) => {}
            Report::Blocked(sentence) | Report::Say(sentence) => bar.bar.suspend(|| say(sentence)),
            Report::Advise { sentence, how } => {
                bar.bar.suspend(|| say(format_args!("{sentence} ({how})")));
            }
            Report::Step { stage, done, total, note } => bar.step(stage, done, total, note),
        }
    }

    /// Prints a command's result: `figures` as JSON, or `sentences`.
    ///
    /// # Errors
    /// As [`print`], and when the figures contain a path that JSON cannot hold.
    pub fn finish(&self, figures: &impl Serialize, sentences: impl FnOnce() -> String) -> Result<()> {
        if self.json {
            // NaN becomes null; a path may not be UTF-8.
            let figures = serde_json::to_string(figures).map_err(|e| {
                Error::invalid(
                    format!("the figures cannot be written as JSON: {e}"),
                    "The work itself is done. Rename the folder or file, or leave --json out",
                )
            })?;
            print(&figures)
        } else {
            print(&sentences())
        }
    }
}

/// Prints lines on stdout. A closed pipe, as after `head`, is not an error.
///
/// # Errors
/// When the lines cannot be written for another reason, such as a full disk.
pub fn print(lines: &str) -> Result<()> {
    let mut out = std::io::stdout();
    match writeln!(out, "{lines}").and_then(|()| out.flush()) {
        Err(e) if e.kind() != ErrorKind::BrokenPipe => Err(Error::io(
            "write",
            "the figures to stdout",
            e,
            "The work itself is done. Redirect the output to a file on a disk with room",
        )),
        _ => Ok(()),
    }
}

/// Prints a sentence on stderr. Work goes on if stderr is closed.
fn say(sentence: impl Display) {
    let _ = writeln!(std::io::stderr(), "{sentence}");
}

impl Bar {
    fn step(&mut self, stage: &'static str, done: u64, total: u64, note: String) {
        if self.stage != stage {
            self.bar.finish();
            self.stage = stage;
            self.bar = if self.terminal { ProgressBar::new(total) } else { ProgressBar::hidden() };
            let template = "{msg:>22} {bar:30} {percent:>3} % · {elapsed} · {eta} left  {prefix}";
            if let Ok(style) = ProgressStyle::with_template(template) {
                self.bar.set_style(style);
            }
            self.bar.set_message(stage);
            self.printed = Instant::now() - 2 * LINE_INTERVAL;
        }
        self.bar.set_length(total.max(1));
        self.bar.set_position(done);
        self.bar.set_prefix(note.clone());
        let finished = done >= total;
        if !self.terminal && (finished || self.printed.elapsed() > LINE_INTERVAL) {
            let percent = 100 * done / total.max(1);
            say(format_args!("{stage}: {percent} % {note}"));
            self.printed = Instant::now();
        }
    }
}
