//! A program read step by step is the program read whole.

use std::io::{self, Read};

use super::samples::ALL;
use super::*;
use crate::drawing::{Note, Step};
use crate::job::gcode::Steps;
use crate::job::gcode::pieces::Pieces;
use crate::job::gcode::settings::ReaderSettings;
use messages::random::SplitMix64;

/// The steps of `text` up to its end or its error.
fn stream(text: &str, piece: usize) -> (Vec<Step>, Option<String>) {
    let settings = ReaderSettings::of(&machine(ZMeaning::Ignored));
    let mut read = Vec::new();
    for step in Steps::new("job.ngc", Pieces(text.as_bytes(), piece), &settings) {
        match step {
            Ok(step) => read.push(step),
            Err(error) => return (read, Some(error.to_string())),
        }
    }
    (read, None)
}

/// A program of `lines` moves, arcs, switches and dwells.
fn random_program(lines: u64, seed: u64) -> String {
    let mut random = SplitMix64::new(seed);
    let mut text = String::from("G21 G90 F600 M3 S10 G0 X1 Y1\n");
    for _ in 0..lines {
        let number = random.bits() % 1000;
        text.push_str(&match random.bits() % 12 {
            0 => format!("G0 X{number} Y5\n"),
            1 => format!("G2 X{number} R{}\n", 600 + number),
            2 => format!("S{number}\n"),
            3 => "M8 (air)\n".to_owned(),
            4 => "M5 M9\n".to_owned(),
            5 => "M4 T1\n".to_owned(),
            6 => format!("G4 P0.{number}\n"),
            7 => format!("G64 P0.{number}\n"),
            _ => format!("G1 X{number}.25 Y{}\n", random.bits() % 90),
        });
    }
    text
}

#[test]
fn a_stream_gives_the_steps_of_the_whole() {
    let long = random_program(20_000, 7);
    for text in ALL.into_iter().chain(["", "%\n%", &long]) {
        let whole = flat(text).drawing.steps;
        for piece in [7, 4096, usize::MAX] {
            assert_eq!(stream(text, piece), (whole.clone(), None));
        }
    }
}

#[test]
fn a_stream_ends_with_the_error_of_the_whole_behind_the_steps_before_it() {
    for length in [0, 1, 3000] {
        let text = random_program(length, 3);
        let before = flat(&text).drawing.steps;
        let broken = format!("{text}G0 X1 M66\nG0 X2\n");
        let message = refused(&broken).to_string();
        assert!(message.starts_with(&format!("job.ngc:{}:7: M66", length + 2)), "{message}");
        let (steps, error) = stream(&broken, 100);
        assert_eq!(error, Some(message));
        // The end of the program would have switched the air off.
        assert_eq!(steps[..], before[..steps.len()]);
        assert!(steps.len() + 1 >= before.len());
    }
}

#[test]
fn a_program_that_cannot_be_read_on_says_so_at_its_line() {
    struct Broken;
    impl Read for Broken {
        fn read(&mut self, _into: &mut [u8]) -> io::Result<usize> {
            Err(io::Error::other("the disk is gone"))
        }
    }
    let source = b"G0 X1\nG0 X2\n".as_slice().chain(Broken);
    let settings = ReaderSettings::of(&machine(ZMeaning::Ignored));
    let read: Vec<_> = Steps::new("job.ngc", source, &settings).collect();
    assert_eq!(read.len(), 3);
    let error = read[2].as_ref().unwrap_err();
    assert_eq!(error.to_string(), "job.ngc:3:1: the program cannot be read on: the disk is gone");
}

#[test]
fn a_reading_without_keeping_counts_what_one_that_keeps_has() {
    let text = random_program(5000, 1);
    let settings = ReaderSettings::of(&machine(ZMeaning::Ignored));
    let reading = |most| Steps::new("job.ngc", text.as_bytes(), &settings).read_through(most);
    let (whole, kept) = reading(5001).unwrap();
    assert_eq!(kept.unwrap().len() as u64, whole.steps);
    for most in [0, 1, 5000] {
        assert_eq!(reading(most).unwrap(), (whole.clone(), None));
    }
    assert_eq!(whole.lines, 5001);
    let tool = Note { line: whole.notes[0].line, text: whole.notes[0].text.clone() };
    assert_eq!(whole.notes, [tool]);
}

#[test]
fn the_estimate_is_what_moves_and_dwells_take_at_their_speeds() {
    let mut machine = machine(ZMeaning::Ignored);
    machine.path.speed = 0.1;
    machine.path.rapid = 0.5;
    let time = |text: &str| {
        let reading = Steps::new("job.ngc", text.as_bytes(), &ReaderSettings::of(&machine));
        reading.read_through(0).unwrap().0.time
    };
    let near = |time: f64, expected: f64| assert!((time - expected).abs() < 1e-12, "{time}");
    near(time("G0 X100\nG4 P0.5\nM0"), 0.7);
    near(time("M3 S5 G1 X50 F3000"), 1.0);
    // A mark no faster than the machine may, and a move in the dark neither.
    near(time("M3 S5 G1 X50 F60000"), 0.5);
    near(time("G1 X50 F60000"), 0.1);
    near(time("M3 S5 G93 G1 X50 F30"), 2.0);
    near(time("M3 S5 G93 G1 X50 F6000"), 0.5);
}
