//! Pass `background`: the environment behind the subject, seen by a camera on +Z that looks along −Z,
//! with its own rotation, level and colour; or the plate, a file, a colour or a checker.

use super::camera_view::CameraView;
use super::cubic::Taps;
use super::descriptor::{Descriptor, NO_BACKGROUND};
use super::facts::key;
use super::passes::{GpuPicture, Recording, Shader, extent};
use super::picture::Ingredients;
use base::error::Result;
use bytemuck::{Pod, Zeroable, bytes_of};
use glam::{Mat3, Quat, Vec3};
use imaging::color::linear_from_srgb;
use imaging::resample::{resize_area, resize_part};
use imaging::{Image, Mask};
use light::latlong::uv_from_direction;
use rayon::prelude::*;
use scene::{Background, BackgroundFile, Effects, Pass, Scene};

const SHADER: Shader = Shader::new("background", include_str!("../../../shaders/background.wgsl"));

/// Squares of a checker in the picture's height, and their light.
const SQUARES: usize = 16;
const GREYS: [f32; 2] = [0.1, 0.2];

pub(crate) const BACKGROUND: Descriptor = Descriptor {
    fixed: |scene| (scene.background == Background::None).then_some(NO_BACKGROUND),
    settings: |context| {
        if context.scene.background != Background::Environment {
            return key(&context.scene.background);
        }
        let Backdrop { yaw_deg, tilt, level } = Backdrop::new(context.scene, 1.0);
        let turn = (yaw_deg.to_bits(), tilt.to_array().map(f32::to_bits));
        let level = level.map(f32::to_bits);
        key((turn, level, draws_whole(&context.effects)))
    },
    reads: |context, _| match context.scene.background {
        Background::Environment => context.facts.inputs.backdrop,
        Background::File(_) => context.facts.inputs.behind,
        _ => context.facts.inputs.frame,
    },
    shader: Some(&SHADER),
    ..Descriptor::new(Pass::Background, |context| {
        context.behind()?;
        let percent = (100.0 * context.facts.open_share).max(1.0);
        Ok(format!("visible in {percent:.0} % of the pixels"))
    })
};

/// A background other than the environment, in linear light at the picture's size; None for the environment.
pub(crate) fn backing(scene: &Scene, ingredients: &Ingredients) -> Option<Image> {
    let (width, height) = ingredients.matte().size();
    match &scene.background {
        Background::Environment | Background::None => None,
        Background::File(placed) => Some(match ingredients.extra.behind {
            Some(picture) => cover(picture, placed, (width, height)),
            None => Image::filled(width, height, [0.0; 3]),
        }),
        Background::Plate => match (ingredients.plate(), ingredients.extra.filmed) {
            (Some(plate), _) => Some(plate.filmed()),
            (None, Some(filmed)) => Some(resize_area(filmed, width, height)),
            (None, None) => Some(Image::filled(width, height, [0.0; 3])),
        },
        Background::Color(codes) => {
            let light = codes.map(|code| linear_from_srgb(f32::from(code) / 255.0));
            Some(Image::filled(width, height, light))
        }
        Background::Checker => {
            let side = (height / SQUARES).max(1);
            Some(Image::from_fn(width, height, |x, y| [GREYS[(x / side + y / side) % 2]; 3]))
        }
    }
}

/// A picture that covers `size` as a file is placed, exposed; black beyond its edges.
fn cover(picture: &Image, placed: &BackgroundFile, (width, height): (usize, usize)) -> Image {
    let BackgroundFile { offset: [right, up], scale, exposure_stops, .. } = placed.clone().bounded();
    let [width_px, height_px] = [width, height].map(|length| length as f64);
    let (columns, rows) = (picture.width as f64, picture.height as f64);
    // Pixels of the picture for each pixel of the result.
    let ratio = (columns / width_px).min(rows / height_px) / f64::from(scale);
    let start = [
        0.5 * columns - (0.5 + f64::from(right)) * width_px * ratio,
        0.5 * rows - (0.5 - f64::from(up)) * height_px * ratio,
    ];
    let mut placed = resize_part(picture, (width, height), start, [ratio; 2]);
    let gain = exposure_stops.exp2();
    if gain != 1.0 {
        placed.pixels.par_iter_mut().for_each(|pixel| *pixel = pixel.map(|light| gain * light));
    }
    placed
}

/// The background is needed everywhere, not only where the matte is open.
pub(crate) fn draws_whole(effects: &Effects) -> bool {
    effects.asks(Pass::BackgroundBlur) || effects.asks(Pass::LightWrap)
}

/// Placement of the environment behind the subject: rotated by a yaw in degrees, then by `tilt`, times `level` per channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Backdrop {
    pub yaw_deg: f32,
    pub tilt: Quat,
    pub level: [f32; 3],
}

impl Backdrop {
    /// Backdrop of a scene, in an environment whose level in the picture is `level`.
    pub fn new(scene: &Scene, level: f32) -> Self {
        let further = scene.lighting.background_yaw_deg;
        Self {
            yaw_deg: scene.yaw_deg + if further.is_finite() { further } else { 0.0 },
            tilt: scene.lighting.tilt(),
            level: scene.lighting.gains().map(|gain| gain * level),
        }
    }
}

/// Adds `level` · environment to a premultiplied picture where `mask` lets it through. The panorama is
/// smoothed with a cubic B-spline, which has no ringing beside a sun and no facets when a small
/// panorama fills a large picture. A large panorama is sampled once per texel. A picture with pixels much
/// smaller than texels is interpolated between samples a fifth of a texel apart: the error is less than
/// 0.3 % of a texel's contrast.
pub fn draw_background(picture: &mut Image, mask: &Mask, panorama: &Image, backdrop: &Backdrop, view: CameraView) {
    let (width, height) = picture.size();
    let sampling = Sampling::new(height, panorama.height, backdrop.yaw_deg, view);
    let Sampling { pixel, turn, .. } = sampling;
    let untilt = backdrop.tilt.inverse();
    // Background at a place in pixels.
    let seen = |x: f32, y: f32| {
        let (across, down) = (x - width as f32 / 2.0, y - height as f32 / 2.0);
        let direction = untilt * Vec3::new(across * pixel, -down * pixel, -1.0);
        let (u, v) = uv_from_direction(direction);
        spline(panorama, u - turn, v)
    };
    let add = |out: &mut [f32; 3], open: f32, color: [f32; 3]| {
        (0..3).for_each(|c| out[c] += open * backdrop.level[c] * color[c]);
    };
    let lattice = (sampling.step > 1).then(|| Lattice::new(mask, sampling.step, &seen));
    let samples = sampling.samples;
    let rows = picture.pixels.par_chunks_mut(width.max(1)).enumerate();
    rows.for_each(|(y, row)| {
        let near = lattice.as_ref().map(|lattice| (lattice, lattice.taps(y)));
        let row = row.iter_mut().zip(&mask.pixels[y * width..]);
        for (x, (out, alpha)) in row.enumerate().filter(|(_, (_, alpha))| **alpha < 1.0) {
            let color = match &near {
                Some((lattice, taps)) => taps.sum(|row| lattice.rows.at(x, row)),
                None => {
                    let mut sum = [0f32; 3];
                    for sample in 0..samples * samples {
                        let (i, j) = (sample % samples, sample / samples);
                        let within = [i, j].map(|i| (i as f32 + 0.5) / samples as f32);
                        let color = seen(x as f32 + within[0], y as f32 + within[1]);
                        (0..3).for_each(|c| sum[c] += color[c]);
                    }
                    sum.map(|v| v / (samples * samples) as f32)
                }
            };
            add(out, 1.0 - alpha, color);
        }
    });
}

/// The background at every `step`-th pixel along each axis: a picture much larger than its part of the
/// panorama changes slowly, and is interpolated between these samples (by a cubic).
struct Lattice {
    step: usize,
    /// Every pixel of every `step`-th row.
    rows: Image,
}

impl Lattice {
    /// Samples only where a nearby pixel of `mask` is open.
    fn new(mask: &Mask, step: usize, see: &(impl Fn(f32, f32) -> [f32; 3] + Sync)) -> Self {
        let (width, height) = mask.size();
        // One beyond the last pixel.
        let [columns, rows] = [width, height].map(|length| (length - 1) / step + 2);
        let along: Vec<Taps> = (0..width).map(|x| Taps::at(x as f32 / step as f32, columns)).collect();
        // A cubic needs two points on each side.
        let around = |i: usize, length: usize| {
            let [first, end] = [(i * step).saturating_sub(2 * step), (i + 2) * step];
            first.min(length)..end.min(length)
        };
        let mut wide = Image::filled(width, rows, [0.0; 3]);
        let lines = wide.pixels.par_chunks_mut(width).enumerate();
        lines.for_each(|(j, line)| {
            let mut open = vec![false; width];
            for y in around(j, height) {
                let row = open.iter_mut().zip(&mask.pixels[y * width..]);
                row.for_each(|(open, &alpha)| *open |= alpha < 1.0);
            }
            if !open.contains(&true) {
                return;
            }
            let look = |i: usize| {
                if open[around(i, width)].contains(&true) {
                    see((i * step) as f32 + 0.5, (j * step) as f32 + 0.5)
                } else {
                    [0.0; 3]
                }
            };
            let points: Vec<[f32; 3]> = (0..columns).map(look).collect();
            let pixels = line.iter_mut().zip(&along);
            pixels.for_each(|(pixel, taps)| *pixel = taps.sum(|i| points[i]));
        });
        Self { step, rows: wide }
    }

    /// The rows around row `y` of the picture.
    fn taps(&self, y: usize) -> Taps {
        Taps::at(y as f32 / self.step as f32, self.rows.height)
    }
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
pub(crate) struct BackgroundParams {
    size: [u32; 2],
    panorama: [u32; 2],
    pixel: f32,
    turn: f32,
    samples: u32,
    opaque: u32,
    untilt: [[f32; 4]; 3],
    level: [f32; 4],
}

impl Recording<'_> {
    /// [`draw_background`] on the GPU: the fourth value of `subject` is its matte. In the result it is 1 if the subject
    /// is `laid` over the background here; otherwise it stays.
    ///
    /// # Errors
    /// When the GPU cannot hold the result.
    pub fn background(
        &mut self,
        subject: &GpuPicture,
        panorama: &GpuPicture,
        backdrop: &Backdrop,
        view: CameraView,
        laid: bool,
    ) -> Result<GpuPicture> {
        let sampling = Sampling::new(subject.height, panorama.height, backdrop.yaw_deg, view);
        let [x, y, z] = Mat3::from_quat(backdrop.tilt.inverse()).to_cols_array_2d().map(|[x, y, z]| [x, y, z, 0.0]);
        let [r, g, b] = backdrop.level;
        let params = BackgroundParams {
            size: extent(subject.size()),
            panorama: extent(panorama.size()),
            pixel: sampling.pixel,
            turn: sampling.turn,
            samples: sampling.samples as u32,
            opaque: u32::from(laid),
            untilt: [x, y, z],
            level: [r, g, b, 0.0],
        };
        let (shader, size) = ((&SHADER, "background"), subject.size());
        self.run(shader, bytes_of(&params), subject, Some(panorama), size)
    }
}

/// View directions of a picture's pixels.
struct Sampling {
    /// Width of a pixel at unit distance.
    pixel: f32,
    /// Yaw in turns, `[0, 1)`.
    turn: f32,
    /// Samples along each axis of a pixel.
    samples: usize,
    /// Pixels between samples.
    step: usize,
}

/// Largest distance of samples in texels where pixels are smaller still.
const APART: f32 = 0.2;

impl Sampling {
    /// `rows` and `panorama_rows` are the heights of picture and panorama.
    fn new(rows: usize, panorama_rows: usize, yaw_deg: f32, view: CameraView) -> Self {
        let half_height = (view.vertical_fov_deg.to_radians() / 2.0).tan();
        let pixel = 2.0 * half_height / rows as f32;
        let texel = std::f32::consts::PI / panorama_rows as f32;
        Self {
            pixel,
            // Reduced first, so that a full turn more gives the same numbers.
            turn: yaw_deg.rem_euclid(360.0) / 360.0,
            samples: (pixel / texel).ceil().max(1.0) as usize,
            step: (APART * texel / pixel).max(1.0) as usize,
        }
    }
}

/// The panorama at (u, v), smoothed with the uniform cubic B-spline over 4 × 4 texels. Columns wrap;
/// beyond a pole the panorama continues half a turn away.
fn spline(panorama: &Image, u: f32, v: f32) -> [f32; 3] {
    let (width, height) = (panorama.width as isize, panorama.height as isize);
    let (x, y) = (u * width as f32 - 0.5, v * height as f32 - 0.5);
    let (column, row) = (x.floor(), y.floor());
    let (across, down) = (weights(x - column), weights(y - row));
    // Yaw plus half a turn wrap a column at most once; narrow panoramas wrap in any case.
    let wrapped = |c: isize| match c {
        c if (0..width).contains(&c) => c,
        c => c.rem_euclid(width),
    };
    let first = column as isize - 1;
    let near = [0, 1, 2, 3].map(|i| wrapped(first + i) as usize);
    let beyond = |far: [usize; 4]| far.map(|c| wrapped(c as isize + width / 2) as usize);
    let mut sum = [0f32; 3];
    for (j, wy) in down.into_iter().enumerate() {
        let r = row as isize + j as isize - 1;
        let (r, columns) = match r {
            r if r < 0 => (-1 - r, beyond(near)),
            r if r >= height => (2 * height - 1 - r, beyond(near)),
            r => (r, near),
        };
        // Panoramas of fewer than two rows cannot be reflected this far.
        let texels = &panorama.pixels[r.clamp(0, height - 1) as usize * panorama.width..];
        for (wx, column) in across.into_iter().zip(columns) {
            let texel = texels[column];
            (0..3).for_each(|k| sum[k] += wx * wy * texel[k]);
        }
    }
    sum
}

/// Weights of four texels for a point `f` ∈ [0, 1) beyond the second one; their sum is 1.
fn weights(f: f32) -> [f32; 4] {
    let g = 1.0 - f;
    [g * g * g, 4.0 - 3.0 * f * f * (2.0 - f), 4.0 - 3.0 * g * g * (2.0 - g), f * f * f].map(|w| w / 6.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use imaging::Raster;

    fn seen(panorama: &Image, size: (usize, usize), yaw_deg: f32, fov: f32) -> Image {
        let mut picture = Image::filled(size.0, size.1, [0.0; 3]);
        let mask = Mask::filled(size.0, size.1, 0.0);
        draw_background(
            &mut picture,
            &mask,
            panorama,
            &Backdrop { yaw_deg, tilt: Quat::IDENTITY, level: [1.0; 3] },
            CameraView { vertical_fov_deg: fov },
        );
        picture
    }

    /// Centre of brightness in pixels from the picture's centre, to the right and down.
    fn centroid(picture: &Image) -> (f32, f32) {
        let (mut x, mut y, mut total) = (0.0, 0.0, 0.0);
        for (i, pixel) in picture.pixels.iter().enumerate() {
            x += pixel[0] * ((i % picture.width) as f32 + 0.5 - picture.width as f32 / 2.0);
            y += pixel[0] * ((i / picture.width) as f32 + 0.5 - picture.height as f32 / 2.0);
            total += pixel[0];
        }
        (x / total, y / total)
    }

    fn spot(width: usize, height: usize, column: usize, row: usize) -> Image {
        Raster::from_fn(width, height, |x, y| if (x, y) == (column, row) { [1e6; 3] } else { [0.0; 3] })
    }

    #[test]
    fn an_even_world_stays_even() {
        for size in [(1, 1), (2, 1), (16, 8), (257, 129)] {
            for fov in [6.0, 40.0, 170.0] {
                let picture = seen(&Image::filled(size.0, size.1, [0.5, 1.0, 2.0]), (31, 17), 33.0, fov);
                assert!(picture.pixels.iter().all(|p| (p[0] - 0.5).abs() < 1e-5 && (p[2] - 2.0).abs() < 1e-5));
            }
        }
    }

    #[test]
    fn the_centre_of_the_panorama_is_behind_the_subject_and_positive_yaw_moves_it_right() {
        let panorama = spot(65, 33, 32, 16);
        let (x, y) = centroid(&seen(&panorama, (65, 65), 0.0, 60.0));
        assert!(x.abs() < 0.05 && y.abs() < 0.05, "({x}, {y})");
        let half_picture = 32.5 / 30f32.to_radians().tan();
        let (x, _) = centroid(&seen(&panorama, (65, 65), 10.0, 60.0));
        assert!((x - half_picture * 10f32.to_radians().tan()).abs() < 0.5, "{x}");
        let (_, y) = centroid(&seen(&spot(65, 33, 32, 14), (65, 65), 0.0, 60.0));
        assert!(y < -2.0, "a texel above the horizon is at {y}");
    }

    #[test]
    fn a_large_picture_of_a_small_panorama_is_interpolated_as_if_each_pixel_looked() {
        let panorama = spot(64, 32, 33, 15);
        let (width, height) = (300, 301);
        let mask = Mask::from_fn(width, height, |x, y| if x + y < 150 { 1.0 } else { 0.0 });
        let backdrop = Backdrop { yaw_deg: 7.0, tilt: Quat::from_rotation_x(0.1), level: [1e-6, 2e-6, 3e-6] };
        let view = CameraView::default();
        let sampling = Sampling::new(height, 32, 7.0, view);
        assert_eq!((sampling.samples, sampling.step), (1, 8));
        let mut picture = Image::filled(width, height, [0.0; 3]);
        draw_background(&mut picture, &mask, &panorama, &backdrop, view);
        let untilt = backdrop.tilt.inverse();
        let mut worst = 0f32;
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let [across, down] = [(x, width), (y, height)].map(|(i, length)| i as f32 + 0.5 - length as f32 / 2.0);
            let pixel = sampling.pixel;
            let look = untilt * Vec3::new(across * pixel, -down * pixel, -1.0);
            let (u, v) = uv_from_direction(look);
            let seen = spline(&panorama, u - sampling.turn, v);
            let open = 1.0 - mask.at(x, y);
            let (found, wanted) = (picture.at(x, y)[2], open * 3e-6 * seen[2]);
            worst = worst.max((found - wanted).abs() / 3.0);
        }
        assert!(worst < 3e-3, "{worst} of a texel's contrast");
    }

    #[test]
    fn a_whole_turn_changes_nothing() {
        let panorama = Raster::from_fn(64, 32, |x, y| [x as f32, y as f32, (x * y) as f32]);
        assert_eq!(seen(&panorama, (20, 30), 77.5, 40.0), seen(&panorama, (20, 30), 77.5 - 360.0, 40.0));
    }

    #[test]
    fn a_small_panorama_is_shown_without_facets() {
        // Second differences along a row of a magnified edge: linear interpolation would give
        // one full slope at a texel's centre.
        let panorama = Raster::from_fn(64, 32, |x, _| if x < 32 { [0.0; 3] } else { [1.0; 3] });
        let picture = seen(&panorama, (512, 1), 0.0, 0.1);
        let row: Vec<f32> = picture.pixels.iter().map(|p| p[0]).collect();
        let slope = row.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f32::max);
        let bend = row.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).abs()).fold(0.0, f32::max);
        assert!(slope > 0.0 && bend < 0.1 * slope, "slope {slope}, bend {bend}");
    }

    #[test]
    fn a_large_panorama_keeps_its_mean() {
        // Stripes of one texel, eight or more per pixel, must not alias.
        let panorama = Raster::from_fn(2048, 1024, |x, _| [(x % 2) as f32; 3]);
        let picture = seen(&panorama, (24, 24), 0.0, 40.0);
        assert!(picture.pixels.iter().all(|p| (p[0] - 0.5).abs() < 0.05));
    }
}
