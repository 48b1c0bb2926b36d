//! Prefix sums and a stable radix sort on the device.

use crate::gpu::layout::{RadixUniform, ScanUniform};
use crate::gpu::pass::{BoundKernel, Kernel, Recorder, Resources};
use crate::gpu::resources::{self, SplitArray};
use crate::gpu::shader::stages;
use crate::gpu::{GpuDevice, GpuError};

/// `SCAN_BLOCK` of scan.wgsl.
const SCAN_BLOCK: u32 = 2048;
/// Threads of a workgroup in the scan and radix kernels.
const GROUP: u32 = 256;
/// `TILE` of radix.wgsl.
const TILE: u32 = 4096;
const DIGIT_BITS: u32 = 8;
const DIGITS: u32 = 1 << DIGIT_BITS;

/// An exclusive prefix sum in place over one buffer.
pub struct PrefixSum {
    uniform: wgpu::Buffer,
    kernels: [BoundKernel; 3],
}

impl PrefixSum {
    /// Prepares sums over up to `length_max` values of `values`.
    ///
    /// # Errors
    /// [`GpuError`] when a buffer can't be made.
    pub fn new(gpu: &GpuDevice, values: &wgpu::Buffer, length_max: u32) -> Result<Self, GpuError> {
        let uniform = resources::uniform::<ScanUniform>(gpu, "scan");
        let sums = resources::storage::<u32>(
            gpu,
            "scan_sums",
            u64::from(length_max.div_ceil(SCAN_BLOCK)),
        )?;
        let bound = Resources::default()
            .with("scan", &uniform)
            .with("scan_values", values)
            .with("scan_sums", &sums);
        let kernel = |stage| Kernel::new(gpu, stage, &[], &|_| 1)?.bind(gpu, &bound);
        let kernels = [
            kernel(stages::scan_blocks)?,
            kernel(stages::scan_totals)?,
            kernel(stages::scan_add)?,
        ];
        Ok(Self { uniform, kernels })
    }

    /// Sets the length; holds from the next submission on.
    pub fn set_length(&self, gpu: &GpuDevice, length: u32) {
        let value = ScanUniform {
            length,
            ..Default::default()
        };
        gpu.queue
            .write_buffer(&self.uniform, 0, bytemuck::bytes_of(&value));
    }

    /// Records the sum over `length` values.
    pub fn record(&self, recorder: &mut Recorder<'_>, name: &'static str, length: u32) {
        let [blocks, totals, add] = &self.kernels;
        let threads = length.div_ceil(SCAN_BLOCK) * GROUP;
        recorder.pass(name, &[(blocks, threads), (totals, 1), (add, threads)]);
    }
}

/// Sorts (key, order) pairs by key; pairs of equal keys keep their order.
pub struct RadixSort {
    /// For each digit: count, scatter.
    digits: Vec<(BoundKernel, BoundKernel)>,
    sum: PrefixSum,
    tile_count: u32,
}

impl RadixSort {
    /// Prepares sorting of up to `capacity` pairs with keys of `key_bits` bits.
    ///
    /// `keys` and `orders` are two arrays each; the pairs lie in the first before the sort, and after it in the first or
    /// second as [`RadixSort::sorted_side`] says. `counters` holds the count of pairs (`PhotonCounters.stored`).
    ///
    /// # Errors
    /// [`GpuError`] when a buffer can't be made.
    pub fn new(
        gpu: &GpuDevice,
        keys: [&SplitArray; 2],
        orders: [&SplitArray; 2],
        counters: &Resources<'_>,
        capacity: u32,
        key_bits: u32,
    ) -> Result<Self, GpuError> {
        let tile_count = capacity.div_ceil(TILE);
        let digit_counts =
            resources::storage::<u32>(gpu, "digit_counts", u64::from(DIGITS * tile_count))?;
        let sum = PrefixSum::new(gpu, &digit_counts, DIGITS * tile_count)?;
        sum.set_length(gpu, DIGITS * tile_count);
        let chunks = keys[0].chunks();
        let count = Kernel::new(gpu, stages::radix_count, &[], &|_| chunks)?;
        let scatter = Kernel::new(gpu, stages::radix_scatter, &[], &|_| chunks)?;
        let digits = (0..key_bits.div_ceil(DIGIT_BITS))
            .map(|digit| {
                let uniform = resources::uniform::<RadixUniform>(gpu, "radix");
                let value = RadixUniform {
                    shift: digit * DIGIT_BITS,
                    tile_count,
                    padding: [0; 2],
                };
                gpu.queue
                    .write_buffer(&uniform, 0, bytemuck::bytes_of(&value));
                let (from, to) = (digit as usize % 2, 1 - digit as usize % 2);
                let bound = counters
                    .clone()
                    .with("radix", &uniform)
                    .with_all(keys[from].resources_as("keys"))
                    .with_all(orders[from].resources_as("order"))
                    .with_all(keys[to].resources_as("sorted_keys"))
                    .with_all(orders[to].resources_as("sorted_order"))
                    .with("digit_counts", &digit_counts);
                Ok((count.bind(gpu, &bound)?, scatter.bind(gpu, &bound)?))
            })
            .collect::<Result<_, GpuError>>()?;
        Ok(Self {
            digits,
            sum,
            tile_count,
        })
    }

    /// Which of the two buffers holds the sorted pairs.
    pub fn sorted_side(&self) -> usize {
        self.digits.len() % 2
    }

    /// Records the sort.
    pub fn record(&self, recorder: &mut Recorder<'_>, name: &'static str) {
        let threads = self.tile_count * GROUP;
        for (count, scatter) in &self.digits {
            recorder.pass(name, &[(count, threads)]);
            self.sum.record(recorder, name, DIGITS * self.tile_count);
            recorder.pass(name, &[(scatter, threads)]);
        }
    }
}
