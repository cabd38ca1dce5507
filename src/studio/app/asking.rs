//! Which picture is asked for, and when the next frame is due.

use super::StudioApp;
use crate::panel::Reading;
use scene::Scene;
use std::time::Duration;
use worker::{Comparison, Origin, PreviewRequest};

/// A picture that the state asks for.
#[derive(PartialEq)]
pub struct Wanted {
    scene: Scene,
    environment: Origin,
    compared: [Option<Comparison>; 2],
    solo: Vec<usize>,
}

impl StudioApp {
    /// Asks for the picture that the state calls for, where that is another than before.
    pub(super) fn ask(&mut self) {
        let place = self.state.look.environment;
        let (Some(worker), Some(entry)) = (&self.worker, self.shelf.entries().get(place)) else {
            return;
        };
        let Reading::Done { panorama, .. } = &entry.panorama else {
            return;
        };
        let compared = self.state.compared(|origin| {
            let entry = self
                .shelf
                .entries()
                .iter()
                .find(|e| e.listed.origin == *origin)?;
            match &entry.panorama {
                Reading::Done { panorama, .. } => Some(panorama.environment.clone()),
                _ => None,
            }
        });
        let wanted = Wanted {
            scene: self.state.scene(),
            environment: entry.listed.origin.clone(),
            compared,
            solo: self.state.solo.clone(),
        };
        let dragged = self.state.is_dragged();
        let (asked, while_dragged) = match &self.asked {
            Some((asked, dragged)) => (*asked == wanted, *dragged),
            None => (false, false),
        };
        if !asked {
            self.news.failure = None;
        }
        if !asked || dragged != while_dragged {
            let [first, second] = wanted.compared.clone();
            worker.show(PreviewRequest {
                scene: wanted.scene.clone(),
                environment: panorama.environment.clone(),
                first,
                second,
                solo: wanted.solo.clone(),
                dragged,
            });
            self.asked = Some((wanted, dragged));
        }
    }

    /// Goes on to the next frame when it is due and the present one has been seen.
    pub(super) fn play(&mut self) {
        let period = 1.0 / self.state.frame_rate;
        let now = self.ctx.input(|i| i.time);
        let seen = self
            .relit
            .as_ref()
            .is_some_and(|r| r.scene.frame == self.state.frame);
        if !self.state.playing {
            self.due = now + period;
        } else if seen {
            if now >= self.due {
                self.state.advance();
                // Late frames are not made up for: that would show them faster than they were filmed.
                self.due = (self.due + period).max(now);
            }
            self.ctx
                .request_repaint_after(Duration::from_secs_f64((self.due - now).max(0.0)));
        }
    }
}
