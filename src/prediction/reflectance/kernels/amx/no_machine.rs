//! Replacement for AMX on other processors.

// The functions have the signatures of the real ones.
#![allow(unsafe_code)]

use super::Precision;
use super::layout::{Blocking, Blocks, Factor};

pub fn available() -> bool {
    false
}

/// # Safety
///
/// It does nothing.
pub unsafe fn configure(_: usize) {}

/// # Safety
///
/// It does nothing.
pub unsafe fn release() {}

/// # Safety
///
/// It is never reached.
pub unsafe fn sum(
    _: Blocking,
    _: Precision,
    _: &Factor,
    _: &Factor,
    _: &[[usize; 2]],
    _: &mut Blocks,
) {
    unreachable!("there are no tiles to set up");
}
