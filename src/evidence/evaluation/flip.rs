//! FLIP: visible difference between two pictures that alternate on a screen.
//!
//! LDR-FLIP of Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström and Fairchild, "FLIP: A Difference
//! Evaluator for Alternating Images" (HPG 2020). Numbers in the comments are the paper's sections.

use super::filter::{Kernel, filtered};
use super::metrics::check_pair;
use base::error::{Error, Result};
use imaging::color::linear_from_srgb;
use imaging::{Encoded, Raster};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Pixels per degree of the viewer's field: a 3840-pixel screen, 0.7 m wide, seen from 0.7 m.
pub const PIXELS_PER_DEGREE: f32 = 67.020_64;

/// Pixels per degree at which the filters have a sensible size.
const PIXELS_PER_DEGREE_RANGE: std::ops::RangeInclusive<f32> = 1.0..=1000.0;

/// A difference between two pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct FlipMap {
    /// Each pixel's error, from 0 (equal) to 1 (the largest difference).
    pub error: Raster<f32>,
    /// Mean over all pixels; see [`super::metrics::mean_inside`] for the mean over a subject.
    pub mean: f64,
}

/// Difference between two pictures with sRGB codes. Values are clipped to `[0, 1]`, and NaN counts as 0.
///
/// # Errors
/// When the pictures differ in size or have no pixels, or `pixels_per_degree` is not from 1 to 1000.
pub fn flip(reference: &Encoded, test: &Encoded, pixels_per_degree: f32) -> Result<FlipMap> {
    check_pair(reference, test)?;
    let (width, height) = reference.0.size();
    if !PIXELS_PER_DEGREE_RANGE.contains(&pixels_per_degree) {
        return Err(Error::invalid(
            format!("FLIP cannot be computed for {pixels_per_degree} pixels per degree, only for 1 to 1000"),
            format!("Use {PIXELS_PER_DEGREE:.0}, a screen at arm's length"),
        ));
    }
    let filters = Filters::new(f64::from(pixels_per_degree));
    let (reference, test) = rayon::join(|| filters.seen(reference), || filters.seen(test));
    let most = hyab(hunt(lab([0.0, 1.0, 0.0])), hunt(lab([0.0, 0.0, 1.0]))).powf(COLOR_POWER);
    let pairs = reference.color.par_iter().zip(&test.color);
    let features = reference.features.par_iter().zip(&test.features);
    let pixels: Vec<f32> = (pairs.zip(features))
        .map(|((&a, &b), (&[edge_a, point_a], &[edge_b, point_b]))| {
            let color = spread(hyab(a, b).powf(COLOR_POWER), most);
            // 4.3: the larger of the differences of edges and points.
            let change = (edge_a - edge_b).abs().max((point_a - point_b).abs());
            let feature = (change * std::f32::consts::FRAC_1_SQRT_2).sqrt().min(1.0);
            // 4.4
            color.powf(1.0 - feature)
        })
        .collect();
    let mean = pixels.iter().map(|&e| f64::from(e)).sum::<f64>() / pixels.len() as f64;
    let error = Raster { width, height, pixels };
    Ok(FlipMap { error, mean })
}

/// 4.1.3: power that compresses large colour differences.
const COLOR_POWER: f32 = 0.7;
/// Colour differences below this share of the largest take up this share of the scale.
const SMALL_DIFFERENCES: (f32, f32) = (0.4, 0.95);

/// 4.1.3: maps a colour difference of at most `most` to a scale from 0 to 1.
fn spread(difference: f32, most: f32) -> f32 {
    let (share, scale) = SMALL_DIFFERENCES;
    let knee = share * most;
    let value = if difference < knee {
        scale / knee * difference
    } else {
        scale + (difference - knee) / (most - knee) * (1.0 - scale)
    };
    value.min(1.0)
}

/// A picture as seen by the eye.
struct PerceivedPicture {
    /// L*a*b* after the eye's blur, with Hunt's adjustment.
    color: Vec<[f32; 3]>,
    /// Strength of edges and of points.
    features: Vec<[f32; 2]>,
}

/// Filters for one viewing distance.
struct Filters {
    /// 4.1.1: contrast sensitivity of the achromatic, red–green and blue–yellow channel, as sums of
    /// Gaussians, each with its share.
    contrast: [Vec<(f32, Kernel)>; 3],
    /// 4.2: a Gaussian, its first and its second derivative.
    feature: [Kernel; 3],
}

impl Filters {
    fn new(pixels_per_degree: f64) -> Self {
        // Table 1: amplitude and width of each Gaussian.
        const CONTRAST: [&[(f64, f64)]; 3] = [&[(1.0, 0.0047)], &[(1.0, 0.0053)], &[(34.1, 0.04), (13.5, 0.025)]];
        // Three deviations of the widest.
        let radius = (3.0 * (0.04 / (2.0 * PI * PI)).sqrt() * pixels_per_degree).ceil() as usize;
        let contrast = CONTRAST.map(|gaussians| {
            let deviation = |width: f64| (width / (2.0 * PI * PI)).sqrt() * pixels_per_degree;
            let sums: Vec<f64> = (gaussians.iter())
                .map(|&(amplitude, width)| {
                    let places = (0..=2 * radius).map(|i| i as f64 - radius as f64);
                    let weights = places.map(|x| (-0.5 * (x / deviation(width)).powi(2)).exp());
                    amplitude * (PI / width).sqrt() * weights.sum::<f64>().powi(2)
                })
                .collect();
            let all: f64 = sums.iter().sum();
            (gaussians.iter().zip(&sums))
                .map(|(&(_, width), sum)| {
                    let kernel = Kernel::gaussian(radius, deviation(width));
                    ((sum / all) as f32, kernel)
                })
                .collect()
        });
        // The width of the most visible feature, in degrees.
        let deviation = 0.5 * 0.082 * pixels_per_degree;
        let radius = (3.0 * deviation).ceil() as usize;
        let bell = |x: f64| (-0.5 * (x / deviation).powi(2)).exp();
        let feature = [
            Kernel::gaussian(radius, deviation),
            Kernel::normalized(radius, |x| -x * bell(x)),
            Kernel::normalized(radius, |x| ((x / deviation).powi(2) - 1.0) * bell(x)),
        ];
        Self { contrast, feature }
    }

    fn seen(&self, picture: &Encoded) -> PerceivedPicture {
        let opponent = picture.0.map(|p| ycxcz(p.map(linear_from_srgb)));
        let blurred: Vec<Raster<f32>> = (self.contrast.iter().enumerate())
            .map(|(channel, gaussians)| {
                let plane = opponent.map(|p| p[channel]);
                let mut sum = Raster::filled(plane.width, plane.height, 0.0);
                for (share, kernel) in gaussians {
                    let part = filtered(&plane, kernel, kernel);
                    for (sum, part) in sum.pixels.iter_mut().zip(part.pixels) {
                        *sum += share * part;
                    }
                }
                sum
            })
            .collect();
        let color = (0..opponent.pixels.len())
            .map(|i| {
                let rgb = rgb_from_ycxcz([0, 1, 2].map(|c| blurred[c].pixels[i]));
                hunt(lab(rgb.map(|v| v.clamp(0.0, 1.0))))
            })
            .collect();
        // 4.2: the achromatic channel from 0 to 1.
        let gray = opponent.map(|[y, ..]| (y + 16.0) / 116.0);
        let [flat, edge, point] = &self.feature;
        let strength = |kernel: &Kernel| -> Vec<f32> {
            let across = filtered(&gray, kernel, flat);
            let down = filtered(&gray, flat, kernel);
            let pairs = across.pixels.iter().zip(&down.pixels);
            pairs.map(|(x, y)| x.hypot(*y)).collect()
        };
        let pairs = strength(edge).into_iter().zip(strength(point));
        PerceivedPicture { color, features: pairs.map(|(edge, point)| [edge, point]).collect() }
    }
}

/// CIE XYZ of the sRGB primaries and white (D65), to the authors' digits.
const RED: [f32; 3] = [0.412_386_56, 0.212_636_82, 0.019_330_62];
const GREEN: [f32; 3] = [0.357_591_5, 0.715_183, 0.119_197_16];
const BLUE: [f32; 3] = [0.180_450_5, 0.072_180_2, 0.950_372_6];
const WHITE: [f32; 3] = [0.950_428_55, 1.0, 1.088_900_4];

/// XYZ relative to white.
fn relative_xyz(linear: [f32; 3]) -> [f32; 3] {
    let [r, g, b] = linear;
    std::array::from_fn(|i| (r * RED[i] + g * GREEN[i] + b * BLUE[i]) / WHITE[i])
}

/// 4.1.1: an opponent space that is linear in light.
fn ycxcz(linear: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = relative_xyz(linear);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

fn rgb_from_ycxcz([y, cx, cz]: [f32; 3]) -> [f32; 3] {
    let y = (y + 16.0) / 116.0;
    let [x, y, z] = [(y + cx / 500.0) * WHITE[0], y * WHITE[1], (y - cz / 200.0) * WHITE[2]];
    // The inverse of the primaries above.
    [
        3.241_003_3 * x - 1.537_399 * y - 0.498_615_9 * z,
        -0.969_224_3 * x + 1.875_93 * y + 0.041_554_2 * z,
        0.055_639_4 * x - 0.204_011_2 * y + 1.057_148_9 * z,
    ]
}

/// CIE 1976 L*a*b*.
fn lab(linear: [f32; 3]) -> [f32; 3] {
    const DELTA: f32 = 6.0 / 29.0;
    let root = |v: f32| {
        if v > DELTA.powi(3) { v.cbrt() } else { v / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
    };
    let [x, y, z] = relative_xyz(linear).map(root);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// 4.1.2: Hunt's adjustment: colours look less saturated in the dark.
fn hunt([l, a, b]: [f32; 3]) -> [f32; 3] {
    [l, 0.01 * l * a, 0.01 * l * b]
}

/// 4.1.3: HyAB, a distance for large differences.
fn hyab([l, a, b]: [f32; 3], [l2, a2, b2]: [f32; 3]) -> f32 {
    (l - l2).abs() + (a - a2).hypot(b - b2)
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::metrics::mean_inside;
    use super::*;
    use imaging::Mask;
    use std::process::Command;

    /// 8-bit codes that are the same in every program.
    pub fn pattern(width: usize, height: usize, seed: u64) -> Encoded {
        let code = |x: usize, y: usize, c: usize| {
            let place = (x as u64 / 3) * 7 + (y as u64 / 2) * 131 + c as u64 * 29 + seed * 977;
            ((place * 2_654_435_761) >> 13) % 256
        };
        Encoded(Raster::from_fn(width, height, |x, y| std::array::from_fn(|c| code(x, y, c) as f32 / 255.0)))
    }

    fn map(reference: &Encoded, test: &Encoded) -> FlipMap {
        flip(reference, test, PIXELS_PER_DEGREE).unwrap()
    }

    #[test]
    fn equal_pictures_do_not_differ_and_nothing_exceeds_one() {
        let a = pattern(40, 30, 1);
        assert_eq!(map(&a, &a).mean, 0.0);
        let [black, white] = [0.0, 1.0].map(|v| Encoded(Raster::filled(9, 9, [v; 3])));
        let far = map(&black, &white);
        assert!(far.error.pixels.iter().all(|e| (0.9..=1.0).contains(e)));
    }

    #[test]
    fn what_cannot_be_compared_is_refused_and_broken_values_are_clipped() {
        let a = pattern(8, 8, 1);
        assert!(flip(&a, &pattern(8, 7, 1), 67.0).is_err());
        let empty = Encoded(Raster::filled(0, 0, [0.0; 3]));
        assert!(flip(&empty, &empty, 67.0).is_err());
        for wrong in [0.0, -3.0, f32::NAN, f32::INFINITY] {
            assert!(flip(&a, &a, wrong).is_err(), "{wrong}");
        }
        let broken = Encoded(Raster::filled(8, 8, [f32::NAN, f32::INFINITY, -1.0]));
        let clipped = Encoded(Raster::filled(8, 8, [0.0, 1.0, 0.0]));
        assert_eq!(map(&a, &broken), map(&a, &clipped));
    }

    #[test]
    fn only_the_subject_counts_inside_a_matte() {
        let mut test = pattern(24, 10, 1);
        for y in 0..10 {
            test.0.pixels[y * 24 + 23] = [1.0; 3];
        }
        let found = map(&pattern(24, 10, 1), &test);
        let left: Mask = Raster::from_fn(24, 10, |x, _| if x < 8 { 1.0 } else { 0.5 });
        assert!(found.mean > 0.0);
        assert_eq!(mean_inside(&found.error, &left).unwrap(), 0.0);
        assert!(mean_inside(&found.error, &Mask::filled(24, 10, 0.5)).is_err());
        assert!(mean_inside(&found.error, &Mask::filled(9, 10, 1.0)).is_err());
    }

    /// Figures of the authors' package `flip_evaluator` 1.7 for these pictures.
    #[test]
    fn errors_are_those_of_the_authors_program() {
        let even = |[r, g, b]: [f32; 3]| Encoded(Raster::filled(16, 16, [r, g, b]));
        let gray = |v: f32| even([v; 3]);
        let [a, b] = [1, 2].map(|seed| pattern(48, 32, seed));
        let darker = Encoded(a.0.map(|p| p.map(|v| 0.9 * v)));
        let [red, blue] = [even([1.0, 0.0, 0.0]), even([0.0, 0.0, 1.0])];
        let cases = [
            (&a, &b, 67.020_64, 0.878_227, [0.974_05, 0.955_55, 0.772_66]),
            (&a, &b, 20.0, 0.916_747, [0.972_24, 0.975_29, 0.797_38]),
            (&a, &darker, 67.020_64, 0.350_433, [0.296_54, 0.398_67, 0.317_79]),
            (&gray(0.2), &gray(0.25), 67.020_64, 0.195_452, [0.195_45; 3]),
            (&gray(0.0), &gray(1.0), 67.020_64, 0.967_388, [0.967_39; 3]),
            (&red, &blue, 67.020_64, 0.965_081, [0.965_08; 3]),
        ];
        for (reference, test, pixels_per_degree, mean, pixels) in cases {
            let found = flip(reference, test, pixels_per_degree).unwrap();
            assert!((found.mean - mean).abs() < 1e-5, "{}", found.mean);
            let (width, height) = found.error.size();
            let places = [(0, 0), (width / 2, height / 2), (width - 1, height / 3)];
            for ((x, y), wanted) in places.into_iter().zip(pixels) {
                let error = found.error.at(x, y);
                assert!((error - wanted).abs() < 1e-5, "({x}, {y}): {error}");
            }
        }
    }

    #[test]
    fn whole_maps_are_those_of_the_authors_program() {
        let Some(python) = test_support::python(&["flip_evaluator"]) else { return };
        let script = test_support::repository("tests/peers/flip.py");
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(name);
        for (width, height, pixels_per_degree) in [(61, 40, 67.0), (33, 70, 20.0), (128, 9, 120.0)] {
            let pictures = [1, 2].map(|seed| pattern(width, height, seed));
            let names = ["reference.png", "test.png"];
            for (picture, name) in pictures.iter().zip(names) {
                imaging::file::write_png(&file(name), picture).unwrap();
            }
            let mut peer = Command::new(&python);
            peer.arg(&script).args(names.map(file)).arg(file("map.f32"));
            peer.arg(pixels_per_degree.to_string());
            assert!(peer.status().unwrap().success());
            let theirs = std::fs::read(file("map.f32")).unwrap();
            let found = flip(&pictures[0], &pictures[1], pixels_per_degree).unwrap();
            assert_eq!(theirs.len(), 4 * width * height);
            let far = (theirs.chunks_exact(4).zip(&found.error.pixels))
                .map(|(b, e)| (f32::from_le_bytes([b[0], b[1], b[2], b[3]]) - e).abs())
                .fold(0.0, f32::max);
            println!("{width} × {height} at {pixels_per_degree}: within {far:.1e}");
            assert!(far < 1e-5, "{far}");
        }
    }
}
