//! The optimiser.

use burn::optim::{AdamState, AdaptiveMomentumState, LearningRate, Optimizer, RecordState, StateSink, StateSource};
use burn::tensor::{Device, Tensor};
use reflectance::kernels;

/// Adam (Kingma and Ba, 2015) with the usual decays of its moments, 0.9 and 0.999, and ε = 1e-8. On the CPU it
/// is one pass over memory; other devices use burn's.
#[derive(Clone)]
pub struct Adam {
    elsewhere: burn::optim::Adam,
}

impl Default for Adam {
    fn default() -> Self {
        let elsewhere = burn::optim::AdamConfig::new().with_epsilon(1e-8).build();
        Self { elsewhere }
    }
}

/// Moments of a parameter's gradients, in burn's form. They are read into memory and move to the parameter's device with the next
/// step. burn would read them on its default device: possibly a missing GPU, whose threads would stay awake.
#[derive(Clone)]
pub struct Moments<const D: usize>(AdamState<D>);

impl<const D: usize> RecordState for Moments<D> {
    fn state_flatten(&self, prefix: &str, out: &mut StateSink) {
        self.0.state_flatten(prefix, out);
    }

    fn state_unflatten(prefix: &str, src: &mut StateSource, _default: &Device) -> Option<Self> {
        AdamState::state_unflatten(prefix, src, &Device::flex()).map(Self)
    }
}

impl Optimizer for Adam {
    type State<const D: usize> = Moments<D>;

    fn step<const D: usize>(
        &self,
        learning_rate: LearningRate,
        parameter: Tensor<D>,
        gradient: Tensor<D>,
        state: Option<Self::State<D>>,
    ) -> (Tensor<D>, Option<Self::State<D>>) {
        if !kernels::serve(&parameter) {
            let state = state.map(|moments| moments.0);
            let (parameter, state) = (self.elsewhere).step(learning_rate, parameter, gradient, state);
            return (parameter, state.map(Moments));
        }
        let (time, moments) = match state.map(|moments| moments.0.momentum) {
            Some(m) => (m.time + 1, [m.moment_1, m.moment_2]),
            None => (1, [(); 2].map(|()| gradient.zeros_like())),
        };
        let (parameter, [first, second]) = kernels::adam(parameter, gradient, moments, learning_rate, time);
        let state = AdamState::new(AdaptiveMomentumState::new(time, first, second));
        (parameter, Some(Moments(state)))
    }

    fn to_device<const D: usize>(state: Self::State<D>, device: &Device) -> Self::State<D> {
        Moments(burn::optim::Adam::to_device(state.0, device))
    }
}
