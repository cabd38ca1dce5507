//! Pictures while the light is dragged.

use super::*;
use compositor::{Plate, PlateSquare};
use imaging::color::linear_from_srgb;
use imaging::resample::resize;

/// A ball under two lamps, on 64 × 64 pixels.
fn ball(index: usize) -> (Frame, Field) {
    let side = |x: usize| (x as f32 + 0.5) / 32.0 - 1.0;
    let mask = Mask::from_fn(64, 64, |x, y| ((0.8 - side(x).hypot(side(y))) * 32.0).clamp(0.0, 1.0));
    let olat = |turn: f32| Image::from_fn(64, 64, |x, _| [(0.6 + turn * side(x)).max(0.0) * 0.5; 3]);
    let field = ReflectanceField::from_olats(&[olat(-1.0), olat(1.0)]);
    let plate = Image::filled(64, 64, [0.5; 3]);
    (Frame { index, plate, mask }, field.into())
}

/// A worker with a time budget per picture in a drag, and a delay before a resting drag gets full size.
fn worker(budget_ms: f64, rest: Duration) -> Worker {
    let open = || {
        Ok(Source {
            rig: rig(),
            device: "test".to_owned(),
            predict: Box::new(|index| Ok(ball(index).into())),
            later: None,
            comparison: Box::new(|_, index| Ok(ball(index).into())),
        })
    };
    Worker::within(budget_ms, rest, open, || {})
}

fn shown(worker: &Worker, yaw_deg: f32, coarse: impl Fn(usize) -> bool) -> Arc<PreviewPicture> {
    wait_for(|| {
        let relit = worker.relit();
        relit.filter(|relit| relit.scene.yaw_deg == yaw_deg && coarse(relit.coarse))
    })
}

fn drag(worker: &Worker, yaw_deg: f32, light: &Arc<Environment>) {
    worker.show(PreviewRequest { moving: true, ..ask(0, yaw_deg, light) });
}

/// The codes at the picture's full size, interpolated between pixels.
fn enlarged(relit: &PreviewPicture) -> Vec<u8> {
    let [width, height] = relit.rgb_size;
    let pixels = relit.rgb.as_chunks::<3>().0.iter();
    let codes = Image { width, height, pixels: pixels.map(|pixel| pixel.map(f32::from)).collect() };
    let codes = resize(&codes, relit.width, relit.height);
    codes.pixels.iter().flatten().map(|v| v.round() as u8).collect()
}

/// Every picture is too slow, or every one is quick enough.
const BUDGETS_MS: [f64; 2] = [0.0, f64::MAX];

/// Drags to 40° from yaw 0, where the first picture sets the measured time.
fn begin_drag(worker: &Worker, light: &Arc<Environment>) {
    drag(worker, 0.0, light);
    shown(worker, 0.0, |coarse| coarse == 1);
    drag(worker, 40.0, light);
}

#[test]
fn where_a_picture_takes_too_long_it_is_coarse_in_a_drag_and_exact_when_it_is_let_go() {
    let light = from_the_left();
    let [slow, quick] = BUDGETS_MS.map(|budget_ms| worker(budget_ms, Duration::MAX));
    for worker in [&slow, &quick] {
        begin_drag(worker, &light);
    }
    let coarse = shown(&slow, 40.0, |coarse| coarse > 1);
    let full = shown(&quick, 40.0, |coarse| coarse == 1);
    assert_eq!((coarse.width, coarse.height), (64, 64));
    assert!(coarse.rgb.len() < full.rgb.len());
    // As the window enlarges them.
    let coarse = enlarged(&coarse);
    let full = enlarged(&full);
    assert_ne!(coarse, full);
    let light_of = |rgb: &[u8]| -> f32 {
        let codes = rgb.iter().map(|&code| f32::from(code) / 255.0);
        codes.map(linear_from_srgb).sum()
    };
    let [less, more] = [&coarse, &full].map(|rgb| light_of(rgb));
    assert!((less / more - 1.0).abs() < 0.05, "{less} {more}");
    // Away from the edge the light is smooth, so the difference is small.
    for (x, y) in (20..44).flat_map(|y| (20..44).map(move |x| (x, y))) {
        let at = 3 * (64 * y + x);
        let apart = coarse[at].abs_diff(full[at]);
        assert!(apart <= 3, "{apart} at {x}, {y}");
    }

    drag(&slow, 90.0, &light);
    shown(&slow, 90.0, |coarse| coarse > 1);
    slow.show(ask(0, 90.0, &light));
    quick.show(ask(0, 90.0, &light));
    let [slow, quick] = [slow, quick].map(|worker| shown(&worker, 90.0, |coarse| coarse == 1));
    assert_eq!(slow.rgb, quick.rgb);
}

/// The pointer is still down, and there is no other request.
#[test]
fn a_drag_that_rests_is_shown_at_its_full_size_bit_for_bit() {
    let light = from_the_left();
    let [rested, quick] = BUDGETS_MS.map(|budget_ms| {
        let worker = worker(budget_ms, Duration::from_millis(1));
        begin_drag(&worker, &light);
        shown(&worker, 40.0, |coarse| coarse == 1)
    });
    assert_eq!(rested.rgb, quick.rgb);
    assert_eq!(rested.linear, quick.linear);
}

#[test]
fn a_drag_has_no_queue() {
    let light = from_the_left();
    let worker = worker(f64::MAX, Duration::MAX);
    worker.show(ask(0, 0.0, &light));
    shown(&worker, 0.0, |_| true);
    let mut pictures = Vec::new();
    for yaw in 1..=400 {
        drag(&worker, yaw as f32 / 4.0, &light);
        pictures.extend(worker.relit().map(|relit| relit.scene.yaw_deg));
    }
    pictures.extend(worker.relit().map(|relit| relit.scene.yaw_deg));
    // At most the current picture comes from here on, then the newest.
    let before = pictures.len();
    while pictures.last() != Some(&100.0) {
        let relit = wait_for(|| worker.relit());
        pictures.push(relit.scene.yaw_deg);
    }
    assert!(pictures.len() <= before + 2);
    assert!(pictures.is_sorted(), "an older picture never follows a newer one: {pictures:?}");
}

#[test]
fn a_scrub_shows_the_nearest_frame_at_hand_and_then_the_one_it_rests_on() {
    let (worker, go, begun) = slow_worker();
    let light = from_the_left();
    for frame in [3, 20] {
        worker.show(ask(frame, 0.0, &light));
        go.send(()).unwrap();
        wait_for(|| worker.relit().filter(|relit| relit.scene.frame == frame));
    }
    for (wanted, nearest) in [(18, 20), (5, 3), (12, 20), (11, 3)] {
        worker.show(ask(wanted, wanted as f32, &light));
        let relit = shown(&worker, wanted as f32, |_| true);
        assert_eq!(relit.scene.frame, nearest, "for frame {wanted}");
    }
    drop(go);
    let refined = wait_for(|| worker.relit().filter(|relit| relit.scene.frame == 11));
    assert_eq!(refined.scene.yaw_deg, 11.0);
    drop(begun);
}

/// The ball on a striped plate of 5 times its width.
pub(crate) fn filmed(index: usize) -> Prediction {
    let (frame, field) = ball(index);
    let stripes = |x: usize, _| [if (x / 2).is_multiple_of(2) { 0.6 } else { 0.3 }; 3];
    let square = PlateSquare { x: 0.0, y: 40.0, side: 320.0 };
    let matte = Mask::from_fn(320, 401, |x, y| match y.checked_sub(40) {
        Some(y) if y < 320 => frame.mask.at(x / 5, y / 5),
        _ => 0.0,
    });
    let plate = Plate::new(Image::from_fn(320, 401, stripes), matte, square, &frame.mask);
    Prediction { frame, plate: Some(plate.unwrap()), field }
}

#[test]
fn a_drag_shows_the_plate_smaller_and_then_all_of_it() {
    let light = from_the_left();
    let open = || {
        Ok(Source {
            rig: rig(),
            device: "test".to_owned(),
            predict: Box::new(|index| Ok(filmed(index))),
            later: None,
            comparison: Box::new(|_, index| Ok(filmed(index))),
        })
    };
    let worker = Worker::within(0.0, Duration::MAX, open, || {});
    begin_drag(&worker, &light);
    let coarse = shown(&worker, 40.0, |coarse| coarse == 4);
    assert_eq!((coarse.width, coarse.height), (320, 401));
    assert_eq!(coarse.rgb_size, [80, 101]);
    worker.show(ask(0, 40.0, &light));
    let full = shown(&worker, 40.0, |coarse| coarse == 1);
    assert_eq!(full.rgb_size, [320, 401]);
    assert_eq!(coarse.codes([319, 400]).is_some(), full.codes([319, 400]).is_some());
    assert_eq!((full.codes([320, 0]), full.codes([0, 401])), (None, None));
    // The stripes come from the plate.
    let [bright, dark] = [[160, 200], [162, 200]].map(|at| full.codes(at).unwrap()[1]);
    assert!(bright > dark + 30, "{bright} {dark}");
    assert_eq!(full.predicted.working_pixel([160, 200]), Some([32, 32]));
    assert_eq!(full.predicted.working_pixel([160, 20]), None);
    // Its counterpart, the filmed plate, has the same size.
    worker.show(PreviewRequest { second: Some(Comparison::Plate), ..ask(0, 40.0, &light) });
    let compared = wait_for(|| worker.relit().filter(|relit| relit.second.is_some()));
    let (_, plate) = compared.second.as_ref().unwrap();
    assert_eq!((plate.width, plate.height), (320, 401));
}
