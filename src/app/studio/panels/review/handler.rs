//! The review: its jobs, the selected cell, and verdicts.

use crate::app::StudioApp;
use crate::command::{ReviewCommand, ViewCommand};
use crate::layout::Pane;
use crate::panels::lamp_title;
use confidence::ConfidenceSettings;
use evaluation::review::{Case, Mark, MarkedOlat, ReviewSettings};
use std::path::PathBuf;
use worker::Job;

impl StudioApp {
    pub(crate) fn apply_to_review(&mut self, command: ReviewCommand) {
        let done = match command {
            ReviewCommand::Measure(truth) => self.review_network(truth, true, None),
            ReviewCommand::Report(to) => self.review_network(None, false, Some(to)),
            ReviewCommand::Trust => self.session.run(|project| Job::Confidence {
                project: project.root.clone(),
                settings: ConfidenceSettings::default(),
            }),
            ReviewCommand::Mark(marked) => self.mark(*marked),
            ReviewCommand::Verdict(verdict) => self.judge(verdict),
            ReviewCommand::Choose(cell) => {
                self.choose(cell);
                Ok(())
            }
            ReviewCommand::NextWorst => self.choose_next_worst(),
        };
        self.refuse_unless(done);
    }

    /// Measures the network against the truth, or writes the results as a page.
    fn review_network(&self, truth: Option<PathBuf>, fresh: bool, report: Option<PathBuf>) -> Result<(), String> {
        let settings =
            ReviewSettings { truth: truth.or_else(|| self.readers.review.truth()), fresh, report, device: self.device };
        self.session.run(|project| Job::Review { project: project.root.clone(), settings })
    }

    fn mark(&mut self, marked: MarkedOlat) -> Result<(), String> {
        (self.session.writable()).and_then(|()| self.readers.review.mark(marked))
    }

    /// True if undo and redo apply to verdicts and notes: there are some, and a review pane is active.
    pub(crate) fn judges(&self) -> bool {
        matches!(self.state.panes.active, Pane::Review | Pane::Lamps) && self.readers.review.has_history()
    }

    /// Undoes or redoes the last verdict or note.
    pub(crate) fn travel_marks(&mut self, back: bool) {
        let done = self.session.writable();
        if done.is_ok() {
            let (done, undo) = if back { ("Undone", "undo") } else { ("Redone", "redo") };
            self.status.mention(match self.readers.review.travel(back) {
                // May be a different cell than the selected one.
                Some([case, lamp]) => format!("{done}: mark of {case}, {}", lamp_title(&lamp)),
                // Undo must not touch the light, which this pane does not show.
                None => {
                    format!("No mark left to {undo}. To {undo} light changes, go to Relight")
                }
            });
        }
        self.refuse_unless(done);
    }

    /// Gives the selected cell a verdict, or removes it if the cell has that one. The note stays. Outside the map's
    /// pane, the cell must be visible.
    fn judge(&mut self, verdict: Mark) -> Result<(), String> {
        let cell = match self.state.panes.active {
            Pane::Review => self.state.review.chosen,
            _ => self.state.review.cell,
        };
        let names = cell.and_then(|(case, lamp)| {
            let review = self.readers.review.measured()?;
            Some((&review.cases.get(case)?.name, review.lamps.get(lamp)?))
        });
        let Some((case, lamp)) = names else {
            return Err("Choose a cell first: click one in the error map".to_owned());
        };
        let marked = self.readers.review.marks.get(case, lamp);
        let note = marked.map_or("", |marked| &marked.note);
        let given = marked.and_then(|marked| marked.mark);
        let verdict = (given != Some(verdict)).then_some(verdict);
        let marked = MarkedOlat::new(case, lamp, verdict, note);
        self.mark(marked)
    }

    /// Selects a cell and shows it beside its truth.
    fn choose(&mut self, cell: (usize, usize)) {
        let review = self.readers.review.measured();
        let Some(case) = review.and_then(|review| {
            let is_there = cell.1 < review.lamps.len();
            review.cases.get(cell.0).filter(|_| is_there)
        }) else {
            return;
        };
        if let Case::Frame(frame) = case.case {
            self.state.show(ViewCommand::Frame(frame));
        }
        self.state.show(ViewCommand::Solo(Some(cell.1)));
        self.state.show(ViewCommand::Cell(Some(cell)));
    }

    fn choose_next_worst(&mut self) -> Result<(), String> {
        let Some(review) = self.readers.review.measured() else {
            return Err("Nothing is measured yet: click Measure in Measurements".to_owned());
        };
        let (metric, marks) = (self.state.review.metric, &self.readers.review.marks);
        match review.next_unmarked(metric, marks, self.state.review.chosen) {
            Some(cell) => self.choose(cell),
            None => self.status.mention("Every cell has a verdict".to_owned()),
        }
        Ok(())
    }

    /// True if the key that switches between two pictures applies to those of a cell: a cell is visible, and the
    /// picture beside it is not the active pane.
    pub(crate) fn flips_cell(&self) -> bool {
        let beside = self.state.panes.active == Pane::Picture && self.state.panes.shows(Pane::Lamps);
        let failed = matches!(self.readers.review.cell, Some(Err(_)));
        self.state.review.cell.is_some() && !failed && !beside
    }
}
