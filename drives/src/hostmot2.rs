//! The port to FPGA boards with HostMot2 firmware, by LBP16 over UDP.
//!
//! - [`lbp16`]: requests and replies; [`crate::link`]: how they travel; [`asking`]: questions before the clock starts.
//! - [`idrom`]: what a board is; [`arming`]: its pins, its clock and its watchdog.
//! - [`steps`], [`pwm`], [`galvo`], [`encoder`]: the modules that move and measure; [`axes`]: an actuator on
//!   them; [`path`]: what it is told through a cycle.
//! - [`grid`]: when requests reach the board; [`gate`]: the laser's edges by the board's clock; [`crate::fired`]: the
//!   light that the board has shown to have given.
//! - [`digital`]: inputs and outputs of the machine file on pins.
//! - [`config`]: what is connected; [`session`]: a cycle; [`port`]: the port.
//!
//! A request is built in a fixed buffer, in each cycle the same but for the numbers in it, and its reply is
//! known by a number that the request writes and reads back. Without the reply nothing that the request asked
//! for counts as done.

pub mod arming;
pub mod asking;
pub mod axes;
pub mod config;
pub mod digital;
pub mod encoder;
pub mod galvo;
pub mod gate;
pub mod grid;
pub mod idrom;
pub mod lbp16;
pub mod path;
pub mod port;
pub mod pwm;
pub mod session;
pub mod steps;

pub use config::{Config, Connection};
pub use port::Hostmot2Port;
