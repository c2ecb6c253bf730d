//! What moves a joint: motor, encoder, transmission ratio, and the gains of its cascade.

use crate::limits::AxisLimits;
use crate::motor::Motor;
use crate::transmission::gear::Efficiency;

/// Friction at the motor shaft.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Friction {
    /// Coulomb friction torque, the same at rest and in motion [N·m].
    pub coulomb: f64,
    /// Viscous friction [N·m·s/rad].
    pub viscous: f64,
}

impl Friction {
    /// Speed below which a motor counts as standing [rad/s]: less than a count of any usual encoder
    /// in a minute. However slowly it creeps above that, friction is against it.
    pub const STANDING: f64 = 1e-6;

    /// What a motor that turns at `speed` [rad/s] must give to overcome it [N·m], with the sign of
    /// the speed; 0 of one that stands, whose Coulomb friction takes no side.
    pub fn torque(&self, speed: f64) -> f64 {
        let side = if Self::is_standing(speed) { 0.0 } else { speed.signum() };
        self.coulomb * side + self.viscous * speed
    }

    /// Whether a motor at `speed` [rad/s] counts as standing.
    pub fn is_standing(speed: f64) -> bool {
        speed.abs() < Self::STANDING
    }
}

/// A brake that is closed while its motor is unpowered, or magnets that clamp a planar motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HoldingBrake {
    /// Torque with which it holds the shaft, 0 where there is none [N·m].
    pub torque: f64,
    /// From the power to the open brake [s]: until then it holds.
    pub release: f64,
}

/// What a motor's position is counted in: the counts of an incremental encoder on its shaft, or the
/// pulses sent to a stepper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Encoder {
    /// Counts per revolution of the motor, all edges counted, or pulses per revolution.
    pub counts: f64,
}

/// Gains of the position/velocity/current cascade.
///
/// Taken from motor and load data unless the machine file overrides a bandwidth. A stepper has no
/// cascade: its bandwidths are 0.
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

/// What a joint is measured in. Its number is the form of a quantity of a joint's travel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum JointUnit {
    /// [m].
    Length = 0,
    /// [rad].
    Angle = 1,
}

impl JointUnit {
    /// The symbol of the joint's position.
    pub fn name(self) -> &'static str {
        self.names()[0]
    }

    /// The symbols of the joint's position and its first three derivatives by time.
    pub fn names(self) -> [&'static str; 4] {
        match self {
            Self::Length => ["m", "m/s", "m/s²", "m/s³"],
            Self::Angle => ["rad", "rad/s", "rad/s²", "rad/s³"],
        }
    }
}

/// One actuated axis, in the order of the joints of the mechanism.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// The name in the machine file.
    pub name: String,
    /// What its joint is measured in.
    pub unit: JointUnit,
    /// Joint units moved per radian of the motor, gear and screw or pulley included; positive
    /// [m/rad or rad/rad].
    pub ratio: f64,
    /// How far the joint moves freely while the motor stands, from stop to stop [m or rad].
    pub backlash: f64,
    /// What of the motor's torque reaches the joint.
    ///
    /// For sizing only. In motion the losses are [`Friction`], for the plant and for the
    /// feedforward alike; counting them here as well would count them twice.
    pub efficiency: Efficiency,
    /// The motor.
    pub motor: Motor,
    /// Friction at its shaft.
    pub friction: Friction,
    /// What holds its shaft while it is unpowered.
    pub brake: HoldingBrake,
    /// Its encoder, or the pulses that take its place.
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

#[cfg(test)]
mod tests {
    use super::Friction;

    #[test]
    fn friction_is_with_the_speed_and_takes_no_side_at_rest() {
        let friction = Friction { coulomb: 0.01, viscous: 2e-5 };
        assert_eq!(friction.torque(0.0), 0.0);
        assert!((friction.torque(100.0) - 0.012).abs() < 1e-15);
        assert_eq!(friction.torque(-100.0), -friction.torque(100.0));
        // A creeping motor has all of the Coulomb friction against it.
        let creep = 2.0 * Friction::STANDING;
        assert!((friction.torque(creep) - 0.01).abs() < 1e-9);
        assert!(friction.torque(Friction::STANDING / 2.0).abs() < 1e-9);
    }
}
