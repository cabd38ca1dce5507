//! The relit interview: every frame predicted, lit by an environment and written.

use super::overlap::{Stages, overlapped};
use super::provenance::Provenance;
use super::writer::{Lights, Writer, check};
use super::{Files, Interview, LightLayers, Rebuild};
use base::error::{Error, Result};
use base::numbers::{ANGLES, within};
use base::progress::Progress;
use calibration::Calibration;
use compositor::{
    EnvironmentLight, Extra, FieldEncoder, Identity, Ingredients, PassReport, Picture, Plate,
    Series, Storage, Upstream, compose,
};
use footage::{Frame, picture_size};
use gpu::{ComputeDevice, DeviceChoice};
use light::conventions::Front;
use light::keyframes::Keyframes;
use light::panorama::{self, ReadSettings};
use light::{Environment, Lighting, Mapping, Rig, built_in, conventions};
use project::{KnownEnvironment, Project};
use reflectance::Predictor;
use scene::{Background, EXPOSURE_STOPS, Effects, Output, Pass, Scene};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// What to relight, how, and where to.
#[derive(Clone, Debug, clap::Args)]
pub struct RelightSettings {
    /// A panorama's file, the name of one of the project's environments, or a built-in one: three-point, clamshell,
    /// side-light, clear-sky, low-sun, overcast, courtyard, nave.
    #[arg(long)]
    pub environment: PathBuf,
    /// Which way is front in the panorama's file, instead of what the project remembers: the convention of a tool
    /// (afterlight, openexr, usd, nuke, mitsuba, threejs, blender), or the yaw that brings it to the middle.
    #[arg(long, value_name = "TOOL|DEG", allow_hyphen_values = true)]
    pub front: Option<Front>,
    /// The environment itself, if it has been read already.
    #[arg(skip)]
    pub read: Option<Arc<Environment>>,
    /// How the panorama's file lays out the sphere, if it is not a lat-long.
    #[arg(long, value_enum)]
    pub mapping: Option<Mapping>,
    /// Turn the environment: positive moves it to camera-right in front.
    #[arg(
        long = "yaw",
        value_name = "DEG",
        default_value_t = 0.0,
        allow_negative_numbers = true,
        value_parser = within(ANGLES)
    )]
    pub yaw_deg: f32,
    /// Turn the environment once around over the frames, starting at --yaw.
    #[arg(long)]
    pub turntable: bool,
    /// Yaw in degrees over the interview's frames, added to `yaw_deg`.
    #[arg(skip)]
    pub yaw_keys: Keyframes,
    /// Light the subject by these lamps alone, without background: each with half of the energy of an even light.
    #[arg(long, value_name = "LAMP,…", value_delimiter = ',')]
    pub solo: Vec<String>,
    #[command(flatten)]
    pub lighting: Lighting,
    /// Brightness in stops over the interview's frames, added to that of `lighting`.
    #[arg(skip)]
    pub intensity_keys: Keyframes,
    #[command(flatten)]
    pub effects: Effects,
    /// Frames A to B, both included [default: all].
    #[arg(long, value_name = "A-B", value_parser = range)]
    pub frames: Option<(usize, usize)>,
    /// Exposure in stops, −10 to 10.
    #[arg(
        long = "exposure",
        default_value_t = 0.0,
        allow_negative_numbers = true,
        value_parser = within(EXPOSURE_STOPS)
    )]
    pub exposure_stops: f32,
    #[arg(skip)]
    pub background: Background,
    #[command(flatten)]
    pub files: Files,
    /// Print which passes ran, which did not and why, and how long each took.
    #[arg(long)]
    pub profile: bool,
    /// Where the network runs.
    #[arg(long, value_enum, default_value_t)]
    pub device: DeviceChoice,
    /// Storage format of predicted OLATs.
    #[arg(long = "field", value_enum, default_value_t)]
    pub storage: Storage,
}

/// The first and last frame, such as `5-12`, or one frame.
fn range(text: &str) -> std::result::Result<(usize, usize), String> {
    let (from, to) = text.split_once('-').unwrap_or((text, text));
    let number = |s: &str| {
        s.trim()
            .parse::<usize>()
            .map_err(|e| format!("{s:?} is not a frame number: {e}"))
    };
    let (from, to) = (number(from)?, number(to)?);
    if from <= to {
        Ok((from, to))
    } else {
        Err(format!("{from} comes after {to}"))
    }
}

/// What was written.
#[derive(Clone, Debug, Serialize)]
pub struct RelightReport {
    /// Number of frames.
    pub frames: usize,
    /// How many of them were there already, from an export that was stopped.
    pub kept: usize,
    /// Mean time per frame in milliseconds: prediction, sum, picture and file.
    pub ms_per_frame: f64,
    /// Mean times of the stages, which run side by side.
    pub stages: Stages,
    /// The passes of the last frame, with their mean time over all frames.
    pub passes: Vec<PassReport>,
    /// Where it was written, with the number of frames as it was asked for.
    pub output: String,
    /// How well the light layers gave back the relit subject, if they were asked for.
    pub layers: Option<Rebuild>,
    /// Share of the environment's energy that comes from where no lamp is.
    pub uncovered_energy: f32,
    /// Where the network ran and why.
    pub device: String,
}

impl RelightReport {
    /// What was written, and how well the light layers add up.
    pub fn sentence(&self) -> String {
        let frames = match self.frames {
            1 => "1 frame".to_owned(),
            frames => format!("{frames} frames"),
        };
        let kept = match self.kept {
            0 => String::new(),
            kept => format!(" ({kept} were there already)"),
        };
        let layers = self
            .layers
            .as_ref()
            .map_or(String::new(), |check| format!(". {}", check.sentence()));
        format!(
            "{frames}{kept} at {:.0} ms each: {}{layers}",
            self.ms_per_frame, self.output
        )
    }
}

/// Relights the project's interview and writes it.
///
/// # Errors
/// When something that has to be made first is missing, a file cannot be read or written, or a stop was asked for:
/// stills that were finished are kept then, a movie is not.
pub fn relight(
    project: &Project,
    settings: &RelightSettings,
    progress: &Progress,
) -> Result<RelightReport> {
    let (first, last) = frame_range(project, settings.frames)?;
    let count = last - first + 1;
    check(&settings.files, &settings.files.to, count)?;
    let (mut clip, mut writer) = Clip::open(project, settings, (first, last), progress)?;
    let started = Instant::now();
    let planned = clip.plan((first, last), &mut writer, progress)?;
    let relit = planned.iter().filter(|plan| plan.write).count();
    let response = clip.calibration.response;
    let mut rebuild: Option<Rebuild> = None;
    let frames: Vec<&Plan> = planned.iter().collect();
    let (mut times, done) = overlapped(
        &frames,
        |plan| {
            if let Some(stand_in) = footage::stand_in(project, plan.frame)? {
                progress.say(stand_in.sentence);
            }
            let (frame, filmed) = Frame::load_filmed(project, &response, plan.frame)?;
            let filmed = filmed.shown(settings.files.at);
            let plate = filmed.map(|filmed| Plate::of(filmed, &frame)).transpose()?;
            Ok((frame, plate))
        },
        |plan, (frame, plate)| {
            progress.check("")?;
            let note = format!("frame {}", plan.frame);
            progress.step(
                "relighting",
                (plan.frame - first) as u64,
                count as u64,
                note,
            );
            clip.relight_frame(plan, &frame, plate.as_ref())
        },
        |plan, made: Made| {
            let made_of = Some(&*plan.made_of).filter(|text| !text.is_empty());
            let check = writer.write(plan.frame, &made.picture, made.lights, made_of, progress)?;
            rebuild = match (rebuild, check) {
                (Some(worst), Some(check)) => Some(worst.and(check)),
                (worst, check) => worst.or(check),
            };
            Ok(())
        },
    );
    done.map_err(|e| match e {
        Error::Cancelled { .. } => Error::Cancelled {
            kept: writer.keeps(),
        },
        other => other,
    })?;
    let ending = Instant::now();
    writer.finish(progress)?;
    // An encoder that was fed has not written yet.
    times.write += ending.elapsed();
    progress.step("relighting", count as u64, count as u64, "");
    for pass in &mut clip.passes {
        pass.ms = pass.ms.map(|ms| ms / planned.len() as f64);
    }
    let whole = started.elapsed();
    let stages = times.of_frames(planned.len(), whole);
    if settings.profile {
        clip.profile(stages, progress);
    }
    Ok(RelightReport {
        frames: count,
        kept: count - relit,
        ms_per_frame: whole.as_secs_f64() * 1e3 / relit.max(1) as f64,
        stages,
        passes: clip.passes,
        output: writer.to,
        layers: rebuild,
        uncovered_energy: clip.uncovered_energy,
        device: clip.compute.description,
    })
}

/// A frame that is relit.
struct Plan {
    frame: usize,
    scene: Scene,
    /// What its file says that it was made of; "" for a movie.
    made_of: String,
    /// Whether it is written: what the next ones need may be there already.
    write: bool,
}

/// A frame that is to be written.
struct Made {
    picture: Picture,
    lights: Option<Lights>,
}

/// A clip while it is relit.
struct Clip<'a> {
    project: &'a Project,
    settings: &'a RelightSettings,
    calibration: Calibration,
    environment: Arc<Environment>,
    /// Which way is front in it.
    front: Front,
    compute: ComputeDevice,
    predictor: Predictor,
    encoder: FieldEncoder,
    /// At the level of the first frame, or the clip would flicker.
    light: Option<EnvironmentLight>,
    /// Numbers of the lamps that light the subject alone; empty for all.
    solo: Vec<usize>,
    series: Series,
    /// What scenes have to make.
    output: Output,
    /// The passes of the newest frame, with the time of all frames so far.
    passes: Vec<PassReport>,
    uncovered_energy: f32,
}

impl<'a> Clip<'a> {
    /// Reads what all frames need, and begins to write.
    fn open(
        project: &'a Project,
        settings: &'a RelightSettings,
        frames: (usize, usize),
        progress: &Progress,
    ) -> Result<(Self, Writer)> {
        let calibration = Calibration::load(project)?;
        let solo = lamps_named(&calibration.rig, &settings.solo)?;
        let (environment, known_front) = match &settings.read {
            Some(read) => (read.clone(), Front::default()),
            None => {
                let (wanted, mapping) = (&settings.environment, settings.mapping);
                let (found, front) = find_environment(project, wanted, mapping, progress)?;
                (Arc::new(found), front)
            }
        };
        let compute = ComputeDevice::choose(settings.device);
        progress.say(format!("The network runs on the {}", compute.description));
        let predictor = Predictor::open(project, &compute.device)?;
        let interview = Interview::of(project)?;
        let size = picture_size(project, settings.files.at)?;
        let ocio = settings.files.ocio.clone();
        let files = Files {
            ocio: ocio.or_config(project.color_config()),
            ..settings.files.clone()
        };
        check_grain(settings)?;
        let writer = Writer::open(&files, frames, size, &interview, progress)?;
        let clip = Self {
            project,
            settings,
            calibration,
            environment,
            front: settings.front.unwrap_or(known_front),
            compute,
            predictor,
            encoder: FieldEncoder::new(settings.storage),
            light: None,
            solo,
            series: Series::default(),
            output: writer.output(&settings.effects),
            passes: Vec::new(),
            uncovered_energy: 0.0,
        };
        Ok((clip, writer))
    }

    /// The frames that are relit: those that are not there already, and what these need.
    fn plan(
        &self,
        (first, last): (usize, usize),
        writer: &mut Writer,
        progress: &Progress,
    ) -> Result<Vec<Plan>> {
        let settings = self.settings;
        let count = last - first + 1;
        let provenance = (writer.writes_stills())
            .then(|| {
                Provenance::of(
                    self.project,
                    &self.environment,
                    settings,
                    first,
                    writer.colors(),
                )
            })
            .transpose()?;
        let mut planned = Vec::with_capacity(count);
        for frame in first..=last {
            let scene = self.scene(frame, (frame - first) as f32 / count as f32);
            let made_of = provenance.as_ref().map_or(String::new(), |provenance| {
                let picture = self.project.frame_picture(frame);
                let matte = self.project.frame_matte(frame);
                provenance.frame(&scene, &[picture.file(), matte.file()])
            });
            let write = !writer.keeps_frame(frame, &made_of);
            // The first frame sets the level of all, and smoothing goes from frame to frame.
            if write || frame == first || settings.effects.asks(Pass::Smoothing) {
                planned.push(Plan {
                    frame,
                    scene,
                    made_of,
                    write,
                });
            }
        }
        let relit = planned.iter().filter(|plan| plan.write).count();
        if relit < count {
            progress.say(format!(
                "{} of {count} frames are there already",
                count - relit
            ));
        }
        if relit == 0 {
            planned.clear();
        }
        Ok(planned)
    }

    /// What frame `index` looks like, `share` of the way through the clip.
    fn scene(&self, index: usize, share: f32) -> Scene {
        let settings = self.settings;
        let turn = if settings.turntable {
            360.0 * share
        } else {
            0.0
        };
        let key = |keys: &Keyframes| keys.at(index as f64).unwrap_or(0.0) as f32;
        let yaw_deg = settings.yaw_deg + turn + key(&settings.yaw_keys);
        Scene {
            frame: index,
            yaw_deg: self.front.turned(yaw_deg),
            lighting: Lighting {
                intensity_stops: settings.lighting.intensity_stops + key(&settings.intensity_keys),
                ..settings.lighting.clone()
            },
            effects: settings.effects,
            exposure_stops: settings.exposure_stops,
            background: match &self.solo[..] {
                [] => settings.background,
                _ => Background::None,
            },
            output: self.output,
        }
    }

    /// Predicts and lights a frame; None if it is not to be written.
    fn relight_frame(
        &mut self,
        plan: &Plan,
        frame: &Frame,
        plate: Option<&Plate>,
    ) -> Result<Option<Made>> {
        let (index, scene) = (plan.frame, &plan.scene);
        let started = Instant::now();
        let predicted = self.predictor.predict_on_device(frame)?;
        let field = self.encoder.encode(predicted, self.compute.passes())?;
        let predict_ms = Some(started.elapsed().as_secs_f64() * 1e3);
        let rig = &self.calibration.rig;
        let (light, weights_ms) = EnvironmentLight::update(
            &mut self.light,
            &self.environment,
            rig,
            scene,
            (&field, &frame.mask),
        )?;
        self.uncovered_energy = light.weights().uncovered;
        let solo = (!self.solo.is_empty()).then(|| light.solo(&self.solo));
        let of = Ingredients {
            weights: solo.as_ref().unwrap_or(light.weights()),
            upstream: Upstream {
                predict_ms,
                weights_ms,
            },
            extra: Extra {
                plate,
                identity: Identity {
                    frame: index as u64,
                    ..Identity::default()
                },
                ..Extra::default()
            },
            ..light.on(&field, &frame.mask)
        };
        let plate = (&frame.plate, &frame.mask);
        let picture = self.series.compose(scene, plate, &of)?;
        add_times(&mut self.passes, &picture);
        if !plan.write {
            return Ok(None);
        }
        let lamps = || lights(scene, &of, rig);
        let lights = self.settings.files.layers.then(lamps).transpose()?;
        Ok(Some(Made { picture, lights }))
    }

    /// Says what each pass did and took.
    fn profile(&self, stages: Stages, progress: &Progress) {
        let turned = self.front.turned(self.settings.yaw_deg);
        progress.say(conventions::sentence(turned));
        progress.say(match self.compute.passes() {
            Some(_) => "The passes ran on the GPU, timed by its own clock",
            None => "The passes ran on the CPU, timed by the wall clock",
        });
        progress.say(self.encoder.sentence());
        progress.say(stages.sentence());
        for pass in &self.passes {
            let time = match pass.ms {
                None => "   not timed".to_owned(),
                Some(ms) if pass.ran || ms > 0.0 => format!("{ms:9.3} ms"),
                Some(_) => "     skipped".to_owned(),
            };
            progress.say(format!("{:16} {time}  {}", pass.name, pass.reason));
        }
    }
}

/// Refuses grain where a configuration makes the codes.
fn check_grain(settings: &RelightSettings) -> Result<()> {
    if settings.files.ocio.is_asked() && settings.effects.asks(Pass::Grain) {
        return Err(Error::invalid(
            "grain is measured in the codes of our own view, and an OpenColorIO configuration makes others",
            "Leave the grain out, or --ocio-display, --ocio-view, --ocio-look and --ocio-space",
        ));
    }
    Ok(())
}

/// The subject under each lamp, and under all of them as the compositor sums them: without what is behind it
/// and without effects.
fn lights(scene: &Scene, of: &Ingredients, rig: &Rig) -> Result<Lights> {
    let plain = Scene {
        background: Background::None,
        effects: Effects::default(),
        output: Output::Linear,
        ..scene.clone()
    };
    let factor = of.levels.subject * scene.exposure_stops.exp2();
    let weights = of.weights.per_lamp.iter();
    let weights = weights.map(|weight| weight.map(|share| share * factor));
    let names = rig.lamps.iter().map(|lamp| &lamp.name);
    let mut layers = LightLayers::of(of.field, of.mask, names.zip(weights))?;
    if let Some(plate) = of.plate() {
        for layer in &mut layers.lamps {
            layer.picture = plate.relit(&layer.picture, of.mask);
        }
    }
    Ok(Lights {
        layers,
        subject: compose(
            &plain,
            &Ingredients {
                extra: Extra {
                    plate: of.extra.plate,
                    ..Extra::default()
                },
                ..*of
            },
        )?,
    })
}

/// The environment that is called so, one of the project's, a file, or one that is built in, and which way is
/// front in it as far as the project remembers. What had to be guessed or mended in a file is said.
///
/// # Errors
/// When there is none, or its file cannot be read as such.
pub fn find_environment(
    project: &Project,
    wanted: &Path,
    mapping: Option<Mapping>,
    progress: &Progress,
) -> Result<(Environment, Front)> {
    let named = project.environment(wanted);
    if let Some(complaint) = named.as_ref().and_then(KnownEnvironment::complaint) {
        progress.say(complaint);
    }
    let file = named.as_ref().map_or(wanted, |named| &named.file);
    if named.is_some() || file.exists() {
        let reading = ReadSettings {
            mapping,
            ..ReadSettings::default()
        };
        let panorama = panorama::read(file, &reading)?;
        panorama.notes.iter().for_each(|note| progress.say(note));
        let front = named.and_then(|named| named.front).unwrap_or_default();
        return Ok((panorama.environment, front));
    }
    if let Some(own) = wanted.to_str().and_then(built_in::named) {
        return Ok((Environment::clone(&own.environment()), Front::default()));
    }
    let own = built_in::all().into_iter().map(|own| own.name.to_owned());
    let known = project.environments().into_iter().map(|known| known.name);
    let names: Vec<String> = known.chain(own).collect();
    Err(Error::missing(
        format!(
            "{} is neither a panorama's file nor one of the environments {}",
            wanted.display(),
            names.join(", ")
        ),
        "Check the path",
    ))
}

/// The numbers of the lamps of these names, ascending.
fn lamps_named(rig: &Rig, names: &[String]) -> Result<Vec<usize>> {
    let number = |name: &String| {
        let place = rig.lamps.iter().position(|lamp| lamp.name == *name);
        place.ok_or_else(|| {
            let known: Vec<&str> = rig.lamps.iter().map(|lamp| lamp.name.as_str()).collect();
            Error::missing(
                format!(
                    "there is no lamp {name:?}: the lamps are {}",
                    known.join(", ")
                ),
                "Name lamps that the network has learnt",
            )
        })
    };
    let mut numbers = names.iter().map(number).collect::<Result<Vec<_>>>()?;
    numbers.sort_unstable();
    numbers.dedup();
    Ok(numbers)
}

fn frame_range(project: &Project, asked: Option<(usize, usize)>) -> Result<(usize, usize)> {
    let last = project.settings.shoot.frames.len().saturating_sub(1);
    match asked {
        None => Ok((0, last)),
        Some((from, to)) if from <= to && to <= last => Ok((from, to)),
        Some((from, to)) => Err(Error::missing(
            format!("there are no frames {from}-{to}: the interview has frames 0 to {last}"),
            "Ask for frames that the interview has",
        )),
    }
}

fn add_times(sums: &mut Vec<PassReport>, picture: &Picture) {
    let times: Vec<Option<f64>> = sums.iter().map(|pass| pass.ms).collect();
    sums.clone_from(&picture.passes);
    for (pass, earlier) in sums.iter_mut().zip(times) {
        pass.ms = pass.ms.zip(earlier).map(|(ms, earlier)| ms + earlier);
    }
}
