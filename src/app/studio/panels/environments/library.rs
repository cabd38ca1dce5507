//! Panoramas of the listed environments and of watched folders: loads the listed ones as the list grows and those of
//! folders once their row is seen, and saves the list in the project.

use crate::environment_list::{self, ListedEnvironment, Owner};
use crate::favourites::Favourites;
use base::FileFormat;
use base::files::natural_order;
use egui::Context;
use light::Environment;
use light::brightest::Area;
use project::Project;
use std::collections::{HashMap, HashSet, VecDeque};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::thread::JoinHandle;
use worker::{EnvironmentListWriter, Origin, Panorama, PanoramaLoader, SrgbPicture};

/// Most panoramas listed of a watched folder and those below it.
pub const MOST_WATCHED: usize = 1000;
/// Panoramas of watched folders that are read at once, so that rows in sight wait for few others.
const READ_AT_ONCE: usize = 2;
/// Most thumbnails of watched folders that are kept, some 250 MB.
const MOST_THUMBNAILS: usize = 300;
/// Memory for panoramas that are not in use: enough for ten with 4096 columns.
const LIGHT_BUDGET_BYTES: usize = 1 << 30;

/// An environment in the list or in a watched folder.
pub struct EnvironmentEntry {
    pub listed: ListedEnvironment,
    pub panorama: PanoramaState,
    /// True for a favourite.
    pub favourite: bool,
    /// Place in the natural order of all names.
    pub order: usize,
}

/// Loading state of a panorama.
pub enum PanoramaState {
    /// In a watched folder, not seen yet.
    Unread,
    Waiting,
    Done {
        panorama: ReadPanorama,
        thumbnail: egui::TextureHandle,
    },
    /// Reason for the failure.
    Failed(String),
}

/// A panorama after reading.
pub struct ReadPanorama {
    /// Its light; None while others use the memory, see [`EnvironmentLibrary::use_light`].
    pub environment: Option<Arc<Environment>>,
    /// Columns and rows of its light.
    pub size: (usize, usize),
    pub thumbnail: Arc<SrgbPicture>,
    /// Its brightest areas, by descending energy.
    pub areas: Vec<Area>,
    /// Guesses and repairs in the file, one sentence each.
    pub notes: Vec<String>,
}

impl ReadPanorama {
    fn from_panorama(panorama: Panorama) -> Self {
        Self {
            size: panorama.environment.radiance.size(),
            environment: Some(panorama.environment),
            thumbnail: Arc::new(panorama.thumbnail),
            areas: panorama.areas,
            notes: panorama.notes,
        }
    }
}

/// Light of a listed panorama; None while it is not in memory.
pub fn light_of(entries: &[EnvironmentEntry], origin: &Origin) -> Option<Arc<Environment>> {
    let mut entries = entries.iter();
    match &entries.find(|e| e.listed.origin == *origin)?.panorama {
        PanoramaState::Done { panorama, .. } => panorama.environment.clone(),
        PanoramaState::Unread | PanoramaState::Waiting | PanoramaState::Failed(_) => None,
    }
}

impl PanoramaState {
    /// True if the panorama cannot be used.
    pub fn is_failed(&self) -> bool {
        matches!(self, Self::Failed(_))
    }

    /// True if the light is in memory.
    pub fn has_light(&self) -> bool {
        matches!(self, Self::Done { panorama, .. } if panorama.environment.is_some())
    }

    /// True while loading.
    pub fn is_waiting(&self) -> bool {
        matches!(self, Self::Waiting)
    }

    /// True if the panorama can light a subject.
    pub fn is_done(&self) -> bool {
        matches!(self, Self::Done { .. })
    }
}

/// Contents of the watched folders.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scan {
    pub panoramas: Vec<PathBuf>,
    /// Folders that cannot be opened.
    pub closed: Vec<PathBuf>,
}

/// Panoramas in the order of the list, then those of watched folders that are not in it.
pub struct EnvironmentLibrary {
    ctx: Context,
    loader: PanoramaLoader,
    entries: Vec<EnvironmentEntry>,
    /// Panoramas in order of use, the latest last.
    recent: Vec<Origin>,
    /// The panorama that jumped the queue.
    hurried: Option<Origin>,
    /// Memory for light, in bytes.
    budget: usize,
    /// Panoramas that could be read at least once.
    read: Vec<Origin>,
    list: Arc<Vec<ListedEnvironment>>,
    /// Newest scan of the watched folders; None before the first.
    scan: Option<Scan>,
    /// Panoramas of watched folders that were read, the latest last.
    thumbnails: VecDeque<Origin>,
    /// Folder of the open project, and the thread that writes there.
    root: Option<PathBuf>,
    writer: Option<EnvironmentListWriter>,
    /// Threads that wait for the writers of previous projects.
    retired: Vec<JoinHandle<()>>,
}

impl Drop for EnvironmentLibrary {
    /// Waits until every list is written.
    fn drop(&mut self) {
        for thread in self.retired.drain(..) {
            // A panic of the thread leaves nothing to wait for.
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
            recent: Vec::new(),
            hurried: None,
            budget: LIGHT_BUDGET_BYTES,
            read: Vec::new(),
            list: Arc::default(),
            scan: None,
            thumbnails: VecDeque::new(),
            root: None,
            writer: None,
            retired: Vec::new(),
        }
    }

    /// Signals once the open project's list is on disk. A project read before that would lack the changes.
    pub fn settled(&self) -> Option<Receiver<()>> {
        Some(self.writer.as_ref()?.settled())
    }

    fn start(&self) -> Option<EnvironmentListWriter> {
        let woken = self.ctx.clone();
        let wake = move || woken.request_repaint();
        let root = self.root.clone()?;
        Some(EnvironmentListWriter::start(root, environment_list::saved(&self.list), wake))
    }

    /// The list of a newly opened project, and a sentence for each missing file. `saved`: save changes of the list in
    /// the project.
    pub fn open(&mut self, project: &Project, saved: bool) -> (Arc<Vec<ListedEnvironment>>, Vec<String>) {
        let list = Arc::new(environment_list::of_project(project));
        self.entries.clear();
        if let Some(old) = self.writer.take() {
            // Dropping the writer waits until the list is written.
            self.retired.retain(|thread| !thread.is_finished());
            self.retired.push(std::thread::spawn(move || drop(old)));
        }
        self.follow(&list);
        self.root = saved.then(|| project.root.clone());
        self.writer = self.start();
        let known = project.environments();
        (list, known.iter().filter_map(|e| e.complaint()).collect())
    }

    /// The entries: those of the list in its order, then those of watched folders.
    pub fn entries(&self) -> &[EnvironmentEntry] {
        &self.entries
    }

    /// Light of a listed panorama; None while it is not in memory.
    pub fn environment(&self, origin: &Origin) -> Option<Arc<Environment>> {
        light_of(&self.entries, origin)
    }

    /// Marks the favourites.
    pub fn mark(&mut self, favourites: &Favourites) {
        let is_favourite = favourites.marker();
        for entry in &mut self.entries {
            entry.favourite = is_favourite(&entry.listed.origin);
        }
    }

    /// Reads the panoramas in use first, again if their light was dropped. Other light is dropped when it exceeds the
    /// memory budget, least recently used first.
    pub fn use_light(&mut self, used: &[Origin]) {
        self.recent.retain(|one| !used.contains(one));
        self.recent.extend_from_slice(used);
        if self.hurried.is_none() {
            let missing = |entry: &&EnvironmentEntry| {
                let state = &entry.panorama;
                used.contains(&entry.listed.origin) && !state.has_light() && !state.is_failed()
            };
            if let Some(entry) = self.entries.iter().find(missing) {
                let origin = entry.listed.origin.clone();
                // Also one that was read for another project: a request in order would wait for its turn.
                let again = entry.panorama.is_done() || self.read.contains(&origin);
                self.loader.load_first(origin.clone(), again);
                self.hurried = Some(origin);
            }
        }
        self.drop_light(used);
    }

    fn drop_light(&mut self, used: &[Origin]) {
        let mut bytes = 0;
        let mut held = Vec::new();
        for (place, entry) in self.entries.iter().enumerate() {
            if let PanoramaState::Done { panorama, .. } = &entry.panorama
                && panorama.environment.is_some()
                // Built-in panoramas stay in memory anyway.
                && let Origin::File(_) = entry.listed.origin
            {
                let size = panorama.size.0 * panorama.size.1 * size_of::<[f32; 3]>();
                bytes += size;
                let at = (self.recent.iter()).position(|one| *one == entry.listed.origin);
                held.push((at.map_or(0, |at| at + 1), place, size));
            }
        }
        if bytes <= self.budget {
            return;
        }
        held.sort_unstable();
        for (_, place, size) in held {
            let entry = &mut self.entries[place];
            if bytes > self.budget
                && !used.contains(&entry.listed.origin)
                && let PanoramaState::Done { panorama, .. } = &mut entry.panorama
            {
                panorama.environment = None;
                bytes -= size;
            }
        }
    }

    /// Loads and saves changes of the list.
    pub fn follow(&mut self, list: &Arc<Vec<ListedEnvironment>>) {
        if self.list == *list && self.entries.len() >= list.len() {
            return;
        }
        self.arrange(list);
        if let Some(writer) = &self.writer {
            writer.keep(environment_list::saved(list));
        }
        self.list = list.clone();
    }

    /// Takes in a scan of the watched folders.
    pub fn watch(&mut self, scan: Scan) {
        if self.scan.as_ref() != Some(&scan) {
            self.scan = Some(scan);
            self.arrange(&self.list.clone());
        }
    }

    /// Newest scan of the watched folders; None before the first.
    pub fn scan(&self) -> Option<&Scan> {
        self.scan.as_ref()
    }

    /// Makes the entries of a list and of the watched folders; those known keep their panoramas.
    fn arrange(&mut self, list: &[ListedEnvironment]) {
        let listed: HashSet<&Path> = list.iter().filter_map(ListedEnvironment::file).collect();
        let watched = self.scan.iter().flat_map(|scan| &scan.panoramas);
        let more = watched.filter(|file| !listed.contains(file.as_path()));
        let more = more.map(|file| ListedEnvironment {
            name: file.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
            origin: Origin::File(file.clone()),
            front: None,
            owner: Owner::Folder,
        });
        let mut old: HashMap<String, EnvironmentEntry> = std::mem::take(&mut self.entries)
            .into_iter()
            .map(|entry| (entry.listed.origin.to_string(), entry))
            .collect();
        for listed in list.iter().cloned().chain(more) {
            let known = old.remove(&listed.origin.to_string());
            let favourite = known.as_ref().is_some_and(|one| one.favourite);
            // A watched file that is used now is read even if it was not, or could not be.
            let is_used = |one: &EnvironmentEntry| one.listed.owner == Owner::Folder && listed.owner != Owner::Folder;
            let is_read = |one: &EnvironmentEntry| one.panorama.is_done() || one.panorama.is_waiting();
            let kept = known.filter(|one| !is_used(one) || is_read(one));
            let panorama = kept.map(|one| one.panorama).unwrap_or_else(|| {
                if listed.owner == Owner::Folder {
                    return PanoramaState::Unread;
                }
                self.loader.load(listed.origin.clone());
                PanoramaState::Waiting
            });
            self.entries.push(EnvironmentEntry { listed, panorama, favourite, order: 0 });
        }
        let mut places: Vec<usize> = (0..self.entries.len()).collect();
        let name = |place: usize| &self.entries[place].listed.name;
        places.sort_by(|&a, &b| natural_order(name(a), name(b)));
        for (order, place) in places.into_iter().enumerate() {
            self.entries[place].order = order;
        }
    }

    /// Reads a panorama of a watched folder whose row is seen, unless others are being read, or one after a failure.
    pub fn read(&mut self, place: usize) {
        let is_read = |entry: &&EnvironmentEntry| entry.listed.owner == Owner::Folder && entry.panorama.is_waiting();
        let busy = self.entries.iter().filter(is_read).count() >= READ_AT_ONCE;
        let entry = self.entries.get_mut(place);
        let unread = |entry: &&mut EnvironmentEntry| match entry.panorama {
            PanoramaState::Unread => !busy,
            PanoramaState::Failed(_) => true,
            PanoramaState::Waiting | PanoramaState::Done { .. } => false,
        };
        if let Some(entry) = entry.filter(unread) {
            entry.panorama = PanoramaState::Waiting;
            self.loader.load(entry.listed.origin.clone());
        }
    }

    /// Takes in loaded panoramas. Returns those that could never be read, with a sentence each.
    pub fn receive(&mut self) -> Vec<(Origin, String)> {
        let mut unreadable = Vec::new();
        for (origin, read) in self.loader.loaded() {
            let mut state = match read {
                Ok(panorama) => {
                    let small = &panorama.thumbnail;
                    let picture = egui::ColorImage::from_rgb([small.width, small.height], &small.rgb);
                    let options = egui::TextureOptions::LINEAR_REPEAT;
                    if !self.read.contains(&origin) {
                        self.read.push(origin.clone());
                    }
                    let thumbnail = self.ctx.load_texture(origin.to_string(), picture, options);
                    PanoramaState::Done { panorama: ReadPanorama::from_panorama(panorama), thumbnail }
                }
                Err(e) => {
                    // The disk may be disconnected for a while.
                    if !self.read.contains(&origin) {
                        unreadable.push((origin.clone(), e.to_string()));
                    }
                    PanoramaState::Failed(e.to_string())
                }
            };
            if self.hurried.as_ref() == Some(&origin) {
                self.hurried = None;
            }
            let waiting = |e: &&mut EnvironmentEntry| {
                e.listed.origin == origin && !e.panorama.has_light() && !e.panorama.is_failed()
            };
            if let Some(entry) = self.entries.iter_mut().find(waiting) {
                // The file's stem may be another entry's name.
                if let PanoramaState::Done { panorama, .. } = &mut state
                    && let Some(light) = panorama.environment.as_mut().and_then(Arc::get_mut)
                {
                    light.name.clone_from(&entry.listed.name);
                }
                entry.panorama = state;
                if entry.listed.owner == Owner::Folder && entry.panorama.is_done() {
                    self.thumbnails.push_back(origin);
                }
            }
        }
        while self.thumbnails.len() > MOST_THUMBNAILS
            && let Some(oldest) = self.thumbnails.pop_front()
        {
            let is_it = |one: &&mut EnvironmentEntry| one.listed.owner == Owner::Folder && one.listed.origin == oldest;
            if let Some(entry) = self.entries.iter_mut().find(is_it) {
                entry.panorama = PanoramaState::Unread;
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

/// True for a file that may be a panorama.
pub fn is_panorama(path: &Path) -> bool {
    FileFormat::from_path(path).is_some_and(FileFormat::is_picture)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::environment_list::Owner;
    use imaging::Image;

    fn until(library: &mut EnvironmentLibrary, used: &[Origin], done: fn(&PanoramaState) -> bool) {
        test_support::wait_for(|| {
            assert!(library.receive().is_empty());
            library.use_light(used);
            let mut entries = library.entries().iter();
            let lit = used.iter().all(|origin| library.environment(origin).is_some());
            (entries.all(|entry| done(&entry.panorama)) && lit).then_some(())
        });
    }

    #[test]
    fn light_that_is_not_used_goes_and_is_read_again_when_it_is_asked_for() {
        let folder = tempfile::tempdir().unwrap();
        let files: Vec<Origin> = (0..5)
            .map(|i| {
                let file = folder.path().join(format!("{i}.exr"));
                imaging::file::write_exr(&file, &Image::filled(8, 4, [1.0; 3])).unwrap();
                Origin::File(file)
            })
            .collect();
        let listed = |origin: &Origin| ListedEnvironment {
            name: origin.to_string(),
            origin: origin.clone(),
            front: None,
            owner: Owner::Person,
        };
        let mut library = EnvironmentLibrary::new(&Context::default());
        // Room for two of them.
        library.budget = 2 * 8 * 4 * size_of::<[f32; 3]>();
        library.follow(&Arc::new(files.iter().map(listed).collect()));
        let lit = |library: &EnvironmentLibrary| -> Vec<bool> {
            let all = files.iter().map(|origin| library.environment(origin));
            all.map(|light| light.is_some()).collect()
        };
        until(&mut library, &files[4..], PanoramaState::is_done);
        assert!(lit(&library)[4]);
        assert_eq!(lit(&library).iter().filter(|lit| **lit).count(), 2);
        until(&mut library, &files[1..2], PanoramaState::is_done);
        until(&mut library, &files[..1], PanoramaState::is_done);
        assert_eq!(lit(&library), [true, true, false, false, false]);
        // More are in use at once than fit.
        until(&mut library, &files[2..], PanoramaState::is_done);
        assert_eq!(lit(&library), [false, false, true, true, true]);
        // A file that is missing for a while stays in the list; a click reads it again.
        let file = folder.path().join("0.exr");
        std::fs::rename(&file, folder.path().join("away")).unwrap();
        test_support::wait_for(|| {
            library.use_light(&files[..1]);
            assert!(library.receive().is_empty());
            library.entries()[0].panorama.is_failed().then_some(())
        });
        std::fs::rename(folder.path().join("away"), &file).unwrap();
        library.read(0);
        until(&mut library, &files[..1], PanoramaState::is_done);
        // A file that could never be read is reported once.
        let gone = Origin::File(folder.path().join("gone.exr"));
        library.follow(&Arc::new(vec![listed(&gone)]));
        let said = test_support::wait_for(|| library.receive().pop());
        assert!(said.1.contains("gone.exr"), "{}", said.1);
        assert!(library.entries()[0].panorama.is_failed());
    }
}
