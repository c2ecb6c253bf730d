//! Axes and actuators are counted from zero in the order of the machine file: an axis is one joint of the
//! mechanism, and has one actuator or several.

/// The most axes a machine can have; every per-axis array in a sample has this length.
pub const MAX_AXES: usize = 8;

/// The most actuators a machine can have; every per-actuator array in a sample has this length.
pub const MAX_ACTUATORS: usize = 16;

/// One number for each axis; entries beyond the machine's axes are 0.0.
pub type AxisArray = [f64; MAX_AXES];

/// One number for each actuator; entries beyond the machine's actuators are 0.0.
pub type ActuatorArray = [f64; MAX_ACTUATORS];

/// Copies `values` into an [`AxisArray`], the rest zero.
///
/// # Panics
/// If there are more than [`MAX_AXES`] values; machine files with more are refused when read.
pub fn axis_array(values: &[f64]) -> AxisArray {
    array(values)
}

/// Copies `values` into an [`ActuatorArray`], the rest zero.
///
/// # Panics
/// If there are more than [`MAX_ACTUATORS`] values; machine files with more are refused when read.
pub fn actuator_array(values: &[f64]) -> ActuatorArray {
    array(values)
}

fn array<const N: usize>(values: &[f64]) -> [f64; N] {
    let mut array = [0.0; N];
    array[..values.len()].copy_from_slice(values);
    array
}
