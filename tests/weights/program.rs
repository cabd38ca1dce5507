//! Accuracy of the kinds of weights: true OLATs of the virtual stage, summed with each kind, against the same subject
//! under all lamps of the dome.
//!
//! `make weights` writes docs/weights.md; a small part runs with the tests.

mod random;
mod stage;
#[cfg(test)]
mod tests;

use light::weights::{Partition, Weighting};
use light::{Environment, YawTable, built_in, panorama};
use rayon::prelude::*;
use stage::{Shoot, Subject};
use std::collections::HashSet;
use std::fmt::Write;
use std::time::Instant;

const KINDS: [Weighting; 3] = [Weighting::Cells, Weighting::Smooth, Weighting::Fit];

/// Decibels of each kind for one picture.
struct Case {
    environment: usize,
    subject: usize,
    decibels: [f64; 3],
    /// Share of the subject's pixels that are exactly black with `fit`.
    black: f64,
}

impl Case {
    /// Gain of `fit` over the best of the others, in decibels.
    fn gain(&self) -> f64 {
        self.decibels[2] - self.decibels[0].max(self.decibels[1])
    }
}

/// All subjects under all environments at `yaws` yaws, a whole number of columns apart.
fn cases(shoot: &Shoot, subjects: &[Subject], environments: &[Environment], yaws: usize) -> Vec<Case> {
    let partitions = KINDS.map(|kind| Partition::new(kind, &shoot.rig));
    let turns = environments.len() * yaws;
    (0..turns)
        .into_par_iter()
        .flat_map_iter(|turn| {
            let (environment, columns) = (turn / yaws, turn % yaws * Partition::WIDTH / yaws);
            let panorama = environments[environment].reduced(stage::COLUMNS);
            let yaw_deg = 360.0 * columns as f32 / Partition::WIDTH as f32;
            let kinds = partitions.each_ref().map(|partition| partition.weights(&panorama, yaw_deg).per_lamp);
            let lamps = shoot.lamps_under(&panorama, columns * stage::COLUMNS / Partition::WIDTH);
            let cases = subjects.iter().enumerate().map(|(subject, pixels)| {
                let truth = pixels.under_lamps(&lamps);
                let pictures = kinds.each_ref().map(|weights| pixels.under_banks(weights));
                let black = pictures[2].iter().filter(|pixel| **pixel == [0.0; 3]);
                Case {
                    environment,
                    subject,
                    decibels: pictures.each_ref().map(|p| stage::psnr(p, &truth)),
                    black: black.count() as f64 / truth.len() as f64,
                }
            });
            cases.collect::<Vec<_>>()
        })
        .collect()
}

/// The built-in environments, then those of the shared data, by name.
fn environments() -> Vec<Environment> {
    let mut found: Vec<Environment> = (built_in::all().iter()).map(|own| (*own.environment()).clone()).collect();
    let Some(folder) = test_support::shared("data/hdri") else { return found };
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .map(|file| file.unwrap().path())
        .filter(|file| file.extension().is_some_and(|e| e == "hdr" || e == "exr"))
        .collect();
    files.sort();
    found.extend(files.iter().map(|file| panorama::load(file).unwrap()));
    found
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn main() -> std::io::Result<()> {
    let (known, random) = (environments(), random::environments(96, 7));
    let shoot = Shoot::new(41);
    let looks: Vec<(u64, usize)> = (0..stage::LOOKS.len()).map(|look| (31 + look as u64, look)).collect();
    let subjects = stage::subjects(&shoot, 48, &looks, 2);
    let text = table(
        &subjects,
        (&known, &cases(&shoot, &subjects, &known, 12)),
        (&random, &cases(&shoot, &subjects, &random, 1)),
    );
    println!("{text}");
    print_times();
    std::fs::write(test_support::repository("docs/weights.md"), text)
}

/// Prints the time of a turn for each kind, the fastest of several runs.
fn print_times() {
    let environment = random::environments(4, 8).remove(3).reduced(Partition::WIDTH);
    for lamps in [41, 146, 931] {
        let rig = Shoot::new(lamps).rig;
        for kind in KINDS {
            let partition = Partition::new(kind, &rig);
            let table = YawTable::new(&partition, &environment);
            let quickest = |turn: &dyn Fn(f32)| {
                let times = (0..20).map(|yaw| {
                    let start = Instant::now();
                    turn(yaw as f32 * 7.3);
                    start.elapsed().as_secs_f64() * 1e3
                });
                times.fold(f64::MAX, f64::min)
            };
            println!(
                "{lamps} lamps, {kind:?}: a turn {:.2} ms, from the table of all yaws {:.2} ms",
                quickest(&|yaw| drop(partition.weights(&environment, yaw))),
                quickest(&|yaw| drop(table.at(yaw)))
            );
        }
    }
}

/// Text of docs/weights.md, from the cases under known and under random environments.
fn table(
    subjects: &[Subject],
    (known, known_cases): (&[Environment], &[Case]),
    (random, random_cases): (&[Environment], &[Case]),
) -> String {
    let mut text = String::from(include_str!("head.md"));
    let black = |cases: &[Case]| 100.0 * cases.iter().map(|case| case.black).fold(0.0, f64::max);
    let mut reached: Vec<(f64, &str)> = (subjects.iter().enumerate())
        .map(|(i, subject)| {
            let own = known_cases.iter().filter(|case| case.subject == i);
            let look = subject.name.rsplit_once(", ").map_or("", |(look, _)| look);
            (median(own.map(|case| case.decibels[2])), look)
        })
        .collect();
    reached.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (least, most) = (reached[0], reached[reached.len() - 1]);
    write!(
        text,
        "\nUnder known environments `fit` has {:.1} ({}) to {:.1} dB ({}). It leaves at most {:.1} %\n\
         of a subject exactly black, under random environments {:.1} %.\n",
        least.0,
        least.1,
        most.0,
        most.1,
        black(known_cases),
        black(random_cases)
    )
    .unwrap();
    let mut part = |title: &str, rows: Vec<(&str, Vec<&Case>)>| {
        write!(
            text,
            "\n| {title} | `cells` | `smooth` | `fit` | gain | least | worse by 0.3 dB |\n\
             |---|---:|---:|---:|---:|---:|---:|\n"
        )
        .unwrap();
        rows.iter().for_each(|(name, cases)| row(&mut text, name, cases));
    };
    part(
        "pictures",
        vec![
            ("known environments", known_cases.iter().collect()),
            ("random environments", random_cases.iter().collect()),
        ],
    );
    for (title, environments, cases) in
        [("environment", known, known_cases), ("random environment", random, random_cases)]
    {
        let mut names: Vec<&str> = environments.iter().map(|own| own.name.as_str()).collect();
        // Random environments of a kind share a name.
        let mut seen = HashSet::new();
        names.retain(|name| seen.insert(*name));
        let rows = names.into_iter().map(|name| {
            let own = cases.iter().filter(|case| environments[case.environment].name == name);
            (name, own.collect())
        });
        part(title, rows.collect());
    }
    text
}

/// A table row that summarizes these cases.
fn row(text: &mut String, name: &str, cases: &[&Case]) {
    let kind = |k: usize| median(cases.iter().map(|case| case.decibels[k]));
    let gains: Vec<f64> = cases.iter().map(|case| case.gain()).collect();
    let least = gains.iter().copied().fold(f64::MAX, f64::min);
    let below = gains.iter().filter(|gain| **gain < -0.3).count();
    writeln!(
        text,
        "| {name} | {:.1} | {:.1} | {:.1} | {:+.1} | {:+.1} | {}/{} |",
        kind(0),
        kind(1),
        kind(2),
        median(gains.iter().copied()),
        least,
        below,
        gains.len()
    )
    .unwrap();
}
