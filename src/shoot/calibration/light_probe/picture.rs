//! Ray-traced pictures of mirror balls in analytic surroundings, as ground truth for tests. Shares no formula with
//! the unwrapping.

use super::BallView;
use glam::DVec3;
use imaging::Image;
use rayon::prelude::*;

/// A photograph of `size × size` pixels of a ball in surroundings with an analytic radiance; black outside the
/// ball. `RAYS²` rays per pixel.
pub(super) fn photographed(
    view: &BallView,
    size: (usize, usize),
    radiance: impl Fn(DVec3) -> [f32; 3] + Sync,
) -> Image {
    const RAYS: usize = 4;
    let distance = view.camera.distance_radii(view.radius_px).min(1e7);
    let camera = DVec3::new(0.0, 0.0, distance);
    // The outermost ray touches the ball: its tangent times the focal length is the radius.
    let focal = view.radius_px * (distance * distance - 1.0).sqrt();
    let ray = |x: f64, y: f64| -> Option<[f32; 3]> {
        let direction = DVec3::new(x - view.centre_px[0], view.centre_px[1] - y, -focal).normalize();
        let along = -camera.dot(direction);
        let nearest = camera + along * direction;
        let inside = 1.0 - nearest.length_squared();
        if inside < 0.0 {
            return None;
        }
        let hit = nearest - inside.sqrt() * direction;
        let away = direction - 2.0 * direction.dot(hit) * hit;
        let seen = match view.surroundings_radii {
            None => away,
            Some(dome) => {
                let b = hit.dot(away);
                let t = (b * b + dome * dome - hit.length_squared()).sqrt() - b;
                (hit + t * away).normalize()
            }
        };
        let light = radiance(seen);
        Some([0, 1, 2].map(|c| light[c] * view.reflectivity[c]))
    };
    let pixel = |i: usize| {
        let mut sum = [0.0f32; 3];
        for sub in 0..RAYS * RAYS {
            let at = |p: usize, sub: usize| p as f64 + (sub as f64 + 0.5) / RAYS as f64;
            let place = (at(i % size.0, sub % RAYS), at(i / size.0, sub / RAYS));
            if let Some(light) = ray(place.0, place.1) {
                sum = [0, 1, 2].map(|c| sum[c] + light[c]);
            }
        }
        sum.map(|v| v / (RAYS * RAYS) as f32)
    };
    Image { width: size.0, height: size.1, pixels: (0..size.0 * size.1).into_par_iter().map(pixel).collect() }
}
