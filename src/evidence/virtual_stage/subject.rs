//! The subject: a moving head on a dressed trunk, as one signed distance with a part for every surface point.

use super::accessories;
use super::attire;
use super::head::{Head, HeadDistances};
use super::motion::Pose;
use super::shape::{join, rod};
use super::trouble::Look;
use glam::{Mat3, Vec3};

/// Part of the subject at a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    Skin,
    Eye,
    Tooth,
    Wrap,
    Gold,
    Shirt,
    Jacket,
    Hair,
    Glasses,
    Hand,
}

/// Corner of the box around everything that is visible or can cast a shadow.
pub const BOX_LOW: Vec3 = Vec3::new(-0.29, -0.35, -0.19);
/// The opposite corner.
pub const BOX_HIGH: Vec3 = Vec3::new(0.29, 0.26, 0.19);

/// Joint of the head, in the head's axes.
const NECK_JOINT: Vec3 = Vec3::new(0.0, -0.085, -0.025);
/// The origin of the head's axes on the stage.
const HEAD_ORIGIN: Vec3 = Vec3::new(0.0, 0.024, 0.0);
/// The foot of the neck on the stage.
const NECK_FOOT: Vec3 = Vec3::new(0.0, -0.205, -0.038);

/// A subject in one pose.
pub struct Subject {
    pub head: Head,
    pub look: Look,
    /// Height of a raised hand; 0 if none is raised.
    hand: f32,
    head_from_stage: Mat3,
    /// Joint of neck and head, on the stage.
    joint: Vec3,
    /// The cords of the neck on the +X and −X sides: below the ear and above the breastbone.
    cords: [(Vec3, Vec3); 2],
}

impl Subject {
    /// The subject in pose `pose`, in its own axes: those of the stage if it sits in the middle.
    pub fn new(pose: &Pose, look: &Look) -> Self {
        let stage_from_head = pose.rotation();
        let joint = HEAD_ORIGIN + NECK_JOINT + pose.shift();
        let cord = |side: f32| {
            let mastoid = stage_from_head * (Vec3::new(0.056 * side, -0.052, -0.024) - NECK_JOINT) + joint;
            (mastoid, Vec3::new(0.014 * side, -0.168, 0.020))
        };
        Self {
            head: Head::new(pose),
            look: *look,
            hand: if look.hands { pose.hand } else { 0.0 },
            head_from_stage: stage_from_head.transpose(),
            joint,
            cords: [cord(1.0), cord(-1.0)],
        }
    }

    /// A place of the stage in the axes of a head of standard build.
    pub fn head_place(&self, p: Vec3) -> Vec3 {
        let q = self.head_from_stage * (p - self.joint);
        q / self.look.build.map_or(Vec3::ONE, Vec3::from) + NECK_JOINT
    }

    /// A place of the stage in the axes of the head, and of the glasses, which fit any head.
    fn worn_place(&self, p: Vec3) -> Vec3 {
        self.head_from_stage * (p - self.joint) + NECK_JOINT
    }

    /// Signed distance to the nearest surface in metres; a bound far from it.
    pub fn distance(&self, p: Vec3) -> f32 {
        self.parts(p).1
    }

    /// The nearest part and its signed distance.
    pub fn parts(&self, p: Vec3) -> (Part, f32) {
        let q = self.head_place(p);
        // In a head of another build, distances shrink at most by its smallest factor.
        let near = self.look.build.map_or(1.0, |build| Vec3::from(build).min_element().min(1.0));
        let head = self.head.distances(q);
        let head = HeadDistances { skin: near * head.skin, eyes: near * head.eyes, teeth: near * head.teeth };
        let neck = self.neck(p);
        let skin = join(head.skin, neck, 0.018);
        let trunk = attire::trunk(p);
        let all = [
            (Part::Eye, head.eyes),
            (Part::Tooth, head.teeth),
            match self.look.hair {
                None => (Part::Wrap, near * attire::wrap(q)),
                Some(_) => (Part::Hair, near * accessories::hair(q)),
            },
            (Part::Gold, near * attire::earrings(q)),
            (Part::Shirt, attire::shirt(p, trunk, neck)),
            (Part::Jacket, attire::jacket(p, trunk, neck)),
        ];
        let glasses = (self.look.glasses).then(|| (Part::Glasses, accessories::glasses(self.worn_place(p))));
        let hand = (self.hand > 0.0).then(|| (Part::Hand, accessories::hand(p, self.hand)));
        let all = all.into_iter().chain(glasses).chain(hand);
        all.fold((Part::Skin, skin), |best, next| if next.1 < best.1 { next } else { best })
    }

    /// Hit of a ray on a lens of the glasses, if the subject wears them: the distance along it and the normal.
    pub fn lens(&self, origin: Vec3, direction: Vec3) -> Option<(f32, Vec3)> {
        if !self.look.glasses {
            return None;
        }
        let stage_from_head = self.head_from_stage.transpose();
        accessories::lens(self.worn_place(origin), self.head_from_stage * direction)
            .map(|(t, normal)| (t, stage_from_head * normal))
    }

    fn neck(&self, p: Vec3) -> f32 {
        let mut d = rod(p, self.joint + Vec3::new(0.0, 0.02, 0.0), NECK_FOOT, 0.046, 0.052);
        for (mastoid, breastbone) in self.cords {
            d = join(d, rod(p, mastoid, breastbone, 0.008, 0.006), 0.018);
        }
        d
    }

    /// Unit normal of the surface near `p`: the gradient by a tetrahedron of four differences.
    pub fn normal(&self, p: Vec3) -> Vec3 {
        const STEP: f32 = 4e-4;
        let corners = [Vec3::new(1.0, -1.0, -1.0), Vec3::new(-1.0, -1.0, 1.0), Vec3::new(-1.0, 1.0, -1.0), Vec3::ONE];
        corners.iter().map(|&c| c * self.distance(p + c * STEP)).sum::<Vec3>().normalize_or(Vec3::Z)
    }
}
