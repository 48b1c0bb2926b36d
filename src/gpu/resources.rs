//! Buffers: made by name and size, checked against the device's limits, cut into chunks where one binding is too small, read back.
//! And arrays that lie in textures.

use bytemuck::Pod;

use super::device::{GpuDevice, GpuError};
use super::pass::Resources;
use super::shader::{TEXEL_SHIFT, chunk_shift};

/// Smallest buffer that is made: an empty array still binds one element of any shared struct.
const MIN_BYTES: u64 = 256;

fn usage() -> wgpu::BufferUsages {
    wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC
}

/// A storage buffer of `count` elements of `T`, zeroed.
///
/// # Errors
/// [`GpuError::BufferTooLarge`] when the device can't hold or bind it.
pub fn storage<T: Pod>(gpu: &GpuDevice, name: &str, count: u64) -> Result<wgpu::Buffer, GpuError> {
    let bytes = (count.saturating_mul(size_of::<T>() as u64))
        .max(MIN_BYTES)
        .next_multiple_of(16);
    let limits = gpu.device.limits();
    let limit = limits
        .max_buffer_size
        .min(limits.max_storage_buffer_binding_size);
    if bytes > limit {
        return Err(GpuError::BufferTooLarge {
            buffer: name.into(),
            bytes,
            limit,
        });
    }
    Ok(gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(name),
        size: bytes,
        usage: usage(),
        mapped_at_creation: false,
    }))
}

/// A storage buffer that holds `data`.
///
/// # Errors
/// [`GpuError::BufferTooLarge`] when the device can't hold or bind it.
pub fn storage_with<T: Pod>(
    gpu: &GpuDevice,
    name: &str,
    data: &[T],
) -> Result<wgpu::Buffer, GpuError> {
    let buffer = storage::<T>(gpu, name, data.len() as u64)?;
    gpu.queue
        .write_buffer(&buffer, 0, bytemuck::cast_slice(data));
    Ok(buffer)
}

/// Three counts of workgroups that a shader writes and a later dispatch reads.
pub fn dispatch_counts(gpu: &GpuDevice, name: &str) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(name),
        size: 16,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::INDIRECT,
        mapped_at_creation: false,
    })
}

/// A uniform buffer for one `T`.
pub fn uniform<T: Pod>(gpu: &GpuDevice, name: &str) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(name),
        size: (size_of::<T>() as u64).next_multiple_of(16),
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// An array in as many buffers as its size needs, reached in WGSL through a `//! split` declaration of the same name.
#[derive(Debug)]
pub struct SplitArray {
    name: &'static str,
    chunks: Vec<wgpu::Buffer>,
    element_bytes: u64,
}

/// Most chunks of an array: the numbers of their bindings follow each other, and those of the next array begin after so many.
const CHUNKS_MAX: u32 = 16;

impl SplitArray {
    /// Room for `count` elements of `T`.
    ///
    /// # Errors
    /// [`GpuError::BufferTooLarge`] when even one chunk is too large for the device.
    pub fn new<T: Pod>(gpu: &GpuDevice, name: &'static str, count: u64) -> Result<Self, GpuError> {
        let element_bytes = size_of::<T>() as u64;
        let chunk = 1u64 << chunk_shift(element_bytes as u32);
        let chunk_count = Self::chunk_count::<T>(count);
        if chunk_count > CHUNKS_MAX {
            return Err(GpuError::BufferTooLarge {
                buffer: name.into(),
                bytes: count.saturating_mul(element_bytes),
                limit: u64::from(CHUNKS_MAX) * chunk * element_bytes,
            });
        }
        let chunks = (0..chunk_count)
            .map(|index| {
                storage::<T>(
                    gpu,
                    &format!("{name}_{index}"),
                    (count - u64::from(index) * chunk).min(chunk),
                )
            })
            .collect::<Result<_, _>>()?;
        Ok(Self {
            name,
            chunks,
            element_bytes,
        })
    }

    /// An array that holds `data`.
    ///
    /// # Errors
    /// [`GpuError::BufferTooLarge`] when even one chunk is too large for the device.
    pub fn with<T: Pod>(gpu: &GpuDevice, name: &'static str, data: &[T]) -> Result<Self, GpuError> {
        let array = Self::new::<T>(gpu, name, data.len() as u64)?;
        array.write(gpu, data);
        Ok(array)
    }

    /// Writes from the first element on; holds from the next submission on.
    pub fn write<T: Pod>(&self, gpu: &GpuDevice, data: &[T]) {
        let chunk = 1usize << chunk_shift(self.element_bytes as u32);
        for (buffer, part) in self.chunks.iter().zip(data.chunks(chunk)) {
            gpu.queue
                .write_buffer(buffer, 0, bytemuck::cast_slice(part));
        }
    }

    /// Fills it with zeros.
    pub fn clear(&self, encoder: &mut wgpu::CommandEncoder) {
        for chunk in &self.chunks {
            encoder.clear_buffer(chunk, 0, None);
        }
    }

    /// Copies the first `count` elements to the host; waits for the device.
    ///
    /// # Errors
    /// [`GpuError::Failed`] when the device is lost.
    pub fn read<T: Pod>(&self, gpu: &GpuDevice, count: u64) -> Result<Vec<T>, GpuError> {
        let chunk = 1u64 << chunk_shift(self.element_bytes as u32);
        let mut all = Vec::with_capacity(count as usize);
        for (index, buffer) in (0u64..).zip(&self.chunks) {
            let left = count.saturating_sub(index * chunk);
            all.extend(read_back::<T>(gpu, buffer, left.min(chunk))?);
        }
        Ok(all)
    }

    /// Its name in WGSL.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// How many chunks this array has.
    pub fn chunks(&self) -> u32 {
        self.chunks.len() as u32
    }

    /// Into how many chunks an array of `count` elements is cut.
    pub fn chunk_count<T>(count: u64) -> u32 {
        let chunk = 1u64 << chunk_shift(size_of::<T>() as u32);
        u32::try_from(count.div_ceil(chunk).max(1)).unwrap_or(u32::MAX)
    }

    /// Bytes of all chunks.
    pub fn bytes(&self) -> u64 {
        self.chunks.iter().map(wgpu::Buffer::size).sum()
    }

    /// The chunks, in order.
    pub fn buffers(&self) -> &[wgpu::Buffer] {
        &self.chunks
    }

    /// The chunks by their WGSL names, under the array's own name or an alias (for ping-pong).
    pub fn resources_as<'a>(&'a self, name: &str) -> Resources<'a> {
        self.chunks
            .iter()
            .enumerate()
            .fold(Resources::default(), |all, (index, chunk)| {
                all.with(&format!("{name}_{index}"), chunk)
            })
    }

    /// The chunks by their WGSL names.
    pub fn resources(&self) -> Resources<'_> {
        self.resources_as(self.name)
    }
}

/// A component of the vectors in a [`TexelArray`].
pub trait Component: Pod {
    /// The texture format of four of them.
    const FORMAT: wgpu::TextureFormat;
}

impl Component for f32 {
    const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Float;
}

impl Component for u32 {
    const FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba32Uint;
}

/// A constant array of four-component vectors in a texture, reached in WGSL through a `//! texel_array` declaration of the same name.
/// For arrays that are read at scattered places: software devices go thread by thread through a scattered read of a buffer, but
/// vectorise one of a texture, which makes rays 1.3 times as fast. A binding's size limit does not apply either.
#[derive(Debug)]
pub struct TexelArray {
    name: &'static str,
    texture: wgpu::Texture,
    view: wgpu::TextureView,
}

impl TexelArray {
    /// An array that holds `vectors`, row by row and layer by layer.
    ///
    /// # Errors
    /// [`GpuError::BufferTooLarge`] when the device has no texture with so many layers.
    pub fn new<T: Component>(
        gpu: &GpuDevice,
        name: &'static str,
        vectors: &[[T; 4]],
    ) -> Result<Self, GpuError> {
        let side = 1usize << TEXEL_SHIFT;
        let layer = side * side;
        let layers = vectors.len().div_ceil(layer).max(1);
        let most_layers = gpu.device.limits().max_texture_array_layers as usize;
        if layers > most_layers {
            return Err(GpuError::BufferTooLarge {
                buffer: name.into(),
                bytes: size_of_val(vectors) as u64,
                limit: (most_layers * layer * size_of::<[T; 4]>()) as u64,
            });
        }
        let texture = gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(name),
            size: wgpu::Extent3d {
                width: side as u32,
                height: vectors.len().div_ceil(side).clamp(1, side) as u32,
                depth_or_array_layers: layers as u32,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: T::FORMAT,
            usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::COPY_DST,
            view_formats: &[],
        });
        for (z, in_layer) in vectors.chunks(layer).enumerate() {
            let (rows, last_row) = in_layer.split_at(in_layer.len() / side * side);
            let write = |y: usize, width: usize, part: &[[T; 4]]| {
                let mut place = texture.as_image_copy();
                place.origin = wgpu::Origin3d {
                    x: 0,
                    y: y as u32,
                    z: z as u32,
                };
                let layout = wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some((width * size_of::<[T; 4]>()) as u32),
                    rows_per_image: None,
                };
                let size = wgpu::Extent3d {
                    width: width as u32,
                    height: (part.len() / width) as u32,
                    depth_or_array_layers: 1,
                };
                gpu.queue
                    .write_texture(place, bytemuck::cast_slice(part), layout, size);
            };
            if !rows.is_empty() {
                write(0, side, rows);
            }
            if !last_row.is_empty() {
                write(rows.len() / side, last_row.len(), last_row);
            }
        }
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        Ok(Self {
            name,
            texture,
            view,
        })
    }

    /// Its name in WGSL.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// The texture as shaders see it.
    pub fn view(&self) -> &wgpu::TextureView {
        &self.view
    }

    /// How many layers the texture has.
    pub fn layers(&self) -> u32 {
        self.texture.depth_or_array_layers()
    }

    /// Bytes of the texture.
    pub fn bytes(&self) -> u64 {
        let texel = self.texture.format().block_copy_size(None).unwrap_or(0);
        let size = self.texture.size();
        [texel, size.width, size.height, size.depth_or_array_layers]
            .map(u64::from)
            .iter()
            .product()
    }
}

/// Copies the first `count` elements of a buffer to the host; waits for the device.
///
/// # Errors
/// [`GpuError::Failed`] when the device is lost.
pub fn read_back<T: Pod>(
    gpu: &GpuDevice,
    buffer: &wgpu::Buffer,
    count: u64,
) -> Result<Vec<T>, GpuError> {
    let bytes = (count * size_of::<T>() as u64).next_multiple_of(4);
    let staging = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("read back"),
        size: bytes,
        usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, bytes);
    gpu.queue.submit([encoder.finish()]);
    staging.slice(..).map_async(wgpu::MapMode::Read, |_| ());
    gpu.wait("reading results back")?;
    let mapped = staging
        .slice(..)
        .get_mapped_range()
        .map_err(|error| GpuError::Failed {
            during: "reading results back".into(),
            reason: error.to_string(),
        })?;
    Ok(bytemuck::pod_collect_to_vec(
        &mapped[..count as usize * size_of::<T>()],
    ))
}
