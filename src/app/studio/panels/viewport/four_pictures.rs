//! Pictures of four looks side by side.

use crate::four_looks::{FourLooks, FourSlot};
use crate::look::LookSettings;
use crate::panels::environments::library::{EnvironmentEntry, light_of};
use crate::state::State;
use crate::stored_looks::StoredLooks;
use worker::{LookView, Origin};

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
}

impl FourLooks {
    /// The environments of the visible looks.
    pub fn environments(&self, state: &State, stored: &StoredLooks) -> Vec<Origin> {
        let shown = self.slots.iter().filter(|_| self.on);
        shown.filter_map(|slot| slot.environment(state, stored)).collect()
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
    pub fn new(slot: &FourSlot, state: &State, stored: &StoredLooks, environments: &[EnvironmentEntry]) -> Self {
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
        let Some(entry) = environments.get(look.environment) else { return Self::Missing("No environment".to_owned()) };
        match light_of(environments, &entry.listed.origin) {
            Some(environment) => Self::View(Box::new(LookView { scene: state.scene_of(look), environment })),
            None if entry.panorama.is_failed() => Self::Missing(format!("{} cannot be read", entry.listed.name)),
            None => Self::Waiting,
        }
    }
}
