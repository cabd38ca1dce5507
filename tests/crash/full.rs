//! A disk that fills up at any byte.

use crate::{Ground, afterlight};
use ::afterlight::calibration::Calibration;
use ::afterlight::imaging::file::read_encoded;
use ::afterlight::project::{Project, relative};
use ::afterlight::reflectance::checkpoint;
use burn::tensor::Device;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use test_support::accident::{Moments, left_over};
use test_support::small_disk::SmallDisk;
use test_support::{Need, require};

/// The commands that write.
const COMMANDS: [&str; 5] = [
    "import again-NUMBER --shoot shoot --size 16",
    "calibrate film",
    "train film --epochs EPOCHS --device cpu --set width=8 --set checkpoint-seconds=0",
    "relight film --device cpu --environment nave --to out/%02d.png",
    "relight film --device cpu --environment nave --to out/clip.mp4",
];

/// Words of a command, made unique for each call by `number`.
fn words(command: &str, number: u32) -> Vec<String> {
    let command = command.replace("NUMBER", &number.to_string());
    let command = command.replace("EPOCHS", &(2 + number).to_string());
    command.split_whitespace().map(str::to_owned).collect()
}

/// Asserts that the program succeeded, or failed with a message that names a file and the lack of room; returns true if
/// it failed.
fn is_refused(output: &Output, folder: &Path) -> bool {
    let said = String::from_utf8_lossy(&output.stderr);
    match output.status.code() {
        Some(0) => false,
        Some(1) => {
            let sentence = said.lines().last().unwrap_or_default();
            let file = ["film", "again", "out"].iter().any(|name| sentence.contains(name));
            assert!(
                sentence.starts_with("afterlight: cannot write ") && file && sentence.contains("room"),
                "in {}: {said}",
                folder.display()
            );
            true
        }
        code => panic!("it ended with {code:?}: {said}"),
    }
}

/// Asserts that all remaining files are intact.
fn check(ground: &Ground, folder: &Path, step: u64) -> u64 {
    let project = Project::open(&folder.join("film")).unwrap();
    Calibration::load(&project).unwrap();
    let now = checkpoint::load_training(&project.checkpoint_path(), &Device::flex()).unwrap();
    assert!(now.info.step >= step);
    let entries = |folder: PathBuf| std::fs::read_dir(folder).into_iter().flatten().flatten();
    for still in entries(folder.join("out")).map(|entry| entry.path()) {
        if still.extension().is_some_and(|ending| ending == "png") {
            read_encoded(&still).unwrap();
        }
    }
    for again in entries(folder.to_owned()).map(|entry| entry.path()) {
        if again.join("project.toml").exists() {
            Project::open(&again).unwrap();
        }
    }
    ground.check_outside();
    now.info.step
}

/// Asserts that no unfinished file is left except those that the next training save removes.
fn check_left_over(folder: &Path) {
    let left = left_over(folder);
    let hidden = |path: &Path| path.components().any(|part| part.as_os_str() == "checkpoints");
    assert!(left.iter().all(|path| hidden(path)), "{left:?}");
}

#[test]
fn a_file_that_can_grow_no_more_at_any_byte_ends_every_command_with_a_sentence() {
    let prlimit = Command::new("prlimit").arg("--version").output().is_ok();
    if !require(Need::Prlimit, prlimit, "prlimit is not installed") || !test_support::ffmpeg() {
        return;
    }
    let ground = Ground::new();
    let mut moments = Moments::from_name("file size");
    let (mut refused, mut step) = (0, 1);
    for number in 0..moments.count {
        let command = COMMANDS[number as usize % COMMANDS.len()];
        // Small files are as likely to be hit as large ones: limits from 1 byte to 1 MB.
        let bytes = 10f64.powf(6.0 * moments.share()) as u64;
        // The system's signal would end the program before it could print a message.
        let script = format!("trap '' XFSZ; exec prlimit --fsize={bytes} \"$@\"");
        let program = ground.command(&[]).get_program().to_owned();
        let mut limited = Command::new("sh");
        limited.args(["-c", &script, "sh"]).arg(program);
        limited.args(words(command, number));
        let plain = ground.command(&[]);
        let settings = plain.get_envs().filter_map(|(key, value)| Some((key, value?)));
        let folder = ground.folder.path();
        limited.envs(settings).current_dir(folder);
        let output = limited.output().unwrap();
        refused += u32::from(is_refused(&output, folder));
        step = check(&ground, folder, step);
        check_left_over(&ground.at("out"));
        check_left_over(&ground.film());
    }
    let last = words(COMMANDS[2], moments.count + 1);
    ground.succeed(&last.iter().map(String::as_str).collect::<Vec<_>>());
    let measured = format!("{} runs, {refused} of them refused", moments.count);
    eprintln!("{measured}");
    test_support::shown!(
        Accidents,
        "A file size limit reached at any byte",
        bound: "exit code 1 with that message; earlier files are intact, and no unfinished file is left",
        measured: measured
    );
}

#[test]
fn a_disk_that_fills_at_any_time_ends_every_command_with_a_sentence() {
    if !test_support::ffmpeg() {
        return;
    }
    let ground = Ground::new();
    let mut moments = Moments::from_name("small disk");
    let mut refused = 0;
    for number in 0..moments.count {
        // Files are small: from a page to a MB.
        let room = 10f64.powf(3.6 + 2.4 * moments.share()) as u64;
        let used = size(&ground.film()).div_ceil(1024) as usize;
        let Some(disk) = SmallDisk::mount(used + 2048) else { return };
        let folder = disk.0.path();
        let copied = Command::new("cp").arg("-a").arg(ground.film()).arg(folder).status();
        assert!(copied.unwrap().success());
        std::os::unix::fs::symlink(ground.at("shoot"), folder.join("shoot")).unwrap();
        // Relative path from the copied project to the original shoot.
        let shoot = relative(&folder.join("film"), &ground.at("shoot")).unwrap();
        Project::change(&folder.join("film"), |project| {
            project.settings.shoot.folder = shoot;
            Ok(())
        })
        .unwrap();
        fill(&folder.join("ballast"), room);
        let before = checkpoint::info(&folder.join("film/checkpoint")).unwrap().step;
        let command = COMMANDS[number as usize % COMMANDS.len()];
        let mut program = afterlight(folder);
        program.args(words(command, number));
        // Burn's own cache is kept elsewhere.
        program.env("XDG_CACHE_HOME", ground.at("cache"));
        program.env("CUBECL_DEBUG_LOG", ground.at("kernels.log"));
        let output = program.output().unwrap();
        refused += u32::from(is_refused(&output, folder));
        check(&ground, folder, before);
        check_left_over(folder);
    }
    let measured = format!("{} runs, {refused} of them refused", moments.count);
    eprintln!("{measured}");
    test_support::shown!(
        Accidents,
        "A disk that fills at any time",
        bound: "exit code 1 with that message; earlier files are intact, and no unfinished file is left",
        measured: measured
    );
}

/// Fills the disk with a file, then frees `room` bytes.
fn fill(path: &Path, room: u64) {
    let mut file = std::fs::File::create(path).unwrap();
    while std::io::Write::write_all(&mut file, &[0; 4096]).is_ok() {}
    let length = file.metadata().unwrap().len();
    file.set_len(length - room).unwrap();
}

/// Disk usage of a folder's files in bytes, in whole pages.
fn size(folder: &Path) -> u64 {
    let entries = std::fs::read_dir(folder).unwrap().flatten();
    let sizes = entries.map(|entry| {
        let data = entry.metadata().unwrap();
        if data.is_dir() { size(&entry.path()) + 4096 } else { data.len().next_multiple_of(4096) + 4096 }
    });
    sizes.sum()
}
