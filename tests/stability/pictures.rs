//! Whole pictures of odd sizes, mattes and light, with all effects, in memory and on a GPU.

use super::gpu;
use super::noise;
use afterlight::compositor::{Extra, Field, Grain, Ingredients, Picture, compose};
use afterlight::gpu::ComputeDevice;
use afterlight::imaging::{Image, Mask};
use afterlight::light::{Environment, LightWeights, weights};
use afterlight::reflectance::FieldBuffer;
use afterlight::scene::{Background, Effects, Output, Scene};
use test_support::shown;

const LAMPS: usize = 3;

/// Odd sizes: one pixel, lines, primes, not square.
const SIZES: [(usize, usize); 7] = [(1, 1), (1, 7), (11, 1), (2, 3), (13, 17), (31, 5), (97, 53)];

/// A matte that is empty, full, one pixel, or a ramp.
fn mattes((width, height): (usize, usize)) -> [(&'static str, Mask); 4] {
    let one = (width / 2, height / 3);
    [
        ("empty", Mask::filled(width, height, 0.0)),
        ("full", Mask::filled(width, height, 1.0)),
        ("of one pixel", Mask::from_fn(width, height, |x, y| f32::from(u8::from((x, y) == one)))),
        ("a ramp", Mask::from_fn(width, height, |x, _| x as f32 / width as f32)),
    ]
}

fn environment(radiance: Image) -> Environment {
    Environment::from_radiance("test", radiance)
}

/// A window in a dim room.
fn window() -> Environment {
    environment(Image::from_fn(64, 32, |x, y| {
        let inside = (28..36).contains(&x) && (10..16).contains(&y);
        let light = if inside { 12.0 } else { 0.3 };
        [light, 0.9 * light, 0.01 * (x + y) as f32 + 0.5 * light]
    }))
}

/// All effects at a third of their strength, before the environment.
fn scene(output: Output) -> Scene {
    Scene {
        yaw_deg: 10.0,
        exposure_stops: 0.3,
        background: Background::Environment,
        output,
        effects: Effects::all(0.3),
        ..Scene::default()
    }
}

struct Set {
    here: Field,
    there: Field,
    weights: LightWeights,
}

impl Set {
    fn new(size: (usize, usize), weight: f32, compute: &ComputeDevice) -> Self {
        let field = noise(size, LAMPS);
        let device = &compute.gpu.as_ref().unwrap().device;
        Self {
            there: Field::Gpu(FieldBuffer::upload(&field, device), compute.passes().unwrap().clone()),
            here: field.into(),
            weights: LightWeights {
                per_lamp: vec![[weight, 0.5 * weight, 0.3 * weight], [0.0; 3], [0.25; 3]],
                uncovered: 0.0,
            },
        }
    }

    /// The picture in memory and on the GPU.
    fn both(&self, scene: &Scene, mask: &Mask, environment: &Environment) -> [Picture; 2] {
        [&self.here, &self.there].map(|field| {
            let ingredients = Ingredients {
                extra: Extra { grain: Some(&Grain { deviation: [[0.03; 3]; 8] }), ..Extra::default() },
                ..Ingredients::new(field, mask, &self.weights, environment)
            };
            compose(scene, &ingredients).unwrap()
        })
    }
}

/// Largest difference of linear light, relative to the value or to middle grey; everything must be finite.
fn apart([here, there]: &[Picture; 2], what: &str) -> f32 {
    let [here, there] = [here, there].map(|p| p.linear.as_ref().expect("linear light"));
    let pairs = here.pixels.iter().flatten().zip(there.pixels.iter().flatten());
    let apart = pairs.map(|(a, b)| {
        assert!(a.is_finite() && b.is_finite(), "{what}: {a}, {b}");
        (a - b).abs() / a.abs().max(0.18)
    });
    apart.fold(0.0, f32::max)
}

/// Largest difference of codes, in 8-bit steps; all must be from 0 to 1.
fn codes_apart([here, there]: &[Picture; 2], what: &str) -> f32 {
    let [here, there] = [here, there].map(|p| &p.display.as_ref().expect("codes").0);
    let pairs = here.pixels.iter().flatten().zip(there.pixels.iter().flatten());
    let apart = pairs.map(|(a, b)| {
        assert!((0.0..=1.0).contains(a) && (0.0..=1.0).contains(b), "{what}: {a}, {b}");
        255.0 * (a - b).abs()
    });
    apart.fold(0.0, f32::max)
}

#[test]
fn pictures_of_odd_sizes_and_mattes_are_alike_in_memory_and_on_a_gpu() {
    let Some((compute, _turn)) = gpu() else { return };
    let environment = window();
    let (mut most, mut codes) = (0.0f32, 0.0f32);
    for size in SIZES {
        let set = Set::new(size, 1.0, &compute);
        for (name, mask) in mattes(size) {
            for background in [Background::Environment, Background::None] {
                let what = format!("{size:?}, matte {name}, {background:?}");
                let variant = |output| Scene { background: background.clone(), ..scene(output) };
                let linear = set.both(&variant(Output::Linear), &mask, &environment);
                let display = set.both(&variant(Output::Display), &mask, &environment);
                let (light, code) = (apart(&linear, &what), codes_apart(&display, &what));
                println!("{what}: {light:.1e}, {code:.2} codes");
                // GPU arc tangents in the background are accurate to 1e-4 of a texel, which shows at the window's edge.
                assert!(light < 1e-3, "{what}: {light}");
                most = most.max(light);
                codes = codes.max(code);
                let empty = name == "empty" && background == Background::None;
                let black = |p: &Picture| p.linear.as_ref().unwrap().pixels.iter().all(|p| *p == [0.0; 3]);
                assert!(!empty || linear.iter().all(black), "{what}");
            }
        }
    }
    shown!(Pictures, "1×1, 1×7, 11×1, 2×3, 13×17, 31×5 and 97×53 with mattes that are empty, full, one pixel or a ramp, all effects on",
        bound: "all finite; a GPU's light within 1e-3 of the value or of middle grey, all codes from 0 to 1",
        measured: format!("{most:.1e}; {codes:.2} codes"));
}

#[test]
fn extreme_light_makes_finite_pictures_in_memory_and_on_a_gpu() {
    let Some((compute, _turn)) = gpu() else { return };
    let size = (23, 19);
    let sun = |value: f32| {
        let mut radiance = Image::filled(64, 32, [0.1; 3]);
        radiance.pixels[15 * 64 + 31] = [value; 3];
        environment(radiance)
    };
    let environments = [
        ("black", environment(Image::filled(64, 32, [0.0; 3]))),
        ("uniform", environment(Image::filled(1, 1, [1.0; 3]))),
        ("one column", environment(Image::from_fn(1, 9, |_, y| [y as f32; 3]))),
        ("a sun of 10⁶", sun(1e6)),
        ("the largest f32", sun(f32::MAX)),
        ("NaN", environment(Image::filled(64, 32, [f32::NAN; 3]))),
    ];
    let mut most = 0.0f32;
    for weight in [0.0, 1e-40, 1.0, 1e6, weights::MOST] {
        let set = Set::new(size, weight, &compute);
        for (light, environment) in &environments {
            for (name, mask) in &mattes(size)[1..3] {
                let what = format!("weight {weight:e}, {light}, matte {name}");
                let linear = set.both(&scene(Output::Linear), mask, environment);
                let light = apart(&linear, &what);
                codes_apart(&set.both(&scene(Output::Display), mask, environment), &what);
                let moderate = weight <= 1e6 && *environment.radiance.pixels[0].first().unwrap() < 1e7;
                if moderate {
                    most = most.max(light);
                }
            }
        }
    }
    shown!(Pictures, "Weights of 0, 10⁻⁴⁰, 10⁶ and the largest, 10²⁵, before black, uniform and NaN environments, suns of 10⁶ and of 3.4·10³⁸",
        bound: "all light finite, all codes from 0 to 1, in memory and on the GPU", measured: format!("holds; apart by {most:.1e} at most"));
}
