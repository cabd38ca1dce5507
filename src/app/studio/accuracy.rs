//! The window's knowledge of the cost of accuracy. A thread of its own reads the measurements.

use egui::{ColorImage, Context, TextureHandle, TextureOptions};
use project::Project;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tradeoff::Ledger;
use worker::LadderThread;
use worker::background::drop_later;

/// Interval between reads of the ladder while rungs are measured.
const AGAIN: Duration = Duration::from_secs(2);
/// The picture of the truth.
pub const TRUTH: &str = "truth.png";

/// The thread's answers; it starts when it is first needed.
#[derive(Default)]
pub struct Accuracy {
    /// The measurements, or the reason they cannot be read; None before they are known, and inside before anything was measured.
    pub ledger: Option<Result<Option<Arc<Ledger>>, String>>,
    /// Pictures of rungs by their files.
    pub pictures: BTreeMap<String, TextureHandle>,
    /// Reason for missing pictures.
    pub failure: Option<String>,
    thread: Option<LadderThread>,
    /// When the ladder was asked for last.
    asked: Option<Instant>,
    /// The pictures that were asked for last.
    drawn: Vec<String>,
}

impl Accuracy {
    /// A job may have measured something.
    pub fn invalidate(&mut self) {
        self.asked = None;
        self.drawn.clear();
    }

    /// Takes in the newest answers.
    pub fn receive(&mut self, ctx: &Context) {
        let Some(thread) = &self.thread else { return };
        self.ledger = thread.ledger().or(self.ledger.take());
        if let Some(pictures) = thread.pictures() {
            let texture = |codes: &worker::SrgbPicture| {
                let picture = ColorImage::from_rgb([codes.width, codes.height], &codes.rgb);
                ctx.load_texture("rung", picture, TextureOptions::LINEAR)
            };
            match pictures {
                Ok(all) => {
                    let all = all.pictures.iter();
                    self.pictures =
                        all.map(|(name, codes)| (name.clone(), texture(codes))).collect();
                    self.failure = None;
                }
                Err(sentence) => self.failure = Some(sentence),
            }
        }
    }

    /// Asks for what was measured, if that may have changed: `running` while a job measures. Called while it is visible.
    pub fn ask(
        &mut self,
        project: &Project,
        running: bool,
        wake: impl Fn() + Clone + Send + Sync + 'static,
    ) {
        let start = || LadderThread::start(project.root.clone(), wake);
        let thread = self.thread.get_or_insert_with(start);
        let is_due = |asked: Instant| running && asked.elapsed() > AGAIN;
        if self.asked.is_none_or(is_due) {
            thread.read();
            self.asked = Some(Instant::now());
        }
    }

    /// Asks for the pictures of these files and of the truth.
    pub fn draw(&mut self, files: &[String]) {
        let mut wanted = vec![TRUTH.to_owned()];
        wanted.extend_from_slice(files);
        wanted.dedup();
        if let Some(thread) = &self.thread
            && wanted != self.drawn
        {
            thread.draw(wanted.clone());
            self.drawn = wanted;
        }
    }

    /// The measurements, if anything was measured.
    pub fn measured(&self) -> Option<&Arc<Ledger>> {
        self.ledger.as_ref()?.as_ref().ok()?.as_ref()
    }
}

impl Drop for Accuracy {
    /// Joins the thread in the background: it may be reading.
    fn drop(&mut self) {
        if let Some(thread) = self.thread.take() {
            drop_later(thread);
        }
    }
}
