//! Clipping of all gradients by their common norm.

use burn::module::{Module, ModuleVisitor, Param};
use burn::optim::GradientsParams;
use burn::tensor::Tensor;
use reflectance::{UNet, kernels};

/// Scales `gradients` so that their common Euclidean norm is at most `most`, and returns the norm
/// before. It is NaN or infinite if any gradient is: such a step must be skipped.
pub fn clip<M: Module>(network: &M, gradients: &mut GradientsParams, most: f32) -> f32 {
    let mut squares = Squares { gradients, sums: Vec::new() };
    network.visit(&mut squares);
    let sums = squares.sums;
    if sums.is_empty() {
        return 0.0;
    }
    let norm = Tensor::cat(sums, 0).sum().sqrt().into_scalar::<f32>();
    if norm > most {
        network.visit(&mut Scaler { gradients, factor: most / norm });
    }
    norm
}

/// Euclidean norm of all weights of a network on a plain device. It is NaN or infinite when any weight is.
pub fn weight_norm(network: &UNet) -> f32 {
    struct Squares(Vec<Tensor<1>>);
    impl ModuleVisitor for Squares {
        fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
            self.0.push(kernels::square_sum(param.val()));
        }
    }
    let mut squares = Squares(Vec::new());
    network.visit(&mut squares);
    Tensor::cat(squares.0, 0).sum().sqrt().into_scalar::<f32>()
}

struct Squares<'a> {
    gradients: &'a GradientsParams,
    sums: Vec<Tensor<1>>,
}

impl ModuleVisitor for Squares<'_> {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        if let Some(gradient) = self.gradients.get::<D>(param.id) {
            self.sums.push(kernels::square_sum(gradient));
        }
    }
}

struct Scaler<'a> {
    gradients: &'a mut GradientsParams,
    factor: f32,
}

impl ModuleVisitor for Scaler<'_> {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        if let Some(gradient) = self.gradients.remove::<D>(param.id) {
            self.gradients.register(param.id, gradient * self.factor);
        }
    }
}
