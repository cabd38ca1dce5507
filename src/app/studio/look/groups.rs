//! Settings under one heading: whether any differs from its default, and the reset.

use super::LookSettings;
use scene::{Look, Setting};

/// The groups of settings in the light panel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Group {
    /// Rotation of the environment, and its distribution among the lamps.
    Environment,
    /// Brightness and colour of the environment.
    Grade,
    /// The lights placed by hand.
    Lights,
    /// Exposure, background, and the tone curve.
    Picture,
    /// The strengths of the effects.
    Effects,
}

impl Group {
    /// Text of its heading.
    pub fn name(self) -> &'static str {
        match self {
            Self::Environment => "Environment",
            Self::Grade => "Grade",
            Self::Lights => "Lights",
            Self::Picture => "Picture",
            Self::Effects => "Effects",
        }
    }

    /// The group of a setting.
    pub fn from_setting(setting: Setting) -> Self {
        match setting {
            Setting::Yaw | Setting::Pitch | Setting::Roll | Setting::BackgroundYaw => Self::Environment,
            Setting::Intensity | Setting::Temperature | Setting::Tint => Self::Grade,
            Setting::Exposure => Self::Picture,
            Setting::Effect(_) => Self::Effects,
            Setting::Light(..) | Setting::Group(_) => Self::Lights,
        }
    }
}

impl LookSettings {
    /// True if a setting in the group differs from its default, or has keys.
    pub fn is_changed(&self, group: Group) -> bool {
        let mut restored = self.clone();
        restored.restore(group);
        restored != *self
    }

    /// Resets a group to its defaults and removes its keys.
    pub(crate) fn restore(&mut self, group: Group) {
        let look = &mut self.shown;
        look.animation.retain(|setting| Group::from_setting(setting) != group);
        for setting in Setting::all(&look.lighting) {
            if Group::from_setting(setting) == group
                && let Some(value) = setting.field(look)
            {
                *value = setting.default_value();
            }
        }
        let default = Look::default();
        match group {
            Group::Environment => look.lighting.weighting = default.lighting.weighting,
            Group::Lights => {
                (look.lighting.placed, look.lighting.groups) = (Vec::new(), Vec::new());
            }
            Group::Picture => {
                look.background = default.background;
                look.effects.view = default.effects.view;
            }
            Group::Grade | Group::Effects => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::command::{LookCommand, ViewCommand};
    use crate::state::State;
    use light::weights::Weighting;
    use light::{Lighting, PlacedLight};
    use scene::{Background, Effects, ViewTransform};

    const ALL: [Group; 5] = [Group::Environment, Group::Grade, Group::Lights, Group::Picture, Group::Effects];

    #[test]
    fn each_setting_belongs_to_one_group_which_brings_it_back_in_one_step() {
        let lighting = |change: fn(&mut Lighting)| {
            let mut lighting = Lighting::default();
            change(&mut lighting);
            LookCommand::Lighting(Box::new(lighting))
        };
        let effects = |change: fn(&mut Effects)| {
            let mut effects = Effects::default();
            change(&mut effects);
            LookCommand::Effects(effects)
        };
        for (group, command) in [
            (Group::Environment, LookCommand::Set(Setting::Yaw, 20.0)),
            (Group::Environment, LookCommand::ToggleKey(Setting::Yaw)),
            (Group::Environment, lighting(|l| l.pitch_deg = 3.0)),
            (Group::Environment, lighting(|l| l.roll_deg = 3.0)),
            (Group::Environment, lighting(|l| l.background_yaw_deg = 3.0)),
            (Group::Environment, lighting(|l| l.weighting = Weighting::Cells)),
            (Group::Grade, LookCommand::ToggleKey(Setting::Intensity)),
            (Group::Grade, lighting(|l| l.intensity_stops = 1.0)),
            (Group::Grade, lighting(|l| l.temperature_k = 3200.0)),
            (Group::Grade, lighting(|l| l.tint = 5.0)),
            (Group::Lights, lighting(|l| l.placed.push(PlacedLight::default()))),
            (Group::Grade, LookCommand::ToggleKey(Setting::Tint)),
            (Group::Picture, LookCommand::ToggleKey(Setting::Exposure)),
            (Group::Effects, LookCommand::ToggleKey(Setting::Effect(scene::Pass::Glare))),
            (Group::Lights, lighting(|l| l.groups.push(light::LightGroup::default()))),
            (Group::Picture, LookCommand::Set(Setting::Exposure, 1.0)),
            (Group::Picture, LookCommand::Background(Background::None)),
            (Group::Picture, effects(|e| e.view = ViewTransform::Filmic)),
            (Group::Effects, effects(|e| e.glare = 0.5)),
            (Group::Effects, effects(|e| e.grain = 1.0)),
        ] {
            let mut s = State::new(5, 24.0);
            s.show(ViewCommand::Frame(2));
            let before = s.look.clone();
            s.change(command.clone());
            s.release();
            for one in ALL {
                assert_eq!(s.look.is_changed(one), one == group, "{one:?} {command:?}");
            }
            let changed = s.look.clone();
            s.change(LookCommand::Reset(group));
            s.release();
            assert_eq!(s.look, before, "{command:?}");
            s.change(LookCommand::Undo);
            assert_eq!(s.look, changed, "{command:?}");
        }
    }

    #[test]
    fn what_nothing_was_changed_of_is_no_step_when_it_is_reset() {
        let mut s = State::new(1, 24.0);
        for group in ALL {
            s.change(LookCommand::Reset(group));
        }
        assert!(!s.can_undo());
    }
}
