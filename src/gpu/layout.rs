//! Every struct that host and shaders share, in the layout of WGSL. `tests/shader_layout.rs` compares each with its WGSL namesake by
//! reflection: sizes, offsets, names.

use bytemuck::{Pod, Zeroable};

/// Declares a host struct and lists its fields for the layout test.
macro_rules! shared_struct {
    ($(#[doc = $doc:literal])+ $name:ident { $($(#[doc = $field_doc:literal])* $field:ident: $ty:ty,)+ }) => {
        $(#[doc = $doc])+
        #[repr(C)]
        #[derive(Clone, Copy, Debug, Default, Pod, Zeroable)]
        pub struct $name {
            $($(#[doc = $field_doc])* #[allow(missing_docs, reason = "documented in the shader")] pub $field: $ty,)+
        }
        impl SharedStruct for $name {
            const NAME: &'static str = stringify!($name);
            fn fields() -> Vec<(&'static str, usize)> {
                vec![$((stringify!($field), std::mem::offset_of!($name, $field)),)+]
            }
        }
    };
}

/// A struct that a shader module declares under the same name.
pub trait SharedStruct: Pod {
    /// Name in WGSL.
    const NAME: &'static str;
    /// Name and byte offset of each field, in order.
    fn fields() -> Vec<(&'static str, usize)>;
}

/// Three rows of an affine map.
pub type AffineRows = [[f32; 4]; 3];

/// The rows of an affine map.
pub fn affine_rows(map: glam::Affine3A) -> AffineRows {
    let [x, y, z, w] = [
        map.matrix3.x_axis,
        map.matrix3.y_axis,
        map.matrix3.z_axis,
        map.translation,
    ];
    [
        [x.x, y.x, z.x, w.x],
        [x.y, y.y, z.y, w.y],
        [x.z, y.z, z.z, w.z],
    ]
}

shared_struct! {
    /// What every dispatch knows of the scene.
    SceneUniform {
        bounds_center: [f32; 3],
        bounds_radius_m: f32,
        ray_offset_m: f32,
        light_count: u32,
        object_count: u32,
        delta_light_count: u32,
    }
}

shared_struct! {
    /// A material.
    Material {
        base_color: [f32; 3],
        metallic: f32,
        emission: [f32; 3],
        roughness: f32,
        specular_color: [f32; 3],
        specular_factor: f32,
        absorption: [f32; 3],
        ior: f32,
        transmission: f32,
        alpha_cutoff: f32,
        flags: u32,
        base_color_texture: i32,
        metallic_roughness_texture: i32,
        emission_texture: i32,
        padding: [u32; 2],
    }
}

/// `MATERIAL_DOUBLE_SIDED` of scene.wgsl.
pub const MATERIAL_DOUBLE_SIDED: u32 = 1;
/// `MATERIAL_SOLID` of scene.wgsl.
pub const MATERIAL_SOLID: u32 = 2;

shared_struct! {
    /// One use of a texture.
    TextureUse {
        first_texel: u32,
        width: u32,
        height: u32,
        flags: u32,
        uv_column0: [f32; 2],
        uv_column1: [f32; 2],
        uv_offset: [f32; 2],
        padding: [f32; 2],
    }
}

/// `TEXTURE_BILINEAR` of scene.wgsl.
pub const TEXTURE_BILINEAR: u32 = 16;
/// `TEXTURE_SRGB` of scene.wgsl.
pub const TEXTURE_SRGB: u32 = 32;

shared_struct! {
    /// A moving object's place.
    Object {
        scene_from_object: AffineRows,
        object_from_scene: AffineRows,
        root_node: u32,
        padding0: u32,
        padding1: u32,
        padding2: u32,
    }
}

shared_struct! {
    /// A light.
    Light {
        position: [f32; 3],
        kind: u32,
        edge1: [f32; 3],
        alias_share: f32,
        edge2: [f32; 3],
        alias_index: u32,
        emission: [f32; 3],
        pick_probability: f32,
        spot_scale: f32,
        spot_offset: f32,
        spot_cos_outer: f32,
        area_m2: f32,
        triangle: u32,
        emission_texture: i32,
        sides: u32,
        unshadowed_probability: f32,
    }
}

shared_struct! {
    /// A sphere around what is specular.
    SpecularTarget {
        center: [f32; 3],
        radius_m: f32,
        importance: f32,
        padding0: u32,
        padding1: u32,
        padding2: u32,
    }
}

shared_struct! {
    /// One wavefront's numbers.
    TraceUniform {
        seed: u32,
        frame: u32,
        first_path: u32,
        path_count: u32,
        bounce: u32,
        depth_max: u32,
        capacity: u32,
        padding: u32,
    }
}

shared_struct! {
    /// What became of the photons of one map.
    PhotonCounters {
        alive: u32,
        stored: u32,
        batch_stored: u32,
        batch_overflows: u32,
        emitted: u32,
        dropped_paths: u32,
        dropped_photons: u32,
        padding: u32,
    }
}

shared_struct! {
    /// A path between bounces.
    PhotonPath {
        origin: [f32; 3],
        state: u32,
        direction: [f32; 3],
        path: u32,
        flux_w: [f32; 3],
        padding: u32,
    }
}

shared_struct! {
    /// A photon as a bounce leaves it.
    Photon {
        position: [f32; 3],
        packed_incident: u32,
        flux_w: [f32; 3],
        packed_normal: u32,
    }
}

shared_struct! {
    /// One class' grid.
    PhotonGrid {
        origin: [f32; 3],
        cells_per_m: f32,
        dimensions: [u32; 3],
        first_cell: u32,
    }
}

shared_struct! {
    /// The grids and how they are gathered from.
    PhotonMapUniform {
        grids: [PhotonGrid; 2],
        global_radius_m: f32,
        caustic_radius_m: f32,
        cell_count: u32,
        normal_cos_min: f32,
        flatness: f32,
        padding0: u32,
        padding1: u32,
        padding2: u32,
    }
}

shared_struct! {
    /// One pass of the radix sort.
    RadixUniform {
        shift: u32,
        tile_count: u32,
        padding: [u32; 2],
    }
}

shared_struct! {
    /// Length of a prefix sum.
    ScanUniform {
        length: u32,
        padding0: u32,
        padding1: u32,
        padding2: u32,
    }
}

shared_struct! {
    /// The eye at work.
    EyeUniform {
        scene_from_view: AffineRows,
        slope_left_top: [f32; 2],
        slope_extent: [f32; 2],
        gaze_dir_in_view: [f32; 3],
        fovea_radius_rad: f32,
        size: [u32; 2],
        first_row: u32,
        row_count: u32,
        samples: [u32; 3],
        transition_radius_rad: f32,
        radius_scale: [f32; 3],
        sample: u32,
        seed: u32,
        frame: u32,
        shadow_rays: u32,
        light_candidates: u32,
        paths: [u32; 3],
        chain_max: u32,
        path_depth_max: u32,
        resolve_first_row: u32,
        resolve_row_count: u32,
        kept_max: u32,
        previous_view_from_scene: AffineRows,
        previous_slope_left_top: [f32; 2],
        previous_slope_extent: [f32; 2],
        refresh_frames: u32,
        padding0: u32,
        padding1: u32,
        padding2: u32,
    }
}

shared_struct! {
    /// Where an eye path gathers.
    VisiblePoint {
        position: [f32; 3],
        packed_normal: u32,
        throughput: [f32; 3],
        packed_geometric_normal: u32,
        diffuse: [f32; 3],
        packed_wo: u32,
        f0: [f32; 3],
        packed_alpha_f90: u32,
        coat_f0: [f32; 3],
        coat_f90: f32,
    }
}

shared_struct! {
    /// How an image is shown.
    PresentUniform {
        size: [u32; 2],
        exposure: f32,
        padding: u32,
    }
}
