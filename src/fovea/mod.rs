//! Gaze to regions.
