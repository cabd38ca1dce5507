//! The light layers of a shot: which lamp each is, in which group, with what weight in each frame.

use crate::group::{Group, groups};
use crate::media::Stills;
use base::error::{Error, Result};
use base::progress::Progress;
use export::{ExrAlpha, LayerFiles, LayerListing};
use glam::Vec3;
use imaging::color::luminance;
use light::Rig;

/// The layers of all frames.
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
    /// The layer's name: `light_07`.
    pub layer: String,
    /// The lamp's.
    pub lamp: String,
    /// From the subject to the lamp, of length 1.
    pub direction: Vec3,
    /// Root-mean-square angle of the lamp about its middle.
    pub spread_deg: f32,
    pub group: Group,
    /// Its weight per channel, frame by frame.
    pub weights: Vec<[f32; 3]>,
    /// Files of the layer, if it is not in the pictures' files.
    pub files: Option<Stills>,
}

/// Layer without the lamps' light: background and effects.
#[derive(Clone, Debug, PartialEq)]
pub struct Rest {
    /// Files of the layer, if it is not in the pictures' files.
    pub files: Option<Stills>,
}

impl Layers {
    /// Reads the headers of frames `first` to `last`.
    ///
    /// # Errors
    /// When a file cannot be read, or has other layers than the rig has lamps.
    pub fn read(
        stills: &Stills,
        (first, last): (usize, usize),
        rig: &Rig,
        progress: &Progress,
    ) -> Result<Self> {
        let listing = |frame| LayerListing::of(&stills.folder.join(stills.name(frame)));
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
                        "{} has {} light layers, and the project has {} lamps",
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
                rest.get_or_insert_with(|| Rest {
                    files: found.file.map(|file| stills.like(&file, frame)),
                });
            }
        }
        let frames = last - first + 1;
        if with_rest > 0 && with_rest < frames {
            progress.say(format!(
                "{with_rest} of {frames} frames have a layer rest, and the others none: there it counts as black"
            ));
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

    /// The lamps of a group.
    pub fn of(&self, group: Group) -> impl Iterator<Item = &LampLayer> {
        self.lamps.iter().filter(move |lamp| lamp.group == group)
    }
}
