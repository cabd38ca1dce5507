//! The check that light layers give back what they are layers of.

use super::exr_file::{ExrFile, Part};
use super::layers::REST;
use super::listing::LayerListing;
use base::error::{Error, Result};
use base::files::is_bare;
use exr::prelude::{AnyChannel, FlatImage, FlatSamples};
use half::slice::HalfFloatSliceExt;
use imaging::Image;
use rayon::prelude::*;
use serde::Serialize;
use std::path::Path;

const REMEDY: &str = "Export it again with its light layers";
/// A residual that the rounding of half floats explains: half a step of 2⁻¹¹ for the layers, and as much for picture
/// and rest.
const ROUNDING: f32 = 1.0 / 1024.0;

/// Accuracy with which layers gave back their picture.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rebuild {
    /// Layers of a frame.
    pub layers: usize,
    /// The largest difference of a channel.
    pub residual: f32,
    /// The largest value that was to be given back.
    pub brightest: f32,
}

/// Sum of a file's light layers, each times its weight.
struct Sum {
    size: (usize, usize),
    layers: usize,
    /// Without rest.
    lamps: Vec<[f64; 3]>,
    rest: Option<Vec<[f64; 3]>>,
    beauty: Vec<[f64; 3]>,
}

/// The sum of a file's light layers, each times the weight that its header says: the relit subject within the data
/// window, linear and as its alpha says.
///
/// # Errors
/// When the file cannot be read, or it has no light layers with weights.
pub fn rebuilt(path: &Path) -> Result<Image> {
    let sum = Sum::from_path(path)?;
    Ok(Image {
        width: sum.size.0,
        height: sum.size.1,
        pixels: (sum.lamps.into_iter()).map(|sum| sum.map(|v| v as f32)).collect(),
    })
}

impl Rebuild {
    /// Compares the sum of layers, each times its weight, with `subject` as the file `path` would hold it before
    /// compression, which rounds in PXR24 alone.
    ///
    /// # Errors
    /// When more is missing than half floats round away.
    pub(super) fn of_channels(
        path: &Path,
        layers: &[([f32; 3], &[AnyChannel<FlatSamples>; 3])],
        subject: &[[f32; 3]],
    ) -> Result<Self> {
        // Their sums fit a core's cache.
        const PIXELS: usize = 2048;
        let part = |(index, subject): (usize, &[[f32; 3]])| {
            let mut sums = vec![[0.0; 3]; subject.len()];
            for (weight, channels) in layers {
                for (c, channel) in channels.iter().enumerate() {
                    let weight = f64::from(weight[c]);
                    add_samples(&channel.sample_data, index * PIXELS, weight, &mut sums, c);
                }
            }
            let subject = subject.iter().map(|v| v.map(f64::from));
            Self::compare(layers.len(), &sums, subject)
        };
        let parts = subject.par_chunks(PIXELS).enumerate().map(part);
        let nothing = || Self { layers: layers.len(), residual: 0.0, brightest: 0.0 };
        let found = parts.reduce(nothing, Self::and);
        if found.is_exact() {
            return Ok(found);
        }
        Err(Error::invalid(
            format!(
                "{} was not written: its {} light layers, weighted and added, miss the relit subject by {:.2e}, \
                 {:.3} % of its brightest light, beyond half-float rounding",
                path.display(),
                found.layers,
                found.residual,
                100.0 * found.share()
            ),
            "Export light layers in a colour space that is linear in light, or export without them",
        ))
    }

    /// Compares what the layers of an EXR add up to, rest included, with its picture.
    ///
    /// # Errors
    /// As [`rebuilt`].
    pub fn of_file(path: &Path) -> Result<Self> {
        Sum::from_path(path).map(Self::of_sum)
    }

    /// The same of a file that has been decoded.
    ///
    /// # Errors
    /// When a layer is not there, has another size than the picture, or its own file cannot be read.
    pub(super) fn of_image(path: &Path, file: &FlatImage, layers: &LayerListing) -> Result<Self> {
        Sum::of_image(path, file, layers).map(Self::of_sum)
    }

    fn of_sum(mut sum: Sum) -> Self {
        if let Some(rest) = &sum.rest {
            for (sum, rest) in sum.lamps.iter_mut().zip(rest) {
                (0..3).for_each(|c| sum[c] += rest[c]);
            }
        }
        Self::compare(sum.layers, &sum.lamps, sum.beauty.into_iter())
    }

    fn compare(layers: usize, sums: &[[f64; 3]], wanted: impl Iterator<Item = [f64; 3]>) -> Self {
        let (mut residual, mut brightest) = (0f64, 0f64);
        for (sum, wanted) in sums.iter().zip(wanted) {
            for c in 0..3 {
                // NaN in a file is a difference that no limit allows.
                let difference = (sum[c] - wanted[c]).abs();
                residual = residual.max(if difference.is_nan() { f64::INFINITY } else { difference });
                brightest = brightest.max(wanted[c].abs());
            }
        }
        Self { layers, residual: residual as f32, brightest: brightest as f32 }
    }

    /// The worse of two frames.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            layers: self.layers,
            residual: self.residual.max(other.residual),
            brightest: self.brightest.max(other.brightest),
        }
    }

    /// True if no more is missing than half floats round away.
    pub fn is_exact(&self) -> bool {
        self.residual.is_finite() && self.residual <= ROUNDING * self.brightest
    }

    /// Share of the brightest light that is missing.
    pub fn share(&self) -> f32 {
        self.residual / self.brightest.max(f32::MIN_POSITIVE)
    }

    /// Result, in a sentence.
    pub fn sentence(&self) -> String {
        let percent = 100.0 * self.share();
        format!(
            "The {} light layers, weighted and added, equal the relit subject to within {:.2e}, {percent:.3} % of its \
             brightest light",
            self.layers, self.residual
        )
    }

    /// Result for a file, in a sentence.
    pub fn file_sentence(&self, path: &Path) -> String {
        let percent = 100.0 * self.share();
        let verdict = if self.is_exact() {
            "within half-float rounding"
        } else {
            "beyond half-float rounding: the picture or its layers were changed"
        };
        format!(
            "{}: its {} light layers, weighted and added, give back the picture to within {:.2e}, {percent:.3} % of its \
             brightest light, {verdict}",
            path.display(),
            self.layers,
            self.residual
        )
    }
}

impl Sum {
    fn from_path(path: &Path) -> Result<Self> {
        let file = ExrFile::open(path, REMEDY)?;
        let layers = LayerListing::of_parts(path, &file.parts)?;
        Self::of_image(path, &file.decode(path, REMEDY)?, &layers)
    }

    fn of_image(path: &Path, file: &FlatImage, listing: &LayerListing) -> Result<Self> {
        let first = (file.layer_data.first()).ok_or_else(|| missing(path, "part"))?;
        let window = first.size;
        let pixels = window.area();
        let mut lamps = vec![[0f64; 3]; pixels];
        for entry in &listing.lamps {
            let weight = entry.weight.map(f64::from);
            add(path, file, &entry.layer, entry.file.as_deref(), weight, &mut lamps)?;
        }
        let mut beauty = vec![[0f64; 3]; pixels];
        add_channels(path, first, "", [1.0; 3], &mut beauty)?;
        let rest = listing.rest.as_ref().map(|layer| {
            let (mut rest, file_name) = (vec![[0f64; 3]; pixels], layer.file.as_deref());
            add(path, file, REST, file_name, [1.0; 3], &mut rest).map(|()| rest)
        });
        Ok(Self {
            size: (window.width(), window.height()),
            layers: listing.lamps.len(),
            lamps,
            rest: rest.transpose()?,
            beauty,
        })
    }
}

/// Adds a layer times its weight, from wherever it is: another file, a part, or channels beside the picture's.
fn add(
    path: &Path,
    picture: &FlatImage,
    layer: &str,
    file: Option<&str>,
    weight: [f64; 3],
    sums: &mut [[f64; 3]],
) -> Result<()> {
    if let Some(name) = file {
        if !is_bare(name) {
            return Err(Error::invalid(
                format!("{} names a layer's file {name:?}: expected a file name without a folder", path.display()),
                REMEDY,
            ));
        }
        let path = path.with_file_name(name);
        let file = ExrFile::open(&path, REMEDY)?.decode(&path, REMEDY)?;
        let first = file.layer_data.first().ok_or_else(|| missing(&path, "part"))?;
        return add_channels(&path, first, "", weight, sums);
    }
    match part(picture, layer) {
        Some(part) => add_channels(path, part, "", weight, sums),
        None => match picture.layer_data.first() {
            Some(first) => add_channels(path, first, &format!("{layer}."), weight, sums),
            None => Err(missing(path, "part")),
        },
    }
}

fn add_channels(path: &Path, part: &Part, prefix: &str, weight: [f64; 3], sums: &mut [[f64; 3]]) -> Result<()> {
    for (c, color) in ["R", "G", "B"].into_iter().enumerate() {
        let name = format!("{prefix}{color}");
        let channel = (part.channel_data.list.iter())
            .find(|channel| channel.name.eq(&name))
            .ok_or_else(|| missing(path, &format!("channel {name}")))?;
        if channel.sample_data.len() != sums.len() {
            return Err(Error::invalid(
                format!("{} has a layer of another size than its picture", path.display()),
                REMEDY,
            ));
        }
        add_samples(&channel.sample_data, 0, weight[c], sums, c);
    }
    Ok(())
}

/// Adds samples from `start` on, times a weight, to channel `c` of the sums.
fn add_samples(samples: &FlatSamples, start: usize, weight: f64, sums: &mut [[f64; 3]], c: usize) {
    let mut floats = vec![0.0; sums.len()];
    let end = start + sums.len();
    match samples {
        FlatSamples::F16(values) => values[start..end].convert_to_f32_slice(&mut floats),
        FlatSamples::F32(values) => floats.copy_from_slice(&values[start..end]),
        FlatSamples::U32(values) => {
            floats.iter_mut().zip(&values[start..end]).for_each(|(f, v)| *f = *v as f32);
        }
    }
    for (sum, value) in sums.iter_mut().zip(floats) {
        sum[c] += weight * f64::from(value);
    }
}

fn part<'a>(file: &'a FlatImage, name: &str) -> Option<&'a Part> {
    let is_named = |part: &&Part| {
        let found = part.attributes.layer_name.as_ref();
        found.is_some_and(|found| found.eq(name))
    };
    file.layer_data.iter().find(is_named)
}

fn missing(path: &Path, what: &str) -> Error {
    Error::missing(format!("{} has no {what}", path.display()), REMEDY)
}
