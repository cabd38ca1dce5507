//! OLATs of a frame, in memory or on the GPU, and their sum under the lamps' weights.

use super::passes::PicturePasses;
use super::relight::{lit_lamps, relight, relight_compressed, relight_half};
use base::error::Result;
use clap::ValueEnum;
use imaging::Image;
use reflectance::{CompressedField, DeviceField, FieldBuffer, HalfField, LampBasis, ReflectanceField};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Storage format of predicted OLATs: each trades accuracy for memory and speed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "kebab-case")]
pub enum Storage {
    /// Full precision, as the network outputs them.
    F32,
    /// Half the memory; each value within 0.05 %.
    #[default]
    F16,
    /// Principal components over the lamps, as many as needed for an error below 1 % of the field's root mean square.
    Compressed,
}

/// Converts the predicted OLATs of successive frames to a storage format.
#[derive(Debug, Default)]
pub struct FieldEncoder {
    storage: Storage,
    /// Components of the last frames, and the number in use.
    basis: Option<(LampBasis, usize)>,
    /// Largest error of a frame in components.
    error: f64,
}

/// The OLATs of a frame, in memory or on the GPU.
#[derive(Debug)]
pub enum Field {
    Memory(ReflectanceField),
    /// In half the memory; a sum takes half the time.
    Half(HalfField),
    /// As principal components over its lamps.
    Compressed(CompressedField),
    /// On the network's GPU, with the passes that make pictures there.
    Gpu(FieldBuffer, Arc<PicturePasses>),
}

impl From<ReflectanceField> for Field {
    fn from(field: ReflectanceField) -> Self {
        Self::Memory(field)
    }
}

impl From<HalfField> for Field {
    fn from(field: HalfField) -> Self {
        Self::Half(field)
    }
}

impl From<CompressedField> for Field {
    fn from(field: CompressedField) -> Self {
        Self::Compressed(field)
    }
}

impl Field {
    /// The field in f16 if it is in memory as f32. A field on the GPU stays unchanged.
    #[must_use]
    pub fn halved(self) -> Self {
        match self {
            Self::Memory(field) => Self::Half(HalfField::from(&field)),
            other => other,
        }
    }

    /// Width and height in pixels.
    pub fn size(&self) -> (usize, usize) {
        match self {
            Self::Memory(field) => (field.width, field.height),
            Self::Half(field) => (field.width, field.height),
            Self::Compressed(field) => (field.width, field.height),
            Self::Gpu(field, _) => (field.width, field.height),
        }
    }

    /// Number of lamps.
    pub fn lamps(&self) -> usize {
        match self {
            Self::Memory(field) => field.lamps,
            Self::Half(field) => field.lamps,
            Self::Compressed(field) => field.lamps,
            Self::Gpu(field, _) => field.lamps,
        }
    }

    /// Size of the OLATs in bytes, in the memory that holds them.
    pub fn bytes(&self) -> usize {
        match self {
            Self::Memory(field) => size_of_val(&field.values[..]),
            Self::Half(field) => size_of_val(field.values()),
            Self::Compressed(field) => field.bytes(),
            Self::Gpu(field, _) => field.bytes(),
        }
    }

    /// The linear picture under these lamp weights: pass `relight`. From a GPU only this picture
    /// is copied.
    ///
    /// # Errors
    /// When field and weights do not match, or the device fails.
    pub fn relight(&self, weights: &[[f32; 3]]) -> Result<Image> {
        match self {
            Self::Memory(field) => Ok(relight(field, weights, &lit_lamps(weights))),
            Self::Half(field) => Ok(relight_half(field, weights, &lit_lamps(weights))),
            Self::Compressed(field) => Ok(relight_compressed(field, weights)),
            Self::Gpu(field, passes) => passes.guarded(|| passes.relight.sum(field, weights)),
        }
    }
}

impl FieldEncoder {
    /// Error of [`Storage::Compressed`]: of a frame, and the lower one by which components are chosen, so
    /// that they also fit the frames around it.
    const ERRORS: [f64; 2] = [0.01, 0.007];

    pub fn new(storage: Storage) -> Self {
        Self { storage, ..Self::default() }
    }

    /// A prediction in the storage format: on the GPU if `passes` are given (the network's own GPU), otherwise in memory.
    ///
    /// # Errors
    /// When the device fails.
    pub fn encode(&mut self, field: DeviceField, passes: Option<&Arc<PicturePasses>>) -> Result<Field> {
        let Some(passes) = passes else {
            let field = field.read()?;
            return Ok(match self.storage {
                Storage::F32 => field.into(),
                Storage::F16 => HalfField::from(&field).into(),
                Storage::Compressed => self.compressed(&field).into(),
            });
        };
        let field = match self.storage {
            Storage::F32 => field.into_buffer(&passes.device)?,
            Storage::F16 => passes.relight.halve(&field.into_buffer(&passes.device)?)?,
            Storage::Compressed => {
                let field = self.compressed(&field.read()?);
                FieldBuffer::upload_components(field, &passes.device)
            }
        };
        Ok(Field::Gpu(field, passes.clone()))
    }

    /// Message with the storage format and its cost in accuracy.
    pub fn sentence(&self) -> String {
        match (self.storage, &self.basis) {
            (Storage::F32, _) => "The predicted OLATs are stored in f32".to_owned(),
            (Storage::F16, _) => "The predicted OLATs are stored in f16: each value within 0.05 %".to_owned(),
            (Storage::Compressed, basis) => {
                let (count, all) = basis.as_ref().map_or((0, 0), |(basis, n)| (*n, basis.len()));
                format!(
                    "The predicted OLATs are stored in {count} of {all} components, with an error of up to {:.2} % of their root mean square",
                    100.0 * self.error
                )
            }
        }
    }

    /// The field in the components of earlier frames, or in its own if their error is too large.
    fn compressed(&mut self, field: &ReflectanceField) -> CompressedField {
        let [most, chosen] = Self::ERRORS;
        if let Some((basis, count)) = &self.basis
            && let Some(kept) = basis.compress(field, *count)
        {
            let error = kept.error(field);
            if error <= most {
                self.error = self.error.max(error);
                return kept;
            }
        }
        let basis = LampBasis::from_fields(&[field]).expect("a single field is consistent");
        let count = basis.components_for(chosen);
        let own = basis.compress(field, count);
        self.error = self.error.max(basis.error(count));
        self.basis = Some((basis, count));
        own.expect("the field's own basis fits")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// All pixels look alike under the lamps, each at its own brightness.
    fn field(look: fn(usize) -> f32, brightness: f32) -> ReflectanceField {
        let (lamps, pixels) = (7, 6 * 5);
        let value = |i: usize| brightness * look(i / pixels) * (1 + i % pixels) as f32;
        ReflectanceField { width: 6, height: 5, lamps, values: (0..3 * lamps * pixels).map(value).collect() }
    }

    #[test]
    fn components_of_a_frame_serve_the_next_until_they_err_too_much() {
        let mut encoder = FieldEncoder::new(Storage::Compressed);
        let first = field(|plane| 1.0 + plane as f32, 1.0);
        let kept = encoder.compressed(&first);
        assert_eq!(kept.basis.len(), 1);
        assert!(kept.error(&first) <= 0.007);
        // The same look needs the same components, at any brightness.
        let darker = field(|plane| 1.0 + plane as f32, 0.5);
        assert!(encoder.compressed(&darker).basis == kept.basis);
        let other = field(|plane| (plane % 2) as f32, 1.0);
        let fresh = encoder.compressed(&other);
        assert!(fresh.basis != kept.basis);
        assert!(fresh.error(&other) <= 0.007 && encoder.error <= 0.01);
        let dark = field(|_| 0.0, 1.0);
        assert_eq!(encoder.compressed(&dark).error(&dark), 0.0);
    }
}
