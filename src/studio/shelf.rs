//! The panoramas behind the list of environments: has them read as the list grows, and keeps the list in the
//! project.

use super::listed::{self, Listed};
use super::panel::{Entry, Reading};
use egui::Context;
use project::Project;
use std::path::PathBuf;
use std::sync::Arc;
use worker::{EnvironmentListWriter, PanoramaLoader};

/// The panoramas of the list, in its order.
pub struct Shelf {
    ctx: Context,
    library: PanoramaLoader,
    entries: Vec<Entry>,
    list: Arc<Vec<Listed>>,
    /// The open project's folder, and the thread that writes there.
    root: Option<PathBuf>,
    keeper: Option<EnvironmentListWriter>,
}

impl Shelf {
    /// An empty one.
    pub fn new(ctx: &Context) -> Self {
        let woken = ctx.clone();
        Self {
            ctx: ctx.clone(),
            library: PanoramaLoader::start(move || woken.request_repaint()),
            entries: Vec::new(),
            list: Arc::default(),
            root: None,
            keeper: None,
        }
    }

    /// Reads a project once the list of the open one is written, in case they are the same.
    pub fn written<T>(&mut self, read: impl FnOnce() -> T) -> T {
        self.keeper = None;
        let read = read();
        self.keeper = self.start();
        read
    }

    fn start(&self) -> Option<EnvironmentListWriter> {
        let woken = self.ctx.clone();
        let wake = move || woken.request_repaint();
        let root = self.root.clone()?;
        Some(EnvironmentListWriter::start(
            root,
            listed::kept(&self.list),
            wake,
        ))
    }

    /// The list of a project that was just opened, into which it is `kept` as it changes. Files that are not
    /// there are named in the sentences.
    pub fn open(&mut self, project: &Project, kept: bool) -> (Arc<Vec<Listed>>, Vec<String>) {
        let list = Arc::new(listed::of_project(project));
        self.entries.clear();
        self.keeper = None;
        self.follow(&list);
        self.root = kept.then(|| project.root.clone());
        self.keeper = self.start();
        let known = project.environments();
        (list, known.iter().filter_map(|e| e.complaint()).collect())
    }

    /// The panoramas in the list's order.
    pub fn entries(&self) -> &[Entry] {
        &self.entries
    }

    /// Brings the panoramas and the project in line with the list.
    pub fn follow(&mut self, list: &Arc<Vec<Listed>>) {
        if self.list == *list && self.entries.len() == list.len() {
            return;
        }
        let mut old = std::mem::take(&mut self.entries);
        for listed in list.iter() {
            let known = old.iter().position(|e| e.listed.origin == listed.origin);
            let panorama = match known {
                Some(known) => old.swap_remove(known).panorama,
                None => {
                    self.library.load(listed.origin.clone());
                    Reading::Waiting
                }
            };
            self.entries.push(Entry {
                listed: listed.clone(),
                panorama,
            });
        }
        if let Some(keeper) = &self.keeper {
            keeper.keep(listed::kept(list));
        }
        self.list = list.clone();
    }

    /// Takes in what has been read, and gives what could not be kept, a sentence each.
    pub fn hear(&mut self) -> Vec<String> {
        for (origin, read) in self.library.loaded() {
            let panorama = match read {
                Ok(panorama) => {
                    let small = &panorama.thumbnail;
                    let picture =
                        egui::ColorImage::from_rgb([small.width, small.height], &small.rgb);
                    let options = egui::TextureOptions::LINEAR_REPEAT;
                    let thumbnail = self.ctx.load_texture(origin.to_string(), picture, options);
                    Reading::Done {
                        panorama,
                        thumbnail,
                    }
                }
                Err(e) => Reading::Failed(e.to_string()),
            };
            let waiting = |e: &&mut Entry| {
                e.listed.origin == origin && matches!(e.panorama, Reading::Waiting)
            };
            if let Some(entry) = self.entries.iter_mut().find(waiting) {
                entry.panorama = panorama;
            }
        }
        let failures = self.keeper.iter().flat_map(|keeper| keeper.failures());
        failures.collect()
    }
}
