//! The thread behind *Accuracy*: reads the measurements and the pictures of rungs.

use super::background::{Background, Handler};
use super::latest::Latest;
use super::mailbox::Request;
use super::srgb_picture::SrgbPicture;
use base::error::Result;
use imaging::file::read_encoded;
use project::Project;
use std::path::PathBuf;
use std::sync::Arc;
use tradeoff::{Ledger, folder};

/// Longer side of a rung's picture, in pixels.
const PICTURE_PX: usize = 640;

type Answer<T> = std::result::Result<T, String>;

/// The thread. Dropping it stops it after the current answer.
pub struct LadderThread {
    thread: Background<LadderRequest>,
    answers: Answers,
}

#[derive(Clone)]
struct Answers {
    ledger: Arc<Latest<Answer<Option<Arc<Ledger>>>>>,
    pictures: Arc<Latest<Answer<LadderPictures>>>,
}

/// Pictures of rungs beside the truth, all at one exposure.
#[derive(Clone, Debug, PartialEq)]
pub struct LadderPictures {
    /// Names in the ladder's folder of pictures, and the pictures.
    pub pictures: Vec<(String, SrgbPicture)>,
}

enum LadderRequest {
    Read,
    Pictures(Vec<String>),
}

enum Done {
    Ledger(Option<Arc<Ledger>>),
    Pictures(LadderPictures),
}

struct Reading {
    root: PathBuf,
    answers: Answers,
}

impl LadderThread {
    /// Starts the thread on the project in `root`; `wake` is called after each answer.
    pub fn start(root: PathBuf, wake: impl Fn() + Clone + Send + Sync + 'static) -> Self {
        let answers = Answers {
            ledger: Arc::new(Latest::new(wake.clone())),
            pictures: Arc::new(Latest::new(wake)),
        };
        let own = answers.clone();
        let thread = Background::spawn("ladder", move |_| Reading { root, answers: own });
        Self { thread, answers }
    }

    /// Requests the current measurements.
    pub fn read(&self) {
        self.thread.put(LadderRequest::Read);
    }

    /// Requests these pictures.
    pub fn draw(&self, names: Vec<String>) {
        self.thread.put(LadderRequest::Pictures(names));
    }

    /// The newest answers, once.
    pub fn ledger(&self) -> Option<Answer<Option<Arc<Ledger>>>> {
        self.answers.ledger.take()
    }

    pub fn pictures(&self) -> Option<Answer<LadderPictures>> {
        self.answers.pictures.take()
    }
}

impl Request for LadderRequest {
    fn lane(&self) -> Option<usize> {
        Some(match self {
            Self::Read => 0,
            Self::Pictures(_) => 1,
        })
    }
}

impl Handler for Reading {
    type Request = LadderRequest;
    type Answer = Done;

    fn work(&mut self, request: &mut LadderRequest) -> Result<Done> {
        let project = Project::open(&self.root)?;
        match request {
            LadderRequest::Read => Ok(Done::Ledger(Ledger::load(&project)?.map(Arc::new))),
            LadderRequest::Pictures(names) => {
                let pictures = folder(&project).join("pictures");
                let read = |name: &String| {
                    let picture = read_encoded(&pictures.join(name))?;
                    Ok((name.clone(), SrgbPicture::reduced(&picture, PICTURE_PX)))
                };
                let pictures = names.iter().map(read).collect::<Result<_>>()?;
                Ok(Done::Pictures(LadderPictures { pictures }))
            }
        }
    }

    fn deliver(&mut self, request: LadderRequest, answer: Result<Done>) {
        match (request, answer.map_err(|e| e.to_string())) {
            (_, Ok(Done::Ledger(ledger))) => self.answers.ledger.put(Ok(ledger)),
            (_, Ok(Done::Pictures(pictures))) => self.answers.pictures.put(Ok(pictures)),
            (LadderRequest::Read, Err(sentence)) => self.answers.ledger.put(Err(sentence)),
            (LadderRequest::Pictures(_), Err(sentence)) => self.answers.pictures.put(Err(sentence)),
        }
    }
}
