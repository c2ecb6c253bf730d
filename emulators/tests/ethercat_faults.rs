//! What goes wrong on the bus in the middle of a job, in virtual time: the light goes out, the axes stop, and the
//! run ends with words that say why.

mod job;
mod line;

use emulators::ethercat::Link;
use emulators::ethercat::faults::Rates;
use machine::Machine;
use machine::drives::fault_text;
use messages::{Fault, LinkCounters, Nanoseconds};

/// How long after the first deadline it goes wrong: in the middle of the letters [ns].
const WHEN: i64 = 1_400_000_000;

/// How long the axes may take to rest [ns].
const STOPPING: i64 = 300_000_000;

/// How long a frame is on its way along the slaves at most [ns].
const FLIGHT: i64 = 10_000;

/// The first and the third drive, the gate, and the power.
const SLAVES: [usize; 4] = [0, 2, 4, 5];

/// What is counted of a kind of fault.
type Count = fn(&LinkCounters) -> u64;

/// What became of the job.
struct Ended {
    completed: bool,
    words: String,
    link: LinkCounters,
    /// How long after the event there was light for the last time [ns].
    lit_for: i64,
    /// Light that no command had asked for [ns].
    wrong: Vec<[i64; 2]>,
}

/// Marks the letters on `machine`, with `event` in the midst of them. The axes rest at the end.
fn disturbed(
    machine: &Machine,
    event: impl FnOnce(&mut Link, Nanoseconds) + Send + 'static,
) -> Ended {
    let bench = line::open(machine.clone(), Rates::default(), 0);
    let at = bench.deadline.0 + WHEN;
    let played = job::play(bench, &job::letters(machine), Some((WHEN, Box::new(event))));
    let cable = &played.cable;
    let asked = job::asked(&played.records, machine, machine.drives.gate_latency.0);
    let most = played.resolution / 2 + FLIGHT;
    let is_asked = |span: &[i64; 2]| {
        asked.iter().any(|asked| span[0] + most >= asked[0] && span[1] <= asked[1] + most)
    };
    let wrong = cable.lit().into_iter().filter(|span| !is_asked(span)).collect();
    assert!(cable.lit().iter().any(|span| span[0] < at), "it is in the midst of the job");
    let now = drives::link::Link::now(cable);
    let places = || cable.with(|link, _| link.segment.plant().positions().to_vec());
    cable.go_to(now + Nanoseconds(STOPPING));
    let rest = places();
    cable.go_to(now + Nanoseconds(2 * STOPPING));
    assert_eq!(places(), rest, "the axes do not rest");
    Ended {
        completed: played.report.completed == 1,
        words: words(&played.report.fault, machine),
        link: played.drives.link,
        lit_for: cable.lit().last().map_or(0, |span| span[1]) - at,
        wrong,
    }
}

/// What a fault of the drives means, and whose it is.
fn words(fault: &Fault, machine: &Machine) -> String {
    let text = fault_text(&machine.drives.kind, fault.value as u32).unwrap_or_default();
    let actuator = usize::from(fault.actuator).checked_sub(1);
    let name = actuator.and_then(|index| machine.actuators.get(index)).map(|it| it.name.as_str());
    format!("{:?} {}: {text}", fault.code(), name.unwrap_or_default())
}

/// Asserts that the job was broken off in the dark with `words`.
fn assert_stopped(ended: &Ended, machine: &Machine, words: &str) {
    assert!(!ended.completed);
    assert!(ended.words.contains(words), "{}", ended.words);
    assert_eq!(ended.wrong, [[0; 2]; 0], "light that was not asked for");
    let machine::DrivesKind::Ethercat(bus) = &machine.drives.kind else { panic!("no bus") };
    assert!(ended.lit_for <= bus.watchdog.0, "lit for {} ns", ended.lit_for);
}

#[test]
fn a_cable_that_is_cut_before_the_first_slave() {
    let machine = line::gantry("position");
    let ended = disturbed(&machine, |link, now| link.segment.cut(0, now));
    assert_stopped(&ended, &machine, "the bus does not answer");
    assert!(ended.link.lost >= 20 && ended.link.bridged >= 20, "{:?}", ended.link);
}

#[test]
fn a_cable_that_is_cut_between_two_drives() {
    let machine = line::gantry("position");
    let ended = disturbed(&machine, |link, now| link.segment.cut(2, now));
    assert_stopped(&ended, &machine, "some slaves do not take part");
    assert!(ended.link.corrupted >= 20, "{:?}", ended.link);
}

#[test]
fn a_slave_that_loses_its_power_for_a_moment() {
    let machine = line::gantry("position");
    for slave in SLAVES {
        let ended = disturbed(&machine, move |link, now| link.segment.power_cycle(slave, now));
        assert_stopped(&ended, &machine, "some slaves do not take part");
    }
}

#[test]
fn a_slave_that_leaves_its_operational_state() {
    let machine = line::gantry("position");
    for slave in SLAVES {
        let ended = disturbed(&machine, move |link, now| link.segment.leave(slave, now));
        assert_stopped(&ended, &machine, "has left the operational state");
        if let Some(actuator) = machine.actuators.get(slave) {
            assert!(ended.words.contains(&actuator.name), "{}", ended.words);
        }
    }
}

#[test]
fn one_in_a_hundred_frames_lost_late_doubled_or_damaged_costs_no_job() {
    let machine = line::gantry("position");
    let (part, delay) = (0.01, Nanoseconds(3_000_000));
    // Most of the damaged are refused by a slave, or come back as the answer to no question of this cycle.
    let kinds: [(&str, Rates, Count); 4] = [
        ("lost", Rates { lost: part, ..Rates::default() }, |link| link.lost),
        ("late", Rates { late: part, delay, ..Rates::default() }, |link| link.late),
        ("doubled", Rates { duplicated: part, ..Rates::default() }, |link| link.duplicated),
        ("damaged", Rates { corrupted: part, ..Rates::default() }, |link| {
            link.corrupted + link.lost
        }),
    ];
    for (kind, rates, count) in kinds {
        let ended = disturbed(&machine, move |link, _| link.set_rates(rates));
        assert!(ended.completed, "{kind}: {}", ended.words);
        assert_eq!(ended.wrong, [[0; 2]; 0], "{kind}: light that was not asked for");
        assert!(count(&ended.link) > 10, "{kind}: {:?}", ended.link);
        let LinkCounters { lost, corrupted, bridged, .. } = ended.link;
        assert_eq!(bridged, lost + corrupted, "{kind}");
    }
}
