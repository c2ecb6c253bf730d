//! What a person should know of a file, each thing once with how often it occurred.

use std::collections::HashMap;

use crate::shape::FileNote;

/// How many different things are told; a file of noise would fill the screen.
const MOST_NOTES: usize = 50;

/// Collects notes while a file is read.
#[derive(Debug, Default)]
pub(crate) struct Notes {
    found: Vec<Found>,
    places: HashMap<String, usize>,
    further: u64,
}

#[derive(Debug)]
struct Found {
    text: String,
    line: u64,
    count: u64,
}

impl Notes {
    /// Takes a note at a line, from 1; 0 for none. The same text again is counted.
    pub(crate) fn add(&mut self, text: impl Into<String>, line: u64) {
        let text = text.into();
        if let Some(&place) = self.places.get(&text) {
            self.found[place].count += 1;
        } else if self.found.len() < MOST_NOTES {
            self.places.insert(text.clone(), self.found.len());
            self.found.push(Found { text, line, count: 1 });
        } else {
            self.further += 1;
        }
    }

    /// The notes in the order in which they were first taken.
    pub(crate) fn finish(self) -> Vec<FileNote> {
        let mut notes: Vec<FileNote> = self
            .found
            .into_iter()
            .map(|found| FileNote {
                line: found.line,
                text: match found.count {
                    1 => found.text,
                    count => format!("{} ({count} times)", found.text),
                },
            })
            .collect();
        if self.further > 0 {
            notes.push(FileNote { line: 0, text: format!("{} further notes", self.further) });
        }
        notes
    }
}

#[cfg(test)]
mod tests {
    use super::{MOST_NOTES, Notes};

    #[test]
    fn each_note_is_told_once_with_its_count_and_first_line() {
        let mut notes = Notes::default();
        notes.add("text is left out", 3);
        notes.add("one hatch is left out", 4);
        notes.add("text is left out", 9);
        let notes = notes.finish();
        assert_eq!(notes.len(), 2);
        assert_eq!((notes[0].line, notes[0].text.as_str()), (3, "text is left out (2 times)"));
        assert_eq!((notes[1].line, notes[1].text.as_str()), (4, "one hatch is left out"));
    }

    #[test]
    fn a_file_of_noise_does_not_fill_the_memory_with_notes() {
        let mut notes = Notes::default();
        for number in 0..1000 {
            notes.add(format!("entity {number} is left out"), number);
        }
        let notes = notes.finish();
        assert_eq!(notes.len(), MOST_NOTES + 1);
        assert_eq!(notes[MOST_NOTES].text, "950 further notes");
    }
}
