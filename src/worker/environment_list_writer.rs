//! Writes the window's list of environments into `project.toml`, beside the window's thread.

use base::error::Result;
use project::{NamedEnvironment, Project};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;

/// The writing thread of an open project. Dropping it waits until the newest list has been written.
pub struct EnvironmentListWriter {
    lists: Option<Sender<Vec<NamedEnvironment>>>,
    failures: Receiver<String>,
    thread: Option<JoinHandle<()>>,
}

impl EnvironmentListWriter {
    /// Starts the thread for the project in folder `root`. `list` is what the window has read there;
    /// `wake` is called when something could not be written.
    pub fn start(
        root: PathBuf,
        list: Vec<NamedEnvironment>,
        wake: impl Fn() + Send + 'static,
    ) -> Self {
        let (lists, waiting) = channel::<Vec<NamedEnvironment>>();
        let (fail, failures) = channel();
        let thread = std::thread::spawn(move || {
            let mut written = list;
            while let Ok(list) = waiting.recv() {
                // Of several lists the last is enough.
                let list = waiting.try_iter().last().unwrap_or(list);
                match Project::change(&root, |project| bring(project, &written, &list)) {
                    Ok(()) => written = list,
                    Err(e) => {
                        // Nobody listens once the window is closed.
                        let _ = fail.send(e.to_string());
                        wake();
                    }
                }
            }
        });
        Self {
            lists: Some(lists),
            failures,
            thread: Some(thread),
        }
    }

    /// Has this list written soon. Its files are those that the list at the start had, or paths that can be
    /// opened.
    pub fn keep(&self, list: Vec<NamedEnvironment>) {
        if let Some(lists) = &self.lists {
            // The thread ends with this struct.
            let _ = lists.send(list);
        }
    }

    /// What could not be written since the last call.
    pub fn failures(&self) -> impl Iterator<Item = String> {
        self.failures.try_iter()
    }
}

impl Drop for EnvironmentListWriter {
    fn drop(&mut self) {
        self.lists = None;
        if let Some(thread) = self.thread.take() {
            // A panic of the thread has been said on stderr.
            let _ = thread.join();
        }
    }
}

/// Makes the changes between two lists. What others changed in the project meanwhile stays.
fn bring(
    project: &mut Project,
    before: &[NamedEnvironment],
    after: &[NamedEnvironment],
) -> Result<()> {
    fn of<'a>(
        list: &'a [NamedEnvironment],
        one: &NamedEnvironment,
    ) -> Option<&'a NamedEnvironment> {
        list.iter().find(|other| other.file == one.file)
    }
    for gone in before.iter().filter(|one| of(after, one).is_none()) {
        if project.environment(&gone.file).is_some() {
            project.remove_environment(&gone.file)?;
        }
    }
    for now in after {
        match of(before, now) {
            Some(old) if old.front == now.front => {}
            Some(_) => project.set_front(&now.file, now.front)?,
            None => project.add_environment(&now.file, now.front),
        }
    }
    Ok(())
}
