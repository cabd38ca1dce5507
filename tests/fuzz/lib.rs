//! Fuzzing: randomly changed files and texts for every reader.
//!
//! A target starts from valid files, written by the program itself, changes them by random draws, and reads them. A
//! reader must end with a value or with an error that names the file, and stay within its memory limit. Earlier
//! failures are in `tests/fuzz/cases` and are read first.
//!
//! `AFTERLIGHT_FUZZ_SECONDS` sets the run time of each target; the default is about half a minute for all together.
//! `AFTERLIGHT_FUZZ_SEED` changes the draws. `AFTERLIGHT_FUZZ_CASE` names a file to read first. With the feature
//! `bolero`, bolero's engines make the draws: `cargo bolero test -p afterlight-fuzz --features bolero TARGET` with
//! cargo-bolero.

mod change;
mod memory;

#[cfg(feature = "bolero")]
pub use bolero;
pub use change::png_checksums;
pub use memory::Counted;

use proptest::test_runner::{Config, RngAlgorithm, TestRng, TestRunner};
use std::cell::Cell;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use test_support::{PATIENCE, repository};

/// Largest heap of a reader in bytes: two copies of the largest readable picture, with 12 bytes for each of
/// `imaging::file::MAX_PIXELS`, and the decoder's memory.
pub const MOST_MEMORY: usize = 4 << 30;
/// Length limit of an error in letters.
const LONGEST_SENTENCE: usize = 4000;

/// A kind of file to change and read.
pub struct Target {
    /// Name of the target and of its folder of cases.
    pub name: &'static str,
    /// Path of the file while it is read.
    pub place: PathBuf,
    /// Valid files to start from.
    pub seeds: Vec<Vec<u8>>,
    /// True if the files hold words and numbers.
    pub of_text: bool,
    /// Corrects bytes that would hide the rest, such as checksums.
    pub repair: fn(&mut Vec<u8>),
    /// Largest heap of a reader in bytes.
    pub most_memory: usize,
}

impl Target {
    /// Target for files of words and numbers.
    pub fn of_text(name: &'static str, place: PathBuf, seeds: Vec<Vec<u8>>) -> Self {
        Self { of_text: true, ..Self::of_bytes(name, place, seeds) }
    }

    /// Target for binary files.
    pub fn of_bytes(name: &'static str, place: PathBuf, seeds: Vec<Vec<u8>>) -> Self {
        Self { name, place, seeds, of_text: false, repair: |_| (), most_memory: MOST_MEMORY }
    }
}

/// A running target. One runs at a time, so that all memory belongs to its reader.
pub struct Run {
    target: Target,
    started: Instant,
    cases: Cell<u32>,
    refused: Cell<u32>,
    most: Cell<usize>,
    slowest: Cell<Duration>,
    _alone: MutexGuard<'static, ()>,
}

/// Result of reading a file: fine, or the error's text.
pub type Outcome = Result<(), String>;

impl Run {
    /// Reads the seeds, which must be valid, and the earlier failures.
    ///
    /// # Panics
    /// When a seed is refused, or as [`Self::case`].
    pub fn begin(target: Target, read: &dyn Fn(&Path) -> Outcome) -> Self {
        static ALONE: Mutex<()> = Mutex::new(());
        let run = Self {
            _alone: ALONE.lock().unwrap_or_else(PoisonError::into_inner),
            target,
            started: Instant::now(),
            cases: Cell::default(),
            refused: Cell::default(),
            most: Cell::default(),
            slowest: Cell::default(),
        };
        for (i, seed) in run.target.seeds.iter().enumerate() {
            let mut seed = seed.clone();
            (run.target.repair)(&mut seed);
            let said = run.read(&seed, read);
            assert_eq!(said, Ok(()), "seed {i} of {}", run.target.name);
        }
        let mut cases: Vec<PathBuf> = std::fs::read_dir(repository("tests/fuzz/cases").join(run.target.name))
            .into_iter()
            .flatten()
            .map(|entry| entry.unwrap().path())
            .collect();
        cases.sort();
        cases.extend(std::env::var_os("AFTERLIGHT_FUZZ_CASE").map(PathBuf::from));
        for case in cases {
            eprintln!("{}: {}", run.target.name, case.display());
            let _ = run.read(&std::fs::read(case).unwrap(), read);
        }
        run
    }

    /// Run time of the target.
    pub fn time() -> Duration {
        let said = std::env::var("AFTERLIGHT_FUZZ_SECONDS").ok();
        Duration::from_secs_f64(said.map_or(1.5, |text| text.parse().unwrap()))
    }

    /// Reads a seed changed according to `draws`.
    ///
    /// # Panics
    /// When the reader panics, takes too much memory, or fails with an error that does not name the file.
    pub fn case(&self, draws: &[u8], read: &dyn Fn(&Path) -> Outcome) {
        let seeds: Vec<&[u8]> = self.target.seeds.iter().map(Vec::as_slice).collect();
        let (_, mut file) = change::changed(&seeds, self.target.of_text, draws);
        // One in sixteen keeps its wrong checksums.
        if draws.first().is_some_and(|first| first % 16 > 0) {
            (self.target.repair)(&mut file);
        }
        let _ = self.read(&file, read);
    }

    fn read(&self, file: &[u8], read: &dyn Fn(&Path) -> Outcome) -> Outcome {
        let place = &self.target.place;
        // Not truncated first: file systems would sync each time.
        let mut written = File::options().create(true).write(true).truncate(false).open(place).unwrap();
        written.write_all(file).unwrap();
        written.set_len(file.len() as u64).unwrap();
        drop(written);
        let kept = Kept::before(&self.target, file.len());
        let started = Instant::now();
        let before = memory::begin(self.target.most_memory, &place.to_string_lossy());
        let said = read(place);
        let most = memory::end(before);
        let taken = started.elapsed();
        assert!(taken < PATIENCE, "it took {taken:?}");
        assert!(
            most <= self.target.most_memory,
            "the heap held {most} bytes while reading {} bytes; the limit is {}",
            file.len(),
            self.target.most_memory
        );
        if let Err(sentence) = &said {
            self.refused.set(self.refused.get() + 1);
            self.judge(sentence);
        }
        self.cases.set(self.cases.get() + 1);
        self.most.set(self.most.get().max(most));
        if taken > self.slowest.get() {
            self.slowest.set(taken);
            if taken > Duration::from_secs(5) {
                kept.copy("slow");
            }
        }
        said
    }

    /// Refuses an error that does not help a user.
    fn judge(&self, sentence: &str) {
        let name = self.target.place.file_name().unwrap().to_string_lossy();
        assert!(sentence.contains(&*name), "the error does not name {name}: {sentence}");
        assert!(sentence.len() <= LONGEST_SENTENCE, "the error has {} letters: {sentence:.300} …", sentence.len());
        let strange = |c: char| c.is_control() && c != '\n';
        assert!(!sentence.contains(strange), "the error has control characters: {sentence:?}");
    }

    /// Figures of the run for `docs/stability.md`.
    pub fn end(self) -> String {
        let figures = format!(
            "{} files, {} refused, at most {:.0} MB",
            self.cases.get(),
            self.refused.get(),
            self.most.get() as f64 / 1e6
        );
        eprintln!(
            "{}: {figures}, the slowest {:.2?}, in {:.0?}",
            self.target.name,
            self.slowest.get(),
            self.started.elapsed()
        );
        figures
    }
}

/// Saves the shortest file that failed.
struct Kept<'a> {
    target: &'a Target,
    length: usize,
}

impl<'a> Kept<'a> {
    fn before(target: &'a Target, length: usize) -> Self {
        Self { target, length }
    }

    fn copy(&self, why: &str) {
        let folder = repository("target/fuzz");
        let path = folder.join(format!("{}-{why}", self.target.name));
        let shorter = std::fs::metadata(&path).map_or(true, |old| old.len() >= self.length as u64);
        if shorter && std::fs::create_dir_all(&folder).is_ok() {
            let _ = std::fs::copy(&self.target.place, &path);
            eprintln!("kept as {}", path.display());
        }
    }
}

impl Drop for Kept<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.copy("fault");
        }
    }
}

/// Draws bytes, shrinks those that make `case` panic, and panics with the shortest.
pub fn draw(case: impl Fn(&[u8])) {
    let seed = std::env::var("AFTERLIGHT_FUZZ_SEED").map_or(1, |text| text.parse().unwrap());
    let bytes = proptest::collection::vec(proptest::num::u8::ANY, 0..96);
    let until = Instant::now() + Run::time();
    for round in 0u64.. {
        let config = Config { cases: 64, max_shrink_time: 20_000, failure_persistence: None, ..Config::default() };
        let mut key = [0; 32];
        key[..8].copy_from_slice(&(seed + 1_000_000 * round).to_le_bytes());
        let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &key);
        let drawn = TestRunner::new_with_rng(config, rng).run(&bytes, |draws| {
            if Instant::now() < until {
                case(&draws);
            }
            Ok(())
        });
        if let Err(failed) = drawn {
            panic!("{failed}");
        }
        if Instant::now() >= until {
            return;
        }
    }
}

/// Runs a target: `fuzz::run!(target, |path| read(path).map(drop).map_err(|e| e.to_string()))`. Returns its figures.
#[macro_export]
macro_rules! run {
    ($target:expr, $read:expr) => {{
        let read = std::panic::AssertUnwindSafe($read);
        let run = std::panic::AssertUnwindSafe($crate::Run::begin($target, &*read));
        let case = |draws: &[u8]| {
            let (run, read) = (&run, &read);
            run.case(draws, &**read);
        };
        $crate::drive!(case);
        run.0.end()
    }};
}

/// Feeds draws to a function through bolero, so that any of its engines can be used.
#[cfg(feature = "bolero")]
#[macro_export]
macro_rules! drive {
    ($case:expr) => {
        $crate::bolero::check!()
            .with_test_time($crate::Run::time())
            .with_iterations(usize::MAX)
            .with_max_len(96)
            .for_each($case)
    };
}

/// Feeds draws to a function.
#[cfg(not(feature = "bolero"))]
#[macro_export]
macro_rules! drive {
    ($case:expr) => {
        $crate::draw($case)
    };
}
