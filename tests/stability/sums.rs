//! The sum of lamps: every storage format, in memory and on a GPU, against the sum in f64.

use super::gpu;
use super::noise;
use afterlight::compositor::Field;
use afterlight::imaging::Image;
use afterlight::reflectance::{CompressedField, FieldBuffer, HalfField, ReflectanceField};
use test_support::shown;

const NAMES: [&str; 6] = ["f32", "f16", "components", "f32 on the GPU", "f16 on the GPU", "components on the GPU"];

/// A field in every storage format; the last three are on the GPU.
fn formats(field: &ReflectanceField, compute: &afterlight::gpu::ComputeDevice) -> [Field; 6] {
    let passes = compute.passes().expect("the test was given a GPU");
    let device = &compute.gpu.as_ref().unwrap().device;
    let there = |buffer: FieldBuffer| Field::Gpu(buffer, passes.clone());
    let half = HalfField::from(field);
    let components = CompressedField::new(field, 0.0);
    [
        field.clone().into(),
        half.clone().into(),
        components.clone().into(),
        there(FieldBuffer::upload(field, device)),
        there(FieldBuffer::upload_half(&half, device)),
        there(FieldBuffer::upload_components(components, device)),
    ]
}

/// The sum, Σ of magnitudes, and the product of the norms of weights and values, in f64.
fn exact(field: &ReflectanceField, weights: &[[f32; 3]], pixel: usize, c: usize) -> [f64; 3] {
    let terms = || {
        let planes = (0..field.lamps).map(|l| f64::from(field.plane(l, c)[pixel]));
        planes.zip(weights.iter().map(|w| f64::from(w[c])))
    };
    let values = (0..field.lamps).flat_map(|l| [0, 1, 2].map(|c| field.plane(l, c)[pixel]));
    let values: f64 = values.map(|v| f64::from(v).powi(2)).sum();
    let norm: f64 = terms().map(|(_, w)| w * w).sum();
    [terms().map(|(v, w)| v * w).sum(), terms().map(|(v, w)| (v * w).abs()).sum(), (norm * values).sqrt()]
}

/// Distance of each format from the sum in f64, as a share of its rounding bound.
fn in_bounds(field: &ReflectanceField, weights: &[[f32; 3]], compute: &afterlight::gpu::ComputeDevice) -> [f64; 6] {
    let unit = 0.5 * f64::from(f32::EPSILON);
    let lamps = field.lamps as f64;
    let largest = field.values.iter().fold(0f32, |m, v| m.max(v.abs()));
    let mut used = [0.0f64; 6];
    for ((format, used), kind) in formats(field, compute).iter().zip(&mut used).zip(0..) {
        let relit: Image = format.relight(weights).unwrap();
        assert_eq!(relit.size(), (field.width, field.height));
        for (i, pixel) in relit.pixels.iter().enumerate() {
            for c in 0..3 {
                let [sum, magnitudes, norms] = exact(field, weights, i, c);
                // Values that a GPU may flush to 0: denormals, each times its weight.
                let weight: f64 = weights.iter().map(|w| f64::from(w[c].abs())).sum();
                let flushed = f64::from(f32::MIN_POSITIVE) * (1.0 + weight);
                let bound = flushed
                    + match kind % 3 {
                        // A product and an addition for each lamp.
                        0 => 2.0 * lamps * unit * magnitudes,
                        // Plus each value to 2⁻¹¹, or below the smallest normal half to 2⁻³⁹ of the largest.
                        1 => {
                            (2.0 * lamps * unit + 0.5f64.powi(11)) * magnitudes
                                + 0.5f64.powi(39) * f64::from(largest) * weight
                        }
                        // Basis, components, shares and sum are each rounded, for 3 · lamps values.
                        _ => 4.0 * 3.0 * lamps * unit * norms,
                    };
                let error = (f64::from(pixel[c]) - sum).abs();
                assert!(error <= bound, "{}: {} is not {sum}, bound {bound:e}", NAMES[kind], pixel[c]);
                *used = used.max(error / bound);
            }
        }
    }
    used
}

/// The used shares of the bounds in words.
fn shares(used: [f64; 6]) -> String {
    let used = used.map(|used| 100.0 * used);
    format!(
        "of each bound, in memory and on the GPU: f32 {:.0} % and {:.0} %, f16 {:.0} % and {:.0} %, components {:.0} % and {:.0} %",
        used[0], used[3], used[1], used[4], used[2], used[5]
    )
}

fn most(a: [f64; 6], b: [f64; 6]) -> [f64; 6] {
    std::array::from_fn(|i| a[i].max(b[i]))
}

#[test]
fn pictures_of_any_size_and_any_number_of_lamps_are_summed_alike_everywhere() {
    let Some((compute, _turn)) = gpu() else { return };
    let mut used = [0.0; 6];
    for (size, lamps) in [
        ((1, 1), 1),
        ((1, 1), 41),
        ((1, 13), 3),
        ((13, 1), 3),
        ((17, 31), 5),
        ((61, 47), 41),
        ((64, 1), 2),
        ((65, 63), 7),
    ] {
        let mut weights: Vec<[f32; 3]> = (0..lamps).map(|i| [0.01 * i as f32, 0.3, 1.0 / (1 + i) as f32]).collect();
        weights[lamps / 2] = [1e6, 2e6, 0.5];
        let field = noise(size, lamps);
        used = most(used, in_bounds(&field, &weights, &compute));
    }
    shown!(Pictures, "1 to 41 lamps, one of weight 10⁶, in pictures of 1×1, 1×13, 13×1, 17×31, 61×47 and 65×63",
        bound: "against f64: 2n·2⁻²⁴ of the sum of magnitudes for n lamps; f16 2⁻¹¹ more; components 12n·2⁻²⁴ of the norms",
        measured: shares(used));
}

#[test]
fn values_at_the_ends_of_f16_and_f32_are_summed_without_overflow() {
    let Some((compute, _turn)) = gpu() else { return };
    let mut used = [0.0; 6];
    let plain = noise((9, 7), 5);
    let ends = [
        // Above and below the largest half, and far from either.
        65_504.0, 65_520.0, 1e30, 6e-8, 6e-5, 1e-30, 1e-36,
    ];
    for unit in ends {
        let mut field = plain.clone();
        field.values.iter_mut().for_each(|v| *v *= unit);
        for weight in [1e-4f32, 1.0, 1e6] {
            let weights = [[weight; 3]; 5];
            used = most(used, in_bounds(&field, &weights, &compute));
        }
    }
    // One field with all of it: most halves are denormal, and a GPU may flush f32 denormals to 0.
    let mut field = plain;
    for (value, unit) in field.values.iter_mut().zip(ends.iter().chain(&[1e-40]).cycle()) {
        *value *= unit;
    }
    used = most(used, in_bounds(&field, &[[1.0; 3]; 5], &compute));
    shown!(Pictures, "OLATs of 65,504 and beyond, of 10³⁰, of 10⁻³⁰, and all of these in one, under weights of 10⁻⁴ to 10⁶",
        bound: "as above; below 2⁻²⁹ of the largest value 2⁻³⁹ of that, and 0 is accepted below f32's normal numbers",
        measured: shares(used));
}

#[test]
fn light_is_added_in_any_storage_format() {
    let Some((compute, _turn)) = gpu() else { return };
    use proptest::prelude::*;
    use std::cell::Cell;
    let field = noise((11, 5), 6);
    let formats = formats(&field, &compute);
    let largest = Cell::new(0.0f32);
    let any = || proptest::collection::vec((0f32..10.0).prop_map(|w| [w, 0.5 * w, 0.0]), 6);
    let config = ProptestConfig::with_cases(12);
    proptest!(config, |(one in any(), two in any(), a in 0f32..100.0, b in 0f32..1.0)| {
        let pairs = one.iter().zip(&two);
        let both: Vec<[f32; 3]> = pairs.map(|(v, w)| [0, 1, 2].map(|c| a * v[c] + b * w[c])).collect();
        for format in &formats {
            let [one, two, both] = [&one, &two, &both].map(|w| format.relight(w).unwrap());
            for ((one, two), both) in one.pixels.iter().zip(&two.pixels).zip(&both.pixels) {
                for c in 0..3 {
                    let sum = a * one[c] + b * two[c];
                    // Rounded once in the weights, and in each of three sums of at most 18 components with mixed signs:
                    // relative to the norms, which are at most 18 times the sum of positive terms.
                    let bound = (1.0 + 3.0 * 2.0 * 18.0) * f32::EPSILON * both[c].max(sum);
                    prop_assert!((sum - both[c]).abs() <= bound, "{} is not {}", sum, both[c]);
                    largest.set(largest.get().max((sum - both[c]).abs() / bound.max(f32::MIN_POSITIVE)));
                }
            }
        }
    });
    shown!(Pictures, "a·w₁ + b·w₂ for 12 pairs of weights in six storage formats",
        bound: "1.3e-5 of the value: rounding of 18 components in three sums",
        measured: format!("{:.1e}", largest.get() * 109.0 * f32::EPSILON));
}

#[test]
fn a_field_that_is_nan_infinite_or_black_stays_in_its_pixels() {
    let Some((compute, _turn)) = gpu() else { return };
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut field = noise((9, 7), 4);
        field.values[40] = bad;
        for (format, name) in formats(&field, &compute).iter().zip(NAMES) {
            let relit = format.relight(&[[0.5; 3]; 4]).unwrap();
            let at: Vec<usize> = (0..63).filter(|&i| relit.pixels[i].iter().any(|v| !v.is_finite())).collect();
            assert_eq!(at, [40], "{bad}, {name}");
        }
    }
    let mut black = noise((9, 7), 4);
    black.values.fill(0.0);
    for (format, name) in formats(&black, &compute).iter().zip(NAMES) {
        for weights in [[[1e6; 3]; 4], [[0.0; 3]; 4]] {
            let relit = format.relight(&weights).unwrap();
            assert!(relit.pixels.iter().all(|p| *p == [0.0; 3]), "{name}");
        }
    }
    shown!(Pictures, "NaN or ∞ in one value of a field, and fields that are black, in six storage formats",
        bound: "no other pixel changes; black stays exactly 0", measured: "holds");
}
