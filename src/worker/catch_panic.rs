//! Faults of the program on a thread of its own: they end what was being done, not the thread.

use base::error::{Error, Result};
use gpu;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Does something; a panic is an error.
pub(super) fn catch_panic<T>(act: impl FnOnce() -> Result<T>) -> Result<T> {
    catch_unwind(AssertUnwindSafe(act)).unwrap_or_else(|panic| {
        if gpu::is_lost() {
            return Err(Error::GpuLost);
        }
        let text = panic.downcast_ref::<&str>().map(|text| (*text).to_owned());
        let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
        Err(Error::bug(text.unwrap_or_else(|| "a panic".to_owned())))
    })
}
