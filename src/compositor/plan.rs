//! Which passes a scene calls for, and why. The plan is data: it can be shown, tested and overruled.

use super::background::Backdrop;
use super::despill::Spill;
use super::grain;
use super::smoothing;
use scene::{Background, Effects, Inspection, Output, Pass, Scene, ViewTransform};
use std::hash::{DefaultHasher, Hash, Hasher};

/// Spill that takes less than this share of the rim's luminance is left where it is.
pub const LEAST_SPILL: f32 = 0.005;

/// Wrapped light that adds less than this share to the rim's is left out.
pub const LEAST_WRAP: f32 = 0.002;

/// What the plan has to know besides the scene. What an effect's need is measured by is measured where the
/// scene asks for the effect; else it is left at its default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
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
    /// What the picture is made of, as numbers that differ where the things do.
    pub inputs: Inputs,
    /// The gain that would hold this frame's brightness steady, where smoothing was measured.
    pub steady_gain: Option<[f32; 3]>,
    /// The spill of the relit subject's rim.
    pub spill: Option<Spill>,
    /// What wrapping wholly would add to the rim, as a share of the rim's light.
    pub wrap_need: f32,
    /// The largest linear value before exposure.
    pub brightest: f32,
    /// The largest deviation of the plate's grain beyond the picture's own, in codes.
    pub missing_grain: f32,
    /// There is a second picture to compare with.
    pub second_picture: bool,
}

/// Numbers that stand for what the passes read: equal numbers stand for equal things.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Inputs {
    /// The frame: its field and its matte.
    pub frame: u64,
    /// The lamps' weights and the subject's level.
    pub light: u64,
    /// The panorama, its level and the camera that sees it.
    pub backdrop: u64,
    /// The plate's grain.
    pub grain: u64,
    /// The second picture.
    pub second: u64,
}

/// The decision about one pass.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedPass {
    pub pass: Pass,
    pub run: bool,
    /// Why it runs, or why it may be left out without changing the picture; whether it was forced.
    pub reason: String,
    /// Why it cannot be forced to run or to be left out; nothing where it can.
    pub fixed: Option<&'static str>,
    /// Stands for all that the picture after this pass depends on: where it did not change, neither did
    /// the picture. A pass that is left out has the key of the picture that it passes on.
    pub key: u64,
}

/// The picture behind the subject is needed whole, not only where the matte is open.
pub(super) fn draws_whole(effects: &Effects) -> bool {
    effects.asks(Pass::BackgroundBlur) || effects.asks(Pass::LightWrap)
}

/// Nothing is behind the subject: the scene asks for no background, or it is forced off.
pub(super) fn is_cut_out(scene: &Scene) -> bool {
    scene.background == Background::None
        || scene.effects.forced.get(Pass::Background) == Some(false)
}

/// A number that stands for `parts`.
pub(super) fn key(parts: impl Hash) -> u64 {
    let mut hasher = DefaultHasher::new();
    parts.hash(&mut hasher);
    hasher.finish()
}

/// Decides about every pass, in the order in which they run.
pub fn plan(scene: &Scene, facts: &Facts) -> Vec<PlannedPass> {
    let effects = scene.effects.bounded();
    let mut planned: Vec<PlannedPass> = Vec::with_capacity(Pass::ALL.len());
    for pass in Pass::ALL {
        let fixed = fixed(pass, scene);
        let forced = effects.forced.get(pass).filter(|_| fixed.is_none());
        let (run, reason) = match (forced, decision(pass, scene, &effects, facts)) {
            (None, Ok(reason)) => (true, reason),
            (None, Err(reason)) => (false, reason),
            (Some(true), Ok(reason) | Err(reason)) => (true, format!("forced; {reason}")),
            // Whether it would be called for was not measured.
            (Some(false), _) => (false, "forced off".to_owned()),
        };
        let upstream = upstream_key(pass, scene, &facts.inputs, &planned);
        let key = match pass {
            // Whether these had to be made anew does not change what they are.
            Pass::Predict | Pass::Weights => upstream,
            _ if run => key((pass, upstream, parameters(pass, scene, &effects, facts))),
            // Nothing is behind the subject, whatever the panorama is.
            Pass::Background => 0,
            _ => upstream,
        };
        planned.push(PlannedPass {
            pass,
            run,
            reason,
            fixed,
            key,
        });
    }
    planned
}

/// Why a pass cannot be forced; nothing where it can.
fn fixed(pass: Pass, scene: &Scene) -> Option<&'static str> {
    let bare = is_cut_out(scene);
    let linear = scene.output == Output::Linear;
    match pass {
        Pass::Predict | Pass::Weights => {
            Some("it is made once and kept: no picture is made without it")
        }
        Pass::Relight => Some("it makes the subject: no picture is made without it"),
        Pass::View => Some("it makes what a display can show"),
        Pass::Channels | Pass::FalseColor => Some("it is chosen under Show"),
        Pass::Difference => Some("it needs a second picture: it is chosen under Compare"),
        Pass::Background if scene.background == Background::None => {
            Some("the scene asks for no background")
        }
        Pass::BackgroundBlur | Pass::LightWrap if bare => Some("nothing is behind the subject"),
        Pass::Grain | Pass::Dither if linear => Some("the output stays linear"),
        _ => None,
    }
}

/// What a pass reads.
fn upstream_key(pass: Pass, scene: &Scene, inputs: &Inputs, planned: &[PlannedPass]) -> u64 {
    let of = |wanted: Pass| {
        let found = planned.iter().find(|p| p.pass == wanted);
        found.map_or(0, |p| p.key)
    };
    match pass {
        Pass::Predict => key((scene.frame, inputs.frame)),
        Pass::Weights => inputs.light,
        Pass::Relight => key((of(Pass::Smoothing), of(Pass::Weights))),
        Pass::Despill => of(Pass::Relight),
        Pass::Background => inputs.backdrop,
        Pass::LightWrap => key((of(Pass::Despill), of(Pass::BackgroundBlur))),
        Pass::Difference => key((of(Pass::Channels), inputs.second)),
        Pass::Grain => key((of(Pass::View), inputs.grain)),
        _ => planned.last().map_or(0, |p| p.key),
    }
}

/// The settings and measurements that a pass goes by.
fn parameters(pass: Pass, scene: &Scene, effects: &Effects, facts: &Facts) -> u64 {
    let bits = f32::to_bits;
    match pass {
        Pass::Predict | Pass::Weights | Pass::Relight => 0,
        Pass::Smoothing => key(facts.steady_gain.map(|gain| gain.map(bits))),
        Pass::Despill => key((bits(effects.despill), facts.spill.map(|s| s.screen))),
        Pass::Background => {
            let Backdrop {
                yaw_deg,
                tilt,
                level,
            } = Backdrop::of(scene, 1.0);
            let turn = (bits(yaw_deg), tilt.to_array().map(bits));
            key((turn, level.map(bits), draws_whole(effects)))
        }
        Pass::BackgroundBlur => key(bits(effects.background_blur)),
        Pass::LightWrap => key(bits(effects.light_wrap)),
        Pass::Glare => key([effects.glare, scene.exposure_stops].map(bits)),
        Pass::Exposure => key(bits(scene.exposure_stops)),
        Pass::View => key(effects.view),
        Pass::Grain => key((bits(effects.grain), scene.frame)),
        Pass::Dither => facts.inputs.frame,
        Pass::Channels | Pass::Difference | Pass::FalseColor => key(match effects.inspection {
            Inspection::Picture | Inspection::FalseColor => (None, 0),
            Inspection::Channel(channel) => (Some(channel), 0),
            Inspection::Difference { gain } => (None, bits(gain)),
        }),
    }
}

/// Whether a pass runs, and why: `Ok` to run, `Err` to leave it out.
fn decision(pass: Pass, scene: &Scene, effects: &Effects, facts: &Facts) -> Result<String, String> {
    let decide = |run: bool, yes: String, no: &str| if run { Ok(yes) } else { Err(no.to_owned()) };
    let asked = |strength: f32| {
        if strength > 0.0 {
            Ok(())
        } else {
            Err("the scene does not ask for it".to_owned())
        }
    };
    let behind = if scene.background == Background::None {
        Err("the scene asks for no background".to_owned())
    } else if is_cut_out(scene) {
        Err("the background is forced off".to_owned())
    } else if facts.open_share > 0.0 {
        Ok(())
    } else {
        Err("the subject covers every pixel".to_owned())
    };
    let displayed = match scene.output {
        Output::Display => Ok(()),
        Output::Linear => Err("the output stays linear".to_owned()),
    };
    match pass {
        Pass::Predict => decide(
            !facts.field_cached,
            format!("frame {} had no reflectance field yet", scene.frame),
            "the reflectance field of this frame is at hand",
        ),
        Pass::Smoothing => {
            asked(effects.smoothing)?;
            let gain = facts.steady_gain.unwrap_or([1.0; 3]);
            let change = gain
                .map(|g| (g - 1.0).abs())
                .into_iter()
                .fold(0.0, f32::max);
            decide(
                change > smoothing::UNSEEN,
                format!(
                    "the brightness jumped, and {:.1} % of it are held back",
                    100.0 * change
                ),
                "the brightness did not flicker by 0.1 %",
            )
        }
        Pass::Weights => decide(
            !facts.weights_cached,
            "the environment, its turn or its grade is new".to_owned(),
            "the weights of this light are at hand",
        ),
        Pass::Relight => decide(
            facts.lit_lamps > 0,
            format!(
                "{} of {} lamps are lit; the rest are skipped",
                facts.lit_lamps, facts.lamps
            ),
            "no lamp is lit, so the subject is black",
        ),
        Pass::Despill => {
            asked(effects.despill)?;
            match facts.spill.filter(|spill| spill.excess > LEAST_SPILL) {
                Some(spill) => Ok(format!(
                    "{:.1} % of the rim's light is {} spill",
                    100.0 * spill.excess,
                    ["green", "blue"][spill.screen.channel() - 1]
                )),
                None => Err("the rim is no greener and no bluer than what is inside".to_owned()),
            }
        }
        Pass::Background => behind.map(|()| {
            let percent = (100.0 * facts.open_share).max(1.0);
            format!("it shows in {percent:.0} % of the pixels")
        }),
        Pass::BackgroundBlur => {
            asked(effects.background_blur)?;
            behind.map(|()| {
                let percent = 100.0 * effects.background_blur;
                format!("points become discs of {percent:.1} % of the height")
            })
        }
        Pass::LightWrap => {
            asked(effects.light_wrap)?;
            behind?;
            decide(
                effects.light_wrap * facts.wrap_need > LEAST_WRAP,
                format!(
                    "it adds {:.1} % to the rim",
                    100.0 * effects.light_wrap * facts.wrap_need
                ),
                "the background is no brighter than the rim",
            )
        }
        Pass::Glare => {
            asked(effects.glare)?;
            let brightest = facts.brightest * scene.exposure_stops.exp2();
            decide(
                brightest > 1.0,
                format!("the brightest light is {brightest:.1} times white"),
                "nothing is brighter than white",
            )
        }
        Pass::Exposure => decide(
            scene.exposure_stops != 0.0,
            format!("{:+} stops", scene.exposure_stops),
            "0 stops change nothing",
        ),
        Pass::View => displayed.map(|()| {
            let curve = match effects.view {
                ViewTransform::Srgb => "a display wants sRGB",
                ViewTransform::Filmic => "a display wants sRGB; highlights roll off as on film",
                ViewTransform::Aces => "a display wants sRGB, by way of ACES",
            };
            curve.to_owned()
        }),
        Pass::Grain => {
            asked(effects.grain)?;
            displayed?;
            let steps = 255.0 * facts.missing_grain;
            decide(
                facts.missing_grain > grain::UNSEEN,
                format!("the plate has grain of {steps:.1} codes more"),
                "the plate has no more grain than the picture",
            )
        }
        Pass::Dither => {
            displayed?;
            behind.map(|()| "8 bits would show steps in the smooth background".to_owned())
        }
        Pass::Channels => {
            displayed?;
            match effects.inspection {
                Inspection::Channel(channel) => Ok(format!("{channel:?} is looked at alone")),
                _ => Err("the scene does not ask for it".to_owned()),
            }
        }
        Pass::Difference => {
            displayed?;
            match effects.inspection {
                Inspection::Difference { gain } => decide(
                    facts.second_picture,
                    format!("two pictures are compared, {gain} times enlarged"),
                    "there is no second picture",
                ),
                _ => Err("the scene does not ask for it".to_owned()),
            }
        }
        Pass::FalseColor => {
            displayed?;
            match effects.inspection {
                Inspection::FalseColor => Ok("zones of exposure are looked at".to_owned()),
                _ => Err("the scene does not ask for it".to_owned()),
            }
        }
    }
}

#[cfg(test)]
#[path = "plan_tests.rs"]
mod tests;
