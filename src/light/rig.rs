//! The rig: where each lamp is and how strong it is, as the mirror balls recorded it.

use glam::Vec3;
use serde::{Deserialize, Serialize};

/// One lamp (or bank of lamps that switch together), as its OLAT's mirror ball shows it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Lamp {
    /// The name of its OLAT, as in the files: `olat_07`.
    pub name: String,
    /// Unit direction from the subject towards the lamp's centroid.
    pub direction: Vec3,
    /// ∫ L dω per channel over the lamp's footprint on the ball, in the units of the OLAT session.
    pub energy: [f32; 3],
    /// Root-mean-square angle of the footprint about the centroid, in degrees.
    pub spread_deg: f32,
    /// 0 (not seen) to 1 (clear of the ball's rim and of clipping).
    pub confidence: f32,
}

/// All lamps of a session, in the order of their OLATs.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Rig {
    pub lamps: Vec<Lamp>,
}
