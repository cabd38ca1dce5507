//! Skies: clear ones after Preetham, Shirley and Smits, "A Practical Analytic Model for Daylight"
//! (SIGGRAPH 1999), the CIE overcast sky (ISO 15469), and a plain below them.
//!
//! Radiances are in kcd/m² of luminance. Preetham's skies are 1.6 to 2.8 times as bright as measured clear skies
//! and would drown the sun. Their distribution and colours are kept and scaled to the diffuse illuminance of the
//! IES Lighting Handbook (9th edition, chapter 8).

use super::panorama::panorama;
use super::pattern::{noise, ramp};
use crate::patch::{Outline, Patch};
use crate::white;
use glam::{DVec3, Vec3};
use imaging::Image;
use imaging::color::{linear_from_xyz, luminance};
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Mean radius of the sun seen from the earth in radians (959.63″, IAU).
const SUN_RADIUS: f64 = 959.63 / 3600.0 * PI / 180.0;
/// Illuminance of the sun above the atmosphere in klx (Darula, Kittler and Gueymard 2005).
const SUN_KLX: f64 = 133.1;

/// A clear sky with the sun behind the camera's left shoulder.
pub fn clear(width: usize) -> Image {
    ClearSky::new(2.2, -130f64.to_radians(), 40f64.to_radians()).panorama(width)
}

/// A low sun, ahead and to the right.
pub fn low_sun(width: usize) -> Image {
    ClearSky::new(3.0, 48f64.to_radians(), 8f64.to_radians()).panorama(width)
}

/// A closed cover of cloud.
pub fn overcast(width: usize) -> Image {
    // 12 klx on the ground, an overcast spring noon at 50°; clouds are a little bluer than D65.
    const ZENITH: f32 = 5.0;
    let cloud = Vec3::from(white::gains(6800.0, 0.0)) * ZENITH;
    let ground = cloud * (7.0 / 9.0);
    panorama(width, |direction| {
        if direction.y < 0.0 {
            return plain(direction, ground, cloud / 3.0);
        }
        // Billows of 5 %, present in real clouds and absent from the standard.
        let p = direction / (direction.y + 0.25);
        let billow = noise(p * Vec3::new(1.3, 0.0, 1.3)) + 0.5 * noise(p * Vec3::new(3.1, 0.0, 3.1));
        cloud * overcast_gradation(direction.y) * (1.0 + 0.05 * billow)
    })
}

/// Luminance relative to the zenith, by the sine of the elevation (Moon and Spencer 1942; ISO 15469, type 16).
fn overcast_gradation(sine: f32) -> f32 {
    (1.0 + 2.0 * sine) / 3.0
}

/// A plain of dry grass under `irradiance / π` that fades into `horizon` with distance.
fn plain(direction: Vec3, white: Vec3, horizon: Vec3) -> Vec3 {
    // The ray meets the ground, 1.6 m below, here.
    let p = direction * (1.6 / -direction.y.min(-1e-3));
    // Detail fades where a texel covers many metres.
    let fine = 1.0 - ramp(8.0, 40.0, p.length());
    let grain = 0.12 * fine * (noise(p * 1.1) + noise(p * 4.3)) + 0.18 * noise(Vec3::new(p.x, 0.0, p.z) * 0.11);
    let ground = Vec3::new(0.23, 0.21, 0.13) * (1.0 + grain) * white;
    let haze = 1.0 - (-p.length() / 400.0).exp();
    ground.lerp(horizon * 0.8, haze)
}

/// A clear sky with its sun.
struct ClearSky {
    turbidity: f64,
    azimuth: f64,
    elevation: f64,
    sun: DVec3,
    /// For luminance (as in Preetham), x and y: the zenith value divided by the Perez function there, and the
    /// function's five parameters.
    parts: [(f64, [f64; 5]); 3],
    /// Factor that scales the sky to its illuminance.
    level: f64,
}

impl ClearSky {
    /// A sky of a turbidity (2 is very clear, 6 hazy) with the sun at an azimuth and elevation in radians.
    fn new(turbidity: f64, azimuth: f64, elevation: f64) -> Self {
        let t = turbidity;
        // Appendix A.2: the parameters of luminance, x and y, each linear in turbidity.
        let lines = [
            [(0.1787, -1.4630), (-0.3554, 0.4275), (-0.0227, 5.3251), (0.1206, -2.5771), (-0.0670, 0.3703)],
            [(-0.0193, -0.2592), (-0.0665, 0.0008), (-0.0004, 0.2125), (-0.0641, -0.8989), (-0.0033, 0.0452)],
            [(-0.0167, -0.2608), (-0.0950, 0.0092), (-0.0079, 0.2102), (-0.0441, -1.6537), (-0.0109, 0.0529)],
        ];
        let theta = FRAC_PI_2 - elevation;
        let zenith = zenith(t, theta);
        let parts = std::array::from_fn(|i| {
            let parameters = lines[i].map(|(slope, offset)| slope * t + offset);
            (zenith[i] / perez(parameters, 1.0, theta), parameters)
        });
        let (sin_phi, cos_phi) = azimuth.sin_cos();
        let (sin_up, cos_up) = elevation.sin_cos();
        let sun = DVec3::new(cos_up * sin_phi, sin_up, -cos_up * cos_phi);
        let mut sky = Self { turbidity, azimuth, elevation, sun, parts, level: 1.0 };
        let klx = luminance(sky.irradiance().to_array());
        sky.level = (0.8 + 15.5 * elevation.sin().sqrt()) / f64::from(klx);
        sky
    }

    /// Preetham's luminance in kcd/m², x and y of the sky in a direction above the horizon.
    fn luminance_xy(&self, direction: DVec3) -> [f64; 3] {
        // angle_between loses precision close to the sun, where the sky is steepest.
        let cross = direction.cross(self.sun).length();
        let gamma = cross.atan2(direction.dot(self.sun));
        let [level, x, y] = self.parts;
        // Below 8° the colour fit turns pink, unlike a clear sky, so the colours of 8° are used.
        let above_haze = direction.y.max(0.14);
        [
            level.0 * perez(level.1, direction.y, gamma),
            x.0 * perez(x.1, above_haze, gamma),
            y.0 * perez(y.1, above_haze, gamma),
        ]
    }

    fn radiance(&self, direction: DVec3) -> Vec3 {
        let [level, x, y] = self.luminance_xy(direction);
        let level = self.level * level;
        let xyz = [level * x / y, level, level * (1.0 - x - y) / y];
        Vec3::from(linear_from_xyz(xyz.map(|v| v as f32))).max(Vec3::ZERO)
    }

    /// Illuminance of the sun per channel in klx on a surface facing it, after Rayleigh scattering and aerosols
    /// (appendix A.1, without the weak bands of ozone and water).
    fn sun_energy(&self) -> [f64; 3] {
        // Kasten 1966, as in the paper, with the elevation in degrees.
        let degrees = self.elevation.to_degrees();
        let mass = 1.0 / (self.elevation.sin() + 0.15 * (degrees + 3.885).powf(-1.253));
        let beta = 0.04608 * self.turbidity - 0.04586;
        // The sun's own colour is nearly that of a blackbody of 5900 K. The wavelengths, in µm, are the middles of
        // the three primaries' bands.
        let color = white::gains(5900.0, 0.0);
        let wavelengths = [0.612f64, 0.549, 0.465];
        std::array::from_fn(|c| {
            let depth = 0.008735 * wavelengths[c].powf(-4.08) + beta * wavelengths[c].powf(-1.3);
            SUN_KLX * f64::from(color[c]) * (-depth * mass).exp()
        })
    }

    /// Illuminance of a level surface by the sky without the sun, per channel in klx.
    fn irradiance(&self) -> Vec3 {
        const ROWS: usize = 24;
        const COLUMNS: usize = 48;
        let mut sum = DVec3::ZERO;
        for row in 0..ROWS {
            // Equal parts of the projected hemisphere: sin² θ is uniform.
            let sine = ((row as f64 + 0.5) / ROWS as f64).sqrt();
            for column in 0..COLUMNS {
                let (s, c) = (TAU * (column as f64 + 0.5) / COLUMNS as f64).sin_cos();
                let direction = DVec3::new(sine * s, (1.0 - sine * sine).sqrt(), sine * c);
                sum += self.radiance(direction).as_dvec3();
            }
        }
        (sum * PI / (ROWS * COLUMNS) as f64).as_vec3()
    }

    fn panorama(&self, width: usize) -> Image {
        let energy = self.sun_energy();
        let sun = DVec3::from(energy).as_vec3() * self.elevation.sin() as f32;
        let white = (sun + self.irradiance()) / std::f32::consts::PI;
        let mut image = panorama(width, |direction| {
            // The model divides by 0 at the horizon.
            let level = DVec3::new(direction.x.into(), 0.0, direction.z.into()).normalize_or(DVec3::Z);
            if direction.y < 0.0 {
                return plain(direction, white, self.radiance(level));
            }
            self.radiance(direction.as_dvec3().normalize())
        });
        let disc = Patch {
            azimuth: self.azimuth,
            elevation: self.elevation,
            outline: Outline::Disc(SUN_RADIUS),
            softness: 0.0,
        };
        disc.add(&mut image, energy);
        image
    }
}

/// Luminance in kcd/m², x and y of the zenith for a sun at the angle θ from it (appendix A.2).
fn zenith(turbidity: f64, theta: f64) -> [f64; 3] {
    let t = turbidity;
    let chi = (4.0 / 9.0 - t / 120.0) * (PI - 2.0 * theta);
    let luminance = (4.0453 * t - 4.9710) * chi.tan() - 0.2155 * t + 2.4192;
    let cubic = |[a, b, c, d]: [f64; 4]| ((a * theta + b) * theta + c) * theta + d;
    let square = |rows: [[f64; 4]; 3]| (cubic(rows[0]) * t + cubic(rows[1])) * t + cubic(rows[2]);
    let x = square([
        [0.00166, -0.00375, 0.00209, 0.0],
        [-0.02903, 0.06377, -0.03202, 0.00394],
        [0.11693, -0.21196, 0.06052, 0.25886],
    ]);
    let y = square([
        [0.00275, -0.00610, 0.00317, 0.0],
        [-0.04214, 0.08970, -0.04153, 0.00516],
        [0.15346, -0.26756, 0.06670, 0.26688],
    ]);
    [luminance, x, y]
}

/// The distribution of Perez, Seals and Michalsky (1993) for a direction with cosine `cos_theta` from the zenith
/// and angle `gamma` from the sun.
fn perez([a, b, c, d, e]: [f64; 5], cos_theta: f64, gamma: f64) -> f64 {
    // It divides by 0 at the horizon.
    let gradation = 1.0 + a * (b / cos_theta.max(0.035)).exp();
    gradation * (1.0 + c * (d * gamma).exp() + e * gamma.cos().powi(2))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sky(turbidity: f64, elevation_deg: f64) -> ClearSky {
        ClearSky::new(turbidity, 0.5, elevation_deg.to_radians())
    }

    #[test]
    fn the_zenith_is_the_papers() {
        // The formulas of appendix A.2, evaluated independently of this code: T = 2, sun 45° up.
        let [luminance, x, y] = zenith(2.0, PI / 4.0);
        assert!((luminance - 4.46964).abs() < 1e-5, "{luminance}");
        assert!((x - 0.240952).abs() < 1e-6 && (y - 0.243722).abs() < 1e-6, "{x} {y}");
        let sky = sky(2.0, 45.0);
        let [level, ..] = sky.luminance_xy(DVec3::Y);
        assert!((level - luminance).abs() < 1e-9);
    }

    #[test]
    fn a_clear_sky_has_the_luminances_of_clear_skies() {
        // ISO 15469, type 12 (the CIE clear sky: a −1, b −0.32, c 10, d −3, e 0.45), relative to its zenith, 30°
        // and more from the sun. Preetham's fit to other skies stays within 40 % of it.
        let elevation = 45f64;
        let sky = sky(2.5, elevation);
        let gradation = |cos: f64| 1.0 - (-0.32 / cos).exp();
        let indicatrix =
            |angle: f64| 1.0 + 10.0 * ((-3.0 * angle).exp() - (-3.0 * FRAC_PI_2).exp()) + 0.45 * angle.cos().powi(2);
        let to_zenith = (90.0 - elevation).to_radians();
        for (azimuth, up) in [(2.0, 30.0), (3.1, 60.0), (-1.8, 20.0), (4.0, 45.0), (3.6, 75.0)] {
            let up: f64 = f64::to_radians(up);
            let d = DVec3::new(up.cos() * f64::sin(azimuth), up.sin(), -up.cos() * f64::cos(azimuth));
            let standard =
                gradation(d.y) * indicatrix(d.angle_between(sky.sun)) / (gradation(1.0) * indicatrix(to_zenith));
            let is = sky.luminance_xy(d)[0] / sky.luminance_xy(DVec3::Y)[0];
            assert!((is / standard).ln().abs() < 1.4f64.ln(), "{azimuth} {up}: {is} for {standard}");
        }
    }

    #[test]
    fn the_sun_has_the_illuminance_of_the_sun() {
        // IES Lighting Handbook: 127.5 klx · exp(−0.21 · air mass) on a surface facing a clear sky's sun.
        for elevation in [20.0, 40.0, 60.0] {
            let sky = sky(2.5, elevation);
            let is = luminance(sky.sun_energy().map(|v| v as f32));
            let expected = 127.5 * (-0.21 / elevation.to_radians().sin()).exp() as f32;
            assert!((is / expected - 1.0).abs() < 0.15, "{elevation}°: {is} klx for {expected}");
            let sun = is * elevation.to_radians().sin() as f32;
            let ratio = sun / luminance(sky.irradiance().to_array());
            assert!((1.5..9.0).contains(&ratio), "{elevation}°: sun {ratio} times the sky");
        }
        let [r, _, b] = sky(2.5, 8.0).sun_energy();
        assert!(r > 2.0 * b, "a low sun is warm: {r} {b}");
    }

    #[test]
    fn the_zenith_of_an_overcast_sky_is_three_times_its_horizon() {
        assert_eq!(overcast_gradation(1.0) / overcast_gradation(0.0), 3.0);
        let image = overcast(128);
        // 7π/9 of the zenith's luminance falls on the ground (ISO 15469), 12.2 klx.
        let mut sum = 0.0;
        for (i, &pixel) in image.pixels.iter().enumerate().take(64 * 64) {
            let direction = crate::latlong::texel_direction(i % 128, i / 128, 128, 64);
            let part = crate::latlong::texel_solid_angle(i / 128, 128, 64);
            sum += f64::from(luminance(pixel) * direction.y.max(0.0)) * part;
        }
        // The cover's billows do not average out over one sky.
        assert!((sum / (5.0 * 7.0 * PI / 9.0) - 1.0).abs() < 0.03, "{sum}");
    }

    #[test]
    fn a_sky_is_blue_and_brightest_about_the_sun() {
        let sky = sky(2.5, 40.0);
        let zenith = sky.radiance(DVec3::Y);
        assert!(zenith.z > 1.5 * zenith.x, "{zenith}");
        let near = sky.luminance_xy((sky.sun + DVec3::Y * 0.05).normalize())[0];
        let away = sky.luminance_xy(DVec3::new(-sky.sun.x, sky.sun.y, -sky.sun.z))[0];
        assert!(near > 4.0 * away, "{near} {away}");
    }
}
