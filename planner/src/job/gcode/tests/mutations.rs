//! Broken programs: each is refused on its line, or is still a sound drawing; none panics.

use super::samples::ALL;
use super::*;
use crate::job::gcode::read_by;
use crate::job::gcode::settings::ReaderSettings;
use messages::random::SplitMix64;

/// Reads `text` on both kinds of machine; gives back the refusal's line.
fn try_read(text: &str) -> Option<u64> {
    let mut line = None;
    for z in [ZMeaning::Ignored, ZMeaning::Focus] {
        // A loop without end takes its time, and has a test of its own.
        let settings = ReaderSettings { most_lines: 500, ..ReaderSettings::of(&machine(z)) };
        match read_by("job.ngc", text, &settings) {
            Ok(program) => {
                check_sound(&program, text);
                let facts = program.facts;
                let sums = [facts.feed_length, facts.rapid_length, facts.mark_length];
                assert!(sums.iter().chain(&facts.end).all(|value| value.is_finite()), "{text}");
            }
            Err(error) => {
                assert!(error.line >= 1 && error.column >= 1, "{error}\n{text}");
                assert!(
                    error.line <= 1 + text.matches(['\n', '\r']).count() as u64,
                    "{error}\n{text}"
                );
                assert!(!error.message.is_empty() && !error.help.is_empty(), "{error}\n{text}");
                line = Some(error.line);
            }
        }
    }
    line
}

/// Where the words of the program proper are: outside comments, before its end.
fn words(text: &str) -> Vec<(usize, usize)> {
    let mut words = Vec::new();
    let mut offset = 0;
    for line in text.split_inclusive('\n') {
        let code = line.split(['(', ';']).next().unwrap_or("");
        let skipped = code.starts_with('/') || code.starts_with('%');
        let mut start = None;
        for (at, character) in code.char_indices().chain([(code.len(), 'A')]) {
            if skipped || !character.is_ascii_alphabetic() {
                continue;
            }
            if let Some(from) = start.replace(at) {
                words.push((offset + from, offset + code[..at].trim_end().len()));
            }
        }
        if code.starts_with("M2") || code.starts_with("M30") {
            break;
        }
        offset += line.len();
    }
    words
}

fn line_of(text: &str, at: usize) -> u64 {
    1 + text[..at].matches('\n').count() as u64
}

#[test]
fn a_word_without_a_sound_number_is_refused_on_its_line() {
    let huge = "9".repeat(400);
    for text in ALL {
        for (from, to) in words(text) {
            for number in [
                "", "nan", "inf", "1e400", "--1", "1.2.3", "1,5", "#", "[1", "#<a>", "SIN", ".",
                "- ", &huge,
            ] {
                let broken = format!("{}{number}{}", &text[..=from], &text[to..]);
                assert_eq!(try_read(&broken), Some(line_of(text, from)), "{number}\n{broken}");
            }
            // A number without its letter, unless the letter before takes it as its own digits.
            let broken = format!("{}{}", &text[..from], &text[from + 1..]);
            assert_eq!(try_read(&broken), Some(line_of(text, from)), "{broken}");
        }
    }
}

#[test]
fn a_word_changed_lost_doubled_or_swapped_never_panics() {
    for text in ALL {
        let words = words(text);
        for (index, &(from, to)) in words.iter().enumerate() {
            try_read(&format!("{}{}", &text[..from], &text[to..]));
            for number in ["0", "-0", "-1", "1e-3", "0.0000001", "999999999", "-999999999", "2.5"] {
                try_read(&format!("{}{number}{}", &text[..=from], &text[to..]));
            }
            for letter in "ABCDEFGHIJKLMNOPQRSTUVWXYZ%/(;)#*\u{b5}\u{2212}".chars() {
                try_read(&format!("{}{letter}{}", &text[..from], &text[from + 1..]));
            }
            if !text[from..].starts_with(['G', 'g', 'M', 'N', 'n']) {
                let doubled = format!("{} {}{}", &text[..to], &text[from..to], &text[to..]);
                assert_eq!(try_read(&doubled), Some(line_of(text, from)), "{doubled}");
            }
            if let Some(&(next, end)) = words.get(index + 1) {
                try_read(&format!(
                    "{}{}{}{}{}",
                    &text[..from],
                    &text[next..end],
                    &text[to..next],
                    &text[from..to],
                    &text[end..]
                ));
            }
        }
        for at in 0..text.len() {
            try_read(&text[..at]);
        }
    }
}

#[test]
fn random_text_never_panics() {
    const PIECES: &[&str] = &[
        "G0",
        "G1",
        "G2",
        "G3",
        "G17",
        "G18",
        "G19",
        "G90",
        "G91",
        "G90.1",
        "G93",
        "G94",
        "F600",
        "M3",
        "M4",
        "S10",
        "X1",
        "X-5",
        "Y2",
        "Y0",
        "Z1",
        "I1",
        "J-1",
        "K2",
        "R3",
        "R-3",
        "P2",
        "G20",
        "G28",
        "G92",
        "G53",
        "G54",
        "G59.3",
        "G64",
        "G4",
        "\n",
        "\n",
        "\n",
        " ",
        "(c)",
        ";",
        "/",
        "%",
        "e",
        "1",
        ".",
        "-",
        "\u{e9}",
        "\0",
        "\u{feff}",
        "N1",
        "T1",
        "M0",
        "M8",
        "1e400",
        "G10",
        "L2",
        "L20",
        "P1",
        "M62",
        "M65",
        "S1:2:3",
        ":4",
        "#1=2",
        "#1",
        "[1+2]",
        "#<a>",
        "o1 if [1]\n",
        "o1 endif\n",
        "o2 repeat [2]\n",
        "o2 endrepeat\n",
        "o3 sub\n",
        "o3 endsub\n",
        "o3 call\n",
        "M98",
        "M99",
        "G43",
        "H1",
        "G43.1",
        "G50",
        "M6",
        "O7",
    ];
    let mut random = SplitMix64::new(1);
    for _ in 0..20_000 {
        let count = 1 + random.bits() % 24;
        let mut text =
            String::from(if random.bits().is_multiple_of(2) { "F60 M3 S9\n" } else { "" });
        for _ in 0..count {
            text.push_str(PIECES[(random.bits() % PIECES.len() as u64) as usize]);
        }
        try_read(&text);
    }
    for _ in 0..5_000 {
        let bytes: Vec<u8> = (0..random.bits() % 64).map(|_| random.bits() as u8).collect();
        try_read(&String::from_utf8_lossy(&bytes));
    }
    for _ in 0..5_000 {
        let mut bytes = ALL[(random.bits() % 3) as usize].as_bytes().to_vec();
        for _ in 0..1 + random.bits() % 4 {
            let at = (random.bits() % bytes.len() as u64) as usize;
            bytes[at] = random.bits() as u8;
        }
        try_read(&String::from_utf8_lossy(&bytes));
    }
}
