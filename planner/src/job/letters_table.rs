//! The job file's table of the letters of the thesis.

use machine::document::{Point, Positive, Quantity, Spanned};
use machine::quantity::Length;
use machine::table;
use nalgebra::Vector3;

use super::composition::moved;
use super::file::Reading;
use super::letters::{self, Letter, Style};
use super::room::{Room, room};
use super::{Job, JobError};
use crate::drawing::{Note, Power, Turns};

table! {
    /// Letters of the thesis, in a row around the machine's home.
    pub struct LettersTable {
        /// Any of N, A, S, O.
        pub text: Spanned<String>,
        /// Height of a letter.
        pub height: Quantity<Length, Positive> = "20 mm",
        /// curves: no stop on a curve; h1, h2: chord by chord, the thesis's conventions.
        pub style: Spanned<Style> = "curves",
        /// Where the middle of the row lies as seen from the machine's home; left out, at home or, where there
        /// is no room for it there, in the middle of the area.
        pub at: Option<Point>,
    }
}

/// Why style h2 is for paper only.
const REPLICA: &str = "style h2 replicates a printed table with free moves of up to 0.99 m/s, which \
                       no motor of the machine can do; use style h1 or curves, or plan it with --ideal";

/// Largest speed of free moves of convention h1 [m/s].
const H1_RAPID: f64 = 0.25;

/// The job that marks letters.
pub(super) fn read(table: &LettersTable, mut reading: Reading<'_>) -> Result<Job, JobError> {
    let mut text = Vec::new();
    for character in table.text.value.chars() {
        match Letter::from_character(character) {
            Some(letter) => text.push(letter),
            None => reading.diagnostics.contradict(
                table.text.span,
                format!("there is no letter `{character}`"),
                "write any of N, A, S, O",
            ),
        }
    }
    if table.text.value.is_empty() {
        let help = "write any of N, A, S, O";
        reading.diagnostics.contradict(
            table.text.span,
            "there is no letter to mark".to_owned(),
            help,
        );
    }
    let line = reading.line(table.text.span);
    let (style, home) = (table.style.value, Vector3::from(reading.machine.home));
    let power = Power { level: reading.beside.marking.level(), follows_speed: false };
    let middle = home + table.at.as_ref().map_or(Vector3::zeros(), |at| Vector3::from(at.value));
    let draw = |middle| letters::draw(&text, table.height.value, style, power, middle, line);
    let mut drawing = draw(middle);
    let is_level = reading.beside.surface.is_none() && reading.beside.attitude.is_none();
    let mut found = Room::AtHome;
    if let (true, Some(bounds)) = (is_level, letters::bounds(&drawing)) {
        found = room(reading.machine, bounds, &|| Box::new(letters::points(&drawing)));
    }
    if let Room::Middle(shift) = found {
        if table.at.is_none() {
            drawing = draw(middle + Vector3::new(shift.x, shift.y, 0.0));
            drawing.notes.push(Note { line: 0, text: moved(shift) });
        } else {
            found = Room::AtHome;
        }
    }
    // Style h2 begins beside its letters, wherever they are.
    if style != Style::H2 {
        drawing.start = home;
    }
    let (rapid, ideal_only) = match style {
        Style::Curves => (None, None),
        Style::H1 => (Some(H1_RAPID), None),
        Style::H2 => (Some(f64::INFINITY), Some(REPLICA)),
    };
    let mut job = reading.job_of(drawing);
    // The printed times have a rest between two strokes; and a hold next to a letter is as accurate as
    // at rest.
    job.marking.turns = Turns::Stop;
    let (placed, too_large) = (found.shift(), found.too_large());
    reading.finish(Job { rapid, ideal_only, placed, too_large, ..job })
}
