//! Cost of accuracy as the window knows it. A background thread reads the measurements.

use egui::{ColorImage, Context, TextureHandle, TextureOptions};
use project::Project;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tradeoff::Ledger;
use worker::LadderThread;
use worker::background::drop_later;

/// Interval between reads of the ladder while rungs are being measured.
const AGAIN: Duration = Duration::from_secs(2);
/// The true picture.
pub const TRUTH: &str = "truth.png";

/// Answers of the thread, which starts on first use.
#[derive(Default)]
pub struct Accuracy {
    /// The measurements, or the reason they cannot be read. None until read; the inner None means nothing was measured.
    pub ledger: Option<Result<Option<Arc<Ledger>>, String>>,
    /// Pictures of rungs, by file.
    pub pictures: BTreeMap<String, TextureHandle>,
    /// Reason the pictures are missing.
    pub failure: Option<String>,
    thread: Option<LadderThread>,
    /// Time of the last request for the ladder.
    asked: Option<Instant>,
    /// Pictures of the last request.
    drawn: Vec<String>,
}

impl Accuracy {
    /// Marks the measurements as stale, since a job may have added some.
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

    /// Requests the measurements if they may have changed. `running` is true while a job measures. Called while the
    /// panel is visible.
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

    /// Requests the pictures of these files and the true picture.
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

    /// The measurements, if there are any.
    pub fn measured(&self) -> Option<&Arc<Ledger>> {
        self.ledger.as_ref()?.as_ref().ok()?.as_ref()
    }
}

impl Drop for Accuracy {
    /// Joins the thread in the background, since it may be reading.
    fn drop(&mut self) {
        if let Some(thread) = self.thread.take() {
            drop_later(thread);
        }
    }
}
