//! Requirements of tests that a machine may lack. Such a test returns and reports the skip: `make test` lists all skips
//! at its end, and if `AFTERLIGHT_REQUIRED` names the need, the test fails instead.

use std::fmt::Display;
use std::io::Write;
use std::path::PathBuf;

/// Comma-separated needs that must not be missing.
const REQUIRED: &str = "AFTERLIGHT_REQUIRED";
/// File that collects skips, one per line: need, crate, test and reason, separated by tabs.
const SKIPPED: &str = "AFTERLIGHT_SKIPPED";

/// Something that a machine may lack.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Need {
    /// The folder `shared` beside the repository.
    SharedData,
    /// An adapter with compute shaders and drawing; a software one is enough.
    Gpu,
    /// Half floats in the GPU's shaders.
    GpuF16,
    /// The GPU's own clock.
    GpuClock,
    /// The programs `ffmpeg` and `ffprobe`.
    Ffmpeg,
    /// A Python interpreter with PyTorch and the other peers.
    Python,
    /// MediaPipe in that interpreter; it conflicts with some of the other peers.
    Mediapipe,
    /// The processor's products of bf16.
    Bf16,
    /// Permission to mount a small disk.
    SmallDisk,
    /// The program `pfspanoramic`.
    Pfspanoramic,
    /// The program `prlimit`.
    Prlimit,
    /// The program `blender`, with its renderer Cycles.
    Blender,
    /// The program `openjd` of openjd-cli.
    OpenJobDescription,
    /// The daemons of Slurm and MUNGE, and permission to start them.
    Slurm,
}

impl Need {
    /// All needs.
    const ALL: [Self; 14] = [
        Self::SharedData,
        Self::Gpu,
        Self::GpuF16,
        Self::GpuClock,
        Self::Ffmpeg,
        Self::Python,
        Self::Mediapipe,
        Self::Bf16,
        Self::SmallDisk,
        Self::Pfspanoramic,
        Self::Prlimit,
        Self::Blender,
        Self::OpenJobDescription,
        Self::Slurm,
    ];

    /// Name in lists.
    fn name(self) -> &'static str {
        match self {
            Self::SharedData => "shared data",
            Self::Gpu => "gpu",
            Self::GpuF16 => "gpu f16",
            Self::GpuClock => "gpu clock",
            Self::Ffmpeg => "ffmpeg",
            Self::Python => "python",
            Self::Mediapipe => "mediapipe",
            Self::Bf16 => "bf16",
            Self::SmallDisk => "small disk",
            Self::Pfspanoramic => "pfspanoramic",
            Self::Prlimit => "prlimit",
            Self::Blender => "blender",
            Self::OpenJobDescription => "openjd",
            Self::Slurm => "slurm",
        }
    }
}

/// True if a test's need is met. Otherwise the skip is recorded with its reason, and the test returns.
///
/// # Panics
/// If it is missing and `AFTERLIGHT_REQUIRED` names it.
pub fn require(need: Need, here: bool, why: impl Display) -> bool {
    found(need, if here { Ok(()) } else { Err(why) }).is_some()
}

/// A test's need, if found. Otherwise the skip is recorded with its reason, and the test returns.
///
/// # Panics
/// If it is missing and `AFTERLIGHT_REQUIRED` names it.
pub fn found<T>(need: Need, result: Result<T, impl Display>) -> Option<T> {
    let rules = Rules::new(&std::env::var(REQUIRED).unwrap_or_default(), std::env::var_os(SKIPPED).map(PathBuf::from));
    let result = result.map_err(|why| rules.miss(need, &why.to_string()));
    result.ok()
}

/// Rules for missing needs.
struct Rules {
    required: Vec<Need>,
    record: Option<PathBuf>,
}

impl Rules {
    fn new(required: &str, record: Option<PathBuf>) -> Self {
        let names = required.split(',').map(str::trim);
        let need = |name: &str| {
            let known = Need::ALL.into_iter().find(|need| need.name() == name);
            known.unwrap_or_else(|| {
                let names = Need::ALL.map(Need::name).join(", ");
                panic!("{REQUIRED} names {name:?}; valid needs: {names}")
            })
        };
        Self { required: names.filter(|name| !name.is_empty()).map(need).collect(), record }
    }

    fn miss(&self, need: Need, why: &str) {
        let name = need.name();
        assert!(!self.required.contains(&need), "{name} is missing; {REQUIRED} requires it: {why}");
        eprintln!("skipped for lack of {name}: {why}");
        let Some(record) = &self.record else { return };
        let package = std::env::var("CARGO_PKG_NAME").unwrap_or_default();
        let thread = std::thread::current();
        let test = thread.name().unwrap_or("a thread of a test");
        let line = [name, &package, test, why].map(|word| {
            let words: Vec<&str> = word.split_whitespace().collect();
            words.join(" ")
        });
        // In a single write, since other tests append at the same time.
        let line = line.join("\t") + "\n";
        std::fs::OpenOptions::new()
            .append(true)
            .create(true)
            .open(record)
            .and_then(|mut file| file.write_all(line.as_bytes()))
            .unwrap_or_else(|e| panic!("cannot record a skip in {}: {e}", record.display()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_need_is_required_by_its_own_name() {
        for need in Need::ALL {
            assert_eq!(Rules::new(need.name(), None).required, [need]);
        }
        let all = Need::ALL.map(Need::name).join(" , ");
        assert_eq!(Rules::new(&all, None).required, Need::ALL);
        assert_eq!(Rules::new("", None).required, []);
    }

    #[test]
    #[should_panic(expected = "names \"gpus\"; valid needs: shared data, gpu,")]
    fn a_name_that_is_no_need_is_refused() {
        Rules::new("ffmpeg,gpus", None);
    }

    #[test]
    #[should_panic(expected = "ffmpeg is missing; AFTERLIGHT_REQUIRED requires it: not installed")]
    fn what_is_required_must_be_here() {
        Rules::new("gpu,ffmpeg", None).miss(Need::Ffmpeg, "not installed");
    }

    #[test]
    fn each_skip_is_a_line_with_need_crate_test_and_reason() {
        let folder = tempfile::tempdir().unwrap();
        let record = folder.path().join("skipped");
        let rules = Rules::new("python", Some(record.clone()));
        rules.miss(Need::SmallDisk, "mount:\tonly root\nmay do that");
        let lines = std::fs::read_to_string(&record).unwrap();
        let test = "need::tests::each_skip_is_a_line_with_need_crate_test_and_reason";
        // With a single thread, tests run on the main thread, without their own names.
        let test = [test, "main"]
            .map(|test| format!("small disk\tafterlight-test-support\t{test}\tmount: only root may do that\n"));
        assert!(test.contains(&lines), "{lines}");

        std::thread::scope(|threads| {
            for _ in 0..8 {
                threads.spawn(|| (0..100).for_each(|_| rules.miss(Need::Bf16, "no bf16")));
            }
        });
        let lines = std::fs::read_to_string(&record).unwrap();
        assert_eq!(lines.lines().count(), 801);
        assert!(lines.lines().all(|line| line.split('\t').count() == 4));
    }

    #[test]
    fn what_is_here_is_handed_on() {
        assert_eq!(found(Need::Gpu, Ok::<_, String>(3)), Some(3));
        assert!(require(Need::Gpu, true, "nothing is missing"));
    }
}
