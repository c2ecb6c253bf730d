//! The tables by their numbers.

use machine::DocumentError;
use machine::kinematics::KinematicsError;
use schemars::JsonSchema;
use serde::Serialize;

use super::convention;
use super::corrected::{self, All};
use super::data::{
    CART_TRAVEL, CARTESIAN_RPM, CARTESIAN_TRAVEL, CARTS, CARTS_RPM, CARTS_TORQUES, COREXY_RPM,
    COREXY_TRAVEL, FIVE_BAR_ARMS, FIVE_BAR_GEAR, FIVE_BAR_GEAR_BUILT, FIVE_BAR_RPM,
    FIVE_BAR_TORQUES, HEIGHTS, LETTERS, Printed, PrintedPair, SPEEDS, SPEEDS_IMPLIED, TIMES,
};
use super::errata::{ERRATA, Erratum};
use super::machines::{Manner, ThesisMachine};
use super::model::{ModelError, Modelled, MotorMarks, model};
use super::table::{Cell, Table, Unit, Values};
use super::table_7_1;

/// The numbers of the tables.
pub const NAMES: [&str; 10] =
    ["3-1", "3-2", "4-1", "5-1", "5-2", "5-3", "6-1", "6-2", "6-3", "7-1"];

/// Tables, and what their values' differences are due to.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct TablesReport {
    /// The tables.
    pub tables: Vec<Table>,
    /// The errata that they name.
    pub errata: Vec<Erratum>,
}

/// Why tables cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum TablesError {
    /// No such table.
    #[error("no table {name}; there are {}", NAMES.join(", "))]
    Unknown {
        /// What was asked for.
        name: String,
    },
    /// A machine file that is not sound.
    #[error(transparent)]
    Machine(#[from] Box<DocumentError>),
    /// A letter that cannot be marked.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A letter that is out of reach of the corrected equations.
    #[error(transparent)]
    Kinematics(#[from] KinematicsError),
}

/// The tables of these `names`, all where there are none, in the source's order.
///
/// # Errors
/// A name that is no table's.
pub fn tables(names: &[String]) -> Result<TablesReport, TablesError> {
    if let Some(name) = names.iter().find(|name| !NAMES.contains(&name.as_str())) {
        return Err(TablesError::Unknown { name: name.clone() });
    }
    let wanted: Vec<&str> = NAMES
        .into_iter()
        .filter(|name| names.is_empty() || names.iter().any(|asked| asked == name))
        .collect();
    let material = Material::for_tables(&wanted)?;
    let tables: Vec<Table> =
        wanted.iter().map(|name| material.table(name)).collect::<Result<_, _>>()?;
    let is_named = |erratum: &&Erratum| {
        let mut named = tables.iter().flat_map(|table| &table.cells).flat_map(|cell| &cell.because);
        named.any(|name| name == erratum.id)
    };
    let errata = ERRATA.iter().filter(is_named).copied().collect();
    Ok(TablesReport { tables, errata })
}

/// What the tables are made from.
pub(super) struct Material {
    models: Vec<Modelled>,
    five_bar: Option<All>,
    prrrp: Option<All>,
}

impl Material {
    fn for_tables(names: &[&str]) -> Result<Self, TablesError> {
        use Manner::{Curves, Optimum, Printed};
        use ThesisMachine::{Cartesian, CoreXy, FiveBar, Prrrp};
        let mut wanted: Vec<(ThesisMachine, Manner)> = Vec::new();
        for name in names {
            let of: &[(ThesisMachine, Manner)] = match *name {
                "3-1" => &[(Cartesian, Printed), (Cartesian, Optimum), (Cartesian, Curves)],
                "3-2" => &[(Cartesian, Printed)],
                "4-1" => &[(CoreXy, Printed)],
                "5-1" | "5-2" | "5-3" => &[(FiveBar, Printed)],
                "6-1" | "6-2" | "6-3" => &[(Prrrp, Printed)],
                _ => &ThesisMachine::ALL.map(|machine| (machine, Printed)),
            };
            for model in of {
                if !wanted.contains(model) {
                    wanted.push(*model);
                }
            }
        }
        let has = |machine| wanted.contains(&(machine, Printed));
        Ok(Self {
            five_bar: has(FiveBar).then(corrected::five_bar).transpose()?,
            prrrp: has(Prrrp).then(corrected::prrrp).transpose()?,
            models: model(&wanted)?,
        })
    }

    /// The model of `machine`, empty where it was not asked for.
    pub(super) fn model(&self, machine: ThesisMachine, manner: Manner) -> Modelled {
        let is = |model: &&Modelled| model.machine == machine && model.manner == manner;
        let none = Modelled { machine, manner, letters: Vec::new() };
        self.models.iter().find(is).cloned().unwrap_or(none)
    }

    pub(super) fn five_bar(&self) -> All {
        self.five_bar.unwrap_or_default()
    }

    pub(super) fn prrrp(&self) -> All {
        self.prrrp.unwrap_or_default()
    }

    fn table(&self, name: &str) -> Result<Table, TablesError> {
        let model = |machine| self.model(machine, Manner::Printed);
        Ok(match name {
            "3-1" => self.table_3_1(),
            "3-2" => alike(
                name,
                "Velocità angolari massime modello cartesiano in RPM",
                &CARTESIAN_RPM,
                CARTESIAN_TRAVEL,
                &model(ThesisMachine::Cartesian),
            ),
            "4-1" => alike(
                name,
                "Velocità angolari massime modello cartesiano core XY in RPM",
                &COREXY_RPM,
                // Source 003 eq. 4.39: along a diagonal one belt takes the whole motion.
                COREXY_TRAVEL / core::f64::consts::SQRT_2,
                &model(ThesisMachine::CoreXy),
            ),
            "7-1" => table_7_1::table(self)?,
            _ => self.linkage(name),
        })
    }

    fn table_3_1(&self) -> Table {
        let [printed, optimum, curves] = [Manner::Printed, Manner::Optimum, Manner::Curves]
            .map(|manner| self.model(ThesisMachine::Cartesian, manner));
        let mut cells = Vec::new();
        for (row, index) in places() {
            let (height, name) = (HEIGHTS[index], format!("{:?}", LETTERS[row]));
            let planned = |model: &Modelled| model.letters.get(3 * row + index).cloned();
            let speed = SPEEDS_IMPLIED[row][index];
            let mut cell = |what: &str, unit, values| {
                let column = format!("{name}: {what}");
                cells.push(Cell::new(
                    &label(height),
                    &column,
                    None,
                    unit,
                    values,
                    &["E-3.1t", "E-3.1v"][usize::from(what == "V")..][..1],
                ));
            };
            cell(
                "t",
                Unit::SECOND,
                Values {
                    printed: Some(TIMES[row][index]),
                    errata: Some(convention::time(LETTERS[row], height, speed)),
                    modelled: planned(&printed).map(|plan| plan.time),
                    ..Values::default()
                },
            );
            cell(
                "V",
                Unit::METRES_PER_SECOND,
                Values {
                    printed: Some(SPEEDS[row][index]),
                    errata: Some(speed),
                    modelled: planned(&printed).map(|plan| plan.speed),
                    ..Values::default()
                },
            );
            let only = |modelled| Values { modelled, ..Values::default() };
            let best = planned(&optimum);
            cell("t at the best V", Unit::SECOND, only(best.as_ref().map(|plan| plan.time)));
            cell("best V", Unit::METRES_PER_SECOND, only(best.map(|plan| plan.speed)));
            let drawn = planned(&curves).map(|plan| plan.time);
            cell("t of true curves", Unit::SECOND, only(drawn));
        }
        let title = "Tempi e velocità d'incisione delle traiettorie generate";
        Table::new("3-1", title, cells)
    }

    fn linkage(&self, name: &str) -> Table {
        let five_bar = name.starts_with('5');
        let (machine, all) = if five_bar {
            (ThesisMachine::FiveBar, self.five_bar())
        } else {
            (ThesisMachine::Prrrp, self.prrrp())
        };
        // Joint speed of a motor's [rad/s] as printed, as built, and what the equations lack.
        let (travel, built) = if five_bar {
            (1.0 / FIVE_BAR_GEAR, 1.0 / FIVE_BAR_GEAR_BUILT)
        } else {
            (CART_TRAVEL, CART_TRAVEL)
        };
        let rpm = Unit::RPM.factor;
        let linkage = |title, printed, unit, reasons| Linkage {
            name: name.to_owned(),
            title,
            printed,
            unit,
            reasons,
        };
        let speed_reasons: &[&str] = if five_bar { &["E-5.3", "E-e"] } else { &["E-6.1", "E-6.3"] };
        let torque_reasons: &[&str] =
            if five_bar { &["E-5.3", "E-5.11", "E-e"] } else { &["E-6.1", "E-6.3", "E-6.7"] };
        let motors_reasons: &[&str] =
            if five_bar { &["E-5.3", "E-e", "E-7i"] } else { &["E-6.1", "E-6.3"] };
        let model = self.model(machine, Manner::Printed);
        let of = |row: usize, index: usize, motor: usize| all[row][index].speed_and_torque(motor);
        match name {
            "5-1" | "6-1" => {
                let (title, printed, unit) = if five_bar {
                    let title = "Velocità angolare alla uscita del motoriduttore";
                    (title, &FIVE_BAR_ARMS, Unit::RADIANS_PER_SECOND)
                } else {
                    ("Velocità lineali dei carri", &CARTS, Unit::METRES_PER_SECOND)
                };
                linkage(title, printed, unit, speed_reasons).table(
                    &model,
                    |_, _, _| None,
                    |row, index, motor| of(row, index, motor).0,
                    |marks| marks.speed * built,
                )
            }
            "5-2" | "6-2" => {
                let (title, printed, arms) = if five_bar {
                    ("Velocità angolare massime modello 5R in RPM", &FIVE_BAR_RPM, &FIVE_BAR_ARMS)
                } else {
                    ("Velocità angolare massime modello in RPM", &CARTS_RPM, &CARTS)
                };
                linkage(title, printed, Unit::RPM, motors_reasons).table(
                    &model,
                    |row, index, motor| Some(arms[row][index][motor] / travel / rpm),
                    |row, index, motor| of(row, index, motor).0 / travel / rpm,
                    |marks| marks.speed / rpm,
                )
            }
            _ => {
                let title = "Massime coppie erogate dai motori per ogni Set";
                let printed = if five_bar { &FIVE_BAR_TORQUES } else { &CARTS_TORQUES };
                linkage(title, printed, Unit::MILLINEWTONMETRE, torque_reasons).table(
                    &model,
                    |_, _, _| None,
                    |row, index, motor| of(row, index, motor).1 * 1e3,
                    |marks| marks.load * 1e3,
                )
            }
        }
    }
}

/// A table of the linkages, with two motors that differ.
struct Linkage<'a> {
    name: String,
    title: &'static str,
    printed: &'a PrintedPair,
    unit: Unit,
    reasons: &'a [&'a str],
}

impl Linkage<'_> {
    fn table(
        &self,
        model: &Modelled,
        from_print: impl Fn(usize, usize, usize) -> Option<f64>,
        errata: impl Fn(usize, usize, usize) -> f64,
        modelled: impl Fn(&MotorMarks) -> f64,
    ) -> Table {
        let mut cells = Vec::new();
        for (row, index) in places() {
            for motor in 0..2 {
                let planned = model.letters.get(3 * row + index);
                let marks = planned.and_then(|planned| planned.motors.get(motor));
                let values = Values {
                    printed: Some(self.printed[row][index][motor]),
                    from_print: from_print(row, index, motor),
                    errata: Some(errata(row, index, motor)),
                    modelled: marks.map(&modelled),
                };
                cells.push(Cell::new(
                    &label(HEIGHTS[index]),
                    &format!("{:?}", LETTERS[row]),
                    Some(motor as u8 + 1),
                    self.unit,
                    values,
                    self.reasons,
                ));
            }
        }
        Table::new(&self.name, self.title, cells)
    }
}

/// A table of speeds in which both motors are alike: that of the tool over `travel` [m/rad].
fn alike(name: &str, title: &str, printed: &Printed, travel: f64, model: &Modelled) -> Table {
    let rpm = Unit::RPM.factor;
    let mut cells = Vec::new();
    for (row, index) in places() {
        let right = SPEEDS_IMPLIED[row][index] / travel / rpm;
        let planned = model.letters.get(3 * row + index);
        let fastest = planned.map(|planned| {
            planned.motors.iter().map(|marks| marks.speed).fold(0.0, f64::max) / rpm
        });
        let values = Values {
            printed: Some(printed[row][index]),
            from_print: Some(SPEEDS[row][index] / travel / rpm),
            errata: Some(right),
            modelled: fastest,
        };
        let (height, letter) = (label(HEIGHTS[index]), format!("{:?}", LETTERS[row]));
        cells.push(Cell::new(&height, &letter, None, Unit::RPM, values, &[]));
    }
    Table::new(name, title, cells)
}

/// Every letter with every height, by their indices, in the order of the series.
fn places() -> impl Iterator<Item = (usize, usize)> {
    (0..LETTERS.len()).flat_map(|row| (0..HEIGHTS.len()).map(move |index| (row, index)))
}

/// A height as a row is named.
fn label(height: f64) -> String {
    format!("{:.0} cm", height * 1e2)
}
