//! A question answered in the background: on the disk, in a field on the GPU, or by a fit.

use super::background::{Background, Handler};
use super::mailbox::{Mailbox, Request};
use base::error::Result;
use base::progress::Control;
use std::sync::mpsc::{Receiver, Sender, channel};

/// The last key, and the thread that finds its answer. A key replaces an earlier one whose search has not begun.
/// Dropping a query never waits: the thread is told to stop, and ends after the current search.
pub struct Query<Key: Send + 'static, Answer> {
    finder: Option<Finder<Key, Answer>>,
    asked: Option<Key>,
    /// True if the last key is searched even after the query is dropped.
    kept: bool,
    /// Number of keys sent, and the number of the last answered one.
    sent: u64,
    answered: u64,
}

struct Finder<Key: Send + 'static, Answer> {
    /// Dropped before the thread is told to stop, so that an answer of that time wakes nobody.
    answers: Receiver<(Numbered<Key>, Result<Answer>)>,
    thread: Background<Numbered<Key>>,
}

/// A key, and its number from 1.
struct Numbered<Key> {
    key: Key,
    number: u64,
    kept: bool,
}

impl<Key: Send + 'static> Request for Numbered<Key> {
    fn is_kept(&self) -> bool {
        self.kept
    }
}

struct Finding<Find, Wake, Key, Answer> {
    find: Find,
    answers: Sender<(Numbered<Key>, Result<Answer>)>,
    wake: Wake,
}

impl<Key: Send + 'static, Answer> Default for Query<Key, Answer> {
    fn default() -> Self {
        Self { finder: None, asked: None, kept: false, sent: 0, answered: 0 }
    }
}

impl<Key: Clone + PartialEq + Send + 'static, Answer: Send + 'static> Query<Key, Answer> {
    /// A query that writes: its last key is searched even after it is dropped.
    pub fn kept() -> Self {
        Self { kept: true, ..Self::default() }
    }

    /// A query whose thread has started. `make` returns the search, and takes the control that a long search polls
    /// to know when to stop; `wake` is called after each answer. A panic of the search is an answer too: an error.
    pub fn start<Find>(wake: impl Fn() + Send + 'static, make: impl FnOnce(Control) -> Find) -> Self
    where
        Find: FnMut(&Key) -> Result<Answer> + Send + 'static,
    {
        let (send, answers) = channel();
        let stop = Control::default();
        let finding = Finding { find: make(stop.clone()), answers: send, wake };
        let thread = Background::start("query", Mailbox::new(), stop, move || finding).detached();
        Self { finder: Some(Finder { answers, thread }), ..Self::default() }
    }

    /// Sends a key and returns true, unless it is the last one. The first key starts the thread, as
    /// [`Self::start`].
    pub fn ask<Find>(&mut self, key: Key, wake: impl Fn() + Send + 'static, make: impl FnOnce(Control) -> Find) -> bool
    where
        Find: FnMut(&Key) -> Result<Answer> + Send + 'static,
    {
        if self.asked.as_ref() == Some(&key) {
            return false;
        }
        if self.finder.is_none() {
            self.finder = Self::start(wake, make).finder;
        }
        self.sent += 1;
        if let Some(finder) = &self.finder {
            let (number, kept) = (self.sent, self.kept);
            finder.thread.put(Numbered { key: key.clone(), number, kept });
        }
        self.asked = Some(key);
        true
    }

    /// The last key; None before the first, and once forgotten.
    pub fn asked(&self) -> Option<&Key> {
        self.asked.as_ref()
    }

    /// Makes the next [`Self::ask`] send its key, even the same one.
    pub fn forget(&mut self) {
        self.asked = None;
    }

    /// True until the answer to the last key sent is received.
    pub fn is_waiting(&self) -> bool {
        self.answered < self.sent
    }

    /// Keys and their answers, or the reasons for their absence, since the last call.
    pub fn answers(&mut self) -> impl Iterator<Item = (Key, std::result::Result<Answer, String>)> {
        let answered = &mut self.answered;
        let answers = self.finder.iter().flat_map(|finder| finder.answers.try_iter());
        answers.map(|(Numbered { number, key, .. }, answer)| {
            *answered = number;
            (key, answer.map_err(|e| e.to_string()))
        })
    }
}

impl<Find, Wake, Key, Answer> Handler for Finding<Find, Wake, Key, Answer>
where
    Find: FnMut(&Key) -> Result<Answer>,
    Wake: Fn(),
    Key: Send + 'static,
{
    type Request = Numbered<Key>;
    type Answer = Answer;

    fn work(&mut self, request: &mut Numbered<Key>) -> Result<Answer> {
        (self.find)(&request.key)
    }

    fn deliver(&mut self, request: Numbered<Key>, answer: Result<Answer>) {
        // The receiver is gone once the query is dropped.
        if self.answers.send((request, answer)).is_ok() {
            (self.wake)();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_question_is_answered() {
        let (let_go, held) = channel::<()>();
        let (woke, rung) = channel();
        let mut query = Query::start(
            move || woke.send(()).unwrap(),
            |_| {
                move |n: &u32| {
                    held.recv().unwrap();
                    Ok(2 * n)
                }
            },
        );
        let ask = |query: &mut Query<u32, u32>, n| query.ask(n, || {}, |_| |_: &u32| Ok(0));
        assert!(!query.is_waiting());
        for n in 1..=100 {
            assert!(ask(&mut query, n));
            assert!(!ask(&mut query, n), "the same key is sent once");
        }
        let mut answers = Vec::new();
        while query.is_waiting() {
            let_go.send(()).unwrap();
            rung.recv().unwrap();
            answers.extend(query.answers().map(|(n, answer)| (n, answer.unwrap())));
        }
        assert_eq!(answers.last(), Some(&(100, 200)));
        // The first may have begun before the others came.
        assert!(answers.len() <= 2, "{answers:?}");
        query.forget();
        assert!(query.asked().is_none() && ask(&mut query, 100) && query.is_waiting());
    }

    #[test]
    fn a_panic_is_an_answer_and_the_next_question_is_answered() {
        let (woke, rung) = channel();
        let mut query = Query::default();
        let mut answers = Vec::new();
        for n in [0, 4] {
            let woke = woke.clone();
            query.ask(n, move || woke.send(()).unwrap(), |_| |n: &u32| Ok(12 / *n));
            rung.recv().unwrap();
            answers.extend(query.answers());
        }
        let sentence = answers[0].1.as_ref().unwrap_err();
        assert!(sentence.contains("divide by zero"), "{sentence}");
        assert_eq!(answers[1], (4, Ok(3)));
    }

    #[test]
    fn a_dropped_query_stops_its_search_and_does_what_is_kept() {
        for kept in [false, true] {
            let (begin, begun) = channel();
            let (woke, rung) = channel();
            let mut query = Query { kept, ..Query::default() };
            let make = |stop: Control| {
                move |n: &u32| {
                    begin.send(*n).unwrap();
                    while !stop.stopped() {
                        std::thread::yield_now();
                    }
                    Ok(())
                }
            };
            query.ask(1, move || woke.send(()).unwrap(), make);
            assert_eq!(begun.recv(), Ok(1));
            query.ask(2, || {}, |_| |_: &u32| Ok(()));
            drop(query);
            // Both end with the thread. Nobody waits for the answers.
            assert_eq!(begun.iter().collect::<Vec<u32>>(), if kept { vec![2] } else { vec![] });
            assert_eq!(rung.iter().count(), 0);
        }
    }
}
