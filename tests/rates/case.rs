//! Cases to measure: the demo's interview at several plate sizes and working sizes, with more and fewer lamps.

use base::{Error, Result};
use measuring::{Program, printed};
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Sizes of a case.
#[derive(Debug, PartialEq, Eq)]
pub struct Case {
    /// Columns and rows of the plates.
    pub plate: (usize, usize),
    /// Working size in pixels.
    pub network: usize,
    pub lamps: usize,
    /// True for EXR stills; otherwise frames become ProRes 4444.
    pub stills: bool,
}

const fn case(plate: (usize, usize), network: usize, lamps: usize, stills: bool) -> Case {
    Case { plate, network, lamps, stills }
}

const HD: (usize, usize) = (1080, 1920);

/// The first case is the basis of the simulated tables.
pub const CASES: [Case; 6] = [
    case(HD, 128, 41, false),
    case(HD, 128, 41, true),
    case(HD, 64, 41, false),
    case(HD, 128, 10, false),
    case((540, 960), 128, 41, false),
    case((2160, 3840), 128, 41, false),
];

impl Case {
    /// Name of the case in tables.
    pub fn words(&self) -> String {
        let (width, height) = self.plate;
        let files = if self.stills { "EXR" } else { "ProRes 4444" };
        format!("{width} × {height}, {} px, {} lamps, {files}", self.network, self.lamps)
    }

    /// Its project in `folder`, and its shoot, made if missing. The network is barely trained: it takes as long as a
    /// trained one.
    pub fn prepare(&self, afterlight: Program, folder: &Path) -> Result<[PathBuf; 2]> {
        let (width, height) = self.plate;
        let Self { network, lamps, .. } = self;
        let project = folder.join(format!("{width}x{height}-{network}-{lamps}"));
        let shoot = folder.join(format!("shoot-{width}x{height}"));
        if project.join("checkpoint/checkpoint.toml").exists() {
            return Ok([project, shoot]);
        }
        let demo = folder.join("demo");
        afterlight.run(&["demo", &text(&demo), "--prepare"])?;
        enlarge(&demo.join("shoot"), &shoot, self.plate)?;
        let (name, from) = (text(&project), text(&shoot));
        let [network, lamps] = [network, lamps].map(ToString::to_string);
        // A stopped run may have left it.
        if !project.join("project.toml").exists() {
            let import = ["import", &name, "--shoot", &from, "--size", &network, "--lamps", &lamps];
            afterlight.run(&import)?;
        }
        afterlight.run(&["calibrate", &name])?;
        afterlight.run(&["train", &name, "--minutes", "0.1", "--device", "cpu"])?;
        Ok([project, shoot])
    }
}

/// True for a plate or a matte of the interview.
pub fn is_interview(shoot: &Path, file: &Path) -> bool {
    let inside = file.strip_prefix(shoot).unwrap_or(file);
    let folder = inside.components().next();
    folder.is_some_and(|folder| {
        let name = folder.as_os_str().to_string_lossy();
        name == "interview" || name == "interview_masks"
    })
}

/// Copies a shoot, with its interview at another size.
fn enlarge(from: &Path, to: &Path, (width, height): (usize, usize)) -> Result<()> {
    let fail = |e: std::io::Error| Error::io("copy", from, e, "Make room on the disk");
    // This file is copied last.
    const MARK: &str = "manifest.json";
    if to.join(MARK).exists() {
        return Ok(());
    }
    for file in files(from)? {
        let target = to.join(file.strip_prefix(from).unwrap_or(&file));
        std::fs::create_dir_all(target.parent().unwrap_or(to)).map_err(fail)?;
        if is_interview(from, &file) {
            scale(&file, &target, (width, height))?;
        } else if !file.ends_with(MARK) {
            std::fs::copy(&file, &target).map_err(fail)?;
        }
    }
    std::fs::copy(from.join(MARK), to.join(MARK)).map_err(fail)?;
    Ok(())
}

/// All files in a folder, recursively.
pub fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let fail = |e: std::io::Error| Error::io("read", folder, e, "Check that it can be read");
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(fail)? {
        let path = entry.map_err(fail)?.path();
        if path.is_dir() { found.extend(files(&path)?) } else { found.push(path) }
    }
    Ok(found)
}

fn scale(from: &Path, to: &Path, (width, height): (usize, usize)) -> Result<()> {
    let mut ffmpeg = Command::new("ffmpeg");
    ffmpeg.args(["-v", "error", "-y", "-i"]).arg(from);
    let filter = format!("scale={width}:{height}:flags=lanczos");
    printed(ffmpeg.args(["-q:v", "2", "-vf", &filter]).arg(to)).map(drop)
}

/// A path as an argument.
pub fn text(path: &Path) -> Cow<'_, str> {
    path.to_string_lossy()
}
