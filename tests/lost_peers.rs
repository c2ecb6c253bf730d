//! Planner or supervisor die while the machine moves, in virtual time: the gate is closed from that
//! deadline on, and the axes, motors or steppers, come to rest where the controller has them.

#![allow(clippy::unwrap_used)]

mod chain;

use std::path::Path;

use chain::{Chain, START};
use controller::{Peers, Presence};
use drives::GatePermission;
use machine::Machine;
use messages::{CommandMode, ControllerState, FaultCode};
use planner::job::Job;
use planner::{Plan, plan};

/// The largest distance of an axis from its reference while the loops or the pulses hold it [m or rad],
/// and the fastest that one moved in the cycle of the death [m/s or rad/s].
struct Rest {
    off: f64,
    speed: f64,
}

/// Plays the sample job until a peer dies in the cycle `death`, which the controller learns `late`
/// cycles later, and on until the machine has faulted.
fn play(machine: &Machine, plan: &Plan, death: u64, late: u64, lost: (Peers, FaultCode)) -> Rest {
    let case = format!("{}, {:?} at {death}, {late} late", machine.name, lost.1);
    let mut chain = Chain::new(machine, plan);
    let mut rest = Rest { off: 0.0, speed: 0.0 };
    for step in 1..death + 3000 {
        if step >= death {
            chain.bridge.permit(GatePermission::Inhibited);
            chain.is_fed = false;
        }
        let feedback = chain.begin();
        // The light of a cycle is measured at its end.
        assert!(step <= death || !feedback.laser.is_lit(), "{case}: lit in {step}");
        let peers = if step < death + late { Peers::default() } else { lost.0 };
        chain.finish(&feedback, None, peers);
        let outputs = &chain.outputs;
        let actuators = || machine.actuators.iter().enumerate();
        if step == death {
            let speeds = actuators().map(|(index, it)| (feedback.velocity[index] * it.ratio).abs());
            rest.speed = speeds.fold(0.0, f64::max);
        }
        let follows = outputs.command.mode() == CommandMode::Driven;
        if step > death && follows {
            let errors = &outputs.command.following_error;
            let off = actuators().map(|(index, it)| (errors[index] * it.ratio).abs());
            rest.off = off.fold(rest.off, f64::max);
        }
        if outputs.command.state() == ControllerState::Faulted {
            assert_eq!(outputs.command.fault.code(), lost.1, "{case}");
            assert!(step > death + 20, "{case}: faulted after {} cycles", step - death);
            return rest;
        }
    }
    panic!("{case}: {:?}", chain.outputs.command.state());
}

#[test]
fn the_axes_come_to_rest_where_the_controller_has_them() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("machines");
    let planner = Peers { planner: Presence::Lost, ..Peers::default() };
    let supervisor = Peers { supervisor: Presence::Lost, ..Peers::default() };
    for name in ["corexy", "cartesian_steppers", "twin_actuator", "tri_planar"] {
        let machine = Machine::load(&folder.join(name).with_extension("toml"), &[]).unwrap();
        let plan = plan(&machine, &Job::builtin(&[], &machine).unwrap()).unwrap();
        let mut fastest: f64 = 0.0;
        for moment in [37, 110, 250, 410, 633, 900] {
            for lost in [(planner, FaultCode::PlannerLost), (supervisor, FaultCode::SupervisorLost)]
            {
                // Drives counts a dead peer as one that closes the gate, which the controller hears of
                // in the same cycle, unless it has found out by itself.
                let rest = play(&machine, &plan, START + moment, 0, lost);
                fastest = fastest.max(rest.speed);
                let most = 0.1 * machine.axes[0].limits.following_error;
                assert!(rest.off < most, "{name} at {moment}: {} off", rest.off);
                let (peers, _) = lost;
                let rest = play(&machine, &plan, START + moment, 3, (peers, FaultCode::DriveFault));
                assert!(rest.off < most, "{name} at {moment}: {} off", rest.off);
            }
        }
        assert!(fastest > 0.02, "{name}: {fastest}");
    }
}
