//! Checks in the background whether files of the next export exist already.

use export::{Destination, untaken};
use std::sync::Arc;
use worker::Latest;

/// The question: where the export goes.
#[derive(Clone, Debug, PartialEq)]
pub struct DestinationQuery {
    /// As [`Destination::parse`] understands it.
    pub to: String,
    /// First and last frame.
    pub range: (usize, usize),
    /// Number of finished exports: each may have written files.
    pub finished: usize,
}

/// The answer.
#[derive(Clone, Debug, PartialEq)]
pub struct ExistingFiles {
    pub query: DestinationQuery,
    /// How many of its files exist.
    pub files: usize,
    /// The destination with a number appended that is free; unchanged if no file exists.
    pub free: String,
}

/// Answers one question at a time, the newest.
pub struct DestinationCheck {
    asked: Option<DestinationQuery>,
    answer: Arc<Latest<ExistingFiles>>,
    found: Option<ExistingFiles>,
    busy: bool,
}

impl DestinationCheck {
    /// Nothing is known yet; `wake` is called with each answer.
    pub fn new(wake: impl Fn() + Send + Sync + 'static) -> Self {
        Self {
            asked: None,
            answer: Arc::new(Latest::new(wake)),
            found: None,
            busy: false,
        }
    }

    /// Takes in the answer, and asks again if the question changed.
    pub fn ask(&mut self, query: DestinationQuery) {
        if let Some(found) = self.answer.take() {
            self.found = Some(found);
            self.busy = false;
        }
        if self.busy || self.asked.as_ref() == Some(&query) {
            return;
        }
        self.asked = Some(query.clone());
        self.busy = true;
        let answer = self.answer.clone();
        std::thread::spawn(move || answer.put(ExistingFiles::of(query)));
    }

    /// The newest answer.
    pub fn found(&self) -> Option<&ExistingFiles> {
        self.found.as_ref()
    }
}

impl ExistingFiles {
    /// Looks at the disk.
    fn of(query: DestinationQuery) -> Self {
        let (first, last) = query.range;
        // A destination that is not understood has no files; the export says what is wrong with it.
        let files = Destination::parse(&query.to).map_or(0, |d| d.taken(first, last));
        let free = untaken(&query.to, first, last).unwrap_or_else(|_| query.to.clone());
        Self { query, files, free }
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
        let query = |name: &str, finished| DestinationQuery {
            to: folder.path().join(name).display().to_string(),
            range: (0, 7),
            finished,
        };
        let mut destination_check = DestinationCheck::new(|| {});
        let started = Instant::now();
        let mut until = |query: DestinationQuery| {
            while destination_check
                .found()
                .is_none_or(|found| found.query != query)
            {
                assert!(started.elapsed() < Duration::from_secs(60));
                destination_check.ask(query.clone());
                std::thread::sleep(Duration::from_millis(1));
            }
            destination_check.found().cloned().unwrap()
        };
        let found = until(query("a.%04d.png", 0));
        assert_eq!(found.files, 1);
        assert!(found.free.ends_with("a_2.%04d.png"));
        assert_eq!(until(query("b.%04d.png", 0)).files, 0);
        std::fs::write(folder.path().join("b.0000.png"), "").unwrap();
        assert_eq!(until(query("b.%04d.png", 1)).files, 1);
    }
}
