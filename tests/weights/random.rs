//! Random environments: suns, softboxes and rooms, which reveal tuning to the known panoramas.

use chacha20::ChaCha8Rng;
use glam::Vec3;
use imaging::Image;
use light::Environment;
use light::latlong::texel_direction;
use rand::{RngExt, SeedableRng};
use std::f32::consts::{PI, TAU};

/// Columns of the panoramas.
const COLUMNS: usize = 512;

/// `count` environments: in turn a hard sun, a soft sun, up to four softboxes, and a room of patches with many lamps.
pub fn environments(count: usize, seed: u64) -> Vec<Environment> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    (0..count).map(|i| environment(i % 4, &mut random)).collect()
}

fn environment(kind: usize, random: &mut ChaCha8Rng) -> Environment {
    let mut within = |low: f32, high: f32| low + (high - low) * random.random::<f32>();
    let name = ["hard sun", "soft sun", "softboxes", "room"][kind];
    let count = match kind {
        0 | 1 => 1,
        2 => within(1.0, 5.0) as usize,
        _ => within(3.0, 12.0) as usize,
    };
    let mut direction = |below: bool| -> Vec3 {
        let (y, turn) = (within(if below { -1.0 } else { 0.0 }, 1.0), within(0.0, TAU));
        let across = (1.0 - y * y).sqrt();
        Vec3::new(across * turn.cos(), y, across * turn.sin())
    };
    let lamps: Vec<Vec3> = (0..count).map(|_| direction(kind == 3)).collect();
    let (up, patches): (Vec3, Vec<Vec3>) = (direction(true), (0..12).map(|_| direction(true)).collect());
    let lamps: Vec<(Vec3, f32, [f32; 3])> = (lamps.into_iter())
        .map(|lamp| {
            let radius_deg = match kind {
                0 => 0.5,
                1 => within(1.0, 6.0),
                2 => within(3.0, 25.0),
                _ => within(0.7f32.ln(), 20f32.ln()).exp(),
            };
            let power = within(-1.0, 1.0).exp();
            (lamp, radius_deg, [0; 3].map(|_| power * within(0.6, 1.0)))
        })
        .collect();
    let patches: Vec<(Vec3, f32, f32)> =
        (patches.into_iter()).map(|patch| (patch, within(-2.0, 2.0).exp(), within(0.02, 0.6))).collect();
    let (slope, colour) = (within(0.0, 0.95), [0; 3].map(|_| within(0.3, 1.0)));
    // Relative power of the room's lamps: from a tenth to a hundred times the rest.
    let ratio = within(0.1f32.ln(), 100f32.ln()).exp();
    let even = Image::from_fn(COLUMNS, COLUMNS / 2, |x, y| {
        let at = texel_direction(x, y, COLUMNS, COLUMNS / 2);
        let patch = |(to, power, size): &(Vec3, f32, f32)| power * ((at.dot(*to) - 1.0) / size).exp();
        let level = match kind {
            3 => patches.iter().map(patch).sum(),
            _ => 1.0 + slope * at.dot(up),
        };
        colour.map(|c| c * level)
    });
    let lit = Image::from_fn(COLUMNS, COLUMNS / 2, |x, y| {
        let at = texel_direction(x, y, COLUMNS, COLUMNS / 2);
        let mut sum = [0.0; 3];
        for (lamp, radius_deg, colour) in &lamps {
            // No smaller than a texel.
            let radius = radius_deg.to_radians().max(1.5 * PI / (COLUMNS / 2) as f32);
            if at.angle_between(*lamp) < radius {
                (0..3).for_each(|c| sum[c] += colour[c] / (1.0 - radius.cos()));
            }
        }
        sum
    });
    let energy = |image: &Image| Environment::from_radiance("", image.clone()).energy();
    let green = [energy(&even)[1], energy(&lit)[1]];
    let gain = f64::from(ratio) * green[0] / green[1];
    let pairs = even.pixels.iter().zip(&lit.pixels);
    let pixels = pairs.map(|(e, l)| [0, 1, 2].map(|c| e[c] + gain as f32 * l[c])).collect();
    Environment::from_radiance(name, Image { pixels, ..even })
}
