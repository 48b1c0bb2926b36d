//! Recorded, live and fixed gaze.
