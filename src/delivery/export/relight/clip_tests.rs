use super::*;
use compositor::{Field, PlateSquare, Steady};
use exr::prelude::f16;
use imaging::{Image, Mask};
use light::{Environment, Lamp, LightWeights, built_in};
use reflectance::{HalfField, ReflectanceField};
use std::sync::Arc;

/// Working size in pixels along an axis.
const SIZE: usize = 16;
const LAMPS: usize = 9;

fn disc(side: usize) -> Mask {
    Mask::from_fn(side, side, |x, y| {
        let [x, y] = [x, y].map(|i| (2 * i + 1) as f32 / side as f32 - 1.0);
        (6.0 * (0.9 - x.hypot(y))).clamp(0.0, 1.0)
    })
}

/// Lamps that cast hard shadows.
fn field(brightness: f32) -> ReflectanceField {
    let olat = |lamp: usize| {
        Image::from_fn(SIZE, SIZE, |x, y| {
            let place = lamp * 7919 + x / 3 * 104_729 + y / 2 * 1_299_709;
            let light = |dark| if place % 7 < 3 { 0.8 } else { dark };
            [0.01, 0.02, 0.03].map(|dark| brightness * light(dark))
        })
    };
    ReflectanceField::from_olats(&(0..LAMPS).map(olat).collect::<Vec<_>>())
}

fn rig() -> Rig {
    let lamp = |index: usize| Lamp::new(format!("olat_{index}"), Default::default());
    Rig { lamps: (0..LAMPS).map(lamp).collect() }
}

fn plate(side: usize) -> Plate {
    let texture = |x, y| [0.1, 0.3, 0.5].map(|v| v + 0.1 * ((3 * x + 5 * y) % 7) as f32);
    let square = PlateSquare { x: 0.0, y: 0.0, side: side as f32 };
    let light = Image::from_fn(side, side, texture);
    Plate::new(light, disc(side), square, &disc(SIZE)).unwrap()
}

/// Input of a picture, besides its field and its plate.
struct Shot {
    mask: Mask,
    environment: Arc<Environment>,
    weights: LightWeights,
}

impl Shot {
    fn new(turn: usize) -> Self {
        let lit = |lamp: usize| match (lamp + turn) % 3 {
            0 => [0.0; 3],
            1 => [0.02, 0.1, 0.05],
            _ => [9.0, 4.0, 6.0],
        };
        Self {
            mask: disc(SIZE),
            environment: built_in::all()[0].environment(),
            weights: LightWeights { per_lamp: (0..LAMPS).map(lit).collect(), uncovered: 0.0 },
        }
    }

    fn ingredients<'a>(&'a self, field: &'a Field, extra: Extra<'a>) -> Ingredients<'a> {
        Ingredients { extra, ..Ingredients::new(field, &self.mask, &self.weights, &self.environment) }
    }
}

/// Largest difference as a share of the brightest value.
fn missing(sum: &Image, wanted: &Image) -> f32 {
    let wanted = wanted.pixels.as_flattened().iter();
    let brightest = wanted.clone().fold(0f32, |most, v| most.max(v.abs()));
    let pairs = wanted.zip(sum.pixels.as_flattened());
    pairs.fold(0f32, |most, (a, b)| most.max((a - b).abs())) / brightest
}

/// Adds a layer rounded to half floats.
fn add(sum: &mut Image, layer: &Image, weight: [f32; 3]) {
    for (sum, pixel) in sum.pixels.iter_mut().zip(&layer.pixels) {
        (0..3).for_each(|c| sum[c] += weight[c] * f16::from_f32(pixel[c]).to_f32());
    }
}

fn check(scene: &Scene, of: &Ingredients) {
    check_by(scene, of, None);
    // Two lights, one of which shares every lamp with the other.
    let share = |share: f32| of.weights.per_lamp.iter().map(|w| w.map(|w| share * w)).collect();
    let parts = [0.25, 0.75].map(|of| (format!("{of}"), share(of)));
    check_by(scene, of, Some(&parts));
}

fn check_by(scene: &Scene, of: &Ingredients, parts: Option<&[NamedLight]>) {
    let picture = compose(scene, of).unwrap().linear.unwrap();
    let layers = light_layers(scene, of, &rig(), parts).unwrap().with_rest(&picture);
    let subject = layers.subject.as_ref().unwrap();
    let mut sum = Image::filled(subject.width, subject.height, [0.0; 3]);
    for layer in &layers.lamps {
        add(&mut sum, &layer.picture, layer.weight);
    }
    let of_lamps = missing(&sum, subject);
    if let Some(rest) = &layers.rest {
        add(&mut sum, rest, [1.0; 3]);
    }
    let of_all = missing(&sum, &picture);
    assert!(of_lamps <= 1.0 / 2048.0 && of_all <= 1.0 / 1024.0, "{:?} {scene:?}: {of_lamps} {of_all}", picture.size());
}

#[test]
fn layers_add_up_on_every_plate_under_every_light() {
    let mut scene = Scene { exposure_stops: 0.5, output: Output::Linear, ..Scene::default() };
    for turn in 0..3 {
        let shot = Shot::new(turn);
        scene.effects.smoothing = 0.8;
        let darker = Field::from(field(0.9));
        let before = compose(&scene, &shot.ingredients(&darker, Extra::default())).unwrap();
        let before: Option<&Steady> = before.steady.as_ref();
        scene.frame = 1;
        for field in [HalfField::from(&field(1.0)).into(), Field::from(field(1.0))] {
            for plate in [SIZE, 20, 33, 6 * SIZE].map(plate) {
                for background in [Background::None, Background::Environment] {
                    for smoothing in [0.0, 0.8] {
                        scene.background = background.clone();
                        scene.effects.smoothing = smoothing;
                        let plate = Some(&plate);
                        let extra = Extra { plate, before, ..Extra::default() };
                        check(&scene, &shot.ingredients(&field, extra));
                    }
                }
            }
        }
        scene.frame = 0;
    }
}
