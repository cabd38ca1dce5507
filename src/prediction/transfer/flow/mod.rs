//! Dense optical flow between two grey pictures: patches are matched from coarse to fine, then all
//! offsets refined together.

mod patches;
mod pyramid;
mod refinement;
mod settings;
mod vector;

pub use settings::FlowSettings;

use imaging::Raster;
use patches::{Field, matched};
use pyramid::{doubled, pyramid};
use refinement::refine;
use vector::PATCH;

/// Offsets (dx, dy) in pixels: pixel (x, y) of `from` lies at (x + dx, y + dy) in `to`. Codes are 0
/// to 255; NaN counts as 0. `start`: offsets to begin from, one for each pixel. Offsets are 0 if
/// the pictures differ in size or are smaller than a patch. One thread, and the same bits on any
/// processor.
///
/// Patches after Kroeger, Timofte, Dai and Van Gool 2016, "Fast optical flow using dense inverse
/// search"; refinement after Brox, Bruhn, Papenberg and Weickert 2004, "High accuracy optical flow
/// estimation based on a theory for warping", with the normalisation of Zimmer, Bruhn and Weickert
/// 2011.
pub fn flow(
    from: &Raster<f32>,
    to: &Raster<f32>,
    start: Option<&[[f32; 2]]>,
    settings: &FlowSettings,
) -> Vec<[f32; 2]> {
    let (width, height) = from.size();
    let count = width * height;
    let alike = to.size() == from.size() && [from, to].iter().all(|picture| picture.pixels.len() == count);
    if !alike || width.min(height) < PATCH {
        return vec![[0.0; 2]; count];
    }
    let coarsest = coarsest_scale(width, height);
    let finest = settings.finest_scale.min(coarsest);
    let code = |v: f32| if v.is_nan() { 0.0 } else { v.clamp(0.0, 255.0) };
    let [from, to] = [from, to].map(|picture| pyramid(picture.map(code), coarsest, 1.0));
    let start = start.filter(|start| start.len() == count).map(|start| {
        let reach = width.max(height) as f32;
        let offset = |v: f32| {
            if v.is_nan() { 0.0 } else { v.clamp(-reach, reach) }
        };
        [0, 1].map(|c| {
            let pixels = start.iter().map(|o| offset(o[c])).collect();
            pyramid(Raster { width, height, pixels }, coarsest, 0.5)
        })
    });
    let start = |scale: usize| start.as_ref().map(|[x, y]| [&x[scale], &y[scale]]);
    let (width, height) = from[coarsest].size();
    let mut field: Field = match start(coarsest) {
        Some(start) => start.map(Clone::clone),
        None => [0, 1].map(|_| Raster::filled(width, height, 0.0)),
    };
    for scale in (finest..=coarsest).rev() {
        let (from, to) = (&from[scale], &to[scale]);
        if scale < coarsest {
            field = field.map(|plane| doubled(&plane, from.size()));
        }
        field = matched(from, to, &field, start(scale), settings);
        refine(from, to, &mut field, settings);
    }
    for picture in from[..finest].iter().rev() {
        field = field.map(|plane| doubled(&plane, picture.size()));
    }
    field[0].pixels.iter().zip(&field[1].pixels).map(|(x, y)| [*x, *y]).collect()
}

/// Halvings at which a patch is a quarter of the picture, and no more than the picture holds a
/// patch.
fn coarsest_scale(width: usize, height: usize) -> usize {
    let quarter = (width.max(height) as f32 / (4 * PATCH) as f32).log2().round().max(0.0) as usize;
    quarter.min((width.min(height) / PATCH).ilog2() as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Waves of 9 to 60 pixels.
    fn texture(x: f32, y: f32) -> f32 {
        let coarse = 30.0 * (0.09 * x + 0.05 * y).sin() + 30.0 * (0.06 * x - 0.11 * y).cos();
        128.0 + coarse + 20.0 * (0.31 * x + 0.42 * y).sin() + 20.0 * (0.52 * x - 0.37 * y).cos()
    }

    /// Mean error of a known warp's offsets in pixels, 5 pixels and more from the borders of both
    /// pictures.
    fn error((width, height): (usize, usize), guess: Option<[f32; 2]>, warp: impl Fn(f32, f32) -> [f32; 2]) -> f32 {
        let to = Raster::from_fn(width, height, |x, y| texture(x as f32, y as f32));
        let from = Raster::from_fn(width, height, |x, y| {
            let [dx, dy] = warp(x as f32, y as f32);
            texture(x as f32 + dx, y as f32 + dy)
        });
        let start = guess.map(|offset| vec![offset; width * height]);
        let found = flow(&from, &to, start.as_deref(), &FlowSettings::default());
        let near = |at: f32, length: usize| at > 4.0 && at < length as f32 - 5.0;
        let misses: Vec<f32> = (0..width * height)
            .filter_map(|p| {
                let (x, y) = ((p % width) as f32, (p / width) as f32);
                let [dx, dy] = warp(x, y);
                let inside = near(x, width) && near(y, height) && near(x + dx, width) && near(y + dy, height);
                inside.then(|| (found[p][0] - dx).hypot(found[p][1] - dy))
            })
            .collect();
        misses.iter().sum::<f32>() / misses.len() as f32
    }

    #[test]
    fn a_shift_is_found_at_any_size() {
        for size in [(96, 80), (97, 81), (40, 61)] {
            let error = error(size, None, |_, _| [3.3, -2.6]);
            assert!(error < 0.1, "{size:?}: {error}");
        }
    }

    #[test]
    fn a_smooth_warp_is_found() {
        let warp = |x: f32, y: f32| [4.0 * (0.03 * y).sin() + 1.0, 3.0 * (0.025 * x + 0.01 * y).cos()];
        let error = error((160, 128), None, warp);
        assert!(error < 0.15, "{error}");
    }

    #[test]
    fn a_start_is_followed() {
        let shift = [12.0, -12.0];
        let [without, with] = [None, Some(shift)].map(|start| error((48, 48), start, |_, _| shift));
        assert!(with < 0.1 && without > 1.0, "{with} {without}");
    }

    #[test]
    fn even_pictures_stay_in_place() {
        let picture = Raster::filled(50, 33, 77.0);
        assert!(flow(&picture, &picture, None, &FlowSettings::default()).iter().all(|o| *o == [0.0; 2]));
    }

    #[test]
    fn offsets_are_finite_for_any_pictures() {
        let settings = FlowSettings { finest_scale: 1, stride: 0, ..FlowSettings::default() };
        for size in [(0, 0), (1, 1), (3, 200), (8, 8), (9, 21), (33, 70)] {
            let from = Raster::from_fn(size.0, size.1, |x, y| if (x + y) % 5 == 0 { f32::NAN } else { (x * y) as f32 });
            let to = Raster::from_fn(size.0, size.1, |x, _| if x % 3 == 0 { f32::INFINITY } else { -9.0 });
            let start = vec![[f32::NAN, f32::NEG_INFINITY]; size.0 * size.1];
            for settings in [&settings, &FlowSettings::default()] {
                let offsets = flow(&from, &to, Some(&start), settings);
                assert_eq!(offsets.len(), size.0 * size.1);
                assert!(offsets.iter().flatten().all(|v| v.is_finite()), "{size:?}");
            }
        }
        assert_eq!(flow(&Raster::filled(9, 9, 1.0), &Raster::filled(8, 9, 1.0), None, &settings), [[0.0; 2]; 81]);
    }
}
