//! Even selection of a few lamps: the OLATs to shoot or train with when time is short.

use super::latlong::texel_direction;
use base::error::{Error, Result};
use glam::Vec3;
use rayon::prelude::*;

/// Lamps chosen from a rig.
#[derive(Clone, Debug, PartialEq)]
pub struct Subset {
    /// Indices of the chosen lamps, in ascending order.
    pub indices: Vec<usize>,
    /// Largest angle in degrees from a covered direction to the nearest chosen lamp. A direction is covered if a
    /// lamp of the full rig is within the rig's spacing (the median angle between nearest neighbours). Sampled
    /// every 2°, so it may be up to 1° too small.
    pub covering_deg: f32,
    /// Smallest angle between two chosen lamps in degrees; 180 for a single lamp.
    pub separation_deg: f32,
}

/// Chooses `count` lamps of a rig with the given unit directions, as evenly as possible: a chosen lamp near every
/// covered direction, and no two chosen lamps close together. The first choice repeatedly adds the lamp farthest
/// from those already chosen (Gonzalez 1985). Lamps are then swapped while that lowers the cost; the best swap is
/// found as in FasterPAM (Schubert and Rousseeuw 2021). The result is the most even of several choices with
/// different first lamps. Deterministic.
///
/// # Errors
/// When `count` is 0 or exceeds the number of lamps, or a direction is not of unit length.
pub fn choose(directions: &[Vec3], count: usize) -> Result<Subset> {
    if count == 0 || count > directions.len() {
        return Err(Error::invalid(
            format!("cannot choose {count} lamps from {}", directions.len()),
            "Choose at least 1 and at most all of them",
        ));
    }
    if let Some(lamp) = directions.iter().position(|d| !d.is_normalized()) {
        return Err(Error::invalid(
            format!("direction of lamp {lamp} is not of unit length: {}", directions[lamp]),
            "Leave out lamps that the mirror ball did not show",
        ));
    }
    /// Number of choices with different first lamps. More gain little.
    const STARTS: usize = 8;
    let (samples, share) = covered(directions);
    let cost = Cost::new(directions, &samples, share, count);
    let starts = (0..STARTS).map(|start| {
        let mut chosen = farthest_points(directions, count, start * directions.len() / STARTS);
        cost.lower(&mut chosen);
        chosen.sort_unstable();
        measure(directions, &samples, chosen)
    });
    // In the most even layout, hexagons, the covering is 1/√3 of the separation.
    let excess = |s: &Subset| s.covering_deg - s.separation_deg / 3f32.sqrt();
    let best = starts.min_by(|a, b| excess(a).total_cmp(&excess(b)));
    Ok(best.unwrap_or_else(|| measure(directions, &samples, (0..count).collect())))
}

/// Covering and separation of the chosen lamps.
fn measure(directions: &[Vec3], samples: &[Vec3], indices: Vec<usize>) -> Subset {
    let nearest =
        |sample: &Vec3| indices.iter().map(|&i| angle(directions[i], *sample)).fold(std::f32::consts::PI, f32::min);
    let covering = samples.par_iter().map(nearest).reduce(|| 0.0, f32::max);
    let pairs = indices.iter().enumerate().flat_map(|(k, &i)| indices[k + 1..].iter().map(move |&j| (i, j)));
    let separation = pairs.map(|(i, j)| angle(directions[i], directions[j])).fold(std::f32::consts::PI, f32::min);
    Subset { covering_deg: covering.to_degrees(), separation_deg: separation.to_degrees(), indices }
}

/// Angle between unit vectors; precise for small angles.
fn angle(a: Vec3, b: Vec3) -> f32 {
    2.0 * (0.5 * a.distance(b)).min(1.0).asin()
}

/// `first`, then repeatedly the lamp farthest from all chosen ones, up to `count`.
fn farthest_points(directions: &[Vec3], count: usize, first: usize) -> Vec<usize> {
    let mut chosen: Vec<usize> = Vec::with_capacity(count);
    let mut nearest = vec![f32::INFINITY; directions.len()];
    let mut next = first;
    for _ in 0..count {
        chosen.push(next);
        for (nearest, direction) in nearest.iter_mut().zip(directions) {
            *nearest = nearest.min(direction.distance_squared(directions[next]));
        }
        // Below any distance, so the same lamp is never chosen twice, but a coincident one may be.
        nearest[next] = -1.0;
        next = argmax(nearest.iter().copied());
    }
    chosen
}

/// First index of the largest value.
fn argmax(values: impl Iterator<Item = f32>) -> usize {
    let mut best = (0, f32::NEG_INFINITY);
    for (i, value) in values.enumerate() {
        if value > best.1 {
            best = (i, value);
        }
    }
    best.0
}

/// Covered directions every 2°, and their share of the sphere.
fn covered(directions: &[Vec3]) -> (Vec<Vec3>, f32) {
    const ROWS: usize = 90;
    let neighbour = |(i, a): (usize, &Vec3)| {
        let others = directions.iter().enumerate().filter(|(j, _)| *j != i);
        others.map(|(_, b)| angle(*a, *b)).fold(std::f32::consts::PI, f32::min)
    };
    let mut spacings: Vec<f32> = directions.par_iter().enumerate().map(neighbour).collect();
    spacings.sort_by(f32::total_cmp);
    let spacing = spacings[spacings.len() / 2];
    let rows = (0..ROWS).flat_map(|y| {
        // Enough columns for roughly square texels in the row.
        let polar = std::f32::consts::PI * (y as f32 + 0.5) / ROWS as f32;
        let width = (2.0 * ROWS as f32 * polar.sin()).ceil() as usize;
        (0..width).map(move |x| texel_direction(x, y, width, ROWS))
    });
    let rows: Vec<Vec3> = rows.collect();
    let near = |sample: &Vec3| directions.iter().any(|d| angle(*d, *sample) <= spacing);
    let all = rows.len() as f32;
    let mut samples: Vec<Vec3> = rows.into_par_iter().filter(near).collect();
    let share = samples.len() as f32 / all;
    // A rig with all lamps in one direction covers less than the sample spacing.
    samples.extend(directions);
    (samples, share.max(1e-3))
}

/// Unevenness of a choice, in two terms. The first is the mean of (θ/r)¹⁶ over the covered directions, with θ the
/// angle to the nearest chosen lamp; the farthest directions dominate it. The second is ε/N·Σ(d/θ)¹⁶ over the pairs
/// of N chosen lamps. r and d are the radius and spacing of N even cells. ε makes separation count less than
/// covering.
struct Cost<'a> {
    directions: &'a [Vec3],
    /// For each lamp, the first term of each sample if that lamp were the nearest chosen one.
    far: Vec<Vec<f32>>,
    radius: f32,
    /// Factor of the second term.
    near: f64,
}

impl<'a> Cost<'a> {
    fn new(directions: &'a [Vec3], samples: &[Vec3], share: f32, count: usize) -> Self {
        const EPSILON: f64 = 0.1;
        let radius = (1.0 - 2.0 * share / count as f32).max(-1.0).acos();
        let far = |lamp: &Vec3| {
            let ratios = samples.iter().map(|s| angle(*lamp, *s) / radius);
            ratios.map(power).collect()
        };
        Self {
            directions,
            far: directions.par_iter().map(far).collect(),
            radius,
            near: EPSILON * samples.len() as f64 / count as f64,
        }
    }

    /// Second term for a pair of lamps.
    fn nearness(&self, a: usize, b: usize) -> f64 {
        // The spacing of hexagons is 1.9 times the radius of a circle with the same area.
        let spacing = 1.9 * self.radius;
        let angle = angle(self.directions[a], self.directions[b]);
        self.near * f64::from(power(spacing / angle.max(1e-6)))
    }

    /// Swaps chosen lamps for others until no swap lowers the cost.
    fn lower(&self, chosen: &mut [usize]) {
        let lamps = self.directions.len();
        // Every swap lowers the cost, so the loop ends; the bound limits the time.
        for _ in 0..lamps {
            let nearest: Vec<Nearest> =
                (0..self.far[0].len()).into_par_iter().map(|sample| Nearest::new(sample, &self.far, chosen)).collect();
            // Change of the cost from removing each chosen lamp without a replacement.
            let closeness = |&lamp: &usize| -> f64 {
                let others = chosen.iter().filter(|other| **other != lamp);
                others.map(|&other| self.nearness(lamp, other)).sum()
            };
            let closeness: Vec<f64> = chosen.iter().map(closeness).collect();
            let mut loss: Vec<f64> = closeness.iter().map(|c| -c).collect();
            let mut now = 0.5 * closeness.iter().sum::<f64>();
            for near in &nearest {
                loss[near.place] += near.second - near.first;
                now += near.first;
            }
            let best = (0..lamps)
                .into_par_iter()
                .filter(|lamp| !chosen.contains(lamp))
                .map(|lamp| {
                    let (place, change) = self.best_swap(lamp, chosen, &nearest, loss.clone());
                    (change, lamp, place)
                })
                .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            match best {
                Some((change, lamp, place)) if change < -1e-6 * now => chosen[place] = lamp,
                _ => return,
            }
        }
    }

    /// The best chosen lamp to swap for `lamp`, and the change of the cost.
    fn best_swap(&self, lamp: usize, chosen: &[usize], nearest: &[Nearest], mut change: Vec<f64>) -> (usize, f64) {
        let mut gain = 0.0f64;
        for (near, cost) in nearest.iter().zip(&self.far[lamp]) {
            let cost = f64::from(*cost);
            if cost < near.first {
                gain += cost - near.first;
                change[near.place] += near.first - near.second;
            } else if cost < near.second {
                change[near.place] += cost - near.second;
            }
        }
        for (change, &other) in change.iter_mut().zip(chosen) {
            let nearness = self.nearness(lamp, other);
            gain += nearness;
            *change -= nearness;
        }
        let mut best = (0, f64::INFINITY);
        for (place, change) in change.into_iter().enumerate() {
            if change < best.1 {
                best = (place, change);
            }
        }
        (best.0, best.1 + gain)
    }
}

/// x¹⁶, limited so that f32 sums stay finite.
fn power(x: f32) -> f32 {
    x.min(100.0).powi(16)
}

/// The nearest chosen lamps of a sample.
struct Nearest {
    /// Index of the nearest among the chosen lamps.
    place: usize,
    /// Cost of the sample, and its cost without its nearest lamp.
    first: f64,
    second: f64,
}

impl Nearest {
    fn new(sample: usize, costs: &[Vec<f32>], chosen: &[usize]) -> Self {
        let (mut place, mut first, mut second) = (0, f32::INFINITY, f32::INFINITY);
        for (candidate, &lamp) in chosen.iter().enumerate() {
            let cost = costs[lamp][sample];
            if cost < first {
                second = first;
                (place, first) = (candidate, cost);
            } else {
                second = second.min(cost);
            }
        }
        if chosen.len() == 1 {
            // A single lamp is swapped, never removed. No other lamp costs more than this.
            second = costs.iter().map(|cost| cost[sample]).fold(first, f32::max);
        }
        Self { place, first: first.into(), second: second.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use virtual_stage::dome::Dome;

    /// Directions distributed uniformly over the sphere.
    fn random(n: usize, seed: u64) -> Vec<Vec3> {
        let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
        let mut unit = move || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        (0..n)
            .map(|_| {
                let (y, turn) = (2.0 * unit() - 1.0, std::f32::consts::TAU * unit());
                let radius = (1.0 - y * y).max(0.0).sqrt();
                Vec3::new(radius * turn.cos(), y, radius * turn.sin()).normalize()
            })
            .collect()
    }

    fn rigs() -> Vec<(&'static str, Vec<Vec3>)> {
        let dome = Dome::new(146).banks;
        let half: Vec<Vec3> = Dome::new(292).banks.into_iter().filter(|d| d.y > 0.0).collect();
        vec![
            ("dome of 146", dome),
            ("half dome of 146", half),
            ("146 at random", random(146, 3)),
            ("300 at random", random(300, 8)),
            ("half of 300 at random", random(300, 5).into_iter().filter(|d| d.z > 0.0).collect()),
        ]
    }

    fn greedy(directions: &[Vec3], count: usize) -> Subset {
        let (samples, _) = covered(directions);
        measure(directions, &samples, farthest_points(directions, count, 0))
    }

    #[test]
    fn swaps_are_clearly_better_than_greed_alone() {
        let (mut gain, mut cases) = (0.0, 0.0);
        for (name, directions) in rigs() {
            for count in [12, 41] {
                let start = std::time::Instant::now();
                let chosen = choose(&directions, count).unwrap();
                let ms = start.elapsed().as_secs_f64() * 1e3;
                let greedy = greedy(&directions, count);
                let (samples, _) = covered(&directions);
                // Best of 20 random choices.
                let lucky = (0..20u64)
                    .map(|seed| {
                        let order = random(directions.len(), 100 + seed);
                        let mut indices: Vec<usize> = (0..directions.len()).collect();
                        indices.sort_by(|&i, &j| order[i].x.total_cmp(&order[j].x));
                        indices.truncate(count);
                        measure(&directions, &samples, indices)
                    })
                    .min_by(|a, b| a.covering_deg.total_cmp(&b.covering_deg))
                    .unwrap();
                let figures = |s: &Subset| format!("{:5.1}° / {:4.1}°", s.covering_deg, s.separation_deg);
                println!(
                    "{count} of {name}: covering / separation {} in {ms:.0} ms; greedy {}; best of 20 random {}",
                    figures(&chosen),
                    figures(&greedy),
                    figures(&lucky)
                );
                assert!(chosen.covering_deg <= greedy.covering_deg + 0.01);
                assert!(chosen.covering_deg < lucky.covering_deg);
                gain += greedy.covering_deg / chosen.covering_deg;
                cases += 1.0;
            }
        }
        println!("greedy covers {:.2} times as far on average", gain / cases);
        assert!(gain / cases > 1.1);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        #[test]
        fn as_many_lamps_as_asked_for_and_none_twice(n in 1usize..60, seed in 0u64..1000, share in 0.0f32..1.0) {
            let directions = random(n, seed);
            let count = 1 + (share * (n - 1) as f32) as usize;
            let chosen = choose(&directions, count).unwrap();
            prop_assert_eq!(chosen.indices.len(), count);
            prop_assert!(chosen.indices.windows(2).all(|w| w[0] < w[1]) && chosen.indices.iter().all(|&i| i < n));
            prop_assert_eq!(&choose(&directions, count).unwrap(), &chosen);
        }
    }

    #[test]
    fn one_lamp_of_a_cone_is_its_middle() {
        let directions: Vec<Vec3> = Dome::new(400).banks.into_iter().filter(|d| d.z > 0.8).collect();
        let chosen = choose(&directions, 1).unwrap();
        assert!(directions[chosen.indices[0]].z > 0.98, "{chosen:?}");
    }

    #[test]
    fn all_of_all_is_all() {
        let directions = Dome::new(41).banks;
        let chosen = choose(&directions, 41).unwrap();
        assert_eq!(chosen.indices, (0..41).collect::<Vec<_>>());
        assert!(chosen.covering_deg < 25.0);
    }

    #[test]
    fn lamps_in_one_direction_are_chosen_last() {
        let mut directions = Dome::new(20).banks;
        directions.extend(vec![directions[3]; 30]);
        let chosen = choose(&directions, 20).unwrap();
        assert!(chosen.separation_deg > 20.0, "{chosen:?}");
        assert_eq!(choose(&[Vec3::Y; 5], 5).unwrap().separation_deg, 0.0);
        assert_eq!(choose(&[Vec3::Y; 5], 1).unwrap().separation_deg, 180.0);
    }

    #[test]
    fn impossible_choices_are_refused() {
        let directions = Dome::new(6).banks;
        assert!(choose(&directions, 0).is_err() && choose(&directions, 7).is_err());
        assert!(choose(&[], 1).is_err());
        assert!(choose(&[Vec3::NAN, Vec3::Y], 1).is_err() && choose(&[Vec3::ZERO], 1).is_err());
    }
}
