//! Pictures of the full sphere: the direction and solid angle of each pixel, and conversion between mappings.
//!
//! All share one world frame: right-handed, +Y up, the camera on +Z looking along −Z. Pictures have their origin in
//! the top left corner; u ∈ [0, 1] goes right and v ∈ [0, 1] down.
//!
//! | mapping | size | middle | right of it | what it is |
//! |---|---|---|---|---|
//! | [`Mapping::LatLong`] | any | −Z | +X | [`super::latlong`] |
//! | [`Mapping::Angular`] | n×n | −Z | +X | Debevec's light probe: radius ∝ angle from the middle |
//! | [`Mapping::MirrorBall`] | n×n | +Z | +X | an ideal ball's photograph from afar: radius = sin(angle/2) |
//! | [`Mapping::CubeCross`] | 4n×3n | −Z, row 2 column 2 | +X | six views from within |
//! | [`Mapping::CubeStrip`] | 6n×n | – | – | OpenGL's six faces side by side |
//!
//! The mirror ball is seen from outside: its middle shows the camera, and its picture is mirrored compared with a
//! view from inside. Both discs touch the frame; the area outside is black and shows nothing. Their rims show one
//! direction only: −Z for the mirror ball, +Z for the angular map.
//!
//! `pfspanoramic` of pfstools 2.2 has the same `polar` and `angular`. Its `mirrorball` is a view from inside: its
//! result for a ball's photograph is ours with left and right exchanged and half a turn of yaw, u' = 3/2 − u (mod
//! 1). It places a pixel's value at the pixel's top left corner, so its pictures are displaced by half a source
//! pixel. With both differences undone a smooth picture agrees to 63 dB or more (tests/pfstools.rs); with only the
//! first undone, to 38 to 43 dB.

mod disc;
mod projection;
mod resample;
#[cfg(test)]
mod tests;

pub use disc::{Disc, Profile};
pub use projection::{Kind, Projection};
pub use resample::resample;

use super::Environment;
use base::error::{Error, Result};
use glam::{DQuat, DVec3, Quat};
use imaging::{Image, Raster};
use serde::{Deserialize, Serialize};

/// Layout of the sphere in a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize, clap::ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Mapping {
    /// Longitude along the rows, latitude along the columns.
    LatLong,
    /// Debevec's angular map ("light probe"): the middle shows −Z, the rim +Z, and the distance from
    /// the middle is proportional to the angle from −Z.
    Angular,
    /// The photograph of an ideal mirror ball from far away: the middle shows +Z (the camera), the rim
    /// −Z, and the distance from the middle is sin(angle/2). Every pixel covers the same solid angle.
    MirrorBall,
    /// A cube seen from inside, unfolded around its front (−Z): above it +Y, below it −Y, left of it −X, right of
    /// it +X, and at the far right +Z. The other six cells are black.
    CubeCross,
    /// The cube's faces +X −X +Y −Y +Z −Z from left to right, each laid out as in OpenGL's table of cube map
    /// coordinates (that table is left-handed, so the faces look mirrored from inside).
    CubeStrip,
}

impl Mapping {
    /// All mappings.
    pub const ALL: [Self; 5] = [Self::LatLong, Self::Angular, Self::MirrorBall, Self::CubeCross, Self::CubeStrip];

    /// Unit direction at the place (u, v); `None` if the picture shows nothing there.
    pub fn direction(self, u: f64, v: f64) -> Option<DVec3> {
        let unit = self.unit();
        let (x, y) = (u * unit.width as f64, v * unit.height as f64);
        let inside = (0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v);
        unit.look(x, y).filter(|_| inside).map(|(direction, _)| direction)
    }

    /// Place (u, v) of a direction of any non-zero length.
    pub fn position(self, direction: DVec3) -> (f64, f64) {
        let unit = self.unit();
        // Only photographs miss some directions.
        let (x, y) = unit.place(direction.normalize_or(DVec3::NEG_Z)).unwrap_or((0.0, 0.0));
        (x / unit.width as f64, y / unit.height as f64)
    }

    /// Size of this mapping's pictures with square pixels and a height near `height`.
    pub fn size(self, height: usize) -> (usize, usize) {
        let height = height.max(1);
        match self {
            Self::LatLong => (2 * height, height),
            Self::Angular | Self::MirrorBall => (height, height),
            Self::CubeCross => (4 * height.div_ceil(3), 3 * height.div_ceil(3)),
            Self::CubeStrip => (6 * height, height),
        }
    }

    /// Solid angle of each pixel in steradians; 0 where it shows nothing. The sum is 4π: exactly for lat-longs and
    /// cubes, and for the discs because neighbours share the integrals along their borders.
    ///
    /// # Errors
    /// When a picture of this mapping cannot have this size.
    pub fn solid_angles(self, size: (usize, usize)) -> Result<Raster<f64>> {
        let projection = self.projection(size)?;
        Ok(Raster { width: size.0, height: size.1, pixels: projection.solid_angles() })
    }

    /// ∫ E dω over the sphere, per channel. Pixels that show nothing do not count.
    ///
    /// # Errors
    /// When a picture of this mapping cannot have this size.
    pub fn energy(self, picture: &Image) -> Result<[f64; 3]> {
        let angles = self.solid_angles(picture.size())?;
        let mut energy = [0.0; 3];
        for (pixel, &angle) in picture.pixels.iter().zip(&angles.pixels) {
            if angle > 0.0 {
                for (sum, &value) in energy.iter_mut().zip(pixel) {
                    *sum += angle * f64::from(value);
                }
            }
        }
        Ok(energy)
    }

    /// Checks a size and returns the projection of such a picture.
    pub fn projection(self, (width, height): (usize, usize)) -> Result<Projection> {
        let (fits, expected) = match self {
            Self::LatLong => (width > 0 && height > 0, "at least one pixel"),
            Self::Angular | Self::MirrorBall => (width > 0 && width == height, "a square picture"),
            Self::CubeCross => (width > 0 && width.is_multiple_of(4) && width / 4 * 3 == height, "4×3 square faces"),
            Self::CubeStrip => (height > 0 && width == 6 * height, "6×1 square faces"),
        };
        if fits && u32::try_from(width.saturating_mul(height)).is_ok() {
            return Ok(self.geometry(width, height));
        }
        Err(Error::invalid(
            format!(
                "{width}×{height} pixels do not suit the mapping {self:?}: it needs {expected}, and \
                 fewer than 4 billion pixels"
            ),
            "Choose another size or another mapping",
        ))
    }

    /// Projection of the smallest picture.
    fn unit(self) -> Projection {
        match self {
            Self::CubeCross => self.geometry(4, 3),
            Self::CubeStrip => self.geometry(6, 1),
            _ => self.geometry(1, 1),
        }
    }

    fn geometry(self, width: usize, height: usize) -> Projection {
        let disc = |profile, facing| {
            Kind::Disc(Disc {
                centre: [0.5 * width as f64, 0.5 * height as f64],
                radius: 0.5 * width as f64,
                profile,
                facing,
            })
        };
        let kind = match self {
            Self::LatLong => Kind::LatLong,
            Self::Angular => disc(Profile::Angular, -1.0),
            Self::MirrorBall => disc(Profile::FAR_BALL, 1.0),
            Self::CubeCross => Kind::Cube(&projection::CROSS, height / 3),
            Self::CubeStrip => Kind::Cube(&projection::STRIP, height),
        };
        Projection { width, height, kind }
    }
}

/// A picture converted to another mapping.
#[derive(Clone, Debug)]
pub struct Converted {
    /// Radiance, finite and not negative; black where the mapping shows nothing.
    pub image: Image,
    /// Number of repaired source pixels (NaN, infinite or negative), as in [`Environment::from_radiance`]; pixels
    /// outside a disc or cross do not count.
    pub repaired_pixels: usize,
}

/// Converts a picture to another mapping and size. It is interpolated where it grows and averaged by solid angle
/// where it shrinks, across seams, poles and cube edges. Its energy ([`Mapping::energy`]) is kept to one part in
/// 100 000, even that of a lamp in one pixel, and a uniform sky stays uniform.
///
/// # Errors
/// When either size does not suit its mapping.
pub fn convert(image: &Image, from: Mapping, to: Mapping, size: (usize, usize)) -> Result<Converted> {
    convert_turned(image, from, to, size, Quat::IDENTITY)
}

/// [`convert`] with the world rotated: direction ω becomes `turn · ω`. A rotation of −ψ about +Y is a yaw of +ψ,
/// towards larger u.
///
/// # Errors
/// When either size does not suit its mapping.
pub fn convert_turned(
    image: &Image,
    from: Mapping,
    to: Mapping,
    size: (usize, usize),
    turn: Quat,
) -> Result<Converted> {
    let (source, target) = (from.projection(image.size())?, to.projection(size)?);
    let shown = source.coverage();
    let mut image = image.clone();
    for (pixel, &shown) in image.pixels.iter_mut().zip(&shown) {
        if shown <= 0.0 {
            *pixel = [0.0; 3];
        }
    }
    let clean = Environment::from_radiance("", image);
    let turn = if turn.is_finite() { turn.as_dquat().normalize() } else { DQuat::IDENTITY };
    let resampled = resample(&clean.radiance, &source, &shown, &target, turn);
    Ok(Converted { image: resampled.image, repaired_pixels: clean.repaired_texels })
}
