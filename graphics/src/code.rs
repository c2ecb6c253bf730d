//! QR codes (ISO/IEC 18004) and Data Matrix codes (ISO/IEC 16022, ECC 200) as filled shapes.

mod outline;

use datamatrix::{DataMatrix, SymbolList};
use kurbo::Point;
use qrcodegen::{DataTooLong, QrCode, QrCodeEcc};

use crate::curve::circle;
use crate::{Colour, Contour, Fill, FillRule, Segment, Shape};

/// What is encoded, and how it looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Code<'a> {
    /// The text, not empty. Readers agree on printable ASCII alone.
    pub text: &'a str,
    /// Which code.
    pub symbology: Symbology,
    /// Width of a module [m], 1e-6 to 1.
    pub module: f64,
    /// Width of the quiet zone around it in modules, at most 100; QR asks for 4, Data Matrix for 1.
    pub quiet: usize,
    /// Whether what is light on paper is marked, the quiet zone with it: for marks that are lighter than the
    /// material.
    pub is_inverted: bool,
    /// What a module becomes.
    pub modules: Modules,
}

/// Kind of code; the smallest symbol that holds the text is taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Symbology {
    /// QR, with at least this much correction: more where the same symbol holds it.
    Qr(Correction),
    /// Data Matrix, square.
    SquareDataMatrix,
    /// Data Matrix, rectangular.
    RectangularDataMatrix,
}

/// How much of a QR code may be lost.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Correction {
    /// L, 7 %.
    Low,
    /// M, 15 %.
    Medium,
    /// Q, 25 %.
    Quartile,
    /// H, 30 %.
    High,
}

/// What marked modules become.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Modules {
    /// Areas of neighbouring modules without edges between them.
    Merged,
    /// A square each, its width this share of a module, more than 0 to 1.
    Squares(f64),
    /// A circle each, its diameter this share of a module, more than 0 to 1.
    Dots(f64),
}

/// A code to be filled.
#[derive(Debug, Clone, PartialEq)]
pub struct Symbol {
    /// Its marked areas; the lower left corner of the quiet zone is the origin.
    pub shape: Shape,
    /// Columns and rows of modules, the quiet zone among them.
    pub size: (usize, usize),
}

/// Why a text is not encoded.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum CodeError {
    /// No text.
    #[error("the code has no text; it needs at least one character")]
    Empty,
    /// More text than any symbol holds.
    #[error(
        "the text of {length} bytes does not fit into {what}, which holds at most {most} digits"
    )]
    TooLong {
        /// Bytes of the text.
        length: usize,
        /// Kind of code.
        what: &'static str,
        /// Digits that its largest symbol holds; fewer letters, and fewer bytes of other text.
        most: usize,
    },
    /// Characters that the code has no encoding for.
    #[error("the text has characters that a Data Matrix code cannot hold; take printable ASCII")]
    Characters,
    /// A setting is out of its range.
    #[error("{name} is {value}; it must be {range}")]
    Setting {
        /// Which one.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What would be right.
        range: &'static str,
    },
}

impl Code<'_> {
    /// The code as a shape.
    ///
    /// # Errors
    ///
    /// Where the text is empty, too long, or has characters that the code does not know, and where a
    /// setting is out of its range.
    pub fn symbol(&self) -> Result<Symbol, CodeError> {
        self.check()?;
        let symbol = self.matrix()?;
        let (columns, rows) = (symbol.columns + 2 * self.quiet, symbol.bits.len() / symbol.columns);
        let rows = rows + 2 * self.quiet;
        let quiet = self.quiet;
        // From the lower left corner.
        let is_marked = |column: usize, row: usize| {
            let within = column >= quiet && row >= quiet;
            let at = (column.wrapping_sub(quiet), row.wrapping_sub(quiet));
            let is_dark = within && symbol.is_dark(at.0, at.1);
            is_dark != self.is_inverted
        };
        let contours = match self.modules {
            Modules::Merged => outline::merged(columns, rows, self.module, is_marked),
            Modules::Squares(share) => {
                self.each(columns, rows, is_marked, |centre| square(centre, share * self.module))
            }
            Modules::Dots(share) => self
                .each(columns, rows, is_marked, |centre| circle(centre, share * self.module / 2.0)),
        };
        let fill = Some(Fill { colour: Colour::BLACK, rule: FillRule::NonZero });
        Ok(Symbol { shape: Shape { contours, fill, ..Shape::default() }, size: (columns, rows) })
    }

    fn check(&self) -> Result<(), CodeError> {
        let check = |name, value: f64, is_right: bool, range| {
            if is_right { Ok(()) } else { Err(CodeError::Setting { name, value, range }) }
        };
        let is_module = (1e-6..=1.0).contains(&self.module);
        check("module", self.module, is_module, "from 0.000001 m to 1 m")?;
        check("quiet zone", self.quiet as f64, self.quiet <= 100, "at most 100 modules")?;
        match self.modules {
            Modules::Merged => Ok(()),
            Modules::Squares(share) | Modules::Dots(share) => {
                let is_right = share > 0.0 && share <= 1.0;
                check("share of a module", share, is_right, "more than 0 and at most 1")
            }
        }
    }

    fn matrix(&self) -> Result<Matrix, CodeError> {
        if self.text.is_empty() {
            return Err(CodeError::Empty);
        }
        let (what, most) = match self.symbology {
            Symbology::Qr(Correction::Low) => ("a QR code of correction L", 7_089),
            Symbology::Qr(Correction::Medium) => ("a QR code of correction M", 5_596),
            Symbology::Qr(Correction::Quartile) => ("a QR code of correction Q", 3_993),
            Symbology::Qr(Correction::High) => ("a QR code of correction H", 3_057),
            Symbology::SquareDataMatrix => ("a square Data Matrix code", 3_116),
            Symbology::RectangularDataMatrix => ("a rectangular Data Matrix code", 98),
        };
        let too_long = CodeError::TooLong { length: self.text.len(), what, most };
        if self.text.len() > most {
            return Err(too_long);
        }
        let symbols = match self.symbology {
            Symbology::Qr(correction) => return qr(self.text, correction).ok_or(too_long),
            Symbology::SquareDataMatrix => SymbolList::default().enforce_square(),
            Symbology::RectangularDataMatrix => SymbolList::default().enforce_rectangular(),
        };
        use datamatrix::data::DataEncodingError;
        let matrix = DataMatrix::encode_str(self.text, symbols).map_err(|error| match error {
            DataEncodingError::TooMuchOrIllegalData => too_long,
            _ => CodeError::Characters,
        })?;
        let bitmap = matrix.bitmap();
        Ok(Matrix { columns: bitmap.width(), bits: bitmap.bits().to_vec() })
    }

    /// A contour for each marked module.
    fn each(
        &self,
        columns: usize,
        rows: usize,
        is_marked: impl Fn(usize, usize) -> bool,
        contour: impl Fn(Point) -> Contour,
    ) -> Vec<Contour> {
        let places = (0..rows).flat_map(|row| (0..columns).map(move |column| (column, row)));
        let centre = |(column, row): (usize, usize)| {
            Point::new((column as f64 + 0.5) * self.module, (row as f64 + 0.5) * self.module)
        };
        let marked = places.filter(|(column, row)| is_marked(*column, *row));
        marked.map(|place| contour(centre(place))).collect()
    }
}

/// Modules of a symbol row by row from the top.
struct Matrix {
    columns: usize,
    bits: Vec<bool>,
}

impl Matrix {
    /// Whether a module, counted from the lower left one, is dark; outside of the symbol none is.
    fn is_dark(&self, column: usize, row: usize) -> bool {
        let rows = self.bits.len() / self.columns;
        let is_within = column < self.columns && row < rows;
        is_within && self.bits[(rows - 1 - row) * self.columns + column]
    }
}

fn qr(text: &str, correction: Correction) -> Option<Matrix> {
    let level = match correction {
        Correction::Low => QrCodeEcc::Low,
        Correction::Medium => QrCodeEcc::Medium,
        Correction::Quartile => QrCodeEcc::Quartile,
        Correction::High => QrCodeEcc::High,
    };
    let code = match QrCode::encode_text(text, level) {
        Ok(code) => code,
        Err(DataTooLong::SegmentTooLong | DataTooLong::DataOverCapacity(..)) => return None,
    };
    let size = code.size();
    let bits = (0..size).flat_map(|y| (0..size).map(move |x| (x, y)));
    let bits = bits.map(|(x, y)| code.get_module(x, y)).collect();
    Some(Matrix { columns: size.unsigned_abs() as usize, bits })
}

fn square(centre: Point, width: f64) -> Contour {
    let half = width / 2.0;
    let corner = |x: f64, y: f64| Point::new(centre.x + x * half, centre.y + y * half);
    let corners = [corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0), corner(-1.0, -1.0)];
    Contour { start: corners[3], segments: corners.map(Segment::Line).into(), is_closed: true }
}

#[cfg(test)]
mod tests;
