//! Frequencies and shapes in which the load swings on its transmissions, without damping.

use core::f64::consts::TAU;

use nalgebra::{Cholesky, DMatrix, DVector, SymmetricEigen, Vector3};

use super::Place;
use super::principal::{MOST_TURNS, direction};

/// What the motors' rotors do meanwhile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rotors {
    /// They stand.
    Held,
    /// They swing freely; as many modes as there are axes have no frequency.
    Free,
}

/// One way in which the load swings.
#[derive(Debug, Clone, PartialEq)]
pub struct Mode {
    /// [Hz].
    pub frequency: f64,
    /// Amplitudes of the joints' load side [m or rad], such that the modal mass is 1 kg.
    pub joints: Vec<f64>,
    /// The direction in which the tool swings, of length 1; zero where it does not move.
    pub tool: Vector3<f64>,
}

impl Place {
    /// The modes, the lowest first; empty where the transmission is rigid.
    pub fn modes(&self, rotors: Rotors) -> Vec<Mode> {
        self.solve_modes(rotors).unwrap_or_default()
    }

    fn solve_modes(&self, rotors: Rotors) -> Option<Vec<Mode>> {
        let count = self.axes();
        let stiffness = self.stiffness.as_ref()?;
        let (mass, spring) = match rotors {
            Rotors::Held => (self.mass.clone(), stiffness.clone()),
            Rotors::Free => {
                let mut mass = DMatrix::zeros(2 * count, 2 * count);
                mass.view_mut((0, 0), (count, count)).copy_from(&self.mass);
                for (axis, motor) in self.motors.iter().enumerate() {
                    mass[(count + axis, count + axis)] = motor.inertia;
                }
                let mut spring = DMatrix::zeros(2 * count, 2 * count);
                for (row, column, sign) in
                    [(0, 0, 1.0), (0, count, -1.0), (count, 0, -1.0), (count, count, 1.0)]
                {
                    spring.view_mut((row, column), (count, count)).copy_from(&(stiffness * sign));
                }
                (mass, spring)
            }
        };
        // M = L·Lᵀ turns K·φ = ω²·M·φ into a symmetric problem in Lᵀ·φ.
        let lower = Cholesky::new(mass)?.l();
        let half = lower.solve_lower_triangular(&spring)?;
        let symmetric = lower.solve_lower_triangular(&half.transpose())?;
        let symmetric = (&symmetric + symmetric.transpose()) / 2.0;
        let eigen = SymmetricEigen::try_new(symmetric, f64::EPSILON, MOST_TURNS)?;
        let upper = lower.transpose();
        let mut modes = Vec::with_capacity(eigen.eigenvalues.len());
        for (square, shape) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            let shape = upper.solve_upper_triangular(&shape.into_owned())?;
            modes.push(self.mode(square.max(0.0).sqrt() / TAU, &shape.rows(0, count).into_owned()));
        }
        modes.sort_by(|one, other| one.frequency.total_cmp(&other.frequency));
        modes.iter().all(|mode| mode.frequency.is_finite()).then_some(modes)
    }

    fn mode(&self, frequency: f64, joints: &DVector<f64>) -> Mode {
        let tool = direction((&self.linear * joints).iter());
        let tool = tool.try_normalize(f64::MIN_POSITIVE).unwrap_or_default();
        Mode { frequency, joints: joints.iter().copied().collect(), tool }
    }
}
