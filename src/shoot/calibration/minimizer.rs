//! Gradient-free minimum of a function of a few variables: Powell's BOBYQA (2009), which stays within bounds and
//! needs few evaluations.

use base::error::{Error, Result};
use bobyqa::{Bobyqa, Config};

/// Region and step sizes of a search.
pub(super) struct Search<const N: usize> {
    pub start: [f64; N],
    /// Bounds of each variable.
    pub low: [f64; N],
    pub high: [f64; N],
    /// Step sizes at the start and at the end.
    pub first_step: f64,
    pub last_step: f64,
    /// Largest number of evaluations.
    pub evaluations: usize,
}

/// Minimum near the start, and the value there. The function must be finite within the bounds.
pub(super) fn minimise<const N: usize>(
    function: impl Fn([f64; N]) -> f64,
    search: &Search<N>,
) -> Result<([f64; N], f64)> {
    let mut config = Config::new(N);
    (config.rho_begin, config.rho_end) = (search.first_step, search.last_step);
    config.max_fun = search.evaluations;
    let fault = |status: bobyqa::Status| Error::bug(format!("the calibration's search cannot start ({status:?})"));
    let mut solver = Bobyqa::new(N, config).map_err(fault)?;
    let mut place = search.start;
    let found = solver.minimize(|x| function(std::array::from_fn(|i| x[i])), &mut place, &search.low, &search.high);
    Ok((place, found.f))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bottom_of_a_curved_valley_is_found() {
        let rosenbrock = |[x, y]: [f64; 2]| (1.0 - x).powi(2) + 100.0 * (y - x * x).powi(2);
        let search = Search {
            start: [-1.2, 1.0],
            low: [-3.0; 2],
            high: [3.0; 2],
            first_step: 0.3,
            last_step: 1e-6,
            evaluations: 500,
        };
        let ([x, y], value) = minimise(rosenbrock, &search).unwrap();
        assert!((x - 1.0).abs() < 1e-2 && (y - 1.0).abs() < 1e-2 && value < 1e-4);
    }

    #[test]
    fn a_bound_is_not_crossed() {
        let search = Search {
            start: [3.0, 3.0],
            low: [2.0; 2],
            high: [4.0; 2],
            first_step: 0.2,
            last_step: 1e-4,
            evaluations: 100,
        };
        let (place, _) = minimise(|[x, y]| x + y, &search).unwrap();
        assert!(place.iter().all(|x| (x - 2.0).abs() < 1e-9), "{place:?}");
    }
}
