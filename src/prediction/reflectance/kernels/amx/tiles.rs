//! The processor's tile registers, through one routine that holds four blocks of 16 × 16 sums in them.

#![allow(unsafe_code)]

use super::layout::{Blocking, Blocks, Factor, SIDE};
use super::{Precision, machine};
use std::cell::Cell;
use std::marker::PhantomData;

/// Steps of a sum: offsets of the tiles of both factors.
pub struct Steps {
    offsets: Vec<[usize; 2]>,
    farthest: [usize; 2],
}

impl Steps {
    pub fn new(offsets: Vec<[usize; 2]>) -> Self {
        let farthest = [0, 1].map(|side| offsets.iter().map(|o| o[side]).max().unwrap_or(0));
        Self { offsets, farthest }
    }
}

/// The tile registers of this thread while they are configured.
pub struct Tiles {
    pairs: usize,
    /// Not Send: the registers belong to the thread.
    _thread: PhantomData<*const ()>,
}

thread_local! {
    static IN_USE: Cell<bool> = const { Cell::new(false) };
}

/// Runs `work` with tile registers for products over `pairs` pairs of elements per step (1 to 16).
///
/// # Panics
///
/// When the processor has no such registers, or within another such call.
pub fn with_tiles<T>(pairs: usize, work: impl FnOnce(&Tiles) -> T) -> T {
    assert!(available(), "the processor has no AMX");
    assert!((1..=SIDE).contains(&pairs), "{pairs} pairs do not fit a tile");
    assert!(!IN_USE.replace(true), "the tiles are set up already");
    let tiles = Tiles { pairs, _thread: PhantomData };
    // Dropped, and the registers freed, also when `work` panics.
    let tiles = InUse(tiles);
    // SAFETY: both were asserted above.
    unsafe { machine::configure(pairs) };
    work(&tiles.0)
}

struct InUse(Tiles);

impl Drop for InUse {
    fn drop(&mut self) {
        // SAFETY: there are registers, else `with_tiles` had not made this.
        unsafe { machine::release() };
        IN_USE.set(false);
    }
}

impl Tiles {
    /// into = Σ over steps of left tile · right tile, for the blocks of sums in `blocking`.
    /// Each sum follows the order of the steps; with split factors, a step adds high · low,
    /// high · high and low · high.
    pub fn sum(
        &self,
        blocking: Blocking,
        precision: Precision,
        left: &Factor,
        right: &Factor,
        steps: &Steps,
        into: &mut Blocks,
    ) {
        let [across, down] = blocking.tiles();
        let fits = |factor: &Factor, tiles, rows, farthest| {
            factor
                .end(precision, tiles, rows, farthest)
                .is_some_and(|end| end <= factor.bytes.len())
        };
        assert!(
            fits(left, across, SIDE, steps.farthest[0]),
            "the left factor's tiles lie outside of it"
        );
        assert!(
            fits(right, down, self.pairs, steps.farthest[1]),
            "the right factor's tiles lie outside of it"
        );
        if steps.offsets.is_empty() {
            *into = [[0.0; SIDE * SIDE]; 4];
            return;
        }
        // SAFETY: `Tiles` exist only within `with_tiles`, on the thread that configured them, and do
        // not leave it. The assertions have tried the largest offsets of all steps, in which each
        // factor's tiles reach farthest, and there is a step.
        unsafe { machine::sum(blocking, precision, left, right, &steps.offsets, into) };
    }
}

/// True if this process may use the tile registers.
pub fn available() -> bool {
    machine::available()
}
