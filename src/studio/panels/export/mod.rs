//! What to export: frames, format, size, background, layers and file name; and the export queue.

mod colors;
mod format;
mod queue;

use crate::command::{Command, Dialog, ExportCommand};
use crate::export_options::ExportOptions;
use crate::icons;
use crate::panel_context::PanelContext;
use crate::panels::accuracy::words;
use crate::panels::number_ui;
use crate::panels::rows::segments_ui;
use crate::theme::{self, GAP};
use egui::{
    Align, Button, DragValue, Grid, Id, Label, Layout, Response, RichText, Role, TextEdit, Ui,
    UiBuilder, WidgetInfo, vec2,
};
use export::{Destination, Files, Format, HandOver, PixelBits};
use farm::Engine;
use footage::PictureSize;
use project::Project;
use scene::Background;
use std::path::Path;

/// Width of a number's field in points.
const FIELD: f32 = 56.0;

/// Holds whether the first control is to take the keyboard focus.
#[derive(Default)]
pub struct ExportPanel {
    focus: bool,
}

impl ExportPanel {
    /// Moves the keyboard focus to the first control.
    pub fn focus(&mut self) {
        self.focus = true;
    }

    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let Some(project) = context.project else {
            return;
        };
        let mut options = context.state.export_options.clone();
        ui.add_space(GAP);
        let rows = Grid::new("order").num_columns(2).spacing([GAP, 8.0]);
        rows.show(ui, |ui| {
            let first = frames_ui(ui, &mut options, context.state.frames, out);
            if std::mem::take(&mut self.focus) {
                first.request_focus();
            }
            format::ui(ui, &mut options);
            colors::ui(ui, context, &mut options);
            picture_ui(ui, &mut options);
            let own = longer_side(context, project, &options);
            size_ui(ui, &mut options, own, out);
            background_ui(ui, &mut options);
            layers_ui(ui, &mut options);
            hand_over_ui(ui, &mut options);
            name_ui(ui, &mut options, out);
        });
        colors::sentence_ui(ui, context, &options);
        files_ui(ui, context, &mut options, &project.root);
        cost_ui(ui, context, project, &options);
        steady(ui, "add", |ui| add_ui(ui, context, out));
        if options != context.state.export_options {
            out.push(Command::Export(ExportCommand::Options(Box::new(options))));
        }
        ui.add_space(GAP);
        queue::ui(ui, context, out);
    }
}

/// Controls that keep the focus when rows come or go above them: their ids are their own.
fn steady<R>(ui: &mut Ui, name: &str, add: impl FnOnce(&mut Ui) -> R) -> R {
    let own = UiBuilder::new().scope_id(Id::unique(("export", name)));
    ui.scope_builder(own, add).inner
}

/// Returns the first control.
fn frames_ui(
    ui: &mut Ui,
    options: &mut ExportOptions,
    frames: usize,
    out: &mut Vec<Command>,
) -> Response {
    let most = frames.saturating_sub(1);
    let (first, last) = options.range(frames);
    let (mut from, mut to) = (first, last);
    let plain = options.clone();
    let reset = |frames| {
        let frames = Some(frames);
        let options = ExportOptions {
            frames,
            ..plain.clone()
        };
        Command::Export(ExportCommand::Options(Box::new(options)))
    };
    ui.label("Frames");
    let response = ui.horizontal(|ui| {
        let field = |value| DragValue::new(value).range(0..=most).speed(0.1);
        let response = number_ui(ui, "In", field(&mut from), FIELD, out, || reset((0, last)));
        number_ui(ui, "Out", field(&mut to), FIELD, out, || {
            reset((first, most))
        });
        if from != first {
            to = to.max(from);
        }
        from = from.min(to);
        let hint = "All frames of the interview. Keys I and O set In and Out to the current frame.";
        if choice_ui(ui, "Frames", "all", hint, options.frames.is_none()) {
            options.frames = None;
        } else if (from, to) != (first, last) {
            options.frames = Some((from, to));
        }
        response
    });
    ui.end_row();
    response.inner
}

/// One option of a group; returns whether it was clicked. `of` names the group to screen readers.
fn choice_ui(ui: &mut Ui, of: &str, name: &str, hint: &str, chosen: bool) -> bool {
    let response = ui.add(Button::selectable(chosen, name));
    response.widget_info(|| {
        WidgetInfo::selected(Role::RadioButton, true, chosen, format!("{of} {name}"))
    });
    response.on_hover_text(hint).clicked()
}

fn picture_ui(ui: &mut Ui, options: &mut ExportOptions) {
    ui.label("Picture");
    segments_ui(ui, |ui| {
        ui.spacing_mut().button_padding.x = 6.0;
        for (at, name, hint) in [
            (
                PictureSize::Plate,
                "plate",
                "The whole plate, at its own resolution",
            ),
            (
                PictureSize::Box,
                "box",
                "The square that the network sees, at the plate's resolution",
            ),
            (
                PictureSize::Square,
                "square",
                "The square that the network sees, at the network's resolution",
            ),
        ] {
            if choice_ui(ui, "Picture", name, hint, options.at == at) {
                options.at = at;
            }
        }
    });
    ui.end_row();
}

/// What the rung in use costs for this clip, if it was measured.
fn cost_ui(ui: &mut Ui, context: &PanelContext, project: &Project, options: &ExportOptions) {
    let Some(rung) = context
        .accuracy
        .measured()
        .and_then(|ledger| ledger.in_use())
    else {
        return;
    };
    let (first, last) = options.range(context.state.frames);
    let frames = (last - first + 1) as f64;
    let seconds = frames * rung.frame.median / 1e3;
    let longer = options
        .size
        .unwrap_or(longer_side(context, project, options)) as f64;
    let shape = match (options.at, context.relit) {
        (PictureSize::Plate, Some(relit)) => {
            let (width, height) = (relit.width as f64, relit.height as f64);
            width.min(height) / width.max(height)
        }
        _ => 1.0,
    };
    let bytes = |bits: f64| words::bytes((frames * longer * longer * shape * bits / 8.0) as u64);
    let has_alpha = options.background == Some(Background::None);
    let bits = options.format.pixel_bits(has_alpha);
    let bytes = bits.map(|bits| match bits {
        PixelBits::AtMost(bits) => format!("at most {}", bytes(bits)),
        PixelBits::About(bits) => format!("about {}", bytes(bits)),
    });
    let bytes = bytes.map_or(String::new(), |bytes| format!(", {bytes}"));
    let text = format!(
        "{}: about {}{bytes}, {:.1} dB expected",
        words::title(rung),
        words::duration(seconds),
        rung.fidelity.psnr_db
    );
    ui.label(RichText::new(text).size(13.0).color(theme::QUIET))
        .on_hover_text("As measured in Accuracy, in the workspace Review");
}

/// Pixels of the longer side that pictures have if they are not resized.
fn longer_side(context: &PanelContext, project: &Project, options: &ExportOptions) -> usize {
    let working = project.settings.size;
    let shown = context.relit.map(|relit| (relit.width, relit.height));
    match (options.at, shown) {
        (PictureSize::Plate, Some((width, height))) => width.max(height),
        (PictureSize::Box, Some(plate)) => project.settings.framing.of(plate).side,
        _ => working,
    }
}

fn size_ui(ui: &mut Ui, options: &mut ExportOptions, own: usize, out: &mut Vec<Command>) {
    let label = ui.label("Size");
    ui.horizontal(|ui| {
        let before = options.size.unwrap_or(own);
        let mut size = before;
        let field = DragValue::new(&mut size)
            .range(Files::SIZES)
            .suffix(" px")
            // The range is applied once typing has ended.
            .update_while_editing(false);
        let response = ui.add_sized(vec2(FIELD + 2.0 * GAP, 24.0), field);
        let response = response.labelled_by(label.id).on_hover_text(
            "The longer side. Pictures are averaged down or interpolated up, in linear light.",
        );
        if response.double_clicked() {
            ui.memory_mut(|memory| memory.surrender_focus(response.id));
            let options = ExportOptions {
                size: None,
                ..options.clone()
            };
            out.push(Command::Export(ExportCommand::Options(Box::new(options))));
        }
        let hint = "Not resized";
        if choice_ui(ui, "Size", "as it is", hint, options.size.is_none()) {
            options.size = None;
        } else if size != before {
            options.size = Some(size);
        }
    });
    ui.end_row();
}

fn background_ui(ui: &mut Ui, options: &mut ExportOptions) {
    ui.label("Background");
    segments_ui(ui, |ui| {
        ui.spacing_mut().button_padding.x = 6.0;
        for (background, name, hint) in [
            (None, "as shown", "The same background as in the picture"),
            (
                Some(Background::Environment),
                "environment",
                "The environment, as the interview's camera would see it",
            ),
            (
                Some(Background::None),
                "none",
                "No background: transparent; black in H.264",
            ),
        ] {
            if choice_ui(
                ui,
                "Background",
                name,
                hint,
                options.background == background,
            ) {
                options.background = background;
            }
        }
    });
    ui.end_row();
}

fn layers_ui(ui: &mut Ui, options: &mut ExportOptions) {
    ui.label("Layers");
    let has_room = options.format == Format::Exr;
    let mut layers = options.layers && has_room;
    let tick = egui::Checkbox::new(&mut layers, "one for each lamp");
    let response = steady(ui, "layers", |ui| ui.add_enabled(has_room, tick))
        .on_hover_text(
            "light_00.R … beside the picture, with the lamps' weights in the header. Each file is checked: the \
             layers add up to the relit subject.",
        )
        .on_disabled_hover_text("Only EXR files can hold layers");
    if response.changed() {
        options.layers = layers;
    }
    ui.end_row();
}

fn hand_over_ui(ui: &mut Ui, options: &mut ExportOptions) {
    ui.label("Hand over to");
    ui.horizontal(|ui| {
        for program in HandOver::ALL {
            let obstacle = options.hand_over_obstacle(program);
            let chosen = options.hand_over.contains(&program);
            let mut ticked = chosen && obstacle.is_none();
            let tick = egui::Checkbox::new(&mut ticked, program.name());
            let response = ui.add_enabled(obstacle.is_none(), tick);
            let response = response.on_hover_text(hand_over_hint(program));
            let response = response.on_disabled_hover_text(obstacle.unwrap_or_default());
            if response.changed() {
                options.hand_over.retain(|other| *other != program);
                options.hand_over.extend(ticked.then_some(program));
            }
        }
    });
    ui.end_row();
}

fn hand_over_hint(program: HandOver) -> &'static str {
    match program {
        HandOver::Nuke => {
            "A script beside the files: a gain for each lamp, key, fill and rim, and the picture rebuilt"
        }
        HandOver::Blender => {
            "A script beside the files: the compositor that rebuilds the picture, the environment as the world, a sun for each lamp"
        }
        HandOver::Otio => {
            "A timeline for Resolve and other editors, with range, rate, time code and reel"
        }
        HandOver::Edl => "An edit decision list for Premiere, Avid and Resolve",
    }
}

fn name_ui(ui: &mut Ui, options: &mut ExportOptions, out: &mut Vec<Command>) {
    let label = ui.label("Name");
    ui.horizontal(|ui| {
        let choose = 34.0;
        let field = TextEdit::singleline(&mut options.name)
            .desired_width(ui.available_width() - choose - 2.0 * GAP);
        ui.add(field).labelled_by(label.id).on_hover_text(
            "Relative to the project's folder, or a full path. The format adds frame number and extension.",
        );
        let button = ui.add(Button::new("…").min_size(vec2(choose, 24.0)));
        button.widget_info(|| WidgetInfo::labeled(Role::Button, true, "Choose the file name"));
        if button.on_hover_text("Choose the file name in a dialog").clicked() {
            out.push(Command::Dialog(Dialog::Destination));
        }
    });
    ui.end_row();
}

/// The files that will be written, and whether existing ones are replaced.
fn files_ui(ui: &mut Ui, context: &PanelContext, options: &mut ExportOptions, root: &Path) {
    let (first, last) = options.range(context.state.frames);
    let to = options.to(root);
    let taken = context.existing_files.filter(|taken| taken.query.to == to);
    let taken = taken.filter(|taken| taken.files > 0);
    let written = match taken {
        Some(taken) if !options.replaces() => &taken.free,
        _ => &to,
    };
    let name = |file: &Path| file.file_name().unwrap_or_default().display().to_string();
    let quiet =
        |text: String| Label::new(RichText::new(text).size(13.0).color(theme::QUIET)).truncate();
    if let Ok(destination) = Destination::parse(written) {
        let files: Vec<_> = [first, last]
            .map(|f| destination.files(f, f).next())
            .into_iter()
            .flatten()
            .collect();
        let frames = match last - first {
            0 => "1 frame".to_owned(),
            more => format!("{} frames", more + 1),
        };
        let text = match &files[..] {
            [one, other] if one != other => format!("{frames}: {} … {}", name(one), name(other)),
            [one, ..] => format!("{frames}: {}", name(one)),
            [] => String::new(),
        };
        ui.add(quiet(text)).on_hover_text(written);
    }
    if let Some(taken) = taken {
        let there = match taken.files {
            1 => "1 file with this name already exists".to_owned(),
            files => format!("{files} files with this name already exist"),
        };
        ui.label(RichText::new(there).size(13.0).color(theme::WARNING));
        ui.checkbox(&mut options.replace, "replace existing files")
            .on_hover_text("If off, existing files are kept and a number is appended");
        if !options.format.is_movie() {
            ui.checkbox(&mut options.resume, "resume a stopped export")
                .on_hover_text(
                    "Keeps frames that were made of the same project, network, environment and look, and writes the others",
                );
        }
    } else {
        options.replace = false;
        options.resume = false;
    }
}

/// Height of the buttons that export, and what the one for a farm takes of their row, in points.
const ADD: f32 = 28.0;
const SEND: f32 = 124.0;

fn add_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let environment = context.environment().map(|entry| &entry.panorama);
    let obstacle = context.state.export_options.obstacle(
        &context.status.phase,
        environment,
        &context.state.look,
    );
    if let Some(&lamp) = context.state.solo.first() {
        let text = format!(
            "{} alone, without background, as the picture shows it",
            context.lamps_named(lamp)
        );
        ui.label(RichText::new(text).size(13.0).color(theme::ACCENT))
            .on_hover_text("Esc lights the subject by the environment again");
    }
    ui.add_space(2.0);
    let add = Button::new((icons::QUEUE, "Add to queue")).fill(theme::PRIMARY);
    let enabled = obstacle.is_none();
    let row = ui.horizontal(|ui| {
        ui.spacing_mut().interact_size.y = ADD;
        let size = vec2(ui.available_width() - SEND, ADD);
        let response = ui
            .add_enabled_ui(enabled, |ui| ui.add_sized(size, add))
            .inner;
        ui.add_enabled_ui(enabled, |ui| farm_ui(ui, out));
        response
    });
    let response = row.inner;
    response.widget_info(|| WidgetInfo::labeled(Role::Button, enabled, "Add to queue"));
    let response =
        response.on_hover_text("Exports the picture with its current settings. Key: Ctrl+Enter");
    if response.clicked() {
        out.push(Command::Export(ExportCommand::Add));
    }
    if let Some(obstacle) = obstacle {
        let down = Layout::top_down(Align::Min);
        ui.with_layout(down, |ui| {
            ui.label(RichText::new(obstacle).color(theme::WARNING));
        });
    }
}

/// For which farm a job of the same export is written.
fn farm_ui(ui: &mut Ui, out: &mut Vec<Command>) {
    let hint = "Writes a job that relights this export on many machines, with a copy of network and look, so that work \
                here can go on. You submit it.";
    let menu = ui.menu_button("Send to farm…", |ui| {
        for engine in Engine::ALL {
            if ui.button(format!("{}…", engine.name())).clicked() {
                out.push(Command::Dialog(Dialog::FarmFolder(engine)));
            }
        }
    });
    menu.response.on_hover_text(hint);
}
