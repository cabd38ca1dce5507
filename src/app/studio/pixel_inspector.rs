//! The light of the pixel under the cursor under each lamp. It is read in the background: a field on a GPU takes time.

use super::layout::Pane;
use std::sync::Arc;
use worker::{Lookup, PredictedFrame};

/// A pixel of a frame: column and row.
#[derive(Clone)]
struct Ask {
    of: Arc<PredictedFrame>,
    pixel: [usize; 2],
}

/// The light of a pixel under each lamp at full power; None if unknown.
type Texel = Option<Vec<[f32; 3]>>;

/// The newest answer, and the thread that finds it.
#[derive(Default)]
pub struct PixelInspector {
    lookup: Option<Lookup<Ask, Texel>>,
    asked: Option<Ask>,
    found: Texel,
    failure: Option<String>,
}

impl PixelInspector {
    /// Takes in what was found.
    pub fn receive(&mut self) {
        // Older questions may stay unanswered; the newest is answered last.
        if let Some((_, found)) = self.lookup.iter().flat_map(Lookup::answers).last() {
            (self.found, self.failure) = match found {
                Ok(found) => (found, None),
                Err(e) => (None, Some(e.to_string())),
            };
        }
    }

    /// Reason the newest was not found, once.
    pub fn failure(&mut self) -> Option<String> {
        self.failure.take()
    }

    /// Asks for a pixel of a frame if the panes `shown` show it.
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

    /// The light of the pixel under each lamp at full power; that of the previous pixel until it is known.
    pub fn texel(&self) -> Option<&[[f32; 3]]> {
        self.found.as_deref()
    }
}
