//! Time since an event in everyday words.

use std::time::{SystemTime, UNIX_EPOCH};

/// Seconds since a Unix time in seconds; 0 for a time in the future.
pub fn since(time: u64) -> u64 {
    let now = SystemTime::now().duration_since(UNIX_EPOCH);
    now.map_or(0, |now| now.as_secs().saturating_sub(time))
}

/// Time since an event, to the hour.
pub fn ago(seconds: u64) -> String {
    let (hours, days) = (seconds / 3600, seconds / 86_400);
    match days {
        0 if hours == 0 => "within the last hour".to_owned(),
        0 if hours == 1 => "1 hour ago".to_owned(),
        0 => format!("{hours} hours ago"),
        1 => "yesterday".to_owned(),
        2..14 => format!("{days} days ago"),
        14..60 => format!("{} weeks ago", days / 7),
        60..730 => format!("{} months ago", days / 30),
        _ => format!("{} years ago", days / 365),
    }
}

/// Time since an event, to the minute.
pub fn minutes_ago(seconds: u64) -> String {
    match seconds / 60 {
        0..2 => "just now".to_owned(),
        minutes @ 2..60 => format!("{minutes} min ago"),
        _ => ago(seconds),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn how_long_ago_is_read_at_a_glance() {
        let hour = 3600;
        let said = [0, hour, 5 * hour, 30 * hour, 80 * hour, 500 * hour, 2000 * hour, 30_000 * hour];
        assert_eq!(
            said.map(ago),
            [
                "within the last hour",
                "1 hour ago",
                "5 hours ago",
                "yesterday",
                "3 days ago",
                "2 weeks ago",
                "2 months ago",
                "3 years ago"
            ]
        );
    }

    #[test]
    fn what_was_just_done_is_told_to_the_minute() {
        let said = [0, 119, 120, 3599, 3600].map(minutes_ago);
        let said = said.each_ref().map(String::as_str);
        let expected = ["just now", "just now", "2 min ago", "59 min ago", "1 hour ago"];
        assert_eq!(said, expected);
    }
}
