//! Quantities: a number with a unit, read once at the edge and SI from then on.
//!
//! A unit is a product of symbols with powers: `m/s^2`, `m/s²`, `kg m^2`, `kg*m²`, `N·m·s/rad`.
//! A `/` divides by the one symbol after it. Angles and counts are dimensions of their own here,
//! so a torsional stiffness (`N m/rad`) cannot be mistaken for a torque (`N m`), nor a lead for a
//! length.

mod kind;
mod parse;
mod unit;

pub use kind::{
    Acceleration, Angle, AngularSpeed, Area, Bandwidth, CountsPerTurn, Current, Damping, Duration,
    Force, Inductance, Inertia, Jerk, JointStiffness, Kind, Lead, Length, Mass, Modulus, PulseRate,
    Resistance, SecondMoment, Speed, Stiffness, Torque, TorqueConstant, TorsionalDamping,
    TorsionalStiffness, Travel, TravelAcceleration, TravelJerk, TravelSpeed, Voltage,
};
pub use parse::{QuantityError, QuantityErrorKind};
pub use unit::Dimension;

/// The largest magnitude that is taken for a quantity of any machine, SI. Beyond it a value is a
/// slip, and products of a few such values could leave the range of an `f64`.
pub const LARGEST: f64 = 1e15;

/// The smallest positive magnitude that is taken for a quantity of any machine, SI.
pub const SMALLEST: f64 = 1e-15;

/// Reads `text` as a quantity of kind `K`, such as `"0.2 m/s"` for [`Speed`], and gives it in SI
/// units and radians.
///
/// # Errors
/// What is wrong with the text, where in it, and what would be right.
///
/// ```
/// use machine::quantity::{Length, Speed, read};
///
/// assert_eq!(read::<Speed>("12 m/min"), Ok(0.2));
/// assert_eq!(
///     read::<Length>("20 mmm").unwrap_err().to_string(),
///     "`mmm` is not a unit; did you mean `mm`?",
/// );
/// ```
pub fn read<K: Kind>(text: &str) -> Result<f64, QuantityError> {
    read_form::<K>(text).map(|(value, _)| value)
}

/// Reads `text` as [`read`], and says which of the kind's dimensions it has.
///
/// # Errors
/// As [`read`].
pub fn read_form<K: Kind>(text: &str) -> Result<(f64, usize), QuantityError> {
    let (value, dimension) = parse::parse(text).map_err(|error| error.due::<K>())?;
    let Some(form) = K::DIMENSIONS.iter().position(|known| *known == dimension) else {
        return Err(QuantityError::wrong_dimension::<K>(text, dimension));
    };
    if value.abs() > LARGEST {
        return Err(QuantityError::too_large::<K>(text));
    }
    Ok((value, form))
}

/// Reads `text` as a number with any unit or none: its value in SI units and radians, and what it is
/// measured in.
///
/// # Errors
/// What is wrong with the text.
pub fn read_any(text: &str) -> Result<(f64, Dimension), QuantityError> {
    parse::parse(text)
}

/// Reads `text` as a share, `"80 %"` or `"0.8"`.
///
/// # Errors
/// What is not a share, and what would be right.
pub fn read_share(text: &str) -> Result<f64, QuantityError> {
    match parse::parse(text)? {
        (value, Dimension::NONE) => Ok(value),
        (_, dimension) => Err(QuantityError::no_share(text, dimension)),
    }
}
