//! The footage: the interview's frames and the exemplars as filmed, their mattes, and the framing: the
//! square that is cut out of them.

mod brush;
pub mod command;
mod handler;
mod matte;
pub mod painting;
pub mod reader;
mod square;
mod strip;

use crate::command::{Command, LookCommand, ProjectCommand, ViewCommand};
use crate::panel_context::PanelContext;
use crate::panels::footage::reader::{FootagePicture, FootageView, MatteView};
use crate::panels::widgets::missing;
use crate::panels::widgets::notice::{notice_ui, quiet_ui};
use crate::panels::widgets::numbers::computing;
use crate::panels::widgets::rows::{field_ui, segments_ui};
use crate::status::Phase;
use crate::theme::{self, GAP};
use brush::Brush;
use egui::{Button, Frame, Margin, Panel, Ui};
use footage::scan::counted;
use project::{Framing, Padding, Project};
use square::Square;

/// Width of the column of numbers, and height of the strip of thumbnails.
const COLUMN: f32 = 272.0;
const STRIP: f32 = 70.0;

/// Holds the framing that is being edited.
#[derive(Default)]
pub struct FootagePanel {
    draft: Option<Framing>,
    /// The change waits for confirmation, because calibration and network must be made again.
    asking: bool,
    square: Square,
    brush: Brush,
}

impl FootagePanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let Some(project) = context.session.project else { return };
        if let Err(e) = project.check_parts() {
            return notice_ui(ui, |ui| {
                ui.heading("There is no footage");
                ui.add_space(GAP);
                ui.label(e.to_string());
                missing::button_ui(ui, "New project…", Command::Project(ProjectCommand::New(None)), out);
            });
        }
        let ground = || Frame::new().fill(theme::PANEL).inner_margin(Margin::symmetric(12, 0));
        Panel::bottom("footage strip")
            .exact_size(STRIP)
            .frame(ground())
            .show(ui, |ui| strip::strip_ui(ui, context, out));
        let picture = context.readers.footage.picture();
        Panel::right("framing").exact_size(COLUMN).frame(ground()).show(ui, |ui| {
            ui.add_space(GAP);
            view_ui(ui, context, project, out);
            if let Some(Ok(shown)) = picture {
                ui.add_space(GAP);
                matte::tools_ui(ui, context, out);
                ui.add_space(0.5 * GAP);
                if context.readers.matte.on {
                    matte::matte_ui(ui, context, project, shown, out)
                } else {
                    self.framing_ui(ui, context, project, shown, out)
                }
            }
        });
        let rect = ui.available_rect_before_wrap();
        ui.painter().rect_filled(rect, 0.0, theme::SURROUND);
        match picture {
            Some(Ok(shown)) if context.readers.matte.on => {
                let kept = project.settings.framing.for_size(shown.size);
                let frame = context.state.frame;
                let is_interview = !context.state.footage.exemplars;
                let allowed = is_interview && matte::refusal(context, project, frame).is_none();
                (self.brush).ui(ui, context, shown, kept, (frame, allowed), out);
            }
            Some(Ok(shown)) => {
                let kept = project.settings.framing.for_size(shown.size);
                let mut framing = self.framing(kept);
                self.square.ui(ui, shown, kept, &mut framing);
                self.draft = (framing != kept).then_some(framing);
            }
            Some(Err(sentence)) => notice_ui(ui, |ui| {
                ui.heading("This picture cannot be read");
                ui.add_space(GAP);
                ui.label(sentence);
                missing::locate_ui(ui, context, out);
            }),
            None => notice_ui(ui, |ui| {
                ui.heading("Reading the footage");
            }),
        }
    }

    /// The framing that is drawn: the edited one, or the project's.
    fn framing(&self, kept: Framing) -> Framing {
        let draft = self.draft.filter(|draft| draft.source == kept.source);
        draft.unwrap_or(kept)
    }

    fn framing_ui(
        &mut self,
        ui: &mut Ui,
        context: &PanelContext,
        project: &Project,
        shown: &FootagePicture,
        out: &mut Vec<Command>,
    ) {
        let kept = project.settings.framing.for_size(shown.size);
        let mut framing = self.framing(kept);
        let (width, height) = shown.size;
        quiet_ui(ui, &format!("The square used of {width} × {height} pixels"));
        let speed = width.max(height) as f32 / 500.0;
        egui::Grid::new("square").num_columns(2).spacing([GAP, 5.0]).show(ui, |ui| {
            let most = 4 * width.max(height);
            let field = computing(&mut framing.x).speed(speed);
            if field_ui(ui, "Left", field) {
                framing.x = kept.x;
            }
            let field = computing(&mut framing.y).speed(speed);
            if field_ui(ui, "Top", field) {
                framing.y = kept.y;
            }
            let field = computing(&mut framing.side).speed(speed);
            if field_ui(ui, "Size", field.range(1..=most)) {
                framing.side = kept.side;
            }
            ui.label("Outside");
            segments_ui(ui, |ui| {
                for padding in Padding::ALL {
                    let chosen = framing.padding == padding;
                    if ui.add(Button::selectable(chosen, padding.name())).clicked() {
                        framing.padding = padding;
                    }
                }
            });
            ui.end_row();
        });
        ui.horizontal(|ui| {
            let padding = framing.padding;
            for (name, hint, square) in [
                ("Largest", "The largest square inside the picture", Framing::largest(shown.size)),
                ("Whole", "The smallest square around the whole picture", Framing::whole(shown.size)),
            ] {
                if ui.button(name).on_hover_text(hint).clicked() {
                    framing = Framing { padding, ..square };
                }
            }
        });
        let size = project.settings.size;
        if framing.side < size {
            quiet_ui(ui, &format!("Smaller than the working size, {size}"));
        }
        framing = framing.bounded();
        self.draft = (framing != kept).then_some(framing);
        self.asking &= self.draft.is_some();
        if self.draft.is_some() {
            ui.add_space(GAP);
            self.decide_ui(ui, context, framing, out);
        }
    }

    /// Buttons that use the edited framing or discard it.
    fn decide_ui(&mut self, ui: &mut Ui, context: &PanelContext, framing: Framing, out: &mut Vec<Command>) {
        if let Some(why) = context.session.read_only {
            ui.colored_label(theme::WARNING, why);
        }
        if self.asking {
            ui.colored_label(
                theme::WARNING,
                "Calibration and network belong to the old framing. They are set aside: make both again.",
            );
        }
        let computed = match &context.status.phase {
            phase @ Phase::Blocked(_) => !phase.waits_for_job(),
            _ => true,
        };
        ui.horizontal(|ui| {
            let name = if self.asking { "Change framing anyway" } else { "Use this framing" };
            let free = context.session.read_only.is_none() && context.status.job.is_none();
            let response = ui.add_enabled(free, Button::new(name));
            if response.on_disabled_hover_text("Not while a job is running or the project is read-only").clicked() {
                if computed && !self.asking {
                    self.asking = true;
                } else {
                    self.asking = false;
                    out.push(Command::Project(ProjectCommand::Reframe(framing)));
                }
            }
            if ui.button("Revert").clicked() {
                (self.draft, self.asking) = (None, false);
            }
        });
    }
}

/// The in and out points for playback and export.
fn range_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let (first, last) = context.state.range();
    ui.horizontal(|ui| {
        for (name, hint, command) in [
            ("In", "Play and export from this frame. Key: I", Command::View(ViewCommand::MarkIn)),
            ("Out", "Play and export to this frame. Key: O", Command::View(ViewCommand::MarkOut)),
        ] {
            if ui.button(name).on_hover_text(hint).clicked() {
                out.push(command);
            }
        }
        let is_part = context.state.look.range.is_some();
        if ui.add_enabled(is_part, Button::new("All")).clicked() {
            out.push(Command::Look(LookCommand::Range(None)));
        }
        quiet_ui(ui, &if first == last { format!("Frame {first}") } else { format!("Frames {first} to {last}") });
    });
}

/// Choice of the shown picture, and of the view of its matte.
fn view_ui(ui: &mut Ui, context: &PanelContext, project: &Project, out: &mut Vec<Command>) {
    let view = context.state.footage;
    let mut choice = |ui: &mut Ui, name: &str, wanted: FootageView| {
        if ui.add(Button::selectable(view == wanted, name)).clicked() && view != wanted {
            out.push(Command::View(ViewCommand::Footage(wanted)));
        }
    };
    segments_ui(ui, |ui| {
        for (name, exemplars) in [("Interview", false), ("Poses", true)] {
            choice(ui, name, FootageView { exemplars, ..view });
        }
    });
    segments_ui(ui, |ui| {
        for (name, matte) in
            [("Picture", MatteView::Off), ("Matte overlay", MatteView::Over), ("Matte", MatteView::Alone)]
        {
            choice(ui, name, FootageView { matte, ..view });
        }
    });
    let shoot = &project.settings.shoot;
    if view.exemplars {
        ui.horizontal(|ui| {
            let last = shoot.poses.len() - 1;
            let mut pose = context.state.shoot.pose.min(last);
            let label = ui.label("Pose");
            let field = computing(&mut pose).range(0..=last).speed(0.1);
            if ui.add(field).labelled_by(label.id).changed() {
                out.push(Command::View(ViewCommand::Pose(pose)));
            }
            quiet_ui(ui, &format!("of 0–{last}, under {}", context.lamp_title(0)));
        });
    } else {
        range_ui(ui, context, out);
        let frame = context.state.frame.min(shoot.frames.len() - 1);
        quiet_ui(ui, &format!("{}, {} in all", shoot.frames.name(frame), counted(shoot.frames.len(), "frame")));
    }
}
