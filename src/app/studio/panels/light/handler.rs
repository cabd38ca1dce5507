//! Lights placed by hand: add, copy, paste, remove, and groups.

use crate::app::StudioApp;
use crate::command::{Command, LightsCommand, LookCommand, ViewCommand};
use crate::look::CopiedLight;
use light::Lighting;

impl StudioApp {
    pub(crate) fn apply_to_lights(&mut self, command: LightsCommand) {
        let done = self.change_lights(command);
        self.refuse_unless(done);
    }

    fn change_lights(&mut self, command: LightsCommand) -> Result<(), String> {
        let look = &self.state.look;
        let mut lighting = look.lighting.clone();
        match command {
            LightsCommand::Add => self.add_light(lighting.another_light().into()),
            LightsCommand::Duplicate => {
                let copied = CopiedLight::new(look, self.chosen_light()?);
                copied.into_iter().for_each(|copied| self.add_light(copied));
            }
            LightsCommand::Copy => {
                let copied = CopiedLight::new(look, self.chosen_light()?);
                let text = copied.map(|copied| copied.text());
                self.ctx.copy_text(text.unwrap_or_default());
            }
            LightsCommand::Paste(text) => self.add_light(CopiedLight::parse(&text)?),
            LightsCommand::Remove => {
                lighting.placed.remove(self.chosen_light()?);
                self.relight(LookCommand::Lighting(Box::new(lighting)));
            }
            LightsCommand::RenameGroup(index, name) => {
                if lighting.groups.iter().any(|group| group.name == name) {
                    return Err(format!("A group named {name} already exists. Choose another name"));
                }
                if let Some(group) = lighting.groups.get_mut(index) {
                    let before = std::mem::replace(&mut group.name, name.clone());
                    regroup(&mut lighting, &before, &name);
                    self.relight(LookCommand::Lighting(Box::new(lighting)));
                }
            }
            LightsCommand::RemoveGroup(index) => {
                if index < lighting.groups.len() {
                    let group = lighting.groups.remove(index);
                    regroup(&mut lighting, &group.name, "");
                    self.relight(LookCommand::Lighting(Box::new(lighting)));
                }
            }
        }
        Ok(())
    }

    /// Index of the selected light.
    fn chosen_light(&self) -> Result<usize, String> {
        let none = "Choose a light first: click its line in Light, or its handle";
        self.state.chosen_light().ok_or(none.to_owned())
    }

    /// Adds a light and selects it.
    fn add_light(&mut self, light: CopiedLight) {
        self.relight(LookCommand::AddLight(Box::new(light)));
        let last = self.state.look.lighting.placed.len().checked_sub(1);
        self.state.show(ViewCommand::ChooseLight(last));
    }

    /// Changes the look as one separate undo step.
    fn relight(&mut self, command: LookCommand) {
        self.state.release();
        self.apply(Command::Look(command));
        self.state.release();
    }
}

/// Moves the lights of a group to another group, or out of any group.
fn regroup(lighting: &mut Lighting, from: &str, to: &str) {
    let inside = lighting.placed.iter_mut().filter(|light| light.group == from);
    inside.for_each(|light| to.clone_into(&mut light.group));
}

#[cfg(test)]
mod tests {
    use super::*;
    use light::PlacedLight;

    #[test]
    fn lights_of_other_groups_stay_where_they_are() {
        let light = |group: &str| PlacedLight { group: group.to_owned(), ..PlacedLight::default() };
        let mut lighting = Lighting { placed: vec![light("Left"), light(""), light("Left")], ..Lighting::default() };
        regroup(&mut lighting, "Left", "Rim");
        let groups: Vec<&str> = lighting.placed.iter().map(|l| &*l.group).collect();
        assert_eq!(groups, ["Rim", "", "Rim"]);
    }
}
