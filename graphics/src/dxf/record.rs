//! One object of a DXF file: the pairs from its name to the next one.

use super::codes::Pair;
use super::frame::Space;

/// One object.
#[derive(Debug, Clone, Copy)]
pub(super) struct Record<'p, 'a> {
    pub(super) kind: &'a str,
    pub(super) line: u64,
    pub(super) pairs: &'p [Pair<'a>],
}

impl<'p, 'a> Record<'p, 'a> {
    /// The objects that pairs consist of; what comes before the first one is passed over.
    pub(super) fn all(pairs: &'p [Pair<'a>]) -> impl Iterator<Item = Self> {
        let mut rest = pairs;
        core::iter::from_fn(move || {
            let begin = rest.iter().position(|pair| pair.code == 0)?;
            let (head, after) = rest[begin..].split_first()?;
            let end = after.iter().position(|pair| pair.code == 0).unwrap_or(after.len());
            rest = &after[end..];
            let pairs = &after[..end];
            Some(Self { kind: head.text().trim(), line: head.line.into(), pairs })
        })
    }

    /// The first value of a code.
    fn first(&self, code: i32) -> Option<&'p Pair<'a>> {
        self.pairs.iter().find(|pair| pair.code == code)
    }

    pub(super) fn text(&self, code: i32) -> Option<&'a str> {
        self.first(code).map(|pair| pair.text().trim())
    }

    pub(super) fn real(&self, code: i32) -> Option<f64> {
        self.first(code)?.real()
    }

    pub(super) fn whole(&self, code: i32) -> Option<i64> {
        self.first(code)?.whole()
    }

    /// A bit field; 0 where there is none.
    pub(super) fn flags(&self, code: i32) -> i64 {
        self.whole(code).unwrap_or(0)
    }

    /// A place or a direction: its x has the code, y and z ten and twenty more.
    pub(super) fn space(&self, code: i32) -> Option<Space> {
        let part = |code| self.real(code);
        Some([part(code)?, part(code + 10)?, part(code + 20).unwrap_or(0.0)])
    }

    /// All places of a code; one without a y is passed over.
    pub(super) fn spaces(&self, code: i32) -> Vec<Space> {
        let mut places: Vec<(Space, bool)> = Vec::new();
        for pair in self.pairs {
            let Some(value) = pair.real() else { continue };
            if pair.code == code {
                places.push(([value, 0.0, 0.0], false));
            } else if let Some((place, has_y)) = places.last_mut() {
                if pair.code == code + 10 {
                    place[1] = value;
                    *has_y = true;
                } else if pair.code == code + 20 {
                    place[2] = value;
                }
            }
        }
        places.into_iter().filter(|&(_, has_y)| has_y).map(|(place, _)| place).collect()
    }

    /// All values of a code.
    pub(super) fn reals(&self, code: i32) -> Vec<f64> {
        self.pairs.iter().filter(|pair| pair.code == code).filter_map(Pair::real).collect()
    }
}
