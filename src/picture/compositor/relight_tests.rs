//! Tests of the sum of lamps on the CPU.

use super::*;

/// A field of `lamps` lamps with pseudo-random values in [0, 1).
pub fn noise_field(width: usize, height: usize, lamps: usize) -> ReflectanceField {
    let value = |i: usize| (i.wrapping_mul(2_654_435_761) >> 8 & 0xffff) as f32 / 65536.0;
    let values = (0..lamps * 3 * width * height).map(value).collect();
    ReflectanceField { width, height, lamps, values }
}

fn all(weights: &[[f32; 3]]) -> Vec<usize> {
    (0..weights.len()).collect()
}

/// The largest difference relative to the sum of magnitudes, which bounds the error of f32.
fn relative(a: &Image, b: &Image, largest: f32) -> f32 {
    let pairs = a.pixels.iter().flatten().zip(b.pixels.iter().flatten());
    pairs.map(|(x, y)| (x - y).abs()).fold(0.0, f32::max) / largest
}

#[test]
fn the_sum_agrees_with_one_in_double_precision() {
    let field = noise_field(61, 47, 41);
    let mut weights: Vec<_> = (0..41).map(|i| [0.01 * i as f32, 0.3, 1.0 / (1 + i) as f32]).collect();
    weights[17] = [1e6, 2e6, 3e6];
    let relit = relight(&field, &weights, &all(&weights));
    for (i, pixel) in relit.pixels.iter().enumerate() {
        for c in 0..3 {
            let exact: f64 = (0..41).map(|l| f64::from(weights[l][c]) * f64::from(field.plane(l, c)[i])).sum();
            // 41 additions, each rounded to half a unit of 2⁻²³.
            assert!((f64::from(pixel[c]) - exact).abs() <= 41.0 * 6e-8 * exact);
        }
    }
    test_support::shown!(Pictures, "41 lamps, one of weight 2·10⁶",
 bound: "beside f64: 41·2⁻²⁴ of the sum", measured: "holds");
}

#[test]
fn relighting_is_linear_in_the_light() {
    let field = noise_field(33, 65, 7);
    let (a, b) = (vec![[0.5, 0.25, 2.0]; 7], vec![[3.0, 0.0, 0.125]; 7]);
    let both: Vec<[f32; 3]> = a.iter().zip(&b).map(|(a, b)| std::array::from_fn(|c| a[c] + b[c])).collect();
    let mut sum = relight(&field, &a, &all(&a));
    for (s, p) in sum.pixels.iter_mut().zip(relight(&field, &b, &all(&b)).pixels) {
        (0..3).for_each(|c| s[c] += p[c]);
    }
    assert!(relative(&sum, &relight(&field, &both, &all(&both)), 7.0 * 3.5) < 1e-6);
}

#[test]
fn lamps_without_energy_may_be_skipped() {
    let mut field = noise_field(16, 16, 5);
    let weights = [[1.0; 3], [0.0; 3], [0.0, 0.5, 0.0], [0.0; 3], [2.0; 3]];
    let lit = lit_lamps(&weights);
    assert_eq!(lit, [0, 2, 4]);
    assert_eq!(relight(&field, &weights, &lit), relight(&field, &weights, &all(&weights)));
    field.values[3 * 256..6 * 256].fill(f32::NAN);
    assert!(relight(&field, &weights, &lit).pixels.iter().flatten().all(|v| v.is_finite()));
    assert!(relight(&field, &[[0.0; 3]; 5], &[]).pixels.iter().all(|&p| p == [0.0; 3]));
}

/// The weights of a sun among weak lamps and dark ones.
fn sunny(lamps: usize) -> Vec<[f32; 3]> {
    let mut weights: Vec<_> = (0..lamps).map(|i| [0.01 * i as f32, 0.3, 1.0 / (1 + i) as f32]).collect();
    weights[lamps / 2] = [1e6, 2e6, 0.0];
    weights
}

#[test]
fn halves_are_summed_exactly_as_f32_would_be() {
    for (width, height, lamps) in [(1, 1, 1), (61, 47, 41), (64, 3, 9)] {
        let half = HalfField::from(&noise_field(width, height, lamps));
        let weights = sunny(lamps);
        let (here, there) =
            (relight_half(&half, &weights, &all(&weights)), relight(&half.widened(), &weights, &all(&weights)));
        // Both add in one order, and the scale is a power of two.
        assert_eq!(here, there);
    }
}

#[test]
fn half_a_field_gives_the_picture_within_half_a_unit_of_eleven_bits() {
    let field = noise_field(61, 47, 41);
    let weights = sunny(41);
    let half = relight_half(&HalfField::from(&field), &weights, &all(&weights));
    let full = relight(&field, &weights, &all(&weights));
    let pairs = half.pixels.iter().flatten().zip(full.pixels.iter().flatten());
    for (half, full) in pairs {
        // 2⁻¹¹ from the format; values and weights are positive. Plus the rounding of 41 additions.
        assert!((half - full).abs() <= (0.5f32.powi(11) + 41.0 * 1.2e-7) * full);
    }
}

#[test]
fn halves_keep_black_lamps_bad_values_and_nothing_apart() {
    let mut field = noise_field(9, 9, 3);
    field.values[40] = f32::NAN;
    field.values[7] = f32::INFINITY;
    // The second lamp is invalid throughout, and dark.
    field.values[3 * 81..6 * 81].fill(f32::NAN);
    let half = HalfField::from(&field);
    let weights = [[1.0; 3], [0.0; 3], [1e6; 3]];
    let relit = relight_half(&half, &weights, &lit_lamps(&weights));
    let bad = |i: &usize| relit.pixels[*i].iter().any(|v| !v.is_finite());
    assert_eq!((0..81).filter(bad).collect::<Vec<_>>(), [7, 40]);
    let dark = relight_half(&half, &[[0.0; 3]; 3], &[]);
    assert!(dark.pixels.iter().all(|&p| p == [0.0; 3]));
    let nothing = HalfField::from(&noise_field(0, 0, 3));
    assert!(relight_half(&nothing, &weights, &all(&weights)).pixels.is_empty());
}

#[test]
fn the_light_of_a_halved_field_is_linear() {
    let half = HalfField::from(&noise_field(33, 5, 7));
    let sum = |weight: f32| {
        let weights = vec![[weight, 2.0 * weight, 0.25]; 7];
        relight_half(&half, &weights, &all(&weights))
    };
    for ((a, b), both) in (sum(0.5).pixels.iter()).zip(&sum(1.5).pixels).zip(&sum(2.0).pixels) {
        (0..2).for_each(|c| assert!((a[c] + b[c] - both[c]).abs() <= 1e-6 * both[c]));
    }
}

#[test]
fn all_components_of_a_field_give_its_pictures() {
    let field = noise_field(71, 61, 5);
    let compressed = CompressedField::new(&field, 0.0);
    let weights = [[1e4, 0.0, 2.0], [0.0; 3], [1.0; 3], [0.5; 3], [0.0, 3.0, 0.0]];
    let here = relight_compressed(&compressed, &weights);
    let full = relight(&field, &weights, &all(&weights));
    // Per channel, relative to the brightest pixel.
    for c in 0..3 {
        let largest = full.pixels.iter().map(|p| p[c]).fold(0.0, f32::max);
        for (here, full) in here.pixels.iter().zip(&full.pixels) {
            assert!((here[c] - full[c]).abs() <= 1e-5 * largest, "{here:?} {full:?}");
        }
    }
    let dark = relight_compressed(&compressed, &[[0.0; 3]; 5]);
    assert!(dark.pixels.iter().all(|&p| p == [0.0; 3]));
}
