//! FPGA boards with HostMot2 firmware, by LBP16 over UDP.
//!
//! - [`lbp16`]: requests and replies; [`link`]: how they travel; [`asking`]: questions before the clock starts.
//! - [`idrom`]: what a board is; [`arming`]: its pins, its clock and its watchdog.
//! - [`pwm`], [`encoder`]: modules that move and measure.
//! - [`grid`]: when requests reach the board; [`gate`]: the laser's edges by the board's clock.
//!
//! A request is built in a fixed buffer, and its reply is known by a number that the request writes and reads
//! back. Without the reply nothing that the request asked for counts as done.

pub mod arming;
pub mod asking;
pub mod encoder;
pub mod gate;
pub mod grid;
pub mod idrom;
pub mod lbp16;
pub mod link;
pub mod pwm;
