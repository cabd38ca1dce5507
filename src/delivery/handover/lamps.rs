//! Light layers of a shot: lamp, group, and weight in each frame.

use crate::group::{Group, groups};
use crate::media::Stills;
use base::error::{Error, Result};
use base::progress::Progress;
use export::{ExrAlpha, LayerFiles, LayerListing};
use glam::Vec3;
use imaging::color::luminance;
use light::Rig;

/// Layers of all frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Layers {
    /// In the order of the rig.
    pub lamps: Vec<LampLayer>,
    pub rest: Option<Rest>,
    pub place: LayerFiles,
    pub alpha: ExrAlpha,
    /// Columns and rows.
    pub size: (usize, usize),
}

/// The subject under one lamp.
#[derive(Clone, Debug, PartialEq)]
pub struct LampLayer {
    /// Name of the layer: `light_07`.
    pub layer: String,
    /// Name of the lamp.
    pub lamp: String,
    /// Unit vector from the subject to the lamp.
    pub direction: Vec3,
    /// Root-mean-square angle of the lamp about its middle.
    pub spread_deg: f32,
    pub group: Group,
    /// Weight per channel, frame by frame.
    pub weights: Vec<[f32; 3]>,
    /// Files of the layer, if it is not in the pictures' files.
    pub files: Option<Stills>,
}

/// Layer of background and effects, beyond the lamps.
#[derive(Clone, Debug, PartialEq)]
pub struct Rest {
    /// Files of the layer, if it is not in the pictures' files.
    pub files: Option<Stills>,
}

impl Layers {
    /// Reads the headers of the files with the numbers `first` to `last`.
    ///
    /// # Errors
    /// When a file cannot be read, or its layers do not match the lamps of the rig.
    pub fn read(stills: &Stills, (first, last): (i64, i64), rig: &Rig, progress: &Progress) -> Result<Self> {
        let listing = |frame| LayerListing::from_path(&stills.folder.join(stills.name(frame)));
        let start = listing(first)?;
        let mut weights: Vec<Vec<[f32; 3]>> = vec![Vec::new(); rig.lamps.len()];
        let mut with_rest = 0;
        let mut rest = None;
        for frame in first..=last {
            progress.check("")?;
            let found = listing(frame)?;
            if found.lamps.len() != rig.lamps.len() || found.place != start.place {
                return Err(Error::invalid(
                    format!(
                        "{} has {} light layers, but the project has {} lamps",
                        stills.folder.join(stills.name(frame)).display(),
                        found.lamps.len(),
                        rig.lamps.len()
                    ),
                    ("Export all frames again with light layers", "--layers, without --resume"),
                ));
            }
            for (weights, layer) in weights.iter_mut().zip(&found.lamps) {
                weights.push(layer.weight);
            }
            if let Some(found) = found.rest {
                with_rest += 1;
                rest.get_or_insert_with(|| Rest { files: found.file.map(|file| stills.like(&file, frame)) });
            }
        }
        let frames = (last - first + 1) as usize;
        if with_rest > 0 && with_rest < frames {
            progress.say(format!("{with_rest} of {frames} frames have a layer rest; in the others it counts as black"));
        }
        let light = |(lamp, weights): (&light::Lamp, &Vec<[f32; 3]>)| {
            let sum = |c: usize| weights.iter().map(|w| w[c]).sum::<f32>() * lamp.energy[c];
            (lamp.direction, luminance([0, 1, 2].map(sum)))
        };
        let given: Vec<_> = rig.lamps.iter().zip(&weights).map(light).collect();
        let groups = groups(&given);
        let lamps = rig.lamps.iter().zip(start.lamps).zip(groups.into_iter().zip(weights));
        Ok(Self {
            lamps: lamps
                .map(|((lamp, listed), (group, weights))| LampLayer {
                    layer: listed.layer,
                    lamp: lamp.name.clone(),
                    direction: lamp.direction.normalize_or_zero(),
                    spread_deg: lamp.spread_deg,
                    group,
                    weights,
                    files: listed.file.map(|file| stills.like(&file, first)),
                })
                .collect(),
            rest,
            place: start.place,
            alpha: start.alpha,
            size: start.size,
        })
    }

    /// Lamps of a group.
    pub fn lamps_in(&self, group: Group) -> impl Iterator<Item = &LampLayer> {
        self.lamps.iter().filter(move |lamp| lamp.group == group)
    }
}
