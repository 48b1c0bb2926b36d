//! What an application hands over by address, verified before it is looked at.
//!
//! The specification lets a runtime trust that an address which isn't null points at a structure or
//! array of the stated kind and length; nothing more. [`Trusted`] is where that trust is taken up; all
//! that follows from it - null, structure type, text - is checked here.

use std::ffi::{c_char, c_void};
use std::ptr;

use openxr_sys as sys;

use crate::XrResult;

/// The longest `next` chain that is followed, against a chain tied to itself.
const MAX_CHAIN: usize = 256;

/// An argument as the C boundary brings it, and what it becomes within.
pub(crate) trait Trusted {
    /// The form in which the functions see it.
    type Argument;
    /// # Safety
    /// A pointer is null, or points at what the specification's valid usage asks for during the call.
    unsafe fn trust(self) -> Self::Argument;
}

impl<T> Trusted for *const T {
    type Argument = In<T>;
    unsafe fn trust(self) -> In<T> {
        In(self)
    }
}

impl<T> Trusted for *mut T {
    type Argument = Out<T>;
    unsafe fn trust(self) -> Out<T> {
        Out(self)
    }
}

macro_rules! trusted_values {
    ($($value:ty),* $(,)?) => {
        $(impl Trusted for $value {
            type Argument = Self;
            unsafe fn trust(self) -> Self {
                self
            }
        })*
    };
}

trusted_values!(
    u32,
    sys::Instance,
    sys::Session,
    sys::Space,
    sys::Swapchain,
    sys::ActionSet,
    sys::Action,
    sys::SystemId,
    sys::Path,
    sys::Time,
    sys::Result,
    sys::StructureType,
    sys::ReferenceSpaceType,
    sys::ViewConfigurationType,
);

/// A structure that names its type in its first member.
///
/// # Safety
/// It begins with `type` and `next`, as `XrBaseInStructure` does.
pub(crate) unsafe trait Structure {
    const TYPE: sys::StructureType;
}

macro_rules! structures {
    ($($name:ident),* $(,)?) => {
        // SAFETY: these are the API's structures, laid out as its header has them
        $(unsafe impl Structure for sys::$name {
            const TYPE: sys::StructureType = sys::$name::TYPE;
        })*
    };
}

structures!(
    ActionCreateInfo,
    ActionSetCreateInfo,
    ActionSpaceCreateInfo,
    ActionStateBoolean,
    ActionStateFloat,
    ActionStateGetInfo,
    ActionStatePose,
    ActionStateVector2f,
    ActionsSyncInfo,
    BoundSourcesForActionEnumerateInfo,
    CompositionLayerDepthInfoKHR,
    CompositionLayerProjection,
    CompositionLayerProjectionView,
    CompositionLayerQuad,
    EventDataBuffer,
    ExtensionProperties,
    EyeGazeSampleTimeEXT,
    FrameBeginInfo,
    FrameEndInfo,
    FrameState,
    FrameWaitInfo,
    GraphicsBindingVulkanKHR,
    GraphicsRequirementsVulkanKHR,
    HapticActionInfo,
    HapticVibration,
    InputSourceLocalizedNameGetInfo,
    InstanceCreateInfo,
    InstanceProperties,
    InteractionProfileState,
    InteractionProfileSuggestedBinding,
    ReferenceSpaceCreateInfo,
    SessionActionSetsAttachInfo,
    SessionBeginInfo,
    SessionCreateInfo,
    SpaceLocation,
    SpaceLocations,
    SpaceVelocities,
    SpaceVelocity,
    SpacesLocateInfo,
    SwapchainCreateInfo,
    SwapchainImageAcquireInfo,
    SwapchainImageReleaseInfo,
    SwapchainImageVulkanKHR,
    SwapchainImageWaitInfo,
    SystemEyeGazeInteractionPropertiesEXT,
    SystemGetInfo,
    SystemProperties,
    View,
    ViewConfigurationProperties,
    ViewConfigurationView,
    ViewLocateInfo,
    ViewState,
    VulkanDeviceCreateInfoKHR,
    VulkanGraphicsDeviceGetInfoKHR,
    VulkanInstanceCreateInfoKHR,
    VulkanSwapchainFormatListCreateInfoKHR,
);

/// The address of something that the application lets the runtime read during the call.
#[derive(Debug)]
pub(crate) struct In<T>(*const T);

impl<T> Clone for In<T> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<T> Copy for In<T> {}

impl<T> In<T> {
    pub fn address(&self) -> *const T {
        self.0
    }

    /// The same place, seen as another structure of the same family.
    pub fn cast<U>(self) -> In<U> {
        In(self.0.cast())
    }

    /// What is there; `VALIDATION_FAILURE` where nothing is.
    pub fn get(&self) -> XrResult<&T> {
        // SAFETY: not null, so it points at a T for the call (`Trusted`), which `self` doesn't outlive
        unsafe { self.0.as_ref() }.ok_or(sys::Result::ERROR_VALIDATION_FAILURE)
    }
}

impl<T: Structure> In<T> {
    /// The structure there; `VALIDATION_FAILURE` where there is none or one of another type.
    pub fn verified(&self) -> XrResult<&T> {
        self.verified_or_null()?
            .ok_or(sys::Result::ERROR_VALIDATION_FAILURE)
    }

    /// As [`Self::verified`], but null is allowed, as in the functions whose information is optional.
    pub fn verified_or_null(&self) -> XrResult<Option<&T>> {
        if self.0.is_null() {
            return Ok(None);
        }
        // SAFETY: not null, so it points at a structure, which begins as every structure does
        let ty = unsafe { (*self.0.cast::<sys::BaseInStructure>()).ty };
        if ty != T::TYPE {
            return Err(sys::Result::ERROR_VALIDATION_FAILURE);
        }
        self.get().map(Some)
    }
}

impl In<c_char> {
    /// The text there, which ends by a zero within `limit` bytes; else `VALIDATION_FAILURE`.
    pub fn text(&self, limit: usize) -> XrResult<&str> {
        self.get()?;
        // SAFETY: not null, so it points at a text that ends by a zero; no byte past that is read
        let length = (0..limit).find(|&index| unsafe { *self.0.add(index) } == 0);
        let length = length.ok_or(sys::Result::ERROR_VALIDATION_FAILURE)?;
        // SAFETY: these bytes were just read
        let bytes = unsafe { std::slice::from_raw_parts(self.0.cast::<u8>(), length) };
        std::str::from_utf8(bytes).map_err(|_| sys::Result::ERROR_VALIDATION_FAILURE)
    }
}

/// The address of something that the application lets the runtime write during the call.
#[derive(Debug)]
pub(crate) struct Out<T>(*mut T);

impl<T> Clone for Out<T> {
    fn clone(&self) -> Self {
        *self
    }
}
impl<T> Copy for Out<T> {}

impl<T> Out<T> {
    pub fn is_null(self) -> bool {
        self.0.is_null()
    }

    /// Writes the value; `VALIDATION_FAILURE` where there is no place for it.
    pub fn set(self, value: T) -> XrResult<()> {
        if self.0.is_null() {
            return Err(sys::Result::ERROR_VALIDATION_FAILURE);
        }
        // SAFETY: not null, so there is room for a T (`Trusted`)
        unsafe { self.0.write(value) };
        Ok(())
    }

    /// What is there now; `VALIDATION_FAILURE` where nothing is.
    pub fn read(self) -> XrResult<T>
    where
        T: Copy,
    {
        In(self.0.cast_const()).get().copied()
    }

    /// The place of the `index`-th element, which the application's count covers.
    pub fn at(self, index: usize) -> XrResult<Self> {
        if self.0.is_null() {
            return Err(sys::Result::ERROR_VALIDATION_FAILURE);
        }
        // SAFETY: callers keep to the capacity that the application gave with the address
        Ok(Self(unsafe { self.0.add(index) }))
    }

    /// The same place, seen as another structure of the same chain or family.
    pub fn cast<U>(self) -> Out<U> {
        Out(self.0.cast())
    }
}

impl<T: Structure> Out<T> {
    /// The structure there, to be filled; `VALIDATION_FAILURE` where there is none or one of another type.
    pub fn verified(&mut self) -> XrResult<&mut T> {
        In(self.0.cast_const()).verified()?;
        // SAFETY: it was just read as a structure of this type; the application lends it for the call
        Ok(unsafe { &mut *self.0 })
    }
}

#[cfg(test)]
impl<T> Out<T> {
    pub fn null() -> Self {
        Self(ptr::null_mut())
    }

    pub fn to(place: &mut T) -> Self {
        Self(place)
    }

    pub fn to_slice(places: &mut [T]) -> Self {
        Self(places.as_mut_ptr())
    }
}

/// An array that a verified structure names.
pub(crate) fn array<'a, T>(
    _owner: &'a impl Structure,
    start: *const T,
    count: u32,
) -> XrResult<&'a [T]> {
    if count == 0 {
        return Ok(&[]);
    }
    if start.is_null() {
        return Err(sys::Result::ERROR_VALIDATION_FAILURE);
    }
    // SAFETY: the application's structure says that so many T are there, and lends them with itself
    Ok(unsafe { std::slice::from_raw_parts(start, count as usize) })
}

/// The place of the `index`-th element of an array that a verified structure names, within its count.
pub(crate) fn element<T>(start: *mut T, index: usize) -> XrResult<Out<T>> {
    Out(start).at(index)
}

/// A text that a verified structure names.
pub(crate) fn text(
    _owner: &impl Structure,
    start: *const c_char,
    limit: usize,
) -> XrResult<String> {
    In(start).text(limit).map(str::to_owned)
}

/// A layer by its type.
pub(crate) enum AnyLayer<'a> {
    Projection(&'a sys::CompositionLayerProjection),
    Quad(&'a sys::CompositionLayerQuad),
    Other,
}

/// The layers of a frame; `LAYER_INVALID` where one is null.
pub(crate) fn layers(info: &sys::FrameEndInfo) -> XrResult<Vec<AnyLayer<'_>>> {
    let addresses = array(info, info.layers, info.layer_count)?;
    let layers = addresses.iter().map(|&address| {
        // SAFETY: null, or a layer's structure, which the application lends with the frame's
        let header = unsafe { address.as_ref() }.ok_or(sys::Result::ERROR_LAYER_INVALID)?;
        Ok(match header.ty {
            // SAFETY: the structure is of the type that it says
            sys::CompositionLayerProjection::TYPE => {
                AnyLayer::Projection(unsafe { &*address.cast() })
            }
            // SAFETY: the structure is of the type that it says
            sys::CompositionLayerQuad::TYPE => AnyLayer::Quad(unsafe { &*address.cast() }),
            _ => AnyLayer::Other,
        })
    });
    layers.collect()
}

/// The structure of type `T` in the chain that begins at `next`, if any.
pub(crate) fn chained<'a, T: Structure>(
    _owner: &'a impl Structure,
    next: *const c_void,
) -> XrResult<Option<&'a T>> {
    // SAFETY: found in the chain of a structure that the application lends for the call
    Ok(find_in_chain(next, T::TYPE)?.map(|found| unsafe { &*found.cast::<T>() }))
}

/// As [`chained`], of a chain that the runtime fills.
pub(crate) fn chained_out<T: Structure>(next: *mut c_void) -> XrResult<Option<Out<T>>> {
    Ok(find_in_chain(next, T::TYPE)?.map(|found| Out(found.cast_mut().cast())))
}

fn find_in_chain(
    next: *const c_void,
    ty: sys::StructureType,
) -> XrResult<Option<*const sys::BaseInStructure>> {
    let mut next: *const sys::BaseInStructure = next.cast();
    for _ in 0..MAX_CHAIN {
        // SAFETY: a chain's address is null or that of a structure, which begins as every one does
        match unsafe { next.as_ref() } {
            None => return Ok(None),
            Some(structure) if structure.ty == ty => return Ok(Some(ptr::from_ref(structure))),
            Some(structure) => next = structure.next,
        }
    }
    Err(sys::Result::ERROR_VALIDATION_FAILURE)
}

/// The text of a fixed array; none where it doesn't end by a zero, or isn't UTF-8.
pub(crate) fn fixed_text(array: &[c_char]) -> Option<&str> {
    let length = array.iter().position(|&byte| byte == 0)?;
    // SAFETY: `c_char` and `u8` have one layout; the slice stays within the array
    let bytes = unsafe { std::slice::from_raw_parts(array.as_ptr().cast::<u8>(), length) };
    std::str::from_utf8(bytes).ok()
}

/// A fixed array holding `text`, cut where it is too long, and a closing zero.
pub(crate) fn fixed_array<const N: usize>(text: &str) -> [c_char; N] {
    let mut array = [0; N];
    for (place, byte) in array.iter_mut().take(N - 1).zip(text.bytes()) {
        *place = byte as c_char;
    }
    array
}
