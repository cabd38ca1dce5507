//! Strokes on mattes.

use crate::app::StudioApp;
use crate::command::MatteCommand;
use crate::layout::Pane;
use crate::panels::footage::painting::GROWTH;
use footage::{BrushSide, MatteSettings};
use worker::Job;

impl StudioApp {
    /// True if undo and redo apply to strokes: the brush is active, its pane too, and there are steps.
    pub(crate) fn paints(&self, back: bool) -> bool {
        self.state.panes.active == Pane::Footage && self.readers.matte.can_travel(back)
    }

    pub(crate) fn apply_to_matte(&mut self, command: MatteCommand) {
        let matte = &mut self.readers.matte;
        let done = match command {
            MatteCommand::Tool(on) => {
                matte.on = on;
                Ok(())
            }
            MatteCommand::ToggleTool => {
                matte.on = !matte.on;
                Ok(())
            }
            MatteCommand::Side(side) => {
                matte.side = side;
                Ok(())
            }
            MatteCommand::SwapSide => {
                matte.side = match matte.side {
                    BrushSide::Keep => BrushSide::Remove,
                    BrushSide::Remove => BrushSide::Keep,
                };
                Ok(())
            }
            MatteCommand::Radius(radius) => {
                matte.radius = Some(radius);
                Ok(())
            }
            MatteCommand::StepRadius(steps) => {
                let picture = self.readers.footage.picture();
                if let Some(Ok(shown)) = picture {
                    let radius = matte.radius(shown.size) * GROWTH.powi(steps);
                    matte.radius = Some(radius);
                    matte.radius = Some(matte.radius(shown.size));
                }
                Ok(())
            }
            MatteCommand::Stroke(stroke) => (self.session.writable()).and_then(|()| matte.paint(*stroke)),
            MatteCommand::Clear(frame) => (self.session.writable()).and_then(|()| matte.clear(frame)),
            MatteCommand::MakeAll => {
                matte.make_all();
                Ok(())
            }
        };
        self.refuse_unless(done);
    }

    /// Makes all mattes once the strokes are on disk, if requested.
    pub(crate) fn make_mattes(&mut self) {
        if let Some(failure) = self.readers.matte.failure() {
            self.status.refuse(failure);
        }
        if self.readers.matte.takes_make() {
            let done = self.session.run(|project| Job::Matte {
                project: project.root.clone(),
                settings: MatteSettings { replace: true, ..MatteSettings::default() },
            });
            self.refuse_unless(done);
        }
    }
}
