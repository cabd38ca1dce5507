//! Jobs run by real engines: Open Job Description's reference implementation, and Slurm on this machine.

use crate::job::{FRAMES, Ground, kill_the_worker};
use std::path::Path;
use std::process::{Command, Output, Stdio};
use test_support::{Slurm, shown};

/// Output of `openjd`, which must succeed or fail as stated.
fn openjd(program: &Path, succeeds: bool, arguments: &[&str]) -> String {
    let output = Command::new(program).args(arguments).output().unwrap();
    let said = said(&output);
    assert_eq!(output.status.success(), succeeds, "{arguments:?}: {said}");
    said
}

fn said(output: &Output) -> String {
    let [out, err] = [&output.stdout, &output.stderr].map(|b| String::from_utf8_lossy(b));
    format!("{out}{err}")
}

#[test]
fn open_job_description_runs_a_job_whose_worker_is_killed() {
    let (Some(program), true) = (test_support::openjd(), test_support::ffmpeg()) else { return };
    let ground = Ground::new();
    ground.export("alone.mov");
    let written = ground.write_job("a job", "joined.mov", &["--engine", "openjd", "--chunk", "6"]);
    let template = ground.text("a job/template.json");
    assert!(written["submit"].as_str().unwrap().contains("template.json"));
    openjd(&program, true, &["check", &template]);
    let summary = openjd(&program, true, &["summary", &template]);
    assert!(summary.contains("Relight") && summary.contains("Assemble"), "{summary}");
    // The first chunk is killed half-way; its engine reports the failure.
    let tasks = r#"[{"Frame": 0}]"#;
    let first = ["run", &template, "--step", "Relight", "--tasks", tasks];
    let running = Command::new(&program).args(first).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let job = ground.at("a job").canonicalize().unwrap();
    kill_the_worker(&job, &ground.frame("a job", 0));
    let output = running.wait_with_output().unwrap();
    assert!(!output.status.success(), "{}", said(&output));
    let left = ground.frames("a job");
    assert!((1..6).contains(&left.len()), "{left:?}");
    // Runs everything again with other chunks, set by a job parameter.
    let whole = ["run", &template, "--step", "Assemble", "--run-dependencies", "-p", "ChunkSize=4"];
    let told = openjd(&program, true, &whole);
    assert!(told.contains(&format!("({} existed before)", left.len().min(4))), "{told}");
    assert!(ground.read("joined.mov") == ground.read("alone.mov"));
    shown!(Accidents, "A farm worker is killed under Open Job Description, and the job is run again",
        bound: "the movie of one export", measured: "equal bytes");
}

#[test]
fn open_job_description_s_templates_say_what_they_need() {
    let Some(program) = test_support::openjd() else { return };
    let ground = Ground::new();
    let more = ["--engine", "openjd", "--chunk", "1", "--memory", "7.5", "--frames", "3-3"];
    ground.write_job("one", "one.%04d.png", &more);
    let text = std::fs::read_to_string(ground.at("one/template.json")).unwrap();
    let template: serde_json::Value = serde_json::from_str(&text).unwrap();
    let needs = &template["steps"][0]["hostRequirements"]["amounts"];
    assert_eq!(needs[1]["min"], 7153, "7.5 GB in MiB");
    openjd(&program, true, &["check", &ground.text("one/template.json")]);
    openjd(&program, true, &["run", &ground.text("one/template.json"), "--step", "Assemble", "--run-dependencies"]);
    assert!(ground.at("one.0003.png").is_file());
    // The same program refuses an invalid template.
    std::fs::write(ground.at("one/template.json"), text.replace("INT", "IMT")).unwrap();
    openjd(&program, false, &["check", &ground.text("one/template.json")]);
}

#[test]
fn slurm_runs_a_job_whose_worker_is_killed() {
    if !test_support::ffmpeg() {
        return;
    }
    let Some(slurm) = Slurm::start() else { return };
    let ground = Ground::new();
    ground.export("alone.mov");
    let written = ground.write_job("a job", "joined.mov", &["--engine", "slurm", "--chunk", "6", "--memory", "0.5"]);
    let submit = || {
        let mut shell = slurm.command("sh");
        let output = shell.args(["-c", written["submit"].as_str().unwrap()]).output().unwrap();
        assert!(output.status.success(), "{}", said(&output));
        said(&output)
    };
    let log = |name: &str| std::fs::read_to_string(ground.at("a job/logs").join(name)).unwrap_or_default();
    let told = submit();
    assert!(told.contains("tasks 0 to 1"), "{told}");
    let job = ground.at("a job").canonicalize().unwrap();
    kill_the_worker(&job, &ground.frame("a job", 0));
    // The last step waits for chunks to succeed: it never starts, and is cancelled in the queue.
    let ended = test_support::wait_for(|| {
        let queue = slurm.command("squeue").args(["-h", "-o", "%j %r"]).output().unwrap();
        let queue = String::from_utf8_lossy(&queue.stdout).into_owned();
        let waits = queue.lines().count() == 1 && queue.contains("Dependency");
        (waits || queue.is_empty()).then_some(queue)
    });
    assert!(!ground.at("joined.mov").exists(), "{ended}");
    let left = ground.frames("a job").len();
    assert!(left < FRAMES, "{left}");
    slurm.command("scancel").arg("--user=root").status().unwrap();
    slurm.wait_until_empty().unwrap();
    submit();
    slurm.wait_until_empty().unwrap();
    let told = [log("chunk-0.log"), log("chunk-1.log"), log("assemble.log")];
    assert!(ground.at("joined.mov").exists(), "{told:?}");
    assert!(ground.read("joined.mov") == ground.read("alone.mov"));
    assert!(told[2].contains("All 12 frames"), "{told:?}");
    shown!(Accidents, "A farm worker is killed under Slurm, and the job is submitted again",
        bound: "the movie of one export", measured: "equal bytes");
}
