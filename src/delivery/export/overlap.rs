//! Pipeline of three stages: while one frame is made, the next is read and the previous one is written.

use base::error::Result;
use serde::{Deserialize, Serialize};
use std::panic::resume_unwind;
use std::sync::mpsc::sync_channel;
use std::time::{Duration, Instant};

/// Most frames that wait between two stages: more cost memory without a gain.
const AHEAD: usize = 2;

/// Total working times of the stages, without waiting times.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageTimes {
    pub read: Duration,
    pub make: Duration,
    pub write: Duration,
}

/// Mean milliseconds per frame in each stage, and from frame to frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Stages {
    /// Decoding the plate and its matte.
    pub read_ms: f64,
    /// Prediction, sum and picture.
    pub make_ms: f64,
    /// Encoding and the disk.
    pub write_ms: f64,
    /// All stages together, overlapped.
    pub frame_ms: f64,
}

impl StageTimes {
    /// Means over `frames` frames that took `whole` together.
    pub fn of_frames(self, frames: usize, whole: Duration) -> Stages {
        let mean = |time: Duration| time.as_secs_f64() * 1e3 / frames.max(1) as f64;
        Stages { read_ms: mean(self.read), make_ms: mean(self.make), write_ms: mean(self.write), frame_ms: mean(whole) }
    }
}

impl Stages {
    /// Frames per second of each stage alone, and of all stages overlapped.
    pub fn sentence(&self) -> String {
        let rate = |ms: f64| 1e3 / ms.max(1e-3);
        format!(
            "Frames a second: reading alone {:.1}, relighting alone {:.1}, writing alone {:.1}, all overlapped {:.1}",
            rate(self.read_ms),
            rate(self.make_ms),
            rate(self.write_ms),
            rate(self.frame_ms)
        )
    }
}

/// Reads, makes and writes each of `frames`, in order. `make` runs on this thread; its None is not written.
///
/// # Errors
/// The first error of a stage. Frames already made are still written, unless writing itself fails.
pub fn overlapped<F: Copy + Send + Sync, R: Send, M: Send>(
    frames: &[F],
    mut read: impl FnMut(F) -> Result<R> + Send,
    mut make: impl FnMut(F, R) -> Result<Option<M>>,
    mut write: impl FnMut(F, M) -> Result<()> + Send,
) -> (StageTimes, Result<()>) {
    std::thread::scope(|threads| {
        let (give, take) = sync_channel::<(F, Result<R>)>(AHEAD);
        let reading = threads.spawn(move || {
            let mut busy = Duration::ZERO;
            for &frame in frames {
                let started = Instant::now();
                let found = read(frame);
                busy += started.elapsed();
                let failed = found.is_err();
                // The receiver is gone once another stage has failed.
                if give.send((frame, found)).is_err() || failed {
                    break;
                }
            }
            busy
        });
        let (hand_on, to_write) = sync_channel::<(F, M)>(AHEAD);
        let writing = threads.spawn(move || {
            let mut busy = Duration::ZERO;
            for (frame, made) in to_write {
                let started = Instant::now();
                let written = write(frame, made);
                busy += started.elapsed();
                if written.is_err() {
                    return (busy, written);
                }
            }
            (busy, Ok(()))
        });
        let mut busy = Duration::ZERO;
        let mut done = Ok(());
        for (frame, found) in take {
            let started = Instant::now();
            let made = found.and_then(|found| make(frame, found));
            busy += started.elapsed();
            match made {
                Ok(Some(made)) => {
                    if hand_on.send((frame, made)).is_err() {
                        break;
                    }
                }
                Ok(None) => {}
                Err(e) => {
                    done = Err(e);
                    break;
                }
            }
        }
        drop(hand_on);
        let (write, written) = writing.join().unwrap_or_else(|panic| resume_unwind(panic));
        let read = reading.join().unwrap_or_else(|panic| resume_unwind(panic));
        let times = StageTimes { read, make: busy, write };
        // The frame in the writer comes before the frame in the maker.
        (times, written.and(done))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use base::error::Error;
    use std::sync::Mutex;
    use std::sync::atomic::{AtomicUsize, Ordering};

    fn fail(at: usize, frame: usize) -> Result<usize> {
        if at == frame { Err(Error::invalid(format!("frame {frame}"), "nothing")) } else { Ok(frame) }
    }

    #[test]
    fn frames_keep_their_order_and_few_are_under_way() {
        let (underway, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let written = Mutex::new(Vec::new());
        let frames: Vec<usize> = (0..50).collect();
        let (_, done) = overlapped(
            &frames,
            |frame| {
                most.fetch_max(underway.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
                Ok(frame)
            },
            |frame, read| Ok((frame != 7).then_some(read)),
            |frame, made| {
                assert_eq!(frame, made);
                underway.fetch_sub(1, Ordering::SeqCst);
                written.lock().unwrap().push(made);
                Ok(())
            },
        );
        done.unwrap();
        let wanted: Vec<usize> = (0..50).filter(|frame| *frame != 7).collect();
        assert_eq!(written.into_inner().unwrap(), wanted);
        // Two frames wait on either side, one is in each stage, plus the frame that was left out.
        assert!(most.into_inner() <= 2 * AHEAD + 3 + 1);
    }

    #[test]
    fn a_stage_that_fails_ends_all_and_what_was_made_before_is_written() {
        let frames: Vec<usize> = (0..20).collect();
        for stage in 0..3 {
            let at = |wanted: usize| if stage == wanted { 9 } else { 99 };
            let written = AtomicUsize::new(0);
            let (_, done) = overlapped(
                &frames,
                |frame| fail(at(0), frame),
                |frame, read| fail(at(1), frame).map(|_| Some(read)),
                |frame, _| {
                    fail(at(2), frame)?;
                    written.fetch_add(1, Ordering::SeqCst);
                    Ok(())
                },
            );
            assert!(done.unwrap_err().to_string().contains("frame 9"), "{stage}");
            assert_eq!(written.into_inner(), 9, "{stage}");
        }
    }
}
