//! Pictures of the comparison.

use super::four_pictures::FourPicture;
use crate::comparison::{CompareSettings, Reference};
use crate::environment_list::ListedEnvironment;
use crate::four_looks::FourSlot;
use crate::panels::environments::library::{EnvironmentEntry, light_of};
use crate::state::State;
use crate::stored_looks::StoredLooks;
use worker::{Comparison, ComparisonSource, Origin};

impl CompareSettings {
    /// Environments of the compared pictures.
    pub fn environments(&self, state: &State, looks: &StoredLooks) -> Vec<Origin> {
        let compared = self.references().into_iter().flatten();
        compared
            .filter_map(|one| match one {
                Reference::Environment(origin) => Some(origin.clone()),
                Reference::Look(id, number) => FourSlot::Stored(id.clone(), *number).environment(state, looks),
                _ => None,
            })
            .collect()
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
    pub fn missing(&self, state: &State, looks: &StoredLooks, environments: &[EnvironmentEntry]) -> Option<String> {
        let compared = self.references().into_iter().flatten();
        compared.filter_map(|one| one.picture(state, looks, environments).err()).next()
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
            Self::Checkpoint(folder) => Comparison::Olats(ComparisonSource::Checkpoint(folder.clone())),
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
    use super::*;
    use crate::command::LookCommand;
    use crate::look_name::LookName;
    use crate::panels::environments::library::{PanoramaState, ReadPanorama};
    use crate::panels::footage::reader::texture;
    use crate::stored_looks::{LookId, Shelf};
    use imaging::Image;
    use light::Environment;
    use light::conventions::Front;
    use scene::Setting;
    use std::path::PathBuf;
    use std::sync::Arc;
    use worker::SrgbPicture;

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
        for (panorama, why) in
            [(PanoramaState::Waiting, "Reading b"), (PanoramaState::Failed(String::new()), "b cannot be read")]
        {
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
