//! Lamps on photographs of real balls, and on synthetic ones with every defect of real ones.

use super::super::code_values::{CodeValues, ResponseTable, codes};
use super::super::footprint::{Footprint, aim};
use super::super::mirror_ball::MirrorBall;
use super::super::probe::measure;
use super::super::silhouette::{Circle, Photographs};
use super::*;
use crate::PROVISIONAL;
use glam::Vec3;
use imaging::{Encoded, file};
use light::Lamp;
use project::Ball;
use std::path::Path;

mod made_up;
mod scene;
mod variants;

/// Lamps in a series of photographs.
fn lamps(ball: &Ball, series: &[Encoded]) -> Vec<Lamp> {
    let size = series[0].0.size();
    let geometry = MirrorBall::new(ball, None, size).unwrap();
    let table = ResponseTable::from_response(&PROVISIONAL);
    let mut grid = Grid::new(&geometry, size.0, series.len());
    let mut photographs = Photographs::one("ball", &series[0]).unwrap();
    for picture in &series[1..] {
        photographs.add("ball", picture).unwrap();
    }
    grid.check_circle(&photographs, &Circle::from_ball(ball));
    let (mut footprints, levels): (Vec<_>, Vec<_>) = series
        .iter()
        .map(|picture| {
            let codes = codes(picture);
            let seen: Vec<CodeValues> = geometry.pixels.iter().map(|p| codes[p.index]).collect();
            (Footprint::find(&seen, &table), grid.reduce(&seen, &table))
        })
        .unzip();
    aim(&mut footprints, &levels, &grid, &table);
    let names = vec!["lamp".to_owned(); series.len()];
    measure(&footprints, (&geometry, 1.0), names.iter(), &table).0.lamps
}

/// A ball photographed from far away.
fn far(center_px: [f32; 2], radius_px: f32) -> Ball {
    Ball { center_px, radius_px, radius_m: 0.05, camera_distance_m: 1e4 }
}

/// Numbers in a text file.
fn numbers(path: &Path) -> Vec<f32> {
    let text = std::fs::read_to_string(path).unwrap();
    (text.split_whitespace()).map(|word| word.parse().unwrap()).collect()
}

/// One of the shared balls: its twelve photographs, its circle, and the published directions.
fn shiny_ball(number: usize) -> Option<(Vec<Encoded>, Ball, Vec<Vec3>)> {
    let folder = test_support::shared(format!("data/shiny_balls/LightProbe-{number}"))?;
    let series: Vec<Encoded> =
        (1..=12).map(|i| file::read_encoded(&folder.join(format!("Image_{i:02}.JPG"))).unwrap()).collect();
    let circle = numbers(&folder.join("circle_data.txt"));
    // Rows count from the bottom.
    let below = series[0].0.height as f32 - circle[1];
    let directions = numbers(&folder.join("light_directions.txt"));
    let published =
        (0..12).map(|i| Vec3::new(directions[i], directions[12 + i], directions[24 + i]).normalize()).collect();
    Some((series, far([circle[0], below], circle[2]), published))
}

/// Lamps on the two shared balls, with the published directions.
pub(crate) fn real_balls() -> Option<[(Vec<Lamp>, Vec<Vec3>); 2]> {
    let real_ball = |number| {
        let (series, ball, published) = shiny_ball(number)?;
        Some((lamps(&ball, &series), published))
    };
    Some([real_ball(1)?, real_ball(2)?])
}

/// Angles in degrees between a rig of the shared lamps and the mean of the published directions of both balls.
pub(crate) fn apart_from_published(rig: &light::Rig) -> Vec<f32> {
    let published = [1, 2].map(|number| shiny_ball(number).unwrap().2);
    let mean = |i: usize| (published[0][i] + published[1][i]).normalize();
    (rig.lamps.iter().enumerate()).map(|(i, lamp)| apart(lamp.direction, mean(i))).collect()
}

fn apart(a: Vec3, b: Vec3) -> f32 {
    a.angle_between(b).to_degrees()
}

fn sorted(values: impl Iterator<Item = f32>) -> Vec<f32> {
    let mut values: Vec<f32> = values.collect();
    values.sort_by(f32::total_cmp);
    values
}

#[test]
fn lamps_on_two_real_balls_are_where_they_were_published_and_agree_better() {
    let Some(balls) = real_balls() else { return };
    for ((found, published), number) in balls.iter().zip([1, 2]) {
        let off: Vec<f32> =
            (found.iter().zip(published)).map(|(lamp, published)| apart(lamp.direction, *published)).collect();
        for (i, (lamp, off)) in found.iter().zip(&off).enumerate() {
            println!(
                "ball {number}, lamp {:2}: {off:.2}° off, confidence {:.2}, spread {:.1}°, clipped {:.2}",
                i + 1,
                lamp.confidence,
                lamp.spread_deg,
                lamp.clipped
            );
            assert!(lamp.confidence > 0.5 && lamp.spread_deg < 12.0);
        }
        let off = sorted(off.into_iter());
        println!("ball {number}: median {:.2}°, worst {:.2}°", off[6], off[11]);
        assert!(off[11] <= 1.5);
    }
    let [first, second] = &balls;
    let ours = sorted((0..12).map(|i| apart(first.0[i].direction, second.0[i].direction)));
    let theirs = sorted((0..12).map(|i| apart(first.1[i], second.1[i])));
    for (name, angles) in [("found", &ours), ("published", &theirs)] {
        println!(
            "between the balls, {name}: {:.2}° to {:.2}°, median {:.2}°, mean {:.2}°",
            angles[0],
            angles[11],
            angles[6],
            angles.iter().sum::<f32>() / 12.0
        );
    }
    let mean = |angles: &[f32]| angles.iter().sum::<f32>() / 12.0;
    assert!(ours[6] < theirs[6] && ours[11] < theirs[11] && mean(&ours) < mean(&theirs));
}
