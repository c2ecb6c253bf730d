//! The machine that the board drives: the motors of the simulated plant, by its connections.
//!
//! The plant moves in cycles of its own, of 125 µs. At the start of each it is told what the board puts out then:
//! where the steps will be at its end if their rate stays, and the mirrors by their velocity and acceleration, the
//! voltage. So it is up to one cycle late in what changes inside it. Until a motor has power its cycles are put so
//! that one starts just after a datagram has arrived. An encoder stands where its motor is, carried on from the
//! start of the cycle by the speed there.
//!
//! A stepper driver has power once its steps are connected, and keeps it. An amplifier has it while its
//! enable is low: without it brakes the motor to rest, and lets it go.

use machine::{Actuator, Machine, Mechanism, MechanismVisitor};
use messages::{CommandMode, Fault, MAX_ACTUATORS, Nanoseconds};

use super::board::Modules;
use super::layout::{Function, pin_of};
use super::wiring::{Connection, Drive, Wiring};
use drives::plant::{Plant, PlantError};
use drives::{Actuation, Freshness, Measurement, PlantOptions, Port};
use messages::time::Period;

/// Below this a motor counts as standing [rad/s].
const STANDING: f64 = 0.1;

/// From the arrival of a datagram to the start of a cycle of the plant: more than arrivals usually vary by.
const MARGIN: Nanoseconds = Nanoseconds(20_000);

/// How long a cycle of the plant is.
const PERIOD: Period = Period::SHORTEST;

/// The plant, its mechanism forgotten.
trait Motors: Send {
    /// Moves through the cycle before, and lets `actuation` act from now on.
    fn exchange(&mut self, actuation: &Actuation, measurement: &mut Measurement);
    /// Angle [rad] and speed [rad/s] of a rotor.
    fn rotor(&self, row: usize) -> [f64; 2];
}

impl<const N: usize, M: Mechanism<N>, const A: usize> Motors for Plant<N, M, A> {
    fn exchange(&mut self, actuation: &Actuation, measurement: &mut Measurement) {
        Port::exchange(self, actuation, measurement);
    }

    fn rotor(&self, row: usize) -> [f64; 2] {
        let state = self.state();
        [&state.angle, &state.speed].map(|all| all.get(row).copied().unwrap_or(0.0))
    }
}

struct Build<'a>(&'a Machine, PlantOptions);

impl MechanismVisitor for Build<'_> {
    type Output = Result<Box<dyn Motors>, PlantError>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let Self(Machine { axes, actuators, laser, home_joints, .. }, options) = self;
        if actuators.len() == axes.len() {
            let plant = Plant::<N, M>::new(
                mechanism,
                axes,
                actuators,
                laser,
                home_joints,
                PERIOD,
                options,
            )?;
            return Ok(Box::new(plant));
        }
        let plant = Plant::<N, M, MAX_ACTUATORS>::new(
            mechanism,
            axes,
            actuators,
            laser,
            home_joints,
            PERIOD,
            options,
        )?;
        Ok(Box::new(plant))
    }
}

/// Why a machine cannot stand behind the board.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum RigError {
    /// The plant refuses it.
    #[error(transparent)]
    Plant(#[from] PlantError),
    /// The board lacks what something is connected to.
    #[error("{0}")]
    Lacking(String),
    /// As many connections as actuators are needed.
    #[error("{connected} actuators are connected, and the machine has {actuators}")]
    Count {
        /// Connections.
        connected: usize,
        /// Actuators.
        actuators: usize,
    },
}

/// One actuator with where it stood at power-on.
#[derive(Debug, Clone, Copy)]
struct Axis {
    connection: Connection,
    /// Steps in a radian of the motor.
    steps_per_radian: f64,
    /// Supply of its amplifier [V].
    supply: f64,
    /// The commanded angle at power-on [rad].
    home: f64,
    /// The rotor's angle at power-on [rad].
    rotor: f64,
    powered: bool,
}

/// The machine behind a board.
pub struct Rig {
    motors: Box<dyn Motors>,
    axes: Vec<Axis>,
    /// When its cycle at hand started.
    started: Nanoseconds,
    measurement: Measurement,
    fault: Fault,
}

impl core::fmt::Debug for Rig {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self { axes, started, measurement, .. } = self;
        let mut rig = formatter.debug_struct("Rig");
        rig.field("axes", axes).field("started", started).field("measurement", measurement);
        rig.finish_non_exhaustive()
    }
}

impl Rig {
    /// `machine` at home, connected by `wiring`.
    ///
    /// # Errors
    /// If it cannot be simulated, or the board lacks what it is connected to.
    pub fn new(machine: &Machine, wiring: &Wiring) -> Result<Self, RigError> {
        if let Some(lacking) = wiring.lacking() {
            return Err(RigError::Lacking(lacking));
        }
        let (connected, actuators) = (wiring.actuators.len(), machine.actuators.len());
        if connected != actuators {
            return Err(RigError::Count { connected, actuators });
        }
        // How late the motors are is the board's doing: those behind it follow at once.
        let mut direct = machine.clone();
        direct.actuators.iter_mut().for_each(|actuator| actuator.latency = Nanoseconds(0));
        let mut motors = machine.mechanism.visit(Build(&direct, PlantOptions::default()))?;
        let mut measurement = Measurement::default();
        motors.exchange(&Actuation::DISABLED, &mut measurement);
        let axis = |(row, (connection, actuator)): (usize, (&Connection, &Actuator))| Axis {
            connection: *connection,
            steps_per_radian: actuator.encoder.counts / core::f64::consts::TAU,
            supply: actuator.motor.dc().map_or(0.0, |motor| motor.voltage),
            home: measurement.position.get(row).copied().unwrap_or(0.0),
            rotor: motors.rotor(row)[0],
            powered: false,
        };
        let axes = wiring.actuators.iter().zip(&machine.actuators).enumerate().map(axis).collect();
        let started = Nanoseconds(0);
        Ok(Self { motors, axes, started, measurement, fault: Fault::default() })
    }

    /// When its next cycle starts.
    pub fn next(&self) -> Nanoseconds {
        self.started + PERIOD.time()
    }

    /// A datagram has arrived at `now`. Until a motor has power, the next cycle starts a little after it.
    pub fn align(&mut self, now: Nanoseconds) {
        if !self.axes.iter().any(|axis| axis.powered) {
            self.started = now + MARGIN - PERIOD.time();
        }
    }

    /// Moves to the start of the next cycle, and takes what the board puts out there.
    pub fn step(&mut self, modules: &Modules) {
        self.started = self.next();
        let actuation = self.actuation(modules);
        self.motors.exchange(&actuation, &mut self.measurement);
        if !self.fault.is_some() {
            self.fault = self.measurement.fault;
        }
    }

    /// The encoders as they stand at `now`, inside the cycle at hand.
    pub fn count(&self, modules: &mut Modules, now: Nanoseconds) {
        let elapsed = (now - self.started).seconds();
        for (row, axis) in self.axes.iter().enumerate() {
            let Some(encoder) = axis.connection.encoder else { continue };
            let [angle, speed] = self.motors.rotor(row);
            let turned = angle + speed * elapsed - axis.rotor;
            let counts = axis.connection.counts;
            let count = (turned * counts / core::f64::consts::TAU).round() as i64;
            modules.encoders.set(encoder, count, Some(counts as i64), now);
        }
    }

    /// Where the tool is at the start of the cycle at hand, in the machine frame [m].
    pub fn tool(&self) -> Option<[f64; 3]> {
        self.measurement.tool
    }

    /// What went wrong first, such as a stepper out of step.
    pub fn fault(&self) -> Fault {
        self.fault
    }

    /// What the motors shall do in the cycle that starts.
    fn actuation(&mut self, modules: &Modules) -> Actuation {
        let mut actuation = Actuation { freshness: Freshness::Fresh, ..Actuation::DISABLED };
        let duration = PERIOD.seconds();
        let (mut powered, mut released) = (false, false);
        for (row, axis) in self.axes.iter_mut().enumerate() {
            match axis.connection.drive {
                Drive::Stepgen { stepgen } => {
                    axis.powered |= pin_connected(modules, Function::Stepgen(1, stepgen));
                    let speed = modules.stepgens.speed(stepgen) / axis.steps_per_radian;
                    let angle = modules.stepgens.delivered(stepgen) / axis.steps_per_radian;
                    set(&mut actuation.position, row, axis.home + angle + speed * duration);
                    set(&mut actuation.velocity, row, speed);
                }
                Drive::Mirror { xy2mod, axis: side, full_scale } => {
                    let lines = [1, 2, 3, 4].map(|pin| Function::Xy2mod(pin, xy2mod));
                    let connected = lines.iter().all(|line| pin_connected(modules, *line));
                    axis.powered |= connected;
                    if connected {
                        let [position, speed] = modules.mirrors.after(xy2mod, side, duration);
                        set(&mut actuation.position, row, position * full_scale);
                        set(&mut actuation.velocity, row, speed * full_scale);
                    } else {
                        set(&mut actuation.position, row, self.motors.rotor(row)[0]);
                    }
                }
                Drive::Pwm { pwm } => {
                    let enable = pin_of(Function::PwmEnable(pwm))
                        .is_some_and(|pin| !modules.pins.level(pin, !modules.pwmgens.enabled(pwm)));
                    let driven = pin_connected(modules, Function::Pwmgen(1, pwm)) && enable;
                    let moving = self.motors.rotor(row)[1].abs() > STANDING;
                    released |= axis.powered && !driven;
                    axis.powered = driven || axis.powered && moving;
                    let voltage =
                        if driven { modules.pwmgens.duty(pwm) * axis.supply } else { 0.0 };
                    set(&mut actuation.voltage, row, voltage);
                }
            }
            powered |= axis.powered;
        }
        actuation.mode = match (powered, released) {
            (false, _) => CommandMode::Disabled,
            (true, true) => CommandMode::QuickStop,
            (true, false) => CommandMode::Driven,
        };
        actuation
    }
}

fn pin_connected(modules: &Modules, function: Function) -> bool {
    pin_of(function).is_some_and(|pin| modules.pins.connected(pin))
}

fn set(values: &mut messages::ActuatorArray, row: usize, value: f64) {
    if let Some(place) = values.get_mut(row) {
        *place = value;
    }
}
