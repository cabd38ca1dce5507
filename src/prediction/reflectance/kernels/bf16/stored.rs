//! A layer's input and output as far as its gradients need them, in half the memory or less.

use super::pack::Round;
use crate::kernels::chunks::{WORTH_A_THREAD, vectorized};
use rayon::prelude::*;

/// A leaky ReLU's output, for its gradient.
#[derive(Clone, Debug)]
pub struct Signs {
    pub slope: f32,
    /// True for each output above 0.
    pub positive: Vec<bool>,
}

impl Signs {
    pub fn new(slope: f32, output: &[f32]) -> Self {
        let positive = mapped(
            output,
            #[inline(always)]
            |output, into| {
                for (into, output) in into.iter_mut().zip(output) {
                    *into = *output > 0.0;
                }
            },
        );
        Self { slope, positive }
    }
}

/// The bf16 of each value.
pub fn to_bf16(values: &[f32]) -> Vec<u16> {
    mapped(values, f32::to_bf16)
}

fn mapped<T: Clone + Default + Send>(values: &[f32], map: impl Fn(&[f32], &mut [T]) + Sync) -> Vec<T> {
    let mut out = vec![T::default(); values.len()];
    let chunks = out.par_chunks_mut(WORTH_A_THREAD).zip(values.par_chunks(WORTH_A_THREAD));
    chunks.for_each(|(out, values)| {
        vectorized(
            #[inline(always)]
            || map(values, out),
        );
    });
    out
}
