//! Text in a Nuke script: Tcl within braces.

use std::fmt::Write;

/// Knob value that means exactly `text`, in quotes unless it is plain. Braces are escaped too, because the node's own
/// braces are counted.
pub fn quoted(text: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "_./:%+-".contains(c);
    if !text.is_empty() && text.chars().all(is_plain) {
        return text.to_owned();
    }
    let mut quoted = String::from("\"");
    for c in text.chars() {
        match c {
            '\n' => quoted.push_str("\\n"),
            '"' | '\\' | '[' | ']' | '$' | '{' | '}' => quoted.extend(['\\', c]),
            c if c.is_control() => quoted.push('_'),
            c => quoted.push(c),
        }
    }
    quoted.push('"');
    quoted
}

/// Literal value of a knob that Nuke evaluates, such as a file or a label.
pub fn literal(text: &str) -> String {
    let mut plain = String::new();
    for c in text.chars() {
        if matches!(c, '\\' | '[' | ']' | '$') {
            plain.push('\\');
        }
        plain.push(c);
    }
    plain
}

/// A number over frames from `first` on: a constant if it does not change, otherwise a key per frame.
pub fn animated(first: i64, values: impl Iterator<Item = f32> + Clone) -> String {
    let start = values.clone().next().unwrap_or(0.0);
    if values.clone().all(|value| value == start) {
        return start.to_string();
    }
    let mut curve = String::from("{curve");
    for (frame, value) in (first..).zip(values) {
        // Writing into a string does not fail.
        let _ = write!(curve, " x{frame} {value}");
    }
    curve.push('}');
    curve
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_quoted_where_tcl_would_read_more_into_it() {
        assert_eq!(quoted("shot.%04d.exr"), "shot.%04d.exr");
        assert_eq!(quoted("my shot"), "\"my shot\"");
        assert_eq!(quoted("a \"b\" {c"), r#""a \"b\" \{c""#);
        assert_eq!(quoted("[exit] $x \\"), r#""\[exit\] \$x \\""#);
        assert_eq!(quoted("é\n"), "\"é\\n\"");
        assert_eq!(quoted(""), "\"\"");
        // Evaluated twice: by the script's reader, and by the knob.
        assert_eq!(quoted(&literal("[x]")), r#""\\\[x\\\]""#);
    }

    #[test]
    fn only_what_changes_is_a_curve() {
        assert_eq!(animated(7, [0.5; 3].into_iter()), "0.5");
        assert_eq!(animated(4_320_000, [0.5, 1e-7].into_iter()), "{curve x4320000 0.5 x4320001 0.0000001}");
        assert_eq!(animated(0, [].into_iter()), "0");
    }
}
