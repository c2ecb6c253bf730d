//! What becomes of the machine when commands stop or cannot be trusted.
//!
//! Duties:
//!
//! - **Gate**: open only in a cycle with a fresh command. The first cycle without one is dark; the
//!   axes go on with the last command for it, which at constant speed is the right voltage.
//! - **Lost peer**: the gate stays closed whatever the command says. The command stays fresh: how the
//!   axes come to rest is the controller's to say.
//! - **Axes**: once more cycles in a row than the tolerated stall has ([`machine::StallTolerance`]) lack a
//!   fresh command, or at once for a command that makes no sense, a fault of the port or a lost controller,
//!   they are stopped by the drive's own brake, in the dark and with all outputs off. Until then they
//!   go on with the last command.
//! - **Holding brakes**: open while the motors are powered, whatever the command says of their outputs.
//! - **Skipped cycles**, for whose deadlines drives was too late, are cycles without a fresh command.
//! - **Latch**: a stop stays, with its first cause, until a person has asked for a reset (its
//!   ticket travels in the command) and the controller starts again from disabled.
//!
//! ```text
//! Waiting ──command: disabled──► Following ──fault──► Stopped
//!    ▲ ▲                            │                    │
//!    │ └──too many misses, unpowered┘                    │
//!    └──────────command: disabled, with a new reset──────┘   (goes on to Following)
//! ```
//!
//! This is software on the control computer and not a safety function: the laser's interlock and
//! the motors' safe torque off are wired.

use machine::Timing;
use messages::time::Period;
use messages::{
    ActuatorArray, Command, CommandMode, Fault, FaultCode, FaultQuantity, LaserCycle,
    MAX_ACTUATORS, MAX_EDGES, Nanoseconds,
};

use crate::port::{Actuation, Freshness};

/// Time whose skipped cycles are gone through one by one; axes that brake rest long before.
const MOST_PASSED: Nanoseconds = Nanoseconds(1_000_000_000);

/// Whether the gate may open in a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum GatePermission {
    /// Every peer lives: the command decides.
    #[default]
    Granted,
    /// A peer was found dead: closed whatever the command says. The axes follow the command.
    Inhibited,
}

/// What the watchdog makes of the commands.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Watch {
    /// Unpowered and dark; only a command that says disabled is taken.
    Waiting,
    /// Each fresh command is carried out.
    Following,
    /// Stopped by the watchdog, until a person resets.
    Stopped,
}

/// What the watchdog counted since start.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Cycles without a fresh command.
    pub missed: u64,
    /// Times it closed an open gate.
    pub gate_trips: u64,
    /// Times it stopped powered axes.
    pub stops: u64,
}

/// The watchdog of one bridge.
#[derive(Debug, Clone)]
pub struct Watchdog {
    actuators: usize,
    /// Outputs that open the holding brakes, one bit each.
    brakes: u64,
    period: Period,
    tolerated: u64,
    watch: Watch,
    /// Cycles in a row without a fresh command.
    misses: u64,
    reset: u64,
    fault: Fault,
    last: Actuation,
    /// Stroke of the open gate at the end of the last cycle, 0 when it was closed.
    gate: u32,
    counts: Counts,
}

impl Watchdog {
    /// A watchdog over `actuators` motors that waits for the first command, and bears the stalls of
    /// `timing`.
    pub fn new(actuators: usize, timing: Timing) -> Self {
        Self {
            actuators: actuators.min(MAX_ACTUATORS),
            brakes: 0,
            period: timing.period,
            tolerated: timing.stalled_cycles(),
            watch: Watch::Waiting,
            misses: 0,
            reset: 0,
            fault: Fault::default(),
            last: Actuation::DISABLED,
            gate: 0,
            counts: Counts::default(),
        }
    }

    /// Opens holding brakes by these outputs, one bit each.
    pub fn set_brakes(&mut self, brakes: u64) {
        self.brakes = brakes;
    }

    /// The holding brakes go with the power.
    fn switch_brakes(&mut self) {
        let open = if self.last.mode == CommandMode::Disabled { 0 } else { self.brakes };
        self.last.outputs = self.last.outputs & !self.brakes | open;
    }

    /// Its state.
    pub fn watch(&self) -> Watch {
        self.watch
    }

    /// The cause of the stop, if there is one.
    pub fn fault(&self) -> &Fault {
        &self.fault
    }

    /// What it counted.
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Cycles in a row, to now, without a fresh command.
    pub fn misses(&self) -> u64 {
        self.misses
    }

    /// `cycles` were skipped before the one that begins `now`, which will lack a fresh command too:
    /// gives what was in force in each of them, in order, to `passed`. Beyond a second they are
    /// only counted.
    pub fn skip(&mut self, cycles: u64, now: Nanoseconds, mut passed: impl FnMut(&Actuation)) {
        let lacking = self.misses.saturating_add(cycles).saturating_add(1);
        let most = self.period.cycles_for(MOST_PASSED);
        for _ in 0..cycles.min(most) {
            self.missed(lacking, now);
            self.switch_brakes();
            self.watch_gate(GatePermission::Granted);
            passed(&self.last);
        }
        if self.watch != Watch::Waiting {
            let rest = cycles.saturating_sub(most);
            self.misses = self.misses.saturating_add(rest);
            self.counts.missed += rest;
        }
    }

    /// What is in force in the cycle that begins `now`, with the fresh command if one came.
    /// `resting` axes may be unpowered while stopped; moving ones are braked first.
    pub fn decide(
        &mut self,
        command: Option<&Command>,
        permission: GatePermission,
        resting: bool,
        now: Nanoseconds,
    ) -> Actuation {
        match command {
            Some(command) => self.fresh(command, resting, now),
            None => self.missed(self.misses.saturating_add(1), now),
        }
        if permission == GatePermission::Inhibited {
            self.last.laser = LaserCycle::OFF;
        }
        self.switch_brakes();
        self.watch_gate(permission);
        self.last
    }

    /// Counts an open gate that was closed for want of a command, or of a peer.
    fn watch_gate(&mut self, permission: GatePermission) {
        let commanded =
            self.last.freshness == Freshness::Fresh && permission == GatePermission::Granted;
        self.counts.gate_trips += u64::from(self.gate != 0 && !commanded);
        (self.gate, _) = self.last.laser.last();
    }

    fn fresh(&mut self, command: &Command, resting: bool, now: Nanoseconds) {
        self.misses = 0;
        let mode = command.mode();
        match self.watch {
            Watch::Waiting if mode == CommandMode::Disabled => {
                self.watch = Watch::Following;
                self.reset = command.reset;
            }
            Watch::Waiting => {
                self.reset = command.reset;
                let fault = Fault::new(FaultCode::DriveFault);
                let mode = f64::from(command.mode);
                self.stop(fault.with(FaultQuantity::Mode, mode).at(now));
            }
            Watch::Following => {
                self.reset = command.reset;
                if let Some(doubt) = doubt(command, self.actuators, self.period) {
                    self.stop(doubt.at(now));
                }
            }
            Watch::Stopped if mode == CommandMode::Disabled => {
                if command.reset != 0 && command.reset != self.reset {
                    self.reset = command.reset;
                    self.watch = Watch::Following;
                    self.fault = Fault::default();
                } else if resting {
                    self.last = Actuation::DISABLED;
                }
            }
            Watch::Stopped => {}
        }
        if self.watch == Watch::Following {
            self.last = actuation(command, mode);
        }
    }

    /// A cycle without a fresh command, one of `lacking` in a row as far as is known.
    fn missed(&mut self, lacking: u64, now: Nanoseconds) {
        if self.watch == Watch::Waiting {
            return;
        }
        self.counts.missed += 1;
        self.misses = self.misses.saturating_add(1);
        self.darken();
        if self.watch == Watch::Following && self.misses > self.tolerated {
            if self.last.mode == CommandMode::Disabled {
                self.watch = Watch::Waiting;
                self.last = Actuation::DISABLED;
            } else {
                let (value, limit) = (lacking as f64, self.tolerated as f64);
                let fault = Fault::new(FaultCode::StaleCommand);
                self.stop(fault.beyond(FaultQuantity::Cycles, value, limit).at(now));
            }
        }
    }

    /// Stops the axes from now on. Only the first cause is kept.
    pub fn stop(&mut self, cause: Fault) -> Actuation {
        if self.watch != Watch::Stopped {
            self.watch = Watch::Stopped;
            self.fault = cause;
            self.last = if self.last.mode == CommandMode::Disabled {
                Actuation::DISABLED
            } else {
                self.counts.stops += 1;
                Actuation::QUICK_STOP
            };
            self.switch_brakes();
        }
        self.last
    }

    /// No command stands behind what is in force any more: the gate stays closed.
    fn darken(&mut self) {
        self.last.freshness = Freshness::Stale;
        self.last.laser = LaserCycle::OFF;
    }
}

/// What `command` asks for. Without a mode that follows the controller there is no light either.
fn actuation(command: &Command, mode: CommandMode) -> Actuation {
    let follows = !matches!(mode, CommandMode::Disabled | CommandMode::QuickStop);
    Actuation {
        freshness: Freshness::Fresh,
        mode,
        position: command.position,
        velocity: command.velocity,
        effort: command.effort,
        voltage: command.voltage,
        outputs: command.outputs,
        homing: if follows { command.homing as u16 } else { 0 },
        laser: if follows { command.laser } else { LaserCycle::OFF },
    }
}

/// What makes `command` impossible to carry out, if anything: a target that is not finite, or a laser cycle that makes no sense.
fn doubt(command: &Command, actuators: usize, period: Period) -> Option<Fault> {
    let targets: &[&ActuatorArray] = match command.mode() {
        CommandMode::Disabled | CommandMode::QuickStop => &[],
        CommandMode::Driven => {
            &[&command.position, &command.velocity, &command.effort, &command.voltage]
        }
    };
    let broken = targets.iter().find_map(|targets| {
        targets.iter().take(actuators).enumerate().find(|(_, target)| !target.is_finite())
    });
    if let Some((index, target)) = broken {
        let fault = Fault::new(FaultCode::NotFinite).on_actuator(index);
        return Some(fault.with(FaultQuantity::Number, *target));
    }
    if !command.laser.is_valid(period.time()) {
        return Some(impossible_light(&command.laser));
    }
    None
}

/// The fault of a laser cycle that cannot be carried out: more edges than a sample holds, or edges
/// out of order, out of the cycle, or too close for the source.
pub(crate) fn impossible_light(laser: &LaserCycle) -> Fault {
    let fault = Fault::new(FaultCode::DriveFault);
    let (edges, most) = (f64::from(laser.edge_count), MAX_EDGES as f64);
    if edges > most {
        fault.beyond(FaultQuantity::Edges, edges, most)
    } else {
        fault.with(FaultQuantity::ImpossibleEdges, edges)
    }
}
