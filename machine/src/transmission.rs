//! What stands between a motor and its joint: springs, backlash, gears.
//!
//! A screw, a belt, a gear, an arm that bends and a planar stepper differ in how stiff they are and
//! in what their data sheets print; seen from the joint each is a spring and a damper
//! ([`Elasticity`]) behind some [`backlash`]. Here stand the formulas that lead there:
//! [`screw`], [`belt`], [`gear`], [`link`] and, with the mass of its own, [`beam`]. A planar stepper has none: its field pulls the rotor
//! across the gap, with the stiffness of [`crate::StepperMotor`].

pub mod backlash;
pub mod beam;
pub mod belt;
pub mod equilibrium;
pub mod gear;
pub mod link;
pub mod screw;

use nalgebra::{SMatrix, SVector};

/// A linear spring and damper, both in translation, or both in torsion where the joint turns.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elasticity {
    /// [N/m or N·m/rad].
    pub stiffness: f64,
    /// [N·s/m or N·m·s/rad].
    pub damping: f64,
}

impl Elasticity {
    /// A spring of `stiffness` [N/m or N·m/rad] under `mass` [kg or kg·m²], damped by the share
    /// `damping_ratio` of critical damping.
    ///
    /// Source 003 eq. 3.31, `β = 2·ζ·√(K·I)`, seen at the joint: with `K` and `I` both divided by
    /// the square of the ratio the same formula holds.
    pub fn damped(stiffness: f64, mass: f64, damping_ratio: f64) -> Self {
        Self { stiffness, damping: 2.0 * damping_ratio * (stiffness * mass).sqrt() }
    }
}

/// The stiffness of joints with a spring each, in joint coordinates [N/m or N·m/rad]: diagonal, `N`
/// by `N`; `None` where they are rigid.
pub fn stiffness<const N: usize>(springs: Option<[Elasticity; N]>) -> Option<SMatrix<f64, N, N>> {
    springs.map(|springs| diagonal(springs.map(|spring| spring.stiffness)))
}

/// The damping of joints with a damper each, in joint coordinates [N·s/m or N·m·s/rad]: diagonal, `N`
/// by `N`; zero where they are rigid.
pub fn damping<const N: usize>(springs: Option<[Elasticity; N]>) -> SMatrix<f64, N, N> {
    springs.map_or_else(SMatrix::zeros, |springs| diagonal(springs.map(|spring| spring.damping)))
}

fn diagonal<const N: usize>(values: [f64; N]) -> SMatrix<f64, N, N> {
    SMatrix::from_diagonal(&SVector::from(values))
}

/// The stiffness of springs in a row, all seen at the same place and in the same unit.
///
/// Source 003 eq. 3.30, where they are said to be in parallel.
pub fn in_series(stiffnesses: impl IntoIterator<Item = f64>) -> f64 {
    1.0 / stiffnesses.into_iter().map(|stiffness| 1.0 / stiffness).sum::<f64>()
}
