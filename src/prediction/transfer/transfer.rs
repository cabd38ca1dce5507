//! The exemplars, ready to be carried over to frames.

use crate::blend::{Blend, Carried};
use crate::lamps::Lamps;
use crate::pose::{PlatePose, Pose};
use crate::pose_turns::{PoseTurn, PoseTurns};
use crate::target::Target;
use crate::turn::turn_vector;
use base::error::{Error, Result};
use calibration::Calibration;
use footage::{Exemplar, Frame};
use imaging::Mask;
use light::Rig;
use project::Project;
use rayon::prelude::*;
use std::sync::Arc;

/// All exemplars of a project, which predict the OLATs of its frames without training: reflectance transfer after Peers,
/// Tamura, Matusik and Debevec 2007. Each exemplar is matched with the frame densely, and its lamps turn with the head. Shading
/// is divided out before neighbouring lamps are blended. Exemplars are blended by the angle of their nearest lamp, by pose, and
/// pixel by pixel by how well their prediction explains the frame. The blend sums to the frame under the interview's light.
#[derive(Clone, Debug)]
pub struct Transfer {
    poses: Vec<Arc<Pose>>,
    turns: PoseTurns,
    pub(crate) lamps: Lamps,
    /// The interview's light as a sum of the lamps, exposure included.
    weights: Vec<[f32; 3]>,
}

impl Transfer {
    /// Reads the project's exemplars.
    ///
    /// # Errors
    /// When a picture cannot be read, or the shoot has no pose.
    pub fn open(project: &Project, calibration: &Calibration) -> Result<Self> {
        let light = calibration.interview_light();
        let poses = Exemplar::load_all(project, &calibration.response)?
            .into_iter()
            .map(|exemplar| {
                let plate = exemplar.relit_by_all(project, &calibration.response, &light)?;
                Ok(PlatePose { exemplar, plate })
            })
            .collect::<Result<Vec<_>>>()?;
        if poses.is_empty() {
            return Err(Error::missing("the shoot has no pose of the OLAT session", "Import the shoot again"));
        }
        Ok(Self::new(&poses, &calibration.rig, calibration.learnt_light()))
    }

    /// Prepares poses whose OLATs are those of `rig`. `weights`: the interview's light as a sum of these lamps, exposure
    /// included.
    pub fn new(plates: &[PlatePose], rig: &Rig, weights: Vec<[f32; 3]>) -> Self {
        let lamps = Lamps::new(rig);
        let poses = plates.par_iter().map(|pose| Arc::new(Pose::new(pose, &lamps))).collect();
        let mut transfer = Self { poses, lamps, weights, turns: PoseTurns::default() };
        transfer.turns = transfer.turns_between(plates);
        transfer
    }

    /// The same without one pose, by its number in the project.
    #[must_use]
    pub fn without(&self, pose: usize) -> Self {
        let mut rest = self.clone();
        rest.poses.retain(|other| other.number != pose);
        rest.turns.leave_out(pose);
        rest
    }

    /// Bytes of the exemplars in memory.
    pub fn bytes(&self) -> usize {
        let size = |pose: &Arc<Pose>| {
            let pixels = pose.mask.pixels.len() + pose.depth.pixels.len();
            pose.bare.bytes()
                + size_of_val(&pose.normals[..])
                + size_of::<f32>() * (pixels + pose.contrast.pixels.len())
        };
        self.poses.iter().map(size).sum()
    }

    /// The interview's light as a sum of the lamps, exposure included.
    pub fn weights(&self) -> &[[f32; 3]] {
        &self.weights
    }

    /// Carries the exemplars over to a frame of their size. Without exemplars all OLATs are black.
    pub fn carry(&self, frame: &Frame) -> Carried {
        let target = self.target(frame);
        let Blend { olats, rest } = self.blend(&target);
        Carried { field: target.field(&olats), ..rest }
    }

    /// Blend of the exemplars' predictions of a frame.
    pub(crate) fn blend(&self, target: &Target) -> Blend {
        let said = |pose: &Arc<Pose>| target.said(pose, target.found(pose));
        target.blend(self.poses.par_iter().map(said).collect())
    }

    /// A frame that the exemplars are carried over to.
    pub(crate) fn target<'a>(&'a self, frame: &'a Frame) -> Target<'a> {
        Target::new(frame, &self.lamps, &self.weights, &self.turns)
    }

    /// Turns between all poses, each matched with the others as a frame would be.
    fn turns_between(&self, plates: &[PlatePose]) -> PoseTurns {
        let turns_to = |(to, plate): (&Arc<Pose>, &PlatePose)| -> Vec<PoseTurn> {
            let frame = Frame { index: 0, plate: plate.plate.clone(), mask: plate.exemplar.mask.clone() };
            let target = self.target(&frame);
            let turn = |from: &Arc<Pose>| {
                let found = target.matched(from, target.found(from));
                PoseTurn {
                    from: from.number,
                    to: to.number,
                    by_depth: turn_vector(&found.turn),
                    by_normals: turn_vector(&target.turn_of_normals(from, &found, &to.normals)),
                }
            };
            let others = (self.poses.iter()).filter(|from| from.number != to.number);
            others.map(turn).collect()
        };
        let poses = self.poses.par_iter().zip(plates);
        PoseTurns(poses.flat_map_iter(turns_to).collect())
    }

    /// Distance of each pixel of a frame from another frame that is matched with it, as [`Carried::unlike`]; more where the
    /// other shows no subject.
    pub fn apart(&self, frame: &Frame, other: &Frame) -> Mask {
        let [target, other] = [frame, other].map(|frame| self.target(frame));
        let found = target.moved(target.offsets(&target.contrast, &other.contrast));
        target.unlike(&found.pulled(&other.plate), &found.pulled(&other.frame.mask))
    }
}
