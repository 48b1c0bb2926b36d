//! Time per pass: from GPU timestamps, or on a software device from the clock on the wall.
//!
//! Software drivers run a submission on the calling machine's own cores, so waiting after each pass costs nothing there, while their
//! timestamps can't be trusted: Mesa 22.3 takes them when the next framebuffer is flushed.

use std::time::Instant;

use super::device::{GpuDevice, GpuError};
use super::resources::read_back;

/// Time that the passes of one name took in one submission, in frame order of their first run.
#[derive(Clone, Debug, PartialEq)]
pub struct PassTime {
    /// Name of the pass.
    pub name: &'static str,
    /// Sum over its runs, milliseconds.
    pub ms: f64,
}

/// Times of the passes of one frame.
pub struct PassTimer {
    source: Source,
    /// Passes timed so far: with timestamps, in the order of the queries; by the wall clock, with their times.
    names: Vec<&'static str>,
    walls_ms: Vec<f64>,
    /// By the wall clock: the passes at work and when they started.
    running: Option<(&'static str, Instant)>,
    /// Work of the host.
    host: Vec<PassTime>,
}

enum Source {
    Timestamps {
        set: wgpu::QuerySet,
        resolved: wgpu::Buffer,
        period_ns: f32,
    },
    WallClock,
    Nothing,
}

/// Passes that can be timed by timestamps in one frame: WebGPU's largest query set. More run untimed, and a warning says so.
const CAPACITY: u32 = 2048;

impl PassTimer {
    /// Takes what the device has: nothing is timed on a GPU without timestamps.
    pub fn new(gpu: &GpuDevice) -> Self {
        let source = match gpu.timestamp_period_ns {
            _ if gpu.info.device_type == wgpu::DeviceType::Cpu => Source::WallClock,
            None => Source::Nothing,
            Some(period_ns) => Source::Timestamps {
                set: gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                    label: Some("timestamps"),
                    ty: wgpu::QueryType::Timestamp,
                    count: CAPACITY * 2,
                }),
                resolved: gpu.device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some("timestamps"),
                    size: u64::from(CAPACITY) * 16,
                    usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                    mapped_at_creation: false,
                }),
                period_ns,
            },
        };
        Self {
            source,
            names: Vec::new(),
            walls_ms: Vec::new(),
            running: None,
            host: Vec::new(),
        }
    }

    /// What a pass of that name writes its timestamps to.
    pub(super) fn compute_writes(
        &mut self,
        name: &'static str,
    ) -> Option<wgpu::ComputePassTimestampWrites<'_>> {
        let Source::Timestamps { set, .. } = &self.source else {
            return None;
        };
        let index = self.names.len() as u32;
        if index >= CAPACITY {
            if index == CAPACITY {
                tracing::warn!(
                    "more than {CAPACITY} passes in a frame: the last ones are not timed"
                );
            }
            return None;
        }
        self.names.push(name);
        Some(wgpu::ComputePassTimestampWrites {
            query_set: set,
            beginning_of_pass_write_index: Some(index * 2),
            end_of_pass_write_index: Some(index * 2 + 1),
        })
    }

    /// Whether a pass of that name is timed by waiting for what came before: it is the first of its name in a row.
    pub(super) fn waits_before(&self, name: &'static str) -> bool {
        matches!(self.source, Source::WallClock)
            && self.running.is_none_or(|(running, _)| running != name)
    }

    /// Notes that all passes before are done and that those named `name` start.
    pub(super) fn starts(&mut self, name: &'static str) {
        self.stop();
        self.running = Some((name, Instant::now()));
    }

    /// Takes note of work of the host that ran since `started`, with the device idle.
    pub(super) fn add_host_pass(&mut self, name: &'static str, started: Instant) {
        if let Some((_, running_since)) = &mut self.running {
            // What the device did before is done: its clock goes on when the next pass is recorded.
            *running_since += started.elapsed();
        }
        self.host.push(PassTime {
            name,
            ms: started.elapsed().as_secs_f64() * 1e3,
        });
    }

    fn stop(&mut self) {
        if let Some((name, started)) = self.running.take() {
            self.names.push(name);
            self.walls_ms.push(started.elapsed().as_secs_f64() * 1e3);
        }
    }

    /// Records the copy that makes the timestamps readable; call it after the last pass of the frame.
    pub(super) fn resolve(&self, encoder: &mut wgpu::CommandEncoder) {
        if let Source::Timestamps { set, resolved, .. } = &self.source
            && !self.names.is_empty()
        {
            encoder.resolve_query_set(set, 0..self.names.len() as u32 * 2, resolved, 0);
        }
    }

    /// Reads the times of the finished frame and starts afresh. Empty where nothing can be timed.
    ///
    /// # Errors
    /// [`GpuError::Failed`] when the device is lost.
    pub fn read(&mut self, gpu: &GpuDevice) -> Result<Vec<PassTime>, GpuError> {
        self.stop();
        let names = std::mem::take(&mut self.names);
        let walls_ms = std::mem::take(&mut self.walls_ms);
        let all_ms: Vec<f64> = match &self.source {
            Source::Timestamps {
                resolved,
                period_ns,
                ..
            } if !names.is_empty() => {
                let ticks: Vec<u64> = read_back(gpu, resolved, names.len() as u64 * 2)?;
                let ms_of = |pair: &[u64]| {
                    pair[1].saturating_sub(pair[0]) as f64 * f64::from(*period_ns) * 1e-6
                };
                ticks.chunks_exact(2).map(ms_of).collect()
            }
            _ => walls_ms,
        };
        let mut times: Vec<PassTime> = Vec::new();
        let on_host = std::mem::take(&mut self.host);
        let on_host = on_host.into_iter().map(|time| (time.name, time.ms));
        for (name, ms) in on_host.chain(names.into_iter().zip(all_ms)) {
            match times.iter_mut().find(|time| time.name == name) {
                Some(time) => time.ms += ms,
                None => times.push(PassTime { name, ms }),
            }
        }
        Ok(times)
    }
}
