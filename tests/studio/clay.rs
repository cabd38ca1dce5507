//! A shoot without a network: a ball of clay whose picture under every lamp is known.

use afterlight::compositor::Field;
use afterlight::footage::Frame;
use afterlight::imaging::{Image, Mask, Raster, file::write_exr};
use afterlight::light::{Lamp, Rig};
use afterlight::project::{Ball, NamedEnvironment, Project, Shoot};
use afterlight::reflectance::ReflectanceField;
use afterlight::worker::{Blocked, ComparisonSource, Source};
use glam::Vec3;
use std::path::{Path, PathBuf};

pub const FRAMES: usize = 8;
const SIZE: usize = 64;

/// Lamps all around, on a Fibonacci lattice, with equal energy.
fn rig() -> Rig {
    let lamps = 24;
    let direction = |i: usize| {
        let y = 1.0 - (2.0 * i as f32 + 1.0) / lamps as f32;
        let turn = i as f32 * 2.399_963;
        Vec3::new((1.0 - y * y).sqrt() * turn.cos(), y, (1.0 - y * y).sqrt() * turn.sin())
    };
    Rig {
        lamps: (0..lamps)
            .map(|i| Lamp { energy: [0.5; 3], ..Lamp::new(format!("olat_{i:02}"), direction(i)) })
            .collect(),
    }
}

/// A ball of clay that rolls to the right, lit by Lambert's law under every lamp, so that the expected picture is known
/// without a network.
fn predicted(rig: &Rig, index: usize) -> (Frame, Field) {
    let middle = 26.0 + 1.5 * index as f32;
    let normal = |x: usize, y: usize| {
        let (nx, ny) = ((x as f32 + 0.5 - middle) / 22.0, (32.0 - y as f32 - 0.5) / 22.0);
        Vec3::new(nx, ny, (1.0 - nx * nx - ny * ny).max(0.0).sqrt())
    };
    let mask: Mask = Raster::from_fn(SIZE, SIZE, |x, y| {
        let r = (x as f32 + 0.5 - middle).hypot(y as f32 + 0.5 - 32.0);
        (22.5 - r).clamp(0.0, 1.0)
    });
    let olats: Vec<Image> = rig
        .lamps
        .iter()
        .map(|lamp| {
            Raster::from_fn(SIZE, SIZE, |x, y| {
                let light = normal(x, y).dot(lamp.direction).max(0.0) * mask.at(x, y);
                [0.30 * light, 0.22 * light, 0.17 * light]
            })
        })
        .collect();
    let plate = Image::filled(SIZE, SIZE, [0.2; 3]);
    (Frame { index, plate, mask }, ReflectanceField::from_olats(&olats).into())
}

pub fn environments(folder: &Path) -> Vec<NamedEnvironment> {
    let half = |u: f32, from: f32| if (u - from).abs() < 0.12 { 6.0 } else { 0.15 };
    let window: Image = Raster::from_fn(64, 32, |x, _| {
        let light = half(x as f32 / 64.0, 0.25);
        [light, 0.9 * light, 0.7 * light]
    });
    let sky: Image = Raster::from_fn(64, 32, |_, y| if y < 16 { [0.5, 0.8, 1.6] } else { [0.25, 0.2, 0.15] });
    [("window", window), ("sky", sky)]
        .map(|(name, picture)| {
            let file = PathBuf::from(format!("{name}.exr"));
            write_exr(&folder.join(&file), &picture).unwrap();
            NamedEnvironment { name: name.to_owned(), file, front: None }
        })
        .into()
}

pub fn project(folder: &Path, environments: Vec<NamedEnvironment>) -> Project {
    let mut project = Project::without_shoot(folder);
    project.settings.name = "clay".to_owned();
    project.settings.size = SIZE;
    project.settings.shoot = Shoot {
        frame_rate: 4.0,
        poses: vec!["pose00".to_owned()],
        lamps: rig().lamps.iter().map(|l| l.name.clone()).collect(),
        frames: (0..FRAMES).map(|i| format!("frame_{i:03}")).collect::<Vec<_>>().into(),
        takes: Default::default(),
        ball: Ball { center_px: [32.0; 2], radius_px: 20.0, radius_m: 0.1, camera_distance_m: 4.0 },
        environments,
        ..project.settings.shoot
    };
    project
}

pub fn source() -> Result<Source, Blocked> {
    let rig = rig();
    let (lamps, other) = (rig.clone(), rig.clone());
    Ok(Source {
        rig,
        device: "clay, no network".to_owned(),
        // In its pose, the ball has rolled as far as in the last frame. Earlier networks give darker pictures.
        later: None,
        comparison: Box::new(move |rival, index| {
            let (mut frame, mut field) = predicted(&other, FRAMES - 1);
            frame.index = index;
            if let (ComparisonSource::Checkpoint(folder), Field::Memory(field)) = (rival, &mut field) {
                let name = folder.file_name().unwrap().to_string_lossy();
                let number: f32 = name[..4].parse().unwrap();
                field.values.iter_mut().for_each(|v| *v *= 0.25 * number);
            }
            Ok((frame, field).into())
        }),
        predict: Box::new(move |index| Ok(predicted(&lamps, index).into())),
    })
}
