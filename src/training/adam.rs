//! The optimiser.

use burn::optim::{AdamState, AdaptiveMomentumState, LearningRate, Optimizer};
use burn::tensor::{Device, Tensor};
use reflectance::kernels;

/// Adam (Kingma and Ba, 2015) with the usual decays of its moments, 0.9 and 0.999, and ε = 1e-8. On the CPU it
/// is one pass over memory; other devices use burn's, whose state it shares.
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

impl Optimizer for Adam {
    type State<const D: usize> = AdamState<D>;

    fn step<const D: usize>(
        &self,
        learning_rate: LearningRate,
        parameter: Tensor<D>,
        gradient: Tensor<D>,
        state: Option<Self::State<D>>,
    ) -> (Tensor<D>, Option<Self::State<D>>) {
        if !kernels::serve(&parameter) {
            return self
                .elsewhere
                .step(learning_rate, parameter, gradient, state);
        }
        let (time, moments) = match state.map(|s| s.momentum) {
            Some(m) => (m.time + 1, [m.moment_1, m.moment_2]),
            None => (1, [(); 2].map(|()| gradient.zeros_like())),
        };
        let (parameter, [first, second]) =
            kernels::adam(parameter, gradient, moments, learning_rate, time);
        let state = AdamState::new(AdaptiveMomentumState::new(time, first, second));
        (parameter, Some(state))
    }

    fn to_device<const D: usize>(state: Self::State<D>, device: &Device) -> Self::State<D> {
        burn::optim::Adam::to_device(state, device)
    }
}
