//! Measurements of a GPU: copy bandwidth and allocated memory.

use super::Gpu;
use std::time::Instant;

impl Gpu {
    /// Result of the self-test, which runs once per process.
    ///
    /// # Errors
    /// Message with the computed and the expected value.
    pub fn self_test(&self) -> Result<(), String> {
        self.check()?;
        self.check_network()
    }

    /// The adapter's name.
    pub fn name(&self) -> &str {
        &self.adapter.name
    }

    /// Bytes read and written per second when copying 64 MiB sixteen times: the median of five runs.
    pub fn copied_per_second(&self) -> f64 {
        const BYTES: u64 = 64 << 20;
        const TIMES: usize = 16;
        let buffer = || {
            self.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("copied"),
                size: BYTES,
                usage: wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        let (source, target) = (buffer(), buffer());
        let copy = |times: usize| {
            let mut commands = self.device.create_command_encoder(&Default::default());
            for _ in 0..times {
                commands.copy_buffer_to_buffer(&source, 0, &target, 0, BYTES);
            }
            let started = Instant::now();
            self.queue.submit([commands.finish()]);
            self.wait();
            started.elapsed().as_secs_f64()
        };
        copy(1);
        let mut seconds: Vec<f64> = (0..5).map(|_| copy(TIMES)).collect();
        seconds.sort_by(f64::total_cmp);
        2.0 * (BYTES * TIMES as u64) as f64 / seconds[seconds.len() / 2]
    }

    /// Waits for all submitted work.
    pub fn wait(&self) {
        // A lost device has nothing to wait for; reading its results reports the loss.
        let _ = self.device.poll(wgpu::PollType::wait_indefinitely());
    }

    /// Bytes of GPU memory allocated by this process, for the network and for pictures; None where wgpu
    /// does not know. Freed memory is kept for reuse, so this is close to the peak.
    pub fn taken_bytes(&self) -> Option<u64> {
        let report = self.device.generate_allocator_report()?;
        Some(report.total_reserved_bytes)
    }
}
