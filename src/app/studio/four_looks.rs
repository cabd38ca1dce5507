//! Four looks side by side: the slots.

use super::stored_looks::LookId;

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

    /// Follows the renaming of a look.
    pub fn rename(&mut self, from: &LookId, to: &LookId) {
        self.slots.iter_mut().for_each(|slot| slot.rename(from, to));
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
