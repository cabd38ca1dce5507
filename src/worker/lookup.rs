//! A thread that answers small questions beside the window's: what is on the disk.

use std::sync::mpsc::{Receiver, Sender, channel};

/// The thread. The newest question counts; older ones are not answered. Dropping it never waits: the thread
/// ends after the answer in hand.
pub struct Lookup<Ask, Answer> {
    asks: Sender<Ask>,
    answers: Receiver<Answer>,
}

impl<Ask: Send + 'static, Answer: Send + 'static> Lookup<Ask, Answer> {
    /// Starts the thread; `wake` is called after each answer.
    pub fn start(
        wake: impl Fn() + Send + 'static,
        mut answer: impl FnMut(Ask) -> Answer + Send + 'static,
    ) -> Self {
        let (asks, asked) = channel();
        let (send, answers) = channel();
        std::thread::spawn(move || {
            while let Ok(mut ask) = asked.recv() {
                while let Ok(newer) = asked.try_recv() {
                    ask = newer;
                }
                if send.send(answer(ask)).is_err() {
                    break;
                }
                wake();
            }
        });
        Self { asks, answers }
    }

    /// Asks in place of what was asked before and is not begun.
    pub fn ask(&self, ask: Ask) {
        // The thread ends with this struct.
        let _ = self.asks.send(ask);
    }

    /// The answers since the last call.
    pub fn answers(&self) -> impl Iterator<Item = Answer> {
        self.answers.try_iter()
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
            move |n: u32| {
                held.recv().unwrap();
                2 * n
            },
        );
        (1..=100).for_each(|n| lookup.ask(n));
        let mut answers = Vec::new();
        while answers.last() != Some(&200) {
            let_go.send(()).unwrap();
            rung.recv().unwrap();
            answers.extend(lookup.answers());
        }
        // The first may have been begun while the others came.
        assert!(answers.len() <= 2, "{answers:?}");
    }
}
