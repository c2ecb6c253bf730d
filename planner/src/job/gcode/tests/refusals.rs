//! Every refusal names its place, what is wrong, and what would be right.

use miette::Diagnostic;

use super::*;

fn check(text: &str, line: u64, column: u64, message: &str, help: &str) {
    let error = refused(text);
    assert_eq!((error.line, error.column), (line, column), "{text}: {error}");
    assert!(error.message.contains(message), "{text}: {error}");
    assert!(error.help.contains(help), "{text}: {}", error.help);
    assert!(error.to_string().starts_with(&format!("job.ngc:{line}:{column}: ")));
    let label = error.labels().unwrap().next().unwrap();
    assert!(label.offset() + label.len() <= text.len(), "{text}: {label:?}");
}

#[test]
fn codes_that_are_not_there() {
    check("G0 X1\nG43.2 H1", 2, 1, "G43.2 is not supported", "no tool lengths");
    check("G43.1 Z5", 1, 7, "Z5 of G43.1 is not 0", "G92 or G10");
    check("T1 m 66", 1, 4, "M66 is not supported", "no inputs");
    check("G16", 1, 1, "G16 is not supported", "polar");
    check("G51 X2", 1, 1, "G51 is not supported", "scaling");
    check("G68 X0 Y0 R30", 1, 1, "G68 is not supported", "rotation");
    check("G41 D1", 1, 1, "G41 is not supported", "width of the line");
    check("G71", 1, 1, "G71 is not supported", "gcode.dialect");
    check("G50 X1", 1, 5, "G50 with coordinates", "G92 or G10");
    check("G38.2 Z-5 F100", 1, 1, "G38.2 is not supported", "no probe");
    check("M3 I S0", 1, 4, "I has no number", "gcode.dialect = \"marlin\"");
    check("M62", 1, 1, "the digital output has no P", "M64 P0");
    check("M64 P63", 1, 5, "there is no digital output P63", "0 to 62");
    check("M64 P0 G4 P1", 1, 11, "P is on this line twice", "line break");
    check("M64 G4 P1", 1, 8, "two codes of this line use P", "lines of their own");
    check("G10 P1 X0", 1, 1, "G10 has no L", "G10 L20 P1");
    check("G10 L2 X0", 1, 1, "G10 has no P", "G10 L20 P1");
    check("G10 L2 P10 X0", 1, 8, "there is no work coordinate system P10", "P0 is");
    check("G10 L1 P1 X0", 1, 5, "G10 L1 is not supported", "G10 L20 P1");
    check("G10 L2 P1 R5", 1, 11, "a rotation of the coordinates", "G10 L20 P1");
    check("G10 L2 P1 G1 X0", 1, 11, "G10 and G1 both take", "lines of their own");
    check("G1 F9 S1:2", 1, 9, "a cluster of powers needs a G1 move", "three equal parts");
    check("G0 X1 S1:2", 1, 9, "a cluster of powers needs a G1 move", "three equal parts");
    check("G1 F9 X1 M3 S1:2:1001", 1, 17, "S1001 is outside 0 to 1000", "S1000");
    check("F9 G1 X1 S1:1:1:1:1:1:1:1:1:1:1:1:1:1:1:1:1", 1, 42, "more than 16 powers", "rest");
    check("G81 X1", 1, 1, "G81 is not supported", "canned cycles");
    check("g 59.4", 1, 1, "G59.4 is not supported", "G59.1-G59.3");
    check("G1.05", 1, 1, "G1.05 is not supported", "supported are G0 G1");
    check("G-1", 1, 1, "G-1 is not supported", "supported are");
    check("M50", 1, 1, "M50 is not supported", "override");
    check("M106 S255", 1, 1, "M106 is not supported", "M3 or M4");
    check("(é) A1", 1, 5, "no rotary axis", "X, Y and Z");
    check("U1", 1, 1, "U is not an axis", "X, Y and Z");
    check("X1e4", 1, 3, "E words are not supported", "no exponent");
    check("G1 X1e1 Y2e1", 1, 6, "E words are not supported", "no exponent");
    check("M67 E1 Q5", 1, 5, "there is no analog output E1", "M67 E0 Q50");
    check("M67 Q5", 1, 1, "the analog output has no E", "M67 E0 Q50");
    check("M5 M68 E0", 1, 4, "the analog output has no Q", "M67 E0 Q50");
    check("M67 E0 Q1001", 1, 8, "Q1001 is outside 0 to 1000", "Q1000");
    check("M67 M68 E0 Q1", 1, 5, "M67 and M68 are both of the analog output group", "lines");
    check("M67 E0 Q1 G64 P1", 1, 8, "two codes of this line use Q", "lines of their own");
    check("G0 X1 Q5", 1, 7, "nothing on this line uses Q", "M67");
    check("D1", 1, 1, "D words are not supported", "words begin with");
    check("G0 X1\n% tape note", 2, 1, "% is not alone on its line", "begins or ends");
    check("o100 subb", 1, 1, "subb is no O word", "o100 sub");
    check("M99", 1, 1, "M99 in the main program", "M30");
    check("M98 P7\nM30\nO8\nM99", 1, 1, "there is no program O7", "O1000");
    check("G0 X#<a>", 1, 5, "#<a> has no value", "[#1 * 2]");
}

#[test]
fn codes_that_exclude_each_other() {
    check("G0 G1 X1", 1, 4, "G0 and G1 are both of the motion group", "lines of their own");
    check("G90 g 91", 1, 5, "G90 and G91 are both of the distance group", "lines of their own");
    check("M3 M5", 1, 4, "M3 and M5 are both of the laser group", "lines of their own");
    check("G4 P1 G92 X0", 1, 7, "G4 and G92 are both of the non-modal group", "lines");
    check("G28 G1 X0", 1, 5, "G28 and G1 both take the coordinates", "lines of their own");
    check("G4 G64 P1", 1, 8, "two codes of this line use P", "lines of their own");
    check("G0 X1 x2", 1, 7, "X is on this line twice: X1 and X2", "line break");
}

#[test]
fn words_that_are_missing_or_stray() {
    check("X1", 1, 1, "nothing on this line uses X", "G0, G1, G2 or G3");
    check("G0 X1\nG80 X2", 2, 5, "nothing on this line uses X", "G0, G1, G2 or G3");
    check("G0 X1 I2", 1, 7, "nothing on this line uses I", "G2 and G3");
    check("G0 X1 P2", 1, 7, "nothing on this line uses P", "G4");
    check("G1 X1", 1, 1, "the move has no feed rate", "F600");
    check("F0\nG1 X1", 2, 1, "the move has no feed rate", "F600");
    check("G93 G1 X1 F2\nX2", 2, 1, "the move has no feed rate", "G93");
    check("G93 G1 X1 F2\nG94 X2", 2, 5, "the move has no feed rate", "F600");
    check("F-5", 1, 1, "F-5 is negative", "above 0");
    check("M3 S1001", 1, 4, "S1001 is outside 0 to 1000", "S1000");
    check("M3 S-1", 1, 4, "S-1 is outside 0 to 1000", "S1000");
    check("G4", 1, 1, "G4 has no P", "seconds");
    check("G4 P-1", 1, 4, "a dwell of -1 s", "seconds");
    check("G64 P-1", 1, 5, "negative", "0 or above");
    check("G92", 1, 1, "G92 has no coordinates", "G92 X0 Y0");
    check("G53 X1", 1, 1, "G53 needs G0 or G1", "machine's zero");
    check("G91 G53 G0 X1", 1, 5, "G53 needs G0 or G1", "G91");
    check("G0 X1 N5", 1, 7, "N stands inside a line", "first word");
    check("T1.5", 1, 1, "T needs a whole number", "0, 1, 2");
    check("G0 X1 % ", 1, 7, "% is not alone", "on a line of its own");
}

#[test]
fn arcs_that_are_not_there() {
    check("F9 G2 X1", 1, 4, "the arc has no centre", "needs I or J, or R");
    check("F9 G18 G2 X1 J1", 1, 14, "J is not in the plane", "K and I");
    check("F9 G90.1 G2 X1 I1", 1, 10, "the arc has no centre", "needs I and J, or R");
    check("F9 G2 X1 I1 R1", 1, 13, "the arc has R and a centre", "either R");
    check("F9 G2 X0 R1", 1, 4, "ends where it starts", "full circle");
    check("F9 G2 X3 R1", 1, 4, "radius of 1.000000 mm cannot reach an end 3.000000 mm", "1.500000");
    check("F9 G2 X3 I1", 1, 4, "1.000000 mm at its start and 2.000000 mm at its end", "G90.1");
    check("F9 G2 X1 I0 J0", 1, 4, "the radius is 0", "G91.1");
    check("F9 G2 X1 I.5 P1.5", 1, 14, "P1.5 is not a number of turns", "whole number");
    check("F9 G3 X1 I.5\nX5 I1", 2, 1, "at its start", "differ by 0.028 mm");
}

/// Line and message of every error that one reading finds.
fn all(text: &str) -> Vec<(u64, String)> {
    let first = refused(text);
    let others = first.others.iter().map(|other| (other.line, other.message.clone()));
    std::iter::once((first.line, first.message.clone())).chain(others).collect()
}

#[test]
fn what_is_not_supported_is_found_at_once() {
    let found =
        all("G21 G90 G51\nT1 M66\nG43.2 H1 Z5\nM50\nG0 X10\nM3 S500\nM66\nG1 X2\nM19\nM2\nM20");
    let unsupported = |line, code| (line, format!("{code} is not supported"));
    let feed = (8, "the move has no feed rate".to_owned());
    let expected = [
        unsupported(1, "G51"),
        unsupported(2, "M66"),
        unsupported(3, "G43.2"),
        unsupported(4, "M50"),
        feed,
        unsupported(9, "M19"),
    ];
    assert_eq!(found, expected);
    // The program ends with its tape mark, and the feed of the refused line holds.
    let found = all("%\nF600 M66\nG1 X1\nX\u{2212}5\nM50\n%\nM19");
    let dash = (4, "X has no number, but minus sign (U+2212)".to_owned());
    assert_eq!(found, [unsupported(2, "M66"), dash, unsupported(5, "M50")]);
    let many: String = (200..300).map(|code| format!("M{code}\n")).collect();
    assert_eq!(all(&many).len(), 20);
    let last = refused(&many).others.pop().unwrap();
    assert!(last.help.ends_with("\n80 more lines are refused, not shown"), "{}", last.help);
}

#[test]
fn one_error_makes_no_others() {
    let count = |text: &str| all(text).into_iter().map(|error| error.0).collect::<Vec<_>>();
    // No feed, no motion and no place after a line that could not be read.
    assert_eq!(count("G1 X1,5 F600\nX2\nG2 X3 I1\nY5\nM66\nM66"), [1, 5]);
    assert_eq!(count("G81 X1 R2\nX3\nX4\nG1 Y5\nS2000"), [1, 4, 5]);
    assert_eq!(count("F600 G0 X1 S2000\nX2\nG1 X3\nG2 X9 R1\nG0 X0 Y0\nG2 X9 R1"), [1, 6]);
    // Two arcs that do not fit are two errors, and the end of one is the start of the next.
    assert_eq!(count("F600 G2 X9 I1\nG3 X10 I1\nG3 X12 I1"), [1, 2]);
    // A missing feed is one.
    assert_eq!(count("G1 X1\nX2\nX3\nM66"), [1, 4]);
    // A subroutine that fails leaves open what comes next.
    assert_eq!(count("o1 sub\nG0 X#<a>\nM66\no1 endsub\no1 call\nG0 X#<a>\nM50"), [2, 3, 7]);
}

#[test]
fn all_errors_are_shown_with_their_places() {
    let error = refused("G21 G51\nG0 X1\nM66\n");
    let mut text = String::new();
    let theme = miette::GraphicalTheme::unicode_nocolor();
    miette::GraphicalReportHandler::new_themed(theme).render_report(&mut text, &error).unwrap();
    for expected in ["job.ngc:1:5", "G51 is not supported", "job.ngc:3:1", "M66 is not supported"] {
        assert!(text.contains(expected), "{expected}\n{text}");
    }
}
