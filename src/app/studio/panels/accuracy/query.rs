//! Cost of accuracy as the window knows it. The measurements and the pictures of rungs are read in the background.

use crate::panels::footage::reader::texture;
use base::error::Result;
use egui::{Context, TextureHandle};
use imaging::file::read_encoded;
use project::Project;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tradeoff::{Ledger, folder};
use worker::{Query, SrgbPicture};

/// Interval between reads of the ladder while rungs are being measured.
const AGAIN: Duration = Duration::from_secs(2);
/// The true picture.
pub const TRUTH: &str = "truth.png";
/// Longer side of a rung's picture, in pixels.
const PICTURE_PX: usize = 640;

/// Pictures of rungs beside the truth, by file, all at one exposure.
type RungPictures = Vec<(String, SrgbPicture)>;

/// The newest answers, and the queries for them.
#[derive(Default)]
pub struct Accuracy {
    /// The measurements, or the reason they cannot be read. None until read; the inner None means nothing was measured.
    pub ledger: Option<std::result::Result<Option<Arc<Ledger>>, String>>,
    /// Pictures of rungs, by file.
    pub pictures: BTreeMap<String, TextureHandle>,
    /// Reason the pictures are missing.
    pub failure: Option<String>,
    /// By the time of the request.
    reader: Query<Instant, Option<Arc<Ledger>>>,
    drawing: Query<Vec<String>, RungPictures>,
}

impl Accuracy {
    /// Marks the measurements as stale, since a job may have added some.
    pub fn invalidate(&mut self) {
        self.reader.forget();
        self.drawing.forget();
    }

    /// Takes in the newest answers.
    pub fn receive(&mut self, ctx: &Context) {
        if let Some((_, ledger)) = self.reader.answers().last() {
            self.ledger = Some(ledger);
        }
        match self.drawing.answers().last() {
            Some((_, Ok(all))) => {
                let shown = |(name, codes)| (name, texture(ctx, "rung", &codes));
                self.pictures = all.into_iter().map(shown).collect();
                self.failure = None;
            }
            Some((_, Err(sentence))) => self.failure = Some(sentence),
            None => {}
        }
    }

    /// Requests the measurements if they may have changed. `running` is true while a job measures. Called while the
    /// panel is visible.
    pub fn ask(&mut self, project: &Project, running: bool, wake: impl Fn() + Send + 'static) {
        let is_due = |asked: &Instant| running && asked.elapsed() > AGAIN;
        if self.reader.asked().is_none_or(is_due) {
            self.reader.ask(Instant::now(), wake, |_| {
                let root = project.root.clone();
                move |_: &Instant| Ok(Ledger::load(&Project::open(&root)?)?.map(Arc::new))
            });
        }
    }

    /// Requests the pictures of these files and the true picture.
    pub fn draw(&mut self, project: &Project, files: &[String], wake: impl Fn() + Send + 'static) {
        let mut wanted = vec![TRUTH.to_owned()];
        wanted.extend_from_slice(files);
        wanted.dedup();
        self.drawing.ask(wanted, wake, |_| {
            let root = project.root.clone();
            move |names: &Vec<String>| pictures(&root, names)
        });
    }

    /// The measurements, if there are any.
    pub fn measured(&self) -> Option<&Arc<Ledger>> {
        self.ledger.as_ref()?.as_ref().ok()?.as_ref()
    }
}

/// Reads pictures of rungs of the project in folder `root`.
fn pictures(root: &Path, names: &[String]) -> Result<RungPictures> {
    let pictures = folder(&Project::open(root)?).join("pictures");
    let read = |name: &String| {
        let picture = read_encoded(&pictures.join(name))?;
        Ok((name.clone(), SrgbPicture::reduced(&picture, PICTURE_PX)))
    };
    names.iter().map(read).collect()
}
