//! Time per pass from GPU timestamps.

use super::device::{GpuDevice, GpuError};
use super::resources::read_back;

/// Timestamps of the passes of one submission.
pub struct Timestamps {
    queries: Option<Queries>,
    names: Vec<&'static str>,
}

struct Queries {
    set: wgpu::QuerySet,
    resolved: wgpu::Buffer,
    period_ns: f32,
}

/// Passes that can be timed in one submission; more run untimed.
const CAPACITY: u32 = 2048;

/// Time that the passes of one name took in one submission, in frame order of their first run.
#[derive(Clone, Debug, PartialEq)]
pub struct PassTime {
    /// Name of the pass.
    pub name: &'static str,
    /// Sum over its runs, milliseconds.
    pub ms: f64,
}

fn query_set(gpu: &GpuDevice) -> wgpu::QuerySet {
    gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
        label: Some("timestamps"),
        ty: wgpu::QueryType::Timestamp,
        count: CAPACITY * 2,
    })
}

impl Timestamps {
    /// Room for timestamps; does nothing on a device that has none.
    pub fn new(gpu: &GpuDevice) -> Self {
        let queries = gpu.timestamp_period_ns.map(|period_ns| Queries {
            set: query_set(gpu),
            resolved: gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("timestamps"),
                size: u64::from(CAPACITY) * 16,
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            }),
            period_ns,
        });
        Self {
            queries,
            names: Vec::new(),
        }
    }

    pub(super) fn compute_writes(
        &mut self,
        name: &'static str,
    ) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        let queries = self.queries.as_ref()?;
        let index = self.names.len() as u32;
        if index >= CAPACITY {
            return None;
        }
        self.names.push(name);
        Some(wgpu::ComputePassTimestampWrites {
            query_set: &queries.set,
            beginning_of_pass_write_index: Some(index * 2),
            end_of_pass_write_index: Some(index * 2 + 1),
        })
    }

    /// Records the copy that makes the timestamps readable; call it after the last pass of the submission.
    pub fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        if let Some(queries) = &self.queries
            && !self.names.is_empty()
        {
            encoder.resolve_query_set(
                &queries.set,
                0..self.names.len() as u32 * 2,
                &queries.resolved,
                0,
            );
        }
    }

    /// Reads the times of the finished submission and starts afresh. Empty where the device has no timestamps.
    ///
    /// # Errors
    /// [`GpuError::Failed`] when the device is lost.
    pub fn read(&mut self, gpu: &GpuDevice) -> Result<Vec<PassTime>, GpuError> {
        let names = std::mem::take(&mut self.names);
        let Some(queries) = &mut self.queries else {
            return Ok(Vec::new());
        };
        if names.is_empty() {
            return Ok(Vec::new());
        }
        let ticks: Vec<u64> = read_back(gpu, &queries.resolved, names.len() as u64 * 2)?;
        // Mesa 22.3's software driver keeps the old value of a query that is written again.
        queries.set = query_set(gpu);
        let mut times: Vec<PassTime> = Vec::new();
        for (index, name) in names.into_iter().enumerate() {
            let elapsed = ticks[index * 2 + 1].saturating_sub(ticks[index * 2]);
            let ms = elapsed as f64 * f64::from(queries.period_ns) * 1e-6;
            match times.iter_mut().find(|time| time.name == name) {
                Some(time) => time.ms += ms,
                None => times.push(PassTime { name, ms }),
            }
        }
        Ok(times)
    }
}
