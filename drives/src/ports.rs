//! The one list of the ports: what a machine file's table of drives is served by.

use machine::{DrivesKind, Machine};

use crate::hostmot2::Hostmot2Port;
use crate::plant::{PlantOptions, SimulatedPlant};
use crate::port::{Port, PortError};

/// Which port serves which kind of drives.
macro_rules! ports {
    ($( $kind:ident => $build:path; )*) => {
        /// The port that `machine` asks for, not open yet. What `plant` says counts where it is simulated.
        ///
        /// # Errors
        /// A port that this build does not have, or that cannot be made of this machine.
        pub fn build(machine: &Machine, plant: &Machine) -> Result<Box<dyn Port>, PortError> {
            match &machine.drives.kind {
                $( DrivesKind::$kind { .. } => $build(machine, plant), )*
            }
        }
    };
}

ports! {
    Simulated => simulated;
    Hostmot2 => hostmot2;
    Ethercat => ethercat;
}

/// The plant that `plant` describes.
///
/// # Errors
/// A machine that cannot be simulated.
pub fn simulated(_machine: &Machine, plant: &Machine) -> Result<Box<dyn Port>, PortError> {
    let port = SimulatedPlant::new(plant, PlantOptions::default());
    port.map_err(|error| PortError::Unsupported {
        what: format!("the machine cannot be simulated: {error}"),
        instead: "change the machine file, or drive the machine itself".to_owned(),
    })
}

/// The board that `machine` names.
///
/// # Errors
/// A machine file that no board can serve.
pub fn hostmot2(machine: &Machine, _plant: &Machine) -> Result<Box<dyn Port>, PortError> {
    Ok(Box::new(Hostmot2Port::of(machine)?))
}

/// The port to the bus that `machine` has.
///
/// # Errors
/// A bus that the machine file cannot mean.
#[cfg(feature = "ethercat")]
pub fn ethercat(machine: &Machine, _plant: &Machine) -> Result<Box<dyn Port>, PortError> {
    Ok(Box::new(crate::ethercat::EthercatPort::of(machine)?))
}

#[cfg(not(feature = "ethercat"))]
fn ethercat(machine: &Machine, plant: &Machine) -> Result<Box<dyn Port>, PortError> {
    absent(machine, plant)
}

/// The error of a port that is not part of this build.
#[cfg(not(feature = "ethercat"))]
fn absent(machine: &Machine, _plant: &Machine) -> Result<Box<dyn Port>, PortError> {
    Err(PortError::Unsupported {
        what: format!("this build has no port for [drives.{}]", machine.drives.kind.name()),
        instead: "build it with that feature, as by `cargo build --release --features ethercat`, or run with \
                  `--drives sim`"
            .to_owned(),
    })
}
