//! The panoramas of the environments in the list: loads them as the list grows, and saves the list in the project.

use super::environment_list::{self, ListedEnvironment};
use egui::Context;
use light::Environment;
use project::Project;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::thread::JoinHandle;
use worker::{EnvironmentListWriter, Origin, Panorama, PanoramaLoader};

/// An environment in the list.
pub struct EnvironmentEntry {
    pub listed: ListedEnvironment,
    pub panorama: PanoramaState,
}

/// Whether a panorama is loaded.
pub enum PanoramaState {
    Waiting,
    Done {
        panorama: Panorama,
        thumbnail: egui::TextureHandle,
    },
    /// Why it cannot be used.
    Failed(String),
}

impl PanoramaState {
    /// Whether it is still being loaded.
    pub fn is_waiting(&self) -> bool {
        matches!(self, Self::Waiting)
    }

    /// Whether the panorama can light a subject.
    pub fn is_done(&self) -> bool {
        matches!(self, Self::Done { .. })
    }
}

/// The panoramas of the list, in its order.
pub struct EnvironmentLibrary {
    ctx: Context,
    loader: PanoramaLoader,
    entries: Vec<EnvironmentEntry>,
    list: Arc<Vec<ListedEnvironment>>,
    /// The open project's folder, and the thread that writes there.
    root: Option<PathBuf>,
    writer: Option<EnvironmentListWriter>,
    /// Those that wait for the writers of projects before.
    retired: Vec<JoinHandle<()>>,
}

impl Drop for EnvironmentLibrary {
    /// No list is lost.
    fn drop(&mut self) {
        for thread in self.retired.drain(..) {
            // If it panicked, there is nothing to wait for.
            let _ = thread.join();
        }
    }
}

impl EnvironmentLibrary {
    /// An empty library.
    pub fn new(ctx: &Context) -> Self {
        let woken = ctx.clone();
        Self {
            ctx: ctx.clone(),
            loader: PanoramaLoader::start(move || woken.request_repaint()),
            entries: Vec::new(),
            list: Arc::default(),
            root: None,
            writer: None,
            retired: Vec::new(),
        }
    }

    /// Tells once the open project's list has been written as it is now. A project that is read before may be the
    /// same, and lack what changed.
    pub fn settled(&self) -> Option<Receiver<()>> {
        Some(self.writer.as_ref()?.settled())
    }

    fn start(&self) -> Option<EnvironmentListWriter> {
        let woken = self.ctx.clone();
        let wake = move || woken.request_repaint();
        let root = self.root.clone()?;
        Some(EnvironmentListWriter::start(
            root,
            environment_list::saved(&self.list),
            wake,
        ))
    }

    /// The list of a project that was just opened, and a sentence for each file that is missing. If `saved`, changes
    /// of the list are saved in the project.
    pub fn open(
        &mut self,
        project: &Project,
        saved: bool,
    ) -> (Arc<Vec<ListedEnvironment>>, Vec<String>) {
        let list = Arc::new(environment_list::of_project(project));
        self.entries.clear();
        if let Some(old) = self.writer.take() {
            // It waits until the list is written.
            self.retired.retain(|thread| !thread.is_finished());
            self.retired.push(std::thread::spawn(move || drop(old)));
        }
        self.follow(&list);
        self.root = saved.then(|| project.root.clone());
        self.writer = self.start();
        let known = project.environments();
        (list, known.iter().filter_map(|e| e.complaint()).collect())
    }

    /// The panoramas in the list's order.
    pub fn entries(&self) -> &[EnvironmentEntry] {
        &self.entries
    }

    /// A panorama of the list, once it is loaded.
    pub fn environment(&self, origin: &Origin) -> Option<Arc<Environment>> {
        let mut entries = self.entries.iter();
        match &entries.find(|e| e.listed.origin == *origin)?.panorama {
            PanoramaState::Done { panorama, .. } => Some(panorama.environment.clone()),
            PanoramaState::Waiting | PanoramaState::Failed(_) => None,
        }
    }

    /// Loads and saves what changed in the list.
    pub fn follow(&mut self, list: &Arc<Vec<ListedEnvironment>>) {
        if self.list == *list && self.entries.len() == list.len() {
            return;
        }
        let mut old = std::mem::take(&mut self.entries);
        for listed in list.iter() {
            let known = old.iter().position(|e| e.listed.origin == listed.origin);
            let panorama = match known {
                Some(known) => old.swap_remove(known).panorama,
                None => {
                    self.loader.load(listed.origin.clone());
                    PanoramaState::Waiting
                }
            };
            self.entries.push(EnvironmentEntry {
                listed: listed.clone(),
                panorama,
            });
        }
        if let Some(writer) = &self.writer {
            writer.keep(environment_list::saved(list));
        }
        self.list = list.clone();
    }

    /// Takes in what was loaded; returns those that cannot be read, with a sentence each.
    pub fn receive(&mut self) -> Vec<(Origin, String)> {
        let mut unreadable = Vec::new();
        for (origin, read) in self.loader.loaded() {
            let panorama = match read {
                Ok(panorama) => {
                    let small = &panorama.thumbnail;
                    let picture =
                        egui::ColorImage::from_rgb([small.width, small.height], &small.rgb);
                    let options = egui::TextureOptions::LINEAR_REPEAT;
                    let thumbnail = self.ctx.load_texture(origin.to_string(), picture, options);
                    PanoramaState::Done {
                        panorama,
                        thumbnail,
                    }
                }
                Err(e) => {
                    unreadable.push((origin.clone(), e.to_string()));
                    PanoramaState::Failed(e.to_string())
                }
            };
            let waiting = |e: &&mut EnvironmentEntry| {
                e.listed.origin == origin && matches!(e.panorama, PanoramaState::Waiting)
            };
            if let Some(entry) = self.entries.iter_mut().find(waiting) {
                entry.panorama = panorama;
            }
        }
        unreadable
    }

    /// A sentence for each list that could not be saved since the last call.
    pub fn unsaved(&self) -> Vec<String> {
        let failures = self.writer.iter().flat_map(|writer| writer.failures());
        failures.collect()
    }
}
