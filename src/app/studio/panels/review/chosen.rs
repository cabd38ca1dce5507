//! The chosen picture of the review: its figures, its mark and its note.

use super::verdict;
use crate::command::{Command, ReviewCommand};
use crate::panels::lamp_title;
use crate::theme;
use egui::{RichText, TextEdit, Ui};
use evaluation::review::{MarkedOlat, Marks, Metric, Review};

/// Draws the chosen cell.
pub struct ChosenUi<'a> {
    pub review: &'a Review,
    /// Indices of case and lamp in the review.
    pub cell: (usize, usize),
    pub marks: &'a Marks,
    pub metric: Metric,
}

impl ChosenUi<'_> {
    pub fn ui(&self, ui: &mut Ui, out: &mut Vec<Command>) {
        let (case, lamp) = self.cell;
        let (case, lamp_name) = (&self.review.cases[case], &self.review.lamps[lamp]);
        let marked = self.marks.get(&case.name, lamp_name);
        let mark = marked.and_then(|m| m.mark);
        let note = marked.map_or("", |m| m.note.as_str());
        ui.strong(format!("{}, {}", case.name, lamp_title(lamp_name)));
        let figures = Metric::ALL.map(|m| {
            let text = format!("{} {}", m.name(), m.text(m.score(&case.cells[lamp])));
            let strong = m == self.metric;
            RichText::new(text).color(if strong { theme::TEXT } else { theme::QUIET })
        });
        ui.horizontal_wrapped(|ui| figures.map(|text| ui.label(text)));
        let mut wanted = mark;
        ui.horizontal_wrapped(|ui| {
            if let Some(clicked) = verdict::verdicts_ui(ui, mark) {
                wanted = (mark != Some(clicked)).then_some(clicked);
            }
            next_ui(ui, out);
        });
        let label = ui.label(RichText::new("Note").color(theme::QUIET));
        // Starts from the current note, which an undo may have changed.
        let mut text = note.to_owned();
        let field = TextEdit::multiline(&mut text)
            .id_salt(("note", &case.name, lamp_name))
            .desired_rows(2)
            .desired_width(f32::INFINITY)
            .hint_text("What is right or wrong here");
        ui.add(field).labelled_by(label.id);
        if wanted != mark || text != note {
            let marked = MarkedOlat::new(&case.name, lamp_name, wanted, &text);
            out.push(Command::Review(ReviewCommand::Mark(Box::new(marked))));
        }
    }
}

/// The button for the next cell to judge.
pub fn next_ui(ui: &mut Ui, out: &mut Vec<Command>) {
    let hint = "The worst cell after this one that has no verdict. Key: N";
    if ui.button("Next worst").on_hover_text(hint).clicked() {
        out.push(Command::Review(ReviewCommand::NextWorst));
    }
}
