//! The least-squares fit of the lamps' footprints to an environment.
//!
//! Footprints and blur are heat kernels h_t on the sphere, h_t(cos θ) = Σ_l (2l+1)/4π · e^(−l(l+1)t) · P_l(cos θ),
//! for which blurring is adding: h_s ∗ h_t = h_(s+t) (each Legendre term is damped by itself). So all inner
//! products between blurred footprints and the blurred environment have a closed form, and only the environment
//! itself is sampled. h_t has a mean square angle of 4t from its centre, for t well below 1.

use super::super::Rig;
use super::nodes::Nodes;
use glam::DVec3;
use rayon::prelude::*;

/// The footprints of a rig's lamps, ready to be fitted.
#[derive(Clone)]
pub(super) struct Fit {
    directions: Vec<DVec3>,
    /// Inner products between blurred footprints, row by row.
    gram: Vec<f64>,
    /// Per node the inner product of its blurred footprint with a blurred point of light, by the angle
    /// between them: [`STEPS`] + 1 values from 0 to π.
    agreements: Vec<Vec<f32>>,
}

/// Steps of [`Fit::agreements`]: at 0.09° each, linear interpolation is good to 1e-4 for the sharpest.
const STEPS: usize = 2048;

impl Fit {
    /// The footprints of the directions that hold lamps.
    pub fn of(rig: &Rig, nodes: &Nodes) -> Self {
        let directions: Vec<DVec3> = nodes.real().copied().collect();
        // A Gaussian of half the spacing: footprints overlap just enough to close the gaps. Below 2° the panorama's
        // texels would show, and 30° blur a hemisphere already.
        let sigma = (0.5 * nodes.spacing()).clamp(2.0f64.to_radians(), 30.0f64.to_radians());
        let blur = sigma * sigma / 2.0;
        let time = |lamps: &Vec<usize>| {
            let square = |&lamp: &usize| {
                let spread = f64::from(rig.lamps[lamp].spread_deg).to_radians();
                if spread.is_finite() {
                    spread * spread
                } else {
                    0.0
                }
            };
            let mean = lamps.iter().map(square).sum::<f64>() / lamps.len().max(1) as f64;
            (mean / 4.0).min(0.25)
        };
        let times: Vec<f64> = nodes.lamps.iter().map(time).collect();
        let n = directions.len();
        let gram = (0..n * n)
            .into_par_iter()
            .map(|at| {
                // The same number for i, j and j, i.
                let (i, j) = ((at / n).min(at % n), (at / n).max(at % n));
                heat_kernel(
                    directions[i].dot(directions[j]),
                    times[i] + times[j] + 2.0 * blur,
                )
            })
            .collect();
        let agreements = times
            .par_iter()
            .map(|time| {
                (0..=STEPS)
                    .map(|i| {
                        let angle = std::f64::consts::PI * i as f64 / STEPS as f64;
                        heat_kernel(angle.cos(), time + 2.0 * blur).max(0.0) as f32
                    })
                    .collect()
            })
            .collect();
        Self {
            directions,
            gram,
            agreements,
        }
    }

    /// Which nodes' blurred footprints agree with a blurred point of light there, and how well. Values below a
    /// hundred-thousandth of the best possible are left out.
    pub fn agreement(&self, direction: DVec3) -> Vec<(u16, f32)> {
        let mut agreement = Vec::new();
        for (node, (lamp, table)) in self.directions.iter().zip(&self.agreements).enumerate() {
            let place = lamp.angle_between(direction) / std::f64::consts::PI * STEPS as f64;
            let below = (place as usize).min(STEPS - 1);
            let fraction = (place - below as f64) as f32;
            let value = (1.0 - fraction) * table[below] + fraction * table[below + 1];
            if value > 1e-5 * table[0] {
                agreement.push((node as u16, value));
            }
        }
        agreement
    }

    /// The nodes' energies, per channel: not negative and of sum `total`.
    pub fn energies(&self, agreement: &[[f64; 3]], total: [f64; 3]) -> Vec<[f64; 3]> {
        let channels = [0, 1, 2].map(|c| {
            let target: Vec<f64> = agreement.iter().map(|a| a[c]).collect();
            simplex_least_squares(&self.gram, &target, total[c])
        });
        (0..agreement.len())
            .map(|i| [0, 1, 2].map(|c| channels[c][i]))
            .collect()
    }
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
    sum / (4.0 * std::f64::consts::PI)
}

/// The x ≥ 0 of Σx = `total` that minimises ½·xᵀGx − targetᵀx. In each step the two unknowns that gain
/// most from it exchange an exact amount (second-order working sets, Fan, Chen and Lin 2005), so the sum
/// is kept all the way; with G positive definite there is one minimum, and it moves continuously.
fn simplex_least_squares(gram: &[f64], target: &[f64], total: f64) -> Vec<f64> {
    let n = target.len();
    if n == 0 || total.is_nan() || total <= 0.0 {
        return vec![0.0; n];
    }
    let mut x = vec![total / n as f64; n];
    let row = |i: usize| &gram[i * n..(i + 1) * n];
    let mut gain: Vec<f64> = (0..n)
        .map(|i| target[i] - row(i).iter().sum::<f64>() * total / n as f64)
        .collect();
    // An exchange with less than this share of the largest possible gain changes no weight noticeably.
    let enough = 1e-10 * (0..n).map(|i| row(i)[i]).fold(0.0, f64::max) * total;
    for _ in 0..1000 * n {
        let up = (0..n)
            .max_by(|&i, &j| gain[i].total_cmp(&gain[j]))
            .unwrap_or(0);
        let mut best = (0.0, up, 0.0);
        let mut gap = 0.0f64;
        for down in (0..n).filter(|&j| x[j] > 0.0) {
            let difference = gain[up] - gain[down];
            gap = gap.max(difference);
            // Two equal footprints have no curvature between them.
            let curvature =
                (row(up)[up] + row(down)[down] - 2.0 * row(up)[down]).max(1e-12 * row(up)[up]);
            let improvement = difference * difference / curvature;
            if difference > 0.0 && improvement > best.0 {
                best = (improvement, down, (difference / curvature).min(x[down]));
            }
        }
        let (_, down, step) = best;
        if gap <= enough || step <= 0.0 {
            break;
        }
        x[up] += step;
        x[down] = if step >= x[down] { 0.0 } else { x[down] - step };
        for (gain, (a, b)) in gain.iter_mut().zip(row(up).iter().zip(row(down))) {
            *gain -= step * (a - b);
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn heat_kernels_are_footprints_of_the_spread_they_should_have() {
        for spread_deg in [3.0f64, 10.0, 25.0] {
            let t = spread_deg.to_radians().powi(2) / 4.0;
            let (mut sum, mut square) = (0.0, 0.0);
            let n = 20_000;
            for i in 0..n {
                let angle = std::f64::consts::PI * (f64::from(i) + 0.5) / f64::from(n);
                let ring =
                    std::f64::consts::TAU * angle.sin() * std::f64::consts::PI / f64::from(n);
                let value = heat_kernel(angle.cos(), t) * ring;
                sum += value;
                square += value * angle * angle;
            }
            assert!((sum - 1.0).abs() < 1e-6, "{spread_deg}°: {sum}");
            let spread = square.sqrt().to_degrees();
            assert!(
                (spread / spread_deg - 1.0).abs() < 0.02,
                "{spread_deg}° became {spread}°"
            );
        }
    }

    proptest! {
        #[test]
        fn no_exchange_between_lamps_betters_the_fit(
            (n, cells) in (1usize..25).prop_flat_map(|n| (Just(n), proptest::collection::vec(-1.0f64..1.0, n * 30))),
            target in proptest::collection::vec(0.0f64..2.0, 25), total in 0.01f64..50.0,
        ) {
            let gram: Vec<f64> = (0..n * n)
                .map(|at| (0..30).map(|p| cells[at / n * 30 + p] * cells[at % n * 30 + p]).sum())
                .collect();
            let x = simplex_least_squares(&gram, &target[..n], total);
            prop_assert!(x.iter().all(|x| *x >= 0.0));
            prop_assert!((x.iter().sum::<f64>() / total - 1.0).abs() < 1e-9);
            let gain: Vec<f64> = (0..n)
                .map(|i| target[i] - (0..n).map(|j| gram[i * n + j] * x[j]).sum::<f64>())
                .collect();
            let most = gain.iter().copied().fold(f64::MIN, f64::max);
            let largest = (0..n).map(|i| gram[i * n + i]).fold(0.0, f64::max);
            for i in (0..n).filter(|&i| x[i] > 1e-9 * total) {
                prop_assert!(most - gain[i] <= 1e-8 * largest * total, "{} is left to gain", most - gain[i]);
            }
        }
    }

    #[test]
    fn forty_one_equal_footprints_share() {
        let x = simplex_least_squares(&[2.0; 41 * 41], &[1.0; 41], 8.2);
        assert!(x.iter().all(|x| (x - 0.2).abs() < 1e-9), "{x:?}");
    }
}
