//! The registry of WGSL modules and entry points, and how a dispatch's source is put together.
//!
//! A shader file names the shared modules that it builds on in a first line `//! use a, b`. WGSL does not care about the order of
//! declarations, so composing is concatenating each module once. An array that may outgrow the device's largest binding is declared
//! by a line `//! split ..` (see `split_declaration`), one that lies in a texture by a line `//! texel_array ..`; both are reached
//! through the accessors which that line generates. A constant that only the host knows is declared by a line `//! size NAME`.

use std::collections::BTreeSet;

/// One compute entry point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stage {
    /// The file's stem in `shaders/`, and the entry point.
    pub name: &'static str,
}

macro_rules! shader_registry {
    (shared: $($shared:ident),+; stages: $($stage:ident),+; draws: $($draw:ident),+;) => {
        /// Every WGSL file: stem and text.
        pub const MODULES: &[(&str, &str)] = &[
            $((stringify!($shared), include_str!(concat!("../../shaders/", stringify!($shared), ".wgsl"))),)+
            $((stringify!($stage), include_str!(concat!("../../shaders/", stringify!($stage), ".wgsl"))),)+
            $((stringify!($draw), include_str!(concat!("../../shaders/", stringify!($draw), ".wgsl"))),)+
        ];
        /// Every compute entry point there is, named as its file.
        pub mod stages {
            use super::Stage;
            $(
                #[doc = concat!("`shaders/", stringify!($stage), ".wgsl`.")]
                #[allow(non_upper_case_globals, reason = "a stage is written as its file is named")]
                pub const $stage: Stage = Stage { name: stringify!($stage) };
            )+
            /// All of them, in frame order.
            pub const ALL: &[Stage] = &[$($stage),+];
            /// Files with a vertex and a fragment entry point (`vertex_main`, `fragment_main`).
            pub const DRAWS: &[&str] = &[$(stringify!($draw)),+];
        }
    };
}

shader_registry! {
shared: threads, random, packing, scene, traversal, surface, bsdf, lights, next_event, scattered_path, eye, light_path, filter, collected, history,
        photon_paths, photon_start, photon_map, coverage, gather, records, scan, radix;
    stages: photon_emit, photon_aim, photon_bounce, photon_count, photon_offsets, photon_append, photon_commit,
        photon_keys, radix_count, radix_scatter, scan_blocks, scan_totals, scan_add,
        grid_count, photon_arrange,
        record_points, record_irradiance,
        visible_points, direct_light, path_light, foveated_light, density_estimate,
        history_find, filter_collect, history_join, filter_prepare, filter_level, filter_finish, resolve,
        add_samples;
    draws: present;
}

/// What can be wrong with the shaders that macula carries, or with the count of their buffers.
#[derive(Debug, thiserror::Error)]
pub enum ShaderError {
    /// A `//! use` line names no file in `shaders/`.
    #[error("shader module `{0}` is not in the registry")]
    UnknownModule(String),
    /// A `//! split` line can't be read.
    #[error("shader module `{module}`: can't read `{line}`")]
    BadDirective {
        /// File's stem.
        module: String,
        /// The line.
        line: String,
    },
    /// A stage needs more buffers than the device binds at once: its arrays are cut into too many chunks.
    #[error(
        "the stage `{stage}` needs {needed} buffers at once, but the device binds {allowed}; lower photon.count, photon.stored_per_path or the size of the picture, or take a smaller scene"
    )]
    TooManyBuffers {
        /// Name of the stage.
        stage: String,
        /// Buffers that it binds.
        needed: u32,
        /// The device's limit.
        allowed: u32,
    },
    /// naga refuses the composed source.
    #[error("shader `{name}` is not valid WGSL: {message}")]
    Invalid {
        /// File's stem.
        name: String,
        /// naga's message.
        message: String,
    },
}

/// Puts a shader's source together from its file and the shared modules that it uses.
///
/// `size_of_name` tells the sizes that are known only at run time: for an array declared by `//! split` into how many bindings it is
/// cut, for one declared by `//! texel_array` how many layers it has, for a constant declared by `//! size` its value.
///
/// # Errors
/// [`ShaderError`] for an unknown module or an unreadable directive.
pub fn compose(name: &str, size_of_name: &dyn Fn(&str) -> u32) -> Result<String, ShaderError> {
    let text = module_text(name)?;
    compose_text(name, text, size_of_name)
}

/// Puts a source together from a text that is not in the registry, such as a test's.
///
/// # Errors
/// [`ShaderError`] for an unknown module or an unreadable directive.
pub fn compose_text(
    name: &str,
    text: &str,
    size_of_name: &dyn Fn(&str) -> u32,
) -> Result<String, ShaderError> {
    let mut seen = BTreeSet::from([name.to_owned()]);
    let mut source = String::new();
    append_text(name, text, size_of_name, &mut seen, &mut source)?;
    Ok(source)
}

fn module_text(name: &str) -> Result<&'static str, ShaderError> {
    let module = MODULES.iter().find(|(module, _)| *module == name);
    module
        .map(|(_, text)| *text)
        .ok_or_else(|| ShaderError::UnknownModule(name.to_owned()))
}

fn append_text(
    name: &str,
    text: &str,
    size_of_name: &dyn Fn(&str) -> u32,
    seen: &mut BTreeSet<String>,
    source: &mut String,
) -> Result<(), ShaderError> {
    let used = text
        .lines()
        .filter_map(|line| line.strip_prefix("//! use "));
    for module in used.flat_map(|list| list.split(',')).map(str::trim) {
        if seen.insert(module.to_owned()) {
            append_text(module, module_text(module)?, size_of_name, seen, source)?;
        }
    }
    for line in text.lines() {
        if let Some(directive) = line.strip_prefix("//! split ") {
            let declaration = split_declaration(directive, size_of_name).ok_or_else(|| {
                ShaderError::BadDirective {
                    module: name.to_owned(),
                    line: line.to_owned(),
                }
            })?;
            source.push_str(&declaration);
        } else if let Some(directive) = line.strip_prefix("//! texel_array ") {
            let declaration =
                texel_array_declaration(directive, size_of_name).ok_or_else(|| {
                    ShaderError::BadDirective {
                        module: name.to_owned(),
                        line: line.to_owned(),
                    }
                })?;
            source.push_str(&declaration);
        } else if let Some(constant) = line.strip_prefix("//! size ") {
            source.push_str(&format!(
                "const {constant}: u32 = {}u;\n",
                size_of_name(constant).max(1)
            ));
        } else {
            source.push_str(line);
            source.push('\n');
        }
    }
    Ok(())
}

/// log2 of the elements in one chunk of a split array: 128 MiB, the smallest binding limit met (WebGPU's default, and llvmpipe's).
/// `element_bytes` is a power of two.
pub const fn chunk_shift(element_bytes: u32) -> u32 {
    27 - element_bytes.ilog2()
}

fn element_bytes(wgsl_type: &str) -> Option<u32> {
    match wgsl_type {
        "u32" | "f32" => Some(4),
        "vec2f" | "vec2u" => Some(8),
        "vec4f" | "vec4u" => Some(16),
        _ => None,
    }
}

/// Turns `NAME: ELEMENT, ACCESS, GROUP, FIRST_BINDING` into as many bindings as the array has chunks, and the functions
/// `load_NAME(index)` and, for `read_write`, `store_NAME(index, value)`. With one chunk they are plain indexing.
fn split_declaration(directive: &str, size_of_name: &dyn Fn(&str) -> u32) -> Option<String> {
    let (name, rest) = directive.split_once(':')?;
    let name = name.trim();
    let fields: Vec<&str> = rest.split(',').map(str::trim).collect();
    let &[element, access, group, first_binding] = fields.as_slice() else {
        return None;
    };
    let first_binding: u32 = first_binding.parse().ok()?;
    let shift = chunk_shift(element_bytes(element)?);
    let chunks = size_of_name(name).max(1);
    let mut out = String::new();
    for chunk in 0..chunks {
        out += &format!(
            "@group({group}) @binding({}) var<storage, {access}> {name}_{chunk}: array<{element}>;\n",
            first_binding + chunk
        );
    }
    let body = |access_one: &dyn Fn(u32, &str) -> String| {
        if chunks == 1 {
            return access_one(0, "index");
        }
        let local = format!("(index & {}u)", (1u32 << shift) - 1);
        let cases: String = (1..chunks)
            .map(|chunk| format!("    case {chunk}u: {{ {} }}\n", access_one(chunk, &local)))
            .collect();
        format!(
            "  switch index >> {shift}u {{\n{cases}    default: {{ {} }}\n  }}\n",
            access_one(0, &local)
        )
    };
    out += &format!(
        "fn load_{name}(index: u32) -> {element} {{\n{}\n}}\n",
        body(&|chunk, index| format!("return {name}_{chunk}[{index}];"))
    );
    if access == "read_write" {
        out += &format!(
            "fn store_{name}(index: u32, value: {element}) {{\n{}\n}}\n",
            body(&|chunk, index| format!("{name}_{chunk}[{index}] = value;"))
        );
    }
    Some(out)
}

/// log2 of the texels in a row, and of the rows in a layer, of an array that lies in a texture: half of WebGPU's default limit.
pub const TEXEL_SHIFT: u32 = 12;

/// Turns `NAME: COMPONENT, GROUP, BINDING` into a read-only storage texture of four components (f32 or u32) a texel, and the function
/// `load_NAME(index)`.
fn texel_array_declaration(directive: &str, size_of_name: &dyn Fn(&str) -> u32) -> Option<String> {
    let (name, rest) = directive.split_once(':')?;
    let name = name.trim();
    let fields: Vec<&str> = rest.split(',').map(str::trim).collect();
    let &[component, group, binding] = fields.as_slice() else {
        return None;
    };
    let format = match component {
        "f32" => "rgba32float",
        "u32" => "rgba32uint",
        _ => return None,
    };
    let mask = (1u32 << TEXEL_SHIFT) - 1;
    let (texture, place) = if size_of_name(name) > 1 {
        let layer = 2 * TEXEL_SHIFT;
        let row = format!("(index >> {TEXEL_SHIFT}u) & {mask}u");
        (
            "texture_storage_2d_array",
            format!("vec2u(index & {mask}u, {row}), index >> {layer}u"),
        )
    } else {
        (
            "texture_storage_2d",
            format!("vec2u(index & {mask}u, index >> {TEXEL_SHIFT}u)"),
        )
    };
    Some(format!(
        "@group({group}) @binding({binding}) var {name}: {texture}<{format}, read>;\n\
         fn load_{name}(index: u32) -> vec4<{component}> {{\n  return textureLoad({name}, {place});\n}}\n"
    ))
}

/// A composed source, parsed and checked, with what its entry point binds.
#[derive(Debug)]
pub struct Reflection {
    /// Bindings that the entry point uses, in order of group and binding.
    pub bindings: Vec<Binding>,
    /// Threads in a workgroup.
    pub workgroup_size: [u32; 3],
    /// Names of the `override` constants that the source declares.
    pub overrides: Vec<String>,
}

/// One resource that a shader binds, by its name in WGSL.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Binding {
    /// Name of the variable.
    pub name: String,
    /// `@group`.
    pub group: u32,
    /// `@binding`.
    pub binding: u32,
    /// What kind of resource it is.
    pub kind: BindingKind,
}

/// What kind of resource a binding is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BindingKind {
    /// `var<uniform>`.
    Uniform,
    /// `var<storage, read>`.
    StorageRead,
    /// `var<storage, read_write>`.
    StorageReadWrite,
    /// `texture_storage_2d<.., read>`, or `texture_storage_2d_array` where it has layers.
    TexelArray {
        /// `rgba32float`, else `rgba32uint`.
        is_float: bool,
        /// Whether it has layers.
        is_layered: bool,
    },
}

fn texel_array_kind(ty: &naga::TypeInner) -> Option<BindingKind> {
    match ty {
        naga::TypeInner::Image {
            arrayed,
            class: naga::ImageClass::Storage { format, .. },
            ..
        } => Some(BindingKind::TexelArray {
            is_float: *format == naga::StorageFormat::Rgba32Float,
            is_layered: *arrayed,
        }),
        _ => None,
    }
}

/// Parses and validates composed WGSL with the capabilities that macula's device asks for (none beyond WebGPU's own).
///
/// # Errors
/// [`ShaderError::Invalid`] with naga's message.
pub fn validate(
    name: &str,
    source: &str,
) -> Result<(naga::Module, naga::valid::ModuleInfo), ShaderError> {
    let module = naga::front::wgsl::parse_str(source).map_err(|error| ShaderError::Invalid {
        name: name.to_owned(),
        message: error.emit_to_string(source),
    })?;
    let mut validator = naga::valid::Validator::new(
        naga::valid::ValidationFlags::all(),
        naga::valid::Capabilities::default(),
    );
    let info = validator
        .validate(&module)
        .map_err(|error| ShaderError::Invalid {
            name: name.to_owned(),
            message: error.emit_to_string(source),
        })?;
    Ok((module, info))
}

/// Reads what the entry point `entry` binds.
///
/// # Errors
/// [`ShaderError::Invalid`] when the source has no such entry point or is not valid.
pub fn reflect(name: &str, source: &str, entry: &str) -> Result<Reflection, ShaderError> {
    let (module, info) = validate(name, source)?;
    let index = module
        .entry_points
        .iter()
        .position(|point| point.name == entry)
        .ok_or_else(|| ShaderError::Invalid {
            name: name.to_owned(),
            message: format!("it has no entry point `{entry}`"),
        })?;
    let entry_info = info.get_entry_point(index);
    let mut bindings: Vec<Binding> = module
        .global_variables
        .iter()
        .filter(|(handle, _)| !entry_info[*handle].is_empty())
        .filter_map(|(_, variable)| {
            let slot = variable.binding?;
            let kind = match variable.space {
                naga::AddressSpace::Handle => texel_array_kind(&module.types[variable.ty].inner)?,
                naga::AddressSpace::Uniform => BindingKind::Uniform,
                naga::AddressSpace::Storage { access }
                    if access.contains(naga::StorageAccess::STORE) =>
                {
                    BindingKind::StorageReadWrite
                }
                _ => BindingKind::StorageRead,
            };
            Some(Binding {
                name: variable.name.clone()?,
                group: slot.group,
                binding: slot.binding,
                kind,
            })
        })
        .collect();
    bindings.sort_by_key(|binding| (binding.group, binding.binding));
    let overrides = module
        .overrides
        .iter()
        .filter_map(|(_, constant)| constant.name.clone())
        .collect();
    Ok(Reflection {
        bindings,
        workgroup_size: module.entry_points[index].workgroup_size,
        overrides,
    })
}
