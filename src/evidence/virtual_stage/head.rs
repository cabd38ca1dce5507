//! The head and neck: skin, eyes and teeth as signed distances. Places are in the head's own axes:
//! metres from the point between the eyes' heights and the ears, +Z out of the face.

use super::motion::Pose;
use super::shape::{almond, ball, common, cut, ellipsoid, join, ring, rod};
use glam::{Mat3, Vec2, Vec3};

/// Centre of the eye on the +X side.
pub const EYE: Vec3 = Vec3::new(0.0315, 0.0, 0.0652);
/// Radius of an eyeball.
pub const EYE_RADIUS: f32 = 0.0133;
/// Place where the lips meet.
pub const MOUTH: Vec3 = Vec3::new(0.0, -0.0708, 0.088);
/// Distance of the open lids above and below the slit's corners.
const LID_UP: f32 = 0.0051;
const LID_DOWN: f32 = 0.0042;
/// Joint of the jaw.
const JAW_JOINT: Vec3 = Vec3::new(0.0, -0.022, -0.004);

/// A head with an expression.
pub struct Head {
    /// Transform from the head's axes to those of the opened jaw.
    jaw_from_head: Mat3,
    /// Half the gap between the lips in metres, 0 when they touch.
    gap: f32,
    /// Pull on the corners of the mouth, out, up and back, from 0 to 1.
    smile: f32,
    /// Opening of the lids, from 0 to 1.
    lids: f32,
}

/// Distances to the parts of a head.
pub struct HeadDistances {
    pub skin: f32,
    pub eyes: f32,
    pub teeth: f32,
}

impl Head {
    /// A head with the expression of `pose`.
    pub fn new(pose: &Pose) -> Self {
        Self {
            jaw_from_head: Mat3::from_rotation_x(-0.13 * pose.jaw),
            gap: 0.0052 * pose.jaw,
            smile: pose.smile,
            lids: 1.0 - pose.blink,
        }
    }

    /// Position of a point on the opened jaw with the jaw shut.
    fn shut(&self, q: Vec3) -> Vec3 {
        self.jaw_from_head * (q - JAW_JOINT) + JAW_JOINT
    }

    /// Distances at `q`.
    pub fn distances(&self, q: Vec3) -> HeadDistances {
        // Both sides at once, folded with a small radius so that there is no seam on the midline.
        let s = Vec3::new(q.x.hypot(0.005), q.y, q.z);
        // If only the skull's bound is near, no detail can be closer.
        let bound = ellipsoid(q - Vec3::new(0.0, -0.01, 0.0), Vec3::new(0.105, 0.14, 0.125));
        if bound > 0.02 {
            return HeadDistances { skin: bound, eyes: bound, teeth: bound };
        }
        let mut skin = self.skull(q, s);
        skin = self.eye_region(skin, s);
        if q.z > 0.0 {
            skin = nose(skin, q, s);
            skin = self.mouth(skin, q, s);
        }
        skin = ear(skin, s);
        let teeth = self.teeth(q);
        HeadDistances { skin, eyes: ball(s - EYE, EYE_RADIUS), teeth }
    }

    fn skull(&self, q: Vec3, s: Vec3) -> f32 {
        let j = self.shut(s);
        let cranium = ellipsoid(q - Vec3::new(0.0, 0.034, -0.016), Vec3::new(0.0735, 0.084, 0.096));
        let face = ellipsoid(q - Vec3::new(0.0, -0.022, 0.017), Vec3::new(0.0600, 0.082, 0.0645));
        let mut d = join(cranium, face, 0.03);
        let jaw = rod(j, Vec3::new(0.0475, -0.053, 0.008), Vec3::new(0.014, -0.094, 0.056), 0.0155, 0.0130);
        d = join(d, jaw, 0.036);
        d = join(d, ball(self.shut(q) - Vec3::new(0.0, -0.0965, 0.0650), 0.0125), 0.024);
        // Cheek bones, and the flesh of the cheeks, which a smile lifts.
        let bone = ellipsoid(s - Vec3::new(0.0410, -0.0215, 0.055), Vec3::new(0.0205, 0.016, 0.0190));
        d = join(d, bone, 0.024);
        let flesh = Vec3::new(0.0350, -0.047 + 0.006 * self.smile, 0.0580 + 0.003 * self.smile);
        d = join(d, ball(s - flesh, 0.0195), 0.030);
        let muzzle = ellipsoid(q - Vec3::new(0.0, -0.068, 0.063), Vec3::new(0.0275, 0.022, 0.0205));
        join(d, muzzle, 0.022)
    }

    fn eye_region(&self, skin: f32, s: Vec3) -> f32 {
        if s.z < 0.03 {
            return skin;
        }
        let brow = rod(s, Vec3::new(0.012, 0.0185, 0.0815), Vec3::new(0.042, 0.0215, 0.0625), 0.0068, 0.0058);
        let mut d = join(skin, brow, 0.02);
        let socket = ellipsoid(s - Vec3::new(0.0315, 0.002, 0.0925), Vec3::new(0.0205, 0.0165, 0.0195));
        d = cut(d, socket, 0.017);
        let e = s - EYE;
        // The lids are a shell about the eyeball, slit like an almond with its outer corner higher.
        let mut lids = ball(e, EYE_RADIUS + 0.0019);
        let bag = ball(s - EYE - Vec3::new(0.0, -0.0045, -0.0015), EYE_RADIUS + 0.0006);
        lids = join(lids, bag, 0.003);
        d = join(d, lids, 0.0055);
        if self.lids > 0.02 {
            let slit = Vec2::new(e.x, e.y + 0.0008 - 0.11 * e.x);
            let up = LID_UP * self.lids;
            let opening = almond(slit, 0.0150, up, LID_DOWN * self.lids.sqrt());
            d = cut(d, opening.max(-e.z), 0.0012);
        }
        // The fold above the upper lid.
        let fold = (e.x.hypot(e.y + 0.004) - 0.0142).abs().max(-(e.y - 0.003));
        cut(d, (fold - 0.0004).max(ball(e, EYE_RADIUS + 0.0045)), 0.0016)
    }

    fn mouth(&self, skin: f32, q: Vec3, s: Vec3) -> f32 {
        if (q - MOUTH).length_squared() > 0.06 * 0.06 {
            return skin;
        }
        let (lobe, lower) = self.lips(s);
        let upper = join(lobe, ball(q - Vec3::new(0.0, -0.0674, 0.0872), 0.0040), 0.004);
        let mut d = join(skin, upper, 0.0045);
        d = join(d, lower, 0.0045);
        // The groove from nose to lip and the hollow below the lower lip.
        let groove = rod(q, Vec3::new(0.0, -0.0525, 0.0925), Vec3::new(0.0, -0.0615, 0.0925), 0.0022, 0.0026);
        d = cut(d, groove, 0.0045);
        let hollow = ellipsoid(self.shut(q) - Vec3::new(0.0, -0.0868, 0.0885), Vec3::new(0.016, 0.004, 0.0050));
        d = cut(d, hollow, 0.011);
        cut(d, self.opening(q), 0.0016)
    }

    /// The upper lip's lobe and the lower lip, on the +X side.
    fn lips(&self, s: Vec3) -> (f32, f32) {
        let corner = self.corner();
        let upper = rod(s, Vec3::new(0.0075, -0.0662, 0.0862), corner, 0.0050, 0.0018);
        let lower_corner = corner - Vec3::new(0.0015, 0.0006, 0.0);
        let lower = rod(self.shut(s), Vec3::new(0.0060, -0.0770, 0.0844), lower_corner, 0.0062, 0.0018);
        (upper, lower)
    }

    /// The corner of the mouth on the +X side.
    fn corner(&self) -> Vec3 {
        Vec3::new(0.0240 + 0.004 * self.smile, -0.0712 + 0.0028 * self.smile, 0.0718 - 0.002 * self.smile)
    }

    /// Space between the lips: a thin line when closed, the hollow of the mouth when open.
    fn opening(&self, q: Vec3) -> f32 {
        let dip = Vec3::new(0.0, -0.0006 - 0.9 * self.gap + 4.0 * (0.25 + self.smile) * q.x * q.x, -0.008);
        let reach = Vec3::new(self.corner().x - 0.0075, 0.0006 + self.gap, 0.021);
        ellipsoid(q - MOUTH - dip, reach)
    }

    fn teeth(&self, q: Vec3) -> f32 {
        let upper = ellipsoid(q - Vec3::new(0.0, -0.0662, 0.0605), Vec3::new(0.0215, 0.0068, 0.0232));
        let lower = ellipsoid(self.shut(q) - Vec3::new(0.0, -0.0805, 0.0580), Vec3::new(0.0200, 0.0058, 0.0215));
        upper.min(lower)
    }

    /// True if `q` lies inside the mouth, behind parted lips.
    pub fn in_mouth(&self, q: Vec3) -> bool {
        let behind = q.z - MOUTH.z < -0.0045 - 12.0 * q.x * q.x;
        self.gap > 4e-4 && behind && self.opening(q) < 0.0008
    }

    /// Share of lip at `q`, from 0 to 1, for a point of the skin.
    pub fn lip(&self, q: Vec3) -> f32 {
        let (upper, lower) = self.lips(Vec3::new(q.x.abs(), q.y, q.z));
        1.0 - super::shape::ramp(0.0008, 0.0022, upper.min(lower))
    }

    /// The almond between the lids at `q` (+X side): its signed distance in the plane of the face.
    pub fn lid_edge(&self, q: Vec3) -> f32 {
        let e = Vec3::new(q.x.abs(), q.y, q.z) - EYE;
        let slit = Vec2::new(e.x, e.y + 0.0008 - 0.11 * e.x);
        let open = self.lids.max(0.02);
        almond(slit, 0.0150, LID_UP * open, LID_DOWN * open.sqrt())
    }
}

fn nose(skin: f32, q: Vec3, s: Vec3) -> f32 {
    if s.z < 0.05 || s.y > 0.04 || s.y < -0.075 {
        return skin;
    }
    let bridge = rod(q, Vec3::new(0.0, 0.011, 0.0785), Vec3::new(0.0, -0.033, 0.0965), 0.0052, 0.0070);
    let mut d = join(skin, bridge, 0.014);
    let tip = ellipsoid(q - Vec3::new(0.0, -0.0375, 0.0985), Vec3::new(0.0090, 0.0078, 0.0088));
    d = join(d, tip, 0.009);
    let wing = ellipsoid(s - Vec3::new(0.0128, -0.0420, 0.0870), Vec3::new(0.0064, 0.0058, 0.0085));
    d = join(d, wing, 0.0065);
    let nostril = ellipsoid(s - Vec3::new(0.0070, -0.0478, 0.0925), Vec3::new(0.0034, 0.0040, 0.0052));
    cut(d, nostril, 0.0028)
}

fn ear(skin: f32, s: Vec3) -> f32 {
    let p = s - Vec3::new(0.0755, -0.012, -0.012);
    if p.length_squared() > 0.05 * 0.05 {
        return skin;
    }
    // The ear leans back and stands off the head.
    let e = Mat3::from_rotation_x(0.22) * (Mat3::from_rotation_y(0.42) * p);
    let oval = ellipsoid(e - Vec3::new(0.002, 0.0, -0.004), Vec3::new(0.0062, 0.0300, 0.0175));
    let bowl = ellipsoid(e - Vec3::new(0.0085, 0.001, -0.004), Vec3::new(0.0062, 0.0205, 0.0105));
    let mut d = cut(oval, bowl, 0.004);
    // Its rim: a ring squeezed into an oval, open towards the cheek at the lobe.
    let round = Vec3::new(e.y * 0.62, e.x - 0.0058, e.z + 0.004);
    let rim = common(ring(round, 0.0152, 0.0027), -(e.y + 0.017), 0.004);
    d = join(d, rim, 0.004);
    let lobe = ball(e - Vec3::new(0.0040, -0.0255, 0.0008), 0.0062);
    d = join(d, lobe, 0.006);
    let flap = ball(e - Vec3::new(0.0035, -0.003, 0.0105), 0.0042);
    d = join(d, flap, 0.006);
    join(skin, d, 0.007)
}
