//! Pass `plate`: light is smooth, detail is in the plate. The sum of lamps says how the light *changes* each pixel of
//! the working size; that ratio is brought to the plate's size, where it multiplies the plate's own pixels.
//!
//! With the plate's light P, a floor ε against noise in the dark, the matte α, and D for the mean over what one pixel of
//! the working size covers: ratio r = relit ÷ D(P + ε), picture = α · P · U(r) ÷ U(r₀). r₀ = D(P) ÷ D(P + ε) is the ratio
//! under the light that the plate was filmed in, which so gives the plate back. Where D(P) is below half of ε, dark noise
//! would be multiplied: the picture turns into α · (P + ε) · U(r). D takes pixels of the plate that lie in two of the
//! working size by their shares, as the network's picture does. U is Catmull and Rom's cubic, which keeps what it
//! interpolates: a step of back-projection behind it brings the mean nearer and rings at the shadows of
//! single lamps (`benches/plate.rs` measures the ways there are). Plate and matte alone decide the operation, and it is
//! linear in the light: pictures under single lamps add up to the picture under all of them. So nothing is clamped: the
//! cubic swings below zero beside the hard shadow of a single lamp, which a display shows as black.

use super::cubic::Taps;
use super::descriptor::{Descriptor, Run, decide};
use super::edges::extend_edges;
use super::facts::key;
use super::passes::{GpuPicture, PicturePasses, Recording, Shader, extent};
use base::error::{Error, Result};
use bytemuck::{Pod, Zeroable, bytes_of};
use footage::{FilmedFrame, Frame};
use half::f16;
use imaging::{Image, Mask, Raster, resample::resize_area};
use rayon::prelude::*;
use reflectance::kernels::chunks::vectorized;
use scene::Pass;
use std::collections::VecDeque;
use std::sync::Arc;

pub(super) const SHADER: Shader = Shader::new("plate", include_str!("../../../shaders/plate.wgsl"));

pub(crate) const PLATE: Descriptor = Descriptor {
    fixed: |_| Some("the picture's size decides"),
    settings: |context| key((context.facts.plate, context.facts.fine_light)),
    reads: |context, planned| {
        let before = planned.last().map_or(0, |before| before.key);
        key((before, context.facts.inputs.frame))
    },
    shader: Some(&SHADER),
    run: Run::Composed,
    ..Descriptor::new(Pass::Plate, |context| {
        let (width, height) = context.facts.plate.unwrap_or_default();
        decide(
            context.facts.plate.is_some(),
            || {
                let fine = if context.facts.fine_light { ", with the exemplars' fine shadows and glints" } else { "" };
                format!("the light is brought to the plate's {width} × {height} pixels{fine}")
            },
            "the picture is as large as the plate",
        )
    })
};

/// Light added to the plate's, as a share of its mean: a ratio in the dark stays finite and does not multiply noise.
/// Measured on a shoot with its truth, 0 to 2 % are equally good there, and 10 % lose up to 0.7 dB.
const FLOOR: f32 = 0.01;

/// Ratios under the plate's own light between which the floor fades out: [`FLOOR`]'s eighth and half.
const FADE: [f32; 2] = [1.0 / 9.0, 1.0 / 3.0];

/// The smallest floor, for a plate that is black.
const LEAST_FLOOR: f32 = 1e-6;

/// A frame's plate, ready to be multiplied by light that was summed at the working size.
#[derive(Clone, Debug)]
pub struct Plate {
    /// The subject's coverage, at the plate's size.
    pub matte: Mask,
    /// The plate as it was filmed.
    filmed: Arc<Raster<[f16; 3]>>,
    /// What the enlarged ratio multiplies: the plate's light, its edge in the colour of the solid subject next to it, and
    /// the floor, by the ratio under the plate's own light, times the matte.
    lit: Image,
    square: PlateSquare,
    nodes: Arc<Nodes>,
    pub(crate) fine: Option<Arc<dyn FineLight>>,
}

/// The square of a plate that the network sees, in the plate's pixels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlateSquare {
    /// Its left edge, to the right of the plate's.
    pub x: f32,
    /// Its upper edge, below the plate's.
    pub y: f32,
    /// Columns and rows.
    pub side: f32,
}

/// Light within a pixel of the working size: shadow edges, pores, glints. [`Plate::relit`] lacks it.
pub trait FineLight: std::fmt::Debug + Send + Sync {
    /// False while it is being read.
    fn is_ready(&self) -> bool;

    /// Amount added to the ratio of each pixel of the plate under these lamp weights, and linear in them. None while it is
    /// being read.
    fn ratio(&self, weights: &[[f32; 3]]) -> Option<Image>;

    /// Memory that it takes for this frame, in bytes.
    fn bytes(&self) -> usize;
}

/// The pixels of the working size.
#[derive(Debug)]
struct Nodes {
    size: usize,
    each: Vec<Node>,
}

/// A pixel of the working size.
#[derive(Clone, Copy, Debug)]
struct Node {
    /// The nearest pixel that holds some of the subject, whose ratio it takes; often itself.
    source: u32,
    /// The mean of the plate's light and the floor over the subject in it; at the edge that of the solid subject next to it.
    look: [f32; 3],
}

/// The [`Taps`] of each of `length` pixels of the plate among `size` of the working size; the square begins at `start`.
fn taps(length: usize, start: f32, side: f32, size: usize) -> Vec<Taps> {
    let step = size as f32 / side;
    let at = |i: usize| Taps::at((i as f32 + 0.5 - start) * step - 0.5, size);
    (0..length).map(at).collect()
}

/// For each of `size` pixels of the working size, the pixels of the plate that it covers along an axis, and how much of
/// each.
fn covered(length: usize, start: f32, side: f32, size: usize) -> Vec<Vec<(usize, f32)>> {
    let (start, step) = (f64::from(start), f64::from(side) / size as f64);
    let pixels_of = |node: usize| {
        let from = start + node as f64 * step;
        let to = from + step;
        let pixels = from.max(0.0) as usize..(to.max(0.0).ceil() as usize).min(length);
        let share = |i: usize| (i, (to.min(i as f64 + 1.0) - from.max(i as f64)) as f32);
        pixels.map(share).filter(|&(_, share)| share > 1e-6).collect()
    };
    (0..size).map(pixels_of).collect()
}

/// The pixel of the working size, of `size`, that a plate's pixel belongs to; None beyond the square.
fn cell(i: usize, start: f32, side: f32, size: usize) -> Option<usize> {
    let at = (i as f32 + 0.5 - start) * size as f32 / side;
    (at >= 0.0 && at < size as f32).then_some(at as usize)
}

impl Plate {
    /// Prepares a frame: `radiance` and `matte` are the plate as it was filmed, linear, and the subject's coverage;
    /// `square` is what `working`, the matte at the working size, shows of it. The plate may end within the square, and
    /// the square within the plate; beyond the square the ratio at its edge goes on.
    ///
    /// # Errors
    /// When plate and matte differ in size, one of them is empty, or `working` is not square.
    pub fn new(mut radiance: Image, matte: Mask, square: PlateSquare, working: &Mask) -> Result<Self> {
        let size = working.width;
        let (width, height) = matte.size();
        let is_sized = radiance.size() == (width, height) && working.height == size;
        let is_empty = width * height * size == 0 || square.side.is_nan() || square.side <= 0.0;
        if !is_sized || is_empty {
            return Err(Error::invalid(
                format!(
                    "a plate of {} × {} pixels, a matte of {width} × {height} and a working size of {size} × {} do not \
                     belong together",
                    radiance.width, radiance.height, working.height
                ),
                "Give frame and matte the same size, and make the network's square at least a pixel wide",
            ));
        }
        let filmed = Arc::new(radiance.map(|pixel| pixel.map(f16::from_f32)));
        extend_edges(&mut radiance, &matte);
        let floor = floor(&radiance, &matte);
        let mut lit = radiance;
        let pixels = lit.pixels.par_iter_mut().zip(&matte.pixels);
        pixels.with_min_len(4096).for_each(|(pixel, &alpha)| {
            *pixel = pixel.map(|v| alpha * (v.max(0.0) + floor));
        });
        let nodes = Arc::new(Nodes::new(&lit, &matte, square, working));
        let own = enlarged(&nodes.own_ratio(floor), size, square, &lit);
        let pixels = lit.pixels.par_iter_mut().zip(&own.pixels).zip(&matte.pixels);
        pixels.with_min_len(4096).for_each(|((pixel, own), &alpha)| {
            for (value, own) in pixel.iter_mut().zip(own) {
                let ratio = if *value > 0.0 { own / *value } else { 0.0 };
                let share = ((ratio - FADE[0]) / (FADE[1] - FADE[0])).clamp(0.0, 1.0);
                if share > 0.0 {
                    *value += share * ((*value - alpha * floor) / ratio - *value);
                }
            }
        });
        Ok(Self { matte, filmed, lit, square, nodes, fine: None })
    }

    /// The square that the network sees, in the plate's pixels.
    pub fn square(&self) -> PlateSquare {
        self.square
    }

    /// The light that the enlarged ratio multiplies: the plate's and a floor, times the matte.
    pub fn lit(&self) -> &Image {
        &self.lit
    }

    /// The plate of a frame; `frame` is the same one at the working size.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn from_filmed(filmed: FilmedFrame, frame: &Frame) -> Result<Self> {
        let FilmedFrame { plate, mask, framing } = filmed;
        let square = PlateSquare { x: framing.x as f32, y: framing.y as f32, side: framing.side as f32 };
        Self::new(plate, mask, square, &frame.mask)
    }

    /// A plate of the same size that shows nothing but the light of another subject, whose matte at the working size is
    /// `working`: what is lit with it is only enlarged.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn without_detail(&self, working: &Mask) -> Result<Self> {
        let (width, height) = self.size();
        let PlateSquare { x, y, side } = self.square;
        let columns = taps(width, x, side, working.width);
        let rows = taps(height, y, side, working.height);
        let inside = |i: usize, start: f32| (0.0..side).contains(&(i as f32 + 0.5 - start));
        let matte = Mask::from_fn(width, height, |i, j| {
            if !(inside(i, x) && inside(j, y)) {
                return 0.0;
            }
            let along = |row: usize| columns[i].sum(|column| [working.at(column, row)]);
            rows[j].sum(along)[0].clamp(0.0, 1.0)
        });
        Self::new(Image::filled(width, height, [1.0; 3]), matte, self.square, working)
    }

    /// The plate as it was filmed, background included, to 11 bits: for what is measured and shown of it.
    pub fn filmed(&self) -> Image {
        self.filmed.map(|pixel| pixel.map(f16::to_f32))
    }

    /// The pixel of the working size that a pixel of the plate belongs to; None beyond the square.
    pub fn working_pixel(&self, [x, y]: [usize; 2]) -> Option<[usize; 2]> {
        let size = self.nodes.size;
        let column = cell(x, self.square.x, self.square.side, size)?;
        Some([column, cell(y, self.square.y, self.square.side, size)?])
    }

    /// The place on the plate of a point of the working size, in columns and rows of each.
    pub fn filmed_place(&self, at: [f32; 2]) -> [f32; 2] {
        let PlateSquare { x, y, side } = self.square;
        let scale = side / self.nodes.size.max(1) as f32;
        let along = |at: f32, from: f32| from + (at + 0.5) * scale - 0.5;
        [along(at[0], x), along(at[1], y)]
    }

    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        self.matte.size()
    }

    /// The memory that it takes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.lit.pixels[..])
            + size_of_val(&self.filmed.pixels[..])
            + size_of_val(&self.matte.pixels[..])
            + size_of_val(&self.nodes.each[..])
            + self.fine.as_ref().map_or(0, |fine| fine.bytes())
    }

    /// True if light of `size` pixels has to be brought to this plate: not if both are the same picture.
    pub(crate) fn is_larger(&self, size: (usize, usize)) -> bool {
        let whole = PlateSquare { x: 0.0, y: 0.0, side: size.0 as f32 };
        (self.size(), self.square) != (size, whole)
    }

    /// The same plate at a `factor`-th of its width and height, rounded up, for pictures that have to be there soon;
    /// [`Self::filmed`] keeps its size. Light is no finer than the working size.
    #[must_use]
    pub fn shrunk(&self, factor: usize) -> Self {
        let (width, height) = self.size();
        let (columns, rows) = (width.div_ceil(factor), height.div_ceil(factor));
        let along = columns as f32 / width as f32;
        Self {
            matte: resize_area(&self.matte, columns, rows),
            filmed: self.filmed.clone(),
            lit: resize_area(&self.lit, columns, rows),
            square: PlateSquare { x: self.square.x * along, y: self.square.y * along, side: self.square.side * along },
            nodes: self.nodes.clone(),
            fine: None,
        }
    }

    /// The subject at the plate's size, premultiplied by its matte. `relit` is what [`super::reference::relight`] sums
    /// at the working size, premultiplied by `working`, the matte there, and finite. Beside hard shadows of single lamps
    /// the result may be negative.
    ///
    /// # Panics
    /// When `relit` or `working` has another size than the one that the plate was prepared for.
    pub fn relit(&self, relit: &Image, working: &Mask) -> Image {
        let size = self.nodes.size;
        assert_eq!((relit.size(), working.size()), ((size, size), (size, size)));
        enlarged(&self.nodes.ratio(relit, working), size, self.square, &self.lit)
    }
}

/// U of `size` × `size` ratios that lie in `square`, times `lit`.
fn enlarged(ratio: &[[f32; 3]], size: usize, square: PlateSquare, lit: &Image) -> Image {
    let ((width, height), PlateSquare { x, y, side }) = (lit.size(), square);
    // Across first, for the few rows of the working size; the rest goes straight through memory.
    let columns = taps(width, x, side, size);
    let mut wide = vec![[0f32; 3]; width * size];
    let lines = wide.par_chunks_mut(width).zip(ratio.par_chunks(size));
    lines.for_each(|(line, ratio)| {
        for (pixel, taps) in line.iter_mut().zip(&columns) {
            *pixel = taps.sum(|i| ratio[i]);
        }
    });
    let rows = taps(height, y, side, size);
    let mut picture = Image::filled(width, height, [0.0; 3]);
    let lines = picture.pixels.par_chunks_mut(width);
    let lines = lines.zip(lit.pixels.par_chunks(width)).zip(rows);
    lines.with_min_len(8).for_each(|((line, lit), taps)| {
        let near = taps.places.map(|row| wide[row * width..][..width].as_flattened());
        vectorized(
            #[inline(always)]
            || multiply(line.as_flattened_mut(), lit.as_flattened(), near, taps.shares),
        );
    });
    picture
}

/// `lit` times the sum of four rows, each times its share.
#[inline(always)]
fn multiply(line: &mut [f32], lit: &[f32], rows: [&[f32]; 4], shares: [f32; 4]) {
    let lit = &lit[..line.len()];
    let rows = rows.map(|row| &row[..line.len()]);
    for (i, value) in line.iter_mut().enumerate() {
        let mut ratio = 0.0;
        for k in 0..4 {
            ratio += shares[k] * rows[k][i];
        }
        *value = lit[i] * ratio;
    }
}

/// Light added to that of a plate.
fn floor(radiance: &Image, matte: &Mask) -> f32 {
    let (mut sum, mut covered) = (0f64, 0f64);
    for (pixel, &alpha) in radiance.pixels.iter().zip(&matte.pixels) {
        let light: f32 = pixel.iter().map(|v| v.max(0.0)).sum();
        sum += f64::from(alpha * light) / 3.0;
        covered += f64::from(alpha);
    }
    let mean = if covered > 0.0 { sum / covered } else { 0.0 };
    (FLOOR * mean as f32).max(LEAST_FLOOR)
}

impl Nodes {
    fn new(lit: &Image, matte: &Mask, square: PlateSquare, working: &Mask) -> Self {
        let size = working.width;
        let PlateSquare { x, y, side } = square;
        let columns = covered(matte.width, x, side, size);
        let rows = covered(matte.height, y, side, size);
        // Light, and then coverage.
        let mut sums = vec![([0f32; 3], 0f32); size * size];
        let lines = sums.par_chunks_mut(size).zip(rows);
        lines.for_each(|(sums, rows)| {
            for (row, high) in rows {
                for ((light, covered), columns) in sums.iter_mut().zip(&columns) {
                    for &(column, wide) in columns {
                        let (pixel, share) = (lit.at(column, row), high * wide);
                        (0..3).for_each(|c| light[c] += share * pixel[c]);
                        *covered += share * matte.at(column, row);
                    }
                }
            }
        });
        let known = |i: usize| sums[i].1 > 0.0 && working.pixels[i] > 0.0;
        let sources = nearest(size, known).into_iter();
        let look = sums.iter().map(|(light, covered)| {
            let mean = |v: f32| if v > 0.0 { v / covered } else { 1.0 };
            light.map(mean)
        });
        let mut look = Image { width: size, height: size, pixels: look.collect() };
        // At the subject's edge the sum of lamps shows the solid subject next to it, and so must the look: the ratio of
        // one thing under two lights says something, that of two things nothing.
        extend_edges(&mut look, working);
        let nodes = sources.zip(look.pixels);
        Self { size, each: nodes.map(|(source, look)| Node { source, look }).collect() }
    }

    /// r₀ at every pixel, of a plate with `floor` in its look.
    fn own_ratio(&self, floor: f32) -> Vec<[f32; 3]> {
        let look = |node: &Node| self.each[node.source as usize].look;
        self.each.iter().map(|node| look(node).map(|v| 1.0 - floor / v)).collect()
    }

    /// r at every pixel.
    fn ratio(&self, relit: &Image, working: &Mask) -> Vec<[f32; 3]> {
        let ratio = |node: &Node| {
            let source = node.source as usize;
            let (light, alpha) = (relit.pixels[source], working.pixels[source]);
            let look = self.each[source].look;
            let per_coverage = if alpha > 0.0 { 1.0 / alpha } else { 0.0 };
            [0, 1, 2].map(|c| light[c] * per_coverage / look[c])
        };
        self.each.iter().map(ratio).collect()
    }

    /// As the shader `plate` reads it: the look of each pixel, with its source as the fourth value.
    fn texels(&self) -> (Image, Mask) {
        let (width, height) = (self.size, self.size);
        let looks = Image { width, height, pixels: self.each.iter().map(|node| node.look).collect() };
        // Whole numbers up to 2²⁴ are exact: working sizes up to 4096.
        let sources = self.each.iter().map(|node| node.source as f32);
        let sources = Mask { width, height, pixels: sources.collect() };
        (looks, sources)
    }
}

/// For each of `size` × `size` pixels the nearest that is known, in steps to the four sides; itself if none is.
fn nearest(size: usize, known: impl Fn(usize) -> bool) -> Vec<u32> {
    let mut source: Vec<Option<u32>> = vec![None; size * size];
    let mut queue: VecDeque<usize> = (0..size * size).filter(|&i| known(i)).collect();
    for &i in &queue {
        source[i] = Some(i as u32);
    }
    while let Some(i) = queue.pop_front() {
        let (x, y) = (i % size, i / size);
        let sides = [
            (x > 0).then(|| i - 1),
            (x + 1 < size).then(|| i + 1),
            (y > 0).then(|| i - size),
            (y + 1 < size).then(|| i + size),
        ];
        for side in sides.into_iter().flatten() {
            if source[side].is_none() {
                source[side] = source[i];
                queue.push_back(side);
            }
        }
    }
    let or_itself = |(i, source): (usize, Option<u32>)| source.unwrap_or(i as u32);
    source.into_iter().enumerate().map(or_itself).collect()
}

/// A plate on the GPU.
#[derive(Clone, Debug)]
pub(crate) struct GpuPlate {
    /// The picture that the light multiplies, with the matte as its fourth value.
    pub lit: GpuPicture,
    nodes: GpuPicture,
    size: usize,
    square: PlateSquare,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(crate) struct PlateParams {
    pub size: [u32; 2],
    nodes: u32,
    step: f32,
    start: [f32; 2],
    unused: [f32; 2],
}

impl PicturePasses {
    /// Copies a plate to the GPU.
    ///
    /// # Errors
    /// When it is larger than what the GPU binds at once.
    pub(crate) fn upload_plate(&self, plate: &Plate) -> Result<GpuPlate> {
        let (nodes, sources) = plate.nodes.texels();
        Ok(GpuPlate {
            lit: self.upload(&plate.lit, &plate.matte)?,
            nodes: self.upload(&nodes, &sources)?,
            size: plate.nodes.size,
            square: plate.square,
        })
    }
}

impl Recording<'_> {
    /// [`Plate::relit`] on the GPU: `subject` is premultiplied, with its matte at the working size as its fourth value,
    /// and the result with the plate's matte.
    ///
    /// # Errors
    /// When the GPU cannot hold the result.
    pub(crate) fn plate(&mut self, subject: &GpuPicture, plate: &GpuPlate) -> Result<GpuPicture> {
        let PlateSquare { x, y, side } = plate.square;
        let params = |size| PlateParams {
            size: extent(size),
            nodes: plate.size as u32,
            step: plate.size as f32 / side,
            start: [x, y],
            unused: [0.0; 2],
        };
        let small = subject.size();
        let (shader, nodes) = ((&SHADER, "ratio"), Some(&plate.nodes));
        let ratio = self.run(shader, bytes_of(&params(small)), subject, nodes, small)?;
        let size = plate.lit.size();
        let (shader, lit) = ((&SHADER, "enlarge"), Some(&plate.lit));
        self.run(shader, bytes_of(&params(size)), &ratio, lit, size)
    }
}

#[cfg(test)]
#[path = "plate_tests.rs"]
mod tests;
