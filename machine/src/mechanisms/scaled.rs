//! A mechanism that is other than its file says: heavier or lighter, stiffer or softer.

use super::{Cartesian, MechanismKind, Serial};
use crate::transmission::Elasticity;

impl MechanismKind {
    /// The same with all masses and inertias `mass` times as large, and all springs `stiffness` times as
    /// stiff, at the same damping ratio of a given load. What balances a weight stays as it is.
    #[must_use]
    pub fn scaled(&self, mass: f64, stiffness: f64) -> Self {
        let mut kind = self.clone();
        match &mut kind {
            Self::Cartesian(it) => scale_cartesian(it, mass, stiffness),
            Self::CartesianLift(it) => scale_cartesian(it, mass, stiffness),
            Self::CoreXy(it) => {
                scale(&mut it.mass, mass);
                soften(&mut it.elasticity, stiffness);
            }
            Self::Mcm(it) => {
                let load = &mut it.load;
                scale(&mut load.head_inertia, mass);
                for value in [
                    &mut load.carriage_mass,
                    &mut load.slide_mass,
                    &mut load.table_inertia,
                    &mut load.yoke_inertia,
                    &mut load.head_mass,
                ] {
                    *value *= mass;
                }
                soften(&mut it.elasticity, stiffness);
            }
            Self::Polar(it) => {
                let load = &mut it.load;
                for value in [
                    &mut load.arm_mass,
                    &mut load.arm_inertia,
                    &mut load.head_mass,
                    &mut load.head_inertia,
                    &mut load.table_inertia,
                    &mut load.workpiece_mass,
                    &mut load.workpiece_inertia,
                ] {
                    *value *= mass;
                }
                soften(&mut it.elasticity, stiffness);
            }
            Self::TriPlanar(it) => {
                scale(&mut it.platform_inertia, mass);
                for value in [&mut it.platform_mass, &mut it.leg_mass, &mut it.inductor_mass] {
                    *value *= mass;
                }
                soften(&mut it.elasticity, stiffness);
            }
            Self::FiveBar(it) => {
                for value in [
                    &mut it.proximal_mass,
                    &mut it.proximal_inertia,
                    &mut it.distal_mass,
                    &mut it.distal_inertia,
                    &mut it.tool_mass,
                    &mut it.bar_mass,
                ] {
                    *value *= mass;
                }
                soften(&mut it.elasticity, stiffness);
            }
            Self::Prrrp(it) => {
                for value in [
                    &mut it.link_mass,
                    &mut it.link_inertia,
                    &mut it.cart_mass,
                    &mut it.tool_mass,
                    &mut it.bar_mass,
                ] {
                    *value *= mass;
                }
                soften(&mut it.elasticity, stiffness);
            }
            Self::TwinActuator(it) => {
                it.tool_mass *= mass;
                for body in &mut it.bodies {
                    body.housing_inertia *= mass;
                    body.rod_mass *= mass;
                    body.rod_inertia *= mass;
                }
                soften(&mut it.elasticity, stiffness);
            }
            Self::Serial2(it) => scale_serial(it, mass, stiffness),
            Self::Serial3(it) => scale_serial(it, mass, stiffness),
            Self::Serial4(it) => scale_serial(it, mass, stiffness),
            Self::Serial5(it) => scale_serial(it, mass, stiffness),
            Self::Serial6(it) => scale_serial(it, mass, stiffness),
        }
        kind
    }
}

fn scale_cartesian<const N: usize>(it: &mut Cartesian<N>, mass: f64, stiffness: f64) {
    scale(&mut it.mass, mass);
    soften(&mut it.elasticity, stiffness);
}

fn scale_serial<const N: usize>(it: &mut Serial<N>, mass: f64, stiffness: f64) {
    for link in &mut it.links {
        link.mass *= mass;
        link.inertia *= mass;
    }
    soften(&mut it.elasticity, stiffness);
}

fn scale(values: &mut [f64], factor: f64) {
    values.iter_mut().for_each(|value| *value *= factor);
}

fn soften<const N: usize>(springs: &mut Option<[Elasticity; N]>, factor: f64) {
    for spring in springs.iter_mut().flatten() {
        spring.stiffness *= factor;
        spring.damping *= factor.sqrt();
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use crate::kinematics::Joints;
    use crate::{Machine, Mechanism, MechanismVisitor};

    /// Mass matrix at home, and the springs.
    struct Loads<'a>(&'a [f64]);

    impl MechanismVisitor for Loads<'_> {
        type Output = (Vec<f64>, Vec<f64>);

        fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
            let joints = Joints::<N>::from_fn(|axis, _| self.0[axis]);
            let chain = mechanism.solve(&joints, mechanism.branch(), None).unwrap();
            let springs = mechanism.stiffness().into_iter();
            let springs = springs.flat_map(|springs| springs.iter().copied().collect::<Vec<_>>());
            (mechanism.mass_matrix(&chain).iter().copied().collect(), springs.collect())
        }
    }

    #[test]
    fn every_mass_and_spring_of_every_mechanism_is_scaled() {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../machines");
        let mut count = 0;
        for file in std::fs::read_dir(folder).unwrap() {
            let path = file.unwrap().path();
            if path.extension().is_none_or(|extension| extension != "toml") {
                continue;
            }
            let machine = Machine::load(&path, &[]).unwrap();
            let loads = |kind: &crate::MechanismKind| kind.visit(Loads(&machine.home_joints));
            let (mass, springs) = loads(&machine.mechanism);
            let (heavy, stiff) = loads(&machine.mechanism.scaled(1.5, 4.0));
            let largest = mass.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
            for (one, other) in mass.iter().zip(&heavy) {
                assert!((1.5 * one - other).abs() < 1e-9 * largest, "{}", path.display());
            }
            for (one, other) in springs.iter().zip(&stiff) {
                assert!((4.0 * one - other).abs() <= 1e-9 * other.abs(), "{}", path.display());
            }
            count += 1;
        }
        assert!(count > 8, "{count} machines");
    }
}
