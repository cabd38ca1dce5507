//! Light of the pixel under the cursor, under each lamp. A background thread reads it, since fields on a GPU take time.

use super::layout::Pane;
use std::sync::Arc;
use worker::{Lookup, PredictedFrame};

/// A pixel of a frame: column and row.
#[derive(Clone)]
struct Ask {
    of: Arc<PredictedFrame>,
    pixel: [usize; 2],
}

/// Light of a pixel under each lamp at full power; None if unknown.
type Texel = Option<Vec<[f32; 3]>>;

/// The newest answer, and the thread that reads it.
#[derive(Default)]
pub struct PixelInspector {
    lookup: Option<Lookup<Ask, Texel>>,
    asked: Option<Ask>,
    found: Texel,
    failure: Option<String>,
}

impl PixelInspector {
    /// Takes in the newest answer.
    pub fn receive(&mut self) {
        // Older requests may stay unanswered; the newest is answered last.
        if let Some((_, found)) = self.lookup.iter().flat_map(Lookup::answers).last() {
            (self.found, self.failure) = match found {
                Ok(found) => (found, None),
                Err(e) => (None, Some(e.to_string())),
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
        let known = |asked: &Ask| Arc::ptr_eq(&asked.of, of) && asked.pixel == pixel;
        if !shown.contains(&Pane::Scopes) || self.asked.as_ref().is_some_and(known) {
            return;
        }
        let ask = Ask { of: of.clone(), pixel };
        let find = |ask: &Ask| {
            let pixel = ask.of.working_pixel(ask.pixel);
            Ok(pixel.and_then(|[x, y]| ask.of.field.texel(x, y)))
        };
        let lookup = self.lookup.get_or_insert_with(|| Lookup::start(wake, find));
        lookup.ask(ask.clone());
        self.asked = Some(ask);
    }

    /// Light of the pixel under each lamp at full power; of the previous pixel until known.
    pub fn texel(&self) -> Option<&[[f32; 3]]> {
        self.found.as_deref()
    }
}
