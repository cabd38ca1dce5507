//! Background reads and changes of projects on disk, which may be slow or locked by another process.

use super::StudioApp;
use base::error::Result;
use std::collections::VecDeque;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use worker::background::catch_panic;

/// Follow-up in the window once an errand is done.
type Then = Box<dyn FnOnce(&mut StudioApp) + Send>;

/// Running errands, in order of their start.
#[derive(Default)]
pub struct Errands(VecDeque<Receiver<Then>>);

impl Errands {
    /// Follow-up of the first errand, once it is done.
    fn done(&mut self) -> Option<Then> {
        loop {
            match self.0.front()?.try_recv() {
                Ok(then) => {
                    self.0.pop_front();
                    return Some(then);
                }
                Err(TryRecvError::Empty) => return None,
                // The thread could not start: nothing follows.
                Err(TryRecvError::Disconnected) => drop(self.0.pop_front()),
            }
        }
    }
}

impl StudioApp {
    /// Runs `act` on its own thread once the open project's environment list is on disk, then calls `then` with the
    /// result on this thread.
    pub(crate) fn errand<T: Send + 'static>(
        &mut self,
        act: impl FnOnce() -> Result<T> + Send + 'static,
        then: impl FnOnce(&mut Self, Result<T>) + Send + 'static,
    ) {
        let (settled, wake) = (self.library.settled(), self.wake());
        let (send, done) = channel::<Then>();
        self.errands.0.push_back(done);
        std::thread::spawn(move || {
            // An error means that the writer is gone, so there is nothing to wait for.
            let _ = settled.map(|settled| settled.recv());
            let made = catch_panic(act);
            // Fails once the window is closed, when the result does not matter.
            let _ = send.send(Box::new(move |app| then(app, made)));
            wake();
        });
    }

    /// The same for the open project: `then` is dropped if another project is open by then.
    pub(crate) fn errand_here<T: Send + 'static>(
        &mut self,
        act: impl FnOnce() -> Result<T> + Send + 'static,
        then: impl FnOnce(&mut Self, Result<T>) + Send + 'static,
    ) {
        let root = self.project().map(|project| project.root.clone());
        self.errand(act, move |app, made| {
            if app.project().map(|project| &project.root) == root.as_ref() {
                then(app, made);
            }
        });
    }

    /// Runs the follow-ups of finished errands.
    pub(super) fn finish_errands(&mut self) {
        while let Some(then) = self.errands.done() {
            then(self);
        }
    }
}
