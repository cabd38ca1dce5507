//! Lamps with an area: softboxes, windows and bare lamps, as light on the subject and as reflections in the mirror
//! ball.

use super::transport::Source;
use glam::Vec3;
use serde::Serialize;

/// Largest angle of one sample of a panel, seen from the subject, in radians.
const SAMPLE_WIDTH: f32 = 0.06;
/// Most samples along either side of a panel.
const MOST_SAMPLES: usize = 10;
/// Share of a window's width and height that each bar between panes takes.
const BAR: f32 = 0.04;

/// A flat lamp that faces the subject, or a window.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Panel {
    /// Centre on the stage in metres.
    pub centre: Vec3,
    /// Facing direction.
    pub normal: Vec3,
    /// The direction of its width.
    pub across: Vec3,
    /// Half its width and height in metres.
    pub half: [f32; 2],
    /// True for a disc, false for a rectangle.
    pub round: bool,
    /// Panes side by side and above each other; bars between them are dark.
    pub panes: [usize; 2],
    pub radiance: [f32; 3],
}

impl Panel {
    /// A panel `distance` metres away in a direction, turned to the subject.
    pub fn facing(towards: Vec3, distance: f32, half: [f32; 2], radiance: [f32; 3]) -> Self {
        let normal = -towards.normalize();
        let across = Vec3::Y.cross(normal).normalize_or(Vec3::X);
        Self { centre: -normal * distance, normal, across, half, round: false, panes: [1; 2], radiance }
    }

    /// The direction of its height.
    fn up(&self) -> Vec3 {
        self.normal.cross(self.across)
    }

    /// True if the panel emits light at a place of its plane, from −1 to 1 along width and height.
    fn shines(&self, [x, y]: [f32; 2]) -> bool {
        if x.abs() > 1.0 || y.abs() > 1.0 {
            return false;
        }
        let in_pane = |place: f32, panes: usize| {
            let along = (0.5 + 0.5 * place) * panes as f32;
            let from_bar = (along - along.round()).abs() / panes as f32;
            panes == 1 || from_bar > 0.5 * BAR || along.round() == 0.0 || along.round() == panes as f32
        };
        if self.round { x.hypot(y) <= 1.0 } else { in_pane(x, self.panes[0]) && in_pane(y, self.panes[1]) }
    }

    /// Radiance along a ray, and distance; `None` if the ray misses it.
    pub fn seen(&self, origin: Vec3, direction: Vec3) -> Option<(f32, [f32; 3])> {
        let towards = -direction.dot(self.normal);
        if towards <= 0.0 {
            return None;
        }
        let t = (origin - self.centre).dot(self.normal) / towards;
        let off = origin + direction * t - self.centre;
        let place = [off.dot(self.across) / self.half[0], off.dot(self.up()) / self.half[1]];
        (t > 0.0 && self.shines(place)).then_some((t, self.radiance))
    }

    /// The panel as small discs, each with its solid angle.
    pub fn sources(&self) -> Vec<Source> {
        let distance = self.centre.length();
        let count = |half: f32| ((2.0 * half / distance / SAMPLE_WIDTH).ceil() as usize).clamp(1, MOST_SAMPLES);
        let [columns, rows] = self.half.map(count);
        // Finer than the samples, so that bars and a disc's outline count by their area.
        const FINE: usize = 8;
        let cell = 4.0 * self.half[0] * self.half[1] / (columns * rows) as f32;
        let mut sources = Vec::new();
        for i in 0..columns * rows {
            let inside = (0..FINE * FINE).map(|j| {
                let part =
                    |i: usize, n: usize, j: usize| 2.0 * (i as f32 + (j as f32 + 0.5) / FINE as f32) / n as f32 - 1.0;
                [part(i % columns, columns, j % FINE), part(i / columns, rows, j / FINE)]
            });
            let lit: Vec<[f32; 2]> = inside.filter(|place| self.shines(*place)).collect();
            if lit.is_empty() {
                continue;
            }
            let middle = |axis: usize| lit.iter().map(|p| p[axis]).sum::<f32>() / lit.len() as f32;
            let place = self.centre + self.across * (middle(0) * self.half[0]) + self.up() * (middle(1) * self.half[1]);
            let area = cell * lit.len() as f32 / (FINE * FINE) as f32;
            let distance_m = place.length();
            let facing = (-place.dot(self.normal) / distance_m).max(0.0);
            sources.push(Source {
                place,
                radius_m: (area / std::f32::consts::PI).sqrt(),
                solid_angle: area * facing / (distance_m * distance_m),
                distance_m,
            });
        }
        sources
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_fill_the_part_of_the_sphere_that_rays_meet() {
        let towards = Vec3::new(-0.8, 0.3, 0.5).normalize();
        let soft = Panel::facing(towards, 1.6, [0.5, 0.4], [1.0; 3]);
        let window = Panel { panes: [2, 3], ..soft };
        let disc = Panel { round: true, ..soft };
        for panel in [soft, window, disc] {
            let sampled: f32 = panel.sources().iter().map(|s| s.solid_angle).sum();
            // Rays spread evenly over the whole sphere.
            let (width, height) = (1024, 512);
            let mut met = 0.0;
            for y in 0..height {
                let solid_angle = light::latlong::texel_solid_angle(y, width, height);
                for x in 0..width {
                    let ray = light::latlong::texel_direction(x, y, width, height);
                    if panel.seen(Vec3::ZERO, ray).is_some() {
                        met += solid_angle;
                    }
                }
            }
            assert!((f64::from(sampled) / met - 1.0).abs() < 0.02, "{sampled} and {met}");
        }
    }

    #[test]
    fn a_panel_shines_only_forwards() {
        let panel = Panel::facing(Vec3::X, 2.0, [0.3; 2], [1.0; 3]);
        assert!(panel.seen(Vec3::ZERO, Vec3::X).is_some());
        assert!(panel.seen(Vec3::ZERO, Vec3::NEG_X).is_none());
        assert!(panel.seen(Vec3::X * 3.0, Vec3::NEG_X).is_none());
    }
}
