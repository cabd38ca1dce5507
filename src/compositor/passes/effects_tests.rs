use super::super::pictures::SHADERS;
use super::super::relight::tests::any_device;
use super::*;
use crate::compositor::pyramid::Rgba;
use crate::compositor::{self as cpu, compose::tests::disc, reference};
use crate::imaging::{Encoded, Image, Mask, Raster};

/// Sizes with nothing in common: a pixel, odd and even ones, one that halves many times.
const SIZES: [(usize, usize); 4] = [(1, 1), (37, 61), (96, 96), (129, 64)];

struct Set {
    passes: PicturePasses,
    image: Image,
    mask: Mask,
    on_gpu: GpuPicture,
}

/// Runs on every size, with light from black to 1e6; nothing where there is no adapter.
fn on_every_size(test: impl Fn(&Set)) {
    let Some((device, queue)) = any_device() else {
        return;
    };
    for (width, height) in SIZES {
        let passes = PicturePasses::new(&device, &queue);
        let round = disc(width.max(height));
        let mask = Mask::from_fn(width, height, |x, y| round.at(x, y));
        let image = Image::from_fn(width, height, |x, y| {
            let noise = ((x * 7919 + y * 104_729) % 1009) as f32 / 1009.0;
            let lamp = if (x * 5 + y * 3) % 211 == 7 { 1e6 } else { 1.0 };
            [
                noise * lamp,
                0.7 * x as f32 / width as f32,
                2.0 * y as f32 / height as f32,
            ]
        });
        let on_gpu = passes.upload(&image, &mask).unwrap();
        test(&Set {
            passes,
            image,
            mask,
            on_gpu,
        });
    }
}

impl Set {
    fn upload(&self, image: &Image) -> GpuPicture {
        self.passes.upload(image, &self.mask).unwrap()
    }

    fn matte(&self, mask: &Mask) -> GpuPicture {
        self.upload(&mask.map(|a| [a; 3]))
    }

    /// The GPU's picture is the CPU's: no value is apart by more than `most`, in units of 1 and of the
    /// value itself, whichever is larger. The fourth values are the matte.
    fn assert_same(&self, name: &str, there: &GpuPicture, here: &Image, most: f32) {
        let there = self.passes.read(there).unwrap();
        assert_eq!(there.size(), here.size());
        let values = there.pixels.iter().zip(&here.pixels);
        let apart = values.flat_map(|(there, here)| {
            (0..3).map(|c| (there[c] - here[c]).abs() / here[c].abs().max(1.0))
        });
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
    for (name, text, _) in SHADERS {
        let module = naga::front::wgsl::parse_str(text).unwrap();
        let params = module
            .types
            .iter()
            .find(|(_, t)| t.name.as_deref() == Some("Params"));
        let naga::TypeInner::Struct { span, members } = &params.unwrap().1.inner else {
            panic!("{name}: Params is no struct");
        };
        let (size, offsets): (usize, &[usize]) = match name {
            "pyramid" => (size_of::<PyramidParams>(), &[0, 8, 16, 20, 24]),
            "grain" => (size_of::<GrainParams>(), &[0, 8, 12, 16, 144]),
            "false_color" => (size_of::<FalseColorParams>(), &[0, 8, 16, 144]),
            "background" => (size_of::<BackgroundParams>(), &[0, 8, 16, 20, 24, 32, 80]),
            "dither" => (size_of::<PlainParams>(), &[0, 8]),
            _ => (size_of::<PlainParams>(), &[0, 8, 12]),
        };
        assert_eq!(*span as usize, size, "{name}");
        let found: Vec<usize> = members.iter().map(|m| m.offset as usize).collect();
        assert_eq!(found, offsets, "{name}");
    }
}

#[test]
fn despill_agrees_with_its_twin() {
    on_every_size(|set| {
        let guide = cpu::guide(&set.image, &set.mask, &cpu::rim(&set.mask));
        for screen in [Screen::Green, Screen::Blue] {
            let mut here = set.image.clone();
            cpu::despill(&mut here, &guide, screen, 0.8);
            let guide = set.upload(&guide);
            let there = set.passes.despill(&set.on_gpu, &guide, screen, 0.8);
            // A difference of two products of the brightest light, each rounded.
            set.assert_same("despill", &there.unwrap(), &here, 1e-6);
        }
    });
}

#[test]
fn background_agrees_with_its_twin() {
    on_every_size(|set| {
        for (rows, yaw, fov) in [(1, 0.0, 40.0), (32, 77.0, 170.0), (200, -20.0, 6.0)] {
            let panorama = Image::from_fn(2 * rows, rows, |x, y| {
                [1.0 + (0.3 * x as f32).sin(), y as f32 / rows as f32, 0.25]
            });
            let view = CameraView {
                vertical_fov_deg: fov,
            };
            let mut here = set.image.clone();
            let backdrop = cpu::Backdrop {
                yaw_deg: yaw,
                tilt: crate::light::weights::rotation(0.0, 0.5 * yaw, -20.0),
                level: [0.7, 0.5, 0.6],
            };
            cpu::draw_background(&mut here, &set.mask, &panorama, &backdrop, view);
            let opaque = Mask::filled(2 * rows, rows, 1.0);
            let panorama = set.passes.upload(&panorama, &opaque).unwrap();
            let there = set
                .passes
                .background(&set.on_gpu, &panorama, &backdrop, view);
            // An angle's arc tangent is good to 1e-4 of a texel's weight on GPUs.
            set.assert_same("background", &there.unwrap(), &here, 2e-3);
        }
    });
}

#[test]
fn background_blur_agrees_with_its_twin() {
    on_every_size(|set| {
        for radius in [0.4, 2.0, 11.0, 40.0] {
            let mut here = set.image.clone();
            cpu::background_blur(&mut here, radius);
            let opaque = Mask::filled(here.width, here.height, 1.0);
            let there = set.passes.upload(&set.image, &opaque).unwrap();
            let there = set.passes.background_blur(&there, radius).unwrap();
            let there = set.passes.read(&there).unwrap();
            // Up to a hundred terms of one sign, summed in one order and weighed in another.
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
            pixels: set
                .mask
                .pixels
                .iter()
                .map(|a| [0.2 * a, 0.1 * a, 0.3 * a])
                .collect(),
            ..set.image.clone()
        };
        let mut here = subject.clone();
        cpu::light_wrap(&mut here, &set.mask, &set.image, 0.6);
        let there = set
            .passes
            .light_wrap(&set.upload(&subject), &set.on_gpu, 0.6);
        set.assert_same("light_wrap", &there.unwrap(), &here, 1e-5);
    });
}

#[test]
fn glare_agrees_with_its_twin() {
    on_every_size(|set| {
        let mut here = set.image.clone();
        cpu::glare(&mut here, 0.3, 0.5);
        let there = set.passes.glare(&set.on_gpu, 0.3, 0.5).unwrap();
        set.assert_same("glare", &there, &here, 1e-5);
    });
}

#[test]
fn exposure_view_and_inspections_agree_with_their_twins() {
    on_every_size(|set| {
        let mut here = set.image.clone();
        reference::scale(&mut here, 1.5f32.exp2());
        let there = set.passes.exposure(&set.on_gpu, 1.5).unwrap();
        set.assert_same("exposure", &there, &here, 1e-6);
        let curves = [
            ViewTransform::Srgb,
            ViewTransform::Filmic,
            ViewTransform::Aces,
        ];
        for curve in curves {
            let here = cpu::view(&set.image, curve).0;
            let there = set.passes.view(&set.on_gpu, curve).unwrap();
            // A twentieth of a step of 8 bits: powers and logarithms are approximate on GPUs.
            set.assert_same(&format!("{curve:?}"), &there, &here, 2e-4);
        }
        let codes = cpu::view(&set.image, ViewTransform::Srgb);
        let on_gpu = set.upload(&codes.0);
        let all = [
            Channel::Red,
            Channel::Green,
            Channel::Blue,
            Channel::Luminance,
            Channel::Alpha,
        ];
        for channel in all {
            let mut here = codes.clone();
            cpu::channels(&mut here, &set.mask, channel);
            let there = set.passes.channels(&on_gpu, channel).unwrap();
            set.assert_same(&format!("{channel:?}"), &there, &here.0, 2e-4);
        }
        let second = Encoded(codes.0.map(|[r, g, b]| [g, b, 1.0 - r]));
        let mut here = codes.clone();
        cpu::difference(&mut here, &second, 3.0).unwrap();
        let there = set.passes.difference(&on_gpu, &set.upload(&second.0), 3.0);
        set.assert_same("difference", &there.unwrap(), &here.0, 1e-6);
    });
}

#[test]
fn false_color_agrees_with_its_twin() {
    on_every_size(|set| {
        let here = cpu::false_color(&set.image).0;
        let there = set.passes.false_color(&set.on_gpu).unwrap();
        let there = set.passes.read(&there).unwrap();
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
        let plate = Grain {
            deviation: std::array::from_fn(ramp),
        };
        let own = Grain {
            deviation: [[0.008; 3]; BINS],
        };
        let mut here = cpu::view(&set.image, ViewTransform::Srgb);
        let codes = set.upload(&here.0);
        cpu::grain(&mut here, [&set.mask; 2], [&plate, &own], 1.0, 17);
        let matte = set.matte(&set.mask);
        let there = set.passes.grain(&codes, &matte, [&plate, &own], 1.0, 17);
        set.assert_same("grain", &there.unwrap(), &here.0, 1e-6);
    });
}

#[test]
fn dither_agrees_with_its_twin() {
    on_every_size(|set| {
        let mut here = cpu::view(&set.image, ViewTransform::Srgb);
        let codes = set.upload(&here.0);
        reference::dither(&mut here, &set.mask);
        let there = set.passes.dither(&codes, &set.matte(&set.mask)).unwrap();
        let there = set.passes.read(&there).unwrap();
        // The pattern enlarges rounding, and where it wraps it moves a code by a whole step.
        let values = there.pixels.iter().zip(&here.0.pixels);
        let apart: Vec<f32> = values
            .flat_map(|(there, here)| (0..3).map(|c| (there[c] - here[c]).abs()))
            .collect();
        assert!(apart.iter().all(|&v| v <= 1.001 / 255.0));
        assert!(apart.iter().filter(|&&v| v > 0.01 / 255.0).count() * 100 <= apart.len());
    });
}

#[test]
fn no_value_that_is_no_number_spreads_on_the_gpu() {
    let Some((device, queue)) = any_device() else {
        return;
    };
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
        let plain = passes
            .upload(&Image::filled(24, 24, [0.1; 3]), &mask)
            .unwrap();
        for picture in [
            passes.background_blur(&picture, 2.0).unwrap(),
            passes.background_blur(&picture, 9.0).unwrap(),
            passes.glare(&picture, 1.0, 0.1).unwrap(),
            passes.light_wrap(&plain, &picture, 1.0).unwrap(),
        ] {
            assert!(finite(&passes.read(&picture).unwrap()), "{value}");
        }
    }
    assert!(
        passes
            .upload(&Image::filled(0, 4, [0.0; 3]), &Mask::filled(0, 4, 0.0))
            .is_err()
    );
}
