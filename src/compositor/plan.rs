//! Which passes a scene calls for, and why. The plan is data: it can be shown, tested and overruled.

use crate::scene::{Background, Output, Scene};
use serde::Serialize;

/// One effect of the picture, in the order in which they run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Pass {
    /// The network predicts the frame's reflectance field.
    Predict,
    /// The environment's energy is given to the lamps.
    Weights,
    /// The lamps' pictures are summed, and the subject is cut out.
    Relight,
    /// The environment is drawn behind the subject.
    Background,
    /// Everything is made brighter or darker.
    Exposure,
    /// Linear light is encoded for a display.
    View,
    /// A pattern below one code keeps smooth gradients from showing steps.
    Dither,
}

impl Pass {
    /// The name that finds this pass everywhere: in reports, files and shaders.
    pub fn name(self) -> &'static str {
        match self {
            Self::Predict => "predict",
            Self::Weights => "weights",
            Self::Relight => "relight",
            Self::Background => "background",
            Self::Exposure => "exposure",
            Self::View => "view",
            Self::Dither => "dither",
        }
    }
}

/// What the plan has to know besides the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facts {
    /// The reflectance field of the scene's frame was there already.
    pub field_cached: bool,
    /// The weights of the scene's environment and yaw were there already.
    pub weights_cached: bool,
    /// Lamps of the rig.
    pub lamps: usize,
    /// Lamps whose weight is not zero.
    pub lit_lamps: usize,
    /// Share in `[0, 1]` of pixels that the subject does not cover wholly.
    pub open_share: f32,
}

/// The decision about one pass.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedPass {
    pub pass: Pass,
    pub run: bool,
    /// Why it runs, or why it may be left out without changing the picture.
    pub reason: String,
}

/// Decides about every pass, in the order in which they run.
pub fn plan(scene: &Scene, facts: &Facts) -> Vec<PlannedPass> {
    let decide = |pass, run, yes: String, no: &str| PlannedPass {
        pass,
        run,
        reason: if run { yes } else { no.to_owned() },
    };
    let wanted = scene.background == Background::Environment;
    let background = wanted && facts.open_share > 0.0;
    let display = scene.output == Output::Display;
    let no_background = if wanted {
        "the subject covers every pixel"
    } else {
        "the scene asks for no background"
    };
    vec![
        decide(
            Pass::Predict,
            !facts.field_cached,
            format!("frame {} had no reflectance field yet", scene.frame),
            "the reflectance field of this frame is at hand",
        ),
        decide(
            Pass::Weights,
            !facts.weights_cached,
            "the environment or its yaw is new".to_owned(),
            "the weights of this environment and yaw are at hand",
        ),
        decide(
            Pass::Relight,
            facts.lit_lamps > 0,
            format!(
                "{} of {} lamps carry energy; no other is read",
                facts.lit_lamps, facts.lamps
            ),
            "no lamp carries energy, so the subject is black",
        ),
        decide(
            Pass::Background,
            background,
            format!(
                "it shows in {:.0} % of the pixels",
                (100.0 * facts.open_share).max(1.0)
            ),
            no_background,
        ),
        decide(
            Pass::Exposure,
            scene.exposure_stops != 0.0,
            format!("{:+} stops", scene.exposure_stops),
            "0 stops change nothing",
        ),
        decide(
            Pass::View,
            display,
            "a display wants sRGB".to_owned(),
            "the output stays linear",
        ),
        decide(
            Pass::Dither,
            display && background,
            "8 bits would show steps in the smooth background".to_owned(),
            if display {
                no_background
            } else {
                "the output stays linear"
            },
        ),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    const FACTS: Facts = Facts {
        field_cached: false,
        weights_cached: false,
        lamps: 41,
        lit_lamps: 38,
        open_share: 0.6,
    };

    fn scene() -> Scene {
        Scene {
            frame: 3,
            yaw_deg: 0.0,
            exposure_stops: 1.0,
            background: Background::Environment,
            output: Output::Display,
        }
    }

    fn names(scene: &Scene, facts: &Facts) -> Vec<&'static str> {
        plan(scene, facts)
            .iter()
            .filter(|p| p.run)
            .map(|p| p.pass.name())
            .collect()
    }

    #[test]
    fn a_new_frame_for_a_window_runs_everything() {
        let all = [
            "predict",
            "weights",
            "relight",
            "background",
            "exposure",
            "view",
            "dither",
        ];
        assert_eq!(names(&scene(), &FACTS), all);
    }

    #[test]
    fn a_turn_of_the_environment_never_asks_the_network() {
        let turned = Facts {
            field_cached: true,
            ..FACTS
        };
        assert!(!names(&scene(), &turned).contains(&"predict"));
        assert!(names(&scene(), &turned).contains(&"weights"));
    }

    #[test]
    fn a_linear_cut_out_at_0_stops_needs_the_sum_alone() {
        let bare = Scene {
            exposure_stops: 0.0,
            background: Background::None,
            output: Output::Linear,
            ..scene()
        };
        let cached = Facts {
            field_cached: true,
            weights_cached: true,
            ..FACTS
        };
        assert_eq!(names(&bare, &cached), ["relight"]);
    }

    #[test]
    fn what_cannot_be_seen_does_not_run() {
        let covered = Facts {
            open_share: 0.0,
            ..FACTS
        };
        assert!(!names(&scene(), &covered).contains(&"background"));
        assert!(!names(&scene(), &covered).contains(&"dither"));
        let dark = Facts {
            lit_lamps: 0,
            ..FACTS
        };
        assert!(!names(&scene(), &dark).contains(&"relight"));
    }

    #[test]
    fn every_decision_has_a_reason() {
        for cached in [false, true] {
            let facts = Facts {
                field_cached: cached,
                weights_cached: cached,
                ..FACTS
            };
            assert!(plan(&scene(), &facts).iter().all(|p| !p.reason.is_empty()));
        }
        let relight = &plan(&scene(), &FACTS)[2];
        assert_eq!(
            relight.reason,
            "38 of 41 lamps carry energy; no other is read"
        );
    }
}
