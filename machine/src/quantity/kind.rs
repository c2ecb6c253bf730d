//! Kinds of quantity: what a key asks for.

use super::unit::Dimension;

/// A kind of quantity, with the dimensions that it may be given in.
pub trait Kind: Copy + core::fmt::Debug + PartialEq + Send + Sync + 'static {
    /// What it is called, with its article: `a length`.
    const NAME: &'static str;
    /// A value of this kind as a person would write it.
    const EXAMPLE: &'static str;
    /// The unit that a bare number was probably meant in.
    const UNIT: &'static str;
    /// The dimensions that it may have.
    const DIMENSIONS: &'static [Dimension];
}

macro_rules! kinds {
    ($( $(#[$doc:meta])* $kind:ident = $name:literal, $number:literal $unit:literal,
        $( [$($power:literal),*] )+ ; )*) => {
        $(
            $(#[$doc])*
            #[derive(Debug, Clone, Copy, PartialEq)]
            pub enum $kind {}

            impl Kind for $kind {
                const NAME: &'static str = $name;
                const EXAMPLE: &'static str = concat!($number, " ", $unit);
                const UNIT: &'static str = $unit;
                const DIMENSIONS: &'static [Dimension] = &[$( Dimension([$($power),*]) ),+];
            }
        )*

        /// Name, unit and dimensions of every kind, for error texts and schemas.
        pub(super) const NAMES: &[(&str, &[Dimension])] = &[$( ($name, $kind::DIMENSIONS) ),*];
    };
}

// Powers of length, mass, time, current, angle and count.
kinds! {
    /// [m].
    Length = "a length", "120" "mm", [1, 0, 0, 0, 0, 0];
    /// [rad].
    Angle = "an angle", "90" "deg", [0, 0, 0, 0, 1, 0];
    /// [N].
    Force = "a force", "2" "N", [1, 1, -2, 0, 0, 0];
    /// Of elasticity of a material [Pa].
    Modulus = "a modulus of elasticity", "70e9" "N/m^2", [-1, 1, -2, 0, 0, 0];
    /// [m²].
    Area = "an area", "50" "mm^2", [2, 0, 0, 0, 0, 0];
    /// Of a cross-section [m⁴].
    SecondMoment = "a second moment of area", "8e-9" "m^4", [4, 0, 0, 0, 0, 0];
    /// [kg].
    Mass = "a mass", "0.33" "kg", [0, 1, 0, 0, 0, 0];
    /// [s].
    Duration = "a time", "20" "us", [0, 0, 1, 0, 0, 0];
    /// [m/s].
    Speed = "a speed", "0.25" "m/s", [1, 0, -1, 0, 0, 0];
    /// [m/s²].
    Acceleration = "an acceleration", "10" "m/s^2", [1, 0, -2, 0, 0, 0];
    /// [m/s³].
    Jerk = "a jerk", "500" "m/s^3", [1, 0, -3, 0, 0, 0];
    /// [rad/s].
    AngularSpeed = "a rotational speed", "3000" "rpm", [0, 0, -1, 0, 1, 0];
    /// [1/s] or [rad/s], which are the same for a control loop.
    Bandwidth = "a bandwidth", "160" "rad/s", [0, 0, -1, 0, 1, 0] [0, 0, -1, 0, 0, 0];
    /// [m/rad].
    Lead = "a lead", "15" "mm/rev", [1, 0, 0, 0, -1, 0];
    /// [counts/rad].
    CountsPerTurn = "an encoder resolution", "4096" "counts/rev", [0, 0, 0, 0, -1, 1];
    /// [kg·m²].
    Inertia = "a moment of inertia", "2e-6" "kg m^2", [2, 1, 0, 0, 0, 0];
    /// [N·m].
    Torque = "a torque", "5" "mN m", [2, 1, -2, 0, 0, 0];
    /// [N/m].
    Stiffness = "a stiffness", "60" "N/mm", [0, 1, -2, 0, 0, 0];
    /// [N·m/rad].
    TorsionalStiffness = "a torsional stiffness", "600" "N m/rad", [2, 1, -2, 0, -1, 0];
    /// [N·s/m].
    Damping = "a damping", "250" "N s/m", [0, 1, -1, 0, 0, 0];
    /// [N·m·s/rad].
    TorsionalDamping = "a viscous friction", "1e-6" "N m s/rad", [2, 1, -1, 0, -1, 0];
    /// [Ω].
    Resistance = "a resistance", "2.3" "ohm", [2, 1, -3, -2, 0, 0];
    /// [H].
    Inductance = "an inductance", "2.3" "mH", [2, 1, -2, -2, 0, 0];
    /// [V].
    Voltage = "a voltage", "12" "V", [2, 1, -3, -1, 0, 0];
    /// [A].
    Current = "a current", "5.2" "A", [0, 0, 0, 1, 0, 0];
    /// [N·m/A] or [V·s/rad], which are the same for a motor.
    TorqueConstant = "a torque constant", "0.021" "N m/A",
        [2, 1, -2, -1, 0, 0] [2, 1, -2, -1, -1, 0];
    // Last, so that an error names the plain kinds of what was written.
    /// Of a joint, [m] or [rad].
    Travel = "a length or an angle", "120" "mm", [1, 0, 0, 0, 0, 0] [0, 0, 0, 0, 1, 0];
    /// Of a joint, [m/s] or [rad/s].
    TravelSpeed = "a speed", "0.25" "m/s", [1, 0, -1, 0, 0, 0] [0, 0, -1, 0, 1, 0];
    /// Of a joint, [m/s²] or [rad/s²].
    TravelAcceleration = "an acceleration", "10" "m/s^2", [1, 0, -2, 0, 0, 0] [0, 0, -2, 0, 1, 0];
    /// Of a joint, [m/s³] or [rad/s³].
    TravelJerk = "a jerk", "500" "m/s^3", [1, 0, -3, 0, 0, 0] [0, 0, -3, 0, 1, 0];
    /// Of a spring between motor and joint, [N/m] or [N·m/rad].
    JointStiffness = "a stiffness", "60" "N/mm", [0, 1, -2, 0, 0, 0] [2, 1, -2, 0, -1, 0];
    /// [rad/s]: 2π for each pulse a second, as of every frequency.
    PulseRate = "a pulse rate", "200" "kHz", [0, 0, -1, 0, 1, 0];
}
