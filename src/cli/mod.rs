//! The command line. Each command reads its arguments, runs one action of the library with a
//! progress bar on stderr, and prints its figures: sentences, or with `--json` one object.

mod console;

use crate::calibration::develop::{BallPictures, DevelopSettings, Lens};
use crate::calibration::gamma::Comparison;
use crate::calibration::light_probe::{BallCamera, ClippedLight};
use crate::calibration::{CalibrateSettings, Circle, Trial};
use crate::error::Result;
use crate::evaluation::{EvaluateSettings, Method, Truth};
use crate::export::relight::RelightSettings;
use crate::footage::ImportSettings;
use crate::gpu::DeviceChoice;
use crate::imaging::DualGamma;
use crate::light::Mapping;
use crate::project::Project;
use crate::reflectance::Precision;
use crate::scene::Background;
use crate::studio;
use crate::training::{Preset, TrainSettings};
use crate::virtual_stage::StageSettings;
use crate::worker::Job;
use clap::{Args, Parser, Subcommand};
use console::Console;
use std::path::PathBuf;

/// Relight filmed interviews after filming.
///
/// Without a command the studio opens, on PROJECT where one is named.
#[derive(Debug, Parser)]
#[command(version, args_conflicts_with_subcommands = true)]
pub struct Cli {
    /// The project to open in the studio.
    project: Option<PathBuf>,
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    Stage(StageArgs),
    Import(ImportArgs),
    Probe(Box<ProbeArgs>),
    Calibrate(CalibrateArgs),
    Train(TrainArgs),
    Relight(RelightArgs),
    Evaluate(EvaluateArgs),
    Studio(StudioArgs),
    Demo(DemoArgs),
    Pack(PackArgs),
}

/// Write a shoot of a virtual light stage, with its truth: data to try everything with.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight stage shoot --frames 24 --size 128")]
struct StageArgs {
    /// The folder to write.
    dir: PathBuf,
    /// Interview frames.
    #[arg(long, default_value_t = StageSettings::default().frames)]
    frames: usize,
    /// Width and height of the pictures in pixels.
    #[arg(long, default_value_t = StageSettings::default().size)]
    size: usize,
    /// Seed of all that is random: the same seed gives the same files.
    #[arg(long, default_value_t = StageSettings::default().seed)]
    seed: u64,
    /// Lamp banks, which are the lighting conditions of the OLATs.
    #[arg(long, default_value_t = StageSettings::default().lamps)]
    lamps: usize,
    #[command(flatten)]
    output: OutputArgs,
}

/// Make a project from a shoot folder. Copies nothing.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight import interview --shoot shoot --size 128")]
struct ImportArgs {
    /// The project's folder, made where it is missing.
    project: PathBuf,
    /// The folder that holds the shoot's manifest.json.
    #[arg(long)]
    shoot: PathBuf,
    /// Working size in pixels, a power of two.
    #[arg(long, default_value_t = 128)]
    size: usize,
    /// Seed of the project's random draws.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Work with so many of the lamps only, chosen evenly over the sphere.
    #[arg(long, value_name = "N", value_parser = parse_count)]
    lamps: Option<usize>,
    #[command(flatten)]
    output: OutputArgs,
}

/// Make a light probe, a panorama of the light, from photographs of a mirror ball.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: afterlight probe ball_0.png ball_2.png ball_4.png --stops 0,-2,-4 --fov 20 --to light.exr"
)]
struct ProbeArgs {
    /// The ball's photograph, or a bracket of several. EXR and HDR are linear, others as --gamma says.
    #[arg(required = true)]
    photographs: Vec<PathBuf>,
    /// Exposures of the photographs in stops, in their order.
    #[arg(long, value_delimiter = ',', allow_negative_numbers = true)]
    stops: Vec<f32>,
    /// The ball's centre and radius in pixels; it is looked for where this is left out.
    #[arg(long, value_name = "X,Y,RADIUS", value_parser = parse_circle)]
    circle: Option<Circle>,
    /// The same ball from another side, to fill in what the first hides.
    #[arg(long, value_name = "FILE", num_args = 1..)]
    second: Vec<PathBuf>,
    /// Exposures of those photographs in stops.
    #[arg(
        long,
        value_delimiter = ',',
        allow_negative_numbers = true,
        requires = "second"
    )]
    second_stops: Vec<f32>,
    /// How far the second camera stands to the right of the first, seen from the ball.
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 90.0,
        allow_negative_numbers = true
    )]
    second_angle: f32,
    /// The camera's field of view across the whole picture's width; from far away where nothing is said.
    #[arg(long, value_name = "DEG", group = "lens")]
    fov: Option<f64>,
    /// The camera's focal length in pixels.
    #[arg(long, value_name = "PIXELS", group = "lens")]
    focal_length: Option<f64>,
    /// The camera's distance from the ball's centre in radii of the ball.
    #[arg(long, value_name = "RADII", group = "lens")]
    distance: Option<f64>,
    /// The camera's response as two exponents.
    #[arg(long, value_name = "G1,G2", default_value = "2.2,2.2", value_parser = parse_gamma)]
    gamma: DualGamma,
    /// The part of the light that the ball reflects, in red, green and blue.
    #[arg(long, value_name = "R,G,B", default_value = "1,1,1", value_parser = parse_rgb)]
    reflectivity: [f32; 3],
    /// Estimate the light that was clipped from what surrounds it; otherwise it is only counted.
    #[arg(long)]
    estimate_clipped: bool,
    /// Turn what is written: positive moves it to camera-right in front.
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    yaw: f32,
    /// How the sphere is laid out.
    #[arg(long, value_enum, default_value = "lat-long")]
    mapping: Mapping,
    /// Rows of the picture.
    #[arg(long, default_value_t = 512)]
    height: usize,
    /// The EXR to write.
    #[arg(long, value_name = "FILE.exr")]
    to: PathBuf,
    #[command(flatten)]
    output: OutputArgs,
}

/// Find lamps, interview light and camera response from the mirror balls and the pictures.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight calibrate interview --json")]
struct CalibrateArgs {
    /// The project's folder.
    project: PathBuf,
    /// The ball's centre and radius in pixels of its photographs, in place of the project's.
    #[arg(long, value_name = "X,Y,RADIUS", value_parser = parse_circle, conflicts_with = "find_ball")]
    circle: Option<Circle>,
    /// Look for the ball in its photographs, in place of the project's circle.
    #[arg(long)]
    find_ball: bool,
    /// What of exemplars and interview is compared; pixels where a frame shows a pose, if this is left out.
    #[arg(long, value_enum)]
    comparison: Option<Comparison>,
    /// Take this response of the camera, and an exposure of the interview, in place of fitting them.
    #[arg(long, value_name = "G1,G2[,EXPOSURE]", value_parser = parse_trial, conflicts_with = "comparison")]
    gamma: Option<Trial>,
    #[command(flatten)]
    output: OutputArgs,
}

/// Train the project's network, or go on training it. Ctrl-C stops it and keeps the checkpoint.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: afterlight train interview --preset quick --exclude-frames 5,14,25,36"
)]
struct TrainArgs {
    /// The project's folder.
    project: PathBuf,
    /// Where the settings start from.
    #[arg(long, value_enum, default_value = "quick")]
    preset: Preset,
    /// How exactly convolutions multiply on a CPU.
    #[arg(long, value_enum)]
    precision: Option<Precision>,
    /// End after this many minutes of training, earlier runs counted in.
    #[arg(long, conflicts_with = "epochs")]
    minutes: Option<f64>,
    /// End after this many epochs, earlier runs counted in.
    #[arg(long)]
    epochs: Option<u32>,
    /// Compare pictures by the features of the network in this file, in place of the built-in ones:
    /// torchvision's VGG-16, VGG-19 or SqueezeNet 1.1 as .safetensors or .pth.
    #[arg(long, value_name = "FILE")]
    features: Option<PathBuf>,
    /// Compare the OLATs of this many lamps a step, drawn anew each time; all where this is left out.
    #[arg(long, value_name = "K", value_parser = parse_count)]
    lamps_per_step: Option<usize>,
    /// Exemplar steps from one with the rendering loss to the next; those between compute only the lamps
    /// that they compare.
    #[arg(long, value_name = "STEPS", default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
    rendering_every: u64,
    /// Change any other setting of the preset, such as width=32; can be given several times.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// Interview frames that training must not see, such as 5,14,25,36.
    #[arg(long, value_delimiter = ',')]
    exclude_frames: Vec<usize>,
    /// Keep the frames of this truth out of training, so that they can judge it.
    #[arg(long, value_name = "DIR")]
    exclude_truth: Option<PathBuf>,
    /// A pose, from 0, that training must not see and that judges it: the best network there predicts.
    #[arg(long, value_name = "POSE")]
    hold_out: Option<usize>,
    /// Start over instead of going on from the checkpoint.
    #[arg(long)]
    fresh: bool,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Relight the interview under an environment and write pictures or a clip.
#[derive(Debug, Args)]
#[command(
    after_help = "Example: afterlight relight interview --environment courtyard.hdr --turntable --to clip.mp4"
)]
struct RelightArgs {
    /// The project's folder.
    project: PathBuf,
    /// A lat-long EXR or HDR file, or the name of one of the shoot's own environments.
    #[arg(long)]
    environment: PathBuf,
    /// Turn the environment: positive moves it to camera-right in front.
    #[arg(
        long,
        value_name = "DEG",
        default_value_t = 0.0,
        allow_negative_numbers = true
    )]
    yaw: f32,
    /// Turn the environment once around over the frames, from --yaw on.
    #[arg(long)]
    turntable: bool,
    /// Frames A to B, both included; all where this is left out.
    #[arg(long, value_name = "A-B", value_parser = parse_range)]
    frames: Option<(usize, usize)>,
    /// Exposure in stops.
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true)]
    exposure: f32,
    /// Leave out the environment behind the subject.
    #[arg(long)]
    no_background: bool,
    /// What to write: out.%04d.png, out.%04d.exr, clip.mp4 or clip.mov.
    #[arg(long)]
    to: String,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Measure relit frames and OLATs against a truth.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight evaluate interview --truth shoot --with ratio")]
struct EvaluateArgs {
    /// The project's folder.
    project: PathBuf,
    /// A folder with truth.json and truth/.
    #[arg(long)]
    truth: PathBuf,
    /// What predicts.
    #[arg(long, value_enum, default_value = "network")]
    with: Method,
    /// Also measure all methods and write their table into this Markdown file, in the shoot's section.
    #[arg(long, value_name = "FILE")]
    table: Option<PathBuf>,
    /// Also write predicted beside true OLATs as a contact sheet.
    #[arg(long, value_name = "PNG")]
    sheet: Option<PathBuf>,
    /// Also write a contact sheet of the 20 lamps and frames whose OLATs are furthest from the truth.
    #[arg(long, value_name = "FILE.png")]
    worst: Option<PathBuf>,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Open the studio.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight studio interview")]
struct StudioArgs {
    /// The project's folder.
    project: Option<PathBuf>,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Run the whole way on a shoot of the virtual stage: no data and no download needed.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight demo demo")]
struct DemoArgs {
    /// The folder to work in. What is there already is kept and not made again.
    #[arg(default_value = "demo")]
    dir: PathBuf,
    /// Make the project only, for the studio to open.
    #[arg(long)]
    prepare: bool,
    #[command(flatten)]
    device: DeviceArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// Pack a project's network as a small starting point for others: half floats, without the
/// optimiser's state.
#[derive(Debug, Args)]
#[command(after_help = "Example: afterlight pack interview --to assets/starter")]
struct PackArgs {
    /// The project's folder.
    project: PathBuf,
    /// The folder to write.
    #[arg(long)]
    to: PathBuf,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Debug, Args)]
struct OutputArgs {
    /// Print one JSON object with the figures instead of sentences.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Args)]
struct DeviceArgs {
    /// Where the network runs.
    #[arg(long, value_enum, default_value = "auto")]
    device: DeviceChoice,
}

impl Cli {
    /// Does what was asked.
    ///
    /// # Errors
    /// Whatever the action failed with, as one sentence.
    pub fn run(self) -> Result<()> {
        let Some(command) = self.command else {
            return open_studio(self.project, DeviceChoice::Auto);
        };
        match command {
            Command::Studio(args) => {
                open_studio(args.project.clone(), args.device.device)?;
                if args.output.json {
                    println!("{}", serde_json::json!({ "project": args.project }));
                }
                Ok(())
            }
            Command::Stage(args) => {
                let StageArgs {
                    dir,
                    frames,
                    size,
                    seed,
                    lamps,
                    output,
                } = args;
                let settings = StageSettings {
                    frames,
                    size,
                    seed,
                    lamps,
                };
                do_job(&output, || {
                    Ok(Job::Stage {
                        folder: dir,
                        settings,
                    })
                })
            }
            Command::Import(args) => {
                let ImportArgs {
                    project,
                    shoot,
                    size,
                    seed,
                    lamps,
                    output,
                } = args;
                let settings = ImportSettings { size, seed };
                do_job(&output, || {
                    Ok(Job::Import {
                        project,
                        shoot,
                        settings,
                        lamps,
                    })
                })
            }
            Command::Probe(args) => do_job(&args.output, || Ok(args.job())),
            Command::Calibrate(args) => do_job(&args.output, || {
                Ok(Job::Calibrate {
                    project: args.project,
                    settings: CalibrateSettings {
                        circle: args.circle,
                        find_circle: args.find_ball,
                        comparison: args.comparison,
                        trial: args.gamma,
                    },
                })
            }),
            Command::Train(args) => do_job(&args.output, || args.job()),
            Command::Relight(args) => do_job(&args.output, || Ok(args.job())),
            Command::Evaluate(args) => {
                let EvaluateArgs {
                    project,
                    truth,
                    with,
                    table,
                    sheet,
                    worst,
                    device,
                    output,
                } = args;
                let settings = EvaluateSettings {
                    truth,
                    method: with,
                    table,
                    sheet,
                    worst,
                    device: device.device,
                };
                do_job(&output, || Ok(Job::Evaluate { project, settings }))
            }
            Command::Demo(args) => {
                let DemoArgs {
                    dir,
                    prepare,
                    device,
                    output,
                } = args;
                do_job(&output, || {
                    Ok(Job::Demo {
                        folder: dir,
                        prepare,
                        device: device.device,
                    })
                })
            }
            Command::Pack(args) => do_job(&args.output, || {
                Ok(Job::Pack {
                    project: args.project,
                    to: args.to,
                })
            }),
        }
    }
}

/// Runs a job on this thread and prints what came of it.
fn do_job(output: &OutputArgs, job: impl FnOnce() -> Result<Job>) -> Result<()> {
    let console = Console::new(output.json);
    let job = job()?;
    let outcome = console.run(|progress| job.run(progress))?;
    console.finish(&outcome, || outcome.sentence());
    Ok(())
}

fn open_studio(project: Option<PathBuf>, device: DeviceChoice) -> Result<()> {
    let project = project.map(|root| Project::open(&root)).transpose()?;
    studio::run(project, device)
}

impl ProbeArgs {
    fn job(&self) -> Job {
        let camera = match (self.fov, self.focal_length, self.distance) {
            (Some(degrees), ..) => Lens::FieldOfView(degrees),
            (_, Some(px), _) => Lens::Camera(BallCamera::FocalLength { px }),
            (.., Some(ball_radii)) => Lens::Camera(BallCamera::Distance { ball_radii }),
            _ => Lens::Camera(BallCamera::Far),
        };
        let second = BallPictures {
            photographs: self.second.clone(),
            stops: self.second_stops.clone(),
            circle: None,
        };
        Job::Develop {
            settings: Box::new(DevelopSettings {
                ball: BallPictures {
                    photographs: self.photographs.clone(),
                    stops: self.stops.clone(),
                    circle: self.circle,
                },
                second: (!self.second.is_empty()).then_some((second, self.second_angle)),
                lens: camera,
                response: self.gamma,
                reflectivity: self.reflectivity,
                clipped: if self.estimate_clipped {
                    ClippedLight::Estimate
                } else {
                    ClippedLight::Keep
                },
                yaw_deg: self.yaw,
                mapping: self.mapping,
                height: self.height,
                to: self.to.clone(),
            }),
        }
    }
}

impl TrainArgs {
    fn job(&self) -> Result<Job> {
        let mut config = self.preset.config();
        if let Some(precision) = self.precision {
            config.precision = precision;
        }
        if self.minutes.is_some() {
            config.minutes = self.minutes;
        }
        if let Some(epochs) = self.epochs {
            config.epochs = epochs;
            config.minutes = None;
        }
        config.features.clone_from(&self.features);
        config.lamps_per_step = self.lamps_per_step;
        config.rendering_every = self.rendering_every;
        self.set
            .iter()
            .try_for_each(|setting| config.set(setting))?;
        let mut exclude_frames = self.exclude_frames.clone();
        if let Some(truth) = &self.exclude_truth {
            exclude_frames.extend(Truth::open(&Project::open(&self.project)?, truth)?.frames);
        }
        let settings = TrainSettings {
            config,
            exclude_frames,
            hold_out: self.hold_out,
            fresh: self.fresh,
            device: self.device.device,
        };
        Ok(Job::Train {
            project: self.project.clone(),
            settings,
        })
    }
}

impl RelightArgs {
    fn job(&self) -> Job {
        let settings = RelightSettings {
            environment: self.environment.clone(),
            yaw_deg: self.yaw,
            turntable: self.turntable,
            frames: self.frames,
            exposure_stops: self.exposure,
            background: if self.no_background {
                Background::None
            } else {
                Background::Environment
            },
            to: self.to.clone(),
            device: self.device.device,
        };
        Job::Relight {
            project: self.project.clone(),
            settings,
        }
    }
}

/// Numbers between commas, as many as `names` has.
fn parse_numbers<const N: usize>(text: &str, names: &str) -> std::result::Result<[f64; N], String> {
    let refuse = || format!("{text:?} is not {names}");
    let numbers = text
        .split(',')
        .map(|number| number.trim().parse())
        .collect::<std::result::Result<Vec<f64>, _>>()
        .map_err(|_| refuse())?;
    numbers.try_into().map_err(|_| refuse())
}

fn parse_circle(text: &str) -> std::result::Result<Circle, String> {
    let [x, y, radius] = parse_numbers(text, "X,Y,RADIUS in pixels")?;
    Circle::new([x, y], radius).map_err(|e| e.to_string())
}

fn parse_gamma(text: &str) -> std::result::Result<DualGamma, String> {
    let [gamma1, gamma2] = parse_numbers(text, "two exponents such as 2.6,2.1")?;
    DualGamma::new(gamma1 as f32, gamma2 as f32).map_err(|e| e.to_string())
}

fn parse_trial(text: &str) -> std::result::Result<Trial, String> {
    let full = if text.matches(',').count() == 1 {
        format!("{text},1")
    } else {
        text.to_owned()
    };
    let [gamma1, gamma2, exposure] = parse_numbers(&full, "G1,G2 or G1,G2,EXPOSURE")?;
    Trial::new(gamma1 as f32, gamma2 as f32, exposure as f32).map_err(|e| e.to_string())
}

fn parse_rgb(text: &str) -> std::result::Result<[f32; 3], String> {
    let rgb: [f64; 3] = parse_numbers(text, "R,G,B such as 0.6,0.6,0.6")?;
    Ok(rgb.map(|v| v as f32))
}

fn parse_count(text: &str) -> std::result::Result<usize, String> {
    match text.parse() {
        Ok(0) => Err("at least one lamp has to count".to_owned()),
        parsed => parsed.map_err(|e| format!("{text:?} is no count: {e}")),
    }
}

fn parse_range(text: &str) -> std::result::Result<(usize, usize), String> {
    let (from, to) = text.split_once('-').unwrap_or((text, text));
    let number = |s: &str| {
        s.trim()
            .parse::<usize>()
            .map_err(|e| format!("{s:?} is no frame number: {e}"))
    };
    let (from, to) = (number(from)?, number(to)?);
    if from <= to {
        Ok((from, to))
    } else {
        Err(format!("{from} comes after {to}"))
    }
}
