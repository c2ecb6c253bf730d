//! A HostMot2 board on Ethernet: LBP16 over UDP, with the modules that a laser machine needs.
//!
//! [`Board`] is a state machine without input or output: it is told the time, takes datagrams and gives
//! replies. Its time is nanoseconds since it was powered; a test advances it as it likes, the program
//! `hostmot2-emulator` by the clock ([`service`]). Motors, encoders and mirrors are those of the simulated
//! plant ([`rig`]), and what the light and the watchdog did is kept for whoever asks ([`record`]).
//!
//! The layouts of the registers are those that the public regmap and LinuxCNC's driver use. What no public
//! text says, and is a choice of this emulator, is said where it is made.

pub mod board;
pub mod clock;
pub mod dpll;
pub mod emulator;
pub mod encoder;
pub mod faults;
pub mod idrom;
pub mod layout;
pub mod lbp16;
pub mod oneshot;
pub mod pins;
pub mod pwmgen;
pub mod record;
pub mod report;
pub mod rig;
pub mod service;
pub mod spaces;
pub mod stepgen;
pub mod watchdog;
pub mod wiring;
pub mod xy2mod;

pub use board::Board;
pub use emulator::Emulator;
pub use faults::Faults;
