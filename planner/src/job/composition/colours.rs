//! Which colours and layers of a file are on a layer of the job.

use graphics::Colour;
use machine::document::{Diagnostics, Spanned};

use super::tables::LayerTable;

/// Nothing is marked with it.
pub(super) const WHITE: Colour = Colour { red: 255, green: 255, blue: 255 };

/// The basic colours by name, as CSS has them.
const NAMED: [(&str, [u8; 3]); 18] = [
    ("black", [0, 0, 0]),
    ("silver", [192, 192, 192]),
    ("gray", [128, 128, 128]),
    ("grey", [128, 128, 128]),
    ("white", [255, 255, 255]),
    ("maroon", [128, 0, 0]),
    ("red", [255, 0, 0]),
    ("purple", [128, 0, 128]),
    ("magenta", [255, 0, 255]),
    ("green", [0, 128, 0]),
    ("lime", [0, 255, 0]),
    ("olive", [128, 128, 0]),
    ("yellow", [255, 255, 0]),
    ("navy", [0, 0, 128]),
    ("blue", [0, 0, 255]),
    ("teal", [0, 128, 128]),
    ("cyan", [0, 255, 255]),
    ("orange", [255, 165, 0]),
];

/// What is on a layer of the job.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Palette {
    colours: Vec<Colour>,
    names: Vec<String>,
}

impl Palette {
    /// Of the layer called `name`; what is wrong with it goes to `diagnostics`.
    pub(super) fn new(
        name: &Spanned<String>,
        table: &LayerTable,
        diagnostics: &mut Diagnostics,
    ) -> Self {
        let mut colours = Vec::new();
        for written in table.colors.iter().flatten() {
            match parse(&written.value) {
                Some(colour) => colours.push(colour),
                None => {
                    let names: Vec<&str> = NAMED.iter().map(|(name, _)| *name).collect();
                    diagnostics.contradict(
                        written.span,
                        format!("`{}` is no colour", written.value),
                        &format!("write one such as \"#ff0000\", or {}", names.join(", ")),
                    );
                }
            }
        }
        let names = match (&table.names, &table.colors) {
            (Some(names), _) => names.iter().map(|name| name.value.clone()).collect(),
            (None, Some(_)) => Vec::new(),
            (None, None) => {
                // A layer that says nothing is the one of its own name, or of the colour of that name.
                colours.extend(parse(&name.value));
                vec![name.value.clone()]
            }
        };
        Self { colours, names }
    }

    /// Whether something on the layer `name` of a file, with this colour, is on it.
    pub(super) fn holds(&self, name: Option<&str>, colour: Option<Colour>) -> bool {
        colour.is_some_and(|colour| self.colours.contains(&colour))
            || name.is_some_and(|name| self.names.iter().any(|own| own == name))
    }
}

/// The colour of a text such as `#f00`, `#ff0000` or `red`.
fn parse(text: &str) -> Option<Colour> {
    let Some(digits) = text.strip_prefix('#') else {
        let named = NAMED.iter().find(|(name, _)| name.eq_ignore_ascii_case(text));
        return named.map(|(_, [red, green, blue])| Colour {
            red: *red,
            green: *green,
            blue: *blue,
        });
    };
    let digits: Vec<u8> = digits
        .chars()
        .map(|digit| digit.to_digit(16).and_then(|digit| u8::try_from(digit).ok()))
        .collect::<Option<_>>()?;
    match *digits.as_slice() {
        [red, green, blue] => Some(Colour { red: red * 17, green: green * 17, blue: blue * 17 }),
        [r, ed, g, reen, b, lue] => {
            Some(Colour { red: r * 16 + ed, green: g * 16 + reen, blue: b * 16 + lue })
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_read_by_digits_and_by_name() {
        let red = Some(Colour { red: 255, green: 0, blue: 0 });
        assert_eq!([parse("#f00"), parse("#FF0000"), parse("Red")], [red; 3]);
        assert_eq!([parse("#ff00"), parse("#gg0000"), parse("rot"), parse("")], [None; 4]);
    }
}
