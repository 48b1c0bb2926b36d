//! Checked reading of accessors (glTF 2.0, section 3.6.2): no offset, stride, count or sparse index of the file is trusted.

use std::borrow::Cow;

use gltf::json;
use gltf::json::accessor::{ComponentType, GenericComponentType, IndexComponentType};
use gltf::json::validation::Checked;

use super::error::SceneProblem;

/// The accessors of a document, over the contents of its buffers.
pub(super) struct Accessors<'a> {
    pub root: &'a json::Root,
    pub buffers: &'a [Cow<'a, [u8]>],
}

/// Elements of equal size, `stride` bytes apart. `bytes` reaches to the end of the last one.
struct Elements<'a> {
    bytes: &'a [u8],
    stride: usize,
    size: usize,
    count: usize,
}

impl<'a> Elements<'a> {
    fn iter(&self) -> impl Iterator<Item = &'a [u8]> {
        let (bytes, stride, size) = (self.bytes, self.stride, self.size);
        (0..self.count).map(move |i| &bytes[i * stride..i * stride + size])
    }
}

impl<'a> Accessors<'a> {
    /// Elements that the accessor claims to hold: compare with a limit before reading it.
    pub fn count(&self, accessor: usize) -> u64 {
        self.root.accessors[accessor].count.0
    }

    /// Vectors of `N` floats; integers become floats as the accessor says (`normalized`).
    ///
    /// # Errors
    /// If the accessor is not such a vector, reaches beyond its buffer, or holds a value that is not finite; `what` names it.
    pub fn read_vectors<const N: usize>(
        &self,
        accessor: usize,
        what: &str,
    ) -> Result<Vec<[f32; N]>, SceneProblem> {
        let json = &self.root.accessors[accessor];
        let (Checked::Valid(dimensions), Checked::Valid(GenericComponentType(component))) =
            (json.type_, json.component_type)
        else {
            return Err(invalid(what, accessor, "has an unknown type"));
        };
        if dimensions.multiplicity() != N {
            let message = format!("has type {dimensions:?}, but {N} components are needed");
            return Err(invalid(what, accessor, &message));
        }
        let decode = decoder(component, json.normalized);
        let component_size = component.size();
        let decode_element = |bytes: &[u8]| -> [f32; N] {
            std::array::from_fn(|c| decode(&bytes[c * component_size..]))
        };

        let size = N * component_size;
        let mut vectors: Vec<[f32; N]> = match json.buffer_view {
            Some(view) => {
                let offset = json.byte_offset.unwrap_or_default().0;
                self.elements(view.value(), offset, size, json.count.0)
                    .ok_or_else(|| invalid(what, accessor, "reaches beyond its buffer"))?
                    .iter()
                    .map(decode_element)
                    .collect()
            }
            // Zeros that a sparse part fills: the count is bounded by the caller's limit, not by the file's size.
            None => vec![[0.0; N]; usize::try_from(json.count.0).unwrap_or(0)],
        };
        if let Some(sparse) = &json.sparse {
            self.overwrite(&mut vectors, sparse, size, decode_element)
                .ok_or_else(|| {
                    invalid(
                        what,
                        accessor,
                        "has a sparse part that reaches out of range",
                    )
                })?;
        }
        match vectors
            .iter()
            .position(|v| !v.iter().all(|c| c.is_finite()))
        {
            None => Ok(vectors),
            Some(at) => Err(SceneProblem::NotFinite(format!(
                "{what} (accessor {accessor}): element {at} is NaN or infinite; export the scene again"
            ))),
        }
    }

    /// Vertex indices.
    ///
    /// # Errors
    /// If they are no unsigned integers, or reach beyond their buffer; `what` names them.
    pub fn read_indices(&self, accessor: usize, what: &str) -> Result<Vec<u32>, SceneProblem> {
        let json = &self.root.accessors[accessor];
        let Checked::Valid(GenericComponentType(component)) = json.component_type else {
            return Err(invalid(what, accessor, "has an unknown type"));
        };
        let is_scalar = matches!(json.type_, Checked::Valid(json::accessor::Type::Scalar));
        let decode = index_decoder(component)
            .filter(|_| is_scalar && json.sparse.is_none())
            .ok_or_else(|| invalid(what, accessor, "does not hold plain unsigned integers"))?;
        let offset = json.byte_offset.unwrap_or_default().0;
        let elements = json
            .buffer_view
            .and_then(|view| self.elements(view.value(), offset, component.size(), json.count.0))
            .ok_or_else(|| invalid(what, accessor, "reaches beyond its buffer"))?;
        Ok(elements.iter().map(decode).collect())
    }

    fn overwrite<const N: usize>(
        &self,
        vectors: &mut [[f32; N]],
        sparse: &json::accessor::sparse::Sparse,
        size: usize,
        decode_element: impl Fn(&[u8]) -> [f32; N],
    ) -> Option<()> {
        let Checked::Valid(IndexComponentType(component)) = sparse.indices.component_type else {
            return None;
        };
        let decode_index = index_decoder(component)?;
        let count = sparse.count.0;
        let (index_view, value_view) = (sparse.indices.buffer_view, sparse.values.buffer_view);
        let index_offset = sparse.indices.byte_offset.0;
        let value_offset = sparse.values.byte_offset.0;
        let indices = self.elements(index_view.value(), index_offset, component.size(), count)?;
        let values = self.elements(value_view.value(), value_offset, size, count)?;
        for (index, value) in indices.iter().zip(values.iter()) {
            *vectors.get_mut(decode_index(index) as usize)? = decode_element(value);
        }
        Some(())
    }

    /// `count` elements of `size` bytes from `offset` in a buffer view, or `None` where they do not fit.
    fn elements(&self, view: usize, offset: u64, size: usize, count: u64) -> Option<Elements<'a>> {
        let view = &self.root.buffer_views[view];
        let buffer: &'a [u8] = &self.buffers[view.buffer.value()];
        let start = usize::try_from(view.byte_offset.unwrap_or_default().0).ok()?;
        let length = usize::try_from(view.byte_length.0).ok()?;
        let in_view = buffer.get(start..start.checked_add(length)?)?;
        let bytes = in_view.get(usize::try_from(offset).ok()?..)?;
        let stride = view.byte_stride.map_or(size, |stride| stride.0).max(1);
        let count = usize::try_from(count).ok()?;
        let needed = match count.checked_sub(1) {
            Some(steps) => steps.checked_mul(stride)?.checked_add(size)?,
            None => 0,
        };
        Some(Elements {
            bytes: bytes.get(..needed)?,
            stride,
            size,
            count,
        })
    }
}

fn invalid(what: &str, accessor: usize, message: &str) -> SceneProblem {
    SceneProblem::Invalid(format!("{what}: accessor {accessor} {message}"))
}

/// Reads one component; normalised integers as in glTF 2.0, section 3.11 (c / max, signed ones at least -1).
fn decoder(component: ComponentType, is_normalized: bool) -> fn(&[u8]) -> f32 {
    match (component, is_normalized) {
        (ComponentType::F32, _) => |b| f32::from_le_bytes([b[0], b[1], b[2], b[3]]),
        (ComponentType::U32, _) => |b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as f32,
        (ComponentType::U8, false) => |b| f32::from(b[0]),
        (ComponentType::U8, true) => |b| f32::from(b[0]) / 255.0,
        (ComponentType::I8, false) => |b| f32::from(b[0] as i8),
        (ComponentType::I8, true) => |b| (f32::from(b[0] as i8) / 127.0).max(-1.0),
        (ComponentType::U16, false) => |b| f32::from(u16::from_le_bytes([b[0], b[1]])),
        (ComponentType::U16, true) => |b| f32::from(u16::from_le_bytes([b[0], b[1]])) / 65535.0,
        (ComponentType::I16, false) => |b| f32::from(i16::from_le_bytes([b[0], b[1]])),
        (ComponentType::I16, true) => {
            |b| (f32::from(i16::from_le_bytes([b[0], b[1]])) / 32767.0).max(-1.0)
        }
    }
}

/// Reads one unsigned index, or `None` for a type that indices cannot have.
fn index_decoder(component: ComponentType) -> Option<fn(&[u8]) -> u32> {
    match component {
        ComponentType::U8 => Some(|b| u32::from(b[0])),
        ComponentType::U16 => Some(|b| u32::from(u16::from_le_bytes([b[0], b[1]]))),
        ComponentType::U32 => Some(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]])),
        ComponentType::I8 | ComponentType::I16 | ComponentType::F32 => None,
    }
}
