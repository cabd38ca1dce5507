//! Faults of a shot, found in the headers and pixels of its frames.

use super::findings::{Fault, Findings, joined, span, spans};
use super::frame::{Content, Frame};
use super::time::{rate_of, time_codes};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Most letters of a difference that a message shows.
const SHOWN: usize = 90;
/// Provenance keys shared by the whole shot.
const COMMON: [&str; 5] = ["version", "project", "checkpoint", "environment", "settings"];

/// Delivery requirements of a shot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Requirements {
    /// First and last required frame. None for the frames found.
    pub frames: Option<(i64, i64)>,
    /// Frames per second. None for the rate in the headers.
    pub rate: Option<f64>,
    /// Allows equal pictures in neighbouring frames.
    pub allow_repeats: bool,
}

/// Judges the frames of a shot, sorted by number.
pub(super) fn judge(frames: &[Frame], numbered: bool, settings: &Requirements) -> Findings {
    let mut found = Findings::default();
    found.numbers(frames, numbered, settings);
    let unreadable = frames.iter().filter_map(|frame| {
        let said = frame.picture.as_ref().err()?;
        Some((frame.number, said))
    });
    for (number, said) in unreadable {
        found.fault("unreadable", [number], said.clone());
    }
    let whole: Vec<(&Frame, &Content)> =
        frames.iter().filter_map(|frame| Some((frame, frame.picture.as_ref().ok()?))).collect();
    if !settings.allow_repeats {
        found.repeats(&whole);
    }
    found.not_finite(&whole);
    found.layers(&whole);
    found.beside(&whole);
    found.alike(&whole, "size", "the size", |content| {
        let [x, y, width, height] = content.display_window;
        format!("{width} × {height} pixels from {x}, {y}")
    });
    found.data_windows(&whole);
    found.alike(&whole, "channels", "the channels", |c| c.channels.clone());
    found.alike(&whole, "color", "the colour tags", |c| c.color.words());
    for (frame, content) in &whole {
        if let Some(said) = content.color.contradiction() {
            found.fault("color", [frame.number], format!("{}: {said}", frame.file.name));
        }
    }
    found.alike(&whole, "rate", "the frame rate", |c| rate_words(c.rate));
    found.rate_asked(&whole, settings);
    time_codes(&mut found, &whole, settings.rate);
    found.provenance(&whole);
    found
}

/// Frame rate as text.
pub(super) fn rate_words(rate: Option<(i32, u32)>) -> String {
    match rate {
        None => "none".to_owned(),
        Some((frames, 1)) => format!("{frames} frames a second"),
        Some((frames, seconds)) => format!("{frames}/{seconds} frames a second"),
    }
}

type Whole<'a> = [(&'a Frame, &'a Content)];

impl Findings {
    /// Finds missing and duplicate frame numbers.
    fn numbers(&mut self, frames: &[Frame], numbered: bool, settings: &Requirements) {
        let (Some(first), Some(last)) = (frames.first(), frames.last()) else { return };
        if !numbered {
            self.remark("numbers", "The file name has no frame number: missing frames were not checked");
            return;
        }
        let (from, to) = settings.frames.unwrap_or((first.number, last.number));
        let mut names: BTreeMap<i64, Vec<&str>> = BTreeMap::new();
        for frame in frames {
            names.entry(frame.number).or_default().push(&frame.file.name);
        }
        // A range may be far longer than the list of frames, so gaps are named by their ends.
        let (mut gaps, mut count, mut next) = (Vec::new(), 0u64, from);
        for number in names.keys().copied().filter(|n| (from..=to).contains(n)) {
            if number > next {
                gaps.push(span(next, number - 1));
                count += number.abs_diff(next);
            }
            next = number.saturating_add(1);
        }
        if next <= to && to != i64::MAX {
            gaps.push(span(next, to));
            count = count.saturating_add(to.abs_diff(next)).saturating_add(1);
        }
        if count > 0 {
            let all = joined(&gaps);
            let verb = if count == 1 { "is" } else { "are" };
            self.faults.push(Fault {
                kind: "missing".to_owned(),
                sentence: format!("{count} of {} {verb} missing: {all}", span(from, to)),
                frames: all,
            });
        }
        for (number, names) in names.iter().filter(|(_, names)| names.len() > 1) {
            let sentence = format!("duplicate frame {number}: {}", names.join(", "));
            self.fault("double", [*number], sentence);
        }
        let outside = frames.iter().map(|frame| frame.number);
        let outside: BTreeSet<i64> = outside.filter(|n| !(from..=to).contains(n)).collect();
        if !outside.is_empty() {
            let sentence = format!("outside the range {}: {}", span(from, to), spans(&outside));
            self.fault("extra", outside, sentence);
        }
    }

    /// Finds frames with the same picture as the frame before. Frames of one colour are ignored.
    fn repeats(&mut self, whole: &Whole) {
        let same = whole.windows(2).filter(|pair| {
            let [(_, before), (_, after)] = [pair[0], pair[1]];
            before.pixels == after.pixels && !after.is_flat
        });
        let same: BTreeSet<i64> = same.map(|pair| pair[1].0.number).collect();
        if !same.is_empty() {
            let sentence =
                format!("same picture as the frame before: {} (if intended, use --allow-repeats)", spans(&same));
            self.fault("repeated", same, sentence);
        }
    }

    fn not_finite(&mut self, whole: &Whole) {
        let bad = whole.iter().filter(|(_, content)| content.not_finite > 0);
        let bad: Vec<(i64, u64)> = bad.map(|(f, content)| (f.number, content.not_finite)).collect();
        if bad.is_empty() {
            return;
        }
        let count: u64 = bad.iter().map(|(_, count)| count).sum();
        let numbers: BTreeSet<i64> = bad.iter().map(|(number, _)| *number).collect();
        let values = if count == 1 { "value is" } else { "values are" };
        let sentence = format!("{count} {values} NaN or infinite, in {}", spans(&numbers));
        self.fault("not_finite", numbers, sentence);
    }

    /// Finds light layers that are missing in some frames, or that do not rebuild the picture.
    fn layers(&mut self, whole: &Whole) {
        let has = |(_, content): &&(&Frame, &Content)| content.layers.is_some();
        let with = whole.iter().filter(has).count();
        if with == 0 {
            if !whole.is_empty() {
                self.remark("layers", "No light layers to check");
            }
            return;
        }
        let without = whole.iter().filter(|pair| !has(pair));
        let without: BTreeSet<i64> = without.map(|(frame, _)| frame.number).collect();
        if !without.is_empty() {
            let sentence = format!("light layers are missing in {}; {with} frames have them", spans(&without));
            self.fault("layers", without, sentence);
        }
        let mut inexact = BTreeSet::new();
        let mut worst = (0, 0.0);
        for (frame, content) in whole {
            match &content.layers {
                Some(Err(said)) => self.fault("layers", [frame.number], said.clone()),
                Some(Ok(rebuild)) if !rebuild.is_exact() => {
                    inexact.insert(frame.number);
                    if inexact.len() == 1 || rebuild.residual > worst.1 {
                        worst = (frame.number, rebuild.residual);
                    }
                }
                _ => (),
            }
        }
        if !inexact.is_empty() {
            let sentence = format!(
                "the weighted sum of the light layers does not rebuild the picture in {}: the largest difference is \
                 {:.2e}, in frame {}",
                spans(&inexact),
                worst.1,
                worst.0
            );
            self.fault("rebuild", inexact, sentence);
        }
    }

    /// Finds missing files of light layers.
    fn beside(&mut self, whole: &Whole) {
        for (frame, content) in whole {
            let gone = content.beside.iter().find(|file| file.c4.is_empty());
            if let Some(gone) = gone {
                let sentence = format!("cannot read {}, which {} needs", gone.name, frame.file.name);
                self.fault("layers", [frame.number], sentence);
            }
        }
    }

    fn data_windows(&mut self, whole: &Whole) {
        let mut seen = BTreeSet::new();
        let mut outside = BTreeSet::new();
        for (frame, content) in whole {
            let ([x, y, width, height], [left, top, columns, rows]) = (content.data_window, content.display_window);
            seen.insert(content.data_window);
            // The file stores the data window's corner relative to the display window.
            let fits = x >= left && y >= top && x + width <= left + columns && y + height <= top + rows;
            if !fits {
                outside.insert(frame.number);
            }
        }
        if !outside.is_empty() {
            let sentence = format!("the data window extends beyond the picture in {}", spans(&outside));
            self.fault("data_window", outside, sentence);
        } else if seen.len() > 1 {
            self.remark(
                "data_window",
                "The data window changes between frames, as it does when empty borders are cropped",
            );
        }
    }

    fn rate_asked(&mut self, whole: &Whole, settings: &Requirements) {
        let Some(asked) = settings.rate else { return };
        let other = whole.iter().filter(|(_, content)| {
            let found = content.rate.and_then(rate_of);
            found.is_some_and(|found| (found - asked).abs() > 5e-3)
        });
        let other: BTreeSet<i64> = other.map(|(frame, _)| frame.number).collect();
        let found = whole.iter().find(|(frame, _)| other.contains(&frame.number));
        if let Some((_, content)) = found {
            let sentence =
                format!("the header has {} instead of {asked} in {}", rate_words(content.rate), spans(&other));
            self.fault("rate", other, sentence);
        }
    }

    /// Compares the frames. The most frequent value counts as right; frames with another value are named.
    fn alike(&mut self, whole: &Whole, kind: &'static str, what: &str, words: impl Fn(&Content) -> String) {
        let mut groups: HashMap<String, Vec<i64>> = HashMap::new();
        for (frame, content) in whole {
            groups.entry(words(content)).or_default().push(frame.number);
        }
        let most = groups.iter().max_by_key(|(_, numbers)| (numbers.len(), Reverse(numbers[0])));
        let Some((usual, _)) = most else { return };
        let mut others: Vec<_> = groups.iter().filter(|(found, _)| *found != usual).collect();
        others.sort_by_key(|(_, numbers)| numbers[0]);
        for (found, numbers) in others {
            let numbers: BTreeSet<i64> = numbers.iter().copied().collect();
            let [found, usual] = difference(found, usual);
            let sentence = format!("{what}: {found} in {}; {usual} in most frames", spans(&numbers));
            self.fault(kind, numbers, sentence);
        }
    }

    /// Checks that all frames share one provenance, and that each header holds the frame number of its file name.
    fn provenance(&mut self, whole: &Whole) {
        let says = whole.iter().filter(|(_, content)| content.provenance.is_some()).count();
        if says == 0 {
            if !whole.is_empty() {
                self.remark("provenance", "No frame has a provenance");
            }
            return;
        }
        for key in COMMON {
            self.alike(whole, "provenance", &format!("provenance ({key})"), |content| {
                content.made_of().get(key).map_or("nothing", |value| value).to_owned()
            });
        }
        // A pipeline may start at another number, but not change the order.
        let offset = |frame: &Frame, content: &Content| {
            let made: i128 = content.made_of().get("frame")?.parse().ok()?;
            Some(i128::from(frame.number) - made)
        };
        let offsets = whole.iter().filter_map(|(f, content)| Some((f.number, offset(f, content)?)));
        let offsets: Vec<(i64, i128)> = offsets.collect();
        let mut counts: HashMap<i128, usize> = HashMap::new();
        for (_, offset) in &offsets {
            *counts.entry(*offset).or_default() += 1;
        }
        let usual = counts.iter().max_by_key(|(offset, count)| (**count, -offset.abs()));
        let Some((&usual, _)) = usual else { return };
        let moved = offsets.iter().filter(|(_, offset)| *offset != usual);
        let moved: BTreeSet<i64> = moved.map(|(number, _)| *number).collect();
        if !moved.is_empty() {
            let sentence = format!("the frame number in the header differs from the file name in {}", spans(&moved));
            self.fault("order", moved, sentence);
        }
    }
}

/// Excerpts of two texts around their first difference.
fn difference(found: &str, usual: &str) -> [String; 2] {
    let same = (found.chars().zip(usual.chars())).take_while(|(a, b)| a == b).count();
    let longest = found.chars().count().max(usual.chars().count());
    let skipped = if longest > SHOWN { same.saturating_sub(20) } else { 0 };
    [found, usual].map(|text| {
        let start = if skipped > 0 { "…" } else { "" };
        let shown: String = text.chars().skip(skipped).take(SHOWN).collect();
        let end = if text.chars().count() > skipped + SHOWN { "…" } else { "" };
        format!("{start}{shown}{end}")
    })
}
