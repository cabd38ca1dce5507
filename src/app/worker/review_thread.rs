//! The thread behind a review: draws the current frame under every lamp and a cell beside its truth, and reads
//! and writes the saved review. Only the newest request of a kind is handled, but no mark is dropped.

use super::PredictedFrame;
use super::background::{Background, Handler};
use super::latest::Latest;
use super::mailbox::Request;
use super::srgb_picture::{SrgbPicture, reduced_size};
use base::error::{Error, Result};
use base::progress::Control;
use confidence::ConfidenceReport;
use evaluation::review::{Case, Fingerprint, Marks, Review, ScoredPictures, own_truth};
use evaluation::{display_gain, display_picture};
use gpu::DeviceChoice;
use imaging::resample::resize_area;
use imaging::{Image, Mask, Raster};
use project::Project;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Longer side of a lamp's picture, in pixels.
const THUMBNAIL_PX: usize = 96;

/// A frame under every lamp alone, all at one exposure.
#[derive(Clone, Debug)]
pub struct LampSheet {
    pub frame: usize,
    pub lamps: Vec<SrgbPicture>,
}

/// A measured frame or pose under one lamp.
#[derive(Clone, Debug, PartialEq)]
pub struct Cell {
    pub case: Case,
    /// Factor on predictions in its scores.
    pub scale: f64,
    pub lamp: usize,
    /// Truth that frames were measured against.
    pub truth: Option<PathBuf>,
    /// Device that runs the network.
    pub device: DeviceChoice,
}

/// Pictures of a measured cell.
#[derive(Clone, Debug)]
pub struct CellPictures {
    pub cell: Cell,
    pub truth: SrgbPicture,
    pub predicted: SrgbPicture,
    /// FLIP of each pixel, 0 to 1.
    pub difference: Raster<f32>,
}

/// A project's saved review.
#[derive(Clone, Debug)]
pub struct SavedReview {
    /// The figures; None before the first measurement.
    pub review: Option<Arc<Review>>,
    /// The change since the measurement, as the subject of a sentence.
    pub outdated: Option<&'static str>,
    pub marks: Marks,
    /// Truth of a new measurement: that of the last one, or the shoot's own.
    pub truth: Option<PathBuf>,
    /// Confidence for frames without a truth, and true if it belongs to the current network. None before the
    /// first estimate; an error if it cannot be read.
    pub confidence: std::result::Result<Option<(Arc<ConfidenceReport>, bool)>, String>,
}

/// An answer, or the reason that there is none.
type Answer<T> = std::result::Result<Arc<T>, String>;

/// The thread. Dropping it stops it after the current answer; waiting marks are written first.
pub struct ReviewThread {
    thread: Background<ReviewRequest>,
    answers: Answers,
}

/// Slots of the newest answers.
#[derive(Clone)]
struct Answers {
    sheet: Arc<Latest<Answer<LampSheet>>>,
    saved: Arc<Latest<Answer<SavedReview>>>,
    cell: Arc<Latest<Answer<CellPictures>>>,
    written: Arc<Latest<std::result::Result<(), String>>>,
}

enum ReviewRequest {
    Write(Marks),
    Read,
    Draw(Arc<PredictedFrame>),
    Compare(Cell),
}

enum Done {
    Written,
    Saved(Arc<SavedReview>),
    Sheet(Arc<LampSheet>),
    Cell(Arc<CellPictures>),
}

struct Reviewing {
    root: PathBuf,
    answers: Answers,
    stop: Control,
    /// The case that was compared last, under every lamp.
    compared: Option<(Cell, ScoredPictures)>,
}

impl ReviewThread {
    /// Starts the thread on the project in `root`; `wake` is called after each answer.
    pub fn start(root: PathBuf, wake: impl Fn() + Clone + Send + Sync + 'static) -> Self {
        let answers = Answers {
            sheet: Arc::new(Latest::new(wake.clone())),
            saved: Arc::new(Latest::new(wake.clone())),
            cell: Arc::new(Latest::new(wake.clone())),
            written: Arc::new(Latest::new(wake)),
        };
        let own = answers.clone();
        let thread = Background::spawn("review", move |stop| Reviewing {
            root,
            answers: own,
            stop,
            compared: None,
        });
        Self { thread, answers }
    }

    /// Requests a frame's sheet.
    pub fn draw(&self, field: Arc<PredictedFrame>) {
        self.thread.put(ReviewRequest::Draw(field));
    }

    /// Requests a cell beside its truth.
    pub fn compare(&self, cell: Cell) {
        self.thread.put(ReviewRequest::Compare(cell));
    }

    /// Requests the current saved review.
    pub fn read(&self) {
        self.thread.put(ReviewRequest::Read);
    }

    /// Saves marks in place of the saved ones.
    pub fn write(&self, marks: Marks) {
        self.thread.put(ReviewRequest::Write(marks));
    }

    /// The newest answers, once.
    pub fn sheet(&self) -> Option<Answer<LampSheet>> {
        self.answers.sheet.take()
    }

    pub fn saved(&self) -> Option<Answer<SavedReview>> {
        self.answers.saved.take()
    }

    pub fn cell(&self) -> Option<Answer<CellPictures>> {
        self.answers.cell.take()
    }

    pub fn written(&self) -> Option<std::result::Result<(), String>> {
        self.answers.written.take()
    }
}

impl Request for ReviewRequest {
    /// Marks first: they are never lost, and never read before they are written.
    fn lane(&self) -> Option<usize> {
        Some(match self {
            Self::Write(_) => 0,
            Self::Read => 1,
            Self::Compare(_) => 2,
            Self::Draw(_) => 3,
        })
    }

    fn is_kept(&self) -> bool {
        matches!(self, Self::Write(_))
    }
}

impl Handler for Reviewing {
    type Request = ReviewRequest;
    type Answer = Done;

    fn work(&mut self, request: &mut ReviewRequest) -> Result<Done> {
        match request {
            ReviewRequest::Write(marks) => {
                marks.save(&Project::open(&self.root)?)?;
                Ok(Done::Written)
            }
            ReviewRequest::Read => {
                // The network may have changed.
                self.compared = None;
                Ok(Done::Saved(Arc::new(SavedReview::read(&self.root)?)))
            }
            ReviewRequest::Compare(cell) => self.compare(cell),
            ReviewRequest::Draw(field) => {
                let sheet = LampSheet::draw(field, &self.stop)?;
                Ok(Done::Sheet(Arc::new(sheet)))
            }
        }
    }

    fn deliver(&mut self, request: ReviewRequest, answer: Result<Done>) {
        let Answers { sheet, saved, written, cell } = &self.answers;
        match (request, answer) {
            (_, Ok(Done::Written)) => written.put(Ok(())),
            (_, Ok(Done::Saved(review))) => saved.put(Ok(review)),
            (_, Ok(Done::Sheet(drawn))) => sheet.put(Ok(drawn)),
            (_, Ok(Done::Cell(pictures))) => cell.put(Ok(pictures)),
            (ReviewRequest::Write(_), Err(e)) => written.put(Err(e.to_string())),
            (ReviewRequest::Read, Err(e)) => saved.put(Err(e.to_string())),
            (ReviewRequest::Draw(_), Err(e)) => sheet.put(Err(e.to_string())),
            (ReviewRequest::Compare(_), Err(e)) => cell.put(Err(e.to_string())),
        }
    }
}

impl Reviewing {
    fn compare(&mut self, cell: &Cell) -> Result<Done> {
        let is_same = |known: &Cell| Cell { lamp: cell.lamp, ..known.clone() } == *cell;
        let known = self.compared.take().filter(|(known, _)| is_same(known));
        let (_, pictures) = match known {
            Some(known) => self.compared.insert(known),
            None => {
                let project = Project::open(&self.root)?;
                let (of, truth) = ((cell.case, cell.scale), cell.truth.as_deref());
                let pictures = ScoredPictures::open(&project, truth, cell.device, of)?;
                self.compared.insert((cell.clone(), pictures))
            }
        };
        let ([truth, predicted], difference) = pictures.of(cell.lamp)?;
        Ok(Done::Cell(Arc::new(CellPictures {
            cell: cell.clone(),
            truth: SrgbPicture::of(&truth),
            predicted: SrgbPicture::of(&predicted),
            difference,
        })))
    }
}

impl SavedReview {
    fn read(root: &Path) -> Result<Self> {
        let project = Project::open(root)?;
        let review = Review::load(&project)?;
        let outdated = review.as_ref().and_then(|review| {
            // Without a network nothing can be measured, so the saved figures are used.
            let now = Fingerprint::of(&project).ok()?;
            review.basis.difference(&now)
        });
        let confidence = ConfidenceReport::load(&project)
            .map(|found| found.map(|(report, fits)| (Arc::new(report), fits)))
            .map_err(|e| e.to_string());
        let last = review.as_ref().and_then(|review| review.truth.clone());
        Ok(Self {
            outdated,
            marks: Marks::load(&project)?,
            truth: last.or_else(|| own_truth(&project)),
            review: review.map(Arc::new),
            confidence,
        })
    }
}

impl LampSheet {
    /// Draws a field, lamp by lamp.
    ///
    /// # Errors
    /// When the device fails, or a stop was requested.
    fn draw(predicted: &PredictedFrame, stop: &Control) -> Result<Self> {
        let field = &predicted.field;
        let (width, height) = reduced_size(field.size(), THUMBNAIL_PX);
        let mask: Mask = resize_area(&predicted.frame.mask, width, height);
        let mut olats: Vec<Image> = Vec::with_capacity(field.lamps());
        let mut weights = vec![[0f32; 3]; field.lamps()];
        for lamp in 0..field.lamps() {
            if stop.stopped() {
                return Err(Error::Cancelled { kept: "nothing was changed".to_owned() });
            }
            weights[lamp] = [1.0; 3];
            olats.push(resize_area(&field.relight(&weights)?, width, height));
            weights[lamp] = [0.0; 3];
        }
        let gain = display_gain(olats.iter(), &mask);
        let thumbnail = |olat: &Image| SrgbPicture::of(&display_picture(olat, &mask, gain));
        Ok(Self { frame: predicted.frame.index, lamps: olats.iter().map(thumbnail).collect() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use compositor::Field;
    use evaluation::review::{Mark, MarkedOlat};
    use footage::Frame;
    use reflectance::ReflectanceField;
    use std::sync::mpsc::channel;

    /// Three lamps, which light the left half, the right half and nothing.
    fn predicted() -> PredictedFrame {
        let lit = |left: f32, right: f32| {
            Raster::from_fn(200, 100, |x, _| [if x < 100 { left } else { right }; 3])
        };
        let olats = [lit(1.0, 0.0), lit(0.0, 2.0), lit(0.0, 0.0)];
        PredictedFrame {
            frame: Arc::new(Frame {
                index: 7,
                plate: Image::filled(200, 100, [0.2; 3]),
                mask: Mask::filled(200, 100, 1.0),
            }),
            plate: None,
            field: Arc::new(Field::Memory(ReflectanceField::from_olats(&olats))),
            generation: 1,
            ms: 1.0,
        }
    }

    #[test]
    fn a_sheet_shows_each_lamp_at_one_exposure() {
        let sheet = LampSheet::draw(&predicted(), &Control::default()).unwrap();
        assert_eq!((sheet.frame, sheet.lamps.len()), (7, 3));
        let at = |lamp: usize, x: usize| {
            let SrgbPicture { width, height, rgb } = &sheet.lamps[lamp];
            assert_eq!((*width, *height), (96, 48));
            rgb[(20 * width + x) * 3]
        };
        assert!(at(0, 10) > 60 && at(0, 80) == 0 && at(1, 10) == 0);
        assert!(at(1, 80) > at(0, 10), "the second lamp is twice as bright");
        assert!(sheet.lamps[2].rgb.iter().all(|&code| code == 0));
        let stopped = Control::default();
        stopped.stop();
        assert!(LampSheet::draw(&predicted(), &stopped).is_err());
    }

    #[test]
    fn marks_are_written_before_the_thread_ends_and_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let project = project::Project::without_shoot(folder.path());
        project.save().unwrap();
        let mut marks = Marks::default();
        marks.set(MarkedOlat::new("frame_001", "olat_00", Some(Mark::Bad), "edge"));
        let thread = ReviewThread::start(folder.path().to_path_buf(), || {});
        thread.write(marks.clone());
        drop(thread);
        assert_eq!(Marks::load(&project).unwrap(), marks);

        let (wake, woken) = channel();
        let thread = ReviewThread::start(folder.path().to_path_buf(), move || {
            let _ = wake.send(());
        });
        thread.read();
        woken.recv().unwrap();
        let kept = thread.saved().unwrap().unwrap();
        assert_eq!(kept.marks, marks);
        assert!(kept.review.is_none() && kept.outdated.is_none() && kept.truth.is_none());
        std::fs::write(project.marks_path(), "format = 9").unwrap();
        thread.read();
        woken.recv().unwrap();
        let refused = thread.saved().unwrap().unwrap_err();
        assert!(refused.contains("review.toml"), "{refused}");
        thread.draw(Arc::new(predicted()));
        woken.recv().unwrap();
        assert_eq!(thread.sheet().unwrap().unwrap().lamps.len(), 3);
    }

    #[test]
    fn a_panic_is_said_where_it_was_asked() {
        let folder = tempfile::tempdir().unwrap();
        project::Project::without_shoot(folder.path()).save().unwrap();
        let (wake, woken) = channel();
        let thread = ReviewThread::start(folder.path().to_path_buf(), move || {
            let _ = wake.send(());
        });
        let said = |ask: &dyn Fn()| {
            thread.thread.panic_next();
            ask();
            woken.recv().unwrap();
        };
        said(&|| thread.read());
        assert!(thread.saved().unwrap().unwrap_err().contains("on purpose"));
        said(&|| thread.write(Marks::default()));
        assert!(thread.written().unwrap().unwrap_err().contains("on purpose"));
        said(&|| thread.draw(Arc::new(predicted())));
        assert!(thread.sheet().unwrap().unwrap_err().contains("on purpose"));
        thread.read();
        woken.recv().unwrap();
        assert!(thread.saved().unwrap().is_ok());
    }
}
