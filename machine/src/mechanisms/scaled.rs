//! A mechanism that is other than its file says: heavier or lighter, stiffer or softer.

use crate::transmission::Elasticity;

/// What has masses and springs.
pub(super) trait Scale {
    /// Makes all masses and inertias `mass` times as large, and all springs `stiffness` times as stiff, at
    /// the same damping ratio of a given load. What balances a weight stays as it is.
    fn scale(&mut self, mass: f64, stiffness: f64);
}

/// Multiplies all `values` by `factor`.
pub(super) fn all<'a>(values: impl IntoIterator<Item = &'a mut f64>, factor: f64) {
    values.into_iter().for_each(|value| *value *= factor);
}

/// Makes `springs` `factor` times as stiff.
pub(super) fn soften<const N: usize>(springs: &mut Option<[Elasticity; N]>, factor: f64) {
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
