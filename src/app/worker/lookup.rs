//! A thread for small look-ups off the window's thread: on the disk, or in a field on the GPU.

use super::background::{Background, Handler};
use super::mailbox::Request;
use base::error::Result;
use std::sync::mpsc::{Receiver, Sender, channel};

/// The thread. Only the newest question is answered. Dropping it never waits: the thread ends after the current
/// answer.
pub struct Lookup<Question: Send + 'static, Answer> {
    thread: Background<Asked<Question>>,
    answers: Receiver<(Question, Result<Answer>)>,
}

struct Asked<Question>(Question);

impl<Question: Send + 'static> Request for Asked<Question> {}

struct Answering<Find, Wake, Question, Answer> {
    find: Find,
    answers: Sender<(Question, Result<Answer>)>,
    wake: Wake,
}

impl<Question: Send + 'static, Answer: Send + 'static> Lookup<Question, Answer> {
    /// Starts the thread; `wake` is called after each answer. A panic of `find` is an answer too: an error.
    pub fn start(
        wake: impl Fn() + Send + 'static,
        find: impl FnMut(&Question) -> Result<Answer> + Send + 'static,
    ) -> Self {
        let (send, answers) = channel();
        let thread = Background::spawn("lookup", move |_| Answering { find, answers: send, wake });
        Self { thread: thread.detached(), answers }
    }

    /// Sends a question; replaces an earlier one that has not begun.
    pub fn ask(&self, question: Question) {
        self.thread.put(Asked(question));
    }

    /// Questions and their answers since the last call.
    pub fn answers(&self) -> impl Iterator<Item = (Question, Result<Answer>)> {
        self.answers.try_iter()
    }
}

impl<Find, Wake, Question, Answer> Handler for Answering<Find, Wake, Question, Answer>
where
    Find: FnMut(&Question) -> Result<Answer>,
    Wake: Fn(),
    Question: Send + 'static,
{
    type Request = Asked<Question>;
    type Answer = Answer;

    fn work(&mut self, Asked(question): &mut Asked<Question>) -> Result<Answer> {
        (self.find)(question)
    }

    fn deliver(&mut self, Asked(question): Asked<Question>, answer: Result<Answer>) {
        // The receiver is gone once the lookup is dropped.
        if self.answers.send((question, answer)).is_ok() {
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
        let lookup = Lookup::start(
            move || woke.send(()).unwrap(),
            move |n: &u32| {
                held.recv().unwrap();
                Ok(2 * n)
            },
        );
        (1..=100).for_each(|n| lookup.ask(n));
        let mut answers = Vec::new();
        while answers.last() != Some(&(100, 200)) {
            let_go.send(()).unwrap();
            rung.recv().unwrap();
            answers.extend(lookup.answers().map(|(n, answer)| (n, answer.unwrap())));
        }
        // The first may have begun before the others came.
        assert!(answers.len() <= 2, "{answers:?}");
    }

    #[test]
    fn a_panic_is_an_answer_and_the_next_question_is_answered() {
        let (woke, rung) = channel();
        let find = |n: &u32| Ok(12 / *n);
        let lookup = Lookup::start(move || woke.send(()).unwrap(), find);
        for n in [0, 4] {
            lookup.ask(n);
            rung.recv().unwrap();
        }
        let answers: Vec<(u32, Result<u32>)> = lookup.answers().collect();
        let sentence = answers[0].1.as_ref().unwrap_err().to_string();
        assert!(sentence.contains("divide by zero"), "{sentence}");
        assert_eq!(*answers[1].1.as_ref().unwrap(), 3);
    }
}
