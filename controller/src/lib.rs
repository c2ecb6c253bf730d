//! From setpoints and feedback to commands: look-ahead, player, cascades, feedforward, state
//! machine, supervision.
//!
//! [`Controller::step`] answers one feedback. It does no input or output, and after
//! [`Controller::new`] it allocates nothing; the same step runs in real time and in simulation.

pub mod alignment;
pub mod cascade;
pub mod catch_up;
pub mod controller;
pub mod digest;
pub mod exchange;
pub mod feedforward;
pub mod gate;
pub mod homing;
pub mod intake;
pub mod latency;
pub mod light;
pub mod lookahead;
pub mod motion_limits;
pub mod outputs;
pub mod planned;
pub mod player;
mod prediction;
pub mod ramp;
pub mod rapids;
pub mod reference;
pub mod safety;
pub mod service;
pub mod slow;
pub mod squaring;
pub mod standing;
mod state;
pub mod statistics;
pub mod stream_time;
pub mod supervision;
pub mod test_pulse;
pub mod travel;
mod winding;

pub use controller::Controller;
pub use exchange::{Inputs, Outputs, Peers, Presence};
