//! A table of the source: what is printed, what its own numbers give, what is right, what is modelled.

use schemars::JsonSchema;
use serde::Serialize;

use core::f64::consts::PI;

/// How much printed and corrected values may differ by rounding.
const ROUNDING: f64 = 0.005;

/// How much printed and modelled values may differ without a reason given.
const AGREEMENT: f64 = 0.10;

/// A unit of the source and the one that it has here.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unit {
    /// The source's.
    pub(super) source: &'static str,
    /// The SI's.
    pub(super) si: &'static str,
    /// The source's unit in the SI's.
    pub(super) factor: f64,
}

impl Unit {
    const fn same(name: &'static str) -> Self {
        Self { source: name, si: name, factor: 1.0 }
    }

    pub(super) const ONE: Self = Self::same("1");
    pub(super) const SECOND: Self = Self::same("s");
    pub(super) const METRES_PER_SECOND: Self = Self::same("m/s");
    pub(super) const RADIANS_PER_SECOND: Self = Self::same("rad/s");
    pub(super) const KILOGRAM: Self = Self::same("kg");
    pub(super) const WATT: Self = Self::same("W");
    pub(super) const TORQUE: Self = Self::same("N·m");
    pub(super) const TORSION: Self = Self::same("N·m/rad");
    pub(super) const RPM: Self = Self { source: "rpm", si: "rad/s", factor: PI / 30.0 };
    pub(super) const MILLINEWTONMETRE: Self = Self { source: "mN·m", si: "N·m", factor: 1e-3 };
    pub(super) const SPRING: Self = Self { source: "N/mm", si: "N/m", factor: 1e3 };
    pub(super) const CENTIMETRE: Self = Self { source: "cm", si: "m", factor: 1e-2 };
}

/// One value of a table.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Cell {
    /// The row, such as `1 cm`.
    pub row: String,
    /// The column, such as `N`, or a machine.
    pub column: String,
    /// The motor, from 1; null where it is not one motor's.
    pub motor: Option<u8>,
    /// The source's unit.
    pub source_unit: String,
    /// The SI unit.
    pub unit: String,
    /// What is printed in words.
    pub text: Option<String>,
    /// What is printed, in the source's unit; null where the source has no such value.
    pub printed: Option<f64>,
    /// The same in SI units.
    pub printed_si: Option<f64>,
    /// What the printed values of an earlier table or equation give, as they are.
    pub from_print: Option<f64>,
    /// The same in SI units.
    pub from_print_si: Option<f64>,
    /// What the source's equations give on its own values, the errata applied.
    pub errata: Option<f64>,
    /// The same in SI units.
    pub errata_si: Option<f64>,
    /// What Graver's plan of the job on the machine gives.
    pub modelled: Option<f64>,
    /// The same in SI units.
    pub modelled_si: Option<f64>,
    /// The errata by which these differ: there is one wherever the model is more than a tenth off the
    /// print, or the corrected value more than rounding.
    pub because: Vec<String>,
}

/// The values of a cell, in the source's unit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Values {
    pub(super) printed: Option<f64>,
    pub(super) from_print: Option<f64>,
    pub(super) errata: Option<f64>,
    pub(super) modelled: Option<f64>,
}

impl Cell {
    /// A cell; `reasons` are the errata that would explain a difference.
    pub(super) fn new(
        row: &str,
        column: &str,
        motor: Option<u8>,
        unit: Unit,
        values: Values,
        reasons: &[&str],
    ) -> Self {
        let Values { printed, from_print, errata, modelled } = values;
        let si = |value: Option<f64>| value.map(|value| value * unit.factor);
        let mut cell = Self {
            row: row.to_owned(),
            column: column.to_owned(),
            motor,
            source_unit: unit.source.to_owned(),
            unit: unit.si.to_owned(),
            text: None,
            printed,
            printed_si: si(printed),
            from_print,
            from_print_si: si(from_print),
            errata,
            errata_si: si(errata),
            modelled,
            modelled_si: si(modelled),
            because: Vec::new(),
        };
        if cell.differs() {
            cell.because = reasons.iter().map(|reason| (*reason).to_owned()).collect();
        }
        cell
    }

    /// A cell of words alone.
    pub(super) fn words(row: &str, column: &str, text: &str) -> Self {
        let values = Values::default();
        Self { text: Some(text.to_owned()), ..Self::new(row, column, None, Unit::ONE, values, &[]) }
    }

    /// The same with words of the source beside its number.
    pub(super) fn saying(self, text: &str) -> Self {
        Self { text: Some(text.to_owned()), ..self }
    }

    /// Whether what is printed is so far from the other values that a reason must be given.
    pub fn differs(&self) -> bool {
        let Some(printed) = self.printed else { return false };
        let off = |value: Option<f64>| value.map_or(0.0, |value| (value / printed - 1.0).abs());
        off(self.modelled) > AGREEMENT || off(self.errata) > ROUNDING
    }
}

/// A table.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct Table {
    /// Its number, such as `5-2`.
    pub name: String,
    /// Its title in the source.
    pub title: String,
    /// The source's unit where all cells have the same; else null.
    pub source_unit: Option<String>,
    /// The SI unit where all cells have the same; else null.
    pub unit: Option<String>,
    /// The values, row by row.
    pub cells: Vec<Cell>,
}

impl Table {
    pub(super) fn new(name: &str, title: &str, cells: Vec<Cell>) -> Self {
        let one = |unit: fn(&Cell) -> &str| {
            let first = cells.first().map(unit)?;
            cells.iter().all(|cell| unit(cell) == first).then(|| first.to_owned())
        };
        let (source_unit, unit) = (one(|cell| &cell.source_unit), one(|cell| &cell.unit));
        Self { name: name.to_owned(), title: title.to_owned(), source_unit, unit, cells }
    }

    /// The cell of a row, column and motor.
    pub fn cell(&self, row: &str, column: &str, motor: Option<u8>) -> Option<&Cell> {
        let is = |cell: &&Cell| cell.row == row && cell.column == column && cell.motor == motor;
        self.cells.iter().find(is)
    }
}
