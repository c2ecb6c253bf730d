//! Every number of one operating point, by hand.

use super::{OPTIONS, close, letters, shipped};
use machine::Machine;
use workbench::catalogue::Catalogue;
use workbench::size::MachineFile;
use workbench::size::candidate::{Candidate, GearChoice};
use workbench::size::checks::{self, Use};
use workbench::size::need::{self, AxisNeed, NeedPoint};

/// A motor with its gear, and a belt.
pub(crate) const ONE: &str = r#"
    source = "a hand"
    [[motor]]
    name = "M"
    mass = "480 g"
    max_speed = "6000 rpm"
    no_load_current = "0.1 A"
    thermal = { winding_housing = 1.93, housing_ambient = 4.65, max_winding = 155 }
    [motor.dc]
    voltage = "24 V"
    current = "8 A"
    continuous_current = "3 A"
    resistance = "0.5 ohm"
    inductance = "0.1 mH"
    torque_constant = "30 mN m/A"
    rotor_inertia = "1e-5 kg m^2"
    [[gear]]
    name = "G"
    ratio = 5
    efficiency = 0.75
    max_torque = "2 N m"
    continuous_torque = "1 N m"
    inertia = "2e-6 kg m^2"
    mass = "200 g"
    max_input_speed = "5000 rpm"
    radial_load = "50 N"
    axial_load = "20 N"
    [[belt]]
    axis = "a"
    breaking_force = "300 N"
    friction = 0.3
    wrap = "180 deg"
"#;

/// Two cycles in which the first belt of the CoreXY goes on evenly: along the diagonal with 10 m/s² at
/// 0.2 m/s, where it moves (0.33 + 1.06)/4 kg and is √2 times as fast.
fn diagonal() -> AxisNeed {
    let text = shipped("corexy");
    let file = MachineFile { name: "it.toml", text: &text, overrides: &[] };
    let machine = Machine::parse("it.toml", &text, &[]).unwrap();
    let table = need::table(file).unwrap();
    let (_, mut needs) = need::needs(&machine, &table, &letters(&machine)).unwrap();
    let point = NeedPoint {
        speed: 0.2 * 2_f64.sqrt(),
        acceleration: 10.0 * 2_f64.sqrt(),
        effort: (0.33 + 1.06) / 4.0 * 10.0 * 2_f64.sqrt(),
        ..NeedPoint::default()
    };
    AxisNeed { points: vec![point, NeedPoint { time: 1e-3, ..point }], ..needs.swap_remove(0) }
}

fn the<'a>(uses: &'a [Use], check: &str) -> &'a Use {
    uses.iter().find(|it| it.check == check).unwrap_or_else(|| panic!("no check {check}"))
}

#[test]
fn the_present_motor_needs_what_a_hand_computes() {
    let need = diagonal();
    close(need.travel, 0.01);
    close(need.load, 0.347_5);
    let present = Candidate::present(&need);
    let course = present.course(&need);
    let point = course.points[1];
    close(point.speed, 226.274);
    close(point.acceleration, 11_313.7);
    close(point.load, 6.143_0e-3);
    close(point.rotor, 22.627_4e-3);
    close(point.friction, 5.226_27e-3);
    close(point.torque(), 33.996_7e-3);
    close(point.by_efficiency, 30.306_1e-3);
    close(point.current, 1.618_89);
    close(point.voltage, 2.3 * 1.618_89 + 0.021 * 226.274);
    close(point.power(), 7.692_6);
    close(point.supplied, point.voltage * 1.618_89);
    let uses = checks::uses(&present, &need, &course, &Catalogue::default(), &OPTIONS);
    close(the(&uses, "torque").share, 33.996_7e-3 * 1.25 / (0.021 * 5.2));
    close(the(&uses, "voltage").share, 8.475_2 * 1.25 / (0.99 * 12.0));
    close(the(&uses, "speed").share, 226.274 * 1.25 / (12.0 / 0.021));
    close(the(&uses, "inertia").value, 1.25e-3 * 1.25e-3 * 0.347_5 / 2e-6);
}

/// The same motion with another motor and another gear.
#[test]
fn another_motor_and_gear_need_what_a_hand_computes() {
    let need = diagonal();
    let catalogue = Catalogue::parse("one.toml", ONE).unwrap();
    let gear = GearChoice::Of(&catalogue.gears[0]);
    let candidate = Candidate::new(&need, &catalogue.motors[0], gear);
    // A radius of 10 mm behind a gear of 5.
    close(candidate.ratio, 2e-3);
    close(candidate.mass.unwrap(), 0.68);
    let course = candidate.course(&need);
    let point = course.points[1];
    let (speed, acceleration) = (141.421, 7_071.07);
    close(point.speed, speed);
    let rotor = 1.2e-5 * acceleration;
    close(point.rotor, rotor);
    let load = 2e-3 * 4.914_39;
    close(point.load, load);
    // Friction is the joint's: the shaft feels 2/1.25 of it, and of its growth with speed the square.
    let friction = 5e-3 * 1.6 + 1e-6 * 1.6 * 1.6 * speed;
    close(point.friction, friction);
    // The gear alone loses more than the 0.8 of the machine file; the motor itself takes 0.1 A·30 mN·m/A.
    let by_efficiency = rotor + load / 0.75 + 3e-3;
    close(point.by_efficiency, by_efficiency);
    let torque = rotor + load + friction;
    close(point.torque(), torque);
    let larger = torque.max(by_efficiency);
    let uses = checks::uses(&candidate, &need, &course, &catalogue, &OPTIONS);
    close(the(&uses, "torque").share, larger * 1.25 / 0.24);
    // Slower than the 6000 rpm of the motor: the gear's 5000 rpm, 523.6 rad/s.
    close(the(&uses, "speed").share, speed * 1.25 / 523.599);
    let current = larger / 0.03;
    close(the(&uses, "heating").share, current * 1.25 / 3.0);
    // The winding warms by 6.58 K/W·0.5 Ω·(1.25·I)², the more for its growing resistance.
    let rise = 6.58 * 0.5 * (1.25 * current) * (1.25 * current);
    let warm = (25.0 + rise * (1.0 - 0.00393 * 25.0)) / (1.0 - 0.00393 * rise);
    close(the(&uses, "temperature").share, (warm - 25.0) / 130.0);
    let resistance = 0.5 * (1.0 + 0.00393 * (warm - 25.0));
    close(the(&uses, "voltage").value, resistance * current + 0.03 * speed);
    close(the(&uses, "inertia").value, 2e-3 * 2e-3 * 0.347_5 / 1.2e-5);
    // 49.1 mN·m at the gear's output; a load of 0.116 rotors is uniform.
    let output = 0.01 * 4.914_39;
    close(the(&uses, "gear_torque").share, output * 1.25 / 2.0);
    close(the(&uses, "gear_heating").share, output * 1.25);
    // F_R = 2000·M·k_r/d with d = 20 mm; F_A = 0.2·F_R.
    let radial = 2000.0 * output * 1.1 / 20.0;
    close(the(&uses, "gear_radial").value, radial);
    close(the(&uses, "gear_axial").value, 0.2 * radial);
    close(the(&uses, "belt_strength").share, 2.5 * 4.914_39 * 1.25 / 300.0);
    close(the(&uses, "belt_grip").share, 0.510_826 / (0.3 * core::f64::consts::PI));
}
