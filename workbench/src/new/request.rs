//! What is asked for, and what may be.

use super::Kind;
use machine::quantity::{Acceleration, Length, Mass, Speed, read};

/// What a machine is asked to be.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// Its kind.
    pub kind: Kind,
    /// Its name.
    pub name: String,
    /// Width and depth of the area [m].
    pub area: [f64; 2],
    /// Travel in z [m]; only of a kind that moves in z.
    pub z: f64,
    /// Mass of the head [kg].
    pub head: f64,
    /// Speed of the tool [m/s].
    pub speed: f64,
    /// Acceleration of the tool [m/s²].
    pub acceleration: f64,
    /// Steppers in place of DC motors.
    pub steppers: bool,
}

/// A number that can be asked for: its name, range and unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Argument {
    /// As on the command line, without dashes.
    pub name: &'static str,
    /// In SI units.
    pub range: [f64; 2],
    /// The unit for people, and how many SI units it is.
    pub unit: (&'static str, f64),
}

impl Argument {
    /// A side of the area.
    pub const AREA: Self = Self { name: "area", range: [0.02, 2.0], unit: ("mm", 1e-3) };
    /// Travel in z.
    pub const Z: Self = Self { name: "z", range: [0.01, 0.3], unit: ("mm", 1e-3) };
    /// Mass of the head.
    pub const HEAD: Self = Self { name: "head", range: [0.01, 20.0], unit: ("kg", 1.0) };
    /// Speed of the tool.
    pub const SPEED: Self = Self { name: "speed", range: [0.01, 2.0], unit: ("m/s", 1.0) };
    /// Acceleration of the tool.
    pub const ACCELERATION: Self =
        Self { name: "acceleration", range: [0.1, 50.0], unit: ("m/s^2", 1.0) };

    /// Reads `text`: a quantity, or a bare number in the argument's own unit.
    ///
    /// # Errors
    /// What is no such quantity or out of the range, with what would be right.
    pub fn read(self, text: &str) -> Result<f64, String> {
        let (unit, scale) = self.unit;
        let value = match text.trim().parse::<f64>() {
            Ok(bare) => bare * scale,
            Err(_) => match unit {
                "mm" => read::<Length>(text),
                "kg" => read::<Mass>(text),
                "m/s" => read::<Speed>(text),
                _ => read::<Acceleration>(text),
            }
            .map_err(|error| format!("--{}: {error}", self.name))?,
        };
        self.check(value).map_err(|error| error.to_string())?;
        Ok(value)
    }

    /// Reads two of them, as in `300 x 200 mm`; one without a unit has that of the other.
    ///
    /// # Errors
    /// As of [`Self::read`].
    pub fn read_two(self, text: &str) -> Result<[f64; 2], String> {
        let Some((first, second)) = text.split_once(['x', '×']) else {
            let Self { name, unit: (unit, _), .. } = self;
            return Err(format!("--{name} {text}: write two, such as \"300 x 200 {unit}\""));
        };
        // A bare number is in the unit of the other.
        let is_number = |text: &str| text.trim().parse::<f64>().is_ok();
        let with = |text: &str, other: &str| {
            let unit = other.char_indices().rev().find(|(at, _)| is_number(&other[..*at]));
            let lends = is_number(text) && !is_number(other);
            let unit = unit.filter(|_| lends).map_or("", |(at, _)| &other[at..]);
            format!("{} {}", text.trim(), unit.trim())
        };
        Ok([self.read(&with(first, second))?, self.read(&with(second, first))?])
    }

    /// `value`, in SI units, as a person writes it.
    pub fn written(self, value: f64) -> String {
        let (unit, scale) = self.unit;
        format!("{} {unit}", super::text::number(value / scale))
    }

    /// Whether `value`, in SI units, is within the range.
    ///
    /// # Errors
    /// Where it is not, with the range.
    pub fn check(self, value: f64) -> Result<(), OutOfRange> {
        // Put this way what is no number is out of range too; unit conversion may have rounded an end.
        let [low, high] = [self.range[0] * (1.0 - 1e-9), self.range[1] * (1.0 + 1e-9)];
        if (low..=high).contains(&value) {
            return Ok(());
        }
        let (unit, scale) = self.unit;
        let [value, from, to] =
            [value, self.range[0], self.range[1]].map(|value| super::text::number(value / scale));
        Err(OutOfRange { argument: self.name, value, from, to, unit })
    }
}

/// An argument that is out of its range.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("--{argument} {value} {unit}: from {from} to {to} {unit} can be asked for")]
pub struct OutOfRange {
    /// Which.
    pub argument: &'static str,
    /// What was asked for.
    pub value: String,
    /// The least.
    pub from: String,
    /// The largest.
    pub to: String,
    /// The unit of all three.
    pub unit: &'static str,
}

impl Request {
    /// What a machine of this kind is asked to be where nobody says more: about the shipped one.
    pub fn usual(kind: Kind) -> Self {
        let [width, depth] = kind.usual_area();
        let [speed, acceleration] = kind.usual_motion();
        Self {
            kind,
            name: kind.title().to_owned(),
            area: [width, depth],
            z: 0.05,
            head: 0.5,
            speed,
            acceleration,
            steppers: false,
        }
    }

    /// Whether all of it is within its range.
    ///
    /// # Errors
    /// The first that is not.
    pub fn check(&self) -> Result<(), OutOfRange> {
        for side in self.area {
            Argument::AREA.check(side)?;
        }
        if self.kind.has_z() {
            Argument::Z.check(self.z)?;
        }
        Argument::HEAD.check(self.head)?;
        Argument::SPEED.check(self.speed)?;
        Argument::ACCELERATION.check(self.acceleration)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn arguments_are_read_with_their_unit_or_without() {
        assert_eq!(Argument::HEAD.read("0.8"), Ok(0.8));
        assert_eq!(Argument::HEAD.read("800 g"), Ok(0.8));
        assert_eq!(Argument::AREA.read_two("300x200"), Ok([0.3, 0.2]));
        assert_eq!(Argument::AREA.read_two("30 x 20 cm"), Ok([0.3, 0.2]));
        assert_eq!(Argument::AREA.read_two("30 cm x 20"), Ok([0.3, 0.2]));
        assert_eq!(Argument::AREA.read_two("3e2 x 2e2 mm"), Ok([0.3, 0.2]));
        assert_eq!(Argument::AREA.read_two("0.3 m x 200 mm"), Ok([0.3, 0.2]));
        assert_eq!(Argument::AREA.read_two("2000 mm x 20 mm"), Ok([2.0, 0.02]));
        assert_eq!(Argument::SPEED.written(0.25), "0.25 m/s");
    }

    #[test]
    fn what_is_out_of_range_is_refused_with_its_name_value_and_range() {
        let refused = Argument::AREA.read_two("3000 x 200 mm").unwrap_err();
        assert_eq!(refused, "--area 3000 mm: from 20 to 2000 mm can be asked for");
        let refused = Argument::SPEED.read("5 m/s").unwrap_err();
        assert_eq!(refused, "--speed 5 m/s: from 0.01 to 2 m/s can be asked for");
        assert!(Argument::HEAD.read("NaN").is_err());
        assert!(Argument::HEAD.read("5 mm").unwrap_err().starts_with("--head: "));
        assert!(Argument::AREA.read_two("300").unwrap_err().contains("300 x 200 mm"));
        let request = Request { acceleration: 51.0, ..Request::usual(Kind::CoreXy) };
        assert_eq!(request.check().unwrap_err().argument, "acceleration");
    }
}
