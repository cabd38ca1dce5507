//! What the picture is compared with, and how both are shown.

use super::listed::Listed;
use super::state::State;
use light::Environment;
use light::conventions::Front;
use std::path::PathBuf;
use std::sync::Arc;
use worker::{Comparison, ComparisonSource, Origin};

/// What stands beside the relit picture.
#[derive(Clone, Debug, PartialEq)]
pub enum With {
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
pub enum How {
    /// The first to the left of a line that can be dragged, the second to its right.
    Wipe,
    /// One beside the other.
    Side,
    /// One at a time.
    Toggle,
    /// What differs between them.
    Difference,
}

/// The comparison.
#[derive(Clone, Debug, PartialEq)]
pub struct Compare {
    pub on: bool,
    /// The first picture; none is the relit one.
    pub first: Option<With>,
    /// The second picture.
    pub with: With,
    pub how: How,
    /// Where one is shown at a time: whether it is the second.
    pub second: bool,
}

impl Default for Compare {
    fn default() -> Self {
        Self {
            on: false,
            first: None,
            with: With::Plate,
            how: How::Wipe,
            second: false,
        }
    }
}

impl Compare {
    /// Wipes, or no longer does.
    pub fn toggle_wipe(&mut self) {
        self.on = !(self.on && self.how == How::Wipe);
        self.how = How::Wipe;
    }

    /// Shows the other of the two alone.
    pub fn toggle_second(&mut self) {
        self.second = !(self.on && self.how == How::Toggle && self.second);
        (self.on, self.how) = (true, How::Toggle);
    }
}

impl State {
    /// The pictures besides the relit one that this state asks for, the first and the second; none where it is
    /// of an environment that has not been read.
    pub fn compared(
        &self,
        environment: impl Fn(&Origin) -> Option<Arc<Environment>>,
    ) -> [Option<Comparison>; 2] {
        if !self.compare.on {
            return [None, None];
        }
        let Compare { first, with, .. } = &self.compare;
        [first.as_ref(), Some(with)].map(|with| self.beside(with?, &environment))
    }

    fn beside(
        &self,
        with: &With,
        environment: impl Fn(&Origin) -> Option<Arc<Environment>>,
    ) -> Option<Comparison> {
        Some(match with {
            With::Plate => Comparison::Plate,
            With::Environment(origin) => {
                let mut list = self.look.environments.iter();
                let listed = list.find(|listed| listed.origin == *origin);
                let front = listed.map_or(Front::default(), Listed::front);
                Comparison::Light(environment(origin)?, front.turned(self.look.yaw_deg))
            }
            With::Exemplar(pose) => Comparison::Olats(ComparisonSource::Exemplar(*pose)),
            With::Truth(folder) => Comparison::Olats(ComparisonSource::Truth(folder.clone())),
            With::Checkpoint(folder) => {
                Comparison::Olats(ComparisonSource::Checkpoint(folder.clone()))
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::command::Command;
    use super::*;
    use imaging::Image;

    #[test]
    fn w_wipes_and_q_changes_sides() {
        let mut compare = Compare::default();
        compare.toggle_wipe();
        assert!(compare.on && compare.how == How::Wipe);
        compare.toggle_second();
        assert!(compare.on && compare.how == How::Toggle && compare.second);
        compare.toggle_second();
        assert!(compare.on && !compare.second);
        compare.toggle_wipe();
        assert!(compare.on && compare.how == How::Wipe);
        compare.toggle_wipe();
        assert!(!compare.on);
    }

    #[test]
    fn the_other_environment_is_turned_by_its_own_front() {
        let mut state = State::new(1, 24.0);
        let files = ["/a.hdr", "/b.hdr"].map(PathBuf::from);
        state.apply(&Command::AddEnvironments(files.clone().into()));
        state.apply(&Command::Yaw(10.0));
        state.apply(&Command::Front(0, Some(Front::new(90.0))));
        state.apply(&Command::Front(1, Some(Front::new(-20.0))));
        state.compare.on = true;
        state.compare.with = With::Environment(Origin::File(files[1].clone()));
        let grey = Image::filled(2, 1, [0.5; 3]);
        let grey = std::sync::Arc::new(Environment::from_radiance("grey", grey));
        let compared = state.compared(|_| Some(grey.clone()));
        assert_eq!(
            compared,
            [None, Some(Comparison::Light(grey.clone(), -10.0))]
        );
        state.compare.first = Some(With::Plate);
        assert_eq!(
            state.compared(|_| None),
            [Some(Comparison::Plate), None],
            "it was not read"
        );
        assert_eq!(state.scene().yaw_deg, 100.0);
    }
}
