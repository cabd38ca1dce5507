//! Materials of the parts: colours in the parts' own axes, highlights, cloth sheen and subsurface distance of skin.

use super::head::{EYE, EYE_RADIUS};
use super::shape::{noise, ramp, rod};
use super::subject::{Part, Subject};
use super::trouble::Hair;
use glam::{Vec2, Vec3};

/// Reflectance at a surface point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// Diffuse reflectance per channel.
    pub albedo: Vec3,
    /// Mirror reflectance face-on per channel.
    pub mirror: Vec3,
    /// Width of the highlight: the α of the GGX distribution.
    pub roughness: f32,
    /// Strength of the fibres' sheen at grazing angles.
    pub sheen: f32,
    /// Distance that light of each channel travels below the surface in metres: that of skin, less under hair, 0 for
    /// opaque surfaces.
    pub below: Vec3,
}

/// Diffuse mean free path of skin per channel in metres (Jensen et al., "A Practical Model for
/// Subsurface Light Transport", 2001, table 1, Skin1).
pub const BELOW_SKIN_M: Vec3 = Vec3::new(3.67e-3, 1.37e-3, 0.68e-3);

/// The surface of `part` at place `p` of the stage.
pub fn surface(subject: &Subject, part: Part, p: Vec3, camera: Vec3) -> Surface {
    let q = subject.head_place(p);
    let matte =
        Surface { albedo: Vec3::ZERO, mirror: Vec3::splat(0.04), roughness: 0.5, sheen: 0.0, below: Vec3::ZERO };
    match part {
        Part::Skin => skin(subject, q),
        Part::Eye => {
            let albedo = eye(q, subject.head_place(camera));
            Surface { albedo, roughness: 0.065, mirror: Vec3::splat(0.035), ..matte }
        }
        Part::Tooth => Surface { albedo: Vec3::new(0.62, 0.57, 0.48), roughness: 0.12, ..matte },
        Part::Wrap => Surface { albedo: wrap(q), roughness: 0.33, sheen: 0.10, ..matte },
        Part::Gold => Surface { mirror: Vec3::new(1.0, 0.73, 0.32), roughness: 0.16, ..matte },
        Part::Shirt => {
            let thread = 1.0 + 0.03 * noise(p * Vec3::new(900.0, 300.0, 900.0));
            Surface { albedo: Vec3::new(0.70, 0.665, 0.60) * thread, roughness: 0.6, sheen: 0.03, ..matte }
        }
        Part::Hair => Surface {
            albedo: hair(subject.look.hair, q),
            mirror: Vec3::splat(0.046),
            roughness: 0.30 + 0.06 * noise(q * Vec3::new(500.0, 40.0, 500.0)),
            ..matte
        },
        Part::Glasses => Surface { albedo: Vec3::new(0.020, 0.016, 0.014), roughness: 0.10, ..matte },
        Part::Hand => Surface {
            albedo: complexion(subject.look.skin) * (1.0 + 0.05 * noise(p * 70.0) + 0.04 * noise(p * 190.0)),
            mirror: Vec3::splat(0.028),
            roughness: 0.33,
            below: BELOW_SKIN_M,
            ..matte
        },
        Part::Jacket => Surface { albedo: tweed(p), roughness: 0.75, sheen: 0.06, mirror: Vec3::splat(0.03), ..matte },
    }
}

/// A lens of glasses: it only mirrors.
pub const LENS: Surface =
    Surface { albedo: Vec3::ZERO, mirror: Vec3::splat(0.04), roughness: 0.05, sheen: 0.0, below: Vec3::ZERO };

/// Diffuse reflectance of skin of a tone from 0 (light) to 1 (dark), about the lightest and darkest patches of skin
/// charts; `None` is the stage's own subject.
fn complexion(tone: Option<f32>) -> Vec3 {
    const USUAL: Vec3 = Vec3::new(0.520, 0.305, 0.205);
    const LIGHT: Vec3 = Vec3::new(0.640, 0.430, 0.340);
    const DARK: Vec3 = Vec3::new(0.095, 0.050, 0.033);
    // Pigment absorbs exponentially with thickness, so equal steps are equal ratios.
    tone.map_or(USUAL, |t| LIGHT.powf(1.0 - t) * DARK.powf(t))
}

/// The lips' diffuse reflectance: redder than the skin.
fn lips(tone: Option<f32>) -> Vec3 {
    const USUAL: Vec3 = Vec3::new(0.36, 0.115, 0.105);
    tone.map_or(USUAL, |_| complexion(tone) * Vec3::new(0.72, 0.42, 0.52))
}

/// Strands of hair from root to tip.
fn hair(colour: Option<Hair>, q: Vec3) -> Vec3 {
    let colour = match colour {
        None | Some(Hair::Black) => Vec3::new(0.014, 0.011, 0.010),
        Some(Hair::Brown) => Vec3::new(0.085, 0.047, 0.028),
        Some(Hair::Red) => Vec3::new(0.190, 0.065, 0.025),
        Some(Hair::Blond) => Vec3::new(0.400, 0.270, 0.130),
        Some(Hair::Grey) => Vec3::new(0.330, 0.320, 0.310),
    };
    let strand = noise(q * Vec3::new(700.0, 40.0, 700.0));
    colour * (1.0 + 0.30 * strand + 0.15 * noise(q * Vec3::new(90.0, 12.0, 90.0)))
}

fn skin(subject: &Subject, q: Vec3) -> Surface {
    let s = Vec3::new(q.x.abs(), q.y, q.z);
    let spot = |centre: Vec3, size: f32| (-(s - centre).length_squared() / (size * size)).exp();
    // Blotches, then blood where it is near the surface: cheeks, nose, ears, chin.
    let mottle = 0.05 * noise(q * 70.0) + 0.04 * noise(q * 190.0);
    let blood = 0.85 * spot(Vec3::new(0.043, -0.036, 0.062), 0.020)
        + 0.70 * spot(Vec3::new(0.0, -0.040, 0.106), 0.011)
        + 0.55 * ramp(0.068, 0.082, s.x)
        + 0.25 * spot(Vec3::new(0.0, -0.100, 0.078), 0.014);
    let mut albedo = complexion(subject.look.skin) * (1.0 + mottle);
    albedo *= Vec3::ONE - blood.min(1.0) * Vec3::new(0.02, 0.22, 0.20);
    // Tired, bluish skin about the eyes; freckles over nose and cheeks.
    albedo *= Vec3::ONE - spot(EYE + Vec3::new(-0.002, -0.007, 0.012), 0.013) * Vec3::new(0.20, 0.22, 0.12);
    let freckled = spot(Vec3::new(0.026, -0.026, 0.080), 0.026) * ramp(0.30, 0.62, noise(q * 430.0));
    albedo *= Vec3::ONE - freckled * Vec3::new(0.30, 0.40, 0.45);

    let mut roughness = 0.27 - 0.05 * spot(Vec3::new(0.0, -0.01, 0.09), 0.035) + 0.03 * noise(q * 300.0);
    let on_face = q.z > 0.02;
    let lip = if on_face { subject.head.lip(q) } else { 0.0 };
    albedo = albedo.lerp(lips(subject.look.skin) * (1.0 + 0.10 * noise(q * Vec3::new(900.0, 150.0, 300.0))), 0.9 * lip);
    roughness += (0.15 - roughness) * lip;
    if on_face && subject.head.in_mouth(q) {
        albedo = Vec3::new(0.10, 0.022, 0.02);
    }
    let hair = brow(s).max(lash(subject, s));
    albedo = albedo.lerp(Vec3::new(0.030, 0.019, 0.014), hair);
    let below = BELOW_SKIN_M * (1.0 - hair);
    let (mirror, roughness) = match subject.look.shine {
        Some(shine) => (0.028 * 0.3 * 6.5f32.powf(shine), roughness * 2.2 * 0.2f32.powf(shine)),
        None => (0.028, roughness),
    };
    Surface { albedo, mirror: Vec3::splat(mirror), roughness, sheen: 0.0, below }
}

/// Density of the brow's hair at `s` (+X side), from 0 to 1.
fn brow(s: Vec3) -> f32 {
    if s.z < 0.03 {
        return 0.0;
    }
    let flat = |v: Vec3| Vec3::new(v.x, v.y, 0.0);
    let inner = rod(flat(s), Vec3::new(0.0135, 0.0185, 0.0), Vec3::new(0.034, 0.0240, 0.0), 0.0033, 0.0026);
    let outer = rod(flat(s), Vec3::new(0.034, 0.0240, 0.0), Vec3::new(0.0475, 0.0190, 0.0), 0.0026, 0.0006);
    let strands = 0.0009 * noise(Vec3::new(s.x * 700.0 + s.y * 500.0, s.y * 350.0, 0.0));
    0.88 * (1.0 - ramp(-0.0012, 0.0010, inner.min(outer) + strands))
}

/// Darkness of the lids' rims by the lashes at `s` (+X side), from 0 to 1.
fn lash(subject: &Subject, s: Vec3) -> f32 {
    let e = s - EYE;
    if e.z < 0.004 || e.length() > EYE_RADIUS + 0.004 {
        return 0.0;
    }
    let off = subject.head.lid_edge(s);
    let width = if e.y > -0.001 + 0.11 * e.x { 0.0019 } else { 0.0007 };
    0.95 * (1.0 - ramp(0.4 * width, width, off))
}

/// White, iris and pupil of the eye at `q`, looking half-way between straight ahead and `camera`.
fn eye(q: Vec3, camera: Vec3) -> Vec3 {
    let side = Vec3::new(q.x.signum(), 1.0, 1.0);
    let centre = EYE * side;
    let gaze = (0.45 * Vec3::Z + 0.55 * (camera - centre).normalize()).normalize();
    let outward = (q - centre) / EYE_RADIUS;
    let off = outward.cross(gaze).length();
    let white = Vec3::new(0.66, 0.62, 0.585) * (1.0 - 0.30 * ramp(0.45, 1.0, off));
    if outward.dot(gaze) < 0.0 || off > 0.52 {
        return white;
    }
    let turn = Vec2::new(outward.dot(Vec3::X), outward.dot(Vec3::Y)).to_angle();
    let rays = 0.75 + 0.25 * noise(Vec3::new(9.0 * turn.cos(), 9.0 * turn.sin(), 3.0 * off));
    let iris = Vec3::new(0.145, 0.070, 0.026).lerp(Vec3::new(0.030, 0.018, 0.012), ramp(0.36, 0.47, off)) * rays;
    let pupil = Vec3::splat(0.006);
    pupil.lerp(iris, ramp(0.16, 0.21, off)).lerp(white, ramp(0.45, 0.52, off))
}

/// Printed cloth: ochre with rust and cream bands that follow the pleats, and blue marks.
fn wrap(q: Vec3) -> Vec3 {
    let along = 36.0 * (q.y * 0.80 - 0.60 * q.x + 0.20 * q.z) + 0.25 * noise(q * 20.0);
    let band = (along - along.floor() - 0.5).abs();
    let ochre = Vec3::new(0.56, 0.285, 0.045);
    let rust = Vec3::new(0.33, 0.060, 0.022);
    let cream = Vec3::new(0.66, 0.55, 0.36);
    let cloth = ochre.lerp(rust, ramp(0.30, 0.34, band)).lerp(cream, ramp(0.425, 0.445, band));
    let across = 70.0 * (0.6 * q.y + 0.8 * q.x);
    let mark = Vec2::new(across - across.floor() - 0.5, 3.2 * band).length();
    cloth.lerp(Vec3::new(0.035, 0.060, 0.150), 1.0 - ramp(0.20, 0.28, mark))
}

/// Herringbone: slanting threads that turn in every column.
fn tweed(p: Vec3) -> Vec3 {
    let column = p.x / 0.026;
    let slant = 2.0 * (column - column.floor() - 0.5).abs();
    let thread = (std::f32::consts::TAU * (p.y / 0.0095 + 1.6 * slant)).sin();
    let fleck = ramp(0.55, 0.75, noise(p * 420.0));
    let blue = Vec3::new(0.060, 0.075, 0.135);
    (blue * (1.0 + 0.38 * thread + 0.15 * noise(p * 260.0))).lerp(Vec3::new(0.30, 0.25, 0.20), 0.35 * fleck)
}
