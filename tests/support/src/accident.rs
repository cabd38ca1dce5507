//! Programs killed at random moments, and what they leave.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant, SystemTime};

/// Environment variable with the number of kills per program; the default suits everyday tests.
const COUNT: &str = "AFTERLIGHT_CRASHES";
/// Environment variable with the seed of the moments.
const SEED: &str = "AFTERLIGHT_CRASH_SEED";

/// Random moments for killing a program.
pub struct Moments {
    /// Number of moments.
    pub count: u32,
    state: u64,
}

impl Moments {
    /// As many moments as the environment sets, a dozen by default; `name` makes each test's moments its own.
    pub fn from_name(name: &str) -> Self {
        let number = |key| std::env::var(key).ok()?.parse().ok();
        let seed: u64 = number(SEED).unwrap_or(1);
        Self {
            count: number(COUNT).map_or(12, |count| count as u32),
            state: (name.bytes()).fold(seed, |sum, b| sum.wrapping_mul(31) + u64::from(b)),
        }
    }

    /// Uniform random number in [0, 1) (SplitMix64).
    pub fn share(&mut self) -> f64 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Next moment for a program that runs for `whole` and writes into `folders`: any time of its run, or, every second
    /// time, shortly after a change of names in the folders.
    pub fn next(&mut self, whole: Duration, folders: &[&Path]) -> Moment {
        let after = whole.mul_f64(self.share());
        if self.share() < 0.5 {
            return Moment { after, changes: 0, folders: Vec::new() };
        }
        Moment {
            after: Duration::from_secs_f64(0.004 * self.share().powi(3)),
            changes: 1 + (6.0 * self.share().powi(2)) as usize,
            folders: folders.iter().map(|folder| folder.to_path_buf()).collect(),
        }
    }
}

/// Moment of a kill: a time after the start, or after a number of name changes in some folders.
#[derive(Debug)]
pub struct Moment {
    after: Duration,
    changes: usize,
    folders: Vec<PathBuf>,
}

/// End of a program.
#[derive(Debug)]
pub enum End {
    Killed,
    /// Ended before its moment; with its exit status and error output.
    Finished(ExitStatus, String),
}

impl Moment {
    /// Runs a program until the moment, and kills it. Its children end by themselves: this waits for them.
    pub fn kill(&self, command: &mut Command) -> End {
        let said = tempfile::NamedTempFile::new().unwrap();
        command.stdin(Stdio::null()).stdout(Stdio::null());
        command.stderr(said.reopen().unwrap());
        let mut child = command.spawn().expect("the program starts");
        let finished = self.wait(&mut child);
        let children = children(child.id());
        child.kill().unwrap();
        let status = child.wait().unwrap();
        for process in children {
            super::wait_for(|| (!lives(process)).then_some(()));
        }
        if finished { End::Finished(status, std::fs::read_to_string(said.path()).unwrap()) } else { End::Killed }
    }

    /// Waits for the moment; true if the program ended before it.
    fn wait(&self, child: &mut Child) -> bool {
        let names = || -> Vec<_> {
            let folders = self.folders.iter();
            let entries = folders.flat_map(|folder| std::fs::read_dir(folder).into_iter().flatten());
            let mut names: Vec<_> = entries.flatten().map(|entry| entry.path()).collect();
            names.sort();
            names
        };
        let ended = |child: &mut Child| child.try_wait().unwrap().is_some();
        let (mut before, mut changes) = (names(), 0);
        while changes < self.changes {
            if ended(child) {
                return true;
            }
            let now = names();
            if now != before {
                (before, changes) = (now, changes + 1);
            }
        }
        let started = Instant::now();
        while started.elapsed() < self.after {
            if ended(child) {
                return true;
            }
            // Some moments are only microseconds away.
            std::thread::sleep(Duration::from_micros(200).min(self.after - started.elapsed().min(self.after)));
        }
        ended(child)
    }
}

/// True while a process runs: neither gone nor a zombie.
fn lives(process: u32) -> bool {
    stat(process).is_some_and(|(state, _)| !["Z", "X"].contains(&&*state))
}

/// Children of a process.
fn children(parent: u32) -> Vec<u32> {
    let entries = std::fs::read_dir("/proc").into_iter().flatten().flatten();
    let processes = entries.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    let parents = |process: &u32| stat(*process).is_some_and(|(_, of)| of == parent);
    processes.filter(parents).collect()
}

/// State and parent of a process.
fn stat(process: u32) -> Option<(String, u32)> {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).ok()?;
    // The name before the last bracket may contain anything.
    let mut rest = stat.rsplit_once(')')?.1.split_whitespace();
    Some((rest.next()?.to_owned(), rest.next()?.parse().ok()?))
}

/// Contents of a folder: files with their bytes, links with their targets.
pub fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    for entry in std::fs::read_dir(folder).unwrap().flatten() {
        let (path, kind) = (entry.path(), entry.file_type().unwrap());
        if kind.is_symlink() {
            let to = std::fs::read_link(&path).unwrap();
            all.insert(path, to.as_os_str().as_encoded_bytes().to_vec());
        } else if kind.is_dir() {
            all.insert(path.clone(), Vec::new());
            all.extend(contents(&path));
        } else {
            let bytes = std::fs::read(&path).unwrap();
            all.insert(path, bytes);
        }
    }
    all
}

/// Unfinished files and folders below a folder.
pub fn left_over(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut found = Vec::new();
    for entry in entries {
        let (path, kind) = (entry.path(), entry.file_type().unwrap());
        let name = entry.file_name().to_string_lossy().into_owned();
        let hidden = name.starts_with('.') && name != ".lock" && !kind.is_symlink();
        if hidden {
            found.push(path.clone());
        }
        if kind.is_dir() {
            found.extend(left_over(&path));
        }
    }
    found
}

/// Makes unfinished files look a minute old: younger ones may belong to a living process.
pub fn age(files: &[PathBuf]) {
    let long_ago = SystemTime::now() - Duration::from_secs(60);
    for path in files.iter().filter(|path| path.is_file()) {
        let file = std::fs::File::options().write(true).open(path).unwrap();
        file.set_modified(long_ago).unwrap();
    }
}
