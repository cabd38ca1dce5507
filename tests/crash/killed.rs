//! Commands that are killed at random moments.

use crate::Ground;
use afterlight::calibration::Calibration;
use afterlight::project::{Lock, Project};
use afterlight::reflectance::checkpoint;
use burn::tensor::Device;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};
use test_support::accident::{End, Moments, age, left_over};

/// Results of killing a command repeatedly.
#[derive(Default)]
struct Tally {
    killed: u32,
    finished: u32,
    /// Kills that left an unfinished file.
    unfinished: u32,
}

impl Tally {
    /// Counts a run that was to be killed; if it ended sooner, it must have succeeded.
    fn add(&mut self, end: End, left_over: usize) {
        match end {
            End::Killed => self.killed += 1,
            End::Finished(status, said) => {
                assert!(status.success(), "{said}");
                self.finished += 1;
                assert!(self.finished < 100 + 10 * self.killed, "it is hardly ever killed");
            }
        }
        self.unfinished += u32::from(left_over > 0);
    }

    fn sentence(&self) -> String {
        let Self { killed, finished, unfinished } = self;
        // For runs with another number of kills.
        let sentence =
            format!("{killed} kills, {unfinished} of them with something unfinished; {finished} runs ended before");
        eprintln!("{sentence}");
        sentence
    }
}

/// Run time of a command without a kill.
fn measured(command: &mut Command) -> Duration {
    let started = Instant::now();
    let output = command.output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    started.elapsed()
}

#[test]
fn a_killed_import_leaves_no_project_or_a_whole_one() {
    let ground = Ground::of_shoot();
    let import = |name: &str| ground.command(&["import", name, "--shoot", "shoot", "--size", "16"]);
    let mut moments = Moments::from_name("import");
    let whole = measured(&mut import("unkilled"));
    let wanted = Project::open(&ground.at("unkilled")).unwrap().settings;
    let mut tally = Tally::default();
    while tally.killed < moments.count {
        let i = tally.killed + tally.finished;
        let root = ground.at(&format!("import-{i}"));
        let end = moments.next(whole, &[&root]).kill(&mut import(&format!("import-{i}")));
        tally.add(end, left_over(&root).len());
        if !root.join("project.toml").exists() {
            // Leftovers do not block another import.
            age(&left_over(&root));
            ground.succeed(&["import", &format!("import-{i}"), "--shoot", "shoot", "--size", "16"]);
        }
        assert_eq!(Project::open(&root).unwrap().settings, wanted);
        ground.clean_up(&root);
        assert!(left_over(&root).is_empty());
    }
    ground.check_outside();
    test_support::shown!(
        Accidents,
        "`import` is killed",
        bound: "each project is complete or absent, and can be imported again",
        measured: tally.sentence()
    );
}

#[test]
fn a_killed_calibration_leaves_the_old_one_or_the_new_one() {
    let ground = Ground::of_shoot();
    let gammas: [&[&str]; 2] = [&["--gamma", "srgb"], &[]];
    let path = ground.at("film/calibration.toml");
    let command = |which: usize| ground.command(&[&["calibrate", "film"], gammas[which]].concat());
    let mut moments = Moments::from_name("calibrate");
    let known = [0, 1].map(|which| {
        let whole = measured(&mut command(which));
        (whole, std::fs::read(&path).unwrap())
    });
    assert_ne!(known[0].1, known[1].1);
    let settings = ground.project().settings;
    let mut tally = Tally::default();
    while tally.killed < moments.count {
        let i = (tally.killed + tally.finished) as usize;
        let moment = moments.next(known[i % 2].0, &[&ground.film()]);
        let end = moment.kill(&mut command(i % 2));
        tally.add(end, left_over(&ground.film()).len());
        let now = std::fs::read(&path).unwrap();
        assert!(known.iter().any(|(_, bytes)| *bytes == now));
        assert_eq!(ground.project().settings, settings);
        Calibration::load(&ground.project()).unwrap();
        // The next calibration removes it.
        age(&left_over(&ground.film()));
    }
    ground.clean_up(&ground.film());
    assert!(left_over(&ground.film()).is_empty());
    ground.check_outside();
    test_support::shown!(
        Accidents,
        "`calibrate` is killed",
        bound: "the old calibration or the new one, byte for byte; no file outside the project changed",
        measured: tally.sentence()
    );
}

#[test]
fn a_killed_training_loses_nothing_older_than_one_save() {
    let ground = Ground::of_shoot();
    ground.succeed(&["calibrate", "film"]);
    let settings = [
        "train",
        "film",
        "--device",
        "cpu",
        "--hold-out",
        "1",
        "--set",
        "width=8",
        "--set",
        "most-channels=16",
        "--set",
        "minutes=none",
        "--set",
        "checkpoint-seconds=0",
    ];
    let train = || ground.command(&settings);
    let folder = ground.at("film/checkpoint");
    let step = || checkpoint::info(&folder).map_or(0, |info| info.step);
    // Measures the time until training resumes; then training runs for ever.
    let started = Instant::now();
    let mut first = train().spawn().unwrap();
    test_support::wait_for(|| (step() > 2).then_some(()));
    let mut whole = 2 * started.elapsed();
    first.kill().unwrap();
    first.wait().unwrap();

    let mut moments = Moments::from_name("train");
    let mut tally = Tally::default();
    let checkpoints = ground.at("film/checkpoints");
    let film = ground.film();
    let (mut before, mut resumed) = (step(), 0);
    while tally.killed < moments.count || resumed == 0 {
        if tally.killed >= moments.count {
            // The machine has had other work since, and no run had the time to resume.
            whole *= 2;
            assert!(whole < test_support::PATIENCE, "no run resumed");
        }
        let moment = moments.next(whole, &[&folder, &checkpoints, &film]);
        let end = moment.kill(&mut train());
        assert!(matches!(end, End::Killed), "{end:?}");
        tally.add(end, left_over(&film).len());
        let state = checkpoint::load_training(&folder, &Device::flex()).unwrap();
        assert!(state.info.step >= before && state.optimizer.is_some());
        resumed += u32::from(state.info.step > before);
        before = state.info.step;
        for kept in afterlight::training::checkpoints::list(&ground.project()) {
            checkpoint::load(&kept.folder(&ground.project()), &Device::flex()).unwrap();
        }
        age(&left_over(&film));
    }
    ground.check_training(before, &settings);
    ground.check_outside();
    test_support::shown!(
        Accidents,
        "`train` is killed, saving after each step",
        bound: "the step never goes back; every kept checkpoint loads; no file outside the project changed",
        measured: format!("{}; {resumed} runs resumed", tally.sentence())
    );
}

impl Ground {
    /// Training continues from `step`, its log has each step once, and no unfinished file is left.
    fn check_training(&self, step: u64, settings: &[&str]) {
        let folder = self.at("film/checkpoint");
        let mut last = self.command(settings).spawn().unwrap();
        test_support::wait_for(|| checkpoint::info(&folder).is_ok_and(|info| info.step > step + 1).then_some(()));
        last.kill().unwrap();
        last.wait().unwrap();
        let log = std::fs::read_to_string(self.at("film/training.csv")).unwrap();
        let steps: Vec<u64> = (log.lines().skip(1)).filter_map(|line| line.split(',').next()?.parse().ok()).collect();
        assert!(steps.is_sorted_by(|a, b| a < b), "{steps:?}");
        self.clean_up(&self.film());
        // The next save removes what training itself leaves.
        let left = left_over(&self.film());
        let hidden = |path: &Path| path.parent().is_some_and(|at| at.ends_with("checkpoints"));
        let (folders, files): (Vec<_>, Vec<_>) = left.iter().partition(|path| hidden(path));
        let within = |file: &PathBuf| folders.iter().any(|folder| file.starts_with(folder));
        assert!(folders.len() <= 1 && files.into_iter().all(within), "{left:?}");
    }
}

#[test]
fn killed_stills_are_whole_or_not_there() {
    let ground = Ground::new();
    let relight = |light: &str| ground.relight(light, "out/%02d.png");
    let lights = ["nave", "courtyard"];
    let files = || [0, 1, 2].map(|frame| std::fs::read(ground.at(&format!("out/{frame:02}.png"))));
    let mut moments = Moments::from_name("stills");
    let known = lights.map(|light| {
        let whole = measured(&mut relight(light));
        (whole, files().map(Result::unwrap))
    });
    let mut tally = Tally::default();
    let out = ground.at("out");
    while tally.killed < moments.count {
        let i = (tally.killed + tally.finished) as usize;
        let which = i % lights.len();
        let end = moments.next(known[which].0, &[&out]).kill(&mut relight(lights[which]));
        tally.add(end, left_over(&out).len());
        for (frame, bytes) in files().into_iter().enumerate() {
            let bytes = bytes.unwrap();
            assert!(known.iter().any(|(_, files)| files[frame] == bytes));
        }
        age(&left_over(&out));
    }
    measured(&mut relight(lights[0]));
    assert_eq!(files().map(Result::unwrap), known[0].1);
    assert!(left_over(&ground.film()).is_empty() && left_over(&out).is_empty());
    ground.check_outside();
    test_support::shown!(
        Accidents,
        "`relight` is killed while it writes stills",
        bound: "each still is the old one or the new one, byte for byte",
        measured: tally.sentence()
    );
}

#[test]
fn a_killed_movie_is_the_old_one() {
    if !test_support::ffmpeg() {
        return;
    }
    let ground = Ground::new();
    let movie = ground.at("out/clip.mp4");
    let export = || ground.relight("nave", "out/clip.mp4");
    let frames = || {
        let mut probe = Command::new("ffprobe");
        probe.args(["-v", "error", "-count_frames", "-show_entries", "stream=nb_read_frames"]);
        let output = probe.args(["-of", "csv=p=0"]).arg(&movie).output().unwrap();
        String::from_utf8_lossy(&output.stdout).trim().to_owned()
    };
    let mut moments = Moments::from_name("clip");
    let whole = measured(&mut export());
    let mut tally = Tally::default();
    let out = ground.at("out");
    while tally.killed < moments.count {
        let end = moments.next(whole, &[&out]).kill(&mut export());
        tally.add(end, left_over(&out).len());
        assert_eq!(frames(), "3");
        age(&left_over(&out));
    }
    measured(&mut export());
    assert!(left_over(&out).is_empty() && left_over(&ground.film()).is_empty());
    ground.check_outside();
    // The lock of a dead process is released at once.
    drop(Lock::take(&ground.film(), "a test").unwrap());
    test_support::shown!(
        Accidents,
        "`relight` is killed while ffmpeg writes a movie",
        bound: "the movie has all its frames; no process and no file is left",
        measured: tally.sentence()
    );
}
