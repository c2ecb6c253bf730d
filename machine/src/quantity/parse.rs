//! The reader of quantities and what it says when a text is none.

use core::fmt;
use core::ops::Range;

use super::kind::{Kind, NAMES};
use super::unit::{Dimension, find, nearest};

/// Why a text is not the quantity that is needed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct QuantityError {
    /// What went wrong.
    pub kind: QuantityErrorKind,
    /// Which bytes of the text it concerns.
    pub span: Range<usize>,
    message: String,
    help: Option<String>,
}

/// What can be wrong with a quantity.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum QuantityErrorKind {
    /// It does not start with a number.
    NotANumber,
    /// The number is NaN, infinite, or too large for any machine.
    NotFinite,
    /// A number without a unit.
    NoUnit,
    /// A symbol that no unit has.
    UnknownUnit,
    /// Something in the unit that is neither symbol, power nor operator.
    Malformed,
    /// A unit of another kind of quantity.
    WrongDimension,
}

impl fmt::Display for QuantityError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}", self.message)?;
        match &self.help {
            Some(help) => write!(formatter, "; {help}"),
            None => Ok(()),
        }
    }
}

impl core::error::Error for QuantityError {}

impl QuantityError {
    fn new(kind: QuantityErrorKind, span: Range<usize>, message: String) -> Self {
        Self { kind, span, message, help: None }
    }

    /// What is wrong.
    pub fn message(&self) -> &str {
        &self.message
    }

    /// What would be right.
    pub fn help(&self) -> Option<&str> {
        self.help.as_deref()
    }

    /// Adds what is needed where the text alone could not tell.
    pub(super) fn due<K: Kind>(mut self) -> Self {
        if self.help.is_none() {
            self.help = Some(format!("write {} such as \"{}\"", K::NAME, K::EXAMPLE));
        }
        self
    }

    pub(super) fn wrong_dimension<K: Kind>(text: &str, dimension: Dimension) -> Self {
        let error = if dimension == Dimension::NONE {
            Self::new(
                QuantityErrorKind::NoUnit,
                0..text.len(),
                format!("`{}` has no unit, but {} is needed", text.trim(), K::NAME),
            )
        } else {
            Self::new(
                QuantityErrorKind::WrongDimension,
                0..text.len(),
                format!("`{}` is {}, but {} is needed", text.trim(), name_of(dimension), K::NAME),
            )
        };
        error.due::<K>()
    }

    pub(super) fn no_share(text: &str, dimension: Dimension) -> Self {
        Self::new(
            QuantityErrorKind::WrongDimension,
            0..text.len(),
            format!("`{}` is {}, but a share is needed", text.trim(), name_of(dimension)),
        )
    }

    pub(super) fn too_large<K: Kind>(text: &str) -> Self {
        Self::new(
            QuantityErrorKind::NotFinite,
            0..text.len(),
            format!("`{}` is beyond any machine", text.trim()),
        )
        .due::<K>()
    }
}

/// What a quantity of this dimension is called.
fn name_of(dimension: Dimension) -> &'static str {
    NAMES
        .iter()
        .find(|(_, dimensions)| dimensions.contains(&dimension))
        .map_or("something else", |(name, _)| name)
}

/// The value in SI and the dimension of `text`.
pub(super) fn parse(text: &str) -> Result<(f64, Dimension), QuantityError> {
    let start = text.len() - text.trim_start().len();
    let end = text.trim_end().len().max(start);
    let body = text.get(start..end).unwrap_or_default();
    let digits = number_length(body);
    let (number, unit) = body.split_at(digits);
    let span = start..start + digits;
    if digits == 0 {
        let word = body.trim_start_matches(['+', '-']).to_ascii_lowercase();
        if word.starts_with("nan") || word.starts_with("inf") {
            return Err(QuantityError::new(
                QuantityErrorKind::NotFinite,
                start..end,
                format!("`{body}` is not a finite number"),
            ));
        }
        return Err(QuantityError::new(
            QuantityErrorKind::NotANumber,
            start..end,
            format!("`{body}` does not start with a number"),
        ));
    }
    let value: f64 = number.parse().map_err(|_| {
        QuantityError::new(
            QuantityErrorKind::NotANumber,
            span.clone(),
            format!("`{number}` is not a number"),
        )
    })?;
    let (multiply, divide, dimension) = parse_unit(unit, start + digits)?;
    let value = value * multiply / divide;
    if !value.is_finite() {
        return Err(QuantityError::new(
            QuantityErrorKind::NotFinite,
            span,
            format!("`{number}` is beyond any machine"),
        ));
    }
    Ok((value, dimension))
}

/// The length of the decimal number that `text` starts with, 0 for none.
fn number_length(text: &str) -> usize {
    let bytes = text.as_bytes();
    let digits =
        |from: usize| bytes.iter().skip(from).take_while(|byte| byte.is_ascii_digit()).count();
    let sign = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let whole = digits(sign);
    let mut length = sign + whole;
    let mut fraction = 0;
    if bytes.get(length) == Some(&b'.') {
        fraction = digits(length + 1);
        length += 1 + fraction;
    }
    if whole + fraction == 0 {
        return 0;
    }
    if matches!(bytes.get(length), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(length + 1), Some(b'+' | b'-')));
        let exponent = digits(length + 1 + sign);
        if exponent > 0 {
            length += 1 + sign + exponent;
        }
    }
    length
}

/// Size in SI, as a fraction, and dimension of the unit `text`, which starts at byte `offset` of
/// the quantity.
fn parse_unit(text: &str, offset: usize) -> Result<(f64, f64, Dimension), QuantityError> {
    let mut above = 1.0;
    let mut below = 1.0;
    let mut dimension = Dimension::NONE;
    let mut divide = false;
    let mut pending: Option<Range<usize>> = None;
    let mut rest = text;
    loop {
        let trimmed = rest.trim_start();
        let at = offset + text.len() - trimmed.len();
        let Some(first) = trimmed.chars().next() else { break };
        if matches!(first, '*' | '·' | '⋅' | '×' | '/') {
            if pending.is_some() || (first != '/' && at == offset) {
                return Err(malformed(first, at));
            }
            divide = first == '/';
            pending = Some(at..at + first.len_utf8());
            rest = trimmed.get(first.len_utf8()..).unwrap_or_default();
            continue;
        }
        let length = symbol_length(trimmed);
        if length == 0 {
            return Err(malformed(first, at));
        }
        let (symbol, after) = trimmed.split_at(length);
        let unit = find(symbol).ok_or_else(|| unknown(symbol, at))?;
        let (power, length) = parse_power(after, at + symbol.len())?;
        let signed = if divide { -power } else { power };
        for _ in 0..power.unsigned_abs() {
            let (up, down) = (unit.multiply, unit.divide);
            let (up, down) = if signed < 0 { (down, up) } else { (up, down) };
            above *= up;
            below *= down;
        }
        dimension = dimension.times(unit.dimension, signed).ok_or_else(|| malformed(first, at))?;
        divide = false;
        pending = None;
        rest = after.get(length..).unwrap_or_default();
    }
    match pending {
        Some(span) => Err(QuantityError::new(
            QuantityErrorKind::Malformed,
            span,
            "the unit ends with an operator".to_owned(),
        )),
        None => Ok((above, below, dimension)),
    }
}

/// The length of the symbol that `text` starts with: letters, or one of the signs `%`, `°`, `1`.
fn symbol_length(text: &str) -> usize {
    match text.chars().next() {
        Some(sign @ ('%' | '°' | '1')) => sign.len_utf8(),
        _ => text.chars().take_while(|letter| letter.is_alphabetic()).map(char::len_utf8).sum(),
    }
}

/// The power that `text` starts with and its length in bytes; 1 and 0 for none.
fn parse_power(text: &str, at: usize) -> Result<(i8, usize), QuantityError> {
    if let Some(after) = text.strip_prefix('^') {
        let negative = after.starts_with('-');
        let digit = after.chars().nth(usize::from(negative)).and_then(|digit| digit.to_digit(10));
        return match digit {
            Some(digit @ 1..=9) => {
                let power = digit as i8;
                Ok((if negative { -power } else { power }, 2 + usize::from(negative)))
            }
            _ => Err(QuantityError::new(
                QuantityErrorKind::Malformed,
                at..at + 1,
                "`^` takes a power from 1 to 9".to_owned(),
            )),
        };
    }
    let (negative, after) = match text.strip_prefix('⁻') {
        Some(after) => (true, after),
        None => (false, text),
    };
    let sign = text.len() - after.len();
    let (power, length) = match after.chars().next() {
        Some(digit @ '¹') => (1, digit.len_utf8()),
        Some(digit @ '²') => (2, digit.len_utf8()),
        Some(digit @ '³') => (3, digit.len_utf8()),
        Some(digit @ '⁴') => (4, digit.len_utf8()),
        _ if negative => return Err(malformed('⁻', at)),
        _ => return Ok((1, 0)),
    };
    Ok((if negative { -power } else { power }, sign + length))
}

fn malformed(found: char, at: usize) -> QuantityError {
    QuantityError::new(
        QuantityErrorKind::Malformed,
        at..at + found.len_utf8(),
        format!("`{found}` has no place in a unit here"),
    )
}

fn unknown(symbol: &str, at: usize) -> QuantityError {
    let mut error = QuantityError::new(
        QuantityErrorKind::UnknownUnit,
        at..at + symbol.len(),
        format!("`{symbol}` is not a unit"),
    );
    error.help = nearest(symbol).map(|near| format!("did you mean `{near}`?"));
    error
}
