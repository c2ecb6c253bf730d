//! One line of a program: its codes and its numbers, checked for what cannot stand together.

use std::ops::Range;

use machine::gcode_settings::WordMeanings;

use super::codes::{Codes, Stop, spell};
use super::error::{Needs, Refusal};
use super::expression::Target;
use super::lexer::Word;

/// A line, gathered word by word.
#[derive(Debug, Clone)]
pub(super) struct Block {
    /// Which letters but G and M the line has, a bit for each.
    present: u32,
    /// Letters whose number something on the line has used.
    used: u32,
    numbers: [f64; 26],
    spans: [Range<usize>; 26],
    /// Its G and M codes.
    pub(super) codes: Codes,
    /// What it sets parameters to.
    pub(super) settings: Vec<(Target, f64)>,
    /// The powers after the first of a cluster, `S1:2:3`, and where they stand.
    pub(super) cluster: Vec<(f64, Range<usize>)>,
    /// Whether something other than a motion has taken its coordinates.
    pub(super) axes_taken: bool,
    /// Whether it has any word.
    pub(super) begun: bool,
    /// Way of a degree [m], where the line's Y was written as A.
    way_per_degree: Option<f64>,
}

impl Block {
    pub(super) fn new() -> Self {
        Self {
            present: 0,
            used: 0,
            numbers: [0.0; 26],
            spans: std::array::from_fn(|_| 0..0),
            codes: Codes::default(),
            settings: Vec::new(),
            cluster: Vec::new(),
            axes_taken: false,
            begun: false,
            way_per_degree: None,
        }
    }

    /// Empties it for the next line.
    pub(super) fn clear(&mut self) {
        self.present = 0;
        self.used = 0;
        self.codes = Codes::default();
        self.settings.clear();
        self.cluster.clear();
        self.axes_taken = false;
        self.begun = false;
        self.way_per_degree = None;
    }

    /// Takes one word.
    pub(super) fn take(
        &mut self,
        line: &[u8],
        mut word: Word,
        words: &WordMeanings,
    ) -> Result<(), Box<Refusal>> {
        let first = !std::mem::replace(&mut self.begun, true);
        let name = char::from(word.letter);
        match word.letter {
            b'G' | b'M' => return self.codes.take(line, word, words),
            b'N' => {
                if !first {
                    return Err(Refusal::new(
                        word.span,
                        "N stands inside a line",
                        "line number",
                        "a line number is the first word of its line",
                    ));
                }
                if word.number < 0.0 {
                    return Err(Refusal::new(
                        word.span,
                        "a line number is negative",
                        "line number",
                        "line numbers count from 0, or leave them out",
                    ));
                }
                return Ok(());
            }
            b'E' | b'F' | b'I' | b'J' | b'K' | b'P' | b'Q' | b'R' | b'S' | b'X' | b'Y' | b'Z' => {}
            b'H' | b'L' | b'T' => {
                whole(&word)?;
            }
            // The chuck stands in the place of y: degrees are a way around the workpiece.
            b'A' if words.way_per_degree.is_some() => {
                self.way_per_degree = words.way_per_degree;
                word.letter = b'Y';
            }
            b'A' | b'B' | b'C' | b'U' | b'V' | b'W' => {
                return Err(Refusal::new(
                    word.span,
                    match word.letter {
                        b'A' | b'B' | b'C' => {
                            format!("{name} is not supported: this machine has no rotary axis")
                        }
                        _ => format!("{name} is not an axis of this machine"),
                    },
                    "unknown axis",
                    "a program moves X, Y and Z",
                ));
            }
            _ => {
                return Err(Refusal::new(
                    word.span,
                    format!("{name} words are not supported"),
                    "unsupported word",
                    "words begin with E F G H I J K L M N P Q R S T X Y or Z",
                ));
            }
        }
        let index = usize::from(word.letter - b'A');
        if self.present & (1 << index) != 0 {
            self.check_gathered()?;
            let first = spell(line, &self.spans[index]);
            let second = spell(line, &word.span);
            return Err(Refusal::new(
                word.span,
                format!("{name} is on this line twice: {first} and {second}"),
                format!("second {name}"),
                format!("a line can have one {name}: is a line break missing?"),
            ));
        }
        self.present |= 1 << index;
        self.numbers[index] = word.number;
        self.spans[index] = word.span;
        Ok(())
    }

    /// Refuses words that nothing of the line could use, once it has all of them: E without M67 and M68,
    /// which is an exponent or an extruder's.
    pub(super) fn check_gathered(&self) -> Result<(), Box<Refusal>> {
        if !self.has(b'E') || self.codes.analog_output.is_some() {
            return Ok(());
        }
        Err(Refusal::new(
            self.span(b'E'),
            "E words are not supported",
            "E word",
            "a number has no exponent, a marking machine no extruder, and E0 belongs to M67 and M68",
        ))
    }

    /// Whether the line ends the program.
    pub(super) fn ends_program(&self) -> bool {
        self.codes.stop.as_ref().is_some_and(|chosen| chosen.code == Stop::End)
    }

    /// Whether the line has `letter`.
    pub(super) fn has(&self, letter: u8) -> bool {
        self.present & bit(letter) != 0
    }

    /// Whether the line has any of the axes.
    pub(super) fn has_axes(&self) -> bool {
        self.present & (bit(b'X') | bit(b'Y') | bit(b'Z')) != 0
    }

    /// Where its first coordinate stands, in the order of the axes.
    pub(super) fn first_axis(&self) -> Range<usize> {
        let axes = [b'X', b'Y', b'Z'].into_iter();
        axes.filter(|&axis| self.has(axis)).map(|axis| self.span(axis)).next().unwrap_or(0..0)
    }

    /// Whether the line has any offset to the centre of an arc.
    pub(super) fn has_offsets(&self) -> bool {
        self.present & (bit(b'I') | bit(b'J') | bit(b'K')) != 0
    }

    /// Whether the number of `letter` is used already.
    pub(super) fn is_used(&self, letter: u8) -> bool {
        self.used & bit(letter) != 0
    }

    /// The number of `letter`, which counts as used from here.
    pub(super) fn number(&mut self, letter: u8) -> Option<f64> {
        if !self.has(letter) {
            return None;
        }
        self.used |= bit(letter);
        Some(self.numbers[usize::from(letter - b'A')])
    }

    /// The coordinate of an axis, X, Y or Z, where a unit is so many metres [m].
    pub(super) fn coordinate(&mut self, letter: u8, unit: f64) -> Option<f64> {
        let scale = self.way_per_degree.filter(|_| letter == b'Y').unwrap_or(unit);
        self.number(letter).map(|number| number * scale)
    }

    /// Where `letter` stands.
    pub(super) fn span(&self, letter: u8) -> Range<usize> {
        self.spans[usize::from(letter - b'A')].clone()
    }

    /// Refuses the first word that nothing on the line has used.
    pub(super) fn check_used(&self) -> Result<(), Box<Refusal>> {
        let left = self.present & !self.used;
        if left == 0 {
            return Ok(());
        }
        let letters = (b'A'..=b'Z').filter(|&letter| left & bit(letter) != 0);
        let Some(letter) = letters.min_by_key(|&letter| self.span(letter).start) else {
            return Ok(());
        };
        let name = char::from(letter);
        let help = match letter {
            b'X' | b'Y' | b'Z' => "coordinates need G0, G1, G2 or G3, on this line or before",
            b'I' | b'J' | b'K' | b'R' => "I, J, K and R belong to G2 and G3",
            b'P' => "P belongs to G2, G3, G4, G10, G64, M62 to M65 and M98",
            b'H' => "H belongs to G43",
            b'L' => "L belongs to G10 and M98",
            _ => "Q belongs to G64, M67 and M68",
        };
        Err(Refusal::new(
            self.span(letter),
            format!("nothing on this line uses {name}"),
            "unused word",
            help,
        )
        .needing(Needs::Motion))
    }
}

fn bit(letter: u8) -> u32 {
    1 << (letter - b'A')
}

/// Refuses a word whose number is not 0, 1, 2 …
fn whole(word: &Word) -> Result<(), Box<Refusal>> {
    if word.number >= 0.0 && word.number.floor() == word.number {
        return Ok(());
    }
    let name = char::from(word.letter);
    Err(Refusal::new(
        word.span.clone(),
        format!("{name} needs a whole number"),
        "not a whole number",
        format!("write {name} with 0, 1, 2 and so on"),
    ))
}
