//! Parts that several kinds are made of: screws, tubes and discs.

use crate::catalogue::Screw;
use crate::catalogue::table::Support;
use crate::new::Short;
use crate::new::text::{about, inertia, line, mm, number};
use crate::size::screw;
use core::f64::consts::{PI, TAU};

/// Diameters of screws that can be bought [m].
const DIAMETERS: [f64; 9] = [8e-3, 10e-3, 12e-3, 16e-3, 20e-3, 25e-3, 32e-3, 40e-3, 50e-3];

/// Leads of screws that can be bought [m].
const LEADS: [f64; 15] = [
    0.5e-3, 1e-3, 2e-3, 2.5e-3, 4e-3, 5e-3, 8e-3, 10e-3, 12e-3, 16e-3, 20e-3, 25e-3, 32e-3, 40e-3,
    50e-3,
];

/// Turns of a screw in a second, 3000 rpm; and where its lead must be short.
const TURNS: [f64; 2] = [50.0, 100.0];

/// Length over diameter beyond which a screw sags.
const SLENDEREST: f64 = 80.0;

/// Length of a screw beyond its travel: nut and ends [m].
const ENDS: f64 = 0.1;

/// Density and modulus of steel [kg/m³, N/m²].
const STEEL: [f64; 2] = [7850.0, 210e9];

/// Density of aluminium [kg/m³].
const ALUMINIUM: f64 = 2700.0;

/// Source 003's head [kg], and its links: kilograms of a metre of tube.
const SOURCE_HEAD: f64 = 0.33;
const SOURCE_TUBE: f64 = 0.78;

/// A screw that moves its nut over a travel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ScrewPart {
    pub(super) diameter: f64,
    pub(super) length: f64,
    pub(super) lead: f64,
    pub(super) inertia: f64,
}

impl ScrewPart {
    /// The thinnest screw for `travel` [m] with the shortest lead that goes at `speed` [m/s] without
    /// whipping, on the axis `name`.
    pub(super) fn new(name: &str, travel: f64, speed: f64) -> Result<Self, Short> {
        let length = travel + ENDS;
        let mut fastest: f64 = 0.0;
        for diameter in DIAMETERS.into_iter().filter(|it| *it * SLENDEREST >= length) {
            let part = Screw {
                axis: String::new(),
                diameter: 0.85 * diameter,
                bore: 0.0,
                length,
                support: Support::FixedSupported,
                modulus: STEEL[1],
                density: STEEL[0],
            };
            let whips = screw::SHARE * screw::critical_speed(&part) / TAU;
            for turns in TURNS.map(|turns| turns.min(whips)) {
                for lead in LEADS.into_iter().filter(|lead| *lead <= travel) {
                    fastest = fastest.max(lead * turns);
                    if lead * turns >= speed * (1.0 - 1e-9) {
                        let inertia = screw::inertia(diameter, 0.0, length, STEEL[0]);
                        return Ok(Self { diameter, length, lead, inertia });
                    }
                }
            }
        }
        // Three digits, rounded down.
        let scale = 1e3;
        Err(Short::Speed(
            (fastest * scale).floor() / scale,
            format!("a screw of {} mm on axis {name} whips at more", about(length * 1e3)),
        ))
    }

    /// What is said of it beside its lead and its inertia.
    pub(super) fn lines(&self) -> String {
        let turns = "the shortest that can be bought for the speed";
        let steel =
            format!("steel, {} mm by {} mm", about(self.diameter * 1e3), about(self.length * 1e3));
        line("lead", &format!("\"{} mm/rev\"", number(self.lead * 1e3)), turns)
            + &line("inertia", &inertia(self.inertia), &steel)
    }

    /// Its table as the transmission of the axis `name`.
    pub(super) fn transmission(&self, name: &str) -> String {
        format!("[axis.{name}.transmission.screw]\n{}\n", self.lines())
    }

    /// Its table of what yields.
    pub(super) fn shaft(&self) -> String {
        line("core_diameter", &mm(0.85 * self.diameter), "under the thread")
            + &line(
                "length",
                &mm(self.length / 2.0),
                "from the fixed bearing to the nut, on average",
            )
    }
}

/// What moves an axis along a line.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Straight {
    /// What the gear turns.
    pub(super) output: &'static str,
    /// Its table.
    pub(super) transmission: String,
    /// What it passes on with its gear, and of what that is usual.
    pub(super) efficiency: (f64, &'static str),
}

impl Straight {
    /// A screw on the axis `name` where one goes over `travel` [m] at `speed` [m/s] without whipping;
    /// else a belt.
    pub(super) fn new(name: &str, travel: f64, speed: f64) -> Self {
        match ScrewPart::new(name, travel, speed) {
            Ok(screw) => Self {
                output: "the screw",
                transmission: screw.transmission(name),
                efficiency: (0.8, "a ball screw and its gear"),
            },
            Err(_) => Self {
                output: "the pulley",
                transmission: format!("# A screw would whip.\n{}", belt(name, travel)),
                efficiency: (0.8, "a gear and a toothed belt"),
            },
        }
    }
}

/// The table of a belt as the transmission of the axis `name`, whose joint travels so far [m].
pub(super) fn belt(name: &str, travel: f64) -> String {
    let radius = pulley(travel);
    let what = "small, for few turns of gear; no turn is longer than the travel";
    format!("[axis.{name}.transmission.belt]\n{}\n", line("pulley_radius", &mm(radius), what))
}

/// Radius of the pulley of a belt that travels so far [m].
pub(super) fn pulley(travel: f64) -> f64 {
    (travel / 8.0).clamp(3.2e-3, 10e-3)
}

/// Kilograms of a metre of the links of a machine that is `scale` times the source's and bears `head`
/// [kg]: heavier where the load asks for more, with the root of it.
pub(super) fn tube(head: f64, scale: f64) -> f64 {
    SOURCE_TUBE * (head / SOURCE_HEAD * scale).max(1.0).sqrt()
}

/// Mass [kg] and inertia [kg·m²] of a link of `length` [m] with so many kilograms a metre.
pub(super) fn link(tube: f64, length: f64) -> [f64; 2] {
    let mass = tube * length;
    [mass, mass * length * length / 12.0]
}

/// Mass [kg] and inertia [kg·m²] of a disc.
pub(super) fn disc(radius: f64, thickness: f64, density: f64) -> [f64; 2] {
    let mass = density * PI * radius * radius * thickness;
    [mass, mass * radius * radius / 2.0]
}

/// Inertia of a table of aluminium of `radius` [m], a thirtieth of it thick and 10 mm at least [kg·m²].
pub(super) fn table(radius: f64) -> f64 {
    disc(radius, (radius / 30.0).max(0.01), ALUMINIUM)[1]
}

/// A head of `mass` [kg] as a cube of half the density of aluminium, about each of its axes [kg·m²].
pub(super) fn head_inertia(mass: f64) -> f64 {
    let side = messages::math::exp(messages::math::ln(mass / (0.5 * ALUMINIUM)) / 3.0);
    mass * side * side / 6.0
}

/// Speed and acceleration of an axis that lifts: up to 0.1 m/s and 2 m/s², less where less is asked for.
pub(super) fn lift(speed: f64, acceleration: f64) -> [f64; 2] {
    [speed.min(0.1), acceleration.min(2.0)]
}
