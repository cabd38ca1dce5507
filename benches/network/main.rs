//! The network against its PyTorch counterpart: time and memory of a training step and of a prediction, measured in
//! turns. Run by `make bench`; `tests/peers/README.md` describes both.
//!
//! The driver starts one process per peer and case, so that the number of threads is set before any starts and peak
//! memory belongs to one case. Both peers answer the same commands: `step N`, `predict N`, `memory`, `quit`.

mod beside_burn;
mod layers;

use afterlight::gpu::{ComputeDevice, DeviceChoice};
use afterlight::reflectance::kernels::chunks::keep_to_avx2;
use afterlight::reflectance::kernels::{LossInputs, LossSettings, losses, on_pool};
use afterlight::reflectance::predictor::predicts_in_half;
use afterlight::reflectance::{Device, Formulation, Normalization, Precision, Statistics, UNet, UNetConfig};
use afterlight::training::Adam;
use burn::module::Module;
use burn::optim::{GradientsParams, ModuleOptimizer};
use burn::tensor::{Distribution, FloatDType, Tensor};
use clap::{Parser, ValueEnum};
use serde_json::{Value, json};
use std::error::Error;
use std::io::{BufRead, BufReader, Lines, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::Instant;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

const PYTHON: &str = "AFTERLIGHT_PYTHON";
const LEARNING_RATE: f64 = 1e-3;
const LAMPS: usize = 41;
/// Seconds of a peer's turn, unless a single run takes longer.
const TURN: f64 = 0.5;
/// Rounds of turns for each case, however slow.
const LEAST_ROUNDS: usize = 3;
/// Time the network against PyTorch.
#[derive(Parser)]
struct Options {
    /// Widths and heights of the pictures.
    #[arg(long, value_delimiter = ',', default_values_t = [128, 256, 512])]
    size: Vec<usize>,
    /// Numbers of threads.
    #[arg(long, value_delimiter = ',', default_values_t = [1, 2])]
    threads: Vec<usize>,
    /// Shapes of the network.
    #[arg(long, value_enum, value_delimiter = ',', default_values_t = [Shape::Quick, Shape::Paper])]
    shape: Vec<Shape>,
    /// Precision of our convolutions; PyTorch's are f32 unless `--peer` says otherwise. On a GPU `mixed` predicts in
    /// f16, and training always uses f32.
    #[arg(long, value_enum, default_value_t)]
    precision: Precision,
    /// Processor or GPU for both peers. On a GPU the number of threads is ignored, and memory is the GPU's.
    #[arg(long, value_enum, default_value = "cpu")]
    device: DeviceChoice,
    /// Seconds for each of the two measurements of a case.
    #[arg(long, default_value_t = 15.0)]
    seconds: f64,
    /// Further arguments for the PyTorch script, such as "--fused --channels-last".
    #[arg(long, default_value = "", allow_hyphen_values = true)]
    peer: String,
    /// Limit both peers to AVX2, as on processors without AVX-512. Needs `--precision full` or `auto`.
    #[arg(long)]
    avx2: bool,
    /// Train with gradient checkpointing: cheap operations are recomputed in the backward pass.
    #[arg(long)]
    recompute: bool,
    /// Loss of a step, for both peers.
    #[arg(long, value_enum, default_value = "training")]
    loss: Loss,
    /// Share of the processor's peak of each convolution, instead of the race.
    #[arg(long)]
    layers: bool,
    /// Our kernels beside burn's operations, instead of the race.
    #[arg(long)]
    burn: bool,
    /// Answer commands as a peer; used by the driver.
    #[arg(long, hide = true)]
    serve: bool,
    /// Flag that cargo passes to benches.
    #[arg(long, hide = true)]
    bench: bool,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum Loss {
    /// The losses of training.
    Training,
    /// Mean squared error, by burn's operations. The only one on a GPU.
    Squares,
}

#[derive(Clone, Copy, ValueEnum)]
enum Shape {
    /// The preset for ten minutes of training.
    Quick,
    /// The paper's network.
    Paper,
}

impl Shape {
    fn config(self, size: usize, precision: Precision) -> UNetConfig {
        let (width, most_channels, normalization) = match self {
            Self::Quick => (16, 64, Normalization::Group),
            Self::Paper => (32, 512, Normalization::Batch),
        };
        UNetConfig {
            size,
            lamps: LAMPS,
            depth: None,
            width,
            most_channels,
            normalization,
            statistics: Statistics::Running,
            formulation: Formulation::Direct,
            precision,
        }
    }
}

fn main() -> Result<()> {
    let mut options = Options::parse();
    if options.device == DeviceChoice::Auto {
        options.device = match ComputeDevice::choose(DeviceChoice::Auto).gpu {
            Some(_) => DeviceChoice::Gpu,
            None => DeviceChoice::Cpu,
        };
    }
    if options.device == DeviceChoice::Gpu {
        options.loss = Loss::Squares;
    }
    afterlight::memory::keep_freed();
    if options.avx2 && options.precision == Precision::Mixed {
        return Err("--avx2 needs --precision full or auto: bf16 needs AVX-512".into());
    }
    if options.avx2 {
        keep_to_avx2();
    }
    if options.serve {
        let config = options.shape[0].config(options.size[0], options.precision);
        return serve(&config, &compute(options.device), &options);
    }
    if options.layers {
        return layers::measure(&options);
    }
    if options.burn {
        return beside_burn::measure(&options);
    }
    race(&options)
}

/// The requested device; `auto` takes a GPU if there is one.
fn compute(choice: DeviceChoice) -> ComputeDevice {
    let compute = ComputeDevice::choose(choice);
    eprintln!("afterlight on the {}", compute.description);
    compute
}

/// A network in training, and the inputs of a step.
struct Learner {
    network: UNet,
    optimizer: ModuleOptimizer,
    input: Tensor<4>,
    target: Tensor<4>,
    loss: Loss,
}

/// Seconds of the parts of a step, and its loss.
struct Step {
    forward: f64,
    backward: f64,
    optimizer: f64,
    loss: f32,
}

impl Learner {
    /// A fresh network, and noise to learn.
    fn random(config: &UNetConfig, device: &Device, loss: Loss) -> Self {
        device.seed(0);
        let noise = |channels| {
            let shape = [1, channels, config.size, config.size];
            Tensor::random(shape, Distribution::Uniform(0.0, 1.0), device)
        };
        let network = config.init(0.5, device).materialize();
        let optimizer = ModuleOptimizer::from(Adam::default());
        Self { network, optimizer, input: noise(3), target: noise(3 * config.lamps), loss }
    }

    fn loss(&self) -> Tensor<1> {
        if self.loss == Loss::Squares {
            let output = self.network.forward(self.input.clone());
            return (output - self.target.clone()).square().mean();
        }
        let output = self.network.logits(self.input.clone(), None);
        let [_, channels, h, w] = output.dims();
        let lamps = channels / 3;
        let device = output.device().without_autodiff();
        let inputs = LossInputs {
            light: Tensor::ones([1, 3, h, w], &device),
            mask: &Tensor::ones([1, 1, h, w], &device),
            olats: Some(&self.target.clone().inner().reshape([lamps, 3, h, w])),
            plate: &self.input.clone().inner(),
            weights: &Tensor::full([lamps, 3, 1, 1], 1.0 / lamps as f32, &device),
            settings: LossSettings { gain: 1.0, shift: [0; 2], reconstruction: 1.0, rendering: 1.0, logits: true },
        };
        losses(output, &inputs).0
    }

    fn step(&mut self) -> Step {
        let start = Instant::now();
        let loss = self.loss();
        let forward = start.elapsed().as_secs_f64();
        let gradients = GradientsParams::from_grads(loss.backward(), &self.network);
        let backward = start.elapsed().as_secs_f64();
        self.network = self.optimizer.step(LEARNING_RATE, self.network.clone(), gradients);
        let loss = loss.into_scalar();
        Step { forward, backward: backward - forward, optimizer: start.elapsed().as_secs_f64() - backward, loss }
    }
}

/// Answers commands on standard input with the network of this crate.
fn serve(config: &UNetConfig, compute: &ComputeDevice, options: &Options) -> Result<()> {
    let plain = &compute.device;
    let mut device = plain.clone().autodiff();
    if options.recompute {
        device = device.gradient_checkpointing();
    }
    let mut learner = Learner::random(config, &device, options.loss);
    for line in std::io::stdin().lines() {
        let line = line?;
        let (what, count) = line.split_once(' ').unwrap_or((&line, "0"));
        let count: usize = count.parse()?;
        let reply = match what {
            "quit" => break,
            "memory" => match plain.memory_pool_usage() {
                // Pages are pooled for reuse, so the reserved bytes are the peak.
                Some(gpu) => json!({
                    "peak_kib": gpu.bytes_reserved / 1024,
                    "now_kib": gpu.bytes_in_use / 1024,
                }),
                None => json!({
                    "peak_kib": status_kib("VmHWM"),
                    "now_kib": status_kib("VmRSS"),
                }),
            },
            "step" => {
                let steps: Vec<Step> = (0..count).map(|_| on_pool(plain, || learner.step())).collect();
                let column = |f: fn(&Step) -> f64| steps.iter().map(f).collect::<Vec<_>>();
                json!({
                    "seconds": column(|s| s.forward + s.backward + s.optimizer),
                    "forward": column(|s| s.forward),
                    "backward": column(|s| s.backward),
                    "optimizer": column(|s| s.optimizer),
                    "loss": column(|s| s.loss.into()),
                })
            }
            "predict" => {
                let (mut network, mut input) = (learner.network.valid(), learner.input.clone().inner());
                if config.precision == Precision::Mixed && predicts_in_half(plain) {
                    network = network.halved();
                    input = input.cast(FloatDType::F16);
                }
                let mut seconds = Vec::with_capacity(count);
                for _ in 0..count {
                    let start = Instant::now();
                    let output = on_pool(plain, || network.forward(input.clone()));
                    plain.sync().map_err(text)?;
                    seconds.push(start.elapsed().as_secs_f64());
                    drop(output);
                }
                json!({ "seconds": seconds })
            }
            _ => json!({ "error": "expected: step N, predict N, memory or quit" }),
        };
        println!("{reply}");
    }
    Ok(())
}

/// A value of the process's status in KiB; 0 on systems without one.
fn status_kib(name: &str) -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    status
        .lines()
        .find_map(|l| l.strip_prefix(name)?.strip_prefix(':'))
        .and_then(|l| l.split_whitespace().next()?.parse().ok())
        .unwrap_or(0)
}

/// One of the two processes in a case.
struct Peer {
    child: Child,
    lines: Lines<BufReader<ChildStdout>>,
    to: ChildStdin,
}

impl Peer {
    fn start(command: &mut Command) -> Result<Self> {
        let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn()?;
        let to = child.stdin.take().expect("it is piped");
        let lines = BufReader::new(child.stdout.take().expect("it is piped")).lines();
        Ok(Self { child, lines, to })
    }

    fn ours(shape: Shape, size: usize, threads: usize, options: &Options) -> Result<Self> {
        let recompute = options.recompute.then_some("--recompute");
        Self::start(
            Command::new(std::env::current_exe()?)
                .args(recompute)
                .args(options.avx2.then_some("--avx2"))
                .args(["--serve", "--shape", &name(shape)])
                .args(["--precision", &name(options.precision)])
                .args(["--device", &name(options.device)])
                .args(["--loss", &name(options.loss)])
                .args(["--size", &size.to_string()])
                .env("RAYON_NUM_THREADS", threads.to_string()),
        )
    }

    fn theirs(python: &str, shape: Shape, size: usize, threads: usize, options: &Options) -> Result<Self> {
        let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/peers/unet.py");
        let config = shape.config(size, Precision::Full);
        let device = match options.device {
            DeviceChoice::Gpu => "cuda",
            _ => "cpu",
        };
        let normalization = match config.normalization {
            Normalization::Batch => "batch",
            Normalization::Group => "group",
            Normalization::None => "none",
        };
        // Settings for its convolutions, its other operations and its matrix products.
        let cap =
            [("ONEDNN_MAX_CPU_ISA", "AVX2"), ("ATEN_CPU_CAPABILITY", "avx2"), ("MKL_ENABLE_INSTRUCTIONS", "AVX2")];
        Self::start(
            Command::new(python)
                .arg(script)
                .envs(cap.into_iter().filter(|_| options.avx2))
                .args(["serve", "--normalization", normalization])
                .args(["--size", &size.to_string()])
                .args(["--lamps", &config.lamps.to_string()])
                .args(["--width", &config.width.to_string()])
                .args(["--most-channels", &config.most_channels.to_string()])
                .args(["--threads", &threads.to_string()])
                .args(["--device", device])
                .args(["--loss", &name(options.loss)])
                .args(options.peer.split_whitespace())
                .env("OMP_NUM_THREADS", threads.to_string()),
        )
    }

    fn ask(&mut self, line: &str) -> Result<Value> {
        writeln!(self.to, "{line}")?;
        let reply = self.lines.next().ok_or("a peer ended early")??;
        Ok(serde_json::from_str(&reply)?)
    }

    fn memory(&mut self, which: &str) -> Result<f64> {
        let kib = self.ask("memory")?[which].as_f64().unwrap_or(0.0);
        Ok(kib / 1024.0)
    }

    fn run(&mut self, what: &str, count: usize, into: &mut Samples) -> Result<()> {
        let reply = self.ask(&format!("{what} {count}"))?;
        for (part, samples) in Samples::PARTS.iter().zip(&mut into.0) {
            let values = reply[part].as_array().into_iter().flatten();
            samples.extend(values.filter_map(Value::as_f64));
        }
        Ok(())
    }
}

impl Drop for Peer {
    fn drop(&mut self) {
        // A peer that has already ended needs no command.
        let _ = writeln!(self.to, "quit");
        let _ = self.child.wait();
    }
}

/// Seconds of many runs, in total and by part.
#[derive(Default)]
struct Samples([Vec<f64>; 4]);

impl Samples {
    const PARTS: [&str; 4] = ["seconds", "forward", "backward", "optimizer"];

    /// Median and minimum of a part in milliseconds.
    fn milliseconds(&self, part: usize) -> [f64; 2] {
        let mut values = self.0[part].clone();
        values.sort_by(f64::total_cmp);
        [values.len() / 2, 0].map(|i| values.get(i).map_or(f64::NAN, |seconds| seconds * 1e3))
    }
}

/// Lets the peers take turns at `what` for about `budget` seconds.
fn alternate(peers: &mut [Peer], what: &str, options: &Options) -> Result<Vec<Samples>> {
    let mut turns = Vec::new();
    for peer in peers.iter_mut() {
        let mut warm = Samples::default();
        let mut seconds = 0.0;
        // The first run allocates memory; if a run takes long, that is a small part of it. On a GPU it also compiles
        // kernels and times them against each other.
        let gpu = options.device == DeviceChoice::Gpu;
        while warm.0[0].len() < 2 && (gpu || seconds < 4.0 * TURN) {
            peer.run(what, 1, &mut warm)?;
            seconds = warm.0[0].last().copied().unwrap_or(TURN);
        }
        turns.push((TURN / seconds).clamp(1.0, 50.0) as usize);
    }
    let start = Instant::now();
    let mut samples: Vec<Samples> = peers.iter().map(|_| Samples::default()).collect();
    let mut rounds = 0;
    while rounds < LEAST_ROUNDS || start.elapsed().as_secs_f64() < options.seconds {
        for ((peer, samples), turn) in peers.iter_mut().zip(&mut samples).zip(&turns) {
            peer.run(what, *turn, samples)?;
        }
        rounds += 1;
    }
    Ok(samples)
}

/// Times every case and prints the tables.
fn race(options: &Options) -> Result<()> {
    let gpu = options.device == DeviceChoice::Gpu;
    let mut python = std::env::var(PYTHON).ok().filter(|p| !p.is_empty());
    if python.is_none() {
        println!("PyTorch is left out: {PYTHON} is not set (`make peers` installs it).\n");
    } else if gpu && !python.as_deref().is_some_and(has_cuda) {
        println!("PyTorch is left out: it sees no CUDA device.\n");
        python = None;
    }
    println!("Milliseconds: median (minimum). Memory in MiB: peak, and the amount held at the start.\n");
    // A GPU's speed does not depend on the host threads.
    let threads = if gpu { &options.threads[..1] } else { &options.threads[..] };
    println!("| network | size | threads | step | PyTorch | ratio | prediction | PyTorch | ratio | memory | PyTorch |");
    println!("|---|---|---|---|---|---|---|---|---|---|---|");
    let mut parts = Vec::new();
    for &shape in &options.shape {
        for &size in &options.size {
            for &threads in threads {
                let mut peers = vec![Peer::ours(shape, size, threads, options)?];
                if let Some(python) = &python {
                    let peer = Peer::theirs(python, shape, size, threads, options)?;
                    peers.push(peer);
                }
                let mut starts = Vec::new();
                for peer in &mut peers {
                    starts.push(peer.memory("now_kib")?);
                }
                let predictions = alternate(&mut peers, "predict", options)?;
                let steps = alternate(&mut peers, "step", options)?;
                let case = format!("| {} | {size} | {threads} |", name(shape));
                print!("{case}{}{}", cells(&steps, 0), cells(&predictions, 0));
                for (peer, start) in peers.iter_mut().zip(starts) {
                    print!(" {:.0}, {start:.0} |", peer.memory("peak_kib")?);
                }
                println!("{}", if peers.len() == 1 { " |" } else { "" });
                let row: String = (1..4).map(|part| cells(&steps, part)).collect();
                parts.push(format!("{case}{row}"));
            }
        }
    }
    if gpu {
        // On a GPU the parts' times are only submission times.
        return Ok(());
    }
    println!("\nThe parts of a step.\n");
    println!(
        "| network | size | threads | forward | PyTorch | ratio | backward | PyTorch | ratio | Adam | PyTorch | ratio |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|");
    println!("{}", parts.join("\n"));
    Ok(())
}

/// True if this interpreter's PyTorch can use a GPU.
fn has_cuda(python: &str) -> bool {
    let ask = "import sys, torch; sys.exit(not torch.cuda.is_available())";
    let asked = Command::new(python).args(["-c", ask]).status();
    asked.is_ok_and(|status| status.success())
}

/// The name of an option's value.
fn name(value: impl ValueEnum) -> String {
    let value = value.to_possible_value().expect("none is skipped");
    value.get_name().to_owned()
}

/// Ours, theirs and their ratio as cells of a table.
fn cells(samples: &[Samples], part: usize) -> String {
    let [median, least] = samples[0].milliseconds(part);
    match samples.get(1).map(|theirs| theirs.milliseconds(part)) {
        Some([their_median, their_least]) => format!(
            " {median:.1} ({least:.1}) | {their_median:.1} ({their_least:.1}) | {:.2} ({:.2}) |",
            median / their_median,
            least / their_least
        ),
        None => format!(" {median:.1} ({least:.1}) | | |"),
    }
}

fn text(cause: impl std::fmt::Debug) -> String {
    format!("{cause:?}")
}
