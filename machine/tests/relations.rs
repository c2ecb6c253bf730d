//! What two values of a machine file say of each other: a change of one that makes no sense beside
//! another is an error or a warning that names both, and where the other stands.

#![allow(clippy::unwrap_used)]

use machine::Machine;
use machine::document::Override;

fn file(name: &str) -> String {
    let path = format!("{}/../machines/{name}.toml", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(path).unwrap()
}

/// What is new in the warnings, or the errors, with these settings.
fn told(name: &str, settings: &[&str]) -> Vec<String> {
    let text = file(name);
    let before = Machine::parse(name, &text, &[]).unwrap().warnings;
    let overrides: Vec<Override> = settings.iter().map(|set| set.parse().unwrap()).collect();
    match Machine::parse(name, &text, &overrides) {
        Ok(machine) => {
            let new = machine.warnings.into_iter().filter(|warning| !before.contains(warning));
            new.map(|warning| warning.text).collect()
        }
        Err(error) => error.problems().map(machine::document::Problem::message).collect(),
    }
}

#[track_caller]
fn warned(name: &str, settings: &[&str], parts: &[&str]) {
    let told = told(name, settings);
    let all = |text: &&String| parts.iter().all(|part| text.contains(part));
    assert!(told.iter().any(|text| all(&text)), "{name} {settings:?}: {told:#?}");
}

#[track_caller]
fn sound(name: &str, settings: &[&str]) {
    assert_eq!(told(name, settings), [""; 0], "{name} {settings:?}");
}

#[test]
fn a_following_error_below_a_count_is_refused_and_one_of_a_few_counts_warned_of() {
    // A count of the belt is 10 mm / 8 turns: 1.917 µm.
    warned(
        "corexy",
        &["axis.a.limits.following_error=1.9 um"],
        &["1.900e-6 m stops the machine", "one count of the encoder is 1.917e-6 m (line 59)"],
    );
    warned(
        "corexy",
        &["axis.a.limits.following_error=7 um"],
        &["less than 4 times the count of the encoder of 1.917e-6 m", "noise of the encoder"],
    );
    // 62.5 µm of travel in 3200 pulses.
    warned(
        "cartesian_steppers",
        &["axis.y.limits.following_error=1 um"],
        &["one pulse is 1.563e-6 m"],
    );
}

#[test]
fn a_following_error_below_what_a_jerk_changes_is_warned_of() {
    // The head of 1.06 kg on 60 N/mm: (500 m/s³ · √2 · 2) · 1 ms · (1.06 / 60e3) s² / 0.25 = 100 µm.
    warned(
        "corexy",
        &["axis.a.limits.following_error=50 um"],
        &["below 9.994e-5 m", "the jerk of 500 m/s³ (line 22)"],
    );
    sound("corexy", &["axis.a.limits.following_error=0.11 mm"]);
}

/// A rotor behind its field gives way as a load behind a spring does.
#[test]
fn a_rotor_that_its_field_hardly_moves_is_warned_of() {
    // 6.4e-3 kg·m² on 6 N·m/rad, at 2 · 5000 m/s³ · some 2 rad/m.
    warned(
        "galvo",
        &["axis.m1.motor.stepper.rotor_inertia=6.4e-3 kg m^2"],
        &["a following error of 2.000e-3 rad stops the machine", "takes for a jump below"],
    );
    sound("galvo", &["axis.m1.motor.stepper.rotor_inertia=6.4e-6 kg m^2"]);
}

#[test]
fn an_encoder_coarser_than_the_tolerance_is_warned_of() {
    warned(
        "corexy",
        &["path.tolerance=1 um"],
        &["one count of the encoder moves the tool by 1.356 µm", "tolerance is 1.000 µm"],
    );
    warned("polar", &["axis.th2.encoder.resolution=400 counts/rev"], &["tolerance is 5.000 µm"]);
    sound("corexy", &["path.tolerance=2 um"]);
}

#[test]
fn a_gear_that_is_off_shows_in_speed_or_in_the_load_that_the_rotor_feels() {
    for gear in ["0.8", "80"] {
        let told = told("corexy", &[&format!("axis.a.gear={gear}")]);
        assert!(!told.is_empty(), "a gear of {gear} passed");
    }
    warned("corexy", &["axis.a.gear=0.8"], &["times the motor's 2.000e-6 kg·m² (line 50)"]);
    warned("polar", &["axis.th1.gear=5000"], &["the motor reaches 0.1600 rad/s without load"]);
    warned("five_bar", &["axis.th1.gear=25000"], &["near home a path at 0.25 m/s may ask it for"]);
}

#[test]
fn a_lead_longer_than_the_travel_is_warned_of() {
    warned(
        "cartesian",
        &["mechanism.cartesian.y.lead=300 mm/rev"],
        &["one turn of the gear's output moves the joint by 0.3000 m", "whole travel is 0.2020 m"],
    );
}

#[test]
fn time_constants_of_motors_give_a_warning_where_no_motor_has_them() {
    let winding = "windings have 2e-5 to 0.2 s";
    warned("corexy", &["axis.a.motor.dc.inductance=2.3 uH"], &["1.000e-6 s", winding, "line 47"]);
    warned("corexy", &["axis.a.motor.dc.inductance=0.9 H"], &[winding, "line 47"]);
    warned("corexy", &["axis.a.motor.dc.torque_constant=0.5 mN m/A"], &["motors have 5e-5 to 2 s"]);
    // Behind its belt the rotor swings alone, whatever the load makes of the whole: 5.2 µs.
    warned(
        "corexy",
        &["axis.a.motor.dc.rotor_inertia=1e-9 kg m^2"],
        &["turn 1.000e-9 kg·m² with a time constant of 5.215e-6 s"],
    );
}

#[test]
fn a_load_softer_than_the_loops_is_warned_of() {
    // √(60 kN/m / 3 kg) = 141 rad/s, and the velocity loop has 160.
    warned(
        "corexy",
        &["mechanism.corexy.mass_y=3 kg"],
        &["a bandwidth of 160.0 rad/s", "resonates at 141.4 rad/s"],
    );
    sound("corexy", &["mechanism.corexy.mass_y=2 kg"]);
}

#[test]
fn a_position_loop_near_its_velocity_loop_is_warned_of() {
    let parts = ["a bandwidth of 120.0 rad/s", "160.0 rad/s (line 67)", "swing together"];
    warned("corexy", &["axis.a.loops.position=120 1/s"], &parts);
    sound("corexy", &["axis.a.loops.position=60 1/s"]);
}

#[test]
fn loops_that_axes_make_faster_for_each_other_are_warned_of() {
    // The bar of a five-bar moves only where both arms do.
    warned(
        "five_bar",
        &["mechanism.five_bar.bar_mass=18.6 kg"],
        &["the axes move each other's load"],
    );
    sound("five_bar", &["mechanism.five_bar.bar_mass=0.4 kg"]);
}

#[test]
fn an_axis_that_sinks_without_power_is_warned_of() {
    warned(
        "mcm",
        &["mechanism.mcm.counterbalance=5 N"],
        &["it sinks while the motor is unpowered"],
    );
    warned("serial", &["axis.j3.friction.brake=0 N m"], &["it sinks while the motor is unpowered"]);
    warned(
        "mcm",
        &["mechanism.mcm.counterbalance=18 N"],
        &["it sinks while the motor is unpowered"],
    );
    sound("mcm", &["mechanism.mcm.counterbalance=18 N", "axis.Z.friction.brake=0.1 N m"]);
}

#[test]
fn a_weight_that_a_motor_takes_over_from_a_brake_is_nothing_to_warn_of() {
    // 7.8 mN·m on the shaft, of which friction holds 4: the motor bears all of it before the brake opens.
    sound("serial", &["path.tolerance=3 um"]);
}

#[test]
fn friction_that_takes_much_of_the_motor_or_of_the_path_is_warned_of() {
    warned("corexy", &["axis.a.friction.coulomb=50 mN m"], &["friction takes 5.000e-2 N·m of the"]);
    warned("corexy", &["axis.a.friction.coulomb=20 mN m"], &["pushes the tool off its path by"]);
    sound("corexy", &["axis.a.friction.coulomb=6 mN m"]);
}

#[test]
fn a_stepper_whose_teeth_are_stronger_than_its_field_is_refused() {
    let detent = "axis.x.motor.stepper.detent_torque";
    warned("cartesian_steppers", &[&format!("{detent}=0.4 N m")], &["the motor could not turn"]);
    warned("cartesian_steppers", &[&format!("{detent}=0.2 N m")], &["50 % of the holding torque"]);
    sound("cartesian_steppers", &[&format!("{detent}=40 mN m")]);
}

#[test]
fn a_stepper_that_friction_holds_off_its_pulses_is_warned_of() {
    // 0.03 mN·m against 3 mN·m · 200/rad are 50 µrad, and the beam turns by twice as much: 25 µm at 250 mm.
    warned(
        "galvo",
        &["axis.m1.motor.stepper.holding_torque=3 mN m"],
        &[
            "axis `m1`",
            "off its pulses by 5.000e-5 rad",
            "by 24.997 µm",
            "tolerance is 10.000 µm (line 24)",
        ],
    );
    sound("galvo", &["axis.m1.motor.stepper.holding_torque=9 mN m"]);
    warned(
        "cartesian_steppers",
        &["axis.x.friction.coulomb=0.1 N m", "path.tolerance=1 um"],
        &["axis `x`", "off its pulses"],
    );
}
