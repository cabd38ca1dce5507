//! Check that time codes step by one.

use super::super::TimeCode;
use super::findings::{Findings, spans};
use super::frame::{Content, Frame};
use exr::meta::attribute;
use std::collections::BTreeSet;

/// Most jumps that a message lists one by one.
const NAMED: usize = 3;

/// Adds faults of the time codes. A gap in the frame numbers is a gap in the time codes, too. `required_rate` is in frames per
/// second; without one the rate in the headers counts.
pub(super) fn time_codes(found: &mut Findings, whole: &[(&Frame, &Content)], required_rate: Option<f64>) {
    let without = whole.iter().filter(|(_, content)| content.time_code.is_none());
    let without: BTreeSet<i64> = without.map(|(frame, _)| frame.number).collect();
    if without.len() == whole.len() {
        if !whole.is_empty() {
            found.remark("time_code", "No frame has a time code");
        }
        return;
    }
    if !without.is_empty() {
        let sentence = format!("the time code is missing in {}", spans(&without));
        found.fault("time_code", without, sentence);
    }
    let stated = whole.iter().find_map(|(_, content)| content.rate.and_then(rate_of));
    let Some(rate) = required_rate.or(stated) else {
        found.remark(
            "time_code",
            "No frame has a frame rate: the steps of the time codes were not checked (use --rate)",
        );
        return;
    };
    let mut jumps = Vec::new();
    // Above 60 frames a second several frames share a time code, so several starts are possible.
    let mut starts: Vec<TimeCode> = Vec::new();
    let mut start_number = 0;
    for (frame, content) in whole {
        let Some(code) = content.time_code else { continue };
        let ahead = frame.number.saturating_sub(start_number).max(0) as usize;
        let follows: Vec<TimeCode> =
            (starts.iter().copied()).filter(|start| is_same(start.plus(ahead).into(), code)).collect();
        if follows.is_empty() {
            if let Some(start) = starts.first() {
                let wanted: attribute::TimeCode = start.plus(ahead).into();
                jumps.push((frame.number, words(code), words(wanted)));
            }
            starts = TimeCode::of_header(code, rate).collect();
            start_number = frame.number;
            if starts.is_empty() {
                jumps.push((frame.number, words(code), format!("one at {rate} frames a second")));
            }
        } else {
            starts = follows;
        }
    }
    if jumps.is_empty() {
        return;
    }
    let numbers: BTreeSet<i64> = jumps.iter().map(|(number, ..)| *number).collect();
    let named =
        jumps.iter().take(NAMED).map(|(number, is, wanted)| format!("frame {number} has {is} instead of {wanted}"));
    let named: Vec<String> = named.collect();
    let sentence = format!("the time code does not step by one at {}: {}", spans(&numbers), named.join("; "));
    found.fault("time_code", numbers, sentence);
}

/// Frame rate in frames per second; None if it is not a positive fraction.
pub(super) fn rate_of((frames, seconds): (i32, u32)) -> Option<f64> {
    (frames > 0 && seconds > 0).then(|| f64::from(frames) / f64::from(seconds))
}

fn is_same(a: attribute::TimeCode, b: attribute::TimeCode) -> bool {
    let fields = |t: attribute::TimeCode| (t.hours, t.minutes, t.seconds, t.frame, t.field_phase, t.drop_frame);
    fields(a) == fields(b)
}

/// Time code of a header, as on a slate.
pub(super) fn words(code: attribute::TimeCode) -> String {
    let attribute::TimeCode { hours, minutes, seconds, frame, .. } = code;
    let mark = if code.drop_frame { ';' } else { ':' };
    let field = if code.field_phase { " second field" } else { "" };
    format!("{hours:02}:{minutes:02}:{seconds:02}{mark}{frame:02}{field}")
}
