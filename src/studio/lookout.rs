//! Looks beside the window whether files of the next export are there already.

use export::{Destination, untaken};
use std::sync::Arc;
use worker::Latest;

/// What is asked: where the export goes.
#[derive(Clone, Debug, PartialEq)]
pub struct Wanted {
    /// As [`Destination::parse`] understands it.
    pub to: String,
    /// First and last frame.
    pub range: (usize, usize),
    /// Exports that are over: each may have written files.
    pub over: usize,
}

/// What was found.
#[derive(Clone, Debug, PartialEq)]
pub struct Taken {
    pub wanted: Wanted,
    /// How many of its files are there.
    pub files: usize,
    /// The destination with a number that is free, or the same where none is there.
    pub free: String,
}

/// Asks one question at a time, the newest.
pub struct Lookout {
    asked: Option<Wanted>,
    answer: Arc<Latest<Taken>>,
    found: Option<Taken>,
    busy: bool,
}

impl Lookout {
    /// Nothing is known yet; `wake` is called with each answer.
    pub fn new(wake: impl Fn() + Send + Sync + 'static) -> Self {
        Self {
            asked: None,
            answer: Arc::new(Latest::new(wake)),
            found: None,
            busy: false,
        }
    }

    /// Takes in the answer and asks where `wanted` is another question than before.
    pub fn look(&mut self, wanted: Wanted) {
        if let Some(found) = self.answer.take() {
            self.found = Some(found);
            self.busy = false;
        }
        if self.busy || self.asked.as_ref() == Some(&wanted) {
            return;
        }
        self.asked = Some(wanted.clone());
        self.busy = true;
        let answer = self.answer.clone();
        std::thread::spawn(move || answer.put(Taken::of(wanted)));
    }

    /// What is known of the destination that was asked for last.
    pub fn found(&self) -> Option<&Taken> {
        self.found.as_ref()
    }
}

impl Taken {
    /// Looks at the disk.
    fn of(wanted: Wanted) -> Self {
        let (first, last) = wanted.range;
        // A destination that is not understood has no files; the export says what is wrong with it.
        let files = Destination::parse(&wanted.to).map_or(0, |d| d.taken(first, last));
        let free = untaken(&wanted.to, first, last).unwrap_or_else(|_| wanted.to.clone());
        Self {
            wanted,
            files,
            free,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Duration, Instant};

    #[test]
    fn files_that_are_there_are_found_and_the_newest_question_is_answered() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.0003.png"), "").unwrap();
        let wanted = |name: &str, over| Wanted {
            to: folder.path().join(name).display().to_string(),
            range: (0, 7),
            over,
        };
        let mut lookout = Lookout::new(|| {});
        let started = Instant::now();
        let mut until = |wanted: Wanted| {
            while lookout.found().is_none_or(|found| found.wanted != wanted) {
                assert!(started.elapsed() < Duration::from_secs(60));
                lookout.look(wanted.clone());
                std::thread::sleep(Duration::from_millis(1));
            }
            lookout.found().cloned().unwrap()
        };
        let found = until(wanted("a.%04d.png", 0));
        assert_eq!(found.files, 1);
        assert!(found.free.ends_with("a_2.%04d.png"));
        assert_eq!(until(wanted("b.%04d.png", 0)).files, 0);
        std::fs::write(folder.path().join("b.0000.png"), "").unwrap();
        assert_eq!(until(wanted("b.%04d.png", 1)).files, 1);
    }
}
