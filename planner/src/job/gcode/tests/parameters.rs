//! Parameters, subroutines, conditions and loops. The places are those that `rs274` of LinuxCNC 2.9 goes to.

use super::words::moves;
use super::*;
use crate::job::gcode::settings::ReaderSettings;
use crate::job::gcode::{Steps, read_by};

/// The ends of all moves [mm].
fn places(text: &str) -> Vec<(f64, f64)> {
    moves(text).into_iter().map(|(_, x, y)| (x, y)).collect()
}

#[test]
fn parameters_are_numbers_that_are_set_after_their_line() {
    assert_eq!(places("#3=5\n#3=7 G0 X#3\nG0 X#3"), [(5.0, 0.0), (7.0, 0.0)]);
    assert_eq!(
        places("#1=10.0 (margin)\n#<feed>=1200\nG0 X#1 Y[#1*2]\nG1 X[#1+20] F#<feed>\nY[#1*2+10]"),
        [(10.0, 20.0), (30.0, 20.0), (30.0, 30.0)]
    );
    assert_eq!(places("#<_a B>=4\n#31=2\n#[30+1]=[#31*#<_ab>]\nG0 X#31 Y-#31"), [(8.0, -8.0)]);
    assert_eq!(places("#1=2\n#2=9\nG0 X##1 Y-SQRT[##1]"), [(9.0, -3.0)]);
    assert_eq!(places("#1=1 #2=2\nG#1 X#2 F60\nG[0] Y1"), [(2.0, 0.0), (2.0, 1.0)]);
}

#[test]
fn predefined_parameters_say_what_is_in_force() {
    let mut machine = machine(ZMeaning::Focus);
    machine.gcode.words.full_scale = 100_000.0;
    let text = "G20 G0 X1\nG0 Y#5420 Z#<_metric>\nG59.2 G0 X0\nG0 X#<_coord_system> Y#5220\n\
                G0 X[#<_rpm>+1] S7\nG0 X[#<_rpm>+2]\nG1 X[#<_feed>+1] F60\nG1 X[#<_feed>+3]\nG0 X#<_line>";
    let program = read("job.ngc", text, &machine).unwrap();
    let ends: Vec<[f64; 2]> = program
        .drawing
        .steps
        .iter()
        .map(|step| match &step.action {
            Action::Rapid { to } => *to,
            Action::Mark { curve, .. } | Action::Feed { curve, .. } => curve.to(),
            other => panic!("{other:?}"),
        })
        .map(|to| [to.x, to.y].map(|value| (value / 0.0254 * 1e9).round() / 1e9))
        .collect();
    let expected = [
        [1.0, 0.0],
        [1.0, 1.0],
        [0.0, 1.0],
        [592.0, 8.0],
        [1.0, 8.0],
        [9.0, 8.0],
        [1.0, 8.0],
        [63.0, 8.0],
        [9.0, 8.0],
    ];
    assert_eq!(ends, expected);
}

#[test]
fn subroutines_have_parameters_of_their_own() {
    let factorial = "o<f> sub\no1 if [#1 LE 1]\no<f> return [1]\no1 endif\no<f> call [#1-1]\n\
                     o<f> endsub [#1*#<_value>]\n#1=9\no<f> call [5]\nG0 X#<_value> Y#<_value_returned>\nG0 X#1";
    assert_eq!(places(factorial), [(120.0, 1.0), (9.0, 1.0)]);
    assert_eq!(
        places("o1 sub\nG0 X[#1+#2+#30]\no1 endsub\n#1=9\no1 call [1] [2]\nG0 X#1"),
        [(3.0, 0.0), (9.0, 0.0)]
    );
    // One may stand after its call.
    assert_eq!(places("o1 call\nM2\no1 sub\nG0 X1\no1 endsub"), [(1.0, 0.0)]);
    let square = "o100 sub\nG91\nG1 X5\nG1 Y5\nG1 X-5\nG1 Y-5\nG90\no100 endsub\nG21 G90\nM3 S500 F1200\n\
                  G0 X10 Y10\no100 call\nG0 X30 Y10\no100 call\n#1=0\no200 while [#1 LT 3]\nG0 X[50+10*#1] \
                  Y10\no100 call\n#1=[#1+1]\no200 endwhile\nM5\nM2\n";
    let program = flat(square);
    assert!((program.facts.mark_length - 0.100).abs() < 1e-12);
    assert!((program.facts.rapid_length - 0.07414213562373095).abs() < 1e-12);
    assert_eq!(program.facts.end[0], 0.070);
}

#[test]
fn programs_are_called_by_their_number() {
    let text = "%\nG21 G90\nM3 S500 F1200\nG0 X10 Y10\nM98 P1000 L3\nM5\nM30\nO1000\nG91 G1 X5\nY5\nX-5\nY-5\n\
                G0 X10\nG90\nM99\n%\n";
    let program = flat(text);
    assert!((program.facts.mark_length - 0.060).abs() < 1e-12);
    assert!((program.facts.end[0] - 0.040).abs() < 1e-15);
    assert!(program.drawing.notes.is_empty());
    // Numbered parameters are shared, named ones are not.
    let text = "#1=5\nM98 P100\nG0 X#1\nM30\nO100\n#1=7\nG0 Y#1\nM99";
    assert_eq!(places(text), [(0.0, 7.0), (7.0, 7.0)]);
    assert!(
        refused("#<n>=3\nM98 P100\nM30\nO100\nG0 Y#<n>\nM99").message.contains("#<n> has no value")
    );
    let error = refused("M98 P8\nG0 X1\nO8\nG0 Y3\nM99");
    assert_eq!((error.line, error.message.as_str()), (3, "the program runs into O8"));
}

#[test]
fn conditions_and_loops_are_linuxcncs() {
    let x = |text: &str| places(text).into_iter().map(|place| place.0).collect::<Vec<_>>();
    assert_eq!(x("o1 if [0]\nG0 X1\no1 else\nG0 X2\no1 endif\nG0 X3"), [2.0, 3.0]);
    let branches = "o9 sub\no1 if [#1 EQ 3]\nG0 X1\no1 elseif [#1 EQ 4]\nG0 X2\no1 else\nG0 X3\no1 endif\no9 \
                    endsub\no9 call [3]\no9 call [4]\nO9 CALL [5]";
    assert_eq!(x(branches), [1.0, 2.0, 3.0]);
    assert_eq!(x("o1 while [0]\nG0 X#<q>\no1 endwhile\nG0 X2"), [2.0]);
    assert_eq!(x("o1 repeat [1.5]\nG0 X[#<_x>+1]\no1 endrepeat"), [1.0, 2.0]);
    assert_eq!(x("o1 repeat [-2]\nG0 X1\no1 endrepeat\nG0 X9"), [9.0]);
    let loops = "o1 KIND\n#1=[#1+1]\no2 if [#1 EQ 3]\no1 continue\no2 endif\no3 if [#1 EQ 5]\no1 break\n\
                 o3 endif\nG0 X#1\n";
    let of = |kind: &str, end: &str| x(&format!("{}{end}\nG0 X9", loops.replace("KIND", kind)));
    assert_eq!(of("while [1]", "o1 endwhile"), [1.0, 2.0, 4.0, 9.0]);
    assert_eq!(of("do", "o1 while [1]"), [1.0, 2.0, 4.0, 9.0]);
    assert_eq!(x("o1 do\nG0 X[#<_x>+1]\no1 while [#<_x> LT 3]"), [1.0, 2.0, 3.0]);
    assert_eq!(x("N5 o1 if [1]\nG0 X4\nN7 o1 endif (c)"), [4.0]);
}

#[test]
fn what_has_no_end_is_refused_at_its_line() {
    let machine = machine(ZMeaning::Ignored);
    let settings = ReaderSettings { most_lines: 10_000, ..ReaderSettings::of(&machine) };
    let check = |text: &str, line: u64, message: &str| {
        let error = read_by("job.ngc", text, &settings).unwrap_err();
        assert!(error.message.contains(message) && error.line == line, "{text}: {error}");
    };
    check("G0 X1\no1 while [1]\n#1=[#1+1]\no1 endwhile", 4, "gone through 10000 lines");
    check("o1 sub\no1 call\no1 endsub\no1 call", 2, "nested more than 10 deep");
    check("o1 sub\nG0 X1\nM2", 3, "o1 of line 1 has no end in this file");
    check("o1 while [1]\nG0 X1\nM5", 3, "the file ends inside o1");
    check("o1 endwhile", 1, "nothing that o1 ends is open here");
    check("o1 repeat [3]\no1 break\no1 endrepeat", 2, "no loop o1 is being run here");
    check("o1 endsub", 1, "o1 is not being run here");
    check("o1 if [1] G0 X1\no1 endif", 1, "something follows the O word");
    check("o1 call", 1, "there is no o1 sub in this file");
    check("o1 if\no1 endif", 1, "the O word has no expression");
    check("o<a", 1, "the name is not closed");
    check("G0 X[1/0]", 1, "a division by zero");
}

/// A loop is read again and again, but its steps come as they are asked for.
#[test]
fn a_program_with_loops_is_counted_by_the_lines_that_are_run() {
    let text = "o1 repeat [2000]\nG91 G0 X0.1\no1 endrepeat\nG90\n";
    let settings = ReaderSettings::of(&machine(ZMeaning::Ignored));
    let reading = |most| Steps::new("job.ngc", text.as_bytes(), &settings).read_through(most);
    let (survey, steps) = reading(3000).unwrap();
    assert_eq!((survey.steps, survey.lines, steps), (2000, 4002, None));
    assert_eq!(reading(5000).unwrap().1.unwrap().len(), 2000);
}

/// Ten thousand mutations of programs with everything: each is a sound drawing or refused on a line of it.
#[test]
fn mutations_of_programs_with_loops_never_panic() {
    use messages::random::SplitMix64;
    const PROGRAMS: [&str; 3] = [
        "o<f> sub\no1 if [#1 LE 1]\no<f> return [1]\no1 else\nG1 X#1 F60\no1 endif\no<f> call [#1-1]\n\
         o<f> endsub [#1*#<_value>]\nM3 S9\no<f> call [3]\nG0 X#<_value>\n",
        "#1=1 #<a>=2\no1 do\n#1=[#1+1]\no2 if [#1 EQ 3 AND EXISTS[#<a>]]\no1 continue\no2 endif\nG1 X#1 F[60]\n\
         o1 while [#1 LT 6]\no3 repeat [2]\nG0 Y[SIN[30]*#1]\no3 endrepeat\n",
        "%\nO1\nM98 P7 L2\no4 while [#4 LT 3]\n#4=[#4 + 1]\nG2 X[#4*5] R10 F60\no4 endwhile\nM30\nO7\n#2=5 M3 S5\nM99\n%\n",
    ];
    const PIECES: &[&str] = &[
        "#1",
        "[",
        "]",
        "=",
        "+",
        "*",
        "**",
        "MOD",
        "o1",
        "o<f>",
        "if",
        "endif",
        "while",
        "sub",
        "call",
        "\n",
        "X",
        "G1",
        "5",
        "-",
        "#<a>",
        "<",
        ">",
        "EXISTS",
        "ATAN[1]/[2]",
        "M99",
        "break",
        "%",
        "\u{e9}",
    ];
    let mut random = SplitMix64::new(5);
    let machine = machine(ZMeaning::Ignored);
    for round in 0..10_000 {
        let mut text = PROGRAMS[round % PROGRAMS.len()].to_owned();
        for _ in 0..1 + random.bits() % 3 {
            let places: Vec<usize> = text.char_indices().map(|(at, _)| at).collect();
            let at = places[(random.bits() % places.len() as u64) as usize];
            let piece = PIECES[(random.bits() % PIECES.len() as u64) as usize];
            match random.bits() % 3 {
                0 => {
                    text.remove(at);
                }
                1 => text.insert_str(at, piece),
                _ => {
                    let length = text[at..].chars().next().map_or(0, char::len_utf8);
                    text.replace_range(at..at + length, piece);
                }
            }
        }
        // A loop without end takes its time, and has a test of its own.
        let settings = ReaderSettings { most_lines: 500, ..ReaderSettings::of(&machine) };
        let steps = Steps::new("job.ngc", text.as_bytes(), &settings);
        let Err(error) = steps.read_through(u64::MAX) else { continue };
        assert!(
            error.line >= 1 && error.line <= 1 + text.matches('\n').count() as u64,
            "{error}\n{text}"
        );
    }
}
