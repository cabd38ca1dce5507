//! Check for motion of the subject during the lamp sequence.

use super::check::{Check, Level, Subject};
use calibration::Calibration;
use footage::Motion;

/// Checks that the subject is still in the poses' OLATs.
pub(super) fn check(calibration: &Calibration) -> Check {
    match &calibration.motion {
        Some(motion) => judged(motion),
        None => Check::new(
            Subject::Motion,
            Level::Unknown,
            "The calibration did not measure the subject's motion during the lamp sequence",
        )
        .remedy("Calibrate again"),
    }
}

fn judged(motion: &Motion) -> Check {
    let check = |level, sentence| Check::new(Subject::Motion, level, sentence);
    // Two deviations above the measured motion, where deviations are known.
    let reach = |moved: bool| -> Vec<f32> {
        let poses = motion.poses.iter().filter(move |pose| pose.corrected == moved);
        poses.map(|pose| pose.largest_px + 2.0 * pose.deviation_px).collect()
    };
    let all = motion.poses.len();
    if all == 0 || [reach(true), reach(false)].concat().iter().any(|v| v.is_nan()) {
        return check(
            Level::Unknown,
            "The OLATs do not show whether the subject moved during the lamp sequence".to_owned(),
        )
        .remedy("Photograph more lamps for each pose, or fully lit tracking frames between them");
    }
    let moved = motion.poses.iter().filter(|pose| pose.corrected);
    let Some(most) = moved.clone().max_by(|a, b| a.largest_px.total_cmp(&b.largest_px)) else {
        let unseen = reach(false).into_iter().fold(0.0, f32::max);
        return check(
            Level::Good,
            format!(
                "No motion was found in {all} poses during the lamp sequence; up to {unseen:.1} pixels could be hidden"
            ),
        );
    };
    let sentence = format!(
        "The subject moved during the lamp sequence in {} of {all} poses, in {} by {:.1} ± {:.1} pixels. Most of \
         it is corrected",
        moved.count(),
        most.pose,
        most.largest_px,
        most.deviation_px
    );
    check(Level::Doubtful, sentence).remedy(
        "Review these poses' OLATs; photograph them again with a headrest, or take fully lit tracking frames between the lamps",
    )
}
