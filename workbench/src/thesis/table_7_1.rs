//! Table 7-1, the source's comparison of its four mechanisms.

use core::f64::consts::SQRT_2;

use machine::kinematics::KinematicsError;
use machine::{Machine, MechanismKind};

use super::corrected::All;
use super::data::{ACCELERATION, CART_TRAVEL, CARTESIAN_TRAVEL, COREXY_TRAVEL, FIVE_BAR_GEAR};
use super::machines::{Manner, ThesisMachine};
use super::model::{Modelled, MotorMarks};
use super::table::{Cell, Table, Unit, Values};
use super::tables::{Material, TablesError};
use crate::mechanics::Mechanics;

/// What is printed and what is right of one machine, in the source's units; the rows of two are per
/// motor.
struct Column {
    machine: ThesisMachine,
    transmission: &'static str,
    /// Travel of a joint per radian of the gear's output [m or rad].
    travel: f64,
    ratio: f64,
    ratio_right: f64,
    ratio_text: &'static str,
    efficiency: f64,
    stiffness: f64,
    stiffness_right: f64,
    stiffness_unit: Unit,
    stiffness_text: &'static str,
    stiffness_reasons: &'static [&'static str],
    mass: f64,
    mass_right: f64,
    mass_reasons: &'static [&'static str],
    size: [f64; 2],
    area_reasons: &'static [&'static str],
    speed: [f64; 2],
    /// Of the source's own tables [rpm].
    speed_from_print: [f64; 2],
    torque: [f64; 2],
    motor_torque: [f64; 2],
    power: [f64; 2],
}

const COLUMNS: [Column; 4] = [
    Column {
        machine: ThesisMachine::Cartesian,
        transmission: "Ingranaggi / Vite Madrevite",
        travel: CARTESIAN_TRAVEL * 3.0,
        ratio: 3.0,
        ratio_right: 3.0,
        ratio_text: "P = 15 mm/rev",
        efficiency: 0.5,
        stiffness: 2.626,
        stiffness_right: 2626.0,
        stiffness_unit: Unit::TORSION,
        stiffness_text: "printed with the unit N/m",
        stiffness_reasons: &["E-3.5k", "E-3.30"],
        mass: 1.93,
        mass_right: 0.33 + 0.3 + 0.264 + 0.5 + 2.0 * 0.2,
        mass_reasons: &["E-m1"],
        size: [25.0, 25.0],
        area_reasons: &[],
        speed: [2880.0, 2880.0],
        speed_from_print: [2880.0, 2880.0],
        torque: [0.0989, 0.0164],
        motor_torque: [0.19, 0.033],
        power: [57.3, 9.9],
    },
    Column {
        machine: ThesisMachine::CoreXy,
        transmission: "Epicicloidale / Cinghia",
        travel: COREXY_TRAVEL * 8.0,
        ratio: 8.0,
        ratio_right: 8.0,
        ratio_text: "r = 1 cm",
        efficiency: 0.8,
        stiffness: 15.0,
        // Two belts of two spans each.
        stiffness_right: 60.0,
        stiffness_unit: Unit::SPRING,
        stiffness_text: "of one span of 0.5 m",
        stiffness_reasons: &["E-4.15"],
        mass: 1.06,
        mass_right: 0.33 + 0.3 + 4.0 * 0.1 + 0.03,
        mass_reasons: &[],
        size: [25.0, 25.0],
        area_reasons: &[],
        speed: [2593.0, 2593.0],
        speed_from_print: [2593.0, 2593.0],
        torque: [0.0173, 0.0173],
        motor_torque: [0.0247, 0.0247],
        power: [6.7, 6.7],
    },
    Column {
        machine: ThesisMachine::FiveBar,
        transmission: "Epicicloidale",
        travel: 1.0,
        ratio: 250.0,
        ratio_right: 236.09,
        ratio_text: "",
        efficiency: 0.7,
        stiffness: 293.0,
        // 3EJ/L of the arm, 10 mm by 10 mm and 200 mm long.
        stiffness_right: 3.0 * 22e10 * (1e-8 / 12.0) / 0.2,
        stiffness_unit: Unit::TORSION,
        stiffness_text: "",
        stiffness_reasons: &["E-5.20"],
        mass: 1.31,
        mass_right: 2.0 * 0.156 + 2.0 * 0.195 + 0.33 + 0.186,
        mass_reasons: &["E-7m"],
        size: [22.0, 47.0],
        area_reasons: &["E-area"],
        speed: [2053.0, 2053.0],
        speed_from_print: [2100.0, 2100.0],
        torque: [0.012, 0.012],
        motor_torque: [0.017, 0.017],
        power: [3.65, 3.65],
    },
    Column {
        machine: ThesisMachine::Prrrp,
        transmission: "Ingranaggi / Vite Madrevite",
        travel: CART_TRAVEL * 3.0,
        ratio: 3.0,
        ratio_right: 3.0,
        ratio_text: "P = 36 mm/rev",
        efficiency: 0.5,
        stiffness: 440.0,
        stiffness_right: 2673.0,
        stiffness_unit: Unit::TORSION,
        stiffness_text: "",
        stiffness_reasons: &["E-6.4k", "E-6.5k"],
        mass: 1.22,
        mass_right: 2.0 * 0.2 + 2.0 * 0.234 + 0.33 + 0.186,
        mass_reasons: &["E-7m"],
        size: [32.0, 80.0],
        area_reasons: &["E-6.area"],
        speed: [2600.0, 2800.0],
        speed_from_print: [2600.0, 2800.0],
        torque: [0.03, 0.027],
        motor_torque: [0.06, 0.054],
        power: [16.33, 15.83],
    },
];

/// Side of the working area that is printed for all [cm].
const AREA: f64 = 20.0;

/// The table, from the models of all four machines.
///
/// # Errors
/// A machine file that is not sound.
pub(super) fn table(material: &Material) -> Result<Table, TablesError> {
    let mut columns = Vec::with_capacity(COLUMNS.len());
    for column in &COLUMNS {
        let machine = column.machine.machine().map_err(Box::new)?;
        let model = material.model(column.machine, Manner::Printed);
        columns.push((column, machine, model));
    }
    let mut cells = Vec::new();
    for (column, ..) in &columns {
        let name = column.machine.name();
        cells.push(Cell::words("Riduttore / Trasmissione", name, column.transmission));
    }
    for (column, machine, _) in &columns {
        cells.extend(column.built(machine)?);
    }
    for (column, _, model) in &columns {
        for motor in 0..2 {
            let right = column.right(motor, material);
            cells.extend(column.motor(motor, &right, model));
        }
    }
    // Row by row, as the source has it.
    let mut rows: Vec<String> = Vec::new();
    for cell in &cells {
        if !rows.contains(&cell.row) {
            rows.push(cell.row.clone());
        }
    }
    cells.sort_by_key(|cell| rows.iter().position(|row| *row == cell.row));
    Ok(Table::new("7-1", "Confronto tra i meccanismi", cells))
}

/// What is right of one motor.
struct Right {
    /// [rpm].
    speed: f64,
    /// Of the load, without losses [N·m].
    torque: f64,
    speed_reasons: &'static [&'static str],
    torque_reasons: &'static [&'static str],
}

impl Column {
    /// The rows that the machine as it is built has.
    fn built(&self, machine: &Machine) -> Result<Vec<Cell>, KinematicsError> {
        let name = self.machine.name();
        let mechanics = Mechanics::of(machine)?;
        let efficiency = machine.actuators.first().map(|actuator| actuator.efficiency.dynamic);
        let ratio = Values {
            printed: Some(self.ratio),
            errata: Some(self.ratio_right),
            modelled: self.gear(machine),
            ..Values::default()
        };
        let cell =
            |row: &str, unit, values, reasons| Cell::new(row, name, None, unit, values, reasons);
        let mut cells = vec![cell("i", Unit::ONE, ratio, &["E-7i"]).saying(self.ratio_text)];
        let values = Values {
            printed: Some(self.efficiency),
            errata: Some(self.efficiency),
            modelled: efficiency,
            ..Values::default()
        };
        cells.push(cell("η trasmissione", Unit::ONE, values, &[]));
        let values = Values {
            printed: Some(self.stiffness),
            errata: Some(self.stiffness_right),
            modelled: self.spring(machine).map(|spring| spring / self.stiffness_unit.factor),
            ..Values::default()
        };
        let row = "Rigidezza";
        let stiffness = cell(row, self.stiffness_unit, values, self.stiffness_reasons);
        cells.push(stiffness.saying(self.stiffness_text));
        let values = Values {
            printed: Some(self.mass),
            errata: Some(self.mass_right),
            modelled: Some(mechanics.moving_mass),
            ..Values::default()
        };
        cells.push(cell("Massa", Unit::KILOGRAM, values, self.mass_reasons));
        let centimetre = Unit::CENTIMETRE.factor;
        for (index, (axis, size)) in ["x", "y"].into_iter().zip(self.size).enumerate() {
            let modelled = mechanics.footprint.map(|lengths| lengths[index] / centimetre);
            let values = Values { printed: Some(size), modelled, ..Values::default() };
            cells.push(cell(&format!("Misure {axis}"), Unit::CENTIMETRE, values, &["E-size"]));
            let modelled = mechanics.rectangle.map(|[x, y]| {
                let [from, to] = [x, y][index];
                (to - from) / centimetre
            });
            let values = Values { printed: Some(AREA), modelled, ..Values::default() };
            let row = format!("Piano di lavoro {axis}");
            cells.push(cell(&row, Unit::CENTIMETRE, values, self.area_reasons));
        }
        Ok(cells)
    }

    /// Turns of the motor per turn of the gear's output.
    fn gear(&self, machine: &Machine) -> Option<f64> {
        machine.actuators.first().map(|actuator| self.travel / actuator.ratio)
    }

    /// The spring of the first axis as the source has it: at the screw, the belt or the arm [N·m/rad or
    /// N/m].
    fn spring(&self, machine: &Machine) -> Option<f64> {
        let square = self.travel * self.travel;
        match &machine.mechanism {
            MechanismKind::Cartesian(it) => it.elasticity.map(|[x, _]| x.stiffness * square),
            MechanismKind::CoreXy(it) => it.elasticity.map(|[x, _]| x.stiffness),
            MechanismKind::FiveBar(it) => it.elasticity.map(|[first, _]| first.stiffness),
            MechanismKind::Prrrp(it) => it.elasticity.map(|[first, _]| first.stiffness * square),
            _ => None,
        }
    }

    fn right(&self, motor: usize, material: &Material) -> Right {
        let rpm = Unit::RPM.factor;
        let largest = |all: &All, torque: bool| {
            let of = all.iter().flatten().map(|largest| largest.speed_and_torque(motor));
            of.map(|(speed, effort)| if torque { effort } else { speed }).fold(0.0, f64::max)
        };
        match self.machine {
            ThesisMachine::Cartesian => Right {
                speed: 0.24 / CARTESIAN_TRAVEL / rpm,
                // Source 003 eq. 3.17 with p per radian.
                torque: [1.93, 0.33][motor] * ACCELERATION * CARTESIAN_TRAVEL,
                speed_reasons: &[],
                torque_reasons: &["E-3.17"],
            },
            ThesisMachine::CoreXy => Right {
                speed: 0.24 * SQRT_2 / COREXY_TRAVEL / rpm,
                // Source 003 sec. 4.5 with the half of eq. 4.7: both directions at once.
                torque: (0.33 + 1.06) / 2.0 * ACCELERATION * COREXY_TRAVEL,
                speed_reasons: &[],
                torque_reasons: &["E-4.5", "E-vec"],
            },
            ThesisMachine::FiveBar => {
                let all = material.five_bar();
                Right {
                    speed: largest(&all, false) * FIVE_BAR_GEAR / rpm,
                    torque: largest(&all, true),
                    speed_reasons: &["E-7w", "E-5.3", "E-7i"],
                    torque_reasons: &["E-5.3", "E-5.11", "E-e"],
                }
            }
            ThesisMachine::Prrrp => {
                let all = material.prrrp();
                Right {
                    speed: largest(&all, false) / CART_TRAVEL / rpm,
                    torque: largest(&all, true),
                    speed_reasons: &["E-6.1", "E-6.3"],
                    torque_reasons: &["E-6.1", "E-6.3", "E-6.7"],
                }
            }
        }
    }

    /// The rows of one motor, with what the source leaves out below them.
    fn motor(&self, motor: usize, right: &Right, model: &Modelled) -> Vec<Cell> {
        let name = self.machine.name();
        let rpm = Unit::RPM.factor;
        let largest = |value: fn(&MotorMarks) -> f64| model.largest(motor, value);
        let (speed, load) = (largest(|marks| marks.speed), largest(|marks| marks.load));
        let cell = |row: &str, unit, values, reasons: &[&str]| {
            Cell::new(row, name, Some(motor as u8 + 1), unit, values, reasons)
        };
        let joined = |more: &[&'static str]| -> Vec<&'static str> {
            let mut all = right.torque_reasons.to_vec();
            all.extend_from_slice(more);
            all
        };
        let values = Values {
            printed: Some(self.speed[motor]),
            from_print: Some(self.speed_from_print[motor]),
            errata: Some(right.speed),
            modelled: Some(speed / rpm),
        };
        let row = "ω max motore";
        let mut cells = vec![cell(row, Unit::RPM, values, right.speed_reasons)];
        let values = Values {
            printed: Some(self.torque[motor]),
            errata: Some(right.torque),
            modelled: Some(load),
            ..Values::default()
        };
        cells.push(cell("C max teoria", Unit::TORQUE, values, right.torque_reasons));
        let values = Values {
            printed: Some(self.motor_torque[motor]),
            from_print: Some(self.torque[motor] / self.efficiency),
            errata: Some(right.torque / self.efficiency),
            modelled: Some(load / self.efficiency),
        };
        let reasons = match self.machine {
            ThesisMachine::CoreXy => joined(&["E-7eta", "E-7row"]),
            _ => joined(&["E-7row"]),
        };
        cells.push(cell("C max · η", Unit::TORQUE, values, &reasons));
        let values = Values {
            printed: Some(self.power[motor]),
            from_print: Some(self.motor_torque[motor] * self.speed[motor] * rpm),
            errata: Some(right.torque / self.efficiency * right.speed * rpm),
            modelled: Some(load / self.efficiency * speed),
        };
        cells.push(cell("P max", Unit::WATT, values, &joined(&["E-7p"])));
        let more: [(&str, Unit, f64); 5] = [
            ("ω max, free moves included", Unit::RPM, largest(|it| it.demand.speed_peak) / rpm),
            ("C of the rotor", Unit::TORQUE, largest(|it| it.demand.rotor_peak)),
            ("C of friction", Unit::TORQUE, largest(|it| it.demand.friction_peak)),
            ("C of the motor", Unit::TORQUE, largest(|it| it.demand.torque_peak)),
            ("P of the motor at one instant", Unit::WATT, largest(|it| it.demand.power_peak)),
        ];
        for (row, unit, value) in more {
            let values = Values { modelled: Some(value), ..Values::default() };
            cells.push(cell(row, unit, values, &[]));
        }
        cells
    }
}
