//! Transforms of our light through a configuration.

use imaging::color::unit;
use imaging::color_space::{ColorSpace, transformed};
use imaging::{DisplayTable, Encoded, Image, Raster};
use ocio::{CpuProcessor, OptimizationFlags, Processor};
use rayon::prelude::*;

/// Pixels per chunk of a thread.
const CHUNK: usize = 4096;
/// Largest difference between matrices of the same space, due to rounding in written files.
const SAME: f32 = 2e-4;

/// Target of a transform of light.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Target {
    /// Codes of a display.
    View { display: String, view: String },
    /// Values of a colour space.
    Space { name: String, is_linear: bool },
}

/// A transform of linear Rec. 709.
pub struct Transform {
    processor: CpuProcessor,
    identity: String,
    pub target: Target,
    /// ASWF interop ID of the output, if the configuration knows it.
    pub interop_id: Option<String>,
    /// Name of the output colour space in the configuration.
    pub space: String,
}

impl Transform {
    pub(super) fn new(processor: Processor, target: Target, interop_id: Option<String>, space: String) -> Self {
        Self {
            identity: processor.cache_id(),
            // Without the approximations for real-time playback.
            processor: processor.optimized_cpu_processor(OptimizationFlags::LOSSLESS),
            target,
            interop_id,
            space,
        }
    }

    /// Identifier of the transform: equal for equal results, including tables.
    pub fn identity(&self) -> &str {
        &self.identity
    }

    /// Transforms pixels, on all cores.
    pub fn apply(&self, pixels: &mut [[f32; 3]]) {
        pixels.par_chunks_mut(CHUNK).for_each(|pixels| {
            self.processor.apply_rgb_slice(pixels.as_flattened_mut());
        });
    }

    /// A picture's codes, clipped to `[0, 1]`; NaN gives 0.
    pub fn encoded(&self, light: &Image) -> Encoded {
        let mut codes = light.clone();
        self.apply(&mut codes.pixels);
        let pixels = codes.pixels.into_par_iter().with_min_len(CHUNK);
        Encoded(Raster { pixels: pixels.map(|code| code.map(unit)).collect(), ..light.map(|_| [0.0; 3]) })
    }

    /// A view as a display table, under its names in the configuration. Values between the table's entries are
    /// interpolated.
    pub fn table(&self, look: Option<&str>) -> DisplayTable {
        let name = match (&self.target, look) {
            (Target::View { view, .. }, None) => view.clone(),
            (Target::View { view, .. }, Some(look)) => format!("{view} with {look}"),
            (Target::Space { name, .. }, _) => name.clone(),
        };
        DisplayTable::new(name, |pixels| self.apply(pixels))
    }

    /// Our name of the output space, if it is one of ours.
    pub fn known_space(&self) -> Option<ColorSpace> {
        if !matches!(self.target, Target::Space { is_linear: true, .. }) {
            return None;
        }
        let probes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [2.0, 4.0, 8.0]];
        let mut found = probes;
        self.apply(&mut found);
        let all = [ColorSpace::Rec709, ColorSpace::P3D65, ColorSpace::Rec2020, ColorSpace::AcesCg];
        all.into_iter().find(|space| {
            let matrix = ColorSpace::Rec709.matrix_to(*space);
            (probes.iter().zip(&found)).all(|(probe, found)| {
                let wanted = transformed(&matrix, *probe);
                let size = probe.iter().sum::<f32>();
                (0..3).all(|c| (wanted[c] - found[c]).abs() < SAME * size)
            })
        })
    }
}

impl std::fmt::Debug for Transform {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:?} {}", self.target, self.identity)
    }
}

impl PartialEq for Transform {
    fn eq(&self, other: &Self) -> bool {
        self.target == other.target && self.identity == other.identity
    }
}
