//! Hashes of the files behind a review, which tell whether it is up to date.

use base::error::{Error, Result};
use base::files;
use project::Project;
use serde::{Deserialize, Serialize};

/// Hashes of the files that determine the scores.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fingerprint {
    network: String,
    calibration: String,
    shoot: String,
}

impl Fingerprint {
    /// Fingerprint of the project's current state.
    ///
    /// # Errors
    /// When the project has no calibration.
    pub fn from_project(project: &Project) -> Result<Self> {
        let read = |path: std::path::PathBuf, remedy: (&str, &str)| {
            let text = files::read_text(&path, files::MOST_TEXT);
            text.map_err(|e| Error::io("open", path, e, remedy))
        };
        let mark = |text: &str| base::Fnv::from_bytes(text.as_bytes()).to_string();
        let table = project.checkpoint_path().join("checkpoint.toml");
        Ok(Self {
            // The table counts seconds, so it changes with every checkpoint. Empty before any training.
            network: if table.exists() {
                let remedy = ("Train this project first", "afterlight train PROJECT");
                mark(&read(table, remedy)?)
            } else {
                String::new()
            },
            calibration: mark(&read(
                project.calibration_path(),
                ("Calibrate this project first", "afterlight calibrate PROJECT"),
            )?),
            shoot: mark(
                &read(
                    project.root.join("project.toml"),
                    ("Make a project first", "afterlight import PROJECT --shoot DIR"),
                )?
                .lines()
                // Colours of exports and of the viewer do not affect OLATs.
                .filter(|line| !line.starts_with("color_config = "))
                .fold(String::new(), |text, line| text + line + "\n"),
            ),
        })
    }

    /// Part that changed since `self`, as the subject of a sentence; None without a change.
    pub fn difference(&self, now: &Self) -> Option<&'static str> {
        let pairs = [
            (&self.shoot, &now.shoot, "the project"),
            (&self.calibration, &now.calibration, "the calibration"),
            (&self.network, &now.network, "the network"),
        ];
        pairs.into_iter().find(|(old, new, _)| old != new).map(|(.., what)| what)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_changed_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let mut project = project::Project::without_shoot(folder.path());
        let missing = Fingerprint::from_project(&project).unwrap_err().for_terminal();
        assert!(missing.contains("afterlight calibrate"), "{missing}");
        project.save().unwrap();
        std::fs::create_dir(project.checkpoint_path()).unwrap();
        let table = project.checkpoint_path().join("checkpoint.toml");
        std::fs::write(&table, "seconds = 1.0").unwrap();
        std::fs::write(project.calibration_path(), "exposure = 1.0").unwrap();
        let first = Fingerprint::from_project(&project).unwrap();
        assert_eq!(first.difference(&Fingerprint::from_project(&project).unwrap()), None);
        std::fs::write(&table, "seconds = 2.0").unwrap();
        let trained = Fingerprint::from_project(&project).unwrap();
        assert_eq!(first.difference(&trained), Some("the network"));
        std::fs::write(project.calibration_path(), "exposure = 1.1").unwrap();
        let calibrated = Fingerprint::from_project(&project).unwrap();
        assert_eq!(trained.difference(&calibrated), Some("the calibration"));
        project.settings.color_config = Some("ocio://default".into());
        project.save().unwrap();
        assert_eq!(calibrated.difference(&Fingerprint::from_project(&project).unwrap()), None);
        project.settings.size += 16;
        project.save().unwrap();
        let resized = Fingerprint::from_project(&project).unwrap();
        assert_eq!(calibrated.difference(&resized), Some("the project"));
        assert_eq!(base::Fnv::from_bytes(b"").to_string(), "cbf29ce484222325");
    }
}
