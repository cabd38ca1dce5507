//! What the picture is compared with, and how both are shown.

use super::environment_list::ListedEnvironment;
use super::look::LookSettings;
use light::Environment;
use light::conventions::Front;
use std::path::PathBuf;
use std::sync::Arc;
use worker::{Comparison, ComparisonSource, Origin};

/// A picture to compare with.
#[derive(Clone, Debug, PartialEq)]
pub enum Reference {
    /// The interview's frame.
    Plate,
    /// The same frame under another environment of the list.
    Environment(Origin),
    /// The photographs of a pose in the same light.
    Exemplar(usize),
    /// The true OLATs in a folder, in the same light.
    Truth(PathBuf),
    /// Another network's OLATs in the same light.
    Checkpoint(PathBuf),
}

/// How two pictures are shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CompareMode {
    /// The first to the left of a line that can be dragged, the second to its right.
    Wipe,
    /// Side by side.
    Side,
    /// One at a time.
    Toggle,
    /// Their difference.
    Difference,
}

/// What the difference of two pictures can be multiplied by.
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

    /// The truth after the prediction, and the prediction after any other.
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
    /// The first picture; None for the relit one.
    pub first: Option<Reference>,
    /// The second picture.
    pub reference: Reference,
    pub mode: CompareMode,
    /// In [`CompareMode::Toggle`], whether the second is shown.
    pub second: bool,
}

impl Default for CompareSettings {
    fn default() -> Self {
        Self {
            on: false,
            first: None,
            reference: Reference::Plate,
            mode: CompareMode::Wipe,
            second: false,
        }
    }
}

impl CompareSettings {
    /// Starts or stops the wipe.
    pub fn toggle_wipe(&mut self) {
        self.on = !(self.on && self.mode == CompareMode::Wipe);
        self.mode = CompareMode::Wipe;
    }

    /// Shows the other of the two alone.
    pub fn toggle_second(&mut self) {
        self.second = !(self.on && self.mode == CompareMode::Toggle && self.second);
        (self.on, self.mode) = (true, CompareMode::Toggle);
    }

    /// The environments that are compared.
    pub fn environments(&self) -> impl Iterator<Item = &Origin> {
        let both = [self.first.as_ref(), Some(&self.reference)].into_iter();
        let compared = both.flatten().filter(|_| self.on);
        compared.filter_map(|one| match one {
            Reference::Environment(origin) => Some(origin),
            _ => None,
        })
    }

    /// The pictures that these settings ask for besides the relit one, the first and the second; None for an
    /// environment that is not loaded. `environment` gives those that are.
    pub fn pictures(
        &self,
        look: &LookSettings,
        environment: impl Fn(&Origin) -> Option<Arc<Environment>>,
    ) -> [Option<Comparison>; 2] {
        if !self.on {
            return [None, None];
        }
        [self.first.as_ref(), Some(&self.reference)].map(|shown| shown?.picture(look, &environment))
    }
}

impl Reference {
    fn picture(
        &self,
        look: &LookSettings,
        environment: impl Fn(&Origin) -> Option<Arc<Environment>>,
    ) -> Option<Comparison> {
        Some(match self {
            Self::Plate => Comparison::Plate,
            Self::Environment(origin) => {
                let mut list = look.environments.iter();
                let listed = list.find(|listed| listed.origin == *origin);
                let front = listed.map_or(Front::default(), ListedEnvironment::front);
                Comparison::Light(environment(origin)?, front.turned(look.yaw_deg))
            }
            Self::Exemplar(pose) => Comparison::Olats(ComparisonSource::Exemplar(*pose)),
            Self::Truth(folder) => Comparison::Olats(ComparisonSource::Truth(folder.clone())),
            Self::Checkpoint(folder) => {
                Comparison::Olats(ComparisonSource::Checkpoint(folder.clone()))
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::command::LookCommand;
    use super::super::state::State;
    use super::*;
    use imaging::Image;

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

    #[test]
    fn the_other_environment_is_turned_by_its_own_front() {
        let mut state = State::new(1, 24.0);
        let files = ["/a.hdr", "/b.hdr"].map(PathBuf::from);
        state.change(LookCommand::AddEnvironments(files.clone().into()));
        state.change(LookCommand::Yaw(10.0));
        state.change(LookCommand::Front(0, Some(Front::new(90.0))));
        state.change(LookCommand::Front(1, Some(Front::new(-20.0))));
        state.compare.on = true;
        state.compare.reference = Reference::Environment(Origin::File(files[1].clone()));
        let grey = Image::filled(2, 1, [0.5; 3]);
        let grey = std::sync::Arc::new(Environment::from_radiance("grey", grey));
        let compared = state.compare.pictures(&state.look, |_| Some(grey.clone()));
        assert_eq!(
            compared,
            [None, Some(Comparison::Light(grey.clone(), -10.0))]
        );
        state.compare.first = Some(Reference::Plate);
        assert_eq!(
            state.compare.pictures(&state.look, |_| None),
            [Some(Comparison::Plate), None],
            "it was not read"
        );
        assert_eq!(state.scene().yaw_deg, 100.0);
    }
}
