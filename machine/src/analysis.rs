//! What a machine's builder asks of it at one place, and over its area: how stiff the tool is, how it
//! swings, how fast and how strongly it moves in which direction, and how much moves with it.
//!
//! [`Place`] gathers a mechanism's matrices at one joint position, whatever its number of axes; the
//! questions are its methods. [`Area`] walks the area by the rules that say what is reached.
//! Everything is linear algebra of small matrices: nothing here is on the real-time path.

mod area;
mod bodies;
mod envelope;
mod manipulability;
mod modes;
mod place;
mod principal;
mod stiffness;

pub use area::{Area, Reached, Refusal, grid_position, places, to_and_fro};
pub use bodies::{Bodies, footprint};
pub use envelope::Capability;
pub use manipulability::Manipulability;
pub use modes::{Mode, Rotors};
pub use place::Place;
pub use principal::Principal;
pub use stiffness::Hold;
