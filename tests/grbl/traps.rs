//! What other firmware got wrong, and what would hurt somebody.

use grbl::machine::Ask;
use operator::Verb;

use crate::bench::Bench;

fn verbs(bench: &Bench) -> Vec<Verb> {
    let asked = bench.machine.asked.iter();
    asked
        .filter_map(|ask| match ask {
            Ask::Verb { verb, .. } => Some(*verb),
            _ => None,
        })
        .collect()
}

const JOB: &str = "G90 M4 S500 F3000\nG1 X20\nG1 X30\nG1 X40\nM5\n";

#[test]
fn a_new_connection_resets_nothing() {
    let mut bench = Bench::new();
    bench.send(JOB);
    bench.pass(0.6);
    assert_eq!(bench.state(), "Run");
    bench.session.disconnect(bench.now);
    bench.session.connect(bench.now);
    bench.pass(0.02);
    assert_eq!(bench.state(), "Run", "the job outlives the connection");
    assert!(verbs(&bench).is_empty());
    bench.pass(2.0);
    assert_eq!(bench.state(), "Idle");
}

#[test]
fn a_program_of_which_the_end_has_not_come_goes_with_its_client() {
    let mut bench = Bench::new();
    bench.send(JOB);
    bench.session.disconnect(bench.now);
    bench.session.connect(bench.now);
    bench.pass(2.0);
    assert_eq!(bench.machine.programs(), [""; 0]);
}

#[test]
fn a_hold_works_with_a_full_window_and_before_the_job_begins() {
    let mut bench = Bench::new();
    bench.send(JOB);
    bench.send("!");
    bench.pass(3.0);
    assert_eq!(bench.state(), "Hold:0");
    assert_eq!(bench.machine.programs(), [""; 0], "a program that is held does not begin");
    bench.send("~");
    bench.pass(0.05);
    assert_eq!(bench.state(), "Run");
    // More than any buffer holds, behind a line that waits.
    bench.send("G4 P1\n");
    bench.send("G1 X1\n".repeat(40_000));
    bench.machine.asked.clear();
    bench.send("!");
    assert_eq!(verbs(&bench), [Verb::Hold]);
    assert_eq!(bench.machine.status.state, "holding");
}

#[test]
fn a_reset_puts_the_light_out_and_forgets_all_that_was_sent() {
    let mut bench = Bench::new();
    bench.send(JOB);
    bench.pass(0.6);
    bench.send(JOB.repeat(3));
    bench.machine.asked.clear();
    let lines = bench.ask("G1 X7\x18");
    assert_eq!(lines.last().unwrap(), "Grbl 1.1h ['$' for help]");
    assert_eq!(
        bench.machine.asked[0],
        Ask::Verb { verb: Verb::Stop, value: 0.0 },
        "before all else"
    );
    bench.pass(3.0);
    assert_eq!(bench.state(), "Idle");
    assert_eq!(bench.machine.jobs, []);
    assert!(bench.ask("$G\n")[0].contains(" M5 "));
    let submits =
        bench.machine.asked.iter().filter(|ask| matches!(ask, Ask::Submit { .. })).count();
    assert_eq!(submits, 0);
}

#[test]
fn a_line_that_waits_for_the_end_never_waits_for_the_client() {
    // One line at a time, each sent when the one before is answered, with dwells inside.
    let mut bench = Bench::new();
    let program = ["G90 M4 S500 F3000", "G1 X20", "G4 P0.1", "G1 X30", "G4 P0", "M5", "G4 P0.5"];
    for line in program {
        bench.lines();
        bench.send(format!("{line}\n"));
        let before = bench.now;
        loop {
            let lines = bench.lines();
            if lines.contains(&"ok".to_owned()) {
                break;
            }
            assert!(bench.now - before < 5.0, "{line} is not answered: {lines:?}");
            bench.pass(0.01);
        }
    }
    assert_eq!(bench.machine.programs().len(), 2, "each dwell that was waited for ends a part");
}

#[test]
fn a_full_window_behind_a_line_that_waits_begins_the_job() {
    let mut bench = Bench::new();
    bench.send("G90 M4 S500 F3000\nG1 X20\nM2\n");
    let behind = "G1 X1 (waits behind the end of the program before it)\n";
    bench.send(behind);
    let free = format!("|Bf:15,{}|", 128 - behind.len());
    assert!(bench.ask("?").last().unwrap().contains(&free), "{free}");
    bench.pass(2.0);
    let lines = bench.lines();
    assert_eq!(lines.iter().filter(|line| *line == "ok").count(), 2, "{lines:?}");
}

#[test]
fn a_client_that_knows_that_more_follows_gets_one_job() {
    let mut bench = Bench::new();
    let lines = bench.ask("G90 M4 S500 F3000\nG1 X20\nG4 P0.1\nG1 X30\nG4 P0.1\nM5\n");
    assert_eq!(lines, ["ok"; 6], "a dwell with more behind it is the job's");
    bench.pass(1.0);
    assert_eq!(bench.machine.programs().len(), 1);
}

#[test]
fn the_same_command_as_utf_8_and_comments_with_accents_are_understood() {
    let mut bench = Bench::new();
    bench.ask("$J=G91 X50 F600\n");
    bench.pass(0.1);
    bench.send([0xC2, 0x85]);
    bench.pass(0.1);
    assert_eq!(bench.state(), "Idle", "cancelled");
    // Ö is C3 96, which alone would be a rapid override, ä is C3 A4, and a dash E2 80 94.
    assert_eq!(bench.ask("(Öl für Räder – 10 %)\n"), ["ok"]);
    assert_eq!(bench.ask("G21 (a\u{a0}b)\n"), ["ok"]);
    assert!(!bench.machine.status.outputs["air"]);
}

#[test]
fn every_error_is_told_with_its_line_and_the_job_is_not_begun() {
    let mut bench = Bench::new();
    let lines = bench.ask("G21 G90\nG1 X10\nM3 S100\nG1 X20 F600\nM2\n");
    assert_eq!(
        lines[1],
        "[MSG:line 2: the move has no feed rate, column 1; write F in units per minute here or before: F600]"
    );
    assert_eq!(lines[2], "error:22");
    assert!(lines.iter().any(|line| {
        line.starts_with("[MSG:the job is not begun: a line is wrong, the first is line 2")
    }));
    assert_eq!(lines.last().unwrap(), "ok");
    bench.pass(2.0);
    assert_eq!(bench.machine.programs(), [""; 0]);
    assert_eq!(bench.state(), "Idle");
}

#[test]
fn errors_have_grbls_numbers() {
    for (line, code) in [
        ("5", 1),
        ("G1 X", 2),
        ("$foo", 3),
        ("G1 X1 F-1", 4),
        ("G1 X1 S-5", 4),
        ("G1 X300 F600", 15),
        ("G0 X-1", 15),
        ("G99.1", 20),
        ("o100 sub", 20),
        ("G0 G1 X1", 21),
        ("G1 X1", 22),
        ("G92 G0 X1", 24),
        ("G0 X1 X2", 25),
        ("G92", 26),
        ("N-1 G0 X1", 27),
        ("G4", 28),
        ("G10 L2 X1", 28),
        ("G10 L2 P20 X1", 29),
        ("G53 G2 X1 R5 F1", 30),
        ("G2 X110 Y100 R1 F600", 34),
        ("G2 X110 Y110 F600", 35),
        ("G0 X1 P5", 36),
        ("G43.1 Z5", 37),
        ("$J=X10 F100 M3", 16),
        ("$J=F100", 16),
        ("$J=X10", 22),
        ("$J=X500 F100", 15),
        ("$J=G91 X-101 F100", 15),
        ("$32=0", 17),
        ("$100=1", 3),
        ("$10=-1", 4),
        ("$999=1", 3),
        ("$N0=G0", 3),
    ] {
        let mut bench = Bench::new();
        let lines = bench.ask(format!("{line}\n"));
        assert_eq!(lines.last().unwrap(), &format!("error:{code}"), "{line}: {lines:?}");
        assert!(lines[0].starts_with("[MSG:"), "{line}: {lines:?}");
        assert_eq!(lines.len(), 2, "{line}: {lines:?}");
    }
}

#[test]
fn overrides_go_to_the_machine_within_their_range() {
    let mut bench = Bench::new();
    bench.send([0x91; 12]);
    assert_eq!(bench.machine.asked.last(), Some(&Ask::Verb { verb: Verb::Override, value: 2.0 }));
    bench.send([0x92; 30]);
    assert_eq!(bench.machine.asked.last(), Some(&Ask::Verb { verb: Verb::Override, value: 0.1 }));
    bench.send([0x90, 0x93, 0x9B, 0x9B, 0x9D]);
    assert_eq!(bench.machine.asked.last(), Some(&Ask::Verb { verb: Verb::Power, value: 0.79 }));
    bench.ask("?");
    assert!(bench.ask("?")[0].contains("|Ov:101,100,79"));
    for (byte, value) in [(0x97, 0.25), (0x95, 1.0), (0x96, 0.5)] {
        bench.send([byte]);
        assert_eq!(bench.machine.asked.last(), Some(&Ask::Verb { verb: Verb::Rapid, value }));
    }
    let reports: Vec<String> = (0..3).flat_map(|_| bench.ask("?")).collect();
    assert!(reports.iter().any(|report| report.contains("|Ov:101,50,79")), "{reports:?}");
    bench.send("\x18");
    let last = &bench.machine.asked[bench.machine.asked.len() - 3..];
    assert!(last.contains(&Ask::Verb { verb: Verb::Override, value: 1.0 }));
    assert!(last.contains(&Ask::Verb { verb: Verb::Rapid, value: 1.0 }));
    assert!(last.contains(&Ask::Verb { verb: Verb::Power, value: 1.0 }));
}

#[test]
fn overrides_are_told_as_they_are_in_force_whoever_asked_for_them() {
    let mut bench = Bench::new();
    let told = |bench: &mut Bench| {
        bench.pass(0.1);
        // Now and then a report has the offsets instead.
        let reports: Vec<String> = (0..30).flat_map(|_| bench.ask("?")).collect();
        let with = reports.iter().rev().find(|report| report.contains("|Ov:")).unwrap();
        with.split("|Ov:").nth(1).unwrap().trim_end_matches('>').to_owned()
    };
    bench.send([0x9B, 0x92]);
    (bench.machine.status.rate_override, bench.machine.status.power_override) = (0.9, 0.9);
    assert!(told(&mut bench).starts_with("90,100,90"));
    // The job is over, and another client has asked for a rate.
    (bench.machine.status.rate_override, bench.machine.status.power_override) = (0.55, 1.0);
    assert!(told(&mut bench).starts_with("55,100,100"));
    bench.send([0x93]);
    assert_eq!(bench.machine.asked.last(), Some(&Ask::Verb { verb: Verb::Override, value: 0.56 }));
}

#[test]
fn a_fault_is_an_alarm_that_only_a_person_clears() {
    let mut bench = Bench::new();
    bench.send(JOB);
    bench.pass(0.6);
    bench.send("G4 P1\n");
    bench.lines();
    bench.machine.fault("following_error");
    bench.pass(0.1);
    let lines = bench.lines();
    assert!(lines.contains(&"ALARM:3".to_owned()), "{lines:?}");
    assert_eq!(
        lines.iter().filter(|line| line.starts_with("error:")).count(),
        1,
        "the dwell's answer"
    );
    assert_eq!(bench.state(), "Alarm");
    assert_eq!(bench.ask("G0 X1\n").last().unwrap(), "error:9");
    bench.send("\x18");
    assert_eq!(bench.state(), "Alarm", "no reset clears a fault");
    assert_eq!(bench.ask("$X\n"), ["[MSG:Caution: Unlocked]"]);
    bench.pass(0.3);
    assert_eq!(bench.lines(), ["ok"]);
    assert_eq!(bench.state(), "Idle");
}

#[test]
fn an_unhomed_machine_is_locked_until_it_is_homed_or_unlocked() {
    let mut bench = Bench::new();
    bench.machine.status.unhomed = vec!["x".into()];
    bench.pass(0.1);
    assert_eq!(bench.state(), "Alarm");
    assert_eq!(bench.ask("G0 X1\n").last().unwrap(), "error:9");
    assert_eq!(bench.ask("$J=G91 X1 F100\n").last().unwrap(), "error:9");
    assert_eq!(bench.ask("$X\n").last().unwrap(), "ok");
    assert_eq!(bench.ask("$J=G91 X1 F100\n"), ["ok"]);
}

#[test]
fn jogs_queue_up_and_are_cancelled_together() {
    let mut bench = Bench::new();
    let jogs = "$J=G91 X1 F60\n".repeat(20);
    let lines = bench.ask(jogs);
    assert_eq!(lines.len(), 15, "the others wait for room");
    bench.pass(0.01);
    assert!(bench.ask("?")[0].contains("|Bf:0,"));
    bench.send([0x85]);
    bench.pass(0.2);
    assert_eq!(bench.lines().iter().filter(|line| *line == "ok").count(), 5);
    bench.send([0x85]);
    bench.pass(0.1);
    assert_eq!(bench.state(), "Idle");
    assert!(!verbs(&bench).contains(&Verb::Stop), "a cancelled jog stops no job");
}

#[test]
fn check_mode_answers_and_moves_nothing() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask("$C\n"), ["[MSG:Enabled]", "ok"]);
    assert_eq!(bench.state(), "Check");
    let lines = bench.ask("M4 S100 F600\nG1 X10\nG1 X900\nM2\n");
    assert_eq!(lines.iter().filter(|line| *line == "ok").count(), 3);
    assert!(lines.contains(&"error:15".to_owned()));
    bench.pass(1.0);
    assert_eq!(bench.ask("$C\n")[..2], ["[MSG:Disabled]", "ok"]);
    assert_eq!((bench.machine.programs().len(), bench.state().as_str()), (0, "Idle"));
}

#[test]
fn sleep_unpowers_and_only_a_reset_wakes() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask("$SLP\n"), ["ok"]);
    assert_eq!(
        (bench.state().as_str(), bench.machine.status.state.as_str()),
        ("Sleep", "disabled")
    );
    assert_eq!(bench.ask("G0 X1\n").last().unwrap(), "error:9");
    bench.send("\x18");
    bench.pass(0.02);
    assert_eq!(bench.state(), "Idle");
    assert_eq!(bench.ask("$J=G91 X1 F600\n"), ["ok"]);
    bench.pass(0.5);
    assert_eq!(verbs(&bench).last(), Some(&Verb::Enable), "a jog powers the motors");
    assert!(bench.ask("?")[0].contains("MPos:101.000"));
}
