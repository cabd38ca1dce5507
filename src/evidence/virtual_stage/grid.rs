//! Distances baked into a grid: coarse enough to bake for every pose, fine enough for tracing rays.

use super::subject::{BOX_HIGH, BOX_LOW, Subject};
use glam::Vec3;
use rayon::prelude::*;

/// Edge of a cell in metres.
pub const CELL_M: f32 = 0.004;
/// Fine cells along the edge of a coarse one.
const COARSE: usize = 6;
/// Distance of the coarse grid below which the surface may be within the coarse cell: half its diagonal, and a margin
/// for blends, which distort distances a little.
const REACH_M: f32 = CELL_M * COARSE as f32 * 1.2;

/// Unit of stored distances in metres, so that a grid fits the cache.
const UNIT_M: f32 = 1e-5;

/// Signed distances over the subject's box at two scales.
pub struct Grid {
    fine: Nodes,
    coarse: Nodes,
}

/// Signed distances at the corners of cells.
struct Nodes {
    count: [usize; 3],
    distance: Vec<i16>,
    cells_per_m: f32,
}

/// Passage of a ray near the subject.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passage {
    /// Narrowest clearance as seen from the start: distance to the surface over distance travelled. 1 if nothing is
    /// near, negative if the ray enters the subject.
    pub clearance: f32,
    /// Greatest depth of the ray in the subject, in metres.
    pub depth_m: f32,
}

/// Number of rays traced at the same time.
const ABREAST: usize = 6;

/// A ray in progress: `t` metres travelled, out of the box at `leave`, and true while the surface is far.
struct Ray {
    direction: Vec3,
    t: f32,
    leave: f32,
    far: bool,
}

impl Grid {
    /// Bakes the subject. Only cells near the surface are evaluated; the others are interpolated from a coarser grid.
    pub fn bake(subject: &Subject) -> Self {
        let extent = (BOX_HIGH - BOX_LOW) / CELL_M;
        // Both grids reach beyond the box, the coarse one beyond the fine one.
        let blocks = extent.to_array().map(|e| (e + 2.0) as usize / COARSE + 1);
        let nodes = blocks.map(|b| b * COARSE);
        let coarse_nodes = blocks.map(|b| b + 1);
        let place = |x: usize, y: usize, z: usize| BOX_LOW + CELL_M * Vec3::new(x as f32, y as f32, z as f32);
        let coarse = Nodes {
            count: coarse_nodes,
            distance: (0..coarse_nodes.iter().product())
                .into_par_iter()
                .map(|i| {
                    let [x, y, z] = split(i, coarse_nodes);
                    store(subject.distance(place(x * COARSE, y * COARSE, z * COARSE)))
                })
                .collect(),
            cells_per_m: 1.0 / (CELL_M * COARSE as f32),
        };
        let (columns, rows) = (nodes[0], nodes[1]);
        let mut distance = vec![0; nodes.iter().product()];
        distance.par_chunks_mut(columns * rows).enumerate().for_each(|(z, layer)| {
            for (i, value) in layer.iter_mut().enumerate() {
                let p = place(i % columns, i / columns, z);
                let rough = coarse.at(p - BOX_LOW);
                *value = store(if rough.abs() < REACH_M { subject.distance(p) } else { rough });
            }
        });
        Self { fine: Nodes { count: nodes, distance, cells_per_m: 1.0 / CELL_M }, coarse }
    }

    /// Weighted sum of several grids' distances. Weights that sum to 1 interpolate between moments of one movement.
    pub fn blend(grids: &[(&Self, f32)]) -> Self {
        let nodes = |level: fn(&Self) -> &Nodes| {
            let first = level(grids[0].0);
            let at = |i: usize| {
                let terms = grids.iter();
                terms.map(|(grid, weight)| weight * f32::from(level(grid).distance[i])).sum::<f32>()
            };
            Nodes {
                count: first.count,
                distance: (0..first.distance.len()).into_par_iter().map(|i| at(i).round() as i16).collect(),
                cells_per_m: first.cells_per_m,
            }
        };
        Self { fine: nodes(|grid| &grid.fine), coarse: nodes(|grid| &grid.coarse) }
    }

    /// Signed distance at a place inside the box.
    pub fn distance(&self, p: Vec3) -> f32 {
        self.fine.at(p - BOX_LOW)
    }

    /// Traces rays from `start` (just off the surface) towards `directions`, out of the box. A ray deeper than
    /// `enough_m` inside may stop early: its `depth_m` is then at least that.
    pub fn pass(&self, start: Vec3, directions: &[Vec3], enough_m: f32, passages: &mut Vec<Passage>) {
        passages.clear();
        passages.resize(directions.len(), Passage { clearance: 1.0, depth_m: 0.0 });
        let origin = start - BOX_LOW;
        // Each step of a ray depends on the previous one, so several rays are traced at the same time.
        for (directions, passages) in directions.chunks(ABREAST).zip(passages.chunks_mut(ABREAST)) {
            let mut rays: [Ray; ABREAST] = std::array::from_fn(|i| match directions.get(i) {
                Some(&direction) => Ray { direction, t: CELL_M, leave: leave_box(start, direction), far: false },
                None => Ray { direction: Vec3::Z, t: 0.0, leave: 0.0, far: false },
            });
            while rays.iter().any(|ray| ray.t < ray.leave) {
                for (ray, passage) in rays.iter_mut().zip(passages.iter_mut()) {
                    if ray.t < ray.leave {
                        self.step(origin, ray, passage, enough_m);
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn step(&self, origin: Vec3, ray: &mut Ray, passage: &mut Passage, enough_m: f32) {
        let place = origin + ray.direction * ray.t;
        // Far from the surface the coarse grid is enough, and it fits the cache.
        let mut d = if ray.far { self.coarse.at(place) } else { 0.0 };
        if d < REACH_M {
            d = self.fine.at(place);
        }
        ray.far = d > 0.7 * REACH_M;
        passage.clearance = passage.clearance.min(d / ray.t);
        passage.depth_m = passage.depth_m.max(-d);
        // A lamp's penumbra is as wide as a fortieth of the way; finer steps show nothing.
        ray.t += d.abs().max(0.9 * CELL_M).max(0.025 * ray.t);
        if passage.depth_m > enough_m {
            ray.leave = 0.0;
        }
    }

    /// Distance to the first point within `near_m` of the surface, for a ray from outside the box that has travelled
    /// `from` metres; `None` if it misses.
    pub fn approach(&self, start: Vec3, direction: Vec3, from: f32, near_m: f32) -> Option<f32> {
        let (enter, leave) = crossing(start, direction)?;
        let mut t = from.max(enter);
        while t < leave {
            let d = self.distance(start + direction * t);
            if d < near_m {
                return Some(t);
            }
            t += (d - 0.5 * near_m).max(0.5 * CELL_M);
        }
        None
    }
}

impl Nodes {
    /// Trilinear distance at `from_low` metres from the box's low corner, inside the box.
    #[inline(always)]
    fn at(&self, from_low: Vec3) -> f32 {
        let at = from_low * self.cells_per_m;
        let [nx, ny, _] = self.count;
        // The grid extends beyond the box, so that rounding at its far side stays inside.
        let (x, y, z) = (at.x as i32, at.y as i32, at.z as i32);
        let (fx, fy, fz) = (at.x - x as f32, at.y - y as f32, at.z - z as f32);
        let layer = nx * ny;
        let base = z as usize * layer + y as usize * nx + x as usize;
        let edge = |i: usize| {
            let pair = &self.distance[i..i + 2];
            let (a, b) = (f32::from(pair[0]), f32::from(pair[1]));
            a + (b - a) * fx
        };
        let (a, b) = (edge(base), edge(base + nx));
        let near = a + (b - a) * fy;
        let (a, b) = (edge(base + layer), edge(base + layer + nx));
        let far = a + (b - a) * fy;
        (near + (far - near) * fz) * UNIT_M
    }
}

/// A distance in stored units, capped at 0.3 m.
fn store(distance_m: f32) -> i16 {
    (distance_m / UNIT_M).round() as i16
}

fn split(i: usize, nodes: [usize; 3]) -> [usize; 3] {
    [i % nodes[0], i / nodes[0] % nodes[1], i / nodes[0] / nodes[1]]
}

/// Distance along the ray to the far side of the box, for a start inside it.
fn leave_box(start: Vec3, direction: Vec3) -> f32 {
    let ahead = Vec3::select(direction.cmpge(Vec3::ZERO), BOX_HIGH, BOX_LOW);
    let t = (ahead - start) / direction;
    // A ray along a side gives 0/0 = NaN, which must not count.
    [t.x, t.y, t.z].into_iter().filter(|t| !t.is_nan()).fold(f32::MAX, f32::min)
}

/// Distances along the ray to its entry and exit of the box, if it meets the box.
fn crossing(start: Vec3, direction: Vec3) -> Option<(f32, f32)> {
    let (a, b) = ((BOX_LOW - start) / direction, (BOX_HIGH - start) / direction);
    let (near, far) = (a.min(b).max_element().max(0.0), a.max(b).min_element());
    (near < far).then_some((near, far))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::Pose;
    use crate::trouble::Look;

    #[test]
    fn the_grid_tells_the_distance_near_the_surface() {
        let subject = Subject::new(&Pose::default(), &Look::default());
        let grid = Grid::bake(&subject);
        for i in 0..2000 {
            let at = |k: usize| ((i * k) % 997) as f32 / 997.0;
            let p = BOX_LOW + (BOX_HIGH - BOX_LOW) * Vec3::new(at(211), at(383), at(577));
            let exact = subject.distance(p);
            if exact.abs() < 0.02 {
                let baked = grid.distance(p);
                // Creases finer than a cell are rounded by up to half a cell.
                assert!((baked - exact).abs() < CELL_M, "{p}: {baked} instead of {exact}");
            }
        }
    }

    #[test]
    fn a_ray_through_the_head_is_blocked_and_one_away_from_it_is_free() {
        let grid = Grid::bake(&Subject::new(&Pose::default(), &Look::default()));
        let nose = Vec3::new(0.0, 0.0, 0.15);
        let mut passages = Vec::new();
        grid.pass(nose, &[Vec3::NEG_Z, Vec3::Z], 0.01, &mut passages);
        assert!(passages[0].depth_m > 0.01);
        assert!(passages[1].depth_m == 0.0 && passages[1].clearance > 0.5);
    }
}
