//! Measures the ladder: trains networks, measures rungs, saves the figures.

use super::front::front;
use super::judge::{Against, Judge, exemplar_size};
use super::ladder::{BASE, Facts, Knob, Network, Rung, Show, TradeoffSettings, order, rungs};
use super::ledger::{Failure, Ledger, folder};
use super::measure::{Cost, Found, Measured, Trained, measure};
use super::network_folders::{file_name, mark, variant};
use super::pace::Pace;
use super::report::TradeoffReport;
use super::together::together;
use base::error::{Error, Result};
use base::progress::Progress;
use calibration::Calibration;
use compositor::Storage;
use footage::scan::counted;
use footage::{PictureSize, picture_size};
use gpu::ComputeDevice;
use imaging::file::write_png;
use project::Project;
use reflectance::{Precision, Predictor, checkpoint};
use std::path::{Path, PathBuf};
use std::time::Instant;
use training::features::Lpips;
use training::{TrainSettings, train};
use transfer::OlatPredictor;

/// Measures the project's rungs that are not measured yet. Each figure is saved at once, so a stopped run can be
/// continued.
///
/// # Errors
/// When the project has no calibration, there is no reference, files cannot be read or written, or the user stops it. A
/// rung that fails alone is left out and listed.
pub fn tradeoff(project: &Project, settings: &TradeoffSettings, progress: &Progress) -> Result<TradeoffReport> {
    settings.check()?;
    project.check_shoot()?;
    project.check_parts()?;
    Calibration::load(project)?;
    let compute = ComputeDevice::choose(settings.device);
    progress.say(format!("The network runs on the {}", compute.description));
    let mut climb = compute.guarded(|| Climb::start(project, settings, &compute, progress))?;
    climb.all(progress)?;
    let ledger = climb.ledger;
    Ok(TradeoffReport {
        table: folder(project).join("ladder.csv"),
        compared_with: ledger.compared_with,
        on_front: front(&ledger.rungs),
        rungs: ledger.rungs,
        failures: ledger.failures,
    })
}

/// Measurement in progress.
struct Climb<'a> {
    project: &'a Project,
    /// The project at its first measurement.
    base: Project,
    settings: &'a TradeoffSettings,
    compute: &'a ComputeDevice,
    ledger: Ledger,
    judge: Judge,
    rungs: Vec<Rung>,
    lpips: Option<Lpips>,
    /// The base's network, timed in turn with each rung's.
    timed_base: Option<Trained>,
    pace: Pace,
    began: Instant,
}

impl<'a> Climb<'a> {
    fn start(
        project: &'a Project,
        settings: &'a TradeoffSettings,
        compute: &'a ComputeDevice,
        progress: &Progress,
    ) -> Result<Self> {
        let lpips = settings.lpips.as_deref().map(Lpips::open).transpose()?;
        let against = Against::new(project, settings)?;
        let mut ledger = Self::ledger(project, settings, against, compute, progress)?;
        let base = ledger.base.project(project);
        if !base.calibration_path().exists() {
            Calibration::load(project)?.save(&base)?;
        }
        let calibration = Calibration::load(&base)?;
        let plate = match &ledger.against {
            Against::Truth(_) => {
                let (width, height) = picture_size(&base, PictureSize::Box)?;
                width.min(height)
            }
            Against::Pose(_) => usize::MAX,
        };
        let shoot = &base.settings.shoot;
        let mut facts = Facts {
            size: base.settings.size,
            source: exemplar_size(&base)?.min(plate),
            lamps: shoot.lamps.len(),
            poses: shoot.poses.len(),
            has_truth: matches!(ledger.against, Against::Truth(_)),
            environment_columns: 0,
            precisions: precisions(compute),
        };
        let most = rungs(&facts, settings).iter().map(|rung| rung.network.size).max();
        let judge = Judge::open(&base, &calibration, &ledger.against, settings.at, most.unwrap_or(facts.size))?;
        let columns = judge.lit.iter().map(|lit| lit.environment.radiance.width);
        facts.environment_columns = columns.max().unwrap_or(0);
        let rungs = rungs(&facts, settings);
        ledger.planned = rungs.len() * settings.seeds as usize;
        progress.say(format!(
            "Compares {} with {}; {} already measured",
            counted(ledger.planned, "setting"),
            ledger.compared_with,
            ledger.rungs.len()
        ));
        Ok(Self {
            project,
            base,
            settings,
            compute,
            ledger,
            judge,
            rungs,
            lpips,
            timed_base: None,
            pace: Pace::default(),
            began: Instant::now(),
        })
    }

    /// Earlier measurements if they can be continued, or an empty ledger.
    fn ledger(
        project: &Project,
        settings: &TradeoffSettings,
        against: Against,
        compute: &ComputeDevice,
        progress: &Progress,
    ) -> Result<Ledger> {
        let new = Ledger::new(project, settings, against, &compute.description)?;
        let old = match Ledger::load(project) {
            Ok(None) => return Ok(new),
            Ok(Some(old)) if !settings.fresh && old.continues(&new) => return Ok(old),
            Ok(Some(_)) => Ok(()),
            Err(e) => Err(e),
        };
        let aside = Ledger::set_aside(project)?;
        let aside = aside.display();
        match old {
            Ok(()) => progress
                .say(format!("Moved earlier measurements, with other settings or from another machine, to {aside}")),
            Err(e) => progress.report(format!("{e}. Moved to {aside}"), &e),
        }
        Ok(new)
    }

    /// Measures in the order of [`order`] until everything is measured or the time is up.
    fn all(&mut self, progress: &Progress) -> Result<()> {
        let first = self.project.settings.seed;
        let seeds = first..first + self.settings.seeds;
        let wants_together = self.settings.knobs.is_empty() || self.settings.knobs.contains(&Knob::Together);
        let [sooner, _] = order(&self.rungs, seeds.clone());
        if self.some(sooner, progress)? {
            if wants_together {
                let first_seed: Vec<&Measured> = (self.ledger.rungs.iter()).filter(|m| m.seed == first).collect();
                let together = together(&first_seed);
                self.ledger.planned += together.len() * self.settings.seeds as usize;
                self.rungs.extend(together);
            }
            let [sooner, later] = order(&self.rungs, seeds);
            self.some([sooner, later].concat(), progress)?;
        }
        self.ledger.save(self.project)
    }

    /// Measures these rungs; false if the time ran out.
    fn some(&mut self, rungs: Vec<(Rung, u64)>, progress: &Progress) -> Result<bool> {
        let time = self.settings.within.map(|minutes| 60.0 * minutes);
        for (rung, seed) in rungs {
            let is_left = self.ledger.measured(&rung.name, seed).is_none();
            let is_over = time.is_some_and(|time| self.began.elapsed().as_secs_f64() > time);
            if is_left && is_over && rung.knob.is_some() {
                let left = counted(self.ledger.left(), "setting");
                progress.say(format!("Time is up. Left for the next run: {left}"));
                return Ok(false);
            }
            self.rung(&rung, seed, progress)?;
        }
        Ok(true)
    }

    /// Measures a rung unless it is already measured. A rung that fails alone does not end the run.
    fn rung(&mut self, rung: &Rung, seed: u64, progress: &Progress) -> Result<()> {
        if self.ledger.measured(&rung.name, seed).is_some() {
            return Ok(());
        }
        let done = self.ledger.rungs.len() + self.ledger.failures.len();
        progress.say(format!(
            "Setting {} of {}: {}{}",
            (done + 1).min(self.ledger.planned),
            self.ledger.planned,
            rung.name,
            self.left()
        ));
        let is_same = |failure: &Failure| failure.rung == rung.name && failure.seed == seed;
        self.ledger.failures.retain(|failure| !is_same(failure));
        let compute = self.compute;
        match compute.guarded(|| self.measured(rung, seed, progress)) {
            Ok(measured) => self.ledger.add(measured),
            Err(stopped @ (Error::Cancelled { .. } | Error::GpuLost)) => return Err(stopped),
            Err(e) => {
                progress.report(format!("Left out {}: {e}", rung.name), &e);
                self.ledger.failures.push(Failure { rung: rung.name.clone(), seed, sentence: e.to_string() });
            }
        }
        self.ledger.save(self.project)
    }

    /// Training time left.
    fn left(&self) -> String {
        let first = self.project.settings.seed;
        let mut minutes = 0.0;
        for seed in first..first + self.settings.seeds {
            let mut networks: Vec<(&str, f64)> = Vec::new();
            for rung in &self.rungs {
                if self.ledger.measured(&rung.name, seed).is_some() {
                    continue;
                }
                let trained = mark(self.project, &rung.network, rung.minutes, seed).join("checkpoint.toml");
                if trained.exists() {
                    continue;
                }
                match networks.iter_mut().find(|(name, _)| *name == rung.network.name) {
                    Some((_, most)) => *most = most.max(rung.minutes),
                    None => networks.push((&rung.network.name, rung.minutes)),
                }
            }
            minutes += networks.iter().map(|(_, minutes)| minutes).sum::<f64>();
        }
        format!("; at most {minutes:.1} min of training are left")
    }

    /// Trained network of a rung, and the folder of its weights.
    fn trained(&mut self, rung: &Rung, seed: u64, progress: &Progress) -> Result<(Trained, PathBuf)> {
        let (variant, calibration) = variant(&self.base, self.project, &rung.network, seed, progress)?;
        let mark = self.train(rung, seed, &variant, &calibration, progress)?;
        let network = (rung.minutes > 0.0).then_some(&*mark);
        let device = &self.compute.device;
        let mut predictor =
            OlatPredictor::open_at(&variant, &calibration, network, device)?.with_detail(&variant, &calibration)?;
        if let Some(pose) = self.judge.held_out() {
            predictor = predictor.without(pose);
        }
        let trained = Trained { variant, calibration, predictor };
        Ok((trained, mark))
    }

    fn measured(&mut self, rung: &Rung, seed: u64, progress: &Progress) -> Result<Measured> {
        let (trained, mark) = self.trained(rung, seed, progress)?;
        let base = match self.timed_base.take() {
            Some(base) => base,
            // The first rung is always the base with the first seed.
            None => {
                let first = self.project.settings.seed;
                let base = self.rungs[0].clone();
                self.trained(&base, first, progress)?.0
            }
        };
        let base = self.timed_base.insert(base);
        let found = measure(rung, &trained, base, self.compute, &self.judge, self.lpips.as_ref(), progress)?;
        let pictures = folder(self.project).join("pictures");
        let picture = format!("{}-{seed}.png", file_name(&rung.name));
        write_png(&pictures.join("truth.png"), &found.truth)?;
        write_png(&pictures.join(&picture), &found.picture)?;
        let info = trained.predictor.network().map(Predictor::info);
        let parameters = info.map_or(0, |info| info.network.cost().parameters);
        let exemplars = trained.predictor.bytes() as u64;
        let Found {
            timed,
            base_ms,
            predict_ms,
            field_bytes,
            fidelity,
            relit_psnr_db,
            olat_psnr_db,
            changes_db,
            flicker,
            ..
        } = found;
        Ok(Measured {
            predicted: self.predicted(rung, seed),
            cost: Cost {
                frame_ms: timed.median,
                memory_bytes: exemplars + 4 * parameters + field_bytes,
                disk_bytes: bytes(&mark),
            },
            rung: rung.clone(),
            seed,
            frame: timed,
            predict_ms,
            timed,
            base_ms,
            training_seconds: info.map_or(0.0, |info| info.seconds),
            steps: info.map_or(0, |info| info.step),
            fidelity,
            relit_psnr_db,
            olat_psnr_db,
            changes_db,
            flicker,
            device: self.compute.description.clone(),
            build: evaluation::build().to_owned(),
            picture,
        })
    }

    /// Predicted cost of a rung, from the base's cost and the networks' shapes; None before the base is measured.
    fn predicted(&self, rung: &Rung, seed: u64) -> Option<Cost> {
        let base = self.ledger.measured(BASE, seed)?;
        let shape = |network: &Network| {
            let mut variant = self.base.clone();
            variant.settings.size = network.size;
            variant.settings.shoot.lamps.truncate(network.lamps);
            network.config.network(&variant).cost()
        };
        let (mine, bases) = (shape(&rung.network), shape(&base.rung.network));
        let share = |mine: u64, whole: u64| mine as f64 / whole.max(1) as f64;
        let area = |network: &Network| (network.size * network.size) as u64;
        // Exemplars take most of the time, which grows with the number of pixels.
        let predict_ms = base.predict_ms * share(area(&rung.network), area(&base.rung.network));
        let picture_ms = base.frame.median - base.predict_ms;
        let own = |network: &Network, show: &Show, parameters: u64| {
            let planes = match show.components {
                Some(count) => 4 * count,
                None if show.storage == Storage::F32 => 12 * network.lamps,
                None => 6 * network.lamps,
            };
            4 * parameters + area(network) * planes as u64
        };
        let exemplars = |network: &Network| area(network) * network.lamps as u64;
        let base_rung = &base.rung;
        let kept = base.cost.memory_bytes.saturating_sub(own(&base_rung.network, &base_rung.show, bases.parameters));
        let kept = kept as f64 * share(exemplars(&rung.network), exemplars(&base_rung.network));
        let parameters = if rung.minutes > 0.0 { mine.parameters } else { 0 };
        let disk = base.cost.disk_bytes as f64 * share(parameters, bases.parameters);
        Some(Cost {
            frame_ms: predict_ms + picture_ms,
            memory_bytes: kept as u64 + own(&rung.network, &rung.show, parameters),
            disk_bytes: disk as u64,
        })
    }

    /// Number of training steps that fit into a rung's minutes on a quiet machine.
    fn steps(&mut self, rung: &Rung) -> Result<u64> {
        let base = &self.rungs[0];
        let base_ms = match self.ledger.base_step_ms {
            Some(ms) => ms,
            None => {
                let ms = self.pace.base_ms(base, self.compute)?;
                self.ledger.base_step_ms = Some(ms);
                self.ledger.save(self.project)?;
                ms
            }
        };
        let times = self.pace.times(rung, base, self.compute)?;
        Ok((60e3 * rung.minutes / (base_ms * times)).ceil() as u64)
    }

    /// Trains a rung's network as far as needed, and returns the folder of its weights.
    fn train(
        &mut self,
        rung: &Rung,
        seed: u64,
        variant: &Project,
        calibration: &Calibration,
        progress: &Progress,
    ) -> Result<PathBuf> {
        let mark = mark(self.project, &rung.network, rung.minutes, seed);
        if rung.minutes == 0.0 || mark.join("checkpoint.toml").exists() {
            return Ok(mark);
        }
        let steps = self.steps(rung)?;
        let (without, held_out) = (self.judge.frames(), self.judge.held_out());
        let shoot = &variant.settings.shoot;
        let poses = shoot.poses.len() - usize::from(held_out.is_some());
        let frames = shoot.frames.len().saturating_sub(without.len());
        let settings = TrainSettings {
            config: rung.network.config.clone().for_steps(steps, poses, frames),
            exclude_frames: without,
            hold_out: held_out,
            fresh: false,
            device: self.settings.device,
        };
        train(variant, calibration, &settings, progress)?;
        // A stopped training continues in the next run.
        progress.check("All earlier measurements are kept, and so is the network that was being trained")?;
        checkpoint::link(&variant.checkpoint_path(), &mark)?;
        Ok(mark)
    }
}

/// Precisions that differ from `auto` on the device.
fn precisions(compute: &ComputeDevice) -> Vec<Precision> {
    if reflectance::predictor::predicts_in_half(&compute.device) {
        vec![Precision::Mixed]
    } else if reflectance::kernels::peak::bf16_pays() {
        vec![Precision::Full]
    } else if reflectance::kernels::has_bf16() {
        vec![Precision::Mixed]
    } else {
        Vec::new()
    }
}

/// Size of a folder's files in bytes.
fn bytes(folder: &Path) -> u64 {
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
    files.filter_map(|file| file.metadata().ok()).map(|data| data.len()).sum()
}
