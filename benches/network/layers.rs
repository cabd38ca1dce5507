//! Each convolution of a network against the processor's peak: `make bench BENCH="--layers"`.

use crate::{Learner, Options, Result, Shape, compute, name};
use afterlight::reflectance::kernels::Activation;
use afterlight::reflectance::kernels::convolution::{GradientInputs, backward, forward};
use afterlight::reflectance::kernels::peak::Peak;
use afterlight::reflectance::{Convolution, Precision, UNetConfig};
use std::hint::black_box;
use std::time::Instant;

/// Seconds of a convolution and of its gradients by input and by weights; those at the peak rate.
struct Times {
    measured: [f64; 3],
    ideal: f64,
    bf16: bool,
}

/// Prints the share of the peak that each convolution reaches, and all of a step.
pub fn measure(options: &Options) -> Result<()> {
    let peak = Peak::measure(1000);
    print!("Peak of a core: f32 {:.0} GFLOP/s", peak.f32 / 1e9);
    println!("{}.", peak.bf16.map_or(String::new(), |bf16| format!(", bf16 {:.0}", bf16 / 1e9)));
    println!("Percent of the peak of all threads, in the fastest of many runs.\n");
    for &shape in &options.shape {
        for &size in &options.size {
            for &threads in &options.threads {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
                pool.install(|| network(shape, size, threads, options, &peak));
            }
        }
    }
    Ok(())
}

fn network(shape: Shape, size: usize, threads: usize, options: &Options, peak: &Peak) {
    let config = shape.config(size, options.precision);
    println!("`{}`, {size} × {size}, threads: {threads}.\n", name(shape));
    println!(
        "| channels | kernel | size | MFLOP | factors | forward | by input | by weights |\n\
         |---|---|---|---|---|---|---|---|"
    );
    let mut sums = [0.0; 2];
    for (i, layer) in config.convolutions().iter().enumerate() {
        let times = time(layer, config.precision, threads, peak);
        // Nothing asks for the gradient by the plate.
        let used = if i == 0 { vec![0, 2] } else { vec![0, 1, 2] };
        let share = |of: usize| {
            if used.contains(&of) {
                format!("{:.0}", 100.0 * times.ideal / times.measured[of])
            } else {
                "–".to_owned()
            }
        };
        sums[0] += used.len() as f64 * times.ideal;
        sums[1] += used.iter().map(|of| times.measured[*of]).sum::<f64>();
        println!(
            "| {} → {} | {} | {} | {:.1} | {} | {} | {} | {} |",
            layer.inputs,
            layer.outputs,
            layer.kernel,
            layer.size,
            2e-6 * layer.multiply_adds() as f64,
            if times.bf16 { "bf16" } else { "f32" },
            share(0),
            share(1),
            share(2),
        );
    }
    let step = step(&config, options);
    println!(
        "\nAll convolutions: {:.0} % ({:.1} ms); whole step: {:.0} % ({:.1} ms).\n",
        100.0 * sums[0] / sums[1],
        1e3 * sums[1],
        100.0 * sums[0] / step,
        1e3 * step,
    );
}

fn time(layer: &Convolution, precision: Precision, threads: usize, peak: &Peak) -> Times {
    let shape = layer.shape(precision);
    let values = |count: usize| (0..count).map(|i| ((i * 7919) % 997) as f32 / 997.0).collect();
    let pixels = layer.size * layer.size;
    let x: Vec<f32> = values(layer.inputs * pixels);
    let weight: Vec<f32> = values(layer.inputs * layer.outputs * layer.kernel.pow(2));
    let bias: Vec<f32> = values(layer.outputs);
    let gradient: Vec<f32> = values(layer.outputs * pixels);
    let rectified = Activation::LeakyRelu(0.0);
    let mut out = vec![0.0; gradient.len()];
    forward(&shape, [&x, &[]], &weight, &bias, rectified, &mut out);
    let output = out.clone();
    let inputs = GradientInputs::Exact([&x, &[]], &output);
    let gradients = |wanted| backward(&shape, inputs, &weight, rectified, &gradient, wanted);
    let measured = [
        least(|| forward(&shape, [&x, &[]], &weight, &bias, rectified, &mut out)),
        least(|| drop(black_box(gradients([true, false])))),
        least(|| drop(black_box(gradients([false, true])))),
    ];
    let rate = if shape.bf16 { peak.bf16.unwrap_or(peak.f32) } else { peak.f32 };
    let ideal = 2.0 * layer.multiply_adds() as f64 / rate / threads as f64;
    Times { measured, ideal, bf16: shape.bf16 }
}

/// Seconds of a step of training.
fn step(config: &UNetConfig, options: &Options) -> f64 {
    let device = compute(options.device).device.autodiff();
    let mut learner = Learner::random(config, &device, options.loss);
    least(|| {
        black_box(learner.step());
    })
}

/// Least seconds of `work` within half a second, after a first run.
pub fn least(mut work: impl FnMut()) -> f64 {
    work();
    let start = Instant::now();
    let mut least = f64::INFINITY;
    let mut runs = 0;
    while runs < 5 || start.elapsed().as_secs_f64() < 0.5 {
        let start = Instant::now();
        work();
        least = least.min(start.elapsed().as_secs_f64());
        runs += 1;
    }
    least
}
