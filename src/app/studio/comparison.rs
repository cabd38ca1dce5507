//! Comparison of the picture with another, and the ways to show both.

use super::environment_library::{EnvironmentEntry, light_of};
use super::environment_list::ListedEnvironment;
use super::four_looks::{FourPicture, FourSlot};
use super::state::State;
use super::stored_looks::{LookId, StoredLooks};
use std::path::PathBuf;
use worker::{Comparison, ComparisonSource, Origin};

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

    /// Switches to the other of the two pictures.
    pub fn toggle_second(&mut self) {
        self.second = !(self.on && self.mode == CompareMode::Toggle && self.second);
        (self.on, self.mode) = (true, CompareMode::Toggle);
    }

    /// Environments of the compared pictures.
    pub fn environments(&self, state: &State, looks: &StoredLooks) -> Vec<Origin> {
        let compared = self.references().into_iter().flatten();
        compared
            .filter_map(|one| match one {
                Reference::Environment(origin) => Some(origin.clone()),
                Reference::Look(id, number) => {
                    FourSlot::Stored(id.clone(), *number).environment(state, looks)
                }
                _ => None,
            })
            .collect()
    }

    /// First and second picture of an active comparison; None stands in place of the relit picture.
    fn references(&self) -> [Option<&Reference>; 2] {
        if self.on { [self.first.as_ref(), Some(&self.reference)] } else { [None, None] }
    }

    /// Pictures that these settings need besides the relit picture: the first and the second. None for a picture that
    /// cannot be made yet.
    pub fn pictures(
        &self,
        state: &State,
        looks: &StoredLooks,
        environments: &[EnvironmentEntry],
    ) -> [Option<Comparison>; 2] {
        self.references().map(|shown| shown?.picture(state, looks, environments).ok())
    }

    /// Reason that one of the pictures is missing.
    pub fn missing(
        &self,
        state: &State,
        looks: &StoredLooks,
        environments: &[EnvironmentEntry],
    ) -> Option<String> {
        let compared = self.references().into_iter().flatten();
        compared.filter_map(|one| one.picture(state, looks, environments).err()).next()
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

impl Reference {
    /// The picture, or the reason for its absence.
    fn picture(
        &self,
        state: &State,
        looks: &StoredLooks,
        environments: &[EnvironmentEntry],
    ) -> Result<Comparison, String> {
        Ok(match self {
            Self::Plate => Comparison::Plate,
            Self::Environment(origin) => {
                let look = &state.look;
                let mut list = look.environments.iter();
                let listed = list.find(|listed| listed.origin == *origin);
                let listed = listed.ok_or_else(|| format!("{origin} is no longer in the list"))?;
                let light = light_of(environments, origin);
                let light = light.ok_or_else(|| reading(environments, listed))?;
                Comparison::Light(light, listed.front().turned(look.yaw_deg))
            }
            Self::Look(id, number) => {
                let slot = FourSlot::Stored(id.clone(), *number);
                match FourPicture::new(&slot, state, looks, environments) {
                    FourPicture::View(view) => Comparison::Look(view),
                    FourPicture::Missing(why) => return Err(why),
                    FourPicture::Waiting | FourPicture::Empty => {
                        return Err(format!("Reading the environment of {}", slot.name()));
                    }
                }
            }
            Self::Exemplar(pose) => Comparison::Olats(ComparisonSource::Exemplar(*pose)),
            Self::Truth(folder) => Comparison::Olats(ComparisonSource::Truth(folder.clone())),
            Self::Checkpoint(folder) => {
                Comparison::Olats(ComparisonSource::Checkpoint(folder.clone()))
            }
            Self::Transfer => Comparison::Olats(ComparisonSource::Transfer),
        })
    }
}

/// Reason that an environment in the list gives no light.
fn reading(environments: &[EnvironmentEntry], listed: &ListedEnvironment) -> String {
    let entry = environments.iter().find(|e| e.listed.origin == listed.origin);
    if entry.is_some_and(|entry| entry.panorama.is_failed()) {
        format!("{} cannot be read", listed.name)
    } else {
        format!("Reading {}", listed.name)
    }
}

#[cfg(test)]
mod tests {
    use super::super::command::LookCommand;
    use super::super::environment_library::{PanoramaState, ReadPanorama};
    use super::super::footage_reader::texture;
    use super::super::look_name::LookName;
    use super::super::stored_looks::Shelf;
    use super::*;
    use imaging::Image;
    use light::Environment;
    use light::conventions::Front;
    use scene::Setting;
    use std::sync::Arc;
    use worker::SrgbPicture;

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

    /// An entry of the list with its light in memory.
    fn read(listed: &ListedEnvironment, light: &Arc<Environment>) -> EnvironmentEntry {
        let dot = || SrgbPicture { width: 1, height: 1, rgb: vec![0; 3] };
        EnvironmentEntry {
            listed: listed.clone(),
            panorama: PanoramaState::Done {
                panorama: ReadPanorama {
                    environment: Some(light.clone()),
                    size: (2, 1),
                    thumbnail: Arc::new(dot()),
                    areas: Vec::new(),
                    notes: Vec::new(),
                },
                thumbnail: texture(&egui::Context::default(), "dot", &dot()),
            },
            favourite: false,
            order: 0,
        }
    }

    #[test]
    fn the_other_environment_is_turned_by_its_own_front() {
        let mut state = State::new(1, 24.0);
        let files = ["/a.hdr", "/b.hdr"].map(PathBuf::from);
        state.change(LookCommand::AddEnvironments(files.clone().into()));
        state.change(LookCommand::Set(Setting::Yaw, 10.0));
        state.change(LookCommand::Front(0, Some(Front::new(90.0))));
        state.change(LookCommand::Front(1, Some(Front::new(-20.0))));
        state.compare.on = true;
        state.compare.reference = Reference::Environment(Origin::File(files[1].clone()));
        let grey = Image::filled(2, 1, [0.5; 3]);
        let grey = Arc::new(Environment::from_radiance("grey", grey));
        let list = state.look.environments.clone();
        let mut entries: Vec<_> = list.iter().map(|listed| read(listed, &grey)).collect();
        let looks = StoredLooks::new(None, || {});
        let compared = state.compare.pictures(&state, &looks, &entries);
        assert_eq!(compared, [None, Some(Comparison::Light(grey.clone(), -10.0))]);
        assert_eq!(state.compare.missing(&state, &looks, &entries), None);
        state.compare.first = Some(Reference::Plate);
        let said = |state: &State, entries: &[EnvironmentEntry]| {
            let compared = state.compare.pictures(state, &looks, entries);
            assert_eq!(compared, [Some(Comparison::Plate), None]);
            state.compare.missing(state, &looks, entries).unwrap()
        };
        for (panorama, why) in [
            (PanoramaState::Waiting, "Reading b"),
            (PanoramaState::Failed(String::new()), "b cannot be read"),
        ] {
            entries[1].panorama = panorama;
            assert_eq!(said(&state, &entries), why);
        }
        assert_eq!(state.scene().yaw_deg, 100.0);
        state.change(LookCommand::RemoveEnvironment(1));
        let why = said(&state, &entries);
        assert!(why.contains("b.hdr is no longer in the list"), "{why}");
    }

    #[test]
    fn a_look_that_is_not_stored_is_said_by_its_name() {
        let mut state = State::new(1, 24.0);
        let id = |name: &str| LookId { shelf: Shelf::Project, name: LookName::new(name).unwrap() };
        let looks = StoredLooks::new(None, || {});
        state.compare.on = true;
        state.compare.first = Some(Reference::Look(id("warm"), Some(3)));
        state.compare.rename(&id("warm"), &id("noon"));
        let why = state.compare.missing(&state, &looks, &[]).unwrap();
        assert_eq!(why, "noon, version 3 was removed");
        state.compare.on = false;
        assert_eq!(state.compare.missing(&state, &looks, &[]), None);
    }
}
