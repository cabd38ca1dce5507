//! Light finer than the working size, carried over from the exemplars as they were photographed.
//!
//! A pose is lit by each lamp alone, at the working size, and that light is brought to its own plate by [`Plate::relit`]. What
//! the photograph shows beyond that, over the pose's plate, is the lamp's detail: shadow edges, pores, glints. Details are summed
//! by the lamps' weights, turned with the head, pulled over to the frame and added to its ratio: linear in the light, and nothing
//! under the interview's own.

use crate::matching::around;
use crate::places::Place;
use base::error::Result;
use calibration::Calibration;
use compositor::reference::extend_edges;
use compositor::{FineLight, Plate, PlateSquare};
use footage::{OlatReader, PictureSize, picture_size};
use half::f16;
use imaging::{Image, resample::resize_area};
use project::Project;
use rayon::prelude::*;
use reflectance::kernels::chunks::vectorized;
use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

/// The most bytes that details take: larger exemplars are read smaller.
const MOST_BYTES: usize = 800 << 20;
/// Exemplars less than this many times larger than the working size have no detail worth its time.
const LEAST_SCALE: f32 = 1.25;
/// Coverage from which a pixel shows the subject alone.
const SOLID: f32 = 0.98;
/// Quantile of a lamp's details that the codes reach. Larger ones are cut to it: glints in black.
const LARGEST: f32 = 0.999;
/// Values among which that is found.
const SAMPLES: usize = 1 << 16;
/// Pixels that a thread sums at a time.
const PIXELS: usize = 1024;

/// The details of all exemplars under each lamp.
#[derive(Debug)]
pub struct ExemplarDetail {
    poses: BTreeMap<usize, PoseDetail>,
}

/// The details of one exemplar.
#[derive(Debug)]
struct PoseDetail {
    side: usize,
    /// Numbers of the pixels that show the subject alone.
    pixels: Vec<u32>,
    /// Details of lamp l: `codes[3 · l · pixels.len()..]`, red, green and blue of each pixel. Code k is `scales[l] · k · |k|`.
    codes: Vec<i8>,
    scales: Vec<f32>,
}

/// Details that are read beside other work.
pub type SharedDetail = Arc<OnceLock<Option<ExemplarDetail>>>;

/// A frame's places in the exemplars, by which its plate gets their fine light.
#[derive(Clone, Debug)]
pub struct FineField {
    pub exemplars: SharedDetail,
    pub places: Arc<[Place]>,
    /// Columns and rows of the working size.
    pub working: usize,
}

/// A frame's fine light at its plate's size.
#[derive(Debug)]
struct FineFrame {
    field: FineField,
    square: PlateSquare,
    size: (usize, usize),
}

impl ExemplarDetail {
    /// Reads the project's exemplars as large as its frames are, or as they were photographed if that is less. None if that is
    /// hardly more than the working size.
    ///
    /// # Errors
    /// When a picture cannot be read.
    pub fn read(project: &Project, calibration: &Calibration) -> Result<Option<Self>> {
        let working = project.settings.size;
        let most = picture_size(project, PictureSize::Box)?.0;
        let mut poses = BTreeMap::new();
        let count = project.settings.shoot.poses.len();
        for pose in 0..count {
            let reader = OlatReader::new(project, &calibration.response, pose)?;
            let side = reader.side()?.min(most);
            let mask = reader.mask_at(side)?;
            let solid = mask.pixels.iter().filter(|&&alpha| alpha > SOLID).count();
            let bytes = 3 * solid * calibration.rig.lamps.len() * count;
            let fitting = (MOST_BYTES as f32 / bytes.max(1) as f32).sqrt().min(1.0);
            let side = (side as f32 * fitting) as usize;
            if side as f32 >= LEAST_SCALE * working as f32 {
                poses.insert(pose, PoseDetail::read(&reader, calibration, (side, working))?);
            }
        }
        Ok((!poses.is_empty()).then_some(Self { poses }))
    }

    /// The memory that it takes.
    pub fn bytes(&self) -> usize {
        let size = |pose: &PoseDetail| pose.codes.len() + size_of_val(&pose.pixels[..]);
        self.poses.values().map(size).sum()
    }
}

impl PoseDetail {
    /// One without lamps.
    fn new(side: usize, pixels: Vec<u32>) -> Self {
        Self { side, pixels, codes: Vec::new(), scales: Vec::new() }
    }

    fn read(reader: &OlatReader, calibration: &Calibration, (side, working): (usize, usize)) -> Result<Self> {
        let mask = reader.mask_at(side)?;
        let pixels: Vec<u32> = (0..side * side).filter(|&p| mask.pixels[p] > SOLID).map(|p| p as u32).collect();
        let small_mask = resize_area(&mask, working, working);
        let light = calibration.interview_light();
        let learnt = calibration.rig.lamps.len();
        let mut lit = Image::filled(side, side, [0.0; 3]);
        let mut olats = Vec::with_capacity(learnt);
        let lamps: Vec<usize> = (0..light.len()).collect();
        for some in lamps.chunks(2 * rayon::current_num_threads()) {
            let read = some.par_iter().map(|&lamp| reader.read_at(lamp, side));
            for (&lamp, olat) in some.iter().zip(read.collect::<Result<Vec<_>>>()?) {
                lit.pixels
                    .par_iter_mut()
                    .zip(&olat.pixels)
                    .with_min_len(4096)
                    .for_each(|(sum, olat)| (0..3).for_each(|c| sum[c] += light[lamp][c] * olat[c]));
                if lamp < learnt {
                    let solid = pixels.iter().map(|&p| olat.pixels[p as usize].map(f16::from_f32));
                    let mut small = resize_area(&olat, working, working);
                    extend_edges(&mut small, &small_mask);
                    for (pixel, &alpha) in small.pixels.iter_mut().zip(&small_mask.pixels) {
                        *pixel = pixel.map(|v| v * alpha);
                    }
                    olats.push((small, solid.collect::<Vec<_>>()));
                }
            }
        }
        let square = PlateSquare { x: 0.0, y: 0.0, side: side as f32 };
        let plate = Plate::new(lit, mask, square, &small_mask)?;
        let mut detail = Self::new(side, pixels);
        for (small, olat) in olats {
            let enlarged = plate.relit(&small, &small_mask);
            let shown = detail.pixels.par_iter().zip(&olat).with_min_len(4096);
            let beyond: Vec<[f32; 3]> = shown
                .map(|(&p, olat)| {
                    let p = p as usize;
                    let (alpha, lit) = (plate.matte.pixels[p], plate.lit().pixels[p]);
                    std::array::from_fn(|c| (alpha * olat[c].to_f32() - enlarged.pixels[p][c]) / lit[c])
                })
                .collect();
            detail.push(beyond.as_flattened());
        }
        Ok(detail)
    }

    /// Appends a lamp's details.
    fn push(&mut self, values: &[f32]) {
        let step = (values.len() / SAMPLES).max(1) | 1;
        let sizes = values.iter().step_by(step).map(|v| v.abs());
        let mut sizes: Vec<f32> = sizes.filter(|size| size.is_finite()).collect();
        let at = (LARGEST * sizes.len().saturating_sub(1) as f32) as usize;
        let largest = if sizes.is_empty() { 0.0 } else { *sizes.select_nth_unstable_by(at, f32::total_cmp).1 };
        let code = |value: &f32| {
            let root = (value.abs() / largest.max(f32::MIN_POSITIVE)).sqrt().min(1.0);
            (value.signum() * 127.0 * root).round() as i8
        };
        self.codes.par_extend(values.par_iter().with_min_len(4096).map(code));
        self.scales.push(largest / (127.0 * 127.0));
    }

    /// The detail under lamps of these weights, 0 where the subject is not alone.
    fn lit(&self, weights: &[[f32; 3]]) -> Image {
        let mut picture = Image::filled(self.side, self.side, [0.0; 3]);
        let values = 3 * self.pixels.len();
        let lamps = self.codes.chunks_exact(values.max(1)).zip(&self.scales).zip(weights);
        let lamps: Vec<(&[i8], [f32; 3])> = lamps
            .map(|((codes, scale), weight)| (codes, weight.map(|w| w * scale)))
            .filter(|(_, weight)| *weight != [0.0; 3])
            .collect();
        let sums: Vec<[f32; 3]> = (self.pixels.par_chunks(PIXELS).enumerate())
            .flat_map_iter(|(chunk, pixels)| {
                let mut sums = vec![[0.0; 3]; pixels.len()];
                let first = 3 * PIXELS * chunk;
                vectorized(
                    #[inline(always)]
                    || {
                        for (codes, weight) in &lamps {
                            add(&mut sums, &codes[first..][..3 * pixels.len()], *weight);
                        }
                    },
                );
                sums
            })
            .collect();
        for (&p, sum) in self.pixels.iter().zip(sums) {
            picture.pixels[p as usize] = sum;
        }
        picture
    }
}

/// Adds details of one lamp.
#[inline(always)]
fn add(sums: &mut [[f32; 3]], codes: &[i8], weight: [f32; 3]) {
    for (sum, code) in sums.iter_mut().zip(codes.as_chunks::<3>().0) {
        for c in 0..3 {
            let code = f32::from(code[c]);
            sum[c] += weight[c] * code * code.abs();
        }
    }
}

impl FineField {
    /// The frame's plate with this light, if there is any.
    #[must_use]
    pub fn on(fine: Option<Self>, plate: Plate) -> Plate {
        match fine {
            Some(fine) => {
                let light = fine.fine_light(&plate);
                plate.with_fine_light(Arc::new(light))
            }
            None => plate,
        }
    }

    /// The light at the plate's size.
    pub fn fine_light(self, plate: &Plate) -> impl FineLight + use<> {
        FineFrame { field: self, square: plate.square(), size: plate.size() }
    }
}

impl FineLight for FineFrame {
    fn is_ready(&self) -> bool {
        self.field.exemplars.get().is_some_and(Option::is_some)
    }

    fn ratio(&self, weights: &[[f32; 3]]) -> Option<Image> {
        let exemplars = self.field.exemplars.get()?.as_ref()?;
        let known = self.field.places.iter().filter_map(|place| Some((place, exemplars.poses.get(&place.pose)?)));
        let lit: Vec<(&Place, Image)> = known.map(|(place, pose)| (place, pose.lit(&place.turned(weights)))).collect();
        let (width, height) = self.size;
        let step = self.field.working as f32 / self.square.side;
        let at = |i: usize, from: f32| (i as f32 + 0.5 - from) * step - 0.5;
        let within = -0.5..self.field.working as f32 - 0.5;
        let mut ratio = Image::filled(width, height, [0.0; 3]);
        let rows = ratio.pixels.par_chunks_mut(width.max(1)).enumerate();
        rows.filter(|(y, _)| within.contains(&at(*y, self.square.y))).for_each(|(y, row)| {
            for (x, out) in row.iter_mut().enumerate() {
                let here = [at(x, self.square.x), at(y, self.square.y)];
                if !within.contains(&here[0]) {
                    continue;
                }
                let near = around(here, (self.field.working, self.field.working));
                for (place, lit) in &lit {
                    let share: f32 = near.iter().map(|&(q, w)| w * place.share.pixels[q]).sum();
                    if share < 1e-3 {
                        continue;
                    }
                    let scale = lit.width as f32 / self.field.working as f32;
                    let there: [f32; 2] = std::array::from_fn(|c| {
                        let offset: f32 = near.iter().map(|&(q, w)| w * place.offsets[q][c]).sum();
                        (here[c] + offset + 0.5) * scale - 0.5
                    });
                    for (q, w) in around(there, lit.size()) {
                        (0..3).for_each(|c| out[c] += share * w * lit.pixels[q][c]);
                    }
                }
            }
        });
        Some(ratio)
    }

    fn bytes(&self) -> usize {
        self.field.places.iter().map(Place::bytes).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn details_are_kept_to_a_part_of_their_size() {
        let pixels: Vec<u32> = (0..64).collect();
        let mut detail = PoseDetail::new(8, pixels);
        let lamp = |k: usize| -> Vec<f32> { (0..192).map(|i| ((i * (k + 3)) % 41) as f32 / 41.0 - 0.5).collect() };
        (0..2).for_each(|k| detail.push(&lamp(k)));
        let lit = detail.lit(&[[2.0, 0.0, 0.5], [0.0, -1.0, 0.5]]);
        for (i, value) in lit.pixels.as_flattened().iter().enumerate() {
            let weights = [[2.0, 0.0], [0.0, -1.0], [0.5, 0.5]][i % 3];
            let exact = weights[0] * lamp(0)[i] + weights[1] * lamp(1)[i];
            assert!((value - exact).abs() < 0.02, "{value} is not {exact}");
        }
        assert!(detail.lit(&[[0.0; 3]; 2]).pixels.iter().all(|pixel| *pixel == [0.0; 3]));
    }

    #[test]
    fn empty_and_black_subjects_have_no_detail() {
        for pixels in [Vec::new(), vec![0, 5]] {
            let values = vec![0.0; 3 * pixels.len()];
            let mut detail = PoseDetail::new(3, pixels);
            detail.push(&values);
            assert!(detail.lit(&[[1.0; 3]]).pixels.iter().all(|pixel| *pixel == [0.0; 3]));
        }
    }

    #[test]
    fn what_is_not_finite_has_no_detail_or_the_largest() {
        let pixels: Vec<u32> = (0..4).collect();
        let mut detail = PoseDetail::new(2, pixels);
        let (nan, infinite) = (f32::NAN, f32::INFINITY);
        detail.push(&[nan, infinite, -infinite, 0.5, -0.5, 0.25, nan, nan, nan, 0.5, 0.5, 0.5]);
        let lit = detail.lit(&[[1.0; 3]]);
        assert_eq!(lit.pixels[0], [0.0, 0.5, -0.5]);
        assert!(lit.pixels.iter().flatten().all(|v| v.is_finite()));
    }
}
