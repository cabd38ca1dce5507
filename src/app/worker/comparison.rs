//! Counterparts of a picture, as the window requests them.

use light::Environment;
use scene::Scene;
use std::path::PathBuf;
use std::sync::Arc;

/// Counterpart of the relit picture in a comparison.
#[derive(Clone, Debug)]
pub enum Comparison {
    /// The interview's frame as it was filmed.
    Plate,
    /// The same frame under another environment, turned by a yaw in degrees.
    Light(Arc<Environment>, f32),
    /// The same frame in another look.
    Look(Box<LookView>),
    /// Other OLATs under the same light.
    Olats(ComparisonSource),
}

impl PartialEq for Comparison {
    /// Environments are equal if they are the same object.
    fn eq(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Plate, Self::Plate) => true,
            (Self::Light(one, yaw), Self::Light(other, turned)) => Arc::ptr_eq(one, other) && yaw == turned,
            (Self::Look(one), Self::Look(other)) => one == other,
            (Self::Olats(one), Self::Olats(other)) => one == other,
            _ => false,
        }
    }
}

/// Another look at the frame of a picture.
#[derive(Clone, Debug)]
pub struct LookView {
    /// Its frame is ignored: the picture's is used.
    pub scene: Scene,
    pub environment: Arc<Environment>,
}

impl PartialEq for LookView {
    /// Environments are equal if they are the same object.
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.environment, &other.environment) && self.scene == other.scene
    }
}

/// OLATs that do not come from the current network.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum ComparisonSource {
    /// Photographs of this pose.
    Exemplar(usize),
    /// True OLATs of the shown frame, in a folder as [`evaluation::Truth`] reads it.
    Truth(PathBuf),
    /// Exemplars carried over, corrected by the network in this folder.
    Checkpoint(PathBuf),
    /// Exemplars carried over, without a network.
    Transfer,
}
