//! Files and texts that are changed at random, given to everything that reads them.
//!
//! A target starts from valid files, which the program's own writers make, changes them by random draws, and reads them. It
//! demands that a reader ends with a value or with a sentence that names the file, and takes no more memory than stated. Cases
//! that were once wrong are in `tests/fuzz/cases`, and are read first.
//!
//! `AFTERLIGHT_FUZZ_SECONDS` says how long each target runs; without it they take about half a minute together.
//! `AFTERLIGHT_FUZZ_SEED` draws others. `AFTERLIGHT_FUZZ_CASE` names a file that is read first. With the feature `bolero`,
//! the engines of bolero draw: `cargo bolero test -p afterlight-fuzz --features bolero TARGET` with cargo-bolero.

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

/// Most bytes that a reader may have on the heap at once: two copies of the largest picture that is read, with 12 bytes for
/// each of `imaging::file::MAX_PIXELS`, and the memory that a decoder takes.
pub const MOST_MEMORY: usize = 4 << 30;
/// Most letters of an error.
const LONGEST_SENTENCE: usize = 4000;

/// A kind of file that is changed and read.
pub struct Target {
    /// Its name, and that of its folder of cases.
    pub name: &'static str,
    /// Path of the file while it is read.
    pub place: PathBuf,
    /// Valid files to start from.
    pub seeds: Vec<Vec<u8>>,
    /// The files hold words and numbers.
    pub of_text: bool,
    /// Corrects what would hide the rest, such as checksums.
    pub repair: fn(&mut Vec<u8>),
    /// Bytes that a reader may have on the heap at once.
    pub most_memory: usize,
}

impl Target {
    /// A target for files of words and numbers.
    pub fn of_text(name: &'static str, place: PathBuf, seeds: Vec<Vec<u8>>) -> Self {
        Self { of_text: true, ..Self::of_bytes(name, place, seeds) }
    }

    /// A target for other files.
    pub fn of_bytes(name: &'static str, place: PathBuf, seeds: Vec<Vec<u8>>) -> Self {
        Self { name, place, seeds, of_text: false, repair: |_| (), most_memory: MOST_MEMORY }
    }
}

/// A target while it runs. One runs at a time, so that memory is that of its reader.
pub struct Run {
    target: Target,
    started: Instant,
    cases: Cell<u32>,
    refused: Cell<u32>,
    most: Cell<usize>,
    slowest: Cell<Duration>,
    _alone: MutexGuard<'static, ()>,
}

/// Result of reading a file: nothing to object to, or the error's sentence.
pub type Outcome = Result<(), String>;

impl Run {
    /// Reads the seeds, which must be valid, and the cases that were once wrong.
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
        let mut cases: Vec<PathBuf> =
            std::fs::read_dir(repository("tests/fuzz/cases").join(run.target.name))
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

    /// Time for which it runs.
    pub fn time() -> Duration {
        let said = std::env::var("AFTERLIGHT_FUZZ_SECONDS").ok();
        Duration::from_secs_f64(said.map_or(1.5, |text| text.parse().unwrap()))
    }

    /// Reads a seed that was changed as `draws` say.
    ///
    /// # Panics
    /// When the reader panics, takes too much memory, or refuses the file with something other than a sentence about it.
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
        // Not emptied first, for which file systems would wait for the disk each time.
        let mut written =
            File::options().create(true).write(true).truncate(false).open(place).unwrap();
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
            "{most} bytes were on the heap at once while {} bytes were read; at most {} may be",
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

    /// Refuses an error that a person cannot use.
    fn judge(&self, sentence: &str) {
        let name = self.target.place.file_name().unwrap().to_string_lossy();
        assert!(sentence.contains(&*name), "the error does not name {name}: {sentence}");
        assert!(
            sentence.len() <= LONGEST_SENTENCE,
            "the error has {} letters: {sentence:.300} …",
            sentence.len()
        );
        let strange = |c: char| c.is_control() && c != '\n';
        assert!(!sentence.contains(strange), "the error has control characters: {sentence:?}");
    }

    /// Figures of the run, for `docs/stability.md`.
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

/// Keeps the shortest file that a reader failed on.
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

/// Draws bytes, shrinks those with which `case` panics, and panics with the shortest.
pub fn draw(case: impl Fn(&[u8])) {
    let seed = std::env::var("AFTERLIGHT_FUZZ_SEED").map_or(1, |text| text.parse().unwrap());
    let bytes = proptest::collection::vec(proptest::num::u8::ANY, 0..96);
    let until = Instant::now() + Run::time();
    for round in 0u64.. {
        let config = Config {
            cases: 64,
            max_shrink_time: 20_000,
            failure_persistence: None,
            ..Config::default()
        };
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

/// Runs a target: `fuzz::run!(target, |path| read(path).map(drop).map_err(|e| e.to_string()))`. Gives what was measured.
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

/// Gives draws to a function: bolero's, so that any engine of bolero can draw.
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

/// Gives draws to a function.
#[cfg(not(feature = "bolero"))]
#[macro_export]
macro_rules! drive {
    ($case:expr) => {
        $crate::draw($case)
    };
}
