//! Gradients of our own operations against central differences, both in f64: the renderer, the encoding, the
//! norm, the mask, and the losses as a whole. Kernels for f32 are compared with the same operations
//! elsewhere.

use super::loss::Criterion;
use burn::tensor::{DType, Device, Tensor, TensorData};
use reflectance::Formulation;
use reflectance::kernels::{LossInputs, LossSettings};
use reflectance::render::{encode, light, olats, relight};

/// Step of the central differences, as a share of the value. Their error grows with its square over that of
/// the scale on which the slope changes, rounding with 1e-16 over it.
const STEP: f64 = 1e-5;
/// The same near zero error, where the norm's slope changes within [`EPSILON`](super::features::EPSILON).
const FINE: f64 = 2e-8;

fn tensor<const D: usize>(values: &[f64], shape: [usize; D]) -> Tensor<D> {
    let device = Device::flex().autodiff();
    Tensor::from_data(TensorData::new(values.to_vec(), shape), (&device, DType::F64))
}

/// Pseudo-random values in `[0, 1)`.
fn noise(count: usize, seed: u64) -> Vec<f64> {
    let value = |i: u64| {
        let mixed = (i + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ seed.wrapping_mul(0xD6E8_FEB8_6659_FD93);
        (mixed.wrapping_mul(0xFF51_AFD7_ED55_8CCD) >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..count as u64).map(value).collect()
}

/// Compares every partial derivative of `f` at `x` with its central difference.
fn check(name: &str, step: f64, x: &[f64], shape: [usize; 4], f: impl Fn(Tensor<4>) -> Tensor<1>) {
    let value = |x: &[f64]| f(tensor(x, shape)).into_scalar::<f64>();
    let variable = tensor(x, shape).require_grad();
    let gradients = f(variable.clone()).backward();
    let gradient = variable.grad(&gradients).unwrap().into_data();
    let gradient = gradient.try_to_vec::<f64>().unwrap();
    let largest = gradient.iter().fold(0.0f64, |m, g| m.max(g.abs()));
    assert!(largest > 0.0, "{name}: no gradient at all");
    for i in 0..x.len() {
        let mut there = x.to_vec();
        let step = step * x[i].abs().max(1e-3);
        there[i] = x[i] + step;
        let above = value(&there);
        there[i] = x[i] - step;
        let slope = (above - value(&there)) / (2.0 * step);
        let error = (slope - gradient[i]).abs();
        // Rounding of the sums costs 1e-16 of the value over the step.
        let bound = 1e-7 * largest + 1e-15 * value(x).abs() / step;
        assert!(error <= bound, "{name}, {i}: {} instead of {slope} by differences", gradient[i]);
    }
}

#[test]
fn the_encoding_is_smooth_from_black_to_far_beyond_white() {
    let levels = [1e-7, 1e-5, 1e-3, 0.01, 0.5, 1.0, 30.0, 1e4, 1e6];
    let x: Vec<f64> = levels.iter().cycle().take(27).copied().collect();
    check("encode", STEP, &x, [1, 3, 3, 3], |x| encode(x).sum());
}

#[test]
fn the_renderer_and_what_outputs_stand_for() {
    let weights = tensor(&noise(4 * 3, 2), [4, 3, 1, 1]);
    let plate = tensor(&noise(3 * 6, 3), [1, 3, 2, 3]);
    let part = tensor(&noise(3 * 6, 4), [1, 3, 2, 3]);
    for formulation in [Formulation::Direct, Formulation::Ratio] {
        let light = light(&plate, formulation, 1.7);
        check("relight", STEP, &noise(12 * 6, 1), [1, 12, 2, 3], |output| {
            (relight(olats(output, &light), &weights) * part.clone()).sum()
        });
    }
}

#[test]
fn the_losses_as_a_whole_with_a_mask_of_black_grey_and_white() {
    const LAMPS: usize = 3;
    let shape = [1, 3 * LAMPS, 8, 8];
    let plate = tensor(&noise(3 * 64, 5), [1, 3, 8, 8]);
    let truth = encode(tensor(&noise(LAMPS * 3 * 64, 6), [LAMPS, 3, 8, 8]));
    let weights = tensor(&noise(LAMPS * 3, 7), [LAMPS, 3, 1, 1]);
    let coverage: Vec<f64> = (0..64).map(|i| [0.0, 0.4, 1.0, 1.0][i % 4]).collect();
    let mask = tensor(&coverage, [1, 1, 8, 8]);
    let output: Vec<f64> = noise(3 * LAMPS * 64, 8).iter().map(|v| 0.05 + 0.9 * v).collect();
    for (lamps, pixel, with_olats) in
        [(None, 0.0, true), (None, 0.3, true), (Some(&[0, 2][..]), 0.3, true), (None, 0.0, false)]
    {
        let loss = |output: Tensor<4>| {
            let mut criterion = Criterion { pixel, ..Criterion::default() };
            let with = LossInputs {
                light: light(&plate, Formulation::Ratio, 1.3),
                mask: &mask,
                olats: with_olats.then_some(&truth),
                plate: &encode(plate.clone()),
                weights: &weights,
                settings: LossSettings {
                    gain: 1.4,
                    shift: [1, -2],
                    reconstruction: 1.0,
                    rendering: 0.5,
                    logits: false,
                },
            };
            criterion.losses(output, &with, lamps, None).0
        };
        check("losses", STEP, &output, shape, loss);
    }
}

/// At zero error the safe norm is at its minimum: its gradient is 0 where the bare norm's is 0/0, and near it
/// follows the differences.
#[test]
fn the_norm_at_and_near_zero_error() {
    let truth = noise(3 * 16, 9);
    let mask = tensor(&[1.0; 16], [1, 1, 4, 4]);
    let zero = tensor(&[0.0; 3], [1, 3, 1, 1]);
    let plate = tensor(&truth, [1, 3, 4, 4]);
    let loss = |output: Tensor<4>| {
        let with = LossInputs {
            light: plate.ones_like(),
            mask: &mask,
            olats: Some(&encode(plate.clone())),
            plate: &plate.zeros_like(),
            weights: &zero,
            settings: LossSettings { gain: 1.0, shift: [0, 0], reconstruction: 1.0, rendering: 0.0, logits: false },
        };
        Criterion::default().losses(output, &with, None, None).0
    };
    let exact = tensor(&truth, [1, 3, 4, 4]).require_grad();
    let gradients = loss(exact.clone()).backward();
    let gradient = exact.grad(&gradients).unwrap().into_data();
    assert!(gradient.try_to_vec::<f64>().unwrap().iter().all(|g| *g == 0.0));
    for error in [1e-6, 1e-4, 1e-2] {
        let near: Vec<f64> = truth.iter().map(|v| v + error).collect();
        check("norm", FINE, &near, [1, 3, 4, 4], loss);
    }
}
