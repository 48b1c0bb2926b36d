//! Rigid node animation.

/// How nodes move.
#[derive(Clone, Debug, Default)]
pub struct Animation {}
