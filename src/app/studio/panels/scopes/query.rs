//! Light of the pixel under the cursor, under each lamp. A background thread reads it, since fields on a GPU take time.

use crate::layout::Pane;
use std::sync::Arc;
use worker::{PredictedFrame, Query};

/// A frame, and column and row of its pixel.
type Place = (Arc<PredictedFrame>, [usize; 2]);

/// Light of a pixel under each lamp at full power; None if unknown.
type Texel = Option<Vec<[f32; 3]>>;

/// The newest answer, and the query for it.
#[derive(Default)]
pub struct PixelInspector {
    query: Query<Place, Texel>,
    found: Texel,
    failure: Option<String>,
}

impl PixelInspector {
    /// Takes in the newest answer.
    pub fn receive(&mut self) {
        // Older requests may stay unanswered; the newest is answered last.
        if let Some((_, found)) = self.query.answers().last() {
            (self.found, self.failure) = match found {
                Ok(found) => (found, None),
                Err(sentence) => (None, Some(sentence)),
            };
        }
    }

    /// Reason that the newest request failed; reported once.
    pub fn failure(&mut self) -> Option<String> {
        self.failure.take()
    }

    /// Requests the pixel of a frame if one of the panes `shown` displays it.
    pub fn ask(
        &mut self,
        of: &Arc<PredictedFrame>,
        pixel: [usize; 2],
        shown: &[Pane],
        wake: impl Fn() + Send + 'static,
    ) {
        let find = |(of, pixel): &Place| Ok(of.working_pixel(*pixel).and_then(|[x, y]| of.field.texel(x, y)));
        if shown.contains(&Pane::Scopes) {
            self.query.ask((of.clone(), pixel), wake, |_| find);
        }
    }

    /// Light of the pixel under each lamp at full power; of the previous pixel until known.
    pub fn texel(&self) -> Option<&[[f32; 3]]> {
        self.found.as_deref()
    }
}
