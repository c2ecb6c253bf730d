//! What is told against the origin, and where two samples differ.
#![allow(clippy::unwrap_used)]

use super::difference::difference;
use super::*;
use messages::{Command, Cycle};

const ORIGIN: Origin = Origin { epoch: 5_000_000, cycle: 700, deadline: 1_000_000_000 };

fn command() -> Command {
    let stamps = [20_000, 50_000].map(|after| Nanoseconds(ORIGIN.deadline + after));
    let [received, published] = stamps;
    let mut command = Command {
        epoch: ORIGIN.epoch,
        cycle: Cycle(ORIGIN.cycle),
        received,
        published,
        rate: 1.0,
        ..Command::default()
    };
    command.laser.gate = 3;
    command
}

#[test]
fn times_of_the_cycle_are_small_and_its_number_takes_no_room() {
    let mut bytes = Vec::new();
    command().put(&ORIGIN, &mut bytes);
    // received 1 + 3, published 1 + 3, setpoint_published (0) 1 + 5, rate 1 + 8, laser 2 + 1 + 2.
    assert_eq!(bytes.len(), 4 + 4 + 6 + 9 + 5);
    assert_eq!(Command::read(&bytes, &ORIGIN).unwrap(), command());
    // A field of a later version is passed over.
    wire::put_bytes(99, b"new", &mut bytes);
    assert_eq!(Command::read(&bytes, &ORIGIN).unwrap(), command());
    wire::put_bytes(13, b"no double", &mut bytes);
    assert_eq!(Command::read(&bytes, &ORIGIN), Err(Malformed));
}

#[test]
fn a_difference_of_one_bit_is_told_with_its_field() {
    let recorded = command();
    assert_eq!(difference(&recorded, &recorded, &ORIGIN), None);
    let mut found = recorded;
    found.voltage[1] = -0.0;
    let told = difference(&recorded, &found, &ORIGIN).unwrap().to_string();
    assert_eq!(told, "voltage is [0.0, -0.0], recorded was 0");
    found.rate = 1.0_f64.next_up();
    let told = difference(&recorded, &found, &ORIGIN).unwrap().to_string();
    assert_eq!(told, "rate is 1.0000000000000002, recorded was 1.0");
}
