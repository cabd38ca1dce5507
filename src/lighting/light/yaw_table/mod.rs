//! Weights of an environment at every yaw.
//!
//! A yaw shifts the panorama's columns. A node's energy at all shifts is therefore a circular correlation of its
//! shares with the environment, row by row: E(s) = Σ_y Σ_x share(x, y) · L(x − s, y) · Ω_y. In the Fourier domain
//! that is a product per row. The rows are summed there, so that each node and channel is transformed back once
//! (the correlation theorem).

use super::Environment;
use super::latlong::texel_solid_angle;
use super::weights::{LampDivision, LightWeights, NodeEnergies, Partition, columns};
use rayon::prelude::*;
use realfft::num_complex::Complex;
use realfft::{RealFftPlanner, RealToComplex};
use std::sync::Arc;

/// Weights of one environment for a rig at every yaw. Building it takes as long as a few rotations; reading takes
/// microseconds.
pub struct YawTable {
    width: usize,
    /// Energy at every shift per node and channel: `[node · 3 + channel][shift]`.
    nodes: Vec<Vec<f64>>,
    /// Energy from directions without lamps at every shift, per channel.
    uncovered: Vec<Vec<f64>>,
    total: [f64; 3],
    division: Arc<LampDivision>,
}

type Spectrum = Vec<Complex<f64>>;

impl YawTable {
    /// The table of an environment for a partition of any kind. An environment of a different size is resized
    /// first.
    pub fn new(partition: &Partition, environment: &Environment) -> Self {
        let (width, height) = (partition.width, partition.height);
        if environment.radiance.size() != (width, height) {
            return Self::new(partition, &environment.reduced(width));
        }
        /// Rows per sequential sum. Blocks are summed in order too, so the result does not depend on the number of
        /// cores.
        const BLOCK: usize = 16;
        let mut planner = RealFftPlanner::new();
        let (forward, back) = (planner.plan_fft_forward(width), planner.plan_fft_inverse(width));
        let rows: Vec<usize> = (0..height).collect();
        let blocks: Vec<Spectra> = rows
            .par_chunks(BLOCK)
            .map(|rows| {
                let mut sum = Spectra::new(partition);
                for &y in rows {
                    sum.add_row(partition, environment, y, &forward);
                }
                sum
            })
            .collect();
        let mut sum = Spectra::new(partition);
        for block in blocks {
            sum.add(block);
        }
        let total = sum.total;
        // Rounding leaves about 1e-16 of the brightest light in dark places.
        let at_all_shifts = |(i, spectrum): (usize, &mut Option<Spectrum>)| {
            let mut shifts = vec![0.0f64; width];
            let Some(spectrum) = spectrum else { return shifts };
            // These coefficients of a real signal are real, up to rounding.
            spectrum[0].im = 0.0;
            if width.is_multiple_of(2) {
                spectrum[width / 2].im = 0.0;
            }
            if back.process(spectrum, &mut shifts).is_err() {
                return vec![0.0; width];
            }
            for value in &mut shifts {
                *value /= width as f64;
                let dark = *value < 1e-13 * total[i % 3];
                *value = if dark { 0.0 } else { *value };
            }
            shifts
        };
        let mut nodes: Vec<Vec<f64>> = sum.spectra.par_iter_mut().enumerate().map(at_all_shifts).collect();
        let uncovered = nodes.split_off(3 * partition.division.nodes());
        Self { width, nodes, uncovered, total, division: partition.division.clone() }
    }

    /// Weights at a yaw, equal to [`Partition::weights`], including the mix of two columns at fractional shifts.
    pub fn at(&self, yaw_deg: f32) -> LightWeights {
        let (shift, fraction) = columns(yaw_deg, self.width);
        let next = (shift + 1) % self.width;
        let read = |shifts: &Vec<f64>| fraction * shifts[next] + (1.0 - fraction) * shifts[shift];
        let channels = |table: &[Vec<f64>]| [0, 1, 2].map(|c| read(&table[c]));
        self.division.weights(&NodeEnergies {
            nodes: self.nodes.chunks_exact(3).map(channels).collect(),
            uncovered: channels(&self.uncovered),
            total: self.total,
        })
    }
}

/// Spectra over the shift: the energy of each node per channel, `[node · 3 + channel]`, then the uncovered energy.
/// `None` is zero.
struct Spectra {
    spectra: Vec<Option<Spectrum>>,
    total: [f64; 3],
}

impl Spectra {
    fn new(partition: &Partition) -> Self {
        Self { spectra: vec![None; 3 * (partition.division.nodes() + 1)], total: [0.0; 3] }
    }

    fn add(&mut self, other: Self) {
        for (sum, part) in self.spectra.iter_mut().zip(other.spectra) {
            match (sum, part) {
                (Some(sum), Some(part)) => sum.iter_mut().zip(part).for_each(|(s, p)| *s += p),
                (sum, Some(part)) => *sum = Some(part),
                (_, None) => {}
            }
        }
        for c in 0..3 {
            self.total[c] += other.total[c];
        }
    }

    fn add_row(
        &mut self,
        partition: &Partition,
        environment: &Environment,
        y: usize,
        forward: &Arc<dyn RealToComplex<f64>>,
    ) {
        let width = partition.width;
        let solid_angle = texel_solid_angle(y, width, partition.height);
        let transform = |signal: &mut [f64]| {
            let mut spectrum = forward.make_output_vec();
            // The only possible error is a length that differs from the plan's, and lengths match.
            forward.process(signal, &mut spectrum).ok().map(|()| spectrum)
        };
        let row = &environment.radiance.pixels[y * width..(y + 1) * width];
        let light = [0, 1, 2].map(|c| {
            let mut signal: Vec<f64> = row.iter().map(|p| solid_angle * f64::from(p[c])).collect();
            self.total[c] += signal.iter().sum::<f64>();
            let dark = signal.iter().all(|v| *v == 0.0);
            if dark { None } else { transform(&mut signal) }
        });
        let nodes = partition.division.nodes();
        let mut shares: Vec<Option<Vec<f64>>> = vec![None; nodes + 1];
        for x in 0..width {
            for &(node, share) in partition.texel(x, y) {
                let shares = &mut shares[usize::from(node)];
                shares.get_or_insert_with(|| vec![0.0; width])[x] += f64::from(share);
            }
            if !partition.is_covered(x, y) {
                shares[nodes].get_or_insert_with(|| vec![0.0; width])[x] = 1.0;
            }
        }
        for (node, shares) in shares.into_iter().enumerate() {
            let Some(spectrum) = shares.and_then(|mut shares| transform(&mut shares)) else { continue };
            for (c, light) in light.iter().enumerate() {
                let Some(light) = light else { continue };
                let sum = self.spectra[3 * node + c].get_or_insert_with(|| vec![Complex::default(); spectrum.len()]);
                for ((sum, share), light) in sum.iter_mut().zip(&spectrum).zip(light) {
                    *sum += share * light.conj();
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
