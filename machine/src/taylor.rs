//! Quantities with their first three time derivatives, so that an equation written once gives the
//! position, velocity, acceleration and jerk of what it computes, exact to rounding.
//!
//! An inverse kinematics written over [`Scalar`] works on plain numbers, at full speed, and on
//! [`Taylor`] series, where the chain rule is done by the arithmetic.

use core::ops::{Add, Div, Mul, Neg, Sub};

use messages::math;

/// What an equation of kinematics needs of its numbers: [`f64`], or [`Taylor`].
pub trait Scalar:
    Copy
    + core::fmt::Debug
    + From<f64>
    + Neg<Output = Self>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
{
    /// The plain number.
    fn value(self) -> f64;
    /// Square root of a number above 0.
    fn sqrt(self) -> Self;
    /// Sine and cosine of an angle [rad].
    fn sin_cos(self) -> (Self, Self);
    /// Angle of the point (`x`, `self`) [rad], which is not the origin.
    fn atan2(self, x: Self) -> Self;
    /// Arc sine of a number inside −1..1 [rad].
    fn asin(self) -> Self;
    /// Arc cosine of a number inside −1..1 [rad].
    fn acos(self) -> Self;
}

impl Scalar for f64 {
    fn value(self) -> f64 {
        self
    }

    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }

    fn sin_cos(self) -> (Self, Self) {
        math::sin_cos(self)
    }

    fn atan2(self, x: Self) -> Self {
        math::atan2(self, x)
    }

    fn asin(self) -> Self {
        math::asin(self)
    }

    fn acos(self) -> Self {
        math::acos(self)
    }
}

/// A value and its first three derivatives by time.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Taylor {
    /// The value.
    pub value: f64,
    /// Its first derivative [1/s].
    pub first: f64,
    /// Its second derivative [1/s²].
    pub second: f64,
    /// Its third derivative [1/s³].
    pub third: f64,
}

impl Taylor {
    /// A value and its derivatives.
    pub fn new(value: f64, first: f64, second: f64, third: f64) -> Self {
        Self { value, first, second, third }
    }

    /// What changes with `rate`, `rate_first` and `rate_second` as its own three derivatives.
    pub(crate) fn integral(value: f64, rate: Self) -> Self {
        Self { value, first: rate.value, second: rate.first, third: rate.second }
    }

    /// Its own derivative; the highest order is lost and 0.
    pub fn derivative(self) -> Self {
        Self { value: self.first, first: self.second, second: self.third, third: 0.0 }
    }
}

impl From<f64> for Taylor {
    fn from(value: f64) -> Self {
        Self { value, ..Self::default() }
    }
}

impl Neg for Taylor {
    type Output = Self;

    fn neg(self) -> Self {
        self * -1.0
    }
}

impl Add for Taylor {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            first: self.first + other.first,
            second: self.second + other.second,
            third: self.third + other.third,
        }
    }
}

impl Sub for Taylor {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Taylor {
    type Output = Self;

    // Leibniz: (fg)⁽ⁿ⁾ = Σ binomial(n, k)·f⁽ᵏ⁾·g⁽ⁿ⁻ᵏ⁾.
    fn mul(self, other: Self) -> Self {
        let (f, g) = (self, other);
        Self {
            value: f.value * g.value,
            first: f.first * g.value + f.value * g.first,
            second: f.second * g.value + 2.0 * f.first * g.first + f.value * g.second,
            third: f.third * g.value
                + 3.0 * (f.second * g.first + f.first * g.second)
                + f.value * g.third,
        }
    }
}

impl Div for Taylor {
    type Output = Self;

    // From q·g = f, order by order.
    fn div(self, other: Self) -> Self {
        let (f, g) = (self, other);
        let value = f.value / g.value;
        let first = (f.first - value * g.first) / g.value;
        let second = (f.second - 2.0 * first * g.first - value * g.second) / g.value;
        let third =
            (f.third - 3.0 * (second * g.first + first * g.second) - value * g.third) / g.value;
        Self { value, first, second, third }
    }
}

impl Add<f64> for Taylor {
    type Output = Self;

    fn add(self, other: f64) -> Self {
        Self { value: self.value + other, ..self }
    }
}

impl Sub<f64> for Taylor {
    type Output = Self;

    fn sub(self, other: f64) -> Self {
        self + -other
    }
}

impl Mul<f64> for Taylor {
    type Output = Self;

    fn mul(self, factor: f64) -> Self {
        Self {
            value: self.value * factor,
            first: self.first * factor,
            second: self.second * factor,
            third: self.third * factor,
        }
    }
}

impl Div<f64> for Taylor {
    type Output = Self;

    fn div(self, divisor: f64) -> Self {
        Self {
            value: self.value / divisor,
            first: self.first / divisor,
            second: self.second / divisor,
            third: self.third / divisor,
        }
    }
}

impl Scalar for Taylor {
    fn value(self) -> f64 {
        self.value
    }

    // From r·r = f, order by order.
    fn sqrt(self) -> Self {
        let value = self.value.sqrt();
        let twice = 2.0 * value;
        let first = self.first / twice;
        let second = (self.second - 2.0 * first * first) / twice;
        let third = (self.third - 6.0 * first * second) / twice;
        Self { value, first, second, third }
    }

    // s′ = c·f′ and c′ = −s·f′, order by order.
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = math::sin_cos(self.value);
        let Self { first, second, third, .. } = self;
        let square = first * first;
        let bend = third - square * first;
        let cross = 3.0 * first * second;
        (
            Self {
                value: s,
                first: c * first,
                second: c * second - s * square,
                third: c * bend - s * cross,
            },
            Self {
                value: c,
                first: -s * first,
                second: -s * second - c * square,
                third: -s * bend - c * cross,
            },
        )
    }

    // φ′ = (x·y′ − y·x′)/(x² + y²).
    fn atan2(self, x: Self) -> Self {
        let y = self;
        let rate = (x * y.derivative() - y * x.derivative()) / (x * x + y * y);
        Self::integral(math::atan2(y.value, x.value), rate)
    }

    // φ′ = f′/√(1 − f²).
    fn asin(self) -> Self {
        let root = (-(self * self) + 1.0).sqrt();
        Self::integral(math::asin(self.value), self.derivative() / root)
    }

    fn acos(self) -> Self {
        let root = (-(self * self) + 1.0).sqrt();
        Self::integral(math::acos(self.value), -(self.derivative() / root))
    }
}

#[cfg(test)]
mod tests {
    use super::{Scalar, Taylor};

    /// A motion with all derivatives, and the same motion `time` later.
    fn later(motion: Taylor, time: f64) -> Taylor {
        let Taylor { value, first, second, third } = motion;
        Taylor {
            value: value + time * (first + time * (second / 2.0 + time * third / 6.0)),
            first: first + time * (second + time * third / 2.0),
            second: second + time * third,
            third,
        }
    }

    /// Every derivative of `function` against central differences of the one below it.
    #[track_caller]
    fn check(name: &str, function: impl Fn(Taylor, Taylor) -> Taylor) {
        let (f, g) = (Taylor::new(0.31, 0.7, -1.3, 2.1), Taylor::new(0.83, -0.4, 0.9, -1.7));
        let step = 1e-5;
        let at = |time: f64| function(later(f, time), later(g, time));
        let (behind, here, ahead) = (at(-step), at(0.0), at(step));
        for (found, low, high) in [
            (here.first, behind.value, ahead.value),
            (here.second, behind.first, ahead.first),
            (here.third, behind.second, ahead.second),
        ] {
            let expected = (high - low) / (2.0 * step);
            assert!(
                (found - expected).abs() < 1e-7 * (1.0 + found.abs()),
                "{name}: {found} {expected}"
            );
        }
    }

    #[test]
    fn every_operation_has_the_derivatives_of_its_values() {
        check("product", |f, g| f * g);
        check("quotient", |f, g| f / g);
        check("root", |f, _| f.sqrt());
        check("sine", |f, _| f.sin_cos().0);
        check("cosine", |f, _| f.sin_cos().1);
        check("arc tangent", |f, g| f.atan2(g));
        check("arc tangent, third quadrant", |f, g| (-f).atan2(-g));
        check("arc sine", |f, _| f.asin());
        check("arc cosine", |f, _| f.acos());
        check("all at once", |f, g| ((f * 2.0 - g).sin_cos().0 / (g + 3.0)).asin() * g - 1.0);
    }
}
