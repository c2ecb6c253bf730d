//! Axes are counted from zero in the order of the machine file.

/// The most axes a machine can have; every per-axis array in a sample has this length.
pub const MAX_AXES: usize = 8;

/// One number for each axis; entries beyond the machine's axes are 0.0.
pub type AxisArray = [f64; MAX_AXES];

/// Copies `values` into an [`AxisArray`], the rest zero.
///
/// # Panics
/// If there are more than [`MAX_AXES`] values; machine files with more are refused when read.
pub fn axis_array(values: &[f64]) -> AxisArray {
    let mut array = [0.0; MAX_AXES];
    array[..values.len()].copy_from_slice(values);
    array
}
