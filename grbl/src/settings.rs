//! The `$n=` settings: what the machine file says, told as grbl's numbers, and the few that a client may change.

use machine::operating::{InputFunction, Side};
use machine::{Directions, Machine};

use crate::codes::ErrorCode;

/// Bit of `$10`: machine position, else work position.
pub const MACHINE_POSITION: u8 = 1;
/// Bit of `$10`: what is left of the buffers.
pub const BUFFER: u8 = 2;

/// Seconds in a minute.
const MINUTE: f64 = 60.0;
/// Millimetres in a metre.
const MILLIMETRES: f64 = 1e3;
/// A limit that the machine file does not give is told as this [mm/s²].
const UNLIMITED: f64 = 100_000.0;

/// Settings that mean nothing on this machine: kept and told as they were set, without effect.
const IDLE: [(u16, &str); 10] = [
    (0, "10"),
    (1, "255"),
    (2, "0"),
    (3, "0"),
    (4, "0"),
    (5, "0"),
    (6, "0"),
    (11, "0.010"),
    (12, "0.002"),
    (26, "10"),
];

/// All settings of one machine.
#[derive(Debug, Clone)]
pub struct Settings {
    /// What a status report tells, `$10`.
    pub report: u8,
    /// Whether reports are in inches, `$13`.
    pub in_inches: bool,
    /// The S word for full power, `$30`.
    pub full_scale: f64,
    idle: [(u16, String); IDLE.len()],
    /// Those of the machine file, in order.
    fixed: Vec<(u16, String)>,
    defaults: [f64; 1],
}

impl Settings {
    /// Those of `machine`.
    pub fn of(machine: &Machine) -> Self {
        let full_scale = machine.gcode.words.full_scale;
        Self {
            report: MACHINE_POSITION | BUFFER,
            in_inches: false,
            full_scale,
            idle: IDLE.map(|(number, value)| (number, value.to_owned())),
            fixed: fixed(machine),
            defaults: [full_scale],
        }
    }

    /// As they were at first.
    pub fn restore(&mut self) {
        self.report = MACHINE_POSITION | BUFFER;
        self.in_inches = false;
        [self.full_scale] = self.defaults;
        self.idle = IDLE.map(|(number, value)| (number, value.to_owned()));
    }

    /// All of them as `$$` tells them, by number.
    pub fn all(&self) -> Vec<(u16, String)> {
        let mut all = self.fixed.clone();
        all.extend(self.idle.iter().cloned());
        all.push((10, self.report.to_string()));
        all.push((13, u8::from(self.in_inches).to_string()));
        all.push((30, short(self.full_scale)));
        all.sort_by_key(|(number, _)| *number);
        all
    }

    /// Sets one.
    ///
    /// # Errors
    /// One that is not known, a value that it cannot have, or one that only the machine file changes; the words say
    /// what would be right.
    pub fn set(&mut self, number: u16, text: &str) -> Result<(), (ErrorCode, String)> {
        let value: f64 =
            text.trim().parse().ok().filter(|value: &f64| value.is_finite()).ok_or_else(|| {
                (ErrorCode::BadNumber, format!("${number}={text}: the value is no number"))
            })?;
        if value < 0.0 {
            return Err((ErrorCode::Negative, format!("${number}={text}: the value is negative")));
        }
        if let Some((_, kept)) = self.idle.iter_mut().find(|(it, _)| *it == number) {
            *kept = text.trim().to_owned();
            return Ok(());
        }
        let outside =
            |range: &str| Err((ErrorCode::BadNumber, format!("${number}={text}: it is {range}")));
        match number {
            10 if value <= 255.0 && value.fract() == 0.0 => self.report = value as u8,
            10 => return outside("a whole number up to 255"),
            13 if value == 0.0 || value == 1.0 => self.in_inches = value == 1.0,
            13 => return outside("0 or 1"),
            30 if (1.0..=1e6).contains(&value) => self.full_scale = value,
            30 => return outside("from 1 to 1000000"),
            _ => return self.keep(number, value),
        }
        Ok(())
    }

    /// Takes the value that a setting of the machine file has, and no other.
    fn keep(&self, number: u16, value: f64) -> Result<(), (ErrorCode, String)> {
        let Some((_, own)) = self.fixed.iter().find(|(it, _)| *it == number) else {
            return Err((ErrorCode::BadStatement, format!("there is no setting ${number}")));
        };
        let is_same =
            own.parse().is_ok_and(|own: f64| (own - value).abs() <= 1e-3 * own.abs().max(1e-3));
        if is_same {
            return Ok(());
        }
        let code = if number == 32 { ErrorCode::LaserMode } else { ErrorCode::BadStatement };
        Err((code, format!("${number} stays {own}: it is what the machine file says")))
    }
}

/// The settings that the machine file says.
fn fixed(machine: &Machine) -> Vec<(u16, String)> {
    let operating = &machine.operating;
    let has_limits =
        operating.inputs.iter().any(|input| matches!(input.function, InputFunction::Limit { .. }));
    let homing: Vec<_> = operating.homing.iter().enumerate().collect();
    let towards_lower = homing.iter().filter_map(|(axis, homing)| {
        let homing = homing.as_ref()?;
        (homing.side == Side::Lower).then(|| machine.axes.get(*axis)?.name.chars().next())?
    });
    let direction_mask = towards_lower
        .filter_map(|name| "xyz".find(name))
        .fold(0_u32, |mask, axis| mask | 1 << axis);
    let speeds = homing.iter().filter_map(|(_, homing)| homing.as_ref());
    let per_minute = |speed: f64| speed * MILLIMETRES * MINUTE;
    let slowest = |speed: fn(&machine::operating::Homing) -> f64| {
        speeds.clone().map(speed).fold(f64::INFINITY, f64::min)
    };
    let told = |speed: f64| if speed.is_finite() { per_minute(speed) } else { 0.0 };
    let least = machine.laser.min_power * machine.gcode.words.full_scale;
    let mut all = vec![
        (20, "1".to_owned()),
        (21, u8::from(has_limits).to_string()),
        // A machine without anything to find knows its place.
        (22, "1".to_owned()),
        (23, direction_mask.to_string()),
        (24, format!("{:.3}", told(slowest(|homing| homing.latch_speed)))),
        (25, format!("{:.3}", told(slowest(|homing| homing.speed)))),
        (27, "0.000".to_owned()),
        (31, short(least)),
        (32, "1".to_owned()),
    ];
    let directions = Directions::of(machine);
    for (index, name) in ["x", "y", "z"].into_iter().enumerate() {
        let number = index as u16;
        let axis = machine.axes.iter().find(|axis| axis.name == name && axis.unit.name() == "m");
        let (speed, acceleration) = match (axis, directions.lever(index)) {
            (Some(axis), _) => (axis.limits.velocity, axis.limits.acceleration),
            (None, Some(lever)) => {
                let most = |limit: fn(&machine::AxisLimits) -> f64| {
                    let limits = machine.axes.iter().zip(lever).filter(|(_, way)| **way != 0.0);
                    limits
                        .map(|(axis, way)| limit(&axis.limits) / way.abs())
                        .fold(f64::INFINITY, f64::min)
                };
                (most(|limits| limits.velocity), most(|limits| limits.acceleration))
            }
            // The tool goes there by several joints: as fast as along any path.
            (None, None) => (machine.path.rapid, machine.path.acceleration),
        };
        let speed = speed.min(machine.path.rapid);
        let acceleration = acceleration.min(machine.path.acceleration);
        let acceleration =
            if acceleration.is_finite() { acceleration * MILLIMETRES } else { UNLIMITED };
        let travel = (machine.area.upper[index] - machine.area.lower[index]) * MILLIMETRES;
        all.push((100 + number, counts(machine, name)));
        all.push((110 + number, format!("{:.3}", per_minute(speed))));
        all.push((120 + number, format!("{acceleration:.3}")));
        all.push((130 + number, format!("{travel:.3}")));
    }
    all
}

/// Counts of the drive for each millimetre of an axis; what grbl's default is where there is no such number.
fn counts(machine: &Machine, name: &str) -> String {
    let axis = machine.axes.iter().find(|axis| axis.name == name && axis.unit.name() == "m");
    let actuator = axis.and_then(|axis| machine.actuators.get(axis.actuators.start));
    let per_millimetre = actuator
        .map_or(250.0, |actuator| 1.0 / (actuator.count() * actuator.ratio.abs() * MILLIMETRES));
    format!("{per_millimetre:.3}")
}

/// A number without zeros at its end.
fn short(value: f64) -> String {
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}
