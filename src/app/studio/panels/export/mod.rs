//! Export options: frames, format, size, background, layers and file name; and the export queue.

mod choice;
mod colors;
pub mod command;
pub mod destination_check;
pub mod exports;
mod format;
mod handler;
mod queue;

use crate::command::{Command, Dialog, ExportCommand, LookCommand};
use crate::export_options::{ExportOptions, Overwrite};
use crate::icons;
use crate::panel_context::PanelContext;
use crate::panels::accuracy::words;
use crate::panels::light::lights::solo_names;
use crate::panels::widgets::numbers::{computing, is_reset};
use crate::panels::widgets::rows::number_ui;
use crate::panels::widgets::rows::segments_ui;
use crate::state::State;
use crate::theme::{self, GAP};
use choice::option_ui;
use egui::{
    Align, Button, Grid, Id, Label, Layout, Response, RichText, Role, ScrollArea, TextEdit, Ui, UiBuilder, WidgetInfo,
    vec2,
};
use export::{Files, Format, HandOver, LayersBy, PixelBits};
use farm::Engine;
use footage::scan::counted;
use footage::{FRAME_NUMBERS, PictureSize};
use project::Project;
use scene::Background;
use std::path::Path;

/// Width of a number's field in points.
const FIELD: f32 = 56.0;

/// Least height in points of the options.
const LEAST: f32 = 96.0;

/// Height in points kept for the queue: a running and a waiting export, so that neither moves the buttons above.
const QUEUE: f32 = 172.0;

/// Holds a pending focus request, and heights in points from the last draw.
#[derive(Default)]
pub struct ExportPanel {
    focus: bool,
    /// Height of the export buttons, with the lines above and below them.
    add: f32,
    /// Height of the queue down to its newest export.
    newest: f32,
}

impl ExportPanel {
    /// Moves the keyboard focus to the first control.
    pub fn focus(&mut self) {
        self.focus = true;
    }

    pub fn ui(&mut self, ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
        let Some(project) = context.session.project else { return };
        let mut options = context.state.export_options.clone();
        let existing = existing(context, &options, &project.root);
        ui.add_space(GAP);
        // The buttons and the newest export stay visible without scrolling.
        let below = self.add + self.newest.max(QUEUE).min(ui.available_height() / 2.0);
        let room = ui.available_height() - below - 3.0 * GAP;
        let scrolled = ScrollArea::vertical().id_salt("options").max_height(room.max(LEAST)).auto_shrink([false, true]);
        scrolled.show(ui, |ui| {
            self.options_ui(ui, context, (project, &mut options, existing), out);
        });
        let top = ui.cursor().top();
        files_ui(ui, context, &options, (&project.root, existing));
        steady(ui, "add", |ui| add_ui(ui, context, out));
        self.add = ui.cursor().top() - top;
        if options != context.state.export_options {
            out.push(Command::Export(ExportCommand::Options(Box::new(options))));
        }
        ui.add_space(GAP);
        self.newest = queue::ui(ui, context, out);
    }

    /// Options of the export.
    fn options_ui(
        &mut self,
        ui: &mut Ui,
        context: &PanelContext,
        (project, options, existing): (&Project, &mut ExportOptions, usize),
        out: &mut Vec<Command>,
    ) {
        let rows = Grid::new("order").num_columns(2).spacing([GAP, 6.0]);
        rows.show(ui, |ui| {
            let first = frames_ui(ui, context.state, out);
            if std::mem::take(&mut self.focus) {
                first.request_focus();
            }
            name_ui(ui, options, out);
            format::ui(ui, options);
            colors::ui(ui, context, options);
            picture_ui(ui, options);
            let own = longer_side(context, project, options);
            size_ui(ui, options, own, out);
            background_ui(ui, options);
            layers_ui(ui, options);
            hand_over_ui(ui, options);
            if !options.format.is_movie() {
                first_number_ui(ui, options, context.state.playback.first_number);
            }
            existing_ui(ui, options, existing);
        });
        colors::sentence_ui(ui, context, options);
        cost_ui(ui, context, project, options);
    }
}

/// Controls with ids of their own, which keep the focus when rows above them come or go.
fn steady<R>(ui: &mut Ui, name: &str, add: impl FnOnce(&mut Ui) -> R) -> R {
    let own = UiBuilder::new().scope_id(Id::unique(("export", name)));
    ui.scope_builder(own, add).inner
}

/// First and last frame of the export. Returns the first control.
fn frames_ui(ui: &mut Ui, state: &State, out: &mut Vec<Command>) -> Response {
    let most = state.playback.frames.saturating_sub(1);
    let (first, last) = state.range();
    let (mut from, mut to) = (first, last);
    let range = |range| Command::Look(LookCommand::Range(range));
    let reset = |frames| range(Some(frames));
    ui.label("Frames");
    let response = ui.horizontal(|ui| {
        let field = |value| computing(value).range(0..=most).speed(0.1);
        let response = number_ui(ui, "In", field(&mut from), FIELD, out, || reset((0, last)));
        number_ui(ui, "Out", field(&mut to), FIELD, out, || reset((first, most)));
        if from != first {
            to = to.max(from);
        }
        from = from.min(to);
        let hint = "All frames. Keys: I and O set In and Out.";
        if option_ui(ui, "Frames", "All", hint, state.look.range.is_none()) {
            out.push(range(None));
        } else if (from, to) != (first, last) {
            out.push(range(Some((from, to))));
        }
        response
    });
    ui.end_row();
    response.inner
}

fn picture_ui(ui: &mut Ui, options: &mut ExportOptions) {
    ui.label("Picture");
    segments_ui(ui, |ui| {
        ui.spacing_mut().button_padding.x = 6.0;
        for (at, name, hint) in [
            (PictureSize::Plate, "Plate", "The whole plate, at its own resolution"),
            (PictureSize::Box, "Box", "The square that the network sees, at the plate's resolution"),
            (PictureSize::Square, "Square", "The square that the network sees, at the network's resolution"),
        ] {
            if option_ui(ui, "Picture", name, hint, options.at == at) {
                options.at = at;
            }
        }
    });
    ui.end_row();
}

/// Expected time, size and error of this export, if the rung in use was measured.
fn cost_ui(ui: &mut Ui, context: &PanelContext, project: &Project, options: &ExportOptions) {
    let Some(rung) = context.readers.accuracy.measured().and_then(|ledger| ledger.in_use()) else { return };
    let (first, last) = context.state.range();
    let frames = (last - first + 1) as f64;
    let seconds = frames * rung.frame.median / 1e3;
    let longer = options.size.unwrap_or(longer_side(context, project, options)) as f64;
    let shape = match (options.at, context.relit()) {
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
    ui.label(RichText::new(text).size(13.0).color(theme::QUIET)).on_hover_text("Measured in Review, Accuracy");
}

/// Longer side in pixels of pictures that are not resized.
fn longer_side(context: &PanelContext, project: &Project, options: &ExportOptions) -> usize {
    let working = project.settings.size;
    let shown = context.relit().map(|relit| (relit.width, relit.height));
    match (options.at, shown) {
        (PictureSize::Plate, Some((width, height))) => width.max(height),
        (PictureSize::Box, Some(plate)) => project.settings.framing.for_size(plate).side,
        _ => working,
    }
}

fn size_ui(ui: &mut Ui, options: &mut ExportOptions, own: usize, out: &mut Vec<Command>) {
    let label = ui.label("Size");
    ui.horizontal(|ui| {
        let before = options.size.unwrap_or(own);
        let mut size = before;
        let field = computing(&mut size).range(Files::SIZES).suffix(" px");
        let response = ui.add_sized(vec2(FIELD + 2.0 * GAP, 24.0), field);
        let response = response.labelled_by(label.id).on_hover_text("The longer side in pixels");
        if is_reset(ui, &response) {
            let options = ExportOptions { size: None, ..options.clone() };
            out.push(Command::Export(ExportCommand::Options(Box::new(options))));
        }
        let hint = "Not resized";
        if option_ui(ui, "Size", "Original size", hint, options.size.is_none()) {
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
            (None, "As shown", "The background of the picture"),
            (Some(Background::Environment), "Environment", "The environment, as the camera sees it"),
            (Some(Background::None), "None", "No background: transparent; black in H.264"),
        ] {
            if option_ui(ui, "Background", name, hint, options.background == background) {
                options.background = background;
            }
        }
    });
    ui.end_row();
}

fn layers_ui(ui: &mut Ui, options: &mut ExportOptions) {
    ui.label("Layers");
    let has_room = options.format == Format::Exr;
    let ways = [
        (None, "None", "The picture alone"),
        (
            Some(LayersBy::Lamp),
            "By lamp",
            "light_00.R …, each lamp of the shoot with its weight in the header: can be relit, for Nuke and Blender",
        ),
        (
            Some(LayersBy::Light),
            "By light",
            "light_01_Key.R …, the environment, each group and each other light: fewer layers, smaller files",
        ),
    ];
    let chosen = (options.layers && has_room).then_some(options.exr.layers_by);
    ui.add_enabled_ui(has_room, |ui| {
        segments_ui(ui, |ui| {
            for (by, name, hint) in ways {
                let hint = if has_room { hint } else { "Only EXR holds layers" };
                if option_ui(ui, "Layers", name, hint, chosen == by) {
                    options.layers = by.is_some();
                    options.exr.layers_by = by.unwrap_or(options.exr.layers_by);
                }
            }
        });
    });
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
        HandOver::Nuke => "A script with a gain for each lamp, in key, fill and rim",
        HandOver::Blender => "A script with compositor, world and a sun for each lamp",
        HandOver::Otio => "A timeline for Resolve and other editors",
        HandOver::Edl => "An edit decision list for Premiere, Avid and Resolve",
    }
}

fn name_ui(ui: &mut Ui, options: &mut ExportOptions, out: &mut Vec<Command>) {
    let label = ui.label("Name");
    ui.horizontal(|ui| {
        let choose = 34.0;
        let field = TextEdit::singleline(&mut options.name).desired_width(ui.available_width() - choose - 2.0 * GAP);
        ui.add(field)
            .labelled_by(label.id)
            .on_hover_text("A path in the project's folder, or an absolute one. Frame number and extension are added.");
        let button = ui.add(Button::new("…").min_size(vec2(choose, 24.0)));
        button.widget_info(|| WidgetInfo::labeled(Role::Button, true, "Choose the file name"));
        if button.on_hover_text("Choose the file name in a dialog").clicked() {
            out.push(Command::Dialog(Dialog::Destination));
        }
    });
    ui.end_row();
}

fn first_number_ui(ui: &mut Ui, options: &mut ExportOptions, own: i64) {
    let label = ui.label("First number");
    ui.horizontal(|ui| {
        let before = options.first_number.unwrap_or(own);
        let mut number = before;
        let field = computing(&mut number).range(FRAME_NUMBERS).speed(0.1);
        let response = ui.add_sized(vec2(FIELD + 2.0 * GAP, 24.0), field);
        response.labelled_by(label.id).on_hover_text("Number of the interview's first frame in the names of the files");
        let hint = "The numbers of the interview's files; a movie counts from 0";
        if option_ui(ui, "First number", "Plate's", hint, options.first_number.is_none()) {
            options.first_number = None;
        } else if number != before {
            options.first_number = Some(number);
        }
    });
    ui.end_row();
}

/// Number of existing files under the chosen name.
fn existing(context: &PanelContext, options: &ExportOptions, root: &Path) -> usize {
    let to = options.to(root);
    let known = context.exports.destination.found().filter(|known| known.query.to == to);
    known.map_or(0, |known| known.files)
}

fn existing_ui(ui: &mut Ui, options: &mut ExportOptions, existing: usize) {
    ui.label("Existing files");
    let ways = [
        (Overwrite::Never, "Keep", "The new files get a number"),
        (Overwrite::All, "Replace", "Overwrites them"),
        (Overwrite::Outdated, "Resume", "Writes only the frames that are missing or were made with other settings"),
    ];
    ui.add_enabled_ui(existing > 0, |ui| {
        segments_ui(ui, |ui| {
            for (way, name, hint) in ways {
                if way == Overwrite::Outdated && options.format.is_movie() {
                    continue;
                }
                let hint = if existing > 0 { hint } else { "None of these files exists yet" };
                if option_ui(ui, "Existing files", name, hint, options.overwrite == way) {
                    options.overwrite = way;
                }
            }
        });
    });
    ui.end_row();
}

/// Files that will be written.
fn files_ui(ui: &mut Ui, context: &PanelContext, options: &ExportOptions, (root, existing): (&Path, usize)) {
    let (first, last) = context.state.numbers();
    let to = options.to(root);
    let written = if options.replaces() { to } else { context.exports.goes_to(&to, (first, last)) };
    let name = |file: &Path| file.file_name().unwrap_or_default().display().to_string();
    let files: Vec<_> = [first, last].map(|f| written.files(f, f).next()).into_iter().flatten().collect();
    let frames = counted((last - first + 1) as usize, "frame");
    let files = match &files[..] {
        [one, other] if one != other => format!("{} … {}", name(one), name(other)),
        [one, ..] => name(one),
        [] => String::new(),
    };
    let (text, color) = if existing > 0 && options.replaces() {
        let outdated = if options.resumes() { "outdated ones of " } else { "" };
        let existing = counted(existing, "file");
        (format!("Replaces {outdated}{existing}: {files}"), theme::WARNING)
    } else {
        (format!("{frames}: {files}"), theme::QUIET)
    };
    ui.add(Label::new(RichText::new(text).size(13.0).color(color)).truncate()).on_hover_text(written.to_string());
}

/// Height of the export buttons, and width of the farm's button with its gap, in points.
const ADD: f32 = 28.0;
const SEND: f32 = 124.0;

fn add_ui(ui: &mut Ui, context: &PanelContext, out: &mut Vec<Command>) {
    let environment = context.environment().map(|entry| &entry.panorama);
    let obstacle = context.state.export_options.obstacle(&context.status.phase, environment, &context.state.look);
    // In the button, so that it stays in its place.
    let solo = match context.state.solo.first() {
        Some(&lamp) => Some(format!("{}, without background", context.lamps_named(lamp))),
        None => solo_names(&context.state.look.lighting),
    };
    ui.add_space(2.0);
    let enabled = obstacle.is_none();
    let text = if solo.is_some() { "Add solo to queue" } else { "Add to queue" };
    let add = theme::main_button(enabled, format!("{} {text}", icons::QUEUE));
    let row = ui.horizontal(|ui| {
        ui.spacing_mut().interact_size.y = ADD;
        let size = vec2(ui.available_width() - SEND, ADD);
        let response = ui.add_enabled_ui(enabled, |ui| ui.add_sized(size, add)).inner;
        ui.add_enabled_ui(enabled, |ui| farm_ui(ui, solo.is_some(), out));
        response
    });
    let response = row.inner;
    response.widget_info(|| WidgetInfo::labeled(Role::Button, enabled, text));
    let hint = match &solo {
        Some(names) => format!("Exports {names}, as shown. Esc ends solo. Key: Ctrl+Enter"),
        None => "Exports the picture with its current settings. Key: Ctrl+Enter".to_owned(),
    };
    let response = response.on_hover_text(&hint).on_disabled_hover_text(hint);
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

/// Menu of the farms for which this export can be written as a job.
fn farm_ui(ui: &mut Ui, solo: bool, out: &mut Vec<Command>) {
    let hint = "Writes this export as a render-farm job, with a copy of network and look. You submit it.";
    let text = if solo { "Solo to farm…" } else { "Send to farm…" };
    let menu = ui.menu_button(text, |ui| {
        for engine in Engine::ALL {
            if ui.button(format!("{}…", engine.name())).clicked() {
                out.push(Command::Dialog(Dialog::FarmFolder(engine)));
            }
        }
    });
    menu.response.on_hover_text(hint);
}
