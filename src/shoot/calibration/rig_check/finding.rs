//! Faults that a rig can have, and their report.

use light::Rig;
use serde::{Deserialize, Serialize};

/// Possible faults of lamps.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fault {
    /// Not seen on the mirror ball, or not in every channel. Relighting cannot use the lamp.
    NotSeen,
    /// Much weaker than the other lamps, so that its OLAT's noise would be amplified.
    Dark,
    /// Clipped on the ball: the energy is a lower bound, the direction is right.
    Clipped,
    /// In or touching the cone behind the ball: direction and energy are estimates.
    BehindBall,
    /// Several OLATs show the same lamp.
    SameLamp,
    /// Several mirror balls, or OLATs of a pose, are copies of one picture; see [`super::same_pictures`].
    SamePicture,
    /// The OLAT shows the lamp that the layout assigns to another OLAT.
    Swapped,
    /// Measured at a place without a lamp in the layout.
    Misplaced,
    /// The layout as a whole does not fit the measured directions.
    WrongLayout,
    /// The mirror ball's circle is off its outline, so every direction is wrong.
    WrongCircle,
}

/// One fault.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    pub fault: Fault,
    /// Indices of the faulty lamps in [`Rig::lamps`], ascending.
    pub lamps: Vec<usize>,
    /// Description and remedy.
    pub sentence: String,
}

/// Names of lamps for a sentence; only the first few of many.
pub(super) fn names(rig: &Rig, lamps: &[usize]) -> String {
    const MOST: usize = 8;
    let name = |&i: &usize| rig.lamps[i].name.as_str();
    let listed: Vec<&str> = lamps.iter().take(MOST).map(name).collect();
    match lamps.len().saturating_sub(MOST) {
        0 => listed.join(", "),
        more => format!("{} and {more} more", listed.join(", ")),
    }
}
