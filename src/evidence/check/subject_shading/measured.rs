//! Numbers of a pose's small OLATs.

use glam::DVec2;
use imaging::color::luminance;
use imaging::{Image, Mask};

/// Smallest coverage of the subject's pixels.
const INSIDE: f32 = 0.9;

/// Shading of a pose under every lamp, in numbers.
#[derive(Clone, Debug, Default)]
pub struct Shading {
    /// Sums over the subject's pixels of the products of two OLATs' luminances, row by row.
    pub products: Vec<f64>,
    /// Mean luminance of each OLAT on the subject.
    pub light: Vec<f64>,
    /// Mean place of each OLAT's light in pixels, to the right and up.
    pub places: Vec<DVec2>,
}

impl Shading {
    /// The shading of a pose from its small OLATs.
    pub fn from_olats(olats: &[Image], mask: &Mask) -> Self {
        let inside: Vec<usize> = (0..mask.pixels.len()).filter(|&i| mask.pixels[i] > INSIDE).collect();
        let value = |olat: &Image, i: usize| f64::from(luminance(olat.pixels[i]).max(0.0));
        let values: Vec<Vec<f64>> = olats.iter().map(|olat| inside.iter().map(|&i| value(olat, i)).collect()).collect();
        let place = |i: usize| DVec2::new((i % mask.width) as f64, -((i / mask.width) as f64));
        let places = values.iter().map(|values| {
            let sum: DVec2 = inside.iter().zip(values).map(|(&i, v)| *v * place(i)).sum();
            sum / values.iter().sum::<f64>()
        });
        let mean = |values: &Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
        Self {
            products: values.iter().flat_map(|a| values.iter().map(move |b| product(a, b))).collect(),
            light: values.iter().map(mean).collect(),
            places: places.collect(),
        }
    }

    /// Light of each OLAT relative to the median.
    pub fn relative(&self) -> impl Iterator<Item = f64> {
        let mut sorted = self.light.clone();
        sorted.sort_by(f64::total_cmp);
        let median = sorted[sorted.len() / 2];
        self.light.iter().map(move |light| light / median)
    }

    /// The shading under some lamps, divided by their energies.
    pub fn lit_by(&self, lamps: &[usize], energies: &[f64]) -> Self {
        let all = self.light.len();
        let some = || lamps.iter().zip(energies);
        let products = some().flat_map(|(i, a)| some().map(move |(j, b)| self.products[i * all + j] / (a * b)));
        Self {
            products: products.collect(),
            light: some().map(|(&i, energy)| self.light[i] / energy).collect(),
            places: lamps.iter().map(|&i| self.places[i]).collect(),
        }
    }
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
