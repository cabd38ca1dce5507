//! Times of passes on the GPU, by its own clock.

use scene::Pass;

/// Most dispatches that can be timed in one recording.
const SPANS: u32 = 512;

/// Memory for the start and end times of each dispatch.
#[derive(Debug)]
pub(super) struct Clock {
    set: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    /// Pass of each span, in order.
    spans: Vec<Pass>,
    ms_per_tick: f64,
    /// True if there were more dispatches than room.
    overrun: bool,
}

impl Clock {
    /// None if the GPU has no timestamps.
    pub fn new(device: &wgpu::Device, queue: &wgpu::Queue) -> Option<Self> {
        if !device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return None;
        }
        let set = device.create_query_set(&wgpu::QuerySetDescriptor {
            label: Some("clock"),
            ty: wgpu::QueryType::Timestamp,
            count: 2 * SPANS,
        });
        let resolved = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("clock"),
            size: u64::from(2 * SPANS * wgpu::QUERY_SIZE),
            usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        Some(Self {
            set,
            resolved,
            spans: Vec::new(),
            ms_per_tick: f64::from(queue.get_timestamp_period()) * 1e-6,
            overrun: false,
        })
    }

    /// Slot for the next dispatch's times.
    pub fn span(&mut self, pass: Pass) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        let index = 2 * self.spans.len() as u32;
        if index == 2 * SPANS {
            self.overrun = true;
            return None;
        }
        self.spans.push(pass);
        Some(wgpu::ComputePassTimestampWrites {
            query_set: &self.set,
            beginning_of_pass_write_index: Some(index),
            end_of_pass_write_index: Some(index + 1),
        })
    }

    /// Resolves the times into [`Self::resolved`], once all spans are recorded.
    pub fn resolve(&self, commands: &mut wgpu::CommandEncoder) {
        if !self.spans.is_empty() {
            let written = 0..2 * self.spans.len() as u32;
            commands.resolve_query_set(&self.set, written, &self.resolved, 0);
        }
    }

    /// Buffer with the times, once the GPU has finished the recording.
    pub fn resolved(&self) -> &wgpu::Buffer {
        &self.resolved
    }

    /// Milliseconds of each span, from the content of [`Self::resolved`]; None if some have no time.
    pub fn times(&self, ticks: &[u8]) -> Option<Vec<(Pass, f64)>> {
        let ticks: Vec<u64> = bytemuck::pod_collect_to_vec(ticks);
        let pairs = ticks.as_chunks::<2>().0;
        let ms = |[start, end]: &[u64; 2]| end.saturating_sub(*start) as f64 * self.ms_per_tick;
        let times = self.spans.iter().zip(pairs).map(|(&pass, t)| (pass, ms(t)));
        (!self.overrun).then(|| times.collect())
    }
}
