//! The tables of a catalogue. Their documentation becomes the schema's, so it speaks to whoever writes one.

use machine::document::{Fraction, Number, Positive, Quantity, Spanned};
use machine::file::tables::{DcMotorTable, StepperMotorTable};
use machine::quantity as unit;
use machine::{keyword, table};

/// A quantity above 0.
type Above<K> = Quantity<K, Positive>;
/// A quantity of 0 or more.
type AtLeastZero<K> = Quantity<K, machine::document::NonNegative>;

table! {
    /// Motors and gears to choose from, and parts of the machine that its own file says nothing of.
    pub struct CatalogueTable {
        /// Where the data come from, with the date, for every entry that does not say it itself.
        pub source: Option<Spanned<String>>,
        /// Motors.
        pub motor: Option<Vec<CatalogueMotorTable>>,
        /// Gears.
        pub gear: Option<Vec<CatalogueGearTable>>,
        /// Screws of the machine, for their critical speed.
        pub screw: Option<Vec<CatalogueScrewTable>>,
        /// Belts of the machine, for their preload.
        pub belt: Option<Vec<CatalogueBeltTable>>,
        /// What is behind the motors' power stages.
        pub supply: Option<SupplyTable>,
    }
}

table! {
    /// A motor.
    pub struct CatalogueMotorTable {
        /// What its maker calls it.
        pub name: Spanned<String>,
        /// Who makes it.
        pub maker: Option<Spanned<String>>,
        /// Where its data come from.
        pub source: Option<Spanned<String>>,
        /// Its mass.
        pub mass: Option<Above<unit::Mass>>,
        /// Largest speed that its maker allows.
        pub max_speed: Option<Above<unit::AngularSpeed>>,
        /// Current that it takes without load, which stands for its own friction.
        pub no_load_current: Option<AtLeastZero<unit::Current>>,
        /// How it warms.
        pub thermal: Option<ThermalTable>,
        /// A DC motor, as in a machine file; a brushless one with the values between two of its phases.
        pub dc: Option<DcMotorTable>,
        /// A stepper, as in a machine file.
        pub stepper: Option<StepperMotorTable>,
    }
}

table! {
    /// How a motor's winding warms.
    pub struct ThermalTable {
        /// Thermal resistance from the winding to the housing [K/W].
        pub winding_housing: Number<Positive>,
        /// Thermal resistance from the housing to the air [K/W].
        pub housing_ambient: Number<Positive>,
        /// Time constant of the winding.
        pub winding_time: Option<Above<unit::Duration>>,
        /// Time constant of the motor.
        pub motor_time: Option<Above<unit::Duration>>,
        /// Largest temperature of the winding [°C].
        pub max_winding: Option<Number<Positive>>,
    }
}

table! {
    /// A gear.
    pub struct CatalogueGearTable {
        /// What its maker calls it.
        pub name: Spanned<String>,
        /// Who makes it.
        pub maker: Option<Spanned<String>>,
        /// Where its data come from.
        pub source: Option<Spanned<String>>,
        /// Turns of the motor per turn of its output.
        pub ratio: Number<Positive>,
        /// Part of the power that comes through in motion.
        pub efficiency: Fraction<Positive>,
        /// What of that is left from standstill; 1 of planetary gears.
        pub static_efficiency: Fraction<Positive> = 1.0,
        /// Largest torque at its output, for a short time.
        pub max_torque: Above<unit::Torque>,
        /// Largest root mean square of the torque at its output.
        pub continuous_torque: Option<Above<unit::Torque>>,
        /// Its mass.
        pub mass: Option<Above<unit::Mass>>,
        /// Moment of inertia at its input.
        pub inertia: AtLeastZero<unit::Inertia> = "0 kg m^2",
        /// Largest speed of its input.
        pub max_input_speed: Option<Above<unit::AngularSpeed>>,
        /// Largest radial force at its output.
        pub radial_load: Option<Above<unit::Force>>,
        /// Largest axial force at its output.
        pub axial_load: Option<Above<unit::Force>>,
        /// By what the torque is multiplied before it is compared.
        pub service_factor: ServiceFactorTable,
    }
}

// Source 003 sec. 5.2.1 names a service factor and prints none. Usual ones of gear makers.
table! {
    /// By what the torque is multiplied before it is compared, by the load's inertia beside the rotor's.
    pub struct ServiceFactorTable {
        /// Up to 0.3 of it.
        pub uniform: Number<Positive> = 1.0,
        /// Up to 3 times it.
        pub medium: Number<Positive> = 1.25,
        /// Up to 10 times it.
        pub heavy: Number<Positive> = 1.5,
    }
}

table! {
    /// The screw of an axis.
    pub struct CatalogueScrewTable {
        /// The axis of the machine.
        pub axis: Spanned<String>,
        /// Diameter of its core, under the thread of the balls.
        pub diameter: Above<unit::Length>,
        /// Bore of a hollow shaft.
        pub bore: AtLeastZero<unit::Length> = "0 mm",
        /// Length between its supports.
        pub length: Above<unit::Length>,
        /// How it is held at its ends.
        pub support: Spanned<Support> = "fixed_supported",
        /// Modulus of elasticity; that of steel when left out.
        pub modulus: Above<unit::Modulus> = "210e9 N/m^2",
        /// Density [kg/m³]; that of steel when left out.
        pub density: Number<Positive> = 7850.0,
    }
}

table! {
    /// The belt of an axis.
    pub struct CatalogueBeltTable {
        /// The axis of the machine.
        pub axis: Spanned<String>,
        /// Force at which it breaks.
        pub breaking_force: Option<Above<unit::Force>>,
        /// Coefficient of friction on its pulley; of a toothed belt none.
        pub friction: Option<Number<Positive>>,
        /// Angle by which it wraps its pulley.
        pub wrap: Option<Above<unit::Angle>>,
    }
}

table! {
    /// What is behind the motors' power stages.
    pub struct SupplyTable {
        /// Capacitance that takes up what the motors give back [F].
        pub capacitance: Number<Positive>,
        /// Largest voltage that it may be charged to.
        pub max_voltage: Above<unit::Voltage>,
    }
}

/// How a screw is held at its ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Support {
    /// One end clamped, the other free.
    FixedFree,
    /// Both ends in simple bearings.
    Supported,
    /// One end clamped, the other in a simple bearing.
    FixedSupported,
    /// Both ends clamped.
    FixedFixed,
}

keyword! {
    Support, "a way to hold a screw",
    "fixed_free" => Self::FixedFree,
    "supported" => Self::Supported,
    "fixed_supported" => Self::FixedSupported,
    "fixed_fixed" => Self::FixedFixed,
}
