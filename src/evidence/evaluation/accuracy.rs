//! Methods, their output, and their scores.

use super::regions::RegionScore;
use super::shadow_edges::ShadowEdges;
use base::error::{Error, Result};
use clap::ValueEnum;
use compositor::reference::{lit_lamps, relight};
use footage::PictureSize;
use imaging::Image;
use reflectance::ReflectanceField;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use transfer::FineField;

/// Origin of a frame's reflectance field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Method {
    /// The displayed and exported OLATs: carried-over exemplars, corrected by the network if one is trained.
    Prediction,
    /// The exemplars carried over, without training (reflectance transfer).
    Transfer,
    /// The trained network alone.
    Network,
    /// The true OLATs: the upper bound for any sum over this rig's lamps.
    TruthOlats,
    /// The most similar pose of the OLAT session, unchanged.
    Nearest,
    /// The nearest pose times frame / pose, both under the interview's light.
    Ratio,
    /// The same ratio, with the pose as nine low-order lights would have recorded it (spherical harmonics, Fyffe 2011).
    Harmonics,
    /// Few-shot patch-based training (Texler 2020): the relit poses are keyframes. Trained during evaluation.
    Texler,
    /// Single image portrait relighting (Sun 2019), trained on the poses during evaluation.
    Sun,
}

impl Method {
    /// True for the methods of an [`OlatPredictor`](transfer::OlatPredictor).
    pub fn predicts(self) -> bool {
        matches!(self, Self::Prediction | Self::Transfer | Self::Network)
    }

    /// True if the method is trained during evaluation.
    pub fn learns(self) -> bool {
        matches!(self, Self::Texler | Self::Sun)
    }
}

/// A method's output for a frame.
pub enum Predicted {
    /// OLATs to sum, and light within their pixels.
    Field(ReflectanceField, Option<FineField>),
    /// Finished pictures.
    Pictures(Pictures),
}

impl Predicted {
    /// Picture under a light, summed from OLATs or found by name.
    pub(super) fn relit(&self, name: &str, weights: &[[f32; 3]]) -> Result<Image> {
        match self {
            Self::Field(field, _) => {
                check_lamps(field, weights)?;
                Ok(relight(field, weights, &lit_lamps(weights)))
            }
            Self::Pictures(pictures) => (pictures.relit.get(name).cloned())
                .ok_or_else(|| Error::bug(format!("no picture was made under {name}"))),
        }
    }

    /// Pictures under each lamp, if available.
    pub(super) fn olats(&self) -> Option<Box<dyn Iterator<Item = Image> + '_>> {
        match self {
            Self::Field(field, _) => Some(Box::new((0..field.lamps).map(|lamp| field.olat(lamp)))),
            Self::Pictures(pictures) => {
                let olats = pictures.olats.as_ref()?;
                Some(Box::new(olats.iter().cloned()))
            }
        }
    }
}

fn check_lamps(field: &ReflectanceField, weights: &[[f32; 3]]) -> Result<()> {
    if field.lamps == weights.len() {
        return Ok(());
    }
    Err(Error::invalid(
        format!("the reflectance field has {} lamps, the calibration {}", field.lamps, weights.len()),
        "Calibrate and train this project again",
    ))
}

/// Linear pictures of a frame at the working size.
pub struct Pictures {
    /// Environment → the frame under it.
    pub relit: BTreeMap<String, Image>,
    /// The frame under each lamp, if requested.
    pub olats: Option<Vec<Image>>,
    /// Time of one relit picture in milliseconds.
    pub picture_ms: f64,
}

/// Accuracy of a method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    pub method: Method,
    /// Part of the plate and resolution of the measured pictures.
    #[serde(default = "working_size")]
    pub at: PictureSize,
    /// Measured frames.
    pub frames: Vec<usize>,
    /// Environment → mean PSNR over the frames in decibels.
    pub relit_psnr_db: BTreeMap<String, f64>,
    /// Environment → PSNR of each of `frames`.
    pub relit_psnr_by_frame_db: BTreeMap<String, Vec<f64>>,
    /// Environment → the error in each region of the subject.
    #[serde(default)]
    pub relit_regions: BTreeMap<String, Vec<RegionScore>>,
    /// Mean PSNR of the OLATs over the frames with true OLATs.
    pub olat_psnr_db: Option<f64>,
    /// Frame → PSNR of its OLATs.
    pub olat_psnr_by_frame_db: BTreeMap<usize, f64>,
    /// Frame → PSNR of each lamp's OLAT, at the frame's exposure.
    pub olat_psnr_by_lamp_db: BTreeMap<usize, Vec<f64>>,
    /// OLATs at shadow edges, over all those frames.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub olat_shadow_edges: Option<ShadowEdges>,
    /// Median time in milliseconds for a frame's OLATs, or for a relit picture if the method makes no OLATs.
    #[serde(default)]
    pub frame_ms: Option<f64>,
}

/// Size for scores saved without one.
fn working_size() -> PictureSize {
    PictureSize::Square
}
