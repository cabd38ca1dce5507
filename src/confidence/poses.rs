//! How far a frame is from the poses that were photographed, in the network's own features.

use super::cells::{Cells, moved};
use base::error::Result;
use footage::Frame;
use rayon::prelude::*;
use reflectance::Predictor;

/// The poses that a network has learnt from.
pub struct Poses {
    /// Each pose as it is, then moved by parts of a cell.
    poses: Vec<Vec<Cells>>,
    /// Of each feature the inverse of its deviation over all poses, times the root of how many there are: squares of
    /// differences then sum to a mean.
    scale: Vec<f32>,
}

/// How far a picture is from the poses.
#[derive(Clone, Debug, PartialEq)]
pub struct Nearest {
    /// Of each cell that shows the subject, by its number: the distance to the nearest cell of any pose, in deviations of
    /// the features.
    pub cells: Vec<(usize, f32)>,
    /// The root mean square of those; 0 where no cell shows the subject.
    pub distance: f32,
    /// The pose that most cells are nearest to; None without poses or cells.
    pub pose: Option<usize>,
}

impl Poses {
    /// What `predictor` makes of these poses, under the interview's light.
    ///
    /// # Errors
    /// When the device fails.
    pub fn of(predictor: &Predictor, poses: &[Frame]) -> Result<Self> {
        let cells = poses.iter().map(|pose| {
            let moved = moved(pose);
            moved
                .iter()
                .map(|moved| Cells::of(predictor, moved))
                .collect()
        });
        Ok(Self::from_cells(cells.collect::<Result<_>>()?))
    }

    /// The same of cells that are known.
    pub(crate) fn from_cells(poses: Vec<Vec<Cells>>) -> Self {
        let channels = poses
            .iter()
            .flatten()
            .next()
            .map_or(0, |cells| cells.channels);
        let (mut sums, mut squares, mut count) = (vec![0f64; channels], vec![0f64; channels], 0.0);
        for (_, features) in poses
            .iter()
            .filter_map(|pose| pose.first())
            .flat_map(Cells::subject)
        {
            count += 1.0;
            for (channel, value) in features.iter().enumerate() {
                sums[channel] += f64::from(*value);
                squares[channel] += f64::from(*value).powi(2);
            }
        }
        let scale = sums.iter().zip(squares).map(|(sum, square)| {
            let mean = sum / f64::max(count, 1.0);
            let variance = square / f64::max(count, 1.0) - mean * mean;
            // A feature that is always the same tells nothing.
            let usable = variance.is_finite() && variance > 1e-12;
            let inverse = if usable { 1.0 / variance.sqrt() } else { 0.0 };
            (inverse / (channels as f64).sqrt()) as f32
        });
        Self {
            scale: scale.collect(),
            poses,
        }
    }

    /// How many poses there are.
    pub fn count(&self) -> usize {
        self.poses.len()
    }

    /// Takes another picture among the poses, as if it had been photographed.
    pub fn add(&mut self, cells: Cells) {
        self.poses.push(vec![cells]);
    }

    /// How far a picture is from all poses but `without`.
    pub fn nearest(&self, cells: &Cells, without: Option<usize>) -> Nearest {
        let known = self.poses.iter().enumerate();
        let known: Vec<(usize, &[f32])> = known
            .filter(|(pose, _)| Some(*pose) != without)
            .flat_map(|(pose, moved)| moved.iter().map(move |cells| (pose, cells)))
            .flat_map(|(pose, cells)| cells.subject().map(move |(_, features)| (pose, features)))
            .collect();
        let subject: Vec<(usize, &[f32])> = cells.subject().collect();
        let found: Vec<(usize, f32, Option<usize>)> = subject
            .par_iter()
            .map(|(cell, features)| {
                let (mut best, mut of) = (f32::INFINITY, None);
                for (pose, other) in &known {
                    let square = self.square(features, other, best);
                    if square < best {
                        (best, of) = (square, Some(*pose));
                    }
                }
                (*cell, best.sqrt(), of)
            })
            .collect();
        let found: Vec<_> = found
            .into_iter()
            .filter(|(_, d, _)| d.is_finite())
            .collect();
        let mut votes = vec![0usize; self.poses.len()];
        for pose in found.iter().filter_map(|(.., pose)| *pose) {
            votes[pose] += 1;
        }
        let pose = (0..votes.len()).max_by_key(|&pose| (votes[pose], usize::MAX - pose));
        let square: f64 = found.iter().map(|(_, d, _)| f64::from(*d).powi(2)).sum();
        Nearest {
            distance: (square / found.len().max(1) as f64).sqrt() as f32,
            pose: pose.filter(|&pose| votes[pose] > 0),
            cells: found.into_iter().map(|(cell, d, _)| (cell, d)).collect(),
        }
    }

    /// The distance of each pose to the others.
    pub fn among_themselves(&self) -> Vec<Nearest> {
        let own = self.poses.iter().enumerate();
        own.filter_map(|(pose, moved)| Some(self.nearest(moved.first()?, Some(pose))))
            .collect()
    }

    /// The squared distance of two cells; beyond `most` any number above it.
    fn square(&self, a: &[f32], b: &[f32], most: f32) -> f32 {
        let mut sum = 0.0;
        let parts = a.chunks(16).zip(b.chunks(16)).zip(self.scale.chunks(16));
        for ((a, b), scale) in parts {
            sum += a
                .iter()
                .zip(b)
                .zip(scale)
                .map(|((a, b), scale)| ((a - b) * scale).powi(2))
                .sum::<f32>();
            if sum > most {
                break;
            }
        }
        sum
    }
}

/// The pictures that, photographed one after the other, would leave the least uncovered: each is the one farthest from the
/// poses and those chosen before it (Gonzalez 1985). `pictures` are numbered by their place.
pub fn missing(poses: &mut Poses, pictures: &[Cells], count: usize) -> Vec<(usize, f32)> {
    // A picture that shows little of the subject has a bad matte.
    let mut counts: Vec<usize> = pictures.iter().map(Cells::count).collect();
    counts.sort_unstable();
    let usual = counts.get(counts.len() / 2).copied().unwrap_or(0);
    let usable: Vec<usize> = (0..pictures.len())
        .filter(|&picture| 2 * pictures[picture].count() > usual)
        .collect();
    let mut distances: Vec<f32> = usable
        .par_iter()
        .map(|&picture| poses.nearest(&pictures[picture], None).distance)
        .collect();
    let mut chosen = Vec::new();
    while chosen.len() < count {
        let farthest = (0..usable.len()).max_by(|&a, &b| distances[a].total_cmp(&distances[b]));
        let Some(place) = farthest.filter(|&place| distances[place] > 0.0) else {
            break;
        };
        chosen.push((usable[place], distances[place]));
        poses.add(pictures[usable[place]].clone());
        distances = usable
            .par_iter()
            .map(|&picture| poses.nearest(&pictures[picture], None).distance)
            .collect();
    }
    chosen
}
