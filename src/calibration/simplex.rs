//! A minimum of a function of few numbers without its gradient (Nelder and Mead 1965).

/// Walks downhill from `start`, with first steps of `steps`, for at most `evaluations` calls, until the
/// simplex is smaller than a thousandth of `steps`. The function may be +∞ where it is not defined.
/// Returns the best point and its value.
pub(super) fn minimise<const N: usize>(
    function: impl Fn([f64; N]) -> f64,
    start: [f64; N],
    steps: [f64; N],
    evaluations: usize,
) -> ([f64; N], f64) {
    let mut simplex = vec![(start, function(start))];
    for axis in 0..N {
        let mut point = start;
        point[axis] += steps[axis];
        simplex.push((point, function(point)));
    }
    let mut calls = N + 1;
    while calls < evaluations {
        simplex.sort_by(|a, b| a.1.total_cmp(&b.1));
        let (best, worst) = (simplex[0], simplex[N]);
        let size = (0..N).map(|axis| {
            simplex
                .iter()
                .map(|(p, _)| ((p[axis] - best.0[axis]) / steps[axis]).abs())
                .fold(0.0, f64::max)
        });
        if size.fold(0.0, f64::max) < 1e-3 {
            break;
        }
        let center: [f64; N] = std::array::from_fn(|axis| {
            simplex[..N].iter().map(|(p, _)| p[axis]).sum::<f64>() / N as f64
        });
        let along = |t: f64| -> ([f64; N], f64) {
            let point =
                std::array::from_fn(|axis| center[axis] + t * (worst.0[axis] - center[axis]));
            (point, function(point))
        };
        let reflected = along(-1.0);
        calls += 1;
        let better = if reflected.1 < best.1 {
            calls += 1;
            let expanded = along(-2.0);
            if expanded.1 < reflected.1 {
                expanded
            } else {
                reflected
            }
        } else if reflected.1 < simplex[N - 1].1 {
            reflected
        } else {
            calls += 1;
            along(if reflected.1 < worst.1 { -0.5 } else { 0.5 })
        };
        if better.1 < worst.1 {
            simplex[N] = better;
        } else {
            for vertex in &mut simplex[1..] {
                let point = std::array::from_fn(|axis| 0.5 * (vertex.0[axis] + best.0[axis]));
                *vertex = (point, function(point));
                calls += 1;
            }
        }
    }
    simplex
        .into_iter()
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .unwrap_or((start, f64::INFINITY))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bottom_of_a_curved_valley_is_found() {
        let rosenbrock = |[x, y]: [f64; 2]| (1.0 - x).powi(2) + 100.0 * (y - x * x).powi(2);
        let ([x, y], value) = minimise(rosenbrock, [-1.2, 1.0], [0.3, 0.3], 500);
        assert!(
            (x - 1.0).abs() < 1e-2 && (y - 1.0).abs() < 1e-2 && value < 1e-4,
            "({x}, {y}): {value}"
        );
    }

    #[test]
    fn a_wall_is_not_crossed() {
        let walled = |[x]: [f64; 1]| if x < 2.0 { f64::INFINITY } else { x };
        assert!((minimise(walled, [3.0], [0.5], 200).0[0] - 2.0).abs() < 1e-2);
    }
}
