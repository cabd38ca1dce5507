//! Memory use of the process, and the allocator's settings.

/// Keeps freed memory for the next allocation. By default glibc returns large blocks to the system at once and
/// gets them again page by page, with a page fault each: a tenth of a training step's time. One arena for all threads:
/// memory freed by one serves all, a quarter less in a training step. Call it once, at the start of a program.
pub fn keep_freed() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        /// The largest threshold that glibc accepts; blocks above it are mapped separately.
        const MAPPED_FROM: i32 = 32 << 20;
        /// Size of each request to the system.
        const STEP: i32 = 64 << 20;
        // SAFETY: mallopt accepts any numbers, rejects invalid ones, and locks the allocator while it changes it.
        #[allow(unsafe_code)]
        unsafe {
            libc::mallopt(libc::M_MMAP_THRESHOLD, MAPPED_FROM);
            libc::mallopt(libc::M_TRIM_THRESHOLD, i32::MAX);
            libc::mallopt(libc::M_TOP_PAD, STEP);
            libc::mallopt(libc::M_ARENA_MAX, 1);
        }
    }
}

/// Memory that the process holds now, in bytes; None if the system does not report it.
pub fn held() -> Option<u64> {
    read("/proc/self/status", "VmRSS:")
}

/// Peak memory of the process in bytes; None if the system does not report it.
pub fn peak() -> Option<u64> {
    read("/proc/self/status", "VmHWM:")
}

/// Memory in bytes that programs can still take without pushing others out; None if the system does not report
/// it.
pub fn available() -> Option<u64> {
    read("/proc/meminfo", "MemAvailable:")
}

/// A line of proc(5) in units of 1024 bytes.
fn read(path: &str, name: &str) -> Option<u64> {
    let text = std::fs::read_to_string(path).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    let kibibytes: u64 = line.trim().strip_suffix(" kB")?.trim().parse().ok()?;
    Some(1024 * kibibytes)
}

#[cfg(test)]
mod tests {
    #[cfg(target_os = "linux")]
    #[test]
    fn what_is_held_counts_what_was_written() {
        let block = std::hint::black_box(vec![1u8; 64 << 20]);
        let held = super::held().unwrap();
        assert!((64 << 20..1 << 40).contains(&held), "{held}");
        drop(block);
        let (peak, available) = (super::peak().unwrap(), super::available().unwrap());
        // The system counts in steps of some pages, so the peak may lie a little below the held memory.
        assert!((64 << 20..1 << 40).contains(&peak), "{peak}");
        assert!((1 << 20..1 << 50).contains(&available), "{available}");
    }
}
