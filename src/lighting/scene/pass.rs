//! The passes in running order and the strengths that enable some of them, in one table for panels, command line,
//! files and bounds.

use super::{Inspection, ViewTransform};
use base::numbers::within;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Generates [`Pass`], [`Effects`] and [`STRENGTHS`] from one table.
macro_rules! passes {
    ($(
        $(#[$doc:meta])*
        $pass:ident = $name:literal, $label:literal
            $(, $field:ident up to $most:literal: $hint:literal)?;
    )*) => {
        /// One effect of the picture.
        #[derive(
            Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
        )]
        #[serde(rename_all = "snake_case")]
        pub enum Pass {
            $($(#[$doc])* $pass,)*
        }

        impl Pass {
            /// Every pass, in order.
            pub const ALL: [Pass; [$(Pass::$pass),*].len()] = [$(Pass::$pass),*];

            /// Name of this pass in reports, files and shaders.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$pass => $name,)*
                }
            }

            /// Label in the window.
            pub fn label(self) -> &'static str {
                match self {
                    $(Self::$pass => $label,)*
                }
            }
        }

        /// Effects and their strengths. The default leaves the picture of light and camera unchanged. A negative or
        /// NaN strength counts as 0.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, clap::Args)]
        #[serde(default)]
        pub struct Effects {
            $($(
                #[doc = $hint]
                #[arg(
                    long,
                    default_value_t = 0.0,
                    allow_negative_numbers = true,
                    value_parser = within(0.0f32..=$most),
                    help = format!("{} [0 to {}]", $hint, $most)
                )]
                pub $field: f32,
            )?)*
            /// View transform from light to display codes.
            #[arg(long, value_enum, default_value_t)]
            pub view: ViewTransform,
            /// Diagnostic view in place of the picture.
            #[arg(skip)]
            pub inspection: Inspection,
            /// Passes forced on or off, regardless of the plan.
            #[arg(skip)]
            pub forced: Forced,
        }

        /// Strengths that enable a pass, in the order of the passes.
        pub const STRENGTHS: &[Strength] = &[$($(
            Strength {
                pass: Pass::$pass,
                label: $label,
                hint: $hint,
                most: $most,
                of: |effects| &mut effects.$field,
            },
        )?)*];
    };
}

// Each pass has a name and a label. A pass with a strength also has its field and option, the largest value and a
// hint.
passes! {
    /// Predicts the frame's reflectance field with the network.
    Predict = "predict", "Prediction";
    /// Holds the field's brightness steady between frames.
    Smoothing = "smoothing", "Smoothing", smoothing up to 1.0:
        "Evens out jumps in brightness between frames";
    /// Distributes the environment's energy over the lamps.
    Weights = "weights", "Lamp weights";
    /// Sums the lamps' pictures and cuts out the subject.
    Relight = "relight", "Relight";
    /// Upscales the light from the working size to the plate's size and multiplies the plate by it.
    Plate = "plate", "Plate";
    /// Removes a screen's colour from the subject's rim.
    Despill = "despill", "Despill", despill up to 1.0:
        "Removes green- or blue-screen spill from the subject's edge";
    /// Draws the environment behind the subject.
    Background = "background", "Background";
    /// Puts the background out of focus.
    BackgroundBlur = "background_blur", "Background blur", background_blur up to 0.25:
        "Puts the background out of focus; radius as a share of the picture's height";
    /// Wraps light from behind around the rim and composites the subject over the background.
    LightWrap = "light_wrap", "Light wrap", light_wrap up to 1.0:
        "Wraps the background's light around the subject's edge";
    /// Scatters light above white, as in a lens.
    Glare = "glare", "Glare", glare up to 1.0:
        "Scatters light above white, as in a lens";
    /// Darkens the picture towards its corners, as in a lens.
    Vignette = "vignette", "Vignette", vignette up to 0.9:
        "Darkens the corners, as in a lens; share of light lost there";
    /// Brightens or darkens the full picture.
    Exposure = "exposure", "Exposure";
    /// Encodes linear light for a display.
    View = "view", "Tone curve";
    /// Adds the plate's grain.
    Grain = "grain", "Grain", grain up to 4.0:
        "Adds the plate's grain; 1 matches the plate";
    /// Adds a pattern below one code, so that smooth gradients show no steps.
    Dither = "dither", "Dither";
    /// Shows one channel in grey.
    Channels = "channels", "Channel";
    /// Shows the difference to a second picture.
    Difference = "difference", "Difference";
    /// Shows exposure zones in flat colours.
    FalseColor = "false_color", "False colour";
}

/// A strength among [`Effects`] that enables a pass.
#[derive(Clone, Copy, Debug)]
pub struct Strength {
    pub pass: Pass,
    /// Label on a panel.
    pub label: &'static str,
    /// Effect, for a tooltip and for `--help`.
    pub hint: &'static str,
    /// Largest value; the smallest is 0, which disables the pass.
    pub most: f32,
    /// Field of the strength.
    pub of: fn(&mut Effects) -> &mut f32,
}

impl Effects {
    /// Effects with every strength at this share of its largest value.
    pub fn all(share: f32) -> Self {
        let mut all = Self::default();
        for strength in STRENGTHS {
            *(strength.of)(&mut all) = share * strength.most;
        }
        all
    }

    /// Effects with every strength within its bounds; 0 if negative or NaN.
    pub fn bounded(mut self) -> Self {
        for strength in STRENGTHS {
            let value = (strength.of)(&mut self);
            // `f32::max` returns the other operand if one is NaN.
            *value = value.max(0.0).min(strength.most);
        }
        self
    }

    /// Strength of a pass; 0 for a pass without one.
    pub fn strength(mut self, pass: Pass) -> f32 {
        let strength = STRENGTHS.iter().find(|strength| strength.pass == pass);
        strength.map_or(0.0, |strength| *(strength.of)(&mut self))
    }

    /// True if a pass with a strength is enabled: its strength is above 0 or it is forced to run, and it is not
    /// forced off.
    pub fn asks(&self, pass: Pass) -> bool {
        let forced = self.forced.get(pass);
        forced.unwrap_or(self.strength(pass) > 0.0)
    }
}

/// Forced passes: `true` to run one, `false` to skip it. Stored in files as a table keyed by pass name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "BTreeMap<Pass, bool>", into = "BTreeMap<Pass, bool>")]
pub struct Forced([Option<bool>; Pass::ALL.len()]);

impl Forced {
    /// Forced state of a pass; None if the plan decides.
    pub fn get(self, pass: Pass) -> Option<bool> {
        self.0[pass as usize]
    }

    /// Copy with a pass forced to run (`Some(true)`), forced off (`Some(false)`), or left to the plan (None).
    pub fn with(mut self, pass: Pass, run: Option<bool>) -> Self {
        self.0[pass as usize] = run;
        self
    }

    /// Number of forced passes.
    pub fn count(self) -> usize {
        self.0.iter().flatten().count()
    }
}

impl From<BTreeMap<Pass, bool>> for Forced {
    fn from(table: BTreeMap<Pass, bool>) -> Self {
        let all = table.into_iter();
        all.fold(Self::default(), |forced, (pass, run)| forced.with(pass, Some(run)))
    }
}

impl From<Forced> for BTreeMap<Pass, bool> {
    fn from(forced: Forced) -> Self {
        let entry = |pass| Some((pass, forced.get(pass)?));
        Pass::ALL.into_iter().filter_map(entry).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[test]
    fn a_strength_that_makes_no_sense_is_brought_into_its_range() {
        let wild =
            Effects { glare: f32::NAN, despill: -1.0, grain: f32::INFINITY, light_wrap: 7.0, ..Effects::default() };
        let bounded = wild.bounded();
        assert_eq!((bounded.glare, bounded.despill), (0.0, 0.0));
        assert_eq!((bounded.grain, bounded.light_wrap), (4.0, 1.0));
    }

    #[test]
    fn what_is_forced_is_kept_by_name() {
        let forced = Forced::default().with(Pass::LightWrap, Some(true)).with(Pass::Dither, Some(false));
        let text = serde_json::to_string(&forced).unwrap();
        assert_eq!(text, r#"{"light_wrap":true,"dither":false}"#);
        assert_eq!(serde_json::from_str::<Forced>(&text).unwrap(), forced);
        assert_eq!(forced.count(), 2);
        assert_eq!(forced.with(Pass::Dither, None).count(), 1);
    }

    #[test]
    fn a_forced_effect_is_asked_for_without_a_strength_and_one_forced_off_is_not() {
        let mut effects = Effects { glare: 0.5, ..Effects::default() };
        assert!(effects.asks(Pass::Glare) && !effects.asks(Pass::Grain));
        effects.forced = effects.forced.with(Pass::Glare, Some(false));
        effects.forced = effects.forced.with(Pass::Grain, Some(true));
        assert!(!effects.asks(Pass::Glare) && effects.asks(Pass::Grain));
    }

    #[test]
    fn every_strength_has_its_own_place_and_the_name_of_its_pass_in_files_and_options() {
        #[derive(Parser)]
        struct Options {
            #[command(flatten)]
            effects: Effects,
        }
        for strength in STRENGTHS {
            let mut effects = Effects::default();
            *(strength.of)(&mut effects) = strength.most;
            for other in STRENGTHS {
                let own = other.pass == strength.pass;
                assert_eq!(effects.asks(other.pass), own, "{strength:?}");
            }
            let json = serde_json::to_value(effects).unwrap();
            let stored = json[strength.pass.name()].as_f64();
            assert_eq!(stored.map(|v| v as f32), Some(strength.most), "{strength:?}");
            let option = format!("--{}", strength.pass.name().replace('_', "-"));
            let arguments = ["relight", &option, &strength.most.to_string()];
            let asked = Options::try_parse_from(arguments).unwrap();
            assert_eq!(asked.effects, effects, "{option}");
        }
    }
}
