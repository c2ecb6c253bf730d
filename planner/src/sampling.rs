//! The setpoint of every cycle, made of the planned motion.

pub(crate) mod backlash;
pub(crate) mod deflection;
pub(crate) mod sampler;
