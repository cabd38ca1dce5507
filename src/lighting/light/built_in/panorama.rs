//! Panorama of a radiance that depends on the direction.

use crate::latlong::direction_from_uv;
use glam::Vec3;
use imaging::{Image, Raster};
use rayon::prelude::*;

/// A panorama whose texels are means over a square grid of rays.
pub(super) fn panorama(width: usize, radiance: impl Fn(Vec3) -> Vec3 + Sync) -> Image {
    let width = width.max(2);
    let height = width / 2;
    // Window panes need several rays in large texels; two rays smooth edges in small ones.
    let rays = (2560 / width).clamp(2, 5);
    let pixels = (0..width * height)
        .into_par_iter()
        .map(|i| {
            let mut sum = Vec3::ZERO;
            for ray in 0..rays * rays {
                let u = ((i % width) as f32 + ((ray % rays) as f32 + 0.5) / rays as f32) / width as f32;
                let v = ((i / width) as f32 + ((ray / rays) as f32 + 0.5) / rays as f32) / height as f32;
                sum += radiance(direction_from_uv(u, v));
            }
            (sum / (rays * rays) as f32).to_array()
        })
        .collect();
    Raster { width, height, pixels }
}
