//! Programs become jobs: what they begin with, when they begin, and what is said of how they end.

use crate::bench::Bench;

#[test]
fn a_single_dark_line_goes_after_a_short_silence() {
    let mut bench = Bench::new();
    bench.send("G0 X10\n");
    bench.pass(0.25);
    assert_eq!(bench.machine.programs().len(), 1);
}

#[test]
fn a_program_begins_after_silence_at_its_end_or_at_a_tape_mark() {
    for (end, wait) in [("", 0.7), ("M2\n", 0.05), ("M30\n", 0.05), ("%\n", 0.05)] {
        let mut bench = Bench::new();
        bench.send("%\nG90 M3 S100 F600\nG1 X10\nG1 X20\n");
        bench.pass(0.3);
        assert_eq!(bench.machine.programs().len(), 0);
        bench.send(end);
        bench.pass(wait);
        assert_eq!(bench.machine.programs().len(), 1, "{end:?}");
    }
}

#[test]
fn work_offsets_and_what_is_in_force_go_with_the_job() {
    let mut bench = Bench::new();
    bench.send("G10 L2 P2 X20 Y30\nG55\nG92 X1 Y2\nG91 G20\nM4 S250 F60\n");
    bench.pass(1.0);
    bench.send("G1 X0.5\nG1 Y0.5\n");
    bench.pass(0.7);
    let programs = bench.machine.programs();
    assert_eq!(programs.len(), 1, "{programs:?}");
    let expected = [
        "G21 G90 G94 M5",
        "G53 G0 X100.000000 Y100.000000",
        "G10 L2 P2 X20.000000 Y30.000000 Z0.000000",
        "G17 G55",
        "G92 X1.000000 Y2.000000 Z0.000000",
        "F1524.000000",
        "S250.000000",
        "M4",
        "G20 G91 G94 G0",
        "G1 X0.5",
        "G1 Y0.5",
    ];
    assert_eq!(programs[0].lines().collect::<Vec<_>>(), expected);
}

#[test]
fn the_next_part_goes_on_where_the_one_before_ends() {
    let mut bench = Bench::new();
    bench.send("G91 M3 S100 F600\nG1 X10\nG1 X10\n");
    bench.pass(0.6);
    bench.send("G1 X5\nG1 X5\n");
    bench.pass(0.6);
    let programs = bench.machine.programs();
    assert_eq!(programs.len(), 2);
    assert!(programs[1].contains("G53 G0 X120.000000 Y100.000000\n"), "{}", programs[1]);
}

#[test]
fn a_job_that_is_refused_is_an_alarm_and_answers_its_last_line() {
    let mut bench = Bench::new();
    bench.machine.refuses = Some("line 12: out of reach".into());
    bench.send("G90 M4 S500 F3000\nG1 X20\nM2\n");
    bench.pass(0.1);
    let lines = bench.lines();
    let told = lines
        .iter()
        .any(|line| line.starts_with("[MSG:the job is not begun: line 12: out of reach"));
    assert!(told && lines.contains(&"ALARM:2".to_owned()), "{lines:?}");
    assert_eq!(lines.last().unwrap(), "error:9");
    assert_eq!(bench.state(), "Alarm");
    assert_eq!(bench.ask("$X\n"), ["[MSG:Caution: Unlocked]", "ok"]);
}

#[test]
fn a_job_that_somebody_else_stops_takes_what_follows_with_it() {
    let mut bench = Bench::new();
    bench.send("G90 M4 S500 F3000\nG1 X20\nG1 X30\n");
    bench.pass(0.6);
    bench.send("G1 X40\nG1 X50\n");
    bench.pass(0.05);
    bench.machine.ask(&grbl::machine::Ask::Verb { verb: operator::Verb::Stop, value: 0.0 });
    bench.pass(2.0);
    assert!(bench.lines().contains(&"[MSG:the job was stopped]".to_owned()));
    assert_eq!((bench.machine.programs().len(), bench.state().as_str()), (1, "Idle"));
}

#[test]
fn the_scale_of_s_is_the_clients_where_it_sets_it() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask("$30=255\n"), ["ok"]);
    assert_eq!(bench.ask("M3 S256\n").last().unwrap(), "error:2");
    bench.pass(1.0);
    bench.send("M3 S255 F600 G1 X10\nG1 X20\nM2\n");
    let set = bench.machine.asked.iter().find_map(|ask| match ask {
        grbl::machine::Ask::Submit { set, .. } => Some(set.clone()),
        _ => None,
    });
    assert_eq!(set.unwrap(), ["gcode.dialect=grbl", "gcode.full_scale=255"]);
}
