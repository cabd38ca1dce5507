//! Calibration, and the outline and response set by hand.

use super::command::CalibrationCommand;
use crate::app::StudioApp;
use crate::command::LookCommand;
use calibration::{CalibrateSettings, Circle};
use worker::Job;

impl StudioApp {
    pub(crate) fn apply_to_calibration(&mut self, command: CalibrationCommand) {
        let done = match command {
            CalibrationCommand::FindCircle => self.find_circle(),
            CalibrationCommand::NudgeCircle { by, radius } => self.nudge_circle(by, radius),
            CalibrationCommand::NudgeTrial(by) => self.nudge_trial(by),
            CalibrationCommand::Start => self.calibrate(CalibrateSettings {
                circle: self.state.look.circle,
                trial: self.state.look.trial,
                ..CalibrateSettings::default()
            }),
        };
        self.refuse_unless(done);
    }

    fn find_circle(&mut self) -> Result<(), String> {
        let circle = self.readers.analysis.found()?;
        self.state.change(LookCommand::Circle(Some(circle)));
        Ok(())
    }

    fn nudge_circle(&mut self, by: [f64; 2], radius: f64) -> Result<(), String> {
        let Circle { center_px: [x, y], radius_px } = self.readers.analysis.circle(&self.state)?;
        let moved = Circle::new([x + by[0], y + by[1]], radius_px + radius);
        let moved = moved.map_err(|e| e.to_string())?;
        self.state.change(LookCommand::Circle(Some(moved)));
        Ok(())
    }

    fn nudge_trial(&mut self, by: [f32; 3]) -> Result<(), String> {
        let trial = self.readers.analysis.trial(&self.state)?.nudged(by);
        self.state.change(LookCommand::Trial(Some(trial)));
        Ok(())
    }

    pub(crate) fn calibrate(&self, settings: CalibrateSettings) -> Result<(), String> {
        self.session.run(|project| Job::Calibrate { project: project.root.clone(), settings })
    }
}
