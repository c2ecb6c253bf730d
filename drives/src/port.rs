//! The one seam between the bridge and what it drives: hardware, or the simulated plant.
//!
//! # One cycle
//!
//! ```text
//! deadline t[k]              t[k] + latency             t[k+1]
//!  │ send: hands the actuation │ it acts on the motors     │ send …
//!  │ receive: what was measured at t[k]                    │
//! ```
//!
//! Duties of a port, beyond moving numbers:
//!
//! - [`Port::open`] comes before the clock starts. It finds the hardware, holds it to the machine file, brings
//!   it to where it can be powered, and arms its watchdog. It may block and allocate, and gives up within
//!   some seconds with an error that says what would be right. [`Port::close`] leaves it dark, unpowered and
//!   safe, and is called once at the end, whether or not the port was opened.
//! - [`Port::send`] is called once a cycle, at its deadline, and returns at once: the bus works while we
//!   think. The actuation acts from this instant and the [latency](ActuatorProfile::latency) of each actuator
//!   on, until the next one takes its place.
//! - [`Port::receive`] follows it. The measurement is that of this deadline, but for places, which may be older by the
//!   [age](ActuatorProfile::age) that the port declares of each actuator; its `laser` tells what was fired
//!   between the deadline before and this one, by our clock. A port waits for it within a time of its own,
//!   a small part of the period. Where nothing came, it gives the measurement before, with places that go on at
//!   the speed before for some cycles, as the motors do, and counts that; from how many in a row on that is a fault is the port's to say.
//! - Where drives was too late for deadlines, it says so by [`Port::pass`] for each of them, before the send
//!   of the one that it is in time for. Hardware has done by then what the next point asks of it.
//! - The gate opens only inside a cycle whose actuation is [`Freshness::Fresh`]. With
//!   [`Freshness::Stale`] the gate stays closed, whatever `laser` asks: the bridge has asked for
//!   darkness already, and a port does not rely on it.
//! - When the next call does not come at all, nothing in this process can help. Hardware must then
//!   act by itself: close the gate at the end of the actuation's cycle, since no actuation is
//!   valid for longer than one, go on with its targets, and stop the axes at their limit of
//!   deceleration once the tolerated stall of the machine file ([`machine::StallTolerance`]) is over.
//!   A hardware port arms that watchdog before it first powers a motor (on a fieldbus: the slave's
//!   process-data watchdog).
//! - A number that is not finite, or a laser cycle that cannot be carried out, is never replaced by
//!   something similar: the port closes the gate, brakes, and reports a fault, until it is told
//!   [`CommandMode::Disabled`]. A fault word of a drive is a [`messages::FaultCode::DriveFault`] with
//!   [`messages::FaultQuantity::DriveWord`] and the word; its text stands in [`machine::drives::fault_text`].
//! - A drive whose bit in [`Actuation::homing`] is set, where the motors are driven, looks for its reference by itself,
//!   once: from that send on it has its bit in [`Measurement::homing`] and follows no target. When it has found it, it
//!   tells places in the machine, comes back to its targets, and then its bit falls. Taken back before, it comes to
//!   rest, and back. What it does not find is a fault.
//! - No allocation, lock, print or panic in a send, a receive or a pass.

use machine::{ActuatorMode, Machine};
use messages::{
    ActuatorArray, CommandMode, Fault, LaserCycle, LinkCounters, MAX_ACTUATORS, Nanoseconds,
};

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
    /// What the motors shall do.
    pub mode: CommandMode,
    /// Target position at the end of the cycle [rad at the motor]. Where the mode is
    /// [`CommandMode::Driven`], each motor follows the target of its own [`ActuatorMode`], and its drive takes
    /// those after it as feedforward, if it can: with a position its velocity and torque, with a velocity the
    /// torque.
    pub position: ActuatorArray,
    /// Target velocity [rad/s at the motor].
    pub velocity: ActuatorArray,
    /// Target torque [N·m at the motor].
    pub effort: ActuatorArray,
    /// Motor voltage [V].
    pub voltage: ActuatorArray,
    /// Digital outputs, one bit each.
    pub outputs: u64,
    /// Actuators whose drives shall look for their references by themselves, one bit each, once each time that it is set.
    pub homing: u16,
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
        homing: 0,
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
    /// Actuators whose drives look for their references by themselves, one bit each: see
    /// [`messages::Feedback::homing`].
    pub homing: u16,
    /// What the laser did since the previous measurement; offsets count from there, through the cycles
    /// that passed since.
    pub laser: LaserCycle,
    /// Where the port has a clock that ours shall follow: how far it is ahead of where it should be at the
    /// deadline, a whole number of periods after the first one and the [moves](Port::moved) since [ns].
    pub clock_offset: Option<Nanoseconds>,
    /// The port's own fault, latched until the mode is [`CommandMode::Disabled`]; its `at` is set
    /// by the bridge.
    pub fault: Fault,
}

/// Whose clock the cycle follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum PortClock {
    /// Ours.
    #[default]
    Ours,
    /// That of the bus; ours is held to it, by [`Measurement::clock_offset`].
    Bus,
}

/// What the drive of one actuator can do.
#[derive(Debug, Clone, PartialEq)]
pub struct ActuatorProfile {
    /// The targets that it can follow.
    pub modes: Vec<ActuatorMode>,
    /// From the deadline at which a target is sent until the motor follows it [ns]. The controller counts on
    /// the one in the machine file: a port holds the two to each other when it is opened.
    pub latency: Nanoseconds,
    /// How long before a deadline the place of the motor was measured that is told then [ns]. The controller counts on
    /// it as on the latency, and so it is held to that of the machine.
    pub age: Nanoseconds,
}

/// What a port is: complete once it is open, and what is known before that.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Whose clock the cycle follows.
    pub clock: PortClock,
    /// The finest step of a gate edge: an edge fires at most half of it away from its offset.
    pub gate_resolution: Nanoseconds,
    /// From the deadline at which a laser cycle is sent until its offsets count from [ns].
    pub gate_latency: Nanoseconds,
    /// Its actuators, `1..=MAX_ACTUATORS`, in the order of the machine file: several motors of one axis are
    /// one each.
    pub actuators: Vec<ActuatorProfile>,
}

impl ActuatorProfile {
    /// A drive that follows targets of `mode` alone, at once.
    pub fn immediate(mode: ActuatorMode) -> Self {
        Self { modes: vec![mode], latency: Nanoseconds(0), age: Nanoseconds(0) }
    }
}

impl Profile {
    /// These actuators by our clock, with a gate that acts at once and to the nanosecond.
    pub fn of(actuators: Vec<ActuatorProfile>) -> Self {
        Self {
            clock: PortClock::Ours,
            gate_resolution: Nanoseconds(1),
            gate_latency: Nanoseconds(0),
            actuators,
        }
    }
}

/// Why a port cannot be opened or closed; each says what would be right.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum PortError {
    /// This build, or this port, cannot do it.
    #[error("{what}; {instead}")]
    Unsupported {
        /// What is not there.
        what: String,
        /// What can be done.
        instead: String,
    },
    /// Nobody answers.
    #[error("{whom} does not answer; {check}")]
    NoAnswer {
        /// Who was asked, with its address.
        whom: String,
        /// What to look at.
        check: String,
    },
    /// The hardware is not what the machine file says.
    #[error("{found}; {expected}")]
    Mismatch {
        /// What is there.
        found: String,
        /// What the machine file asks for, and how to make the two agree.
        expected: String,
    },
    /// A drive lacks the mode that the machine file has for its actuator.
    #[error("the drive of actuator `{actuator}` cannot follow a {}: it has {}", .mode.name(), list(.modes))]
    Mode {
        /// The actuator.
        actuator: String,
        /// The mode of the machine file.
        mode: ActuatorMode,
        /// The modes that the drive has.
        modes: Vec<ActuatorMode>,
    },
    /// The hardware does not come to, or leave, a state.
    #[error("{what} does not {act}; {check}")]
    State {
        /// The part of the hardware.
        what: String,
        /// What it was told: "come to its operational state".
        act: String,
        /// Its own words for why, and what to look at.
        check: String,
    },
    /// The operating system refuses something.
    #[error("{about}: {reason}")]
    System {
        /// What was asked of it.
        about: String,
        /// Its answer, and what would help.
        reason: String,
    },
}

/// The words for `modes`.
fn list(modes: &[ActuatorMode]) -> String {
    let names: Vec<&str> = modes.iter().map(|mode| mode.name()).collect();
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

/// Hardware, or the plant that stands for it.
pub trait Port: Send {
    /// What it is.
    fn profile(&self) -> &Profile;

    /// Finds the hardware, holds it to the machine file, and makes it ready to be powered, with its watchdog
    /// armed.
    ///
    /// # Errors
    /// Hardware that is not there, is not what the machine file says, or does not do as it is told.
    fn open(&mut self) -> Result<(), PortError> {
        Ok(())
    }

    /// Leaves the hardware dark, unpowered and in a safe state.
    ///
    /// # Errors
    /// Hardware that does not do so; its own watchdog does, then.
    fn close(&mut self) -> Result<(), PortError> {
        Ok(())
    }

    /// The first deadline from `from` on that suits the clock of the bus; any does where it has none.
    fn first_deadline(&self, from: Nanoseconds) -> Nanoseconds {
        from
    }

    /// Hands `actuation` over, to act from now and its latency on, and returns at once.
    ///
    /// The first call starts the first cycle, so nothing has happened before it.
    fn send(&mut self, actuation: &Actuation);

    /// Gives what was measured at the deadline of the [`Self::send`] before it.
    fn receive(&mut self, measurement: &mut Measurement);

    /// A deadline has passed without a send; hardware was in the state of `actuation` from there
    /// to the next: the last targets in the dark, or the brake. It has done so by itself and is not
    /// touched here. A plant that moves only when it is told moves on.
    fn pass(&mut self, actuation: &Actuation) {
        let _ = actuation;
    }

    /// Deadlines come later by so much from the next one on, to follow the clock of the port; earlier where it
    /// is negative.
    fn moved(&mut self, by: Nanoseconds) {
        let _ = by;
    }

    /// Sets the inputs of a simulated machine that have no place of their own, one bit each; hardware has
    /// its own and ignores this.
    fn set_inputs(&mut self, inputs: u64) {
        let _ = inputs;
    }

    /// What was counted on the link to the hardware.
    fn link(&self) -> LinkCounters {
        LinkCounters::default()
    }

    /// Both halves of a cycle, one after the other.
    fn exchange(&mut self, actuation: &Actuation, measurement: &mut Measurement) {
        self.send(actuation);
        self.receive(measurement);
    }
}

/// Holds what a port is to what `machine` says of it.
///
/// # Errors
/// Another number of actuators, a drive without the mode of its actuator, another latency, or measurements of another
/// age.
pub fn check(profile: &Profile, machine: &Machine) -> Result<(), PortError> {
    let (found, expected) = (profile.actuators.len(), machine.actuators.len());
    if found != expected {
        return Err(PortError::Mismatch {
            found: format!("the port drives {found} actuators"),
            expected: format!("the machine file has {expected}"),
        });
    }
    for (own, actuator) in profile.actuators.iter().zip(&machine.actuators) {
        if !own.modes.contains(&actuator.mode) {
            return Err(PortError::Mode {
                actuator: actuator.name.clone(),
                mode: actuator.mode,
                modes: own.modes.clone(),
            });
        }
        let of = || format!("the actuator `{}`", actuator.name);
        check_latency(of, own.latency, actuator.latency)?;
        if own.age != actuator.age {
            let [found, counted] = [own.age, actuator.age].map(|age| age.seconds() * 1e6);
            return Err(PortError::Mismatch {
                found: format!("{} is measured {found} us before its deadline", of()),
                expected: format!("the controller counts on {counted} us"),
            });
        }
    }
    let of = || "the laser's gate".to_owned();
    check_latency(of, profile.gate_latency, machine.drives.gate_latency)
}

fn check_latency(
    of: impl Fn() -> String,
    found: Nanoseconds,
    declared: Nanoseconds,
) -> Result<(), PortError> {
    if found == declared {
        return Ok(());
    }
    let microseconds = |time: Nanoseconds| time.seconds() * 1e6;
    let (found, declared) = (microseconds(found), microseconds(declared));
    Err(PortError::Mismatch {
        found: format!("{} has a latency of {found} us", of()),
        expected: format!("the machine file declares {declared} us: write what it has"),
    })
}
