//! Ctrl-C while ffmpeg hangs.

use crate::Ground;
use std::process::{Command, Stdio};
use test_support::accident::left_over;

#[test]
fn ctrl_c_ends_an_export_whose_ffmpeg_hangs() {
    let ground = Ground::new();
    let (tools, started) = (ground.at("tools"), ground.at("started"));
    std::fs::create_dir(&tools).unwrap();
    let text = format!("#!/bin/sh\necho $$ >{0}.new; mv {0}.new {0}\nsleep 100000\n", started.display());
    std::fs::write(ground.at("hanging"), text).unwrap();
    // A file that this process wrote may still be open in a child of another test; it could not be started then.
    let installed = Command::new("install").arg(ground.at("hanging")).arg(tools.join("ffmpeg")).status();
    assert!(installed.unwrap().success());
    let path = std::env::var("PATH").unwrap();
    let mut command = ground.relight("nave", "out/clip.mp4");
    command.env("PATH", format!("{}:{path}", tools.display())).stderr(Stdio::piped());
    let child = command.spawn().unwrap();
    test_support::wait_for(|| started.exists().then_some(()));
    let pid = child.id().to_string();
    assert!(Command::new("kill").args(["-INT", &pid]).status().unwrap().success());
    let output = child.wait_with_output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(said.contains("stopped on request: no movie was written"), "{said}");
    let ffmpeg = std::fs::read_to_string(&started).unwrap();
    let stat = std::fs::read_to_string(format!("/proc/{}/stat", ffmpeg.trim())).unwrap_or_default();
    assert!(stat.is_empty() || stat.contains(") Z "), "{stat}");
    assert!(left_over(&ground.at("out")).is_empty() && !ground.at("out/clip.mp4").exists());
    test_support::shown!(
        Surroundings,
        "Ctrl-C while ffmpeg hangs",
        done: "ffmpeg is killed, its file removed, and a message says that no movie was written"
    );
}
