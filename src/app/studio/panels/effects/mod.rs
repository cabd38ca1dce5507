//! The plan of passes: which ran, which were skipped and why, the time of each, and a switch that forces it.

use crate::command::{Command, LookCommand};
use crate::panel_context::PanelContext;
use crate::panels::widgets::group::Heading;
use crate::panels::widgets::missing::no_picture_ui;
use crate::theme::{self, GAP};
use compositor::{Pass, PassReport};
use egui::{Align, ComboBox, Label, Layout, RichText, Role, Sense, Ui, WidgetInfo, vec2};
use scene::{Effects, Forced};
use worker::PreviewPicture;

/// Width of the switch in points.
const SWITCH: f32 = 64.0;
/// Most letters of a reason within the line, such as `off`, `cached`, `off by hand`.
const WORD: usize = 11;
/// Height in points of a line with a switch.
const LINE: f32 = 20.0;

/// Choices for a pass, each with the text on the switch and its meaning.
const CHOICES: [(Option<bool>, &str, &str); 3] =
    [(None, "Auto", "Automatic"), (Some(true), "On", "Always on"), (Some(false), "Off", "Always off")];

/// The passes under each heading.
const GROUPS: [(&str, &[Pass]); 5] = [
    ("Relighting", &[Pass::Predict, Pass::Smoothing, Pass::Weights, Pass::Relight, Pass::Plate]),
    ("Subject and background", &[Pass::Despill, Pass::Background, Pass::BackgroundBlur, Pass::LightWrap]),
    ("Lens", &[Pass::Glare, Pass::Vignette]),
    ("Finish", &[Pass::Exposure, Pass::View, Pass::Grain, Pass::Dither]),
    ("Inspection", &[Pass::Channels, Pass::Difference, Pass::FalseColor]),
];

/// The panel has no state of its own.
#[derive(Default)]
pub struct EffectsPanel;

impl EffectsPanel {
    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let Some(relit) = context.relit() else {
            let sentence = "Passes are listed once a picture has been made";
            return no_picture_ui(ui, context, sentence, out);
        };
        // Leaves room for the scroll bar.
        ui.set_max_width(ui.available_width() - GAP);
        let effects = &context.state.look.effects;
        forced_ui(ui, effects, out);
        ui.spacing_mut().interact_size.y = LINE;
        ui.spacing_mut().item_spacing.y = 2.0;
        times_ui(ui, relit);
        for (name, passes) in GROUPS {
            let member = |report: &PassReport| {
                let mut passes = passes.iter().copied();
                passes.find(|pass| pass.name() == report.name)
            };
            let reports = (relit.passes.iter()).filter_map(|report| Some((member(report)?, report)));
            let ran = reports.clone().filter(|(_, report)| report.ran).count();
            let auto = |forced: Forced, &pass: &Pass| forced.with(pass, None);
            let forced = passes.iter().fold(effects.forced, auto);
            let heading = Heading {
                name,
                changed: forced != effects.forced,
                reset: Command::Look(LookCommand::Effects(Effects { forced, ..*effects })),
                folded: context.autosave.folded().contains(name),
            };
            heading.ui(
                ui,
                out,
                |ui, _| {
                    let count = format!("{ran} of {}", passes.len());
                    ui.label(RichText::new(count).size(12.0).color(theme::QUIET))
                        .on_hover_text("Passes of this group that ran for this picture");
                },
                |ui, out| {
                    for (pass, report) in reports {
                        pass_ui(ui, pass, report, effects, out);
                    }
                },
            );
        }
    }
}

/// Times to predict and relight the picture.
fn times_ui(ui: &mut Ui, relit: &PreviewPicture) {
    let small = |text: String| RichText::new(text).size(13.0).color(theme::QUIET);
    ui.label(small(format!("Frame predicted in {:.0} ms", relit.predict_ms)));
    ui.label(small(format!("Picture relit in {:.1} ms", relit.relight_ms)));
    ui.add_space(GAP / 2.0);
}

/// Number of forced passes, and the button that makes all automatic.
fn forced_ui(ui: &mut Ui, effects: &Effects, out: &mut Vec<Command>) {
    let says = match effects.forced.count() {
        0 => return,
        1 => "1 pass set by hand".to_owned(),
        more => format!("{more} passes set by hand"),
    };
    ui.horizontal(|ui| {
        ui.label(RichText::new(says).size(13.0).color(theme::DOUBTFUL));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if ui
                .button(RichText::new("All automatic").size(13.0))
                .on_hover_text("Each pass runs if the picture needs it")
                .clicked()
            {
                out.push(Command::Look(LookCommand::Effects(Effects { forced: Forced::default(), ..*effects })));
            }
        });
    });
    ui.add_space(GAP / 2.0);
}

fn pass_ui(ui: &mut Ui, pass: Pass, report: &PassReport, effects: &Effects, out: &mut Vec<Command>) {
    let color = if report.ran { theme::TEXT } else { theme::QUIET };
    // A short reason is within the line, a longer one below it.
    let word = (!report.ran && report.reason.len() <= WORD).then_some(&report.reason);
    ui.horizontal(|ui| {
        ui.set_min_height(LINE);
        ui.label(RichText::new(pass.label()).size(13.0).color(color));
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            match &report.fixed {
                None => switch_ui(ui, pass, effects, out),
                Some(why) => {
                    let fixed = Label::new(RichText::new("Auto").size(12.0).color(theme::QUIET));
                    ui.add_sized(vec2(SWITCH, LINE), fixed.sense(Sense::hover()))
                        .on_hover_text(format!("Always automatic: {why}"));
                }
            }
            let time = match report.ms {
                _ if !report.ran => word.map_or("skipped", String::as_str).to_owned(),
                Some(ms) => format!("{ms:.2} ms"),
                None => "not timed".to_owned(),
            };
            ui.label(RichText::new(time).size(13.0).color(color));
        });
    });
    if word.is_none() {
        ui.label(RichText::new(&report.reason).size(12.0).color(theme::QUIET));
    }
    ui.add_space(GAP / 2.0);
}

/// Forces a pass on or off, or leaves it to the scene.
fn switch_ui(ui: &mut Ui, pass: Pass, effects: &Effects, out: &mut Vec<Command>) {
    let now = effects.forced.get(pass);
    let (_, says, means) = CHOICES[CHOICES.iter().position(|(run, ..)| *run == now).unwrap_or(0)];
    let color = match now {
        None => theme::QUIET,
        Some(_) => theme::DOUBTFUL,
    };
    let list = ComboBox::from_id_salt(pass)
        .selected_text(RichText::new(says).size(12.0).color(color))
        .width(SWITCH)
        .show_ui(ui, |ui| {
            for (run, _, means) in CHOICES {
                if ui.selectable_label(run == now, means).clicked() && run != now {
                    out.push(Command::Look(LookCommand::Effects(Effects {
                        forced: effects.forced.with(pass, run),
                        ..*effects
                    })));
                }
            }
        });
    let name = format!("{} by hand", pass.label());
    (list.response).widget_info(|| WidgetInfo::labeled(Role::ComboBox, true, &name));
    list.response.on_hover_text(means);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pass_stands_under_one_heading() {
        let mut listed: Vec<Pass> = GROUPS.iter().flat_map(|(_, passes)| *passes).copied().collect();
        listed.sort();
        assert_eq!(listed, Pass::ALL);
    }
}
