//! Cost and accuracy of low-resolution light that multiplies the plate: `make bench-plate`. Prints the tables of
//! `docs/plate.md`.
//!
//! The first table is time: the pass `plate` against a copy of the plate's bytes, and the whole picture while the light
//! is turned. The second is accuracy on shoots with a truth: true OLATs are averaged down to the working size, summed
//! there under the shoot's environments, transferred to the plate's size by each method, and compared with the truth at
//! the plate's size. So it measures only the loss of that transfer.

use afterlight::calibration::{CalibrateSettings, calibrate};
use afterlight::compositor::Extra;
use afterlight::compositor::reference::{extend_edges, lit_lamps, relight};
use afterlight::compositor::{Field, Identity, Ingredients, Pass, Plate, PlateSquare, Series};
use afterlight::evaluation::Truth;
use afterlight::evaluation::metrics::{Compared, psnr};
use afterlight::footage::{Frame, ImportSettings, PictureSize, import};
use afterlight::imaging::resample::{resize, resize_area};
use afterlight::imaging::{Image, Mask, Raster};
use afterlight::light::weights::{Partition, Weighting};
use afterlight::light::{LightWeights, built_in, panorama};
use afterlight::memory::keep_freed;
use afterlight::progress::Progress;
use afterlight::reflectance::{Device, HalfField, ReflectanceField};
use afterlight::scene::{Background, Output, Scene};
use afterlight::transfer::{FineField, OlatPredictor};
use clap::Parser;
use rayon::prelude::*;
use std::error::Error;
use std::hint::black_box;
use std::path::{Path, PathBuf};
use std::time::Instant;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// Time the plate, and measure accuracy on shoots with a truth.
#[derive(Parser)]
struct Options {
    /// Shoots with a truth.
    #[arg(long)]
    shoot: Vec<PathBuf>,
    /// Working sizes.
    #[arg(long, value_delimiter = ',', default_values_t = [128, 64, 32])]
    light: Vec<usize>,
    /// Pictures of each kind.
    #[arg(long, default_value_t = 15)]
    rounds: usize,
    /// Flag that cargo passes to benches.
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> Result<()> {
    keep_freed();
    let options = Options::parse();
    times(&options)?;
    for shoot in &options.shoot {
        accuracy(shoot, &options)?;
    }
    Ok(())
}

fn median(times: impl Iterator<Item = f64>) -> f64 {
    let mut times: Vec<f64> = times.collect();
    times.sort_by(f64::total_cmp);
    times.get(times.len() / 2).copied().unwrap_or(f64::NAN)
}

fn timed(rounds: usize, mut work: impl FnMut()) -> f64 {
    work();
    median((0..rounds).map(|_| {
        let started = Instant::now();
        work();
        started.elapsed().as_secs_f64() * 1e3
    }))
}

/// A pseudo-random value.
fn noise(i: usize) -> f32 {
    (i.wrapping_mul(2_654_435_761) >> 8 & 0xffff) as f32 / 65536.0
}

fn times(options: &Options) -> Result<()> {
    const LIGHT: usize = 128;
    const LAMPS: usize = 41;
    println!(
        "{} threads, light summed at {LIGHT} × {LIGHT}, {LAMPS} lamps; median milliseconds of {}.\n",
        rayon::current_num_threads(),
        options.rounds
    );
    println!(
        "| plate | copy of its bytes | pass `plate` | times | whole picture, cut out | whole picture, before a panorama | ready a plate |"
    );
    println!("|---|---:|---:|---:|---:|---:|---:|");
    let values = (0..LAMPS * 3 * LIGHT * LIGHT).map(noise).collect();
    let field = ReflectanceField { width: LIGHT, height: LIGHT, lamps: LAMPS, values };
    let field: Field = HalfField::from(&field).into();
    let environment = built_in::all()[0].environment();
    for (width, height) in [(540, 960), (1080, 1920), (2160, 3840)] {
        let subject = |x: usize, y: usize, (width, height): (usize, usize)| {
            let [x, y] = [(x, width), (y, height)].map(|(i, n)| 2.0 * (i as f32 + 0.5) / n as f32);
            (30.0 * (0.8 - (x - 1.0).hypot(y - 1.0))).clamp(0.0, 1.0)
        };
        let matte = Mask::from_fn(width, height, |x, y| subject(x, y, (width, height)));
        let light = Image::from_fn(width, height, |x, y| [0.2, 0.3, 0.4].map(|v| v + 0.3 * noise(y * width + x)));
        let square = PlateSquare { x: (width as f32 - height as f32) / 2.0, y: 0.0, side: height as f32 };
        let share = width as f32 / height as f32;
        let working = Mask::from_fn(LIGHT, LIGHT, |x, y| {
            let across = (x as f32 + 0.5 - 0.5 * LIGHT as f32) / share + 0.5 * LIGHT as f32;
            subject(across.max(0.0) as usize, y, (LIGHT, LIGHT))
        });
        let started = Instant::now();
        let plate = Plate::new(light.clone(), matte, square, &working)?;
        let ready = started.elapsed().as_secs_f64() * 1e3;
        let bytes = 12 * width * height;
        let (from, mut to) = (vec![1u64; bytes / 8], vec![0u64; bytes / 8]);
        let copy = timed(options.rounds, || {
            let chunks = to.par_chunks_mut(1 << 15).zip(from.par_chunks(1 << 15));
            chunks.for_each(|(to, from)| to.copy_from_slice(from));
            black_box(&mut to);
        });
        let whole = |background: Background| -> Result<(f64, f64)> {
            let (mut series, mut yaw_deg) = (Series::default(), 0.0);
            let mut passes = Vec::new();
            let mut failure = None;
            let ms = timed(options.rounds, || {
                yaw_deg += 1.0;
                let lamp = |l: usize| [0.02 + 0.001 * ((l as f32 + yaw_deg).sin() + 1.0); 3];
                let weights = LightWeights { per_lamp: (0..LAMPS).map(lamp).collect(), uncovered: 0.0 };
                let scene =
                    Scene { yaw_deg, background: background.clone(), output: Output::Display, ..Scene::default() };
                let ingredients = Ingredients {
                    extra: Extra { plate: Some(&plate), identity: Identity::default(), ..Extra::default() },
                    ..Ingredients::new(&field, &working, &weights, &environment)
                };
                match series.compose(&scene, (&light, &working), &ingredients) {
                    Ok(picture) => passes.push(picture.passes[Pass::Plate as usize].ms),
                    Err(e) => failure = Some(e),
                }
            });
            match failure {
                Some(e) => Err(e.into()),
                None => Ok((ms, median(passes.into_iter().flatten()))),
            }
        };
        let (cut_out, pass) = whole(Background::None)?;
        let (before, _) = whole(Background::Environment)?;
        println!(
            "| {width} × {height} | {copy:.1} | {pass:.1} | {:.1} | {cut_out:.0} | {before:.0} | {ready:.0} |",
            pass / copy
        );
    }
    println!();
    Ok(())
}

/// A transfer of light to the plate. Its inputs are the relit subject and its matte at the working size, and the plate.
type Method = fn(&Image, &Mask, &Shot) -> Image;

const METHODS: [(&str, Method); 5] = [
    ("enlarged, bicubic", |relit, mask, shot| normalized(relit, mask, shot.size(), bicubic)),
    ("guided filter", guided),
    ("joint bilateral ratio", joint_bilateral),
    ("log ratio, bicubic", |relit, mask, shot| log_ratio(relit, mask, shot, bicubic)),
    ("**pass `plate`**", |relit, mask, shot| {
        let mut relit = relit.clone();
        cover(&mut relit, mask);
        let mut picture = shot.plate.relit(&relit, mask);
        uncover(&mut picture, &shot.plate.matte);
        picture
    }),
];

/// A frame at the plate's size; the network's square covers all of it.
struct Shot {
    plate: Plate,
    /// Its light, with edges extended in the colour of the solid subject.
    light: Image,
    /// The same at the working size.
    look: Image,
}

impl Shot {
    fn size(&self) -> (usize, usize) {
        self.plate.size()
    }
}

fn cover(image: &mut Image, mask: &Mask) {
    let pixels = image.pixels.iter_mut().zip(&mask.pixels);
    pixels.for_each(|(pixel, alpha)| *pixel = pixel.map(|v| v * alpha));
}

fn uncover(image: &mut Image, mask: &Mask) {
    let pixels = image.pixels.iter_mut().zip(&mask.pixels);
    let inside = pixels.filter(|(_, alpha)| **alpha > 0.0);
    inside.for_each(|(pixel, alpha)| *pixel = pixel.map(|v| v / alpha));
}

/// Enlarges a raster to a number of columns and rows.
type Enlarge<T> = fn(&Raster<T>, usize, usize) -> Raster<T>;

/// Enlarges inside the matte only.
fn normalized(image: &Image, mask: &Mask, (width, height): (usize, usize), enlarge: Enlarge<[f32; 3]>) -> Image {
    let mut image = image.clone();
    cover(&mut image, mask);
    let mut large = enlarge(&image, width, height);
    let share = enlarge(&mask.map(|a| [a; 3]), width, height).map(|[a, ..]| a.max(0.0));
    uncover(&mut large, &share);
    large.map(|pixel| pixel.map(|v| v.max(0.0)))
}

/// Catmull–Rom interpolation.
fn bicubic(image: &Image, width: usize, height: usize) -> Image {
    let taps = |source: usize, target: usize| -> Vec<[(usize, f32); 4]> {
        let tap = |i: usize| {
            let at = (i as f32 + 0.5) * source as f32 / target as f32 - 0.5;
            let (low, t) = (at.floor(), at - at.floor());
            let weights = [
                -0.5 * t + t * t - 0.5 * t * t * t,
                1.0 - 2.5 * t * t + 1.5 * t * t * t,
                0.5 * t + 2.0 * t * t - 1.5 * t * t * t,
                -0.5 * t * t + 0.5 * t * t * t,
            ];
            let place = |k: usize| (low + k as f32 - 1.0).clamp(0.0, source as f32 - 1.0) as usize;
            [0, 1, 2, 3].map(|k| (place(k), weights[k]))
        };
        (0..target).map(tap).collect()
    };
    let (columns, rows) = (taps(image.width, width), taps(image.height, height));
    let sum = |taps: &[(usize, f32); 4], at: &dyn Fn(usize) -> [f32; 3]| {
        let mut sum = [0f32; 3];
        for (i, weight) in taps {
            let value = at(*i);
            (0..3).for_each(|c| sum[c] += weight * value[c]);
        }
        sum
    };
    let wide = Image::from_fn(width, image.height, |x, y| sum(&columns[x], &|i| image.at(i, y)));
    Image::from_fn(width, height, |x, y| sum(&rows[y], &|i| wide.at(x, i)))
}

/// Floor as in the pass: a hundredth of the mean.
fn floor(look: &Image, mask: &Mask) -> f32 {
    let covered: f32 = mask.pixels.iter().sum();
    let light = look.pixels.iter().zip(&mask.pixels);
    let light: f32 = light.map(|(p, a)| a * p.iter().sum::<f32>() / 3.0).sum();
    0.01 * light / covered.max(1.0)
}

/// Enlarges the ratio's logarithm; adds no detail back.
fn log_ratio(relit: &Image, mask: &Mask, shot: &Shot, enlarge: Enlarge<[f32; 3]>) -> Image {
    let floor = floor(&shot.look, mask);
    let pairs = relit.pixels.iter().zip(&shot.look.pixels);
    let log =
        |(a, b): (&[f32; 3], &[f32; 3])| [0, 1, 2].map(|c| ((a[c].max(0.0) + 1e-3 * floor) / (b[c] + floor)).ln());
    let log = Image { pixels: pairs.map(log).collect(), ..*relit };
    // Shifted, because uncovered pixels count as 0.
    let least = log.pixels.iter().flatten().copied().fold(0f32, f32::min);
    let shifted = log.map(|pixel| pixel.map(|v| v - least));
    let mut large = normalized(&shifted, mask, shot.size(), enlarge);
    let pixels = large.pixels.iter_mut().zip(&shot.light.pixels);
    pixels.for_each(|(pixel, light)| {
        *pixel = [0, 1, 2].map(|c| (pixel[c] + least).min(20.0).exp() * (light[c] + floor));
    });
    large
}

/// The ratio, interpolated between neighbours similar to the pixel (Kopf 2007).
fn joint_bilateral(relit: &Image, mask: &Mask, shot: &Shot) -> Image {
    let (width, height) = shot.size();
    let floor = floor(&shot.look, mask);
    let grey = |pixel: [f32; 3]| (pixel.iter().sum::<f32>() / 3.0 + floor).ln();
    let along = |i: usize, source: usize, target: usize| (i as f32 + 0.5) * source as f32 / target as f32 - 0.5;
    Image::from_fn(width, height, |x, y| {
        let (u, v) = (along(x, relit.width, width), along(y, relit.height, height));
        let own = grey(shot.light.at(x, y));
        let (mut sum, mut total) = ([0f32; 3], 1e-12);
        for dy in -1..=1 {
            for dx in -1..=1 {
                let (i, j) = (u.round() + dx as f32, v.round() + dy as f32);
                let inside = (0.0..relit.width as f32).contains(&i) && (0.0..relit.height as f32).contains(&j);
                if !inside {
                    continue;
                }
                let (near, look) = (relit.at(i as usize, j as usize), shot.look.at(i as usize, j as usize));
                let apart = (u - i).powi(2) + (v - j).powi(2);
                let differs = (own - grey(look)).powi(2);
                let weight = mask.at(i as usize, j as usize) * (-apart / 0.5 - differs / (2.0 * 0.5 * 0.5)).exp();
                total += weight;
                (0..3).for_each(|c| sum[c] += weight * near[c] / (look[c] + floor));
            }
        }
        let light = shot.light.at(x, y);
        [0, 1, 2].map(|c| sum[c] / total * (light[c] + floor))
    })
}

/// The relit picture as a linear function of the look in each 3 × 3 window (He 2015, fast guided filter), per channel.
fn guided(relit: &Image, mask: &Mask, shot: &Shot) -> Image {
    let (columns, rows) = relit.size();
    let window = |x: usize, y: usize| {
        let ys = y.saturating_sub(1)..(y + 2).min(rows);
        ys.flat_map(move |j| (x.saturating_sub(1)..(x + 2).min(columns)).map(move |i| (i, j)))
    };
    let floor = floor(&shot.look, mask);
    let line = |x: usize, y: usize, c: usize| {
        let (mut n, mut a, mut b, mut aa, mut ab) = (1e-9f32, 0f32, 0f32, 0f32, 0f32);
        for (i, j) in window(x, y) {
            let weight = mask.at(i, j);
            let (look, lit) = (shot.look.at(i, j)[c], relit.at(i, j)[c]);
            n += weight;
            a += weight * look;
            b += weight * lit;
            aa += weight * look * look;
            ab += weight * look * lit;
        }
        let (a, b, aa, ab) = (a / n, b / n, aa / n, ab / n);
        let slope = (ab - a * b) / (aa - a * a + floor * floor);
        (slope, b - slope * a)
    };
    let slopes = Image::from_fn(columns, rows, |x, y| [0, 1, 2].map(|c| line(x, y, c).0));
    let offsets = Image::from_fn(columns, rows, |x, y| [0, 1, 2].map(|c| line(x, y, c).1));
    let (width, height) = shot.size();
    let (slopes, offsets) = (resize(&slopes, width, height), resize(&offsets, width, height));
    Image::from_fn(width, height, |x, y| {
        let (slope, offset, light) = (slopes.at(x, y), offsets.at(x, y), shot.light.at(x, y));
        [0, 1, 2].map(|c| (slope[c] * light[c] + offset[c]).max(0.0))
    })
}

fn accuracy(shoot: &Path, options: &Options) -> Result<()> {
    let silent = Progress::silent();
    for &size in &options.light {
        let folder = tempfile::tempdir()?;
        let settings = ImportSettings { size, seed: 1, layer: None };
        let mut project = import(folder.path(), shoot, &settings, &silent)?;
        let calibration = calibrate(&mut project, &CalibrateSettings::default(), &silent)?;
        let truth = Truth::open(&project, shoot)?;
        let partition = Partition::new(Weighting::default(), &calibration.rig);
        let environments = truth.environments.iter().map(|named| {
            let environment = panorama::load(&project.shoot_path(&named.file))?;
            let weights = partition.weights(&environment, named.front().turned(0.0));
            Ok((named.name.clone(), weights.per_lamp))
        });
        let environments: Vec<(String, Vec<[f32; 3]>)> = environments.collect::<Result<_>>()?;
        let frames: Vec<usize> = truth.frames.iter().copied().filter(|&f| truth.has_olats(f)).collect();
        let device = Device::flex();
        let predictor = OlatPredictor::open(&project, &calibration, &device)?.with_detail(&project, &calibration)?;
        // Method, environment, frame.
        let mut pictures: Vec<Vec<Vec<Image>>> = vec![vec![Vec::new(); environments.len()]; METHODS.len() + 2];
        let mut truths: Vec<Vec<Image>> = vec![Vec::new(); environments.len()];
        let (mut mattes, mut ms) = (Vec::new(), [Vec::new(), Vec::new()]);
        let mut plate_size = (0, 0);
        for &index in &frames {
            let (frame, filmed) = Frame::load_filmed(&project, &calibration.response, index)?;
            let mut light = filmed.square().plate;
            let plate = Plate::from_filmed(filmed.square(), &frame)?;
            extend_edges(&mut light, &plate.matte);
            let mut covered = light.clone();
            cover(&mut covered, &plate.matte);
            let mut look = resize_area(&covered, size, size);
            uncover(&mut look, &frame.mask);
            plate_size = plate.size();
            let shot = Shot { plate, light, look };
            let fine = predictor.fine(&predictor.carry(&frame));
            let finely_lit = FineField::on(fine, shot.plate.clone());
            let olats = truth.olats_at(index, PictureSize::Box)?;
            let full = ReflectanceField::from_olats(&olats);
            let small: Vec<Image> = (olats.iter())
                .map(|olat| {
                    let mut covered = olat.clone();
                    cover(&mut covered, &shot.plate.matte);
                    let mut small = resize_area(&covered, size, size);
                    uncover(&mut small, &frame.mask);
                    small
                })
                .collect();
            let small = ReflectanceField::from_olats(&small);
            // The truth has its own units; the exemplars' fine light has the plate's.
            let interview = calibration.learnt_light();
            let own = relight(&small, &interview, &lit_lamps(&interview));
            let light = |image: &Image| -> f32 {
                let pixels = image.pixels.iter().zip(&frame.mask.pixels);
                pixels.map(|(pixel, alpha)| alpha * pixel[1]).sum()
            };
            let units = light(&own) / light(&frame.plate);
            for (e, (name, weights)) in environments.iter().enumerate() {
                let lit = lit_lamps(weights);
                let mut relit = relight(&small, weights, &lit);
                // As left by the pass `relight`.
                extend_edges(&mut relit, &frame.mask);
                for (m, (_, method)) in METHODS.iter().enumerate() {
                    pictures[m][e].push(method(&relit, &frame.mask, &shot));
                }
                let mut covered = relit.clone();
                cover(&mut covered, &frame.mask);
                let scaled: Vec<_> = (weights.iter()).map(|w| w.map(|w| w * units)).collect();
                let mut finely = finely_lit.relit_by(&covered, &frame.mask, &scaled);
                ms[0].push(timed(5, || drop(black_box(shot.plate.relit(&covered, &frame.mask)))));
                ms[1].push(timed(5, || {
                    drop(black_box(finely_lit.relit_by(&covered, &frame.mask, &scaled)));
                }));
                uncover(&mut finely, &shot.plate.matte);
                pictures[METHODS.len()][e].push(finely);
                pictures[METHODS.len() + 1][e].push(relight(&full, weights, &lit));
                truths[e].push(truth.relit_at(index, name, PictureSize::Box)?);
            }
            mattes.push(shot.plate.matte);
        }
        let names: Vec<&str> = environments.iter().map(|(name, _)| name.as_str()).collect();
        let (width, height) = plate_size;
        println!(
            "{}, plate {width} × {height}, light at {size} × {size} (× {:.2}); dB\n",
            project.settings.name,
            width as f64 / size as f64
        );
        println!("| method | {} |", names.join(" | "));
        println!("|---|{}", "---:|".repeat(names.len()));
        let labels = METHODS.iter().map(|(name, _)| *name);
        for (name, by_environment) in labels
            .chain(["**the same with the exemplars' fine light**", "the rig's limit: summed at the plate's size"])
            .zip(&pictures)
        {
            let mut cells = Vec::new();
            for (pictures, truths) in by_environment.iter().zip(&truths) {
                let compared: Vec<Compared> = (pictures.iter().zip(truths).zip(&mattes))
                    .map(|((picture, truth), mask)| Compared {
                        pictures: std::slice::from_ref(picture),
                        truths: std::slice::from_ref(truth),
                        mask,
                    })
                    .collect();
                cells.push(format!("{:.2}", psnr(&compared)?.mean_db));
            }
            println!("| {name} | {} |", cells.join(" | "));
        }
        let [pass, fine] = ms.map(|ms| median(ms.into_iter()));
        println!("\nPass `plate` {pass:.0} ms, with fine light {fine:.0}.\n");
    }
    Ok(())
}
