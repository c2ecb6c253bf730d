//! The choice from a catalogue, and the machine file that is written.

use super::{OPTIONS, close, letters, shipped, sized};
use machine::{Machine, Motor};
use workbench::catalogue::{BUILTIN, Catalogue};
use workbench::operating::{Demand, courses};
use workbench::size::report::SizeReport;
use workbench::size::{Gears, MachineFile, Options, checks, size};

/// Nine motors of one family: mass, torque constant and rotor grow, and one is the smallest that does it.
pub(crate) fn nine() -> Catalogue {
    let mut text = String::from("source = \"made for this\"\n");
    let motors = [
        (2.0, 0.01),
        (4.0, 0.05),
        (7.0, 0.2),
        (12.0, 0.8),
        (22.0, 2.0),
        (30.0, 6.0),
        (45.0, 30.0),
        (60.0, 140.0),
        (90.0, 900.0),
    ];
    for (index, (constant, inertia)) in motors.into_iter().enumerate() {
        let mass = 20 << index;
        text += &format!(
            "[[motor]]\nname = \"M{index}\"\nmass = \"{mass} g\"\n[motor.dc]\nvoltage = \"24 V\"\n\
             current = \"6 A\"\ncontinuous_current = \"2.5 A\"\nresistance = \"1 ohm\"\n\
             inductance = \"0.3 mH\"\ntorque_constant = \"{constant} mN m/A\"\n\
             rotor_inertia = \"{inertia} g cm^2\"\n",
        );
    }
    Catalogue::parse("nine.toml", &text).unwrap()
}

fn chosen(report: &SizeReport) -> Vec<String> {
    report.axes.iter().map(|axis| axis.chosen.as_ref().unwrap().motor.clone()).collect()
}

/// The job is done as the need said: planned with the motor that was chosen, it asks of it what was
/// computed without it.
#[test]
fn a_plan_with_the_chosen_motor_asks_of_it_what_was_computed() {
    for name in ["cartesian", "corexy"] {
        let (report, written) = sized(&shipped(name), &nine(), &OPTIONS);
        let machine = Machine::parse("new.toml", &written.unwrap(), &[]).unwrap();
        let plan = planner::plan(&machine, &letters(&machine)).unwrap();
        for (course, axis) in courses(&machine, &plan).iter().zip(&report.axes) {
            let planned = Demand::of(course);
            let computed = Demand::of(&axis.judged.as_ref().unwrap().course);
            let pairs = [
                ("torque", planned.torque_peak, computed.torque_peak),
                ("rms torque", planned.torque_rms, computed.torque_rms),
                ("speed", planned.speed_peak, computed.speed_peak),
                ("rms current", planned.current_rms, computed.current_rms),
                ("voltage", planned.voltage_peak, computed.voltage_peak),
                ("torque by efficiency", planned.by_efficiency_peak, computed.by_efficiency_peak),
            ];
            for (what, planned, computed) in pairs {
                println!("{name} {} {what}: {planned:.6} {computed:.6}", axis.axis);
                let off = planned / computed - 1.0;
                assert!(off.abs() < 0.01, "{name} {}: {what} {planned} {computed}", axis.axis);
            }
        }
    }
}

/// However wrong the motor is that a machine has, what its job needs is the same.
#[test]
fn a_motor_too_small_and_one_too_large_lead_to_the_same_right_one() {
    let catalogue = nine();
    let text = shipped("cartesian");
    // A rotor thirty times as heavy, and a motor of 6 mm.
    let large = text.replace("rotor_inertia = \"2e-6 kg m^2\"", "rotor_inertia = \"6e-5 kg m^2\"");
    let small = text
        .replace("torque_constant = \"0.021 N m/A\"", "torque_constant = \"0.004 N m/A\"")
        .replace("torque_constant = \"0.023 N m/A\"", "torque_constant = \"0.004 N m/A\"")
        .replace("rotor_inertia = \"2e-6 kg m^2\"", "rotor_inertia = \"5e-9 kg m^2\"")
        .replace("resistance = \"2.3 ohm\"", "resistance = \"30 ohm\"")
        .replace("resistance = \"2 ohm\"", "resistance = \"30 ohm\"");
    assert!(large != text && small != text && small != large);
    let of = |text: &str| {
        let (report, _) = sized(text, &catalogue, &OPTIONS);
        assert!(report.confirmation.as_ref().unwrap().is_right, "{:#?}", report.confirmation);
        report
    };
    let right = of(&text);
    println!("{:?}", chosen(&right));
    for wrong in [of(&large), of(&small)] {
        assert_eq!(chosen(&wrong), chosen(&right));
        // What the machine has does not do it, and it is said why.
        assert!(wrong.axes.iter().any(|axis| axis.now.uses.iter().any(|it| !it.holds())));
    }
    // Without the right one a larger one is chosen, or none.
    let without = |out: &dyn Fn(&str) -> bool| Catalogue {
        motors: catalogue.motors.iter().filter(|it| !out(&it.name)).cloned().collect(),
        ..Catalogue::default()
    };
    let names = chosen(&right);
    let (next, _) = sized(&text, &without(&|name| names.iter().any(|it| it == name)), &OPTIONS);
    for (axis, right) in next.axes.iter().zip(&names) {
        assert!(axis.chosen.as_ref().is_none_or(|chosen| chosen.motor > *right));
    }
    // The smallest does not do it: it is named with the limit that it breaks.
    let (none, written) = sized(&text, &without(&|name| name > "M0"), &OPTIONS);
    assert!(written.is_none() && none.confirmation.is_none() && !none.is_complete());
    assert!(none.axes.iter().all(|axis| axis.chosen.is_none() && axis.rejected.len() == 1));
    assert!(none.axes.iter().flat_map(|axis| &axis.rejected).all(|it| it.share > 1.0));
}

#[test]
fn ratio_and_motor_are_chosen_together() {
    let text = shipped("cartesian");
    let mass = |report: &SizeReport| -> f64 {
        report.axes.iter().map(|axis| axis.chosen.as_ref().unwrap().mass.unwrap()).sum()
    };
    let (kept, _) = sized(&text, &nine(), &OPTIONS);
    let (any, written) = sized(&text, &nine(), &Options { gears: Gears::Any, ..OPTIONS });
    // With any ratio to choose from, a motor as small at most does it.
    assert!(mass(&any) <= mass(&kept), "{} {}", mass(&any), mass(&kept));
    let ratio =
        |report: &SizeReport, axis: usize| report.axes[axis].chosen.as_ref().unwrap().gear_ratio;
    println!("{:?} with {} and {}", chosen(&any), ratio(&any, 0), ratio(&any, 1));
    assert!((0..2).any(|axis| ratio(&any, axis) != 3.0));
    let machine = Machine::parse("new.toml", &written.unwrap(), &[]).unwrap();
    let before = Machine::parse("old.toml", &text, &[]).unwrap();
    for (index, axis) in machine.actuators.iter().enumerate() {
        close(axis.ratio, 0.015 / core::f64::consts::TAU / ratio(&any, index));
        // The joint's friction is what it was.
        let old = &before.actuators[index];
        close(axis.friction.coulomb / axis.ratio, old.friction.coulomb / old.ratio);
        let square = |axis: &machine::Actuator| axis.friction.viscous / (axis.ratio * axis.ratio);
        close(square(axis), square(old));
    }
}

#[test]
fn the_file_that_is_written_keeps_its_comments_and_is_sized_to_itself() {
    let text = shipped("cartesian");
    let (report, written) = sized(&text, &nine(), &OPTIONS);
    let written = written.unwrap();
    for line in text.lines().filter(|line| line.trim_start().starts_with('#')) {
        assert!(written.contains(line), "lost: {line}");
    }
    assert!(written.contains("# turns of the motor per turn of the screw"));
    assert!(written.contains("# Source: made for this."));
    assert!(!written.contains("nominal_torque") && !written.contains("2.3 ohm"));
    let machine = Machine::parse("new.toml", &written, &[]).unwrap();
    for (axis, size) in machine.actuators.iter().zip(&report.axes) {
        let candidate = &size.judged.as_ref().unwrap().candidate;
        let (Motor::Dc(written), Motor::Dc(chosen)) = (&axis.motor, &candidate.motor) else {
            panic!("no DC motor")
        };
        for (written, chosen) in [
            (written.resistance, chosen.resistance),
            (written.inductance, chosen.inductance),
            (written.torque_constant, chosen.torque_constant),
            (written.rotor_inertia, chosen.rotor_inertia),
            (written.voltage, chosen.voltage),
            (written.current, chosen.current),
            (written.continuous_current.unwrap(), chosen.continuous_current.unwrap()),
        ] {
            assert!((written / chosen - 1.0).abs() < 1e-8, "{written} {chosen}");
        }
    }
    let (again, rewritten) = sized(&written, &nine(), &OPTIONS);
    assert_eq!(chosen(&again), chosen(&report));
    let again = Machine::parse("again.toml", &rewritten.unwrap(), &[]).unwrap();
    assert_eq!(again.axes, machine.axes);
}

#[test]
fn steppers_are_chosen_by_their_pull_out_torque() {
    let (_, text) = BUILTIN.into_iter().find(|(name, _)| *name == "steppers").unwrap();
    let catalogue = Catalogue::parse("steppers.toml", text).unwrap();
    let (report, written) = sized(&shipped("cartesian_steppers"), &catalogue, &OPTIONS);
    for axis in &report.axes {
        let chosen = axis.chosen.as_ref().unwrap();
        println!("{} {} {:?}", axis.axis, chosen.motor, checks::worst(&chosen.uses));
        assert!(chosen.uses.iter().any(|it| it.check == "pulse_rate"));
    }
    assert!(report.confirmation.unwrap().is_right);
    let machine = Machine::parse("new.toml", &written.unwrap(), &[]).unwrap();
    for (axis, size) in machine.actuators.iter().zip(&report.axes) {
        let candidate = &size.judged.as_ref().unwrap().candidate;
        let [written, chosen] =
            [&axis.motor, &candidate.motor].map(|motor| *motor.stepper().unwrap());
        for (written, chosen) in [
            (written.holding_torque, chosen.holding_torque),
            (written.rotor_inertia, chosen.rotor_inertia),
            (written.pulse_rate, chosen.pulse_rate),
            (written.current, chosen.current),
        ] {
            assert!((written / chosen - 1.0).abs() < 1e-8, "{written} {chosen}");
        }
    }
}

#[test]
fn a_catalogue_without_motors_of_the_machines_kind_is_told_of() {
    let (_, text) = BUILTIN.into_iter().find(|(name, _)| *name == "steppers").unwrap();
    let catalogue = Catalogue::parse("steppers.toml", text).unwrap();
    let text = shipped("cartesian");
    let machine = Machine::parse("it.toml", &text, &[]).unwrap();
    let file = MachineFile { name: "it.toml", text: &text, overrides: &[] };
    let job = letters(&machine);
    let (report, written) = size(file, &machine, &job, &catalogue, &OPTIONS).unwrap();
    assert!(written.is_none());
    for axis in &report.axes {
        assert_eq!((axis.kind, axis.candidates, axis.chosen.is_none()), ("DC motor", 0, true));
        assert!(axis.need.demand.torque_peak > 0.01);
    }
    let options = Options { axes: vec!["u".to_owned()], ..OPTIONS };
    let error = size(file, &machine, &job, &catalogue, &options).unwrap_err();
    assert!(error.to_string().contains("`u`") && error.to_string().contains("x, y"), "{error}");
}
