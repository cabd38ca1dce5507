//! A frame of the interview with its OLATs: as predicted, and as shared between the threads.

use base::error::Error;
use compositor::{Field, Plate};
use footage::Frame;
use light::Rig;
use light::aim::LampResponses;
use std::sync::Arc;

/// A frame of the interview and its OLATs.
pub struct Prediction {
    pub frame: Frame,
    /// Plate of the frame; None if pictures have the working size.
    pub plate: Option<Plate>,
    pub field: Field,
}

impl From<(Frame, Field)> for Prediction {
    /// For pictures of the working size.
    fn from((frame, field): (Frame, Field)) -> Self {
        Self { frame, plate: None, field }
    }
}

/// A frame with its reflectance field.
#[derive(Clone, Debug)]
pub struct PredictedFrame {
    pub frame: Arc<Frame>,
    /// Plate of the frame; None if pictures have the working size.
    pub plate: Option<Arc<Plate>>,
    pub field: Arc<Field>,
    /// Number of the source's opening that predicted it.
    pub generation: u64,
    /// Time of the prediction in milliseconds, including reading the frame.
    pub ms: f64,
}

/// A prediction equals itself alone.
impl PartialEq for PredictedFrame {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self, other)
    }
}

impl PredictedFrame {
    pub(super) fn new(predicted: Prediction, generation: u64, ms: f64) -> Self {
        Self {
            frame: Arc::new(predicted.frame),
            plate: predicted.plate.map(Arc::new),
            field: Arc::new(predicted.field),
            generation,
            ms,
        }
    }

    /// Columns and rows of its pictures.
    pub fn size(&self) -> (usize, usize) {
        (self.plate.as_ref()).map_or(self.frame.mask.size(), |plate| plate.size())
    }

    /// Field pixel under a picture pixel; None outside the network's crop.
    pub fn working_pixel(&self, pixel: [usize; 2]) -> Option<[usize; 2]> {
        (self.plate.as_ref()).map_or(Some(pixel), |plate| plate.working_pixel(pixel))
    }

    /// Position in the picture of a point of the field, each in columns and rows.
    pub fn picture_place(&self, at: [f32; 2]) -> [f32; 2] {
        (self.plate.as_ref()).map_or(at, |plate| plate.filmed_place(at))
    }

    /// Brightness of each pixel of the field under each lamp of the rig. Waits for a field on a GPU: do not call
    /// it on the window's thread.
    ///
    /// # Errors
    /// When the device fails.
    pub fn responses(&self, rig: &Rig) -> Result<LampResponses, Error> {
        let lamps = self.field.lamps();
        LampResponses::new(rig, &self.frame.mask, |lamp| {
            let mut alone = vec![[0.0; 3]; lamps];
            if let Some(weight) = alone.get_mut(lamp) {
                *weight = [1.0; 3];
            }
            self.field.relight(&alone)
        })
    }
}
