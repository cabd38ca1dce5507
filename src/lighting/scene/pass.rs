//! The passes, in the order in which they run, and the strengths that ask for some of them: one table, which panels,
//! command line, files and bounds read.

use super::{Forced, Inspection, ViewTransform};
use base::numbers::within;
use serde::{Deserialize, Serialize};

/// Makes [`Pass`], [`Effects`] and [`STRENGTHS`] of one table.
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

            /// The name that finds this pass everywhere: in reports, files and shaders.
            pub fn name(self) -> &'static str {
                match self {
                    $(Self::$pass => $name,)*
                }
            }

            /// Label for people to read.
            pub fn label(self) -> &'static str {
                match self {
                    $(Self::$pass => $label,)*
                }
            }
        }

        /// Effects and their strengths. The default leaves the picture as light and camera made it.
        /// A strength that is negative or NaN counts as 0.
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
            /// The view transform: how light becomes display codes.
            #[arg(long, value_enum, default_value_t)]
            pub view: ViewTransform,
            /// View that is shown in place of the picture itself.
            #[arg(skip)]
            pub inspection: Inspection,
            /// Passes that run, or are skipped, whatever the picture calls for.
            #[arg(skip)]
            pub forced: Forced,
        }

        /// The strengths that ask for a pass, in the order of the passes.
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

// A pass has its name and its label; one that is asked for by a strength has: its field and option, the largest value and
// its hint.
passes! {
    /// The network predicts the frame's reflectance field.
    Predict = "predict", "Prediction";
    /// The field's brightness is held steady from frame to frame.
    Smoothing = "smoothing", "Smoothing", smoothing up to 1.0:
        "Evens out jumps in brightness between frames";
    /// The environment's energy is given to the lamps.
    Weights = "weights", "Lamp weights";
    /// The lamps' pictures are summed, and the subject is cut out.
    Relight = "relight", "Relight";
    /// The light of the working size is brought to the plate's size, where it multiplies the plate.
    Plate = "plate", "Plate";
    /// A screen's colour is taken out of the subject's rim.
    Despill = "despill", "Despill", despill up to 1.0:
        "Removes green- or blue-screen spill from the subject's edge";
    /// The environment is drawn behind the subject.
    Background = "background", "Background";
    /// The background is put out of focus.
    BackgroundBlur = "background_blur", "Background blur", background_blur up to 0.25:
        "Puts the background out of focus; radius as a share of the picture's height";
    /// Light from behind reaches around the rim, and the subject is laid over what is behind it.
    LightWrap = "light_wrap", "Light wrap", light_wrap up to 1.0:
        "Wraps the background's light around the subject's edge";
    /// The lens scatters light that is brighter than white.
    Glare = "glare", "Glare", glare up to 1.0:
        "Scatters light above white, as a lens does";
    /// The lens darkens the picture towards its corners.
    Vignette = "vignette", "Vignette", vignette up to 0.9:
        "Darkens the corners, as a lens does; share of light that they lose";
    /// Everything is made brighter or darker.
    Exposure = "exposure", "Exposure";
    /// Linear light is encoded for a display.
    View = "view", "Tone curve";
    /// The picture gets the plate's grain.
    Grain = "grain", "Grain", grain up to 4.0:
        "Adds the plate's grain; 1 matches the plate";
    /// A pattern below one code keeps smooth gradients from showing steps.
    Dither = "dither", "Dither";
    /// One channel is shown in grey.
    Channels = "channels", "Channel";
    /// The difference to a second picture is shown.
    Difference = "difference", "Difference";
    /// Zones of exposure are shown in flat colours.
    FalseColor = "false_color", "False colour";
}

/// A strength among [`Effects`], which asks for a pass.
#[derive(Clone, Copy, Debug)]
pub struct Strength {
    pub pass: Pass,
    /// Label on a panel.
    pub label: &'static str,
    /// Its effect, for a hint and for `--help`.
    pub hint: &'static str,
    /// The largest value; the smallest is 0, which asks for nothing.
    pub most: f32,
    /// Its place.
    pub of: fn(&mut Effects) -> &mut f32,
}

impl Effects {
    /// Every strength at this share of its largest value.
    pub fn all(share: f32) -> Self {
        let mut all = Self::default();
        for strength in STRENGTHS {
            *(strength.of)(&mut all) = share * strength.most;
        }
        all
    }

    /// These with every strength within its bounds: 0 if it is negative or NaN.
    pub fn bounded(mut self) -> Self {
        for strength in STRENGTHS {
            let value = (strength.of)(&mut self);
            // `f32::max` takes the other side if one is NaN.
            *value = value.max(0.0).min(strength.most);
        }
        self
    }

    /// The strength that asks for a pass; 0 if it has none.
    pub fn strength(mut self, pass: Pass) -> f32 {
        let strength = STRENGTHS.iter().find(|strength| strength.pass == pass);
        strength.map_or(0.0, |strength| *(strength.of)(&mut self))
    }

    /// True if a pass that has a strength is asked for: by the strength, or because it is forced to run and not
    /// forced off.
    pub fn asks(&self, pass: Pass) -> bool {
        let forced = self.forced.get(pass);
        forced.unwrap_or(self.strength(pass) > 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[test]
    fn a_strength_that_makes_no_sense_is_brought_into_its_range() {
        let wild = Effects {
            glare: f32::NAN,
            despill: -1.0,
            grain: f32::INFINITY,
            light_wrap: 7.0,
            ..Effects::default()
        };
        let bounded = wild.bounded();
        assert_eq!((bounded.glare, bounded.despill), (0.0, 0.0));
        assert_eq!((bounded.grain, bounded.light_wrap), (4.0, 1.0));
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
