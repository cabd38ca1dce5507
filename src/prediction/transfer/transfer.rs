//! The exemplars, ready to be carried over to frames.

use crate::half_rows::HalfRows;
use crate::lamps::{Lamps, shading};
use crate::places::Place;
use crate::pose_turns::{PoseTurn, PoseTurns};
use crate::shape::{depth, inside, normals};
use crate::target::{CONTRAST, Target, matched_contrast};
use crate::turn::turn_vector;
use base::error::{Error, Result};
use calibration::Calibration;
use footage::{Exemplar, Frame};
use glam::Vec3;
use imaging::color::luminance;
use imaging::{Image, Mask, Raster};
use light::Rig;
use project::Project;
use rayon::prelude::*;
use reflectance::ReflectanceField;
use std::sync::Arc;

/// A pose under the interview's light beside its OLATs.
#[derive(Clone, Debug)]
pub struct PlatePose {
    pub exemplar: Exemplar,
    /// The pose under the interview's light, linear, exposure included.
    pub plate: Image,
}

/// A pose, ready to be matched and carried over.
#[derive(Clone, Debug)]
pub struct Pose {
    /// Number of the pose in the project.
    pub number: usize,
    /// Local contrast of the plate, at the size at which pictures are matched.
    pub contrast: Raster<f32>,
    pub mask: Mask,
    /// Heights towards the camera in pixels.
    pub depth: Raster<f32>,
    pub normals: Vec<Vec3>,
    /// Lamps whose OLATs the pose lacks.
    pub missing: Vec<usize>,
    /// Roots of the OLATs over their lamps' energy and shading, `[3, stride]` a pixel.
    pub bare: HalfRows,
}

/// All exemplars of a project, which predict the OLATs of its frames without training: reflectance transfer after Peers,
/// Tamura, Matusik and Debevec 2007. Each exemplar is matched with the frame densely, and its lamps turn with the head. Shading
/// is divided out before neighbouring lamps are blended. Exemplars are blended by the angle of their nearest lamp, by pose, and
/// pixel by pixel by how well their prediction explains the frame. The blend sums to the frame under the interview's light.
#[derive(Clone, Debug)]
pub struct Transfer {
    pub(crate) poses: Vec<Arc<Pose>>,
    pub(crate) turns: PoseTurns,
    pub(crate) lamps: Lamps,
    /// The interview's light as a sum of the lamps, exposure included.
    pub(crate) weights: Vec<[f32; 3]>,
}

/// A frame's OLATs, carried over.
#[derive(Clone, Debug)]
pub struct Carried {
    /// Linear OLATs, 0 outside the matte.
    pub field: ReflectanceField,
    /// Distance of each pixel from the best exemplar's prediction under the interview's light: root mean square of the
    /// natural logarithm of their ratio in a small window, more where that exemplar shows no subject.
    pub unlike: Mask,
    /// The pose that is most like the frame, by its number; None without poses.
    pub pose: Option<usize>,
    /// Places of the frame in the exemplars.
    pub places: Arc<[Place]>,
    /// Variance of the exemplars' predictions about their blend: squares of roots of light, the mean over lamps and channels.
    pub spread: Mask,
    /// The same of each lamp, the mean over the matte.
    pub lamp_spreads: Vec<f32>,
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
            return Err(Error::missing(
                "the shoot has no pose of the OLAT session",
                "Import the shoot again",
            ));
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
        let target = Target::new(frame, self);
        let said = |pose: &Arc<Pose>| target.said(pose, target.found(pose));
        target.blended(self.poses.par_iter().map(said).collect())
    }

    /// Turns between all poses, each matched with the others as a frame would be.
    fn turns_between(&self, plates: &[PlatePose]) -> PoseTurns {
        let turns_to = |(to, plate): (&Arc<Pose>, &PlatePose)| -> Vec<PoseTurn> {
            let frame =
                Frame { index: 0, plate: plate.plate.clone(), mask: plate.exemplar.mask.clone() };
            let target = Target::new(&frame, self);
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
        let [target, other] = [frame, other].map(|frame| Target::new(frame, self));
        let found = target.moved(target.offsets(&target.contrast, &other.contrast));
        target.unlike(&found.pulled(&other.plate), &found.pulled(&other.frame.mask))
    }
}

impl Pose {
    /// The normal at a place that a match found, not of unit length between pixels.
    #[inline(always)]
    pub fn normal(&self, places: [(usize, f32); 4]) -> Vec3 {
        places.iter().map(|&(p, share)| self.normals[p] * share).sum()
    }

    fn new(pose: &PlatePose, lamps: &Lamps) -> Self {
        let PlatePose { exemplar, plate } = pose;
        let plate = plate.map(luminance);
        let inside = inside(&exemplar.mask);
        let matte = inside.map(|inside| f32::from(u8::from(inside)));
        let known: Vec<(usize, Vec3)> = lamps
            .directions
            .iter()
            .enumerate()
            .filter_map(|(m, direction)| Some((m, (*direction)?)))
            .filter(|(m, _)| !exemplar.missing.contains(m))
            .collect();
        let pixels = exemplar.mask.pixels.len();
        let even: Vec<f32> = (0..pixels)
            .flat_map(|p| {
                known.iter().map(move |&(m, _)| {
                    luminance(exemplar.olats[m].pixels[p]) / luminance(lamps.energies[m])
                })
            })
            .collect();
        let directions: Vec<Vec3> = known.iter().map(|(_, direction)| *direction).collect();
        let normals =
            if known.is_empty() { vec![Vec3::ZERO; pixels] } else { normals(&even, &directions) };
        let stride = lamps.stride;
        let bare = HalfRows::new(&exemplar.mask, 3 * stride, |p, bare| {
            for (m, (olat, direction)) in exemplar.olats.iter().zip(&lamps.directions).enumerate() {
                let shading = shading(normals[p], *direction);
                for c in 0..3 {
                    bare[c * stride + m] =
                        (olat.pixels[p][c].max(0.0) / (lamps.energies[m][c] * shading)).sqrt();
                }
            }
        });
        Self {
            number: exemplar.pose,
            missing: exemplar.missing.clone(),
            contrast: matched_contrast(&plate, &matte, CONTRAST),
            mask: exemplar.mask.clone(),
            depth: depth(&normals, &inside),
            normals,
            bare,
        }
    }
}
