//! Panoramas added since the window was opened.

use super::State;
use crate::environment_list::ListedEnvironment;
use crate::look::LookSettings;
use worker::Origin;

/// An added panorama, and the environment before it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Added {
    pub origin: Origin,
    pub before: Option<Origin>,
}

/// The panoramas added since the window was opened.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Additions {
    pub added: Vec<Added>,
    /// Panorama of a watched folder that the last command added to the list.
    pub tried: Option<Origin>,
}

impl State {
    /// Keeps the panorama that was tried in the list.
    pub fn keep_tried(&mut self) {
        self.additions.tried = None;
    }

    /// Notes what was added to the `list` of before, in which the entry `lit_by` was shown.
    pub(super) fn note_added(&mut self, list: &[ListedEnvironment], lit_by: usize) {
        let now = self.look.environments.clone();
        let is_in = |list: &[ListedEnvironment], origin: &Origin| list.iter().any(|listed| listed.origin == *origin);
        let mut before = list.get(lit_by).map(|listed| listed.origin.clone());
        // One that was tried has gone again: what was shown before it comes back.
        if let Some(tried) = before.clone().filter(|origin| !is_in(&now, origin)) {
            let earlier = self.additions.added.iter().rfind(|added| added.origin == tried);
            before = earlier.and_then(|added| added.before.clone());
        }
        let new = now.iter().filter(|listed| !is_in(list, &listed.origin));
        self.additions.added.extend(new.map(|listed| Added { origin: listed.origin.clone(), before: before.clone() }));
    }

    /// Removes an unreadable panorama from the list if it was added since the window was opened, and restores the
    /// environment before it. Returns true if it was such a panorama.
    pub fn withdraw(&mut self, origin: &Origin) -> bool {
        let Some(added) = self.additions.added.iter().position(|added| added.origin == *origin) else { return false };
        let before = self.additions.added.remove(added).before;
        let lists = self.history.undo.iter_mut().chain(&mut self.history.redo);
        for look in lists.chain([&mut self.look]) {
            let place = |look: &LookSettings, of: &Origin| {
                let mut list = look.environments.iter();
                list.position(|listed| listed.origin == *of)
            };
            if let Some(at) = place(look, origin) {
                let is_shown = look.environment == at;
                look.remove(at);
                if let Some(before) = before.as_ref().filter(|_| is_shown) {
                    look.environment = place(look, before).unwrap_or(look.environment);
                }
            }
        }
        // Undo of the addition is no longer possible.
        while self.history.undo.last() == Some(&self.look) {
            self.history.undo.pop();
        }
        true
    }
}
