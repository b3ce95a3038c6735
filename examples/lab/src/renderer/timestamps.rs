//! Times that the device writes.

use wgpu::{BufferUsages, CommandEncoder, QuerySet};

use super::Gpu;
use super::gpu::Readback;

/// Bytes of a time.
const TIME: u32 = 8;

/// Queries for times, read back.
pub struct Timestamps {
    /// For passes to write to.
    pub queries: QuerySet,
    resolved: wgpu::Buffer,
}

impl Timestamps {
    /// So many queries; `None` where the device has no timestamps.
    pub fn new(gpu: &Gpu, count: u32) -> Option<Self> {
        if !gpu.device.features().contains(wgpu::Features::TIMESTAMP_QUERY) {
            return None;
        }
        let label = Some("subsurface_lab::Timestamps");
        Some(Self {
            queries: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label,
                ty: wgpu::QueryType::Timestamp,
                count,
            }),
            resolved: gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label,
                size: u64::from(TIME * count),
                usage: BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
        })
    }

    /// Has the device write its time once all that was recorded so far is done: by a pass of nothing, which
    /// needs no feature beyond that of the queries.
    pub fn mark(&self, encoder: &mut CommandEncoder, query: u32) {
        encoder.begin_compute_pass(&wgpu::ComputePassDescriptor {
            label: Some("subsurface_lab::Timestamps mark"),
            timestamp_writes: Some(wgpu::ComputePassTimestampWrites {
                query_set: &self.queries,
                beginning_of_pass_write_index: Some(query),
                end_of_pass_write_index: None,
            }),
        });
    }

    /// Submits what `record` records, waits, and reads as many queries as that says it wrote: in ms.
    pub fn run<T>(&self, gpu: &Gpu, record: impl FnOnce(&mut CommandEncoder) -> (T, u32)) -> (T, Vec<f64>) {
        let (result, times) = self.submit(gpu, record);
        (result, times.map_or(Vec::new(), |times| Self::ms(gpu, &gpu.wait_for(times))))
    }

    /// Submits what `record` records, and copies out as many queries as that says it wrote, if any.
    pub fn submit<T>(
        &self,
        gpu: &Gpu,
        record: impl FnOnce(&mut CommandEncoder) -> (T, u32),
    ) -> (T, Option<Readback>) {
        gpu.run(|encoder| {
            let (result, count) = record(encoder);
            if count == 0 {
                return (result, None);
            }
            let bytes = TIME * count;
            let times = Readback::new(gpu, [bytes; 2], 1);
            encoder.resolve_query_set(&self.queries, 0..count, &self.resolved, 0);
            encoder.copy_buffer_to_buffer(&self.resolved, 0, &times.buffer, 0, u64::from(bytes));
            (result, Some(times))
        })
    }

    /// What was copied out, in ms.
    pub fn ms(gpu: &Gpu, bytes: &[u8]) -> Vec<f64> {
        let period_ns = f64::from(gpu.queue.get_timestamp_period());
        let times: Vec<u64> = bytemuck::pod_collect_to_vec(bytes);
        times.into_iter().map(|t| t as f64 * period_ns * 1e-6).collect()
    }
}
