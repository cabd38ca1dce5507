//! Distances baked into a grid: coarse enough to be made for every pose, fine enough to march
//! rays through.

use super::subject::{BOX_HIGH, BOX_LOW, Subject};
use glam::Vec3;
use rayon::prelude::*;

/// Edge of a cell in metres.
pub const CELL_M: f32 = 0.004;
/// Fine cells along the edge of a coarse one.
const COARSE: usize = 6;

/// Signed distances at the corners of cells, over the subject's box.
pub struct Grid {
    nodes: [usize; 3],
    distance: Vec<f32>,
}

/// How a ray passes the subject.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passage {
    /// The narrowest clearance as seen from the start: distance to the surface over distance
    /// travelled. 1 where nothing is near, negative where the ray goes through.
    pub clearance: f32,
    /// How deep the ray dips into the subject at most, in metres.
    pub depth_m: f32,
}

impl Grid {
    /// Bakes the subject. Only cells near the surface are evaluated; the others take what the
    /// corners of a coarser grid tell.
    pub fn bake(subject: &Subject) -> Self {
        let extent = (BOX_HIGH - BOX_LOW) / CELL_M;
        let blocks = extent.to_array().map(|e| (e / COARSE as f32).ceil() as usize);
        let nodes = blocks.map(|b| b * COARSE + 1);
        let coarse_nodes = blocks.map(|b| b + 1);
        let place = |x: usize, y: usize, z: usize| BOX_LOW + CELL_M * Vec3::new(x as f32, y as f32, z as f32);
        let coarse = Self {
            nodes: coarse_nodes,
            distance: (0..coarse_nodes.iter().product())
                .into_par_iter()
                .map(|i| {
                    let (x, y, z) = split(i, coarse_nodes);
                    subject.distance(place(x * COARSE, y * COARSE, z * COARSE))
                })
                .collect(),
        };
        // Beyond this a coarse cell holds no surface: its half diagonal, and some for blends, which
        // bend distances a little.
        let reach = CELL_M * COARSE as f32 * 1.2;
        let (columns, rows) = (nodes[0], nodes[1]);
        let mut distance = vec![0.0; nodes.iter().product()];
        distance.par_chunks_mut(columns * rows).enumerate().for_each(|(z, layer)| {
            for (i, value) in layer.iter_mut().enumerate() {
                let (x, y) = (i % columns, i / columns);
                let from = [x, y, z].map(|n| n as f32 / COARSE as f32);
                let rough = coarse.interpolate(from);
                *value = if rough.abs() < reach { subject.distance(place(x, y, z)) } else { rough };
            }
        });
        Self { nodes, distance }
    }

    /// Trilinear value at a place counted in cells, inside the grid.
    fn interpolate(&self, at: [f32; 3]) -> f32 {
        let [nx, ny, nz] = self.nodes;
        let (x, y, z) = (
            (at[0] as usize).min(nx - 2),
            (at[1] as usize).min(ny - 2),
            (at[2] as usize).min(nz - 2),
        );
        let (fx, fy, fz) = (at[0] - x as f32, at[1] - y as f32, at[2] - z as f32);
        let base = (z * ny + y) * nx + x;
        let layer = nx * ny;
        let d = &self.distance[base..base + layer + nx + 2];
        let edge = |i: usize| d[i] + (d[i + 1] - d[i]) * fx;
        let near = edge(0) + (edge(nx) - edge(0)) * fy;
        let far = edge(layer) + (edge(layer + nx) - edge(layer)) * fy;
        near + (far - near) * fz
    }

    /// Signed distance at a place inside the box.
    pub fn distance(&self, p: Vec3) -> f32 {
        self.interpolate(((p - BOX_LOW) / CELL_M).max(Vec3::ZERO).to_array())
    }

    /// Follows a ray from `start` (just off the surface) towards `direction`, out of the box. It may
    /// stop early once the ray is deeper than `enough_m` inside: `depth_m` then is at least that.
    pub fn pass(&self, start: Vec3, direction: Vec3, enough_m: f32) -> Passage {
        let leave = leave_box(start, direction);
        let (origin, slope) = ((start - BOX_LOW) / CELL_M, direction / CELL_M);
        let mut passage = Passage { clearance: 1.0, depth_m: 0.0 };
        let mut t = CELL_M;
        while t < leave {
            let d = self.interpolate((origin + slope * t).to_array());
            passage.clearance = passage.clearance.min(d / t);
            if d < 0.0 {
                passage.depth_m = passage.depth_m.max(-d);
                if passage.depth_m > enough_m {
                    break;
                }
            }
            t += d.abs().clamp(0.6 * CELL_M, 0.04);
        }
        passage
    }

    /// How far a ray from outside the box, that has travelled `from` metres, has to travel until it is
    /// within `near_m` of the surface; `None` where it misses.
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

fn split(i: usize, nodes: [usize; 3]) -> (usize, usize, usize) {
    (i % nodes[0], i / nodes[0] % nodes[1], i / nodes[0] / nodes[1])
}

/// Distance along the ray to the far side of the box, for a start inside it.
fn leave_box(start: Vec3, direction: Vec3) -> f32 {
    let ahead = Vec3::select(direction.cmpge(Vec3::ZERO), BOX_HIGH, BOX_LOW);
    let t = (ahead - start) / direction;
    // A ray along a side gives 0/0, which must not decide.
    [t.x, t.y, t.z].into_iter().filter(|t| !t.is_nan()).fold(f32::MAX, f32::min)
}

/// Distances along the ray to where it enters and leaves the box, if it meets it.
fn crossing(start: Vec3, direction: Vec3) -> Option<(f32, f32)> {
    let (a, b) = ((BOX_LOW - start) / direction, (BOX_HIGH - start) / direction);
    let (near, far) = (a.min(b).max_element().max(0.0), a.max(b).min_element());
    (near < far).then_some((near, far))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::virtual_stage::motion::Pose;

    #[test]
    fn the_grid_tells_the_distance_near_the_surface() {
        let subject = Subject::new(&Pose::default());
        let grid = Grid::bake(&subject);
        for i in 0..2000 {
            let at = |k: usize| ((i * k) % 997) as f32 / 997.0;
            let p = BOX_LOW + (BOX_HIGH - BOX_LOW) * Vec3::new(at(211), at(383), at(577));
            let exact = subject.distance(p);
            if exact.abs() < 0.02 {
                let baked = grid.distance(p);
                // Creases finer than a cell are rounded by up to about half a cell.
                assert!((baked - exact).abs() < CELL_M, "{p}: {baked} instead of {exact}");
            }
        }
    }

    #[test]
    fn a_ray_through_the_head_is_blocked_and_one_away_from_it_is_free() {
        let grid = Grid::bake(&Subject::new(&Pose::default()));
        let nose = Vec3::new(0.0, 0.0, 0.15);
        assert!(grid.pass(nose, Vec3::NEG_Z, 0.01).depth_m > 0.01);
        let free = grid.pass(nose, Vec3::Z, 0.01);
        assert!(free.depth_m == 0.0 && free.clearance > 0.5);
    }
}
