//! Tests of compressed fields: preserved detail, and difficult fields.

use super::*;

fn field(size: usize, lamps: usize, value: impl Fn(usize) -> f32) -> ReflectanceField {
    ReflectanceField { width: size, height: size, lamps, values: (0..size * size * 3 * lamps).map(value).collect() }
}

fn noise(i: usize) -> f32 {
    (i.wrapping_mul(2_654_435_761) >> 8 & 0xffff) as f32 / 65536.0
}

/// A lobe for each lamp over the picture, so that neighbouring lamps resemble each other.
fn lobes(size: usize, lamps: usize) -> ReflectanceField {
    field(size, lamps, |i| {
        let (pixel, plane) = (i % (size * size), i / (size * size));
        let angle = (pixel % size) as f32 / size as f32 - (plane / 3) as f32 / lamps as f32;
        let tint = [1.0, 0.7, 0.5][plane % 3];
        tint * (-20.0 * angle * angle).exp() * (1.0 + (pixel / size) as f32 / size as f32)
    })
}

/// Reconstruction of the field, summed in f64.
fn expanded(compressed: &CompressedField) -> Vec<f32> {
    let pixels = compressed.width * compressed.height;
    let value = |i: usize| {
        let terms = compressed
            .basis
            .iter()
            .enumerate()
            .map(|(k, component)| f64::from(component[i / pixels]) * f64::from(compressed.plane(k)[i % pixels]));
        terms.sum::<f64>() as f32
    };
    (0..3 * compressed.lamps * pixels).map(value).collect()
}

fn relative_error(kept: &[f32], values: &[f32]) -> f64 {
    let square = |v: f32| f64::from(v) * f64::from(v);
    let error: f64 = kept.iter().zip(values).map(|(a, b)| square(a - b)).sum();
    (error / values.iter().map(|&v| square(v)).sum::<f64>()).sqrt()
}

#[test]
fn all_components_are_the_field() {
    let field = field(37, 6, noise);
    let basis = LampBasis::from_fields(&[&field]).unwrap();
    let compressed = basis.compress(&field, 18).unwrap();
    assert!(relative_error(&expanded(&compressed), &field.values) < 1e-6);
}

#[test]
fn each_component_takes_error_away_and_the_basis_knows_how_much() {
    let field = lobes(24, 9);
    let basis = LampBasis::from_fields(&[&field]).unwrap();
    let mut before = f64::INFINITY;
    for count in 0..=27 {
        let kept = expanded(&basis.compress(&field, count).unwrap());
        let error = relative_error(&kept, &field.values);
        // Planes are f32.
        assert!(error <= before + 1e-6, "{count}: {error} after {before}");
        assert!((error - basis.error(count)).abs() < 1e-6);
        before = error;
    }
    assert!(before < 1e-6 && basis.error(0) == 1.0);
}

#[test]
fn the_wanted_error_is_kept_with_the_fewest_components() {
    let field = lobes(24, 9);
    let basis = LampBasis::from_fields(&[&field]).unwrap();
    for wanted in [0.3, 0.1, 0.01, 1e-3] {
        let compressed = CompressedField::new(&field, wanted);
        let count = compressed.basis.len();
        assert_eq!(count, basis.components_for(wanted));
        assert!(relative_error(&expanded(&compressed), &field.values) <= wanted + 1e-6);
        assert!(basis.error(count - 1) > wanted);
    }
    assert!(CompressedField::new(&field, 0.01).bytes() < 4 * field.values.len() / 2);
}

#[test]
fn a_basis_of_several_frames_serves_each_of_them() {
    let frames = [lobes(16, 7), field(16, 7, noise)];
    let basis = LampBasis::from_fields(&[&frames[0], &frames[1]]).unwrap();
    for frame in &frames {
        let kept = basis.compress(frame, basis.len()).unwrap();
        assert!(relative_error(&expanded(&kept), &frame.values) < 1e-6);
    }
    assert!(LampBasis::from_fields(&[&frames[0], &lobes(16, 6)]).is_none());
    assert!(LampBasis::from_fields(&[]).is_none());
    assert!(basis.compress(&lobes(16, 6), 3).is_none());
}

#[test]
fn equal_lamps_are_one_component_and_black_needs_none() {
    let equal = field(20, 41, |i| noise(i % 400));
    let compressed = CompressedField::new(&equal, 1e-4);
    assert_eq!(compressed.basis.len(), 1);
    assert!(relative_error(&expanded(&compressed), &equal.values) < 1e-6);
    let black = CompressedField::new(&field(20, 41, |_| 0.0), 0.01);
    assert!(black.basis.is_empty() && black.planes.is_empty());
    assert!(expanded(&black).iter().all(|&v| v == 0.0));
    for empty in [field(0, 3, noise), field(4, 0, noise)] {
        assert!(CompressedField::new(&empty, 0.01).planes.is_empty());
    }
    let one = field(1, 41, noise);
    let compressed = CompressedField::new(&one, 1e-5);
    assert!(relative_error(&expanded(&compressed), &one.values) < 1e-5);
    test_support::shown!(Pictures, "Components of lamps that are all alike, and of black",
 bound: "one component; none", measured: "one; none");
}

#[test]
fn suns_denormals_and_what_is_no_number_leave_the_rest_finite() {
    let mut hard = field(9, 4, noise);
    hard.values[3] = 1e6;
    hard.values[100] = 1e-42;
    hard.values[5] = f32::NAN;
    hard.values[2 * 81 + 7] = f32::INFINITY;
    let basis = LampBasis::from_fields(&[&hard]).unwrap();
    assert!(basis.error(1) < 0.01, "the sun is the first component");
    let compressed = basis.compress(&hard, 12).unwrap();
    let bad = |i: &usize| (0..12).any(|k| !compressed.plane(k)[*i].is_finite());
    assert_eq!((0..81).filter(bad).collect::<Vec<_>>(), [5, 7]);
    for unit in [1e-30, 1e30] {
        let scaled = field(9, 4, |i| unit * noise(i));
        let kept = expanded(&CompressedField::new(&scaled, 1e-5));
        let ratio = |v: &f32| v / unit;
        let kept: Vec<f32> = kept.iter().map(ratio).collect();
        let values: Vec<f32> = scaled.values.iter().map(ratio).collect();
        assert!(relative_error(&kept, &values) < 1e-4);
    }
    test_support::shown!(Pictures, "Components of a field with a sun of 10⁶, a denormal, NaN and ∞; in units of 10⁻³⁰ and 10³⁰",
 bound: "no other pixel is touched; 1e-4 of the root mean square in any unit", measured: "holds");
}
