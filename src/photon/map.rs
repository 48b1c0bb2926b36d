//! The photon map: photons sorted into a grid of cells as wide as the gather radius, two classes (global, caustic) side by side.

use glam::Vec3;

use super::sort::{PrefixSum, RadixSort};
use super::store::{PhotonClass, PhotonStore};
use crate::gpu::layout::{PhotonGrid, PhotonMapUniform};
use crate::gpu::pass::{BoundKernel, Kernel, Recorder, Resources};
use crate::gpu::resources::{self, SplitArray};
use crate::gpu::shader::stages;
use crate::gpu::{GpuDevice, GpuError};
use crate::scene::Aabb;

/// Most cells in one class' grid; a smaller radius gets wider cells instead.
const CELLS_MAX: u32 = 1 << 21;
/// Bits of a cell's number over both grids.
const KEY_BITS: u32 = 22;

/// Name of the pass that sorts photons, as the timings give it.
pub const SORTING: &str = "photon sorting";

/// How a map is gathered from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MapSettings {
    /// Radius of the global class in the fovea, metres; no matter where the map has none.
    pub global_radius_m: f32,
    /// Radius of the caustic class in the fovea, metres; no matter where the map has none.
    pub caustic_radius_m: f32,
    /// Largest factor on the radii anywhere in the image, at least 1.
    pub radius_scale_max: f32,
    /// See `gather.normal_cos_min`.
    pub normal_cos_min: f32,
    /// See `gather.flatness`.
    pub flatness: f32,
}

/// Photons in the order of their cells.
pub struct PhotonMap {
    uniform: wgpu::Buffer,
    cell_counts: wgpu::Buffer,
    positions: SplitArray,
    fluxes: SplitArray,
    keys: BoundKernel,
    sort: RadixSort,
    count: BoundKernel,
    cell_sum: PrefixSum,
    arrange: BoundKernel,
    capacity: u32,
    bounds: Aabb,
    classes: &'static [PhotonClass],
    cell_count: u32,
}

impl PhotonMap {
    /// Room for all the photons of `store`, over `bounds`, with a grid for each of its classes.
    ///
    /// # Errors
    /// [`GpuError::BufferTooLarge`] when the map does not fit the device.
    pub fn new(gpu: &GpuDevice, store: &PhotonStore, bounds: Aabb) -> Result<Self, GpuError> {
        let capacity = store.capacity();
        let count = u64::from(capacity);
        let uniform = resources::uniform::<PhotonMapUniform>(gpu, "photon_map");
        // One more than the cells: the last entry is the end of the last cell.
        let classes = store.classes();
        let cell_count_max = classes.len() as u32 * CELLS_MAX;
        let cell_counts =
            resources::storage::<u32>(gpu, "cell_counts", u64::from(cell_count_max) + 1)?;
        let positions = SplitArray::new::<[f32; 4]>(gpu, "map_position", count)?;
        let fluxes = SplitArray::new::<[f32; 4]>(gpu, "map_flux", count)?;
        let key_sides = [
            SplitArray::new::<u32>(gpu, "keys", count)?,
            SplitArray::new::<u32>(gpu, "sorted_keys", count)?,
        ];
        let order_sides = [
            SplitArray::new::<u32>(gpu, "order", count)?,
            SplitArray::new::<u32>(gpu, "sorted_order", count)?,
        ];
        let photons = store.resources();
        let sort = RadixSort::new(
            gpu,
            key_sides.each_ref(),
            order_sides.each_ref(),
            &photons,
            capacity,
            KEY_BITS,
        )?;
        let size_of_name = |array: &str| match array {
            "keys" | "order" => key_sides[0].chunks(),
            _ => store.chunks(),
        };
        let kernel = |stage| Kernel::new(gpu, stage, &[], &size_of_name);
        let unsorted = photons
            .clone()
            .with("photon_map", &uniform)
            .with_all(key_sides[0].resources_as("keys"))
            .with_all(order_sides[0].resources_as("order"));
        let side = sort.sorted_side();
        let sorted = photons
            .with_all(key_sides[side].resources_as("keys"))
            .with_all(order_sides[side].resources_as("order"))
            .with("cell_counts", &cell_counts)
            .with_all(positions.resources())
            .with_all(fluxes.resources());
        Ok(Self {
            keys: kernel(stages::photon_keys)?.bind(gpu, &unsorted)?,
            count: kernel(stages::grid_count)?.bind(gpu, &sorted)?,
            arrange: kernel(stages::photon_arrange)?.bind(gpu, &sorted)?,
            cell_sum: PrefixSum::new(gpu, &cell_counts, cell_count_max + 1)?,
            sort,
            uniform,
            cell_counts,
            positions,
            fluxes,
            capacity,
            bounds,
            classes,
            cell_count: 1,
        })
    }

    /// The classes that photons are told apart in.
    pub fn classes(&self) -> &'static [PhotonClass] {
        self.classes
    }

    /// Sets the radii, and with them the cells; holds from the next submission on.
    pub fn configure(&mut self, gpu: &GpuDevice, settings: &MapSettings) {
        let mut grids = [PhotonGrid::default(); 2];
        self.cell_count = 0;
        for class in self.classes {
            let radius_m = match class {
                PhotonClass::Global => settings.global_radius_m,
                PhotonClass::Caustic => settings.caustic_radius_m,
            };
            let cell_m = radius_m * settings.radius_scale_max;
            let grid = grid(self.bounds, cell_m, self.cell_count);
            self.cell_count += grid.dimensions.iter().product::<u32>();
            grids[*class as usize] = grid;
        }
        let value = PhotonMapUniform {
            grids,
            global_radius_m: settings.global_radius_m,
            caustic_radius_m: settings.caustic_radius_m,
            cell_count: self.cell_count,
            normal_cos_min: settings.normal_cos_min,
            flatness: settings.flatness,
            ..Default::default()
        };
        gpu.queue
            .write_buffer(&self.uniform, 0, bytemuck::bytes_of(&value));
        self.cell_sum.set_length(gpu, self.cell_count + 1);
    }

    /// Records the sorting of the photons into the grid.
    pub fn record(&self, recorder: &mut Recorder<'_>) {
        self.record_as(recorder, SORTING);
    }

    /// As [`PhotonMap::record`], as a part of the pass `name`.
    pub fn record_as(&self, recorder: &mut Recorder<'_>, name: &'static str) {
        recorder.encoder().clear_buffer(
            &self.cell_counts,
            0,
            Some(u64::from(self.cell_count + 1) * 4),
        );
        recorder.pass(name, &[(&self.keys, self.capacity)]);
        self.sort.record(recorder, SORTING);
        recorder.pass(
            name,
            &[(&self.count, self.capacity), (&self.arrange, self.capacity)],
        );
        self.cell_sum.record(recorder, name, self.cell_count + 1);
    }

    /// The sorted map by its WGSL names.
    pub fn resources(&self) -> Resources<'_> {
        Resources::default()
            .with("photon_map", &self.uniform)
            .with("cell_counts", &self.cell_counts)
            .with_all(self.positions.resources())
            .with_all(self.fluxes.resources())
    }
}

/// A grid over `bounds` with cells at least `cell_m` wide and no more than [`CELLS_MAX`] of them.
fn grid(bounds: Aabb, cell_m: f32, first_cell: u32) -> PhotonGrid {
    let extent = if bounds.is_empty() {
        Vec3::ZERO
    } else {
        bounds.max - bounds.min
    };
    let mut cell_m = cell_m
        .max(extent.max_element() * 1e-3)
        .max(f32::MIN_POSITIVE);
    let dimensions_at = |cell_m: f32| (extent / cell_m).map(|cells| cells.floor() + 1.0);
    while f64::from(dimensions_at(cell_m).x)
        * f64::from(dimensions_at(cell_m).y)
        * f64::from(dimensions_at(cell_m).z)
        > f64::from(CELLS_MAX)
    {
        cell_m *= 1.1;
    }
    PhotonGrid {
        origin: if bounds.is_empty() {
            [0.0; 3]
        } else {
            bounds.min.to_array()
        },
        cells_per_m: 1.0 / cell_m,
        dimensions: dimensions_at(cell_m).as_uvec3().to_array(),
        first_cell,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_covers_its_bounds_with_cells_no_narrower_than_asked() {
        for (extent, cell_m) in [
            (Vec3::new(2.0, 3.0, 4.0), 0.1),
            (Vec3::splat(1e3), 1e-3),
            (Vec3::new(0.0, 1.0, 0.0), 0.01),
        ] {
            let bounds = Aabb {
                min: -extent,
                max: Vec3::ZERO,
            };
            let grid = grid(bounds, cell_m, 0);
            let covered = Vec3::from_array(grid.dimensions.map(|d| d as f32)) / grid.cells_per_m;
            assert!(
                covered.cmpge(extent).all() && 1.0 / grid.cells_per_m >= cell_m * 0.999,
                "{extent} {cell_m}"
            );
            assert!(grid.dimensions.iter().product::<u32>() <= CELLS_MAX);
        }
    }
}
