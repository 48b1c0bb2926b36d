//! Calls with their result codes, as tables.
#![allow(
    unused_imports,
    unused_macros,
    reason = "each test file uses its own part"
)]

use std::ffi::c_char;
use std::mem::MaybeUninit;

use openxr::sys::{self, Result as Code};

/// Makes the calls in turn and compares their codes: `"what": call => code;`.
macro_rules! codes {
    ($($what:literal: $call:expr => $expected:expr;)*) => {
        $crate::common::codes::check(&[$(($what, $call, $expected)),*])
    };
}
pub(crate) use codes;

/// A structure of the API with its type and otherwise zero.
macro_rules! zeroed {
    ($name:ident) => {
        $crate::common::codes::structure::<openxr::sys::$name>(openxr::sys::$name::TYPE)
    };
}
pub(crate) use zeroed;

/// A structure of the wrong type.
macro_rules! mistyped {
    ($name:ident) => {
        $crate::common::codes::structure::<openxr::sys::$name>(openxr::sys::StructureType::UNKNOWN)
    };
}
pub(crate) use mistyped;

pub const BAD_HANDLE: Code = Code::ERROR_HANDLE_INVALID;
pub const INVALID: Code = Code::ERROR_VALIDATION_FAILURE;
pub const SUCCESS: Code = Code::SUCCESS;

/// Fails with every call whose code is another.
pub fn check(calls: &[(&str, Code, Code)]) {
    let wrong: Vec<_> = calls
        .iter()
        .filter(|(_, code, expected)| code != expected)
        .collect();
    assert!(wrong.is_empty(), "(call, code, expected): {wrong:#?}");
}

/// `T` must be a structure of the API.
pub fn structure<T>(ty: sys::StructureType) -> T {
    let mut structure = MaybeUninit::<T>::zeroed();
    // SAFETY: all structures begin with their type, and zero is a value of each of their members
    unsafe {
        structure
            .as_mut_ptr()
            .cast::<sys::StructureType>()
            .write(ty);
        structure.assume_init()
    }
}

/// A fixed array with a text.
pub fn text<const N: usize>(text: &str) -> [c_char; N] {
    let mut array = [0; N];
    for (place, byte) in array.iter_mut().zip(text.bytes()) {
        *place = byte as c_char;
    }
    array
}
