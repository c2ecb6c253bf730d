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
    /// Torque of the brake that holds its shaft while it is unpowered, 0 for none [N·m].
    pub brake: f64,
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
