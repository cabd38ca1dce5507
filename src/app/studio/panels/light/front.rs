//! The question "Which way is front?" for a panorama file, and the list that changes the answer later.

use crate::command::{Command, LookCommand};
use crate::panel_context::PanelContext;
use crate::panels::widgets::rows::choice_ui;
use crate::panels::widgets::sphere::{MARK_RADIUS, Mark, clicked, in_order, mark_ui, place, share};
use crate::theme::{self, GAP};
use egui::{Button, Pos2, Rect, Response, RichText, Ui, vec2};
use glam::Quat;
use light::conventions::{Front, Tool};
use light::latlong;

/// The possible fronts, each with the names of the programs that use it.
fn choices() -> Vec<(Front, String)> {
    let mut choices = vec![(Front::default(), "Afterlight".to_owned())];
    for tool in Tool::ALL {
        let front = Front::from_tool(tool);
        match choices.iter_mut().find(|(known, _)| *known == front) {
            Some((_, names)) => *names += &format!(", {}", tool.title()),
            None => choices.push((front, tool.title().to_owned())),
        }
    }
    choices
}

/// The choices as numbered marks on the panorama in `rect`, turned with it. A click on a mark chooses it; a
/// click anywhere else makes that direction the front.
pub fn marks_ui(ui: &Ui, context: &PanelContext, rect: Rect, response: &Response, turn: Quat, out: &mut Vec<Command>) {
    let choices = choices();
    let now = context.state.look.front();
    let marks: Vec<Mark> = (choices.iter().enumerate())
        .map(|(i, (front, _))| Mark {
            number: i + 1,
            direction: turn * latlong::direction_from_uv(front.column(), 0.5),
            chosen: *front == now,
            doubtful: false,
        })
        .collect();
    // Some programs put the front at the left edge: its mark must not be cut in half.
    let within = rect.shrink(MARK_RADIUS);
    let places: Vec<Pos2> = (marks.iter()).map(|mark| within.clamp(place(rect, mark.direction))).collect();
    let painter = ui.painter().with_clip_rect(rect);
    for (mark, at) in in_order(&marks, &places) {
        mark_ui(&painter, at, mark, false);
    }
    let marked = clicked(response, &marks, &places);
    let answer = match (marked, response.interact_pointer_pos()) {
        (Some(number), _) => choices[number - 1].0,
        (None, Some(at)) if response.clicked() => {
            let (u, v) = share(rect, at);
            Front::at_direction(turn.inverse() * latlong::direction_from_uv(u, v))
        }
        _ => return,
    };
    out.push(Command::Look(LookCommand::Front(context.state.look.environment, Some(answer))));
}

/// The question with a button for each choice.
pub fn question_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    ui.add_space(GAP / 2.0);
    ui.strong("Which way is front in this file?");
    let hint = "Choose the program it was made for, or click the panorama where front is.";
    ui.label(RichText::new(hint).small().color(theme::QUIET));
    for (i, (front, names)) in choices().into_iter().enumerate() {
        let text = format!("{}   {names}", i + 1);
        let button =
            Button::new(text).min_size(vec2(ui.available_width(), 24.0)).selected(front == context.state.look.front());
        if ui.add(button).clicked() {
            out.push(Command::Look(LookCommand::Front(context.state.look.environment, Some(front))));
        }
    }
    ui.add_space(GAP / 2.0);
}

/// The chosen front as a row of a grid. Returns true if the person chose to pick it on the panorama.
pub fn answer_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) -> bool {
    let look = &context.state.look;
    let now = look.front();
    let choices = choices();
    let pointed = format!("{:.1}° from the centre", -now.yaw_deg());
    let mut all: Vec<(Option<Front>, &str)> =
        choices.iter().map(|(front, names)| (Some(*front), names.as_str())).collect();
    if choices.iter().all(|(front, _)| *front != now) {
        all.push((Some(now), &pointed));
    }
    all.push((None, "pick on panorama…"));
    let mut wanted = Some(now);
    choice_ui(ui, "Front", &all, &mut wanted)
        .on_hover_text("Front direction in the file, by the program it was made for. Saved with the project.");
    if let Some(front) = wanted.filter(|front| *front != now) {
        out.push(Command::Look(LookCommand::Front(look.environment, Some(front))));
    }
    wanted.is_none()
}
