//! Division of frames into chunks.

use serde::{Deserialize, Serialize};
use std::fmt::{self, Display};
use std::str::FromStr;

/// Requested frames: `A-B`, one frame `A`, or `A+N`, which is up to N frames starting at A.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct FrameSpan {
    pub first: usize,
    /// At least 1.
    pub count: usize,
    /// True if the span may be cut at the job's last frame.
    is_cut: bool,
}

impl FrameSpan {
    /// Frames `first` to `last`.
    pub fn new(first: usize, last: usize) -> Self {
        Self { first, count: last.saturating_sub(first).saturating_add(1), is_cut: false }
    }

    /// First and last frame, in a job whose last frame is `last`.
    pub fn within(self, last: usize) -> (usize, usize) {
        let end = self.first.saturating_add(self.count - 1);
        (self.first, if self.is_cut { end.min(last) } else { end })
    }
}

impl FromStr for FrameSpan {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| {
            let number = text.trim().parse::<usize>();
            number.map_err(|e| format!("{text:?} is not a frame number: {e}"))
        };
        if let Some((first, count)) = text.split_once('+') {
            let (first, count) = (number(first)?, number(count)?);
            if count == 0 {
                return Err(format!("{text:?} has no frames"));
            }
            let is_cut = true;
            return Ok(Self { first, count, is_cut });
        }
        let (first, last) = text.split_once('-').unwrap_or((text, text));
        let (first, last) = (number(first)?, number(last)?);
        if first > last {
            return Err(format!("{first} comes after {last}"));
        }
        Ok(Self::new(first, last))
    }
}

impl Display for FrameSpan {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let (_, last) = self.within(usize::MAX);
        match (self.is_cut, self.count) {
            (true, count) => write!(f, "{}+{count}", self.first),
            (false, 1) => write!(f, "{}", self.first),
            (false, _) => write!(f, "{}-{last}", self.first),
        }
    }
}

/// Frames per chunk for this many minutes at this many milliseconds per frame: at least 1, at most all.
pub(crate) fn chunk_size(ms_per_frame: f64, minutes: f64, frames: usize) -> usize {
    let fitting = minutes * 60e3 / ms_per_frame.max(1e-3);
    (fitting as usize).clamp(1, frames.max(1))
}

/// Ascending frames as spans without gaps.
pub(crate) fn spans(frames: impl IntoIterator<Item = usize>) -> Vec<FrameSpan> {
    let mut found: Vec<FrameSpan> = Vec::new();
    for frame in frames {
        match found.last_mut() {
            Some(span) if span.first + span.count == frame => span.count += 1,
            _ => found.push(FrameSpan::new(frame, frame)),
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spans_are_read_as_they_are_written() {
        for (text, within) in [("3-9", (3, 9)), ("4", (4, 4)), ("3+4", (3, 6)), ("3+9", (3, 7))] {
            let span: FrameSpan = text.parse().unwrap();
            assert_eq!(span.to_string(), text);
            let last = if text == "3-9" { 99 } else { 7 };
            assert_eq!(span.within(last), within, "{text}");
        }
        let most = usize::MAX;
        for (text, within) in [(format!("1-{most}"), (1, most)), (format!("{most}+{most}"), (most, 7))] {
            let span: FrameSpan = text.parse().unwrap();
            assert_eq!((span.to_string(), span.within(7)), (text, within));
        }
        for text in ["", "a", "9-3", "3+0", "3+", "-1", "1-2-3"] {
            assert!(text.parse::<FrameSpan>().is_err(), "{text}");
        }
    }

    #[test]
    fn frames_that_follow_each_other_are_one_span() {
        let found = spans([3, 4, 5, 9, 11, 12]);
        let said: Vec<String> = found.iter().map(ToString::to_string).collect();
        assert_eq!(said, ["3-5", "9", "11-12"]);
    }

    #[test]
    fn a_chunk_takes_as_long_as_was_asked() {
        assert_eq!(chunk_size(100.0, 10.0, 1_000_000), 6000);
        assert_eq!(chunk_size(100.0, 10.0, 50), 50);
        assert_eq!(chunk_size(1e9, 10.0, 50), 1);
        assert_eq!(chunk_size(0.0, 10.0, 50), 50);
    }
}
