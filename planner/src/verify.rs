//! What holds a plan to its limits, independent of how it was made.

pub mod checker;
pub(crate) mod interpolation;
pub mod margins;
pub mod path_check;
