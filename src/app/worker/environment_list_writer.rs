//! Writes the window's list of environments into `project.toml`, off the window's thread.

use super::background::{Background, Handler};
use super::mailbox::Request;
use base::error::Result;
use project::{NamedEnvironment, Project};
use std::path::PathBuf;
use std::sync::mpsc::{Receiver, Sender, channel};

type List = Vec<NamedEnvironment>;

/// The writing thread of an open project. Dropping it waits for the newest list to be written.
pub struct EnvironmentListWriter {
    thread: Background<ListRequest>,
    failures: Receiver<String>,
}

enum ListRequest {
    Write(List),
    /// Reports when every earlier list has been tried.
    Tell(Sender<()>),
}

struct Writing<Wake> {
    root: PathBuf,
    /// The list in the project.
    written: List,
    failures: Sender<String>,
    wake: Wake,
}

impl EnvironmentListWriter {
    /// Starts the thread for the project in folder `root`. `list` is the one that the window read there; `wake`
    /// is called after a failed write.
    pub fn start(root: PathBuf, list: List, wake: impl Fn() + Send + 'static) -> Self {
        let (send, failures) = channel();
        let thread =
            Background::spawn("environment list", move |_| Writing { root, written: list, failures: send, wake });
        Self { thread, failures }
    }

    /// Schedules a list to be written. Its files are those of the list at the start, or paths that can be opened.
    pub fn keep(&self, list: List) {
        self.thread.put(ListRequest::Write(list));
    }

    /// Receives once every list so far has been tried; fails if this is dropped before.
    pub fn settled(&self) -> Receiver<()> {
        let (done, told) = channel();
        self.thread.put(ListRequest::Tell(done));
        told
    }

    /// Failed writes since the last call.
    pub fn failures(&self) -> impl Iterator<Item = String> {
        self.failures.try_iter()
    }
}

impl Request for ListRequest {
    /// Only the newest list is written; waiting receivers are told after it.
    fn lane(&self) -> Option<usize> {
        matches!(self, Self::Write(_)).then_some(0)
    }

    fn is_kept(&self) -> bool {
        matches!(self, Self::Write(_))
    }
}

impl<Wake: Fn()> Handler for Writing<Wake> {
    type Request = ListRequest;
    type Answer = ();

    fn work(&mut self, request: &mut ListRequest) -> Result<()> {
        match request {
            ListRequest::Write(list) => Project::change(&self.root, |project| bring(project, &self.written, list)),
            ListRequest::Tell(_) => Ok(()),
        }
    }

    fn deliver(&mut self, request: ListRequest, answer: Result<()>) {
        match (request, answer) {
            (ListRequest::Write(list), Ok(())) => self.written = list,
            (ListRequest::Tell(done), _) => {
                // The receiver may be gone.
                let _ = done.send(());
            }
            (ListRequest::Write(_), Err(e)) => {
                // The receiver is gone once the window is closed.
                let _ = self.failures.send(e.to_string());
                (self.wake)();
            }
        }
    }
}

/// Applies the changes between two lists. Other changes in the project meanwhile stay.
fn bring(project: &mut Project, before: &[NamedEnvironment], after: &[NamedEnvironment]) -> Result<()> {
    fn matching<'a>(list: &'a [NamedEnvironment], one: &NamedEnvironment) -> Option<&'a NamedEnvironment> {
        list.iter().find(|other| other.file == one.file)
    }
    for gone in before.iter().filter(|one| matching(after, one).is_none()) {
        if project.environment(&gone.file).is_some() {
            project.remove_environment(&gone.file)?;
        }
    }
    for now in after {
        match matching(before, now) {
            Some(old) if old.front == now.front => {}
            Some(_) => project.set_front(&now.file, now.front)?,
            None => project.add_environment(&now.file, now.front),
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn named(file: PathBuf) -> NamedEnvironment {
        NamedEnvironment { name: "any".to_owned(), file, front: None }
    }

    #[test]
    fn a_list_is_written_before_a_dropped_writer_ends_and_a_panic_is_said() {
        let folder = tempfile::tempdir().unwrap();
        Project::without_shoot(folder.path()).save().unwrap();
        let [first, second] = ["first.exr", "second.exr"].map(|name| folder.path().join(name));
        let (wake, woken) = channel();
        let root = folder.path().to_path_buf();
        let writer = EnvironmentListWriter::start(root, vec![], move || wake.send(()).unwrap());
        writer.thread.panic_next();
        writer.keep(vec![named(first.clone())]);
        woken.recv().unwrap();
        let said: Vec<String> = writer.failures().collect();
        assert!(said.len() == 1 && said[0].contains("on purpose"), "{said:?}");
        // The next list includes the changes of the failed one.
        writer.keep(vec![named(first.clone())]);
        writer.settled().recv().unwrap();
        let environments = || Project::open(folder.path()).unwrap().environments().len();
        assert_eq!(environments(), 1);
        writer.keep(vec![named(first), named(second)]);
        drop(writer);
        assert_eq!(Project::open(folder.path()).unwrap().environments().len(), 2);
    }
}
