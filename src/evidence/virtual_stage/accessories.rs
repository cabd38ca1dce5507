//! Optional accessories of the subject: glasses and hair (in the head's axes) and a raised hand (in the subject's).

use super::head::EYE;
use super::shape::{common, cut, ellipsoid, join, noise, rod};
use glam::{Mat3, Vec2, Vec3};

/// Centre of the lens on the +X side, before the lids and brows.
const LENS: Vec3 = Vec3::new(EYE.x + 0.0015, EYE.y - 0.002, 0.0955);
/// Radius of a lens.
const LENS_RADIUS: f32 = 0.0225;
/// Radius of the ball that a lens is part of.
const LENS_CURVE: f32 = 0.12;

/// The frame of a pair of glasses: two rims, a bridge, and temples to the ears.
pub fn glasses(q: Vec3) -> f32 {
    let s = Vec3::new(q.x.abs(), q.y, q.z);
    let p = s - LENS;
    let rim = Vec2::new(p.truncate().length() - LENS_RADIUS, p.z - bulge(p)).length() - 0.0016;
    let bridge =
        rod(s, Vec3::new(0.0, 0.0055, 0.0985), Vec3::new(LENS.x - LENS_RADIUS + 0.002, 0.0035, LENS.z), 0.0016, 0.0018);
    let hinge = Vec3::new(LENS.x + LENS_RADIUS, 0.004, LENS.z - 0.002);
    let turn = Vec3::new(0.0715, 0.005, 0.060);
    let over_ear = Vec3::new(0.0835, 0.012, -0.010);
    let temple = rod(s, hinge, turn, 0.0019, 0.0017).min(rod(s, turn, over_ear, 0.0017, 0.0017));
    rim.min(bridge).min(temple)
}

/// Bulge of a lens at `p` from its centre.
fn bulge(p: Vec3) -> f32 {
    -0.5 * p.truncate().length_squared() / LENS_CURVE
}

/// Intersection of a ray from in front with a lens, in the head's axes: the distance along it and the normal.
pub fn lens(origin: Vec3, direction: Vec3) -> Option<(f32, Vec3)> {
    if direction.z >= 0.0 {
        return None;
    }
    let sides = [LENS, Vec3::new(-LENS.x, LENS.y, LENS.z)];
    sides.into_iter().find_map(|centre| {
        // A lens is nearly flat: its plane is close enough to locate the hit.
        let t = (centre.z - origin.z) / direction.z;
        let p = origin + direction * t - centre;
        let on_lens = p.truncate().length() < LENS_RADIUS;
        on_lens.then(|| (t, Vec3::new(p.x / LENS_CURVE, p.y / LENS_CURVE, 1.0).normalize()))
    })
}

/// Hair to the shoulders: a shell about the skull behind the hairline, falling beside and behind the neck.
pub fn hair(q: Vec3) -> f32 {
    let bound = ellipsoid(q - Vec3::new(0.0, 0.0, -0.03), Vec3::new(0.125, 0.19, 0.135));
    if bound > 0.02 {
        return bound;
    }
    let strands = 0.0016 * noise(q * Vec3::new(420.0, 30.0, 420.0)) + 0.004 * noise(q * Vec3::new(60.0, 14.0, 60.0));
    let cap = ellipsoid(q - Vec3::new(0.0, 0.036, -0.020), Vec3::new(0.0890, 0.0965, 0.1085));
    // From the middle of the brow over the temples to in front of the ears.
    let edge = (q.y - 0.045 - 0.75 * q.z + 2.0 * q.x * q.x) * 0.8;
    let cap = common(cap - strands, -edge, 0.006);
    let fall = ellipsoid(q - Vec3::new(0.0, -0.055, -0.045), Vec3::new(0.098, 0.115, 0.062));
    let face = ellipsoid(q - Vec3::new(0.0, -0.05, 0.035), Vec3::new(0.078, 0.16, 0.075));
    join(cap, cut(fall - strands, face, 0.008), 0.012)
}

/// A loose fist with raised fingers beside the chin, and its forearm. `raised` from 0 (below the picture) to 1.
pub fn hand(p: Vec3, raised: f32) -> f32 {
    let wrist = Vec3::new(0.110, -0.430, 0.100).lerp(Vec3::new(0.088, -0.185, 0.118), raised);
    let elbow = wrist + Vec3::new(0.050, -0.16, -0.060);
    // The hand's own axes: +Y along the palm, leaning towards the face.
    let h = Mat3::from_rotation_z(-0.45) * (p - wrist);
    let forearm = rod(p, wrist, elbow, 0.024, 0.032);
    // The fingers end 0.14 m from the wrist.
    if h.length() > 0.16 {
        return forearm.min(h.length() - 0.14);
    }
    let palm = ellipsoid(h - Vec3::new(0.0, 0.042, 0.0), Vec3::new(0.036, 0.047, 0.0155));
    let mut d = join(palm, forearm, 0.02);
    for (i, length) in [0.030, 0.036, 0.034, 0.026].into_iter().enumerate() {
        let x = 0.0255 - 0.017 * i as f32;
        let knuckle = Vec3::new(x, 0.078, 0.002);
        let middle = knuckle + Vec3::new(0.0, length, 0.008);
        let tip = middle + Vec3::new(0.0, 0.4 * length, -0.022);
        let finger = rod(h, knuckle, middle, 0.0085, 0.0078).min(rod(h, middle, tip, 0.0078, 0.0068));
        d = join(d, finger, 0.006);
    }
    let thumb = rod(h, Vec3::new(-0.028, 0.025, 0.008), Vec3::new(-0.048, 0.066, 0.016), 0.0115, 0.0085);
    join(d, thumb, 0.010)
}
