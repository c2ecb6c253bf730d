//! Numbers of a program as they may be written in LinuxCNC: digits, parameters, functions, and
//! expressions in brackets.
//!
//! Values and precedence are those of LinuxCNC's interpreter: `**` before `*`, `/` and `MOD`, before `+`
//! and `-`, before comparisons, before `AND`, `OR` and `XOR`, and from left to right among equals. Angles
//! are in degrees.

use std::ops::Range;

use messages::math;

use super::error::{Needs, Refusal};

/// How deep brackets may be nested.
const DEEPEST: usize = 50;

/// Differences that `EQ` does not see.
const EQUAL: f64 = 1e-4;

/// How near to a whole number an index must be.
const WHOLE: f64 = 1e-4;

/// What parameters are worth.
pub(super) trait Parameters {
    /// Parameter `index`, `None` where it is none of the program's.
    fn numbered(&self, index: u32) -> Option<f64>;
    /// The parameter `name`, in lower case and without blanks; `None` where it has no value.
    fn named(&self, name: &str) -> Option<f64>;
}

/// Whose value is set.
#[derive(Debug, Clone, PartialEq, Eq, Hash)]
pub(super) enum Target {
    Numbered(u32),
    /// In lower case and without blanks.
    Named(String),
}

/// Reads one expression after the other from a line.
pub(super) struct Reader<'a> {
    pub(super) line: &'a [u8],
    pub(super) at: usize,
    parameters: &'a dyn Parameters,
    depth: usize,
}

type Result<T> = std::result::Result<T, Box<Refusal>>;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Operator {
    Power,
    Times,
    Over,
    Modulo,
    Plus,
    Minus,
    Equal,
    NotEqual,
    Greater,
    GreaterOrEqual,
    Less,
    LessOrEqual,
    And,
    Or,
    ExclusiveOr,
}

const OPERATORS: [(&[u8], Operator); 15] = [
    (b"**", Operator::Power),
    (b"*", Operator::Times),
    (b"/", Operator::Over),
    (b"mod", Operator::Modulo),
    (b"+", Operator::Plus),
    (b"-", Operator::Minus),
    (b"eq", Operator::Equal),
    (b"ne", Operator::NotEqual),
    (b"gt", Operator::Greater),
    (b"ge", Operator::GreaterOrEqual),
    (b"lt", Operator::Less),
    (b"le", Operator::LessOrEqual),
    (b"and", Operator::And),
    (b"or", Operator::Or),
    (b"xor", Operator::ExclusiveOr),
];

/// Functions; the longest first of those that begin alike.
const FUNCTIONS: [&[u8]; 14] = [
    b"exists", b"round", b"acos", b"asin", b"atan", b"sqrt", b"abs", b"cos", b"exp", b"fix",
    b"fup", b"sin", b"tan", b"ln",
];

impl Operator {
    /// Operators of a higher rank bind closer.
    fn rank(self) -> u8 {
        match self {
            Self::Power => 5,
            Self::Times | Self::Over | Self::Modulo => 4,
            Self::Plus | Self::Minus => 3,
            Self::And | Self::Or | Self::ExclusiveOr => 1,
            _ => 2,
        }
    }

    /// What it makes of two numbers, or why it cannot.
    fn apply(self, left: f64, right: f64) -> std::result::Result<f64, &'static str> {
        let truth = |is: bool| Ok(f64::from(u8::from(is)));
        match self {
            Self::Power if left < 0.0 && right.floor() != right => {
                Err("a negative number has no power that is not whole")
            }
            Self::Power => Ok(math::pow(left, right)),
            Self::Times => Ok(left * right),
            Self::Over if right == 0.0 => Err("a division by zero"),
            Self::Over => Ok(left / right),
            Self::Modulo => {
                let rest = left % right;
                Ok(if rest < 0.0 { rest + right.abs() } else { rest })
            }
            Self::Plus => Ok(left + right),
            Self::Minus => Ok(left - right),
            Self::Equal => truth((left - right).abs() < EQUAL),
            Self::NotEqual => truth((left - right).abs() >= EQUAL),
            Self::Greater => truth(left > right),
            Self::GreaterOrEqual => truth(left >= right),
            Self::Less => truth(left < right),
            Self::LessOrEqual => truth(left <= right),
            Self::And => truth(left != 0.0 && right != 0.0),
            Self::Or => truth(left != 0.0 || right != 0.0),
            Self::ExclusiveOr => truth((left != 0.0) != (right != 0.0)),
        }
    }
}

impl<'a> Reader<'a> {
    /// From `at` of `line` on.
    pub(super) fn new(line: &'a [u8], at: usize, parameters: &'a dyn Parameters) -> Self {
        Self { line, at, parameters, depth: 0 }
    }

    /// Whether a parameter, an expression or a function begins at `at`, after a sign or not.
    pub(super) fn begins(line: &[u8], at: usize) -> bool {
        let mut at = at;
        while matches!(line.get(at), Some(b' ' | b'\t' | b'+' | b'-')) {
            at += 1;
        }
        match line.get(at) {
            Some(b'#' | b'[') => true,
            Some(byte) if byte.is_ascii_alphabetic() => function(&line[at..]).is_some(),
            _ => false,
        }
    }

    pub(super) fn blanks(&mut self) {
        while matches!(self.line.get(self.at), Some(b' ' | b'\t')) {
            self.at += 1;
        }
    }

    fn peek(&mut self) -> Option<u8> {
        self.blanks();
        self.line.get(self.at).copied()
    }

    /// A refusal that depends on what parameters are worth.
    fn refuse_value<T>(&self, from: usize, message: impl Into<String>) -> Result<T> {
        self.refuse(from, message).map_err(|refusal| refusal.needing(Needs::Values))
    }

    fn refuse<T>(&self, from: usize, message: impl Into<String>) -> Result<T> {
        Err(Refusal::new(
            from..self.at.max(from + 1),
            message,
            "expression",
            "an expression is such as [#1 * 2], [SIN[30] + #<width>] or -#5",
        ))
    }

    /// A number, a parameter, a function or an expression in brackets, with a sign or without.
    pub(super) fn value(&mut self) -> Result<f64> {
        let start = self.at;
        self.depth += 1;
        if self.depth > DEEPEST {
            return self.refuse(start, format!("brackets are nested more than {DEEPEST} deep"));
        }
        let value = match self.peek() {
            Some(b'[') => self.bracket(),
            Some(b'#') => self.parameter(),
            Some(b'-') => {
                self.at += 1;
                self.value().map(|value| -value)
            }
            Some(b'+') => {
                self.at += 1;
                self.value()
            }
            Some(byte) if byte.is_ascii_alphabetic() => self.function(),
            Some(byte) if byte.is_ascii_digit() || byte == b'.' => self.digits(),
            _ => self.refuse(self.at, "a number is missing"),
        }?;
        self.depth -= 1;
        if !value.is_finite() {
            return self.refuse_value(start, "the value is no number that can be written");
        }
        Ok(value)
    }

    /// `[ … ]`.
    pub(super) fn bracket(&mut self) -> Result<f64> {
        let start = self.at;
        if self.peek() != Some(b'[') {
            return self.refuse(self.at, "an expression in [ ] is missing");
        }
        self.at += 1;
        let value = self.chain(0)?;
        if self.peek() != Some(b']') {
            return match self.peek() {
                None => self.refuse(start, "the expression is not closed by ]"),
                Some(_) => self.refuse(self.at, "an operator or ] is missing"),
            };
        }
        self.at += 1;
        Ok(value)
    }

    /// Values joined by operators of a rank above `rank`.
    fn chain(&mut self, rank: u8) -> Result<f64> {
        let mut left = self.value()?;
        loop {
            let place = self.at;
            self.blanks();
            let start = self.at;
            let Some(operator) = self.operator() else { return Ok(left) };
            if operator.rank() <= rank {
                self.at = place;
                return Ok(left);
            }
            let right = self.chain(operator.rank())?;
            left = match operator.apply(left, right) {
                Ok(value) if value.is_finite() => value,
                Ok(_) => {
                    return self.refuse_value(start, "the value is no number that can be written");
                }
                Err(message) => return self.refuse_value(start, message),
            };
        }
    }

    /// The operator here, if there is one.
    fn operator(&mut self) -> Option<Operator> {
        let rest = &self.line[self.at..];
        let (text, operator) = OPERATORS.into_iter().find(|(text, _)| begins_with(rest, text))?;
        self.at += text.len();
        Some(operator)
    }

    fn function(&mut self) -> Result<f64> {
        let start = self.at;
        let Some(name) = function(&self.line[start..]) else {
            self.at = start + self.word();
            let word = String::from_utf8_lossy(&self.line[start..self.at]).into_owned();
            return self.refuse(start, format!("{word} is no function"));
        };
        self.at += name.len();
        if name == b"exists" {
            return self.exists();
        }
        let x = self.bracket()?;
        let degrees = |radians: f64| radians.to_degrees();
        let refused = match name {
            b"sqrt" if x < 0.0 => Some("a negative number has no square root"),
            b"ln" if x <= 0.0 => Some("only a number above 0 has a logarithm"),
            b"asin" | b"acos" if !(-1.0..=1.0).contains(&x) => {
                Some("only numbers from -1 to 1 have an ASIN and ACOS")
            }
            _ => None,
        };
        if let Some(message) = refused {
            return self.refuse_value(start, message);
        }
        Ok(match name {
            b"abs" => x.abs(),
            b"acos" => degrees(math::acos(x)),
            b"asin" => degrees(math::asin(x)),
            b"cos" => math::cos(x.to_radians()),
            b"exp" => math::exp(x),
            b"fix" => x.floor(),
            b"fup" => x.ceil(),
            b"ln" => math::ln(x),
            b"round" => x.round(),
            b"sin" => math::sin(x.to_radians()),
            b"sqrt" => x.sqrt(),
            b"tan" => math::tan(x.to_radians()),
            _ => {
                if self.peek() != Some(b'/') {
                    return self.refuse(start, "ATAN has two arguments: ATAN[1]/[2]");
                }
                self.at += 1;
                let y = self.bracket()?;
                degrees(math::atan2(x, y))
            }
        })
    }

    /// `EXISTS[#<name>]`: whether a parameter has a value.
    fn exists(&mut self) -> Result<f64> {
        let start = self.at;
        if self.peek() != Some(b'[') {
            return self.refuse(start, "EXISTS has a parameter in brackets: EXISTS[#<width>]");
        }
        self.at += 1;
        if self.peek() != Some(b'#') {
            return self.refuse(start, "EXISTS has a parameter in brackets: EXISTS[#<width>]");
        }
        let is_there = match self.target()? {
            Target::Numbered(index) => self.parameters.numbered(index).is_some(),
            Target::Named(name) => self.parameters.named(&name).is_some(),
        };
        if self.peek() != Some(b']') {
            return self.refuse(start, "the expression is not closed by ]");
        }
        self.at += 1;
        Ok(f64::from(u8::from(is_there)))
    }

    /// `#5`, `##5`, `#[…]` or `#<name>`.
    fn parameter(&mut self) -> Result<f64> {
        let start = self.at;
        match self.target()? {
            Target::Numbered(index) => match self.parameters.numbered(index) {
                Some(value) => Ok(value),
                None => self.refuse_value(start, format!("#{index} is not known here")),
            },
            Target::Named(name) => match self.parameters.named(&name) {
                Some(value) => Ok(value),
                None => self.refuse_value(start, format!("#<{name}> has no value")),
            },
        }
    }

    /// Which parameter is meant.
    pub(super) fn target(&mut self) -> Result<Target> {
        /// The last parameter of LinuxCNC.
        const LAST: f64 = 5601.0;
        let start = self.at;
        if self.peek() != Some(b'#') {
            return self.refuse(start, "a parameter is missing");
        }
        self.at += 1;
        if self.peek() == Some(b'<') {
            return self.name().map(Target::Named);
        }
        let number = self.value()?;
        if (number - number.round()).abs() > WHOLE || !(1.0..=LAST).contains(&number.round()) {
            return self.refuse_value(start, format!("there is no parameter #{number}"));
        }
        Ok(Target::Numbered(number.round() as u32))
    }

    /// `<name>`, in lower case and without blanks.
    pub(super) fn name(&mut self) -> Result<String> {
        let start = self.at;
        self.at += 1;
        let rest = &self.line[self.at..];
        let Some(length) = rest.iter().position(|&byte| byte == b'>') else {
            return self.refuse(start, "the name is not closed by >");
        };
        let name: String = String::from_utf8_lossy(&rest[..length])
            .chars()
            .filter(|character| !character.is_whitespace())
            .collect::<String>()
            .to_lowercase();
        self.at += length + 1;
        if name.is_empty() {
            return self.refuse(start, "the name is empty");
        }
        Ok(name)
    }

    /// Digits with a decimal point or without.
    fn digits(&mut self) -> Result<f64> {
        let start = self.at;
        let is_digit = |byte: &&u8| byte.is_ascii_digit() || **byte == b'.';
        self.at += self.line[start..].iter().take_while(is_digit).count();
        let text = std::str::from_utf8(&self.line[start..self.at]).unwrap_or("");
        match text.parse() {
            Ok(number) => Ok(number),
            Err(_) => self.refuse(start, format!("{text} is no number")),
        }
    }

    /// Length of the word here.
    fn word(&self) -> usize {
        self.line[self.at..].iter().take_while(|byte| byte.is_ascii_alphabetic()).count()
    }

    /// Where it has read from `from` on.
    pub(super) fn span(&self, from: usize) -> Range<usize> {
        from..self.at
    }
}

/// Whether `text` begins with `start`, in upper or lower case.
fn begins_with(text: &[u8], start: &[u8]) -> bool {
    text.get(..start.len()).is_some_and(|head| head.eq_ignore_ascii_case(start))
}

/// The function that `text` begins with, if its bracket follows.
fn function(text: &[u8]) -> Option<&'static [u8]> {
    let name = FUNCTIONS.into_iter().find(|name| begins_with(text, name))?;
    let after = text[name.len()..].trim_ascii_start();
    (after.first() == Some(&b'[')).then_some(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Fixed;

    impl Parameters for Fixed {
        fn numbered(&self, index: u32) -> Option<f64> {
            match index {
                31 => Some(4.0),
                4 => Some(7.0),
                5399 => None,
                _ => Some(0.0),
            }
        }

        fn named(&self, name: &str) -> Option<f64> {
            (name == "width").then_some(2.5)
        }
    }

    fn value(text: &str) -> std::result::Result<f64, String> {
        let mut reader = Reader::new(text.as_bytes(), 0, &Fixed);
        let value = reader.value().map_err(|refusal| refusal.message)?;
        assert_eq!(reader.at, text.len(), "{text}");
        Ok(value)
    }

    /// Values that `rs274` of LinuxCNC 2.9 gives.
    #[test]
    fn values_are_linuxcncs() {
        for (text, expected) in [
            ("#31", 4.0),
            ("##31", 7.0),
            ("-#31", -4.0),
            ("#[1+1]", 0.0),
            ("#<W idth>", 2.5),
            ("[-2**2]", 4.0),
            ("[2**3**2]", 64.0),
            ("[0**0]", 1.0),
            ("[1+2*3-4/2]", 5.0),
            ("[1-2-3]", -4.0),
            ("[8/4/2]", 1.0),
            ("[2*3 MOD 4]", 2.0),
            ("[-5 MOD 3]", 1.0),
            ("[5 MOD -3]", 2.0),
            ("[-5 MOD -3]", 1.0),
            ("[1 LT 2 AND 3]", 1.0),
            ("[1 OR 0 AND 0]", 0.0),
            ("[1 EQ 1 OR 2 GT 3]", 1.0),
            ("[1 XOR 2]", 0.0),
            ("[1 EQ 1.00009]", 1.0),
            ("[1 EQ 1.00011]", 0.0),
            ("[1 GE 1.00001]", 0.0),
            ("[1 LT 1.00001]", 1.0),
            ("[2--1]", 3.0),
            ("[1 + -2]", -1.0),
            ("[-[2]]", -2.0),
            ("[.5]", 0.5),
            ("[5.]", 5.0),
            ("ATAN[1]/[1]", 45.0),
            ("ROUND[2.5]", 3.0),
            ("ROUND[-2.5]", -3.0),
            ("ROUND[0.5]", 1.0),
            ("FIX[-2.5]", -3.0),
            ("FUP[1.2]", 2.0),
            ("ABS[-3]", 3.0),
            ("EXISTS[#5]", 1.0),
            ("EXISTS[#<b>]", 0.0),
            ("EXISTS[#<width>]", 1.0),
        ] {
            assert_eq!(value(text), Ok(expected), "{text}");
        }
        let near = |text: &str, expected: f64| {
            let found = value(text).unwrap_or(f64::NAN);
            assert!((found - expected).abs() < 1e-12, "{text}: {found}");
        };
        near("SIN[30]", 0.5);
        near("cos [ 60 ]", 0.5);
        near("TAN[45]", 1.0);
        near("ASIN[0.5]", 30.0);
        near("ACOS[0.5]", 60.0);
        near("SQRT[2]", std::f64::consts::SQRT_2);
        near("LN[EXP[2]]", 2.0);
    }

    #[test]
    fn what_linuxcnc_refuses_is_refused() {
        for text in [
            "#5602",
            "#0",
            "#1.5",
            "SQRT[-1]",
            "LN[0]",
            "ASIN[2]",
            "[[-8]**[1/3]]",
            "[-8**0.5]",
            "EXP[1000]",
            "[1==1]",
            "ACOS[1.0000000001]",
            "[0**-1]",
            "[1e3]",
            "ATAN[1]",
            "ATAN[1]/2",
            "[1/0]",
            "[5 MOD 0]",
            "[NOT 1]",
            "[#31 + 1",
            "#<b>",
            "#<width",
            "#<>",
            "[",
            "[]",
            "#",
            "EXISTS[5]",
            "[1 2",
            "#5399",
        ] {
            let refused = Reader::new(text.as_bytes(), 0, &Fixed).value();
            assert!(refused.is_err(), "{text}: {refused:?}");
        }
        let deep = "[".repeat(100_000);
        assert!(Reader::new(deep.as_bytes(), 0, &Fixed).value().is_err());
    }
}
