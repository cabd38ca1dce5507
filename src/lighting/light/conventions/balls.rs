//! A mirror ball under an environment, rendered as in Blender and Mitsuba with the printed value, compared pixel by
//! pixel with ours. Their look-ups follow their sources and share no code with ours.

use super::Tool;
use crate::weights::rotation;
use crate::{Environment, latlong};
use glam::{DMat3, DVec3};
use imaging::Image;
use std::f64::consts::{PI, TAU};

const SIZE: usize = 64;

/// A sky with three coloured lamps, none opposite or above another, so that no rotation or mirror image maps it
/// onto itself.
fn sky() -> Image {
    let lamps = [
        (DVec3::new(0.8, 0.5, -0.3), [3.0, 1.0, 0.5]),
        (DVec3::new(-0.5, 0.1, -0.9), [0.4, 2.5, 0.8]),
        (DVec3::new(-0.2, -0.7, 0.6), [0.5, 0.7, 3.0]),
    ];
    Image::from_fn(512, 256, |x, y| {
        let d = latlong::texel_direction(x, y, 512, 256).as_dvec3();
        std::array::from_fn(|c| {
            let light = lamps.iter().map(|(to, color)| color[c] * (8.0 * (d.dot(to.normalize()) - 1.0)).exp());
            (0.1 + light.sum::<f64>()) as f32
        })
    })
}

/// Picture of an ideal mirror ball of radius 1, seen from far away along −Z: `seen` in the direction that each
/// pixel reflects; black outside.
fn ball(seen: impl Fn(DVec3) -> [f64; 3]) -> Vec<[f64; 3]> {
    let at = |i: usize| (i as f64 + 0.5) / SIZE as f64 * 2.0 - 1.0;
    let pixel = |i: usize| {
        let (x, y) = (at(i % SIZE), -at(i / SIZE));
        let facing = 1.0 - x * x - y * y;
        if facing <= 0.0 {
            return [0.0; 3];
        }
        let normal = DVec3::new(x, y, facing.sqrt());
        seen(2.0 * normal.z * normal - DVec3::Z)
    };
    (0..SIZE * SIZE).map(pixel).collect()
}

/// Bilinear interpolation; `x` and `y` in texels, 0 at the centre of the first. Columns wrap, rows clamp.
fn bilinear(picture: &Image, x: f64, y: f64) -> [f64; 3] {
    let (width, height) = (picture.width as i64, picture.height as i64);
    let texel = |dx: i64, dy: i64| {
        let column = (x.floor() as i64 + dx).rem_euclid(width);
        let row = (y.floor() as i64 + dy).clamp(0, height - 1);
        picture.at(column as usize, row as usize).map(f64::from)
    };
    let (fx, fy) = (x - x.floor(), y - y.floor());
    let [a, b, c, d] = [texel(0, 0), texel(1, 0), texel(0, 1), texel(1, 1)];
    std::array::from_fn(|i| (1.0 - fy) * ((1.0 - fx) * a[i] + fx * b[i]) + fy * ((1.0 - fx) * c[i] + fx * d[i]))
}

/// Cycles: `direction_to_equirectangular` of kernel/camera/projection.h after a Mapping node of type Point, which
/// rotates the vector by the value about +Z. Image textures have texel centres at halves, the first row on top.
fn blender(file: &Image, value_deg: f64, d: DVec3) -> [f64; 3] {
    let d = DMat3::from_rotation_z(value_deg.to_radians()) * DVec3::new(d.x, -d.z, d.y);
    let u = (d.y.atan2(d.x) - PI) / -TAU;
    let v = (d.z.acos() - PI) / -PI;
    bilinear(file, u * file.width as f64 - 0.5, (1.0 - v) * file.height as f64 - 0.5)
}

/// Mitsuba 3: `direction_to_uv` and `eval_spectrum` of emitters/envmap.cpp. Its columns are shifted by half a
/// texel, as ours are; its first and last rows are on the poles.
fn mitsuba(file: &Image, value_deg: f64, d: DVec3) -> [f64; 3] {
    let d = DMat3::from_rotation_y(value_deg.to_radians()).inverse() * d;
    let u = d.x.atan2(-d.z) / TAU;
    let v = d.y.clamp(-1.0, 1.0).acos() / PI;
    bilinear(file, (u - u.floor()) * file.width as f64 - 0.5, v * (file.height - 1) as f64)
}

/// Root-mean-square difference of two pictures.
fn apart(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    let square = |(a, b): (&f64, &f64)| (a - b).powi(2);
    let all = a.iter().flatten().zip(b.iter().flatten());
    (all.map(square).sum::<f64>() / (3 * a.len()) as f64).sqrt()
}

#[test]
fn a_mirror_ball_looks_the_same_in_blender_and_mitsuba_at_the_printed_value() {
    let file = sky();
    let environment = Environment::from_radiance("sky", file.clone());
    let ours = |yaw_deg: f32| {
        let back = rotation(yaw_deg, 0.0, 0.0).inverse();
        ball(|d| environment.radiance(back * d.as_vec3()).map(f64::from))
    };
    for yaw_deg in [0.0, 35.0, -110.0, 180.0] {
        let shown = ours(yaw_deg);
        // Half of one of Mitsuba's rows is 0.35°, over which these lamps change by a hundredth.
        for (tool, look, bound) in
            [(Tool::Blender, blender as fn(&Image, f64, DVec3) -> [f64; 3], 1e-4), (Tool::Mitsuba, mitsuba, 5e-3)]
        {
            let value = f64::from(tool.value_of_yaw(yaw_deg));
            let theirs = ball(|d| look(&file, value, d));
            let off = apart(&shown, &theirs);
            // The same picture one degree further, or mirrored, must differ.
            let further = apart(&ours(yaw_deg + 1.0), &theirs);
            let mirrored: Vec<[f64; 3]> =
                (0..SIZE * SIZE).map(|i| theirs[i / SIZE * SIZE + SIZE - 1 - i % SIZE]).collect();
            println!("{tool:?} at {value}: {off:.1e}, a degree further {further:.1e}");
            assert!(off < bound, "{tool:?} at {value}: {off}");
            assert!(further > 2.0 * bound && apart(&shown, &mirrored) > 20.0 * bound);
        }
    }
}
