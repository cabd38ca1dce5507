//! Environments and lamps by name.

use super::RelightSettings;
use base::error::{Error, Result};
use base::progress::Progress;
use imaging::picture::choose_layer;
use light::conventions::Front;
use light::panorama::{self, ReadSettings};
use light::{Environment, Mapping, Rig, built_in};
use project::{KnownEnvironment, Project};
use std::path::Path;
use std::sync::Arc;

impl RelightSettings {
    /// The environment, read before or by name, and its front. Guesses and repairs of a file are reported.
    ///
    /// # Errors
    /// As [`find_environment`].
    pub fn find_environment(&self, project: &Project, progress: &Progress) -> Result<(Arc<Environment>, Front)> {
        let (environment, known) = match &self.read {
            Some(read) => (read.clone(), Front::default()),
            None => {
                let file = project.environment(&self.environment).map(|known| known.file);
                let file = file.as_ref().unwrap_or(&self.environment);
                choose_layer(file, self.environment_layer.as_deref());
                let found = find_environment(project, &self.environment, self.mapping, progress)?;
                (Arc::new(found.0), found.1)
            }
        };
        Ok((environment, self.front.unwrap_or(known)))
    }
}

/// Environment by name: one of the project's, a file, or a built-in one, with its front direction if the project
/// remembers it. Guesses and repairs of a file are reported.
///
/// # Errors
/// When there is none of that name, or its file cannot be read as an environment.
pub fn find_environment(
    project: &Project,
    wanted: &Path,
    mapping: Option<Mapping>,
    progress: &Progress,
) -> Result<(Environment, Front)> {
    let named = project.environment(wanted);
    if let Some(complaint) = named.as_ref().and_then(KnownEnvironment::complaint) {
        progress.say(complaint);
    }
    let file = named.as_ref().map_or(wanted, |named| &named.file);
    if named.is_some() || file.exists() {
        let reading = ReadSettings { mapping, ..ReadSettings::default() };
        let panorama = panorama::read(file, &reading)?;
        panorama.notes.iter().for_each(|note| progress.say(note));
        let front = named.and_then(|named| named.front).unwrap_or_default();
        return Ok((panorama.environment, front));
    }
    if let Some(own) = wanted.to_str().and_then(built_in::named) {
        return Ok((Environment::clone(&own.environment()), Front::default()));
    }
    let own = built_in::all().into_iter().map(|own| own.name.to_owned());
    let known = project.environments().into_iter().map(|known| known.name);
    let names: Vec<String> = known.chain(own).collect();
    Err(Error::missing(
        format!("{} is neither a panorama file nor one of the environments {}", wanted.display(), names.join(", ")),
        "Check the path",
    ))
}

/// Numbers of the lamps with these names, ascending.
///
/// # Errors
/// When a lamp does not exist.
pub fn lamps_named(rig: &Rig, names: &[String]) -> Result<Vec<usize>> {
    let number = |name: &String| {
        let place = rig.lamps.iter().position(|lamp| lamp.name == *name);
        place.ok_or_else(|| {
            let known: Vec<&str> = rig.lamps.iter().map(|lamp| lamp.name.as_str()).collect();
            Error::missing(
                format!("unknown lamp {name:?}: the lamps are {}", known.join(", ")),
                "Choose lamps that the network has learnt",
            )
        })
    };
    let mut numbers = names.iter().map(number).collect::<Result<Vec<_>>>()?;
    numbers.sort_unstable();
    numbers.dedup();
    Ok(numbers)
}
