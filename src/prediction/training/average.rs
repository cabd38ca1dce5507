//! Moving average of a network's weights, which predicts more steadily than the weights of the last step.

use burn::module::{Module, ModuleMapper, ModuleVisitor, Param};
use burn::tensor::Tensor;
use reflectance::kernels;
use std::collections::VecDeque;

/// `average ← keep · average + (1 − keep) · live`, parameter by parameter. Both have the same shape; `average` is on the
/// plain device that belongs to the autodiff device of `live`.
pub fn blend<M: Module>(average: M, live: &M, keep: f32) -> M {
    let mut collector = Collector::default();
    live.visit(&mut collector);
    average.map(&mut Blender { live: collector.0, keep })
}

/// All parameters, flattened, in the module's order.
#[derive(Default)]
struct Collector(VecDeque<Tensor<1>>);

impl ModuleVisitor for Collector {
    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let value = param.val();
        let count = value.dims().iter().product::<usize>();
        self.0.push_back(value.inner().reshape([count]));
    }
}

struct Blender {
    live: VecDeque<Tensor<1>>,
    keep: f32,
}

impl ModuleMapper for Blender {
    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let Some(live) = self.live.pop_front() else { return param };
        param.map(|average| {
            let live = live.reshape(average.dims());
            kernels::follow(average, live, self.keep)
        })
    }
}
