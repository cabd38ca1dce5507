//! Everything stays intact when the program is killed, when the disk is full, and when two processes collide.
//!
//! `AFTERLIGHT_CRASHES=200` sets the number of kills per command, `AFTERLIGHT_CRASH_SEED` draws other moments, and
//! `AFTERLIGHT_SHARED_SECONDS=30` sets how long processes share a project.
#![cfg(target_os = "linux")]

mod full;
mod hanging;
mod import;
mod killed;
mod odd;
mod shared;

use afterlight::project::{Lock, Project};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use test_shoot::TestShoot;
use test_support::accident::{age, contents, left_over};

/// A trained project in a folder that also holds unrelated files.
struct Ground {
    folder: tempfile::TempDir,
    /// Files outside of the project.
    outside: BTreeMap<PathBuf, Vec<u8>>,
}

impl Ground {
    /// With a small calibrated and trained project.
    fn new() -> Self {
        let ground = Self::of_shoot();
        ground.succeed(&["calibrate", "film"]);
        ground.succeed(&["train", "film", "--epochs", "1", "--set", "width=8"]);
        ground
    }

    /// With a small uncalibrated project, and links in it to files outside.
    fn of_shoot() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let at = |path: &str| folder.path().join(path);
        let shoot = TestShoot { working_size: 16, ..TestShoot::default() };
        shoot.import(folder.path(), "film");
        for file in ["a.txt", "below/b.bpk", "below/.ssh/key", "look.json", "calibration.toml"] {
            let path = at("outside").join(file);
            std::fs::create_dir_all(path.parent().unwrap()).unwrap();
            std::fs::write(path, format!("{file} is not the program's")).unwrap();
        }
        std::fs::create_dir(at("film/checkpoint")).unwrap();
        for (link, to) in [
            ("film/notes", "outside"),
            ("film/look.json", "outside/look.json"),
            ("film/calibration.toml", "outside/calibration.toml"),
            ("film/.calibration.toml.a1B2c3.afterlight", "outside/a.txt"),
            ("film/checkpoint/old.bpk", "outside/below/b.bpk"),
            ("film/checkpoint/.weights.a1B2c3.afterlight", "outside/below/.ssh"),
        ] {
            std::os::unix::fs::symlink(at(to), at(link)).unwrap();
        }
        let mut ground = Self { folder, outside: BTreeMap::new() };
        ground.outside = ground.now_outside();
        ground
    }

    fn at(&self, path: &str) -> PathBuf {
        self.folder.path().join(path)
    }

    fn film(&self) -> PathBuf {
        self.at("film")
    }

    fn project(&self) -> Project {
        Project::open(&self.film()).unwrap()
    }

    /// The program in this folder, on one core.
    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = afterlight(self.folder.path());
        command.args(arguments);
        command
    }

    /// The program relighting the interview under a built-in environment.
    fn relight(&self, environment: &str, to: &str) -> Command {
        let mut command = self.command(&["relight", "film", "--device", "cpu"]);
        command.args(["--environment", environment, "--to", to]);
        command
    }

    fn run(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().unwrap()
    }

    fn succeed(&self, arguments: &[&str]) {
        let output = self.run(arguments);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{arguments:?}: {said}");
    }

    /// Current files outside of the project.
    fn now_outside(&self) -> BTreeMap<PathBuf, Vec<u8>> {
        let mut all = contents(&self.at("outside"));
        all.extend(contents(&self.at("shoot")));
        all
    }

    /// Takes the project's lock as the next command does, a minute later; then no unfinished file is left.
    fn clean_up(&self, folder: &Path) {
        age(&left_over(folder));
        drop(Lock::take(folder, "a test").unwrap());
    }

    /// Asserts that nothing outside of the project changed.
    #[track_caller]
    fn check_outside(&self) {
        assert_eq!(self.now_outside(), self.outside);
    }
}

/// The program in a folder, which is also its cache and home, on one core.
fn afterlight(folder: &Path) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_afterlight"));
    command
        .current_dir(folder)
        .env("XDG_CACHE_HOME", folder.join("cache"))
        .env("CUBECL_DEBUG_LOG", folder.join("kernels.log"))
        .env("RAYON_NUM_THREADS", "1");
    command
}
