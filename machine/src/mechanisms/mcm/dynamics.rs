//! What the five motors of the mcm move. The source has no masses; this is a chain of rigid bodies:
//!
//! ```text
//!  frame ── X carriage ── Z slide ── yoke (turns r about the vertical) ── head (tilts a)
//!      └── table with workpiece (turns d about the vertical)
//! ```
//!
//! The carriage moves level, and the slide up and down on it. The yoke's centre of mass lies in its
//! turning axis, so its mass counts with the slide's; the head's lies on the beam, away from the
//! tilting axis, which meets the turning axis. The table turns by itself, so it shares no inertia
//! with the rest.

use messages::math;
use nalgebra::SMatrix;

use crate::kinematics::Joints;

/// Masses and inertias of the chain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct McmLoad {
    /// Mass that moves in X only [kg].
    pub carriage_mass: f64,
    /// Mass of slide and yoke, which move in X and Z [kg].
    pub slide_mass: f64,
    /// Inertia of table and workpiece about the table's axis [kg·m²].
    pub table_inertia: f64,
    /// Inertia of the yoke about its turning axis, the head apart [kg·m²].
    pub yoke_inertia: f64,
    /// Mass of the tilting head [kg].
    pub head_mass: f64,
    /// Distance of the head's centre of mass from the tilting axis, towards the focus [m].
    pub head_center: f64,
    /// Inertia of the head about its centre of mass [kg·m²]: about the tilting axis, across both,
    /// and about the beam.
    pub head_inertia: [f64; 3],
    /// Force on the slide that balances its weight, upwards [N].
    pub counterbalance: f64,
    /// Acceleration of gravity [m/s²].
    pub gravity: f64,
}

impl McmLoad {
    /// First and second moment of the head about the tilting axis [kg·m and kg·m²].
    fn moments(&self) -> (f64, f64) {
        let first = self.head_mass * self.head_center;
        (first, first * self.head_center)
    }

    /// `M = Σ m·J_vᵀ·J_v + J_ωᵀ·I·J_ω`. The head's centre moves at
    /// `(ȧ·b·cos a·sin r + ṙ·b·sin a·cos r, Ẋ + ȧ·b·cos a·cos r − ṙ·b·sin a·sin r, −Ż + ȧ·b·sin a)`
    /// and turns at `(ȧ, −ṙ·sin a, −ṙ·cos a)` in its own axes.
    pub(super) fn mass_matrix(&self, q: &Joints<5>) -> SMatrix<f64, 5, 5> {
        let (tilt_sine, tilt_cosine) = math::sin_cos(q[3]);
        let (turn_sine, turn_cosine) = math::sin_cos(q[4]);
        let (first, second) = self.moments();
        let [tilting, across, beam] = self.head_inertia;
        let lifted = self.slide_mass + self.head_mass;
        let mut mass = SMatrix::zeros();
        mass[(0, 0)] = self.carriage_mass + lifted;
        mass[(1, 1)] = lifted;
        mass[(2, 2)] = self.table_inertia;
        mass[(3, 3)] = tilting + second;
        mass[(4, 4)] = self.yoke_inertia
            + (across + second) * tilt_sine * tilt_sine
            + beam * tilt_cosine * tilt_cosine;
        for (row, column, coupling) in [
            (0, 3, first * tilt_cosine * turn_cosine),
            (0, 4, -first * tilt_sine * turn_sine),
            (1, 3, -first * tilt_sine),
        ] {
            mass[(row, column)] = coupling;
            mass[(column, row)] = coupling;
        }
        mass
    }

    /// Coriolis and centrifugal efforts, by Lagrange from [`Self::mass_matrix`] [N or N·m].
    pub(super) fn centrifugal(&self, q: &Joints<5>, velocity: &Joints<5>) -> Joints<5> {
        let (tilt_sine, tilt_cosine) = math::sin_cos(q[3]);
        let (turn_sine, turn_cosine) = math::sin_cos(q[4]);
        let (first, second) = self.moments();
        let [_, across, beam] = self.head_inertia;
        let (tilt, turn) = (velocity[3], velocity[4]);
        // Half of the change of the turn's inertia with the tilt.
        let slope = (across + second - beam) * tilt_sine * tilt_cosine;
        Joints::from([
            -first
                * (tilt_sine * turn_cosine * (tilt * tilt + turn * turn)
                    + 2.0 * tilt_cosine * turn_sine * tilt * turn),
            -first * tilt_cosine * tilt * tilt,
            0.0,
            -slope * turn * turn,
            2.0 * slope * tilt * turn,
        ])
    }

    /// Weight of slide and head; Z points down [N or N·m].
    pub(super) fn weight(&self, q: &Joints<5>) -> Joints<5> {
        let (first, _) = self.moments();
        let lifted = (self.slide_mass + self.head_mass) * self.gravity;
        let tilting = first * self.gravity * math::sin(q[3]);
        Joints::from([0.0, self.counterbalance - lifted, 0.0, tilting, 0.0])
    }
}
