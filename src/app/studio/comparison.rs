//! Comparison of the picture with another, and the ways to show both.

use super::stored_looks::LookId;
use std::path::PathBuf;
use worker::Origin;

/// A reference picture.
#[derive(Clone, Debug, PartialEq)]
pub enum Reference {
    /// The interview's frame.
    Plate,
    /// The same frame under another environment of the list.
    Environment(Origin),
    /// The same frame in a version of a stored look, by number; None for the newest.
    Look(LookId, Option<u32>),
    /// The photographs of a pose, in the same light.
    Exemplar(usize),
    /// The true OLATs in a folder, in the same light.
    Truth(PathBuf),
    /// The OLATs corrected by another network, in the same light.
    Checkpoint(PathBuf),
    /// The transfer from the exemplars, without a network, in the same light.
    Transfer,
}

/// Way to show two pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CompareMode {
    /// The first picture left of a line that can be dragged, the second right of it.
    Wipe,
    /// Side by side.
    Side,
    /// One at a time.
    Toggle,
    /// Their difference.
    Difference,
}

/// Factors for the difference of two pictures.
pub const GAINS: [f32; 5] = [1.0, 2.0, 4.0, 8.0, 16.0];

/// A picture of a measured cell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellPicture {
    Prediction,
    Truth,
    Difference,
}

impl CellPicture {
    /// All of them, from left to right.
    pub const ALL: [Self; 3] = [Self::Prediction, Self::Truth, Self::Difference];

    /// The truth after the prediction, the prediction after any other.
    pub fn flipped(shown: Option<Self>) -> Self {
        match shown {
            Some(Self::Prediction) => Self::Truth,
            _ => Self::Prediction,
        }
    }
}

/// The comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct CompareSettings {
    pub on: bool,
    /// The first picture; None for the relit picture.
    pub first: Option<Reference>,
    /// The second picture.
    pub reference: Reference,
    pub mode: CompareMode,
    /// True if the second picture is shown in [`CompareMode::Toggle`].
    pub second: bool,
}

impl Default for CompareSettings {
    fn default() -> Self {
        Self { on: false, first: None, reference: Reference::Plate, mode: CompareMode::Wipe, second: false }
    }
}

impl CompareSettings {
    /// Starts or stops the wipe.
    pub fn toggle_wipe(&mut self) {
        self.on = !(self.on && self.mode == CompareMode::Wipe);
        self.mode = CompareMode::Wipe;
    }

    /// Switches to the other of the two pictures.
    pub fn toggle_second(&mut self) {
        self.second = !(self.on && self.mode == CompareMode::Toggle && self.second);
        (self.on, self.mode) = (true, CompareMode::Toggle);
    }

    /// First and second picture of an active comparison; None stands in place of the relit picture.
    pub fn references(&self) -> [Option<&Reference>; 2] {
        if self.on { [self.first.as_ref(), Some(&self.reference)] } else { [None, None] }
    }

    /// Follows the renaming of a look.
    pub fn rename(&mut self, from: &LookId, to: &LookId) {
        for one in self.first.iter_mut().chain([&mut self.reference]) {
            if let Reference::Look(id, _) = one
                && id == from
            {
                *id = to.clone();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn w_wipes_and_q_changes_sides() {
        let mut compare = CompareSettings::default();
        compare.toggle_wipe();
        assert!(compare.on && compare.mode == CompareMode::Wipe);
        compare.toggle_second();
        assert!(compare.on && compare.mode == CompareMode::Toggle && compare.second);
        compare.toggle_second();
        assert!(compare.on && !compare.second);
        compare.toggle_wipe();
        assert!(compare.on && compare.mode == CompareMode::Wipe);
        compare.toggle_wipe();
        assert!(!compare.on);
    }
}
