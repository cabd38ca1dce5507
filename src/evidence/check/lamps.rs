//! Checks of the lamps: visibility, agreement, clipping, occlusion.

use super::check::{Check, Level, Subject};
use calibration::Calibration;
use calibration::rig_check::Fault;
use footage::scan::counted;
use glam::Vec3;
use light::Lamp;
use std::f32::consts::SQRT_2;

/// A direction of lower confidence may be more than five degrees off: see [`Lamp::confidence`].
const TRUSTED: f32 = 0.5;
/// Limits for the share of lamps with a doubtful direction: one wrong lamp in 41 is not visible in any picture;
/// with half of them wrong, the whole rig is uncertain.
const UNSURE: [f32; 2] = [0.03, 0.5];
/// Limits for the angle between two balls' directions. Above the first the balls are photographed or outlined
/// wrongly (as in [`Calibration::warnings`]); above the second the lamps are as wrong as untrusted lamps of a
/// single ball.
const BALLS_APART_DEG: [f32; 2] = [2.5, 5.0];
/// Share of clipped light above which a lamp's energy is unknown: the rest is too small a sample.
const HALF_CLIPPED: f32 = 0.5;
/// Limits for the estimated share of the lamps' light. Measured on the plain stage: with 2.8 % estimated, the
/// lamps behind the ball were right within 1.4° and a sixth of their energy, with 4.2 % within 3° and half of it.
const FILLED: [f32; 2] = [0.035, 0.15];

/// The four checks of the lamps.
pub(super) fn checks(calibration: &Calibration) -> Vec<Check> {
    if calibration.by_list {
        return listed_checks(calibration).into();
    }
    vec![seen(calibration), agree(calibration), clipped(calibration), hidden(calibration)]
}

/// The checks of a shoot without mirror balls.
fn listed_checks(calibration: &Calibration) -> [Check; 4] {
    const REMEDY: &str = "Photograph a mirror ball under each lamp to measure them";
    let unknown = |subject, sentence: &str| Check::new(subject, Level::Unknown, sentence);
    let same = finding(calibration, &[Fault::SameLamp, Fault::SamePicture]);
    let agree = match same {
        Some(finding) => from_finding(Subject::LampsAgree, Level::Bad, finding),
        None => {
            unknown(Subject::LampsAgree, "Directions are those of the shoot's list, without mirror balls to check them")
                .remedy(REMEDY)
        }
    };
    let sentence = "Energies are measured on the subject, up to a common factor: no mirror balls";
    [
        unknown(Subject::LampsSeen, sentence).remedy(REMEDY),
        agree,
        unknown(Subject::LampsClipped, "No mirror balls, so energies cannot be clipped there"),
        unknown(Subject::LampsHidden, "No mirror balls, so no lamp is hidden behind one"),
    ]
}

fn seen(calibration: &Calibration) -> Check {
    let lamps = &calibration.rig.lamps;
    let unseen: Vec<&Lamp> = lamps.iter().filter(|lamp| !lamp.is_usable()).collect();
    if !unseen.is_empty() || lamps.is_empty() {
        let sentence =
            format!("The mirror balls do not show {} of {} lamps{}", unseen.len(), lamps.len(), names(&unseen));
        return Check::new(Subject::LampsSeen, Level::Bad, sentence).remedy(
            "Check that these lamps were on, not blocked and not behind the ball, and photograph their balls and OLATs \
             again",
        );
    }
    if let Some(finding) = finding(calibration, &[Fault::NotSeen, Fault::Dark]) {
        return from_finding(Subject::LampsSeen, Level::Doubtful, finding);
    }
    let sentence = format!("The mirror balls show all {} lamps", lamps.len());
    Check::new(Subject::LampsSeen, Level::Good, sentence)
}

fn agree(calibration: &Calibration) -> Check {
    const WRONG: [Fault; 4] = [Fault::WrongCircle, Fault::SameLamp, Fault::SamePicture, Fault::Swapped];
    const ODD: [Fault; 2] = [Fault::Misplaced, Fault::WrongLayout];
    if let Some(finding) = finding(calibration, &WRONG) {
        return from_finding(Subject::LampsAgree, Level::Bad, finding);
    }
    let usable = || calibration.rig.lamps.iter().filter(|lamp| lamp.is_usable());
    // Lamps behind the ball have a separate check.
    let unsure: Vec<&Lamp> =
        usable().filter(|lamp| lamp.confidence < TRUSTED && !is_hidden(calibration, lamp)).collect();
    let count = usable().count();
    let [doubtful, bad] = UNSURE;
    let level = Level::new(unsure.len() as f32 / count.max(1) as f32, doubtful, bad);
    if level != Level::Good {
        let sentence = format!(
            "The directions of {} of {count} lamps are uncertain: their highlights are small, blurred, or one of several\
             {}",
            unsure.len(),
            names(&unsure)
        );
        return Check::new(Subject::LampsAgree, level, sentence).remedy(
            "Check them in the Probe workspace, and photograph these balls again: larger in the picture, in focus, \
             without other reflections",
        );
    }
    if let Some(finding) = finding(calibration, &ODD) {
        return from_finding(Subject::LampsAgree, Level::Doubtful, finding);
    }
    // A calibration of an older version has findings without kinds.
    if let (true, Some(first)) =
        (calibration.rig_faults.len() != calibration.rig_findings.len(), calibration.rig_findings.first())
    {
        return from_finding(Subject::LampsAgree, Level::Doubtful, first);
    }
    match &calibration.two_balls {
        Some(two) => {
            let [doubtful, bad] = BALLS_APART_DEG;
            let sentence = format!(
                "Two mirror balls show {} lamps {:.1}° apart in the median, {:.1}° at most",
                two.lamps, two.median_deg, two.worst_deg
            );
            let level = Level::new(two.median_deg, doubtful, bad);
            Check::new(Subject::LampsAgree, level, sentence)
                .remedy("Check the circles of both balls, and the positions in the manifest")
        }
        None if count == 0 => Check::new(Subject::LampsAgree, Level::Unknown, "No lamp was seen")
            .remedy("Photograph the mirror balls again"),
        None => {
            let sentence = match unsure.len() {
                0 => {
                    "All lamps that the ball shows in full are almost certainly within 5° of their measured directions"
                        .to_owned()
                }
                some => format!(
                    "Lamps that the ball shows in full are almost certainly within 5° of their measured directions, \
                     except for {some}{}",
                    names(&unsure)
                ),
            };
            Check::new(Subject::LampsAgree, Level::Good, sentence)
        }
    }
}

fn clipped(calibration: &Calibration) -> Check {
    let clipped = |share: f32| {
        let lamps = calibration.rig.lamps.iter();
        lamps.filter(|l| l.clipped >= share).collect::<Vec<_>>()
    };
    let half = clipped(HALF_CLIPPED);
    const REMEDY: &str = "Photograph the balls again with a shorter exposure or a denser filter";
    if !half.is_empty() {
        let sentence = format!(
            "More than half of the light of {} is clipped, so the energy is unknown{}",
            counted(half.len(), "lamp"),
            names(&half)
        );
        return Check::new(Subject::LampsClipped, Level::Bad, sentence).remedy(REMEDY);
    }
    if calibration.clipped_pixels == 0 {
        let sentence = "No mirror ball is clipped";
        return Check::new(Subject::LampsClipped, Level::Good, sentence);
    }
    let most = (calibration.rig.lamps.iter()).map(|l| l.clipped).fold(0.0, f32::max);
    let sentence = format!(
        "{} pixels of the mirror balls are clipped, at most {:.0} % of a lamp's light: clipped lamps are brighter than \
         measured",
        calibration.clipped_pixels,
        100.0 * most
    );
    Check::new(Subject::LampsClipped, Level::Doubtful, sentence).remedy(REMEDY)
}

fn hidden(calibration: &Calibration) -> Check {
    let (filled, blind) = (calibration.filled_energy, calibration.blind_share);
    let [doubtful, bad] = FILLED;
    let level = Level::new(if blind.is_nan() { blind } else { filled }, doubtful, bad);
    let lamps = match finding(calibration, &[Fault::BehindBall]) {
        Some(_) => "hides lamps, at least in part",
        None => "hides no lamp",
    };
    let sentence = format!(
        "The mirror ball {lamps}: it does not show {:.1} % of the sphere, and {:.1} % of the lamps' light is estimated",
        100.0 * blind,
        100.0 * filled
    );
    Check::new(Subject::LampsHidden, level, sentence)
        .remedy("Photograph the ball again from the side, or larger, for the lamps behind it")
}

/// True if the ball may hide a part of a lamp: the invisible cone behind it, widened by the lamp's own width.
fn is_hidden(calibration: &Calibration, lamp: &Lamp) -> bool {
    let cone = (1.0 - 2.0 * calibration.blind_share).acos().to_degrees();
    let from_axis = lamp.direction.angle_between(Vec3::NEG_Z).to_degrees();
    finding(calibration, &[Fault::BehindBall]).is_some() && from_axis < cone + SQRT_2 * lamp.spread_deg
}

/// The first sentence about one of these faults.
fn finding<'a>(calibration: &'a Calibration, faults: &[Fault]) -> Option<&'a String> {
    let found = calibration.rig_faults.iter().zip(&calibration.rig_findings);
    let mut matching = found.filter(|(fault, _)| faults.contains(fault));
    matching.next().map(|(_, sentence)| sentence)
}

/// A check from a finding of the calibration, which ends with the remedy.
fn from_finding(subject: Subject, level: Level, finding: &str) -> Check {
    let (sentence, remedy) = finding.split_once(". ").unwrap_or((finding, "Check these lamps"));
    Check::new(subject, level, sentence).remedy(remedy)
}

/// The names of some lamps, after a colon; only the first few if there are many.
fn names(lamps: &[&Lamp]) -> String {
    const MOST: usize = 6;
    if lamps.is_empty() {
        return String::new();
    }
    let listed: Vec<&str> = lamps.iter().take(MOST).map(|l| l.name.as_str()).collect();
    let more = match lamps.len().saturating_sub(MOST) {
        0 => String::new(),
        more => format!(" and {more} more"),
    };
    format!(": {}{more}", listed.join(", "))
}
