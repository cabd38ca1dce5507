//! Writes small files beside the window's thread, one after the other.

use crate::imaging::file::write_beside;
use std::io::Write;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;

/// The thread that writes. Dropping it waits until everything is written.
pub struct Saver {
    files: Option<Sender<(PathBuf, String)>>,
    failures: Receiver<String>,
    thread: Option<JoinHandle<()>>,
}

impl Saver {
    /// Starts the thread; `wake` is called when something could not be written.
    pub fn start(wake: impl Fn() + Send + 'static) -> Self {
        let (files, waiting) = channel::<(PathBuf, String)>();
        let (fail, failures) = channel();
        let thread = std::thread::spawn(move || {
            while let Ok((mut path, mut text)) = waiting.recv() {
                // Of several versions of one file the last is enough.
                let mut next = None;
                while let Ok(newer) = waiting.try_recv() {
                    if newer.0 == path {
                        (path, text) = newer;
                    } else {
                        next = Some(newer);
                        break;
                    }
                }
                for (path, text) in std::iter::once((path, text)).chain(next) {
                    let written = write_beside(&path, |out| out.write_all(text.as_bytes()));
                    if let Err(e) = written {
                        // Nobody listens once the window is closed.
                        let _ = fail.send(e.to_string());
                        wake();
                    }
                }
            }
        });
        Self {
            files: Some(files),
            failures,
            thread: Some(thread),
        }
    }

    /// Writes `text` to `path` soon, beside and renamed.
    pub fn save(&self, path: PathBuf, text: String) {
        if let Some(files) = &self.files {
            // The thread ends with this struct.
            let _ = files.send((path, text));
        }
    }

    /// What could not be written since the last call.
    pub fn failures(&self) -> impl Iterator<Item = String> {
        self.failures.try_iter()
    }
}

impl Drop for Saver {
    fn drop(&mut self) {
        self.files = None;
        if let Some(thread) = self.thread.take() {
            // A panic of the thread has been said on stderr.
            let _ = thread.join();
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
        let failure = saver.failures.recv().unwrap();
        assert!(failure.contains("c/d"), "{failure}");
        drop(saver);
        for name in ["a", "b"] {
            let text = std::fs::read_to_string(folder.path().join(name)).unwrap();
            assert_eq!(text, "49");
        }
    }
}
