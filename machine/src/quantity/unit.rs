//! The symbols of units.

/// Powers of length, mass, time, current, angle and count.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Dimension(pub [i8; 6]);

impl Dimension {
    /// A plain number.
    pub const NONE: Self = Self([0; 6]);

    pub(super) const fn of(
        length: i8,
        mass: i8,
        time: i8,
        current: i8,
        angle: i8,
        count: i8,
    ) -> Self {
        Self([length, mass, time, current, angle, count])
    }

    /// This times `other` to the `power`; `None` beyond any sensible power.
    pub(super) fn times(self, other: Self, power: i8) -> Option<Self> {
        let mut product = self;
        for (mine, theirs) in product.0.iter_mut().zip(other.0) {
            *mine = mine.checked_add(theirs.checked_mul(power)?)?;
        }
        Some(product)
    }
}

/// One symbol: its size in SI, `multiply/divide`, and its dimension.
///
/// Two whole numbers where there are any, so that `120 mm` is the same `f64` as `0.12`.
pub(super) struct Unit {
    pub(super) symbol: &'static str,
    pub(super) multiply: f64,
    pub(super) divide: f64,
    pub(super) dimension: Dimension,
}

const fn unit(symbol: &'static str, multiply: f64, divide: f64, dimension: Dimension) -> Unit {
    Unit { symbol, multiply, divide, dimension }
}

const LENGTH: Dimension = Dimension::of(1, 0, 0, 0, 0, 0);
const MASS: Dimension = Dimension::of(0, 1, 0, 0, 0, 0);
const TIME: Dimension = Dimension::of(0, 0, 1, 0, 0, 0);
const CURRENT: Dimension = Dimension::of(0, 0, 0, 1, 0, 0);
const ANGLE: Dimension = Dimension::of(0, 0, 0, 0, 1, 0);
const COUNT: Dimension = Dimension::of(0, 0, 0, 0, 0, 1);
const FREQUENCY: Dimension = Dimension::of(0, 0, -1, 0, 1, 0);
const FORCE: Dimension = Dimension::of(1, 1, -2, 0, 0, 0);
const TORQUE: Dimension = Dimension::of(2, 1, -2, 0, 0, 0);
const VOLTAGE: Dimension = Dimension::of(2, 1, -3, -1, 0, 0);
const RESISTANCE: Dimension = Dimension::of(2, 1, -3, -2, 0, 0);
const INDUCTANCE: Dimension = Dimension::of(2, 1, -2, -2, 0, 0);

const TURN: f64 = core::f64::consts::TAU;

/// Every symbol that is understood. The micro sign and the Greek mu look alike and both occur.
#[rustfmt::skip]
pub(super) const UNITS: &[Unit] = &[
    unit("m", 1.0, 1.0, LENGTH), unit("mm", 1.0, 1e3, LENGTH), unit("cm", 1.0, 1e2, LENGTH),
    unit("um", 1.0, 1e6, LENGTH), unit("\u{b5}m", 1.0, 1e6, LENGTH), unit("\u{3bc}m", 1.0, 1e6, LENGTH),
    unit("nm", 1.0, 1e9, LENGTH), unit("in", 127.0, 5e3, LENGTH), unit("inch", 127.0, 5e3, LENGTH),
    unit("kg", 1.0, 1.0, MASS), unit("g", 1.0, 1e3, MASS),
    unit("s", 1.0, 1.0, TIME), unit("ms", 1.0, 1e3, TIME), unit("us", 1.0, 1e6, TIME),
    unit("\u{b5}s", 1.0, 1e6, TIME), unit("\u{3bc}s", 1.0, 1e6, TIME), unit("ns", 1.0, 1e9, TIME),
    unit("min", 60.0, 1.0, TIME),
    unit("A", 1.0, 1.0, CURRENT), unit("mA", 1.0, 1e3, CURRENT),
    unit("rad", 1.0, 1.0, ANGLE), unit("mrad", 1.0, 1e3, ANGLE), unit("deg", TURN, 360.0, ANGLE),
    unit("\u{b0}", TURN, 360.0, ANGLE), unit("rev", TURN, 1.0, ANGLE), unit("turn", TURN, 1.0, ANGLE),
    unit("rpm", TURN, 60.0, FREQUENCY), unit("Hz", TURN, 1.0, FREQUENCY), unit("kHz", 1e3 * TURN, 1.0, FREQUENCY),
    unit("count", 1.0, 1.0, COUNT), unit("counts", 1.0, 1.0, COUNT),
    unit("N", 1.0, 1.0, FORCE), unit("kN", 1e3, 1.0, FORCE), unit("mN", 1.0, 1e3, FORCE),
    unit("Nm", 1.0, 1.0, TORQUE), unit("mNm", 1.0, 1e3, TORQUE), unit("Ncm", 1.0, 1e2, TORQUE),
    unit("V", 1.0, 1.0, VOLTAGE), unit("mV", 1.0, 1e3, VOLTAGE),
    unit("ohm", 1.0, 1.0, RESISTANCE), unit("\u{3a9}", 1.0, 1.0, RESISTANCE), unit("\u{2126}", 1.0, 1.0, RESISTANCE),
    unit("mohm", 1.0, 1e3, RESISTANCE), unit("kohm", 1e3, 1.0, RESISTANCE),
    unit("H", 1.0, 1.0, INDUCTANCE), unit("mH", 1.0, 1e3, INDUCTANCE), unit("uH", 1.0, 1e6, INDUCTANCE),
    unit("\u{b5}H", 1.0, 1e6, INDUCTANCE), unit("\u{3bc}H", 1.0, 1e6, INDUCTANCE),
    unit("%", 1.0, 1e2, Dimension::NONE), unit("1", 1.0, 1.0, Dimension::NONE),
];

pub(super) fn find(symbol: &str) -> Option<&'static Unit> {
    UNITS.iter().find(|unit| unit.symbol == symbol)
}

/// The known symbol most like `symbol`, if any is near.
pub(super) fn nearest(symbol: &str) -> Option<&'static str> {
    crate::document::nearest(symbol, UNITS.iter().map(|unit| unit.symbol))
}
