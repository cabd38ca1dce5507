//! Our kernels beside burn's operations on the processor: `cargo bench --locked --bench network -- --burn`. Only the
//! release profile optimises burn's crates as it does ours.

use crate::layers::least;
use crate::{LEARNING_RATE, Learner, Loss, Options, Result, Shape, name};
use afterlight::reflectance::kernels::{self, Activation, keep_to_burn};
use afterlight::reflectance::{Device, Normalization, Precision};
use afterlight::training::Adam;
use burn::nn::conv::Conv2dConfig;
use burn::nn::{BatchNormConfig, GroupNormConfig, PaddingConfig2d};
use burn::optim::Optimizer;
use burn::tensor::{Distribution, Tensor};
use std::hint::black_box;

/// Prints milliseconds of operations in f32, and of a whole step.
pub fn measure(options: &Options) -> Result<()> {
    println!(
        "Milliseconds in f32, the fastest of many runs: an operation and its gradients on a picture with the first block's \
         channels, updates of all parameters, and a step with squared errors.\n"
    );
    println!("| network | size | threads | operation | ours | burn | ratio |\n|---|---|---|---|---|---|---|");
    for &shape in &options.shape {
        for &size in &options.size {
            for &threads in &options.threads {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
                pool.install(|| network(shape, size, threads));
            }
        }
    }
    Ok(())
}

fn network(shape: Shape, size: usize, threads: usize) {
    const LEAK: f32 = 0.2;
    let config = shape.config(size, Precision::Full);
    let plain = Device::flex();
    let device = plain.clone().autodiff();
    let uniform = Distribution::Uniform(0.0, 1.0);
    let picture = |size: usize| Tensor::<4>::random([1, config.width, size, size], uniform, &device).require_grad();
    let (whole, half) = (picture(size), picture(size / 2));
    let padding = PaddingConfig2d::Explicit(1, 1, 1, 1);
    let layer = Conv2dConfig::new([config.width; 2], [3; 2]).with_padding(padding).init(&device);
    let group = GroupNormConfig::new(8, config.width).init(&device);
    let batch = BatchNormConfig::new(config.width).init(&device);
    let there_and_back = |y: Tensor<4>| drop(black_box(y.sum().backward()));
    let normalized = || match config.normalization {
        Normalization::Group => kernels::group_norm(whole.clone(), &group, LEAK),
        _ => kernels::batch_norm(whole.clone(), &batch, LEAK, true),
    };
    let convolved = || {
        let leak = Activation::LeakyRelu(LEAK);
        kernels::convolution(whole.clone(), None, &layer, leak, Precision::Full)
    };
    let parameters = config.cost().parameters as usize;
    let weights = || Tensor::<1>::random([parameters], uniform, &plain);
    let (weights, others, adam) = (weights(), weights(), Adam::default());
    let optimized = || adam.step(LEARNING_RATE, weights.clone(), others.clone(), None);
    let mut learner = Learner::random(&config, &device, Loss::Squares);
    let operations: [(&str, &mut dyn FnMut()); 8] = [
        ("convolution, leaky ReLU", &mut || there_and_back(convolved())),
        ("normalisation, leaky ReLU", &mut || there_and_back(normalized())),
        ("blur-pool", &mut || there_and_back(kernels::blur_pool(whole.clone()))),
        ("bilinear ×2", &mut || there_and_back(kernels::upsample(half.clone(), None))),
        ("Adam", &mut || drop(black_box(optimized()))),
        ("moving average", &mut || {
            black_box(kernels::follow(weights.clone(), others.clone(), 0.99));
        }),
        ("sum of squares", &mut || drop(black_box(kernels::square_sum(weights.clone())))),
        ("whole step", &mut || {
            black_box(learner.step());
        }),
    ];
    for (operation, work) in operations {
        let [ours, burns] = [false, true].map(|burn| {
            keep_to_burn(burn);
            1e3 * least(&mut *work)
        });
        println!(
            "| {} | {size} | {threads} | {operation} | {ours:.2} | {burns:.2} | {:.2} |",
            name(shape),
            ours / burns
        );
    }
    keep_to_burn(false);
}
