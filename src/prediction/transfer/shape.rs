//! The shape of a pose: normals by photometric stereo, and depth by their integration.

use glam::{DMat3, DVec3, Vec3};
use imaging::{Mask, Raster};
use rayon::prelude::*;

/// Quantiles of a pixel's light between which lamps count: shadows below, glints above.
const SHADOW: f32 = 0.35;
const GLINT: f32 = 0.92;
/// The smallest component of a normal towards the camera that its slope is taken from.
const GRAZING: f32 = 0.25;
/// Steps of the conjugate gradients, and the weight that keeps heights near 0.
const STEPS: usize = 600;
const DAMPING: f64 = 1e-6;

/// Unit normals by photometric stereo (Woodham 1980): least squares over the lamps that neither leave the pixel in shadow nor
/// show in a glint. `olats[pixel · lamps + lamp]` is light under lamps of equal energy; zero where nothing is lit.
pub fn normals(olats: &[f32], directions: &[Vec3]) -> Vec<Vec3> {
    let lamps = directions.len();
    if lamps == 0 {
        return Vec::new();
    }
    let normal = |light: &[f32]| {
        let [shadow, glint] = [SHADOW, GLINT].map(|share| quantile(light.to_vec(), share));
        let (mut a, mut b) = (DMat3::from_diagonal(DVec3::splat(1e-4)), DVec3::ZERO);
        for (&light, direction) in light.iter().zip(directions) {
            if light > shadow && light < glint {
                let d = direction.as_dvec3();
                a += DMat3::from_cols(d * d.x, d * d.y, d * d.z);
                b += d * f64::from(light);
            }
        }
        (a.inverse() * b).normalize_or_zero().as_vec3()
    };
    olats.par_chunks_exact(lamps).map(normal).collect()
}

/// The `share` quantile, linear between two values; 0 if there are none.
pub fn quantile(mut values: Vec<f32>, share: f32) -> f32 {
    let Some(last) = values.len().checked_sub(1) else { return 0.0 };
    let at = share.clamp(0.0, 1.0) * last as f32;
    let (_, below, above) = values.select_nth_unstable_by(at as usize, f32::total_cmp);
    let above = above.iter().copied().min_by(f32::total_cmp).unwrap_or(*below);
    *below + at.fract() * (above - *below)
}

/// Heights towards the camera in pixels, whose slopes are those of the normals in the least-squares sense, where `inside`; 0
/// elsewhere. Each connected part has a mean height near 0. Conjugate gradients on the normal equations.
pub fn depth(normals: &[Vec3], inside: &Raster<bool>) -> Raster<f32> {
    let (width, height) = inside.size();
    let mut index = vec![usize::MAX; width * height];
    let pixels: Vec<usize> = (0..width * height).filter(|&p| inside.pixels[p]).collect();
    for (i, &p) in pixels.iter().enumerate() {
        index[p] = i;
    }
    // Slopes to the right and down; rows count downwards, +y is up.
    let slope = |p: usize| {
        let n = normals[p];
        let z = n.z.max(GRAZING);
        [-n.x / z, n.y / z]
    };
    let mut edges: Vec<[usize; 2]> = Vec::new();
    let mut right = vec![0.0f64; pixels.len()];
    for (i, &p) in pixels.iter().enumerate() {
        for (axis, there) in [(0, (p % width + 1 < width).then_some(p + 1)), (1, Some(p + width))] {
            let Some(&j) = there.and_then(|q| index.get(q)).filter(|&&j| j != usize::MAX) else { continue };
            let rise = 0.5 * f64::from(slope(p)[axis] + slope(pixels[j])[axis]);
            right[j] += rise;
            right[i] -= rise;
            edges.push([i, j]);
        }
    }
    let apply = |x: &[f64], out: &mut [f64]| {
        for (out, x) in out.iter_mut().zip(x) {
            *out = DAMPING * x;
        }
        for &[i, j] in &edges {
            let d = x[j] - x[i];
            out[j] += d;
            out[i] -= d;
        }
    };
    let solved = conjugate_gradients(&right, apply);
    let mut heights = Raster::filled(width, height, 0.0);
    for (&p, z) in pixels.iter().zip(solved) {
        heights.pixels[p] = z as f32;
    }
    heights
}

/// Solves `apply(x) = right` for a positive definite `apply`.
fn conjugate_gradients(right: &[f64], apply: impl Fn(&[f64], &mut [f64])) -> Vec<f64> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut x = vec![0.0; right.len()];
    let mut residual = right.to_vec();
    let mut direction = residual.clone();
    let mut image = vec![0.0; right.len()];
    let mut norm = dot(&residual, &residual);
    let enough = 1e-12 * norm;
    for _ in 0..STEPS {
        if norm <= enough || !norm.is_finite() {
            break;
        }
        apply(&direction, &mut image);
        let step = norm / dot(&direction, &image).max(f64::MIN_POSITIVE);
        for (((x, r), d), i) in x.iter_mut().zip(&mut residual).zip(&direction).zip(&image) {
            *x += step * d;
            *r -= step * i;
        }
        let next = dot(&residual, &residual);
        for (d, r) in direction.iter_mut().zip(&residual) {
            *d = r + next / norm * *d;
        }
        norm = next;
    }
    x
}

/// True where the matte covers more than half a pixel.
pub fn inside(matte: &Mask) -> Raster<bool> {
    matte.map(|coverage| coverage > 0.5)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: usize = 48;

    fn sphere() -> (Vec<Vec3>, Raster<bool>) {
        let inside = Raster::from_fn(SIZE, SIZE, |x, y| at(x, y).length_squared() < 0.8);
        let normals = (0..SIZE * SIZE).map(|p| {
            let v = at(p % SIZE, p / SIZE);
            v + Vec3::Z * (1.0 - v.length_squared()).max(0.0).sqrt()
        });
        (normals.collect(), inside)
    }

    fn at(x: usize, y: usize) -> Vec3 {
        let half = SIZE as f32 / 2.0;
        Vec3::new((x as f32 + 0.5 - half) / half, (half - y as f32 - 0.5) / half, 0.0)
    }

    #[test]
    fn a_sphere_has_its_normals_and_its_depth() {
        let (truth, inside) = sphere();
        let lamps: Vec<Vec3> = (0..24)
            .map(|i| {
                let (angle, height) = (i as f32 * 2.4, 0.3 + 0.65 * i as f32 / 24.0);
                let r = (1.0f32 - height * height).sqrt();
                Vec3::new(r * angle.cos(), r * angle.sin(), height)
            })
            .collect();
        let olats: Vec<f32> =
            truth.iter().flat_map(|n| lamps.iter().map(|l| n.dot(*l).max(0.0)).collect::<Vec<_>>()).collect();
        let found = normals(&olats, &lamps);
        for (p, (found, truth)) in found.iter().zip(&truth).enumerate().filter(|(p, _)| inside.pixels[*p]) {
            assert!(found.dot(*truth) > 0.99, "{p}: {found} {truth}");
        }
        let depth = depth(&truth, &inside);
        let radius = SIZE as f32 / 2.0;
        let height = |x: usize, y: usize| radius * (1.0 - at(x, y).length_squared()).sqrt();
        let offset = depth.at(24, 24) - height(24, 24);
        for (x, y) in [(10, 24), (24, 38), (16, 30), (33, 20)] {
            assert!((depth.at(x, y) - height(x, y) - offset).abs() < 0.25, "{x} {y}");
        }
    }

    #[test]
    fn black_pixels_and_empty_mattes_have_no_shape() {
        assert_eq!(normals(&[0.0; 8], &[Vec3::X, Vec3::Y, Vec3::Z, -Vec3::X]), [Vec3::ZERO; 2]);
        assert!(normals(&[], &[]).is_empty());
        let flat = depth(&[Vec3::ZERO; 6], &Raster::filled(3, 2, true));
        assert!(flat.pixels.iter().all(|z| z.abs() < 1e-6));
        let none = depth(&[Vec3::X; 6], &Raster::filled(3, 2, false));
        assert_eq!(none.pixels, [0.0; 6]);
        assert_eq!(quantile(Vec::new(), 0.5), 0.0);
        assert_eq!(quantile(vec![4.0, 1.0, 2.0], 0.75), 3.0);
    }
}
