//! Where motors and load are, and what the power stages do with the motors.

use machine::kinematics::Joints;
use nalgebra::SVector;

/// Where the plant is, with `N` joints and `A` motors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct State<const N: usize, const A: usize = N> {
    /// Motor currents [A].
    pub current: SVector<f64, A>,
    /// Motor angles [rad].
    pub angle: SVector<f64, A>,
    /// Motor speeds [rad/s].
    pub speed: SVector<f64, A>,
    /// Load side of the joints [m or rad].
    pub load: Joints<N>,
    /// Velocity of the load side [m/s or rad/s].
    pub load_speed: Joints<N>,
}

/// What the power stages do with the motors' phases.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Phases<const N: usize> {
    /// Open: no current. It dies within `L·i/V` of opening, under 1 ms, here at once.
    Open,
    /// Driven with these voltages [V].
    Driven(SVector<f64, N>),
}
