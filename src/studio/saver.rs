//! Writes small files in the background, one after the other.

use imaging::file::write_beside;
use std::collections::HashSet;
use std::io::Write;
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;

/// The thread that writes. Dropping it waits until everything is written.
pub struct Saver {
    tasks: Option<Sender<Task>>,
    failures: Receiver<String>,
    thread: Option<JoinHandle<()>>,
}

enum Task {
    Write(PathBuf, String),
    /// Say when everything before it is written.
    Tell(Sender<()>),
}

impl Saver {
    /// Starts the thread; `wake` is called when something could not be written.
    pub fn start(wake: impl Fn() + Send + 'static) -> Self {
        let (tasks, waiting) = channel();
        let (fail, failures) = channel();
        let thread = std::thread::spawn(move || {
            while let Ok(first) = waiting.recv() {
                let mut tasks: Vec<Task> =
                    std::iter::once(first).chain(waiting.try_iter()).collect();
                // Only the last version of a file counts.
                let mut seen = HashSet::new();
                tasks.reverse();
                tasks.retain(|task| match task {
                    Task::Write(path, _) => seen.insert(path.clone()),
                    Task::Tell(_) => true,
                });
                // Those who wait are told after all writes.
                tasks.sort_by_key(|task| matches!(task, Task::Tell(_)));
                for task in tasks {
                    match task {
                        Task::Write(path, text) => {
                            let written = write_beside(&path, |out| out.write_all(text.as_bytes()));
                            if let Err(e) = written {
                                // Nobody listens after the window is closed.
                                let _ = fail.send(e.to_string());
                                wake();
                            }
                        }
                        // The one who asked may be gone.
                        Task::Tell(done) => drop(done.send(())),
                    }
                }
            }
        });
        Self {
            tasks: Some(tasks),
            failures,
            thread: Some(thread),
        }
    }

    /// Writes `text` to `path` soon: to a file beside it, which is then renamed.
    pub fn save(&self, path: PathBuf, text: String) {
        if let Some(tasks) = &self.tasks {
            // The thread ends with this struct.
            let _ = tasks.send(Task::Write(path, text));
        }
    }

    /// Waits until every write so far has been tried. Call it before reading a file that may be among them.
    pub fn settle(&self) {
        let (done, told) = channel();
        if let Some(tasks) = &self.tasks
            && tasks.send(Task::Tell(done)).is_ok()
        {
            // It fails if the thread is gone: then there is nothing to wait for.
            let _ = told.recv();
        }
    }

    /// What could not be written since the last call.
    pub fn failures(&self) -> impl Iterator<Item = String> {
        self.failures.try_iter()
    }
}

impl Drop for Saver {
    fn drop(&mut self) {
        self.tasks = None;
        if let Some(thread) = self.thread.take() {
            // A panic of the thread is on stderr already.
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
}
