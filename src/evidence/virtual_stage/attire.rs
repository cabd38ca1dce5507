//! Clothes of the subject: a head wrap with a knot and gold earrings (in the head's axes), a shirt with a collar and a
//! woven jacket (in the stage's axes).

use super::shape::{ball, common, cut, ellipsoid, join, noise, ramp, ring, rod};
use glam::{Mat3, Vec3};

/// The head wrap: bands of cloth about the skull, pleated, with a knot above.
pub fn wrap(q: Vec3) -> f32 {
    let bound = ellipsoid(q - Vec3::new(0.0, 0.075, -0.025), Vec3::new(0.115, 0.125, 0.13));
    if bound > 0.02 {
        return bound;
    }
    let skull = ellipsoid(q - Vec3::new(0.0, 0.040, -0.018), Vec3::new(0.0830, 0.0885, 0.1045));
    // The edge runs from the hairline over the tops of the ears to the nape.
    let edge = (q.y - 0.0215 - 0.40 * q.z - 0.9 * q.x * q.x) * 0.93;
    // Pleats run up from each ear and cross above the brow.
    let lean = q.y * 0.80 - 0.60 * q.x + 0.20 * q.z;
    let pleat = |phase: f32| 1.0 - (phase.sin() * 0.5 + 0.5).powf(1.6);
    let bulge = pleat(330.0 * lean + 1.7 * noise(q * 22.0)) * 0.0024 + 0.0022 * noise(q * 26.0);
    let mut cloth = common(skull - 0.0015 - bulge, -edge, 0.005);
    // A rolled band along the edge.
    let roll = (skull - 0.003).hypot(edge - 0.0085) - 0.0085 - 0.0012 * (q.x * 150.0 + 260.0 * edge).sin();
    cloth = join(cloth, roll, 0.004);
    join(cloth, knot(q), 0.012)
}

/// The knot: a low coil on the crown, its end tucked in the middle.
fn knot(q: Vec3) -> f32 {
    let p = Mat3::from_rotation_x(0.30) * (q - Vec3::new(0.008, 0.116, -0.018));
    let angle = p.x.atan2(p.z);
    let coil = ring(p, 0.0365, 0.0205 + 0.0018 * (9.0 * angle + 300.0 * p.y).sin());
    let end = ellipsoid(p - Vec3::new(0.004, 0.014, 0.0), Vec3::new(0.0245, 0.0185, 0.0235));
    join(coil, end + 0.0012 * (3.0 * angle + 420.0 * p.y).sin(), 0.004)
}

/// A gold drop below each ear.
pub fn earrings(q: Vec3) -> f32 {
    let s = Vec3::new(q.x.abs(), q.y, q.z) - Vec3::new(0.0825, -0.0480, -0.0135);
    let drop = rod(s, Vec3::new(0.0, -0.004, 0.0), Vec3::new(0.0005, -0.0185, 0.0), 0.0022, 0.0052);
    drop.min(ball(s, 0.0034))
}

/// The trunk under the clothes: shoulders, chest and upper arms.
pub fn trunk(p: Vec3) -> f32 {
    let s = Vec3::new(p.x.abs(), p.y, p.z);
    let shoulder = rod(s, Vec3::new(0.020, -0.148, -0.040), Vec3::new(0.158, -0.203, -0.032), 0.030, 0.040);
    let chest = ellipsoid(s - Vec3::new(0.0, -0.335, -0.028), Vec3::new(0.178, 0.170, 0.100));
    let arm = rod(s, Vec3::new(0.172, -0.222, -0.032), Vec3::new(0.205, -0.42, -0.026), 0.046, 0.044);
    join(join(shoulder, chest, 0.05), arm, 0.035)
}

/// Half the width of the jacket's opening at height `y`.
fn opening(y: f32) -> f32 {
    0.40 * (y + 0.300)
}

/// The shirt: on the chest inside the jacket's opening, with a band collar about the neck at distance `neck`, open at
/// the throat, and buttons.
pub fn shirt(p: Vec3, trunk: f32, neck: f32) -> f32 {
    let placket = if p.z > 0.0 { 0.0016 * (1.0 - ramp(0.009, 0.011, p.x.abs())) } else { 0.0 };
    let crease = 0.0016 * noise(p * Vec3::new(45.0, 16.0, 30.0));
    let throat = rod(p, Vec3::new(0.0, -0.125, 0.060), Vec3::new(0.0, -0.188, 0.078), 0.020, 0.003);
    let front = trunk - 0.0045 - placket - crease;
    let height = (p.y + 0.158 + 0.30 * p.z).abs() - 0.017;
    let band = common((neck - 0.0065).abs() - 0.0026, height, 0.003);
    let cloth = cut(join(front, band, 0.006), throat, 0.003);
    // A button every 36 millimetres, on the placket.
    let row = ((p.y + 0.204) / 0.036).round().min(0.0) * 0.036 - 0.204;
    let button = Vec3::new(p.x, p.y - row, 0.0).length() - 0.0042;
    join(cloth, common(button, (trunk - 0.0070).abs() - 0.0012, 0.001).max(-p.z), 0.0006)
}

/// The jacket: over the trunk, open in a V, with lapels.
pub fn jacket(p: Vec3, trunk: f32, neck: f32) -> f32 {
    let s = Vec3::new(p.x.abs(), p.y, p.z);
    let mut cloth = trunk - 0.0105 - 0.0020 * noise(p * Vec3::new(24.0, 14.0, 24.0));
    let edge = if p.z > -0.02 { (s.x - opening(p.y)) * 0.93 } else { 0.05 };
    cloth = common(cloth, -edge, 0.004);
    cloth = cut(cloth, neck - 0.0125, 0.006);
    // Lapels lie along the opening, notched half-way.
    let notch = 0.010 * ramp(-0.205, -0.199, p.y);
    let strip = (edge - 0.019 - 0.06 * (p.y + 0.26)).abs() - 0.019 + notch;
    let lapel = common(trunk - 0.0165, strip, 0.003);
    let lapel = common(lapel, -(p.z + 0.02), 0.006);
    let lapel = cut(lapel, neck - 0.0165, 0.004);
    // Behind, the collar stands against the neck.
    let back = common((neck - 0.0165).abs() - 0.0045, (p.y + 0.142 + 0.55 * p.z).abs() - 0.016, 0.005);
    let back = common(back, p.z - 0.012, 0.008);
    join(join(cloth, lapel, 0.003), back, 0.006)
}
