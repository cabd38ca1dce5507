//! Settings and buttons of the matte brush.

use crate::command::{Command, MatteCommand, ViewCommand};
use crate::panel_context::PanelContext;
use crate::panels::footage::painting::MattePainting;
use crate::panels::footage::reader::{FootagePicture, FootageView};
use crate::panels::widgets::notice::quiet_ui;
use crate::panels::widgets::numbers::computing;
use crate::panels::widgets::rows::{field_ui, segments_ui};
use crate::theme::{self, GAP};
use egui::{Button, Ui};
use footage::{BrushSide, strokes};
use project::Project;

/// The two tools of the pane.
pub fn tools_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    segments_ui(ui, |ui| {
        for (name, hint, on) in
            [("Framing", "Set the crop", false), ("Paint matte", "Paint what belongs to the person. Key: M", true)]
        {
            let tool = Button::selectable(context.readers.matte.on == on, name);
            if ui.add(tool).on_hover_text(hint).clicked() {
                out.push(Command::Matte(MatteCommand::Tool(on)));
            }
        }
    });
}

/// Reason why strokes do not affect the shown picture; None if they do.
pub fn refusal(context: &PanelContext, project: &Project, frame: usize) -> Option<String> {
    if !strokes::is_own_matte(project, frame) {
        return Some("The shoot has its own matte for this frame. Remove that file to make one here.".to_owned());
    }
    if let Some(why) = context.session.read_only {
        return Some(why.to_owned());
    }
    match context.readers.matte.strokes() {
        Some(Err(sentence)) => Some(sentence.clone()),
        _ => None,
    }
}

/// Brush, state and buttons.
pub fn matte_ui(
    ui: &mut Ui,
    context: &PanelContext,
    project: &Project,
    shown: &FootagePicture,
    out: &mut Vec<Command>,
) {
    let view = context.state.footage;
    if view.exemplars {
        quiet_ui(ui, "Strokes are painted on interview frames. Poses are cut out by brightness.");
        if ui.button("Show the interview").clicked() {
            let interview = FootageView { exemplars: false, ..view };
            out.push(Command::View(ViewCommand::Footage(interview)));
        }
        return;
    }
    let frame = context.state.frame;
    if let Some(why) = refusal(context, project, frame) {
        ui.colored_label(theme::WARNING, why);
    } else {
        brush_ui(ui, context, shown, out);
        ui.add_space(GAP);
        found_ui(ui, context, frame);
    }
    ui.add_space(GAP);
    strokes_ui(ui, context, frame, out);
    ui.add_space(GAP);
    let free = context.session.read_only.is_none() && context.status.job.is_none();
    let make = ui.add_enabled(free, Button::new("Make all mattes"));
    let make = make
        .on_hover_text("Remakes, with these strokes, every matte that the shoot does not supply")
        .on_disabled_hover_text("Not while a job is running or the project is read-only");
    if make.clicked() {
        out.push(Command::Matte(MatteCommand::MakeAll));
    }
}

fn brush_ui(ui: &mut Ui, context: &PanelContext, shown: &FootagePicture, out: &mut Vec<Command>) {
    segments_ui(ui, |ui| {
        for (name, hint, side) in [
            ("Keep", "Paint the person. Key: X; the right button removes", BrushSide::Keep),
            ("Remove", "Paint the background. Key: X; the right button keeps", BrushSide::Remove),
        ] {
            let chosen = Button::selectable(context.readers.matte.side == side, name);
            if ui.add(chosen).on_hover_text(hint).clicked() {
                out.push(Command::Matte(MatteCommand::Side(side)));
            }
        }
    });
    egui::Grid::new("brush").num_columns(2).spacing([GAP, 5.0]).show(ui, |ui| {
        let mut radius = context.readers.matte.radius(shown.size);
        let before = radius;
        let field = computing(&mut radius).range(strokes::RADII).speed(0.02 * before).max_decimals(1).suffix(" px");
        if field_ui(ui, "Radius", field) {
            radius = MattePainting::fitting_radius(shown.size);
        }
        if radius != before {
            out.push(Command::Matte(MatteCommand::Radius(radius)));
        }
    });
    quiet_ui(ui, "Wheel, [ and ] change the size. Ctrl+Z undoes a stroke.");
}

/// The frame's matte in words.
fn found_ui(ui: &mut Ui, context: &PanelContext, frame: usize) {
    match context.readers.matte.live(frame) {
        Some(Err(sentence)) => drop(ui.colored_label(theme::WARNING, sentence)),
        Some(Ok(_)) => quiet_ui(ui, "Red is removed."),
        None => (),
    }
    if context.readers.matte.is_seeking() {
        ui.horizontal(|ui| {
            ui.spinner();
            quiet_ui(ui, "Finding the matte");
        });
    }
}

/// Frames that have strokes.
fn strokes_ui(ui: &mut Ui, context: &PanelContext, frame: usize, out: &mut Vec<Command>) {
    let Some(Ok(strokes)) = context.readers.matte.strokes() else { return };
    let frames = strokes.frames();
    if frames.is_empty() {
        quiet_ui(ui, "No strokes yet.");
        return;
    }
    let names: Vec<String> = frames.iter().take(12).map(ToString::to_string).collect();
    let more = if frames.len() > 12 { " …" } else { "" };
    quiet_ui(
        ui,
        &format!(
            "Strokes on frame{} {}{more}. They correct the frames around, too.",
            if frames.len() == 1 { "" } else { "s" },
            names.join(", ")
        ),
    );
    let clear = Button::new("Clear this frame");
    let writable = context.session.read_only.is_none() && frames.contains(&frame);
    if ui.add_enabled(writable, clear).clicked() {
        out.push(Command::Matte(MatteCommand::Clear(frame)));
    }
}
