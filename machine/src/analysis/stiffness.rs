//! How far a force at the tool moves it: transmissions and, if asked for, the loops of the motors.

use nalgebra::{Cholesky, DMatrix};

use super::principal::principal_axes;
use super::{Place, Principal};

/// What holds the motors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hold {
    /// Their shafts stand.
    Clamped,
    /// The proportional parts of their loops, or a stepper's field. What an integral part does takes
    /// longer than a push.
    Loops,
}

impl Place {
    /// Compliance of the tool against forces [m/N], 2 or 3 rows: `J·K⁻¹·Jᵀ`; `None` where the
    /// transmission is rigid and nothing else yields.
    pub fn tool_compliance(&self, hold: Hold) -> Option<DMatrix<f64>> {
        let springs = match &self.stiffness {
            Some(stiffness) => Some(Cholesky::new(stiffness.clone())?.inverse()),
            None => None,
        };
        let yielding = match hold {
            Hold::Clamped => springs?,
            Hold::Loops => {
                let count = self.axes();
                let mut yielding = springs.unwrap_or_else(|| DMatrix::zeros(count, count));
                for (axis, motor) in self.motors.iter().enumerate() {
                    yielding[(axis, axis)] += 1.0 / motor.hold;
                }
                yielding
            }
        };
        Some(&self.linear * yielding * self.linear.transpose())
    }

    /// Principal stiffnesses of the tool against forces [N/m], the least first; `None` where it is rigid
    /// in one direction.
    pub fn tool_stiffness(&self, hold: Hold) -> Option<Vec<Principal>> {
        let compliance = principal_axes(self.tool_compliance(hold)?)?;
        let most = compliance.first()?.value;
        // Rounding of the product: below it a direction does not yield.
        let yields = |axis: &Principal| axis.value > 1e-12 * most;
        let stiff = |axis: &Principal| Principal { value: 1.0 / axis.value, ..*axis };
        compliance.iter().all(yields).then(|| compliance.iter().map(stiff).collect())
    }
}
