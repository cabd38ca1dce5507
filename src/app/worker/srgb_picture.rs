//! Pictures in texture format, and thumbnails for panels.

use glam::{Quat, Vec3};
use imaging::color::{byte_from_unit, luminance, srgb_from_linear};
use imaging::resample::resize_area;
use imaging::{Encoded, Image};
use light::{Environment, latlong};

/// A picture in 8-bit sRGB.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SrgbPicture {
    pub width: usize,
    pub height: usize,
    /// sRGB codes, three bytes per pixel, row by row.
    pub rgb: Vec<u8>,
}

/// Direction reflected to the camera at a point of a mirror ball of radius 1, to the right and up; None beside
/// the ball.
pub fn mirrored([x, y]: [f32; 2]) -> Option<Vec3> {
    let depth = 1.0 - x * x - y * y;
    let normal = (depth >= 0.0).then(|| Vec3::new(x, y, depth.sqrt()))?;
    Some(2.0 * normal.z * normal - Vec3::Z)
}

/// Point of a mirror ball of radius 1, to the right and up, that reflects a direction to the camera. The
/// direction right behind the ball maps to its upper edge.
pub fn on_mirror_ball(direction: Vec3) -> [f32; 2] {
    let normal = (direction.normalize_or_zero() + Vec3::Z).normalize_or(Vec3::Y);
    [normal.x, normal.y]
}

/// Width and height, reduced so that the longer is at most `longer_px`; neither is less than 1.
pub(super) fn reduced_size((width, height): (usize, usize), longer_px: usize) -> (usize, usize) {
    let longer = width.max(height).max(1);
    let reduce = |side: usize| (side * longer_px.min(longer) / longer).max(1);
    (reduce(width), reduce(height))
}

impl SrgbPicture {
    /// Columns of a thumbnail: sharp in a panel of 240 points on a screen with two pixels per point.
    const WIDTH: usize = 480;
    /// Columns of a turned thumbnail: few enough for about 3 ms per step of a drag.
    const TURNED_WIDTH: usize = 256;

    /// The codes of a picture.
    pub fn from_picture(picture: &Encoded) -> Self {
        let codes = picture.0.pixels.iter().flatten();
        Self {
            width: picture.0.width,
            height: picture.0.height,
            rgb: codes.map(|&code| byte_from_unit(code)).collect(),
        }
    }

    /// The codes of a picture, reduced to at most `longer_px` pixels along its longer side. Averages codes, which
    /// is accurate enough for viewing.
    pub fn reduced(picture: &Encoded, longer_px: usize) -> Self {
        let (width, height) = reduced_size(picture.0.size(), longer_px);
        Self::from_picture(&Encoded(resize_area(&picture.0, width, height)))
    }

    /// A thumbnail of a photograph's light as a panorama, as bright as the photograph: 1 is white, and noise
    /// stays dark.
    pub fn as_exposed(light: &Image) -> Self {
        Self::encoded(&Self::panorama(light), |pixel| pixel)
    }

    /// A thumbnail of a panorama: its log-average luminance at middle grey, highlights rolled off
    /// (Reinhard et al., SIGGRAPH 2002, equations 1 to 4).
    pub fn tone_mapped(radiance: &Image) -> Self {
        let small = Self::panorama(radiance);
        // Black texels carry no exposure and would pull the average to zero.
        let lit: Vec<f32> = small.pixels.iter().map(|&p| luminance(p)).filter(|&y| y > 0.0).collect();
        let log_sum: f64 = lit.iter().map(|&y| f64::from(y).ln()).sum();
        let average = (log_sum / lit.len().max(1) as f64).exp() as f32;
        let white = lit.iter().copied().fold(0.0, f32::max) * 0.18 / average;
        Self::encoded(&small, |pixel| {
            let y = luminance(pixel) * 0.18 / average;
            let shown = (1.0 + y / (white * white).max(1.0)) / (1.0 + y) * 0.18 / average;
            pixel.map(|v| v * shown)
        })
    }

    /// The same panorama for a turned environment, up to `TURNED_WIDTH` columns wide; see
    /// [`light::weights::rotation`].
    pub fn turned(&self, turn: Quat) -> Self {
        let codes = self.as_environment();
        let width = self.width.min(Self::TURNED_WIDTH);
        let height = (width / 2).max(1);
        let back = turn.inverse();
        // One thread, because the window waits and other threads may be busy with a job.
        let rgb = (0..width * height).flat_map(|i| {
            let direction = latlong::texel_direction(i % width, i / width, width, height);
            codes.radiance(back * direction).map(|v| v.round() as u8)
        });
        Self { width, height, rgb: rgb.collect() }
    }

    /// View of the panorama in a mirror ball `side` pixels wide after a turn, seen by the camera; black around
    /// the ball.
    pub fn mirror_ball(&self, turn: Quat, side: usize) -> Self {
        let codes = self.as_environment();
        let back = turn.inverse();
        let across = |i: usize| (2 * i + 1) as f32 / side as f32 - 1.0;
        let rgb = (0..side * side).flat_map(|i| {
            let seen = mirrored([across(i % side), -across(i / side)]);
            seen.map_or([0; 3], |to| codes.radiance(back * to).map(|v| v.round() as u8))
        });
        Self { width: side, height: side, rgb: rgb.collect() }
    }

    /// Its codes as if they were light.
    fn as_environment(&self) -> Environment {
        let codes = self.rgb.chunks_exact(3);
        let codes = Image {
            width: self.width,
            height: self.height,
            pixels: codes.map(|c| [c[0], c[1], c[2]].map(f32::from)).collect(),
        };
        Environment::from_radiance("", codes)
    }

    fn panorama(radiance: &Image) -> Image {
        let (width, height) = (Self::WIDTH.min(radiance.width), (Self::WIDTH / 2).min(radiance.height));
        resize_area(radiance, width, height)
    }

    fn encoded(small: &Image, shown: impl Fn([f32; 3]) -> [f32; 3]) -> Self {
        let codes = |pixel: &[f32; 3]| shown(*pixel).map(|v| byte_from_unit(srgb_from_linear(v)));
        Self { width: small.width, height: small.height, rgb: small.pixels.iter().flat_map(codes).collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use light::weights::rotation;

    #[test]
    fn a_thumbnail_does_not_depend_on_the_panoramas_units() {
        let picture = Image::from_fn(64, 32, |x, y| [x as f32 / 64.0, y as f32 / 32.0, 0.3]);
        let brighter = picture.map(|p| p.map(|v| v * 1024.0));
        let (a, b) = (SrgbPicture::tone_mapped(&picture), SrgbPicture::tone_mapped(&brighter));
        let worst = a.rgb.iter().zip(&b.rgb).map(|(a, b)| a.abs_diff(*b)).max();
        assert!(worst <= Some(1), "{worst:?}");
    }

    #[test]
    fn black_panoramas_and_suns_have_thumbnails() {
        assert!(SrgbPicture::tone_mapped(&Image::filled(4, 2, [0.0; 3])).rgb.iter().all(|&v| v == 0));
        let sun = Image::from_fn(64, 32, |x, y| [if (x, y) == (9, 9) { 1e6 } else { 0.5 }; 3]);
        let grey = SrgbPicture::tone_mapped(&sun).rgb[0];
        assert!((80..160).contains(&grey), "a sun leaves the sky at {grey}");
    }

    #[test]
    fn a_mirror_ball_shows_every_direction_once() {
        for direction in [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::Z, Vec3::new(0.3, -0.5, -0.7)] {
            let direction = direction.normalize();
            let back = mirrored(on_mirror_ball(direction)).unwrap();
            assert!(back.distance(direction) < 1e-5, "{direction} {back}");
        }
        assert_eq!(mirrored([0.0, 0.0]), Some(Vec3::Z));
        assert!(on_mirror_ball(Vec3::X)[0] > 0.7, "light from the right is right");
        assert_eq!(mirrored([0.9, 0.9]), None);
        // Red to the camera's right, green elsewhere.
        let panorama = SrgbPicture {
            width: 8,
            height: 4,
            rgb: (0..32).flat_map(|i| if (5..7).contains(&(i % 8)) { [200, 0, 0] } else { [0, 100, 0] }).collect(),
        };
        let ball = panorama.mirror_ball(Quat::IDENTITY, 33);
        let at = |x: usize, y: usize| &ball.rgb[3 * (33 * y + x)..][..3];
        assert_eq!(at(28, 16), [200, 0, 0]);
        assert_eq!(at(4, 16), [0, 100, 0]);
        assert_eq!(at(0, 0), [0; 3]);
    }

    #[test]
    fn a_turned_thumbnail_shows_what_the_turn_brings_there() {
        let bright = |x: usize, y: usize| (96..104).contains(&x) && (60..68).contains(&y);
        let picture = Image::from_fn(256, 128, |x, y| [if bright(x, y) { 4.0 } else { 0.2 }; 3]);
        let flat = SrgbPicture::tone_mapped(&picture);
        let brightest = |shown: &SrgbPicture| {
            let sum = |i: &usize| shown.rgb[3 * i..3 * i + 3].iter().map(|&v| u32::from(v)).sum::<u32>();
            let i = (0..shown.width * shown.height).max_by_key(sum).unwrap();
            latlong::texel_direction(i % shown.width, i / shown.width, shown.width, shown.height)
        };
        let spot = latlong::direction_from_uv(100.0 / 256.0, 64.0 / 128.0);
        for (yaw, pitch, roll) in [(0.0, 0.0, 0.0), (70.0, 40.0, 0.0), (-20.0, -130.0, 75.0)] {
            let turn = rotation(yaw, pitch, roll);
            let seen = brightest(&flat.turned(turn));
            let off = seen.angle_between(turn * spot).to_degrees();
            // The spot is 11° across.
            assert!(off < 8.0, "{yaw}, {pitch}, {roll}: {off}° off");
        }
        assert_eq!(flat.turned(Quat::IDENTITY), flat);
    }
}
