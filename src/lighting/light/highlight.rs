//! Place on the subject where a light falls: the inverse of [`super::aim`].

use super::aim::LampResponses;
use glam::Vec3;

/// Largest number of sample points along the longer side of the picture.
const ALONG: usize = 48;
/// Largest angle from a light to the nearest aim, in lamp spacings. Beyond it the light misses the subject.
const FURTHEST: f32 = 1.5;

/// Points spread over the subject, each with the direction of its brightest light.
pub struct Highlights {
    points: Vec<([usize; 2], Vec3)>,
    /// Spacing of the points in pixels.
    step: usize,
    /// Largest angle in radians at which a light still hits a point.
    furthest: f32,
}

impl Highlights {
    /// Aims from points of the subject. Costs several hundred calls of [`LampResponses::aim`].
    pub fn from_responses(responses: &LampResponses) -> Self {
        let (width, height) = responses.size();
        let step = width.max(height).div_ceil(ALONG).max(1);
        let places = |length: usize| (step / 2..length).step_by(step);
        let points = places(height).flat_map(|y| places(width).map(move |x| [x, y]));
        let aimed = points.filter_map(|at| Some((at, responses.aim(at).ok()?)));
        Self { points: aimed.collect(), step, furthest: FURTHEST * responses.spacing() }
    }

    /// Column and row that a light from this unit direction falls on; None if it misses the subject, such as a
    /// light from behind.
    pub fn at(&self, direction: Vec3) -> Option<[f32; 2]> {
        let cosine = |aimed: Vec3| aimed.dot(direction);
        let nearest = self.points.iter().max_by(|a, b| cosine(a.1).total_cmp(&cosine(b.1)));
        let &([x, y], best) = nearest?;
        let best = cosine(best);
        // NaN misses too.
        let falls = best >= self.furthest.min(std::f32::consts::PI).cos();
        if !falls {
            return None;
        }
        // The place moves smoothly between points.
        let (mut sum, mut weights) = ([0.0f32; 2], 0.0f32);
        for &([column, row], aimed) in &self.points {
            if column.abs_diff(x) <= self.step && row.abs_diff(y) <= self.step {
                let width = (0.25 * self.furthest).max(f32::MIN_POSITIVE);
                let weight = ((cosine(aimed) - best) / (width * width)).exp();
                sum = [sum[0] + weight * column as f32, sum[1] + weight * row as f32];
                weights += weight;
            }
        }
        Some(sum.map(|sum| sum / weights))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Lamp, Rig};
    use imaging::{Image, Mask};

    const SIDE: usize = 96;

    /// Normal of a matt ball that fills the picture.
    fn normal(x: usize, y: usize) -> Option<Vec3> {
        let across = |i: usize| 1.05 * ((2 * i + 1) as f32 / SIDE as f32 - 1.0);
        let (x, y) = (across(x), -across(y));
        let depth = 1.0 - x * x - y * y;
        (depth > 0.0).then(|| Vec3::new(x, y, depth.sqrt()))
    }

    fn highlights(rig: &Rig) -> Highlights {
        let covered = |x, y| f32::from(u8::from(normal(x, y).is_some()));
        let matte = Mask::from_fn(SIDE, SIDE, covered);
        let olat = |i: usize| {
            let to: Vec3 = rig.lamps[i].direction;
            let facing = move |x, y| normal(x, y).map_or(0.0, |normal| normal.dot(to).max(0.0));
            Ok::<_, ()>(Image::from_fn(SIDE, SIDE, |x, y| [facing(x, y); 3]))
        };
        Highlights::from_responses(&LampResponses::new(rig, &matte, olat).unwrap())
    }

    fn rig(lamps: usize) -> Rig {
        let lamp = |i: usize| {
            let y = 1.0 - (2 * i + 1) as f32 / lamps as f32;
            let (turn, across) = (2.399_963 * i as f32, (1.0 - y * y).sqrt());
            let direction = Vec3::new(across * turn.cos(), y, across * turn.sin());
            Lamp::new(format!("olat_{i:02}"), direction)
        };
        Rig { lamps: (0..lamps).map(lamp).collect() }
    }

    #[test]
    fn a_light_falls_where_the_ball_faces_it_and_from_behind_nowhere() {
        let highlights = highlights(&rig(96));
        for direction in [Vec3::Z, Vec3::new(0.5, 0.0, 0.8), Vec3::new(-0.4, 0.5, 0.7), Vec3::new(0.2, -0.6, 0.7)] {
            let direction = direction.normalize();
            let [x, y] = highlights.at(direction).unwrap();
            let faces = normal(x.round() as usize, y.round() as usize).unwrap();
            let off = faces.angle_between(direction).to_degrees();
            assert!(off < 15.0, "{direction}: {off}° at {x}, {y}");
        }
        assert_eq!(highlights.at(Vec3::NEG_Z), None);
        assert_eq!(highlights.at(Vec3::NAN), None);
        assert_eq!(self::highlights(&Rig::default()).at(Vec3::Z), None);
    }

    #[test]
    fn the_place_follows_the_light_without_jumps() {
        let highlights = highlights(&rig(96));
        let at = |deg: i32| {
            let (sin, cos) = (deg as f32).to_radians().sin_cos();
            highlights.at(Vec3::new(sin, 0.0, cos)).unwrap()
        };
        let path: Vec<[f32; 2]> = (-50..=50).map(at).collect();
        for pair in path.windows(2) {
            let step = (pair[1][0] - pair[0][0]).hypot(pair[1][1] - pair[0][1]);
            assert!(step < 6.0, "{pair:?}");
        }
        assert!(path[0][0] + 40.0 < path[100][0]);
    }
}
