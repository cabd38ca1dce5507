//! Cost of accuracy: its measurement, and the chosen rung.

use crate::app::StudioApp;
use crate::command::{AccuracyCommand, LookCommand};
use base::progress::Progress;
use project::Project;
use tradeoff::{Show, TradeoffSettings};
use worker::{Job, Worker};

impl StudioApp {
    pub(crate) fn apply_to_accuracy(&mut self, command: AccuracyCommand) {
        match command {
            AccuracyCommand::Measure(settings) => {
                let device = self.device;
                let done = self.session.run(|project| Job::Tradeoff {
                    project: project.root.clone(),
                    settings: Box::new(TradeoffSettings { device, ..*settings }),
                });
                self.refuse_unless(done);
            }
            AccuracyCommand::Apply(rung) => self.use_rung(rung),
            AccuracyCommand::Draw(files) => {
                let wake = self.wake();
                if let Some(project) = &self.session.project {
                    self.readers.accuracy.draw(project, &files, wake);
                }
            }
        }
    }

    /// Uses a rung's network in the project, and the rung's weights and effects for the picture.
    fn use_rung(&mut self, rung: String) {
        let Some(project) = self.session.project.clone() else { return };
        if let Err(sentence) = self.session.writable().and_then(|()| self.session.idle()) {
            return self.status.refuse(sentence);
        }
        let root = project.root.clone();
        self.errand(
            move || {
                let applied = tradeoff::apply(&project, &rung, &Progress::silent())?;
                Ok((Project::open(&root)?, applied))
            },
            |app, done| match done {
                Err(e) => app.status.refuse(e.to_string()),
                Ok((project, applied)) => {
                    if let Err(sentence) = app.session.can_leave() {
                        return app.status.refuse(sentence);
                    }
                    app.status.refusal = None;
                    let worker = Worker::start(project.clone(), app.device, app.wake());
                    app.start(project, worker);
                    app.look_as(&applied.show);
                    app.status.say(applied.sentence());
                }
            },
        );
    }

    /// Lights the picture with a rung's settings. Undoable.
    fn look_as(&mut self, show: &Show) {
        let mut lighting = self.state.look.lighting.clone();
        lighting.weighting = show.weighting;
        self.state.change(LookCommand::Lighting(Box::new(lighting)));
        if show.effects != scene::Effects::default() {
            self.state.release();
            self.state.change(LookCommand::Effects(show.effects));
        }
        self.state.release();
    }
}
