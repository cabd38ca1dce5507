//! Pictures made by a GPU match the CPU's in every scene.

use super::compose::tests::{Set, largest_difference, scene};
use super::passes::{PicturePasses, relight::tests::device};
use super::smoothing::tests::after;
use super::*;
use base::error::Result;
use imaging::{Encoded, Image};
use reflectance::{FieldBuffer, ReflectanceField};
use scene::{
    Background, BackgroundFile, Channel, Effects, Forced, Inspection, Output, STRENGTHS, Scene, Strength, ViewTransform,
};
use std::sync::Arc;

const SIZE: usize = 96;

/// One shoot whose field is in memory, and on a GPU.
struct Both {
    memory: Set,
    gpu: Field,
    plate: Grain,
    second: Encoded,
    before: Steady,
}

impl Both {
    /// None if there is no adapter. `timed` requires its clock.
    fn new(timed: bool) -> Option<Self> {
        let (device, queue) = device(timed)?;
        let mut memory = Set::new(SIZE);
        let rim = rim(&memory.mask);
        let Field::Memory(field) = &mut memory.field else {
            panic!("the field is in memory");
        };
        // Green at the rim, and a level that differs from the frame's.
        let plane = SIZE * SIZE;
        for (i, value) in field.values.iter_mut().enumerate() {
            let green = (i / plane) % 3 == 1;
            *value *= 1.03;
            *value += if green { 0.3 * rim.pixels[i % plane] } else { 0.0 };
        }
        let passes = Arc::new(PicturePasses::new(&device, &queue));
        let gpu = Field::Gpu(FieldBuffer::upload(field, &device), passes);
        memory.environment.radiance = Image::from_fn(128, 64, |x, y| {
            let lamp = if (60..64).contains(&x) && (24..32).contains(&y) { 20.0 } else { 0.5 };
            [lamp, 0.01 * x as f32, 0.02 * y as f32]
        });
        Some(Self {
            before: after(None, 0, &Set::new(SIZE).field, &memory.mask, 0.8),
            memory,
            gpu,
            plate: Grain { deviation: [[0.05; 3]; 8] },
            second: Encoded(Image::filled(SIZE, SIZE, [0.5; 3])),
        })
    }

    fn ingredients(&self) -> [Ingredients<'_>; 2] {
        let extra = Extra {
            before: Some(&self.before),
            grain: Some(&self.plate),
            second: Some(&self.second),
            ..Extra::default()
        };
        let memory = Ingredients { extra, ..self.memory.ingredients() };
        let gpu = Ingredients { field: &self.gpu, ..memory };
        [memory, gpu]
    }

    /// The same scene on the CPU and on the GPU.
    fn compose(&self, scene: &Scene) -> Result<[Picture; 2]> {
        let [memory, gpu] = self.ingredients();
        Ok([compose(scene, &memory)?, compose(scene, &gpu)?])
    }
}

/// Every effect alone, and most of them together.
fn effects() -> Vec<Effects> {
    let off = Effects::default();
    let inspect = |inspection| Effects { inspection, ..off };
    let all = Effects {
        smoothing: 0.8,
        despill: 1.0,
        background_blur: 0.03,
        light_wrap: 0.5,
        view: ViewTransform::Filmic,
        grain: 1.0,
        ..Effects::all(0.3)
    };
    let alone = |strength: &Strength| {
        let mut effects = off;
        *(strength.of)(&mut effects) = all.strength(strength.pass);
        effects
    };
    let force = |run| {
        let all = Pass::ALL.into_iter();
        all.fold(Forced::default(), |forced, pass| forced.with(pass, Some(run)))
    };
    let mut effects = vec![
        off,
        Effects { forced: force(true), ..off },
        Effects { forced: force(false), ..all },
        Effects { view: ViewTransform::Aces, ..off },
        inspect(Inspection::Channel(Channel::Alpha)),
        inspect(Inspection::Channel(Channel::Luminance)),
        inspect(Inspection::Difference { gain: 2.0 }),
        all,
    ];
    effects.extend(STRENGTHS.iter().map(alone));
    effects
}

fn scenes() -> impl Iterator<Item = Scene> {
    effects().into_iter().flat_map(|effects| {
        [Background::Environment, Background::None].map(|background| Scene {
            frame: 1,
            effects,
            ..scene(background, Output::Display, 0.5)
        })
    })
}

#[test]
fn a_gpu_s_picture_is_the_cpu_s() {
    let Some(both) = Both::new(false) else { return };
    for scene in scenes() {
        for output in [Output::Linear, Output::Display] {
            let scene = Scene { output, ..scene.clone() };
            let [here, there] = both.compose(&scene).unwrap();
            assert_eq!(here.alpha, there.alpha);
            let what = |picture: &Picture| {
                let ran = picture.passes.iter().map(|p| (p.name.clone(), p.ran));
                ran.collect::<Vec<_>>()
            };
            assert_eq!(what(&here), what(&there), "{scene:?}");
            // Every requested effect is needed here.
            let effects = scene.effects;
            let shown = output == Output::Display;
            let around = scene.background == Background::Environment;
            for pass in STRENGTHS.iter().map(|strength| strength.pass) {
                let can = match pass {
                    Pass::BackgroundBlur | Pass::LightWrap => around,
                    Pass::Grain => shown,
                    _ => true,
                };
                let asked = effects.asks(pass) && can;
                assert_eq!(there.passes[pass as usize].ran, asked, "{pass:?}: {scene:?}");
            }
            let off = effects.forced.get(Pass::Background) == Some(false);
            let opaque = scene.background == Background::Environment && !off;
            assert_eq!(there.linear.is_some(), output == Output::Linear || !opaque);
            if let (Some(here), Some(there)) = (&here.linear, &there.linear) {
                // Up to 20: arc tangents of the background are accurate to 2e-3 of a GPU's texel.
                let apart = largest_difference(here, there);
                assert!(apart < 5e-3, "{apart}: {scene:?}");
            }
            if let (Some(here), Some(there)) = (&here.display, &there.display) {
                // Dither moves a code by a full step where its pattern wraps.
                let apart = largest_difference(&here.0, &there.0);
                assert!(apart < 1.5 / 255.0, "{apart}: {scene:?}");
                let pairs = here.0.pixels.iter().flatten().zip(there.0.pixels.iter().flatten());
                let mean = pairs.map(|(a, b)| (a - b).abs()).sum::<f32>() / (3 * SIZE * SIZE) as f32;
                assert!(mean < 0.02 / 255.0, "{mean}: {scene:?}");
            }
            assert_eq!(here.steady.is_some(), there.steady.is_some());
        }
    }
}

#[test]
fn a_background_of_ones_own_is_the_same_on_a_gpu() {
    let Some(both) = Both::new(false) else { return };
    let plate = Image::from_fn(SIZE, SIZE, |x, y| [0.01 * x as f32, 0.3, 0.02 * y as f32]);
    let file = Background::File(BackgroundFile { scale: 1.5, ..BackgroundFile::new("a.png") });
    let all = [Background::Plate, Background::Color([9, 200, 99]), Background::Checker, file];
    for background in all {
        for background_blur in [0.0, 0.03] {
            let effects = Effects { background_blur, ..Effects::default() };
            let scene = Scene { effects, ..scene(background.clone(), Output::Linear, 0.5) };
            let [here, there] = both.ingredients().map(|ingredients| {
                let (filmed, behind) = (Some(&plate), Some(&plate));
                let extra = Extra { filmed, behind, ..ingredients.extra };
                compose(&scene, &Ingredients { extra, ..ingredients }).unwrap()
            });
            let apart = largest_difference(here.light(), there.light());
            assert!(apart < 1e-3, "{apart}: {background:?}");
            assert_eq!(here.alpha, there.alpha);
        }
    }
}

#[test]
fn a_pass_that_is_forced_without_a_strength_changes_nothing_on_a_gpu() {
    let Some(both) = Both::new(false) else { return };
    let [_, ingredients] = both.ingredients();
    let made = |forced| {
        let effects = Effects { forced, ..Effects::default() };
        let scene = Scene { effects, ..scene(Background::Environment, Output::Linear, 0.0) };
        compose(&scene, &ingredients).unwrap()
    };
    let plain = made(Forced::default());
    let strengths = STRENGTHS.iter().map(|strength| strength.pass);
    // Grain is added to codes.
    let light = strengths.filter(|pass| *pass != Pass::Grain);
    for pass in light.chain([Pass::Exposure]) {
        let on = made(Forced::default().with(pass, Some(true)));
        assert!(on.passes[pass as usize].ran, "{pass:?}");
        let apart = largest_difference(plain.light(), on.light());
        // Rounding of the brightest value, 20.
        assert!(apart < 20.0 * 1e-6, "{pass:?}: {apart}");
    }
}

#[test]
fn kept_pictures_of_a_gpu_are_those_that_it_would_make() {
    let Some(both) = Both::new(false) else { return };
    let [_, ingredients] = both.ingredients();
    let mut reuse = Reuse::default();
    for scene in scenes() {
        let ran = |picture: &Picture| {
            let ran = picture.passes.iter().filter(|p| p.ran);
            ran.map(|p| p.name.clone()).collect::<Vec<_>>()
        };
        let fresh = compose(&scene, &ingredients).unwrap();
        for again in [false, true] {
            let made = compose_reusing(&scene, &ingredients, &mut reuse).unwrap();
            assert_eq!(made.display, fresh.display, "{scene:?}");
            assert_eq!(made.linear, fresh.linear, "{scene:?}");
            assert!(!again || !ran(&made).contains(&"relight".to_owned()));
        }
    }
}

#[test]
fn a_gpu_s_clock_times_every_pass_that_runs() {
    let Some(both) = Both::new(true) else { return };
    let [_, ingredients] = both.ingredients();
    for scene in scenes() {
        let started = std::time::Instant::now();
        let picture = compose(&scene, &ingredients).unwrap();
        let whole = started.elapsed().as_secs_f64() * 1e3;
        let mut sum = 0.0;
        for pass in &picture.passes {
            let ms = pass.ms.unwrap_or_else(|| panic!("{} is not timed", pass.name));
            // Smoothing is in the weights: only its measurement takes time. The first two are not passes here.
            assert!(ms > 0.0 || !pass.ran || pass.name == "smoothing", "{pass:?}");
            assert!(ms >= 0.0);
            sum += ms;
        }
        assert!(0.0 < sum && sum <= whole, "{sum} of {whole} ms");
    }
}

#[test]
fn a_gpu_without_a_clock_says_so() {
    let Some(both) = Both::new(false) else { return };
    let [_, picture] = both.compose(&scene(Background::None, Output::Display, 0.5)).unwrap();
    let relight = picture.passes.iter().find(|p| p.name == "relight").unwrap();
    assert!(relight.ran && relight.ms.is_none());
    let glare = picture.passes.iter().find(|p| p.name == "glare").unwrap();
    assert_eq!((glare.ran, glare.ms), (false, Some(0.0)));
}

#[test]
fn a_gpu_says_how_many_pixels_it_mended() {
    let Some(mut both) = Both::new(false) else { return };
    let Field::Memory(field) = &mut both.memory.field else {
        panic!("the field is in memory");
    };
    let Field::Gpu(buffer, passes) = &mut both.gpu else {
        panic!("the field is on the GPU");
    };
    field.values[SIZE * SIZE / 2 + SIZE / 2] = f32::NAN;
    *buffer = FieldBuffer::upload(field, &passes.device);
    let [here, there] = both.compose(&scene(Background::None, Output::Linear, 0.0)).unwrap();
    let reason = |picture: &Picture| {
        let relight = picture.passes.iter().find(|p| p.name == "relight");
        relight.unwrap().reason.clone()
    };
    assert!(reason(&here).contains("1 pixels were NaN or infinite"), "{}", reason(&here));
    assert_eq!(reason(&here), reason(&there));
    assert!(largest_difference(here.light(), there.light()) < 1e-5);
}

#[test]
fn what_does_not_fit_is_refused_on_a_gpu_too() {
    let Some(both) = Both::new(false) else { return };
    let scene = Scene {
        effects: Effects { inspection: Inspection::Difference { gain: 1.0 }, ..Effects::default() },
        ..scene(Background::None, Output::Display, 0.0)
    };
    let second = Encoded(Image::filled(8, 8, [0.0; 3]));
    let [_, mut ingredients] = both.ingredients();
    ingredients.extra.second = Some(&second);
    assert!(compose(&scene, &ingredients).unwrap_err().to_string().contains("8 × 8"));
    // A device with default limits binds at most 128 MiB.
    let Field::Gpu(_, passes) = &both.gpu else {
        panic!("the field is on the GPU");
    };
    let large = ReflectanceField { width: 1024, height: 1024, lamps: 11, values: vec![0.0; 11 * (3 << 20)] };
    let buffer = FieldBuffer::upload(&large, &passes.device);
    let refused = passes.relight.sum(&buffer, &[[1.0; 3]; 11]).unwrap_err();
    assert!(refused.to_string().contains("binds at most"), "{refused}");
}
