//! What moves a joint: motor, encoder, transmission ratio, and the gains of its cascade.

use crate::limits::AxisLimits;

/// A permanent-magnet DC motor (source 003 sec. 3.3): `V = R·i + L·i′ + k·ω`, torque `k·i`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DcMotor {
    /// Winding resistance [Ω].
    pub resistance: f64,
    /// Winding inductance [H].
    pub inductance: f64,
    /// Torque constant [N·m/A], equal to the back-EMF constant [V·s/rad].
    pub torque_constant: f64,
    /// Inertia at the shaft on the motor's side of the transmission's spring [kg·m²]: the rotor,
    /// and what turns with it stiffly, such as a screw through its gear (`J_screw/i²`).
    pub rotor_inertia: f64,
    /// Largest voltage that the supply can apply [V].
    pub voltage: f64,
    /// Largest current that the power stage may command [A].
    pub current: f64,
    /// Current that the winding bears for ever [A]; `None` where the file does not say.
    pub continuous_current: Option<f64>,
}

/// Friction at the motor shaft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Friction {
    /// Coulomb friction torque, the same at rest and in motion [N·m].
    pub coulomb: f64,
    /// Viscous friction [N·m·s/rad].
    pub viscous: f64,
}

/// An incremental encoder on the motor shaft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Encoder {
    /// Counts per revolution of the motor, all edges counted.
    pub counts: f64,
}

/// Gains of the position/velocity/current cascade.
///
/// Taken from motor and load data unless the machine file overrides a bandwidth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopGains {
    /// Bandwidth of the position loop [1/s].
    pub position: f64,
    /// Bandwidth of the velocity loop, ω_v [rad/s].
    pub velocity: f64,
    /// Bandwidth of the current loop, ω_c [rad/s].
    pub current: f64,
    /// Inertia that the velocity loop moves: rotor and load seen at the shaft [kg·m²].
    pub inertia: f64,
}

/// One actuated axis, in the order of the joints of the mechanism.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// The name in the machine file.
    pub name: String,
    /// Joint units moved per radian of the motor, gear and screw or pulley included; positive
    /// [m/rad or rad/rad].
    pub ratio: f64,
    /// Share of the motor's torque that reaches the joint when it drives, above 0 and up to 1.
    ///
    /// For sizing only. In motion the losses are [`Friction`], for the plant and for the
    /// feedforward alike; counting them here as well would count them twice.
    pub efficiency: f64,
    /// The motor.
    pub motor: DcMotor,
    /// Friction at its shaft.
    pub friction: Friction,
    /// Its encoder.
    pub encoder: Encoder,
    /// Gains of its cascade.
    pub gains: LoopGains,
    /// Its limits.
    pub limits: AxisLimits,
}

impl Encoder {
    /// Angle of one count [rad].
    pub fn resolution(&self) -> f64 {
        core::f64::consts::TAU / self.counts
    }
}
