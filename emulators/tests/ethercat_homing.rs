//! Axes whose drives find their references by themselves, on the emulated bus: controller, bridge and port are those
//! that run, in virtual time.

#![allow(unreachable_pub, clippy::unwrap_used)]

#[allow(dead_code, reason = "it is written for the simulated machine")]
#[path = "operating/cell.rs"]
mod cell;
mod line;

use cell::{Cell, X};
use emulators::cable::Cable;
use emulators::ethercat::faults::Rates;
use emulators::ethercat::{Layout, Link};
use machine::Machine;
use machine::operating::HomingMethod;
use messages::OperatorVerb::{Disable, Enable, Home, Reset, Start, Step, Stop};
use messages::{
    ControllerState as State, FaultCode, FaultQuantity, MotionEnd, Nanoseconds, Refusal,
};

/// The fastest that an axis is moved here [m/s].
const SPEED: f64 = 50e-3;

/// How far from its place an axis is that has been homed [m].
const PLACE: f64 = 30e-6;

/// The gantry, whose x axis is homed by the `number` of its drive's methods, to be at `position` then; its targets are of
/// `mode`, and a home switch is at the drive.
fn file(mode: &str, number: i32, position: &str, switch: &str) -> String {
    let wired = "x_max = { slave = 0, bit = 1 }\nx_home = { slave = 0, bit = 2 }\n";
    line::shipped("servo_gantry")
        .replace("mode = \"position\"", &format!("mode = \"{mode}\""))
        .replace("x_max = { slave = 0, bit = 1 }\n", wired)
        + &format!(
            "
[inputs.x_home]
function = \"home\"
axis = \"x\"
{switch}
[axis.x.homing]
method = \"drive\"
drive_method = {number}
position = \"{position}\"
speed = \"50 mm/s\"
latch_speed = \"5 mm/s\"
"
        )
}

fn parse(text: &str) -> Result<Machine, String> {
    Machine::parse("homing.toml", text, &[]).map_err(|error| {
        let told: Vec<String> = error.problems().map(|problem| problem.message()).collect();
        told.join("; ")
    })
}

/// The gantry on its bus, operated.
struct Bus {
    cell: Cell,
    cable: Cable<Link>,
    /// Where x truly was [m], and how fast it has been at most [m/s].
    place: f64,
    fastest: f64,
}

impl Bus {
    fn new(text: &str) -> Self {
        let machine = parse(text).unwrap();
        let line = line::open(machine.clone(), Rates::default(), 0);
        let cable = line.cable.clone();
        let mut cell = Cell::of(&machine, Box::new(line));
        cell.run(100);
        cell.enable();
        let mut bus = Self { cell, cable, place: 0.0, fastest: 0.0 };
        bus.place = bus.truth();
        bus
    }

    /// Where x truly is [m].
    fn truth(&self) -> f64 {
        let home = self.cable.with(|link, _| link.segment.wires().motor(0).counts) as f64;
        0.2 + home / 131_072.0 * 10e-3
    }

    /// So many cycles, until `is_over`.
    fn run(&mut self, cycles: u32, is_over: impl Fn(&Cell) -> bool) {
        for _ in 0..cycles {
            self.cell.cycle(None);
            let place = self.truth();
            self.fastest = self.fastest.max((place - self.place).abs() * 1e3);
            self.place = place;
            if is_over(&self.cell) {
                return;
            }
        }
        panic!(
            "{:?}, x at {}: {:?}",
            self.cell.state(),
            self.place,
            self.cell.outputs.command.fault
        );
    }

    fn until(&mut self, state: State) {
        self.run(60_000, |cell| cell.state() == state);
    }

    /// Homed, and at home, without a jump.
    fn home(&mut self) {
        self.cell.accept(Home, 0, 0.0, 0.0);
        self.until(State::Idle);
        assert_eq!((self.cell.end(), self.cell.progress.homed & 1), (MotionEnd::Reached, 1));
        assert!(self.fastest <= 1.2 * SPEED, "{} m/s", self.fastest);
        let told = self.cell.feedback();
        assert_eq!((told.homing, told.fault.is_some()), (0, false));
        // It follows its targets again, from where it is.
        self.cell.accept(Step, X, 5e-3, SPEED);
        self.until(State::Idle);
        self.cell.accept(Step, X, -5e-3, SPEED);
        self.until(State::Idle);
        assert!(self.fastest <= 1.2 * SPEED, "{} m/s", self.fastest);
    }
}

/// The home switch near one end.
const LOWER: &str = "side = \"lower\"\nat = \"20 mm\"";
const UPPER: &str = "side = \"upper\"\nat = \"380 mm\"";

#[test]
fn each_method_leads_to_the_place_of_its_reference() {
    // The axis stands at 200 mm, which is home; the limit switches are at -10 mm and 410 mm, and an index pulse is at
    // 200 mm and every 10 mm from there.
    for (number, position, switch) in [
        (17, "-10 mm", LOWER),
        (18, "410 mm", LOWER),
        (19, "380 mm", UPPER),
        (20, "380 mm", UPPER),
        (21, "20 mm", LOWER),
        (22, "20 mm", LOWER),
        (33, "200 mm", LOWER),
        (34, "210 mm", LOWER),
        (35, "202 mm", LOWER),
        (37, "202 mm", LOWER),
    ] {
        let mut bus = Bus::new(&file("position", number, position, switch));
        assert_eq!(bus.cell.refuse(Start, 0, 1.0, 0.0), Refusal::NotHomed);
        // Away from the index pulse where it stood.
        bus.cell.accept(Step, X, 2e-3, SPEED);
        bus.until(State::Idle);
        bus.home();
        assert!((bus.place - 0.2).abs() <= PLACE, "method {number}: {} m", bus.place);
        // What is told of the plan is of some cycles before.
        bus.cell.run(10);
        let planned = bus.cell.place(0);
        assert!((planned - 0.2).abs() < 1e-9, "method {number}: {planned}");
    }
}

#[test]
fn a_place_that_was_taken_wrongly_is_put_right_in_each_mode() {
    for mode in ["position", "velocity", "torque"] {
        // Where it stands, at 200 mm, shall be 150 mm: at home it is 50 mm farther.
        let mut bus = Bus::new(&file(mode, 37, "150 mm", LOWER));
        bus.home();
        assert!((bus.place - 0.25).abs() <= PLACE, "{mode}: {} m", bus.place);
        // Once more, from there.
        bus.home();
        assert!((bus.place - 0.30).abs() <= PLACE, "{mode}: {} m", bus.place);
        let mut bus = Bus::new(&file(mode, 21, "20 mm", LOWER));
        bus.home();
        assert!((bus.place - 0.2).abs() <= PLACE, "{mode}: {} m", bus.place);
    }
}

#[test]
fn a_stop_brings_it_to_rest_unhomed_and_it_can_be_begun_anew() {
    let mut bus = Bus::new(&file("position", 21, "20 mm", LOWER));
    bus.cell.accept(Home, 0, 0.0, 0.0);
    bus.run(1000, |cell| cell.feedback().homing == 1);
    for _ in 0..500 {
        bus.cell.cycle(None);
    }
    let moving = bus.truth();
    assert!(moving < 0.195, "{moving}");
    bus.place = moving;
    bus.cell.accept(Stop, 0, 0.0, 0.0);
    assert_eq!(bus.cell.refuse(Step, X, 1e-3, SPEED), Refusal::State);
    bus.until(State::Idle);
    assert_eq!((bus.cell.end(), bus.cell.progress.homed & 1), (MotionEnd::Stopped, 0));
    let rest = bus.truth();
    assert!(moving - rest < SPEED * 0.15, "{moving} {rest}");
    bus.cell.run(200);
    assert!((bus.truth() - rest).abs() < PLACE);
    (bus.place, bus.fastest) = (bus.truth(), 0.0);
    bus.home();
    assert!((bus.place - 0.2).abs() <= PLACE, "{} m", bus.place);
}

#[test]
fn a_drive_that_finds_nothing_is_a_fault_in_words_and_rests() {
    // No home switch on the way down: it comes to its limit switch.
    let mut bus = Bus::new(&file("position", 21, "20 mm", UPPER));
    bus.cell.accept(Home, 0, 0.0, 0.0);
    bus.until(State::Faulted);
    let fault = bus.cell.outputs.command.fault;
    assert_eq!((fault.code(), fault.actuator), (FaultCode::HomingFailed, 1));
    assert_eq!(fault.quantity(), FaultQuantity::HomingStatus);
    assert_ne!(fault.value as u16 & 0x2000, 0, "{:x}", fault.value as u16);
    bus.cell.run(300);
    let rest = bus.truth();
    bus.cell.run(200);
    assert!((bus.truth() - rest).abs() < PLACE, "{rest} {}", bus.truth());
    bus.cell.accept(Reset, 0, 0.0, 0.0);
    bus.cell.run(300);
    bus.cell.accept(Enable, 0, 0.0, 0.0);
    bus.until(State::Idle);
    assert_eq!(bus.cell.progress.homed & 1, 0);
    bus.cell.accept(Disable, 0, 0.0, 0.0);
}

#[test]
fn without_a_bridge_a_drive_that_looks_comes_to_rest() {
    let mut bus = Bus::new(&file("position", 17, "-10 mm", LOWER));
    bus.cell.accept(Home, 0, 0.0, 0.0);
    bus.run(1000, |cell| cell.feedback().homing == 1);
    bus.cell.run(300);
    let now = drives::link::Link::now(&bus.cable);
    bus.cable.go_to(now + Nanoseconds(300_000_000));
    let rest = bus.truth();
    bus.cable.go_to(now + Nanoseconds(600_000_000));
    assert!(rest < 0.199 && (bus.truth() - rest).abs() < PLACE, "{rest} {}", bus.truth());
}

#[test]
fn what_the_drive_cannot_do_is_told_when_the_bus_is_opened() {
    let machine = parse(&file("position", 23, "0 mm", LOWER)).unwrap();
    let refused = line::try_open(machine, &Layout::default(), Rates::default());
    let told = refused.err().map(|error| error.to_string()).unwrap_or_default();
    assert!(told.contains("does not take the method 23 of homing (6098h)"), "{told}");
}

#[test]
fn what_no_drive_can_do_is_refused_in_the_machine_file() {
    let plain = file("position", 17, "-10 mm", LOWER);
    let machine = parse(&plain).unwrap();
    let homing = machine.operating.homing(0).unwrap();
    assert_eq!((homing.method, homing.drive.method), (HomingMethod::Drive, 17));
    assert!((homing.drive.acceleration - 0.5).abs() < 1e-12, "50 mm/s in 0.1 s");
    for (from, to, words) in [
        ("drive_method = 17\n", "", "nothing is said of how the drive of axis `x` finds"),
        ("drive_method = 17", "drive_method = 17.5", "17.5 is no method of homing"),
        ("method = \"drive\"", "method = \"switch\"", "`drive_method` has no effect"),
        ("mode = \"position\"", "mode = \"voltage\"", "its drive closes no loop"),
    ] {
        assert!(plain.contains(from), "{from}");
        let told = parse(&plain.replace(from, to)).err().unwrap_or_default();
        assert!(told.contains(words), "{told}");
    }
    let odd = plain.replace("[axis.x.homing]", "[axis.y.homing]");
    let odd = odd.replace("drive_method = 17", "drive_method = -3");
    let told = parse(&odd).err().unwrap_or_default();
    assert!(told.contains("`y.right` is mirrored") && told.contains("method -3"), "{told}");
}

/// The gantry, whose y axis is homed by both of its drives, by the `number` of their method, each at a switch of its own: that on
/// the right stands `apart` [m] beyond that on the left. What is between the two gives way.
fn gantry(number: i32, [side, at]: [&str; 2], apart: f64) -> String {
    let soft = "stiffness = \"500 N m/rad\" # of both together";
    let limits = "[axis.y.limits]\n";
    let text = line::shipped("servo_gantry");
    assert!(text.contains(soft) && text.contains(limits));
    let right: f64 = at.parse().unwrap();
    let wired = "x_max = { slave = 0, bit = 1 }\ny_left = { slave = 1, bit = 2 }\ny_right = { slave = 2, bit = 2 }\n";
    let text = text
        .replace(soft, "stiffness = \"20 N m/rad\"")
        .replace(limits, "[axis.y.limits]\nracking = \"0.1 mm\"\n")
        .replace("x_max = { slave = 0, bit = 1 }\n", wired);
    let mut text = text;
    for (name, place) in [("left", right), ("right", right + apart * 1e3)] {
        text += &format!(
            "
[inputs.y_{name}]
function = \"home\"
axis = \"y\"
actuator = \"{name}\"
side = \"{side}\"
at = \"{place} mm\"
"
        );
    }
    text + &format!(
        "
[axis.y.homing]
method = \"drive\"
drive_method = {number}
position = \"{at} mm\"
speed = \"50 mm/s\"
latch_speed = \"5 mm/s\"
"
    )
}

/// Where the left and the right motor of the gantry's y truly are [m].
fn sides(bus: &Bus) -> [f64; 2] {
    let counts = |motor| bus.cable.with(|link, _| link.segment.wires().motor(motor).counts) as f64;
    [counts(1), -counts(2)].map(|counts| 0.15 + counts / 131_072.0 * 10e-3)
}

#[test]
fn a_gantry_is_homed_by_both_of_its_drives_and_squared() {
    for (number, switch) in [(21, ["lower", "20"]), (22, ["lower", "20"]), (19, ["upper", "280"])] {
        let mut bus = Bus::new(&gantry(number, switch, 60e-6));
        assert_eq!(bus.cell.refuse(Start, 0, 1.0, 0.0), Refusal::NotHomed);
        bus.cell.accept(Home, 0, 0.0, 0.0);
        bus.until(State::Idle);
        assert_eq!((bus.cell.end(), bus.cell.progress.homed & 2), (MotionEnd::Reached, 2));
        // Each is at home by its own switch, the right one so much farther.
        let [left, right] = sides(&bus);
        assert!((left - 0.15).abs() < PLACE, "method {number}: {left}");
        assert!((right - left - 60e-6).abs() < 5e-6, "method {number}: {left} {right}");
        bus.cell.run(10);
        assert!((bus.cell.place(1) - 0.15).abs() < 1e-9, "method {number}");
    }
}

#[test]
fn switches_of_a_gantry_that_are_too_far_apart_are_told_by_the_side_that_stands_off() {
    let mut bus = Bus::new(&gantry(21, ["lower", "20"], 2e-3));
    bus.cell.accept(Home, 0, 0.0, 0.0);
    bus.until(State::Faulted);
    let fault = bus.cell.outputs.command.fault;
    assert_eq!(fault.code(), FaultCode::Racking);
    assert!(fault.actuator == 2 || fault.actuator == 3, "{fault:?}");
    bus.cell.run(300);
    let rest = sides(&bus);
    bus.cell.run(200);
    assert!((sides(&bus)[0] - rest[0]).abs() < PLACE, "{rest:?}");
    assert_eq!(bus.cell.progress.homed & 2, 0);
}
