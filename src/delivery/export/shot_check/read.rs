//! Reader of many files, several at a time.

use super::frame::Frame;
use super::shot::Shot;
use base::error::Result;
use base::progress::Progress;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

const STAGE: &str = "checking frames";
/// Memory budget in bytes where the system does not report its free memory.
const USUAL: u64 = 2 << 30;
/// Most readers at a time: more do not make a disk faster.
const MOST_READERS: usize = 16;

/// Examines all frames of a shot, in order. Only the findings are kept. Frames in memory at a time take at most a
/// quarter of the free memory.
///
/// # Errors
/// When the user stops.
pub(super) fn frames(shot: &Shot, progress: &Progress) -> Result<Vec<Frame>> {
    let read = |(number, name): &(i64, String)| Frame::read(&shot.path(name), *number, name);
    let Some((first, rest)) = shot.files.split_first() else { return Ok(Vec::new()) };
    progress.step(STAGE, 0, shot.files.len() as u64, "");
    let first = read(first);
    let needs = first.picture.as_ref().map_or(USUAL, |content| content.memory);
    let free = base::memory::available().map_or(USUAL, |free| free / 4);
    let at_once = usize::try_from(free / needs.max(1)).unwrap_or(usize::MAX);
    let mut frames = vec![first];
    frames.extend(each(rest, at_once, progress, STAGE, read)?);
    Ok(frames)
}

/// Runs `work` on each of `items`, at most `at_once` at a time. Results keep the order of the items.
///
/// # Errors
/// When the user stops.
pub(super) fn each<I: Sync, R: Send>(
    items: &[I],
    at_once: usize,
    progress: &Progress,
    stage: &'static str,
    work: impl Fn(&I) -> R + Sync,
) -> Result<Vec<R>> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let readers = at_once.min(cores).min(MOST_READERS).min(items.len()).max(1);
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::with_capacity(items.len()));
    let total = items.len() as u64;
    let reader = || {
        while !progress.cancelled() {
            progress.wait_while_paused();
            let index = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(index) else { return };
            let result = work(item);
            let mut done = done.lock().unwrap_or_else(PoisonError::into_inner);
            done.push((index, result));
            progress.step(stage, done.len() as u64, total, "");
        }
    };
    std::thread::scope(|scope| {
        for _ in 1..readers {
            scope.spawn(reader);
        }
        reader();
    });
    progress.check("nothing was written")?;
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(index, _)| *index);
    Ok(done.into_iter().map(|(_, result)| result).collect())
}
