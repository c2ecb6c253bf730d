//! The letters on the emulated bus, whole and in virtual time: where the true tool was under the light, and when the
//! true light was on.

mod job;
mod line;

use emulators::ethercat::faults::Rates;

/// How far a mark may lie from its line, and its end from that of the stroke, by drives that follow positions,
/// velocities and torques [m]: 7.4, 12.2 and 19.0 µm were seen, the first and the last with clocks that drift.
const ERRORS: [(&str, f64); 3] = [("position", 10e-6), ("velocity", 15e-6), ("torque", 20e-6)];

/// How long a frame is on its way along the slaves at most [ns].
const FLIGHT: i64 = 10_000;

/// Asserts that the gantry's letters, by drives that follow targets of `mode` and whose clocks are drawn by `seed`, are where they are drawn, and that the
/// light was on when it was asked for, to half a step of what the port declares.
fn check(mode: &str, seed: u64) {
    let machine = line::gantry(mode);
    assert_eq!(machine.actuators.len(), 4);
    let plan = job::letters(&machine);
    let played = job::play(line::open(machine.clone(), Rates::default(), seed), &plan, None);
    assert_eq!(played.report.completed, 1, "{:?}", played.report.fault);
    let simulated = job::simulate(&machine, &plan);
    assert_eq!(simulated.report.completed, 1, "{:?}", simulated.report.fault);
    // Of drives that close all loops no command answers what was measured.
    for targets in [false, mode == "position"] {
        let [own, other] = [&played.records, &simulated.records];
        assert_eq!(job::digest(own, targets), job::digest(other, targets), "targets: {targets}");
    }

    let link = played.drives.link;
    assert_eq!((link.lost, link.late, link.corrupted, link.bridged), (0, 0, 0, 0), "{link:?}");

    // The last sample of a cycle is always dark.
    let mut lit: Vec<[i64; 2]> = Vec::new();
    for span in played.cable.lit() {
        match lit.last_mut() {
            Some(last) if span[0] - last[1] <= played.resolution + FLIGHT => last[1] = span[1],
            _ => lit.push(span),
        }
    }
    let asked = job::asked(&played.records, &machine, machine.drives.gate_latency.0);
    assert_eq!(lit.len(), asked.len());
    for (lit, asked) in lit.iter().flatten().zip(asked.iter().flatten()) {
        let most = played.resolution / 2 + FLIGHT;
        assert!((lit - asked).abs() <= most, "an edge at {lit} ns instead of {asked}");
    }
    let error = played.error(&lit, &plan.artwork);
    let own = ERRORS.iter().find(|(own, _)| *own == mode);
    assert!(own.is_some_and(|(_, most)| error <= *most), "{error} m");
}

#[test]
fn four_drives_that_follow_positions_mark_the_letters() {
    check("position", 0);
}

#[test]
fn clocks_that_drift_are_followed_to_the_end_of_the_job() {
    check("position", 1);
    check("torque", 1);
}

#[test]
fn drives_that_follow_velocities_mark_the_letters() {
    check("velocity", 0);
}

#[test]
fn drives_that_follow_torques_mark_the_letters() {
    check("torque", 0);
}
