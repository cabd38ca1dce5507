//! What all tests of the farm begin with: a project with a network that has hardly learnt anything, and its export.

use crate::program::{afterlight, succeed};
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::OnceLock;
use tempfile::TempDir;
use test_shoot::TestShoot;
use test_support::wait_for;

/// Frames of the interview.
pub const FRAMES: usize = 12;
/// Where the look of all exports comes from. Names have spaces, as people's have.
const LOOK: [&str; 5] = ["--environment", "nave", "--turntable", "--device", "cpu"];

/// A folder with the project `my film` of the shoot `the shoot`.
pub struct Ground {
    folder: TempDir,
}

impl Ground {
    /// A copy of the project that is made once.
    pub fn new() -> Self {
        static MADE: OnceLock<TempDir> = OnceLock::new();
        let made = MADE.get_or_init(|| {
            let folder = tempfile::tempdir().unwrap();
            let shoot = TestShoot {
                frames: FRAMES,
                size: 64,
                working_size: 64,
                ..TestShoot::default()
            };
            shoot.calibrate(folder.path(), "my film");
            let train = "--epochs 1 --device cpu --set width=8 --set most-channels=16";
            let train: Vec<&str> = train.split(' ').collect();
            succeed(
                folder.path(),
                &[&["train", "my film", "--json"], &train[..]].concat(),
            );
            folder
        });
        let folder = tempfile::Builder::new()
            .prefix("a farm ")
            .tempdir()
            .unwrap();
        copy(made.path(), folder.path());
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

    /// Exports on this machine, as a person does.
    pub fn export(&self, to: &str) {
        succeed(
            self.path(),
            &[&["relight", "my film", "--to", to, "--json"], &LOOK[..]].concat(),
        );
    }

    /// Writes a job of the same export; what the program says of it.
    pub fn write_job(&self, job: &str, output: &str, more: &[&str]) -> Value {
        let begin = ["farm", "my film", "--to", job, "--output", output, "--json"];
        succeed(self.path(), &[&begin[..], &LOOK, more].concat())
    }

    pub fn chunk(&self, job: &str, frames: &str) -> Value {
        succeed(
            self.path(),
            &["farm-chunk", job, "--frames", frames, "--json"],
        )
    }

    pub fn assemble(&self, job: &str) -> Value {
        succeed(self.path(), &["farm-assemble", job, "--json"])
    }

    pub fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.at(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    /// Which of a movie's frames are there.
    pub fn frames(&self, job: &str) -> Vec<usize> {
        (0..FRAMES)
            .filter(|frame| self.frame(job, *frame).is_file())
            .collect()
    }

    pub fn frame(&self, job: &str, frame: usize) -> PathBuf {
        afterlight::export::movie_frame(&self.at(job).join("frames"), frame)
    }

    /// Starts a chunk, and kills it once its first frame is there.
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

/// Kills the program that works on the job in `folder`, as soon as there is one and `file` is there.
pub fn kill_the_worker(folder: &Path, file: &Path) {
    wait_for(|| file.is_file().then_some(()));
    let job = folder.display().to_string();
    let processes = std::fs::read_dir("/proc").unwrap().flatten();
    let is_worker = |process: &PathBuf| {
        let words = std::fs::read(process.join("cmdline")).unwrap_or_default();
        let words = String::from_utf8_lossy(&words).into_owned();
        let here = std::fs::read_link(process.join("cwd")).unwrap_or_default();
        let is_ours = words.contains(&job) || here == folder;
        is_ours
            && words.split('\0').any(|word| word == "farm-chunk")
            && words.contains("afterlight\0")
    };
    let workers: Vec<PathBuf> = processes.map(|p| p.path()).filter(is_worker).collect();
    for worker in &workers {
        let pid = worker.file_name().unwrap();
        Command::new("kill").arg("-9").arg(pid).status().unwrap();
    }
    assert!(!workers.is_empty(), "the worker was faster");
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        let to = to.join(entry.file_name());
        match entry.file_type().unwrap().is_dir() {
            true => copy(&entry.path(), &to),
            false => drop(std::fs::copy(entry.path(), to).unwrap()),
        }
    }
}

/// A checksum of each frame that a movie shows, and when.
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
    for (ending, more) in [
        ("mp4", &[][..]),
        ("mov", &[]),
        ("mkv", &["--no-background"]),
    ] {
        let (alone, joined) = (format!("alone.{ending}"), format!("joined.{ending}"));
        let job = format!("job of {ending}");
        let local = ["relight", "my film", "--to", &alone, "--json"];
        succeed(ground.path(), &[&local[..], &LOOK, more].concat());
        let written = ground.write_job(
            &job,
            &joined,
            &[&["--engine", "slurm", "--chunk", "5"], more].concat(),
        );
        assert_eq!(
            (&written["tasks"], &written["chunks"]),
            (&12.into(), &3.into())
        );
        // In any order.
        for frames in ["10+5", "0+5", "5+5"] {
            ground.chunk(&job, frames);
        }
        let report = ground.assemble(&job);
        assert_eq!(report["frames"], 12);
        assert_eq!(report["chunks"].as_array().unwrap().len(), 3);
        assert!(report["frame_bytes"].as_u64().unwrap() > 1000);
        // Matroska writes a random number into each file.
        let of = |movie: &str| match ending {
            "mkv" => frame_sums(&ground.at(movie)),
            _ => ground.read(movie),
        };
        assert!(of(&joined) == of(&alone), "{ending}");
    }
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
        for frame in 0..FRAMES {
            let [alone, farmed] = [&alone, &farmed].map(|name| {
                let name = name.replace("%02d", &format!("{frame:02}"));
                ground.read(&name)
            });
            assert!(alone == farmed, "{name}, frame {frame}");
        }
    }
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
    // Smoothing goes from frame to frame.
    let smooth = ["--engine", "slurm", "--chunk", "2", "--smoothing", "0.5"];
    assert_eq!(ground.write_job("smooth", "b.mkv", &smooth)["chunk"], 12);
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
