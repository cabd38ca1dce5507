//! What each lamp gives to the pixel under the cursor. It is found beside the window's thread, for a field on a GPU
//! has to be waited for.

use super::layout::Pane;
use std::sync::Arc;
use worker::{Lookup, PredictedFrame};

/// A pixel of a frame: column and row.
#[derive(Clone)]
struct Ask {
    of: Arc<PredictedFrame>,
    pixel: [usize; 2],
}

/// The light of a pixel under each lamp at full power; none where it cannot be told.
type Texel = Option<Vec<[f32; 3]>>;

/// The newest that was found, and who finds it.
#[derive(Default)]
pub struct PixelInspector {
    clerk: Option<Lookup<Ask, Texel>>,
    asked: Option<Ask>,
    found: Texel,
}

impl PixelInspector {
    /// Takes in what was found.
    pub fn receive(&mut self) {
        // The newest question is answered last, and others may not be.
        if let Some(found) = self.clerk.iter().flat_map(Lookup::answers).last() {
            self.found = found;
        }
    }

    /// Asks for a pixel of a frame where the panes `shown` show it.
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
        let ask = Ask {
            of: of.clone(),
            pixel,
        };
        let answer = |Ask { of, pixel: [x, y] }: Ask| of.field.texel(x, y);
        let clerk = self
            .clerk
            .get_or_insert_with(|| Lookup::start(wake, answer));
        clerk.ask(ask.clone());
        self.asked = Some(ask);
    }

    /// The light of the pixel under each lamp at full power, or that of the one before while it is looked for.
    pub fn texel(&self) -> Option<&[[f32; 3]]> {
        self.found.as_deref()
    }
}
