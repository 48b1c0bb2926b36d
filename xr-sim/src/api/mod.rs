//! The functions of the API: each verifies what it was given, then makes one call into the behaviour.

pub(crate) mod actions;
pub(crate) mod frames;
pub(crate) mod instances;
pub(crate) mod layers;
pub(crate) mod pointer;
pub(crate) mod sessions;
pub(crate) mod spaces;
pub(crate) mod swapchains;
pub(crate) mod views;
pub(crate) mod vulkan;

use std::panic::{AssertUnwindSafe, catch_unwind};

use openxr_sys as sys;

use crate::XrResult;

/// Defines functions of the API: the raw signature outside, verified pointers and a result within.
macro_rules! functions {
    ($($(#[$meta:meta])* fn $name:ident($($argument:ident: $ty:ty),* $(,)?) $body:block)*) => {
        $(
            $(#[$meta])*
            pub(crate) unsafe extern "system" fn $name($($argument: $ty),*) -> ::openxr_sys::Result {
                // SAFETY: the caller keeps the specification's valid usage of this function
                $(let $argument = unsafe { $crate::api::pointer::Trusted::trust($argument) };)*
                $crate::api::boundary(stringify!($name), move || $body)
            }
        )*
    };
}
pub(crate) use functions;

/// `TIME_INVALID` for what is no time (specification, "Time": zero and less).
pub(crate) fn verify_time(time: sys::Time) -> XrResult<()> {
    if time.as_nanos() > 0 {
        Ok(())
    } else {
        Err(sys::Result::ERROR_TIME_INVALID)
    }
}

/// A body's success: the plain one, or one of the specification's qualified successes.
pub(crate) trait Success {
    fn code(self) -> sys::Result;
}

impl Success for () {
    fn code(self) -> sys::Result {
        sys::Result::SUCCESS
    }
}

impl Success for sys::Result {
    fn code(self) -> sys::Result {
        self
    }
}

/// Ends every call: nothing unwinds into the application, and each refusal leaves a trace.
pub(crate) fn boundary<S: Success>(name: &str, body: impl FnOnce() -> XrResult<S>) -> sys::Result {
    match catch_unwind(AssertUnwindSafe(body)) {
        Ok(Ok(success)) => success.code(),
        Ok(Err(code)) => {
            tracing::debug!("{name}: {code:?}");
            code
        }
        Err(_) => {
            tracing::error!("{name}: a fault of xr-sim itself");
            sys::Result::ERROR_RUNTIME_FAILURE
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_a_runtime_failure() {
        let result = boundary("test", || -> XrResult<()> { panic!("on purpose") });
        assert_eq!(result, sys::Result::ERROR_RUNTIME_FAILURE);
        assert_eq!(boundary("test", || Ok(())), sys::Result::SUCCESS);
    }
}
