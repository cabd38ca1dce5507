//! Time of each pass beside the least that memory allows.
//!
//! Whole pictures are rendered repeatedly from scenes that together need every pass. Each pass is timed as the program
//! itself times it: by wall clock on the CPU, by the GPU's own clock on a GPU, including the check of whether the pass
//! is needed. The limit is the time in which the same device copies as many bytes as the pass must read and write: its
//! pictures, its matte and its field, once each.

use super::budget::{Budget, Spread};
use super::data::{field as noise_field, from_centre, matte};
use base::error::{Error, Result};
use compositor::reference::{lit_lamps, relight, relight_compressed, relight_half};
use compositor::{Extra, Field, Grain, Ingredients, Pass, PassReport, Steady, compose};
use gpu::{ComputeDevice, Gpu};
use imaging::{Encoded, Image, Mask};
use light::{Environment, LightWeights};
use rayon::prelude::*;
use reflectance::{FieldBuffer, HalfField, LampBasis, ReflectanceField};
use scene::{Background, Channel, Effects, Inspection, Output, Scene, ViewTransform};
use serde::Serialize;
use std::hint::black_box;

/// The sum of lamps of an f16 field on a GPU; `relight` is the sum of an f32 field.
pub const HALF_SUM: &str = "relight, f16";

/// Components of the compressed field.
const COMPONENTS: usize = 36;

/// Times of one pass.
#[derive(Clone, Debug, Serialize)]
pub struct PassTimes {
    pub name: String,
    /// None if the device has no clock for it.
    pub times: Option<Spread>,
    /// Time in which the device copies the bytes that the pass reads and writes.
    pub copy_ms: Option<f64>,
}

/// All passes of one device at one size.
#[derive(Clone, Debug, Serialize)]
pub struct PassTable {
    /// Bytes copied per second, counting reads and writes.
    pub copied_per_second: f64,
    /// On a CPU, first the sum of lamps alone for each kind of field. Then every pass, plus the sum of an f16 field on
    /// a GPU, then the whole picture.
    pub passes: Vec<PassTimes>,
}

/// Receiver of each pass as soon as it is timed, and of the device's copy speed in bytes per second. An error ends the
/// timing.
pub type TellPass<'a> = &'a mut dyn FnMut(&PassTimes, f64) -> Result<()>;

/// Times every pass on a device at `size × size` pixels, the sum of lamps first.
///
/// # Errors
/// When the device fails, or its shaders cannot read a field of this size.
pub fn passes(size: usize, lamps: usize, compute: &ComputeDevice, budget: Budget, tell: TellPass) -> Result<PassTable> {
    let mut shoot = Shoot::new(size, lamps)?;
    let full = shoot.field.take().ok_or_else(|| Error::bug("there is no field"))?;
    let mut passes = Vec::new();
    let field_bytes = size_of_val(&full.values[..]);
    let (field, copied_per_second) = match &compute.gpu {
        Some(gpu) => {
            check_binding(field_bytes as u64, gpu)?;
            let copied = gpu.copied_per_second();
            let buffer = FieldBuffer::upload(&full, &gpu.device);
            (Field::Gpu(buffer, gpu.passes.clone()), copied)
        }
        None => {
            let copied = copied_by_memory(field_bytes, budget)?;
            let mut summed = |pass: PassTimes| {
                tell(&pass, copied)?;
                passes.push(pass);
                Ok(())
            };
            sums(size, &full, &shoot, budget, copied, &mut summed)?;
            (Field::Memory(full), copied)
        }
    };
    let copy_ms = |needs: &Needs| {
        let bytes = needs.bytes(size, lamps, compute.gpu.is_some());
        Some(1e3 * bytes / copied_per_second)
    };
    let mut whole = None;
    for (at, scene) in scenes().into_iter().enumerate() {
        shoot.before = Some(shoot.steady(&field)?);
        let (pictures, wholes) = shoot.timed(&scene, &field, budget)?;
        whole.get_or_insert_with(|| Spread::from_times(wholes));
        for (index, pass) in Pass::ALL.into_iter().enumerate() {
            let report = &pictures[0][index];
            let fresh = passes.iter().all(|known: &PassTimes| known.name != report.name);
            let Some(needs) = needs(pass).filter(|_| fresh && report.ran) else { continue };
            let timed =
                PassTimes { name: report.name.clone(), times: spread(&pictures, index), copy_ms: copy_ms(&needs) };
            tell(&timed, copied_per_second)?;
            passes.push(timed);
        }
        if let (0, Field::Gpu(full, on_gpu)) = (at, &field) {
            let half = Field::Gpu(on_gpu.relight.halve(full)?, on_gpu.clone());
            shoot.before = Some(shoot.steady(&half)?);
            let (pictures, _) = shoot.timed(&scene, &half, budget)?;
            let sum = Pass::ALL.iter().position(|&pass| pass == Pass::Relight);
            let needs = needs(Pass::Relight).map(|needs| Needs { fields: 0.5, ..needs });
            let timed = PassTimes {
                name: HALF_SUM.to_owned(),
                times: sum.and_then(|sum| spread(&pictures, sum)),
                copy_ms: needs.as_ref().and_then(copy_ms),
            };
            tell(&timed, copied_per_second)?;
            passes.push(timed);
        }
    }
    let timed = PassTimes { name: "whole picture".into(), times: whole, copy_ms: None };
    tell(&timed, copied_per_second)?;
    passes.push(timed);
    Ok(PassTable { copied_per_second, passes })
}

/// Times of one pass in several pictures.
fn spread(pictures: &[Vec<PassReport>], index: usize) -> Option<Spread> {
    let times: Vec<f64> = (pictures.iter()).filter_map(|passes| passes[index].ms).collect();
    (!times.is_empty()).then(|| Spread::from_times(times))
}

/// Refuses a field that no shader of this GPU can read.
fn check_binding(bytes: u64, gpu: &Gpu) -> Result<()> {
    let largest = gpu.device.limits().max_storage_buffer_binding_size;
    if bytes <= largest {
        return Ok(());
    }
    Err(Error::device(
        format!(
            "a frame's OLATs take {} MB at this size, and a shader of this GPU reads {} MB at most",
            bytes / 1_000_000,
            largest / 1_000_000
        ),
        "Pictures of this size are made on the CPU",
    ))
}

/// The sum of lamps from each kind of field in memory.
fn sums(
    size: usize,
    full: &ReflectanceField,
    shoot: &Shoot,
    budget: Budget,
    copied: f64,
    found: &mut dyn FnMut(PassTimes) -> Result<()>,
) -> Result<()> {
    let weights = &shoot.weights.per_lamp;
    let lit = lit_lamps(weights);
    let mut timed = |name: &str, bytes: usize, sum: &dyn Fn() -> Image| {
        sum();
        found(PassTimes {
            name: name.to_owned(),
            times: Some(Spread::from_times(budget.time(|| Ok(sum()))?)),
            copy_ms: Some(1e3 * (bytes + 12 * size * size) as f64 / copied),
        })
    };
    timed("sum, f32", size_of_val(&full.values[..]), &|| relight(full, weights, &lit))?;
    let half = HalfField::from(full);
    timed("sum, f16", size_of_val(half.values()), &|| relight_half(&half, weights, &lit))?;
    // Any basis of the right size will do: only the number of components affects the time.
    let part = noise_field(32, full.lamps);
    let few = LampBasis::from_fields(&[&part])
        .and_then(|basis| basis.compress(full, COMPONENTS.min(basis.len())))
        .ok_or_else(|| Error::bug("a field has no components"))?;
    timed("sum, compressed", few.bytes(), &|| relight_compressed(&few, weights))
}

/// Smallest number of pictures, mattes and fields that a pass reads and writes.
struct Needs {
    /// Pictures, read or written.
    pictures: f64,
    mattes: f64,
    fields: f64,
}

/// None for work done before the compositor.
fn needs(pass: Pass) -> Option<Needs> {
    let (pictures, mattes, fields) = match pass {
        Pass::Predict | Pass::Weights => return None,
        Pass::Smoothing => (0.0, 1.0, 1.0),
        Pass::Relight => (1.0, 1.0, 1.0),
        Pass::Despill => (2.0, 1.0, 0.0),
        // The background is drawn in full.
        Pass::Background => (1.0, 0.0, 0.0),
        Pass::LightWrap => (3.0, 1.0, 0.0),
        Pass::Difference => (3.0, 0.0, 0.0),
        Pass::Grain | Pass::Dither => (2.0, 1.0, 0.0),
        // Copied from one picture to another.
        _ => (2.0, 0.0, 0.0),
    };
    Some(Needs { pictures, mattes, fields })
}

impl Needs {
    /// Bytes for pictures of this size.
    fn bytes(&self, size: usize, lamps: usize, on_gpu: bool) -> f64 {
        // A matte is the fourth channel of a picture here.
        let (light, matte) = if on_gpu { (16.0, 0.0) } else { (12.0, 4.0) };
        let field = self.fields * 12.0 * lamps as f64;
        (size * size) as f64 * (self.pictures * light + self.mattes * matte + field)
    }
}

/// Scenes that together need every pass; the first covers what most pictures need.
fn scenes() -> Vec<Scene> {
    let scene = |inspection, background_blur| Scene {
        frame: 1,
        exposure_stops: 0.3,
        background: Background::Environment,
        output: Output::Display,
        effects: Effects {
            smoothing: 0.8,
            despill: 1.0,
            background_blur,
            light_wrap: 0.6,
            view: ViewTransform::Filmic,
            grain: 1.0,
            inspection,
            ..Effects::all(0.3)
        },
        ..Scene::default()
    };
    vec![
        scene(Inspection::Picture, 0.01),
        scene(Inspection::Channel(Channel::Luminance), 0.01),
        scene(Inspection::Difference { gain: 2.0 }, 0.01),
        scene(Inspection::FalseColor, 0.01),
    ]
}

/// A subject with green spill at its edge before a bright window.
struct Shoot {
    field: Option<ReflectanceField>,
    mask: Mask,
    weights: LightWeights,
    environment: Environment,
    plate: Grain,
    second: Encoded,
    before: Option<Steady>,
}

impl Shoot {
    fn new(size: usize, lamps: usize) -> Result<Self> {
        let mut field = noise_field(size, lamps);
        let plane = size * size;
        field.values.par_chunks_mut(plane).enumerate().for_each(|(i, values)| {
            let screen = if i % 3 == 1 { 3.0 } else { 0.0 };
            for (at, value) in values.iter_mut().enumerate() {
                *value += screen * (from_centre(size, at % size, at / size) - 0.62).max(0.0);
            }
        });
        Ok(Self {
            field: Some(field),
            mask: matte(size),
            weights: LightWeights {
                per_lamp: (0..lamps).map(|l| [0.02, 0.03, 0.01 + 0.0005 * l as f32]).collect(),
                uncovered: 0.0,
            },
            environment: Environment {
                name: "window".into(),
                radiance: Image::from_fn(1024, 512, |x, y| {
                    let window = (480..544).contains(&x) && (200..264).contains(&y);
                    [if window { 12.0 } else { 0.3 }, 0.3, 0.001 * (x + y) as f32]
                }),
                repaired_texels: 0,
            },
            plate: Grain { deviation: [[0.2; 3]; 8] },
            second: Encoded(Image::filled(size, size, [0.5; 3])),
            before: None,
        })
    }

    fn ingredients<'a>(&'a self, field: &'a Field) -> Ingredients<'a> {
        Ingredients {
            extra: Extra {
                before: self.before.as_ref(),
                grain: Some(&self.plate),
                second: Some(&self.second),
                ..Extra::default()
            },
            ..Ingredients::new(field, &self.mask, &self.weights, &self.environment)
        }
    }

    /// Smoothing state left by a darker frame.
    fn steady(&self, field: &Field) -> Result<Steady> {
        let first = Scene { frame: 0, ..scenes().remove(0) };
        let steady = compose(&first, &self.ingredients(field))?.steady;
        let mut steady = steady.ok_or_else(|| Error::bug("a scene with smoothing hands on nothing"))?;
        // As if that frame's light had been held back.
        steady.gain = [1.04; 3];
        Ok(steady)
    }

    /// Renders pictures within the budget, after one that warms up. Returns the times of each pass and the milliseconds
    /// of each picture.
    fn timed(&self, scene: &Scene, field: &Field, budget: Budget) -> Result<Made> {
        let ingredients = self.ingredients(field);
        compose(scene, &ingredients)?;
        let mut pictures = Vec::new();
        let times = budget.time(|| {
            pictures.push(compose(scene, &ingredients)?.passes);
            Ok(())
        })?;
        Ok((pictures, times))
    }
}

type Made = (Vec<Vec<PassReport>>, Vec<f64>);

/// Bytes read and written per second by all threads copying a block of this size.
///
/// # Errors
/// None: copying cannot fail.
pub fn copied_by_memory(bytes: usize, budget: Budget) -> Result<f64> {
    let source = vec![1u64; bytes / 8];
    let mut target = vec![0u64; bytes / 8];
    let mut copy = || {
        let chunks = target.par_chunks_mut(1 << 15).zip(source.par_chunks(1 << 15));
        chunks.for_each(|(target, source)| target.copy_from_slice(source));
        black_box(&mut target);
        Ok(())
    };
    copy()?;
    let times = Spread::from_times(budget.time(copy)?);
    Ok(2e3 * bytes as f64 / times.median_ms)
}
