//! Pass `view`: linear light becomes codes of an sRGB display.

use super::curve::Curve;
use super::descriptor::{Descriptor, EncodeStep, Run};
use super::facts::key;
use super::passes::{GpuPicture, Recording, Shader, extent};
use base::error::Result;
use bytemuck::{Pod, Zeroable, bytes_of};
use imaging::{Encoded, Image, Raster, color::srgb_from_linear, color::unit};
use rayon::prelude::*;
use scene::{Pass, Scene, ViewTransform};
use std::sync::LazyLock;

const SHADER: Shader = Shader::new("view", include_str!("../../../shaders/view.wgsl"));

pub(crate) const VIEW: Descriptor = Descriptor {
    fixed: |_| Some("a display needs it"),
    settings: |context| {
        let viewing = &context.scene.viewing;
        let seen = viewing.factor_and_power().map(f32::to_bits);
        let through = viewing.through.as_ref().map(|table| table.identity());
        key((context.scene.view(), seen, through))
    },
    shader: Some(&SHADER),
    run: Run::Encode(EncodeStep {
        in_memory: |context, light| Some(viewed(light, context.scene)),
        on_gpu: |context, recording, light| recording.viewed(light, context.scene).map(Some),
    }),
    ..Descriptor::new(Pass::View, |context| {
        context.displayed()?;
        let viewing = &context.scene.viewing;
        if let Some(table) = &viewing.through {
            return Ok(format!("shown through {}", table.name));
        }
        let curve = match context.scene.view() {
            ViewTransform::Srgb => "the display is sRGB",
            ViewTransform::Filmic => "the display is sRGB; highlights roll off as on film",
            ViewTransform::Aces => "the display is sRGB, by way of ACES",
        };
        Ok(if viewing.is_neutral() { curve.to_owned() } else { format!("{curve}; changed for viewing") })
    })
};

/// AgX (Troy Sobotka) in Benjamin Wrensch's minimal form
/// (<https://iolite-engine.com/blog_posts/minimal_agx_implementation>): linear Rec. 709 towards grey.
const AGX_INSET: [[f32; 3]; 3] = [
    [0.842_479_06, 0.078_433_6, 0.079_223_745],
    [0.042_328_242, 0.878_468_64, 0.079_166_13],
    [0.042_375_655, 0.078_433_6, 0.879_143],
];
/// Inverse matrix, after the curve.
const AGX_OUTSET: [[f32; 3]; 3] = [
    [1.196_879, -0.098_020_88, -0.099_029_74],
    [-0.052_896_85, 1.151_903_1, -0.098_961_18],
    [-0.052_971_635, -0.098_043_45, 1.151_073_7],
];
/// log2 of the darkest and the brightest light within the curve: 10 stops below middle grey and
/// 6.5 above.
const AGX_STOPS: [f32; 2] = [-12.473_93, 4.026_069];

/// Stephen Hill's fit of the Academy's RRT and sRGB ODT (`ACES.hlsl` of BakingLab): linear Rec. 709 to the
/// space of the curve.
const ACES_INPUT: [[f32; 3]; 3] =
    [[0.597_19, 0.354_58, 0.048_23], [0.076_00, 0.908_34, 0.015_66], [0.028_40, 0.133_83, 0.837_77]];
/// From the space of the curve back.
const ACES_OUTPUT: [[f32; 3]; 3] =
    [[1.604_75, -0.531_08, -0.073_67], [-0.102_08, 1.108_13, -0.006_05], [-0.003_27, -0.072_76, 1.076_02]];
/// Brings 18 % grey to its sRGB code: the plain fit is darker, made for projectors.
const ACES_EXPOSURE: f32 = 1.0 / 0.6;

/// Codes of linear light, all in `[0, 1]`. Negative light and NaN become black;
/// infinite light becomes white.
pub fn view(linear: &Image, transform: ViewTransform) -> Encoded {
    match transform {
        ViewTransform::Srgb => srgb(linear),
        ViewTransform::Filmic => encoded(linear, filmic),
        ViewTransform::Aces => encoded(linear, aces),
    }
}

/// [`view`] with a scene's viewing settings: see [`scene::Viewing`].
pub fn viewed(linear: &Image, scene: &Scene) -> Encoded {
    match (&scene.viewing.through, scene.viewing.factor_and_power()) {
        (None, [1.0, 1.0]) => view(linear, scene.view()),
        _ => encoded(linear, |pixel| viewed_code(pixel, scene)),
    }
}

/// Codes of one pixel with a scene's viewing settings.
pub fn viewed_code(pixel: [f32; 3], scene: &Scene) -> [f32; 3] {
    let [factor, power] = scene.viewing.factor_and_power();
    let seen = light(pixel.map(|v| factor * v));
    let seen = match power {
        1.0 => seen,
        _ => seen.map(|v| v.powf(power)),
    };
    match &scene.viewing.through {
        Some(table) => table.at(seen),
        None => code(seen, scene.view()),
    }
}

/// sRGB codes of linear light, clipped to `[0, 1]`.
pub fn srgb(linear: &Image) -> Encoded {
    encoded(linear, |pixel| pixel.map(srgb_from_linear))
}

fn encoded(linear: &Image, code: impl Fn([f32; 3]) -> [f32; 3] + Sync) -> Encoded {
    let pixels = linear.pixels.par_iter().with_min_len(4096);
    Encoded(Raster { width: linear.width, height: linear.height, pixels: pixels.map(|&pixel| code(pixel)).collect() })
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(crate) struct ViewParams {
    size: [u32; 2],
    curve: u32,
    factor: f32,
    power: f32,
    unused: [u32; 3],
}

impl Recording<'_> {
    /// [`viewed`] on the GPU.
    ///
    /// # Errors
    /// When the GPU cannot hold the result.
    pub fn viewed(&mut self, light: &GpuPicture, scene: &Scene) -> Result<GpuPicture> {
        let [factor, power] = scene.viewing.factor_and_power();
        let table = (scene.viewing.through.as_deref()).map(|table| self.passes().display_table(table)).transpose()?;
        let params = ViewParams {
            size: extent(light.size()),
            curve: match (&table, scene.view()) {
                (Some(_), _) => 3,
                (None, ViewTransform::Srgb) => 0,
                (None, ViewTransform::Filmic) => 1,
                (None, ViewTransform::Aces) => 2,
            },
            factor,
            power,
            unused: [0; 3],
        };
        let (shader, size) = ((&SHADER, "view"), light.size());
        self.run(shader, bytes_of(&params), light, table.as_ref(), size)
    }
}

/// Codes of one pixel.
pub fn code(pixel: [f32; 3], transform: ViewTransform) -> [f32; 3] {
    match transform {
        ViewTransform::Srgb => pixel.map(srgb_from_linear),
        ViewTransform::Filmic => filmic(pixel),
        ViewTransform::Aces => aces(pixel),
    }
}

/// Film curve between the matrices: codes of a γ 2.2 display from light.
static FILMIC: LazyLock<Curve> = LazyLock::new(|| {
    let [darkest, brightest] = AGX_STOPS;
    Curve::new(|light| {
        let stops = light.max(1e-10).log2().clamp(darkest, brightest);
        let x = (stops - darkest) / (brightest - darkest);
        // Wrensch's polynomial through AgX's default contrast curve.
        let [x2, x3, x4] = [x * x, x * x * x, x * x * x * x];
        15.5 * x4 * x2 - 40.14 * x4 * x + 31.96 * x4 - 6.868 * x3 + 0.4298 * x2 + 0.1191 * x - 0.002_32
    })
});

static SRGB: LazyLock<Curve> = LazyLock::new(|| Curve::new(srgb_from_linear));

/// Upper limit of the curves' input: larger values look the same.
fn light(pixel: [f32; 3]) -> [f32; 3] {
    pixel.map(|v| if v > 0.0 { v.min(65504.0) } else { 0.0 })
}

fn filmic(pixel: [f32; 3]) -> [f32; 3] {
    let codes = times(&AGX_INSET, light(pixel)).map(|v| FILMIC.at(v));
    times(&AGX_OUTSET, codes).map(unit)
}

fn aces(pixel: [f32; 3]) -> [f32; 3] {
    let exposed = light(pixel).map(|v| ACES_EXPOSURE * v);
    let curve = times(&ACES_INPUT, exposed).map(|v| {
        let above = v * (v + 0.024_578_6) - 0.000_090_537;
        above / (v * (0.983_729 * v + 0.432_951) + 0.238_081)
    });
    times(&ACES_OUTPUT, curve).map(|v| SRGB.at(v))
}

fn times(matrix: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    matrix.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

#[cfg(test)]
mod tests {
    use super::*;
    use scene::Viewing;

    const CURVES: [ViewTransform; 3] = [ViewTransform::Srgb, ViewTransform::Filmic, ViewTransform::Aces];

    #[test]
    fn brighter_light_is_never_a_darker_code() {
        for curve in CURVES {
            let ramp: Vec<f32> = (-140..80).map(|i| code([(i as f32 / 10.0).exp2(); 3], curve)[0]).collect();
            for pair in ramp.windows(2) {
                // The polynomial of the film curve wavers by this much in the deepest black.
                assert!(pair[1] >= pair[0] - 5e-4, "{curve:?}: {pair:?}");
            }
            assert!(ramp[0] < 0.01 && ramp[219] > 0.98, "{curve:?}: {ramp:?}");
        }
    }

    #[test]
    fn a_viewing_exposure_reaches_into_what_clips_and_gamma_leaves_black_and_white() {
        let seen = |light: f32, exposure_stops: f32, gamma: f32| {
            let scene = Scene { viewing: Viewing { exposure_stops, gamma, ..Viewing::default() }, ..Scene::default() };
            let codes = viewed(&Image::filled(1, 1, [light; 3]), &scene).0.pixels[0];
            assert_eq!(codes, viewed_code([light; 3], &scene));
            codes[0]
        };
        // Two stops darker, light of 2 and 3 is distinct again.
        assert_eq!(seen(2.0, 0.0, 1.0), seen(3.0, 0.0, 1.0));
        assert_eq!(seen(2.0, -2.0, 1.0), srgb_from_linear(0.5));
        assert!(seen(3.0, -2.0, 1.0) > seen(2.0, -2.0, 1.0) + 0.1);
        assert!((seen(0.25, 0.0, 2.0) - srgb_from_linear(0.5)).abs() < 1e-6);
        assert_eq!(seen(0.0, 0.0, 2.0), 0.0);
        assert_eq!(seen(1.0, 0.0, 2.0), seen(1.0, 0.0, 1.0));
        for hostile in [f32::NAN, -1.0, f32::NEG_INFINITY, f32::INFINITY] {
            assert!((0.0..=1.0).contains(&seen(hostile, 1.0, 2.0)), "{hostile}");
        }
        let filmic =
            Scene { viewing: Viewing { view: Some(ViewTransform::Filmic), ..Viewing::default() }, ..Scene::default() };
        let grey = Image::filled(1, 1, [0.7; 3]);
        assert_eq!(viewed(&grey, &filmic), view(&grey, ViewTransform::Filmic));
    }

    #[test]
    fn middle_grey_stays_where_it_is_and_grey_stays_grey() {
        let wanted = srgb_from_linear(0.18);
        for curve in CURVES {
            let grey = code([0.18; 3], curve);
            assert!((grey[0] - wanted).abs() < 0.04, "{curve:?}: {grey:?}");
            for level in [0.001, 0.18, 1.0, 30.0] {
                let [r, g, b] = code([level; 3], curve);
                assert!((r - g).abs() < 2e-3 && (b - g).abs() < 2e-3, "{curve:?}: {r} {g} {b}");
            }
        }
    }

    #[test]
    fn film_holds_highlights_that_srgb_clips() {
        let codes = |level: f32, curve| code([level; 3], curve)[1];
        for curve in [ViewTransform::Filmic, ViewTransform::Aces] {
            assert!(codes(2.0, curve) < codes(4.0, curve) - 0.01, "{curve:?}");
        }
        assert_eq!(codes(2.0, ViewTransform::Srgb), codes(4.0, ViewTransform::Srgb));
        // A bright saturated light fades to white as on film.
        let blue = code([0.0, 0.0, 50.0], ViewTransform::Filmic);
        assert!(blue[0] > 0.2 && blue[2] > 0.9, "{blue:?}");
    }

    #[test]
    fn hostile_light_has_codes() {
        for curve in CURVES {
            for value in [f32::NAN, f32::NEG_INFINITY, -1.0, 0.0, 1e6, f32::INFINITY] {
                let codes = view(&Image::filled(1, 1, [value, 0.5, 0.0]), curve).0.pixels[0];
                assert!(codes.iter().all(|c| (0.0..=1.0).contains(c)), "{curve:?} {value}");
            }
            assert!(code([f32::INFINITY; 3], curve).iter().all(|&c| c > 0.98));
        }
    }
}
