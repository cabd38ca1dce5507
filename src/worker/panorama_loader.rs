//! Reads panoramas beside the window's thread, one after the other, and makes their thumbnails.

use super::latest::doorbell;
use super::srgb_picture::SrgbPicture;
use base::error::Result;
use base::progress::Control;
use light::Environment;
use light::brightest::{self, Area};
use light::built_in::BuiltIn;
use light::panorama::{self, ReadSettings};
use std::collections::VecDeque;
use std::fmt;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

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
            Self::File(path) => write!(f, "{}", path.display()),
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

/// The reading thread. Dropping it stops it after the file in hand.
pub struct PanoramaLoader {
    wanted: Arc<Mutex<VecDeque<Origin>>>,
    read: Option<Receiver<(Origin, Result<Panorama>)>>,
    ring: Box<dyn Fn() + Send>,
    stop: Control,
    thread: Option<JoinHandle<()>>,
}

impl PanoramaLoader {
    /// Starts the thread; `wake` is called after each file.
    pub fn start(wake: impl Fn() + Send + 'static) -> Self {
        let wanted = Arc::new(Mutex::new(VecDeque::<Origin>::new()));
        let (send, read) = sync_channel(MOST_WAITING);
        let (ring, rung) = doorbell();
        let stop = Control::default();
        let (queue, stopped) = (wanted.clone(), stop.clone());
        let thread = std::thread::spawn(move || {
            while !stopped.stopped() {
                let next = queue
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner)
                    .pop_front();
                let Some(source) = next else {
                    if rung.recv().is_err() {
                        break;
                    }
                    continue;
                };
                let panorama = Panorama::load(&source);
                if send.send((source, panorama)).is_err() {
                    break;
                }
                wake();
            }
        });
        Self {
            wanted,
            read: Some(read),
            ring: Box::new(ring),
            stop,
            thread: Some(thread),
        }
    }

    /// Asks for a file.
    pub fn load(&self, source: Origin) {
        self.wanted
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push_back(source);
        (self.ring)();
    }

    /// The files that have been read since the last call, in the order in which they were asked for.
    pub fn loaded(&self) -> impl Iterator<Item = (Origin, Result<Panorama>)> {
        self.read.iter().flat_map(|read| read.try_iter())
    }
}

impl Drop for PanoramaLoader {
    fn drop(&mut self) {
        self.stop.stop();
        // Without a receiver, a thread that waits to hand over a panorama goes on and ends.
        drop(self.read.take());
        (self.ring)();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
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
}
