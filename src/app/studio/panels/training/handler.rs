//! Training from the start or from a checkpoint, and the way back to one.

use super::command::TrainingCommand;
use super::controls::duration;
use crate::app::StudioApp;
use worker::Job;

impl StudioApp {
    pub(crate) fn apply_to_training(&mut self, command: TrainingCommand) {
        let done = match command {
            // Training can only be resumed once the checkpoints are known.
            TrainingCommand::Start { .. } if self.readers.training.records.is_none() => {
                Err("The checkpoints are still being read".to_owned())
            }
            TrainingCommand::Start { fresh } => self.train(fresh),
            TrainingCommand::GoBack(to) => self.go_back(to),
            TrainingCommand::ListCheckpoints => {
                self.readers.training.list();
                Ok(())
            }
        };
        self.refuse_unless(done);
    }

    /// Trains with the current settings.
    fn train(&self, fresh: bool) -> Result<(), String> {
        let project = self.session.project.as_ref().ok_or("Open a project first")?;
        let training = &self.readers.training;
        let choice = training.choice(self.state.look.training, project);
        if let (Some(refusal), false) = (training.refusal(&choice, project), fresh) {
            return Err(refusal);
        }
        if let (Some(spent), false) = (training.spent(&choice), fresh) {
            let spent = duration(60.0 * spent);
            return Err(format!("Trained for {spent}: time is up. Raise Minutes, or start over"));
        }
        let settings = training.settings(&choice, fresh, self.device);
        self.session.run(|project| Job::Train { project: project.root.clone(), settings })
    }

    fn go_back(&mut self, to: String) -> Result<(), String> {
        self.session.run(|project| Job::GoBack { project: project.root.clone(), to })?;
        self.readers.training.pictures = None;
        Ok(())
    }
}
