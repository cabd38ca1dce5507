//! Writes small files in the background, one after the other.

use base::error::Result;
use base::files::write_beside;
use std::cell::RefCell;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, Sender, channel};
use worker::background::{Background, Handler, Request};

/// The thread that writes. Dropping it waits until everything is written.
pub struct Saver {
    thread: Background<SaveRequest>,
    /// The files that were saved, by the number that their requests have.
    files: RefCell<Vec<PathBuf>>,
    failures: Receiver<String>,
}

enum SaveRequest {
    /// Write this text into the file of this number.
    Write {
        file: usize,
        path: PathBuf,
        text: String,
    },
    /// Say that every write before it has been tried.
    Tell(Sender<()>),
}

struct Saving<Save, Wake> {
    write: Save,
    failures: Sender<String>,
    wake: Wake,
}

impl Saver {
    /// Starts the thread; `wake` is called when something could not be written.
    pub fn start(wake: impl Fn() + Send + 'static) -> Self {
        Self::by(wake, |path, text| {
            write_beside(path, |out| out.write_all(text.as_bytes()))
        })
    }

    /// The same with another way to write a text into a file.
    fn by(
        wake: impl Fn() + Send + 'static,
        write: impl FnMut(&Path, &str) -> Result<()> + Send + 'static,
    ) -> Self {
        let (fail, failures) = channel();
        let thread = Background::spawn("autosave", move |_| Saving {
            write,
            failures: fail,
            wake,
        });
        Self {
            thread,
            files: RefCell::default(),
            failures,
        }
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
        self.thread.put(SaveRequest::Write { file, path, text });
    }

    /// Waits until every write so far has been tried. Call it before reading a file that may be among them.
    pub fn settle(&self) {
        let (done, told) = channel();
        self.thread.put(SaveRequest::Tell(done));
        // It fails if the thread is gone: then there is nothing to wait for.
        let _ = told.recv();
    }

    /// What could not be written since the last call.
    pub fn failures(&self) -> impl Iterator<Item = String> {
        self.failures.try_iter()
    }
}

impl Request for SaveRequest {
    /// One lane for each file; those who wait are told after all writes.
    fn lane(&self) -> Option<usize> {
        match self {
            Self::Write { file, .. } => Some(*file),
            Self::Tell(_) => None,
        }
    }

    fn is_kept(&self) -> bool {
        matches!(self, Self::Write { .. })
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
        match request {
            SaveRequest::Write { path, text, .. } => (self.write)(path, text),
            SaveRequest::Tell(_) => Ok(()),
        }
    }

    fn deliver(&mut self, request: SaveRequest, answer: Result<()>) {
        if let Err(e) = answer {
            // Nobody listens after the window is closed.
            let _ = self.failures.send(e.to_string());
            (self.wake)();
        }
        if let SaveRequest::Tell(done) = request {
            // The one who asked may be gone.
            let _ = done.send(());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
        saver.settle();
        let failures: Vec<String> = saver.failures().collect();
        assert!(
            failures.len() == 1 && failures[0].contains("c/d"),
            "{failures:?}"
        );
        for name in ["a", "b"] {
            let text = std::fs::read_to_string(folder.path().join(name)).unwrap();
            assert_eq!(text, "49");
        }
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
        saver.settle();
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
