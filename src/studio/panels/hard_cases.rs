//! Hard cases and what is done about them: `docs/stability.md`, which the tests write.

use crate::theme;
use egui::{RichText, ScrollArea, Ui};
use std::sync::LazyLock;

const PAGE: &str = include_str!("../../../docs/stability.md");

/// A section of the page.
struct Section {
    title: &'static str,
    cases: Vec<Case>,
}

/// A row of the page.
struct Case {
    case: String,
    danger: String,
    done: String,
}

static SECTIONS: LazyLock<Vec<Section>> = LazyLock::new(|| sections(PAGE));

fn sections(page: &'static str) -> Vec<Section> {
    let mut sections: Vec<Section> = Vec::new();
    for line in page.lines() {
        if let Some(title) = line.strip_prefix("## ") {
            let cases = Vec::new();
            sections.push(Section { title, cases });
        } else if let (Some(section), Some(case)) = (sections.last_mut(), case(line)) {
            section.cases.push(case);
        }
    }
    sections
}

/// The case in a row of a table, unless it is the head.
fn case(line: &str) -> Option<Case> {
    let cells = line.strip_prefix("| ")?.split(" | ");
    let mut cells = cells.map(|cell| cell.replace("\\|", "|").replace('`', ""));
    let case = Case { case: cells.next()?, danger: cells.next()?, done: cells.next()? };
    (case.case != "case").then_some(case)
}

/// Lists them, a heading above each section.
pub fn hard_cases_ui(ui: &mut Ui) {
    ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        let quiet = |text: &str| RichText::new(text).size(12.0).color(theme::QUIET);
        ui.label(quiet("Each of these is tested; figures are in docs/stability.md."));
        for section in &*SECTIONS {
            ui.add_space(theme::GAP);
            ui.label(RichText::new(section.title).strong());
            for case in &section.cases {
                ui.add_space(4.0);
                ui.label(RichText::new(&case.case).size(13.0));
                ui.label(quiet(&format!("Risk: {}", case.danger)));
                ui.label(quiet(&format!("Done: {}", case.done)));
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_page_s_rows_are_cases_of_their_sections() {
        let page = "# Title\n\n| case | what |\n\n## Light\n\n| case | what could go wrong | what is done | bound |\n\
                    |---|---|---|---|\n| a `sun` | lost | split \\| cut | 1e-5 |\n\n## Pictures\n";
        let read = sections(page);
        assert_eq!((read.len(), read[0].title, read[1].cases.len()), (2, "Light", 0));
        let [case] = &read[0].cases[..] else { panic!("one case") };
        assert_eq!((case.case.as_str(), case.done.as_str()), ("a sun", "split | cut"));
        // The page itself is of this form.
        let rows = PAGE.lines().filter(|line| line.starts_with("| ")).count();
        let cases: usize = SECTIONS.iter().map(|section| section.cases.len()).sum();
        assert_eq!(cases + SECTIONS.len(), rows);
    }
}
