//! A lamp's direction from the shading of a matt ball: a check of the mirror ball that shares only the camera with
//! it.

use super::mirror_ball::MirrorBall;
use base::error::{Error, Result};
use glam::{DMat4, DVec3, DVec4, Vec3};
use imaging::Image;
use imaging::color::luminance;
use project::Ball;

/// A lamp measured on a matt ball.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shading {
    /// Unit direction from the subject to the lamp.
    pub direction: Vec3,
    /// Luminance of the ball where it faces the lamp, minus the ambient.
    pub strength: f32,
    /// Luminance common to all lit pixels: the room's own light.
    pub ambient: f32,
    /// Root-mean-square residual relative to `strength`: a few hundredths for a matt ball in linear light, far more
    /// for encoded values or a ball that is not matt.
    pub residual: f32,
    /// Number of pixels used: lit by the lamp, without highlights and stains.
    pub pixels: usize,
}

/// Fits I = ambient + strength · n·l (Lambert) to the lit pixels of a matt ball in a linear photograph, by least
/// squares with Tukey's weights, so that highlights, stains and cast shadows do not count. The lit pixels follow
/// from l, so both are iterated. The lamp is assumed to be far away.
///
/// # Errors
/// When the ball's figures are out of range, the photograph does not show the ball, or fewer than a hundred of its
/// pixels are lit.
pub fn lamp_from_shading(ball: &Ball, photograph: &Image) -> Result<Shading> {
    let pixels: Vec<Pixel> = normals(ball, photograph.size())?
        .into_iter()
        .map(|(index, normal)| Pixel { normal, light: f64::from(luminance(photograph.pixels[index])) })
        .filter(|pixel| pixel.light.is_finite())
        .collect();
    let dark = || {
        Error::invalid(
            "fewer than a hundred lit pixels on the matt ball in the photograph",
            "Check that the lamp was on, and the ball's centre and radius",
        )
    };
    // Bright pixels roughly face the lamp.
    let towards: DVec3 = pixels.iter().map(|p| p.light.max(0.0) * p.normal).sum();
    let mut fit = Fit { lamp: towards.try_normalize().ok_or_else(dark)?, ambient: 0.0 };
    let mut used = Vec::new();
    for round in 0..ROUNDS {
        let direction = fit.lamp.try_normalize().ok_or_else(dark)?;
        let lit: Vec<&Pixel> = pixels.iter().filter(|p| p.normal.dot(direction) > GRAZING).collect();
        if lit.len() < 100 {
            return Err(dark());
        }
        // The first fits are rough, so their outliers may not be outliers yet.
        let scale = if round < 3 { f64::INFINITY } else { fit.scale(&lit) };
        used =
            lit.into_iter().map(|p| (p, tukey(fit.residual(p) / scale))).filter(|(_, weight)| *weight > 0.0).collect();
        fit = Fit::from_pixels(&used).ok_or_else(dark)?;
    }
    let strength = fit.lamp.length();
    // Uniform light leaves only a rounding-error lamp.
    let least = 1e-6 * fit.ambient.abs();
    if used.len() < 100 || strength.is_nan() || strength <= least {
        return Err(dark());
    }
    let square: f64 = used.iter().map(|(p, w)| w * fit.residual(p).powi(2)).sum();
    let weight: f64 = used.iter().map(|(_, w)| w).sum();
    Ok(Shading {
        direction: (fit.lamp / strength).as_vec3(),
        strength: strength as f32,
        ambient: fit.ambient as f32,
        residual: ((square / weight).sqrt() / strength) as f32,
        pixels: used.len(),
    })
}

/// Rounds of the fit. After about ten the lamp moves by less than 1e-4°.
const ROUNDS: usize = 20;

/// Smallest cosine to the lamp of a usable pixel: 84°, where a real ball's shadow begins and its material shows
/// most.
const GRAZING: f64 = 0.1;

struct Pixel {
    normal: DVec3,
    light: f64,
}

/// The model: light = lamp · normal + ambient.
struct Fit {
    lamp: DVec3,
    ambient: f64,
}

impl Fit {
    /// Weighted least squares; `None` if the normals do not determine the lamp.
    fn from_pixels(pixels: &[(&Pixel, f64)]) -> Option<Self> {
        let (mut square, mut target) = (DMat4::ZERO, DVec4::ZERO);
        for (pixel, weight) in pixels {
            let row = pixel.normal.extend(1.0);
            let weighted = *weight * row;
            square += DMat4::from_cols(weighted * row.x, weighted * row.y, weighted * row.z, weighted * row.w);
            target += weighted * pixel.light;
        }
        let sum: f64 = pixels.iter().map(|(_, weight)| weight).sum();
        let (square, target) = (square * (1.0 / sum), target / sum);
        let solution = square.inverse() * target;
        let sound = sum > 0.0 && square.determinant() > 1e-12 && solution.is_finite();
        sound.then(|| Self { lamp: solution.truncate(), ambient: solution.w })
    }

    fn residual(&self, pixel: &Pixel) -> f64 {
        pixel.light - self.lamp.dot(pixel.normal) - self.ambient
    }

    /// Standard deviation of the residuals without outliers, from their median magnitude. At least a thousandth of
    /// the lamp's strength, because 8 bits resolve no more.
    fn scale(&self, pixels: &[&Pixel]) -> f64 {
        let mut sizes: Vec<f64> = pixels.iter().map(|p| self.residual(p).abs()).collect();
        sizes.sort_by(f64::total_cmp);
        (1.4826 * sizes[sizes.len() / 2]).max(1e-3 * self.lamp.length())
    }
}

/// Tukey's biweight of a residual in standard deviations (Beaton and Tukey 1974), 95 % efficient.
fn tukey(deviations: f64) -> f64 {
    let x = deviations / 4.685;
    if x.abs() < 1.0 { (1.0 - x * x).powi(2) } else { 0.0 }
}

/// Surface normal at each pixel fully on the ball: halfway between the reflected direction and the camera.
fn normals(ball: &Ball, size: (usize, usize)) -> Result<Vec<(usize, DVec3)>> {
    let geometry = MirrorBall::new(ball, None, size)?;
    let (r, d) = (f64::from(ball.radius_m), f64::from(ball.camera_distance_m));
    let focal_px = f64::from(ball.radius_px) / (r / d).asin().tan();
    let normal = |index: usize, reflected: Vec3| {
        let x = (index % size.0) as f64 + 0.5 - f64::from(ball.center_px[0]);
        let y = (index / size.0) as f64 + 0.5 - f64::from(ball.center_px[1]);
        let to_camera = DVec3::new(-x, y, focal_px).normalize();
        (reflected.as_dvec3() + to_camera).normalize_or_zero()
    };
    let pixels = geometry.pixels.iter();
    Ok(pixels.map(|pixel| (pixel.index, normal(pixel.index, pixel.direction))).collect())
}

#[cfg(test)]
mod tests;
