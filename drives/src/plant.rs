//! The simulated plant: motors, transmission, load, encoders and laser source of a machine file.
//!
//! Modes: `Disabled` (phases open, motors coast) and `QuickStop` (the drive's own [`brake`], or a
//! ramp of the pulses); driven, DC motors follow their voltage (held over the cycle), or by loops of the drive's own
//! (`servo`) their torque, velocity or position; steppers their position (by pulses, see [`stepping`]).
//!
//! What is and is not modelled:
//!
//! - The supply saturates the voltage. A chopper keeps the current at the power stage's limit: it
//!   is cut there at the end of each substep, without a trip.
//! - A stepper's position is the count of its pulses, and its current is not measured.
//! - Encoders count in whole counts from power-on, rounded to the nearest; the machine is homed,
//!   at rest at `machine.home`. Currents are read at the deadline, rounded to
//!   [`PlantOptions::current_resolution`].
//! - The light follows the gate after the delays of the laser source; gate edges fall where they
//!   are asked, to the nanosecond.
//! - Targets and the gate act by the latencies of the machine file after they are sent; a disabling and the dark at
//!   once, and so does a quick stop of DC motors: steppers brake at the end of what they were told.
//! - A brake holds the shaft of an unpowered motor as friction does. It closes at once, and holds on for
//!   its `brake_release` after the power has come.
//! - Several motors on an axis pull its joint by a spring each, their shares of the transmission's. The
//!   machine comes up with each of them at its home reference, out of square by what the machine file has.
//! - Backlash is a gap without friction between motor and spring: in it the load coasts.
//! - There is no measurement noise and no thermal model.
//!
//! Integration: fourth order at a fixed substep of 50 µs or finer ([`dynamics`], [`winding`]),
//! with friction's events located inside it ([`friction`]), and third order in what a varying mass
//! matrix adds ([`coupling`]). A transmission too stiff for the substep asked for, or a rotor too light for
//! its winding, gets a finer one.

pub mod brake;
mod contacts;
pub mod coupling;
pub mod dynamics;
pub mod friction;
pub mod motors;
mod servo;
pub mod source;
pub mod state;
pub mod stepping;
pub mod switches;
pub mod winding;

use machine::kinematics::{Joints, KinematicsError};
use machine::motor::BeyondTorque;
use machine::transmission::equilibrium;
use machine::{
    Actuator, ActuatorMode, Axis, LaserSource, Machine, Mechanism, MechanismVisitor, Motor,
};
use messages::delay::{Delay, Recent};
use messages::math::hermite;
use messages::random::SplitMix64;
use messages::time::Period;
use messages::{
    ActuatorArray, CommandMode, Fault, FaultCode, FaultQuantity, GateEdge, LaserCycle,
    MAX_ACTUATORS, Nanoseconds, TooManyEdges,
};
use nalgebra::SVector;

use crate::port::{
    Actuation, ActuatorProfile, Freshness, Measurement, Port, PortClock, Power, Profile,
};
use crate::watchdog::impossible_light;
use brake::Brake;
use coupling::Unsolvable;
use dynamics::Dynamics;
use motors::Motors;
use servo::{MotorState, Servo};
use source::Source;
use state::{Phases, State};
use stepping::Stepping;
use winding::Weights;

/// Largest eigenvalue times substep: the stability region of the classical Runge–Kutta method
/// reaches 2.78 along the negative real axis and 2.6 in the worst direction of the left half.
const STABLE_PRODUCT: f64 = 2.5;

/// Substeps in a second beyond which a transmission should be declared rigid: 1000 in a millisecond.
const MOST_SUBSTEPS: f64 = 1e6;

/// How the plant is simulated; what it is stands in the machine file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlantOptions {
    /// Longest step of the integration [s], `1e-6..=5e-5`; a whole number of steps fill a cycle.
    pub substep: f64,
    /// Step of the measured current [A]; 0 reads it exactly.
    pub current_resolution: f64,
    /// Chooses where between two counts each encoder stands at home; 0 puts all in the middle.
    pub seed: u64,
}

impl Default for PlantOptions {
    fn default() -> Self {
        // 20 kHz; 14 bits over ±8 A.
        Self { substep: 50e-6, current_resolution: 1e-3, seed: 0 }
    }
}

/// Why a machine cannot be simulated.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum PlantError {
    /// The mechanism and the list of axes disagree.
    #[error("the mechanism has {expected} axes, the machine {found}")]
    AxisCount {
        /// Axes of the mechanism.
        expected: usize,
        /// Axes given.
        found: usize,
    },
    /// More actuators than a sample holds.
    #[error("{0} actuators, and a sample holds {MAX_ACTUATORS}")]
    TooManyActuators(usize),
    /// The actuators are not those of the axes.
    #[error("the actuators are not those of the axes, one or several for each in turn")]
    Actuators,
    /// Several motors on a joint, with nothing elastic between them.
    #[error("several motors drive a joint rigidly, or with backlash: nothing says what each bears")]
    Pair,
    /// The joints cannot be at home.
    #[error("home cannot be reached: {0}")]
    Home(KinematicsError),
    /// A stepper cannot hold the load at home.
    #[error("a stepper cannot hold its axis at home: {0}")]
    Hold(BeyondTorque),
    /// A joint moves no mass.
    #[error("the mass matrix of the load is singular at home: an elastic joint must move a mass")]
    SingularMass,
    /// The substep is out of range.
    #[error("a substep of {0} s: it must be from 1e-6 to 5e-5 s")]
    Substep(f64),
    /// The transmission needs a finer substep than can be afforded.
    #[error(
        "the transmission's fastest motion has a rate of {rate} 1/s, which needs more than 1000 \
         substeps in a millisecond: leave its stiffness out to make it rigid"
    )]
    TooStiff {
        /// Bound of the fastest eigenvalue [1/s].
        rate: f64,
    },
    /// Windings and rotors need a finer substep than can be afforded.
    #[error(
        "a winding and its rotor turn each other at a rate of {rate} 1/s, by `torque_constant` against \
         `inductance`, `resistance` and `rotor_inertia`, which needs more than 1000 substeps in a \
         millisecond: one of them is not of a motor"
    )]
    TooQuick {
        /// Bound of their rate [1/s].
        rate: f64,
    },
}

/// The plant of a machine file, its mechanism matched.
#[derive(Debug)]
pub struct SimulatedPlant;

impl SimulatedPlant {
    /// A plant of `machine`, at rest at its home, unpowered and dark.
    ///
    /// # Errors
    /// If the machine cannot be simulated.
    #[allow(clippy::new_ret_no_self)]
    pub fn new(machine: &Machine, options: PlantOptions) -> Result<Box<dyn Port>, PlantError> {
        let plant = machine.mechanism.visit(Build { machine, options })?;
        Ok(switches::Switched::new(machine, plant))
    }
}

struct Build<'a> {
    machine: &'a Machine,
    options: PlantOptions,
}

impl MechanismVisitor for Build<'_> {
    type Output = Result<Box<dyn Port>, PlantError>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let Build { machine, options } = self;
        let home = &machine.home_joints;
        let Machine { axes, actuators, laser, realtime, .. } = machine;
        let (period, gate_latency) = (realtime.period, machine.drives.gate_latency);
        // One size for all machines with several motors on an axis, so that no more has to be compiled.
        if actuators.len() == axes.len() {
            let plant =
                Plant::<N, M>::new(mechanism, axes, actuators, laser, home, period, options)?;
            return Ok(Box::new(plant.with_gate_latency(gate_latency)));
        }
        let plant = Plant::<N, M, MAX_ACTUATORS>::new(
            mechanism, axes, actuators, laser, home, period, options,
        )?;
        Ok(Box::new(plant.with_gate_latency(gate_latency)))
    }
}

/// A plant with its mechanism known, and room for `A` motors: as many as axes, or [`MAX_ACTUATORS`].
#[derive(Debug, Clone)]
pub struct Plant<const N: usize, M: Mechanism<N>, const A: usize = N> {
    period: Period,
    dynamics: Dynamics<N, M, A>,
    brake: Brake<A>,
    /// How many motors there are.
    motors: usize,
    /// The drives of DC motors.
    servos: [Option<Servo>; A],
    /// The drivers of steppers.
    stepping: Option<Stepping<A>>,
    /// What the gate is asked for in the newest cycles, and by how much later it does it.
    gate: Recent<LaserCycle>,
    gate_latency: Delay,
    source: Source,
    weights: Weights<A>,
    substeps: u32,
    current_resolution: f64,
    resolution: SVector<f64, A>,
    origin: SVector<f64, A>,
    /// Where between two counts each encoder stands at the origin, −0.5..0.5 [counts].
    phase: SVector<f64, A>,
    state: State<N, A>,
    /// How long before a deadline each place was measured that is told then.
    age: [Delay; A],
    /// Angles and speeds at the newest deadlines [rad, rad/s].
    turned: Recent<[SVector<f64, A>; 2]>,
    /// Where it was a substep before.
    passed: State<N, A>,
    in_force: Option<Actuation>,
    /// What the laser did since the last exchange.
    light: LaserCycle,
    /// Cycles gone by since the last exchange.
    passed_cycles: u32,
    /// Cycles for which the motors have been powered before the one at hand; `None` if they are not.
    powered_cycles: Option<u32>,
    fault: Fault,
    /// What was measured at the newest deadline.
    measured: Measurement,
    profile: Profile,
}

impl<const N: usize, M: Mechanism<N>, const A: usize> Plant<N, M, A> {
    /// A plant of `mechanism`, at rest with its joints at `home` [m or rad], unpowered and dark, which moves
    /// on by cycles of `period`.
    ///
    /// # Errors
    /// If it cannot be simulated.
    pub fn new(
        mechanism: M,
        axes: &[Axis],
        actuators: &[Actuator],
        laser: &LaserSource,
        home: &[f64],
        period: Period,
        options: PlantOptions,
    ) -> Result<Self, PlantError> {
        let PlantOptions { substep, current_resolution, seed } = options;
        if !(1e-6..=5e-5).contains(&substep) {
            return Err(PlantError::Substep(substep));
        }
        if axes.len() != N {
            return Err(PlantError::AxisCount { expected: N, found: axes.len() });
        }
        if actuators.len() > A || actuators.len() > MAX_ACTUATORS {
            return Err(PlantError::TooManyActuators(actuators.len()));
        }
        if !belong(axes, actuators) {
            return Err(PlantError::Actuators);
        }
        let branch = mechanism.branch();
        let load = Joints::from_fn(|row, _| home.get(row).copied().unwrap_or(f64::NAN));
        let chain = mechanism.solve(&load, branch, None).map_err(PlantError::Home)?;

        let gravity = mechanism.gravity(&chain);
        let motors = Motors::of(axes, actuators);
        let ahead = equilibrium::rotors_ahead(&mechanism, axes, actuators, &gravity);
        let mut angle = SVector::<f64, A>::zeros();
        let mut origin = angle;
        for (row, actuator) in actuators.iter().enumerate() {
            let Actuator { axis, ratio, square, .. } = *actuator;
            // The joint stands at home on crooked references too, in the mean of its springs.
            let own = axes[axis].driven_by(actuators).iter();
            let mean: f64 = own.map(|actuator| actuator.share * actuator.square).sum();
            angle[row] = (load[axis] + ahead[axis] + (square - mean)) / ratio;
            let field =
                equilibrium::field_ahead(actuator, gravity[axis]).map_err(PlantError::Hold)?;
            origin[row] = angle[row] + field / ratio;
        }
        let stepping = Stepping::of(axes, actuators, origin, period);
        let field = stepping.as_ref().map(|stepping| stepping.field(angle));
        let dynamics = Dynamics::new(mechanism, motors, chain)?.with_field(field);

        let substeps = substeps(&dynamics, substep, period.seconds())?;
        let state = State {
            current: SVector::zeros(),
            angle,
            speed: SVector::zeros(),
            load,
            load_speed: SVector::zeros(),
        };
        let age = core::array::from_fn(|row| {
            actuators.get(row).map_or(Delay::default(), |it| Delay::of(it.age, period))
        });
        let oldest = age.iter().map(|age| age.whole_cycles()).max().unwrap_or(0);
        Ok(Self {
            period,
            age,
            turned: Recent::of([state.angle, state.speed], oldest + 1),
            brake: Brake::of(axes, actuators),
            servos: core::array::from_fn(|row| {
                let actuator = actuators.get(row)?;
                Servo::of(actuator, period)
            }),
            motors: actuators.len(),
            gate: Recent::of(LaserCycle::OFF, 2),
            gate_latency: Delay::default(),
            source: Source::new(laser, period),
            weights: motors.windings.weights(period.seconds() / f64::from(substeps)),
            substeps,
            current_resolution,
            resolution: SVector::from_fn(|row, _| {
                actuators.get(row).map_or(1.0, |actuator| actuator.encoder.resolution())
            }),
            origin,
            stepping,
            phase: SVector::from_fn(|row, _| encoder_phase(seed, row as u64)),
            state,
            passed: state,
            dynamics,
            in_force: None,
            light: LaserCycle::OFF,
            passed_cycles: 0,
            powered_cycles: None,
            fault: Fault::default(),
            measured: Measurement::default(),
            profile: profile(actuators),
        })
    }

    /// With a gate that acts by `latency` after the deadline at which it is asked.
    pub fn with_gate_latency(mut self, latency: Nanoseconds) -> Self {
        self.gate_latency = Delay::of(latency, self.period);
        self.gate = Recent::of(LaserCycle::OFF, self.gate_latency.cycles + 2);
        self.profile.gate_latency = latency;
        self
    }

    /// Where the plant is, in truth.
    pub fn state(&self) -> &State<N, A> {
        &self.state
    }

    /// Puts the plant elsewhere, with the power and the laser as they are.
    pub fn place(&mut self, state: State<N, A>) {
        self.state = state;
        self.dynamics.couple(&mut self.state);
        self.passed = self.state;
    }

    /// The equations that it follows.
    pub fn dynamics(&self) -> &Dynamics<N, M, A> {
        &self.dynamics
    }

    /// Moves one cycle on under `actuation`.
    fn advance(&mut self, actuation: &Actuation) {
        self.powered_cycles = match actuation.mode {
            CommandMode::Disabled => None,
            _ => Some(self.powered_cycles.map_or(0, |cycles| cycles.saturating_add(1))),
        };
        let cycle_time = self.period.seconds();
        self.dynamics.power(self.powered_cycles.map(|cycles| f64::from(cycles) * cycle_time));
        let motors = *self.dynamics.motors();
        let step = self.weights.step;
        for index in 0..self.substeps {
            if let (Some(stepping), Some(field)) = (&self.stepping, self.dynamics.field_mut()) {
                let share = |index: u32| f64::from(index) / f64::from(self.substeps);
                stepping.drive(field, [share(index), share(index + 1)], actuation.mode);
                if let Err(stall) = stepping.in_step(field, &self.state) {
                    self.fail(stall);
                }
            }
            let phases = match actuation.mode {
                CommandMode::Disabled => Phases::Open,
                _ if self.stepping.is_some() => Phases::Open,
                CommandMode::Driven => {
                    let at = [f64::from(index) / f64::from(self.substeps), step];
                    let state = &self.state;
                    let servos = &mut self.servos;
                    Phases::Driven(SVector::from_fn(|row, _| {
                        let Some(Some(servo)) = servos.get_mut(row) else { return 0.0 };
                        let voltage = servo.voltage(at, motor_state(state, row));
                        saturate(voltage, motors.voltage[row])
                    }))
                }
                CommandMode::QuickStop => {
                    let voltage = self.brake.voltage(&self.state, &motors, step);
                    Phases::Driven(SVector::from_fn(|row, _| {
                        saturate(voltage[row], motors.voltage[row])
                    }))
                }
            };
            match friction::advance(&mut self.dynamics, &self.state, &phases, &self.weights) {
                Ok(state) => {
                    self.passed = self.state;
                    self.state = state;
                }
                Err(unsolvable) => {
                    self.on_unsolvable(&unsolvable);
                    return;
                }
            }
            for (current, limit) in self.state.current.iter_mut().zip(motors.current.iter()) {
                *current = saturate(*current, *limit);
            }
        }
    }

    /// The mechanism is driven where it cannot go: it stops short of that as at a wall, a fault
    /// until it is reset.
    fn on_unsolvable(&mut self, unsolvable: &Unsolvable) {
        self.state = State {
            current: SVector::zeros(),
            speed: SVector::zeros(),
            load_speed: Joints::zeros(),
            ..self.passed
        };
        match unsolvable {
            Unsolvable::Chain(error) => self.fail(out_of_reach(error)),
            Unsolvable::Mass => self.fail(Fault::new(FaultCode::DriveFault)),
        }
    }

    /// What of `actuation` this plant carries out: all of it, or nothing but the brake.
    fn validate(&mut self, actuation: &Actuation) -> Actuation {
        if actuation.mode == CommandMode::Disabled {
            self.fault = Fault::default();
            return Actuation { laser: LaserCycle::OFF, ..*actuation };
        }
        if !self.fault.is_some() {
            self.fault = self.refusal(actuation).unwrap_or_default();
        }
        if self.fault.is_some() {
            return self.stopped();
        }
        let dark = actuation.freshness == Freshness::Stale || actuation.mode != CommandMode::Driven;
        let laser = if dark { LaserCycle::OFF } else { actuation.laser };
        Actuation { laser, ..*actuation }
    }

    /// Brakes if the motors are powered, else leaves them unpowered.
    fn stopped(&self) -> Actuation {
        match self.in_force {
            Some(Actuation { mode: CommandMode::Disabled, .. }) | None => Actuation::DISABLED,
            Some(_) => Actuation::QUICK_STOP,
        }
    }

    /// The angle of a motor when its place was measured [rad].
    fn turned(&self, row: usize) -> f64 {
        let Delay { cycles, part, .. } = self.age[row];
        let [later, later_speed] = self.turned.back(cycles);
        if part == 0.0 {
            return later[row];
        }
        let [earlier, earlier_speed] = self.turned.back(cycles + 1);
        let [from, to] =
            [earlier_speed, later_speed].map(|speed| speed[row] * self.period.seconds());
        hermite(earlier[row], from, later[row], to, 1.0 - part).0
    }

    fn measure(&mut self) -> Measurement {
        let mut measurement = Measurement::default();
        let pulses = self.stepping.as_ref().map(Stepping::counts);
        for row in 0..self.motors {
            if let Some(pulses) = &pulses {
                measurement.counts[row] = pulses[row];
                measurement.position[row] =
                    self.origin[row] + pulses[row] as f64 * self.resolution[row];
                continue;
            }
            let turned = (self.turned(row) - self.origin[row]) / self.resolution[row];
            let counts = (turned + self.phase[row]).round();
            measurement.counts[row] = counts as i64;
            measurement.position[row] = self.origin[row] + counts * self.resolution[row];
            measurement.current[row] = self.state.current[row];
            if self.current_resolution > 0.0 {
                let steps = (self.state.current[row] / self.current_resolution).round();
                measurement.current[row] = steps * self.current_resolution;
            }
        }
        match self.dynamics.locate(&self.state.load) {
            Ok(pose) => measurement.tool = Some(pose.position.into()),
            Err(error) => self.fail(out_of_reach(&error)),
        }
        measurement.laser = self.light;
        measurement
    }

    /// Why this plant cannot carry `actuation` out, if it cannot.
    fn refusal(&self, actuation: &Actuation) -> Option<Fault> {
        let targets: &[&ActuatorArray] = match actuation.mode {
            CommandMode::Disabled | CommandMode::QuickStop => &[],
            CommandMode::Driven => {
                &[&actuation.voltage, &actuation.effort, &actuation.velocity, &actuation.position]
            }
        };
        for values in targets {
            let mut values = values.iter().take(self.motors).enumerate();
            if let Some((row, value)) = values.find(|(_, value)| !value.is_finite()) {
                let fault = Fault::new(FaultCode::NotFinite).on_actuator(row);
                return Some(fault.with(FaultQuantity::Number, *value));
            }
        }
        (!actuation.laser.is_valid(self.period.time())).then(|| impossible_light(&actuation.laser))
    }

    /// Reports `fault` unless there is an earlier one.
    fn fail(&mut self, fault: Fault) {
        if !self.fault.is_some() {
            self.fault = fault;
        }
    }
}

/// Substeps in a cycle of `cycle_time` [s], none of them longer than `longest` [s], that all of `dynamics`
/// is stable in.
///
/// # Errors
/// More than can be afforded.
fn substeps<const N: usize, M: Mechanism<N>, const A: usize>(
    dynamics: &Dynamics<N, M, A>,
    longest: f64,
    cycle_time: f64,
) -> Result<u32, PlantError> {
    let (mechanical, electrical) = (dynamics.fastest(), dynamics.electrical());
    let stable = (mechanical + electrical) / STABLE_PRODUCT;
    let substeps = (cycle_time / longest - 1e-9).max(stable * cycle_time).ceil();
    if stable <= MOST_SUBSTEPS {
        Ok(substeps as u32)
    } else if electrical > mechanical {
        Err(PlantError::TooQuick { rate: mechanical + electrical })
    } else {
        Err(PlantError::TooStiff { rate: mechanical + electrical })
    }
}

impl<const N: usize, M: Mechanism<N>, const A: usize> Port for Plant<N, M, A> {
    fn profile(&self) -> &Profile {
        &self.profile
    }

    fn send(&mut self, actuation: &Actuation) {
        self.cycle();
        let mut measurement = self.measure();
        (self.light, self.passed_cycles) = (LaserCycle::OFF, 0);
        if self.engage(actuation) != CommandMode::Disabled {
            measurement.power = Power::On;
        }
        measurement.fault = self.fault;
        self.measured = measurement;
    }

    fn receive(&mut self, measurement: &mut Measurement) {
        *measurement = self.measured;
    }

    fn pass(&mut self, actuation: &Actuation) {
        self.cycle();
        self.engage(actuation);
    }
}

impl<const N: usize, M: Mechanism<N>, const A: usize> Plant<N, M, A> {
    /// The cycle from the last call to this one, under what is in force.
    fn cycle(&mut self) {
        let Some(in_force) = self.in_force else { return };
        self.advance(&in_force);
        self.turned.push([self.state.angle, self.state.speed]);
        let Delay { cycles, .. } = self.gate_latency;
        let [before, after] = [cycles + 1, cycles].map(|back| *self.gate.back(back));
        let gate = LaserCycle::across(&before, &after, self.gate_latency, self.period);
        let light = gate.and_then(|gate| self.source.cycle(&gate));
        if light.and_then(|light| self.tell(&light)) == Err(TooManyEdges) {
            self.fail(impossible_light(&after));
        }
        self.passed_cycles = self.passed_cycles.saturating_add(1);
    }

    /// Adds the light of a cycle to what the laser did since the last exchange.
    fn tell(&mut self, light: &LaserCycle) -> Result<(), TooManyEdges> {
        let start = self
            .passed_cycles
            .saturating_mul(u32::try_from(self.period.time().0).unwrap_or(u32::MAX));
        if self.passed_cycles == 0 {
            self.light = *light;
            return Ok(());
        }
        let first = GateEdge { offset: 0, gate: light.gate, power: light.power };
        let changes = (self.light.last() != (light.gate, light.power)).then_some(&first);
        for edge in changes.into_iter().chain(light.edges()) {
            if !self.light.push(GateEdge { offset: edge.offset.saturating_add(start), ..*edge }) {
                return Err(TooManyEdges);
            }
        }
        Ok(())
    }

    /// Puts `actuation` in force, as far as this plant carries it out; the mode that is.
    fn engage(&mut self, actuation: &Actuation) -> CommandMode {
        let mut accepted = self.validate(actuation);
        if let Some(stepping) = &mut self.stepping
            && let Err(beyond) = stepping.engage(&accepted, &self.state)
        {
            self.fail(beyond);
            accepted = self.stopped();
            if let Some(stepping) = &mut self.stepping {
                stepping.brake();
            }
        }
        let braking = |mode| matches!(mode, Some(CommandMode::QuickStop));
        if braking(Some(accepted.mode)) && !braking(self.in_force.map(|before| before.mode)) {
            self.brake.engage(&self.state);
        }
        for (row, servo) in self.servos.iter_mut().enumerate() {
            if let Some(servo) = servo {
                servo.engage(&accepted, row, motor_state(&self.state, row));
            }
        }
        match accepted.mode {
            CommandMode::Driven => self.gate.push(accepted.laser),
            // There is nothing on its way.
            CommandMode::Disabled | CommandMode::QuickStop => self.gate.fill(LaserCycle::OFF),
        }
        self.in_force = Some(accepted);
        accepted.mode
    }
}

/// The motor `row` of `state`.
fn motor_state<const N: usize, const A: usize>(state: &State<N, A>, row: usize) -> MotorState {
    MotorState { angle: state.angle[row], speed: state.speed[row], current: state.current[row] }
}

/// What drives of `actuators` can do.
fn profile(actuators: &[Actuator]) -> Profile {
    let modes = |actuator: &Actuator| match actuator.motor {
        Motor::Dc(_) => ActuatorMode::ALL.to_vec(),
        Motor::Stepper(_) => vec![ActuatorMode::Position],
    };
    let each = |actuator: &Actuator| ActuatorProfile {
        modes: modes(actuator),
        latency: actuator.latency,
        age: actuator.age,
    };
    Profile {
        clock: PortClock::Ours,
        gate_resolution: Nanoseconds(1),
        gate_latency: Nanoseconds(0),
        actuators: actuators.iter().map(each).collect(),
    }
}

/// The fault of a place that the mechanism cannot reach.
fn out_of_reach(error: &KinematicsError) -> Fault {
    let fault = Fault::new(FaultCode::DriveFault);
    let fault = error.axis.map_or(fault, |axis| fault.on_axis(axis));
    fault.beyond(FaultQuantity::Mechanism, error.value, error.limit)
}

/// Whether `actuators` are those of `axes`, in their order, at least one of each.
fn belong(axes: &[Axis], actuators: &[Actuator]) -> bool {
    let mut next = 0;
    axes.iter().enumerate().all(|(index, axis)| {
        let own = axis.driven_by(actuators);
        let follows = axis.actuators.start == next && !own.is_empty();
        next = axis.actuators.end;
        follows && own.iter().all(|actuator| actuator.axis == index)
    }) && next == actuators.len()
}

/// `value` within ±`limit`.
fn saturate(value: f64, limit: f64) -> f64 {
    value.max(-limit).min(limit)
}

/// A phase −0.5..0.5 [counts] for the encoder of `actuator`, 0 for seed 0.
fn encoder_phase(seed: u64, actuator: u64) -> f64 {
    if seed == 0 {
        return 0.0;
    }
    let mut random = SplitMix64::new(seed);
    (0..=actuator).map(|_| random.fraction()).last().unwrap_or(0.5) - 0.5
}
