//! The joints: which of them bring the tool somewhere, how they get there, and how a table is
//! unwound.

pub(crate) mod configuration;
pub(crate) mod directions;
pub(crate) mod follow_flight;
pub mod joint_move;
pub(crate) mod route;
pub(crate) mod unwind;
