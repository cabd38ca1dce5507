//! Order of file names, and names that are never footage.

use std::cmp::{Ordering, Reverse};
use std::ffi::{OsStr, OsString};
use std::io;
use std::path::Path;

/// Order of file names as people count: `take (2)` before `take (10)`, in letters of any case, and numbers below 0 as
/// compositing tools write them (`shot.-3.exr`) before 0. Names without their endings come first in the comparison.
/// Names that differ only in case or leading zeros have the order of their bytes.
pub fn natural_order(a: impl AsRef<OsStr>, b: impl AsRef<OsStr>) -> Ordering {
    let (a, b) = (a.as_ref(), b.as_ref());
    let (left, right) = (a.to_string_lossy(), b.to_string_lossy());
    let ((stem_a, ending_a), (stem_b, ending_b)) = (parts(&left), parts(&right));
    (pieces(stem_a).cmp(pieces(stem_b))).then_with(|| pieces(ending_a).cmp(pieces(ending_b))).then_with(|| a.cmp(b))
}

fn parts(name: &str) -> (&str, &str) {
    name.rsplit_once('.').unwrap_or((name, ""))
}

/// Names in a folder, in [`natural_order`], without [clutter](is_clutter).
///
/// # Errors
/// When the folder cannot be read.
pub fn sorted_names(folder: &Path) -> io::Result<Vec<OsString>> {
    let mut names: Vec<OsString> = std::fs::read_dir(folder)?
        .flatten()
        .map(|entry| entry.file_name())
        .filter(|name| !is_clutter(&name.to_string_lossy()))
        .collect();
    names.sort_by(|a, b| natural_order(a, b));
    Ok(names)
}

/// True for names that systems and file managers leave in folders: hidden ones, `Thumbs.db`, `desktop.ini`, `@eaDir`,
/// `__MACOSX`.
pub fn is_clutter(name: &str) -> bool {
    const LEFT: [&str; 4] = ["Thumbs.db", "desktop.ini", "@eaDir", "__MACOSX"];
    name.starts_with('.') || LEFT.iter().any(|left| left.eq_ignore_ascii_case(name))
}

/// A piece of a name. Numbers stand at the place of digits.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
enum Piece<'a> {
    BeforeDigits(char),
    Negative(Reverse<Digits<'a>>),
    Number(Digits<'a>),
    AfterDigits(char),
}

/// A number of any length, without leading zeros.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Digits<'a> {
    count: usize,
    digits: &'a str,
}

fn pieces(name: &str) -> impl Iterator<Item = Piece<'_>> {
    let mut rest = name;
    // A hyphen after a letter or digit joins; at the start and after a dot or underscore it is a sign.
    let mut takes_sign = true;
    std::iter::from_fn(move || {
        let first = rest.chars().next()?;
        let unsigned = rest.strip_prefix('-').filter(|_| takes_sign).unwrap_or(rest);
        let text = unsigned.trim_start_matches(|c: char| c.is_ascii_digit());
        let digits = &unsigned[..unsigned.len() - text.len()];
        if digits.is_empty() {
            rest = &rest[first.len_utf8()..];
            takes_sign = matches!(first, '.' | '_');
            let lower = first.to_lowercase().next().unwrap_or(first);
            return Some(if lower < '0' { Piece::BeforeDigits(lower) } else { Piece::AfterDigits(lower) });
        }
        let is_negative = unsigned.len() < rest.len();
        rest = text;
        takes_sign = false;
        let digits = digits.trim_start_matches('0');
        let digits = Digits { count: digits.len(), digits };
        Some(if is_negative { Piece::Negative(Reverse(digits)) } else { Piece::Number(digits) })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_ordered_as_people_count() {
        let twelve: Vec<String> = (1..=12).map(|n| format!("frame_{n}.png")).collect();
        let twelve: Vec<&str> = twelve.iter().map(String::as_str).collect();
        for names in [
            &twelve[..],
            &["9996.exr", "9999.exr", "10000.exr", "10003.exr"],
            &["take.mov", "take (2).mov", "take (10).mov"],
            &["shot_2_main.tif", "shot_10_main.tif"],
            &["shot.-10.exr", "shot.-3.exr", "shot.0000.exr", "shot.2.exr"],
            &["shot.-0003.exr", "shot.0000.exr", "shot.0001.exr"],
            &["-2.exr", "-1.exr", "0.exr", "1.exr"],
            &["shot-2.exr", "shot-3.exr", "shot-10.exr"],
            &["2024-01-09.dpx", "2024-01-10.dpx", "2024-02-01.dpx"],
            &["shot.0001.exr", "SHOT.0002.EXR", "shot.0003.exr"],
            &["a.png", "B.PNG", "c.png"],
            &["a9", "a10", "a10b", "b1"],
            &["v1.2", "v1.10"],
            &["olat_01", "olat_1", "olat_02"],
            &["18446744073709551615.png", "18446744073709551616.png", "99999999999999999999.png"],
            &["Äpfel 2", "äpfel 10"],
            &["", ".png", "-", "-a", "a"],
        ] {
            for (i, a) in names.iter().enumerate() {
                for (j, b) in names.iter().enumerate() {
                    assert_eq!(natural_order(a, b), i.cmp(&j), "{a:?} and {b:?}");
                }
            }
        }
    }

    #[test]
    fn a_listing_is_in_order_and_without_clutter() {
        let folder = tempfile::tempdir().unwrap();
        let clutter =
            [".DS_Store", "._2.png", "Thumbs.db", "thumbs.DB", "@eaDir", ".@__thumb", "__MACOSX", "desktop.ini"];
        for name in ["10.png", "2.png", "1.PNG"].iter().chain(&clutter) {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        assert_eq!(sorted_names(folder.path()).unwrap(), ["1.PNG", "2.png", "10.png"]);
        assert!(clutter.iter().all(|name| is_clutter(name)) && !is_clutter("thumb.png"));
        assert!(sorted_names(&folder.path().join("none")).is_err());
    }
}
