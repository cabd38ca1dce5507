//! Reads panoramas beside the window's thread, one after the other, and makes their thumbnails.

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

/// Panoramas that have been read and not been taken yet.
const MOST_WAITING: usize = 4;

/// Where a panorama comes from.
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

/// A panorama as the window wants it.
#[derive(Clone, Debug)]
pub struct Panorama {
    pub environment: Arc<Environment>,
    pub thumbnail: SrgbPicture,
    /// Its brightest areas, the one with most energy first.
    pub areas: Vec<Area>,
    /// What had to be guessed or mended, a sentence each.
    pub notes: Vec<String>,
}

/// The reading thread. Dropping it stops it after the file that it is at.
pub struct PanoramaLoader {
    // Dropped before the thread is joined: without a receiver, a thread that waits to hand over a panorama ends.
    read: Receiver<(Origin, Result<Panorama>)>,
    thread: Background<Origin>,
}

struct Loading<Wake> {
    read: SyncSender<(Origin, Result<Panorama>)>,
    wake: Wake,
}

impl PanoramaLoader {
    /// Starts the thread; `wake` is called after each file.
    pub fn start(wake: impl Fn() + Send + 'static) -> Self {
        let (send, read) = sync_channel(MOST_WAITING);
        let thread = Background::spawn("panoramas", move |_| Loading { read: send, wake });
        Self { read, thread }
    }

    /// Asks for a panorama.
    pub fn load(&self, origin: Origin) {
        self.thread.put(origin);
    }

    /// The panoramas that have been read since the last call, in the order in which they were asked for.
    pub fn loaded(&self) -> impl Iterator<Item = (Origin, Result<Panorama>)> {
        self.read.try_iter()
    }
}

impl Request for Origin {
    /// All are read, one after the other.
    fn lane(&self) -> Option<usize> {
        None
    }
}

impl<Wake: Fn()> Handler for Loading<Wake> {
    type Request = Origin;
    type Answer = Panorama;

    fn work(&mut self, origin: &mut Origin) -> Result<Panorama> {
        Panorama::load(origin)
    }

    fn deliver(&mut self, origin: Origin, panorama: Result<Panorama>) {
        // Nobody listens once the loader is dropped.
        if self.read.send((origin, panorama)).is_ok() {
            (self.wake)();
        }
    }
}

impl Panorama {
    /// How many of the brightest areas are looked for.
    const AREAS: usize = 5;

    /// Reads a panorama, or makes it.
    ///
    /// # Errors
    /// When the file cannot be read or is no panorama.
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
        assert!(
            loaded[0]
                .1
                .as_ref()
                .unwrap_err()
                .to_string()
                .contains("missing.exr")
        );
        assert_eq!(
            loaded[1].1.as_ref().unwrap().environment.radiance.size(),
            (8, 4)
        );
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
