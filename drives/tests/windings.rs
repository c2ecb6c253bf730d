//! Windings and rotors that turn each other faster than the usual substep follows.
#![allow(clippy::unwrap_used)]

mod shaft;

use drives::plant::{Plant, PlantError, PlantOptions};
use drives::{Actuation, Freshness, Measurement, Port};
use machine::{Friction, LaserSource};
use messages::{CommandMode, axis::actuator_array};
use shaft::Shaft;

/// Voltage [V].
const VOLTS: f64 = 6.0;

/// Inductance [H], torque constant [N·m/A] and inertia [kg·m²], beside 2.3 Ω.
#[derive(Debug, Clone, Copy)]
struct Values {
    inductance: f64,
    torque_constant: f64,
    inertia: f64,
}

fn plant(values: Values, substep: f64) -> Result<Plant<1, Shaft>, PlantError> {
    let mut actuator = shaft::actuator(values.inertia, Friction { coulomb: 0.0, viscous: 1e-7 });
    let motor = actuator.motor.dc_mut().unwrap();
    (motor.inductance, motor.torque_constant) = (values.inductance, values.torque_constant);
    let shaft = Shaft { load: 0.0, spread: 0.0 };
    let options = PlantOptions { substep, ..PlantOptions::default() };
    Plant::new(
        shaft,
        &[shaft::axis()],
        &[actuator],
        &LaserSource::IDEAL,
        &[0.0],
        messages::time::Period::OF_SETPOINTS,
        options,
    )
}

/// Angle and speed at the ends of 40 cycles, of which the voltage is on in the first 20.
fn course(values: Values, substep: f64) -> Vec<[f64; 2]> {
    let mut plant = plant(values, substep).unwrap();
    let mut measurement = Measurement::default();
    let driven = |volts: f64| Actuation {
        freshness: Freshness::Fresh,
        mode: CommandMode::Driven,
        voltage: actuator_array(&[volts]),
        ..Actuation::DISABLED
    };
    let mut ends = Vec::new();
    for cycle in 0..40 {
        plant.exchange(&driven(if cycle < 20 { VOLTS } else { 0.0 }), &mut measurement);
        ends.push([plant.state().angle[0], plant.state().speed[0]]);
    }
    ends
}

#[test]
fn a_rotor_too_light_for_the_usual_substep_agrees_with_a_fine_one() {
    let cases = [
        // A rotor of next to nothing: k/√(L·J) is 310,000 1/s, 15 in a substep of 50 µs.
        (Values { inductance: 46.1e-6, torque_constant: 0.021, inertia: 1e-10 }, 1e-5),
        // A winding that takes 0.2 s.
        (Values { inductance: 0.46, torque_constant: 0.021, inertia: 2e-6 }, 1e-9),
        // A torque motor on a light shaft.
        (Values { inductance: 20e-6, torque_constant: 0.5, inertia: 3e-6 }, 1e-4),
        // Windings that settle within a substep, a rotor that takes 5 µs and a usual one: a step of the
        // voltage is felt a sixth of a substep late.
        (Values { inductance: 2.3e-7, torque_constant: 0.021, inertia: 1e-9 }, 1e-4),
        (Values { inductance: 2.3e-6, torque_constant: 0.021, inertia: 2e-6 }, 1e-3),
    ];
    for (values, accuracy) in cases {
        let (found, exact) = (course(values, 50e-6), course(values, 1e-6));
        let largest = exact
            .iter()
            .fold([0.0_f64; 2], |most, end| [most[0].max(end[0].abs()), most[1].max(end[1].abs())]);
        assert!(largest[1] <= 2.0 * VOLTS / values.torque_constant, "{values:?}: {largest:?}");
        for (cycle, (found, exact)) in found.iter().zip(&exact).enumerate() {
            for index in 0..2 {
                let off = (found[index] - exact[index]).abs() / largest[index];
                assert!(off < accuracy, "{values:?}, cycle {cycle}: off by {off}");
            }
        }
    }
}

#[test]
fn what_no_substep_follows_is_refused_in_words_about_the_winding() {
    let values = Values { inductance: 1e-8, torque_constant: 3.0, inertia: 1e-12 };
    let refusal = plant(values, 50e-6).unwrap_err();
    assert!(matches!(refusal, PlantError::TooQuick { .. }), "{refusal:?}");
    assert!(
        refusal.to_string().starts_with("a winding and its rotor turn each other"),
        "{refusal}"
    );
    assert!(refusal.to_string().contains("`rotor_inertia`"), "{refusal}");
}
