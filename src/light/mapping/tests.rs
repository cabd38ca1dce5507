use super::*;
use crate::light::latlong;
use proptest::prelude::*;
use std::f64::consts::PI;

/// A small picture of each mapping.
fn small(mapping: Mapping) -> (usize, usize) {
    mapping.size(24)
}

/// A smooth sky of many colours.
fn sky(d: DVec3) -> [f32; 3] {
    let wave = |a: DVec3, k: f64| 1.0 + 0.8 * (k * d.dot(a)).sin() * (0.7 * k * d.cross(a).x).cos();
    [
        wave(DVec3::new(0.3, 0.8, 0.5).normalize(), 3.0),
        wave(DVec3::new(-0.7, 0.2, 0.6).normalize(), 4.0),
        wave(DVec3::new(0.1, -0.4, 0.9).normalize(), 2.0),
    ]
    .map(|v| v as f32)
}

/// The sky in a mapping, by the mean of many rays in each pixel.
fn painted(mapping: Mapping, size: (usize, usize)) -> Image {
    const RAYS: usize = 6;
    Image::from_fn(size.0, size.1, |x, y| {
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for ray in 0..RAYS * RAYS {
            let at = |p: usize, r: usize, size: usize| {
                (p as f64 + (r as f64 + 0.5) / RAYS as f64) / size as f64
            };
            if let Some(d) =
                mapping.direction(at(x, ray % RAYS, size.0), at(y, ray / RAYS, size.1))
            {
                sum = [0, 1, 2].map(|c| sum[c] + sky(d)[c]);
                count += 1.0;
            }
        }
        sum.map(|v| if count > 0.0 { v / count } else { 0.0 })
    })
}

fn psnr(a: &Image, b: &Image, mask: &[f64]) -> f64 {
    let (mut error, mut count, mut peak) = (0.0f64, 0.0f64, 0.0f64);
    for ((a, b), m) in a.pixels.iter().zip(&b.pixels).zip(mask).filter(|(_, m)| **m > 0.0) {
        for (a, b) in a.iter().zip(b) {
            error += m * f64::from(a - b).powi(2);
            count += m;
            peak = peak.max(f64::from(*b));
        }
    }
    10.0 * (peak * peak * count / error).log10()
}

#[test]
fn zz_numbers() {
    for from in &Mapping::ALL[..4] {
        for to in &Mapping::ALL[..4] {
            let (from, to) = (*from, *to);
            for (h, g) in [(128, 128), (256, 64), (64, 256)] {
                let size = from.size(h);
                let picture = painted(from, size);
                let start = std::time::Instant::now();
                let converted = convert(&picture, from, to, to.size(g)).unwrap();
                let took = start.elapsed().as_secs_f64();
                let truth = painted(to, to.size(g));
                let cover = to.projection(to.size(g)).unwrap().solid_angles();
                let (a, b) = (from.energy(&picture).unwrap(), to.energy(&converted.image).unwrap());
                eprintln!(
                    "{from:?}{size:?} → {to:?}{:?}: psnr {:.1} energy {:.1e} {took:.2}s",
                    to.size(g),
                    psnr(&converted.image, &truth, &cover),
                    (b[0] / a[0] - 1.0).abs()
                );
            }
        }
    }
}
