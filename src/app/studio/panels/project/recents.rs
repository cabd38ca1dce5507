//! The recent projects as currently on disk, each with its first frame.

use crate::panels::footage::reader::{texture, thumbnail};
use base::error::{Error, Result};
use egui::{Context, TextureHandle};
use project::Project;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use worker::{Query, SrgbPicture};

/// Longer side of a thumbnail in pixels: sharp on a screen with two pixels per point.
const THUMBNAIL_PX: usize = 640;

/// A recent project.
#[derive(Clone, Debug, PartialEq)]
pub struct Recent {
    pub folder: PathBuf,
    /// Its name; the folder's name if the project cannot be read.
    pub name: String,
    /// Reason that it cannot be opened.
    pub trouble: Option<String>,
    /// Last opening in seconds since 1970, if known.
    pub opened: Option<u64>,
}

impl Recent {
    fn look(folder: PathBuf) -> Self {
        let opened = if folder.is_dir() {
            Project::open(&folder).map_err(|e| e.to_string())
        } else {
            Err("The folder is missing: it was moved, or its disk is not connected".to_owned())
        };
        match opened {
            Ok(project) => Self { folder, name: project.settings.name, trouble: None, opened: None },
            Err(sentence) => Self::unreadable(folder, sentence),
        }
    }

    fn unreadable(folder: PathBuf, sentence: String) -> Self {
        let called = folder.file_name().unwrap_or_default();
        Self { name: called.to_string_lossy().into_owned(), folder, trouble: Some(sentence), opened: None }
    }
}

/// The list, and the queries for it.
#[derive(Default)]
pub struct Recents {
    list: Vec<Recent>,
    projects: Query<Vec<PathBuf>, Vec<Recent>>,
    /// First frames; None for frames that cannot be read.
    thumbnails: BTreeMap<PathBuf, Option<TextureHandle>>,
    frames: Query<PathBuf, SrgbPicture>,
}

impl Recents {
    /// Newest first; empty until read.
    pub fn list(&self) -> &[Recent] {
        &self.list
    }

    /// First frame of a project's interview; None until read, and if it cannot be read.
    pub fn thumbnail(&self, folder: &Path) -> Option<&TextureHandle> {
        self.thumbnails.get(folder)?.as_ref()
    }

    /// True if every project's first frame was tried.
    pub fn are_drawn(&self) -> bool {
        let known = |recent: &Recent| recent.trouble.is_some() || self.thumbnails.contains_key(&recent.folder);
        self.list.iter().all(known)
    }

    /// Makes the next [`Self::look`] reread the list.
    pub fn invalidate(&mut self) {
        self.projects.forget();
    }

    /// Reads the projects in `folders` if these changed, and takes in the results. `opened` returns the last opening of
    /// each.
    pub fn look(
        &mut self,
        folders: &[PathBuf],
        opened: impl Fn(&Path) -> Option<u64>,
        wake: impl Fn() + Send + 'static,
    ) {
        let read = |folders: &Vec<PathBuf>| Ok(folders.iter().cloned().map(Recent::look).collect());
        if self.projects.ask(folders.to_vec(), wake, |_| read) {
            self.list.retain(|recent| folders.contains(&recent.folder));
        }
        if let Some((folders, list)) = self.projects.answers().last() {
            self.list = list.unwrap_or_else(|sentence| {
                let untold = |folder| Recent::unreadable(folder, sentence.clone());
                folders.into_iter().map(untold).collect()
            });
        }
        for recent in &mut self.list {
            recent.opened = opened(&recent.folder);
        }
    }

    /// Reads the first frames one by one, and takes in the results. Call while they are visible.
    pub fn draw(&mut self, ctx: &Context, wake: impl Fn() + Send + 'static) {
        for (folder, read) in self.frames.answers() {
            let small = read.ok().map(|codes| texture(ctx, "first frame", &codes));
            self.thumbnails.insert(folder, small);
        }
        let missing = |recent: &&Recent| recent.trouble.is_none() && !self.thumbnails.contains_key(&recent.folder);
        let next = self.list.iter().find(missing);
        if let Some(next) = next
            && !self.frames.is_waiting()
        {
            self.frames.ask(next.folder.clone(), wake, |_| |folder: &PathBuf| first_frame(folder));
        }
    }
}

/// The first frame of the interview of the project in a folder.
fn first_frame(folder: &Path) -> Result<SrgbPicture> {
    let project = Project::open(folder)?;
    if project.settings.shoot.frames.is_empty() {
        return Err(Error::invalid("the interview has no frames", "Import a shoot with an interview"));
    }
    thumbnail(&project.frame_picture(0), THUMBNAIL_PX)
}
