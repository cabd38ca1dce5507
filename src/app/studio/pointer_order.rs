//! Splits motion, presses and releases of the pointer into separate frames.
//!
//! In a slow frame, the system may report together that the pointer moved, was pressed and moved on. egui drags by all
//! motion of a frame in which a button is down, including motion before the press, so that the dragged object would
//! jump. It would also lose the last motion before a release, and a drag that is pressed and released in one frame: the
//! tap of a pen.

use egui::{Context, Event, Plugin, RawInput, Ui};

/// Events held back for later frames.
#[derive(Default)]
pub struct PointerOrder {
    held: Vec<Event>,
}

impl Plugin for PointerOrder {
    fn debug_name(&self) -> &'static str {
        "order of pointer events"
    }

    fn input_hook(&mut self, _: &Context, input: &mut RawInput) {
        self.held.append(&mut input.events);
        let cut = first_frame(&self.held);
        let later = self.held.split_off(cut);
        input.events = std::mem::replace(&mut self.held, later);
    }

    fn on_begin_pass(&mut self, ui: &mut Ui) {
        if !self.held.is_empty() {
            ui.ctx().request_repaint();
        }
    }
}

/// Number of leading events for one frame: up to a button after motion or a press, or motion after a press.
fn first_frame(events: &[Event]) -> usize {
    let (mut moved, mut pressed) = (false, false);
    for (place, event) in events.iter().enumerate() {
        match event {
            Event::PointerMoved(_) if pressed => return place,
            Event::PointerMoved(_) => moved = true,
            Event::PointerButton { .. } if moved || pressed => return place,
            Event::PointerButton { pressed: down, .. } => pressed = *down,
            _ => {}
        }
    }
    events.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Modifiers, PointerButton, Pos2};

    #[test]
    fn motion_and_buttons_come_in_frames_of_their_own_and_in_order() {
        let button = |pressed| Event::PointerButton {
            pos: Pos2::ZERO,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        };
        let moved = |x| Event::PointerMoved(Pos2::new(x, 0.0));
        let (press, release, text) = (button(true), button(false), Event::Text("a".to_owned()));
        let all = vec![
            moved(1.0),
            text.clone(),
            moved(2.0),
            press.clone(),
            moved(3.0),
            moved(4.0),
            release.clone(),
            moved(5.0),
            press.clone(),
            release.clone(),
        ];
        let (mut order, ctx) = (PointerOrder::default(), Context::default());
        let mut frames = Vec::new();
        let mut input = RawInput { events: all.clone(), ..RawInput::default() };
        while frames.is_empty() || !order.held.is_empty() {
            order.input_hook(&ctx, &mut input);
            frames.push(std::mem::take(&mut input.events));
        }
        assert_eq!(frames.concat(), all);
        let lengths: Vec<usize> = frames.iter().map(Vec::len).collect();
        assert_eq!(lengths, [3, 1, 2, 2, 1, 1]);
    }
}
