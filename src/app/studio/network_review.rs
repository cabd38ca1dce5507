//! The window's knowledge of the review. A thread of its own draws the sheet and saves the marks.

use confidence::ConfidenceReport;
use evaluation::review::{MarkedOlat, Marks, Review};
use gpu::DeviceChoice;
use project::Project;
use std::path::PathBuf;
use std::sync::Arc;
use worker::background::drop_later;
use worker::{
    Cell, CellPictures, LampSheet, PredictedFrame, PreviewPicture, ReviewThread, SavedReview,
};

/// The thread's answers; it starts when it is first needed.
#[derive(Default)]
pub struct NetworkReview {
    /// The current frame under every lamp, or why it cannot be drawn.
    pub sheet: Option<Result<Arc<LampSheet>, String>>,
    /// The review that is saved in the project, or why it cannot be read.
    pub saved: Option<Result<Arc<SavedReview>, String>>,
    /// The cell that was asked for last beside its truth, or why it cannot be shown; None until it is made.
    pub cell: Option<Result<Arc<CellPictures>, String>>,
    /// The current marks; they may not be written yet.
    pub marks: Marks,
    /// Reason the marks could not be written.
    pub failure: Option<String>,
    thread: Option<ReviewThread>,
    /// The prediction whose sheet was asked for last.
    drawn: Option<Arc<PredictedFrame>>,
    compared: Option<Cell>,
    /// The saved review was asked for since it may have changed.
    asked: bool,
    /// Marks were set in this window.
    edited: bool,
    history: MarkHistory,
}

/// Steps of undo that are kept.
const STEPS: usize = 100;

/// The marks before the present ones, and those that were undone; in each, the nearest is last.
#[derive(Default)]
struct MarkHistory {
    undo: Vec<MarkStep>,
    redo: Vec<MarkStep>,
    /// The last change was to a note alone: further typing into that is no step of its own.
    typing: bool,
}

/// The marks without a change, and the case and lamp that it is about.
struct MarkStep {
    marks: Marks,
    cell: [String; 2],
}

impl MarkHistory {
    /// A mark is to be set.
    fn push(&mut self, before: &Marks, marked: &MarkedOlat) {
        let cell = [&marked.case, &marked.lamp].map(String::clone);
        let of = before.of(&marked.case, &marked.lamp);
        let types = of.and_then(|of| of.mark) == marked.mark;
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

    /// Goes a step back or forth from the present marks. Returns the case and lamp that it was about, if there was one.
    fn travel(&mut self, back: bool, marks: &mut Marks) -> Option<[String; 2]> {
        let (from, to) = match back {
            true => (&mut self.undo, &mut self.redo),
            false => (&mut self.redo, &mut self.undo),
        };
        let step = from.pop()?;
        let cell = step.cell.clone();
        to.push(MarkStep { marks: std::mem::replace(marks, step.marks), cell: step.cell });
        self.typing = false;
        Some(cell)
    }
}

impl NetworkReview {
    /// A job may have changed the saved review.
    pub fn invalidate(&mut self) {
        self.asked = false;
        (self.compared, self.cell) = (None, None);
    }

    /// Takes in the newest answers.
    pub fn receive(&mut self) {
        let Some(thread) = &self.thread else { return };
        self.sheet = thread.sheet().or(self.sheet.take());
        self.cell = thread.cell().or(self.cell.take());
        if let Some(written) = thread.written() {
            self.failure = written.err();
        }
        if let Some(saved) = thread.saved() {
            // Marks from this window are newer than the file.
            if let (Ok(saved), false) = (&saved, self.edited) {
                self.marks = saved.marks.clone();
            }
            self.saved = Some(saved);
        }
    }

    /// Asks for what the review shows, if that changed. Called while it is visible; `relit` is None while a clip
    /// plays. `cell` has indices of case and lamp, and the device for the network.
    pub fn ask(
        &mut self,
        project: &Project,
        relit: Option<&Arc<PreviewPicture>>,
        cell: Option<(usize, usize, DeviceChoice)>,
        wake: impl Fn() + Clone + Send + Sync + 'static,
    ) {
        let start = || ReviewThread::start(project.root.clone(), wake);
        let thread = self.thread.get_or_insert_with(start);
        if !self.asked {
            thread.read();
            self.asked = true;
        }
        let review = match &self.saved {
            Some(Ok(saved)) => saved.review.as_ref(),
            _ => None,
        };
        let cell = cell.and_then(|(case, lamp, device)| {
            let (review, case) = (review?, review?.cases.get(case)?);
            Some(Cell {
                case: case.case,
                scale: case.scale,
                lamp,
                truth: review.truth.clone(),
                device,
            })
        });
        if cell.is_some() && cell != self.compared {
            self.cell = None;
            cell.iter().for_each(|cell| thread.compare(cell.clone()));
        }
        self.compared = cell;
        if let Some(relit) = relit {
            let same = |drawn: &Arc<PredictedFrame>| Arc::ptr_eq(drawn, &relit.predicted);
            if !self.drawn.as_ref().is_some_and(same) {
                thread.draw(relit.predicted.clone());
                self.drawn = Some(relit.predicted.clone());
            }
        }
    }

    /// Sets and saves a verdict or a note.
    ///
    /// # Errors
    /// When the saved ones are not read yet, or cannot be read: they would be lost.
    pub fn mark(&mut self, marked: MarkedOlat) -> Result<(), String> {
        let (Some(thread), Some(saved)) = (&self.thread, &self.saved) else {
            return Err("The review is still being read".to_owned());
        };
        if let Err(sentence) = saved {
            return Err(sentence.clone());
        }
        let before = self.marks.clone();
        self.marks.set(marked.clone());
        if self.marks != before {
            self.history.push(&before, &marked);
            self.edited = true;
            thread.write(self.marks.clone());
        }
        Ok(())
    }

    /// True if verdicts or notes were given in this window.
    pub fn has_history(&self) -> bool {
        !self.history.undo.is_empty() || !self.history.redo.is_empty()
    }

    /// Undoes the last verdict or note, or gives it again. Returns the case and lamp that it is about, if there is one.
    pub fn travel(&mut self, back: bool) -> Option<[String; 2]> {
        let thread = self.thread.as_ref()?;
        let cell = self.history.travel(back, &mut self.marks)?;
        thread.write(self.marks.clone());
        Some(cell)
    }

    /// The last measurement.
    pub fn measured(&self) -> Option<&Arc<Review>> {
        self.saved.as_ref()?.as_ref().ok()?.review.as_ref()
    }

    /// Confidence in the frames, if that was found out for the present network.
    pub fn confidence(&self) -> Option<&Arc<ConfidenceReport>> {
        let saved = self.saved.as_ref()?.as_ref().ok()?;
        let (report, fits) = saved.confidence.as_ref().ok()?.as_ref()?;
        fits.then_some(report)
    }

    /// The truth that was measured against last.
    pub fn truth(&self) -> Option<PathBuf> {
        self.saved.as_ref()?.as_ref().ok()?.truth.clone()
    }
}

impl Drop for NetworkReview {
    /// Joins the thread in the background: it may be drawing a sheet.
    fn drop(&mut self) {
        if let Some(thread) = self.thread.take() {
            drop_later(thread);
        }
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
        // What is typed after an undo is a step of its own, and ends what could be redone.
        set(&mut marks, &mut history, "two", None, "an ear, left");
        assert!(history.travel(false, &mut marks).is_none());
        assert!(history.travel(true, &mut marks).is_some());
        assert_eq!(marks, states[3]);
    }
}
