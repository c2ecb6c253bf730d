//! Characters that come into programs by way of web pages and word processors, by their names.

/// What a person calls `character`, with its number: `no-break space (U+00A0)`.
pub(super) fn name(character: char) -> String {
    let number = u32::from(character);
    let name = match character {
        '\0' => "null character",
        '\u{b}' => "vertical tab",
        '\u{c}' => "form feed",
        '\u{18}' => "ctrl-X",
        '\u{1a}' => "ctrl-Z",
        '\u{85}' => "next-line character",
        '\u{a0}' => "no-break space",
        '\u{2009}' => "thin space",
        '\u{200b}' => "zero-width space",
        '\u{202f}' => "narrow no-break space",
        '\u{2010}' => "hyphen",
        '\u{2011}' => "non-breaking hyphen",
        '\u{2013}' => "en dash",
        '\u{2014}' => "em dash",
        '\u{2212}' => "minus sign",
        '\u{2028}' => "line separator",
        '\u{2029}' => "paragraph separator",
        '\u{2018}' | '\u{2019}' | '\u{201c}' | '\u{201d}' => "typographic quotation mark",
        '\u{feff}' => "byte order mark",
        '\u{fffd}' => "illegible character",
        _ if character.is_control() => "control character",
        _ => return format!("character '{character}' (U+{number:04X})"),
    };
    format!("{name} (U+{number:04X})")
}

/// What to write instead of `character`, where that is plain.
pub(super) fn instead(character: char) -> Option<&'static str> {
    Some(match character {
        '\u{a0}' | '\u{2009}' | '\u{202f}' | '\u{200b}' | '\u{b}' => {
            "write a plain space, or nothing"
        }
        '\u{2010}'..='\u{2014}' | '\u{2212}' => "write a plain hyphen (-) for a negative number",
        '\u{85}' | '\u{2028}' | '\u{2029}' => "end lines with a line feed",
        '\0' | '\u{c}' | '\u{1a}' | '\u{feff}' | '\u{fffd}' => "delete it",
        _ => return None,
    })
}

/// What a person calls a sender's command that begins with `character`.
pub(super) fn command(character: char) -> String {
    match character {
        '\u{18}' => "ctrl-X".to_owned(),
        _ => character.to_string(),
    }
}

/// What is there for a sender's command that begins with `character`.
pub(super) fn command_advice(character: char) -> &'static str {
    match character {
        '$' => {
            "delete the line: settings such as $30 stand in the machine file (gcode.full_scale), and \
             homing and jogging are no part of a program"
        }
        '?' => "delete the line: `graver status` tells the state",
        '!' => "delete the line: `graver hold` holds a job",
        '~' => "delete the line: `graver resume` resumes a job",
        _ => "delete the line: `graver stop` stops a job",
    }
}
