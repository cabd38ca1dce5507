//! Check for motion of the subject while the lamps went round.

use super::{Check, Level, Subject};
use calibration::Calibration;
use footage::Motion;

/// Check that the poses' OLATs show one and the same subject.
pub(super) fn check(calibration: &Calibration) -> Check {
    match &calibration.motion {
        Some(motion) => judged(motion),
        None => Check::new(
            Subject::Motion,
            Level::Unknown,
            "The calibration did not look whether the subject moved while the lamps went round",
        )
        .remedy("Calibrate again"),
    }
}

fn judged(motion: &Motion) -> Check {
    let check = |level, sentence| Check::new(Subject::Motion, level, sentence);
    // Two deviations beyond what was found, as far as that is known.
    let reach = |moved: bool| -> Vec<f32> {
        let poses = motion.poses.iter().filter(move |pose| pose.corrected == moved);
        poses.map(|pose| pose.largest_px + 2.0 * pose.deviation_px).collect()
    };
    let all = motion.poses.len();
    if all == 0 || [reach(true), reach(false)].concat().iter().any(|v| v.is_nan()) {
        return check(
            Level::Unknown,
            "The OLATs do not show whether the subject moved while the lamps went round".to_owned(),
        )
        .remedy("Photograph more lamps for each pose, or fully lit tracking frames between them");
    }
    let moved = motion.poses.iter().filter(|pose| pose.corrected);
    let Some(most) = moved.clone().max_by(|a, b| a.largest_px.total_cmp(&b.largest_px)) else {
        let unseen = reach(false).into_iter().fold(0.0, f32::max);
        return check(
            Level::Good,
            format!(
                "In {all} poses no motion is seen while the lamps went round; {unseen:.1} pixels could hide"
            ),
        );
    };
    let sentence = format!(
        "While the lamps went round the subject moved in {} of {all} poses, in {} by {:.1} ± {:.1} pixels. That is \
         corrected, but not all of it",
        moved.count(),
        most.pose,
        most.largest_px,
        most.deviation_px
    );
    check(Level::Doubtful, sentence).remedy(
        "Review these poses' OLATs; photograph them again with a headrest, or take fully lit tracking frames between the lamps",
    )
}
