//! The export queue, and the check for existing files of the next export.

use super::destination_check::{DestinationCheck, DestinationQuery};
use crate::state::State;
use export::Destination;
use std::path::Path;
use worker::Export;

/// The exports, and the check for existing files of the next one.
#[derive(Default)]
pub struct Exports {
    /// Waiting, running and finished exports.
    pub queue: Vec<Export>,
    pub destination: DestinationCheck,
    /// Destinations of exports not covered by a check of the disk yet.
    pub(super) ahead: Vec<Ahead>,
}

/// Destination of an export whose files may not exist yet.
pub(super) struct Ahead {
    pub(super) id: u64,
    pub(super) to: Destination,
    /// Numbers of the first and last file.
    pub(super) range: (i64, i64),
}

impl Exports {
    /// Takes in the current queue.
    pub fn receive(&mut self, queue: Vec<Export>) {
        self.queue = queue;
        self.destination.receive();
        let finished = self.finished();
        let is_looked_for = (self.destination.found()).is_some_and(|f| f.query.finished == finished);
        let unfinished = |id| {
            let mut unfinished = self.queue.iter().filter(|e| e.status.sentence().is_none());
            unfinished.any(|export| export.id == id)
        };
        (self.ahead).retain(|ahead| unfinished(ahead.id) || !is_looked_for);
    }

    /// Empties the queue, for another project.
    pub fn clear(&mut self) {
        self.queue.clear();
        self.ahead.clear();
    }

    /// Number of finished exports.
    fn finished(&self) -> usize {
        let finished = self.queue.iter().filter(|e| e.status.sentence().is_some());
        finished.count()
    }

    /// Destination of an export of files with the numbers `range` to `to`. Appends a number if files exist there, or will
    /// exist once the queue is written.
    pub fn goes_to(&self, to: &Destination, range: (i64, i64)) -> Destination {
        let found = self.destination.found();
        let found = found.filter(|found| found.query.to == *to && found.query.range == range);
        let free = found.map_or(to, |found| &found.free);
        let is_ahead = |to: &Destination| {
            let meets = |other: (i64, i64)| other.0 <= range.1 && range.0 <= other.1;
            let mut same = self.ahead.iter().filter(|ahead| ahead.to == *to);
            same.any(|ahead| matches!(to, Destination::Clip(_)) || meets(ahead.range))
        };
        let mut names = to.numbered_from(free).filter(|name| !is_ahead(name));
        names.next().unwrap_or_else(|| to.clone())
    }

    /// Checks for existing files of the next export of the project in `root`.
    pub fn ask(&mut self, state: &State, root: &Path, wake: impl Fn() + Send + 'static) {
        let query =
            DestinationQuery { to: state.export_options.to(root), range: state.numbers(), finished: self.finished() };
        self.destination.ask(query, wake);
    }
}
