//! Background check for existing files of the next export.

use export::Destination;
use worker::Query;

/// Query: destination and range of the export.
#[derive(Clone, Debug, PartialEq)]
pub struct DestinationQuery {
    pub to: Destination,
    /// Numbers of the first and last file.
    pub range: (i64, i64),
    /// Number of finished exports. Each may have written files.
    pub finished: usize,
}

/// Result of the check.
#[derive(Clone, Debug, PartialEq)]
pub struct ExistingFiles {
    pub query: DestinationQuery,
    /// Number of the export's files that exist.
    pub files: usize,
    /// Free destination: a number is appended if files exist.
    pub free: Destination,
}

/// The newest result, and the search for it.
#[derive(Default)]
pub struct DestinationCheck {
    search: Query<DestinationQuery, ExistingFiles>,
    found: Option<ExistingFiles>,
    failure: Option<String>,
}

impl DestinationCheck {
    /// Starts a check if the query changed.
    pub fn ask(&mut self, query: DestinationQuery, wake: impl Fn() + Send + 'static) {
        self.search.ask(query, wake, |_| |query: &DestinationQuery| Ok(ExistingFiles::from_query(query)));
    }

    /// Takes in the newest result.
    pub fn receive(&mut self) {
        match self.search.answers().last() {
            Some((_, Ok(found))) => self.found = Some(found),
            Some((_, Err(sentence))) => self.failure = Some(sentence),
            None => {}
        }
    }

    /// The newest result.
    pub fn found(&self) -> Option<&ExistingFiles> {
        self.found.as_ref()
    }

    /// Reason the newest query failed; reported once.
    pub fn failure(&mut self) -> Option<String> {
        self.failure.take()
    }
}

impl ExistingFiles {
    /// Searches the disk.
    fn from_query(query: &DestinationQuery) -> Self {
        let (first, last) = query.range;
        let files = query.to.taken(first, last);
        // The export reports the error.
        let free = query.to.untaken(first, last).unwrap_or_else(|_| query.to.clone());
        Self { query: query.clone(), files, free }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Duration, Instant};

    fn destination(to: &str) -> Destination {
        Destination::parse(to).unwrap()
    }

    #[test]
    fn files_that_are_there_are_found_and_the_newest_question_is_answered() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.0003.png"), "").unwrap();
        let query = |name: &str, finished| DestinationQuery {
            to: destination(&folder.path().join(name).display().to_string()),
            range: (0, 7),
            finished,
        };
        let mut destination_check = DestinationCheck::default();
        let started = Instant::now();
        let mut until = |query: DestinationQuery| {
            while destination_check.found().is_none_or(|found| found.query != query) {
                assert!(started.elapsed() < Duration::from_secs(60));
                destination_check.ask(query.clone(), || {});
                destination_check.receive();
                std::thread::sleep(Duration::from_millis(1));
            }
            destination_check.found().cloned().unwrap()
        };
        let found = until(query("a.%04d.png", 0));
        assert_eq!(found.files, 1);
        assert!(found.free.to_string().ends_with("a_2.%04d.png"));
        assert_eq!(until(query("b.%04d.png", 0)).files, 0);
        std::fs::write(folder.path().join("b.0000.png"), "").unwrap();
        assert_eq!(until(query("b.%04d.png", 1)).files, 1);
    }

    #[test]
    fn a_panic_is_said_once_and_the_next_question_is_answered() {
        let (wake, woken) = std::sync::mpsc::channel();
        let find = |query: &DestinationQuery| {
            assert_ne!(query.to, destination("bad.png"), "on purpose");
            Ok(ExistingFiles::from_query(query))
        };
        let search = Query::start(move || wake.send(()).unwrap(), |_| find);
        let mut check = DestinationCheck { search, ..DestinationCheck::default() };
        let mut ask = |to: &str| {
            let query = DestinationQuery { to: destination(to), range: (0, 0), finished: 0 };
            check.ask(query, || {});
            woken.recv().unwrap();
            check.receive();
            let found = check.found().map(|found| found.query.to.clone());
            (check.failure(), check.failure(), found)
        };
        let (first, again, found) = ask("bad.png");
        assert!(first.unwrap().contains("on purpose"));
        assert_eq!((again, found), (None, None));
        assert_eq!(ask("good.png"), (None, None, Some(destination("good.png"))));
    }
}
