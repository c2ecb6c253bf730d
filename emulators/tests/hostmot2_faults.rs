//! What goes wrong on the way to a board in the middle of a job, in virtual time: no light where none was asked for,
//! and the job is done, or the axes stop and the run ends with words that say why.

mod board;
mod job;

use board::{BoardCable, FLIGHT, shipped};
use emulators::hostmot2::rig::Rig;
use emulators::hostmot2::{Emulator, Faults};
use machine::Machine;
use machine::drives::fault_text;
use messages::{LinkCounters, Nanoseconds};

/// When a cable is cut, or a board falls silent: in the middle of the letters.
const WHEN: Nanoseconds = Nanoseconds(1_400_000_000);

/// How much later than asked an edge may be: half of the gate's resolution, and the jitter of a request.
const EDGE: i64 = 600;

/// What is counted of a kind of fault.
type Count = fn(&LinkCounters) -> u64;

fn play(machine: &Machine, faults: &Faults) -> job::Played<Emulator> {
    let bench = board::open(machine.clone(), faults).expect("an open port");
    job::play(bench, &job::letters(machine), None)
}

/// Asserts that the light was nowhere on where no command had asked for it.
fn assert_no_wrong_light(played: &job::Played<Emulator>, machine: &Machine, case: &str) {
    let later = FLIGHT.0 + machine.drives.gate_latency.0;
    let asked = job::asked(&played.records, machine, later);
    for [from, to] in played.cable.lit() {
        let is_inside = asked.iter().any(|asked| from + EDGE >= asked[0] && to <= asked[1] + EDGE);
        assert!(is_inside, "{case}: light from {from} to {to} ns was not asked for");
    }
}

#[test]
fn one_in_a_hundred_frames_lost_late_doubled_or_damaged_costs_no_job() {
    let part = 0.01;
    let kinds: [(&str, Faults, Count); 4] = [
        ("lost", Faults { loss: part, ..Faults::default() }, |link| link.lost),
        ("late", Faults { late: part, ..Faults::default() }, |link| link.late),
        ("doubled", Faults { duplicate: part, ..Faults::default() }, |link| link.duplicated),
        ("damaged", Faults { corrupt: part, ..Faults::default() }, |link| link.lost),
    ];
    for name in ["hostmot2_steppers", "hostmot2_galvo"] {
        let machine = shipped(name, &[]);
        for (kind, faults, count) in &kinds {
            let case = format!("{name}, {kind}");
            let played = play(&machine, faults);
            assert_eq!(played.report.completed, 1, "{case}: {:?}", played.report.fault);
            assert_no_wrong_light(&played, &machine, &case);
            let link = played.drives.link;
            assert!(count(&link) > 5, "{case}: {link:?}");
            // What has not come in time is bridged, and told.
            assert!(link.bridged >= link.lost, "{case}: {link:?}");
            assert!(played.cable.bites().is_empty(), "{case}");
        }
    }
}

#[test]
fn a_cut_cable_and_a_silent_board_end_a_job_in_the_dark_and_are_told() {
    let silent = Faults { silent_from: Some(WHEN), ..Faults::default() };
    let mute = Faults { mute_from: Some(WHEN), ..Faults::default() };
    let end = WHEN + Nanoseconds(10_000_000_000);
    let cut = Faults { cut: Some([WHEN, end]), ..Faults::default() };
    for name in ["hostmot2_steppers", "hostmot2_galvo"] {
        let machine = shipped(name, &[]);
        // A board that hears and does not answer is told to be dark and to stop.
        for (kind, faults, bites) in [("silent", &silent, 1), ("mute", &mute, 0), ("cut", &cut, 1)]
        {
            let case = format!("{name}, {kind}");
            let played = play(&machine, faults);
            let fault = played.report.fault;
            assert_eq!(played.report.completed, 0, "{case}");
            let words = fault_text(&machine.drives.kind, fault.value as u32).unwrap_or_default();
            assert!(words.contains("the card does not answer"), "{case}: {fault:?}: {words}");
            assert_no_wrong_light(&played, &machine, &case);
            let cable = &played.cable;
            let lit = cable.lit().last().map_or(0, |span| span[1]);
            let machine::DrivesKind::Hostmot2(card) = &machine.drives.kind else {
                panic!("no board")
            };
            assert!(lit <= (WHEN + card.watchdog).0, "{case}: lit until {lit} ns");
            assert!(cable.lit().iter().any(|span| span[0] < WHEN.0), "{case}: before the job");
            assert_eq!(cable.bites().len(), bites, "{case}");
            let link = played.drives.link;
            assert!(link.lost > 5 && link.bridged > 5, "{case}: {link:?}");
            let tool = || cable.with(|emulator, _| emulator.board().rig().and_then(Rig::tool));
            let now = drives::link::Link::now(cable);
            cable.go_to(now + Nanoseconds(500_000_000));
            let rest = tool().expect("a tool");
            cable.go_to(now + Nanoseconds(600_000_000));
            let moved = messages::artwork::distance(&rest, &tool().expect("a tool"));
            assert!(moved < 1e-6, "{case}: the axes do not rest: {moved} m");
        }
    }
}
