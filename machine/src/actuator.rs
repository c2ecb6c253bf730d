//! What moves an axis: motor, encoder, transmission ratio, and the gains of its cascade.

use crate::drives::ActuatorMode;
use crate::motor::Motor;
use crate::transmission::gear::Efficiency;
use messages::Nanoseconds;

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

/// One motor with what stands between it and its joint. An axis has one or several, in the order of the
/// machine file.
#[derive(Debug, Clone, PartialEq)]
pub struct Actuator {
    /// The name of its axis, and of several on one axis its own behind a dot: `x`, `y.left`.
    pub name: String,
    /// Index of the axis that it drives.
    pub axis: usize,
    /// Joint units moved per radian of the motor, gear and screw or pulley included; negative where the
    /// motor is mounted the other way round, never 0 [m/rad or rad/rad].
    pub ratio: f64,
    /// Share of the axis' transmission that is its own, of its stiffness and damping and so of every
    /// effort: what its motor gives at standstill of what all motors of the axis give. They add up to 1.
    pub share: f64,
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
    /// Which target its drive follows.
    pub mode: ActuatorMode,
    /// From the deadline at which a target is sent until the motor follows it [ns].
    pub latency: Nanoseconds,
    /// From when a target acts until the drive's own current loop gives the torque that it asks for [ns].
    pub torque_delay: Nanoseconds,
    /// How long before a deadline its place was measured that is told then [ns].
    pub age: Nanoseconds,
    /// How far it stands beyond its place where its home reference is, in joint units [m or rad]: what
    /// enabling takes back. 0 where the reference is square.
    pub square: f64,
}

impl Actuator {
    /// Joint travel of one count, or of one pulse [m or rad].
    pub fn count(&self) -> f64 {
        self.encoder.resolution() * self.ratio.abs()
    }

    /// Whether a motion of the axis asks the same of this one as of `other`, but for the direction in which
    /// they turn.
    pub fn is_like(&self, other: &Self) -> bool {
        self.axis == other.axis
            && self.ratio.abs() == other.ratio.abs()
            && self.share == other.share
            && self.motor == other.motor
            && self.friction == other.friction
    }

    /// Effort at the joint that `torque` at the shaft [N·m] gives [N or N·m].
    pub fn effort(&self, torque: f64) -> f64 {
        torque / self.ratio.abs()
    }
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
