//! Code values: encoded pixel values as whole numbers, so that a candidate response is one small table.

use base::error::Result;
use imaging::color::unit;
use imaging::{DualGamma, Encoded, Image, Response};
use project::Picture;
use rayon::prelude::*;

/// A pixel's three code values, in steps of 1/[`STEPS`].
pub(super) type CodeValues = [u16; 3];

/// 16 steps per 8-bit code: exact for 8-bit pictures, and 12 bits for finer ones.
pub(super) const STEPS: u16 = 16 * 255;

/// Smallest clipped code: the last 8-bit code.
pub(super) const CLIPPED: u16 = STEPS - 16 + 1;

/// Response for reading the balls before the fit. Pixels far above black are so under any response.
pub const PROVISIONAL: Response = Response::Power(2.2);

/// True if a channel of a pixel is clipped.
pub(super) fn is_clipped(code: &CodeValues) -> bool {
    code.iter().any(|&c| c >= CLIPPED)
}

/// The code values of a picture, row by row.
pub(super) fn codes(picture: &Encoded) -> Vec<CodeValues> {
    let code = |v: f32| (unit(v) * f32::from(STEPS) + 0.5) as u16;
    picture.0.pixels.iter().map(|pixel| pixel.map(code)).collect()
}

/// Mean square of the rounding errors of some codes, encoded: of 8 bits if all are whole 8-bit codes, else of [`STEPS`].
pub(super) fn rounding<'a>(mut codes: impl Iterator<Item = &'a CodeValues>) -> f64 {
    let is_8_bit = codes.all(|code| code.iter().all(|c| c % 16 == 0));
    let steps = if is_8_bit { 255.0 } else { f64::from(STEPS) };
    1.0 / (12.0 * steps * steps)
}

/// Largest light of scaled pictures: below clipping.
const HIGHEST: f32 = 0.9;

/// Factor that brings the light of scene-linear pictures to at most [`HIGHEST`], so that none of it is clipped as codes; 1 for
/// pictures of codes. `brightest` is the largest value of one of them.
///
/// # Errors
/// When a picture cannot be read.
pub(super) fn scale(pictures: &[Picture], brightest: impl Fn(&Picture) -> Result<f32> + Sync + Send) -> Result<f32> {
    match pictures.first() {
        Some(first) if footage::is_scene_linear(first)? => {}
        _ => return Ok(1.0),
    }
    let all = pictures.par_iter().map(brightest).collect::<Result<Vec<_>>>()?;
    let most = all.into_iter().fold(0.0, f32::max);
    Ok(if most > 0.0 { HIGHEST / most } else { 1.0 })
}

/// `scale` times light as codes of sRGB.
pub(super) fn encoded(light: &Image, scale: f32) -> Encoded {
    Response::Srgb.encode(&light.map(|pixel| pixel.map(|v| scale * v)))
}

/// Linear light of every code value under one response: a 1D LUT.
pub(super) struct ResponseTable(Vec<f32>);

impl ResponseTable {
    pub fn new(response: &DualGamma) -> Self {
        Self::from_response(&Response::Dual(*response))
    }

    /// Table of a response.
    pub fn from_response(response: &Response) -> Self {
        Self((0..=STEPS).map(|code| response.decode_value(f32::from(code) / f32::from(STEPS))).collect())
    }

    /// Light of one channel's code value.
    pub fn light(&self, code: u16) -> f32 {
        self.0[usize::from(code)]
    }

    /// Light of a pixel.
    pub fn rgb(&self, code: CodeValues) -> [f32; 3] {
        code.map(|c| self.light(c))
    }

    /// d light / d encoded at a code, by differences over one 8-bit step; positive.
    pub fn slope(&self, code: u16) -> f32 {
        let (low, high) = (code.saturating_sub(8), (code + 8).min(STEPS));
        let rise = self.light(high) - self.light(low);
        (rise * f32::from(STEPS) / f32::from(high - low)).max(1e-6)
    }

    /// The encoded value in `[0, 1]` of linear light, by interpolation between codes.
    pub fn encode(&self, light: f32) -> f32 {
        let above = self.0.partition_point(|&l| l < light).min(usize::from(STEPS));
        if above == 0 {
            return 0.0;
        }
        let (low, high) = (self.0[above - 1], self.0[above]);
        let between = if high > low { ((light - low) / (high - low)).min(1.0) } else { 1.0 };
        ((above - 1) as f32 + between) / f32::from(STEPS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use imaging::Raster;

    #[test]
    fn rounding_is_that_of_the_file() {
        let step = |codes: &[CodeValues]| rounding(codes.iter()).sqrt() * 12f64.sqrt();
        assert!((step(&[[0, 16, 4080], [32, 32, 32]]) - 1.0 / 255.0).abs() < 1e-12);
        assert!((step(&[[0, 16, 4080], [32, 33, 32]]) - 1.0 / 4080.0).abs() < 1e-12);
    }

    #[test]
    fn a_table_agrees_with_the_curve() {
        let curve = DualGamma::new(2.6, 2.1).unwrap();
        let table = ResponseTable::new(&curve);
        for i in 0..=255u16 {
            let encoded = f32::from(i) / 255.0;
            let code = codes(&Encoded(Raster::filled(1, 1, [encoded; 3])))[0][0];
            assert_eq!((code, table.light(code)), (i * 16, curve.decode_value(f32::from(i * 16) / 4080.0)));
            assert!((table.encode(table.light(code)) - encoded).abs() < 1e-4);
        }
        for light in [0.0001, 0.003, 0.2, 0.77] {
            assert!((table.encode(light) - curve.encode_value(light)).abs() < 1e-4);
        }
        assert_eq!((table.encode(-1.0), table.encode(7.0), table.encode(f32::NAN)), (0.0, 1.0, 0.0));
        assert!((table.slope(STEPS) - 2.1).abs() < 0.02 && table.slope(0) > 0.0);
    }
}
