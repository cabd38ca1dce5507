//! The thread behind a review: it draws the shown frame under every lamp, and reads and writes what the
//! project keeps. The newest wish counts; older ones are dropped, but no mark is.

use super::PredictedFrame;
use super::latest::{Latest, doorbell};
use super::srgb_picture::{SrgbPicture, reduced_size};
use base::error::Result;
use base::progress::Control;
use evaluation::review::{Fingerprint, Marks, Review, own_truth};
use evaluation::{display_gain, display_picture};
use imaging::resample::resize_area;
use imaging::{Image, Mask};
use project::Project;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread::JoinHandle;

/// Longer side of a lamp's picture.
const THUMBNAIL_PX: usize = 96;

/// A frame under every lamp alone, all at one exposure.
#[derive(Clone, Debug)]
pub struct LampSheet {
    pub frame: usize,
    pub lamps: Vec<SrgbPicture>,
}

/// What a project keeps of its review.
#[derive(Clone, Debug)]
pub struct SavedReview {
    /// The figures, where there are any.
    pub review: Option<Arc<Review>>,
    /// What has changed since they were measured, as the subject of a sentence.
    pub outdated: Option<&'static str>,
    pub marks: Marks,
    /// The truth that a new measurement would use: that of the last one, or the shoot's own.
    pub truth: Option<PathBuf>,
}

/// An answer, or why there is none.
type Answer<T> = std::result::Result<Arc<T>, String>;

/// The thread. Dropping it stops it after the answer in hand; marks that wait are written first.
pub struct ReviewThread {
    fields: Arc<Latest<Arc<PredictedFrame>>>,
    reads: Arc<Latest<()>>,
    marks: Arc<Latest<Marks>>,
    sheet: Arc<Latest<Answer<LampSheet>>>,
    kept: Arc<Latest<Answer<SavedReview>>>,
    written: Arc<Latest<std::result::Result<(), String>>>,
    ring: Box<dyn Fn() + Send>,
    stop: Control,
    thread: Option<JoinHandle<()>>,
}

impl ReviewThread {
    /// Starts on the project in `root`; `wake` is called after each answer.
    pub fn start(root: PathBuf, wake: impl Fn() + Clone + Send + Sync + 'static) -> Self {
        let (ring, rung) = doorbell();
        let fields = Arc::new(Latest::new(ring.clone()));
        let reads = Arc::new(Latest::new(ring.clone()));
        let marks = Arc::new(Latest::new(ring.clone()));
        let sheet = Arc::new(Latest::new(wake.clone()));
        let kept = Arc::new(Latest::new(wake.clone()));
        let written = Arc::new(Latest::new(wake));
        let stop = Control::default();
        let mut thread = Self {
            fields: fields.clone(),
            reads: reads.clone(),
            marks: marks.clone(),
            sheet: sheet.clone(),
            kept: kept.clone(),
            written: written.clone(),
            ring: Box::new(ring),
            stop: stop.clone(),
            thread: None,
        };
        let work = move || {
            loop {
                // Marks first: what a person wrote is never lost, nor read before it is written.
                if let Some(new) = marks.take() {
                    written.put(write(&root, &new).map_err(|e| e.to_string()));
                } else if stop.stopped() {
                    break;
                } else if reads.take().is_some() {
                    kept.put(read(&root).map(Arc::new).map_err(|e| e.to_string()));
                } else if let Some(field) = fields.take() {
                    let drawn = LampSheet::draw(&field, &stop);
                    sheet.put(drawn.map(Arc::new).map_err(|e| e.to_string()));
                } else if rung.recv().is_err() {
                    break;
                }
            }
        };
        thread.thread = Some(std::thread::spawn(work));
        thread
    }

    /// Asks for a frame's sheet.
    pub fn draw(&self, field: Arc<PredictedFrame>) {
        self.fields.put(field);
    }

    /// Asks for what the project keeps, as it is now.
    pub fn read(&self) {
        self.reads.put(());
    }

    /// Keeps marks in place of those that were kept.
    pub fn write(&self, marks: Marks) {
        self.marks.put(marks);
    }

    /// The newest answers, once.
    pub fn sheet(&self) -> Option<Answer<LampSheet>> {
        self.sheet.take()
    }

    pub fn kept(&self) -> Option<Answer<SavedReview>> {
        self.kept.take()
    }

    pub fn written(&self) -> Option<std::result::Result<(), String>> {
        self.written.take()
    }
}

impl Drop for ReviewThread {
    fn drop(&mut self) {
        self.stop.stop();
        (self.ring)();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn read(root: &std::path::Path) -> Result<SavedReview> {
    let project = Project::open(root)?;
    let review = Review::load(&project)?;
    let outdated = review.as_ref().and_then(|review| {
        // Without a network nothing can be measured anew, and what is kept is all there is.
        let now = Fingerprint::of(&project).ok()?;
        review.basis.difference(&now)
    });
    let last = review.as_ref().and_then(|review| review.truth.clone());
    Ok(SavedReview {
        outdated,
        marks: Marks::load(&project)?,
        truth: last.or_else(|| own_truth(&project)),
        review: review.map(Arc::new),
    })
}

fn write(root: &std::path::Path, marks: &Marks) -> Result<()> {
    marks.save(&Project::open(root)?)
}

impl LampSheet {
    /// Draws a field, lamp by lamp.
    ///
    /// # Errors
    /// When the device fails, or a stop was asked for.
    fn draw(predicted: &PredictedFrame, stop: &Control) -> Result<Self> {
        let field = &predicted.field;
        let (width, height) = reduced_size(field.size(), THUMBNAIL_PX);
        let mask: Mask = resize_area(&predicted.frame.mask, width, height);
        let mut olats: Vec<Image> = Vec::with_capacity(field.lamps());
        let mut weights = vec![[0f32; 3]; field.lamps()];
        for lamp in 0..field.lamps() {
            if stop.stopped() {
                return Err(base::error::Error::Cancelled {
                    kept: "nothing was changed".to_owned(),
                });
            }
            weights[lamp] = [1.0; 3];
            olats.push(resize_area(&field.relight(&weights)?, width, height));
            weights[lamp] = [0.0; 3];
        }
        let gain = display_gain(olats.iter(), &mask);
        let thumbnail = |olat: &Image| SrgbPicture::of(&display_picture(olat, &mask, gain));
        Ok(Self {
            frame: predicted.frame.index,
            lamps: olats.iter().map(thumbnail).collect(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use compositor::Field;
    use evaluation::review::{Mark, MarkedOlat};
    use footage::Frame;
    use imaging::Raster;
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
        marks.set(MarkedOlat::new(
            "frame_001",
            "olat_00",
            Some(Mark::Bad),
            "edge",
        ));
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
        let kept = thread.kept().unwrap().unwrap();
        assert_eq!(kept.marks, marks);
        assert!(kept.review.is_none() && kept.outdated.is_none() && kept.truth.is_none());
        std::fs::write(project.marks_path(), "format = 9").unwrap();
        thread.read();
        woken.recv().unwrap();
        let refused = thread.kept().unwrap().unwrap_err();
        assert!(refused.contains("review.toml"), "{refused}");
        thread.draw(Arc::new(predicted()));
        woken.recv().unwrap();
        assert_eq!(thread.sheet().unwrap().unwrap().lamps.len(), 3);
    }
}
