//! The extensions that this runtime has. Nothing is advertised that isn't implemented.

use openxr_sys as sys;

/// An extension of the API.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
pub(crate) enum Extension {
    VulkanEnable,
    VulkanEnable2,
    VulkanSwapchainFormatList,
    CompositionLayerDepth,
    EyeGazeInteraction,
    Headless,
}

impl Extension {
    /// All of them, in the order of enumeration.
    pub const ALL: &[Self] = &[
        Self::VulkanEnable,
        Self::VulkanEnable2,
        Self::VulkanSwapchainFormatList,
        Self::CompositionLayerDepth,
        Self::EyeGazeInteraction,
        Self::Headless,
    ];

    /// Its name, ended by a zero, and the revision that is implemented.
    pub fn name_and_version(self) -> (&'static [u8], u32) {
        match self {
            Self::VulkanEnable => (
                sys::KHR_VULKAN_ENABLE_EXTENSION_NAME,
                sys::KHR_vulkan_enable_SPEC_VERSION,
            ),
            Self::VulkanEnable2 => (
                sys::KHR_VULKAN_ENABLE2_EXTENSION_NAME,
                sys::KHR_vulkan_enable2_SPEC_VERSION,
            ),
            Self::VulkanSwapchainFormatList => (
                sys::KHR_VULKAN_SWAPCHAIN_FORMAT_LIST_EXTENSION_NAME,
                sys::KHR_vulkan_swapchain_format_list_SPEC_VERSION,
            ),
            Self::CompositionLayerDepth => (
                sys::KHR_COMPOSITION_LAYER_DEPTH_EXTENSION_NAME,
                sys::KHR_composition_layer_depth_SPEC_VERSION,
            ),
            Self::EyeGazeInteraction => (
                sys::EXT_EYE_GAZE_INTERACTION_EXTENSION_NAME,
                sys::EXT_eye_gaze_interaction_SPEC_VERSION,
            ),
            Self::Headless => (
                sys::MND_HEADLESS_EXTENSION_NAME,
                sys::MND_headless_SPEC_VERSION,
            ),
        }
    }

    /// The extension of that name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|extension| {
            extension.name_and_version().0.strip_suffix(b"\0") == Some(name.as_bytes())
        })
    }
}

/// The extensions that an instance was made with.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct ExtensionSet(u32);

impl ExtensionSet {
    pub fn insert(&mut self, extension: Extension) {
        self.0 |= 1 << extension as u8;
    }

    pub fn contains(self, extension: Extension) -> bool {
        self.0 & 1 << extension as u8 != 0
    }
}
