//! The workbench of the machine builder: what a job asks of a machine's motors, and what the machine gives.
//!
//! It plans and simulates with the stages that run the machine, and looks at what they did. Nothing here is
//! on the real-time path.

pub mod calibrate;
pub mod catalogue;
pub mod compare;
pub mod figures;
pub mod mechanics;
pub mod new;
pub mod operating;
pub mod reach;
pub mod replay;
pub mod simulation;
pub mod size;
pub mod spread;
pub mod thesis;
