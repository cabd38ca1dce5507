//! The subject under each lamp or light alone, as layers of an EXR, and the check that the layers times their weights
//! give back the picture.
//!
//! By lamp, layer `light_07` is the subject as lamp 7 at weight 1 shows it, premultiplied by its coverage. The header's
//! attribute `lightWeights` says in JSON which lamp each layer is of and with what weight per channel it
//! goes into the picture, exposure included. What is behind the subject and what effects do is the layer `rest`, if
//! there is any: the picture is the sum of the layers, each times its weight, and `rest`. In another colour space than
//! Rec. 709, layers are multiplied by their weights already and have weight 1, since weights of channels hold in the
//! working space alone. By light, layer `light_01_Key` is the subject under the light or the group Key as it shines in
//! the frame, at weight 1.

use super::exr_settings::{LayerFiles, LayersBy};
use base::error::Result;
use compositor::Ingredients;
use compositor::reference::extend_edges;
use exr::meta::attribute::{AttributeValue, Text};
use imaging::Image;
use imaging::resample::resize;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// The header's attribute.
pub(super) const WEIGHTS: &str = "lightWeights";
/// The layer of what no lamp does.
pub(super) const REST: &str = "rest";

/// The layers of one frame, in the order of the lamps or lights.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LightLayers {
    pub by: LayersBy,
    pub lamps: Vec<LightLayer>,
    /// The picture that they have to add up to, without the rest: linear, premultiplied. None leaves it unchecked.
    pub subject: Option<Image>,
    /// Rest of the picture, without the lamps: linear, premultiplied. None if there is nothing.
    pub rest: Option<Image>,
}

/// Light of one lamp, or of one light.
#[derive(Clone, Debug, PartialEq)]
pub struct LightLayer {
    /// Name of the lamp or the light.
    pub lamp: String,
    /// Its weight per channel in the frame.
    pub weight: [f32; 3],
    /// The subject under it at weight 1: linear, premultiplied.
    pub picture: Image,
}

/// An entry of the header's attribute.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ListedLayer {
    /// The layer's name: `light_07`.
    pub layer: String,
    /// The lamp's.
    pub lamp: String,
    /// The lamp's weight per channel in the frame.
    pub weight: [f32; 3],
    /// The file that holds it, if not the picture's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
}

impl LightLayers {
    /// Looks at a frame under one light after the other: its name, the lamps' weights, and the weight of the layer. At the
    /// size of the plate, if there is one.
    ///
    /// # Errors
    /// When the field has another number of lamps, or its device fails.
    pub fn new(
        frame: &Ingredients,
        by: LayersBy,
        lights: impl ParallelIterator<Item = (String, Vec<[f32; 3]>, [f32; 3])>,
    ) -> Result<Self> {
        let mask = frame.mask;
        let layer = |(lamp, per_lamp, weight): (String, Vec<[f32; 3]>, [f32; 3])| {
            let mut picture = frame.field.relight(&per_lamp)?;
            // As the pass `relight` does with their sum.
            extend_edges(&mut picture, mask);
            for (pixel, &alpha) in picture.pixels.iter_mut().zip(&mask.pixels) {
                *pixel = pixel.map(|v| v * alpha);
            }
            if let Some(plate) = frame.plate() {
                picture = plate.relit_by(&picture, mask, &per_lamp);
            }
            Ok(LightLayer { lamp, weight, picture })
        };
        Ok(Self { by, lamps: lights.map(layer).collect::<Result<_>>()?, ..Self::default() })
    }

    /// The same with `width × height` pixels.
    pub fn scaled(mut self, (width, height): (usize, usize)) -> Self {
        let lamps = self.lamps.iter_mut().map(|layer| &mut layer.picture);
        let others = self.subject.iter_mut().chain(&mut self.rest);
        for picture in lamps.chain(others).filter(|picture| picture.size() != (width, height)) {
            *picture = resize(picture, width, height);
        }
        self
    }

    /// The same with the picture's rest beyond the subject, if there is any.
    pub fn with_rest(mut self, picture: &Image) -> Self {
        let Some(subject) = &self.subject else { return self };
        let pairs = picture.pixels.iter().zip(&subject.pixels);
        let rest = pairs.map(|(whole, part)| std::array::from_fn(|c| whole[c] - part[c]));
        let rest: Vec<[f32; 3]> = rest.collect();
        if rest.iter().flatten().any(|v| *v != 0.0) {
            self.rest = Some(Image { pixels: rest, ..picture.clone() });
        }
        self
    }

    /// The same for a file whose light is another than ours: weights per channel hold in Rec. 709 alone.
    pub fn in_space(mut self, keeps_light: bool) -> Self {
        if !keeps_light {
            for layer in &mut self.lamps {
                let weight = std::mem::replace(&mut layer.weight, [1.0; 3]);
                for pixel in &mut layer.picture.pixels {
                    *pixel = std::array::from_fn(|c| pixel[c] * weight[c]);
                }
            }
        }
        self
    }

    /// Name of a layer: never digits alone, which some programs take for numbers.
    fn name(&self, index: usize) -> String {
        let digits = (self.lamps.len().saturating_sub(1)).to_string().len().max(2);
        let number = format!("light_{index:0digits$}");
        let letter = |c: char| if c.is_ascii_alphanumeric() { c } else { '_' };
        match self.by {
            LayersBy::Lamp => number,
            LayersBy::Light => {
                let name: String = self.lamps[index].lamp.chars().map(letter).collect();
                format!("{number}_{name}")
            }
        }
    }

    /// All layers with their names.
    pub(super) fn pictures(&self) -> impl Iterator<Item = (String, &Image)> + '_ {
        let lamps = self.lamps.iter().enumerate();
        let lamps = lamps.map(|(index, layer)| (self.name(index), &layer.picture));
        lamps.chain(self.rest.iter().map(|rest| (REST.to_owned(), rest)))
    }

    fn written(&self, path: Option<&Path>) -> Vec<ListedLayer> {
        let lamps = self.lamps.iter().enumerate();
        lamps
            .map(|(index, layer)| ListedLayer {
                layer: self.name(index),
                lamp: layer.lamp.clone(),
                weight: layer.weight,
                file: path.map(|path| file_name(&beside(path, &self.name(index)))),
            })
            .collect()
    }

    /// Header attribute that lists them.
    pub(super) fn attribute(&self, files: LayerFiles) -> (Text, AttributeValue) {
        let mut written = self.written(None);
        for entry in &mut written {
            // Headers know few letters beyond these.
            let plain = |c: char| if c.is_ascii_graphic() { c } else { '_' };
            entry.lamp = entry.lamp.chars().map(plain).collect();
        }
        // What is in other files stands in the JSON file, which knows their names.
        if files == LayerFiles::Files {
            written.clear();
        }
        let text = serde_json::to_string(&written).unwrap_or_default();
        (WEIGHTS.into(), AttributeValue::Text(text.as_str().into()))
    }

    /// The text of the JSON file beside the picture `path`.
    pub(super) fn weights(&self, path: &Path, files: LayerFiles) -> String {
        let of_files = (files == LayerFiles::Files).then_some(path);
        let rest = self.rest.as_ref().map(|_| {
            let file = of_files.map(|path| file_name(&beside(path, REST)));
            serde_json::json!({ "layer": REST, "file": file })
        });
        let figures = serde_json::json!({
            "picture": file_name(path),
            "sum": "picture = sum of weight × layer, and rest",
            "layers": self.written(of_files),
            "rest": rest,
        });
        format!("{figures:#}\n")
    }
}

/// A path's last part.
pub(super) fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or_default();
    name.to_string_lossy().into_owned()
}

/// The JSON file beside a picture's.
pub(super) fn weights_file(picture: &Path) -> PathBuf {
    picture.with_extension("json")
}

/// The file of a layer beside that of its picture: `out.light_00.0001.exr` beside `out.0001.exr`.
pub fn beside(picture: &Path, layer: &str) -> PathBuf {
    let stem = picture.file_stem().unwrap_or_default().to_string_lossy();
    let before_number = stem.trim_end_matches(|c: char| c.is_ascii_digit());
    let (name, number) = stem.split_at(before_number.len());
    let name = name.trim_end_matches(['.', '_', '-']);
    let gap = &before_number[name.len()..];
    let stem = match (gap, number) {
        (_, "") | ("", _) => format!("{stem}.{layer}"),
        _ if name.is_empty() => format!("{layer}{gap}{number}"),
        _ => format!("{name}.{layer}{gap}{number}"),
    };
    let ending = picture.extension().unwrap_or_default().to_string_lossy();
    picture.with_file_name(format!("{stem}.{ending}"))
}
