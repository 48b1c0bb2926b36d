//! How the standard loader finds this runtime and agrees with it.

use std::io;
use std::path::Path;

use openxr_sys as sys;

use crate::api::{boundary, pointer::Trusted};
use crate::table;

/// The loader's one interface version.
const INTERFACE_VERSION: u32 = 1;

/// Writes a manifest for the loader: `XR_RUNTIME_JSON` is to name `path`; `library` is this crate's shared library.
///
/// # Errors
/// The file can't be written.
pub fn write_manifest(path: &Path, library: &Path) -> io::Result<()> {
    let manifest = serde_json::json!({
        "file_format_version": "1.0.0",
        "runtime": { "name": "xr-sim", "library_path": library },
    });
    std::fs::write(path, format!("{manifest:#}\n"))
}

/// The runtime's one export: the loader offers its versions, the runtime answers with its own and with
/// its `xrGetInstanceProcAddr` (specification, "Loader Runtime Interaction").
///
/// # Safety
/// The pointers are null or point at structures of the loader's negotiation.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn xrNegotiateLoaderRuntimeInterface(
    loader_info: *const sys::NegotiateLoaderInfo,
    runtime_request: *mut sys::NegotiateRuntimeRequest,
) -> sys::Result {
    // SAFETY: as this function asks of its caller
    let (loader_info, runtime_request) = unsafe { (loader_info.trust(), runtime_request.trust()) };
    boundary("negotiate", move || {
        let failed = sys::Result::ERROR_INITIALIZATION_FAILED;
        let info = loader_info.get().map_err(|_| failed)?;
        let fits = info.struct_type == sys::NegotiateLoaderInfo::TYPE
            && info.struct_version == sys::NegotiateLoaderInfo::VERSION
            && info.struct_size == size_of::<sys::NegotiateLoaderInfo>()
            && (info.min_interface_version..=info.max_interface_version)
                .contains(&INTERFACE_VERSION)
            && info.min_api_version <= sys::CURRENT_API_VERSION
            && info.max_api_version >= sys::Version::new(1, 0, 0);
        let request = runtime_request.read().map_err(|_| failed)?;
        let request_fits = request.struct_type == sys::NegotiateRuntimeRequest::TYPE
            && request.struct_version == sys::NegotiateRuntimeRequest::VERSION
            && request.struct_size == size_of::<sys::NegotiateRuntimeRequest>();
        if !fits || !request_fits {
            return Err(failed);
        }
        runtime_request.set(sys::NegotiateRuntimeRequest {
            runtime_interface_version: INTERFACE_VERSION,
            runtime_api_version: sys::CURRENT_API_VERSION,
            get_instance_proc_addr: Some(table::get_instance_proc_addr),
            ..request
        })
    })
}
