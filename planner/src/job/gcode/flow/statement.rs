//! The O word of a line, and what stands behind it.

use std::ops::Range;

use crate::job::gcode::error::Refusal;
use crate::job::gcode::expression::{Parameters, Reader};

/// What an O word says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Word {
    /// Nothing: it is the number of a program.
    Number,
    Sub,
    EndSub,
    Call,
    Return,
    If,
    ElseIf,
    Else,
    EndIf,
    While,
    EndWhile,
    Do,
    Repeat,
    EndRepeat,
    Break,
    Continue,
}

const WORDS: [(&str, Word); 15] = [
    ("sub", Word::Sub),
    ("endsub", Word::EndSub),
    ("call", Word::Call),
    ("return", Word::Return),
    ("if", Word::If),
    ("elseif", Word::ElseIf),
    ("else", Word::Else),
    ("endif", Word::EndIf),
    ("while", Word::While),
    ("endwhile", Word::EndWhile),
    ("do", Word::Do),
    ("repeat", Word::Repeat),
    ("endrepeat", Word::EndRepeat),
    ("break", Word::Break),
    ("continue", Word::Continue),
];

/// A line with an O word.
#[derive(Debug, Clone, PartialEq)]
pub(in crate::job::gcode) struct Statement {
    /// Digits without leading zeros, or `<name>`.
    pub(super) label: String,
    pub(super) word: Word,
    /// The line from its O on.
    pub(super) span: Range<usize>,
    /// Where what follows the word begins.
    pub(super) rest: usize,
}

/// Reads the O word at `at` of a line.
pub(in crate::job::gcode) fn statement(line: &[u8], at: usize) -> Result<Statement, Box<Refusal>> {
    let mut reader = Reader::new(line, at + 1, &Nothing);
    let refuse = |end: usize, message: &str| {
        Err(Refusal::new(
            at..end.max(at + 1),
            message,
            "O word",
            "an O word is such as o100 sub, o<name> call [1] [2], o1 while [#1 LT 5]; a program's number \
             is O1000",
        ))
    };
    reader.blanks();
    let label = match line.get(reader.at) {
        Some(b'<') => format!("<{}>", reader.name()?),
        _ => {
            let rest = &line[reader.at..];
            let digits = rest.iter().take_while(|byte| byte.is_ascii_digit()).count();
            if !(1..=15).contains(&digits) {
                return refuse(reader.at, "an O word has no number and no name");
            }
            let text = String::from_utf8_lossy(&rest[..digits]);
            reader.at += digits;
            let label = text.trim_start_matches('0');
            if label.is_empty() { "0".to_owned() } else { label.to_owned() }
        }
    };
    reader.blanks();
    let rest = &line[reader.at..];
    let length = rest.iter().take_while(|byte| byte.is_ascii_alphabetic()).count();
    let name = String::from_utf8_lossy(&rest[..length]).to_ascii_lowercase();
    reader.at += length;
    let word = if length == 0 {
        Word::Number
    } else {
        match WORDS.iter().find(|(text, _)| *text == name) {
            Some((_, word)) => *word,
            None => return refuse(reader.at, &format!("{name} is no O word")),
        }
    };
    let has_name = label.starts_with('<');
    if word == Word::Number && has_name {
        return refuse(reader.at, "an O word with a name says nothing");
    }
    let statement = Statement { label, word, span: at..reader.at, rest: reader.at };
    let takes_more = matches!(
        word,
        Word::Call
            | Word::Return
            | Word::EndSub
            | Word::If
            | Word::ElseIf
            | Word::While
            | Word::Repeat
    );
    if !takes_more {
        statement.end(line, reader.at)?;
    }
    Ok(statement)
}

/// No parameters: for lines that are only passed over.
struct Nothing;

impl Parameters for Nothing {
    fn numbered(&self, _index: u32) -> Option<f64> {
        None
    }

    fn named(&self, _name: &str) -> Option<f64> {
        None
    }
}

impl Statement {
    /// Refuses anything but a comment from `at` on.
    pub(super) fn end(&self, line: &[u8], at: usize) -> Result<(), Box<Refusal>> {
        let rest = line.get(at..).unwrap_or_default();
        match rest.trim_ascii_start().first() {
            None | Some(b'(' | b';') => Ok(()),
            Some(_) => Err(Refusal::new(
                at..line.len(),
                "something follows the O word",
                "not an O word's",
                "an O word stands alone on its line, but for its expressions in [ ] and a comment",
            )),
        }
    }

    /// All expressions that follow it.
    pub(super) fn values(
        &self,
        line: &[u8],
        most: usize,
        parameters: &dyn Parameters,
    ) -> Result<Vec<f64>, Box<Refusal>> {
        let mut reader = Reader::new(line, self.rest, parameters);
        let mut values = Vec::new();
        loop {
            reader.blanks();
            if line.get(reader.at) != Some(&b'[') {
                break;
            }
            let from = reader.at;
            values.push(reader.bracket()?);
            if values.len() > most {
                return Err(Refusal::new(
                    reader.span(from),
                    format!("the O word has more than {most} expressions"),
                    "one too many",
                    "leave it out",
                ));
            }
        }
        self.end(line, reader.at)?;
        Ok(values)
    }

    /// The one expression that follows it.
    pub(super) fn condition(
        &self,
        line: &[u8],
        parameters: &dyn Parameters,
    ) -> Result<f64, Box<Refusal>> {
        match self.values(line, 1, parameters)?.first() {
            Some(value) => Ok(*value),
            None => Err(self.refuse("the O word has no expression", "write one: o1 if [#1 GT 0]")),
        }
    }

    pub(super) fn refuse(&self, message: impl Into<String>, help: &str) -> Box<Refusal> {
        Refusal::new(self.span.clone(), message, "O word", help)
    }

    /// As a person writes it.
    pub(super) fn name(&self) -> String {
        format!("o{}", self.label)
    }
}

/// The O word of a line, `None` where it has none that can be read.
pub(super) fn of_line(line: &[u8]) -> Option<Statement> {
    let is_blank = |byte: &&u8| matches!(byte, b' ' | b'\t');
    let mut at = line.iter().take_while(is_blank).count();
    if matches!(line.get(at), Some(b'N' | b'n')) {
        at += 1;
        at += line[at..].iter().take_while(|byte| byte.is_ascii_digit() || is_blank(byte)).count();
    }
    matches!(line.get(at), Some(b'O' | b'o' | b':')).then(|| statement(line, at).ok()).flatten()
}
