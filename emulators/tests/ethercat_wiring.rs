//! Inputs and outputs of the machine file on terminals and drives of the emulated bus, and who answers there.

mod line;

use drives::{Actuation, Freshness, Port as _};
use emulators::ethercat::Layout;
use emulators::ethercat::faults::Rates;
use emulators::ethercat::terminal::Kind;
use line::Line;
use machine::Machine;
use messages::{LaserCycle, Nanoseconds};

const PERIOD: i64 = 1_000_000;

/// Two drives, the gate, the power, eight inputs, eight outputs: the line of the built-in machine.
const WIRING: &str = r#"
[inputs.door]
function = "door"
[inputs.estop]
function = "estop"
active = "low"
[inputs.spare]
function = "general"
[inputs.a_home]
function = "home"
axis = "a"
side = "upper"
at = "HOME"
[inputs.a_max]
function = "limit"
axis = "a"
side = "upper"
at = "LIMIT"
[outputs.air]
function = "air"
[outputs.lamp]
function = "general"
[drives.ethercat.inputs]
door = { slave = 4, bit = 0 }
estop = { slave = 4, bit = 7 }
spare = { slave = 4, bit = 3 }
a_home = { slave = 0, bit = 2 }
a_max = { slave = 0, bit = 1 }
[drives.ethercat.outputs]
air = { slave = 5, bit = 1 }
lamp = { slave = 5, bit = 6 }
"#;

/// Where the belt `a` of the machine is at home [m].
fn start() -> f64 {
    Machine::builtin().home_joints[0]
}

/// The machine's file with this; its switches are 2 mm and 3 mm beyond home.
fn file(more: &str) -> String {
    let at = |beyond: f64| format!("{} mm", start() * 1e3 + beyond);
    more.replace("HOME", &at(2.0)).replace("LIMIT", &at(3.0))
}

fn machine(more: &str) -> Result<Machine, String> {
    let text = line::corexy_file("position") + &file(more);
    Machine::parse("bus.toml", &text, &[]).map_err(|error| {
        let told: Vec<String> = error.problems().map(|problem| problem.message()).collect();
        told.join("; ")
    })
}

fn open(more: &str) -> Line {
    line::open(machine(more).expect("the machine"), Rates::default(), 0)
}

/// What is wrong with the line, when the port is opened.
fn refused(more: &str, layout: &Layout) -> String {
    let opened = line::try_open(machine(more).expect("the machine"), layout, Rates::default());
    opened.err().map(|error| error.to_string()).unwrap_or_default()
}

fn set(bench: &Line, channel: u32, level: bool) {
    bench.cable.with(|link, _| {
        let mut wires = link.segment.wires().lock();
        let line = 1 << channel;
        wires.inputs = if level { wires.inputs | line } else { wires.inputs & !line };
    });
}

fn outputs(bench: &Line) -> u64 {
    bench.cable.with(|link, _| link.segment.wires().lock().outputs)
}

fn switched(outputs: u64) -> Actuation {
    Actuation { freshness: Freshness::Fresh, outputs, ..Actuation::DISABLED }
}

#[test]
fn inputs_of_a_terminal_are_active_by_their_level() {
    let mut bench = open(WIRING);
    bench.cycles(&Actuation::DISABLED, 100);
    assert_eq!(bench.measurement.inputs, 0, "nobody has touched anything yet");
    for (door, estop, spare, active) in
        [(true, true, false, 0b001), (false, false, false, 0b010), (false, true, true, 0b100)]
    {
        for (channel, level) in [(0, door), (7, estop), (3, spare)] {
            set(&bench, channel, level);
        }
        bench.cycles(&Actuation::DISABLED, 2);
        assert_eq!(bench.measurement.inputs, active);
    }
    // What a cycle without an answer tells is that of the cycle before.
    bench.cable.with(|link, _| link.set_rates(Rates { lost: 1.0, ..Rates::default() }));
    set(&bench, 0, true);
    bench.cycle(&Actuation::DISABLED);
    assert_eq!(bench.measurement.inputs, 0b100);
}

#[test]
fn switches_at_a_drive_are_told_by_it() {
    let mut bench = open(WIRING);
    bench.cycles(&Actuation::DISABLED, 200);
    bench.cycles(&bench.driven(0.0, 0.0, LaserCycle::OFF), 200);
    let ratio = bench.machine.actuators[0].ratio;
    // The belt goes on to the switches and back, at 50 mm/s.
    let (mut seen, way) = (Vec::new(), 3.5e-3_f64);
    let cycles = (way.abs() / 50e-3 * 1e3).ceil();
    let there = (0..=cycles as u32).map(|cycle| f64::from(cycle) / cycles);
    for part in there.clone().chain(there.rev()) {
        bench.cycle(&bench.driven(part * way / ratio, 0.0, LaserCycle::OFF));
        let inputs = bench.measurement.inputs;
        if seen.last() != Some(&inputs) {
            seen.push(inputs);
        }
    }
    bench.cycles(&bench.driven(0.0, 0.0, LaserCycle::OFF), 100);
    assert!(!bench.measurement.fault.is_some(), "{:?}", bench.measurement.fault);
    assert_eq!(seen, [0, 1 << 3, 0b11 << 3, 1 << 3, 0]);
}

#[test]
fn outputs_have_the_level_of_their_bit_and_go_low_without_a_master() {
    let mut bench = open(WIRING);
    bench.cycles(&Actuation::DISABLED, 100);
    for (bits, levels) in [(0b01, 1 << 1), (0b11, 1 << 1 | 1 << 6), (0b10, 1 << 6), (0b00, 0)] {
        bench.cycles(&switched(bits), 2);
        assert_eq!(outputs(&bench), levels);
    }
    bench.cycles(&switched(0b11), 5);
    // The bridge dies: the watchdog of the terminal, of 20 ms.
    bench.cable.go_to(bench.deadline + Nanoseconds(18 * PERIOD));
    assert_eq!(outputs(&bench), 1 << 1 | 1 << 6);
    bench.cable.go_to(bench.deadline + Nanoseconds(20 * PERIOD));
    assert_eq!(outputs(&bench), 0);

    let mut bench = open(WIRING);
    bench.cycles(&Actuation::DISABLED, 100);
    bench.cycles(&switched(0b11), 5);
    let cut = bench.deadline;
    bench.cable.with(|link, now| link.segment.cut(0, now));
    bench.cycles(&switched(0b11), 21);
    assert_eq!(outputs(&bench), 0, "a cable that is cut");
    assert!(bench.deadline > cut);
    // Closed in order, they are off at once.
    let mut bench = open(WIRING);
    bench.cycles(&Actuation::DISABLED, 100);
    bench.cycles(&switched(0b11), 5);
    bench.port.close().expect("a closed port");
    assert_eq!(outputs(&bench), 0);
}

#[test]
fn a_gate_on_a_plain_output_and_outputs_beside_it_do_not_disturb_each_other() {
    let plain = line::corexy_file("position").replace(
        "gate = { slave = 2, oversampling = 100 }",
        "gate = { slave = 2, channel = 5, oversampling = 1 }",
    ) + &file(WIRING).replace("slave = 5, bit = 1", "slave = 2, bit = 4");
    let machine = Machine::parse("bus.toml", &plain, &[]).expect("the machine");
    let outputs_beside = Kind::Outputs { gate: Some(5) };
    let spare = Kind::Outputs { gate: None };
    let terminals = vec![outputs_beside, Kind::Analogue, Kind::Inputs, spare];
    let layout = Layout { terminals, seed: 0 };
    let mut bench = line::try_open(machine, &layout, Rates::default()).expect("an open port");
    bench.cycles(&Actuation::DISABLED, 200);
    let standing = bench.driven(0.0, 0.0, LaserCycle::OFF);
    bench.cycles(&standing, 200);
    let lit = LaserCycle { gate: 1, power: 0.5, ..LaserCycle::OFF };
    for (laser, bits, levels) in [
        (LaserCycle::OFF, 0b00, 0),
        (lit, 0b00, 1 << 5),
        (lit, 0b01, 1 << 5 | 1 << 4),
        (LaserCycle::OFF, 0b11, 1 << 4 | 1 << 14),
    ] {
        let actuation = Actuation { laser, outputs: bits, ..standing };
        bench.cycles(&actuation, 3);
        assert_eq!(outputs(&bench), levels, "{bits:b}");
    }
    assert_eq!(bench.measurement.inputs & 0b111, 0);
}

#[test]
fn what_cannot_be_on_the_bus_is_refused_in_the_machine_file() {
    let told = |from: &str, to: &str| {
        assert_eq!(WIRING.matches(from).count(), 1, "{from}");
        machine(&WIRING.replace(from, to)).expect_err("refused")
    };
    for (from, to, words) in [
        ("door = { slave = 4, bit = 0 }\n", "", "nothing is said of where the input `door` is"),
        ("lamp = {", "lapm = {", "the machine has no output `lapm`"),
        (
            "function = \"air\"",
            "function = \"air\"\nactive = \"low\"",
            "a terminal that hears nothing puts its outputs low, which would switch `air` on",
        ),
        ("slave = 5, bit = 6", "slave = 5, bit = 1", "`lamp` is on bit 1 of slave 5, as `air` is"),
        ("slave = 5, bit = 6", "slave = 1, bit = 6", "slave 1 is a drive, and `lamp` cannot be"),
        ("slave = 5, bit = 6", "slave = 2, bit = 6", "`lamp` is where the gate is"),
        ("slave = 5, bit = 6", "slave = 3, bit = 6", "`lamp` is where the power is"),
        ("slave = 0, bit = 2", "slave = 0, bit = 32", "slave 0 is a drive, which has no input 32"),
        ("slave = 4, bit = 3", "slave = 4, bit = 0.5", "0.5 is not possible here"),
        (
            "function = \"home\"",
            "function = \"index\"",
            "the index pulse `a_home` is shorter than a cycle, and no slave on a bus sees it",
        ),
    ] {
        let told = told(from, to);
        assert!(told.contains(words), "{told}");
    }
    let slaves =
        machine("[drives.ethercat.slaves.x]\nvendor = 1\nproduct = 2\n").expect_err("refused");
    assert!(slaves.contains("`x` is no position on a bus"), "{slaves}");
}

#[test]
fn a_bit_that_the_slave_does_not_have_is_named() {
    let layout = Layout::default();
    let wiring = WIRING.replace("slave = 4, bit = 3", "slave = 4, bit = 8");
    let told = refused(&wiring, &layout);
    assert!(
        told.contains(
            "slave 4, \"GVT-1008\", has 8 bits of inputs; the machine file has the input `spare`"
        ),
        "{told}"
    );
    let wiring = WIRING.replace("slave = 5, bit = 6", "slave = 4, bit = 6");
    let told = refused(&wiring, &layout);
    assert!(told.contains("slave 4, \"GVT-1008\", has"), "{told}");
    let wiring = WIRING.replace("slave = 4, bit = 3", "slave = 9, bit = 3");
    let told = refused(&wiring, &layout);
    assert!(
        told.contains("there are 6 slaves on the bus; [drives.ethercat] names slave 9"),
        "{told}"
    );
}

const IDENTITIES: &str = "
[drives.ethercat.slaves]
0 = { vendor = 0xE402, product = 0x0402, serial = 1 }
2 = { vendor = 0xE402, product = 0x2262, revision = 1 }
3 = { vendor = 0xE402, product = 0x4001 }
";

#[test]
fn slaves_are_who_the_machine_file_says_or_it_is_told_who_answers() {
    assert_eq!(refused(IDENTITIES, &Layout::default()), "");
    let other = IDENTITIES.replace("revision = 1", "revision = 2");
    let told = refused(&other, &Layout::default());
    assert!(
        told.contains("slave 2 is \"GVT-2262\", vendor 0xe402, product 0x2262, revision 0x1"),
        "{told}"
    );
    assert!(told.contains("product 0x2262, revision 0x2 there"), "{told}");
    let terminals = vec![Kind::Analogue, Kind::Oversampled, Kind::Inputs];
    let told = refused(IDENTITIES, &Layout { terminals, seed: 1 });
    assert!(told.contains("slaves 2 and 3 have changed places"), "{told}");
    let missing =
        refused("[drives.ethercat.slaves]\n9 = { vendor = 1, product = 2 }", &Layout::default());
    assert!(missing.contains("names slave 9"), "{missing}");
}
