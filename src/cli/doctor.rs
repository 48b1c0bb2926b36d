//! `macula doctor`: what this machine has, what is missing, and how to get it.

use std::fmt::Write as _;

use serde::Serialize;

use super::{CliError, CliResult, Globals};
use crate::gpu::GpuError;
use crate::gpu::survey::{Capabilities, SurveyedDevice, survey};
use crate::xr::{Headset, Runtime, XrError};

/// Show Vulkan devices and features, OpenXR runtime and eye tracking, and what is missing.
#[derive(Debug, clap::Args)]
pub struct Args {}

/// Runs `macula doctor`.
///
/// # Errors
/// [`CliError`] where nothing of macula can run: no usable Vulkan device.
pub fn run(_args: Args, globals: &Globals) -> CliResult {
    let diagnosis = Diagnosis::of_this_machine();
    if globals.json {
        println!("{}", serde_json::to_string(&diagnosis)?);
    } else {
        print!("{}", diagnosis.to_text());
    }
    if diagnosis.vulkan.devices.iter().any(|device| device.usable) {
        Ok(())
    } else {
        Err(CliError::new(
            "nothing can run: this machine has no usable Vulkan device; see `missing` above for how to get one",
        ))
    }
}

#[derive(Serialize)]
struct Diagnosis {
    version: &'static str,
    vulkan: Vulkan,
    /// The active runtime of this machine.
    openxr: OpenXr,
    /// The runtime inside macula.
    simulated: OpenXr,
    missing: Vec<Missing>,
}

#[derive(Default, Serialize)]
struct Vulkan {
    devices: Vec<Device>,
    error: Option<String>,
}

#[derive(Serialize)]
struct Device {
    index: usize,
    name: String,
    usable: bool,
    vulkan_version: String,
    memory_bytes: u64,
    #[serde(flatten)]
    features: Option<Features>,
}

#[derive(Serialize)]
struct Features {
    kind: &'static str,
    driver: String,
    timestamps: bool,
    subgroups: bool,
    shader_f16: bool,
    ray_query: bool,
    max_storage_binding_bytes: u64,
    max_buffer_bytes: u64,
    max_workgroup_threads: u32,
    max_workgroup_memory_bytes: u32,
}

#[derive(Serialize)]
struct OpenXr {
    loader: bool,
    runtime_name: Option<String>,
    runtime_version: Option<String>,
    headset: Option<String>,
    eye_gaze: bool,
    recommended_size_px: Option<[u32; 2]>,
    extensions: Vec<String>,
    error: Option<String>,
}

/// Something that is not there, what it would be good for, and how to get it.
#[derive(Serialize)]
struct Missing {
    what: &'static str,
    needed_for: &'static str,
    mend: Mend,
}

#[derive(Serialize)]
struct Mend {
    debian_ubuntu: &'static str,
    fedora: &'static str,
    arch: &'static str,
    windows: &'static str,
}

impl Diagnosis {
    fn of_this_machine() -> Self {
        let (vulkan, no_vulkan_loader) = match survey() {
            Ok(devices) => (
                Vulkan {
                    devices: devices.into_iter().map(Device::from).collect(),
                    error: None,
                },
                false,
            ),
            Err(error) => (
                Vulkan {
                    devices: Vec::new(),
                    error: Some(error.to_string()),
                },
                matches!(error, GpuError::NoLoader(_)),
            ),
        };
        let openxr = OpenXr::of(Runtime::System);
        let simulated = OpenXr::of(Runtime::InProcess(xr_sim::get_instance_proc_addr));
        let missing = missing(&vulkan, no_vulkan_loader, &openxr);
        Self {
            version: env!("CARGO_PKG_VERSION"),
            vulkan,
            openxr,
            simulated,
            missing,
        }
    }
}

fn missing(vulkan: &Vulkan, no_vulkan_loader: bool, openxr: &OpenXr) -> Vec<Missing> {
    let mut missing = Vec::new();
    let usable = || vulkan.devices.iter().filter(|device| device.usable);
    if no_vulkan_loader {
        missing.push(VULKAN_LOADER);
    } else if usable().next().is_none() {
        missing.push(VULKAN_DEVICE);
    } else if usable().all(|device| device.features.as_ref().is_some_and(|f| f.kind == CPU)) {
        missing.push(GPU_DRIVER);
    }
    if !openxr.loader {
        missing.push(OPENXR_LOADER);
    } else if openxr.runtime_name.is_none() {
        missing.push(OPENXR_RUNTIME);
    } else if !openxr.eye_gaze {
        missing.push(EYE_TRACKING);
    }
    missing
}

const VULKAN_LOADER: Missing = Missing {
    what: "Vulkan loader",
    needed_for: "everything",
    mend: Mend {
        debian_ubuntu: "apt install libvulkan1 mesa-vulkan-drivers",
        fedora: "dnf install vulkan-loader mesa-vulkan-drivers",
        arch: "pacman -S vulkan-icd-loader vulkan-swrast",
        windows: "install the current driver of the graphics card",
    },
};

const VULKAN_DEVICE: Missing = Missing {
    what: "Vulkan device",
    needed_for: "everything",
    mend: Mend {
        debian_ubuntu: "apt install mesa-vulkan-drivers (has a software device too)",
        fedora: "dnf install mesa-vulkan-drivers (has a software device too)",
        arch: "pacman -S vulkan-swrast (software), vulkan-radeon, vulkan-intel or nvidia-utils",
        windows: "install the current driver of the graphics card",
    },
};

const GPU_DRIVER: Missing = Missing {
    what: "a GPU with a Vulkan driver",
    needed_for: "speed: the only device here computes on the CPU",
    mend: Mend {
        debian_ubuntu: "apt install mesa-vulkan-drivers (AMD, Intel) or nvidia-driver (NVIDIA)",
        fedora: "dnf install mesa-vulkan-drivers (AMD, Intel) or akmod-nvidia (NVIDIA, from RPM Fusion)",
        arch: "pacman -S vulkan-radeon, vulkan-intel or nvidia-utils",
        windows: "install the current driver of the graphics card",
    },
};

const OPENXR_LOADER: Missing = Missing {
    what: "OpenXR loader",
    needed_for: "a real headset (`--runtime system`)",
    mend: Mend {
        debian_ubuntu: "apt install libopenxr-loader1",
        fedora: "dnf install openxr-libs",
        arch: "pacman -S openxr",
        windows: "put openxr_loader.dll of the Khronos OpenXR SDK beside macula.exe",
    },
};

/// No distribution packages the same runtimes; those of the headset's maker come from its maker.
const OPENXR_RUNTIME: Missing = Missing {
    what: "active OpenXR runtime with a headset",
    needed_for: "a real headset (`--runtime system`)",
    mend: Mend {
        debian_ubuntu: "start SteamVR and set it as the OpenXR runtime, or build Monado (monado.freedesktop.org)",
        fedora: "start SteamVR and set it as the OpenXR runtime, or dnf install monado",
        arch: "start SteamVR and set it as the OpenXR runtime, or install monado",
        windows: "start the headset's software (SteamVR, Varjo Base, ...) and set it as the OpenXR runtime",
    },
};

const EYE_TRACKING: Missing = Missing {
    what: "eye tracking (XR_EXT_eye_gaze_interaction)",
    needed_for: "live gaze; recorded gaze and `--runtime sim` do without",
    mend: Mend {
        debian_ubuntu: EYE_TRACKING_MEND,
        fedora: EYE_TRACKING_MEND,
        arch: EYE_TRACKING_MEND,
        windows: EYE_TRACKING_MEND,
    },
};

const EYE_TRACKING_MEND: &str = "use a headset with an eye tracker, switch the tracker on and calibrate it in the headset's software";

/// How a device that computes on the CPU is called.
const CPU: &str = "cpu";

impl From<SurveyedDevice> for Device {
    fn from(device: SurveyedDevice) -> Self {
        Self {
            index: device.index,
            name: device.name,
            usable: device.capabilities.is_some(),
            vulkan_version: device.vulkan_version,
            memory_bytes: device.memory_bytes,
            features: device.capabilities.map(Features::from),
        }
    }
}

impl From<Capabilities> for Features {
    fn from(capabilities: Capabilities) -> Self {
        Self {
            kind: match capabilities.kind {
                wgpu::DeviceType::DiscreteGpu => "discrete",
                wgpu::DeviceType::IntegratedGpu => "integrated",
                wgpu::DeviceType::VirtualGpu => "virtual",
                wgpu::DeviceType::Cpu => CPU,
                wgpu::DeviceType::Other => "other",
            },
            driver: capabilities.driver,
            timestamps: capabilities.timestamps,
            subgroups: capabilities.subgroups,
            shader_f16: capabilities.shader_f16,
            ray_query: capabilities.ray_query,
            max_storage_binding_bytes: capabilities.max_storage_binding_bytes,
            max_buffer_bytes: capabilities.max_buffer_bytes,
            max_workgroup_threads: capabilities.max_workgroup_threads,
            max_workgroup_memory_bytes: capabilities.max_workgroup_memory_bytes,
        }
    }
}

impl OpenXr {
    fn of(runtime: Runtime) -> Self {
        let without = |loader, error: XrError| Self {
            loader,
            runtime_name: None,
            runtime_version: None,
            headset: None,
            eye_gaze: false,
            recommended_size_px: None,
            extensions: Vec::new(),
            error: Some(error.to_string()),
        };
        let entry = match runtime.entry() {
            Ok(entry) => entry,
            Err(error) => return without(false, error),
        };
        match Headset::open(&entry) {
            Ok(Headset {
                info, extensions, ..
            }) => Self {
                loader: true,
                runtime_name: Some(info.runtime_name),
                runtime_version: Some(info.runtime_version),
                headset: Some(info.system_name),
                eye_gaze: info.supports_eye_gaze,
                recommended_size_px: Some(info.recommended_size),
                extensions,
                error: None,
            },
            Err(error) => without(true, error),
        }
    }

    fn write(&self, text: &mut String) -> std::fmt::Result {
        if let Some(error) = &self.error {
            writeln!(text, "  {error}")?;
        }
        let (Some(name), Some(version)) = (&self.runtime_name, &self.runtime_version) else {
            return Ok(());
        };
        writeln!(text, "  {name} {version}")?;
        if let (Some(headset), Some([width, height])) = (&self.headset, self.recommended_size_px) {
            let eye_gaze = yes_no(self.eye_gaze);
            writeln!(
                text,
                "     headset {headset}, {width}x{height} per eye, eye tracking {eye_gaze}"
            )?;
        }
        writeln!(text, "     {}", self.extensions.join(" "))
    }
}

impl Diagnosis {
    fn to_text(&self) -> String {
        let mut text = String::new();
        // Writing to a String does not fail.
        let _ = self.write(&mut text);
        text
    }

    fn write(&self, text: &mut String) -> std::fmt::Result {
        writeln!(text, "macula {}\n\nVulkan devices", self.version)?;
        if let Some(error) = &self.vulkan.error {
            writeln!(text, "  {error}")?;
        } else if self.vulkan.devices.is_empty() {
            writeln!(text, "  none")?;
        }
        for device in &self.vulkan.devices {
            device.write(text)?;
        }
        writeln!(text, "\nOpenXR runtime of this machine")?;
        self.openxr.write(text)?;
        writeln!(text, "\nSimulated runtime (always there, `--runtime sim`)")?;
        self.simulated.write(text)?;
        if self.missing.is_empty() {
            return writeln!(text, "\nNothing is missing.");
        }
        writeln!(text, "\nMissing")?;
        for missing in &self.missing {
            writeln!(text, "  {}, for {}", missing.what, missing.needed_for)?;
            let mend = &missing.mend;
            writeln!(text, "     Debian, Ubuntu: {}", mend.debian_ubuntu)?;
            writeln!(text, "     Fedora:         {}", mend.fedora)?;
            writeln!(text, "     Arch:           {}", mend.arch)?;
            writeln!(text, "     Windows:        {}", mend.windows)?;
        }
        Ok(())
    }
}

impl Device {
    fn write(&self, text: &mut String) -> std::fmt::Result {
        writeln!(text, "  {}: {}", self.index, self.name)?;
        let memory = bytes(self.memory_bytes);
        let version = &self.vulkan_version;
        let Some(features) = &self.features else {
            return writeln!(
                text,
                "     Vulkan {version}, {memory}; offers too little for macula"
            );
        };
        let Features { kind, driver, .. } = features;
        writeln!(
            text,
            "     {kind}, driver {driver}, Vulkan {version}, {memory} of memory"
        )?;
        writeln!(
            text,
            "     timestamps {}, subgroups {}, 16-bit floats {}, ray query {}",
            yes_no(features.timestamps),
            yes_no(features.subgroups),
            yes_no(features.shader_f16),
            yes_no(features.ray_query)
        )?;
        writeln!(
            text,
            "     storage bindings to {}, buffers to {}, work groups to {} threads and {}",
            bytes(features.max_storage_binding_bytes),
            bytes(features.max_buffer_bytes),
            features.max_workgroup_threads,
            bytes(features.max_workgroup_memory_bytes.into())
        )
    }
}

fn yes_no(yes: bool) -> &'static str {
    if yes { "yes" } else { "no" }
}

/// A size in the largest binary unit that leaves a number of at least one.
fn bytes(count: u64) -> String {
    const UNITS: [&str; 5] = ["B", "KiB", "MiB", "GiB", "TiB"];
    let power = (count.max(1).ilog2() / 10).min(UNITS.len() as u32 - 1);
    let value = count as f64 / 1024f64.powi(power as i32);
    let number = format!("{value:.1}");
    let number = number.strip_suffix(".0").unwrap_or(&number);
    format!("{number} {}", UNITS[power as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn device(kind: Option<&'static str>) -> Device {
        Device {
            index: 0,
            name: "test".into(),
            usable: kind.is_some(),
            vulkan_version: "1.3.0".into(),
            memory_bytes: 1 << 30,
            features: kind.map(|kind| Features {
                kind,
                driver: "test".into(),
                timestamps: true,
                subgroups: true,
                shader_f16: false,
                ray_query: false,
                max_storage_binding_bytes: 1 << 27,
                max_buffer_bytes: 1 << 31,
                max_workgroup_threads: 1024,
                max_workgroup_memory_bytes: 1 << 15,
            }),
        }
    }

    fn openxr(loader: bool, runtime: Option<&str>, eye_gaze: bool) -> OpenXr {
        OpenXr {
            loader,
            runtime_name: runtime.map(Into::into),
            runtime_version: runtime.map(|_| "1.0.0".into()),
            headset: runtime.map(|_| "test".into()),
            eye_gaze,
            recommended_size_px: runtime.map(|_| [100, 100]),
            extensions: Vec::new(),
            error: None,
        }
    }

    fn whats(vulkan: Vec<Device>, no_loader: bool, openxr: &OpenXr) -> Vec<&'static str> {
        let vulkan = Vulkan {
            devices: vulkan,
            error: None,
        };
        missing(&vulkan, no_loader, openxr)
            .into_iter()
            .map(|missing| missing.what)
            .collect()
    }

    #[test]
    fn only_what_is_missing_is_called_missing() {
        let complete = openxr(true, Some("test"), true);
        assert!(whats(vec![device(Some("discrete"))], false, &complete).is_empty());
        assert_eq!(
            whats(vec![device(Some(CPU))], false, &complete),
            [GPU_DRIVER.what]
        );
        assert_eq!(
            whats(vec![device(None)], false, &complete),
            [VULKAN_DEVICE.what]
        );
        assert_eq!(whats(Vec::new(), true, &complete), [VULKAN_LOADER.what]);
    }

    #[test]
    fn of_openxr_the_first_missing_link_is_named() {
        let gpu = || vec![device(Some("discrete"))];
        assert_eq!(
            whats(gpu(), false, &openxr(false, None, false)),
            [OPENXR_LOADER.what]
        );
        assert_eq!(
            whats(gpu(), false, &openxr(true, None, false)),
            [OPENXR_RUNTIME.what]
        );
        assert_eq!(
            whats(gpu(), false, &openxr(true, Some("x"), false)),
            [EYE_TRACKING.what]
        );
    }

    #[test]
    fn sizes_are_given_in_the_unit_that_people_read() {
        assert_eq!(bytes(0), "0 B");
        assert_eq!(bytes(32 << 10), "32 KiB");
        assert_eq!(bytes(128 << 20), "128 MiB");
        assert_eq!(bytes((4 << 30) - (100 << 20)), "3.9 GiB");
        assert_eq!(bytes(1 << 60), "1048576 TiB");
    }
}
