//! Undo and redo steps between two sessions: `undo.json` beside `look.json`.
//!
//! The file names its look. It is written before that look, so that after a kill it is as new as the look or newer.

use super::environment_list::{self, ListedEnvironment};
use super::history::History;
use super::look::LookSettings;
use super::saved_look::SavedLook;
use base::error::{Error, Result};
use base::files;
use project::{NamedEnvironment, Project};
use serde::{Deserialize, Serialize};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Most steps kept in each direction, counted from the nearest.
const MOST_STEPS: usize = 100;
/// Largest size of the file in bytes.
const MOST_BYTES: u64 = 4 << 20;

/// Contents of the file.
#[derive(Serialize, Deserialize)]
struct HistoryFile {
    /// The look that the steps belong to.
    look: SavedLook,
    undo: Vec<SavedStep>,
    redo: Vec<SavedStep>,
    /// Files of the environment lists.
    lists: Vec<Vec<NamedEnvironment>>,
}

/// An earlier or later look.
#[derive(Serialize, Deserialize)]
struct SavedStep {
    /// Index of its list.
    list: usize,
    look: SavedLook,
}

/// The undo file of a project.
pub fn path(project: &Project) -> PathBuf {
    project.root.join("undo.json")
}

impl History {
    /// Text of the file for the look that the steps belong to. The farthest steps are dropped if the text would be too
    /// long. None if a path is not UTF-8, or the look alone is too long.
    pub fn text([undo, redo]: [&[LookSettings]; 2], look: &LookSettings) -> Option<String> {
        let mut steps = MOST_STEPS;
        loop {
            let mut lists: Vec<(Arc<Vec<ListedEnvironment>>, Vec<NamedEnvironment>)> = Vec::new();
            let mut saved = |step: &LookSettings| {
                let environments = &step.environments;
                let same = |(known, _): &(Arc<Vec<ListedEnvironment>>, _)| Arc::ptr_eq(known, environments);
                let list = lists.iter().position(same).unwrap_or_else(|| {
                    lists.push((environments.clone(), environment_list::saved(environments)));
                    lists.len() - 1
                });
                SavedStep { list, look: SavedLook::from_look(step) }
            };
            let [undo, redo] = [undo, redo].map(|all| {
                let near = &all[all.len().saturating_sub(steps)..];
                near.iter().map(&mut saved).collect()
            });
            let file = HistoryFile {
                look: SavedLook::from_look(look),
                undo,
                redo,
                lists: lists.into_iter().map(|(_, files)| files).collect(),
            };
            let text = serde_json::to_string(&file).ok()?;
            if text.len() as u64 <= MOST_BYTES {
                return Some(text);
            }
            if steps == 0 {
                return None;
            }
            steps /= 2;
        }
    }

    /// The undo and redo steps of a look that was read from the project, with the project's list. `unwritten` is the
    /// newest text, if not on disk yet. Empty without a file.
    ///
    /// # Errors
    /// If the file cannot be parsed, or belongs to a different look. The file stays, and the next change overwrites it.
    pub fn load(project: &Project, unwritten: Option<&str>, look: &LookSettings) -> Result<Self> {
        let path = path(project);
        let text = match unwritten {
            Some(text) => text.to_owned(),
            None => match files::read_text(&path, MOST_BYTES) {
                Ok(text) => text,
                Err(e) if e.kind() == ErrorKind::NotFound => return Ok(Self::default()),
                Err(e) => return Err(useless(&path, e)),
            },
        };
        let file: HistoryFile = serde_json::from_str(&text).map_err(|e| useless(&path, e))?;
        file.history(look).ok_or_else(|| useless(&path, "it belongs to a different look"))
    }
}

fn useless(path: &Path, cause: impl std::fmt::Display) -> Error {
    let remedy = "Undo starts empty; the next change replaces the file";
    Error::codec("use the steps of undo in", path, cause, remedy)
}

impl HistoryFile {
    /// The steps of a look; None if they belong to a different look.
    fn history(self, look: &LookSettings) -> Option<History> {
        let restored = |files: &Vec<NamedEnvironment>| Arc::new(environment_list::restored(&look.environments, files));
        let lists: Vec<_> = self.lists.iter().map(restored).collect();
        let steps = |saved: Vec<SavedStep>| -> Option<Vec<LookSettings>> {
            let steps = saved.into_iter().rev().take(MOST_STEPS).rev();
            let step = |step: SavedStep| {
                let mut one = look.clone();
                one.environments = lists.get(step.list)?.clone();
                // Its own environment is found by name.
                one.environment = 0;
                step.look.apply(&mut one);
                Some(one)
            };
            steps.map(step).collect()
        };
        let (mut undo, mut redo) = (steps(self.undo)?, steps(self.redo)?);
        let mut present = look.clone();
        self.look.apply(&mut present);
        let is_present = |one: &LookSettings| SavedLook::from_look(one) == SavedLook::from_look(look);
        if !is_present(&present) {
            // The window was killed between writing these steps and writing their look.
            match undo.iter().rposition(is_present) {
                Some(at) => {
                    redo.push(present);
                    redo.extend(undo.drain(at + 1..).rev());
                    undo.pop();
                }
                None => {
                    let at = redo.iter().rposition(is_present)?;
                    undo.push(present);
                    undo.extend(redo.drain(at + 1..).rev());
                    redo.pop();
                }
            }
        }
        // Steps that differ only in unsaved settings would change nothing.
        for steps in [&mut undo, &mut redo] {
            steps.dedup();
            while steps.last() == Some(look) {
                steps.pop();
            }
        }
        Some(History { undo, redo })
    }
}

#[cfg(test)]
mod tests {
    use super::super::command::LookCommand;
    use super::super::state::State;
    use super::*;
    use scene::Setting;
    use std::fs::write;

    fn changed(stops: &[f32]) -> State {
        let mut state = State::new(10, 24.0);
        for &stops in stops {
            state.change(LookCommand::Set(Setting::Exposure, stops));
            state.release();
        }
        state
    }

    fn text(state: &State) -> String {
        History::text(state.history(), &state.look).unwrap()
    }

    /// A window opened with the contents of the two files.
    fn reopened(look: &str, undo: &str) -> Result<State> {
        let folder = tempfile::tempdir().unwrap();
        let project = Project::without_shoot(folder.path());
        write(SavedLook::path(&project), look).unwrap();
        write(path(&project), undo).unwrap();
        let mut state = State::new(10, 24.0);
        let saved = SavedLook::load(&project, false).unwrap().unwrap();
        saved.apply(&mut state.look);
        let history = History::load(&project, None, &state.look)?;
        state.remember(history);
        Ok(state)
    }

    fn look_text(state: &State) -> String {
        SavedLook::from_look(&state.look).text()
    }

    #[test]
    fn steps_in_both_directions_come_back() {
        let mut before = changed(&[1.0, 2.0, 3.0]);
        before.change(LookCommand::Undo);
        let mut after = reopened(&look_text(&before), &text(&before)).unwrap();
        assert_eq!(after.history(), before.history());
        for (command, stops) in
            [(LookCommand::Redo, 3.0), (LookCommand::Undo, 2.0), (LookCommand::Undo, 1.0), (LookCommand::Undo, 0.0)]
        {
            after.change(command);
            assert_eq!(after.look.exposure_stops, stops);
        }
        assert!(!after.can_undo());
    }

    #[test]
    fn after_a_kill_between_the_two_files_the_steps_still_lead_to_the_look() {
        // undo.json is written first.
        let (older, newer) = (changed(&[1.0, 2.0]), changed(&[1.0, 2.0, 3.0, 4.0]));
        let mut found = reopened(&look_text(&older), &text(&newer)).unwrap();
        found.change(LookCommand::Undo);
        assert_eq!(found.look.exposure_stops, 1.0);
        for stops in [2.0, 3.0, 4.0] {
            found.change(LookCommand::Redo);
            assert_eq!(found.look.exposure_stops, stops);
        }
        assert!(!found.can_redo());
        // The same with redo steps.
        let mut undone = changed(&[1.0, 2.0, 3.0]);
        undone.change(LookCommand::Undo);
        undone.change(LookCommand::Undo);
        let older = changed(&[1.0, 2.0, 3.0]);
        let mut found = reopened(&look_text(&older), &text(&undone)).unwrap();
        assert!(!found.can_redo());
        for stops in [2.0, 1.0, 0.0] {
            found.change(LookCommand::Undo);
            assert_eq!(found.look.exposure_stops, stops);
        }
    }

    #[test]
    fn steps_of_another_look_and_what_is_none_are_left_out_in_a_sentence() {
        let mine = changed(&[1.0]);
        let other = changed(&[5.0, 6.0]);
        let good = text(&mine);
        for broken in [
            text(&other),
            String::new(),
            "[]".to_owned(),
            "{\"look\": {}}".to_owned(),
            good.replace("\"list\":0", "\"list\":7"),
            good[..good.len() - 3].to_owned(),
            format!("{{\"x\":\"{}\"}}", "x".repeat(MOST_BYTES as usize)),
        ] {
            let said = reopened(&look_text(&mine), &broken).unwrap_err().to_string();
            assert!(said.contains("undo.json"), "{said}");
        }
        assert!(reopened(&look_text(&mine), &good).unwrap().can_undo());
        test_support::shown!(
            Strangers,
            "`undo.json` is damaged, endless or belongs to a different look",
            done: "the file is ignored with a message; its size and its steps are bounded",
        );
    }

    #[test]
    fn the_nearest_steps_are_kept_and_the_file_stays_small() {
        let stops: Vec<f32> = (0..300).map(|i| 1.0 + i as f32 / 100.0).collect();
        let before = changed(&stops);
        let after = reopened(&look_text(&before), &text(&before)).unwrap();
        let [undo, _] = after.history();
        let [all, _] = before.history();
        assert_eq!(undo, &all[all.len() - MOST_STEPS..]);
        // Long looks, with a thousand lights each.
        let mut long = State::new(10, 24.0);
        for i in 0..30 {
            let mut lighting = long.look.lighting.clone();
            lighting.placed = vec![light::PlacedLight::default(); 1000 + i];
            long.change(LookCommand::Lighting(Box::new(lighting)));
            long.release();
        }
        let text = text(&long);
        assert!(text.len() as u64 <= MOST_BYTES, "{}", text.len());
        assert!(reopened(&look_text(&long), &text).unwrap().can_undo());
    }
}
