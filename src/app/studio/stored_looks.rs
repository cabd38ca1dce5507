//! Stored looks of a project and a person: the contents of both shelves, and the thread that reads and writes them.

use super::look_name::LookName;
use super::look_shelf::{LookShelf, LookVersion, ReadPictures, ShelfContents, ShelvedLook};
use base::error::Result;
use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use worker::background::{Background, Handler, Request};

/// Place of stored looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Shelf {
    /// In the open project.
    Project,
    /// In a person's settings, for all projects.
    Person,
}

impl Shelf {
    /// Both of them.
    pub const ALL: [Self; 2] = [Self::Project, Self::Person];
}

/// A stored look.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LookId {
    pub shelf: Shelf,
    pub name: LookName,
}

/// Action on a shelf, and the version that it stored, if any.
type Act = Box<dyn FnOnce(&LookShelf) -> Result<Option<(LookName, u32)>> + Send>;

struct ShelfRequest {
    shelf: Shelf,
    at: LookShelf,
    act: Option<Act>,
    /// Message once it is done.
    said: Option<String>,
}

/// Result of a request, and the contents of the shelf after it.
struct ShelfAnswer {
    shelf: Shelf,
    at: LookShelf,
    stored: Result<Option<(LookName, u32)>>,
    said: Option<String>,
    contents: Option<ShelfContents>,
}

struct Keeping<Wake> {
    pictures: ReadPictures,
    answers: Sender<ShelfAnswer>,
    wake: Wake,
}

/// The thread, and the results of its reads and writes.
struct Keeper {
    thread: Background<ShelfRequest>,
    answers: Receiver<ShelfAnswer>,
}

/// News from the shelves.
#[derive(Debug, PartialEq)]
pub enum LookNews {
    /// A version was stored.
    Stored(LookId, u32),
    /// Message about a finished action.
    Done(String),
    /// Reason that something could not be done.
    Failed(String),
    /// A file that is not a look.
    Unreadable(String),
}

/// Both shelves. Dropping them waits until everything is written.
pub struct StoredLooks {
    shelves: [Option<LookShelf>; 2],
    contents: [ShelfContents; 2],
    keeper: Option<Keeper>,
    wake: Arc<dyn Fn() + Send + Sync>,
    /// Number of unanswered requests.
    waiting: usize,
    /// Files reported already.
    told: BTreeSet<String>,
    /// The last stored or applied version.
    pub current: Option<(LookId, u32)>,
    /// The version of the last thumbnail.
    pub drawn: Option<(LookId, u32)>,
}

impl StoredLooks {
    /// Looks of a person whose settings are in `folder`; None without preferences.
    pub fn new(folder: Option<&Path>, wake: impl Fn() + Send + Sync + 'static) -> Self {
        Self {
            shelves: [None, folder.map(LookShelf::within)],
            contents: Default::default(),
            keeper: None,
            wake: Arc::new(wake),
            waiting: 0,
            told: BTreeSet::new(),
            current: None,
            drawn: None,
        }
    }

    /// Switches to another project's looks.
    pub fn open(&mut self, root: &Path) {
        self.shelves[Shelf::Project as usize] = Some(LookShelf::within(root));
        self.contents[Shelf::Project as usize] = ShelfContents::default();
        (self.current, self.drawn) = (None, None);
        self.read();
    }

    /// Rereads both shelves.
    pub fn read(&mut self) {
        for shelf in Shelf::ALL {
            self.put(shelf, None, None);
        }
    }

    /// Folder of a shelf's looks; None if the shelf does not exist.
    pub fn shelf(&self, shelf: Shelf) -> Option<&LookShelf> {
        self.shelves[shelf as usize].as_ref()
    }

    /// Queues an action on a shelf. `act` returns the version that it stored.
    pub fn act(
        &mut self,
        shelf: Shelf,
        act: impl FnOnce(&LookShelf) -> Result<Option<(LookName, u32)>> + Send + 'static,
    ) {
        self.put(shelf, Some(Box::new(act)), None);
    }

    /// The same, with a message for the end of the action.
    pub fn act_and_say(
        &mut self,
        shelf: Shelf,
        said: String,
        act: impl FnOnce(&LookShelf) -> Result<Option<(LookName, u32)>> + Send + 'static,
    ) {
        self.put(shelf, Some(Box::new(act)), Some(said));
    }

    fn put(&mut self, shelf: Shelf, act: Option<Act>, said: Option<String>) {
        let Some(at) = self.shelves[shelf as usize].clone() else { return };
        let keeper = self.keeper.get_or_insert_with(|| {
            let (send, answers) = channel();
            let wake = self.wake.clone();
            let thread = Background::spawn("looks", move |_| Keeping {
                pictures: ReadPictures::default(),
                answers: send,
                wake: move || wake(),
            });
            Keeper { thread, answers }
        });
        self.waiting += 1;
        keeper.thread.put(ShelfRequest { shelf, at, act, said });
    }

    /// True while a request is unanswered.
    pub fn is_busy(&self) -> bool {
        self.waiting > 0
    }

    /// Takes in results since the last call.
    pub fn receive(&mut self) -> Vec<LookNews> {
        let answers = self.keeper.iter().flat_map(|k| k.answers.try_iter());
        let mut news = Vec::new();
        for answer in answers.collect::<Vec<_>>() {
            self.waiting -= 1;
            let shelf = answer.shelf;
            // Another project may have been opened meanwhile.
            let is_open = self.shelf(shelf) == Some(&answer.at);
            if answer.stored.is_ok() {
                news.extend(answer.said.map(LookNews::Done));
            }
            match answer.stored {
                Ok(Some((name, number))) if is_open => {
                    news.push(LookNews::Stored(LookId { shelf, name }, number));
                }
                Ok(_) => {}
                Err(e) => news.push(LookNews::Failed(e.to_string())),
            }
            if let Some(contents) = answer.contents.filter(|_| is_open) {
                for sentence in &contents.complaints {
                    if self.told.insert(sentence.clone()) {
                        news.push(LookNews::Unreadable(sentence.clone()));
                    }
                }
                self.contents[shelf as usize] = contents;
            }
        }
        news
    }

    /// Looks of a shelf, in order of their names.
    pub fn looks(&self, shelf: Shelf) -> &[ShelvedLook] {
        &self.contents[shelf as usize].looks
    }

    /// Looks removed from a shelf.
    pub fn removed(&self, shelf: Shelf) -> &[LookName] {
        &self.contents[shelf as usize].removed
    }

    /// All looks, the project's first.
    pub fn ids(&self) -> impl Iterator<Item = LookId> {
        Shelf::ALL.into_iter().flat_map(|shelf| {
            let name = move |look: &ShelvedLook| LookId { shelf, name: look.name.clone() };
            self.looks(shelf).iter().map(name)
        })
    }

    /// A version of a look; None for the newest.
    pub fn version(&self, of: &LookId, number: Option<u32>) -> Option<&LookVersion> {
        let look = self.looks(of.shelf).iter().find(|look| look.name == of.name);
        let mut versions = look?.versions.iter();
        match number {
            Some(number) => versions.find(|version| version.number == number),
            None => versions.next(),
        }
    }
}

impl Request for ShelfRequest {
    /// All requests are done, one after another.
    fn lane(&self) -> Option<usize> {
        None
    }

    fn is_kept(&self) -> bool {
        self.act.is_some()
    }
}

impl<Wake: Fn()> Handler for Keeping<Wake> {
    type Request = ShelfRequest;
    type Answer = (Result<Option<(LookName, u32)>>, ShelfContents);

    fn work(&mut self, request: &mut ShelfRequest) -> Result<Self::Answer> {
        let stored = request.act.take().map_or(Ok(None), |act| act(&request.at));
        Ok((stored, request.at.list(&mut self.pictures)))
    }

    fn deliver(&mut self, request: ShelfRequest, answer: Result<Self::Answer>) {
        let (stored, contents) = match answer {
            Ok((stored, contents)) => (stored, Some(contents)),
            Err(e) => (Err(e), None),
        };
        let ShelfRequest { shelf, at, said, .. } = request;
        let answer = ShelfAnswer { shelf, at, stored, said, contents };
        // Fails once the window is closed, when the result does not matter.
        if self.answers.send(answer).is_ok() {
            (self.wake)();
        }
    }
}
