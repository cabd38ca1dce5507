//! A foldable group of settings. Its heading shows whether a setting was changed, and resets the group.

use crate::command::{Command, LookCommand, WindowCommand};
use crate::icons;
use crate::look::Group;
use crate::panel_context::PanelContext;
use crate::theme;
use egui::{Align, Button, Layout, Response, RichText, Role, Sense, Ui, WidgetInfo, vec2};

/// Height of a heading in points, and radius of the dot that says "changed".
const HEIGHT: f32 = 26.0;
const DOT: f32 = 3.0;

/// A heading.
pub struct Heading {
    pub name: &'static str,
    /// A setting of the group differs from its default.
    pub changed: bool,
    /// Command that resets the group to its defaults.
    pub reset: Command,
    /// The rows are hidden.
    pub folded: bool,
}

impl Heading {
    /// The heading of a group of settings.
    pub fn new(group: Group, context: &PanelContext) -> Self {
        Self {
            name: group.name(),
            changed: context.state.look.is_changed(group),
            reset: Command::Look(LookCommand::Reset(group)),
            folded: context.autosave.folded().contains(group.name()),
        }
    }

    /// Draws the heading and, unless folded, the rows. `beside` draws buttons at the right end of the heading.
    pub fn ui(
        self,
        ui: &mut Ui,
        out: &mut Vec<Command>,
        beside: impl FnOnce(&mut Ui, &mut Vec<Command>),
        rows: impl FnOnce(&mut Ui, &mut Vec<Command>),
    ) {
        let Self { name, folded, .. } = self;
        let line = ui.visuals().widgets.noninteractive.bg_stroke;
        let place = ui.available_rect_before_wrap();
        ui.painter().hline(place.x_range(), place.top(), line);
        ui.horizontal(|ui| {
            ui.set_min_height(HEIGHT);
            // Nearly aligns the arrow with the names of the rows.
            ui.spacing_mut().button_padding.x = 4.0;
            if fold_ui(ui, name, folded).clicked() {
                let fold = WindowCommand::Fold(name.to_owned(), !folded);
                out.push(Command::Window(fold));
            }
            if self.changed {
                dot_ui(ui, name);
            }
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                beside(ui, out);
                if self.changed && reset_ui(ui, name).clicked() {
                    out.push(self.reset);
                }
            });
        });
        if !folded {
            rows(ui, out);
        }
    }
}

/// The name with an arrow; a click folds or unfolds the group.
fn fold_ui(ui: &mut Ui, name: &str, folded: bool) -> Response {
    let (arrow, hint) =
        if folded { (icons::NEXT, "Show these settings") } else { (icons::DOWN, "Fold these settings") };
    let arrow = RichText::new(arrow).size(12.0).color(theme::QUIET);
    let heading =
        Button::new((arrow, RichText::new(name).strong())).frame_when_inactive(false).min_size(vec2(0.0, 22.0));
    let response = ui.add(heading);
    // Distinguished from tabs, which have the same names.
    response.widget_info(|| {
        let name = format!("{name} group");
        WidgetInfo::selected(Role::DisclosureTriangle, true, !folded, name)
    });
    response.on_hover_text(hint)
}

/// The dot on the heading of a changed group.
fn dot_ui(ui: &mut Ui, name: &str) {
    let (rect, dot) = ui.allocate_exact_size(vec2(4.0 * DOT, HEIGHT), Sense::hover());
    dot.widget_info(|| WidgetInfo::labeled(Role::Image, true, format!("{name} changed")));
    ui.painter().circle_filled(rect.center(), DOT, theme::TEXT);
    dot.on_hover_text("Changed: differs from the defaults");
}

fn reset_ui(ui: &mut Ui, name: &str) -> Response {
    let button = Button::new(RichText::new(icons::OVER).size(14.0).color(theme::QUIET))
        .frame_when_inactive(false)
        .min_size(vec2(24.0, 22.0));
    icons::named_ui(ui, true, button, &format!("Reset {name}"))
        .on_hover_text("Resets this group to its defaults, as one step of undo")
}
