//! Pass `false_color`: zones of exposure in flat colours, as on camera monitors.

use super::curve::Curve;
use super::descriptor::{Descriptor, EncodeStep, NOT_ASKED, PassContext, Run, inspected};
use super::passes::{GpuPicture, Recording, Shader, extent};
use base::error::Result;
use bytemuck::{Pod, Zeroable, bytes_of};
use imaging::color::{luminance, srgb_from_linear};
use imaging::{Encoded, Image, Raster};
use rayon::prelude::*;
use scene::{Inspection, Pass};
use std::sync::LazyLock;

const SHADER: Shader = Shader::new("false_color", include_str!("../../../shaders/false_color.wgsl"));

pub(crate) const FALSE_COLOR: Descriptor = Descriptor {
    fixed: |_| Some("it is chosen above the picture"),
    settings: inspected,
    shader: Some(&SHADER),
    run: Run::Encode(EncodeStep {
        in_memory: |context, light| is_shown(context).then(|| false_color(light)),
        on_gpu: |context, recording, light| {
            let shown = is_shown(context).then(|| recording.false_color(light));
            shown.transpose()
        },
    }),
    ..Descriptor::new(Pass::FalseColor, |context| {
        context.displayed()?;
        if is_shown(context) { Ok("zones of exposure are shown".to_owned()) } else { Err(NOT_ASKED.to_owned()) }
    })
};

fn is_shown(context: &PassContext) -> bool {
    context.effects.inspection == Inspection::FalseColor
}

/// One zone: luminance from the end of the zone before up to `below`, in stops from middle grey (0.18).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Zone {
    pub below: f32,
    /// sRGB codes; None for grey, as in the picture.
    pub color: Option<[f32; 3]>,
    pub name: &'static str,
}

/// The legend, from dark to bright. White, a luminance of 1, is 2.47 stops above middle grey.
pub const LEGEND: [Zone; 8] = [
    zone(-6.0, Some([0.35, 0.1, 0.6]), "black: darker than −6 stops"),
    zone(-4.0, Some([0.1, 0.3, 0.85]), "deep shadow: −6 to −4 stops"),
    zone(-0.25, None, "shadow: −4 to −¼ stop, in grey"),
    zone(0.25, Some([0.2, 0.65, 0.25]), "middle grey, within ¼ stop"),
    zone(0.75, None, "light: ¼ to ¾ stop, in grey"),
    zone(1.25, Some([0.95, 0.6, 0.65]), "fair skin: ¾ to 1¼ stops"),
    zone(2.0, None, "bright: 1¼ to 2 stops, in grey"),
    zone(WHITE, Some([0.95, 0.85, 0.2]), "nearly white: 2 to 2.47 stops"),
];

/// White in stops above middle grey: log2(1 / 0.18).
pub const WHITE: f32 = 2.473_931;

/// Colour of clipped light: white or brighter.
pub const CLIPPED: [f32; 3] = [0.9, 0.1, 0.1];

const fn zone(below: f32, color: Option<[f32; 3]>, name: &'static str) -> Zone {
    Zone { below, color, name }
}

static GREY: LazyLock<Curve> = LazyLock::new(|| Curve::new(srgb_from_linear));

/// The upper luminances of the zones.
fn limits() -> [f32; LEGEND.len()] {
    LEGEND.map(|zone| 0.18 * zone.below.exp2())
}

/// The zone colours of exposed linear light. NaN luminance is black.
pub fn false_color(linear: &Image) -> Encoded {
    let limits = limits();
    let pixels = linear.pixels.par_iter().with_min_len(4096);
    let color = |&pixel: &[f32; 3]| zone_color(luminance(pixel), &limits);
    Encoded(Raster { width: linear.width, height: linear.height, pixels: pixels.map(color).collect() })
}

fn zone_color(luminance: f32, limits: &[f32; LEGEND.len()]) -> [f32; 3] {
    let luminance = luminance.max(0.0);
    match limits.iter().position(|&limit| luminance < limit) {
        Some(zone) => LEGEND[zone].color.unwrap_or_else(|| [GREY.at(luminance); 3]),
        None => CLIPPED,
    }
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(crate) struct FalseColorParams {
    size: [u32; 2],
    unused: [u32; 2],
    zones: [[f32; 4]; LEGEND.len()],
    clipped: [f32; 4],
}

impl Recording<'_> {
    /// [`false_color`] on the GPU.
    ///
    /// # Errors
    /// When the GPU cannot hold the result.
    pub fn false_color(&mut self, light: &GpuPicture) -> Result<GpuPicture> {
        let limits = limits();
        let zones = std::array::from_fn(|i| {
            let [r, g, b] = LEGEND[i].color.unwrap_or([-1.0; 3]);
            [r, g, b, limits[i]]
        });
        let [r, g, b] = CLIPPED;
        let params = FalseColorParams { size: extent(light.size()), unused: [0; 2], zones, clipped: [r, g, b, 0.0] };
        let (shader, size) = ((&SHADER, "false_color"), light.size());
        self.run(shader, bytes_of(&params), light, None, size)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(stops: f32) -> [f32; 3] {
        zone_color(0.18 * stops.exp2(), &limits())
    }

    #[test]
    fn every_stop_is_in_the_zone_that_the_legend_says() {
        assert_eq!(Some(at(0.0)), LEGEND[3].color);
        assert_eq!(Some(at(1.0)), LEGEND[5].color);
        assert_eq!(Some(at(-5.0)), LEGEND[1].color);
        assert_eq!(Some(at(2.4)), LEGEND[7].color);
        assert_eq!(at(2.48), CLIPPED);
        assert_eq!(zone_color(1.01, &limits()), CLIPPED);
        let grey = at(-2.0);
        assert!(grey[0] == grey[1] && grey[1] == grey[2] && grey[0] > 0.1);
        let limits = LEGEND.windows(2);
        assert!(limits.into_iter().all(|w| w[0].below < w[1].below));
    }

    #[test]
    fn hostile_light_has_a_zone() {
        for value in [f32::NAN, -1.0, 0.0, f32::NEG_INFINITY] {
            assert_eq!(Some(zone_color(value, &limits())), LEGEND[0].color);
        }
        for value in [1e6, f32::INFINITY] {
            assert_eq!(zone_color(value, &limits()), CLIPPED);
        }
    }
}
