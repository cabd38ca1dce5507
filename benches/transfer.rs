//! Time of a frame's OLATs by transfer at 128², and of a dense flow beside `OpenCV`'s: `cargo bench --profile dev
//! --bench transfer`.

use afterlight::benchmark::{Budget, Spread};
use afterlight::footage::Frame;
use afterlight::imaging::Raster;
use afterlight::memory::keep_freed;
use afterlight::transfer::Transfer;
use afterlight::transfer::flow::{FlowSettings, flow};
use clap::Parser;
use std::error::Error;
use std::process::{Command, Stdio};
use std::time::Duration;
use test_shoot::TestShoot;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

const PYTHON: &str = "AFTERLIGHT_PYTHON";
const SHOOT: TestShoot = TestShoot { frames: 1, lamps: 41, size: 128, working_size: 128 };
/// Runs of each row after the first.
const ROUNDS: usize = 31;
/// Side of the pictures that transfer matches at this size.
const MATCHED: usize = 192;
/// Waves of the flow's pictures: along x and y, in radians per pixel, and their codes.
const WAVES: [[f32; 3]; 4] = [[0.09, 0.05, 30.0], [0.06, -0.11, 30.0], [0.31, 0.42, 20.0], [0.52, -0.37, 20.0]];

/// Time transfer.
#[derive(Parser)]
struct Options {
    /// Threads of the transfer; 0 uses all of the processor's. A flow has one.
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Flag that cargo passes to benches.
    #[arg(long, hide = true)]
    bench: bool,
}

fn main() -> Result<()> {
    keep_freed();
    let options = Options::parse();
    rayon::ThreadPoolBuilder::new().num_threads(options.threads).build_global()?;
    let folder = tempfile::tempdir()?;
    let (project, calibration) = SHOOT.calibrate(folder.path(), "project");
    let transfer = Transfer::open(&project, &calibration)?;
    let frame = Frame::load(&project, &calibration.response, 0)?;

    let warp = |x: f32, y: f32| [4.0 * (0.03 * y).sin(), 3.0 * (0.025 * x).cos()];
    let picture = |offset: &dyn Fn(f32, f32) -> [f32; 2]| {
        Raster::from_fn(MATCHED, MATCHED, |x, y| {
            let (x, y) = (x as f32, y as f32);
            let [dx, dy] = offset(x, y);
            let wave = |[a, b, code]: [f32; 3]| code * (a * (x + dx) + b * (y + dy)).sin();
            (128.0 + WAVES.map(wave).iter().sum::<f32>()).round()
        })
    };
    let (from, to) = (picture(&warp), picture(&|_, _| [0.0; 2]));
    let error = |offsets: &[[f32; 2]]| {
        let errors = offsets.iter().enumerate().map(|(p, found)| {
            let [dx, dy] = warp((p % MATCHED) as f32, (p / MATCHED) as f32);
            (found[0] - dx).hypot(found[1] - dy)
        });
        errors.sum::<f32>() / offsets.len() as f32
    };

    println!("{} threads.\n", rayon::current_num_threads());
    println!("| work | median, ms | from 5th to 95th percentile |\n|---|---:|---:|");
    row("OLATs of a frame alone", times(|| transfer.carry(&frame))?);
    let first = || Transfer::open(&project, &calibration).map(|transfer| transfer.carry(&frame));
    row("the first, exemplars read", times(first)?);
    let settings = FlowSettings::default();
    let run = || flow(&from, &to, None, &settings);
    let mut ours = times(run)?;
    let Some(python) = std::env::var(PYTHON).ok().filter(|python| !python.is_empty()) else {
        row("flow", ours);
        eprintln!("OpenCV is left out: {PYTHON} is not set.");
        return Ok(());
    };
    let files = ["from", "to", "offsets"].map(|name| folder.path().join(name));
    for (path, picture) in files.iter().zip([&from, &to]) {
        std::fs::write(path, picture.pixels.iter().map(|code| *code as u8).collect::<Vec<u8>>())?;
    }
    let mut peer = Command::new(python);
    peer.arg(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/peers/flow.py")).args(&files);
    let FlowSettings { finest_scale, stride, descent_iterations, .. } = settings;
    let counts = [MATCHED, ROUNDS, finest_scale, stride, descent_iterations, settings.refinement_iterations];
    peer.args(counts.map(|n| n.to_string()));
    peer.args([settings.alpha, settings.delta, settings.gamma].map(|weight| weight.to_string()));
    let told = peer.stderr(Stdio::inherit()).output()?;
    if !told.status.success() {
        return Err("OpenCV's flow failed".into());
    }
    // Before and after the peer.
    ours.extend(times(run)?);
    let found: Vec<f32> = bytemuck::pod_collect_to_vec(&std::fs::read(&files[2])?);
    let errors = [error(&run()), error(found.as_chunks().0)];
    let ours = row("flow", ours);
    let theirs = row("the same by OpenCV", serde_json::from_slice(&told.stdout)?);
    println!("\nRatio of medians: {:.2}. Mean error in pixels: {errors:.2?}.", ours / theirs);
    Ok(())
}

/// Milliseconds of each run after the first.
fn times<T>(work: impl Fn() -> T) -> Result<Vec<f64>> {
    work();
    Ok(Budget { runs: (ROUNDS, ROUNDS), time: Duration::ZERO }.time(|| Ok(work()))?)
}

/// Prints a row, and returns its median.
fn row(work: &str, times: Vec<f64>) -> f64 {
    let Spread { median_ms, low_ms, high_ms, .. } = Spread::from_times(times);
    println!("| {work} | {median_ms:.1} | {low_ms:.1} to {high_ms:.1} |");
    median_ms
}
