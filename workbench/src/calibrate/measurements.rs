//! The file of measured poses: a header that names the columns, then a pose a line.

use machine::Pose;
use machine::kinematics::Joints;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use super::CalibrationError;

/// The columns: where the feet were [m], where the tool was measured [m], and how it was turned, a unit
/// quaternion.
const COLUMNS: [&str; 13] =
    ["xD", "yD", "xE", "yE", "xF", "yF", "x", "y", "z", "qw", "qx", "qy", "qz"];

/// How far the length of a quaternion may be from 1.
const UNIT: f64 = 1e-3;

/// One measured pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measurement {
    /// Its line of the file, from 1.
    pub line: usize,
    /// Where the motors said the feet were [m].
    pub feet: Joints<6>,
    /// Where the tool was, in the machine's frame.
    pub pose: Pose,
}

/// Reads the measurements of `file` from its `text`. Empty lines and those that begin with # say nothing.
///
/// # Errors
/// The first line that cannot be read, and what would be right.
pub fn read(file: &str, text: &str) -> Result<Vec<Measurement>, CalibrationError> {
    let refuse = |line: usize, text: String| CalibrationError::Measurements {
        file: file.to_owned(),
        line,
        text,
    };
    let lines = text.trim_start_matches('\u{feff}').lines().enumerate();
    let mut lines = lines
        .map(|(index, line)| (index + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    let due = || format!("the columns are {}", COLUMNS.join(","));
    let Some((number, header)) = lines.next() else {
        return Err(refuse(1, format!("there is no header: {}", due())));
    };
    let names: Vec<&str> = header.split(',').map(str::trim).collect();
    for name in &names {
        if !COLUMNS.contains(name) {
            return Err(refuse(number, format!("no column is called `{name}`: {}", due())));
        }
    }
    let mut places = [0; COLUMNS.len()];
    for (place, name) in places.iter_mut().zip(COLUMNS) {
        let mut found = names.iter().enumerate().filter(|(_, known)| **known == name);
        match (found.next(), found.next()) {
            (Some((index, _)), None) => *place = index,
            (None, _) => return Err(refuse(number, format!("`{name}` is missing: {}", due()))),
            _ => return Err(refuse(number, format!("`{name}` stands there twice: {}", due()))),
        }
    }
    let mut measurements = Vec::new();
    for (number, line) in lines {
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        if cells.len() != names.len() {
            let text = format!("{} numbers, and the header has {}", cells.len(), names.len());
            return Err(refuse(number, text));
        }
        let mut values = [0.0; COLUMNS.len()];
        for ((value, place), name) in values.iter_mut().zip(places).zip(COLUMNS) {
            let parsed = cells[place].parse::<f64>().ok().filter(|value| value.is_finite());
            *value = parsed.ok_or_else(|| {
                let text = format!("{name} is `{}`, and must be a finite number", cells[place]);
                refuse(number, text)
            })?;
        }
        let [.., x, y, z, qw, qx, qy, qz] = values;
        let quaternion = Quaternion::new(qw, qx, qy, qz);
        let length = quaternion.norm();
        if (length - 1.0).abs() > UNIT {
            return Err(refuse(
                number,
                format!("qw, qx, qy, qz have the length {length:.6}, and that of a rotation is 1"),
            ));
        }
        let rotation = UnitQuaternion::new_normalize(quaternion).to_rotation_matrix().into_inner();
        measurements.push(Measurement {
            line: number,
            feet: Joints::from_fn(|row, _| values[row]),
            pose: Pose { position: Vector3::new(x, y, z), rotation },
        });
    }
    Ok(measurements)
}
