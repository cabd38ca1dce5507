//! The check that light layers give back what they are layers of.

use super::exr_still::written_light;
use super::layers::REST;
use super::listing::LayerListing;
use super::still::{About, no_light};
use base::error::{Error, Result};
use base::files::is_bare;
use compositor::Picture;
use exr::meta::MetaData;
use exr::prelude::{AnyChannels, FlatImage, FlatSamples, Layer};
use imaging::Image;
use imaging::file::{MAX_PIXELS, check_openexr};
use serde::Serialize;
use std::path::Path;

const REMEDY: &str = "Export it again with its light layers";
/// What a byte of a file can be at most once it is unpacked: deflate makes 1032 of one.
const MOST_PER_BYTE: u64 = 2048;
/// A residual that the rounding of half floats explains: half a step of 2⁻¹¹ for the layers, and as much for picture
/// and rest.
const ROUNDING: f32 = 1.0 / 1024.0;

/// How well layers gave back what they are layers of.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rebuild {
    /// Layers of a frame.
    pub layers: usize,
    /// The largest difference of a channel.
    pub residual: f32,
    /// The largest value that was to be given back.
    pub brightest: f32,
}

/// What a file's light layers add up to, each times its weight.
struct Sum {
    size: (usize, usize),
    /// Top left corner within the picture's frame.
    at: (usize, usize),
    layers: usize,
    /// Without rest.
    lamps: Vec<[f64; 3]>,
    rest: Option<Vec<[f64; 3]>>,
    beauty: Vec<[f64; 3]>,
}

type Part = Layer<AnyChannels<FlatSamples>>;

/// The sum of a file's light layers, each times the weight that its header says: the relit subject within the data
/// window, linear and as its alpha says.
///
/// # Errors
/// When the file cannot be read, or it has no light layers with weights.
pub fn rebuilt(path: &Path) -> Result<Image> {
    let sum = Sum::of(path)?;
    Ok(Image {
        width: sum.size.0,
        height: sum.size.1,
        pixels: (sum.lamps.into_iter())
            .map(|sum| sum.map(|v| v as f32))
            .collect(),
    })
}

impl Rebuild {
    /// Compares what the layers of the file `path` add up to with `subject` as `about` would write it.
    ///
    /// # Errors
    /// As [`rebuilt`].
    pub(super) fn of_written(path: &Path, subject: &Picture, about: &About) -> Result<Self> {
        let linear = subject.linear.as_ref().ok_or_else(|| no_light(path))?;
        let wanted = written_light(linear, subject, about.encoding, about.exr);
        Self::check(path, about.layers.map_or(0, |l| l.lamps.len()), &wanted)
    }

    /// Compares what the layers of the file `path`, `layers` in number, add up to with `wanted`.
    ///
    /// # Errors
    /// As [`rebuilt`].
    pub fn check(path: &Path, layers: usize, wanted: &Image) -> Result<Self> {
        let sum = Sum::of(path)?;
        let (x, y) = sum.at;
        if x + sum.size.0 > wanted.width || y + sum.size.1 > wanted.height {
            return Err(Error::bug(format!(
                "{} has another size than its picture",
                path.display()
            )));
        }
        let row = |(index, row): (usize, &[[f64; 3]])| {
            let wanted = &wanted.pixels[(y + index) * wanted.width + x..][..sum.size.0];
            Self::compare(layers, row, wanted.iter().map(|v| v.map(f64::from)))
        };
        let none = Self::compare(layers, &[], std::iter::empty());
        Ok(sum
            .lamps
            .chunks(sum.size.0)
            .enumerate()
            .map(row)
            .fold(none, Self::and))
    }

    /// Compares what the layers of an EXR add up to, rest included, with its picture.
    ///
    /// # Errors
    /// As [`rebuilt`].
    pub fn of_file(path: &Path) -> Result<Self> {
        let mut sum = Sum::of(path)?;
        if let Some(rest) = &sum.rest {
            for (sum, rest) in sum.lamps.iter_mut().zip(rest) {
                (0..3).for_each(|c| sum[c] += rest[c]);
            }
        }
        Ok(Self::compare(
            sum.layers,
            &sum.lamps,
            sum.beauty.into_iter(),
        ))
    }

    fn compare(layers: usize, sums: &[[f64; 3]], wanted: impl Iterator<Item = [f64; 3]>) -> Self {
        let (mut residual, mut brightest) = (0f64, 0f64);
        for (sum, wanted) in sums.iter().zip(wanted) {
            for c in 0..3 {
                // NaN in a file is a difference that no limit allows.
                let difference = (sum[c] - wanted[c]).abs();
                residual = residual.max(if difference.is_nan() {
                    f64::INFINITY
                } else {
                    difference
                });
                brightest = brightest.max(wanted[c].abs());
            }
        }
        Self {
            layers,
            residual: residual as f32,
            brightest: brightest as f32,
        }
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

    /// Whether no more is missing than half floats round away.
    pub fn is_exact(&self) -> bool {
        self.residual <= ROUNDING * self.brightest
    }

    /// Share of the brightest light that is missing.
    pub fn share(&self) -> f32 {
        self.residual / self.brightest.max(f32::MIN_POSITIVE)
    }

    /// What was found, in a sentence.
    pub fn sentence(&self) -> String {
        let percent = 100.0 * self.share();
        format!(
            "The {} light layers, weighted and added, equal the relit subject to within {:.2e}, {percent:.3} % of its \
             brightest light",
            self.layers, self.residual
        )
    }

    /// What was found in a file, in a sentence.
    pub fn file_sentence(&self, path: &Path) -> String {
        let percent = 100.0 * self.share();
        let verdict = if self.is_exact() {
            "no more than half floats round away"
        } else {
            "more than half floats round away: the picture or its layers were changed"
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
    fn of(path: &Path) -> Result<Self> {
        let file = read(path)?;
        let listing = LayerListing::of(path)?;
        let first = (file.layer_data.first())
            .ok_or_else(|| Error::invalid(format!("{} has no part", path.display()), REMEDY))?;
        let window = first.size;
        let pixels = window.area();
        let corner = first.attributes.layer_position - file.attributes.display_window.position;
        let mut lamps = vec![[0f64; 3]; pixels];
        for entry in &listing.lamps {
            let weight = entry.weight.map(f64::from);
            add(
                path,
                &file,
                &entry.layer,
                entry.file.as_deref(),
                weight,
                &mut lamps,
            )?;
        }
        let mut beauty = vec![[0f64; 3]; pixels];
        add_channels(path, first, "", [1.0; 3], &mut beauty)?;
        let rest = listing.rest.as_ref().map(|layer| {
            let (mut rest, file_name) = (vec![[0f64; 3]; pixels], layer.file.as_deref());
            add(path, &file, REST, file_name, [1.0; 3], &mut rest).map(|()| rest)
        });
        Ok(Self {
            size: (window.width(), window.height()),
            at: (corner.x().max(0) as usize, corner.y().max(0) as usize),
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
                format!(
                    "{} names a layer's file {name:?}, which is no name alone",
                    path.display()
                ),
                REMEDY,
            ));
        }
        let path = path.with_file_name(name);
        let file = read(&path)?;
        let first = file
            .layer_data
            .first()
            .ok_or_else(|| missing(&path, "part"))?;
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

fn add_channels(
    path: &Path,
    part: &Part,
    prefix: &str,
    weight: [f64; 3],
    sums: &mut [[f64; 3]],
) -> Result<()> {
    for (c, color) in ["R", "G", "B"].into_iter().enumerate() {
        let name = format!("{prefix}{color}");
        let channel = (part.channel_data.list.iter())
            .find(|channel| channel.name.eq(&name))
            .ok_or_else(|| missing(path, &format!("channel {name}")))?;
        if channel.sample_data.len() != sums.len() {
            return Err(Error::invalid(
                format!(
                    "{} has a layer of another size than its picture",
                    path.display()
                ),
                REMEDY,
            ));
        }
        for (sum, value) in sums.iter_mut().zip(channel.sample_data.values_as_f32()) {
            sum[c] += weight[c] * f64::from(value);
        }
    }
    Ok(())
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

/// Reads all parts, unless they claim more pixels than the file can hold.
fn read(path: &Path) -> Result<FlatImage> {
    let fail = |e: exr::error::Error| Error::codec("read", path, e, REMEDY);
    let wrong = |problem: String| Error::invalid(format!("{}: {problem}", path.display()), REMEDY);
    let opened = base::files::open(path).map_err(|e| Error::io("open", path, e, REMEDY))?;
    let length = (opened.metadata().map(|data| data.len()))
        .map_err(|e| Error::io("read", path, e, REMEDY))?;
    let reader = std::io::BufReader::new(opened);
    let parts = MetaData::read_from_buffered(reader, false)
        .map_err(fail)?
        .headers;
    check_openexr(&parts).map_err(wrong)?;
    let mut bytes = 0u64;
    for part in &parts {
        let pixels = part.layer_size.0 as u64 * part.layer_size.1 as u64;
        if pixels > MAX_PIXELS as u64 {
            return Err(wrong(format!(
                "it claims to have {pixels} pixels, and at most {MAX_PIXELS} are read"
            )));
        }
        bytes = bytes.saturating_add(pixels.saturating_mul(part.channels.bytes_per_pixel as u64));
    }
    if bytes > length.saturating_mul(MOST_PER_BYTE) {
        return Err(wrong(format!(
            "it claims to hold {bytes} bytes of pixels in {length} bytes"
        )));
    }
    exr::prelude::read_all_flat_layers_from_file(path).map_err(fail)
}
