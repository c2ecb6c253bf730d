//! Functions with their first three derivatives, for test paths.

use core::ops::{Add, Div, Mul, Sub};

use messages::math::{acos, atan2, cos, sin};

/// The Taylor coefficients of a function of u.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Series(pub(super) [f64; 4]);

impl Series {
    pub(super) fn parameter(at: f64) -> Self {
        Self([at, 1.0, 0.0, 0.0])
    }

    pub(super) fn constant(value: f64) -> Self {
        Self([value, 0.0, 0.0, 0.0])
    }

    pub(super) fn scaled(self, factor: f64) -> Self {
        Self(self.0.map(|term| term * factor))
    }

    /// A function of this one, by its value and derivatives here.
    fn through(self, [value, first, second, third]: [f64; 4]) -> Self {
        let [_, one, two, three] = self.0;
        Self([
            value,
            first * one,
            first * two + second / 2.0 * one * one,
            first * three + second * one * two + third / 6.0 * one * one * one,
        ])
    }

    pub(super) fn sine(self) -> Self {
        let (s, c) = (sin(self.0[0]), cos(self.0[0]));
        self.through([s, c, -s, -c])
    }

    pub(super) fn cosine(self) -> Self {
        let (s, c) = (sin(self.0[0]), cos(self.0[0]));
        self.through([c, -s, -c, s])
    }

    pub(super) fn root(self) -> Self {
        let x = self.0[0];
        let r = x.sqrt();
        self.through([r, 0.5 / r, -0.25 / (r * x), 0.375 / (r * x * x)])
    }

    pub(super) fn arc_cosine(self) -> Self {
        let x = self.0[0];
        let d = 1.0 / (1.0 - x * x).sqrt();
        let cube = d * d * d;
        self.through([acos(x), -d, -x * cube, -cube - 3.0 * x * x * cube * d * d])
    }

    pub(super) fn arc_sine(self) -> Self {
        Self::constant(core::f64::consts::FRAC_PI_2) - self.arc_cosine()
    }

    /// The angle of the vector (x, y).
    pub(super) fn angle(y: Self, x: Self) -> Self {
        let rate = (x * y.derivative() - y * x.derivative()) / (x * x + y * y);
        let [a, b, c, _] = rate.0;
        Self([atan2(y.0[0], x.0[0]), a, b / 2.0, c / 3.0])
    }

    fn derivative(self) -> Self {
        let [_, a, b, c] = self.0;
        Self([a, 2.0 * b, 3.0 * c, 0.0])
    }

    /// The first three derivatives.
    pub(super) fn derivatives(self) -> [f64; 3] {
        let [_, a, b, c] = self.0;
        [a, 2.0 * b, 6.0 * c]
    }
}

impl Add for Series {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Self(core::array::from_fn(|k| self.0[k] + other.0[k]))
    }
}

impl Sub for Series {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + other.scaled(-1.0)
    }
}

impl Mul for Series {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        Self(core::array::from_fn(|k| (0..=k).map(|i| self.0[i] * other.0[k - i]).sum()))
    }
}

impl Div for Series {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let x = other.0[0];
        let inverse = [1.0 / x, -1.0 / (x * x), 2.0 / (x * x * x), -6.0 / (x * x * x * x)];
        self * other.through(inverse)
    }
}
