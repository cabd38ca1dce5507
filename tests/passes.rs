//! Whole pictures by the GPU, a software one if there is no other, against those by the CPU.

mod mapped;

use afterlight::compositor::{
    Extra, Field, Grain, Ingredients, Pass, Picture, Plate, PlateSquare, Reuse, Steady, compose, compose_reusing,
};
use afterlight::evaluation::flip;
use afterlight::footage::Frame;
use afterlight::gpu::ComputeDevice;
use afterlight::imaging::{Image, Mask};
use afterlight::light::{Environment, Lamp, LightWeights, Rig};
use afterlight::reflectance::{FieldBuffer, ReflectanceField};
use afterlight::scene::{Background, Effects, Output, Scene, ViewTransform};
use afterlight::worker::{PreviewRequest, Source, Worker};
use glam::Vec3;
use mapped::{gpu, mapped_during};
use std::sync::Arc;
use std::time::{Duration, Instant};
use test_support::PATIENCE;

const SIZE: usize = 256;
const LAMPS: usize = 7;

/// A green-rimmed subject before a bright window, in memory and on a GPU.
struct Shoot {
    memory: Field,
    gpu: Field,
    mask: Mask,
    weights: LightWeights,
    environment: Environment,
    grain: Grain,
    /// Plate 1.5 times as wide as the field, and 1.25 times as high.
    plate: Plate,
    /// State of a darker frame.
    before: Option<Steady>,
}

impl Shoot {
    fn new(compute: &ComputeDevice) -> Self {
        let centre = SIZE as f32 / 2.0;
        let from_centre = |x: usize, y: usize| {
            let [x, y] = [x, y].map(|v| v as f32 + 0.5 - centre);
            x.hypot(y) / centre
        };
        let mask = Mask::from_fn(SIZE, SIZE, |x, y| (20.0 * (0.7 - from_centre(x, y))).clamp(0.0, 1.0));
        let olats = |level: f32| -> Vec<Image> {
            let olat = |lamp: usize| {
                Image::from_fn(SIZE, SIZE, |x, y| {
                    let skin = level * (0.3 + 0.1 * ((x / 9 + lamp * y / 7) % 5) as f32);
                    let screen = level * (from_centre(x, y) - 0.62).max(0.0);
                    [skin, 0.8 * skin + 3.0 * screen, 0.6 * skin]
                })
            };
            (0..LAMPS).map(olat).collect()
        };
        let field = ReflectanceField::from_olats(&olats(1.0));
        let gpu = compute.gpu.as_ref().expect("the test was given a GPU");
        let buffer = FieldBuffer::upload(&field, &gpu.device);
        let mut shoot = Self {
            memory: ReflectanceField::from_olats(&olats(0.96)).into(),
            gpu: Field::Gpu(buffer, gpu.passes.clone()),
            weights: LightWeights {
                per_lamp: (0..LAMPS).map(|l| [0.2, 0.1 * l as f32, 0.3]).collect(),
                uncovered: 0.0,
            },
            environment: Environment {
                name: "window".into(),
                radiance: Image::from_fn(256, 128, |x, y| {
                    let window = (118..142).contains(&x) && (40..66).contains(&y);
                    let light = if window { 12.0 } else { 0.3 };
                    [light, 0.9 * light, 0.004 * (x + y) as f32 + 0.5 * light]
                }),
                repaired_texels: 0,
            },
            plate: Self::plate(&mask),
            mask,
            grain: Grain { deviation: [[0.03; 3]; 8] },
            before: None,
        };
        let first = Scene { frame: 0, ..scene() };
        shoot.before = compose(&first, &shoot.ingredients(&shoot.memory)).unwrap().steady;
        shoot.memory = field.into();
        shoot
    }

    fn plate(working: &Mask) -> Plate {
        let (width, height) = (SIZE * 3 / 2, SIZE * 5 / 4);
        let square = PlateSquare { x: 0.125 * width as f32, y: 0.0, side: height as f32 };
        let at = |i: usize, start: f32| {
            let at = (i as f32 - start) * SIZE as f32 / square.side;
            (at.max(0.0) as usize).min(SIZE - 1)
        };
        let matte = Mask::from_fn(width, height, |x, y| working.at(at(x, square.x), at(y, square.y)));
        let fine = |x, y| [0.3 + 0.05 * ((x + 2 * y) % 4) as f32; 3];
        let light = Image::from_fn(width, height, fine);
        Plate::new(light, matte, square, working).unwrap()
    }

    fn ingredients<'a>(&'a self, field: &'a Field) -> Ingredients<'a> {
        Ingredients {
            extra: Extra { before: self.before.as_ref(), grain: Some(&self.grain), ..Extra::default() },
            ..Ingredients::new(field, &self.mask, &self.weights, &self.environment)
        }
    }
}

impl Shoot {
    /// At the plate's size.
    fn on_plate<'a>(&'a self, field: &'a Field) -> Ingredients<'a> {
        let mut ingredients = self.ingredients(field);
        ingredients.extra.plate = Some(&self.plate);
        ingredients
    }
}

/// Every effect that can be combined.
fn scene() -> Scene {
    Scene {
        frame: 1,
        exposure_stops: 0.3,
        background: Background::Environment,
        output: Output::Display,
        effects: Effects {
            smoothing: 0.8,
            despill: 1.0,
            background_blur: 0.02,
            light_wrap: 0.6,
            view: ViewTransform::Filmic,
            grain: 1.0,
            ..Effects::all(0.3)
        },
        ..Scene::default()
    }
}

fn ran(picture: &Picture) -> Vec<&str> {
    let ran = picture.passes.iter().filter(|pass| pass.ran);
    ran.map(|pass| pass.name.as_str()).collect()
}

#[test]
fn a_picture_with_every_effect_looks_as_the_cpu_s() {
    let Some((compute, _turn)) = gpu() else { return };
    let shoot = Shoot::new(&compute);
    let make = |output| {
        let scene = Scene { output, ..scene() };
        [&shoot.memory, &shoot.gpu].map(|field| compose(&scene, &shoot.on_plate(field)).unwrap())
    };
    let [here, there] = make(Output::Display);
    let all = ["predict", "weights", "channels", "difference", "false_color"];
    let all = Pass::ALL.iter().map(|pass| pass.name()).filter(|name| !all.contains(name));
    assert_eq!(ran(&there), all.collect::<Vec<_>>());
    assert_eq!(ran(&here), ran(&there));
    let [seen, there] = [here, there].map(|picture| picture.display.unwrap());
    let map = flip(&seen, &there, flip::PIXELS_PER_DEGREE).unwrap();
    println!("mean FLIP {:.1e}", map.mean);
    assert!(map.mean < 0.01);

    let [here, there] = make(Output::Linear).map(|picture| picture.linear.unwrap());
    let pairs = here.pixels.iter().flatten().zip(there.pixels.iter().flatten());
    // Relative to the value, or to middle grey if that is larger.
    let apart = pairs.map(|(here, there)| (here - there).abs() / here.max(0.18));
    let most = apart.fold(0.0, f32::max);
    println!("largest relative error {most:.1e}");
    // GPU arc tangents in the background are accurate to about 1e-4 of a texel, which shows at the window's edge.
    assert!(most < 1e-3, "{most}");
}

#[test]
fn of_a_picture_with_its_background_nothing_else_is_read_back() {
    let Some((compute, _turn)) = gpu() else { return };
    let shoot = Shoot::new(&compute);
    let timed = compute.gpu.as_ref().unwrap().device.features();
    let clock = if timed.contains(wgpu::Features::TIMESTAMP_QUERY) { 8192 } else { 0 };
    // Counts and times come in the same copy.
    let picture = (16 * SIZE * SIZE + 16 + clock) as u64;
    let plain = Scene { effects: Effects::default(), ..scene() };
    let (made, mapped) = mapped_during(|| compose(&plain, &shoot.ingredients(&shoot.gpu)).unwrap());
    assert_eq!(ran(&made), ["relight", "background", "exposure", "view", "dither"]);
    assert!(made.linear.is_none());
    assert_eq!(mapped, [picture]);

    // An active effect is measured first, on little data, and not again while its input is unchanged.
    let mut reuse = Reuse::default();
    let mut make = |scene: &Scene| {
        let ingredients = shoot.ingredients(&shoot.gpu);
        mapped_during(|| compose_reusing(scene, &ingredients, &mut reuse).unwrap())
    };
    let (_, mapped) = make(&scene());
    let [smoothing, despill, light_wrap, glare, grain, whole] = mapped[..] else {
        panic!("{mapped:?}");
    };
    assert!(smoothing <= 16 * 16_384 && despill <= 1024 && glare <= 1024);
    assert!(light_wrap <= 2 * 16 * 64 * 64 && grain <= 3 * 16 * 40_000);
    assert_eq!(whole, picture);
    let more = Scene { effects: Effects { grain: 2.0, ..scene().effects }, ..scene() };
    let (made, mapped) = make(&more);
    assert!(ran(&made).contains(&"grain"));
    // A frame whose smoothing state is passed on is not measured again.
    assert_eq!(mapped.len(), 2, "{mapped:?}");
    assert_eq!(mapped[1], picture);
}

/// A worker with its only frame on the GPU.
fn worker(shoot: &Shoot, compute: &ComputeDevice) -> Worker {
    let gpu = compute.gpu.clone().unwrap();
    let Field::Memory(olats) = &shoot.memory else { unreachable!("the shoot is made in memory") };
    let (olats, mask) = (olats.clone(), shoot.mask.clone());
    let lamp = |number: usize| {
        let direction = Vec3::new((number as f32).sin(), 0.1, (number as f32).cos());
        Lamp { energy: [0.5; 3], ..Lamp::new(format!("olat_{number:02}"), direction.normalize()) }
    };
    let rig = Rig { lamps: (0..LAMPS).map(lamp).collect() };
    let open = move || {
        let (gpu, olats, mask) = (gpu.clone(), olats.clone(), mask.clone());
        let frame = move |index| {
            let field = FieldBuffer::upload(&olats, &gpu.device);
            let frame = Frame { index, plate: Image::filled(SIZE, SIZE, [0.2; 3]), mask: mask.clone() };
            Ok((frame, Field::Gpu(field, gpu.passes.clone())).into())
        };
        Ok(Source {
            rig: rig.clone(),
            device: "GPU of the test".to_owned(),
            later: None,
            comparison: Box::new(|_, _| unreachable!("nothing is compared")),
            predict: Box::new(frame),
        })
    };
    // A drag without a pause.
    Worker::within(f64::MAX, Duration::MAX, open, || {})
}

#[test]
fn in_a_drag_of_the_yaw_nothing_is_read_back() {
    let Some((compute, _turn)) = gpu() else { return };
    let shoot = Shoot::new(&compute);
    let worker = worker(&shoot, &compute);
    let environment = Arc::new(shoot.environment.clone());
    let show = |yaw_deg: f32, texture: bool| {
        worker.show(PreviewRequest {
            scene: Scene { yaw_deg, background: Background::Environment, ..Scene::default() },
            environment: environment.clone(),
            first: None,
            second: None,
            looks: Default::default(),
            solo: Vec::new(),
            table: None,
            frame_rate: 24.0,
            moving: texture,
            texture,
        });
        let started = Instant::now();
        loop {
            if let Some(relit) = worker.relit()
                && relit.scene.yaw_deg == yaw_deg
                && relit.rgb.is_empty() == texture
            {
                return relit;
            }
            assert!(started.elapsed() < PATIENCE, "no picture at {yaw_deg}");
            std::thread::sleep(Duration::from_millis(1));
        }
    };
    show(0.0, false);
    let yaws = (1..=20).map(|step| 9.0 * step as f32);
    let (dragged, mapped) = mapped_during(|| -> Vec<_> { yaws.clone().map(|yaw_deg| show(yaw_deg, true)).collect() });
    assert_eq!(mapped, [0; 0]);
    for relit in &dragged {
        assert!(relit.texture.is_some() && relit.linear.is_none());
        let relight = &relit.passes[Pass::Relight as usize];
        assert!(relight.ran, "{relight:?}");
    }
    // After the release, the existing picture is read once, and it equals the one without a drag.
    let (rested, mapped) = mapped_during(|| show(180.0, false));
    assert_eq!(mapped.len(), 1, "{mapped:?}");
    let relight = &rested.passes[Pass::Relight as usize];
    assert!(relight.ran, "it is the same picture: {relight:?}");
    show(0.0, false);
    let again = show(180.0, false);
    assert_eq!(again.rgb, rested.rgb);
}
