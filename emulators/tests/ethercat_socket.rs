//! The EtherCAT port and the emulated line at real sockets on this computer: from nothing to drives that follow, and
//! closed again. It takes as long as it takes: only a hang lasts for [`PATIENCE`].

mod line;

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use drives::ethercat::EthercatPort;
use drives::{Actuation, Freshness, Measurement, PlantOptions, Port as _, Power};
use emulators::ethercat::bus::Bus;
use emulators::ethercat::faults::Rates;
use emulators::ethercat::service::serve;
use emulators::ethercat::slave::state::State;
use emulators::ethercat::{Layout, Link, Segment};
use machine::Machine;
use messages::CommandMode;

const PATIENCE: Duration = Duration::from_secs(120);

/// What holds the motors where they stand.
fn standing(machine: &Machine) -> Actuation {
    let (freshness, mode) = (Freshness::Fresh, CommandMode::Driven);
    let mut actuation = Actuation { freshness, mode, ..Actuation::DISABLED };
    for (actuator, position) in machine.actuators.iter().zip(&mut actuation.position) {
        *position = machine.home_joints[actuator.axis] / actuator.ratio;
    }
    actuation
}

/// Cycles, about a period apart, until the drives follow: where this computer was too slow for them, they are
/// disabled and led up again.
fn enable(port: &mut EthercatPort, machine: &Machine, start: Instant) {
    let mut measurement = Measurement::default();
    let mut resting = 0;
    while measurement.power == Power::Off {
        assert!(start.elapsed() < PATIENCE, "{:?}: {:?}", port.link(), measurement.fault);
        resting = if measurement.fault.is_some() { 200 } else { resting - 1 };
        let actuation = if resting > 0 { Actuation::DISABLED } else { standing(machine) };
        port.exchange(&actuation, &mut measurement);
        std::thread::sleep(Duration::from_micros(500));
    }
}

#[test]
fn it_comes_to_follow_and_is_closed_by_udp() {
    let mut bus = Bus::udp("127.0.0.1:0".parse().expect("an address")).expect("a socket");
    let address = bus.to_string().split_once(' ').map(|(_, address)| address.to_owned());
    let text = line::shipped("servo_gantry");
    let text = text.replace("127.0.0.1:34980", &address.expect("an address"));
    let machine = Machine::parse("servo_gantry.toml", &text, &[]).expect("the machine");
    let layout = Layout { seed: 0, ..Layout::default() };
    let segment = Segment::new(&machine, &layout, PlantOptions::default()).expect("a line");
    let mut link = Link::new(segment, Rates::default(), 1);
    let done = Arc::new(AtomicBool::new(false));
    let told = Arc::clone(&done);
    let server = std::thread::spawn(move || {
        serve(&mut link, &mut bus, || told.load(Ordering::Relaxed)).expect("a line that serves");
        link
    });
    let start = Instant::now();
    let mut port = EthercatPort::of(&machine).expect("a port");
    while let Err(error) = port.open() {
        assert!(start.elapsed() < PATIENCE, "{error}");
    }
    enable(&mut port, &machine, start);
    port.close().expect("closed");
    done.store(true, Ordering::Relaxed);
    let link = server.join().expect("the line");
    let states: Vec<State> = link.segment.slaves().iter().map(|slave| slave.state()).collect();
    assert!(states.iter().all(|state| *state == State::Init), "{states:?}");
}
