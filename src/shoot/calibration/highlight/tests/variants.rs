//! The shared balls as seen by other cameras: smaller, in a room with a window, in a coarser JPEG.

use super::scene::through_jpeg;
use super::*;
use imaging::resample::resize_area;
use imaging::{Image, Response};

/// Photographs with the light of each pixel changed, as JPEG, at a size that gives the ball a radius of
/// `radius_px`.
fn changed(
    (series, ball): (&[Encoded], &Ball),
    radius_px: f32,
    light: impl Fn(usize, [f32; 3]) -> [f32; 3],
) -> (Vec<Encoded>, Ball) {
    let response = Response::Power(2.2);
    let size = series[0].0.size();
    let shrink = radius_px / ball.radius_px;
    let (width, height) = ((size.0 as f32 * shrink).round() as usize, (size.1 as f32 * shrink).round() as usize);
    let shown = (series.iter()).map(|picture| {
        let mut picture: Image = response.decode(picture);
        for (i, pixel) in picture.pixels.iter_mut().enumerate() {
            *pixel = light(i, *pixel);
        }
        let Encoded(picture) = response.encode(&resize_area(&picture, width, height));
        through_jpeg(&picture, 80)
    });
    let (across, down) = (width as f32 / size.0 as f32, height as f32 / size.1 as f32);
    let center = [across * ball.center_px[0], down * ball.center_px[1]];
    (shown.collect(), far(center, across * ball.radius_px))
}

/// Error in degrees against the published direction, and confidence, for each lamp.
fn judged(series: &[Encoded], ball: &Ball, published: &[Vec3]) -> Vec<(f32, f32)> {
    (lamps(ball, series).iter().zip(published))
        .map(|(lamp, published)| (apart(lamp.direction, *published), lamp.confidence))
        .collect()
}

#[test]
fn real_balls_shown_by_other_cameras_are_as_right() {
    for number in [1, 2] {
        let Some((series, ball, published)) = shiny_ball(number) else { return };
        let original = (&series[..], &ball);
        let width = series[0].0.width;
        // A window above the ball, as bright as white.
        let window = |i: usize, pixel: [f32; 3]| {
            let (x, y) = ((i % width) as f32, (i / width) as f32);
            let aside = [x - ball.center_px[0], y - ball.center_px[1] + 0.75 * ball.radius_px];
            let is_window = aside.iter().all(|d| d.abs() < 0.06 * ball.radius_px);
            if is_window { [1.0; 3] } else { pixel }
        };
        let same = |_: usize, pixel: [f32; 3]| pixel;
        for (what, (series, ball)) in [
            ("200 pixels", changed(original, 200.0, same)),
            ("100 pixels", changed(original, 100.0, same)),
            ("60 pixels", changed(original, 60.0, same)),
            ("100 pixels, a window", changed(original, 100.0, window)),
        ] {
            let judged = judged(&series, &ball, &published);
            let off = sorted(judged.iter().map(|(off, _)| *off));
            println!(
                "ball {number}, {what}: median {:.2}°, worst {:.2}°, least confidence {:.2}",
                off[6],
                off[11],
                judged.iter().map(|(_, c)| *c).fold(1.0, f32::min)
            );
            assert!(off[11] <= 2.5, "{what}: {judged:?}");
        }
        // A pixel spans three to six degrees here: some lamps are wrong, but none with high confidence.
        for radius_px in [40.0, 30.0, 20.0] {
            let (series, ball) = changed(original, radius_px, same);
            let judged = judged(&series, &ball, &published);
            println!("ball {number}, {radius_px} pixels: {judged:.2?}");
            let is_honest = |&(off, confidence): &(f32, f32)| off <= 2.5 || confidence <= 0.5;
            assert!(judged.iter().all(is_honest), "{judged:?}");
        }
    }
}
