//! A drag on the timeline.

use super::key_selection::KeySelection;
use crate::command::{Command, LookCommand};
use light::keyframes::{Interpolation, Key, Keyframes};
use scene::{Animation, Setting};

/// A drag, with the keys from before it. Every step of the drag starts from those.
pub enum KeyDrag {
    /// The selected keys, dragged by one of them.
    Keys { key: Key, before: Animation, selection: KeySelection },
    /// A key's tangent.
    Tangent { of: Setting, index: usize, side: Side, before: Keyframes },
}

/// A side of a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Side {
    In,
    Out,
}

impl Side {
    pub const BOTH: [Self; 2] = [Self::In, Self::Out];

    /// Name of the side.
    pub fn name(self) -> &'static str {
        match self {
            Self::In => "in",
            Self::Out => "out",
        }
    }

    /// Sign of the side's direction along the frames.
    pub fn sign(self) -> f32 {
        match self {
            Self::In => -1.0,
            Self::Out => 1.0,
        }
    }

    /// Index of the key whose interpolation shapes this side; None at an end of the curve.
    fn governor(self, keys: &Keyframes, index: usize) -> Option<usize> {
        match self {
            Self::In => index.checked_sub(1),
            Self::Out => (index + 1 < keys.keys().len()).then_some(index),
        }
    }

    /// True if tangents shape the curve on this side of a key.
    pub fn is_shaped(self, keys: &Keyframes, index: usize) -> bool {
        (self.governor(keys, index)).is_some_and(|governor| keys.kind(governor).is_cubic())
    }
}

/// Returns the keys with a tangent of the key at `index` turned to `slope`, in value per frame. The other side turns
/// with it, unless `alone`. A side that tangents do not shape stays unchanged.
pub fn turned(keys: &Keyframes, index: usize, side: Side, slope: f64, alone: bool) -> Keyframes {
    let mut turned = keys.clone();
    let Some(key) = keys.keys().get(index) else { return turned };
    let mut slopes = [key.slope_in, key.slope_out];
    for (own, one) in slopes.iter_mut().zip(Side::BOTH) {
        if (one == side || !alone) && one.is_shaped(keys, index) {
            *own = Some(slope);
            if let Some(governor) = one.governor(keys, index) {
                turned.set_kind(governor, Interpolation::Bezier);
            }
        }
    }
    match turned.set_slopes(index, slopes) {
        Ok(()) => turned,
        // The slope is too steep for a finite number.
        Err(_) => keys.clone(),
    }
}

/// Sends lanes as a command, if any of them differs.
pub fn push_changed(lanes: Vec<(Setting, Keyframes)>, now: &Animation, out: &mut Vec<Command>) {
    let is_new = |(of, keys): &(Setting, Keyframes)| now.keys(*of) != Some(keys);
    if lanes.iter().any(is_new) {
        out.push(Command::Look(LookCommand::Keys(lanes)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn keys() -> Keyframes {
        "0:0,10:10,20:0".parse().unwrap()
    }

    #[test]
    fn both_tangents_turn_together_unless_one_is_turned_alone() {
        let both = turned(&keys(), 1, Side::Out, 2.0, false);
        assert_eq!(both.slopes(1), Some([2.0, 2.0]));
        let kinds = [0, 1].map(|index| both.kind(index));
        assert_eq!(kinds, [Interpolation::Bezier; 2]);
        let alone = turned(&both, 1, Side::In, -1.0, true);
        assert_eq!(alone.slopes(1), Some([-1.0, 2.0]));
        let alone = turned(&keys(), 1, Side::Out, 2.0, true);
        assert_eq!(alone.slopes(1), Some([0.0, 2.0]));
        assert_eq!(alone.at(5.0), keys().at(5.0), "the other side is unchanged");
    }

    #[test]
    fn a_side_without_a_curve_has_no_tangent() {
        let mut held = keys();
        held.set_kind(0, Interpolation::Hold);
        held.set_kind(1, Interpolation::Linear);
        let shaped = |index| Side::BOTH.map(|side| side.is_shaped(&held, index));
        assert_eq!([0, 1, 2].map(shaped), [[false; 2]; 3]);
        held.set_kind(1, Interpolation::Smooth);
        let turned = turned(&held, 1, Side::Out, 2.0, false);
        assert_eq!(turned.keys()[1].slope_in, None);
        assert_eq!(turned.kind(0), Interpolation::Hold);
        assert!(!Side::In.is_shaped(&keys(), 0) && !Side::Out.is_shaped(&keys(), 2));
    }

    #[test]
    fn what_is_too_steep_changes_nothing() {
        assert_eq!(turned(&keys(), 1, Side::Out, f64::INFINITY, false), keys());
        assert_eq!(turned(&keys(), 9, Side::Out, 1.0, false), keys());
    }
}
