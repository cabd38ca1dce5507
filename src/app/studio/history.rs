//! The steps of undo and redo.

use super::look::LookSettings;
use std::mem::replace;

/// The looks before the present one, and those that were undone; in each, the nearest is last.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct History {
    pub undo: Vec<LookSettings>,
    pub redo: Vec<LookSettings>,
}

impl History {
    /// Adds a step: `before` was changed. What was undone cannot be redone any more.
    pub fn push(&mut self, before: LookSettings) {
        self.undo.push(before);
        self.redo.clear();
    }

    /// Goes a step back or forth from the present look. Returns whether there was one.
    pub fn travel(&mut self, back: bool, look: &mut LookSettings) -> bool {
        let (from, to) = match back {
            true => (&mut self.undo, &mut self.redo),
            false => (&mut self.redo, &mut self.undo),
        };
        let step = from.pop();
        let went = step.is_some();
        to.extend(step.map(|step| replace(look, step)));
        went
    }
}
