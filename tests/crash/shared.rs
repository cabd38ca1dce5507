//! Several processes on one project at a time.

use crate::Ground;
use afterlight::calibration::Calibration;
use afterlight::project::Project;
use afterlight::reflectance::checkpoint;
use burn::tensor::Device;
use std::process::{Output, Stdio};
use std::time::{Duration, Instant};
use test_support::accident::left_over;

/// Environment variable with the seconds of shared use.
const SECONDS: &str = "AFTERLIGHT_SHARED_SECONDS";

/// Runs a command, which must end in time.
fn ended(ground: &Ground, arguments: &[&str]) -> Output {
    let mut command = ground.command(arguments);
    command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    test_support::wait_for(|| child.try_wait().unwrap());
    child.wait_with_output().unwrap()
}

/// Number of completed and of refused runs of a command until `over`. The only accepted failure is a project in use.
fn hammer<'a>(ground: &Ground, over: impl Fn() -> bool, mut next: impl FnMut(u32) -> Vec<String> + 'a) -> (u32, u32) {
    let (mut done, mut refused) = (0, 0);
    while !over() {
        let arguments = next(done);
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let output = ended(ground, &arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        match output.status.code() {
            Some(0) => done += 1,
            Some(1) if said.contains("is in use by") => refused += 1,
            code => panic!("{arguments:?} ended with {code:?}: {said}"),
        }
    }
    (done, refused)
}

fn words(text: &str) -> Vec<String> {
    text.split_whitespace().map(str::to_owned).collect()
}

#[test]
fn programs_that_share_a_project_lose_nothing_and_never_hang() {
    let ground = Ground::new();
    let seconds = std::env::var(SECONDS).ok().and_then(|text| text.parse().ok());
    let deadline = Instant::now() + Duration::from_secs(seconds.unwrap_or(6));
    let over = || Instant::now() > deadline;
    let folder = ground.at("film/checkpoint");
    let first = checkpoint::info(&folder).unwrap().step;
    let (calibrated, trained, listed, relit, changed) = std::thread::scope(|threads| {
        let calibrate = threads.spawn(|| hammer(&ground, over, |_| words("calibrate film")));
        // Each training adds one epoch.
        let train = threads.spawn(|| {
            hammer(&ground, over, |done| {
                let epochs = 2 + done;
                words(&format!("train film --epochs {epochs} --device cpu --set width=8 --set checkpoint-seconds=0"))
            })
        });
        let list = threads.spawn(|| {
            hammer(&ground, over, |done| {
                let file = format!("light-{done}.hdr");
                std::fs::write(ground.at(&file), "read when it is used").unwrap();
                words(&format!("environments film --add {file}"))
            })
        });
        let relight = threads.spawn(|| {
            let relight = "relight film --device cpu --environment nave --frames 0 --to out/one.png";
            hammer(&ground, over, |_| words(relight))
        });
        let change = threads.spawn(|| {
            let mut changes = 0;
            while !over() {
                let change = |project: &mut Project| {
                    project.settings.seed += 1;
                    Ok(())
                };
                Project::change(&ground.film(), change).unwrap();
                changes += 1;
                std::thread::sleep(Duration::from_millis(5));
            }
            changes
        });
        (
            calibrate.join().unwrap(),
            train.join().unwrap(),
            list.join().unwrap(),
            relight.join().unwrap(),
            change.join().unwrap(),
        )
    });
    let project = ground.project();
    assert_eq!(project.settings.seed, 5 + changed);
    let names: Vec<String> = (project.environments().into_iter().map(|one| one.name)).collect();
    for number in 0..listed.0 {
        let name = format!("light-{number}");
        assert!(names.contains(&name), "{name} is not among {names:?}");
    }
    assert_eq!((listed.1, relit.1), (0, 0), "neither needs the project alone");
    Calibration::load(&project).unwrap();
    let state = checkpoint::load_training(&folder, &Device::flex()).unwrap();
    assert!(state.info.step > first || trained.0 == 0);
    assert!(left_over(&ground.film()).is_empty() && left_over(&ground.at("out")).is_empty());
    ground.check_outside();
    let measured = format!(
        "{} calibrations, {} trainings, {} environments, {} pictures and {changed} changes; {} refused",
        calibrated.0,
        trained.0,
        listed.0,
        relit.0,
        calibrated.1 + trained.1
    );
    eprintln!("{measured}");
    test_support::shown!(
        Accidents,
        "Several processes write into one project at a time",
        bound: "every change is saved; commands fail only because the project is in use",
        measured: measured
    );
}
