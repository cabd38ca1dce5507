//! The subject under each lamp alone, as layers of an EXR, and the check that the layers times their weights
//! give back the relit subject.
//!
//! Layer `light_07` is the subject as lamp 7 at weight 1 shows it, premultiplied by its coverage. The header's
//! attribute `lightWeights` says in JSON which lamp each layer is of and with what weight per channel it
//! goes into the picture, exposure included. What is behind the subject and what effects do are not in it.

use super::exr_channels::color_channels;
use base::error::{Error, Result};
use compositor::Field;
use compositor::reference::extend_edges;
use exr::meta::attribute::{AttributeValue, Text};
use exr::prelude::{AnyChannel, FlatSamples};
use imaging::resample::resize;
use imaging::{Image, Mask};
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The header's attribute.
const WEIGHTS: &str = "lightWeights";

/// The layers of one frame, in the order of the lamps.
#[derive(Clone, Debug, PartialEq)]
pub struct LightLayers(pub Vec<LightLayer>);

/// What one lamp shows.
#[derive(Clone, Debug, PartialEq)]
pub struct LightLayer {
    /// The lamp's name.
    pub lamp: String,
    /// Its weight per channel in the frame.
    pub weight: [f32; 3],
    /// The subject under the lamp at weight 1: linear, premultiplied.
    pub picture: Image,
}

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

/// An entry of the header's attribute.
#[derive(Serialize, Deserialize)]
struct Written {
    layer: String,
    lamp: String,
    weight: [f32; 3],
}

impl LightLayers {
    /// Looks at a field under one lamp after the other. `lamps` are names and weights in the field's order;
    /// `mask` is the subject's coverage.
    ///
    /// # Errors
    /// When the field has another number of lamps, or its device fails.
    pub fn of<'a>(
        field: &Field,
        mask: &Mask,
        lamps: impl ExactSizeIterator<Item = (&'a String, [f32; 3])>,
    ) -> Result<Self> {
        let count = lamps.len();
        let layer = |(index, (name, weight)): (usize, (&String, [f32; 3]))| {
            let mut alone = vec![[0.0; 3]; count];
            alone[index] = [1.0; 3];
            let mut picture = field.relight(&alone)?;
            // As the pass `relight` does with their sum.
            extend_edges(&mut picture, mask);
            for (pixel, &alpha) in picture.pixels.iter_mut().zip(&mask.pixels) {
                *pixel = pixel.map(|v| v * alpha);
            }
            Ok(LightLayer {
                lamp: name.clone(),
                weight,
                picture,
            })
        };
        lamps
            .enumerate()
            .map(layer)
            .collect::<Result<_>>()
            .map(Self)
    }

    /// The same with so many columns and rows.
    pub fn scaled(mut self, (width, height): (usize, usize)) -> Self {
        for layer in &mut self.0 {
            layer.picture = resize(&layer.picture, width, height);
        }
        self
    }

    fn name(&self, index: usize) -> String {
        let digits = (self.0.len().saturating_sub(1)).to_string().len().max(2);
        format!("light_{index:0digits$}")
    }

    /// The channels of all layers.
    pub(super) fn channels(&self) -> impl Iterator<Item = AnyChannel<FlatSamples>> + '_ {
        self.0.iter().enumerate().flat_map(|(index, layer)| {
            color_channels(&format!("{}.", self.name(index)), &layer.picture)
        })
    }

    /// What the header says of them.
    pub(super) fn attribute(&self) -> (Text, AttributeValue) {
        // Headers know few letters beyond these.
        let plain = |c: char| if c.is_ascii_graphic() { c } else { '_' };
        let written = self.0.iter().enumerate().map(|(index, layer)| Written {
            layer: self.name(index),
            lamp: layer.lamp.chars().map(plain).collect(),
            weight: layer.weight,
        });
        let text = serde_json::to_string(&written.collect::<Vec<_>>()).unwrap_or_default();
        (WEIGHTS.into(), AttributeValue::Text(text.as_str().into()))
    }
}

/// The sum of a file's light layers, each times the weight that its header says: the relit subject, linear
/// and premultiplied.
///
/// # Errors
/// When the file cannot be read, or it has no light layers with weights.
pub fn rebuilt(path: &Path) -> Result<Image> {
    let remedy = "Export it again with its light layers";
    let missing = |what: &str| Error::missing(format!("{} has no {what}", path.display()), remedy);
    let layer = exr::prelude::read_first_flat_layer_from_file(path)
        .map_err(|e| Error::codec("read", path, e, remedy))?
        .layer_data;
    let written = match layer.attributes.other.get(&Text::from(WEIGHTS)) {
        Some(AttributeValue::Text(text)) => text.to_string(),
        _ => return Err(missing("weights of light layers in the header")),
    };
    let written: Vec<Written> =
        serde_json::from_str(&written).map_err(|e| Error::codec("read", path, e, remedy))?;
    let (width, height) = (layer.size.width(), layer.size.height());
    let mut sums = vec![[0f64; 3]; width * height];
    for entry in &written {
        for (c, color) in ["R", "G", "B"].into_iter().enumerate() {
            let name = format!("{}.{color}", entry.layer);
            let channel = (layer.channel_data.list.iter())
                .find(|channel| channel.name.eq(&name))
                .ok_or_else(|| missing(&format!("channel {name}")))?;
            let weight = f64::from(entry.weight[c]);
            for (sum, value) in sums.iter_mut().zip(channel.sample_data.values_as_f32()) {
                sum[c] += weight * f64::from(value);
            }
        }
    }
    Ok(Image {
        width,
        height,
        pixels: sums.into_iter().map(|sum| sum.map(|v| v as f32)).collect(),
    })
}

impl Rebuild {
    /// Compares what the layers of the file `path`, `layers` in number, add up to with `wanted`.
    ///
    /// # Errors
    /// As [`rebuilt`].
    pub fn check(path: &Path, layers: usize, wanted: &Image) -> Result<Self> {
        let rebuilt = rebuilt(path)?;
        let pairs = rebuilt
            .pixels
            .iter()
            .flatten()
            .zip(wanted.pixels.iter().flatten());
        let mut check = Self {
            layers,
            residual: 0.0,
            brightest: 0.0,
        };
        for (rebuilt, wanted) in pairs {
            check.residual = check.residual.max((rebuilt - wanted).abs());
            check.brightest = check.brightest.max(wanted.abs());
        }
        Ok(check)
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

    /// What was found, in a sentence.
    pub fn sentence(&self) -> String {
        let percent = 100.0 * self.residual / self.brightest.max(f32::MIN_POSITIVE);
        format!(
            "The {} light layers, weighted and added, equal the relit subject to within {:.2e}, {percent:.3} % of its \
             brightest light",
            self.layers, self.residual
        )
    }
}
