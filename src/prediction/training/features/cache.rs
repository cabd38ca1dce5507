//! Cache of the features of true pictures, for repeated comparisons.

use super::network::FeatureNetwork;
use crate::schedule::SampleSource;
use burn::tensor::{Tensor, TensorData};
use std::collections::HashMap;

/// Most bytes of the cache; features that do not fit are computed each time.
const MAX_BYTES: usize = 1 << 30;

/// A true picture that is constant over a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PictureId {
    pub source: SampleSource,
    pub picture: PictureKind,
}

/// A picture of a sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PictureKind {
    Plate,
    /// Under this lamp.
    Olat(usize),
}

/// Cached layers of pictures, `[1, channels, h, w]` each.
#[derive(Default)]
pub struct FeatureCache {
    kept: HashMap<PictureId, Vec<Tensor<4>>>,
    bytes: usize,
}

impl FeatureCache {
    /// Layers of `pictures`, `[n, 3, h, w]`, with the names `names`.
    pub fn layers(&mut self, network: &FeatureNetwork, pictures: Tensor<4>, names: &[PictureId]) -> Vec<Tensor<4>> {
        let new: Vec<usize> = (0..names.len()).filter(|i| !self.kept.contains_key(&names[*i])).collect();
        if new.len() == names.len() {
            let layers = network.forward(pictures);
            self.keep(&layers, names.iter().copied());
            return layers;
        }
        let computed = if new.is_empty() { Vec::new() } else { network.forward(rows(pictures, &new)) };
        let mut next = 0;
        let each: Vec<Vec<Tensor<4>>> = names
            .iter()
            .map(|name| match self.kept.get(name) {
                Some(layers) => layers.clone(),
                None => {
                    next += 1;
                    row(&computed, next - 1)
                }
            })
            .collect();
        self.keep(&computed, new.into_iter().map(|i| names[i]));
        (0..each[0].len()).map(|layer| Tensor::cat(each.iter().map(|l| l[layer].clone()).collect(), 0)).collect()
    }

    fn keep(&mut self, layers: &[Tensor<4>], names: impl Iterator<Item = PictureId>) {
        for (i, name) in names.enumerate() {
            let layers = row(layers, i);
            let bytes = layers.iter().map(|l| 4 * l.shape().num_elements()).sum::<usize>();
            if self.bytes + bytes > MAX_BYTES {
                return;
            }
            self.bytes += bytes;
            self.kept.insert(name, layers);
        }
    }
}

/// The pictures at the indices `which` of `[n, c, h, w]`.
pub fn rows(x: Tensor<4>, which: &[usize]) -> Tensor<4> {
    let which: Vec<i64> = which.iter().map(|i| *i as i64).collect();
    let device = x.device().without_autodiff();
    let which = TensorData::new(which.clone(), [which.len()]);
    x.select(0, Tensor::from_data(which, &device))
}

/// Layers of one picture.
fn row(layers: &[Tensor<4>], picture: usize) -> Vec<Tensor<4>> {
    let row = |layer: &Tensor<4>| layer.clone().narrow(0, picture, 1);
    layers.iter().map(row).collect()
}
