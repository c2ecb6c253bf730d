//! What a drawing draws: a file's, a text's or a code's.

use std::path::{Path, PathBuf};

use graphics::code::{self, Code, Modules, Symbology};
use graphics::text::{self, Font, Height, Installed, Text};
use graphics::{Graphic, ReadError, single_line};
use machine::document::{Diagnostics, Either, Spanned};

use super::compose::Part;
use super::serial::Serial;
use super::tables::{Align, BuiltInFont, CodeTable, Correction, TextTable};
use crate::job::JobError;
use crate::job::drawing_error::DrawingError;
use crate::job::files::JobFiles;
use crate::job::whole::whole;

/// The widest quiet zone in modules.
const MOST_QUIET: u64 = 100;

/// Where a drawing's shapes come from.
pub(super) enum Source<'a> {
    /// A file, read once, by its name in the job.
    File { name: PathBuf },
    /// Text, in a font and its file if it has one, or in the single-line font.
    Text { table: &'a TextTable, font: Option<(Option<PathBuf>, Font)> },
    /// A code.
    Code { template: &'a Spanned<String>, table: &'a CodeTable, is_qr: bool },
}

impl<'a> Source<'a> {
    /// Of one drawing; what is wrong with its table goes to `diagnostics`.
    pub(super) fn of(
        part: &Part<'a>,
        files: &JobFiles,
        diagnostics: &mut Diagnostics,
    ) -> Option<Self> {
        const HELP: &str = "keep one of `file`, `text` and `code`";
        let table = part.table;
        let given = [
            table.file.as_ref().map(|file| file.span),
            table.text.as_ref().map(|text| text.span),
            table.code.as_ref().map(|code| code.span),
        ];
        let mut given = given.into_iter().flatten();
        let most = if part.file.is_some() { 0 } else { 1 };
        if let Some(second) = given.nth(most) {
            diagnostics.contradict(second, "a drawing draws one thing".to_owned(), HELP);
            return None;
        }
        if let Some(name) = part.file {
            return Some(Self::File { name: name.to_owned() });
        }
        if let Some(file) = &table.file {
            // What cannot be opened is a fault of the job, what is in it one of the file.
            let cause = match files.open(&file.value).and_then(|opened| opened.metadata()) {
                Err(error) => Some(error.to_string()),
                Ok(data) => data.is_dir().then(|| "it is a folder".to_owned()),
            };
            if let Some(cause) = cause {
                let text =
                    format!("{}: cannot be read: {cause}", files.path(&file.value).display());
                diagnostics.contradict(
                    file.span,
                    text,
                    "a path is relative to the job file's folder",
                );
                return None;
            }
            return Some(Self::File { name: PathBuf::from(&file.value) });
        }
        if let Some(text) = &table.text {
            return Self::of_text(text, files, diagnostics);
        }
        let Some(code) = &table.code else {
            let text = "there is nothing to draw".to_owned();
            diagnostics.contradict(table.span, text, "add `file`, `text` or `code`");
            return None;
        };
        let (template, is_qr) = match (&code.qr, &code.data_matrix) {
            (Some(qr), None) => (qr, true),
            (None, Some(matrix)) => (matrix, false),
            _ => {
                let help = "write one of `qr` and `data_matrix`";
                diagnostics.contradict(code.span, "which code is not clear".to_owned(), help);
                return None;
            }
        };
        Some(Self::Code { template, table: code, is_qr })
    }

    fn of_text(
        table: &'a TextTable,
        files: &JobFiles,
        diagnostics: &mut Diagnostics,
    ) -> Option<Self> {
        let font = match &table.font {
            Either::Word(word) => match word.value {
                BuiltInFont::SingleLine => return Some(Self::Text { table, font: None }),
                BuiltInFont::Outline => (None, Font::built_in()),
            },
            Either::Value(name) if !is_font_file(&name.value) => {
                (None, Installed::here().font(&name.value))
            }
            Either::Value(file) => {
                let name = PathBuf::from(&file.value);
                let font = files.read(&name).map_err(|error| {
                    let text = format!("{}: {error}", files.path(&name).display());
                    ReadError::new(
                        text,
                        "give the path of a font file (.ttf, .otf), or a built-in font",
                    )
                });
                (Some(name), font.and_then(|bytes| Font::new(&bytes)))
            }
        };
        match font {
            (path, Ok(font)) => Some(Self::Text { table, font: Some((path, font)) }),
            (_, Err(error)) => {
                let span = match &table.font {
                    Either::Value(file) => file.span,
                    Either::Word(word) => word.span,
                };
                diagnostics.contradict(span, error.message, &error.help);
                None
            }
        }
    }

    /// The file that it reads, by its name in the job.
    pub(super) fn file(&self) -> Option<&Path> {
        match self {
            Self::File { name } => Some(name),
            Self::Text { font, .. } => font.as_ref().and_then(|(path, _)| path.as_deref()),
            Self::Code { .. } => None,
        }
    }

    /// Whether it may be another one in another place.
    pub(super) fn changes(&self) -> bool {
        match self {
            Self::File { .. } => false,
            Self::Text { table, .. } => table.content.value.contains('{'),
            Self::Code { template, .. } => template.value.contains('{'),
        }
    }

    /// A note of it, with its name.
    pub(super) fn note(&self, text: &str) -> String {
        match self {
            Self::File { name } => {
                let name = name.file_name().unwrap_or_default().to_string_lossy();
                format!("{name}: {text}")
            }
            Self::Text { .. } | Self::Code { .. } => text.to_owned(),
        }
    }

    /// What it draws in a place, from 0; empty where `diagnostics` say why not.
    ///
    /// # Errors
    /// Where its file cannot be read.
    pub(super) fn graphic(
        &self,
        serial: &Serial,
        place: usize,
        files: &JobFiles,
        diagnostics: &mut Diagnostics,
    ) -> Result<Graphic, JobError> {
        let (template, made) = match self {
            Self::File { name } => {
                let read = graphics::read::read_opened(files.open(name), name);
                return read.map_err(|error| DrawingError::new(files.path(name), error).into());
            }
            Self::Text { table, font } => {
                let content = &table.content;
                let Some(written) = filled(content, serial, place, diagnostics) else {
                    return Ok(Graphic::default());
                };
                (content, of_text(table, font.as_ref().map(|(_, font)| font), &written))
            }
            Self::Code { template, table, is_qr } => {
                let Some(written) = filled(template, serial, place, diagnostics) else {
                    return Ok(Graphic::default());
                };
                (*template, of_code(table, *is_qr, &written, diagnostics))
            }
        };
        Ok(made.unwrap_or_else(|error| {
            diagnostics.contradict(template.span, error.message, &error.help);
            Graphic::default()
        }))
    }
}

/// Whether a font is given by its file and not by its name.
pub(in crate::job) fn is_font_file(written: &str) -> bool {
    let extension = Path::new(written).extension().and_then(|extension| extension.to_str());
    let known = ["ttf", "otf", "ttc", "otc"];
    written.contains('/')
        || extension.is_some_and(|found| known.iter().any(|one| one.eq_ignore_ascii_case(found)))
}

/// A text in a font, or in the single-line one.
fn of_text(table: &TextTable, font: Option<&Font>, text: &str) -> Result<Graphic, ReadError> {
    let text = Text {
        text,
        height: Height::Cap(table.height.value),
        letter_spacing: table.spacing.value,
        line_spacing: table.line_spacing.value,
        align: match table.align.value {
            Align::Left => text::Align::Left,
            Align::Center => text::Align::Centre,
            Align::Right => text::Align::Right,
        },
        radius: table.radius.as_ref().map(|radius| radius.value),
    };
    let shape = match font {
        Some(font) => font.set(&text),
        None => single_line::set_text(&text),
    }?;
    Ok(Graphic { shapes: vec![shape], ..Graphic::default() })
}

/// The code of a text.
fn of_code(
    table: &CodeTable,
    is_qr: bool,
    text: &str,
    diagnostics: &mut Diagnostics,
) -> Result<Graphic, ReadError> {
    const HELP: &str = "write less, or other characters; look at `module`, `dot` and `quiet`";
    let quiet = table.quiet.as_ref();
    let quiet = quiet.and_then(|quiet| whole(quiet, 0..=MOST_QUIET, "quiet", diagnostics));
    let symbology = match (is_qr, table.rectangular.value) {
        (true, _) => Symbology::Qr(match table.correction.value {
            Correction::Low => code::Correction::Low,
            Correction::Medium => code::Correction::Medium,
            Correction::Quartile => code::Correction::Quartile,
            Correction::High => code::Correction::High,
        }),
        (false, false) => Symbology::SquareDataMatrix,
        (false, true) => Symbology::RectangularDataMatrix,
    };
    let code = Code {
        text,
        symbology,
        module: table.module.value,
        quiet: quiet.map_or(if is_qr { 4 } else { 1 }, |quiet| quiet as usize),
        is_inverted: table.inverted.value,
        modules: table.dot.as_ref().map_or(Modules::Merged, |dot| Modules::Dots(dot.value)),
    };
    let symbol = code.symbol().map_err(|error| ReadError::new(error.to_string(), HELP))?;
    Ok(Graphic { shapes: vec![symbol.shape], ..Graphic::default() })
}

/// `template` with what stands in its braces.
fn filled(
    template: &Spanned<String>,
    serial: &Serial,
    place: usize,
    diagnostics: &mut Diagnostics,
) -> Option<String> {
    serial
        .fill(&template.value, place)
        .map_err(|name| {
            let known: Vec<String> =
                serial.names().into_iter().map(|name| format!("{{{name}}}")).collect();
            let text = format!("`{{{name}}}` stands for nothing");
            let help = format!("known are {}; write {{{{ for a brace", known.join(", "));
            diagnostics.contradict(template.span, text, &help);
        })
        .ok()
}
