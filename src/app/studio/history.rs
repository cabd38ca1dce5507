//! Undo and redo steps.

use super::look::LookSettings;
use std::mem::replace;

/// Looks before the current one, and looks that were undone. The nearest is last in each.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct History {
    pub undo: Vec<LookSettings>,
    pub redo: Vec<LookSettings>,
}

impl History {
    /// Adds the step from `before`. Clears the redo steps.
    pub fn push(&mut self, before: LookSettings) {
        self.undo.push(before);
        self.redo.clear();
    }

    /// Goes one step back or forward from the current look. Returns true if there was a step.
    pub fn travel(&mut self, back: bool, look: &mut LookSettings) -> bool {
        let (from, to) = if back { (&mut self.undo, &mut self.redo) } else { (&mut self.redo, &mut self.undo) };
        let step = from.pop();
        let went = step.is_some();
        to.extend(step.map(|step| replace(look, step)));
        went
    }
}
