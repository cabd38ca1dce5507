//! Clips of a page: a stretch of the interview under single lamps by each method, and the reference images.

use super::super::accuracy::Method;
use super::super::comparison::at_plate;
use super::super::display::{display_gain, display_picture};
use super::super::evaluate::learning_minutes;
use super::super::exemplars::Nearest;
use super::super::learnt::{Learnt, single_lamps};
use super::result::name;
use super::settings::BlindSettings;
use base::error::{Error, Result};
use base::progress::Progress;
use calibration::Calibration;
use compositor::Plate;
use footage::{Exemplar, Frame, PictureSize};
use gpu::ComputeDevice;
use imaging::file::jpeg_bytes;
use imaging::resample::resize_area;
use imaging::{Encoded, Image, Mask};
use light::subset;
use project::Project;
use reflectance::Predictor;
use rivals::Effort;
use std::collections::BTreeMap;
use std::ops::Range;
use transfer::{FineField, OlatPredictor};

/// Longest side of a picture in the page.
const SIDE_PX: usize = 512;
/// JPEG quality at which artefacts are invisible.
const QUALITY: u8 = 95;
/// Least share of the brightest lamp's level on the subject for a lamp to be chosen automatically: weaker ones only
/// light a rim.
const FRONT: f32 = 0.3;

/// A stretch of the interview under one lamp by one method, as JPEG pictures.
pub(super) struct Clip {
    pub method: Method,
    pub lamp: usize,
    pub pictures: Vec<Vec<u8>>,
}

/// Pictures of a page.
pub(super) struct Clips {
    pub clips: Vec<Clip>,
    /// Lamp → photograph of the subject under it.
    pub references: BTreeMap<usize, Vec<u8>>,
    pub frames: Vec<usize>,
    /// Number of these frames that the project's network was trained on, if it is compared.
    pub seen: usize,
    /// Method → minutes of training.
    pub minutes: BTreeMap<String, f64>,
}

/// Source of a method's pictures.
enum Maker {
    Network(Box<Predictor>),
    Prediction(Box<OlatPredictor>),
    Nearest(Nearest),
    Learnt(Box<Learnt>),
}

impl Maker {
    /// The project's network, if the method uses it.
    fn network(&self) -> Option<&Predictor> {
        match self {
            Self::Network(predictor) => Some(predictor),
            Self::Prediction(predictor) => predictor.network(),
            Self::Nearest(_) | Self::Learnt(_) => None,
        }
    }

    /// A frame under each of `lamps`, and the finer light of its plate.
    fn lit(&self, frame: &Frame, lamps: &[usize]) -> Result<(Vec<Image>, Option<FineField>)> {
        let (field, fine) = match self {
            Self::Network(predictor) => (predictor.predict(frame)?, None),
            Self::Prediction(predictor) => {
                let (field, fine) = predictor.predict_fine(frame)?;
                (field.read()?, fine)
            }
            Self::Nearest(nearest) => (nearest.field(frame)?, None),
            Self::Learnt(learnt) => return Ok((learnt.relit(frame)?, None)),
        };
        Ok((lamps.iter().map(|&lamp| field.olat(lamp)).collect(), fine))
    }
}

/// Renders the clips.
///
/// # Errors
/// When a method's requirements are missing, a lamp or picture is missing, or the user stops it.
pub(super) fn make(
    project: &Project,
    calibration: &Calibration,
    settings: &BlindSettings,
    progress: &Progress,
) -> Result<Clips> {
    let compute = ComputeDevice::choose(settings.device);
    let exemplar = Exemplar::load(project, &calibration.response, 0)?;
    let lamps = lamps(project, calibration, settings, &exemplar)?;
    let gains: Vec<f32> =
        (lamps.iter()).map(|&lamp| display_gain([&exemplar.olats[lamp]].into_iter(), &exemplar.mask)).collect();
    let references =
        lamps.iter().zip(&gains).map(|(&lamp, &gain)| Ok((lamp, jpeg(&exemplar.olats[lamp], &exemplar.mask, gain)?)));
    let references = references.collect::<Result<_>>()?;
    let alone = single_lamps(calibration.rig.lamps.len());
    let frames = middle(project.settings.shoot.frames.len(), settings.frames);
    let (mut clips, mut minutes, mut seen) = (Vec::new(), BTreeMap::new(), 0);
    for &method in &settings.methods {
        let maker = maker(method, (project, calibration), &lamps, settings, &compute, progress)?;
        if let Some(network) = maker.network() {
            let info = network.info();
            minutes.insert(name(method), info.seconds / 60.0);
            let known = |f: &usize| info.training_frames.contains(f);
            seen = frames.clone().filter(known).count();
        }
        if let Maker::Learnt(learnt) = &maker {
            minutes.insert(name(method), learnt.spent().seconds / 60.0);
        }
        let mut pictures: Vec<Vec<Vec<u8>>> = vec![Vec::new(); lamps.len()];
        for index in frames.clone() {
            progress.check("nothing was written")?;
            let (done, total) = ((index - frames.start) as u64, frames.len() as u64);
            progress.step("making clips", done, total, format!("frame {index}"));
            let (frame, filmed) = Frame::load_filmed(project, &calibration.response, index)?;
            let filmed = filmed.shown(settings.at);
            let plate = filmed.map(|filmed| Plate::from_filmed(filmed, &frame)).transpose()?;
            let (lit, fine) = maker.lit(&frame, &lamps)?;
            let plate = plate.map(|plate| FineField::on(fine, plate));
            let matte = plate.as_ref().map_or(&frame.mask, |plate| &plate.matte);
            let made = lit.into_iter().zip(&lamps).zip(&mut pictures).zip(&gains);
            for (((picture, &lamp), pictures), &gain) in made {
                let picture = at_plate(picture, (plate.as_ref(), &frame.mask), &alone[lamp]);
                pictures.push(jpeg(&picture, matte, gain)?);
            }
        }
        clips.extend(lamps.iter().zip(pictures).map(|(&lamp, pictures)| Clip { method, lamp, pictures }));
    }
    Ok(Clips { clips, references, frames: frames.collect(), seen, minutes })
}

fn maker(
    method: Method,
    (project, calibration): (&Project, &Calibration),
    lamps: &[usize],
    settings: &BlindSettings,
    compute: &ComputeDevice,
    progress: &Progress,
) -> Result<Maker> {
    if let Some(nearest) = Nearest::new(method, project, calibration)? {
        return Ok(Maker::Nearest(nearest));
    }
    match method {
        Method::Network => Ok(Maker::Network(Box::new(Predictor::open(project, &compute.device)?))),
        Method::Prediction | Method::Transfer => {
            let mut opened = OlatPredictor::open(project, calibration, &compute.device)?.steady(project, calibration);
            if settings.at != PictureSize::Square {
                opened = opened.with_detail(project, calibration)?;
            }
            if method == Method::Transfer {
                opened = opened.corrected_by(None);
            }
            Ok(Maker::Prediction(Box::new(opened)))
        }
        Method::Texler | Method::Sun => {
            let all = single_lamps(calibration.rig.lamps.len());
            // Sorted by name, which is the order of `lamps`.
            let named = |(place, &lamp): (usize, &usize)| (format!("{place:04}"), all[lamp].clone());
            let lights = lamps.iter().enumerate().map(named).collect();
            let effort = Effort {
                minutes: learning_minutes(project, settings.minutes),
                steps: None,
                seed: project.settings.seed,
            };
            let from = (project, calibration);
            let learn = || Learnt::learn(method, from, &lights, false, &effort, compute, progress);
            Ok(Maker::Learnt(Box::new(compute.guarded(learn)?)))
        }
        _ => Err(Error::invalid(
            "the true OLATs exist for single frames, not for a clip",
            "Compare other methods: --with network,texler,sun",
        )),
    }
}

/// `count` consecutive frames from the middle of the interview.
fn middle(all: usize, wished: usize) -> Range<usize> {
    let count = wished.min(all);
    let first = (all - count) / 2;
    first..first + count
}

/// The named lamps, or else some spread over those that light more than the subject's rim.
fn lamps(
    project: &Project,
    calibration: &Calibration,
    settings: &BlindSettings,
    exemplar: &Exemplar,
) -> Result<Vec<usize>> {
    let names = &project.settings.shoot.lamps;
    if let Some(wanted) = &settings.lamps {
        let place = |wanted: &String| {
            let place = names.iter().position(|name| name == wanted);
            place.ok_or_else(|| {
                Error::missing(
                    format!("the project has no lamp {wanted}"),
                    format!("Choose among {}", names.join(", ")),
                )
            })
        };
        let mut lamps: Vec<usize> = wanted.iter().map(place).collect::<Result<_>>()?;
        lamps.sort_unstable();
        lamps.dedup();
        return Ok(lamps);
    }
    let level = |lamp: usize| 1.0 / display_gain([&exemplar.olats[lamp]].into_iter(), &exemplar.mask);
    let usable = |lamp: &usize| calibration.rig.lamps[*lamp].is_usable();
    let levels: Vec<(usize, f32)> = ((0..names.len()).filter(usable)).map(|lamp| (lamp, level(lamp))).collect();
    let most = levels.iter().map(|(_, level)| *level).fold(0.0, f32::max);
    let front: Vec<usize> =
        (levels.iter()).filter(|(_, level)| *level >= FRONT * most).map(|(lamp, _)| *lamp).collect();
    let directions: Vec<_> =
        (front.iter()).map(|&lamp| calibration.rig.lamps[lamp].direction.normalize_or_zero()).collect();
    let chosen = subset::choose(&directions, settings.conditions.min(front.len()))?;
    Ok(chosen.indices.into_iter().map(|i| front[i]).collect())
}

/// A linear picture over black as a JPEG of at most [`SIDE_PX`] pixels a side.
fn jpeg(picture: &Image, mask: &Mask, gain: f32) -> Result<Vec<u8>> {
    let shown = display_picture(picture, mask, gain);
    let (width, height) = shown.0.size();
    let longest = width.max(height);
    if longest <= SIDE_PX {
        return jpeg_bytes(&shown, QUALITY);
    }
    let reduce = |length: usize| (length * SIDE_PX / longest).max(1);
    // Averaging codes is good enough for a picture that is only viewed.
    let small = resize_area(&shown.0, reduce(width), reduce(height));
    jpeg_bytes(&Encoded(small), QUALITY)
}
