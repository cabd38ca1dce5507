use super::*;
use crate::compose::tests::{Set, disc, scene};
use crate::passes::agreement_tests::on_every_size;
use crate::{Extra, Field, Ingredients, compose};
use imaging::Raster;
use imaging::resample::resize;
use reflectance::ReflectanceField;
use scene::{Background, Output};

/// Pixels of the working size along an axis.
const SIZE: usize = 16;

/// Stripes under every lamp, as bright as the lamp; none while they are being read.
#[derive(Debug)]
struct Stripes(Option<(usize, usize)>);

impl FineLight for Stripes {
    fn is_ready(&self) -> bool {
        self.0.is_some()
    }

    fn ratio(&self, weights: &[[f32; 3]]) -> Option<Image> {
        let (width, height) = self.0?;
        let stripe = |x: usize, lamp: usize| ((x + lamp) % 3) as f32 - 1.0;
        let light = |x: usize, c: usize| -> f32 {
            let lamps = weights.iter().enumerate();
            lamps.map(|(lamp, weight)| weight[c] * stripe(x, lamp)).sum()
        };
        Some(Raster::from_fn(width, height, |x, _| [0, 1, 2].map(|c| light(x, c))))
    }

    fn bytes(&self) -> usize {
        7
    }
}

fn whole(side: usize) -> PlateSquare {
    PlateSquare { x: 0.0, y: 0.0, side: side as f32 }
}

/// A subject with texture finer than the working size, and what a light makes of it.
fn albedo(x: usize, y: usize) -> [f32; 3] {
    let fine = ((x * 7919 + y * 104_729) % 101) as f32 / 101.0;
    let stripe = if (x / 3 + y / 5).is_multiple_of(2) { 0.9 } else { 0.3 };
    [0.2 + 0.6 * fine, stripe, 0.5 * stripe + 0.3 * fine]
}

/// Smooth light from a side; `turn` is where from.
fn light(x: usize, y: usize, side: usize, turn: f32) -> f32 {
    let at = |i: usize| (i as f32 + 0.5) / side as f32 - 0.5;
    let across = at(x) * turn.cos() + at(y) * turn.sin();
    1.0 + 0.8 * across + 0.2 * (5.0 * across).sin()
}

struct Shot {
    plate: Image,
    matte: Mask,
    working: Mask,
    truth: Image,
    relit: Image,
}

impl Shot {
    /// A plate of `factor` times the working size in even light, and its truth in light from a side; `relit` is that
    /// truth at the working size, premultiplied.
    fn new(factor: usize, turn: f32) -> Self {
        Self::with_side(factor * SIZE, turn)
    }

    /// The same for a plate of any size.
    fn with_side(side: usize, turn: f32) -> Self {
        let matte = disc(side);
        let plate = Raster::from_fn(side, side, albedo);
        let truth = Raster::from_fn(side, side, |x, y| albedo(x, y).map(|v| v * light(x, y, side, turn)));
        let working = resize_area(&matte, SIZE, SIZE);
        let relit = summed(&truth, &matte, &working);
        Self { working, plate, matte, truth, relit }
    }

    fn plate(&self) -> Plate {
        let (plate, matte) = (self.plate.clone(), self.matte.clone());
        Plate::new(plate, matte, whole(self.matte.width), &self.working).unwrap()
    }
}

/// A subject at the working size, as the pass `relight` leaves it.
fn summed(subject: &Image, matte: &Mask, working: &Mask) -> Image {
    let mut relit = resize_area(&covered(subject, matte), SIZE, SIZE);
    let straight = relit.pixels.iter_mut().zip(&working.pixels);
    straight.filter(|(_, alpha)| **alpha > 0.0).for_each(|(pixel, alpha)| *pixel = pixel.map(|v| v / alpha));
    extend_edges(&mut relit, working);
    covered(&relit, working)
}

fn covered(image: &Image, matte: &Mask) -> Image {
    let mut image = image.clone();
    let pixels = image.pixels.iter_mut().zip(&matte.pixels);
    pixels.for_each(|(pixel, alpha)| *pixel = pixel.map(|v| v * alpha));
    image
}

/// Root mean square of the difference where the matte is solid.
fn error(picture: &Image, truth: &Image, matte: &Mask) -> f64 {
    let solid = |i: &usize| matte.pixels[*i] >= 1.0;
    let pixels: Vec<usize> = (0..matte.pixels.len()).filter(solid).collect();
    let square = |i: &usize| {
        let (a, b) = (picture.pixels[*i], truth.pixels[*i]);
        (0..3).map(|c| f64::from(a[c] - b[c]).powi(2)).sum::<f64>()
    };
    (pixels.iter().map(square).sum::<f64>() / pixels.len() as f64).sqrt()
}

#[test]
fn detail_comes_from_the_plate_and_light_from_the_sum() {
    for side in [17, 20, 23, 2 * SIZE, 53, 4 * SIZE, 8 * SIZE] {
        let shot = Shot::with_side(side, 0.7);
        let picture = shot.plate().relit(&shot.relit, &shot.working);
        let enlarged = resize(&shot.relit, side, side);
        let [ours, plain] = [&picture, &enlarged].map(|p| error(p, &shot.truth, &shot.matte));
        println!("{side}: {ours:.4}, enlarged {plain:.4}");
        assert!(ours < 0.15 * plain, "{side}: {ours} {plain}");
    }
}

#[test]
fn what_was_summed_is_the_mean_of_what_is_shown() {
    let shot = Shot::new(4, 2.0);
    let picture = shot.plate().relit(&shot.relit, &shot.working);
    let mean = resize_area(&picture, SIZE, SIZE);
    for (i, (mean, relit)) in mean.pixels.iter().zip(&shot.relit.pixels).enumerate() {
        // At the edge the plate takes the colour of the solid subject, which differs from what was summed there.
        let solid = shot.working.pixels[i] >= 1.0;
        let apart = |c: usize| (mean[c] - relit[c]).abs();
        assert!(!solid || (0..3).all(|c| apart(c) < 0.03 * relit[c] + 1e-4), "{i}: {mean:?} {relit:?}");
    }
}

#[test]
fn its_own_light_gives_the_plate_back_bright_and_dark() {
    let mut worst = 0f32;
    for side in [17, 2 * SIZE, 53, 8 * SIZE] {
        let mut shot = Shot::with_side(side, 0.7);
        // Highlights at 6 beside shadows down to a thousandth, where the matte is solid as far as the cubic reaches.
        let across = |i: usize| (i as f32 + 0.5) / side as f32;
        let shade = |x: usize| [6.0, 1.0, 0.1, 0.03][(10.0 * across(x) - 3.0).clamp(0.0, 3.0) as usize];
        shot.plate = Raster::from_fn(side, side, |x, y| albedo(x, y).map(|v| v.max(0.05) * shade(x)));
        let own = summed(&shot.plate, &shot.matte, &shot.working);
        let picture = shot.plate().relit(&own, &shot.working);
        for (i, (shown, filmed)) in picture.pixels.iter().zip(&shot.plate.pixels).enumerate() {
            let (x, y) = (across(i % side), across(i / side));
            if (x - 0.5).hypot(y - 0.5) < 0.2 {
                let off = |c: usize| (shown[c] - filmed[c]).abs() / filmed[c].max(0.01);
                worst = (0..3).map(off).fold(worst, f32::max);
            }
        }
    }
    // Rounding of f32, times the contrast of neighbours: 1000 and more.
    assert!(worst < 1e-3, "{worst}");
}

#[test]
fn even_light_changes_every_pixel_alike_whatever_is_at_the_edge() {
    // A dark subject, bright things thinner than a pixel of the working size around it, and holes.
    let side = 8 * SIZE;
    let inside = |x: usize, y: usize| (30..90).contains(&x) && (20..110).contains(&y);
    let thin = |x: usize, y: usize| (x + y) % 23 < 3 && (18..110).contains(&x) && y > 10;
    let matte = Mask::from_fn(side, side, |x, y| f32::from(inside(x, y) || thin(x, y)));
    let plate =
        Raster::from_fn(side, side, |x, y| if inside(x, y) { albedo(x, y).map(|v| 0.1 * v) } else { [0.9, 0.8, 0.2] });
    let working = resize_area(&matte, SIZE, SIZE);
    let half = plate.map(|pixel| pixel.map(|v| 0.5 * v));
    let relit = summed(&half, &matte, &working);
    let prepared = Plate::new(plate.clone(), matte.clone(), whole(side), &working).unwrap();
    let picture = prepared.relit(&relit, &working);
    let mut worst = 0f32;
    for (i, pixel) in picture.pixels.iter().enumerate() {
        let wanted = plate.pixels[i].map(|v| 0.5 * v * matte.pixels[i]);
        let apart = |c: usize| (pixel[c] - wanted[c]).abs();
        worst = (0..3).map(apart).fold(worst, f32::max);
        // The floor is a hundredth of the mean.
        let fine = |c: usize| apart(c) <= 0.05 * wanted[c] + 0.004;
        assert!((0..3).all(fine), "{i}: {pixel:?} {wanted:?}");
    }
    test_support::shown!(
        Pictures,
        "Something thinner than a pixel of the network at the subject's edge",
        bound: "5 % under even light",
        measured: format!("off by {worst:.4} of white"),
    );
}

#[test]
fn pictures_of_lamps_add_up_at_every_size_as_half_floats_keep_them() {
    // Hard shadows, beside which the cubic swings below zero.
    let lamp = |lamp: usize| {
        Raster::from_fn(SIZE, SIZE, |x, y| {
            let place = lamp * 7919 + x / 3 * 104_729 + y / 2 * 1_299_709;
            [0.01, 0.02, 0.03].map(|dark| if place % 7 < 3 { 1.0 } else { dark })
        })
    };
    let mut least = 0f32;
    for side in [SIZE + 1, 20, 2 * SIZE, 53, 8 * SIZE] {
        let shot = Shot::with_side(side, 0.7);
        for plate in [shot.plate(), shot.plate().shrunk(2)] {
            let mut lit = Image::filled(SIZE, SIZE, [0.0; 3]);
            let mut added = vec![[0f32; 3]; plate.matte.pixels.len()];
            for index in 0..41 {
                let weight = [0.3 * (index % 5) as f32, 0.1, 1.0 / (1.0 + index as f32)];
                let alone = covered(&lamp(index), &shot.working);
                let layer = plate.relit(&alone, &shot.working);
                for (sum, pixel) in lit.pixels.iter_mut().zip(&alone.pixels) {
                    (0..3).for_each(|c| sum[c] += weight[c] * pixel[c]);
                }
                for (sum, pixel) in added.iter_mut().zip(&layer.pixels) {
                    let kept = pixel.map(|v| f16::from_f32(v).to_f32());
                    (0..3).for_each(|c| sum[c] += weight[c] * kept[c]);
                    least = pixel.iter().fold(least, |least, v| least.min(*v));
                }
            }
            let picture = plate.relit(&lit, &shot.working);
            let values = picture.pixels.as_flattened().iter();
            let brightest = values.clone().fold(0f32, |most, v| most.max(*v));
            let apart = values.zip(added.as_flattened()).fold(0f32, |most, (a, b)| most.max((a - b).abs()));
            assert!(apart <= brightest / 2048.0, "{side}: {apart} of {brightest}");
        }
    }
    assert!(least < -0.01, "{least}: a clamp would not show");
}

#[test]
fn the_square_may_be_anywhere_and_its_edge_goes_on() {
    let shot = Shot::new(4, 0.7);
    let inner = shot.plate().relit(&shot.relit, &shot.working);
    let (side, (x0, y0)) = (shot.matte.width, (9, 4));
    let (width, height) = (side + 30, side + 20);
    let inside = |x: usize, y: usize| {
        let (x, y) = (x.checked_sub(x0)?, y.checked_sub(y0)?);
        (x < side && y < side).then_some((x, y))
    };
    let plate = Raster::from_fn(width, height, |x, y| inside(x, y).map_or([0.5; 3], |(x, y)| shot.plate.at(x, y)));
    // The subject goes on to the plate's lower edge.
    let matte = Raster::from_fn(width, height, |x, y| match inside(x, y) {
        Some((x, y)) => shot.matte.at(x, y),
        None => f32::from(y >= y0 + side),
    });
    let square = PlateSquare { x: x0 as f32, y: y0 as f32, side: side as f32 };
    let large = Plate::new(plate, matte, square, &shot.working).unwrap();
    assert!(large.is_larger((SIZE, SIZE)) && large.is_larger((side, side)));
    let picture = large.relit(&shot.relit, &shot.working);
    for (x, y) in [(30, 30), (20, 40), (40, 12)] {
        let (here, there) = (picture.at(x + x0, y + y0), inner.at(x, y));
        // The floor is a share of the mean of all of the subject.
        assert!((0..3).all(|c| (here[c] - there[c]).abs() < 0.02 * there[c]), "{here:?} {there:?}");
    }
    let below = picture.at(x0 + side / 2, height - 1);
    assert!(below.iter().all(|v| *v > 0.05), "{below:?}");
}

#[test]
fn no_plate_makes_what_is_not_finite() {
    let shot = Shot::new(2, 0.7);
    let side = shot.matte.width;
    let mut holes = shot.plate.clone();
    holes.pixels[side * side / 2 + 3] = [f32::NAN, 1.0, f32::INFINITY];
    holes.pixels[side * side / 2 + 4] = [-1.0; 3];
    let black = Image::filled(side, side, [0.0; 3]);
    let open = Mask::filled(side, side, 0.0);
    let all = Mask::filled(side, side, 1.0);
    for plate in [&holes, &black, &shot.plate] {
        for matte in [&open, &all, &shot.matte] {
            for working in [shot.working.clone(), Mask::filled(SIZE, SIZE, 0.0), Mask::filled(SIZE, SIZE, 1.0)] {
                for square in [whole(side), PlateSquare { x: -100.0, y: 7.5, side: 3.0 }] {
                    let plate = Plate::new(plate.clone(), matte.clone(), square, &working).unwrap();
                    let picture = plate.relit(&shot.relit, &working);
                    let fine = |v: &f32| v.abs() < 1e4;
                    assert!(picture.pixels.iter().flatten().all(fine));
                    let small = plate.shrunk(3).relit(&shot.relit, &working);
                    assert!(small.pixels.iter().flatten().all(fine));
                }
            }
        }
    }
    let odd = Mask::filled(SIZE, SIZE + 1, 1.0);
    for (square, working) in [(whole(side), &odd), (whole(0), &shot.working)] {
        let refused = Plate::new(shot.plate.clone(), all.clone(), square, working);
        assert!(refused.unwrap_err().to_string().contains("do not belong together"));
    }
}

#[test]
fn a_shrunk_plate_is_the_picture_shrunk() {
    let shot = Shot::new(8, 0.7);
    let plate = shot.plate();
    let small = plate.shrunk(4);
    assert_eq!(small.size(), (2 * SIZE, 2 * SIZE));
    let picture = resize_area(&plate.relit(&shot.relit, &shot.working), 2 * SIZE, 2 * SIZE);
    let small = small.relit(&shot.relit, &shot.working);
    assert!(error(&small, &picture, &resize_area(&shot.matte, 2 * SIZE, 2 * SIZE)) < 0.02);
}

/// A disc's plate of so many columns and rows.
fn disc_plate(side: usize, working: &Mask) -> Plate {
    let picture = Raster::from_fn(side, side, albedo);
    Plate::new(picture, disc(side), whole(side), working).unwrap()
}

#[test]
fn a_composed_picture_has_the_plate_s_size_and_says_so() {
    let set = Set::new(SIZE);
    let side = 5 * SIZE;
    let plate = disc_plate(side, &set.mask);
    let with = |plate| Ingredients { extra: Extra { plate, ..Extra::default() }, ..set.ingredients() };
    let said = |picture: &crate::Picture| picture.passes[Pass::Plate as usize].clone();
    for background in [Background::Environment, Background::None] {
        let scene = scene(background, Output::Display, 0.0);
        let large = compose(&scene, &with(Some(&plate))).unwrap();
        assert_eq!(large.alpha.size(), (side, side));
        assert_eq!(large.display.as_ref().unwrap().0.size(), (side, side));
        assert!(said(&large).ran && said(&large).reason.contains("80 × 80"));
        let small = compose(&scene, &with(None)).unwrap();
        assert_eq!(small.alpha.size(), (SIZE, SIZE));
        assert!(!said(&small).ran);
    }
    let same = Plate::new(Raster::from_fn(SIZE, SIZE, albedo), set.mask.clone(), whole(SIZE), &set.mask).unwrap();
    let scene = scene(Background::Environment, Output::Display, 0.0);
    let plain = compose(&scene, &with(None)).unwrap();
    let shown = compose(&scene, &with(Some(&same))).unwrap();
    assert_eq!(said(&shown).reason, "the picture is as large as the plate");
    assert_eq!(shown.display, plain.display);
}

#[test]
fn fine_light_is_added_once_it_is_there() {
    let set = Set::new(SIZE);
    let side = 3 * SIZE;
    let plate = disc_plate(side, &set.mask);
    let fine = |size| plate.clone().with_fine_light(Arc::new(Stripes(size)));
    assert_eq!(fine(None).bytes(), plate.bytes() + 7);
    let scene = scene(Background::None, Output::Linear, 0.0);
    let made = |plate: &Plate, draft: bool| {
        let extra = Extra { plate: Some(plate), draft, ..Extra::default() };
        compose(&scene, &Ingredients { extra, ..set.ingredients() }).unwrap()
    };
    let picture = |plate: &Plate| made(plate, false);
    let reason = |picture: &crate::Picture| picture.passes[Pass::Plate as usize].reason.clone();
    let plain = picture(&plate);
    let waiting = picture(&fine(None));
    assert_eq!(waiting.linear, plain.linear);
    assert!(!reason(&waiting).contains("fine shadows"));
    let lit = picture(&fine(Some((side, side))));
    assert!(reason(&lit).contains("fine shadows"));
    // Stripes of no mean: pixels change, the whole hardly.
    let sum = |picture: &crate::Picture| {
        let linear = picture.linear.as_ref().unwrap();
        linear.pixels.iter().map(|pixel| f64::from(pixel[1])).sum::<f64>()
    };
    assert_ne!(lit.linear, plain.linear);
    assert!((sum(&lit) / sum(&plain) - 1.0).abs() < 0.05);
    // A draft has to be there soon, and so has a stand-in.
    let draft = made(&fine(Some((side, side))), true);
    assert_eq!(draft.linear, plain.linear);
    assert!(!reason(&draft).contains("fine shadows"));
    assert!(!fine(Some((side, side))).shrunk(2).has_fine_light());
}

#[test]
fn what_has_no_detail_is_enlarged() {
    let shot = Shot::new(4, 0.7);
    let even = shot.plate().without_detail(&shot.working).unwrap();
    let smooth = Raster::from_fn(SIZE, SIZE, |x, y| [light(x, y, SIZE, 0.7), 0.5, 2.0]);
    let relit = covered(&smooth, &shot.working);
    let picture = even.relit(&relit, &shot.working);
    let side = 4 * SIZE;
    assert_eq!(picture.size(), (side, side));
    let mean = resize_area(&picture, SIZE, SIZE);
    let covered = resize_area(&even.matte, SIZE, SIZE);
    assert!(covered.pixels.iter().any(|&a| a >= 1.0));
    for (i, (mean, relit)) in mean.pixels.iter().zip(&relit.pixels).enumerate() {
        let solid = covered.pixels[i] >= 1.0;
        assert!(!solid || (0..3).all(|c| (mean[c] - relit[c]).abs() < 0.05 * relit[c]));
    }
    assert_eq!(shot.plate().filmed().size(), (side, side));
    assert_eq!(shot.plate().working_pixel([7, 13]), Some([1, 3]));
    let corner = PlateSquare { x: 2.0, ..whole(side) };
    let moved = Plate::new(shot.plate.clone(), shot.matte.clone(), corner, &shot.working).unwrap();
    assert_eq!(moved.working_pixel([1, 5]), None);
}

#[test]
fn a_gpu_makes_the_same_of_a_plate() {
    on_every_size(|set| {
        let (width, height) = set.image.size();
        let working = disc(SIZE);
        let relit = covered(
            &Raster::from_fn(SIZE, SIZE, |x, y| {
                let shadow = f32::from((x / 3 + y / 2) % 3 > 0);
                [light(x, y, SIZE, 0.4), 0.5 * shadow, 2.0 * shadow]
            }),
            &working,
        );
        let square = PlateSquare { x: 0.25 * width as f32, y: -3.0, side: 0.8 * width as f32 };
        let plate = Plate::new(set.image.clone(), set.mask.clone(), square, &working).unwrap();
        let here = plate.relit(&relit, &working);
        let subject = set.passes.upload(&relit, &working).unwrap();
        let on_gpu = set.passes.upload_plate(&plate).unwrap();
        let there = set.there(|recording| recording.plate(&subject, &on_gpu));
        assert_eq!(here.size(), (width, height));
        set.assert_same("plate", &there, &here, 1e-4);
        let fine = plate.with_fine_light(Arc::new(Stripes(Some((width, height)))));
        let weights = [[0.3, 0.2, 0.1], [0.5, -0.1, 0.4]];
        let here = fine.relit_by(&relit, &working, &weights);
        let light = fine.fine_light(&weights).unwrap();
        let light = set.passes.upload_opaque(&light).unwrap();
        let there = set.there(|recording| {
            let subject = recording.plate(&subject, &on_gpu)?;
            recording.add_light(&subject, &light)
        });
        set.assert_same("fine light", &there, &here, 1e-4);
    });
}

#[test]
fn a_picture_of_a_field_on_a_gpu_is_that_of_memory() {
    use crate::passes::relight::tests::any_device;
    let Some((device, queue)) = any_device() else { return };
    let set = Set::new(SIZE);
    let Field::Memory(field) = &set.field else { unreachable!("a set's field is in memory") };
    let passes = Arc::new(PicturePasses::new(&device, &queue));
    let field: &ReflectanceField = field;
    let on_gpu = Field::Gpu(reflectance::FieldBuffer::upload(field, &device), passes);
    let plate = Plate::new(
        Raster::from_fn(90, 160, albedo),
        Mask::from_fn(90, 160, |x, y| disc(160).at(x + 35, y)),
        PlateSquare { x: -35.0, y: 0.0, side: 160.0 },
        &set.mask,
    )
    .unwrap()
    .with_fine_light(Arc::new(Stripes(Some((90, 160)))));
    for background in [Background::Environment, Background::None] {
        let mut scene = scene(background, Output::Display, 0.0);
        scene.effects.despill = 0.5;
        scene.effects.light_wrap = 0.5;
        let picture = |field| {
            let ingredients =
                Ingredients { field, extra: Extra { plate: Some(&plate), ..Extra::default() }, ..set.ingredients() };
            compose(&scene, &ingredients).unwrap().display.unwrap().0
        };
        let [here, there] = [&set.field, &on_gpu].map(picture);
        assert_eq!((here.size(), there.size()), ((90, 160), (90, 160)));
        let pairs = here.pixels.iter().flatten().zip(there.pixels.iter().flatten());
        let apart = pairs.map(|(a, b)| (a - b).abs()).fold(0f32, f32::max);
        // One code, where dither rounds the other way.
        assert!(apart <= 1.01 / 255.0, "{apart}");
    }
}
