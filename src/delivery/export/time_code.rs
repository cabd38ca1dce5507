//! SMPTE 12M time code.

use exr::meta::attribute;
use std::fmt;

/// Hours, minutes, seconds and frames. Television rates count as the next integer: 23.976 as 24, 29.97 as 30.
/// With drop-frame counting (of 30 and 60) the first numbers of each minute but every tenth are skipped, so that
/// the count follows the clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TimeCode {
    pub hours: u8,
    pub minutes: u8,
    pub seconds: u8,
    /// From 0, below the rate.
    pub frame: u16,
    /// Frames that count as a second.
    pub rate: u16,
    /// True for drop-frame counting.
    pub drop: bool,
}

impl TimeCode {
    /// Time code of frame `frame` of a clip with `frame_rate` frames per second that starts at 00:00:00:00, without
    /// drop-frame counting; it wraps after a day.
    pub fn new(frame: usize, frame_rate: f64) -> Self {
        Self { hours: 0, minutes: 0, seconds: 0, frame: 0, rate: whole(frame_rate), drop: false }.plus(frame)
    }

    /// Reads `HH:MM:SS:FF` of a clip with `frame_rate` frames per second; a semicolon or a dot before the frames means
    /// drop-frame, which some cameras tag at exactly 30 too. None if the text is not a time code of that rate, or a number
    /// that drop-frame counting skips.
    pub fn parse(text: &str, frame_rate: f64) -> Option<Self> {
        let text = text.trim();
        let rate = whole(frame_rate);
        let parts: Vec<&str> = text.split([':', ';', '.']).collect();
        let is_number = |part: &&str| (1..=3).contains(&part.len()) && part.bytes().all(|b| b.is_ascii_digit());
        if parts.len() != 4 || !parts.iter().all(is_number) {
            return None;
        }
        let number = |i: usize| parts[i].parse::<u16>().ok();
        let drop = text.contains([';', '.']);
        let (hours, minutes, seconds, frame) = (number(0)?, number(1)?, number(2)?, number(3)?);
        let fits = hours < 24 && minutes < 60 && seconds < 60 && frame < rate;
        let can_drop = !drop || rate.is_multiple_of(30);
        let found = Self { hours: hours as u8, minutes: minutes as u8, seconds: seconds as u8, frame, rate, drop };
        let skipped = seconds == 0 && !minutes.is_multiple_of(10);
        let exists = !skipped || u64::from(frame) >= found.dropped();
        (fits && can_drop && exists).then_some(found)
    }

    /// Possible times of a header's time code in a clip with `frame_rate` frames per second: several above 60, where
    /// more than two frames share a number; none if that rate lacks the number.
    pub(super) fn of_header(code: attribute::TimeCode, frame_rate: f64) -> impl Iterator<Item = Self> {
        let rate = whole(frame_rate);
        let together = rate.div_ceil(30);
        let fits = code.hours < 24 && code.minutes < 60 && code.seconds < 60;
        let among = if code.field_phase { 1..together } else { 0..u16::from(fits) };
        let frames = among.map(move |n| u16::from(code.frame) * together + n);
        frames.filter(move |frame| fits && *frame < rate).map(move |frame| Self {
            hours: code.hours,
            minutes: code.minutes,
            seconds: code.seconds,
            frame,
            rate,
            // Other rates have no drop-frame counting.
            drop: code.drop_frame && rate.is_multiple_of(30),
        })
    }

    /// The time `frames` frames later.
    #[must_use]
    pub fn plus(self, frames: usize) -> Self {
        let rate = u64::from(self.rate);
        let dropped = self.dropped();
        let minute = 60 * rate - dropped;
        // The first of ten minutes drops none.
        let ten_minutes = 10 * minute + dropped;
        let mut count = (self.count() + frames as u64 % (144 * ten_minutes)) % (144 * ten_minutes);
        if dropped > 0 {
            let (tens, rest) = (count / ten_minutes, count % ten_minutes);
            count += 9 * dropped * tens + dropped * (rest.saturating_sub(dropped) / minute);
        }
        let seconds = count / rate;
        Self {
            hours: (seconds / 3600 % 24) as u8,
            minutes: (seconds / 60 % 60) as u8,
            seconds: (seconds % 60) as u8,
            frame: (count % rate) as u16,
            ..self
        }
    }

    /// Frames since midnight.
    pub fn count(self) -> u64 {
        let minutes = 60 * u64::from(self.hours) + u64::from(self.minutes);
        let numbers = (60 * minutes + u64::from(self.seconds)) * u64::from(self.rate) + u64::from(self.frame);
        numbers - self.dropped() * (minutes - minutes / 10)
    }

    /// Numbers dropped per minute: 2 of 30, 4 of 60.
    fn dropped(self) -> u64 {
        if self.drop { u64::from(self.rate) / 15 } else { 0 }
    }
}

/// Frames that count as a second.
fn whole(frame_rate: f64) -> u16 {
    let rate = if frame_rate.is_nan() { 1.0 } else { frame_rate };
    rate.round().clamp(1.0, 1000.0) as u16
}

impl From<TimeCode> for attribute::TimeCode {
    /// The standard has frame numbers up to 29. Faster clips number pairs (or more), and the second frame of a pair
    /// is marked as a second field.
    fn from(time: TimeCode) -> Self {
        let together = time.rate.div_ceil(30);
        Self {
            hours: time.hours,
            minutes: time.minutes,
            seconds: time.seconds,
            frame: (time.frame / together) as u8,
            field_phase: !time.frame.is_multiple_of(together),
            drop_frame: time.drop,
            ..Self::default()
        }
    }
}

impl fmt::Display for TimeCode {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { hours, minutes, seconds, frame, .. } = self;
        let mark = if self.drop { ';' } else { ':' };
        write!(f, "{hours:02}:{minutes:02}:{seconds:02}{mark}{frame:02}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_counted_as_on_a_slate() {
        let said = |frame, rate| TimeCode::new(frame, rate).to_string();
        assert_eq!(said(0, 24.0), "00:00:00:00");
        assert_eq!(said(24 * 3725 + 7, 24.0), "01:02:05:07");
        assert_eq!(said(24, 23.976), "00:00:01:00");
        assert_eq!(said(1799, 29.97), "00:00:59:29");
        assert_eq!(said(25 * 86_400, 25.0), "00:00:00:00");
        assert_eq!(said(3, 0.01), "00:00:03:00");
        for rate in [f64::NAN, -1.0, f64::INFINITY, f64::NEG_INFINITY] {
            said(usize::MAX, rate);
        }
        test_support::shown!(Strangers, "A frame rate that is NaN",
            done: "project.toml is refused; a time code takes NaN for 1");
    }

    #[test]
    fn fast_clips_count_pairs_of_frames() {
        let packed = |frame, rate| attribute::TimeCode::from(TimeCode::new(frame, rate));
        let last = packed(59, 59.94);
        assert_eq!((last.frame, last.field_phase), (29, true));
        assert_eq!((packed(58, 59.94).frame, packed(58, 59.94).field_phase), (29, false));
        assert_eq!(packed(29, 30.0).frame, 29);
        for (frame, rate) in [(47, 48.0), (119, 120.0), (999, 1000.0)] {
            packed(frame, rate).pack_time_as_tv60_u32().unwrap();
        }
    }

    #[test]
    fn dropped_numbers_keep_up_with_the_clock() {
        let rate = 30000.0 / 1001.0;
        let start = TimeCode::parse("00:00:00;00", rate).unwrap();
        // SMPTE 12M-1, and the display of every editor.
        for (frames, wanted) in [
            (1799, "00:00:59;29"),
            (1800, "00:01:00;02"),
            (3597, "00:01:59;29"),
            (3598, "00:02:00;02"),
            (17_981, "00:09:59;29"),
            (17_982, "00:10:00;00"),
            (107_892, "01:00:00;00"),
            (2_589_408, "00:00:00;00"),
        ] {
            assert_eq!(start.plus(frames).to_string(), wanted);
        }
        // Two steps equal one step.
        for frames in (0..200_000).step_by(7) {
            assert_eq!(start.plus(frames).plus(901), start.plus(frames + 901));
        }
        let fast = TimeCode::parse("01:00:59.59", 59.94).unwrap();
        assert_eq!(fast.plus(1).to_string(), "01:01:00;04");
        let packed = attribute::TimeCode::from(start.plus(1800));
        assert!(packed.drop_frame && packed.frame == 2);
        test_support::shown!(Strangers, "An interview with drop-frame time code", bound: "every frame", measured: "no frame off in a day");
    }

    #[test]
    fn each_rate_has_its_numbers() {
        for (rate, start, frames, later) in [
            (24000.0 / 1001.0, "01:00:59:23", 1, "01:01:00:00"),
            (23.976, "23:59:59:23", 1, "00:00:00:00"),
            (24.0, "00:00:59:23", 25, "00:01:01:00"),
            (25.0, "10:00:59:24", 1, "10:01:00:00"),
            (30000.0 / 1001.0, "01:00:59;29", 1, "01:01:00;02"),
            (30000.0 / 1001.0, "01:00:59:29", 1, "01:01:00:00"),
            (29.97, "01:09:59.29", 1, "01:10:00;00"),
            (30.0, "01:00:59;29", 1, "01:01:00;02"),
            (30.0, "01:00:59:29", 1, "01:01:00:00"),
            (50.0, "00:00:00:49", 2, "00:00:01:01"),
            (60000.0 / 1001.0, "01:00:59;59", 1, "01:01:00;04"),
            (59.94, "01:00:59:59", 1, "01:01:00:00"),
            (60.0, "01:00:59:59", 61, "01:01:01:00"),
            (60.0, "01:00:59;59", 1, "01:01:00;04"),
        ] {
            let read = TimeCode::parse(start, rate).unwrap_or_else(|| panic!("{start} at {rate}"));
            assert_eq!(read.to_string(), start.replace('.', ";"), "{rate}");
            assert_eq!(read.plus(frames).to_string(), later, "{start} at {rate}");
            let counted = TimeCode { hours: 0, minutes: 0, seconds: 0, frame: 0, ..read };
            assert_eq!(counted.plus(read.count() as usize), read, "{start} at {rate}");
        }
        for (rate, text) in [
            (24.0, "00:00:00:24"),
            (24.0, "00:00:00;00"),
            (25.0, "00:00:00:25"),
            (25.0, "00:00:00;00"),
            (50.0, "00:00:00;00"),
            (29.97, "01:01:00;01"),
            (30.0, "01:01:00;00"),
            (59.94, "01:01:00;03"),
            (29.97, "01:00:00;30"),
        ] {
            assert_eq!(TimeCode::parse(text, rate), None, "{text} at {rate}");
        }
        test_support::shown!(
            Strangers,
            "A movie of exactly 30 frames a second with a drop-frame time code",
            done: "its numbers are kept, and counted by dropping as the camera does",
        );
    }

    #[test]
    fn what_is_no_time_code_is_none() {
        for text in ["", "1:2", "01:00:00:24", "25:00:00:00", "00:60:00:00", "00:00:00;00", "a:b:c:d", "+1:00:00:00"] {
            assert_eq!(TimeCode::parse(text, 24.0), None, "{text}");
        }
        assert!(TimeCode::parse("00:00:00;00", 23.976).is_none());
        assert_eq!(TimeCode::parse(" 10:20:30:12", 25.0).unwrap().to_string(), "10:20:30:12");
    }
}
