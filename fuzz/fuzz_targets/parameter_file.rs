//! The reader of parameter files.
#![no_main]

#[allow(dead_code, reason = "other targets use the rest of it")]
#[path = "../../tests/common/untrusted.rs"]
mod untrusted;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    untrusted::parameter_file(bytes);
});
