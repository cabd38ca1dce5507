//! The ball in a series of photographs, reduced to a grid of cells so that a full series fits into memory.

use super::super::code_values::{CodeValues, ResponseTable, is_clipped};
use super::super::mirror_ball::MirrorBall;
use super::super::silhouette::{self, Circle, Photographs, Silhouette};
use glam::Vec3;
use rayon::prelude::*;

/// Bounding box of the ball as cells of `bin × bin` pixels.
pub(crate) struct Grid {
    pub width: usize,
    pub height: usize,
    /// The ball's radius in pixels.
    pub radius_px: f32,
    /// Possible error of the ball's circle in pixels.
    pub circle_error_px: f32,
    /// Solid angle of each cell in steradians; 0 outside the ball.
    pub solid_angle: Vec<f32>,
    /// Unit direction of each cell; zero outside the ball.
    pub direction: Vec<Vec3>,
    /// Cell of each of the ball's pixels.
    cell_of_pixel: Vec<u32>,
}

/// One photograph on a [`Grid`]: per cell the square root of its light (mean of the channels, 0 to 1) in 15 bits,
/// and a clipping flag in the lowest bit.
pub(crate) struct Levels(Vec<u16>);

/// Possible error of a circle without a visible rim, in pixels and relative to its radius: the spread of circles
/// drawn by hand and found in out-of-focus photographs.
const UNSEEN_RIM_PX: f32 = 0.4;
const UNSEEN_RIM: f32 = 0.005;
/// Smallest error in pixels of a visible rim.
const SEEN_RIM_PX: f64 = 0.2;
/// Smallest visible share of the circumference of a rim that counts as seen.
const SEEN_RIM: f64 = 0.5;
/// Smallest circle error, relative to the radius, that gives a warning: lamps are then several degrees off.
const WRONG_CIRCLE: f64 = 0.03;

impl Grid {
    /// Largest number of cells across the ball; more show a lamp no better.
    const ACROSS: usize = 1024;
    /// Largest number of cells of a full series, at six bytes each.
    const TOTAL: usize = 1 << 25;

    /// Grid for a series of photographs, each `frame_width` pixels wide.
    pub fn new(ball: &MirrorBall, frame_width: usize, photographs: usize) -> Self {
        let place = |index: usize| (index % frame_width, index / frame_width);
        let (mut low, mut high) = ((usize::MAX, usize::MAX), (0, 0));
        for pixel in &ball.pixels {
            let (x, y) = place(pixel.index);
            low = (low.0.min(x), low.1.min(y));
            high = (high.0.max(x), high.1.max(y));
        }
        let (across, down) = (high.0 + 1 - low.0, high.1 + 1 - low.1);
        let cells = |bin: usize| across.div_ceil(bin) * down.div_ceil(bin);
        let mut bin = across.max(down).div_ceil(Self::ACROSS);
        while cells(bin) * photographs > Self::TOTAL && bin < across {
            bin += 1;
        }
        let (width, height) = (across.div_ceil(bin), down.div_ceil(bin));
        let mut grid = Self {
            width,
            height,
            radius_px: ball.radius_px,
            circle_error_px: UNSEEN_RIM_PX.hypot(UNSEEN_RIM * ball.radius_px),
            solid_angle: vec![0.0; width * height],
            direction: vec![Vec3::ZERO; width * height],
            cell_of_pixel: Vec::with_capacity(ball.pixels.len()),
        };
        for pixel in &ball.pixels {
            let (x, y) = place(pixel.index);
            let cell = (y - low.1) / bin * width + (x - low.0) / bin;
            grid.cell_of_pixel.push(cell as u32);
            grid.solid_angle[cell] += pixel.solid_angle;
            grid.direction[cell] += pixel.solid_angle * pixel.direction;
        }
        for direction in &mut grid.direction {
            *direction = direction.normalize_or_zero();
        }
        grid
    }

    /// Records the circle's distance from the rim in the photographs: a nearby one, or that of a ball the circle
    /// touches. Returns a sentence if the circle is plainly wrong.
    pub fn check_circle(&mut self, photographs: &Photographs, circle: &Circle) -> Option<String> {
        let seen = |rim: &Silhouette| rim.rim_share >= SEEN_RIM;
        // A second ball has its own circle.
        let touches =
            |rim: &Silhouette| rim.circle.center().distance(circle.center()) < rim.circle.radius_px + circle.radius_px;
        let nearby = silhouette::refine(photographs, circle).ok().filter(seen);
        let rim = nearby.or_else(|| {
            let found = silhouette::find(photographs).ok()?;
            (seen(&found) && touches(&found)).then_some(found)
        })?;
        let wider = rim.circle.radius_px - circle.radius_px;
        let aside = rim.circle.center().distance(circle.center());
        // Root mean square over the circumference.
        let error = (0.5 * aside * aside + wider * wider).sqrt();
        self.circle_error_px = error.hypot(SEEN_RIM_PX) as f32;
        (error > WRONG_CIRCLE * rim.circle.radius_px).then(|| {
            format!(
                "the mirror ball's circle is {error:.0} pixels off the outline in its photographs, with its centre \
                 at {:.0}, {:.0} and a radius of {:.0} pixels: all lamp directions are wrong. Find the circle again",
                rim.circle.center_px[0], rim.circle.center_px[1], rim.circle.radius_px
            )
        })
    }

    /// Cell of pixel `pixel` of [`MirrorBall::pixels`].
    pub fn cell(&self, pixel: u32) -> usize {
        self.cell_of_pixel[pixel as usize] as usize
    }

    /// True if a cell shows the ball.
    pub fn is_ball(&self, cell: usize) -> bool {
        self.solid_angle[cell] > 0.0
    }

    /// Reduces a photograph, one code value per pixel of the ball, to light on the grid.
    pub fn reduce(&self, photograph: &[CodeValues], table: &ResponseTable) -> Levels {
        let mut sum = vec![(0.0f32, 0u32, false); self.solid_angle.len()];
        for (code, cell) in photograph.iter().zip(&self.cell_of_pixel) {
            let (light, count, clipped) = &mut sum[*cell as usize];
            *light += table.rgb(*code).into_iter().sum::<f32>() / 3.0;
            *count += 1;
            *clipped |= is_clipped(code);
        }
        let level = |(light, count, clipped): (f32, u32, bool)| {
            let mean = light / count.max(1) as f32;
            ((mean.clamp(0.0, 1.0).sqrt() * 32767.0 + 0.5) as u16) << 1 | u16::from(clipped)
        };
        Levels(sum.into_iter().map(level).collect())
    }

    /// Cells around a cell, clipped to the grid.
    pub fn around(&self, cell: usize) -> impl Iterator<Item = usize> + use<> {
        matte::around(cell, (self.width, self.height), 1).filter(move |&other| other != cell)
    }

    /// Connected parts of the ball's cells for which `inside` holds.
    pub fn parts(&self, inside: impl Fn(usize) -> bool) -> Vec<Vec<u32>> {
        let size = (self.width, self.height);
        let parts = matte::parts(size, |cell| self.is_ball(cell) && inside(cell)).into_iter();
        parts.map(|part| part.into_iter().map(|cell| cell as u32).collect()).collect()
    }

    /// Common part of all photographs of a series per cell: the room, as their median. With fewer than five the
    /// minimum, because two lamps may light one place.
    pub fn room(&self, series: &[Levels]) -> Vec<f32> {
        if series.len() < 2 {
            return vec![0.0; self.solid_angle.len()];
        }
        let rank = if series.len() < 5 { 0 } else { series.len() / 2 };
        (0..self.solid_angle.len())
            .into_par_iter()
            .map_init(Vec::new, |codes: &mut Vec<u16>, cell| {
                if !self.is_ball(cell) {
                    return 0.0;
                }
                codes.clear();
                codes.extend(series.iter().map(|levels| levels.0[cell]));
                light(*codes.select_nth_unstable(rank).1)
            })
            .collect()
    }
}

impl Levels {
    /// Light of a cell.
    pub fn light(&self, cell: usize) -> f32 {
        light(self.0[cell])
    }

    /// True if a pixel of the cell is clipped.
    pub fn is_clipped(&self, cell: usize) -> bool {
        self.0[cell] & 1 == 1
    }
}

fn light(code: u16) -> f32 {
    (f32::from(code >> 1) / 32767.0).powi(2)
}
