//! A reflectance field as a few principal components over its lamps.

use super::eigen::{Symmetric, eigenvectors};
use super::field::ReflectanceField;
use rayon::prelude::*;

/// Pixels multiplied with each other at a time: 123 planes of this length in f64 fit a core's cache.
const CHUNK: usize = 512;

/// Pixels of a component summed at a time, in a core's first-level cache.
const SUMS: usize = 4096;

/// Orthonormal combinations of a field's planes, the one with the most light first. A plane is one
/// channel of one lamp, so red, green and blue of all lamps are combined jointly: for the same
/// number of planes the error is a third to a fifth of that with a basis for each channel.
#[derive(Clone, Debug, PartialEq)]
pub struct LampBasis {
    /// Number of lamps.
    lamps: usize,
    /// `components[k][lamp · 3 + channel]`.
    components: Vec<Vec<f64>>,
    /// Σ of squares of each component in the fields of the basis.
    energies: Vec<f64>,
}

/// A frame under every lamp as few planes: R(lamp, channel) = Σ over k of basis(k, lamp, channel) · plane(k).
#[derive(Clone, Debug, PartialEq)]
pub struct CompressedField {
    pub width: usize,
    pub height: usize,
    /// Number of lamps.
    pub lamps: usize,
    /// `basis[k][lamp · 3 + channel]`, orthonormal.
    pub basis: Vec<Vec<f32>>,
    /// `planes[(k · height + y) · width + x]`. If one value of a pixel is NaN, all of them are.
    pub planes: Vec<f32>,
}

impl LampBasis {
    /// The best basis in the mean square for all of `fields`, such as frames of one clip: the
    /// eigenvectors of their planes' products, by descending eigenvalue. Pixels with NaN are left out.
    /// `None` if the fields differ in their number of lamps.
    pub fn from_fields(fields: &[&ReflectanceField]) -> Option<Self> {
        let lamps = fields.first()?.lamps;
        if fields.iter().any(|field| field.lamps != lamps) {
            return None;
        }
        // Products of any f32 stay far within f64.
        let mut products = Symmetric::zeros(3 * lamps);
        for field in fields {
            products.add(&plane_products(field));
        }
        let (energies, components) = eigenvectors(products);
        Some(Self {
            lamps,
            // Rounding may leave slightly negative values.
            energies: energies.into_iter().map(|energy| energy.max(0.0)).collect(),
            components,
        })
    }

    /// Number of components of the full basis: three for each lamp.
    pub fn len(&self) -> usize {
        self.components.len()
    }

    /// True if there are no lamps.
    pub fn is_empty(&self) -> bool {
        self.components.is_empty()
    }

    /// Relative root-mean-square error with `count` components, over all lamps and pixels of the
    /// fields of the basis.
    pub fn error(&self, count: usize) -> f64 {
        let left: f64 = self.energies.iter().skip(count).sum();
        let all: f64 = self.energies.iter().sum();
        if all > 0.0 { (left / all).sqrt() } else { 0.0 }
    }

    /// The fewest components whose [`Self::error`] is at most `error`.
    pub fn components_for(&self, error: f64) -> usize {
        let enough = |&count: &usize| self.error(count) <= error;
        (0..=self.len()).find(enough).unwrap_or(self.len())
    }

    /// A field projected on the first `count` components. `None` if it has a different number of lamps.
    pub fn compress(&self, field: &ReflectanceField, count: usize) -> Option<CompressedField> {
        if field.lamps != self.lamps {
            return None;
        }
        let components = &self.components[..count.min(self.len())];
        let basis: Vec<Vec<f32>> =
            components.iter().map(|component| component.iter().map(|&v| v as f32).collect()).collect();
        let pixels = field.width * field.height;
        let mut planes = vec![0f32; basis.len() * pixels];
        let rows = planes.par_chunks_mut(pixels.max(1)).zip(&basis);
        rows.for_each(|(plane, component)| {
            for (chunk, sums) in plane.chunks_mut(SUMS).enumerate() {
                for (n, weight) in component.iter().enumerate() {
                    let source = &field.plane(n / 3, n % 3)[chunk * SUMS..];
                    for (sum, value) in sums.iter_mut().zip(source) {
                        *sum += weight * value;
                    }
                }
            }
        });
        Some(CompressedField { width: field.width, height: field.height, lamps: field.lamps, basis, planes })
    }
}

impl CompressedField {
    /// A field in the fewest of its own components with an error of at most `error` of its root mean square.
    pub fn new(field: &ReflectanceField, error: f64) -> Self {
        let compressed =
            LampBasis::from_fields(&[field]).and_then(|basis| basis.compress(field, basis.components_for(error)));
        compressed.expect("a field fits its own basis")
    }

    /// One plane, row by row.
    pub fn plane(&self, component: usize) -> &[f32] {
        let pixels = self.width * self.height;
        &self.planes[component * pixels..(component + 1) * pixels]
    }

    /// Relative root-mean-square error against the original field `of`. NaN is left out.
    pub fn error(&self, of: &ReflectanceField) -> f64 {
        let energy = |planes: &[f32]| -> f64 {
            let squares = planes.par_chunks(SUMS).map(|chunk| {
                let finite = chunk.iter().filter(|v| v.is_finite());
                finite.map(|&v| f64::from(v) * f64::from(v)).sum::<f64>()
            });
            // Added in order, so that the number of threads does not matter.
            squares.collect::<Vec<f64>>().iter().sum()
        };
        let (all, kept) = (energy(&of.values), energy(&self.planes));
        // The basis is orthonormal, so energies of kept and dropped components add up.
        if all > 0.0 { ((all - kept).max(0.0) / all).sqrt() } else { 0.0 }
    }

    /// Bytes of planes and basis.
    pub fn bytes(&self) -> usize {
        size_of::<f32>() * (self.planes.len() + 3 * self.lamps * self.basis.len())
    }
}

/// Contribution of each component to red, green and blue under these weights, one per lamp, for a basis
/// ([`CompressedField::basis`]): Σ over lamps of basis · weight, summed in f64.
pub fn shares(basis: &[Vec<f32>], weights: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let share = |component: &Vec<f32>| {
        let mut sums = [0f64; 3];
        for (lamp, weights) in component.as_chunks::<3>().0.iter().zip(weights) {
            for channel in 0..3 {
                sums[channel] += f64::from(lamp[channel]) * f64::from(weights[channel]);
            }
        }
        sums.map(|sum| sum as f32)
    };
    basis.iter().map(share).collect()
}

/// Σ over pixels of the products of any two planes, without pixels with NaN.
/// Threads take runs of pixels of equal size and their sums are added in order, so that the result does not
/// depend on the number of threads.
fn plane_products(field: &ReflectanceField) -> Symmetric {
    /// Number of chunks in a run.
    const RUN: usize = 16;
    let planes = 3 * field.lamps;
    let pixels = field.width * field.height;
    let products = |run: usize| {
        let mut sum = Symmetric::zeros(planes);
        let mut values = vec![[0f64; CHUNK]; planes];
        let end = pixels.min((run + 1) * RUN * CHUNK);
        for start in (run * RUN * CHUNK..end).step_by(CHUNK) {
            let count = CHUNK.min(end - start);
            let mut is_finite = [true; CHUNK];
            for (n, values) in values.iter_mut().enumerate() {
                let source = &field.plane(n / 3, n % 3)[start..start + count];
                for (i, value) in source.iter().enumerate() {
                    values[i] = f64::from(*value);
                    is_finite[i] &= value.is_finite();
                }
                values[count..].fill(0.0);
            }
            for i in (0..count).filter(|&i| !is_finite[i]) {
                values.iter_mut().for_each(|values| values[i] = 0.0);
            }
            sum.add_products(&values);
        }
        sum
    };
    let runs: Vec<Symmetric> = (0..pixels.div_ceil(RUN * CHUNK)).into_par_iter().map(products).collect();
    let mut sum = Symmetric::zeros(planes);
    runs.iter().for_each(|run| sum.add(run));
    sum
}

#[cfg(test)]
#[path = "compressed_tests.rs"]
mod tests;
