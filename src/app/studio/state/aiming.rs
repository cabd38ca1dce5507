//! Lights placed and moved on the picture.

use super::State;
use crate::command::{AimedLight, LookCommand};
use std::collections::BTreeSet;
use std::mem::discriminant;

/// State of selecting lights, and of placing them on the picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Aiming {
    /// Id of the last selected light; see [`State::chosen_light`].
    chosen: Option<u32>,
    /// Number of presses that started placing a light …
    drag: u64,
    /// … and the last of them for which a light was placed.
    placed_for: u64,
    /// Id of the light that this press moves; None if it places a new one.
    moves: Option<u32>,
    /// The light placed by the newest undo step, and its id.
    newest: Option<(AimedLight, u32)>,
    /// Ids of the folded groups of lights.
    pub folded: BTreeSet<u32>,
}

impl Aiming {
    /// Ends the current placement, after another change.
    pub fn end(&mut self) {
        self.newest = None;
    }
}

impl State {
    /// Index of the last selected placed light, if it still exists.
    pub fn chosen_light(&self) -> Option<usize> {
        self.light_with(self.aiming.chosen?)
    }

    /// Selects the light with this index.
    pub(super) fn choose_light(&mut self, light: Option<usize>) {
        let before = self.place_of_chosen();
        self.aiming.chosen = light.and_then(|light| self.light_id(light));
        self.unfold_chosen(before);
    }

    /// Ids of the selected light and its group; None if it is not in a group.
    pub(super) fn place_of_chosen(&self) -> Option<(u32, u32)> {
        let lighting = &self.look.lighting;
        let light = lighting.placed.get(self.chosen_light()?)?;
        Some((light.id, lighting.group_of(light)?.id))
    }

    /// Unfolds the group of the selected light unless its place is still `before`. Forgets removed groups.
    pub(super) fn unfold_chosen(&mut self, before: Option<(u32, u32)>) {
        let groups = &self.look.lighting.groups;
        (self.aiming.folded).retain(|folded| groups.iter().any(|group| group.id == *folded));
        let now = self.place_of_chosen();
        if let Some((_, group)) = now.filter(|_| now != before) {
            self.aiming.folded.remove(&group);
        }
    }

    /// True if the group with this id is folded.
    pub fn is_folded(&self, group: u32) -> bool {
        self.aiming.folded.contains(&group)
    }

    /// Index of the placed light with this id, if it still exists.
    fn light_with(&self, id: u32) -> Option<usize> {
        let mut lights = self.look.lighting.placed.iter();
        lights.position(|light| light.id == id)
    }

    /// Id of the light with this index.
    fn light_id(&self, index: usize) -> Option<u32> {
        Some(self.look.lighting.placed.get(index)?.id)
    }

    /// True if placed lights have handles on the picture: all of them while lights are placed by the face, otherwise
    /// only the selected one.
    pub fn shows_handles(&self) -> bool {
        self.chosen_light().is_some() || self.viewport.aims && !self.look.lighting.placed.is_empty()
    }

    /// Starts moving the light with this index, or placing a new one.
    pub fn begin_aim(&mut self, moves: Option<usize>) {
        self.aiming.drag += 1;
        self.aiming.moves = moves.and_then(|light| self.light_id(light));
    }

    /// Number of the drag that places a light.
    pub fn aim_drag(&self) -> u64 {
        self.aiming.drag
    }

    /// Pixel in this frame on which the last placed light falls, if nothing has changed since.
    pub fn aimed_at(&self, frame: usize) -> Option<[usize; 2]> {
        let (aimed, _) = self.aiming.newest.as_ref()?;
        (aimed.frame == frame).then_some(aimed.pixel)
    }

    /// Index of the light that was last placed or moved on the picture, if nothing has changed since.
    pub fn aimed_light(&self) -> Option<usize> {
        self.light_with(self.aiming.newest.as_ref()?.1)
    }

    /// Places a light, or moves the one placed by the same drag. Ignores answers from before another change or an undo.
    pub(super) fn aim(&mut self, aimed: AimedLight) {
        let same = self.aiming.newest.filter(|(last, _)| last.drag == aimed.drag);
        let id = match (same, self.aiming.moves) {
            (Some((_, id)), _) => id,
            (None, _) if aimed.drag <= self.aiming.placed_for => return,
            // The light was removed meanwhile.
            (None, Some(id)) if self.light_with(id).is_none() => return,
            (None, moves) => {
                self.history.push(self.look.clone());
                let lighting = &mut self.look.lighting;
                moves.unwrap_or_else(|| {
                    let light = lighting.another_light();
                    let id = light.id;
                    lighting.placed.push(light);
                    id
                })
            }
        };
        let before = self.look.clone();
        let mut lights = self.look.lighting.placed.iter_mut();
        if let Some(light) = lights.find(|light| light.id == id) {
            *light = light.clone().towards(aimed.direction);
        }
        // The clip may have advanced since.
        self.look.set_keys(&before, aimed.frame);
        self.look.follow(self.frame);
        self.aiming.placed_for = aimed.drag;
        self.aiming.newest = Some((aimed, id));
        self.aiming.chosen = Some(id);
        self.dragging = Some((discriminant(&LookCommand::Aim(aimed)), None));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::ViewCommand;
    use crate::state::tests::state;
    use glam::Vec3;
    use scene::Setting;

    fn aimed(drag: u64, direction: Vec3) -> LookCommand {
        LookCommand::Aim(AimedLight { drag, frame: 3, pixel: [drag as usize, 2], direction })
    }

    #[test]
    fn a_light_follows_its_drag_and_all_of_that_is_undone_at_once() {
        let mut s = state();
        s.show(ViewCommand::Solo(Some(4)));
        s.begin_aim(None);
        s.change(aimed(1, Vec3::Z));
        assert!(s.solo.is_empty() && s.is_dragged());
        s.change(aimed(1, Vec3::X));
        // The last answer may arrive after the pointer is released.
        s.release();
        s.change(aimed(1, Vec3::NEG_X));
        s.release();
        assert_eq!(s.look.lighting.placed.len(), 1);
        assert_eq!(s.look.lighting.placed[0].yaw_deg, -90.0);
        assert_eq!((s.chosen_light(), s.aimed_at(3), s.aimed_at(4)), (Some(0), Some([1, 2]), None));
        s.begin_aim(None);
        s.change(aimed(2, Vec3::Z));
        assert_eq!((s.look.lighting.placed.len(), s.chosen_light()), (2, Some(1)));
        s.change(LookCommand::Undo);
        assert_eq!((s.look.lighting.placed.len(), s.chosen_light()), (1, None));
        s.change(LookCommand::Undo);
        assert_eq!(s.look, state().look);
        assert!(!s.can_undo());
    }

    #[test]
    fn the_chosen_light_stays_chosen_when_an_undo_moves_it() {
        let mut s = state();
        for drag in [1, 2] {
            s.begin_aim(None);
            s.change(aimed(drag, Vec3::Z));
            s.release();
        }
        let mut lighting = s.look.lighting.clone();
        lighting.placed.remove(0);
        s.change(LookCommand::Lighting(Box::new(lighting)));
        s.show(ViewCommand::ChooseLight(Some(0)));
        s.change(LookCommand::Undo);
        assert_eq!(s.chosen_light(), Some(1));
        s.change(LookCommand::Redo);
        assert_eq!(s.chosen_light(), Some(0));
    }

    #[test]
    fn what_a_drag_asked_for_before_it_was_undone_comes_too_late() {
        let mut s = state();
        s.begin_aim(None);
        s.change(aimed(1, Vec3::Z));
        s.change(LookCommand::Undo);
        s.change(aimed(1, Vec3::X));
        assert!(s.look.lighting.placed.is_empty() && s.can_redo());
        s.begin_aim(None);
        s.change(aimed(2, Vec3::Z));
        s.change(LookCommand::Set(Setting::Exposure, 0.5));
        s.change(aimed(2, Vec3::X));
        assert_eq!(s.look.lighting.placed[0].yaw_deg, 180.0, "another change ended the drag");
    }

    #[test]
    fn a_handle_on_the_picture_moves_its_own_light() {
        let mut s = state();
        s.begin_aim(None);
        s.change(aimed(1, Vec3::Z));
        s.begin_aim(None);
        s.change(aimed(2, Vec3::Z));
        s.begin_aim(Some(0));
        s.change(aimed(3, Vec3::X));
        s.change(aimed(3, Vec3::NEG_X));
        let yaws: Vec<f32> = s.look.lighting.placed.iter().map(|l| l.yaw_deg).collect();
        assert_eq!((yaws, s.chosen_light()), (vec![-90.0, 180.0], Some(0)));
        s.change(LookCommand::Undo);
        assert_eq!(s.look.lighting.placed[0].yaw_deg, 180.0);
        // No light with this index to move.
        s.begin_aim(Some(7));
        s.change(aimed(4, Vec3::X));
        assert_eq!(s.look.lighting.placed.len(), 3);
    }
    #[test]
    fn a_light_that_is_removed_during_its_drag_moves_no_other() {
        let mut s = state();
        for drag in [1, 2, 3] {
            s.begin_aim(None);
            s.change(aimed(drag, Vec3::Z));
            s.release();
        }
        let without = |s: &State, index: usize| {
            let mut lighting = s.look.lighting.clone();
            lighting.placed.remove(index);
            LookCommand::Lighting(Box::new(lighting))
        };
        s.begin_aim(Some(1));
        let removed = without(&s, 1);
        s.change(removed);
        s.change(aimed(4, Vec3::X));
        let yaws = |s: &State| -> Vec<f32> {
            let lights = s.look.lighting.placed.iter();
            lights.map(|light| light.yaw_deg).collect()
        };
        assert_eq!(yaws(&s), [180.0, 180.0]);
        // A light before it is removed: the drag still moves the same light.
        s.begin_aim(Some(1));
        let removed = without(&s, 0);
        s.change(removed);
        s.change(aimed(5, Vec3::X));
        assert_eq!((yaws(&s), s.aimed_light()), (vec![90.0], Some(0)));
    }
}
