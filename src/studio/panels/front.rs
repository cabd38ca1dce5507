//! "Which way is front?": the question about a panorama's file, and the answer that can be changed later.

use super::panorama::{place, share};
use super::rows::choice_ui;
use super::sphere::{MARK_RADIUS, Mark, clicked, in_order, mark_ui};
use crate::command::{Command, LookCommand};
use crate::panel_context::PanelContext;
use crate::theme::{self, GAP};
use egui::{Button, Pos2, Rect, Response, RichText, Ui, vec2};
use glam::Quat;
use light::conventions::{Front, Tool};
use light::latlong;

/// What can be answered: fronts, with the programs that have them there.
fn choices() -> Vec<(Front, String)> {
    let mut choices = vec![(Front::default(), "Afterlight".to_owned())];
    for tool in Tool::ALL {
        let front = Front::of(tool);
        match choices.iter_mut().find(|(known, _)| *known == front) {
            Some((_, names)) => *names += &format!(", {}", tool.title()),
            None => choices.push((front, tool.title().to_owned())),
        }
    }
    choices
}

/// The choices as numbered marks on the panorama in `rect`, turned as that is. A click on one answers, and so
/// does one on any other place: that is the front.
pub fn marks_ui(
    ui: &Ui,
    context: &PanelContext,
    rect: Rect,
    response: &Response,
    turn: Quat,
    out: &mut Vec<Command>,
) {
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
    // The left edge is a front of some: its mark is drawn whole.
    let within = rect.shrink(MARK_RADIUS);
    let places: Vec<Pos2> = (marks.iter())
        .map(|mark| within.clamp(place(rect, mark.direction)))
        .collect();
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
    out.push(Command::Look(LookCommand::Front(
        context.state.look.environment,
        Some(answer),
    )));
}

/// The question with a button for each choice.
pub fn question_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    ui.add_space(GAP / 2.0);
    ui.label(RichText::new("Which way is front in this file?").color(theme::ACCENT));
    let hint = "Choose the program that it was made for, or click on the panorama where front is.";
    ui.label(RichText::new(hint).small().color(theme::QUIET));
    for (i, (front, names)) in choices().into_iter().enumerate() {
        let text = format!("{}   {names}", i + 1);
        let button = Button::new(text)
            .min_size(vec2(ui.available_width(), 24.0))
            .selected(front == context.state.look.front());
        if ui.add(button).clicked() {
            out.push(Command::Look(LookCommand::Front(
                context.state.look.environment,
                Some(front),
            )));
        }
    }
    ui.add_space(GAP / 2.0);
}

/// The answer as a row of a grid; tells whether the person wants to be asked again.
pub fn answer_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) -> bool {
    let look = &context.state.look;
    let now = look.front();
    let choices = choices();
    let pointed = format!("{:.1}° from the middle", -now.yaw_deg());
    let mut all: Vec<(Option<Front>, &str)> = choices
        .iter()
        .map(|(front, names)| (Some(*front), names.as_str()))
        .collect();
    if choices.iter().all(|(front, _)| *front != now) {
        all.push((Some(now), &pointed));
    }
    all.push((None, "point to it…"));
    let mut wanted = Some(now);
    choice_ui(ui, "Front", &all, &mut wanted).on_hover_text(
        "Which way is front in the file: the program that it was made for. It is kept in the project.",
    );
    if let Some(front) = wanted.filter(|front| *front != now) {
        out.push(Command::Look(LookCommand::Front(
            look.environment,
            Some(front),
        )));
    }
    wanted.is_none()
}
