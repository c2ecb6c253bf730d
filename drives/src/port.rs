//! The one seam between the bridge and what it drives: hardware, or the simulated plant.
//!
//! Duties of a port, beyond moving numbers:
//!
//! - [`Port::exchange`] is called once a cycle, at its deadline. The actuation acts from this
//!   instant to the next call. The measurement is taken at this instant, and its `laser` tells
//!   what was fired between the previous call and this one.
//! - Where drives was too late for deadlines, it says so by [`Port::pass`] for each of them, before
//!   the exchange of the one that it is in time for. Hardware has done by then what the next point
//!   asks of it.
//! - The gate opens only inside a cycle whose actuation is [`Freshness::Fresh`]. With
//!   [`Freshness::Stale`] the gate stays closed, whatever `laser` asks: the bridge has asked for
//!   darkness already, and a port does not rely on it.
//! - When the next call does not come at all, nothing in this process can help. Hardware must then
//!   act by itself: close the gate at the end of the actuation's cycle, since no actuation is
//!   valid for longer than one, go on with its targets, and stop the axes at their limit of
//!   deceleration once the tolerated stall of the machine file ([`machine::StallTolerance`]) is over.
//!   A hardware port arms that watchdog before it first powers a motor (on a fieldbus: the slave's
//!   process-data watchdog).
//! - A mode that the port does not have, or a number that is not finite, is never replaced by
//!   something similar: the port closes the gate, brakes, and reports a fault, until it is told
//!   [`CommandMode::Disabled`].
//! - No allocation, lock, print or panic in an exchange.

use messages::{ActuatorArray, CommandMode, Fault, LaserCycle, MAX_ACTUATORS, Nanoseconds};

/// Whether an actuation comes from a command that answers the newest feedback.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Freshness {
    /// It does not: the gate stays closed.
    #[default]
    Stale,
    /// It does.
    Fresh,
}

/// What the motors, the laser and the outputs shall do in one cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Actuation {
    /// Whether a fresh command stands behind it.
    pub freshness: Freshness,
    /// Which target the motors follow.
    pub mode: CommandMode,
    /// Target position at the end of the cycle [rad at the motor].
    pub position: ActuatorArray,
    /// Target velocity [rad/s at the motor].
    pub velocity: ActuatorArray,
    /// Target torque [N·m at the motor].
    pub effort: ActuatorArray,
    /// Motor voltage [V].
    pub voltage: ActuatorArray,
    /// Digital outputs, one bit each.
    pub outputs: u64,
    /// The laser.
    pub laser: LaserCycle,
}

impl Actuation {
    /// Unpowered and dark: what is in force before the first command.
    pub const DISABLED: Self = Self {
        freshness: Freshness::Stale,
        mode: CommandMode::Disabled,
        position: [0.0; MAX_ACTUATORS],
        velocity: [0.0; MAX_ACTUATORS],
        effort: [0.0; MAX_ACTUATORS],
        voltage: [0.0; MAX_ACTUATORS],
        outputs: 0,
        laser: LaserCycle::OFF,
    };

    /// The axes brake and hold by themselves, in the dark.
    pub const QUICK_STOP: Self = Self { mode: CommandMode::QuickStop, ..Self::DISABLED };
}

/// Whether the power stages drive the motors.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Power {
    /// The motors' phases are open.
    #[default]
    Off,
    /// They are driven.
    On,
}

/// What a port measured at one deadline.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Measurement {
    /// Whether the motors are driven from here on.
    pub power: Power,
    /// Encoder counts since power-on.
    pub counts: [i64; MAX_ACTUATORS],
    /// Motor position from the encoder [rad], `joint / ratio` of the machine file.
    pub position: ActuatorArray,
    /// Motor current [A].
    pub current: ActuatorArray,
    /// Tool centre point in the machine frame [m], where the port knows it.
    pub tool: Option<[f64; 3]>,
    /// Digital inputs in the order of the machine file, one bit each: 1 is active, whichever level that is.
    pub inputs: u64,
    /// What the laser did since the previous exchange; offsets count from there, through the cycles
    /// that passed since.
    pub laser: LaserCycle,
    /// The port's own fault, latched until the mode is [`CommandMode::Disabled`]; its `at` is set
    /// by the bridge.
    pub fault: Fault,
}

/// Hardware, or the plant that stands for it.
pub trait Port {
    /// How many actuators it drives, `1..=MAX_ACTUATORS`, in the order of the machine file: several motors
    /// of one axis are one each.
    fn actuators(&self) -> usize;

    /// The finest step of a gate edge: an edge fires at most half of it away from its offset.
    fn gate_resolution(&self) -> Nanoseconds;

    /// Measures now, and lets `actuation` act from now until the next call.
    ///
    /// The first call starts the first cycle, so nothing has happened before it.
    fn exchange(&mut self, actuation: &Actuation, measurement: &mut Measurement);

    /// A deadline has passed without an exchange; hardware was in the state of `actuation` from there
    /// to the next: the last targets in the dark, or the brake. It has done so by itself and is not
    /// touched here. A plant that moves only when it is told moves on.
    fn pass(&mut self, actuation: &Actuation) {
        let _ = actuation;
    }

    /// Sets the inputs of a simulated machine that have no place of their own, one bit each; hardware has
    /// its own and ignores this.
    fn set_inputs(&mut self, inputs: u64) {
        let _ = inputs;
    }
}
