//! Measurement of one rung: time per frame, and distance from the truth.

use super::judge::{Case, Judge, Lit};
use super::ladder::{Rung, Show};
use base::error::{Error, Result};
use base::progress::Progress;
use calibration::Calibration;
use compositor::reference::extend_edges;
use compositor::{EnvironmentLight, Extra, Field, FieldEncoder, Identity, Ingredients, Picture, Series, Upstream};
use evaluation::flicker;
use evaluation::metrics::{Compared, encoded, psnr};
use evaluation::{Fidelity, at_plate, at_truths_size, fidelity};
use gpu::ComputeDevice;
use imaging::{Encoded, Image, Mask};
use light::weights::Partition;
use light::{Environment, Lighting};
use project::Project;
use reflectance::{DeviceField, LampBasis};
use scene::{Background, Effects, Output, Scene};
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::time::{Duration, Instant};
use training::features::Lpips;
use transfer::{FineField, OlatPredictor};

/// Fewest and most timed frames, and the time limit.
const TIMED: std::ops::RangeInclusive<usize> = 3..=15;
const TIMED_FOR: Duration = Duration::from_secs(6);
/// Rotation of the light between timed frames, in degrees.
const TURN_DEG: f32 = 7.0;

/// Cost of a rung.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// Milliseconds per frame: prediction, weights, picture.
    pub frame_ms: f64,
    /// Bytes of the exemplars, the network's weights and one frame's OLATs.
    pub memory_bytes: u64,
    /// Bytes of the checkpoint, including the training state.
    pub disk_bytes: u64,
}

/// Times of a frame in milliseconds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    pub median: f64,
    /// 10th and 90th percentiles.
    pub low: f64,
    pub high: f64,
    /// Number of timed frames.
    pub count: usize,
}

impl Spread {
    /// Scales the times by `factor`.
    #[must_use]
    pub(crate) fn times(self, factor: f64) -> Self {
        Self { median: factor * self.median, low: factor * self.low, high: factor * self.high, ..self }
    }

    fn from_times(mut times: Vec<f64>) -> Self {
        times.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| {
            let last = times.len().saturating_sub(1) as f64;
            times.get((share * last).round() as usize).copied().unwrap_or(0.0)
        };
        Self { median: at(0.5), low: at(0.1), high: at(0.9), count: times.len() }
    }
}

/// A measured rung.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Measured {
    pub rung: Rung,
    pub seed: u64,
    /// Cost predicted before the measurement, from the base's cost and the networks' shapes.
    pub predicted: Option<Cost>,
    pub cost: Cost,
    /// Frame times on a quiet machine: [`Self::timed`], less the slowdown of the base that was timed in turn.
    pub frame: Spread,
    /// Prediction's part of the median.
    pub predict_ms: f64,
    /// Frame times as measured, in turn with the base's.
    pub timed: Spread,
    /// Median of the base's times in turn.
    pub base_ms: f64,
    pub training_seconds: f64,
    pub steps: u64,
    /// Means over frames and environments.
    pub fidelity: Fidelity,
    /// Environment and PSNR in decibels.
    pub relit_psnr_db: Vec<(String, f64)>,
    /// PSNR of the OLATs, if the rung predicts the project's lamps and their truth is known.
    pub olat_psnr_db: Option<f64>,
    /// Change by the effects: PSNR of the codes against those without effects, in decibels.
    pub changes_db: Option<f64>,
    /// Flicker beyond the interview's own over consecutive frames, in per cent.
    pub flicker: Option<f64>,
    /// Device of the network.
    pub device: String,
    /// Build of the measuring program; empty in ladders of older versions.
    #[serde(default)]
    pub build: String,
    /// Picture of the first frame under the first environment, in the folder `pictures`.
    pub picture: String,
}

impl Measured {
    /// Error for plots: root mean square difference of the codes, 0 to 1.
    pub fn error(&self) -> f64 {
        10f64.powf(-self.fidelity.psnr_db / 20.0)
    }
}

/// Prediction to measure: exemplars, and their network if trained.
pub struct Trained {
    pub variant: Project,
    pub calibration: Calibration,
    pub predictor: OlatPredictor,
}

/// Stores predictions as the rung does.
enum Keeper {
    Storage(FieldEncoder),
    /// Components are derived from the first frame.
    Components(usize, Option<LampBasis>),
}

impl Keeper {
    fn new(show: &Show) -> Self {
        match show.components {
            Some(count) => Self::Components(count, None),
            None => Self::Storage(FieldEncoder::new(show.storage)),
        }
    }

    fn keep(&mut self, predicted: DeviceField, compute: &ComputeDevice) -> Result<Field> {
        match self {
            Self::Storage(encoder) => encoder.encode(predicted, compute.passes()),
            Self::Components(count, basis) => {
                let field = predicted.read()?;
                if basis.is_none() {
                    *basis = LampBasis::from_fields(&[&field]);
                }
                let kept = basis.as_ref().and_then(|basis| basis.compress(&field, *count));
                let kept = kept.ok_or_else(|| Error::bug("a field does not fit its own components"))?;
                Ok(kept.into())
            }
        }
    }
}

/// Results of a rung.
pub struct Found {
    pub timed: Spread,
    pub base_ms: f64,
    /// Prediction's part of the median.
    pub predict_ms: f64,
    pub field_bytes: u64,
    pub fidelity: Fidelity,
    pub relit_psnr_db: Vec<(String, f64)>,
    pub olat_psnr_db: Option<f64>,
    pub changes_db: Option<f64>,
    pub flicker: Option<f64>,
    /// The first frame under the first environment at the compared size, and its truth.
    pub picture: Encoded,
    pub truth: Encoded,
}

/// Measures a rung; its times are taken in turn with the base's.
///
/// # Errors
/// When a picture cannot be read, the device fails, or the user stops it.
pub fn measure(
    rung: &Rung,
    trained: &Trained,
    base: &Trained,
    compute: &ComputeDevice,
    judge: &Judge,
    lpips: Option<&Lpips>,
    progress: &Progress,
) -> Result<Found> {
    let show = &rung.show;
    let lit: Vec<Lit> = judge.lit.iter().map(|lit| reduced(lit, show)).collect();
    let partition = Partition::new(show.weighting, &trained.calibration.rig);
    let weights = lit.iter().map(|lit| partition.weights(&lit.environment, lit.yaw_deg).per_lamp);
    let weights: Vec<Vec<[f32; 3]>> = weights.collect();
    let mut keeper = Keeper::new(show);
    let mut relit: Vec<Vec<Pair>> = lit.iter().map(|_| Vec::new()).collect();
    let mut olats: Vec<Pair> = Vec::new();
    let mut field_bytes = 0;
    let mut timed = None;
    for index in 0..judge.count() {
        progress.check("Earlier measurements are kept")?;
        let (case, predicted) = predicted_case(trained, judge, index)?;
        let field = keeper.keep(predicted, compute)?;
        field_bytes = field.bytes() as u64;
        for (number, weights) in weights.iter().enumerate() {
            let at = (case.plate.as_ref(), &case.frame.mask);
            let picture = at_plate(field.relight(weights)?, at, weights);
            relit[number].push(Pair::new(&case, vec![picture], vec![judge.relit(index, number).clone()]));
        }
        if let Some(truths) = judge.olats(index).filter(|truths| truths.len() == field.lamps()) {
            let alone = |lamp: usize| {
                let mut weights = vec![[0.0; 3]; field.lamps()];
                weights[lamp] = [1.0; 3];
                let picture = field.relight(&weights)?;
                Ok(at_plate(picture, (case.plate.as_ref(), &case.frame.mask), &weights))
            };
            let pictures = (0..field.lamps()).map(alone).collect::<Result<_>>()?;
            olats.push(Pair::new(&case, pictures, truths.to_vec()));
        }
        if index == 0 {
            let (bases, _) = predicted_case(base, judge, index)?;
            let plain = Show::default();
            let mut timers = [
                Timer::new(show, trained, compute, &case, &lit[0]),
                Timer::new(&plain, base, compute, &bases, &judge.lit[0]),
            ];
            timed = Some(time(&mut timers, progress)?);
        }
    }
    let found = flicker::clip_flicker(
        &trained.variant,
        &trained.calibration,
        (&lit[0].environment, lit[0].yaw_deg),
        flicker::middle(&trained.variant),
        &mut |frame| trained.predictor.predict(frame),
        progress,
    );
    let flicker = flicker::if_possible(found, progress)?;
    let timed = timed.ok_or_else(|| Error::bug("there was nothing to compare"))?;
    let distance = lpips.map(|lpips| |truth: &Encoded, picture: &Encoded| lpips.distance(truth, picture));
    let mut all = Fidelity::default();
    let mut relit_psnr_db = Vec::new();
    for (lit, pairs) in lit.iter().zip(&relit) {
        let compared: Vec<Compared> = pairs.iter().map(Pair::compared).collect();
        let found = fidelity(&compared, distance.as_ref().map(|d| d as _))?;
        relit_psnr_db.push((lit.name.clone(), found.psnr_db));
        let share = 1.0 / relit.len() as f64;
        all.psnr_db += share * found.psnr_db;
        all.ssim += share * found.ssim;
        all.flip += share * found.flip;
        all.lpips = found.lpips.map(|found| all.lpips.unwrap_or(0.0) + share * found);
    }
    let compared: Vec<Compared> = olats.iter().map(Pair::compared).collect();
    let olat_psnr_db = (!compared.is_empty()).then(|| psnr(&compared).map(|found| found.mean_db)).transpose()?;
    let [picture, truth] = shown(&relit[0])?;
    Ok(Found {
        timed: timed.frame,
        base_ms: timed.base_ms,
        predict_ms: timed.predict_ms,
        field_bytes,
        fidelity: all,
        relit_psnr_db,
        olat_psnr_db,
        changes_db: timed.changes_db,
        flicker: flicker.map(|found| found.plain.beyond),
        picture,
        truth,
    })
}

/// The environment at the rung's size.
fn reduced(lit: &Lit, show: &Show) -> Lit {
    let columns = show.environment_columns.filter(|&columns| columns < lit.environment.radiance.width);
    Lit {
        name: lit.name.clone(),
        environment: columns.map_or_else(
            || lit.environment.clone(),
            |columns| Arc::new(Environment::reduced(&lit.environment, columns)),
        ),
        yaw_deg: lit.yaw_deg,
    }
}

/// Pictures of a frame beside their truths.
struct Pair {
    mask: Mask,
    pictures: Vec<Image>,
    truths: Vec<Image>,
}

impl Pair {
    fn new(case: &Case, mut pictures: Vec<Image>, truths: Vec<Image>) -> Self {
        let mut mask = case.matte().clone();
        if let Some(truth) = truths.first() {
            at_truths_size(&mut pictures, &mut mask, truth.size());
        }
        Self { mask, pictures, truths }
    }

    fn compared(&self) -> Compared<'_> {
        Compared { pictures: &self.pictures, truths: &self.truths, mask: &self.mask }
    }
}

/// First frame of an environment at the compared size, and its truth.
fn shown(pairs: &[Pair]) -> Result<[Encoded; 2]> {
    let compared: Vec<Compared> = pairs.iter().map(Pair::compared).collect();
    let scale = psnr(&compared)?.scale;
    let first = &pairs[0];
    let exposure = compared[0].exposure();
    let mut picture = first.pictures[0].clone();
    extend_edges(&mut picture, &first.mask);
    Ok([
        encoded(&picture, &first.mask, (exposure * scale) as f32),
        encoded(&first.truths[0], &first.mask, exposure as f32),
    ])
}

/// A case whose plate has the exemplars' fine light, and its prediction.
fn predicted_case(trained: &Trained, judge: &Judge, index: usize) -> Result<(Case, DeviceField)> {
    let case = judge.case(&trained.variant, &trained.calibration, index)?;
    let (predicted, fine) = trained.predictor.predict_fine(&case.frame)?;
    let plate = case.plate.map(|plate| FineField::on(fine, plate));
    Ok((Case { plate, ..case }, predicted))
}

/// Results of timing.
struct Timed {
    frame: Spread,
    base_ms: f64,
    predict_ms: f64,
    changes_db: Option<f64>,
}

/// A picture with its time and that of its prediction.
struct TimedPicture {
    whole_ms: f64,
    predict_ms: f64,
    picture: Picture,
}

/// Renders one picture after another, from the plate on, turning the light each time as in a turntable export.
struct Timer<'a> {
    show: &'a Show,
    trained: &'a Trained,
    compute: &'a ComputeDevice,
    case: &'a Case,
    lit: &'a Lit,
    keeper: Keeper,
    series: Series,
    light: Option<EnvironmentLight>,
    /// Rendered pictures.
    turn: usize,
}

impl<'a> Timer<'a> {
    fn new(show: &'a Show, trained: &'a Trained, compute: &'a ComputeDevice, case: &'a Case, lit: &'a Lit) -> Self {
        Self {
            show,
            trained,
            compute,
            case,
            lit,
            keeper: Keeper::new(show),
            series: Series::default(),
            light: None,
            turn: 0,
        }
    }

    /// Next picture with these effects.
    fn picture(&mut self, effects: Effects) -> Result<TimedPicture> {
        let frame = &self.case.frame;
        let scene = Scene {
            yaw_deg: self.lit.yaw_deg + TURN_DEG * self.turn as f32,
            lighting: Lighting { weighting: self.show.weighting, ..Lighting::default() },
            background: Background::Environment,
            output: Output::Display,
            effects,
            ..Scene::default()
        };
        let started = Instant::now();
        let predicted = self.trained.predictor.predict_on_device(frame)?;
        let field = self.keeper.keep(predicted, self.compute)?;
        let predict_ms = started.elapsed().as_secs_f64() * 1e3;
        let (light, _) = EnvironmentLight::update(
            &mut self.light,
            &self.lit.environment,
            &self.trained.calibration.rig,
            &scene,
            (&field, &frame.mask),
        )?;
        let ingredients = Ingredients {
            upstream: Upstream::default(),
            extra: Extra {
                plate: self.case.plate.as_ref(),
                identity: Identity { frame: self.turn as u64, ..Identity::default() },
                ..Extra::default()
            },
            ..light.on(&field, &frame.mask)
        };
        let picture = self.series.compose(&scene, (&frame.plate, &frame.mask), &ingredients)?;
        self.turn += 1;
        let whole_ms = started.elapsed().as_secs_f64() * 1e3;
        Ok(TimedPicture { whole_ms, predict_ms, picture })
    }
}

/// Times a rung and the base in turn, so that other work on the machine slows both.
fn time([rung, base]: &mut [Timer; 2], progress: &Progress) -> Result<Timed> {
    let effects = rung.show.effects;
    // The first picture warms up; two under the same light show the change by the effects.
    let with = rung.picture(effects)?.picture;
    let changes_db = if effects == Effects::default() {
        None
    } else {
        rung.turn = 0;
        let without = rung.picture(Effects::default())?.picture;
        change(&with, &without)
    };
    base.picture(Effects::default())?;
    let (mut times, mut predictions, mut bases) = (Vec::new(), Vec::new(), Vec::new());
    let began = Instant::now();
    while times.len() < *TIMED.end() && (times.len() < *TIMED.start() || began.elapsed() < TIMED_FOR) {
        progress.check("Earlier measurements are kept")?;
        let timed = rung.picture(effects)?;
        times.push(timed.whole_ms);
        predictions.push(timed.predict_ms);
        bases.push(base.picture(Effects::default())?.whole_ms);
    }
    Ok(Timed {
        frame: Spread::from_times(times),
        base_ms: Spread::from_times(bases).median,
        predict_ms: Spread::from_times(predictions).median,
        changes_db,
    })
}

/// Difference between the codes of two pictures, as PSNR in decibels; 120 for equal pictures.
fn change(a: &Picture, b: &Picture) -> Option<f64> {
    let (a, b) = (a.display.as_ref()?, b.display.as_ref()?);
    let pairs = a.0.pixels.iter().flatten().zip(b.0.pixels.iter().flatten());
    let squares: f64 = pairs.map(|(a, b)| f64::from(a - b).powi(2)).sum();
    let mean = squares / (3 * a.0.pixels.len()).max(1) as f64;
    Some((-10.0 * mean.log10()).min(evaluation::metrics::MAX_DECIBELS))
}
