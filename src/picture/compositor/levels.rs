//! Brightness of subject and background, before the scene's own exposure.
//!
//! Neither has an absolute scale: an HDRI's radiance is in its own units, and a reflectance field
//! in units of the OLAT session. Their ratio cannot be measured either if the mirror balls were
//! photographed through a filter of unknown density. So both are set from assumptions about people.

use super::field::Field;
use super::reference::SOLID;
use base::error::Result;
use imaging::{Image, Mask, color::luminance};
use light::{Environment, LightWeights};
use serde::{Deserialize, Serialize};

/// Mean luminance factor assumed of a subject: between dark skin (0.1) and white clothes (0.8), near
/// light skin (0.35).
const SUBJECT_ALBEDO: f32 = 0.35;

/// Level of the subject's mean at 0 stops: middle grey.
const MIDDLE_GREY: f32 = 0.18;

/// Factors from stored units to the picture's, constant over a clip.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Levels {
    /// Factor on Σ weights · field.
    pub subject: f32,
    /// Factor on the environment's radiance.
    pub background: f32,
}

impl Default for Levels {
    /// Stored units unchanged.
    fn default() -> Self {
        Self { subject: 1.0, background: 1.0 }
    }
}

impl Levels {
    /// Levels at which a subject of albedo 0.35 in light of the environment's mean radiance is middle
    /// grey, and stands in front of that environment as if it were there. `even` are the weights
    /// of an environment of radiance 1 everywhere; `field` and `mask` are any one frame of the clip.
    /// A black field or environment gets the default level.
    ///
    /// # Errors
    /// When the GPU of the field fails.
    pub fn balanced(environment: &Environment, even: &LightWeights, field: &Field, mask: &Mask) -> Result<Self> {
        let albedo_in_field_units = mean_solid_luminance(&field.relight(&even.per_lamp)?, mask);
        let gain = Self::of_environment(environment);
        let subject = positive(SUBJECT_ALBEDO / albedo_in_field_units);
        Ok(Self { subject: gain * subject, background: gain })
    }
}

impl Levels {
    /// Level of the background: an albedo of 0.35 in the environment's mean radiance is middle grey.
    pub fn of_environment(environment: &Environment) -> f32 {
        positive(MIDDLE_GREY / (SUBJECT_ALBEDO * mean_radiance(environment)))
    }

    /// One unit of light on the stage in the environment's units: the unit of placed lights.
    pub fn unit(&self) -> f32 {
        1.0 / self.background
    }

    /// Factor that brings the weights of a light with mean radiance 1 to these levels.
    pub fn of_unit_light(&self) -> f32 {
        positive(MIDDLE_GREY / (SUBJECT_ALBEDO * self.background))
    }
}

/// Usable factor with a finite inverse: 1 if it is not normal or not above 0.
fn positive(factor: f32) -> f32 {
    if factor.is_normal() && factor > 0.0 { factor } else { 1.0 }
}

fn mean_solid_luminance(picture: &Image, mask: &Mask) -> f32 {
    let (mut sum, mut count) = (0f64, 0u32);
    for (pixel, &alpha) in picture.pixels.iter().zip(&mask.pixels) {
        let y = luminance(*pixel);
        if alpha >= SOLID && y.is_finite() {
            sum += f64::from(y);
            count += 1;
        }
    }
    (sum / f64::from(count)) as f32
}

/// Mean luminance over the sphere.
fn mean_radiance(environment: &Environment) -> f32 {
    let sphere = 4.0 * std::f64::consts::PI;
    luminance(environment.energy().map(|energy| (energy / sphere) as f32))
}

#[cfg(test)]
mod tests {
    use super::*;
    use reflectance::ReflectanceField;

    fn environment(radiance: Image) -> Environment {
        Environment { name: "test".into(), radiance, repaired_texels: 0 }
    }

    #[test]
    fn a_subject_in_even_light_is_middle_grey_whatever_the_units() {
        let mask = Mask::filled(8, 8, 1.0);
        for (unit, brightness) in [(1.0, 1.0), (0.02, 700.0), (300.0, 0.001)] {
            let field = ReflectanceField::from_olats(&vec![Image::filled(8, 8, [unit; 3]); 4]).into();
            let even = LightWeights { per_lamp: vec![[0.25; 3]; 4], uncovered: 0.0 };
            let light = environment(Image::filled(32, 16, [brightness; 3]));
            let levels = Levels::balanced(&light, &even, &field, &mask).unwrap();
            let relit = unit * brightness * levels.subject;
            assert!((relit - MIDDLE_GREY).abs() < 1e-5, "{unit} {brightness}: {relit}");
            assert!((levels.background * brightness * SUBJECT_ALBEDO - MIDDLE_GREY).abs() < 1e-5);
        }
    }

    #[test]
    fn black_light_black_fields_and_empty_mattes_leave_usable_levels() {
        let even = LightWeights { per_lamp: vec![[1.0; 3]; 2], uncovered: 0.0 };
        for (light, value, alpha) in
            [(0.0, 1.0, 1.0), (1.0, 0.0, 1.0), (1.0, f32::NAN, 1.0), (1.0, 1.0, 0.0), (f32::MAX, 1.0, 1.0)]
        {
            let field = ReflectanceField::from_olats(&vec![Image::filled(4, 4, [value; 3]); 2]).into();
            let light = environment(Image::filled(4, 2, [light; 3]));
            let levels = Levels::balanced(&light, &even, &field, &Mask::filled(4, 4, alpha)).unwrap();
            assert!(levels.subject.is_normal() && levels.background.is_normal(), "{levels:?}");
        }
        test_support::shown!(Pictures, "Levels of black light, light of 3.4·10³⁸, black or NaN fields, empty mattes",
 bound: "levels and their inverses finite and above 0", measured: "holds");
    }
}
