//! Review page: one HTML file with embedded pictures.

use super::page::{Contents, Sheet, WorstPictures, page};
use super::pictures::ScoredPictures;
use super::reviewer::Reviewer;
use super::{Marks, Metric, Review};
use base::error::Result;
use base::files::write_beside;
use base::progress::Progress;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

/// Number of OLATs shown with pictures.
pub(super) const WORST: usize = 12;

/// Writes the page.
pub(super) fn write_report(
    path: &Path,
    review: &Review,
    marks: &Marks,
    reviewer: &Reviewer,
    progress: &Progress,
) -> Result<()> {
    let mut wanted: BTreeMap<usize, Vec<(usize, usize)>> = BTreeMap::new();
    let worst: Vec<_> = review.worst(Metric::Flip).into_iter().take(WORST).collect();
    for (rank, &(case, lamp)) in worst.iter().enumerate() {
        wanted.entry(case).or_default().push((rank, lamp));
    }
    let shown = sheet_case(review);
    wanted.entry(shown).or_default();
    let mut pictures = vec![Default::default(); worst.len()];
    let mut sheet = Vec::new();
    for (done, (&case, lamps)) in wanted.iter().enumerate() {
        progress.check("the figures are saved; the page was not written")?;
        let scores = &review.cases[case];
        progress.step("pictures", done as u64, wanted.len() as u64, &scores.name);
        let case_pictures = ScoredPictures::new(reviewer.predict(scores.case)?, scores.scale);
        for &(rank, lamp) in lamps {
            pictures[rank] = case_pictures.row(lamp)?;
        }
        if case == shown {
            sheet = case_pictures.sheet()?;
        }
    }
    let total = wanted.len() as u64;
    progress.step("pictures", total, total, "");
    let worst = worst.into_iter().zip(pictures);
    let seconds = SystemTime::now().duration_since(UNIX_EPOCH);
    let text = page(&Contents {
        name: &reviewer.project.settings.name,
        date: &utc_date(seconds.map_or(0, |s| s.as_secs())),
        facts: facts(reviewer),
        review,
        marks,
        directions: reviewer.calibration.rig.lamps.iter().map(|l| l.direction).collect(),
        worst: worst.map(|((case, lamp), pictures)| WorstPictures { case, lamp, pictures }).collect(),
        sheet: Sheet { case: shown, pictures: sheet },
    });
    write_beside(path, |out| out.write_all(text.as_bytes()))
}

/// Case of the contact sheet: the one with the largest difference among those held out of training.
fn sheet_case(review: &Review) -> usize {
    let means = review.case_means(Metric::Flip);
    let rank = |&case: &usize| (u8::from(!review.cases[case].seen), means[case]);
    (0..means.len()).max_by(|a, b| rank(a).partial_cmp(&rank(b)).unwrap_or(std::cmp::Ordering::Equal)).unwrap_or(0)
}

/// Facts about network and calibration.
fn facts(reviewer: &Reviewer) -> Vec<(&'static str, String)> {
    let info = reviewer.predictor.network().map(|network| network.info());
    let calibration = &reviewer.calibration;
    let size = reviewer.project.settings.size;
    let network = info.map_or("not trained yet".to_owned(), |info| {
        let network = &info.network;
        let (lamps, width, most) = (network.lamps, network.width, network.most_channels);
        format!("{lamps} lamps at {size} × {size} pixels, {width} to {most} channels")
    });
    let training = info.map_or("none".to_owned(), |info| {
        let (minutes, frames) = (info.seconds / 60.0, info.training_frames.len());
        format!("{} steps in {minutes:.1} minutes, {frames} interview frames", info.step)
    });
    let mut facts = vec![
        ("OLATs", "poses carried over; poses from the other poses alone".to_owned()),
        ("Network", network),
        ("Training", training),
        ("Camera response", calibration.response.to_string()),
        ("Exposure of the interview", format!("{:.3}", calibration.exposure)),
        ("Interview light from directions without a lamp", format!("{:.1} %", 100.0 * calibration.uncovered_energy)),
        ("Clipped pixels of mirror balls", calibration.clipped_pixels.to_string()),
    ];
    if let Some(held_out) = info.and_then(|info| info.held_out.as_ref()) {
        let pose = &reviewer.project.settings.shoot.poses;
        let name = pose.get(held_out.pose).map_or("a pose", String::as_str);
        facts.push(("Held-out pose", name.to_owned()));
    }
    let findings = calibration.rig_findings.iter();
    facts.extend(findings.map(|finding| ("Problems with the lamps", finding.clone())));
    facts
}

/// UTC date from seconds since 1970, by 400-year cycles of the Gregorian calendar.
fn utc_date(seconds: u64) -> String {
    // Years starting in March have their leap day at the end.
    let days = seconds / 86_400 + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day_of_year = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day_of_year + 2) / 153;
    let day_of_month = day_of_year - (153 * month + 2) / 5 + 1;
    let month = if month < 10 { month + 3 } else { month - 9 };
    let year = 400 * era + year + u64::from(month <= 2);
    format!("{year}-{month:02}-{day_of_month:02}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn days_are_those_of_the_calendar() {
        let days = [
            (0, "1970-01-01"),
            (951_782_400, "2000-02-29"),
            (951_868_799, "2000-02-29"),
            (951_868_800, "2000-03-01"),
            (1_735_689_599, "2024-12-31"),
            (4_107_542_400, "2100-03-01"),
        ];
        for (seconds, date) in days {
            assert_eq!(utc_date(seconds), date);
        }
    }

    #[test]
    fn the_sheet_shows_what_training_has_not_seen() {
        let review = super::super::tests::example();
        assert_eq!(sheet_case(&review), 0);
    }
}
