//! Anti-aliased resampling between pictures of the sphere that keeps every pixel's energy.
//!
//! The sphere is sampled on a grid within the pixels of both pictures. Each sample is interpolated bilinearly in
//! the source and counts for the target pixel it falls in. Its weight is the solid angle it represents: the
//! reciprocal of both grids' density there (the balance heuristic of Veach and Guibas 1995), so that the finer grid
//! always does the work. This gives approximately the share of each source pixel in each target pixel. The energy
//! from a source pixel should add up to its solid angle, and the energy in a target pixel to that pixel's. Scaling
//! both in turn (Sinkhorn and Knopp 1967) nearly satisfies both. The last step makes one exact: the target's for
//! smooth light, so that a uniform sky stays uniform; the source's for light that stands out, so that a lamp of one
//! pixel keeps its energy.

use super::Projection;
use glam::DQuat;
use imaging::Image;
use rayon::prelude::*;

/// Rounds of scaling.
const ROUNDS: usize = 2;

/// Result of [`resample`].
pub struct Resampled {
    /// Mean radiance of the source in each pixel; 0 where a pixel shows nothing of it.
    pub image: Image,
    /// Share of each target pixel's solid angle that the source shows.
    pub shown: Vec<f32>,
}

/// A direction with its place in both pictures.
#[derive(Clone, Copy)]
struct Sample {
    target: u32,
    /// Place in the source in pixels.
    x: f32,
    y: f32,
    /// Solid angle of the sample.
    weight: f32,
}

/// Resamples a picture of finite values. `usable` is the share of each source pixel's area that belongs to the
/// picture. Pixels of 0 are left out, and directions that only they show count as not shown. A direction ω of the
/// source is `turn`·ω in the target.
pub fn resample(picture: &Image, source: &Projection, usable: &[f32], target: &Projection, turn: DQuat) -> Resampled {
    let plan = Plan::new(source, usable, target, turn);
    let factors = plan.balanced();
    let smooth = eroded(picture, usable);
    let sums: Vec<[f64; 6]> = (0..plan.shown_angles.len())
        .into_par_iter()
        .map(|target| {
            let mut sums = [0.0; 6];
            let (even, exact) = (factors.even[target], factors.exact[target]);
            for sample in plan.samples_of(target) {
                let weight = f64::from(sample.weight);
                for (pixel, share) in plan.interpolated(sample) {
                    let part = weight * f64::from(share) * factors.source[pixel];
                    let (all, base) = (picture.pixels[pixel], smooth.pixels[pixel]);
                    for c in 0..3 {
                        sums[c] += even * part * f64::from(base[c]);
                        sums[3 + c] += exact * part * f64::from(all[c] - base[c]);
                    }
                }
            }
            sums
        })
        .collect();
    // Slopes leave a small error in the smooth part's energy; one factor corrects it.
    let correction: [f64; 3] = std::array::from_fn(|c| {
        let before = smooth.pixels.iter().zip(&plan.source_angles);
        let before: f64 = before.map(|(pixel, angle)| f64::from(pixel[c]) * angle).sum();
        let after: f64 = sums.iter().map(|sum| sum[c]).sum();
        if after > 0.0 { before / after } else { 1.0 }
    });
    let pixels =
        sums.iter()
            .zip(&plan.shown_angles)
            .map(|(sum, &angle)| {
                // The mean over the visible part is its energy divided by its solid angle.
                std::array::from_fn(|c| {
                    if angle > 0.0 { ((correction[c] * sum[c] + sum[3 + c]) / angle) as f32 } else { 0.0 }
                })
            })
            .collect();
    Resampled { image: Image { width: target.width, height: target.height, pixels }, shown: plan.shown }
}

/// Minimum of each usable pixel and its usable neighbours.
fn eroded(picture: &Image, usable: &[f32]) -> Image {
    let (width, height) = picture.size();
    Image::from_fn(width, height, |x, y| {
        let mut least = picture.at(x, y);
        for row in y.saturating_sub(1)..(y + 2).min(height) {
            for column in x.saturating_sub(1)..(x + 2).min(width) {
                if usable[row * width + column] > 0.0 {
                    let pixel = picture.at(column, row);
                    least = std::array::from_fn(|c| least[c].min(pixel[c]));
                }
            }
        }
        least
    })
}

/// Approximate share of each source pixel in each target pixel.
struct Plan<'a> {
    source: &'a Projection,
    usable: &'a [f32],
    /// Sorted by target pixel.
    samples: Vec<Sample>,
    /// Start of each target pixel's samples, then the end of all.
    starts: Vec<usize>,
    /// Solid angles of the source's usable pixels.
    source_angles: Vec<f64>,
    /// Solid angles of the target pixels' parts that show the source.
    shown_angles: Vec<f64>,
    /// The same as a share of each target pixel's solid angle.
    shown: Vec<f32>,
}

/// Factors that make a [`Plan`] exact. All products share the source pixels' factors.
struct Factors {
    source: Vec<f64>,
    /// Target factors when the source sums are exact.
    exact: Vec<f64>,
    /// Target factors when the target sums are exact.
    even: Vec<f64>,
}

/// Samples along a side of the pixels of `this` picture: only the centre where the other picture is so much finer
/// that its samples are dense enough.
fn grid(this: &Projection, other: &Projection) -> usize {
    let pixels = |p: &Projection| p.width * p.height;
    if pixels(other) >= 9 * pixels(this) { 1 } else { 2 }
}

/// The places of an `n × n` grid in a pixel.
fn places(picture: &Projection, pixel: usize, n: usize) -> impl Iterator<Item = (f64, f64)> {
    let (x, y) = (pixel % picture.width, pixel / picture.width);
    (0..n * n).map(move |i| {
        let at = |i: usize| (i as f64 + 0.5) / n as f64;
        (x as f64 + at(i % n), y as f64 + at(i / n))
    })
}

/// Two pictures of the sphere with a turn between them, and the grids of samples in their pixels.
struct Sampling<'a> {
    source: &'a Projection,
    usable: &'a [f32],
    target: &'a Projection,
    /// Rotation from source directions to target directions.
    turn: DQuat,
    /// Samples along a side of a target pixel.
    n: usize,
    /// Samples along a side of a source pixel.
    m: usize,
}

impl Sampling<'_> {
    /// True if the source pixel at a place is usable.
    fn shows(&self, (x, y): (f64, f64)) -> bool {
        let (width, height) = (self.source.width as f64, self.source.height as f64);
        let within = (0.0..=width).contains(&x) && (0.0..=height).contains(&y);
        within && self.usable[self.source.pixel((x, y))] > 0.0
    }

    /// Solid angle of a sample, from the densities of both grids in steradians per pixel area.
    fn weight(&self, in_target: f64, in_source: f64) -> f64 {
        1.0 / ((self.n * self.n) as f64 / in_target + (self.m * self.m) as f64 / in_source)
    }

    /// Sample at a place of the target; the error is the solid angle that the source does not show. `None` if the
    /// target shows nothing there.
    fn target_sample(&self, pixel: usize, (x, y): (f64, f64)) -> Option<Result<Sample, f64>> {
        let (direction, in_target) = self.target.look(x, y)?;
        let alone = in_target / (self.n * self.n) as f64;
        let seen = self.source.place(self.turn.inverse() * direction).filter(|&place| self.shows(place));
        Some(seen.ok_or(alone).map(|(x, y)| {
            Sample {
                target: pixel as u32,
                x: x as f32,
                y: y as f32,
                // Where the source is infinitely dense, only the target's samples count.
                weight: self.source.look(x, y).map_or(alone, |(_, d)| self.weight(in_target, d)) as f32,
            }
        }))
    }

    /// Sample at a place of the source; `None` if either picture shows nothing there.
    fn source_sample(&self, (x, y): (f64, f64)) -> Option<Sample> {
        let (direction, in_source) = self.source.look(x, y)?;
        let place = self.target.place(self.turn * direction)?;
        let (_, in_target) = self.target.look(place.0, place.1)?;
        Some(Sample {
            target: self.target.pixel(place) as u32,
            x: x as f32,
            y: y as f32,
            weight: self.weight(in_target, in_source) as f32,
        })
    }

    /// Adds the samples of the target's grid. Returns the solid angle per pixel that the source does not show.
    fn add_of_target(&self, samples: &mut Vec<Sample>, angles: &[f64]) -> Vec<f64> {
        let rows: Vec<(Vec<Sample>, Vec<f64>)> = (0..self.target.height)
            .into_par_iter()
            .map(|y| {
                let (mut samples, mut missed) = (Vec::new(), vec![0.0; self.target.width]);
                for (x, missed) in missed.iter_mut().enumerate() {
                    let pixel = y * self.target.width + x;
                    if angles[pixel] <= 0.0 {
                        continue;
                    }
                    let mut any = false;
                    let grid = places(self.target, pixel, self.n);
                    for sample in grid.filter_map(|p| self.target_sample(pixel, p)) {
                        any = true;
                        match sample {
                            Ok(sample) => samples.push(sample),
                            Err(angle) => *missed += angle,
                        }
                    }
                    // A sliver of a disc may lie between grid places.
                    if !any {
                        let centre = self.target.centre(pixel);
                        samples.extend(self.target_sample(pixel, centre).and_then(Result::ok));
                    }
                }
                (samples, missed)
            })
            .collect();
        let mut missed = Vec::with_capacity(angles.len());
        for (row, miss) in rows {
            samples.extend(row);
            missed.extend(miss);
        }
        missed
    }

    /// The samples of the source's grid.
    fn of_source(&self, angles: &[f64]) -> Vec<Sample> {
        let rows: Vec<Vec<Sample>> = (0..self.source.height)
            .into_par_iter()
            .map(|y| {
                let pixels = y * self.source.width..(y + 1) * self.source.width;
                let mut samples = Vec::new();
                for pixel in pixels.filter(|&p| angles[p] > 0.0) {
                    let before = samples.len();
                    let grid = places(self.source, pixel, self.m);
                    samples.extend(grid.filter_map(|p| self.source_sample(p)));
                    if samples.len() == before {
                        samples.extend(self.source_sample(self.source.centre(pixel)));
                    }
                }
                samples
            })
            .collect();
        rows.into_iter().flatten().collect()
    }
}

/// Share of each target pixel that the source shows, from its samples and the `missed` solid angles. `angles` are
/// the target's; `all` is the source's solid angle.
fn shares_shown(samples: &[Sample], missed: &[f64], angles: &[f64], all: f64) -> Vec<f32> {
    let mut seen = vec![0.0f64; missed.len()];
    for sample in samples {
        seen[sample.target as usize] += f64::from(sample.weight);
    }
    // The total is known exactly. Where the border cuts pixels, samples give only a rough share of each; these
    // shares are scaled to match the total.
    let (mut whole, mut cut) = (0.0, 0.0);
    let mut shown = vec![0.0; missed.len()];
    for (i, (seen, missed)) in seen.iter().zip(missed).enumerate() {
        let share = if *seen > 0.0 { seen / (seen + missed) } else { 0.0 };
        shown[i] = share as f32;
        *(if share < 1.0 { &mut cut } else { &mut whole }) += share * angles[i];
    }
    let scale = if cut > 0.0 { ((all - whole) / cut).max(0.0) } else { 1.0 };
    for shown in &mut shown {
        if *shown > 0.0 && *shown < 1.0 {
            // At least a little is visible there.
            *shown = (*shown * scale as f32).clamp(1e-6, 1.0);
        }
    }
    shown
}

impl<'a> Plan<'a> {
    fn new(source: &'a Projection, usable: &'a [f32], target: &Projection, turn: DQuat) -> Self {
        let sampling = Sampling { source, usable, target, turn, n: grid(target, source), m: grid(source, target) };
        let mut source_angles = source.solid_angles();
        for (angle, &usable) in source_angles.iter_mut().zip(usable) {
            *angle = if usable > 0.0 { *angle } else { 0.0 };
        }
        let mut shown_angles = target.solid_angles();
        let mut samples = sampling.of_source(&source_angles);
        let missed = sampling.add_of_target(&mut samples, &shown_angles);
        samples.retain(|s| s.weight > 0.0 && s.weight.is_finite());
        let all = source_angles.iter().sum();
        let shown = shares_shown(&samples, &missed, &shown_angles, all);
        for (angle, shown) in shown_angles.iter_mut().zip(&shown) {
            *angle *= f64::from(*shown);
        }
        samples.par_sort_by_key(|sample| sample.target);
        let mut starts = vec![0; shown.len() + 1];
        for sample in &samples {
            starts[sample.target as usize + 1] += 1;
        }
        for i in 0..shown.len() {
            starts[i + 1] += starts[i];
        }
        Self { source, usable, samples, starts, source_angles, shown_angles, shown }
    }

    /// Samples of a target pixel.
    fn samples_of(&self, target: usize) -> &[Sample] {
        &self.samples[self.starts[target]..self.starts[target + 1]]
    }

    /// Source pixels interpolated by a sample, with shares that add up to 1.
    fn interpolated(&self, sample: &Sample) -> impl Iterator<Item = (usize, f32)> {
        let around = self.source.neighbours(f64::from(sample.x), f64::from(sample.y));
        let shares = around.map(|(pixel, share)| pixel.map_or((0, 0.0), |pixel| (pixel, share * self.usable[pixel])));
        let all: f32 = shares.iter().map(|(_, share)| share).sum();
        let factor = if all > 0.0 { 1.0 / all } else { 0.0 };
        shares.into_iter().filter(|(_, share)| *share > 0.0).map(move |(pixel, share)| (pixel, share * factor))
    }

    /// Scales the target pixels and the source pixels in turn.
    fn balanced(&self) -> Factors {
        let factors = |angles: &[f64], sums: &[f64]| -> Vec<f64> {
            let pairs = angles.iter().zip(sums);
            pairs.map(|(angle, &sum)| if sum > 0.0 { angle / sum } else { 0.0 }).collect()
        };
        let target = |source: &[f64]| {
            let sum = |target: usize| -> f64 {
                let parts = self.samples_of(target).iter().map(|sample| {
                    let parts = self.interpolated(sample);
                    let sum: f64 = parts.map(|(pixel, share)| f64::from(share) * source[pixel]).sum();
                    f64::from(sample.weight) * sum
                });
                parts.sum()
            };
            let targets = (0..self.shown_angles.len()).into_par_iter();
            factors(&self.shown_angles, &targets.map(sum).collect::<Vec<_>>())
        };
        let mut source = vec![1.0; self.source_angles.len()];
        let mut even = target(&source);
        let mut exact = vec![];
        for _ in 0..ROUNDS {
            // A fixed number of parts gives the same sums on any machine.
            let parts: Vec<Vec<f64>> = self
                .samples
                .par_chunks(self.samples.len().div_ceil(8).max(1))
                .map(|samples| {
                    let mut sums = vec![0.0; self.source_angles.len()];
                    for sample in samples {
                        let row = even[sample.target as usize] * f64::from(sample.weight);
                        for (pixel, share) in self.interpolated(sample) {
                            sums[pixel] += row * f64::from(share);
                        }
                    }
                    sums
                })
                .collect();
            let sums: Vec<f64> = (0..source.len()).map(|i| parts.iter().map(|sums| sums[i]).sum()).collect();
            source = factors(&self.source_angles, &sums);
            exact = even;
            even = target(&source);
        }
        Factors { source, exact, even }
    }
}
