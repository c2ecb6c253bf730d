//! Homing by what other machines have: a hard stop, absolute encoders, and a switch on either side of a gantry.

use super::cell::{Cell, X};
use drives::port::{Actuation, Measurement, Port, Profile};
use drives::{PlantOptions, SimulatedPlant};
use machine::Machine;
use messages::OperatorVerb::{Home, Start, Step, Stop};
use messages::{CommandMode, ControllerState as State, FaultCode, MotionEnd, Refusal};

const CARTESIAN: &str = include_str!("../../../machines/cartesian.toml");
const GANTRY: &str = include_str!("../../../machines/gantry.toml");

/// Where the wall stands that x runs against [m].
const WALL: f64 = 0.092;

/// A machine whose x axis is stopped by a wall: the motor is stalled there, and draws what its voltage drives
/// through it. Elsewhere it is a motor with the inertia of its load; y stands.
struct Walled {
    profile: Profile,
    machine: Machine,
    /// The motor's angle, speed and current [rad, rad/s, A], and the voltage in force.
    angle: f64,
    speed: f64,
    current: f64,
    voltage: f64,
    is_powered: bool,
    start: f64,
    /// The greatest current against the wall [A].
    wall: Option<f64>,
}

impl Walled {
    fn new(machine: &Machine, wall: Option<f64>) -> Self {
        let plant = SimulatedPlant::new(machine, PlantOptions::default()).unwrap();
        let start = machine.home_joints[0] / machine.actuators[0].ratio;
        Self {
            profile: plant.profile().clone(),
            machine: machine.clone(),
            angle: start,
            speed: 0.0,
            current: 0.0,
            voltage: 0.0,
            is_powered: false,
            start,
            wall: wall.map(|wall| wall / machine.actuators[0].ratio),
        }
    }

    /// A millisecond in steps of a microsecond.
    fn advance(&mut self) {
        const STEP: f64 = 1e-6;
        let actuator = &self.machine.actuators[0];
        let motor = actuator.motor.dc().unwrap();
        for _ in 0..1000 {
            let voltage = if self.is_powered { self.voltage } else { 0.0 };
            let back = motor.torque_constant * self.speed;
            self.current +=
                (voltage - motor.resistance * self.current - back) / motor.inductance * STEP;
            let most = motor.current;
            self.current = if self.is_powered { self.current.clamp(-most, most) } else { 0.0 };
            let friction = actuator.friction.coulomb * messages::math::tanh(self.speed / 0.1);
            let torque = motor.torque_constant * self.current - friction;
            self.speed += torque / actuator.gains.inertia * STEP;
            self.angle += self.speed * STEP;
            if let Some(wall) = self.wall.filter(|wall| self.angle < *wall) {
                (self.angle, self.speed) = (wall, self.speed.max(0.0));
            }
        }
    }
}

impl Port for Walled {
    fn profile(&self) -> &Profile {
        &self.profile
    }

    fn send(&mut self, actuation: &Actuation) {
        self.is_powered = actuation.mode != CommandMode::Disabled;
        self.voltage = actuation.voltage[0];
        if actuation.mode == CommandMode::QuickStop {
            self.voltage = 0.0;
        }
    }

    fn receive(&mut self, measurement: &mut Measurement) {
        let resolution = self.machine.actuators[0].encoder.resolution();
        let counts = ((self.angle - self.start) / resolution).round();
        *measurement = Measurement::default();
        measurement.power =
            if self.is_powered { drives::port::Power::On } else { drives::port::Power::Off };
        measurement.counts[0] = counts as i64;
        measurement.position[0] = counts * resolution;
        measurement.current[0] = self.current;
        measurement.tool = Some([self.angle * self.machine.actuators[0].ratio, 0.1, 0.0]);
        self.advance();
    }

    fn pass(&mut self, _actuation: &Actuation) {
        self.advance();
    }
}

/// The Cartesian machine with this homing of x.
fn homed_by(homing: &str) -> Machine {
    Machine::parse("homing.toml", &format!("{CARTESIAN}\n[axis.x.homing]\n{homing}"), &[]).unwrap()
}

const HARD_STOP: &str = r#"
method = "hard_stop"
speed = "10 mm/s"
current = "1.5 A"
position = "-1 mm"
"#;

#[test]
fn a_hard_stop_is_found_by_the_current_and_left_again() {
    let machine = homed_by(HARD_STOP);
    let mut cell = Cell::of(&machine, Box::new(Walled::new(&machine, Some(WALL))));
    cell.enable();
    assert_eq!(cell.progress.homed & 1, 0);
    cell.accept(Home, 0, 0.0, 0.0);
    let mut most = 0.0_f64;
    for _ in 0..30_000 {
        cell.cycle(None);
        most = most.max(cell.feedback().current[0].abs());
        if cell.state() != State::Homing {
            break;
        }
    }
    assert_eq!((cell.state(), cell.end()), (State::Idle, MotionEnd::Reached), "{most} A");
    assert_eq!(cell.progress.homed & 1, 1);
    // At home, 101 mm from the wall.
    cell.run(50);
    let truth = cell.feedback().tool[0];
    assert!((truth - (WALL + 0.101)).abs() < 0.1e-3, "{truth}");
    // It presses on until it has come to rest, with what its power stage gives at most.
    assert!((1.5..=5.2).contains(&most), "{most} A against the wall");
}

#[test]
fn a_hard_stop_that_is_not_there_is_a_fault_and_not_an_endless_search() {
    let machine = homed_by(HARD_STOP);
    let mut cell = Cell::of(&machine, Box::new(Walled::new(&machine, None)));
    cell.enable();
    cell.accept(Home, 0, 0.0, 0.0);
    cell.until(State::Faulted, 30_000);
    assert_eq!(cell.outputs.command.fault.code(), FaultCode::HomingFailed);
    assert_eq!((cell.progress.homed & 1, cell.end()), (0, MotionEnd::Fault));
}

#[test]
fn an_absolute_encoder_knows_its_place_from_the_start() {
    let machine = homed_by("method = \"absolute\"\nposition = \"40 mm\"\n");
    let mut cell = Cell::enabled(&machine);
    assert_eq!(cell.progress.homed & 3, 3);
    let ratio = machine.actuators[0].ratio;
    assert!((cell.feedback().position[0] * ratio - 0.06).abs() < 1e-5, "it reads 0 at 40 mm");
    assert_eq!(cell.refuse(Home, 0, 0.0, 0.0), Refusal::NothingToFind);
    cell.accept(Step, X, 0.02, 0.1);
    cell.until(State::Idle, 5000);
    assert!((cell.place(0) - 0.12).abs() < 1e-6 && (cell.truth(0) - 0.12).abs() < 20e-6);
    let limit = cell.ask(Step, X, 0.1, 0.1);
    assert_eq!(Refusal::from_wire(limit.refusal), Refusal::SoftLimit);
    cell.accept(Start, 0, 1.0, 0.0);
    cell.accept(Stop, 0, 0.0, 0.0);
}

#[test]
fn a_simulated_drive_finds_its_reference_without_a_motion() {
    let by_drive = "method = \"drive\"\ndrive_method = 17\nposition = \"-1 mm\"\n";
    for mode in ["position", "velocity", "torque"] {
        let file = CARTESIAN.replace("[axis.x]\n", &format!("[axis.x]\nmode = \"{mode}\"\n"));
        let text = format!("{file}\n[axis.x.homing]\n{by_drive}");
        let machine = Machine::parse("homing.toml", &text, &[]).unwrap();
        let mut cell = Cell::enabled(&machine);
        assert_eq!(cell.progress.homed & 3, 2);
        assert_eq!(cell.refuse(Start, 0, 1.0, 0.0), Refusal::NotHomed);
        let before = cell.truth(0);
        cell.accept(Home, 0, 0.0, 0.0);
        let mut away = 0;
        for _ in 0..1000 {
            cell.cycle(None);
            away += u32::from(cell.feedback().homing == 1);
            assert!((cell.truth(0) - before).abs() < 20e-6, "{mode}: {} {before}", cell.truth(0));
            if cell.state() == State::Idle {
                break;
            }
        }
        assert_eq!(
            (cell.state(), cell.end(), cell.progress.homed & 3),
            (State::Idle, MotionEnd::Reached, 3)
        );
        assert!((4..10).contains(&away), "{away}");
        // Places are those of the machine from then on, and it moves as it is told.
        let ratio = machine.actuators[0].ratio;
        assert!((cell.feedback().position[0] * ratio - before).abs() < 20e-6, "{mode}");
        cell.accept(Step, X, 0.02, 0.1);
        cell.until(State::Idle, 5000);
        assert!((cell.truth(0) - before - 0.02).abs() < 20e-6, "{mode}: {}", cell.truth(0));
    }
}

/// The gantry with a switch at either end of its bridge, both at the same place of y.
const SIDES: &str = r#"
[inputs.left]
function = "home"
axis = "y"
actuator = "left"
at = "5 mm"
[inputs.right]
function = "home"
axis = "y"
actuator = "right"
at = "5 mm"
[axis.y.homing]
position = "5 mm"
speed = "40 mm/s"
latch_speed = "1 mm/s"
"#;

#[test]
fn a_gantry_is_squared_by_its_two_switches() {
    let machine = Machine::parse("gantry.toml", &format!("{GANTRY}{SIDES}"), &[]).unwrap();
    let axis = machine.axes.iter().position(|axis| axis.name == "y").unwrap();
    let sides = machine.axes[axis].actuators.clone();
    // What drives counts begins where each side stood: at home, out of square by what the file says of each.
    let mean: f64 = machine.actuators[sides.clone()].iter().map(|it| it.share * it.square).sum();
    let truth = |cell: &Cell| -> Vec<f64> {
        let side = |index: usize| {
            let actuator = &machine.actuators[index];
            let start = machine.home_joints[axis] + actuator.square - mean;
            start + cell.feedback().position[index] * actuator.ratio
        };
        sides.clone().map(side).collect()
    };
    let mut cell = Cell::enabled(&machine);
    let before = truth(&cell);
    assert!((before[0] - before[1]).abs() > 75e-6, "out of square by {before:?}");
    cell.accept(Home, 0, 0.0, 0.0);
    cell.until(State::Idle, 60_000);
    assert_eq!(cell.end(), MotionEnd::Reached);
    let after = truth(&cell);
    // Right to half of what a side moves in a cycle at 1 mm/s, and a pulse.
    assert!((after[0] - after[1]).abs() < 10e-6, "square: {after:?}");
    assert!((after[0] - machine.home_joints[axis]).abs() < 10e-6, "at home: {after:?}");
}
