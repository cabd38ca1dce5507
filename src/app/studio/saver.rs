//! Writes small files in the background, one after the other.

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

/// Texts that are not in the files.
#[derive(Clone, Default)]
struct Unwritten(Arc<Mutex<UnwrittenFiles>>);

#[derive(Default)]
struct UnwrittenFiles {
    /// The newest text of each file that writing has not been tried of yet.
    texts: HashMap<PathBuf, Arc<str>>,
    /// Since when there are any.
    since: Option<Instant>,
    /// Files whose last text could not be written, and why.
    failed: HashMap<PathBuf, String>,
}

/// The thread that writes. Dropping it waits until everything is written.
pub struct Saver {
    thread: Background<SaveRequest>,
    /// The files that were saved, by the number that their requests have.
    files: RefCell<Vec<PathBuf>>,
    unwritten: Unwritten,
    failures: Receiver<String>,
}

/// To write this text into the file of this number.
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
    /// Starts the thread; `wake` is called when something could not be written.
    pub fn start(wake: impl Fn() + Send + 'static) -> Self {
        Self::by(wake, |path, text| write_beside(path, |out| out.write_all(text.as_bytes())))
    }

    /// The same with another way to write a text into a file.
    fn by(
        wake: impl Fn() + Send + 'static,
        write: impl FnMut(&Path, &str) -> Result<()> + Send + 'static,
    ) -> Self {
        let (fail, failures) = channel();
        let unwritten = Unwritten::default();
        let own = unwritten.clone();
        let thread = Background::spawn("autosave", move |_| Saving {
            write,
            unwritten: own,
            failures: fail,
            wake,
        });
        Self { thread, files: RefCell::default(), unwritten, failures }
    }

    /// Writes `text` to `path` soon: to a file beside it, which is then renamed. Only the newest text for a file is
    /// written.
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

    /// The newest text for a file, if writing it has not been tried yet: what is in the file is older.
    pub fn unwritten(&self, path: &Path) -> Option<Arc<str>> {
        self.unwritten.get(path)
    }

    /// Time for which texts have been waiting to be written; None if none are.
    pub fn waiting(&self) -> Option<Duration> {
        self.unwritten.lock().since.map(|since| since.elapsed())
    }

    /// Reason the newest text of a file that was tried is not in it; None if all are written.
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

    /// Writing this text has been tried, and failed for this reason if it did.
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
    /// One lane for each file.
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
            // Nobody listens after the window is closed.
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

    /// Waits until writing these files has been tried.
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
                // It fails at the end of the test.
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
            danger: "the window stands still, or shows the older look",
            done: "what has not been written yet is read from memory",
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
        // A file cannot stand below another file.
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
        assert_eq!(saver.failed(), None, "it is written now");
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
