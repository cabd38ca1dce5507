//! Numbers that are dragged, typed or computed, and the bar behind a number with a range.

use crate::look::within_a_turn;
use base::numbers::ANGLES;
use egui::emath::Numeric;
use egui::{Color32, CornerRadius, DragValue, Rect, Response, Shape, Ui};
use std::cell::RefCell;
use std::ops::RangeInclusive;

/// A field for a number that also computes: "+10" adds to it, "/2" halves it, "90-12" is 78.
pub fn computing<N: Numeric>(value: &mut N) -> DragValue<'_> {
    let now = value.to_f64();
    DragValue::new(value)
        // Otherwise "/2" would halve the number at every frame.
        .update_while_editing(false)
        .custom_parser(move |text| computed_once::<N>(text, now))
}

/// True if a field was clicked twice, which resets its number.
pub fn is_reset(ui: &Ui, field: &Response) -> bool {
    let is_reset = field.double_clicked();
    if is_reset {
        // The first click started editing the number as text.
        ui.memory_mut(|memory| memory.surrender_focus(field.id));
    }
    is_reset
}

/// As [`computing`], for an angle in degrees that keys may turn several times. Shows the angle within a turn, and the
/// turns.
pub fn turning(degrees: &mut f32) -> DragValue<'_> {
    computing(degrees)
        .speed(0.5)
        .range(ANGLES)
        .clamp_existing_to_range(false)
        .fixed_decimals(1)
        .custom_formatter(|degrees, _| in_turns(degrees as f32))
}

/// Text of an angle: 442 degrees are 82.0° + 1 turn.
fn in_turns(degrees: f32) -> String {
    let within = within_a_turn(degrees);
    let turns = ((degrees - within) / 360.0).round();
    let sign = if turns < 0.0 { '-' } else { '+' };
    match turns.abs() {
        0.0 => format!("{within:.1}°"),
        1.0 => format!("{within:.1}° {sign} 1 turn"),
        turns => format!("{within:.1}° {sign} {turns:.0} turns"),
    }
}

thread_local! {
    /// The last computation: its text, the number before, and the result.
    static COMPUTED: RefCell<Option<(String, [f64; 2])>> = const { RefCell::new(None) };
}

/// As [`computed`], but applies a text only once. egui parses the text again in the frame after the field loses the
/// focus, which would add twice.
fn computed_once<N: Numeric>(text: &str, now: f64) -> Option<f64> {
    COMPUTED.with_borrow_mut(|last| {
        // The range may have clamped the result.
        let is_again = |(of, [before, gave]): (String, [f64; 2])| {
            of == text && now != before && (before.min(gave)..=before.max(gave)).contains(&now)
        };
        if last.take().is_some_and(is_again) {
            return Some(now);
        }
        let found = computed(text, now).map(|found| if N::INTEGRAL { found.round() } else { found });
        *last = found.map(|found| (text.to_owned(), [now, N::from_f64(found).to_f64()]));
        found
    })
}

/// The result of a text if the number is `now`; None if the text is not a computation.
fn computed(text: &str, now: f64) -> Option<f64> {
    let plain: String = text.trim().replace('−', "-").replace(',', ".");
    let (first, rest) = if plain.starts_with(['+', '*', '/']) { (now, plain.as_str()) } else { number(&plain)? };
    let Some(sign) = rest.chars().next().filter(|sign| "+-*/".contains(*sign)) else {
        return rest.is_empty().then_some(first);
    };
    let (second, rest) = number(&rest[1..])?;
    let result = match sign {
        '+' => first + second,
        '-' => first - second,
        '*' => first * second,
        _ => first / second,
    };
    (rest.is_empty() && result.is_finite()).then_some(result)
}

/// The leading number of a text, and the rest after spaces and a unit. Turns are converted to degrees.
fn number(text: &str) -> Option<(f64, &str)> {
    let text = text.trim_start();
    let is_part = |(place, c): &(usize, char)| c.is_ascii_digit() || *c == '.' || (*place == 0 && *c == '-');
    let end = (text.char_indices().find(|part| !is_part(part))).map_or(text.len(), |(end, _)| end);
    let value: f64 = text[..end].parse().ok()?;
    let unit = text[end..].trim_start();
    let rest = unit.trim_start_matches(|c: char| !"+-*/".contains(c) && !c.is_ascii_digit());
    let turn = if unit.starts_with("turn") { 360.0 } else { 1.0 };
    Some((value * turn, rest))
}

/// Draws a number with the bar behind it: from 0, or from the range's start, to `value`.
pub fn over_bar(
    ui: &mut Ui,
    range: &RangeInclusive<f32>,
    value: f32,
    draw: impl FnOnce(&mut Ui) -> Response,
) -> Response {
    let painter = ui.painter().clone();
    let behind = painter.add(Shape::Noop);
    let response = ui
        .scope(|ui| {
            let widgets = &mut ui.visuals_mut().widgets;
            for widget in [&mut widgets.inactive, &mut widgets.hovered, &mut widgets.active] {
                widget.weak_bg_fill = Color32::TRANSPARENT;
            }
            draw(ui)
        })
        .inner;
    let (least, most) = (*range.start(), *range.end());
    let rect = response.rect;
    let x = |value: f32| {
        let share = (value - least) / (most - least).max(f32::MIN_POSITIVE);
        rect.left() + share.clamp(0.0, 1.0) * rect.width()
    };
    let (from, to) = (x(0.0f32.clamp(least, most)), x(value));
    let bar = Rect::from_x_y_ranges(from.min(to)..=from.max(to), rect.y_range());
    let corner = CornerRadius::same(3);
    painter.set(
        behind,
        Shape::Vec(vec![
            Shape::rect_filled(rect, corner, Color32::from_gray(54)),
            Shape::rect_filled(bar, corner, Color32::from_gray(86)),
        ]),
    );
    response
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_parsed_again_is_not_added_again() {
        let computed = computed_once::<f32>;
        assert_eq!(computed("+10", 40.0), Some(50.0));
        assert_eq!(computed("+10", 50.0), Some(50.0));
        // Typed again.
        assert_eq!(computed("+10", 50.0), Some(60.0));
        // Something else changed the value in between.
        assert_eq!(computed("+10", 5.0), Some(15.0));
        assert_eq!(computed("/2", 15.0), Some(7.5));
        // A range clamped the result to 8.
        assert_eq!(computed("+3", 7.0), Some(10.0));
        assert_eq!(computed("+3", 8.0), Some(8.0));
        // An integer was rounded.
        assert_eq!(computed_once::<usize>("/2", 5.0), Some(3.0));
        assert_eq!(computed_once::<usize>("/2", 3.0), Some(3.0));
        assert_eq!(computed_once::<usize>("*0.3", 8.0), Some(2.0));
        assert_eq!(computed_once::<usize>("*0.3", 2.0), Some(2.0));
    }

    #[test]
    fn an_angle_is_read_within_a_turn_and_typed_as_it_reads() {
        for (degrees, text) in [
            (442.0, "82.0° + 1 turn"),
            (190.0, "-170.0° + 1 turn"),
            (-400.5, "-40.5° - 1 turn"),
            (812.0, "92.0° + 2 turns"),
            (180.0, "180.0°"),
            (-12.3, "-12.3°"),
        ] {
            assert_eq!(in_turns(degrees), text);
            let typed = computed(text, 7.0).unwrap();
            assert!((typed - f64::from(degrees)).abs() < 1e-3, "{text}: {typed}");
        }
        for (text, value) in [("+1 turn", 400.0), ("2 turns", 720.0), ("+10", 50.0)] {
            assert_eq!(computed(text, 40.0), Some(value));
        }
    }

    #[test]
    fn a_number_is_typed_changed_and_computed() {
        for (text, value) in [
            ("12", Some(12.0)),
            (" -3.5 ", Some(-3.5)),
            ("−3,5°", Some(-3.5)),
            ("0.50 stops", Some(0.5)),
            ("+10", Some(50.0)),
            ("*1.5", Some(60.0)),
            ("/2", Some(20.0)),
            ("/ 2", Some(20.0)),
            ("90-12", Some(78.0)),
            ("90° - 12", Some(78.0)),
            ("-10*-2", Some(20.0)),
            ("10/4", Some(2.5)),
            ("/0", None),
            ("", None),
            ("abc", None),
            ("1 2", None),
            ("1+2+3", None),
        ] {
            assert_eq!(computed(text, 40.0), value, "{text:?}");
        }
    }
}
