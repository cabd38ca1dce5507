//! A few lamps of many, spread evenly: which OLATs to shoot, or to train with, when there is no time for
//! all.

use super::latlong::texel_direction;
use crate::error::{Error, Result};
use glam::Vec3;
use rayon::prelude::*;

/// Lamps chosen from a rig.
#[derive(Clone, Debug, PartialEq)]
pub struct Subset {
    /// Which lamps, in ascending order.
    pub indices: Vec<usize>,
    /// The largest angle in degrees from a direction that the whole rig covers to the nearest chosen lamp.
    /// The whole rig covers what is at most its spacing (the median angle between nearest neighbours) away
    /// from one of its lamps. Sampled every 2°, so that up to 1° may be missing.
    pub covering_deg: f32,
    /// The smallest angle between two chosen lamps in degrees; 180 where only one is chosen.
    pub separation_deg: f32,
}

/// Chooses `count` lamps of a rig with the given unit directions, as evenly as it can be: every direction
/// that the rig covers should have a chosen lamp near it. The first choice takes the farthest lamp from
/// those chosen, again and again (Gonzalez 1985); then a chosen lamp is swapped for another as long as
/// that lowers Σ angle⁸ over the covered directions, of which the farthest make nearly all (the swaps are
/// searched as in FasterPAM, Schubert and Rousseeuw 2021). The same input gives the same choice.
///
/// # Errors
/// When `count` is 0 or more than there are lamps, or a direction is not of unit length.
pub fn choose(directions: &[Vec3], count: usize) -> Result<Subset> {
    if count == 0 || count > directions.len() {
        return Err(Error::unexpected(
            "the number of lamps to choose",
            format!("1 to {}, as many as the rig has", directions.len()),
            count.to_string(),
            "Choose another number",
        ));
    }
    if let Some(lamp) = directions.iter().position(|d| !d.is_normalized()) {
        return Err(Error::unexpected(
            format!("lamp {lamp} of the rig"),
            "a direction of unit length",
            directions[lamp].to_string(),
            "Leave lamps out that the mirror ball did not show",
        ));
    }
    let mut chosen = farthest_points(directions, count);
    let samples = covered(directions);
    improve(directions, &samples, &mut chosen);
    chosen.sort_unstable();
    Ok(measure(directions, &samples, chosen))
}

/// The chosen lamps' covering and separation.
fn measure(directions: &[Vec3], samples: &[Vec3], indices: Vec<usize>) -> Subset {
    let nearest = |sample: &Vec3| {
        indices
            .iter()
            .map(|&i| angle(directions[i], *sample))
            .fold(std::f32::consts::PI, f32::min)
    };
    let covering = samples.par_iter().map(nearest).reduce(|| 0.0, f32::max);
    let pairs = indices
        .iter()
        .enumerate()
        .flat_map(|(k, &i)| indices[k + 1..].iter().map(move |&j| (i, j)));
    let separation = pairs
        .map(|(i, j)| angle(directions[i], directions[j]))
        .fold(std::f32::consts::PI, f32::min);
    Subset {
        covering_deg: covering.to_degrees(),
        separation_deg: separation.to_degrees(),
        indices,
    }
}

/// The angle between unit vectors: exact for small ones too.
fn angle(a: Vec3, b: Vec3) -> f32 {
    2.0 * (0.5 * a.distance(b)).min(1.0).asin()
}

/// The farthest lamp from all that were chosen, `count` times. The first is the one nearest to where most
/// of the rig is; a rig without such a side begins with its first lamp.
fn farthest_points(directions: &[Vec3], count: usize) -> Vec<usize> {
    let towards: Vec3 = directions.iter().sum();
    let mut chosen: Vec<usize> = Vec::with_capacity(count);
    let mut nearest = vec![f32::INFINITY; directions.len()];
    for _ in 0..count {
        let next = if chosen.is_empty() {
            argmax(directions.iter().map(|d| d.dot(towards)))
        } else {
            argmax(nearest.iter().copied())
        };
        chosen.push(next);
        for (nearest, direction) in nearest.iter_mut().zip(directions) {
            *nearest = nearest.min(direction.distance_squared(directions[next]));
        }
        // Below any distance: a lamp beside a chosen one may be chosen, the same lamp never.
        nearest[next] = -1.0;
    }
    chosen
}

/// The first place of the largest value.
fn argmax(values: impl Iterator<Item = f32>) -> usize {
    let mut best = (0, f32::NEG_INFINITY);
    for (i, value) in values.enumerate() {
        if value > best.1 {
            best = (i, value);
        }
    }
    best.0
}

/// Directions every 2° that the rig covers, and its lamps.
fn covered(directions: &[Vec3]) -> Vec<Vec3> {
    const ROWS: usize = 90;
    let neighbour = |(i, a): (usize, &Vec3)| {
        let others = directions.iter().enumerate().filter(|(j, _)| *j != i);
        others
            .map(|(_, b)| angle(*a, *b))
            .fold(std::f32::consts::PI, f32::min)
    };
    let mut spacings: Vec<f32> = directions.par_iter().enumerate().map(neighbour).collect();
    spacings.sort_by(f32::total_cmp);
    let spacing = spacings[spacings.len() / 2];
    let rows = (0..ROWS).flat_map(|y| {
        // As many columns as make the row's texels about square.
        let polar = std::f32::consts::PI * (y as f32 + 0.5) / ROWS as f32;
        let width = (2.0 * ROWS as f32 * polar.sin()).ceil() as usize;
        (0..width).map(move |x| texel_direction(x, y, width, ROWS))
    });
    let rows: Vec<Vec3> = rows.collect();
    let near = |sample: &Vec3| directions.iter().any(|d| angle(*d, *sample) <= spacing);
    rows.into_par_iter()
        .filter(near)
        .chain(directions.par_iter().copied())
        .collect()
}

/// Swaps chosen lamps for others until no swap lowers the cost.
fn improve(directions: &[Vec3], samples: &[Vec3], chosen: &mut [usize]) {
    let cost_of = |lamp: usize| -> Vec<f32> {
        samples
            .iter()
            .map(|s| angle(directions[lamp], *s).powi(8))
            .collect()
    };
    let costs: Vec<Vec<f32>> = (0..directions.len()).into_par_iter().map(cost_of).collect();
    // Each swap lowers the cost, so that none returns; the bound is for equal costs by rounding.
    for _ in 0..20 * directions.len() {
        let near: Vec<Near> = (0..samples.len())
            .into_par_iter()
            .map(|sample| Near::of(sample, &costs, chosen))
            .collect();
        // What it costs to lose each chosen lamp, if nothing comes in its place.
        let mut loss = vec![0.0f64; chosen.len()];
        let mut now = 0.0f64;
        for near in &near {
            loss[near.first] += f64::from(near.second_cost) - f64::from(near.first_cost);
            now += f64::from(near.first_cost);
        }
        let best = (0..directions.len())
            .into_par_iter()
            .filter(|lamp| !chosen.contains(lamp))
            .map(|lamp| {
                let mut change = loss.clone();
                let mut gain = 0.0f64;
                for (near, cost) in near.iter().zip(&costs[lamp]) {
                    let [cost, first, second] =
                        [*cost, near.first_cost, near.second_cost].map(f64::from);
                    if cost < first {
                        gain += cost - first;
                        change[near.first] += first - second;
                    } else if cost < second {
                        change[near.first] += cost - second;
                    }
                }
                let place = argmax(change.iter().map(|c| -c as f32));
                (change[place] + gain, lamp, place)
            })
            .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        match best {
            Some((change, lamp, place)) if change < -1e-6 * now => chosen[place] = lamp,
            _ => return,
        }
    }
}

/// The chosen lamps nearest to a sample.
struct Near {
    /// Place of the nearest among the chosen.
    first: usize,
    first_cost: f32,
    /// Of the second nearest; where only one is chosen, all of the sphere away.
    second_cost: f32,
}

impl Near {
    fn of(sample: usize, costs: &[Vec<f32>], chosen: &[usize]) -> Self {
        let far = std::f32::consts::PI.powi(8);
        let mut near = Self {
            first: 0,
            first_cost: f32::INFINITY,
            second_cost: far,
        };
        for (place, &lamp) in chosen.iter().enumerate() {
            let cost = costs[lamp][sample];
            if cost < near.first_cost {
                near.second_cost = near.first_cost.min(far);
                (near.first, near.first_cost) = (place, cost);
            } else {
                near.second_cost = near.second_cost.min(cost);
            }
        }
        near
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::virtual_stage::dome::Dome;
    use proptest::prelude::*;

    /// Directions drawn evenly over the sphere.
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
        let half: Vec<Vec3> = Dome::new(292)
            .banks
            .into_iter()
            .filter(|d| d.y > 0.0)
            .collect();
        vec![
            ("dome of 146", dome),
            ("half dome of 146", half),
            ("146 at random", random(146, 3)),
            ("300 at random", random(300, 8)),
            (
                "half of 300 at random",
                random(300, 5).into_iter().filter(|d| d.z > 0.0).collect(),
            ),
        ]
    }

    fn greedy(directions: &[Vec3], count: usize) -> Subset {
        let samples = covered(directions);
        measure(directions, &samples, farthest_points(directions, count))
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
                let samples = covered(&directions);
                // The best of 20 random choices.
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
                let figures =
                    |s: &Subset| format!("{:5.1}° / {:4.1}°", s.covering_deg, s.separation_deg);
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
