//! Plates, OLATs and balls with pixels that were filled from their neighbours, reported once.

use base::progress::Progress;
use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};

/// Mended pixels of a picture.
struct Mended {
    pixels: usize,
    is_reported: bool,
}

/// By the picture's name in sentences.
static MENDED: Mutex<BTreeMap<String, Mended>> = Mutex::new(BTreeMap::new());

/// Remembers the mended pixels of a picture; reading it again changes nothing.
pub(super) fn remember(name: String, pixels: usize) {
    if pixels > 0 {
        let mut all = MENDED.lock().unwrap_or_else(PoisonError::into_inner);
        all.entry(name).or_insert(Mended { pixels, is_reported: false });
    }
}

/// Reports the pixels that were mended in pictures read since the last report.
pub fn report_mended(progress: &Progress) {
    let mut all = MENDED.lock().unwrap_or_else(PoisonError::into_inner);
    let new = all.iter_mut().filter(|(_, mended)| !mended.is_reported);
    let new: Vec<(&String, usize)> = new
        .map(|(name, mended)| {
            mended.is_reported = true;
            (name, mended.pixels)
        })
        .collect();
    if let Some(sentence) = sentence(&new) {
        progress.say(sentence);
    }
}

fn sentence(mended: &[(&String, usize)]) -> Option<String> {
    let (first, _) = mended.first()?;
    let pixels: usize = mended.iter().map(|(_, pixels)| pixels).sum();
    let others = match mended.len() {
        1 => String::new(),
        2 => " and another picture".to_owned(),
        count => format!(" and {} other pictures", count - 1),
    };
    let were = if pixels == 1 { "pixel was" } else { "pixels were" };
    Some(format!("{first}{others}: {pixels} {were} NaN or infinite: filled from their neighbours"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_summed_over_pictures() {
        let names = ["plate.1003.exr", "plate.1004.exr", "plate.1005.exr"].map(str::to_owned);
        let said = |counts: &[usize]| {
            let mended: Vec<_> = names.iter().zip(counts.iter().copied()).collect();
            sentence(&mended).unwrap_or_default()
        };
        for (counts, right) in [
            (&[][..], ""),
            (&[1], "plate.1003.exr: 1 pixel was NaN or infinite: filled from their neighbours"),
            (
                &[12, 3],
                "plate.1003.exr and another picture: 15 pixels were NaN or infinite: filled from their neighbours",
            ),
            (
                &[12, 3, 1],
                "plate.1003.exr and 2 other pictures: 16 pixels were NaN or infinite: filled from their neighbours",
            ),
        ] {
            assert_eq!(said(counts), right);
        }
    }
}
