//! Heat kernels on the sphere: the shape of footprints and of blur.
//!
//! h_t(cos θ) = Σ_l (2l+1)/4π · e^(−l(l+1)t) · P_l(cos θ). Blurs add up: h_s ∗ h_t = h_(s+t), because each Legendre
//! term is damped independently. h_t has a mean square angle of 4t from its centre, for t well below 1.

use std::f64::consts::PI;

/// A heat kernel by angle: [`STEPS`] + 1 values from 0 to π.
#[derive(Clone)]
pub(super) struct HeatKernel(Vec<f64>);

/// At 0.09° each, linear interpolation is precise to 1e-4 for the sharpest kernel in use.
const STEPS: usize = 2048;

impl HeatKernel {
    /// The kernel at time `t`, per steradian.
    pub fn new(t: f64) -> Self {
        let angle = |i| PI * i as f64 / STEPS as f64;
        Self((0..=STEPS).map(|i| heat_kernel(angle(i).cos(), t).max(0.0)).collect())
    }

    /// Value at the angle with this cosine.
    pub fn at(&self, cosine: f64) -> f64 {
        let place = cosine.clamp(-1.0, 1.0).acos() / PI * STEPS as f64;
        let below = (place as usize).min(STEPS - 1);
        let fraction = place - below as f64;
        (1.0 - fraction) * self.0[below] + fraction * self.0[below + 1]
    }

    /// The kernel lowered by `share` of its peak and clamped to 0, so that it ends without a step, and the cosine
    /// of the angle where it ends.
    pub fn ended(mut self, share: f64) -> (Self, f64) {
        let least = share * self.0[0];
        for value in &mut self.0 {
            *value = (*value - least).max(0.0);
        }
        let end = self.0.iter().position(|v| *v == 0.0).unwrap_or(STEPS);
        (self, (PI * end as f64 / STEPS as f64).cos())
    }
}

/// Time of a kernel whose angles from the centre are Gaussian with standard deviation `sigma` along each axis.
pub(super) fn time_of(sigma: f64) -> f64 {
    sigma * sigma / 2.0
}

/// The heat kernel on the unit sphere at time `t`, per steradian.
fn heat_kernel(cosine: f64, t: f64) -> f64 {
    let (mut sum, mut before, mut legendre) = (1.0, 1.0, cosine);
    for l in 1..=2000 {
        let l = f64::from(l);
        let damping = (-l * (l + 1.0) * t).exp();
        if damping < 1e-14 {
            break;
        }
        sum += (2.0 * l + 1.0) * damping * legendre;
        let next = ((2.0 * l + 1.0) * cosine * legendre - l * before) / (l + 1.0);
        (before, legendre) = (legendre, next);
    }
    sum / (4.0 * PI)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn heat_kernels_are_footprints_of_the_spread_they_should_have() {
        for spread_deg in [3.0f64, 10.0, 25.0] {
            let t = spread_deg.to_radians().powi(2) / 4.0;
            let (mut sum, mut square) = (0.0, 0.0);
            let n = 20_000;
            for i in 0..n {
                let angle = PI * (f64::from(i) + 0.5) / f64::from(n);
                let ring = std::f64::consts::TAU * angle.sin() * PI / f64::from(n);
                let value = heat_kernel(angle.cos(), t) * ring;
                sum += value;
                square += value * angle * angle;
            }
            assert!((sum - 1.0).abs() < 1e-6, "{spread_deg}°: {sum}");
            let spread = square.sqrt().to_degrees();
            assert!((spread / spread_deg - 1.0).abs() < 0.02, "{spread_deg}° became {spread}°");
        }
    }

    #[test]
    fn an_ended_kernel_has_no_step_and_loses_next_to_nothing() {
        let t = time_of(5f64.to_radians());
        let (whole, (ended, end)) = (HeatKernel::new(t), HeatKernel::new(t).ended(1e-5));
        let rest = |cosine: f64| ended.at(cosine) / whole.at(1.0);
        assert!(rest(end) < 1e-9 && rest(end - 1e-3) == 0.0 && (0.0..1e-4).contains(&rest(end + 1e-3)));
        for degrees in [0.0f64, 3.0, 10.0, 20.0] {
            let cosine = degrees.to_radians().cos();
            assert!((whole.at(cosine) - ended.at(cosine)).abs() <= 1.001e-5 * whole.at(1.0));
        }
    }
}
