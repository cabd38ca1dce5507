//! A method's pictures beside their truths: the basis of the scores and of the pictures shown.

use super::accuracy::{Method, Predicted, Scores};
use super::exemplars::Nearest;
use super::learnt::single_lamps;
use super::metrics::{Compared, Psnr, encoded, psnr};
use super::regions::{RegionScore, regions};
use super::shadow_edges::shadow_edges;
use super::truth::Truth;
use base::error::{Error, Result};
use base::progress::Progress;
use calibration::Calibration;
use compositor::Plate;
use compositor::reference::extend_edges;
use footage::{Frame, PictureSize};
use imaging::file::write_png;
use imaging::resample::resize_area;
use imaging::{Image, Mask};
use project::Project;
use reflectance::ReflectanceField;
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;
use transfer::FineField;

/// A method's pictures of the truth's frames.
pub struct Comparison {
    method: Method,
    at: PictureSize,
    frames: Vec<usize>,
    /// Environment → each frame under it.
    relit: BTreeMap<String, Vec<FramePictures>>,
    /// Frames under single lamps, for those with true OLATs.
    olats: Vec<FramePictures>,
    /// Time of each frame in milliseconds.
    times: Vec<f64>,
}

/// Renders the pictures of `method` under each environment, with lamp weights in any unit, and reads their truths.
///
/// # Errors
/// As [`score`](super::score()).
pub fn compare(
    project: &Project,
    calibration: &Calibration,
    truth: &Truth,
    weights: &BTreeMap<String, Vec<[f32; 3]>>,
    (method, at): (Method, PictureSize),
    predict: &mut dyn FnMut(&Frame, bool) -> Result<Predicted>,
    progress: &Progress,
) -> Result<Comparison> {
    let nearest = Nearest::new(method, project, calibration)?;
    let frames: Vec<usize> =
        truth.frames.iter().copied().filter(|&f| method != Method::TruthOlats || truth.has_olats(f)).collect();
    if frames.is_empty() {
        return Err(Error::missing(
            "the truth has no OLATs",
            "Evaluate another method: --with network, nearest or ratio",
        ));
    }
    let mut relit: BTreeMap<String, Vec<FramePictures>> = BTreeMap::new();
    let mut olats: Vec<FramePictures> = Vec::new();
    let mut times: Vec<f64> = Vec::new();
    for (done, &index) in frames.iter().enumerate() {
        progress.check("nothing was written")?;
        let total = frames.len() as u64;
        progress.step("evaluate", done as u64, total, format!("frame {index}"));
        let (frame, filmed) = Frame::load_filmed(project, &calibration.response, index)?;
        let filmed = filmed.shown(at);
        let plate = filmed.map(|filmed| Plate::from_filmed(filmed, &frame)).transpose()?;
        let matte = plate.as_ref().map_or(&frame.mask, |plate| &plate.matte).clone();
        let true_olats = if truth.has_olats(index) { Some(truth.olats_at(index, at)?) } else { None };
        let began = Instant::now();
        let predicted = match (&nearest, method, &true_olats) {
            (Some(nearest), ..) => Predicted::Field(nearest.field(&frame)?, None),
            (None, Method::TruthOlats, Some(olats)) => Predicted::Field(ReflectanceField::from_olats(olats), None),
            _ => predict(&frame, true_olats.is_some())?,
        };
        times.push(match &predicted {
            Predicted::Field(..) => began.elapsed().as_secs_f64() * 1e3,
            Predicted::Pictures(pictures) => pictures.picture_ms,
        });
        let measured = |set: &mut Vec<FramePictures>, pictures, truths| {
            let mut measured = FramePictures { frame: index, mask: matte.clone(), pictures, truths };
            measured.shrink_to_truth();
            set.push(measured);
        };
        let limit = method == Method::TruthOlats;
        let fine = match &predicted {
            Predicted::Field(_, fine) => fine.clone(),
            Predicted::Pictures(_) => None,
        };
        let plate = plate.filter(|_| !limit).map(|plate| FineField::on(fine, plate));
        let plate = plate.as_ref();
        for (name, weights) in weights {
            let picture = predicted.relit(name, weights)?;
            measured(
                relit.entry(name.clone()).or_default(),
                vec![at_plate(picture, (plate, &frame.mask), weights)],
                vec![truth.relit_at(index, name, at)?],
            );
        }
        if let (Some(truths), Some(predicted)) = (true_olats, predicted.olats()) {
            let lamps = single_lamps(truths.len());
            let shown = |(olat, lamp): (Image, &Vec<_>)| at_plate(olat, (plate, &frame.mask), lamp);
            measured(&mut olats, predicted.zip(&lamps).map(shown).collect(), truths);
        }
    }
    progress.step("evaluate", frames.len() as u64, frames.len() as u64, "");
    Ok(Comparison { method, at, frames, relit, olats, times })
}

impl Comparison {
    /// Accuracy of the pictures.
    ///
    /// # Errors
    /// When a frame has no subject.
    pub fn scores(&self) -> Result<Scores> {
        let mut times = self.times.clone();
        times.sort_unstable_by(f64::total_cmp);
        let mut scores = Scores {
            method: self.method,
            at: self.at,
            frames: self.frames.clone(),
            relit_psnr_db: BTreeMap::new(),
            relit_psnr_by_frame_db: BTreeMap::new(),
            relit_regions: BTreeMap::new(),
            olat_psnr_db: None,
            olat_psnr_by_frame_db: BTreeMap::new(),
            olat_psnr_by_lamp_db: BTreeMap::new(),
            olat_shadow_edges: None,
            frame_ms: times.get(times.len() / 2).copied(),
        };
        for (name, set) in &self.relit {
            let found = set_psnr(set)?;
            let regions: Vec<RegionScore> = regions(&compared(set), found.scale);
            scores.relit_psnr_db.insert(name.clone(), found.mean_db);
            scores.relit_psnr_by_frame_db.insert(name.clone(), found.frames_db);
            scores.relit_regions.insert(name.clone(), regions);
        }
        if !self.olats.is_empty() {
            let found = set_psnr(&self.olats)?;
            scores.olat_psnr_db = Some(found.mean_db);
            scores.olat_shadow_edges = shadow_edges(&compared(&self.olats), found.scale);
            let frames = || self.olats.iter().map(|m| m.frame);
            scores.olat_psnr_by_frame_db = frames().zip(found.frames_db).collect();
            scores.olat_psnr_by_lamp_db = frames().zip(found.pictures_db).collect();
        }
        Ok(scores)
    }

    /// Writes each measured frame as `ENVIRONMENT-FRAME.png`, each of its OLATs as `olat-LAMP-FRAME.png`, lamps counted
    /// from 0, and each truth beside them as `…-truth.png`: the measure's codes, over black.
    ///
    /// # Errors
    /// When a file cannot be written.
    pub fn write_pictures(&self, folder: &Path) -> Result<()> {
        std::fs::create_dir_all(folder)
            .map_err(|e| Error::io("write", folder, e, "Check that the folder can be written"))?;
        let write = |set: &[FramePictures], name: &dyn Fn(usize) -> String| -> Result<()> {
            if set.is_empty() {
                return Ok(());
            }
            let scale = set_psnr(set)?.scale;
            for shown in set {
                let exposure = shown.compared().exposure();
                let write = |picture: &Image, gain: f64, name: String| {
                    let mut picture = picture.clone();
                    extend_edges(&mut picture, &shown.mask);
                    let codes = encoded(&picture, &shown.mask, gain as f32);
                    write_png(&folder.join(name), &codes)
                };
                for (place, (picture, truth)) in shown.pictures.iter().zip(&shown.truths).enumerate() {
                    let stem = format!("{}-{}", name(place), shown.frame);
                    write(picture, exposure * scale, format!("{stem}.png"))?;
                    write(truth, exposure, format!("{stem}-truth.png"))?;
                }
            }
            Ok(())
        };
        for (name, set) in &self.relit {
            write(set, &|_| name.clone())?;
        }
        write(&self.olats, &|lamp| format!("olat-{lamp}"))
    }
}

/// A sum of lamps by `weights` at its plate's size, as in the compositor but not premultiplied; unchanged without a
/// plate.
pub fn at_plate(mut sum: Image, (plate, mask): (Option<&Plate>, &Mask), weights: &[[f32; 3]]) -> Image {
    let Some(plate) = plate else { return sum };
    extend_edges(&mut sum, mask);
    premultiply(&mut sum, mask);
    let mut picture = plate.relit_by(&sum, mask, weights);
    unpremultiply(&mut picture, &plate.matte);
    picture
}

fn premultiply(picture: &mut Image, mask: &Mask) {
    for (pixel, &alpha) in picture.pixels.iter_mut().zip(&mask.pixels) {
        *pixel = pixel.map(|v| v * alpha);
    }
}

fn unpremultiply(picture: &mut Image, mask: &Mask) {
    let pixels = picture.pixels.iter_mut().zip(&mask.pixels);
    for (pixel, &alpha) in pixels.filter(|(_, alpha)| **alpha > 0.0) {
        *pixel = pixel.map(|v| v / alpha);
    }
}

/// Pictures of one frame beside their truths.
struct FramePictures {
    frame: usize,
    mask: Mask,
    pictures: Vec<Image>,
    truths: Vec<Image>,
}

impl FramePictures {
    /// Averages the pictures down to the truths' size, if the truths show the same framing in fewer pixels.
    fn shrink_to_truth(&mut self) {
        if let Some(size) = self.truths.first().map(Image::size) {
            at_truths_size(&mut self.pictures, &mut self.mask, size);
        }
    }
    fn compared(&self) -> Compared<'_> {
        Compared { pictures: &self.pictures, truths: &self.truths, mask: &self.mask }
    }
}

fn compared(set: &[FramePictures]) -> Vec<Compared<'_>> {
    set.iter().map(FramePictures::compared).collect()
}

fn set_psnr(set: &[FramePictures]) -> Result<Psnr> {
    psnr(&compared(set))
}

/// Averages pictures of the matte's size, and the matte, down to a truth's size, if it has the same aspect ratio and
/// fewer pixels.
pub fn at_truths_size(pictures: &mut [Image], mask: &mut Mask, (narrow, low): (usize, usize)) {
    let (width, height) = mask.size();
    if narrow >= width || narrow * height != low * width {
        return;
    }
    let small = resize_area(mask, narrow, low);
    let large = (pictures.iter_mut()).filter(|picture| picture.size() == (width, height));
    for picture in large {
        premultiply(picture, mask);
        *picture = resize_area(picture, narrow, low);
        unpremultiply(picture, &small);
    }
    *mask = small;
}

#[cfg(test)]
mod tests {
    use super::super::metrics::SUBJECT;
    use super::super::truth_weights;
    use super::*;
    use calibration::{CalibrateSettings, calibrate};
    use footage::{ImportSettings, import};
    use imaging::file::read_encoded;
    use light::weights::Weighting;
    use virtual_stage::{StageSettings, write_shoot};

    #[test]
    fn pictures_are_written_as_they_are_measured() -> Result<()> {
        let folder = tempfile::tempdir().unwrap();
        let (shoot, silent) = (folder.path().join("shoot"), Progress::silent());
        let stage = StageSettings { frames: 4, size: 32, lamps: 8, ..StageSettings::default() };
        write_shoot(&shoot, &stage, &silent)?;
        let settings = ImportSettings { size: 32, seed: 0, layer: None };
        let mut project = import(&folder.path().join("project"), &shoot, &settings, &silent)?;
        let calibration = calibrate(&mut project, &CalibrateSettings::default(), &silent)?;
        let truth = Truth::open(&project, &shoot)?;
        let weights = truth_weights(&project, &calibration, &truth, Weighting::default())?;
        let found = compare(
            &project,
            &calibration,
            &truth,
            &weights,
            (Method::Ratio, PictureSize::Square),
            &mut |_, _| Err(Error::bug("nothing is predicted")),
            &silent,
        )?;
        let scores = found.scores()?;
        let pictures = folder.path().join("pictures");
        found.write_pictures(&pictures)?;
        for (name, by_frame) in &scores.relit_psnr_by_frame_db {
            for (frame, measured) in scores.frames.iter().zip(by_frame) {
                let read = |end: &str| {
                    let file = format!("{name}-{frame}{end}.png");
                    read_encoded(&pictures.join(file)).map(|codes| codes.0)
                };
                let (picture, truth) = (read("")?, read("-truth")?);
                let (shown, _) = Frame::load_filmed(&project, &calibration.response, *frame)?;
                let inside = shown.mask.pixels.iter().map(|&alpha| alpha > SUBJECT);
                let pairs = picture.pixels.iter().zip(&truth.pixels).zip(inside);
                let errors: Vec<f64> = pairs
                    .filter(|(_, inside)| *inside)
                    .flat_map(|((a, b), _)| [0, 1, 2].map(|c| f64::from(a[c] - b[c]).powi(2)))
                    .collect();
                let mean = errors.iter().sum::<f64>() / errors.len() as f64;
                let shown = -10.0 * mean.log10();
                // Tolerance for 8-bit codes and mattes slightly below 1.
                assert!((shown - measured).abs() < 0.2, "{name} {frame}: {shown} {measured}");
            }
            let shares: f64 = scores.relit_regions[name].iter().map(|part| part.share).sum();
            assert!((shares - 1.0).abs() < 1e-9);
        }
        assert!(scores.relit_psnr_by_frame_db.len() > 1);
        for (frame, lamps) in &scores.olat_psnr_by_lamp_db {
            for lamp in 0..lamps.len() {
                for end in ["", "-truth"] {
                    read_encoded(&pictures.join(format!("olat-{lamp}-{frame}{end}.png")))?;
                }
            }
        }
        assert!(!scores.olat_psnr_by_lamp_db.is_empty());
        Ok(())
    }
}
