use super::*;
use crate::reference::SOLID;
use crate::{CameraView, Facts};
use imaging::color::linear_from_srgb;
use imaging::{Image, Mask, Raster};
use light::{Environment, LightWeights};
use reflectance::ReflectanceField;
use scene::{Background, BackgroundFile, Output};

pub struct Set {
    pub field: Field,
    pub mask: Mask,
    pub weights: LightWeights,
    pub environment: Environment,
}

/// Matte of a disc with a soft edge.
pub fn disc(size: usize) -> Mask {
    let centre = size as f32 / 2.0;
    Raster::from_fn(size, size, |x, y| {
        let r = (x as f32 + 0.5 - centre).hypot(y as f32 + 0.5 - centre);
        (0.7 * centre - r + 0.5).clamp(0.0, 1.0)
    })
}

impl Set {
    /// Disc with a soft edge under three lamps, in front of a ramp.
    pub fn new(size: usize) -> Self {
        let mask = disc(size);
        let olats: Vec<Image> =
            (1..4).map(|l| Raster::from_fn(size, size, |x, y| [mask.at(x, y) * (x + l) as f32 / 40.0; 3])).collect();
        Self {
            field: ReflectanceField::from_olats(&olats).into(),
            mask,
            weights: LightWeights { per_lamp: vec![[0.4, 0.5, 0.6], [0.0; 3], [1.0; 3]], uncovered: 0.0 },
            environment: Environment {
                name: "ramp".into(),
                radiance: Raster::from_fn(64, 32, |x, y| [x as f32 / 64.0, y as f32 / 32.0, 0.25]),
                repaired_texels: 0,
            },
        }
    }

    pub fn ingredients(&self) -> Ingredients<'_> {
        Ingredients::new(&self.field, &self.mask, &self.weights, &self.environment)
    }
}

impl Picture {
    /// The linear light of a picture, which must exist.
    pub fn light(&self) -> &Image {
        self.linear.as_ref().expect("a picture with linear light")
    }
}

pub fn scene(background: Background, output: Output, exposure_stops: f32) -> Scene {
    Scene { frame: 0, yaw_deg: 20.0, exposure_stops, background, output, ..Scene::default() }
}

pub fn largest_difference(a: &Image, b: &Image) -> f32 {
    a.pixels.iter().flatten().zip(b.pixels.iter().flatten()).map(|(x, y)| (x - y).abs()).fold(0.0, f32::max)
}

#[test]
fn what_was_skipped_would_not_have_changed_the_picture() {
    let set = Set::new(24);
    for background in [Background::None, Background::Environment] {
        for stops in [0.0, 1.5] {
            let scene = scene(background.clone(), Output::Display, stops);
            let planned = compose(&scene, &set.ingredients()).unwrap();
            let facts = Facts {
                field_cached: false,
                weights_cached: false,
                lamps: 3,
                lit_lamps: 3,
                open_share: 1.0,
                ..Facts::default()
            };
            let mut forced = plan(&scene, &facts);
            forced.iter_mut().for_each(|p| p.run = true);
            let forced = execute(&scene, &set.ingredients(), &forced).unwrap();
            assert_eq!(planned.linear, forced.linear);
            assert_eq!(planned.alpha, forced.alpha);
            // Dither is the only pass on codes here: less than half a step of 8 bits.
            let (a, b) = (planned.display.unwrap().0, forced.display.unwrap().0);
            assert!(largest_difference(&a, &b) <= 0.501 / 255.0);
        }
    }
}

#[test]
fn an_edge_in_front_of_its_own_colour_cannot_be_seen() {
    // Subject and world both have radiance 1: a fringe would differ.
    let mut set = Set::new(32);
    for premultiplied in [true, false] {
        let light = set.mask.map(|a| if premultiplied { [a; 3] } else { [f32::from(u8::from(a > 0.0)); 3] });
        set.field = ReflectanceField::from_olats(&[light]).into();
        set.weights.per_lamp = vec![[1.0; 3]];
        set.environment.radiance = Image::filled(8, 4, [1.0; 3]);
        let picture = compose(&scene(Background::Environment, Output::Linear, 0.0), &set.ingredients()).unwrap();
        // A pixel that counts as solid may be darker by its missing coverage, once as shot and once as laid.
        let bound = if premultiplied { 2.0 * (1.0 - SOLID) } else { 1e-5 };
        assert!(picture.light().pixels.iter().flatten().all(|v| (v - 1.0).abs() <= bound));
        assert!(picture.display.is_none());
    }
}

#[test]
fn a_cut_out_is_premultiplied_and_keeps_the_matte() {
    let set = Set::new(32);
    let picture = compose(&scene(Background::None, Output::Linear, 0.0), &set.ingredients()).unwrap();
    assert_eq!(picture.alpha, set.mask);
    for (pixel, alpha) in picture.light().pixels.iter().zip(&set.mask.pixels) {
        assert!(*alpha > 0.0 || *pixel == [0.0; 3]);
    }
}

#[test]
fn a_turn_and_a_whole_turn_more_give_one_picture() {
    let set = Set::new(16);
    let at = |yaw_deg| {
        let scene = Scene { yaw_deg, ..scene(Background::Environment, Output::Display, 0.0) };
        compose(&scene, &set.ingredients()).unwrap().light().clone()
    };
    assert_eq!(at(33.0), at(393.0));
    assert_ne!(at(33.0), at(63.0));
    test_support::shown!(Pictures, "The background after a full turn",
 bound: "the same bits", measured: "the same bits");
}

#[test]
fn hard_inputs_give_finite_pictures() {
    for size in [1, 16] {
        for alpha in [0.0, 0.5, 1.0] {
            let mut set = Set::new(size);
            set.mask = Mask::filled(size, size, alpha);
            set.weights.per_lamp = vec![[1e6; 3], [0.0; 3], [-0.0; 3]];
            if let Field::Memory(field) = &mut set.field {
                field.values[0] = f32::NAN;
            }
            for output in [Output::Display, Output::Linear] {
                let picture = compose(&scene(Background::Environment, output, 2.0), &set.ingredients()).unwrap();
                assert!(picture.light().pixels.iter().flatten().all(|v| v.is_finite()));
            }
        }
    }
    test_support::shown!(Pictures, "Weights of 10⁶ and NaN in the field, mattes that are empty, half and full, 1×1 and 16×16",
 bound: "all light finite", measured: "holds");
}

#[test]
fn no_light_leaves_the_subject_black_and_says_why() {
    let mut set = Set::new(16);
    set.weights.per_lamp = vec![[0.0; 3]; 3];
    let picture = compose(&scene(Background::None, Output::Display, 0.0), &set.ingredients()).unwrap();
    assert!(picture.light().pixels.iter().all(|&p| p == [0.0; 3]));
    let relight = picture.passes.iter().find(|p| p.name == "relight").unwrap();
    assert!(!relight.ran && relight.ms == Some(0.0) && relight.reason.contains("no lamp"));
}

#[test]
fn what_does_not_fit_is_refused() {
    let mut set = Set::new(16);
    set.weights.per_lamp.pop();
    let scene = scene(Background::None, Output::Linear, 0.0);
    assert!(compose(&scene, &set.ingredients()).unwrap_err().to_string().contains("weights for 2"));
    let mut set = Set::new(16);
    set.mask = Mask::filled(8, 16, 1.0);
    assert!(compose(&scene, &set.ingredients()).is_err());
    let set = Set::new(16);
    let view = CameraView { vertical_fov_deg: f32::NAN };
    assert!(compose(&scene, &Ingredients { view, ..set.ingredients() }).is_err());
}

#[test]
fn plate_colour_and_checker_stand_behind_the_subject_and_follow_their_frame() {
    let mut set = Set::new(32);
    let bare = |set: &Set| compose(&scene(Background::None, Output::Linear, 0.0), &set.ingredients()).unwrap();
    let plates = [0.25, 0.5].map(|red| Image::from_fn(32, 32, |x, y| [red, x as f32, y as f32]));
    let half = linear_from_srgb(128.0 / 255.0);
    let mut reuse = Reuse::default();
    let file = |offset, scale, exposure_stops| {
        let new = BackgroundFile::new("street.mov");
        Background::File(BackgroundFile { offset, scale, exposure_stops, ..new })
    };
    // Frames, lights and backgrounds change one after the other.
    for (frame, light, background) in [
        (0, 1.0, Background::Plate),
        (0, 2.0, Background::Plate),
        (1, 2.0, Background::Plate),
        (1, 2.0, Background::Color([128, 0, 255])),
        (1, 1.0, Background::Checker),
        (1, 1.0, Background::Color([0, 0, 0])),
        (1, 1.0, file([0.0; 2], 1.0, 1.0)),
        (0, 2.0, file([0.0; 2], 1.0, 1.0)),
        (0, 2.0, file([0.25, -0.5], 1.0, 0.0)),
        (0, 2.0, file([0.0; 2], 0.5, 0.0)),
    ] {
        set.weights.per_lamp[2] = [light; 3];
        let mut ingredients = set.ingredients();
        ingredients.extra.filmed = Some(&plates[frame]);
        ingredients.extra.behind = Some(&plates[frame]);
        ingredients.extra.identity.frame = frame as u64 + 1;
        ingredients.extra.identity.behind = ingredients.extra.identity.frame;
        // Light around the subject does not reach a background of one's own.
        ingredients.levels.background = light;
        let made = scene(background.clone(), Output::Linear, 0.0);
        let made = compose_reusing(&made, &ingredients, &mut reuse).unwrap();
        let filmed = |x: i32, y: i32| {
            if (0..32).contains(&x) && (0..32).contains(&y) {
                plates[frame].at(x as usize, y as usize)
            } else {
                [0.0; 3]
            }
        };
        let behind = |p: usize| match &background {
            Background::File(placed) => {
                let (x, y) = ((p % 32) as i32, (p / 32) as i32);
                if placed.scale < 1.0 {
                    // Four pixels of the file lie in each, from the eighth row and column on.
                    let (x, y) = (2 * x - 16, 2 * y - 16);
                    let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(i, j)| filmed(x + i, y + j));
                    return std::array::from_fn(|c| four.iter().map(|v| v[c]).sum::<f32>() / 4.0);
                }
                let at = filmed(x - (32.0 * placed.offset[0]) as i32, y + (32.0 * placed.offset[1]) as i32);
                at.map(|light| light * placed.exposure_stops.exp2())
            }
            Background::Plate => plates[frame].pixels[p],
            Background::Color([128, ..]) => [half, 0.0, 1.0],
            Background::Checker if (p % 32 / 2 + p / 64).is_multiple_of(2) => [0.1; 3],
            Background::Checker => [0.2; 3],
            _ => [0.0; 3],
        };
        let bare = bare(&set);
        for (p, pixel) in made.light().pixels.iter().enumerate() {
            for c in 0..3 {
                let expected = bare.light().pixels[p][c] + (1.0 - set.mask.pixels[p]) * behind(p)[c];
                assert!((pixel[c] - expected).abs() < 1e-4, "{background:?}: {pixel:?}");
            }
        }
        assert!(made.alpha.pixels.iter().all(|alpha| *alpha == 1.0));
    }
    // A picture whose frame or file was not handed over has nothing behind it.
    for background in [Background::Plate, file([0.0; 2], 1.0, 0.0)] {
        let made = scene(background, Output::Linear, 0.0);
        let made = compose(&made, &set.ingredients()).unwrap();
        assert_eq!(made.light(), bare(&set).light());
    }
}
