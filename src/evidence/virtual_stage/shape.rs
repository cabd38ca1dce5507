//! Solid shapes as signed distances in metres: negative inside, positive outside. The primitives and
//! blends are those of I. Quilez, "Distance functions" and "Smooth minimum".

use glam::{Vec2, Vec3};
pub use light::built_in::pattern::{noise, ramp};

/// A ball about the origin.
pub fn ball(p: Vec3, radius: f32) -> f32 {
    p.length() - radius
}

/// An ellipsoid about the origin; exact on its surface, a bound elsewhere.
pub fn ellipsoid(p: Vec3, radii: Vec3) -> f32 {
    let k0 = (p / radii).length();
    let k1 = (p / (radii * radii)).length();
    // At the very centre both lengths vanish; the distance there is the smallest radius.
    if k1 < 1e-6 { -radii.min_element() } else { k0 * (k0 - 1.0) / k1 }
}

/// A rod from `a` to `b` whose radius changes from `radius_a` to `radius_b`.
pub fn rod(p: Vec3, a: Vec3, b: Vec3, radius_a: f32, radius_b: f32) -> f32 {
    let (pa, ba) = (p - a, b - a);
    let along = (pa.dot(ba) / ba.length_squared()).clamp(0.0, 1.0);
    (pa - ba * along).length() - (radius_a + (radius_b - radius_a) * along)
}

/// A ring about the Y axis.
pub fn ring(p: Vec3, radius: f32, thickness: f32) -> f32 {
    Vec2::new(p.x.hypot(p.z) - radius, p.y).length() - thickness
}

/// An almond in a plane: between two arcs that meet at (±`half_width`, 0) and pass through (0, `up`) and (0, −`down`).
pub fn almond(p: Vec2, half_width: f32, up: f32, down: f32) -> f32 {
    let arc = |height: f32, y: f32| {
        let radius = (half_width * half_width + height * height) / (2.0 * height);
        p.x.hypot(y - (height - radius)) - radius
    };
    arc(up, p.y).max(arc(down, -p.y))
}

/// Union of two shapes, with a fillet about `k` metres wide where they meet.
pub fn join(a: f32, b: f32, k: f32) -> f32 {
    let h = (k - (a - b).abs()).max(0.0) / k;
    a.min(b) - h * h * k * 0.25
}

/// The first shape minus the second, with an edge rounded over about `k` metres.
pub fn cut(a: f32, b: f32, k: f32) -> f32 {
    -join(-a, b, k)
}

/// Intersection of two shapes, with an edge rounded over about `k` metres.
pub fn common(a: f32, b: f32, k: f32) -> f32 {
    -join(-a, -b, k)
}
