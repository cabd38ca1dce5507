//! How the process holds memory.

/// Keeps freed memory for the next allocation. By default glibc gives large blocks back to the system at
/// once, which then hands them out again page by page, each page a fault: a tenth of a training
/// step's time. To be called once, at the start of a program.
pub fn keep_freed() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        /// The largest threshold that glibc accepts; blocks above it are mapped by themselves.
        const MAPPED_FROM: i32 = 32 << 20;
        /// Taken from the system at a time.
        const STEP: i32 = 64 << 20;
        // SAFETY: mallopt takes any numbers, refuses those that it cannot use, and locks the allocator
        // while it changes it.
        #[allow(unsafe_code)]
        unsafe {
            libc::mallopt(libc::M_MMAP_THRESHOLD, MAPPED_FROM);
            libc::mallopt(libc::M_TRIM_THRESHOLD, i32::MAX);
            libc::mallopt(libc::M_TOP_PAD, STEP);
        }
    }
}
