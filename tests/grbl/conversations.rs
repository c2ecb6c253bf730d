//! What each program says first, and what it wants to hear: from what they send on a wire.

use machine::operating::{Homing, HomingMethod, Side};

use crate::bench::{Bench, machine};

/// The settings in `$$`.
fn settings(lines: &[String]) -> Vec<(u16, f64)> {
    let settings = lines.iter().filter_map(|line| line.strip_prefix('$')?.split_once('='));
    settings.map(|(number, value)| (number.parse().unwrap(), value.parse().unwrap())).collect()
}

#[test]
fn all_settings_are_told_in_order_and_say_what_the_machine_is() {
    let mut bench = Bench::new();
    let lines = bench.ask("$$\n");
    assert_eq!(lines.last().unwrap(), "ok");
    let settings = settings(&lines);
    let numbers: Vec<u16> = settings.iter().map(|(number, _)| *number).collect();
    let all = [0..=6, 10..=13, 20..=27, 30..=32, 100..=102, 110..=112, 120..=122, 130..=132];
    assert_eq!(numbers, all.into_iter().flatten().collect::<Vec<u16>>());
    let value = |number| settings.iter().find(|(it, _)| *it == number).unwrap().1;
    assert_eq!((value(30), value(32), value(130), value(131)), (1000.0, 1.0, 200.0, 200.0));
    assert!(value(110) > 0.0 && value(120) > 0.0 && value(100) > 0.0);
}

#[test]
fn every_question_has_its_answer() {
    let mut bench = Bench::new();
    let build = bench.ask("$I\n");
    assert!(build[0].starts_with("[VER:1.1h.20190825:"), "{build:?}");
    assert_eq!(build[1..], ["[OPT:VL,15,128]", "ok"]);
    assert_eq!(bench.ask("$G\n"), ["[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]", "ok"]);
    assert_eq!(bench.ask("$N\r\n"), ["$N0=", "$N1=", "ok"]);
    assert!(bench.ask("$\r")[0].starts_with("[HLP:"));
    let places = bench.ask("$#\n");
    let names: Vec<&str> =
        places.iter().map(|line| line.split([':', ']']).next().unwrap()).collect();
    assert_eq!(
        names,
        [
            "[G54", "[G55", "[G56", "[G57", "[G58", "[G59", "[G28", "[G30", "[G92", "[TLO", "[PRB",
            "ok"
        ]
    );
    assert_eq!(places[10], "[PRB:0.000,0.000,0.000:0]");
    assert_eq!(bench.ask("\n"), ["ok"], "an empty line is a line");
    assert_eq!(bench.ask("$Q\n").last().unwrap(), "error:3");
}

#[test]
fn places_are_kept_and_told_and_gone_to() {
    let mut bench = Bench::new();
    let kept = |bench: &mut Bench| -> Vec<String> {
        let places = bench.ask("$#\n");
        places.into_iter().filter(|it| it.starts_with("[G28") || it.starts_with("[G30")).collect()
    };
    assert_eq!(kept(&mut bench), ["[G28:100.000,100.000,0.000]", "[G30:100.000,100.000,0.000]"]);
    for line in ["G21 G90\n", "G53 G0 X10 Y20\n", "G28.1\n", "G53 G0 X30 Y40\n", "G30.1\n"] {
        assert_eq!(bench.ask(line), ["ok"], "{line}");
    }
    let expect = ["[G28:10.000,20.000,0.000]", "[G30:30.000,40.000,0.000]"];
    assert_eq!(kept(&mut bench), expect);
    for line in ["G28\n", "G91 G30 X0\n"] {
        assert_eq!(bench.ask(line), ["ok"], "{line}");
    }
    // A reset of the controller does not lose them, a reset of the parameters does.
    bench.pass(5.0);
    bench.send("\x18");
    bench.pass(1.0);
    assert_eq!(kept(&mut bench), expect);
    bench.ask("$RST=#\n");
    assert_eq!(kept(&mut bench), ["[G28:100.000,100.000,0.000]", "[G30:100.000,100.000,0.000]"]);
}

#[test]
fn a_report_tells_the_offset_first_and_then_the_overrides() {
    let mut bench = Bench::new();
    let first = bench.ask("?");
    assert_eq!(first, ["<Idle|MPos:100.000,100.000,0.000|Bf:15,128|FS:0,0|WCO:0.000,0.000,0.000>"]);
    let second = bench.ask("?");
    assert_eq!(second, ["<Idle|MPos:100.000,100.000,0.000|Bf:15,128|FS:0,0|Ov:100,100,100>"]);
    for _ in 0..8 {
        assert_eq!(bench.ask("?"), ["<Idle|MPos:100.000,100.000,0.000|Bf:15,128|FS:0,0>"]);
    }
    assert!(bench.ask("?")[0].contains("|WCO:"));
    bench.ask("G92 X0 Y0\n");
    assert!(bench.ask("?")[0].ends_with("|WCO:100.000,100.000,0.000>"), "a change is told at once");
    bench.ask("$10=0\n");
    let report = bench.ask("?");
    assert!(report[0].starts_with("<Idle|WPos:0.000,0.000,0.000|FS:0,0"), "{report:?}");
    bench.ask("$10=3\n$13=1\n");
    assert!(bench.ask("?")[0].contains("MPos:3.9370,3.9370,0.0000"));
}

#[test]
fn meerk40t_resets_asks_and_marks() {
    let mut bench = Bench::new();
    assert_eq!(bench.ask(b"\x18"), ["", "Grbl 1.1h ['$' for help]"]);
    for line in ["$\n", "$$\n", "$G\n"] {
        assert_eq!(bench.ask(line).last().unwrap(), "ok");
    }
    assert_eq!(bench.ask("?").len(), 1);
    let job = "G90\nG94\nG21\nM4\nG0X10Y10S0F600\nG1X20S1000F60\nG1Y20\nM5\n";
    assert_eq!(bench.ask(job), ["ok"; 8]);
    assert_eq!(bench.state(), "Run", "what waits to begin is no idle machine");
    bench.pass(0.6);
    let programs = bench.machine.programs();
    assert_eq!(programs.len(), 1);
    assert!(programs[0].ends_with(job), "{}", programs[0]);
    bench.pass(5.0);
    assert_eq!(bench.state(), "Idle");
}

#[test]
fn cncjs_counts_characters_and_learns_the_end_by_a_dwell() {
    let mut bench = Bench::new();
    bench.send("?$$\n$G\n");
    bench.lines();
    let lines: Vec<String> =
        (0..40).map(|line| format!("G1 X{} Y10 F3000 S500\n", 10 + line)).collect();
    let mut under_way = std::collections::VecDeque::new();
    let mut sent = 0;
    let all: Vec<&str> = ["G21 G90 M4\n"]
        .into_iter()
        .chain(lines.iter().map(String::as_str))
        .chain(["G4 P0.5\n"])
        .collect();
    let mut answered = 0;
    while answered < all.len() - 1 {
        while sent < all.len() && under_way.iter().sum::<usize>() + all[sent].len() <= 120 {
            bench.send(all[sent]);
            under_way.push_back(all[sent].len());
            sent += 1;
        }
        for line in bench.lines() {
            assert_eq!(line, "ok");
            under_way.pop_front();
            answered += 1;
        }
        assert!(sent == all.len() || answered > 0);
    }
    assert_eq!(bench.lines(), [""; 0], "the dwell is answered when the job has ended");
    bench.pass(0.7);
    assert_eq!((bench.state().as_str(), bench.machine.programs().len()), ("Run", 1));
    bench.pass(3.0);
    assert!(bench.lines().contains(&"ok".to_owned()));
    assert_eq!((bench.state().as_str(), bench.machine.programs().len()), ("Idle", 1));
}

#[test]
fn rayforge_homes_sets_origins_and_probes() {
    let mut bench = Bench::new();
    bench.send("?$I\n$$\n");
    bench.lines();
    bench.send("$H\n");
    assert_eq!(bench.lines()[0], "[MSG:the axes know their place: there is nothing to find]");
    assert_eq!(bench.ask("G4 P0.01\n"), [""; 0]);
    bench.pass(0.1);
    assert_eq!(bench.lines(), ["ok"]);
    assert_eq!(bench.ask("G55\nG54\nG10 L2 P1 X5 Y6\n"), ["ok"; 3]);
    assert_eq!(bench.ask("$#\n")[0], "[G54:5.000,6.000,0.000]");
    assert_eq!(bench.ask("G10 L20 P2 X0 Y0\n"), ["ok"]);
    assert_eq!(bench.ask("$#\n")[1], "[G55:100.000,100.000,0.000]");
    bench.pass(1.0);
    bench.lines();
    assert_eq!(bench.machine.programs(), [""; 0], "nothing of that is a job");
    bench.machine.touches_at = Some(0.11);
    assert_eq!(bench.ask("G38.2 X110 F600\n"), [""; 0]);
    bench.pass(6.0);
    assert_eq!(bench.lines(), ["[PRB:110.000,100.000,0.000:1]", "ok"]);
    bench.machine.touches_at = None;
    bench.send("G91\nG38.2 X10 F600\n");
    bench.pass(6.0);
    let lines = bench.lines();
    assert_eq!(lines[2], "[PRB:120.000,100.000,0.000:0]", "{lines:?}");
    assert!(lines.contains(&"ALARM:5".to_owned()) && lines.last().unwrap().starts_with("error:"));
    assert_eq!(bench.state(), "Alarm");
    assert_eq!(bench.ask("$X\n"), ["[MSG:Caution: Unlocked]", "ok"]);
}

#[test]
fn lightburn_asks_jogs_frames_and_sends_clusters_with_air() {
    let mut bench = Bench::new();
    for question in ["$I\n", "$$\n"] {
        assert_eq!(bench.ask(question).last().unwrap(), "ok");
    }
    assert_eq!(bench.ask("$J=G91 G21 X5 F3000\n"), ["ok"]);
    assert_eq!(bench.state(), "Jog");
    bench.pass(0.5);
    assert!(bench.ask("?")[0].starts_with("<Idle|MPos:105.000,100.000"));
    let job =
        "G00 G17 G40 G21 G54\nG90\nM8\nG0X10Y10\nM4\nG1X20S100:200:0:300F6000\nM9\nG1S0\nM5\nM2\n";
    let lines = bench.ask(job);
    assert_eq!(lines, ["ok"; 9], "M2 is answered when the job has ended");
    bench.pass(2.0);
    assert_eq!(bench.lines(), ["ok"]);
    let programs = bench.machine.programs();
    assert!(programs[0].contains("G53 G0 X105.000000 Y100.000000\n"), "{}", programs[0]);
    assert!(programs[0].contains("G1X20S100:200:0:300F6000\n"));
}

#[test]
fn air_is_switched_without_a_job() {
    let mut bench = Bench::new();
    bench.send("M8\n");
    bench.pass(0.7);
    assert!(bench.machine.status.outputs["air"]);
    bench.lines();
    assert!(bench.ask("$G\n")[0].contains(" M8 "));
    bench.send("M9\n");
    bench.pass(0.7);
    assert!(!bench.machine.status.outputs["air"]);
    bench.send([0xA0]);
    assert!(bench.machine.status.outputs["air"]);
    assert_eq!(bench.machine.programs(), [""; 0]);
}

#[test]
fn a_machine_that_has_to_find_its_place_is_homed_and_unlocked_by_that() {
    let mut with_switch = machine();
    with_switch.operating.homing[0] = Some(Homing {
        method: HomingMethod::Switch,
        drive: machine::operating::DriveHoming::default(),
        side: Side::Lower,
        speed: 0.05,
        latch_speed: 0.01,
        position: 0.0,
        order: 0,
        current: 0.0,
    });
    let name = with_switch.axes[0].name.clone();
    let mut bench = Bench::of(with_switch);
    bench.machine.status.unhomed = vec![name.clone()];
    bench.machine.status.state = "disabled".into();
    bench.pass(0.1);
    assert_eq!(bench.state(), "Alarm");
    let lines = bench.ask("$$\n");
    assert!(
        lines.contains(&"$24=600.000".to_owned()) && lines.contains(&"$25=3000.000".to_owned())
    );
    assert_eq!(bench.ask("$H\n"), [""; 0], "it powers the motors, homes, and answers then");
    bench.pass(0.15);
    assert_eq!(bench.state(), "Home");
    bench.pass(0.5);
    assert_eq!(bench.lines(), ["ok"]);
    assert_eq!(bench.state(), "Idle");
    bench.send(format!("$H{name}\n"));
    bench.pass(0.1);
    bench.send("\x18");
    bench.pass(0.5);
    assert!(!bench.lines().contains(&"ok".to_owned()), "a reset forgets the line");
    assert_eq!(bench.ask("$HQ\n").last().unwrap(), "error:3");
}
