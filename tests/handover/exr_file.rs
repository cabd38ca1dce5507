//! Channels of an EXR under Nuke's names.

use exr::prelude::read_all_flat_layers_from_file;
use std::collections::BTreeMap;
use std::path::Path;

/// Values of each channel, such as `rgba.red` or `light_00.green`, over the whole frame.
#[derive(Clone, Debug, Default)]
pub struct Channels {
    pub width: usize,
    pub height: usize,
    pub values: BTreeMap<String, Vec<f32>>,
}

impl Channels {
    /// A channel; black if it is missing.
    pub fn get(&self, name: &str) -> Vec<f32> {
        let black = || vec![0.0; self.width * self.height];
        self.values.get(name).cloned().unwrap_or_else(black)
    }

    /// Largest difference from `wanted`, as a multiple of its value plus 1/1000.
    pub fn residual(&self, wanted: &Self) -> f32 {
        assert_eq!((self.width, self.height), (wanted.width, wanted.height));
        let mut largest = 0f32;
        for channel in ["rgba.red", "rgba.green", "rgba.blue", "rgba.alpha"] {
            for (made, wanted) in self.get(channel).iter().zip(wanted.get(channel)) {
                largest = largest.max((made - wanted).abs() / (wanted.abs() + 1e-3));
            }
        }
        largest
    }

    /// Largest value of the picture.
    pub fn brightest(&self) -> f32 {
        let all = ["rgba.red", "rgba.green", "rgba.blue"].map(|name| self.get(name));
        all.iter().flatten().fold(0.0, |most, v| most.max(v.abs()))
    }
}

pub fn read(path: &Path) -> Channels {
    let file = read_all_flat_layers_from_file(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let frame = file.attributes.display_window;
    let (width, height) = (frame.size.width(), frame.size.height());
    let mut channels = Channels { width, height, values: BTreeMap::new() };
    for (index, part) in file.layer_data.iter().enumerate() {
        let at = part.attributes.layer_position - frame.position;
        let own = part.attributes.layer_name.as_ref().map(ToString::to_string);
        for channel in &part.channel_data.list {
            let name = channel.name.to_string();
            let (layer, letter) = name.rsplit_once('.').map_or_else(
                || match &own {
                    Some(own) if index > 0 => (own.clone(), name.as_str()),
                    _ => ("rgba".to_owned(), name.as_str()),
                },
                |(layer, letter)| (layer.to_owned(), letter),
            );
            let color = match letter {
                "R" => "red",
                "G" => "green",
                "B" => "blue",
                "A" => "alpha",
                other => other,
            };
            let mut whole = vec![0.0; width * height];
            for (i, value) in channel.sample_data.values_as_f32().enumerate() {
                let x = at.x() as usize + i % part.size.width();
                let y = at.y() as usize + i / part.size.width();
                whole[y * width + x] = value;
            }
            channels.values.insert(format!("{layer}.{color}"), whole);
        }
    }
    channels
}
