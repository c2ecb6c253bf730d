//! The machine file with what was chosen.

use super::candidate::Candidate;
use super::checks::SPEED_SHARE;
use super::need::AxisNeed;
use super::report::AxisSize;
use super::{SizeError, named};
use machine::{JointUnit, Motor};
use toml_edit::{DocumentMut, Item, TableLike, Value, value};

/// The machine file `text` with the chosen motors and gears of `axes`: its comments stay, but those of the
/// motors that are replaced, which stand where they stood and are said to be of the motor before.
///
/// # Errors
/// A file in which an axis has no table of its own.
pub fn machine_file(
    text: &str,
    axes: &[AxisSize],
    needs: &[AxisNeed],
) -> Result<String, SizeError> {
    let mut document: DocumentMut =
        text.parse().map_err(|error: toml_edit::TomlError| SizeError::Write(error.to_string()))?;
    for size in axes {
        let (Some(judged), Some(need)) = (&size.judged, named(needs, &size.axis)) else { continue };
        let missing = || SizeError::Write(format!("there is no table `axis.{}`", need.axis));
        let axis = document
            .get_mut("axis")
            .and_then(|axes| axes.get_mut(&need.axis))
            .ok_or_else(missing)?
            .as_table_like_mut()
            .ok_or_else(missing)?;
        write_axis(axis, &judged.candidate, need).ok_or_else(missing)?;
    }
    Ok(document.to_string())
}

/// `text` with each of these dotted keys naming another file, or none.
///
/// # Errors
/// A text that is not TOML.
pub fn with_files(text: &str, names: &[(&str, Option<String>)]) -> Result<String, SizeError> {
    let mut document: DocumentMut =
        text.parse().map_err(|error: toml_edit::TomlError| SizeError::Write(error.to_string()))?;
    for (key, name) in names {
        let Some((path, last)) = key.rsplit_once('.') else { continue };
        let root: Option<&mut dyn TableLike> = Some(document.as_table_mut());
        let table =
            path.split('.').fold(root, |table, key| table?.get_mut(key)?.as_table_like_mut());
        let Some(table) = table.filter(|table| table.contains_key(last)) else { continue };
        match name {
            Some(name) => set(table, last, Value::from(name.as_str())),
            None => {
                table.remove(last);
            }
        }
    }
    Ok(document.to_string())
}

fn write_axis(axis: &mut dyn TableLike, candidate: &Candidate, need: &AxisNeed) -> Option<()> {
    if candidate.gear_ratio != need.gear {
        set(table_of(axis, need, "gear")?, "gear", number(candidate.gear_ratio));
        let friction = table_of(axis, need, "friction")?.get_mut("friction")?;
        let friction = friction.as_table_like_mut()?;
        set(friction, "coulomb", quantity(candidate.friction.coulomb, "N m"));
        set(friction, "viscous", quantity(candidate.friction.viscous, "N m s/rad"));
        if need.actuator.brake.torque > 0.0 {
            // As strong at the joint as before.
            let brake = need.actuator.brake.torque * candidate.ratio / need.actuator.ratio;
            set(friction, "brake", quantity(brake, "N m"));
        }
    }
    let before = need.actuator.efficiency;
    let after = candidate.efficiency;
    if after.dynamic != before.dynamic {
        set(axis, "efficiency", number(after.dynamic));
    }
    if after.at_start != before.at_start {
        set(axis, "static_efficiency", number(after.at_start));
    }
    let reached = candidate.motor.largest_speed() * candidate.ratio;
    if need.velocity.is_some_and(|velocity| velocity > reached) {
        let limits = axis.get_mut("limits")?.as_table_like_mut()?;
        let unit = match need.unit {
            JointUnit::Length => "m/s",
            JointUnit::Angle => "rad/s",
        };
        let allowed: f64 = format!("{:.2e}", SPEED_SHARE * reached).parse().ok()?;
        set(limits, "velocity", quantity(allowed, unit));
    }
    let motor = table_of(axis, need, "motor")?.get_mut("motor")?.as_table_like_mut()?;
    let key = match &candidate.motor {
        Motor::Dc(_) => "dc",
        Motor::Stepper(_) => "stepper",
    };
    let item = motor.get_mut(key)?;
    if let Item::Table(table) = item {
        let prefix = table.decor().prefix().and_then(|prefix| prefix.as_str()).unwrap_or("");
        let prefix = comments(prefix, candidate);
        table.decor_mut().set_prefix(prefix);
    }
    let table = item.as_table_like_mut()?;
    let kept = kept(table, key);
    table.clear();
    for (key, value) in data(candidate).into_iter().chain(kept) {
        table.insert(key, Item::Value(value));
    }
    Some(())
}

/// The table in which `key` of the actuator of `need` stands: its own, or that of its axis.
fn table_of<'a>(
    axis: &'a mut dyn TableLike,
    need: &AxisNeed,
    key: &str,
) -> Option<&'a mut dyn TableLike> {
    let name = need.name.split_once('.').map(|(_, name)| name);
    let own = |name: &str| axis.get("actuator")?.as_table_like()?.get(name)?.as_table_like();
    match name {
        Some(name) if own(name).is_some_and(|own| own.contains_key(key)) => {
            let actuators = axis.get_mut("actuator")?.as_table_like_mut()?;
            actuators.get_mut(name)?.as_table_like_mut()
        }
        _ => Some(axis),
    }
}

/// What the table of a stepper says of its driver, which stays.
fn kept(table: &dyn TableLike, kind: &str) -> Vec<(&'static str, Value)> {
    if kind != "stepper" {
        return Vec::new();
    }
    let value = |key: &'static str| Some((key, table.get(key)?.as_value()?.clone()));
    ["damping"].into_iter().filter_map(value).collect()
}

/// What stands above the motor's table: what was chosen and where its data come from, then what stood there.
fn comments(before: &str, candidate: &Candidate) -> String {
    let gear = match (&candidate.gear, candidate.gear_ratio) {
        (Some(gear), _) => format!(" with the gear {gear}"),
        (None, 1.0) => String::new(),
        (None, ratio) => format!(" with a gear of {ratio}"),
    };
    let mut text = format!("\n# graver size: {}{gear}.\n", candidate.name);
    for source in &candidate.sources {
        text += &format!("# Source: {}.\n", source.trim_end_matches('.'));
    }
    let old: Vec<&str> = before.lines().filter(|line| line.trim_start().starts_with('#')).collect();
    if !old.is_empty() {
        text += "# Of the motor before:\n";
        for line in old {
            text += line;
            text.push('\n');
        }
    }
    text
}

/// The motor's table.
fn data(candidate: &Candidate) -> Vec<(&'static str, Value)> {
    let inertia = quantity(candidate.rotor_inertia, "kg m^2");
    match &candidate.motor {
        Motor::Dc(motor) => {
            let continuous = motor
                .continuous_current
                .map(|current| ("continuous_current", quantity(current, "A")));
            [("voltage", quantity(motor.voltage, "V")), ("current", quantity(motor.current, "A"))]
                .into_iter()
                .chain(continuous)
                .chain([
                    ("resistance", quantity(motor.resistance, "ohm")),
                    ("inductance", quantity(motor.inductance, "H")),
                    ("torque_constant", quantity(motor.torque_constant, "N m/A")),
                    ("rotor_inertia", inertia),
                ])
                .collect()
        }
        Motor::Stepper(motor) => vec![
            ("full_steps", number(motor.full_steps)),
            ("microsteps", number(motor.microsteps)),
            ("holding_torque", quantity(motor.holding_torque, "N m")),
            ("detent_torque", quantity(motor.detent_torque, "N m")),
            ("rotor_inertia", inertia),
            ("current", quantity(motor.current, "A")),
            ("resistance", quantity(motor.resistance, "ohm")),
            ("inductance", quantity(motor.inductance, "H")),
            ("voltage", quantity(motor.voltage, "V")),
            ("pulse_rate", quantity(motor.pulse_rate, "Hz")),
        ],
    }
}

/// Sets `key`, keeping what stands beside the value that was there.
fn set(table: &mut dyn TableLike, key: &str, mut new: Value) {
    if let Some(old) = table.get(key).and_then(Item::as_value) {
        *new.decor_mut() = old.decor().clone();
    }
    table.insert(key, value(new));
}

fn number(number: f64) -> Value {
    if number.fract() == 0.0 && number.abs() < 1e9 {
        Value::from(number as i64)
    } else {
        Value::from(number)
    }
}

/// A quantity as a person would write it, to nine digits: those that rounding of a unit leaves go.
fn quantity(value: f64, unit: &str) -> Value {
    let rounded: f64 = format!("{value:.8e}").parse().unwrap_or(value);
    let plain = rounded == 0.0 || (1e-3..1e6).contains(&rounded.abs());
    let text = if plain { format!("{rounded}") } else { format!("{rounded:e}") };
    Value::from(format!("{text} {unit}"))
}
