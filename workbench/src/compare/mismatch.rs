//! Plants that are other than the machine file says, as machines are: drawn by a seed.

use machine::{Machine, Motor};
use messages::random::SplitMix64;

/// By how much each value is off at most. Our own choice: what builders know of their machines without
/// having measured them.
mod spread {
    /// Friction, which nobody knows.
    pub(super) const FRICTION: f64 = 0.5;
    /// Masses and inertias of the load, all together.
    pub(super) const LOAD: f64 = 0.2;
    /// Each rotor's inertia.
    pub(super) const ROTOR: f64 = 0.1;
    /// Each motor's torque per current, or its holding torque.
    pub(super) const TORQUE: f64 = 0.05;
    /// Each winding's resistance, mostly by its temperature.
    pub(super) const RESISTANCE: f64 = 0.2;
    /// Stiffness of the transmission, all together.
    pub(super) const STIFFNESS: f64 = 0.2;
}

/// The plant that `seed` draws around `plant`, the same on every computer.
pub fn mismatched(plant: &Machine, seed: u64) -> Machine {
    let mut random = SplitMix64::new(seed);
    let mut factor = |spread: f64| random.between(1.0 - spread, 1.0 + spread);
    let mut plant = plant.clone();
    let (load, stiffness) = (factor(spread::LOAD), factor(spread::STIFFNESS));
    plant.mechanism = plant.mechanism.scaled(load, stiffness);
    for actuator in &mut plant.actuators {
        actuator.friction.coulomb *= factor(spread::FRICTION);
        actuator.friction.viscous *= factor(spread::FRICTION);
        let [rotor, torque, resistance] =
            [factor(spread::ROTOR), factor(spread::TORQUE), factor(spread::RESISTANCE)];
        match &mut actuator.motor {
            Motor::Dc(motor) => {
                motor.rotor_inertia *= rotor;
                motor.torque_constant *= torque;
                motor.resistance *= resistance;
            }
            Motor::Stepper(motor) => {
                motor.rotor_inertia *= rotor;
                motor.holding_torque *= torque;
                motor.resistance *= resistance;
            }
        }
    }
    plant
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_seed_always_draws_the_same_plant_within_its_spread() {
        let machine = Machine::builtin();
        assert_eq!(mismatched(&machine, 3), mismatched(&machine, 3));
        assert_ne!(mismatched(&machine, 3), mismatched(&machine, 4));
        for seed in 0..200 {
            let plant = mismatched(&machine, seed);
            for (actuator, own) in plant.actuators.iter().zip(&machine.actuators) {
                let within = |found: f64, nominal: f64, spread: f64| {
                    assert!((found / nominal - 1.0).abs() <= spread, "{seed}: {found} {nominal}");
                };
                within(actuator.friction.coulomb, own.friction.coulomb, 0.5);
                let [motor, nominal] = [actuator, own].map(|it| it.motor.dc().copied());
                let (Some(motor), Some(nominal)) = (motor, nominal) else { panic!() };
                within(motor.torque_constant, nominal.torque_constant, 0.05);
                within(motor.resistance, nominal.resistance, 0.2);
                within(motor.rotor_inertia, nominal.rotor_inertia, 0.1);
            }
        }
    }
}
