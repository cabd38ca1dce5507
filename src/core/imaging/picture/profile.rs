//! Colour of a picture's codes, as its file describes it: linear Rec. 709 of each.
//!
//! A profile of curves and primaries (ICC.1:2022 annex F.3) and the chunks of PNG become a table per channel and a matrix.
//! Light is adapted between whites with Bradford's matrix. A profile of tables goes through moxcms. PQ is read with diffuse
//! white, 203 cd/m² (ITU-R BT.2408), at 1; HLG (ITU-R BT.2100) as scene light with code 0.75 at 1.

use super::properties::Origin;
use crate::color::{linear_from_srgb, linear_from_xyz};
use crate::color_space::{ColorSpace, Matrix, Primaries, transformed};
use crate::response::Response;
use moxcms::{
    ColorProfile, DataColorSpace, Layout, ProfileText, ToneReprCurve, TransformF32Executor, TransformOptions,
};
use std::sync::Arc;

/// Codes to linear Rec. 709.
pub(super) enum Profile {
    Curves {
        /// Light of each 16-bit code.
        tables: Box<[Vec<f32>; 3]>,
        matrix: Option<Matrix>,
    },
    Tables(Arc<TransformF32Executor>),
}

/// A curve with its name in sentences.
pub(super) struct Named {
    pub origin: Origin,
    /// None for sRGB.
    pub profile: Option<Profile>,
}

/// Source in sentences.
const ICC: &str = "its ICC profile";
const CODES: usize = 1 << 16;
/// cd/m² of diffuse white, and of PQ's code 1 (SMPTE ST 2084).
const WHITE: f32 = 203.0;
const PEAK: f32 = 10_000.0;
/// Largest difference to sRGB that counts as sRGB: a step of 8 bits at white.
const SRGB_TOLERANCE: f32 = 2e-3;

fn table(light: impl Fn(f32) -> f32) -> Vec<f32> {
    (0..CODES).map(|code| light(code as f32 / (CODES - 1) as f32)).collect()
}

impl Profile {
    /// One curve for all channels.
    fn curve(light: impl Fn(f32) -> f32, primaries: Option<Primaries>) -> Self {
        let table = table(light);
        let matrix = primaries.map(|p| p.matrix_to(ColorSpace::Rec709.primaries()));
        Self::Curves { tables: Box::new([table.clone(), table.clone(), table]), matrix }
    }

    /// Linear Rec. 709 of codes in `[0, 1]`.
    pub fn light(&self, codes: [f32; 3]) -> [f32; 3] {
        match self {
            Self::Curves { tables, matrix } => {
                let at = |c: usize| {
                    let place = codes[c].clamp(0.0, 1.0) * (CODES - 1) as f32;
                    tables[c][(place + 0.5) as usize]
                };
                let light = [at(0), at(1), at(2)];
                matrix.as_ref().map_or(light, |matrix| transformed(matrix, light))
            }
            Self::Tables(transform) => {
                let mut light = [0.0; 3];
                // Both are one pixel long.
                let _ = transform.transform(&codes, &mut light);
                light
            }
        }
    }

    fn is_srgb(&self) -> bool {
        let steps = [0.0, 0.05, 0.2, 0.5, 0.8, 1.0];
        let colors = steps.iter().flat_map(|&r| steps.iter().map(move |&g| (r, g)));
        colors.flat_map(|(r, g)| steps.iter().map(move |&b| [r, g, b])).all(|codes| {
            let (light, srgb) = (self.light(codes), codes.map(linear_from_srgb));
            (0..3).all(|c| (light[c] - srgb[c]).abs() < SRGB_TOLERANCE)
        })
    }
}

impl Named {
    fn new(name: impl Into<String>, by: &'static str, profile: Profile) -> Self {
        let profile = (!profile.is_srgb()).then_some(profile);
        Self { origin: Origin { name: name.into(), by }, profile }
    }

    /// The matrix alone, for light that has no curve.
    pub fn matrix(&self) -> Option<Matrix> {
        match &self.profile {
            Some(Profile::Curves { matrix, .. }) => *matrix,
            _ => None,
        }
    }

    /// sRGB, named by this part of the file.
    pub fn srgb(by: &'static str) -> Self {
        Self { origin: Origin { name: "sRGB".into(), by }, profile: None }
    }
}

/// Colour of an embedded ICC profile.
///
/// # Errors
/// When it is damaged or not for RGB or grey: the fault.
pub(super) fn icc(bytes: &[u8]) -> Result<Named, String> {
    let profile = ColorProfile::new_from_slice(bytes).map_err(|e| format!("its ICC profile is damaged ({e})"))?;
    let name = described(&profile);
    let evaluator = |curve: &Option<ToneReprCurve>| {
        let curve = curve.as_ref()?.make_linear_evaluator().ok()?;
        Some(table(|code| curve.evaluate_value(code)))
    };
    match profile.color_space {
        DataColorSpace::Gray => {
            let grey = evaluator(&profile.gray_trc).ok_or("its grey ICC profile has no curve".to_owned())?;
            let tables = Box::new([grey.clone(), grey.clone(), grey]);
            Ok(Named::new(name, ICC, Profile::Curves { tables, matrix: None }))
        }
        DataColorSpace::Rgb => {
            let curves = [&profile.red_trc, &profile.green_trc, &profile.blue_trc];
            let has_tables = profile.lut_a_to_b_perceptual.is_some();
            if let ([Some(r), Some(g), Some(b)], false) = (curves.map(evaluator), has_tables) {
                let to_xyz = profile.colorant_matrix().v;
                let columns = [0, 1, 2].map(|c| {
                    let white = to_d65([to_xyz[0][c], to_xyz[1][c], to_xyz[2][c]]);
                    linear_from_xyz(white.map(|v| v as f32)).map(f64::from)
                });
                let matrix = [0, 1, 2].map(|row| columns.map(|column| column[row]));
                let matrix = Some(matrix);
                let tables = Box::new([r, g, b]);
                return Ok(Named::new(name, ICC, Profile::Curves { tables, matrix }));
            }
            let mut linear = ColorProfile::new_srgb();
            let straight = || Some(ToneReprCurve::Lut(Vec::new()));
            (linear.red_trc, linear.green_trc, linear.blue_trc) = (straight(), straight(), straight());
            linear.cicp = None;
            let options = TransformOptions::default();
            let transform = profile.create_transform_f32(Layout::Rgb, &linear, Layout::Rgb, options);
            let transform = transform.map_err(|e| format!("its ICC profile \"{name}\" cannot be used ({e})"))?;
            Ok(Named::new(name, ICC, Profile::Tables(transform)))
        }
        other => Err(format!("its ICC profile \"{name}\" is for {other:?}, not RGB or grey")),
    }
}

/// XYZ of the profile connection space (D50) adapted to D65, by the inverse of the matrix that sRGB's own profile was made
/// with (ICC.1:2022 annex E).
fn to_d65(xyz: [f64; 3]) -> [f64; 3] {
    const D50: [f64; 2] = [0.345_702_9, 0.358_538_6];
    crate::color_space::adapted(xyz, D50, ColorSpace::Rec709.primaries().white)
}

fn described(profile: &ColorProfile) -> String {
    let text = match &profile.description {
        Some(ProfileText::PlainString(text)) => text.clone(),
        Some(ProfileText::Localizable(all)) => all.first().map(|first| first.value.clone()).unwrap_or_default(),
        Some(ProfileText::Description(text)) => text.ascii_string.clone(),
        None => String::new(),
    };
    let text: String = text.chars().filter(|c| !c.is_control()).take(60).collect();
    if text.trim().is_empty() { "ICC profile".into() } else { text.trim().to_owned() }
}

/// Colour of PNG's cICP chunk, by the numbers of ITU-T H.273. None if it leaves curve or primaries open.
pub(super) fn cicp(primaries: u8, transfer: u8) -> Option<Named> {
    let p3 = ColorSpace::P3D65.primaries();
    let (primaries, gamut) = match primaries {
        1 => (None, "Rec. 709"),
        9 => (Some(ColorSpace::Rec2020.primaries()), "Rec. 2020"),
        11 => (Some(Primaries { white: [0.314, 0.351], ..p3 }), "DCI-P3"),
        12 => (Some(p3), "Display P3"),
        _ => return None,
    };
    let (curve, light): (&str, fn(f32) -> f32) = match transfer {
        1 | 6 | 14 | 15 => ("Rec. 709", |code| Response::Rec709.decode_value(code)),
        4 => ("gamma 2.2", |code| code.powf(2.2)),
        8 => ("linear", |code| code),
        13 => ("sRGB", linear_from_srgb),
        16 => ("PQ", pq),
        18 => ("HLG", hlg),
        _ => return None,
    };
    Some(Named::new(format!("{gamut}, {curve}"), "cICP", Profile::curve(light, primaries)))
}

/// Adobe RGB (1998), 4.3: the primaries, D65 and the exponent 2 + 51/256.
pub(super) fn adobe_rgb() -> Named {
    let primaries = Primaries {
        red: [0.64, 0.33],
        green: [0.21, 0.71],
        blue: [0.15, 0.06],
        white: ColorSpace::Rec709.primaries().white,
    };
    let light = |code: f32| code.powf(563.0 / 256.0);
    Named::new("Adobe RGB (1998)", "EXIF", Profile::curve(light, Some(primaries)))
}

/// Colour of PNG's gAMA and cHRM chunks: `gamma` is the exponent of encoding.
pub(super) fn gamma(gamma: f32, primaries: Option<Primaries>) -> Option<Named> {
    if !(gamma.is_finite() && (0.1..=10.0).contains(&gamma)) {
        return None;
    }
    let primaries = primaries.filter(|p| p.is_usable());
    let name = if (gamma - 1.0).abs() < 1e-4 { "linear".to_owned() } else { format!("gamma {:.2}", 1.0 / gamma) };
    let power = 1.0 / gamma;
    Some(Named::new(name, "gAMA", Profile::curve(|code| code.powf(power), primaries)))
}

/// Light of PQ's code, diffuse white at 1 (SMPTE ST 2084).
fn pq(code: f32) -> f32 {
    const M1: f32 = 2610.0 / 16384.0;
    const M2: f32 = 2523.0 / 32.0;
    const C1: f32 = 3424.0 / 4096.0;
    const C2: f32 = 2413.0 / 128.0;
    const C3: f32 = 2392.0 / 128.0;
    let root = code.powf(1.0 / M2);
    PEAK / WHITE * ((root - C1).max(0.0) / (C2 - C3 * root)).powf(1.0 / M1)
}

/// Scene light of HLG's code (ITU-R BT.2100), code 0.75 at 1.
fn hlg(code: f32) -> f32 {
    const A: f32 = 0.178_832_77;
    const B: f32 = 1.0 - 4.0 * A;
    let c = 0.5 - A * (4.0 * A).ln();
    let scene = |code: f32| {
        if code <= 0.5 { code * code / 3.0 } else { (((code - c) / A).exp() + B) / 12.0 }
    };
    scene(code) / scene(0.75)
}
