//! The cable between port and board in virtual time, whose two ends have one clock.

#![allow(dead_code, reason = "each test binary uses its own part")]

pub(crate) mod job;

use std::sync::{Arc, Mutex, PoisonError};

use drives::link::Link;
use emulators::hostmot2::record::Record;
use emulators::hostmot2::rig::Rig;
use emulators::hostmot2::spaces::Identity;
use emulators::hostmot2::wiring::Wiring;
use emulators::hostmot2::{Board, Emulator, Faults};
use machine::Machine;
use messages::Nanoseconds;

/// How long a frame takes each way.
pub(crate) const FLIGHT: Nanoseconds = Nanoseconds(30_000);

pub(crate) struct World {
    pub(crate) emulator: Emulator,
    pub(crate) now: Nanoseconds,
}

/// The cable between port and board, whose time is that of the test.
#[derive(Clone)]
pub(crate) struct Cable(Arc<Mutex<World>>);

impl Cable {
    /// To the board of `machine`, with these faults on the way.
    pub(crate) fn new(machine: &Machine, faults: &Faults) -> Self {
        let wiring = Wiring::of(machine);
        let rig = Rig::new(machine, &wiring).expect("a rig");
        let board = Board::new(Identity::default()).with_machine(rig, &wiring, Record::with_way());
        let emulator = Emulator::new(board, faults, FLIGHT);
        Self(Arc::new(Mutex::new(World { emulator, now: Nanoseconds(0) })))
    }

    pub(crate) fn with<T>(&self, look: impl FnOnce(&mut World) -> T) -> T {
        look(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    pub(crate) fn now(&self) -> Nanoseconds {
        self.with(|world| world.now)
    }

    pub(crate) fn until(&self, at: Nanoseconds) {
        self.with(|world| {
            world.now = world.now.max(at);
            world.emulator.advance(world.now);
        });
    }

    pub(crate) fn lit(&self) -> Vec<[i64; 2]> {
        self.with(|world| {
            let record = world.emulator.board().record();
            record.lit(world.now).into_iter().map(|span| span.map(|at| at.0)).collect()
        })
    }

    pub(crate) fn delivered(&self) -> f64 {
        self.with(|world| world.emulator.board().modules().stepgens.delivered(0))
    }

    /// Steps per second of the first step generator.
    pub(crate) fn speed(&self) -> f64 {
        self.with(|world| world.emulator.board().modules().stepgens.speed(0))
    }

    pub(crate) fn bites(&self) -> Vec<Nanoseconds> {
        self.with(|world| world.emulator.board().record().bites.clone())
    }
}

impl Link for Cable {
    fn send(&mut self, datagram: &[u8]) {
        self.with(|world| world.emulator.send(world.now, datagram));
    }

    fn receive(&mut self, buffer: &mut [u8], until: Nanoseconds) -> Option<usize> {
        self.with(|world| {
            loop {
                if let Some(frame) = world.emulator.receive(world.now) {
                    let length = frame.len().min(buffer.len());
                    buffer[..length].copy_from_slice(&frame[..length]);
                    return Some(length);
                }
                let next = world.emulator.next().filter(|next| *next <= until);
                world.now = world.now.max(next.unwrap_or(until));
                next?;
            }
        })
    }

    fn now(&self) -> Nanoseconds {
        Cable::now(self)
    }
}
