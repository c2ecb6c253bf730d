//! Text as curves: by an outline font, or by [single strokes](crate::single_line).

#[cfg(feature = "text")]
mod font;
#[cfg(feature = "text")]
mod installed;
pub(crate) mod layout;

#[cfg(feature = "text")]
pub use font::Font;
#[cfg(feature = "text")]
pub use installed::Installed;

/// A text and how it is set.
///
/// The baseline of the first line begins, is centred, or ends at the origin, by the alignment; further
/// lines lie below. On an arc the origin is the top of the circle, for a negative radius its bottom.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Text<'a> {
    /// Its lines, divided by `\n`; at most [`MOST_BYTES`].
    pub text: &'a str,
    /// How large it is.
    pub height: Height,
    /// Added between neighbouring characters [m].
    pub letter_spacing: f64,
    /// Distance of baselines in em, 0.1 to 10.
    pub line_spacing: f64,
    /// Where lines begin.
    pub align: Align,
    /// Radius of the arc that the first baseline lies on [m]: positive around a centre below, negative
    /// around one above; `None` for straight lines.
    pub radius: Option<f64>,
}

/// How large a text is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Height {
    /// Height of a capital letter without curves, such as H [m].
    Cap(f64),
    /// The font's em, which drawing programs call its size [m].
    Em(f64),
}

/// Where lines begin.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Align {
    /// At the origin.
    #[default]
    Left,
    /// So that their middle is at the origin.
    Centre,
    /// So that they end at the origin.
    Right,
}

/// Longer texts are refused [bytes].
pub const MOST_BYTES: usize = 100_000;
