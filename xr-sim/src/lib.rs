//! A simulated OpenXR runtime.
