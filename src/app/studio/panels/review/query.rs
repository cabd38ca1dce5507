//! Review of the network as the window knows it. The sheet is drawn and the marks are saved in the background.

use confidence::ConfidenceReport;
use evaluation::review::{MarkedOlat, Marks, Review};
use gpu::DeviceChoice;
use project::Project;
use std::path::PathBuf;
use std::sync::Arc;
use worker::{Cell, CellPictures, CellReader, LampSheet, PredictedFrame, PreviewPicture, Query, SavedReview};

/// The newest answers, and the queries for them.
pub struct NetworkReview {
    /// The current frame under every lamp, or the reason it cannot be drawn.
    pub sheet: Option<Result<Arc<LampSheet>, String>>,
    /// The review saved in the project, or the reason it cannot be read.
    pub saved: Option<Result<Arc<SavedReview>, String>>,
    /// The last requested cell beside its truth, or the reason it cannot be shown; None until made.
    pub cell: Option<Result<Arc<CellPictures>, String>>,
    /// The current marks, possibly not on disk yet.
    pub marks: Marks,
    /// Reason that the marks could not be written.
    pub failure: Option<String>,
    sheets: Query<Arc<PredictedFrame>, Arc<LampSheet>>,
    /// By the number of measurements.
    reader: Query<u64, Arc<SavedReview>>,
    cells: Query<(u64, Cell), Arc<CellPictures>>,
    writer: Query<Marks, ()>,
    /// Number of times that the network or the saved review may have changed.
    measurements: u64,
    /// True if marks were set in this window.
    edited: bool,
    history: MarkHistory,
}

impl Default for NetworkReview {
    fn default() -> Self {
        Self {
            sheet: None,
            saved: None,
            cell: None,
            marks: Marks::default(),
            failure: None,
            sheets: Query::default(),
            reader: Query::default(),
            cells: Query::default(),
            writer: Query::kept(),
            measurements: 0,
            edited: false,
            history: MarkHistory::default(),
        }
    }
}

/// Most undo steps.
const STEPS: usize = 100;

/// Marks before the current ones, and marks that were undone. The nearest is last in each.
#[derive(Default)]
struct MarkHistory {
    undo: Vec<MarkStep>,
    redo: Vec<MarkStep>,
    /// True if the last change affected only a note: typing goes on in the same step.
    typing: bool,
}

/// The marks before a change, and the case and lamp of the change.
struct MarkStep {
    marks: Marks,
    cell: [String; 2],
}

impl MarkHistory {
    /// Adds a step before a mark is set.
    fn push(&mut self, before: &Marks, marked: &MarkedOlat) {
        let cell = [&marked.case, &marked.lamp].map(String::clone);
        let previous = before.get(&marked.case, &marked.lamp);
        let types = previous.and_then(|of| of.mark) == marked.mark;
        let last = self.undo.last();
        if !(types && self.typing && last.is_some_and(|last| last.cell == cell)) {
            if self.undo.len() >= STEPS {
                self.undo.remove(0);
            }
            let marks = before.clone();
            self.undo.push(MarkStep { marks, cell });
        }
        self.typing = types;
        self.redo.clear();
    }

    /// Goes one step back or forward from the current marks. Returns the case and lamp of the change, if there was a
    /// step.
    fn travel(&mut self, back: bool, marks: &mut Marks) -> Option<[String; 2]> {
        let (from, to) = if back { (&mut self.undo, &mut self.redo) } else { (&mut self.redo, &mut self.undo) };
        let step = from.pop()?;
        let cell = step.cell.clone();
        to.push(MarkStep { marks: std::mem::replace(marks, step.marks), cell: step.cell });
        self.typing = false;
        Some(cell)
    }
}

impl NetworkReview {
    /// Marks the saved review as possibly changed by a job.
    pub fn invalidate(&mut self) {
        self.measurements += 1;
        self.cell = None;
    }

    /// Takes in the newest answers.
    pub fn receive(&mut self) {
        let sheet = self.sheets.answers().last().map(|(_, sheet)| sheet);
        let cell = self.cells.answers().last().map(|(_, cell)| cell);
        self.sheet = sheet.or(self.sheet.take());
        self.cell = cell.or(self.cell.take());
        if let Some((_, written)) = self.writer.answers().last() {
            self.failure = written.err();
        }
        if let Some((_, saved)) = self.reader.answers().last() {
            // Marks from this window are newer than the file.
            if let (Ok(saved), false) = (&saved, self.edited) {
                self.marks = saved.marks.clone();
            }
            self.saved = Some(saved);
        }
    }

    /// Requests what the review shows, if that changed, and saves the marks. `relit` is None while a clip plays.
    /// `cell`: indices of case and lamp, and the device for the network.
    pub fn ask(
        &mut self,
        project: &Project,
        relit: Option<&Arc<PreviewPicture>>,
        cell: Option<(usize, usize, DeviceChoice)>,
        wake: impl Fn() + Clone + Send + 'static,
    ) {
        let measurements = self.measurements;
        self.reader.ask(measurements, wake.clone(), |_| {
            let root = project.root.clone();
            move |_: &u64| SavedReview::read(&root).map(Arc::new)
        });
        if self.edited && self.writer.asked() != Some(&self.marks) {
            self.writer.ask(self.marks.clone(), wake.clone(), |_| {
                let root = project.root.clone();
                move |marks: &Marks| marks.save(&Project::open(&root)?)
            });
        }
        let review = match &self.saved {
            Some(Ok(saved)) => saved.review.as_ref(),
            _ => None,
        };
        let cell = cell.and_then(|(case, lamp, device)| {
            let (review, case) = (review?, review?.cases.get(case)?);
            Some(Cell { case: case.case, scale: case.scale, lamp, truth: review.truth.clone(), device })
        });
        let newly_asked = cell.is_some_and(|cell| {
            self.cells.ask((measurements, cell), wake.clone(), |_| {
                let mut reader = CellReader::new(project.root.clone());
                move |(measurements, cell): &(u64, Cell)| reader.read(*measurements, cell).map(Arc::new)
            })
        });
        if newly_asked {
            self.cell = None;
        }
        if let Some(relit) = relit {
            self.sheets.ask(relit.predicted.clone(), wake, |stop| {
                move |of: &Arc<PredictedFrame>| LampSheet::draw(of, &stop).map(Arc::new)
            });
        }
    }

    /// Sets and saves a verdict or a note.
    ///
    /// # Errors
    /// If the saved marks are not read yet, or cannot be read: they would be lost.
    pub fn mark(&mut self, marked: MarkedOlat) -> Result<(), String> {
        match &self.saved {
            None => return Err("The review is still being read".to_owned()),
            Some(Err(sentence)) => return Err(sentence.clone()),
            Some(Ok(_)) => {}
        }
        let before = self.marks.clone();
        self.marks.set(marked.clone());
        if self.marks != before {
            self.history.push(&before, &marked);
            self.edited = true;
        }
        Ok(())
    }

    /// True if this window has changed verdicts or notes.
    pub fn has_history(&self) -> bool {
        !self.history.undo.is_empty() || !self.history.redo.is_empty()
    }

    /// Undoes or redoes the last verdict or note. Returns its case and lamp, if there is one.
    pub fn travel(&mut self, back: bool) -> Option<[String; 2]> {
        self.history.travel(back, &mut self.marks)
    }

    /// The last measurement.
    pub fn measured(&self) -> Option<&Arc<Review>> {
        self.saved.as_ref()?.as_ref().ok()?.review.as_ref()
    }

    /// Confidence in the frames, if estimated for the current network.
    pub fn confidence(&self) -> Option<&Arc<ConfidenceReport>> {
        let saved = self.saved.as_ref()?.as_ref().ok()?;
        let (report, fits) = saved.confidence.as_ref().ok()?.as_ref()?;
        fits.then_some(report)
    }

    /// The truth of the last measurement.
    pub fn truth(&self) -> Option<PathBuf> {
        self.saved.as_ref()?.as_ref().ok()?.truth.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use evaluation::review::Mark;

    #[test]
    fn a_verdict_is_a_step_and_a_note_is_one_however_long_it_is() {
        let (mut marks, mut history) = (Marks::default(), MarkHistory::default());
        let set = |marks: &mut Marks, history: &mut MarkHistory, lamp, mark, note: &str| {
            let marked = MarkedOlat::new("pose00", lamp, mark, note);
            history.push(marks, &marked);
            marks.set(marked);
        };
        let bad = Some(Mark::Bad);
        let mut states = vec![marks.clone()];
        set(&mut marks, &mut history, "one", bad, "");
        states.push(marks.clone());
        for note in ["t", "th", "the chin"] {
            set(&mut marks, &mut history, "one", bad, note);
        }
        states.push(marks.clone());
        set(&mut marks, &mut history, "two", None, "an ear");
        states.push(marks.clone());
        set(&mut marks, &mut history, "one", None, "the chin");
        for wanted in states.iter().rev() {
            assert!(history.travel(true, &mut marks).is_some());
            assert_eq!(marks, *wanted);
        }
        assert!(history.travel(true, &mut marks).is_none());
        for wanted in &states[1..] {
            assert!(history.travel(false, &mut marks).is_some());
            assert_eq!(marks, *wanted);
        }
        // Typing after an undo is a separate step, and clears the redo steps.
        set(&mut marks, &mut history, "two", None, "an ear, left");
        assert!(history.travel(false, &mut marks).is_none());
        assert!(history.travel(true, &mut marks).is_some());
        assert_eq!(marks, states[3]);
    }
}
