//! Writes small files in the background, one after another.

use base::error::Result;
use base::files::write_beside;
use std::cell::RefCell;
use std::collections::HashMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use worker::background::{Background, Handler, Request};

/// Texts that are not on disk.
#[derive(Clone, Default)]
struct Unwritten(Arc<Mutex<UnwrittenFiles>>);

#[derive(Default)]
struct UnwrittenFiles {
    /// Newest text of each file, until a write is attempted.
    texts: HashMap<PathBuf, Arc<str>>,
    /// Time since which texts have been waiting.
    since: Option<Instant>,
    /// Files whose last text could not be written, with the reason.
    failed: HashMap<PathBuf, String>,
}

/// The writing thread. Dropping it waits until everything is written.
pub struct Saver {
    thread: Background<SaveRequest>,
    /// The saved files, by the number used in requests.
    files: RefCell<Vec<PathBuf>>,
    unwritten: Unwritten,
    failures: Receiver<String>,
}

/// Request to write this text to the file with this number.
struct SaveRequest {
    file: usize,
    path: PathBuf,
    text: Arc<str>,
}

struct Saving<Save, Wake> {
    write: Save,
    unwritten: Unwritten,
    failures: Sender<String>,
    wake: Wake,
}

impl Saver {
    /// Starts the thread. `wake` is called after a failed write.
    pub fn start(wake: impl Fn() + Send + 'static) -> Self {
        Self::by(wake, |path, text| write_beside(path, |out| out.write_all(text.as_bytes())))
    }

    /// The same with another function for writing.
    fn by(wake: impl Fn() + Send + 'static, write: impl FnMut(&Path, &str) -> Result<()> + Send + 'static) -> Self {
        let (fail, failures) = channel();
        let unwritten = Unwritten::default();
        let own = unwritten.clone();
        let thread = Background::spawn("autosave", move |_| Saving { write, unwritten: own, failures: fail, wake });
        Self { thread, files: RefCell::default(), unwritten, failures }
    }

    /// Writes `text` to `path` soon, through a renamed temporary file. Only the newest text for a file is written.
    pub fn save(&self, path: PathBuf, text: String) {
        let mut files = self.files.borrow_mut();
        let file = files.iter().position(|known| *known == path);
        let file = file.unwrap_or_else(|| {
            files.push(path.clone());
            files.len() - 1
        });
        let text: Arc<str> = text.into();
        self.unwritten.put(&path, text.clone());
        self.thread.put(SaveRequest { file, path, text });
    }

    /// The newest text for a file, if no write was attempted yet: the file itself is older.
    pub fn unwritten(&self, path: &Path) -> Option<Arc<str>> {
        self.unwritten.get(path)
    }

    /// Waiting time of the oldest unwritten text; None if none is waiting.
    pub fn waiting(&self) -> Option<Duration> {
        self.unwritten.lock().since.map(|since| since.elapsed())
    }

    /// Reason that a file's newest text could not be written; None if all are written.
    pub fn failed(&self) -> Option<String> {
        let files = self.unwritten.lock();
        files.failed.values().next().cloned()
    }

    /// Failed writes since the last call.
    pub fn failures(&self) -> impl Iterator<Item = String> {
        self.failures.try_iter()
    }
}

impl Unwritten {
    fn lock(&self) -> MutexGuard<'_, UnwrittenFiles> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn get(&self, path: &Path) -> Option<Arc<str>> {
        self.lock().texts.get(path).cloned()
    }

    fn put(&self, path: &Path, text: Arc<str>) {
        let mut files = self.lock();
        files.texts.insert(path.to_path_buf(), text);
        files.since.get_or_insert_with(Instant::now);
    }

    /// Records the attempt to write this text, with the reason if it failed.
    fn tried(&self, path: &Path, text: &Arc<str>, failure: Option<String>) {
        let mut files = self.lock();
        let newest = files.texts.get(path);
        if newest.is_some_and(|newest| Arc::ptr_eq(newest, text)) {
            files.texts.remove(path);
        }
        if files.texts.is_empty() {
            files.since = None;
        }
        match failure {
            Some(failure) => files.failed.insert(path.to_path_buf(), failure),
            None => files.failed.remove(path),
        };
    }
}

impl Request for SaveRequest {
    /// One lane per file.
    fn lane(&self) -> Option<usize> {
        Some(self.file)
    }

    fn is_kept(&self) -> bool {
        true
    }
}

impl<Save, Wake> Handler for Saving<Save, Wake>
where
    Save: FnMut(&Path, &str) -> Result<()>,
    Wake: Fn(),
{
    type Request = SaveRequest;
    type Answer = ();

    fn work(&mut self, request: &mut SaveRequest) -> Result<()> {
        (self.write)(&request.path, &request.text)
    }

    fn deliver(&mut self, request: SaveRequest, answer: Result<()>) {
        let failure = answer.err().map(|e| e.to_string());
        let has_failed = failure.is_some();
        if let Some(failure) = failure.clone() {
            // Fails once the window is closed, when the result does not matter.
            let _ = self.failures.send(failure);
        }
        let was_failed = self.unwritten.lock().failed.contains_key(&request.path);
        self.unwritten.tried(&request.path, &request.text, failure);
        if has_failed || was_failed {
            (self.wake)();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use test_support::wait_for;

    /// Waits until these files were attempted.
    fn settle(saver: &Saver, files: &[PathBuf]) {
        let waits = || files.iter().any(|file| saver.unwritten(file).is_some());
        wait_for(|| (!waits()).then_some(()));
    }

    #[test]
    fn what_waits_is_known_while_the_disk_is_slow() {
        let (go, may_go) = channel::<()>();
        let saver = Saver::by(
            || {},
            move |_, _| {
                // Fails at the end of the test.
                let _ = may_go.recv();
                Ok(())
            },
        );
        let path = Path::new("look.json");
        assert_eq!(saver.unwritten(path), None);
        saver.save(path.into(), "first".to_owned());
        saver.save(path.into(), "second".to_owned());
        assert_eq!(saver.unwritten(path).as_deref(), Some("second"));
        assert_eq!(saver.unwritten(Path::new("other.json")), None);
        assert!(saver.waiting().is_some());
        drop(go);
        settle(&saver, &[path.into()]);
        assert_eq!(saver.waiting(), None);
        test_support::shown!(
            Accidents,
            "A project is opened again before its look has been written to a slow disk",
            done: "unwritten changes are read from memory",
        );
    }

    #[test]
    fn the_last_version_of_each_file_is_written_and_failures_are_told() {
        let folder = tempfile::tempdir().unwrap();
        let saver = Saver::start(|| {});
        for i in 0..50 {
            saver.save(folder.path().join("a"), i.to_string());
            saver.save(folder.path().join("b"), i.to_string());
        }
        // A file cannot have a file as its folder.
        std::fs::write(folder.path().join("c"), "").unwrap();
        saver.save(folder.path().join("c/d"), String::new());
        settle(&saver, &["a", "b", "c/d"].map(|name| folder.path().join(name)));
        let failures: Vec<String> = saver.failures().collect();
        assert!(failures.len() == 1 && failures[0].contains("c/d"), "{failures:?}");
        for name in ["a", "b"] {
            let text = std::fs::read_to_string(folder.path().join(name)).unwrap();
            assert_eq!(text, "49");
        }
        assert!(saver.failed().is_some_and(|why| why.contains("c/d")));
        std::fs::remove_file(folder.path().join("c")).unwrap();
        saver.save(folder.path().join("c/d"), String::new());
        settle(&saver, &[folder.path().join("c/d")]);
        assert_eq!(saver.failed(), None, "the text is written now");
    }

    #[test]
    fn a_dropped_saver_writes_what_waits() {
        let folder = tempfile::tempdir().unwrap();
        let saver = Saver::start(|| {});
        for name in ["a", "b", "c"] {
            saver.save(folder.path().join(name), name.to_owned());
        }
        drop(saver);
        for name in ["a", "b", "c"] {
            let text = std::fs::read_to_string(folder.path().join(name)).unwrap();
            assert_eq!(text, name);
        }
    }

    #[test]
    fn a_panic_while_a_file_is_written_is_said_and_the_next_is_written() {
        let (written, saved) = channel();
        let saver = Saver::by(
            || {},
            move |path, text| {
                assert_ne!(text, "bad", "on purpose");
                written.send(path.to_path_buf()).unwrap();
                Ok(())
            },
        );
        saver.save("look".into(), "bad".to_owned());
        settle(&saver, &["look".into()]);
        let failures: Vec<String> = saver.failures().collect();
        assert_eq!(failures.len(), 1);
        for said in ["on purpose", "bug in Afterlight"] {
            assert!(failures[0].contains(said), "{failures:?}");
        }
        saver.save("look".into(), "good".to_owned());
        drop(saver);
        assert_eq!(saved.iter().collect::<Vec<_>>(), [PathBuf::from("look")]);
    }
}
