//! Pictures of a review: the current frame under every lamp, and a cell beside its truth. The saved review.

use super::prediction::PredictedFrame;
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

/// Reads cells beside their truth.
pub struct CellReader {
    root: PathBuf,
    compared: Option<ComparedCase>,
}

/// The case that was compared last, with its pictures under every lamp.
struct ComparedCase {
    measurements: u64,
    cell: Cell,
    pictures: ScoredPictures,
}

impl CellReader {
    /// A reader of the project in folder `root`.
    pub fn new(root: PathBuf) -> Self {
        Self { root, compared: None }
    }

    /// Reads a cell. `measurements` counts possible changes of the network and of the review.
    ///
    /// # Errors
    /// When the network or the truth cannot be read, and when the device fails.
    pub fn read(&mut self, measurements: u64, cell: &Cell) -> Result<CellPictures> {
        let is_same = |known: &ComparedCase| {
            known.measurements == measurements && Cell { lamp: cell.lamp, ..known.cell.clone() } == *cell
        };
        let compared = match self.compared.take().filter(is_same) {
            Some(known) => self.compared.insert(known),
            None => {
                let project = Project::open(&self.root)?;
                let (of, truth) = ((cell.case, cell.scale), cell.truth.as_deref());
                let pictures = ScoredPictures::open(&project, truth, cell.device, of)?;
                self.compared.insert(ComparedCase { measurements, cell: cell.clone(), pictures })
            }
        };
        let ([truth, predicted], difference) = compared.pictures.compare(cell.lamp)?;
        Ok(CellPictures {
            cell: cell.clone(),
            truth: SrgbPicture::from_picture(&truth),
            predicted: SrgbPicture::from_picture(&predicted),
            difference,
        })
    }
}

impl SavedReview {
    /// Reads the review of the project in folder `root`.
    ///
    /// # Errors
    /// When the project, the review or its marks cannot be read.
    pub fn read(root: &Path) -> Result<Self> {
        let project = Project::open(root)?;
        let review = Review::load(&project)?;
        let outdated = review.as_ref().and_then(|review| {
            // Without a calibration nothing can be measured, so the saved figures are used.
            let now = Fingerprint::from_project(&project).ok()?;
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
    pub fn draw(predicted: &PredictedFrame, stop: &Control) -> Result<Self> {
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
        let thumbnail = |olat: &Image| SrgbPicture::from_picture(&display_picture(olat, &mask, gain));
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

    /// Three lamps, which light the left half, the right half and nothing.
    fn predicted() -> PredictedFrame {
        let lit = |left: f32, right: f32| Raster::from_fn(200, 100, |x, _| [if x < 100 { left } else { right }; 3]);
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
    fn saved_marks_are_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let project = project::Project::without_shoot(folder.path());
        project.save().unwrap();
        let mut marks = Marks::default();
        marks.set(MarkedOlat::new("frame_001", "olat_00", Some(Mark::Bad), "edge"));
        marks.save(&project).unwrap();
        let kept = SavedReview::read(folder.path()).unwrap();
        assert_eq!(kept.marks, marks);
        assert!(kept.review.is_none() && kept.outdated.is_none() && kept.truth.is_none());
        std::fs::write(project.marks_path(), "format = 9").unwrap();
        let refused = SavedReview::read(folder.path()).unwrap_err().to_string();
        assert!(refused.contains("review.toml"), "{refused}");
    }
}
