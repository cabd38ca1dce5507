//! Subjects of the virtual stage with every lamp of the dome, and a rig of banks of these lamps.

use base::progress::Progress;
use glam::Vec3;
use imaging::color::luminance;
use imaging::file::{read_linear, read_mask};
use light::latlong::{texel_direction, texel_solid_angle};
use light::weights::Partition;
use light::{Environment, Lamp, Rig};
use rayon::prelude::*;
use std::path::Path;
use virtual_stage::dome::Dome;
use virtual_stage::{Hair, StageSettings, write_shoot};

/// Lamps of the dome.
const LAMPS: usize = 931;
/// Columns of the panoramas that light the truth.
pub const COLUMNS: usize = 4 * Partition::WIDTH;

/// One pixel, or one weight, per channel.
pub type Rgb = [f32; 3];

/// A rig of banks, and the dome with its lamps.
pub struct Shoot {
    pub rig: Rig,
    /// Lamps of each bank.
    banks: Vec<Vec<usize>>,
    /// Nearest lamp for each texel of a panorama.
    owners: Vec<usize>,
}

impl Shoot {
    pub fn new(banks: usize) -> Self {
        let (dome, lit) = (Dome::new(LAMPS), Dome::new(banks));
        assert_eq!(lit.lamps.len(), LAMPS);
        let nearest = |direction: Vec3| -> usize {
            let cosine = |i: &usize| dome.lamps[*i].dot(direction);
            (0..LAMPS).max_by(|a, b| cosine(a).total_cmp(&cosine(b))).unwrap()
        };
        let mut members = vec![vec![]; banks];
        for (lamp, &bank) in lit.lamps.iter().zip(&lit.bank_of_lamp) {
            members[bank].push(nearest(*lamp));
        }
        let lamp = |(i, direction): (usize, &Vec3)| {
            let square = |lamp: &usize| dome.lamps[*lamp].angle_between(*direction).powi(2);
            let count = members[i].len() as f32;
            Lamp {
                energy: [count * dome.lamp_solid_angle(); 3],
                spread_deg: (members[i].iter().map(square).sum::<f32>() / count).sqrt().to_degrees(),
                ..Lamp::new(format!("olat_{i:02}"), *direction)
            }
        };
        let texels = (0..COLUMNS * COLUMNS / 2).into_par_iter();
        Self {
            rig: Rig { lamps: lit.banks.iter().enumerate().map(lamp).collect() },
            owners: texels.map(|i| nearest(texel_direction(i % COLUMNS, i / COLUMNS, COLUMNS, COLUMNS / 2))).collect(),
            banks: members,
        }
    }

    /// Mean radiance around each lamp of the dome, under a panorama of [`COLUMNS`] turned by whole columns.
    pub fn lamps_under(&self, panorama: &Environment, columns: usize) -> Vec<Rgb> {
        assert_eq!(panorama.radiance.size(), (COLUMNS, COLUMNS / 2));
        let mut sums = vec![[0.0f64; 4]; LAMPS];
        for (i, &owner) in self.owners.iter().enumerate() {
            let (x, y) = (i % COLUMNS, i / COLUMNS);
            let solid_angle = texel_solid_angle(y, COLUMNS, COLUMNS / 2);
            let radiance = panorama.radiance.at((x + COLUMNS - columns) % COLUMNS, y);
            (0..3).for_each(|c| sums[owner][c] += solid_angle * f64::from(radiance[c]));
            sums[owner][3] += solid_angle;
        }
        let mean = |[r, g, b, area]: [f64; 4]| [r, g, b].map(|v| (v / area) as f32);
        sums.into_iter().map(mean).collect()
    }
}

/// Pixels of the subject in one pose, under each lamp of the dome and each bank, linear.
pub struct Subject {
    pub name: String,
    lamps: Vec<Vec<Rgb>>,
    banks: Vec<Vec<Rgb>>,
}

impl Subject {
    /// The truth: every lamp of the dome has its own weight.
    pub fn under_lamps(&self, weights: &[Rgb]) -> Vec<Rgb> {
        sum(&self.lamps, weights)
    }

    /// The sum of the banks' pictures.
    pub fn under_banks(&self, weights: &[Rgb]) -> Vec<Rgb> {
        sum(&self.banks, weights)
    }
}

fn sum(pictures: &[Vec<Rgb>], weights: &[Rgb]) -> Vec<Rgb> {
    let mut sum = vec![[0.0; 3]; pictures[0].len()];
    for (picture, weight) in pictures.iter().zip(weights) {
        for (sum, pixel) in sum.iter_mut().zip(picture) {
            (0..3).for_each(|c| sum[c] += weight[c] * pixel[c]);
        }
    }
    sum
}

/// Look of a subject.
pub struct Look {
    pub name: &'static str,
    pub set: fn(&mut StageSettings),
}

pub const LOOKS: [Look; 7] = [
    Look { name: "the stage's own skin", set: |_| () },
    Look {
        name: "light skin, blond hair",
        set: |settings| {
            settings.trouble.skin = Some(0.0);
            settings.trouble.hair = Some(Hair::Blond);
        },
    },
    Look {
        name: "light skin, powdered",
        set: |settings| {
            settings.trouble.skin = Some(0.1);
            settings.trouble.shine = Some(0.0);
        },
    },
    Look {
        name: "light skin, oily",
        set: |settings| {
            settings.trouble.skin = Some(0.2);
            settings.trouble.shine = Some(1.0);
        },
    },
    Look { name: "dark skin", set: |settings| settings.trouble.skin = Some(1.0) },
    Look {
        name: "dark skin, oily",
        set: |settings| {
            settings.trouble.skin = Some(0.9);
            settings.trouble.shine = Some(1.0);
        },
    },
    Look {
        name: "dark skin, glasses, black hair",
        set: |settings| {
            settings.trouble.skin = Some(0.8);
            settings.trouble.hair = Some(Hair::Black);
            settings.trouble.glasses = Some(true);
        },
    },
];

/// Subjects of `size` pixels across: for each look with its seed, the first `poses` poses and truth frames.
pub fn subjects(shoot: &Shoot, size: usize, looks: &[(u64, usize)], poses: usize) -> Vec<Subject> {
    let mut subjects = Vec::new();
    for &(seed, look) in looks {
        let look = &LOOKS[look];
        let mut settings = StageSettings { frames: 8, size, seed, lamps: LAMPS, ..StageSettings::default() };
        (look.set)(&mut settings);
        let folder = tempfile::tempdir().unwrap();
        write_shoot(folder.path(), &settings, &Progress::silent()).unwrap();
        let mut olats: Vec<_> = std::fs::read_dir(folder.path().join("truth"))
            .unwrap()
            .map(|entry| entry.unwrap().path())
            .filter(|path| path.is_dir() && path.file_name().unwrap() != "pose00_olat_exr")
            .collect();
        olats.sort();
        for path in olats.into_iter().take(poses) {
            let frame = path.file_name().unwrap().to_str().unwrap();
            let frame = frame.strip_suffix("_olat").unwrap();
            let matte = folder.path().join(format!("interview_masks/{frame}.png"));
            subjects.push(subject(shoot, format!("{}, {frame}", look.name), &path, &matte));
        }
    }
    subjects
}

fn subject(shoot: &Shoot, name: String, olats: &Path, matte: &Path) -> Subject {
    let matte = read_mask(matte).unwrap();
    let lamps: Vec<Vec<Rgb>> = (0..LAMPS)
        .into_par_iter()
        .map(|lamp| {
            let picture = read_linear(&olats.join(format!("olat_{lamp:03}.exr"))).unwrap();
            let pixels = picture.pixels.into_iter().zip(&matte.pixels);
            let inside = pixels.filter(|(_, alpha)| **alpha > 0.98);
            inside.map(|(pixel, _)| pixel).collect()
        })
        .collect();
    let banks = shoot.banks.iter().map(|members| {
        let mut bank = vec![[0.0; 3]; lamps[0].len()];
        for &lamp in members {
            for (sum, pixel) in bank.iter_mut().zip(&lamps[lamp]) {
                (0..3).for_each(|c| sum[c] += pixel[c]);
            }
        }
        bank
    });
    Subject { name, banks: banks.collect(), lamps }
}

/// PSNR as measured in docs/accuracy.md: equal mean luminance, exposed for the truth's 95th percentile, display values.
pub fn psnr(picture: &[Rgb], truth: &[Rgb]) -> f64 {
    let mean = |pixels: &[Rgb]| pixels.iter().map(|p| f64::from(luminance(*p))).sum::<f64>();
    let scale = mean(truth) / mean(picture);
    let mut values: Vec<f32> = truth.as_flattened().to_vec();
    values.sort_by(f32::total_cmp);
    let place = 0.95 * (values.len() - 1) as f64;
    let (low, share) = (place as usize, place.fract());
    let high = values[(low + 1).min(values.len() - 1)];
    let level = f64::from(values[low]) * (1.0 - share) + f64::from(high) * share;
    let encode = |v: f64| (0.5 * v / level).clamp(0.0, 1.0).powf(1.0 / 2.2);
    let pairs = picture.as_flattened().iter().zip(truth.as_flattened());
    let squares = pairs.map(|(p, t)| (encode(f64::from(*p) * scale) - encode(f64::from(*t))).powi(2));
    -10.0 * (squares.sum::<f64>() / values.len() as f64).log10()
}
