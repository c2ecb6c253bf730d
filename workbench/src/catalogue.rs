//! Catalogues of motors and gears, and of the screws and belts of a machine.
//!
//! A catalogue is TOML, read like a machine file: quantities with their units, errors at their place, values
//! held to bounds. Every entry names the source of its data.

mod bounds;
mod builtin;
mod read;
pub mod table;

use machine::Motor;
use machine::document::{Document, DocumentError, schema_text};
use machine::transmission::gear::LoadClass;
use std::path::Path;

pub use builtin::BUILTIN;

/// Motors, gears and parts of machines, from one catalogue or several.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Catalogue {
    /// Motors, in the order of the catalogues.
    pub motors: Vec<CatalogueMotor>,
    /// Gears, in the order of the catalogues.
    pub gears: Vec<CatalogueGear>,
    /// Screws of the machine, at most one for an axis.
    pub screws: Vec<Screw>,
    /// Belts of the machine, at most one for an axis.
    pub belts: Vec<Belt>,
    /// What is behind the motors' power stages.
    pub supply: Option<Supply>,
}

/// A motor that can be bought.
#[derive(Debug, Clone, PartialEq)]
pub struct CatalogueMotor {
    /// What its maker calls it.
    pub name: String,
    /// Who makes it.
    pub maker: Option<String>,
    /// Where its data come from.
    pub source: String,
    /// [kg].
    pub mass: Option<f64>,
    /// Largest speed that its maker allows [rad/s].
    pub max_speed: Option<f64>,
    /// Current that it takes without load [A], a DC motor's own friction; 0 where it is not known.
    pub no_load_current: f64,
    /// How it warms.
    pub thermal: Option<Thermal>,
    /// The motor with its supply and power stage or driver.
    pub motor: Motor,
}

/// How a motor's winding warms: winding and housing, one behind the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Thermal {
    /// Thermal resistance from the winding to the housing [K/W].
    pub winding_housing: f64,
    /// Thermal resistance from the housing to the air [K/W].
    pub housing_ambient: f64,
    /// Time constants of winding and motor [s].
    pub times: Option<[f64; 2]>,
    /// Largest temperature of the winding [°C].
    pub max_winding: Option<f64>,
}

/// A gear that can be bought.
#[derive(Debug, Clone, PartialEq)]
pub struct CatalogueGear {
    /// What its maker calls it.
    pub name: String,
    /// Where its data come from.
    pub source: String,
    /// Turns of the motor per turn of its output.
    pub ratio: f64,
    /// Part of the power that comes through in motion.
    pub efficiency: f64,
    /// What of that is left from standstill.
    pub static_efficiency: f64,
    /// Largest torque at its output, for a short time [N·m].
    pub max_torque: f64,
    /// Largest root mean square of the torque at its output [N·m].
    pub continuous_torque: Option<f64>,
    /// [kg].
    pub mass: Option<f64>,
    /// Moment of inertia at its input [kg·m²].
    pub inertia: f64,
    /// Largest speed of its input [rad/s].
    pub max_input_speed: Option<f64>,
    /// Largest radial and axial force at its output [N].
    pub loads: [Option<f64>; 2],
    /// By what the torque is multiplied before it is compared, by how hard the gear is used.
    pub service: ServiceFactor,
}

/// By what a gear's torque is multiplied before it is compared with what the gear bears.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServiceFactor {
    /// Under a uniform load.
    pub uniform: f64,
    /// Under a medium one.
    pub medium: f64,
    /// Under a heavy one.
    pub heavy: f64,
}

impl ServiceFactor {
    /// The factor of `class`; that of a heavy load for an extreme one, which is refused anyway.
    pub fn of(&self, class: LoadClass) -> f64 {
        match class {
            LoadClass::Uniform => self.uniform,
            LoadClass::Medium => self.medium,
            LoadClass::Heavy | LoadClass::Extreme => self.heavy,
        }
    }
}

/// The screw of an axis of the machine, for its critical speed.
#[derive(Debug, Clone, PartialEq)]
pub struct Screw {
    /// The axis.
    pub axis: String,
    /// Diameter of its core [m].
    pub diameter: f64,
    /// Bore, 0 of a solid one [m].
    pub bore: f64,
    /// Length between its supports [m].
    pub length: f64,
    /// How it is held at its ends.
    pub support: table::Support,
    /// Modulus of elasticity [N/m²].
    pub modulus: f64,
    /// [kg/m³].
    pub density: f64,
}

/// The belt of an axis of the machine, for its preload.
#[derive(Debug, Clone, PartialEq)]
pub struct Belt {
    /// The axis.
    pub axis: String,
    /// Force at which it breaks [N].
    pub breaking_force: Option<f64>,
    /// Coefficient of friction on its pulley, and the angle by which it wraps it [rad]; of a toothed belt
    /// none.
    pub grip: Option<[f64; 2]>,
}

/// What is behind the motors' power stages.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Supply {
    /// Capacitance that takes up what the motors give back [F].
    pub capacitance: f64,
    /// Largest voltage that it may be charged to [V].
    pub max_voltage: f64,
}

impl Catalogue {
    /// Reads the catalogue called `name` from `text`.
    ///
    /// # Errors
    /// Everything in it that is not sound, with its place.
    pub fn parse(name: &str, text: &str) -> Result<Self, DocumentError> {
        read::catalogue(Document::parse(name, text)?)
    }

    /// Reads the file at `path`.
    ///
    /// # Errors
    /// As [`Self::parse`], or a file that cannot be read.
    pub fn load(path: &Path) -> Result<Self, DocumentError> {
        read::catalogue(Document::read(path)?)
    }

    /// This and `other`.
    #[must_use]
    pub fn and(mut self, other: Self) -> Self {
        self.motors.extend(other.motors);
        self.gears.extend(other.gears);
        self.screws.extend(other.screws);
        self.belts.extend(other.belts);
        self.supply = other.supply.or(self.supply);
        self
    }
}

/// The JSON schema of catalogues, as `catalogues/schema.json` holds it.
pub fn schema() -> String {
    schema_text::<table::CatalogueTable>("Graver catalogue of motors and gears")
}
