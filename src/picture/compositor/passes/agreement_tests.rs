//! Agreement of the GPU's pictures with their twins on the CPU.

use super::pyramid::PyramidParams;
use super::recording::PlainParams;
use super::relight::tests::any_device;
use super::subject::EdgeParams;
use super::*;
use crate::background::BackgroundParams;
use crate::facts::BINS;
use crate::false_color::FalseColorParams;
use crate::grain::GrainParams;
use crate::plate::PlateParams;
use crate::pyramid::Rgba;
use crate::view::ViewParams;
use crate::{self as cpu, CameraView, Grain, Screen, compose::tests::disc, light_wrap, reference};
use base::error::Result;
use imaging::{DisplayTable, Encoded, Image, Mask, Raster, resample::resize_area};
use scene::{Channel, Scene, ViewTransform, Viewing};
use std::sync::Arc;

/// Various sizes: a single pixel, odd and even ones, one that halves many times.
const SIZES: [(usize, usize); 4] = [(1, 1), (37, 61), (96, 96), (129, 64)];

/// A picture and its matte, in memory and on a GPU.
pub struct Set {
    pub passes: PicturePasses,
    pub image: Image,
    pub mask: Mask,
    pub on_gpu: GpuPicture,
}

/// Runs on every size, with light from black to 1e6; does nothing without an adapter.
pub fn on_every_size(test: impl Fn(&Set)) {
    let Some((device, queue)) = any_device() else { return };
    for (width, height) in SIZES {
        let passes = PicturePasses::new(&device, &queue);
        let round = disc(width.max(height));
        let mask = Mask::from_fn(width, height, |x, y| round.at(x, y));
        let image = Image::from_fn(width, height, |x, y| {
            let noise = ((x * 7919 + y * 104_729) % 1009) as f32 / 1009.0;
            let lamp = if (x * 5 + y * 3) % 211 == 7 { 1e6 } else { 1.0 };
            [noise * lamp, 0.7 * x as f32 / width as f32, 2.0 * y as f32 / height as f32]
        });
        let on_gpu = passes.upload(&image, &mask).unwrap();
        test(&Set { passes, image, mask, on_gpu });
    }
}

impl Set {
    /// The GPU's picture.
    pub fn there(&self, make: impl FnOnce(&mut Recording) -> Result<GpuPicture>) -> Rgba {
        let mut recording = self.passes.begin();
        let made = make(&mut recording).unwrap();
        let [made] = recording.read([&made]).unwrap();
        made
    }

    fn upload(&self, image: &Image) -> GpuPicture {
        self.passes.upload(image, &self.mask).unwrap()
    }

    fn matte(&self) -> GpuPicture {
        self.upload(&self.mask.map(|_| [0.0; 3]))
    }

    /// Asserts that the GPU's picture matches the CPU's: values differ by at most `most`, relative to 1 or to the
    /// value, whichever is larger. The fourth values are the matte.
    pub fn assert_same(&self, name: &str, there: &Rgba, here: &Image, most: f32) {
        assert_eq!(there.size(), here.size());
        let values = there.pixels.iter().zip(&here.pixels);
        let apart =
            values.flat_map(|(there, here)| (0..3).map(|c| (there[c] - here[c]).abs() / here[c].abs().max(1.0)));
        let apart: Vec<f32> = apart.collect();
        let largest = apart.iter().fold(0.0f32, |m, &v| m.max(v));
        let mean = apart.iter().sum::<f32>() / apart.len() as f32;
        let (width, height) = here.size();
        println!("{name} {width} × {height}: apart by {largest:.1e}, {mean:.1e} on average");
        assert!(apart.iter().all(|&v| v <= most), "{name}: {largest}");
        let alphas = there.pixels.iter().zip(&self.mask.pixels);
        assert!(alphas.into_iter().all(|(there, &alpha)| there[3] == alpha));
    }
}

#[test]
fn parameters_are_laid_out_as_the_shaders_say() {
    for shader in crate::shaders().filter(|shader| shader.name != "relight") {
        let name = shader.name;
        let module = naga::front::wgsl::parse_str(&shader.source()).unwrap();
        let params = module.types.iter().find(|(_, t)| t.name.as_deref() == Some("Params"));
        let naga::TypeInner::Struct { span, members } = &params.unwrap().1.inner else {
            panic!("{name}: Params is not a struct");
        };
        let (size, offsets): (usize, &[usize]) = match name {
            "pyramid" => (size_of::<PyramidParams>(), &[0, 8, 16, 20, 24]),
            "grain" => (size_of::<GrainParams>(), &[0, 8, 12, 16, 144]),
            "false_color" => (size_of::<FalseColorParams>(), &[0, 8, 16, 144]),
            "background" => (size_of::<BackgroundParams>(), &[0, 8, 16, 20, 24, 28, 32, 80]),
            "view" => (size_of::<ViewParams>(), &[0, 8, 12, 16, 20, 24, 28]),
            "dither" | "measure" => (size_of::<PlainParams>(), &[0, 8]),
            "plate" => (size_of::<PlateParams>(), &[0, 8, 12, 16, 24]),
            "edges" => (size_of::<EdgeParams>(), &[0, 8, 12]),
            _ => (size_of::<PlainParams>(), &[0, 8, 12]),
        };
        assert_eq!(*span as usize, size, "{name}");
        let found: Vec<usize> = members.iter().map(|m| m.offset as usize).collect();
        assert_eq!(found, offsets, "{name}");
    }
}

#[test]
fn the_subject_s_edge_agrees_with_its_twin() {
    on_every_size(|set| {
        for hole in [None, Some(set.image.pixels.len() / 2)] {
            let mut sum = set.image.clone();
            hole.iter().for_each(|&i| sum.pixels[i] = [f32::NAN; 3]);
            let mut here = sum.clone();
            let mended = reference::extend_edges(&mut here, &set.mask);
            let pixels = here.pixels.iter_mut().zip(&set.mask.pixels);
            pixels.for_each(|(pixel, alpha)| *pixel = pixel.map(|v| v * alpha));
            let matte = set.passes.upload_matte(&set.mask).unwrap();
            let sum = set.passes.upload_opaque(&sum).unwrap();
            let there = set.there(|recording| recording.cut_out(&sum, &matte));
            // Means of up to eight values, each of which may itself be a mean.
            set.assert_same("edges", &there, &here, 1e-5);
            let mut recording = set.passes.begin();
            let cut = recording.cut_out(&sum, &matte).unwrap();
            assert_eq!(recording.finish(&[&cut]).unwrap().mended, mended);
        }
    });
}

#[test]
fn what_is_measured_on_the_gpu_is_what_is_measured_in_memory() {
    on_every_size(|set| {
        let near = |there: f32, here: f32, most: f32| {
            assert!((there - here).abs() <= most * here.abs().max(1.0), "{there} is not {here}");
        };
        let mut recording = set.passes.begin();
        assert_eq!(recording.brightest(&set.on_gpu).unwrap(), cpu::brightest(&set.image));
        let every: Vec<[f32; 3]> = set.image.pixels.iter().copied().step_by(7).collect();
        let picked = recording.every(&set.on_gpu, 7).unwrap();
        assert_eq!(picked.iter().map(|p| [p[0], p[1], p[2]]).collect::<Vec<_>>(), every);

        let codes = cpu::view(&set.image, ViewTransform::Srgb);
        let grain = recording.measure_grain(&set.upload(&codes.0), &set.mask).unwrap();
        let deviations = grain.deviation.iter().flatten();
        let own = Grain::new(&codes, &set.mask);
        for (there, here) in deviations.zip(own.deviation.iter().flatten()) {
            near(*there, *here, 1e-5);
        }

        let rim = recording.rim(&set.matte()).unwrap();
        let (guide, spill) = recording.guide(&set.on_gpu, &rim).unwrap();
        let rim_here = cpu::rim(&set.mask);
        let guide_here = cpu::guide(&set.image, &set.mask, &rim_here);
        let spill_here = cpu::spill(&set.image, &guide_here);
        assert_eq!(spill.screen, spill_here.screen);
        // A share of the light: of the brightest lamps, most of it cancels.
        near(spill.excess, spill_here.excess, 1e-4);
        let guide = set.there(|_| Ok(guide));
        set.assert_same("guide", &guide, &guide_here, 1e-3);

        let size = light_wrap::measured_size(set.image.size());
        let small = |image: &Image| resize_area(image, size.0, size.1);
        let subject = set.image.map(|p| p.map(|v| 1e-3 * v.min(1.0)));
        let mask = resize_area(&set.mask, size.0, size.1);
        let need = light_wrap::need(&small(&subject), &mask, &small(&set.image));
        let subject = set.upload(&subject);
        near(recording.wrap_need(&subject, &set.on_gpu).unwrap() / need.max(1e-9), need / need.max(1e-9), 1e-3);
    });
}

#[test]
fn despill_agrees_with_its_twin() {
    on_every_size(|set| {
        let guide = cpu::guide(&set.image, &set.mask, &cpu::rim(&set.mask));
        for screen in [Screen::Green, Screen::Blue] {
            let mut here = set.image.clone();
            cpu::despill(&mut here, &guide, screen, 0.8);
            let guide = set.upload(&guide);
            let there = set.there(|recording| recording.despill(&set.on_gpu, &guide, screen, 0.8));
            // A difference of two products of the brightest light, each rounded.
            set.assert_same("despill", &there, &here, 1e-6);
        }
    });
}

#[test]
fn background_agrees_with_its_twin() {
    on_every_size(|set| {
        for (rows, yaw, fov) in [(1, 0.0, 40.0), (32, 77.0, 170.0), (200, -20.0, 6.0)] {
            let panorama =
                Image::from_fn(2 * rows, rows, |x, y| [1.0 + (0.3 * x as f32).sin(), y as f32 / rows as f32, 0.25]);
            let view = CameraView { vertical_fov_deg: fov };
            let mut here = set.image.clone();
            let backdrop = cpu::Backdrop {
                yaw_deg: yaw,
                tilt: light::weights::rotation(0.0, 0.5 * yaw, -20.0),
                level: [0.7, 0.5, 0.6],
            };
            cpu::draw_background(&mut here, &set.mask, &panorama, &backdrop, view);
            let panorama = set.passes.upload_opaque(&panorama).unwrap();
            let draw =
                |laid| set.there(|recording| recording.background(&set.on_gpu, &panorama, &backdrop, view, laid));
            // An arc tangent is accurate to 1e-4 of a texel's weight on GPUs.
            set.assert_same("background", &draw(false), &here, 2e-3);
            assert!(draw(true).pixels.iter().all(|pixel| pixel[3] == 1.0));
        }
    });
}

#[test]
fn background_blur_agrees_with_its_twin() {
    on_every_size(|set| {
        for radius in [0.4, 2.0, 11.0, 40.0] {
            let mut here = set.image.clone();
            cpu::background_blur(&mut here, radius);
            let there = set.passes.upload_opaque(&set.image).unwrap();
            let there = set.there(|recording| recording.background_blur(&there, radius));
            // Up to a hundred terms of one sign, summed in a different order.
            for (there, here) in there.pixels.iter().zip(&here.pixels) {
                for c in 0..3 {
                    assert!((there[c] - here[c]).abs() <= 1e-5 * here[c].abs().max(1.0));
                }
            }
        }
    });
}

#[test]
fn light_wrap_agrees_with_its_twin() {
    on_every_size(|set| {
        let subject = Raster {
            pixels: set.mask.pixels.iter().map(|a| [0.2 * a, 0.1 * a, 0.3 * a]).collect(),
            ..set.image.clone()
        };
        let mut here = subject.clone();
        cpu::light_wrap(&mut here, &set.mask, &set.image, 0.6);
        let subject = set.upload(&subject);
        let there = set.there(|recording| recording.light_wrap(&subject, &set.on_gpu, 0.6));
        set.assert_same("light_wrap", &there, &here, 1e-5);
    });
}

#[test]
fn glare_agrees_with_its_twin() {
    on_every_size(|set| {
        let mut here = set.image.clone();
        cpu::glare(&mut here, 0.3, 0.5);
        let there = set.there(|recording| recording.glare(&set.on_gpu, 0.3, 0.5));
        set.assert_same("glare", &there, &here, 1e-5);
    });
}

#[test]
fn exposure_view_and_inspections_agree_with_their_twins() {
    on_every_size(|set| {
        let mut here = set.image.clone();
        reference::scale(&mut here, 1.5f32.exp2());
        let there = set.there(|recording| recording.scale(&set.on_gpu, 1.5f32.exp2()));
        set.assert_same("exposure", &there, &here, 1e-6);
        // Channels depend on each other, and all entries differ.
        let table = Arc::new(DisplayTable::new("film".to_owned(), |pixels| {
            for [r, g, b] in pixels {
                let sum = *r + *g + *b;
                (*r, *g, *b) = [*g, *b, *r].map(|v| (v + 0.2 * sum).sqrt() / 2.0).into();
            }
        }));
        let curves = [
            (Some(ViewTransform::Srgb), None),
            (Some(ViewTransform::Filmic), None),
            (Some(ViewTransform::Aces), None),
            (None, Some(table)),
        ];
        for (view, through) in curves {
            for (exposure_stops, gamma) in [(0.0, 1.0), (1.5, 1.0), (-2.0, 2.2), (0.0, 0.6)] {
                let scene = Scene {
                    viewing: Viewing { exposure_stops, gamma, view, through: through.clone() },
                    ..Scene::default()
                };
                let here = cpu::viewed(&set.image, &scene).0;
                let there = set.there(|recording| recording.viewed(&set.on_gpu, &scene));
                // A twentieth of a step of 8 bits: powers and logarithms are approximate on GPUs.
                let name = format!("{view:?} {through:?} {exposure_stops:+} γ {gamma}");
                set.assert_same(&name, &there, &here, 2e-4);
            }
        }
        let codes = cpu::view(&set.image, ViewTransform::Srgb);
        let on_gpu = set.upload(&codes.0);
        let all = [Channel::Red, Channel::Green, Channel::Blue, Channel::Luminance, Channel::Alpha];
        for channel in all {
            let mut here = codes.clone();
            cpu::channels(&mut here, &set.mask, channel);
            let there = set.there(|recording| recording.channels(&on_gpu, channel));
            set.assert_same(&format!("{channel:?}"), &there, &here.0, 2e-4);
        }
        let second = Encoded(codes.0.map(|[r, g, b]| [g, b, 1.0 - r]));
        let mut here = codes.clone();
        cpu::difference(&mut here, &second, 3.0).unwrap();
        let there = set.there(|recording| recording.difference(&on_gpu, &second, 3.0));
        set.assert_same("difference", &there, &here.0, 1e-6);
    });
}

#[test]
fn false_color_agrees_with_its_twin() {
    on_every_size(|set| {
        let here = cpu::false_color(&set.image).0;
        let there = set.there(|recording| recording.false_color(&set.on_gpu));
        // A luminance on the border of two zones may fall to either side.
        let apart = there
            .pixels
            .iter()
            .zip(&here.pixels)
            .filter(|(there, here)| (0..3).any(|c| (there[c] - here[c]).abs() > 2e-4));
        assert!(apart.count() * 1000 <= here.pixels.len());
    });
}

#[test]
fn grain_agrees_with_its_twin() {
    on_every_size(|set| {
        let ramp = |bin: usize| [0.01, 0.02, 0.03].map(|d| d * (1 + bin) as f32 / 4.0);
        let plate = Grain { deviation: std::array::from_fn(ramp) };
        let own = Grain { deviation: [[0.008; 3]; BINS] };
        let mut here = cpu::view(&set.image, ViewTransform::Srgb);
        let codes = set.upload(&here.0);
        cpu::grain(&mut here, [&set.mask; 2], [&plate, &own], 1.0, 17);
        let grains = [&plate, &own];
        let there = set.there(|recording| recording.grain(&codes, &set.matte(), grains, 1.0, 17));
        set.assert_same("grain", &there, &here.0, 1e-6);
    });
}

#[test]
fn dither_agrees_with_its_twin() {
    on_every_size(|set| {
        let mut here = cpu::view(&set.image, ViewTransform::Srgb);
        let codes = set.upload(&here.0);
        reference::dither(&mut here, &set.mask);
        let there = set.there(|recording| recording.dither(&codes, &set.matte()));
        // The pattern amplifies rounding, and where it wraps it moves a code by a full step.
        let values = there.pixels.iter().zip(&here.0.pixels);
        let apart: Vec<f32> = values.flat_map(|(there, here)| (0..3).map(|c| (there[c] - here[c]).abs())).collect();
        assert!(apart.iter().all(|&v| v <= 1.001 / 255.0));
        assert!(apart.iter().filter(|&&v| v > 0.01 / 255.0).count() * 100 <= apart.len());
    });
}

#[test]
fn nan_and_infinity_do_not_spread_on_the_gpu() {
    let Some((device, queue)) = any_device() else { return };
    let passes = PicturePasses::new(&device, &queue);
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut image = Image::filled(24, 24, [0.5; 3]);
        image.pixels[40] = [value; 3];
        let mask = Mask::filled(24, 24, 0.5);
        let picture = passes.upload(&image, &mask).unwrap();
        let finite = |picture: &Rgba| {
            let pixels = picture.pixels.iter().enumerate().filter(|(i, _)| *i != 40);
            pixels.flat_map(|(_, p)| p).all(|v| v.is_finite())
        };
        let plain = passes.upload(&Image::filled(24, 24, [0.1; 3]), &mask).unwrap();
        let mut recording = passes.begin();
        let made = [
            recording.background_blur(&picture, 2.0).unwrap(),
            recording.background_blur(&picture, 9.0).unwrap(),
            recording.glare(&picture, 1.0, 0.1).unwrap(),
            recording.light_wrap(&plain, &picture, 1.0).unwrap(),
        ];
        for picture in recording.read(made.each_ref()).unwrap() {
            assert!(finite(&picture), "{value}");
        }
    }
    assert!(passes.upload(&Image::filled(0, 4, [0.0; 3]), &Mask::filled(0, 4, 0.0)).is_err());
}
