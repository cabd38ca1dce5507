//! Setup of all farm tests: a project with a barely trained network, and its export.

use crate::program::{afterlight, fail, succeed};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use tempfile::TempDir;
use test_shoot::TestShoot;
use test_support::{copy_folder, wait_for};

/// Frames of the interview.
pub const FRAMES: usize = 12;
/// Look options of all exports. Names have spaces, as users' names do.
const LOOK: [&str; 5] = ["--environment", "nave", "--turntable", "--device", "cpu"];

/// A folder with the project `my film` of the shoot `the shoot`.
pub struct Ground {
    folder: TempDir,
}

impl Ground {
    /// A copy of a project that is made once.
    pub fn new() -> Self {
        static MADE: OnceLock<TempDir> = OnceLock::new();
        let made = MADE.get_or_init(|| {
            let folder = tempfile::tempdir().unwrap();
            let shoot = TestShoot { frames: FRAMES, size: 64, working_size: 64, ..TestShoot::default() };
            shoot.calibrate(folder.path(), "my film");
            let train = "--epochs 1 --device cpu --set width=8 --set most-channels=16";
            let train: Vec<&str> = train.split(' ').collect();
            succeed(folder.path(), &[&["train", "my film", "--json"], &train[..]].concat());
            folder
        });
        let folder = tempfile::Builder::new().prefix("a farm ").tempdir().unwrap();
        copy_folder(made.path(), folder.path());
        Self { folder }
    }

    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    pub fn at(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn text(&self, name: &str) -> String {
        self.at(name).display().to_string()
    }

    /// Exports on this machine, as a user does.
    pub fn export(&self, to: &str) {
        succeed(self.path(), &[&["relight", "my film", "--to", to, "--json"], &LOOK[..]].concat());
    }

    /// Writes a job of the same export; returns the program's output.
    pub fn write_job(&self, job: &str, output: &str, more: &[&str]) -> Value {
        let begin = ["farm", "my film", "--to", job, "--output", output, "--json"];
        succeed(self.path(), &[&begin[..], &LOOK, more].concat())
    }

    pub fn chunk(&self, job: &str, frames: &str) -> Value {
        succeed(self.path(), &["farm-chunk", job, "--frames", frames, "--json"])
    }

    pub fn assemble(&self, job: &str) -> Value {
        succeed(self.path(), &["farm-assemble", job, "--json"])
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.at(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// Numbers of the movie frames written so far.
    pub fn frames(&self, job: &str) -> Vec<usize> {
        (0..FRAMES).filter(|frame| self.frame(job, *frame).is_file()).collect()
    }

    pub fn frame(&self, job: &str, frame: usize) -> PathBuf {
        afterlight::export::movie_frame(&self.at(job).join("frames"), frame)
    }

    /// Starts a chunk, and kills it after its first frame.
    pub fn kill_a_chunk(&self, job: &str, first: usize, frames: &str) {
        let mut worker = Command::new(env!("CARGO_BIN_EXE_afterlight"))
            .args(["farm-chunk", job, "--frames", frames])
            .current_dir(self.path())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        wait_for(|| self.frame(job, first).is_file().then_some(()));
        worker.kill().unwrap();
        worker.wait().unwrap();
    }
}

/// Kills the process that works on the job in `folder`, as soon as it runs and `file` exists.
pub fn kill_the_worker(folder: &Path, file: &Path) {
    wait_for(|| file.is_file().then_some(()));
    let job = folder.display().to_string();
    let processes = std::fs::read_dir("/proc").unwrap().flatten();
    let is_worker = |process: &PathBuf| {
        let words = std::fs::read(process.join("cmdline")).unwrap_or_default();
        let words = String::from_utf8_lossy(&words).into_owned();
        let here = std::fs::read_link(process.join("cwd")).unwrap_or_default();
        let is_ours = words.contains(&job) || here == folder;
        is_ours && words.split('\0').any(|word| word == "farm-chunk") && words.contains("afterlight\0")
    };
    let workers: Vec<PathBuf> = processes.map(|p| p.path()).filter(is_worker).collect();
    for worker in &workers {
        let pid = worker.file_name().unwrap();
        Command::new("kill").arg("-9").arg(pid).status().unwrap();
    }
    assert!(!workers.is_empty(), "the worker was faster");
}

/// Checksum and time of each frame that a movie shows.
fn frame_sums(movie: &Path) -> Vec<u8> {
    let mut ffmpeg = Command::new("ffmpeg");
    ffmpeg.args(["-v", "error", "-i"]).arg(movie);
    let output = ffmpeg.args(["-f", "framemd5", "-"]).output().unwrap();
    assert!(output.status.success() && output.stdout.len() > 500);
    output.stdout
}

#[test]
fn chunks_are_joined_to_the_movie_that_one_export_writes() {
    if !test_support::ffmpeg() {
        return;
    }
    let ground = Ground::new();
    // Eight bits, sixteen bits, and sixteen bits with straight alpha.
    for (ending, more) in [("mp4", &[][..]), ("mov", &[]), ("mkv", &["--no-background"])] {
        let (alone, joined) = (format!("alone.{ending}"), format!("joined.{ending}"));
        let job = format!("job of {ending}");
        let local = ["relight", "my film", "--to", &alone, "--json"];
        succeed(ground.path(), &[&local[..], &LOOK, more].concat());
        let written = ground.write_job(&job, &joined, &[&["--engine", "slurm", "--chunk", "5"], more].concat());
        assert_eq!((&written["tasks"], &written["chunks"]), (&12.into(), &3.into()));
        // In random order.
        for frames in ["10+5", "0+5", "5+5"] {
            ground.chunk(&job, frames);
        }
        let report = ground.assemble(&job);
        assert_eq!(report["frames"], 12);
        assert_eq!(report["chunks"].as_array().unwrap().len(), 3);
        assert!(report["frame_bytes"].as_u64().unwrap() > 1000);
        // Matroska writes a random number into each file.
        let contents = |movie: &str| match ending {
            "mkv" => frame_sums(&ground.at(movie)),
            _ => ground.read(movie),
        };
        assert!(contents(&joined) == contents(&alone), "{ending}");
    }
}

/// Compares stills of two exports byte for byte; returns those of the first.
fn same_stills(ground: &Ground, alone: &str, farmed: &str) -> Vec<Vec<u8>> {
    let stills = (0..FRAMES).map(|frame| {
        let [alone, farmed] = [alone, farmed].map(|name| ground.read(&name.replace("%02d", &format!("{frame:02}"))));
        assert!(alone == farmed, "frame {frame}");
        alone
    });
    stills.collect()
}

#[test]
fn stills_of_chunks_are_those_of_one_export_byte_for_byte() {
    let ground = Ground::new();
    for name in ["%02d.png", "%02d.exr"] {
        let (alone, farmed) = (format!("alone {name}"), format!("farmed {name}"));
        ground.export(&alone);
        ground.write_job(name, &farmed, &["--engine", "openjd", "--chunk", "7"]);
        assert_eq!(ground.chunk(name, "0-6")["kept"], 0);
        assert_eq!(ground.chunk(name, "7-11")["kept"], 0);
        ground.assemble(name);
        same_stills(&ground, &alone, &farmed);
    }
}

#[test]
fn a_job_has_the_keys_the_lights_and_the_effects_of_its_look() {
    let ground = Ground::new();
    let keys = r#"{
        "yaw": {"keys": [{"frame": 0, "value": -40}, {"frame": 11, "value": 80, "interpolation": "linear"}]},
        "pitch": {"keys": [{"frame": 3, "value": 10}, {"frame": 9, "value": -10}]},
        "background_yaw": {"keys": [{"frame": 0, "value": 0}, {"frame": 11, "value": 90}]},
        "temperature": {"keys": [{"frame": 0, "value": 3200}, {"frame": 11, "value": 7500}]},
        "exposure": {"keys": [{"frame": 2, "value": 0}, {"frame": 8, "value": 1, "in": 0.3}]},
        "effects.glare": {"interpolation": "linear", "keys": [{"frame": 0, "value": 0}, {"frame": 11, "value": 0.8}]},
        "effects.grain": {"keys": [{"frame": 0, "value": 0.5}, {"frame": 11, "value": 1.5}]},
        "lights.1.yaw": {"keys": [{"frame": 0, "value": -90}, {"frame": 11, "value": 90}]},
        "lights.2.red": {"keys": [{"frame": 0, "value": 1}, {"frame": 11, "value": 0.1}]}
    }"#;
    std::fs::write(ground.at("the keys.json"), keys).unwrap();
    std::fs::create_dir(ground.at("street")).unwrap();
    for number in 0..3u8 {
        let still = image::RgbImage::from_fn(20, 9, |x, y| image::Rgb([x as u8, y as u8, 50 * number]));
        still.save(ground.at(&format!("street/street.{number:02}.png"))).unwrap();
    }
    let look = "--environment;nave;--device;cpu;--keys;the keys.json;--light;0,20,30,2;--light;60,0,20,1,1,0.5,0.5;\
                --view;filmic;--vignette;0.3;--background-blur;0.05;--tint;12;--intensity-keys;0:-0.5,11:0.5;--linear-keys;\
                --size;48;--bits;16;--background;street/street.%02d.png,0.1,0,1.2,-1";
    let look: Vec<&str> = look.split(';').collect();
    let local = ["relight", "my film", "--to", "alone %02d.png", "--json"];
    succeed(ground.path(), &[&local[..], &look].concat());
    let job = "farm;my film;--to;a job;--output;farmed %02d.png;--engine;slurm;--chunk;5;--json";
    let job: Vec<&str> = job.split(';').collect();
    succeed(ground.path(), &[&job[..], &look].concat());
    // A job without a chunk's length relights the first frames.
    let sized = ["--engine", "slurm", "--background", "street/street.%02d.png,0,0,1"];
    ground.write_job("sized", "s%d.png", &sized);
    // The files behind the look may change or disappear meanwhile.
    std::fs::remove_file(ground.at("the keys.json")).unwrap();
    std::fs::remove_dir_all(ground.at("street")).unwrap();
    for frames in ["5-9", "0-4", "10-11"] {
        ground.chunk("a job", frames);
    }
    ground.assemble("a job");
    let stills = same_stills(&ground, "alone %02d.png", "farmed %02d.png");
    assert!(stills.windows(2).all(|two| two[0] != two[1]), "the picture changes");
    // Smoothing set by keys also depends on the previous frame.
    std::fs::write(
        ground.at("smooth.json"),
        r#"{"effects.smoothing": {"keys": [{"frame": 0, "value": 0}, {"frame": 11, "value": 0.5}]}}"#,
    )
    .unwrap();
    let smooth = ["--engine", "slurm", "--chunk", "2", "--keys", "smooth.json"];
    assert_eq!(ground.write_job("smooth", "b%d.png", &[&smooth[..], &["--frames", "2-7"]].concat())["chunk"], 6);
    let lost = r#"{"lights.7.yaw": {"keys": [{"frame": 0, "value": 0}]}}"#;
    std::fs::write(ground.at("lost.json"), lost).unwrap();
    let lost = "farm;my film;--environment;nave;--keys;lost.json;--to;lost;--output;a.mov;--engine;slurm";
    let said = fail(ground.path(), &lost.split(';').collect::<Vec<_>>());
    assert!(said.contains("lights.7.yaw"), "{said}");
    assert!(!ground.at("lost").exists(), "nothing is written");
}

/// A studio's configuration with one view, with an adjustable gamma.
fn write_configuration(path: &Path, gamma: f32) {
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    let text = format!(
        "ocio_profile_version: 2.1
roles:
  default: light
  scene_linear: light
  aces_interchange: aces
displays:
  Monitor:
    - !<View> {{name: Film, colorspace: film}}
colorspaces:
  - !<ColorSpace>
    name: aces
    encoding: scene-linear
  - !<ColorSpace>
    name: light
    aliases: [lin_rec709_scene]
    encoding: scene-linear
    to_scene_reference: !<MatrixTransform> {{matrix: [0.439632982, 0.382988698, 0.177378320, 0, 0.0897764430, 0.813439429, 0.0967841280, 0, 0.0175411704, 0.111546553, 0.870912276, 0, 0, 0, 0, 1]}}
  - !<ColorSpace>
    name: film
    from_scene_reference: !<GroupTransform>
      children:
        - !<ColorSpaceTransform> {{src: aces, dst: light}}
        - !<ExponentTransform> {{value: [{gamma}, {gamma}, {gamma}, 1], direction: inverse}}
"
    );
    std::fs::write(path, text).unwrap();
}

#[test]
fn a_job_shows_pictures_by_the_project_s_configuration_and_notices_its_change() {
    let ground = Ground::new();
    let config = ground.at("the studio's/config.ocio");
    write_configuration(&config, 2.0);
    let named = "ocio;my film;--use;the studio's/config.ocio;--json";
    succeed(ground.path(), &named.split(';').collect::<Vec<_>>());
    ground.export("plain %02d.png");
    let shown = ["--ocio-view", "Film"];
    let local = ["relight", "my film", "--to", "alone %02d.png", "--json"];
    succeed(ground.path(), &[&local[..], &LOOK, &shown].concat());
    let plain = afterlight::imaging::file::read_encoded(&ground.at("plain 03.png")).unwrap();
    let alone = afterlight::imaging::file::read_encoded(&ground.at("alone 03.png")).unwrap();
    assert!(plain != alone, "the view has an effect");
    let engine = ["--engine", "slurm", "--chunk", "6"];
    ground.write_job("a job", "farmed %02d.png", &[&engine[..], &shown].concat());
    // The project may switch to another configuration: the job keeps its own.
    let none = ["ocio", "my film", "--use", "none", "--json"];
    succeed(ground.path(), &none);
    ground.chunk("a job", "0-5");
    ground.chunk("a job", "6-11");
    ground.assemble("a job");
    same_stills(&ground, "alone %02d.png", "farmed %02d.png");
    // A configuration that changes under the job would give frames of two kinds.
    write_configuration(&config, 2.4);
    let said = fail(ground.path(), &["farm-assemble", "a job"]);
    assert!(said.contains("0-11 were made from another"), "{said}");
}

#[test]
fn what_other_programs_open_is_written_once_all_frames_are_there() {
    let ground = Ground::new();
    let output = "shot/it's.%02d.exr";
    let more = ["--layers", "--hand-over", "nuke,blender,otio,edl"];
    let local = ["relight", "my film", "--to", output, "--json"];
    let alone = succeed(ground.path(), &[&local[..], &LOOK, &more].concat());
    std::fs::rename(ground.at("shot"), ground.at("alone")).unwrap();
    let engine = ["--engine", "openjd", "--chunk", "6"];
    ground.write_job("a job", output, &[&engine[..], &more].concat());
    ground.chunk("a job", "0-5");
    ground.chunk("a job", "6-11");
    let report = ground.assemble("a job");
    let names = |report: &Value| -> Vec<String> {
        let files = report["hand_over"].as_array().unwrap().iter();
        let name = |file: &Value| file.as_str().unwrap().rsplit('/').next().unwrap().to_owned();
        files.map(name).collect()
    };
    assert_eq!(names(&report), names(&alone));
    assert_eq!(names(&report).len(), 4);
    let all = std::fs::read_dir(ground.at("alone")).unwrap();
    let all: Vec<PathBuf> = all.map(|entry| entry.unwrap().path()).collect();
    assert!(all.len() > FRAMES + 4, "{all:?}");
    for file in all {
        let farmed = ground.at("shot").join(file.file_name().unwrap());
        assert!(std::fs::read(&file).unwrap() == std::fs::read(&farmed).unwrap(), "{}", file.display());
    }
    // An impossible handover is refused before anything is written.
    let asked = "farm;my film;--environment;nave;--hand-over;nuke;--to;none;--output;a%d.exr;--engine;slurm";
    let said = fail(ground.path(), &asked.split(';').collect::<Vec<_>>());
    assert!(said.contains("--layers"), "{said}");
    assert!(!ground.at("none").exists());
}

#[test]
fn chunks_are_sized_by_what_frames_take() {
    let ground = Ground::new();
    let written = ground.write_job("job", "a.mkv", &["--engine", "slurm"]);
    let ms = written["ms_per_frame"].as_f64().unwrap();
    assert!(ms > 0.0);
    assert_eq!(written["chunk"], 12, "ten minutes are enough for all");
    let short = ["--engine", "slurm", "--chunk-minutes", "0.05"];
    let written = ground.write_job("short", "c.mkv", &short);
    let chunk = written["chunk"].as_u64().unwrap();
    let fitting = 3000.0 / written["ms_per_frame"].as_f64().unwrap();
    assert_eq!(chunk, (fitting as u64).clamp(1, 12));
    assert!(!ground.at("short/tried").exists());
    // Smoothing depends on the previous frame.
    let smooth = ["--engine", "slurm", "--chunk", "2", "--smoothing", "0.5"];
    assert_eq!(ground.write_job("smooth", "b.mkv", &smooth)["chunk"], 12);
    // And so do the components of OLATs.
    let packed = ["--engine", "slurm", "--chunk", "2", "--field", "compressed"];
    assert_eq!(ground.write_job("packed", "d.mkv", &packed)["chunk"], 12);
}

#[test]
fn what_was_asked_for_is_helped() {
    let ground = Ground::new();
    for command in ["farm", "farm-train", "farm-chunk", "farm-assemble"] {
        let said = afterlight(ground.path(), &[command, "--help"]);
        let said = String::from_utf8_lossy(&said.stdout).into_owned();
        assert!(said.contains("Example: afterlight farm"), "{said}");
    }
}
