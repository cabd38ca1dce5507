//! Counts a test's heap, so that files with excessive memory use are found.

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// The system's allocator with a count. A test program installs it:
///
/// ```ignore
/// #[global_allocator]
/// static COUNTED: fuzz::Counted = fuzz::Counted;
/// ```
pub struct Counted;

/// Bytes on the heap, and their peak since [`begin`].
static LIVE: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);
/// Size limit of one allocation, and the current file.
static MOST: AtomicUsize = AtomicUsize::new(usize::MAX);
static READING: Mutex<String> = Mutex::new(String::new());

/// Starts reading a file, with a limit of `most` bytes at once.
pub(crate) fn begin(most: usize, file: &str) -> usize {
    let mut reading = READING.lock().unwrap_or_else(|e| e.into_inner());
    reading.clear();
    reading.push_str(file);
    drop(reading);
    MOST.store(most, Relaxed);
    let live = LIVE.load(Relaxed);
    PEAK.store(live, Relaxed);
    live
}

/// Peak of the heap since a [`begin`] that returned `before`.
pub(crate) fn end(before: usize) -> usize {
    MOST.store(usize::MAX, Relaxed);
    PEAK.load(Relaxed).saturating_sub(before)
}

fn grown(by: usize) {
    let live = LIVE.fetch_add(by, Relaxed) + by;
    PEAK.fetch_max(live, Relaxed);
}

/// True if one allocation is too large; prints the reason, because the process is about to be aborted.
fn is_refused(size: usize) -> bool {
    let most = MOST.load(Relaxed);
    if size <= most {
        return false;
    }
    // This must not allocate.
    let mut out = std::io::stderr();
    let reading = READING.try_lock();
    let file = reading.as_ref().map_or("a file", |file| file.as_str());
    let _ = writeln!(
        out,
        "\nFAULT: an allocation of {size} bytes while reading {file}; the limit is {most}. \
         The file is kept"
    );
    true
}

// SAFETY: every call goes to the system allocator with the given layout; null means out of memory.
#[allow(unsafe_code)]
unsafe impl GlobalAlloc for Counted {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if is_refused(layout.size()) {
            return std::ptr::null_mut();
        }
        grown(layout.size());
        unsafe { System.alloc(layout) }
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        if is_refused(layout.size()) {
            return std::ptr::null_mut();
        }
        grown(layout.size());
        unsafe { System.alloc_zeroed(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        LIVE.fetch_sub(layout.size(), Relaxed);
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        if is_refused(size) {
            return std::ptr::null_mut();
        }
        let moved = unsafe { System.realloc(pointer, layout, size) };
        if !moved.is_null() {
            grown(size);
            LIVE.fetch_sub(layout.size(), Relaxed);
        }
        moved
    }
}
