//! Matte of a picture before a green or blue screen.

use super::parts::{clean, drop_loose};
use super::refine::guided;
use super::screen::{Key, apart, chroma};
use super::{Matte, linear, otsu, quantile, spread, window};
use base::error::{Error, Result};
use imaging::{Encoded, Mask};
use rayon::prelude::*;
use std::ops::Range;

/// Range of the screen's pixels around its colour, in standard deviations.
const SIGMAS: f32 = 4.0;
/// Smallest measurable noise in 8 bits, relative to the screen's colour difference.
const LEAST_NOISE: f32 = 0.008;
/// The same for chroma.
const LEAST_SPREAD: f32 = 0.008;

/// Largest encoded value, in all channels, of a pixel in a letterbox bar.
const BAR: f32 = 12.0 / 255.0;

impl Key {
    /// Matte of a picture before this screen. Its light may be uneven and may differ from the light when the key
    /// was found. Black letterbox bars are background.
    ///
    /// # Errors
    /// When the picture does not show the screen.
    pub fn matte(&self, picture: &Encoded) -> Result<Matte> {
        let size = picture.0.size();
        let shown = Shown::from_picture(picture);
        let light = linear(picture);
        // A bar continues its neighbouring pixels: no edge of the subject is searched there.
        let light: Vec<[f32; 3]> = (0..light.len()).map(|i| light[shown.nearest(i)]).collect();
        let screen = self.local_screen(&light, size)?;
        let share: Vec<f32> = (light.par_iter().zip(&screen))
            .map(|(&p, &s)| self.hue.difference(p) / self.hue.difference(s).max(1e-4))
            .collect();
        let cut = Cut::from_share(&share);
        let mut inside: Vec<bool> = share.iter().map(|&s| s < cut.middle).collect();
        clean(&mut inside, size, |i| share[i] > cut.screen);
        let reach = (size.0.min(size.1) / 128).clamp(2, 8);
        let places = Places::new(&share, &inside, &cut, size, reach);
        let mut alpha = self.unmixed(&light, &screen, &places, size, reach);
        let smooth = guided(&light, &alpha, size, 2);
        for (i, alpha) in alpha.iter_mut().enumerate() {
            if !places.core[i] && !places.screen[i] {
                *alpha = smooth[i];
            }
            // Coverage from the screen's noise alone.
            let noise = cut.noise.min(0.1);
            *alpha = ((*alpha - noise) / (1.0 - 2.0 * noise)).clamp(0.0, 1.0);
            if shown.nearest(i) != i {
                *alpha = 0.0;
            }
        }
        drop_loose(&mut alpha, size, &inside);
        let told = (0..alpha.len()).filter(|&i| places.core[i] || places.screen[i]);
        let uncertain = 1.0 - told.count() as f32 / alpha.len() as f32;
        Ok(Matte { mask: Mask { width: size.0, height: size.1, pixels: alpha }, uncertain })
    }

    /// Light of the screen at every pixel, also behind the subject: a second-order polynomial of the logarithm,
    /// fitted to pixels of the screen's chroma; near those, their own mean.
    fn local_screen(&self, light: &[[f32; 3]], size: (usize, usize)) -> Result<Vec<[f32; 3]>> {
        let center = chroma(self.light).unwrap_or([1.0 / 3.0; 2]);
        let limit = SIGMAS * self.spread.max(LEAST_SPREAD);
        let sum: f32 = self.light.iter().sum();
        let mut certain: Vec<bool> = (light.par_iter())
            .map(|&p| {
                chroma(p).is_some_and(|c| apart(c, center) < limit)
                    && (0.2..5.0).contains(&(p.iter().sum::<f32>() / sum))
            })
            .collect();
        let mut fitted = Vec::new();
        for _ in 0..3 {
            let fit = Surface::new(light, &certain, size).ok_or_else(|| self.gone())?;
            fitted = (0..light.len()).into_par_iter().map(|i| fit.at(i, size)).collect();
            let off = |i: usize| self.hue.difference(light[i]) / self.hue.difference(fitted[i]) - 1.0;
            let known: Vec<usize> = (0..light.len()).filter(|&i| certain[i]).collect();
            let limit = SIGMAS * spread(known.iter().map(|&i| off(i)), 0.0).max(LEAST_NOISE);
            for i in known {
                certain[i] = off(i).abs() <= limit;
            }
        }
        let radius = (size.0.min(size.1) / 64).max(2);
        Ok(window::means(|i| light[i], &certain, size, radius, fitted))
    }

    fn gone(&self) -> Error {
        Error::missing(
            format!("the picture does not show the {} screen of the other frames", self.hue.name()),
            "Leave such frames out, or add your own mattes for them",
        )
    }

    /// Coverage of each pixel. Uncertain pixels get their position between the local screen's colour difference and
    /// that of the nearby subject.
    fn unmixed(
        &self,
        light: &[[f32; 3]],
        screen: &[[f32; 3]],
        places: &Places,
        size: (usize, usize),
        reach: usize,
    ) -> Vec<f32> {
        let count = places.core.iter().filter(|core| **core).count().max(1) as f32;
        let mut mean = [0.0_f32; 3];
        for (_, p) in places.core.iter().zip(light).filter(|(core, _)| **core) {
            for c in 0..3 {
                mean[c] += p[c] / count;
            }
        }
        let prior = vec![mean; light.len()];
        let subject = window::means(|i| light[i], &places.core, size, reach, prior);
        (0..light.len())
            .into_par_iter()
            .map(|i| {
                if places.core[i] {
                    return 1.0;
                }
                if places.screen[i] {
                    return 0.0;
                }
                let [from, to, at] = [screen[i], subject[i], light[i]].map(|p| self.hue.difference(p));
                // A subject nearly as green as the screen cannot be separated by this.
                ((from - at) / (from - to).max(0.1 * from).max(1e-4)).clamp(0.0, 1.0)
            })
            .collect()
    }
}

/// Split of a picture's pixels into subject and screen, by colour difference relative to the screen's: about 1 on
/// the screen, 0 and below on most subjects.
struct Cut {
    /// Threshold: mostly subject below, mostly screen above.
    middle: f32,
    /// Smallest value of a screen pixel.
    screen: f32,
    /// Standard deviation of the screen's pixels.
    noise: f32,
}

impl Cut {
    fn from_share(share: &[f32]) -> Self {
        let (middle, _) = otsu(share, (-0.5, 1.5)).unwrap_or((0.5, 0.0));
        let noise = spread(share.iter().copied().filter(|&s| s > 0.75), 1.0).max(LEAST_NOISE);
        let screen = (1.0 - SIGMAS * noise).max(0.5);
        Self { middle: middle.min(screen).max(0.25), screen, noise }
    }
}

/// Certain subject pixels and certain screen pixels.
struct Places {
    core: Vec<bool>,
    screen: Vec<bool>,
}

impl Places {
    /// The subject's core is `reach` away from its edge and, for wider soft edges, no greener than the inside of
    /// the subject.
    fn new(share: &[f32], inside: &[bool], cut: &Cut, size: (usize, usize), reach: usize) -> Self {
        let subject: Vec<[f32; 1]> = inside.iter().map(|&i| [f32::from(u8::from(i))]).collect();
        let near = window::sums(&subject, size, reach);
        let far = window::sums(&subject, size, 3 * reach);
        let (near_count, far_count) = (window::counts(size, reach), window::counts(size, 3 * reach));
        let full = |i: usize, sums: &[[f32; 1]], count: f32| sums[i][0] > count - 0.5;
        let deep = (0..share.len()).filter(|&i| full(i, &far, far_count(i)));
        let greenest = quantile(deep.map(|i| share[i]).collect(), 0.98);
        let greenest = greenest.unwrap_or(0.0).clamp(0.0, cut.middle);
        let core = |i: usize| full(i, &near, near_count(i)) && (share[i] <= greenest || full(i, &far, far_count(i)));
        let outside = |i: usize| near[i][0] < 0.5 && share[i] >= cut.screen;
        Self { core: (0..share.len()).map(core).collect(), screen: (0..share.len()).map(outside).collect() }
    }
}

/// Light as a function of the place: the logarithm of each channel is a second-order polynomial.
struct Surface([[f64; 6]; 3]);

impl Surface {
    fn terms(place: usize, (width, height): (usize, usize)) -> [f64; 6] {
        let x = 2.0 * (place % width) as f64 / width as f64 - 1.0;
        let y = 2.0 * (place / width) as f64 / height as f64 - 1.0;
        [1.0, x, y, x * x, x * y, y * y]
    }

    /// Least-squares fit over the `certain` pixels; None without any. A weak pull towards a uniform screen decides
    /// undetermined terms.
    fn new(light: &[[f32; 3]], certain: &[bool], size: (usize, usize)) -> Option<Self> {
        let mut matrix = [[0.0; 6]; 6];
        let mut right = [[0.0; 6]; 3];
        let mut count = 0.0;
        for i in (0..light.len()).filter(|&i| certain[i]) {
            let terms = Self::terms(i, size);
            count += 1.0;
            for (row, a) in matrix.iter_mut().zip(terms) {
                for (cell, b) in row.iter_mut().zip(terms) {
                    *cell += a * b;
                }
            }
            for (right, v) in right.iter_mut().zip(light[i]) {
                let log = f64::from(v.max(1e-5)).ln();
                for (cell, a) in right.iter_mut().zip(terms) {
                    *cell += a * log;
                }
            }
        }
        for (k, row) in matrix.iter_mut().enumerate().skip(1) {
            row[k] += 1e-3 * count;
        }
        (count > 0.0).then(|| Self(right.map(|right| solve(matrix, right))))
    }

    fn at(&self, place: usize, size: (usize, usize)) -> [f32; 3] {
        let terms = Self::terms(place, size);
        self.0.map(|polynomial| {
            let log: f64 = polynomial.iter().zip(terms).map(|(a, b)| a * b).sum();
            log.exp().min(4.0) as f32
        })
    }
}

/// Solves a symmetric positive definite system by Gaussian elimination.
fn solve(mut matrix: [[f64; 6]; 6], mut right: [f64; 6]) -> [f64; 6] {
    for k in 0..6 {
        for row in k + 1..6 {
            let factor = matrix[row][k] / matrix[k][k];
            let pivot = matrix[k];
            for (cell, above) in matrix[row].iter_mut().zip(pivot).skip(k) {
                *cell -= factor * above;
            }
            right[row] -= factor * right[k];
        }
    }
    for k in (0..6).rev() {
        let known: f64 = (k + 1..6).map(|c| matrix[k][c] * right[c]).sum();
        right[k] = (right[k] - known) / matrix[k][k];
    }
    right
}

/// The picture without its letterbox bars: fully black rows or columns from the border inwards.
pub(super) struct Shown {
    pub columns: Range<usize>,
    pub rows: Range<usize>,
    width: usize,
}

impl Shown {
    pub fn from_picture(picture: &Encoded) -> Self {
        let (width, height) = picture.0.size();
        let black = |x: usize, y: usize| picture.0.at(x, y).iter().all(|&v| v <= BAR);
        let row = |y: &usize| (0..width).all(|x| black(x, *y));
        let column = |x: &usize| (0..height).all(|y| black(*x, y));
        // The line next to a bar is a mixture, from scaling or from half-size chroma.
        let bar = |lines: usize| if lines > 0 { lines + 1 } else { 0 };
        let top = bar((0..height).take_while(row).count());
        let bottom = bar((0..height).rev().take_while(row).count());
        let left = bar((0..width).take_while(column).count());
        let right = bar((0..width).rev().take_while(column).count());
        // A fully black picture has no bars.
        let within = |from: usize, to: usize, length: usize| {
            if from + to < length { from..length - to } else { 0..length }
        };
        Self { columns: within(left, right, width), rows: within(top, bottom, height), width }
    }

    /// The nearest place outside the bars.
    fn nearest(&self, place: usize) -> usize {
        let x = (place % self.width).clamp(self.columns.start, self.columns.end - 1);
        let y = (place / self.width).clamp(self.rows.start, self.rows.end - 1);
        y * self.width + x
    }
}
