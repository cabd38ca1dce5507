//! Cost and display of a training run, before it starts.

use super::controls::duration;
use crate::panel_context::PanelContext;
use crate::panels::accuracy::words;
use crate::panels::training::query::TrainChoice;
use crate::theme::{self, GAP};
use egui::{Align, Layout, RichText, Ui, vec2};
use footage::scan::counted;
use project::Project;
use training::{Pace, RunCost};

/// Width of the names in points.
const NAMES: f32 = 76.0;

/// The facts, each after its name.
pub fn preview_ui(ui: &mut Ui, context: &PanelContext, project: &Project) {
    let chosen = context.state.look.training;
    let choice = context.readers.training.choice(chosen, project);
    for (name, sentence) in sentences(project, &choice, context.readers.training.pace()) {
        ui.horizontal_top(|ui| {
            let down = Layout::top_down(Align::Min);
            ui.allocate_ui_with_layout(vec2(NAMES, 0.0), down, |ui| {
                ui.set_width(NAMES);
                ui.label(RichText::new(name).color(theme::QUIET));
            });
            let room = vec2(ui.available_width(), 0.0);
            ui.allocate_ui_with_layout(room, down, |ui| {
                ui.set_width(room.x);
                ui.label(sentence);
            });
        });
    }
    ui.add_space(GAP);
}

/// Known facts of a run: its data, time, steps, memory and disk, and the view shown meanwhile.
fn sentences(project: &Project, choice: &TrainChoice, pace: Option<Pace>) -> [(&'static str, String); 6] {
    let shoot = &project.settings.shoot;
    let config = choice.config();
    let held_out = usize::from(choice.hold_out.is_some());
    let cost = config.cost(project, held_out, pace);
    let limit = config.minutes.map(|minutes| 60.0 * minutes);
    let data = format!(
        "{} under {}, and {}",
        counted(shoot.poses.len(), "pose"),
        counted(shoot.lamps.len(), "lamp"),
        counted(shoot.frames.len(), "interview frame"),
    );
    let disk = config.disk(project, held_out, cost.seconds);
    let memory = config.network(project).cost().training_bytes();
    let saves = match config.checkpoint_seconds {
        short if short < 90.0 => format!("{short:.0} s"),
        long => duration(long),
    };
    [
        ("Data", data),
        ("Time", time(&cost, limit)),
        ("Steps", steps(&cost, pace)),
        ("Memory", format!("about {}", words::bytes(memory))),
        (
            "Disk",
            format!(
                "at most {}: {} every {saves}; older checkpoints thin out",
                words::bytes(disk.most),
                words::bytes(disk.checkpoint)
            ),
        ),
        ("You see", format!("curves, a pose beside its truth, and the relit picture, renewed every {saves}")),
    ]
}

fn time(cost: &RunCost, limit: Option<f64>) -> String {
    match (limit, cost.seconds) {
        (Some(limit), Some(seconds)) if seconds < limit => {
            format!("about {}. Stop or pause at any time", duration(seconds))
        }
        (Some(limit), _) => format!("{}. Stop or pause at any time", duration(limit)),
        (None, Some(seconds)) => format!("about {}. Stop or pause at any time", duration(seconds)),
        (None, None) => "known after the first seconds. Stop or pause at any time".to_owned(),
    }
}

fn steps(cost: &RunCost, pace: Option<Pace>) -> String {
    match (cost.steps, pace) {
        (Some(steps), Some(_)) if cost.timed => {
            format!("about {steps}, at the rate of the last run")
        }
        (Some(steps), Some(_)) => {
            format!("about {steps}, estimated from the last run of another network")
        }
        (Some(steps), None) => format!("{steps}. The rate is known after the first seconds"),
        (None, _) => "as many as fit. The rate is known after the first seconds".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use training::Preset;

    fn project() -> Project {
        let names = |count: usize| (0..count).map(|i| i.to_string()).collect::<Vec<_>>();
        let mut project = Project::without_shoot("film".as_ref());
        project.settings.size = 64;
        let shoot = &mut project.settings.shoot;
        (shoot.poses, shoot.lamps, shoot.frames) = (names(6), names(12), names(24).into());
        project
    }

    fn said(preset: Preset, pace: Option<Pace>) -> Vec<String> {
        let choice = TrainChoice { preset, ..TrainChoice::default() };
        let all = sentences(&project(), &choice, pace);
        all.map(|(name, sentence)| format!("{name}: {sentence}")).into()
    }

    #[test]
    fn without_a_timed_run_only_what_is_known_is_said() {
        let quick = said(Preset::Quick, None);
        assert_eq!(quick[0], "Data: 6 poses under 12 lamps, and 24 interview frames");
        assert_eq!(quick[1], "Time: 10 min. Stop or pause at any time");
        assert_eq!(quick[2], "Steps: as many as fit. The rate is known after the first seconds");
        assert!(quick[4].contains("every 30 s"), "{quick:?}");
        let paper = said(Preset::Paper, None);
        assert!(paper[1].starts_with("Time: known after"), "{paper:?}");
        assert!(paper[4].starts_with("Disk: at most 4.3 GB"), "{paper:?}");
    }

    #[test]
    fn a_timed_run_gives_steps_and_hours() {
        let config = Preset::Quick.config();
        let pace = Pace { seconds_per_step: 0.5, multiply_adds: config.network(&project()).cost().multiply_adds };
        let quick = said(Preset::Quick, Some(pace));
        assert_eq!(quick[2], "Steps: about 1200, at the rate of the last run");
        let paper = said(Preset::Paper, Some(pace));
        assert!(paper[1].starts_with("Time: about "), "{paper:?}");
        assert!(paper[2].contains("another network"), "{paper:?}");
    }
}
