//! Environments of the stage: the nave and the courtyard of [`light::built_in`], which are independent of lamps and
//! weights.

use imaging::Image;
use light::built_in;

/// Columns of the panoramas.
const WIDTH: usize = 256;

/// The environments by file name.
pub fn all() -> Vec<(&'static str, Image)> {
    ["nave", "courtyard"]
        .into_iter()
        .filter_map(built_in::named)
        .map(|environment| (environment.name, (environment.make)(WIDTH)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use imaging::color::luminance;
    use light::latlong::texel_solid_angle;

    #[test]
    fn the_environments_are_light_with_a_wide_range() {
        assert_eq!(all().len(), 2);
        for (name, image) in all() {
            assert!(image.pixels.iter().flatten().all(|v| v.is_finite() && *v > 0.0), "{name}");
            let mut levels: Vec<f32> = image.pixels.iter().map(|&p| luminance(p)).collect();
            levels.sort_by(f32::total_cmp);
            let (median, brightest) = (levels[levels.len() / 2], levels[levels.len() - 1]);
            assert!(brightest > 500.0 * median, "{name}: {brightest} over {median}");
            // The value fits a half float.
            assert!(brightest < 65_504.0, "{name}: {brightest}");
        }
    }

    #[test]
    fn the_sun_lights_the_courtyard_a_few_times_as_much_as_the_sky() {
        let (_, image) = &all()[1];
        let mut flux = [0.0f64; 2];
        for (i, &p) in image.pixels.iter().enumerate() {
            let level = f64::from(luminance(p));
            flux[usize::from(level > 100.0)] += level * texel_solid_angle(i / image.width, image.width, image.height);
        }
        let ratio = flux[1] / flux[0];
        assert!((0.3..8.0).contains(&ratio), "{ratio}");
    }
}
