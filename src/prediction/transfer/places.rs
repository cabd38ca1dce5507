//! Places of a frame in the exemplars, and the share of each.

use imaging::Mask;

/// A frame's place in one exemplar.
#[derive(Clone, Debug)]
pub struct Place {
    /// Number of the pose.
    pub pose: usize,
    /// Offsets in pixels of the working size: pixel (x, y) of the frame lies at (x + dx, y + dy) in the pose.
    pub offsets: Vec<[f32; 2]>,
    /// Share of the exemplar in the light of each pixel: less where no exemplar explains the frame.
    pub share: Mask,
    /// Shares of the pose's lamps in the frame's: `lamps[of pose · stride + of frame]`.
    pub(crate) lamps: Vec<f32>,
    pub(crate) stride: usize,
}

impl Place {
    /// Weights of the pose's lamps for those of the frame's.
    pub fn turned(&self, weights: &[[f32; 3]]) -> Vec<[f32; 3]> {
        let turned = |shares: &[f32]| {
            let mut sum = [0.0; 3];
            for (share, weight) in shares.iter().zip(weights) {
                (0..3).for_each(|c| sum[c] += share * weight[c]);
            }
            sum
        };
        self.lamps.chunks_exact(self.stride.max(1)).map(turned).collect()
    }

    /// The memory that it takes.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.offsets[..]) + size_of_val(&self.share.pixels[..]) + size_of_val(&self.lamps[..])
    }
}
