//! Light by the face: a press on the picture places a light, which then follows the pointer.

use crate::app::StudioApp;
use crate::command::{AimCommand, AimedLight, Command, LookCommand};
use crate::layout::Pane;
use crate::panels::viewport::light_aim::AimQuestion;

impl StudioApp {
    pub(crate) fn apply_to_aim(&mut self, command: AimCommand) {
        match command {
            AimCommand::Toggle if !self.state.viewport.aims && !self.shows_picture() => {
                let sentence = "Light by the face needs the picture. Open Relight.";
                self.status.refuse(sentence.to_owned());
            }
            AimCommand::Toggle => {
                self.state.viewport.aims = !self.state.viewport.aims;
                self.readers.aim.clear();
            }
            AimCommand::Begin(light) => self.state.begin_aim(light),
            AimCommand::At(pixel) => {
                if let Some(relit) = &self.preview.relit {
                    let question = AimQuestion {
                        of: relit.predicted.clone(),
                        rig: relit.rig.clone(),
                        pixel,
                        drag: self.state.aim_drag(),
                    };
                    let wake = self.wake();
                    self.readers.aim.ask(question, wake);
                }
            }
        }
    }

    fn shows_picture(&self) -> bool {
        self.state.panes.shows(Pane::Picture) && self.preview.relit.is_some()
    }

    /// Places or moves the light as new directions arrive.
    pub(crate) fn receive_aim(&mut self) {
        let (found, failure) = self.readers.aim.receive();
        for (question, direction) in found {
            if let Some(pixel) = question.pixel {
                self.apply(Command::Look(LookCommand::Aim(AimedLight {
                    drag: question.drag,
                    frame: question.of.frame.index,
                    pixel,
                    direction,
                })));
            }
        }
        failure.into_iter().for_each(|it| self.status.refuse(it));
    }
}
