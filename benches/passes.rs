//! What each pass costs beside what memory allows: `cargo bench --profile dev --bench passes`. It prints a
//! table; `docs/accuracy.md` holds one.
//!
//! Whole pictures are made, again and again, of scenes that together ask for every pass, and each pass is
//! timed as the program itself times it: on the CPU by the wall, on a GPU by its own clock, measuring
//! whether the pass is called for included. The limit is the time in which the same device copies as many
//! bytes as the pass has to read and to write at least: its pictures, its matte and its field, once.

use afterlight::compositor::reference::{lit_lamps, relight, relight_compressed, relight_half};
use afterlight::compositor::{
    CameraView, Extra, Field, Grain, Ingredients, Levels, Pass, PassReport, Steady, Upstream,
    compose,
};
use afterlight::gpu::{ComputeDevice, DeviceChoice};
use afterlight::imaging::{Encoded, Image, Mask};
use afterlight::light::{Environment, LightWeights};
use afterlight::memory::keep_freed;
use afterlight::reflectance::{FieldBuffer, HalfField, LampBasis, ReflectanceField};
use afterlight::scene::{Background, Channel, Effects, Inspection, Output, Scene, ViewTransform};
use clap::Parser;
use rayon::prelude::*;
use std::error::Error;
use std::hint::black_box;
use std::time::Instant;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// Components of the compressed field.
const COMPONENTS: usize = 36;

/// Times every pass.
#[derive(Parser)]
struct Options {
    /// Widths and heights of the pictures.
    #[arg(long, value_delimiter = ',', default_values_t = [512, 1024])]
    size: Vec<usize>,
    #[arg(long, default_value_t = 41)]
    lamps: usize,
    /// Threads; 0 takes all that the processor has.
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Pictures of each scene.
    #[arg(long, default_value_t = 15)]
    rounds: usize,
    /// Take a software GPU if there is no other.
    #[arg(long)]
    software: bool,
    /// What cargo passes to benches.
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> Result<()> {
    keep_freed();
    let options = Options::parse();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(options.threads);
    pool.build_global()?;
    let compute = ComputeDevice::choose(match options.software {
        true => DeviceChoice::Gpu,
        false => DeviceChoice::Auto,
    });
    println!(
        "{} threads; {}; median milliseconds.\n",
        rayon::current_num_threads(),
        compute.description
    );
    println!("| size | pass | CPU, ms | limit, ms | times | GPU, ms | limit, ms | times |");
    println!("|---:|---|---:|---:|---:|---:|---:|---:|");
    for &size in &options.size {
        race(size, &options, &compute)?;
    }
    Ok(())
}

/// Times one size and prints its rows.
fn race(size: usize, options: &Options, compute: &ComputeDevice) -> Result<()> {
    let mut shoot = Shoot::new(size, options.lamps)?;
    let full = shoot.field.take().ok_or("there is a field")?;
    let pixels = (size * size) as f64;
    let copied = copied_by_memory(size * size * 12 * options.lamps, options.rounds);
    println!(
        "| {size} | copying, GB/s | {:.1} | | | {} | | |",
        copied / 1e6,
        {
            let gpu = compute.gpu.as_ref();
            gpu.map_or("–".into(), |gpu| {
                format!("{:.1}", copied_by_gpu(gpu) / 1e6)
            })
        }
    );
    sums(size, &full, &shoot, options, copied)?;
    let bytes = size_of_val(&full.values[..]) as u64;
    let gpu = compute.gpu.as_ref();
    let gpu = gpu.filter(|gpu| bytes <= gpu.device.limits().max_storage_buffer_binding_size);
    let on_gpu = gpu.map(|gpu| {
        let field = FieldBuffer::upload(&full, &gpu.device);
        (Field::Gpu(field, gpu.passes.clone()), copied_by_gpu(gpu))
    });
    let in_memory = Field::Memory(full);
    let mut rows: Vec<Row> = Vec::new();
    for scene in scenes() {
        shoot.before = Some(shoot.steady(&in_memory)?);
        let here = shoot.timed(&scene, &in_memory, options.rounds)?;
        let there = match &on_gpu {
            Some((field, _)) => Some(shoot.timed(&scene, field, options.rounds)?),
            None => None,
        };
        for (index, pass) in Pass::ALL.into_iter().enumerate() {
            let fresh = rows.iter().all(|row| row.name != here.passes[index].name);
            if fresh && here.passes[index].ran && needs(pass).is_some() {
                rows.push(Row {
                    name: here.passes[index].name.clone(),
                    needs: needs(pass),
                    here: here.passes[index].ms,
                    there: there.as_ref().and_then(|there| there.passes[index].ms),
                });
            }
        }
        if rows.iter().all(|row| row.name != "whole picture") {
            rows.push(Row {
                name: "whole picture".into(),
                needs: None,
                here: Some(here.whole),
                there: there.map(|there| there.whole),
            });
        }
    }
    for row in rows {
        let bytes = |light: f64, matte: f64| {
            let needs = row.needs.as_ref()?;
            let field = needs.fields * 12.0 * options.lamps as f64;
            Some(pixels * (needs.pictures * light + needs.mattes * matte + field))
        };
        let limits = [
            bytes(12.0, 4.0).map(|bytes| bytes / copied),
            // A matte is the fourth value of a picture there.
            bytes(16.0, 0.0).and_then(|bytes| Some(bytes / on_gpu.as_ref()?.1)),
        ];
        let cells: Vec<String> = [row.here, row.there]
            .into_iter()
            .zip(limits)
            .flat_map(|(ms, limit)| [ms, limit, ms.zip(limit).map(|(ms, limit)| ms / limit)])
            .map(|value| value.map_or("–".into(), |value| format!("{value:.2}")))
            .collect();
        println!("| {size} | {} | {} |", row.name, cells.join(" | "));
    }
    Ok(())
}

/// The sum of lamps from each kind of field in memory.
fn sums(
    size: usize,
    full: &ReflectanceField,
    shoot: &Shoot,
    options: &Options,
    copied: f64,
) -> Result<()> {
    let weights = &shoot.weights.per_lamp;
    let lit = lit_lamps(weights);
    let half = HalfField::from(full);
    // The basis of a part is a basis: only the number of components matters here.
    let part = noise_field(32, options.lamps);
    let basis = LampBasis::of(&[&part]).ok_or("a field has one number of lamps")?;
    let few = basis.compress(full, COMPONENTS.min(basis.len()));
    let few = few.ok_or("a field has its own lamps")?;
    let timed = |sum: &dyn Fn() -> Image| {
        median((0..=options.rounds).map(|_| {
            let start = Instant::now();
            black_box(sum());
            start.elapsed().as_secs_f64() * 1e3
        }))
    };
    let rows = [
        (
            "sum, f32",
            size_of_val(&full.values[..]),
            timed(&|| relight(full, weights, &lit)),
        ),
        (
            "sum, f16",
            size_of_val(half.values()),
            timed(&|| relight_half(&half, weights, &lit)),
        ),
        (
            "sum, compressed",
            few.bytes(),
            timed(&|| relight_compressed(&few, weights)),
        ),
    ];
    for (name, bytes, ms) in rows {
        let limit = (bytes + 12 * size * size) as f64 / copied;
        println!(
            "| {size} | {name} | {ms:.2} | {limit:.2} | {:.2} | – | – | – |",
            ms / limit
        );
    }
    Ok(())
}

struct Row {
    name: String,
    needs: Option<Needs>,
    here: Option<f64>,
    there: Option<f64>,
}

/// What a pass reads and writes at least.
struct Needs {
    /// Pictures, read or written.
    pictures: f64,
    mattes: f64,
    fields: f64,
}

/// None if it is done before the compositor.
fn needs(pass: Pass) -> Option<Needs> {
    let (pictures, mattes, fields) = match pass {
        Pass::Predict | Pass::Weights => return None,
        Pass::Smoothing => (0.0, 1.0, 1.0),
        Pass::Relight => (1.0, 1.0, 1.0),
        Pass::Despill => (2.0, 1.0, 0.0),
        // What is behind is drawn whole.
        Pass::Background => (1.0, 0.0, 0.0),
        Pass::LightWrap => (3.0, 1.0, 0.0),
        Pass::Difference => (3.0, 0.0, 0.0),
        Pass::Grain | Pass::Dither => (2.0, 1.0, 0.0),
        // From picture to picture.
        _ => (2.0, 0.0, 0.0),
    };
    Some(Needs {
        pictures,
        mattes,
        fields,
    })
}

/// Scenes that together ask for every pass; the first asks for what pictures usually are made of.
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

/// A subject with green at its rim before a bright window.
struct Shoot {
    field: Option<ReflectanceField>,
    mask: Mask,
    weights: LightWeights,
    environment: Environment,
    plate: Grain,
    second: Encoded,
    before: Option<Steady>,
}

/// Median times of a scene's pictures.
struct Timed {
    passes: Vec<PassReport>,
    whole: f64,
}

impl Shoot {
    fn new(size: usize, lamps: usize) -> Result<Self> {
        let centre = size as f32 / 2.0;
        let from_centre = |x: usize, y: usize| {
            let [x, y] = [x, y].map(|v| v as f32 + 0.5 - centre);
            x.hypot(y) / centre
        };
        let mask = Mask::from_fn(size, size, |x, y| {
            (40.0 * (0.7 - from_centre(x, y))).clamp(0.0, 1.0)
        });
        let mut field = noise_field(size, lamps);
        let plane = size * size;
        field
            .values
            .par_chunks_mut(plane)
            .enumerate()
            .for_each(|(i, values)| {
                let screen = if i % 3 == 1 { 3.0 } else { 0.0 };
                for (at, value) in values.iter_mut().enumerate() {
                    *value += screen * (from_centre(at % size, at / size) - 0.62).max(0.0);
                }
            });
        Ok(Self {
            field: Some(field),
            mask,
            weights: LightWeights {
                per_lamp: (0..lamps)
                    .map(|l| [0.02, 0.03, 0.01 + 0.0005 * l as f32])
                    .collect(),
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
            plate: Grain {
                deviation: [[0.2; 3]; 8],
            },
            second: Encoded(Image::filled(size, size, [0.5; 3])),
            before: None,
        })
    }

    fn of<'a>(&'a self, field: &'a Field) -> Ingredients<'a> {
        Ingredients {
            field,
            mask: &self.mask,
            weights: &self.weights,
            environment: &self.environment,
            levels: Levels::default(),
            view: CameraView::default(),
            upstream: Upstream::default(),
            extra: Extra {
                before: self.before.as_ref(),
                grain: Some(&self.plate),
                second: Some(&self.second),
                ..Extra::default()
            },
        }
    }

    /// What a frame that was darker hands on.
    fn steady(&self, field: &Field) -> Result<Steady> {
        let first = Scene {
            frame: 0,
            ..scenes().remove(0)
        };
        let steady = compose(&first, &self.of(field))?.steady;
        let mut steady = steady.ok_or("a scene with smoothing hands on what it saw")?;
        // As if that frame had been held back.
        steady.gain = [1.04; 3];
        Ok(steady)
    }

    /// Makes `rounds` pictures and one more, which warms up.
    fn timed(&self, scene: &Scene, field: &Field, rounds: usize) -> Result<Timed> {
        let of = self.of(field);
        compose(scene, &of)?;
        let mut wholes = Vec::new();
        let mut pictures = Vec::new();
        for _ in 0..rounds {
            let start = Instant::now();
            pictures.push(compose(scene, &of)?.passes);
            wholes.push(start.elapsed().as_secs_f64() * 1e3);
        }
        let passes = (0..Pass::ALL.len()).map(|index| {
            let times = pictures.iter().filter_map(|passes| passes[index].ms);
            let ms = median(times);
            PassReport {
                ms: ms.is_finite().then_some(ms),
                ..pictures[0][index].clone()
            }
        });
        Ok(Timed {
            passes: passes.collect(),
            whole: median(wholes.into_iter()),
        })
    }
}

fn noise_field(size: usize, lamps: usize) -> ReflectanceField {
    let value = |i: usize| (i.wrapping_mul(2_654_435_761) >> 8 & 0xffff) as f32 / 65536.0;
    ReflectanceField {
        width: size,
        height: size,
        lamps,
        values: (0..lamps * 3 * size * size)
            .into_par_iter()
            .map(value)
            .collect(),
    }
}

/// Bytes read and written in a millisecond by all threads that copy a block of this size.
fn copied_by_memory(bytes: usize, rounds: usize) -> f64 {
    let source = vec![1u64; bytes / 8];
    let mut target = vec![0u64; bytes / 8];
    let ms = median((0..=rounds).map(|_| {
        let start = Instant::now();
        let chunks = target
            .par_chunks_mut(1 << 15)
            .zip(source.par_chunks(1 << 15));
        chunks.for_each(|(target, source)| target.copy_from_slice(source));
        black_box(&mut target);
        start.elapsed().as_secs_f64() * 1e3
    }));
    2.0 * bytes as f64 / ms
}

/// Bytes read and written in a millisecond by a GPU that copies 64 MiB sixteen times.
fn copied_by_gpu(gpu: &afterlight::gpu::Gpu) -> f64 {
    const BYTES: u64 = 64 << 20;
    const TIMES: usize = 16;
    let buffer = || {
        gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: BYTES,
            usage: wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        })
    };
    let (source, target) = (buffer(), buffer());
    let copy = |times: usize| {
        let mut commands = gpu.device.create_command_encoder(&Default::default());
        for _ in 0..times {
            commands.copy_buffer_to_buffer(&source, 0, &target, 0, BYTES);
        }
        let start = Instant::now();
        gpu.queue.submit([commands.finish()]);
        let _ = gpu.device.poll(wgpu::PollType::wait_indefinitely());
        start.elapsed().as_secs_f64() * 1e3
    };
    copy(1);
    let ms = median((0..5).map(|_| copy(TIMES)));
    2.0 * BYTES as f64 * TIMES as f64 / ms
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}
