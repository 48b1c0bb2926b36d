//! Structs that host and shaders share have one layout: every field at the same offset, and the same size, by naga's reflection.

use macula::gpu::layout::{self, SharedStruct};
use macula::gpu::shader;

/// Name, size and field offsets of a struct in a shader file.
fn in_wgsl(file: &str, name: &str) -> Option<(usize, Vec<(String, usize)>)> {
    let source = shader::compose(file, &|_| 1).unwrap();
    let module = naga::front::wgsl::parse_str(&source)
        .unwrap_or_else(|error| panic!("{}", error.emit_to_string(&source)));
    module
        .types
        .iter()
        .find(|(_, ty)| ty.name.as_deref() == Some(name))
        .and_then(|(_, ty)| match &ty.inner {
            naga::TypeInner::Struct { members, span } => Some((
                *span as usize,
                members
                    .iter()
                    .map(|m| (m.name.clone().unwrap_or_default(), m.offset as usize))
                    .collect(),
            )),
            _ => None,
        })
}

/// A stage that uses the module, so that the composed source is complete.
fn compare<T: SharedStruct>(stage: &str) -> Result<(), String> {
    let (size, members) =
        in_wgsl(stage, T::NAME).ok_or(format!("{} is not in {stage}", T::NAME))?;
    let host: Vec<(String, usize)> = T::fields()
        .into_iter()
        .map(|(name, offset)| (name.to_owned(), offset))
        .collect();
    if host != members || size_of::<T>() != size {
        return Err(format!(
            "{}: host {host:?} of {} bytes, shader {members:?} of {size} bytes",
            T::NAME,
            size_of::<T>()
        ));
    }
    Ok(())
}

#[test]
fn host_and_shader_agree_on_every_shared_struct() {
    compare::<layout::SceneUniform>("visible_points").unwrap();
    compare::<layout::Material>("visible_points").unwrap();
    compare::<layout::TextureUse>("visible_points").unwrap();
    compare::<layout::Object>("visible_points").unwrap();
    compare::<layout::Light>("direct_light").unwrap();
    compare::<layout::SpecularTarget>("photon_aim").unwrap();
    compare::<layout::TraceUniform>("photon_bounce").unwrap();
    compare::<layout::PhotonCounters>("photon_bounce").unwrap();
    compare::<layout::PhotonPath>("photon_bounce").unwrap();
    compare::<layout::Photon>("photon_bounce").unwrap();
    compare::<layout::PhotonGrid>("density_estimate").unwrap();
    compare::<layout::PhotonMapUniform>("density_estimate").unwrap();
    compare::<layout::RadixUniform>("radix_count").unwrap();
    compare::<layout::ScanUniform>("scan_add").unwrap();
    compare::<layout::EyeUniform>("visible_points").unwrap();
    compare::<layout::VisiblePoint>("visible_points").unwrap();
    compare::<layout::PresentUniform>("present").unwrap();
}

#[test]
fn a_struct_that_drifted_is_noticed() {
    #[repr(C)]
    #[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
    struct Drifted {
        shift: u32,
        tile_count: u32,
    }
    impl SharedStruct for Drifted {
        const NAME: &'static str = "RadixUniform";
        fn fields() -> Vec<(&'static str, usize)> {
            vec![("shift", 0), ("tile_count", 4)]
        }
    }
    assert!(compare::<Drifted>("radix_count").is_err());
}
