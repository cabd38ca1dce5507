//! Methods to compare the prediction with, and its pictures beside theirs.

use crate::kept::Kept;
use crate::shoots::{Source, minutes};
use crate::{Clock, Options};
use base::Result;
use std::path::PathBuf;
use tradeoff::{Knob, Ledger};

/// Names as in `evaluate --with`, in page order.
pub const METHODS: [&str; 8] = ["nearest", "ratio", "harmonics", "texler", "sun", "network", "transfer", "truth-olats"];
/// Methods that are trained during the measurement.
const LEARNING: [&str; 2] = ["texler", "sun"];
/// The network without the transfer: scored with a rung's network, beside its prediction.
const ALONE: &str = "network";
/// The rig's limit, an upper bound for every method.
pub const LIMIT: &str = "truth-olats";

/// A measured method.
pub struct Scored {
    pub method: &'static str,
    /// Seed and training minutes; None for a method without training.
    pub learnt: Option<(u64, f64)>,
    /// Scores as printed by `evaluate --json`, and the program's build.
    pub kept: Kept,
    /// Folder of the compared relit frames and their truths.
    pub pictures: PathBuf,
}

impl Scored {
    /// Minutes of training.
    pub fn minutes(&self) -> Option<f64> {
        self.learnt.map(|(_, minutes)| minutes)
    }
}

/// Measures the methods with one seed, counted from the first. Methods with training get the base's minutes, or those
/// of the longest-trained network. Earlier measurements are reused, and nothing starts after the time is up.
///
/// # Errors
/// When the program fails.
pub fn measure(options: &Options, source: &Source, clock: &Clock, (seed, longest): (u64, bool)) -> Result<()> {
    let Some(ladder) = source.ladder()? else { return Ok(()) };
    let Some((base, most)) = minutes(&ladder) else { return Ok(()) };
    for method in METHODS.into_iter().filter(|method| *method != ALONE) {
        let learns = LEARNING.contains(&method);
        let first = seed == 0 && !longest;
        if clock.is_over() || !(learns || first) {
            continue;
        }
        let seed = first_seed(&ladder) + seed;
        let learnt = learns.then_some((seed, if longest { most } else { base }));
        score(options, source, method, learnt)?;
    }
    Ok(())
}

fn score(options: &Options, source: &Source, method: &str, learnt: Option<(u64, f64)>) -> Result<()> {
    let name = name(method, learnt);
    let (project, pictures) = (source.project(), source.work.join(&name));
    let (project, truth, pictures) =
        (project.to_string_lossy(), source.folder.to_string_lossy(), pictures.to_string_lossy());
    let mut command =
        vec!["evaluate", &project, "--truth", &truth, "--with", method, "--pictures", &pictures, "--json"];
    let learnt = learnt.map(|(seed, minutes)| (seed.to_string(), minutes.to_string()));
    if let Some((seed, minutes)) = &learnt {
        command.extend(["--seed", seed, "--minutes", minutes]);
    }
    let path = source.work.join(format!("{name}.json"));
    Kept::or(&path, options.build(), || options.afterlight(&command)).map(drop)
}

fn first_seed(ladder: &Ledger) -> u64 {
    ladder.rungs.first().map_or(0, |measured| measured.seed)
}

/// Base name of a method's files.
fn name(method: &str, learnt: Option<(u64, f64)>) -> String {
    match learnt {
        Some((seed, minutes)) => format!("{method}-seed-{seed}-for-{minutes:.4}-minutes"),
        None => method.to_owned(),
    }
}

/// Scores of the measured methods, for every seed and both training times.
pub fn all(options: &Options, source: &Source, ladder: &Ledger) -> Vec<Scored> {
    let Some((base, most)) = minutes(ladder) else { return Vec::new() };
    let mut lengths = vec![base, most];
    lengths.dedup();
    let mut found = Vec::new();
    for method in METHODS {
        let mut learnt: Vec<Option<(u64, f64)>> = vec![None];
        if LEARNING.contains(&method) || method == ALONE {
            let every = lengths.iter().flat_map(|&minutes| {
                let first = first_seed(ladder);
                (first..first + options.seeds).map(move |seed| Some((seed, minutes)))
            });
            learnt = every.collect();
        }
        for learnt in learnt {
            let name = name(method, learnt);
            if let Some(kept) = Kept::read(&source.work.join(format!("{name}.json"))) {
                found.push(Scored { method, learnt, kept, pictures: source.work.join(name) });
            }
        }
    }
    found
}

/// The prediction of the rung trained for these minutes with the first seed, with its pictures; the project applies the
/// rung for this, and the network alone is scored too. Measured once; None if there is no such rung, or no time.
///
/// # Errors
/// When the program fails.
pub fn network(options: &Options, source: &Source, wanted: f64, clock: Option<&Clock>) -> Result<Option<Scored>> {
    let Some(ladder) = source.ladder()? else { return Ok(None) };
    let is_length = |knob: Option<Knob>| knob.is_none_or(|knob| knob == Knob::Minutes);
    let seed = first_seed(&ladder);
    let rung = ladder
        .rungs
        .iter()
        .map(|m| (&m.rung, m.seed))
        .find(|(rung, of)| *of == seed && is_length(rung.knob) && (rung.minutes - wanted).abs() < 1e-9);
    let Some((rung, _)) = rung else { return Ok(None) };
    let learnt = Some((seed, wanted));
    let name = name("prediction", learnt);
    let path = source.work.join(format!("{name}.json"));
    let pictures = source.work.join(&name);
    let kept = match (Kept::read(&path), clock) {
        (Some(kept), _) => kept,
        (None, Some(clock)) if !clock.is_over() => {
            let project = source.project();
            let project = project.to_string_lossy();
            options.afterlight(&["tradeoff", &project, "--apply", &rung.name])?;
            score(options, source, ALONE, learnt)?;
            score(options, source, "prediction", learnt)?;
            let Some(kept) = Kept::read(&path) else { return Ok(None) };
            kept
        }
        _ => return Ok(None),
    };
    Ok(Some(Scored { method: "prediction", learnt, kept, pictures }))
}
