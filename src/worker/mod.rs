//! The work behind a window: one thread owns the network, one relights, one reads panoramas. None of
//! them is ever waited for; numbers and sentences come back as [`Event`]s, pictures through
//! [`Latest`] slots.
//!
//! ```text
//! window ── Ask ──► relighter ── frame ──► network
//!    ▲                 │  ▲                   │
//!    └──── Relit ──────┘  └── PredictedFrame ─┘
//! ```

mod cache;
mod event;
mod job;
mod latest;
mod library;
mod network;
mod relighter;

pub use event::{Blocked, Event, Need};
pub use job::{Job, Outcome};
pub use latest::Latest;
pub use library::{Library, Panorama, Thumbnail};
pub use network::{Predict, Source, open_project};
pub use relighter::{Ask, Relit};

use crate::compositor::Field;
use crate::footage::Frame;
use crate::gpu::DeviceChoice;
use crate::progress::Control;
use crate::project::Project;
use std::cell::RefCell;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, sync_channel};
use std::thread::JoinHandle;

/// News that the window has not read yet; what comes on top is dropped, since it is progress.
const MOST_NEWS: usize = 256;

/// Memory for reflectance fields: about 130 frames of 41 lamps at 128 pixels, or 8 at 512.
const FIELD_BUDGET_BYTES: usize = 1 << 30;

/// A frame with its reflectance field.
#[derive(Clone, Debug)]
pub struct PredictedFrame {
    pub frame: Arc<Frame>,
    pub field: Arc<Field>,
    /// What the prediction took in milliseconds, reading the frame included.
    pub ms: f64,
}

/// The threads behind one open project. Dropping it stops and joins them: that takes as long as one
/// prediction or one training step.
pub struct Worker {
    asks: Arc<Latest<Ask>>,
    jobs: Arc<Latest<(Job, Control)>>,
    relit: Arc<Latest<Arc<Relit>>>,
    events: Receiver<Event>,
    stop: Control,
    running: RefCell<Control>,
    ring: Vec<Box<dyn Fn() + Send>>,
    threads: Vec<JoinHandle<()>>,
}

impl Worker {
    /// Starts work on a project; `wake` is called whenever there is something new to show.
    pub fn start(
        project: Project,
        device: DeviceChoice,
        wake: impl Fn() + Clone + Send + Sync + 'static,
    ) -> Self {
        Self::over(move || open_project(&project, device), wake)
    }

    /// Starts work on frames from anywhere. `open` is called on the network's thread, at the start
    /// and after each job.
    pub fn over(
        open: impl FnMut() -> Result<Source, Blocked> + Send + 'static,
        wake: impl Fn() + Clone + Send + Sync + 'static,
    ) -> Self {
        let stop = Control::default();
        let (send, events) = sync_channel(MOST_NEWS);
        let tell = {
            let wake = wake.clone();
            move |event| {
                // Full: see MOST_NEWS. Closed: the window is gone.
                let _ = send.try_send(event);
                wake();
            }
        };
        let (ring_network, network_bell) = latest::doorbell();
        let (ring_relighter, relighter_bell) = latest::doorbell();
        let frames = Arc::new(Latest::new(ring_network.clone()));
        let jobs = Arc::new(Latest::new(ring_network.clone()));
        let rigs = Arc::new(Latest::new(ring_relighter.clone()));
        let fields = Arc::new(Latest::new(ring_relighter.clone()));
        let asks = Arc::new(Latest::new(ring_relighter.clone()));
        let relit = Arc::new(Latest::new(wake));
        let network = network::Network {
            open,
            frames: frames.clone(),
            jobs: jobs.clone(),
            rigs: rigs.clone(),
            fields: fields.clone(),
            tell: tell.clone(),
            stop: stop.clone(),
        };
        let relighter = relighter::Relighter {
            asks: asks.clone(),
            rigs,
            fields,
            frames,
            relit: relit.clone(),
            tell,
            stop: stop.clone(),
            cache: cache::FieldCache::new(FIELD_BUDGET_BYTES),
        };
        Self {
            asks,
            jobs,
            relit,
            events,
            stop,
            running: RefCell::default(),
            ring: vec![Box::new(ring_network), Box::new(ring_relighter)],
            threads: vec![
                std::thread::spawn(move || network.run(&network_bell)),
                std::thread::spawn(move || relighter.run(&relighter_bell)),
            ],
        }
    }

    /// Asks for a picture in place of any that was asked for before and is not begun.
    pub fn show(&self, ask: Ask) {
        self.asks.put(ask);
    }

    /// The newest picture, once.
    pub fn relit(&self) -> Option<Arc<Relit>> {
        self.relit.take()
    }

    /// What happened since the last call.
    pub fn events(&self) -> impl Iterator<Item = Event> {
        self.events.try_iter()
    }

    /// Runs a long action on the network's thread, after the prediction in hand.
    pub fn run(&self, job: Job) {
        let cancel = Control::default();
        self.running.replace(cancel.clone());
        self.jobs.put((job, cancel));
    }

    /// Asks the running job to stop; what it has finished is kept.
    pub fn cancel(&self) {
        self.running.borrow().stop();
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.stop.stop();
        self.cancel();
        self.ring.iter().for_each(|ring| ring());
        for thread in self.threads.drain(..) {
            // A thread that panicked has said so on stderr; there is nothing left to stop.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests;
