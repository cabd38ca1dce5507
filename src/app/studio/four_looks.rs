//! Four looks side by side: their slots and the pictures that these need.

use super::environment_library::{EnvironmentEntry, light_of};
use super::look::LookSettings;
use super::state::State;
use super::stored_looks::{LookId, StoredLooks};
use worker::{LookView, Origin};

/// Content of one of the four slots.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum FourSlot {
    #[default]
    Empty,
    /// The current look.
    Present,
    /// A version of a stored look, by number; None for the newest.
    Stored(LookId, Option<u32>),
}

impl FourSlot {
    /// The environment of the slot's look.
    pub fn environment(&self, state: &State, stored: &StoredLooks) -> Option<Origin> {
        let origin = |look: &LookSettings| {
            let listed = look.environments.get(look.environment)?;
            Some(listed.origin.clone())
        };
        match self {
            FourSlot::Empty => None,
            FourSlot::Present => origin(&state.look),
            FourSlot::Stored(id, number) => {
                let version = stored.version(id, *number)?;
                origin(&version.look.in_window(&state.look, state.frame)?)
            }
        }
    }

    /// Follows the renaming of a look.
    pub fn rename(&mut self, from: &LookId, to: &LookId) {
        if let Self::Stored(id, _) = self
            && id == from
        {
            *id = to.clone();
        }
    }

    /// Name of the slot's look, in words.
    pub fn name(&self) -> String {
        match self {
            Self::Empty => "nothing".to_owned(),
            Self::Present => "current look".to_owned(),
            Self::Stored(id, None) => id.name.to_string(),
            Self::Stored(id, Some(number)) => format!("{}, version {number}", id.name),
        }
    }
}

/// The four slots, from the upper left: A, B, C and D.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FourLooks {
    /// True if they replace the picture.
    pub on: bool,
    pub slots: [FourSlot; 4],
    /// True once a person chose the look of a slot.
    chosen: bool,
}

impl FourLooks {
    /// Names of the slots.
    pub const LETTERS: [&'static str; 4] = ["A", "B", "C", "D"];

    /// Fills the slots with the current look and the stored looks, until a person chooses one.
    pub fn fill(&mut self, stored: impl Iterator<Item = LookId>) {
        if self.on && !self.chosen {
            let stored = stored.map(|id| FourSlot::Stored(id, None));
            let mut all = std::iter::once(FourSlot::Present).chain(stored);
            self.slots.fill_with(|| all.next().unwrap_or_default());
        }
    }

    /// Shows this in a slot.
    pub fn place(&mut self, place: usize, slot: FourSlot) {
        if let Some(free) = self.slots.get_mut(place) {
            (*free, self.chosen) = (slot, true);
        }
    }

    /// The environments of the visible looks.
    pub fn environments(&self, state: &State, stored: &StoredLooks) -> Vec<Origin> {
        let shown = self.slots.iter().filter(|_| self.on);
        shown.filter_map(|slot| slot.environment(state, stored)).collect()
    }

    /// Follows the renaming of a look.
    pub fn rename(&mut self, from: &LookId, to: &LookId) {
        self.slots.iter_mut().for_each(|slot| slot.rename(from, to));
    }
}

/// Picture for a slot.
#[derive(Clone, Debug, PartialEq)]
pub enum FourPicture {
    /// Empty slot.
    Empty,
    /// The environment is still being read.
    Waiting,
    /// Reason for the absence of a picture.
    Missing(String),
    View(Box<LookView>),
}

impl FourPicture {
    /// Picture for a slot, given the stored looks.
    pub fn new(
        slot: &FourSlot,
        state: &State,
        stored: &StoredLooks,
        environments: &[EnvironmentEntry],
    ) -> Self {
        match slot {
            FourSlot::Empty => Self::Empty,
            FourSlot::Present => Self::view(&state.look, state, environments),
            FourSlot::Stored(id, number) => {
                let Some(version) = stored.version(id, *number) else {
                    return Self::Missing(if stored.is_busy() {
                        "Reading the looks".to_owned()
                    } else {
                        format!("{} was removed", slot.name())
                    });
                };
                match version.look.in_window(&state.look, state.frame) {
                    Some(look) => Self::view(&look, state, environments),
                    None => Self::Missing(format!(
                        "Environment \u{201c}{}\u{201d} is not in the list. Click the look in Looks to add it.",
                        version.look.environment.name
                    )),
                }
            }
        }
    }

    fn view(look: &LookSettings, state: &State, environments: &[EnvironmentEntry]) -> Self {
        let Some(entry) = environments.get(look.environment) else {
            return Self::Missing("No environment".to_owned());
        };
        match light_of(environments, &entry.listed.origin) {
            Some(environment) => {
                Self::View(Box::new(LookView { scene: state.scene_of(look), environment }))
            }
            None if entry.panorama.is_failed() => {
                Self::Missing(format!("{} cannot be read", entry.listed.name))
            }
            None => Self::Waiting,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::look_name::LookName;
    use super::super::stored_looks::Shelf;
    use super::*;

    #[test]
    fn places_are_filled_until_one_is_chosen_and_follow_a_new_name() {
        let id = |name: &str| LookId { shelf: Shelf::Project, name: LookName::new(name).unwrap() };
        let mut four = FourLooks { on: true, ..FourLooks::default() };
        four.fill([].into_iter());
        assert_eq!(four.slots[1], FourSlot::Empty);
        four.fill(["warm", "cold"].map(id).into_iter());
        let stored = |name| FourSlot::Stored(id(name), None);
        let filled = [FourSlot::Present, stored("warm"), stored("cold"), FourSlot::Empty];
        assert_eq!(four.slots, filled, "looks stored later appear");
        four.place(0, FourSlot::Empty);
        four.fill(["other"].map(id).into_iter());
        assert_eq!(four.slots[0], FourSlot::Empty, "chosen slots stay");
        assert_eq!(four.slots[1], stored("warm"));
        four.rename(&id("warm"), &id("noon"));
        assert_eq!(four.slots[1], stored("noon"));
    }
}
