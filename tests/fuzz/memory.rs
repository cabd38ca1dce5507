//! Counts what a test's process has on its heap, so that a file that takes too much of it is found.

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// The system's allocator, counted. A test's program makes it its own:
///
/// ```ignore
/// #[global_allocator]
/// static COUNTED: fuzz::Counted = fuzz::Counted;
/// ```
pub struct Counted;

/// Bytes on the heap, and the most since [`begin`].
static LIVE: AtomicUsize = AtomicUsize::new(0);
static PEAK: AtomicUsize = AtomicUsize::new(0);
/// Most bytes that one allocation may take, and the file that is being read.
static MOST: AtomicUsize = AtomicUsize::new(usize::MAX);
static READING: Mutex<String> = Mutex::new(String::new());

/// Begins to read a file, with at most `most` bytes at once.
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

/// The most bytes at once since a [`begin`] that gave `before`.
pub(crate) fn end(before: usize) -> usize {
    MOST.store(usize::MAX, Relaxed);
    PEAK.load(Relaxed).saturating_sub(before)
}

fn grown(by: usize) {
    let live = LIVE.fetch_add(by, Relaxed) + by;
    PEAK.fetch_max(live, Relaxed);
}

/// True if one allocation is too large; then the process is about to be aborted, and says why.
fn is_refused(size: usize) -> bool {
    let most = MOST.load(Relaxed);
    if size <= most {
        return false;
    }
    // Nothing here allocates.
    let mut out = std::io::stderr();
    let reading = READING.try_lock();
    let file = reading.as_ref().map_or("a file", |file| file.as_str());
    let _ = writeln!(
        out,
        "\nFAULT: {size} bytes were asked for at once while {file} was read; at most {most} may be. \
         The file is kept there"
    );
    true
}

// SAFETY: every call is the system allocator's, with the layout that was given; null means that there is no memory.
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
