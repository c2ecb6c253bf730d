//! What a file may be written in, and where a program ends in it.

use super::*;

fn notes(text: &str) -> Vec<(u64, String)> {
    flat(text).drawing.notes.into_iter().map(|note| (note.line, note.text)).collect()
}

#[test]
fn a_carriage_return_alone_ends_a_line() {
    let program = flat("M3 S500\rG1 X10 F600\rY10\r");
    assert_eq!(program.drawing.steps.len(), 2);
    assert!((program.facts.mark_length - 0.020).abs() < 1e-15);
}

#[test]
fn a_tape_mark_ends_only_a_program_that_one_has_begun() {
    // Grbl passes over it, and LinuxCNC refuses it: nothing may be lost in silence.
    let text = "G21 G90\nF1000\n%\nG0 X10 Y10\nM3 S100\nG1 X20\nM5\n%\n";
    assert!((flat(text).facts.mark_length - 0.010).abs() < 1e-15);
    let said = "% is passed over: no % has begun the program, so none ends it";
    assert_eq!(notes(text), [(3, said.to_owned())]);
    // At the end of a file it says nothing new.
    assert_eq!(notes("G0 X1\n%\n(bye)\n"), []);
    let text = "%\nG0 X1\n%\n%\nG0 X2\n ( a )\n\nM5\n";
    assert_eq!(flat(text).drawing.steps.len(), 1);
    let said = "the program ends here: 2 lines with words after it, not read";
    assert_eq!(notes(text), [(3, said.to_owned())]);
    let said = "the program ends here: one line with words after it, not read";
    assert_eq!(notes("G0 X1\nM30\n%\nthis is no g-code"), [(2, said.to_owned())]);
    assert_eq!(notes("%\nG0 X1\nM30\n%\n"), []);
}
