//! Reads panoramas one after the other, off the window's thread, and makes their thumbnails.

use super::background::{Background, Handler};
use super::mailbox::Request;
use super::srgb_picture::SrgbPicture;
use base::error::Result;
use light::Environment;
use light::brightest::{self, Area};
use light::built_in::BuiltIn;
use light::panorama::{self, ReadSettings};
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};

/// Largest number of panoramas read ahead of the window.
const MOST_WAITING: usize = 4;

/// Origin of a panorama.
#[derive(Clone, Debug)]
pub enum Origin {
    File(PathBuf),
    BuiltIn(&'static BuiltIn),
}

impl PartialEq for Origin {
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::File(a), Self::File(b)) => a == b,
            (Self::BuiltIn(a), Self::BuiltIn(b)) => a.name == b.name,
            _ => false,
        }
    }
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Self::File(path) => f.write_str(&base::files::shown(path)),
            Self::BuiltIn(own) => f.write_str(own.describe),
        }
    }
}

/// A panorama with its thumbnail and analysis.
#[derive(Clone, Debug)]
pub struct Panorama {
    pub environment: Arc<Environment>,
    pub thumbnail: SrgbPicture,
    /// Brightest areas, the one with the most energy first.
    pub areas: Vec<Area>,
    /// Guesses and repairs on reading, a sentence each.
    pub notes: Vec<String>,
}

/// The reading thread. Dropping it stops it after the current file.
pub struct PanoramaLoader {
    // Dropped before the thread is joined: without a receiver, a thread that waits to hand over a panorama ends.
    read: Receiver<(Origin, Result<Panorama>)>,
    thread: Background<PanoramaRequest>,
}

enum PanoramaRequest {
    InOrder(Origin),
    /// Ahead of all others. `again`: not also requested in order.
    First {
        origin: Origin,
        again: bool,
    },
}

struct Loading<Wake> {
    read: SyncSender<(Origin, Result<Panorama>)>,
    wake: Wake,
    /// Read ahead of their turn, and skipped when it comes.
    ahead: Vec<Origin>,
    /// Read in their turn.
    read_in_order: Vec<Origin>,
}

impl PanoramaLoader {
    /// Starts the thread; `wake` is called after each file.
    pub fn start(wake: impl Fn() + Send + 'static) -> Self {
        let (send, read) = sync_channel(MOST_WAITING);
        let thread = Background::spawn("panoramas", move |_| Loading {
            read: send,
            wake,
            ahead: Vec::new(),
            read_in_order: Vec::new(),
        });
        Self { read, thread }
    }

    /// Requests a panorama.
    pub fn load(&self, origin: Origin) {
        self.thread.put(PanoramaRequest::InOrder(origin));
    }

    /// Requests a panorama ahead of all others; replaces an earlier such request that has not begun. `again`
    /// means that it was read before; otherwise it also waits in [`Self::load`]'s order, and is read once.
    pub fn load_first(&self, origin: Origin, again: bool) {
        self.thread.put(PanoramaRequest::First { origin, again });
    }

    /// The panoramas read since the last call, in reading order.
    pub fn loaded(&self) -> impl Iterator<Item = (Origin, Result<Panorama>)> {
        self.read.try_iter()
    }
}

impl Request for PanoramaRequest {
    /// All are read, one after the other, except for one that goes first.
    fn lane(&self) -> Option<usize> {
        matches!(self, Self::First { .. }).then_some(0)
    }
}

impl PanoramaRequest {
    fn origin(&self) -> &Origin {
        match self {
            Self::InOrder(origin) | Self::First { origin, .. } => origin,
        }
    }
}

impl<Wake: Fn()> Handler for Loading<Wake> {
    type Request = PanoramaRequest;
    /// None if it was read ahead of its turn.
    type Answer = Option<Panorama>;

    fn work(&mut self, request: &mut PanoramaRequest) -> Result<Option<Panorama>> {
        let ahead = (self.ahead.iter()).position(|one| one == request.origin());
        match request {
            PanoramaRequest::InOrder(_) if let Some(ahead) = ahead => {
                self.ahead.swap_remove(ahead);
                return Ok(None);
            }
            PanoramaRequest::InOrder(origin) => self.read_in_order.push(origin.clone()),
            PanoramaRequest::First { again: true, .. } => {}
            // Already on its way.
            PanoramaRequest::First { origin, .. } if self.read_in_order.contains(origin) => {
                return Ok(None);
            }
            PanoramaRequest::First { origin, .. } => self.ahead.push(origin.clone()),
        }
        Panorama::load(request.origin()).map(Some)
    }

    fn deliver(&mut self, request: PanoramaRequest, panorama: Result<Option<Panorama>>) {
        let origin = request.origin().clone();
        if let Some(panorama) = panorama.transpose() {
            // The receiver is gone once the loader is dropped.
            if self.read.send((origin, panorama)).is_ok() {
                (self.wake)();
            }
        }
    }
}

impl Panorama {
    /// Number of brightest areas to find.
    const AREAS: usize = 5;

    /// Reads or generates a panorama.
    ///
    /// # Errors
    /// When the file cannot be read or is not a panorama.
    pub fn load(source: &Origin) -> Result<Self> {
        let (environment, notes) = match source {
            Origin::File(path) => {
                let read = panorama::read(path, &ReadSettings::default())?;
                (Arc::new(read.environment), read.notes)
            }
            Origin::BuiltIn(own) => (own.environment(), vec![]),
        };
        Ok(Self {
            thumbnail: SrgbPicture::tone_mapped(&environment.radiance),
            areas: brightest::areas(&environment, Self::AREAS),
            environment,
            notes,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use imaging::Image;

    #[test]
    fn files_come_back_in_order_and_broken_ones_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let good = folder.path().join("good.exr");
        imaging::file::write_exr(&good, &Image::filled(8, 4, [1.0; 3])).unwrap();
        let (wake, woken) = std::sync::mpsc::channel();
        let loader = PanoramaLoader::start(move || wake.send(()).unwrap());
        loader.load(Origin::File(folder.path().join("missing.exr")));
        loader.load(Origin::File(good));
        (0..2).for_each(|_| woken.recv().unwrap());
        let loaded: Vec<_> = loader.loaded().collect();
        assert!(loaded[0].1.as_ref().unwrap_err().to_string().contains("missing.exr"));
        assert_eq!(loaded[1].1.as_ref().unwrap().environment.radiance.size(), (8, 4));
    }

    #[test]
    fn one_that_is_shown_is_read_before_its_turn_and_once() {
        let folder = tempfile::tempdir().unwrap();
        let files: Vec<Origin> = (0..20)
            .map(|i| {
                let file = folder.path().join(format!("{i}.exr"));
                imaging::file::write_exr(&file, &Image::filled(8, 4, [1.0; 3])).unwrap();
                Origin::File(file)
            })
            .collect();
        let (wake, woken) = std::sync::mpsc::channel();
        let loader = PanoramaLoader::start(move || wake.send(()).unwrap());
        files.iter().for_each(|file| loader.load(file.clone()));
        loader.load_first(files[19].clone(), false);
        let mut order = Vec::new();
        while order.len() < files.len() {
            woken.recv().unwrap();
            order.extend(loader.loaded().map(|(origin, _)| origin));
        }
        // Some were read, and some read but not taken, before the request.
        let place = order.iter().position(|one| *one == files[19]).unwrap();
        assert!(place < 19, "{place}");
        loader.load_first(files[19].clone(), true);
        let again = test_support::wait_for(|| loader.loaded().next());
        assert_eq!(again.0, files[19]);
    }

    #[test]
    fn a_panic_is_the_answer_for_its_panorama_and_the_next_is_read() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("good.exr");
        imaging::file::write_exr(&file, &Image::filled(8, 4, [1.0; 3])).unwrap();
        let (wake, woken) = std::sync::mpsc::channel();
        let loader = PanoramaLoader::start(move || wake.send(()).unwrap());
        loader.thread.panic_next();
        for _ in 0..2 {
            loader.load(Origin::File(file.clone()));
            woken.recv().unwrap();
        }
        let loaded: Vec<_> = loader.loaded().collect();
        assert_eq!(loaded[0].0, Origin::File(file));
        let sentence = loaded[0].1.as_ref().unwrap_err().to_string();
        assert!(sentence.contains("on purpose"), "{sentence}");
        assert!(loaded[1].1.is_ok());
    }
}
