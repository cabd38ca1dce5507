//! Lights that are placed and moved on the picture.

use super::State;
use crate::command::{AimedLight, LookCommand};
use std::mem::discriminant;

/// The lights that are placed on the picture, and how the window came to them.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Aiming {
    /// The light that was chosen last, by its id; see [`State::chosen_light`].
    chosen: Option<u32>,
    /// Number of presses that began to place a light …
    drag: u64,
    /// … and for which of them a light was placed.
    placed_for: u64,
    /// The light that this press moves, by its id; None if it places another.
    moves: Option<u32>,
    /// The light that the newest step of undo has placed, and its id.
    newest: Option<(AimedLight, u32)>,
}

impl Aiming {
    /// Something else was changed.
    pub fn end(&mut self) {
        self.newest = None;
    }
}

impl State {
    /// The light placed by hand that was chosen last, by its index, if it is still there.
    pub fn chosen_light(&self) -> Option<usize> {
        self.light_with(self.aiming.chosen?)
    }

    /// Chooses the light of this index.
    pub(super) fn choose_light(&mut self, light: Option<usize>) {
        let before = self.place_of_chosen();
        self.aiming.chosen = light.and_then(|light| self.light_id(light));
        self.unfold_chosen(before);
    }

    /// The ids of the chosen light and of its group, if it is in one.
    pub(super) fn place_of_chosen(&self) -> Option<(u32, u32)> {
        let lighting = &self.look.lighting;
        let light = lighting.placed.get(self.chosen_light()?)?;
        Some((light.id, lighting.group_of(light)?.id))
    }

    /// Shows the lights of the chosen one's group if that was not its place `before`; groups that are gone are forgotten.
    pub(super) fn unfold_chosen(&mut self, before: Option<(u32, u32)>) {
        let groups = &self.look.lighting.groups;
        (self.folded_lights).retain(|folded| groups.iter().any(|group| group.id == *folded));
        let now = self.place_of_chosen();
        if let Some((_, group)) = now.filter(|_| now != before) {
            self.folded_lights.remove(&group);
        }
    }

    /// True if the lights of the group with this id are hidden.
    pub fn is_folded(&self, group: u32) -> bool {
        self.folded_lights.contains(&group)
    }

    /// The index of the light placed by hand with this id, if it is still there.
    fn light_with(&self, id: u32) -> Option<usize> {
        let mut lights = self.look.lighting.placed.iter();
        lights.position(|light| light.id == id)
    }

    /// The id of the light of this index.
    fn light_id(&self, index: usize) -> Option<u32> {
        Some(self.look.lighting.placed.get(index)?.id)
    }

    /// True if lights placed by hand have handles on the picture: all of them while lights are placed by the face, else the
    /// one that was chosen last.
    pub fn shows_handles(&self) -> bool {
        self.chosen_light().is_some() || self.aims && !self.look.lighting.placed.is_empty()
    }

    /// Begins to move the light of this index, or to place another.
    pub fn begin_aim(&mut self, moves: Option<usize>) {
        self.aiming.drag += 1;
        self.aiming.moves = moves.and_then(|light| self.light_id(light));
    }

    /// Number of the drag that places a light.
    pub fn aim_drag(&self) -> u64 {
        self.aiming.drag
    }

    /// Position on the picture of a frame where the light falls that was placed last, if nothing was changed since.
    pub fn aimed_at(&self, frame: usize) -> Option<[usize; 2]> {
        let (aimed, _) = self.aiming.newest.as_ref()?;
        (aimed.frame == frame).then_some(aimed.pixel)
    }

    /// The light that was placed or moved last on the picture, by its index, if nothing was changed since.
    pub fn aimed_light(&self) -> Option<usize> {
        self.light_with(self.aiming.newest.as_ref()?.1)
    }

    /// Places a light, or moves the one that the same drag has placed. What was asked for before something else was changed or
    /// undone comes too late.
    pub(super) fn aim(&mut self, aimed: AimedLight) {
        let same = self.aiming.newest.filter(|(last, _)| last.drag == aimed.drag);
        let id = match (same, self.aiming.moves) {
            (Some((_, id)), _) => id,
            (None, _) if aimed.drag <= self.aiming.placed_for => return,
            // It was removed meanwhile.
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
        // The clip may have gone on since.
        self.look.set_keys(&before, aimed.frame);
        self.look.follow(self.frame);
        self.aiming.placed_for = aimed.drag;
        self.aiming.newest = Some((aimed, id));
        self.aiming.chosen = Some(id);
        self.dragging = Some(discriminant(&LookCommand::Aim(aimed)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::ViewCommand;
    use crate::state::tests::state;
    use glam::Vec3;

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
        // The last answer may come after the pointer was released.
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
        s.change(LookCommand::Exposure(0.5));
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
        // There is no such light to move.
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
        // One before it is removed: it still moves itself.
        s.begin_aim(Some(1));
        let removed = without(&s, 0);
        s.change(removed);
        s.change(aimed(5, Vec3::X));
        assert_eq!((yaws(&s), s.aimed_light()), (vec![90.0], Some(0)));
    }
}
