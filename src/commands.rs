//! One file for each command, or family of commands.

pub mod bench;
pub mod calibrate;
pub mod check;
pub mod compare;
pub mod doctor;
pub mod export;
pub mod faults;
pub mod figures;
#[cfg_attr(not(feature = "fleet"), path = "commands/fleet/no_fleet.rs")]
pub mod fleet;
pub mod kinematics;
pub mod machine;
pub mod manual;
pub mod motion;
pub mod offset;
pub mod operating;
pub mod operator;
pub mod path_check;
pub mod plan;
pub mod pulses;
pub mod queue;
pub mod replay;
pub mod run;
pub mod serve;
pub mod service;
pub mod simulate;
pub mod size;
pub mod status;
pub mod submit;
pub mod tables;
pub mod verify;
#[cfg(feature = "watch")]
pub mod watch;
