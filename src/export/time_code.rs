//! The time of a frame as post-production counts it: SMPTE 12M, from the clip's frame 0 at 00:00:00:00.

use exr::meta::attribute;
use std::fmt;

/// Hours, minutes, seconds and frames. Rates of television count as the next whole one, without dropped
/// numbers: 23.976 as 24, 29.97 as 30.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeCode {
    pub hours: u8,
    pub minutes: u8,
    pub seconds: u8,
    /// From 0, less than the rate.
    pub frame: u16,
    /// Frames that count as a second.
    pub rate: u16,
}

impl TimeCode {
    /// The time of frame `frame` of a clip of `frame_rate` frames per second; after a day it starts again.
    pub fn of(frame: usize, frame_rate: f64) -> Self {
        let rate = if frame_rate.is_nan() { 1.0 } else { frame_rate };
        let rate = rate.round().clamp(1.0, 1000.0) as usize;
        let seconds = frame / rate;
        Self {
            hours: (seconds / 3600 % 24) as u8,
            minutes: (seconds / 60 % 60) as u8,
            seconds: (seconds % 60) as u8,
            frame: (frame % rate) as u16,
            rate: rate as u16,
        }
    }
}

impl From<TimeCode> for attribute::TimeCode {
    /// The standard has numbers up to 29. Faster clips count pairs (or more), and the second frame of a pair
    /// is marked as a second field.
    fn from(time: TimeCode) -> Self {
        let together = time.rate.div_ceil(30);
        Self {
            hours: time.hours,
            minutes: time.minutes,
            seconds: time.seconds,
            frame: (time.frame / together) as u8,
            field_phase: !time.frame.is_multiple_of(together),
            ..Self::default()
        }
    }
}

impl fmt::Display for TimeCode {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self {
            hours,
            minutes,
            seconds,
            frame,
            ..
        } = self;
        write!(f, "{hours:02}:{minutes:02}:{seconds:02}:{frame:02}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_counted_as_on_a_slate() {
        let said = |frame, rate| TimeCode::of(frame, rate).to_string();
        assert_eq!(said(0, 24.0), "00:00:00:00");
        assert_eq!(said(24 * 3725 + 7, 24.0), "01:02:05:07");
        assert_eq!(said(24, 23.976), "00:00:01:00");
        assert_eq!(said(1799, 29.97), "00:00:59:29");
        assert_eq!(said(25 * 86_400, 25.0), "00:00:00:00");
        assert_eq!(said(3, 0.01), "00:00:03:00");
        for rate in [f64::NAN, -1.0, f64::INFINITY, f64::NEG_INFINITY] {
            said(usize::MAX, rate);
        }
        test_support::shown!(Strangers, "A frame rate that is NaN", danger: "the time code divides by 0",
            done: "project.toml is refused; a time code takes NaN for 1");
    }

    #[test]
    fn fast_clips_count_pairs_of_frames() {
        let packed = |frame, rate| attribute::TimeCode::from(TimeCode::of(frame, rate));
        let last = packed(59, 59.94);
        assert_eq!((last.frame, last.field_phase), (29, true));
        assert_eq!(
            (packed(58, 59.94).frame, packed(58, 59.94).field_phase),
            (29, false)
        );
        assert_eq!(packed(29, 30.0).frame, 29);
        for (frame, rate) in [(47, 48.0), (119, 120.0), (999, 1000.0)] {
            packed(frame, rate).pack_time_as_tv60_u32().unwrap();
        }
    }
}
