//! How much shared memory a pipeline and its parts need, in bytes.
//!
//! It follows from the channels: how many samples each publisher must have room for, and what
//! iceoryx2 0.10 lays out for them. A test opens every port that there can be and compares.

use std::mem::{align_of, size_of};

use iceoryx2::service::header::publish_subscribe::Header;
use messages::{
    Command, ControllerReport, DrivesReport, Feedback, JobOffer, PlannerReport, Progress,
    SentSetpoint, Setpoint, SimulatedInputs, SlowInputs,
};

use super::page;
use crate::channel::{BORROWED, Channel, Qos, Serial, history};

/// What a segment has beside its samples and queues: counters, pointers, alignment.
const OVERHEAD: usize = 512;

/// An entry of a queue between two ports: the place of a sample.
const ENTRY: usize = 8;

/// An entry of the list of free places in a data segment.
const FREE_ENTRY: usize = 4;

/// Services of a domain beside its channels: two wake events and the operators' requests.
const OTHER_SERVICES: u64 = 3;

/// Nodes that a pipeline has: holder, five services, the threads for operators at both ends, and
/// one who looks.
const NODES: u64 = 9;

/// Small files with content that iceoryx2 keeps of a node.
const NODE_FILES: u64 = 2;

/// Largest of the pages that Linux has on the computers that Graver runs on.
const LARGEST_PAGE: u64 = 64 * 1024;

/// Below this a node may fail to come into being.
pub(crate) const NODE: u64 = NODE_FILES * LARGEST_PAGE;

/// What a whole pipeline needs.
pub(crate) fn pipeline() -> u64 {
    let channels = whole::<Feedback>()
        + whole::<Command>()
        + whole::<Setpoint>()
        + whole::<SentSetpoint>()
        + whole::<Progress>()
        + whole::<ControllerReport>()
        + whole::<DrivesReport>()
        + whole::<PlannerReport>()
        + whole::<JobOffer>()
        + whole::<SimulatedInputs>()
        + whole::<SlowInputs>();
    let wakes = 2 * wake();
    channels + wakes + 2 * operator() + holder() + NODES * node()
}

/// What the holder creates: for each service a description and the list of its ports, and the
/// segment that counts nodes.
pub(crate) fn holder() -> u64 {
    const CHANNELS: u64 = 11;
    (2 * (CHANNELS + OTHER_SERVICES) + 1) * page()
}

/// What a node needs.
pub(crate) fn node() -> u64 {
    NODE_FILES * page()
}

/// What a listener of a wake event needs.
pub(crate) fn wake() -> u64 {
    page()
}

/// What one end of the operators' requests needs: a few small samples, and its connections.
pub(crate) fn operator() -> u64 {
    4 * page()
}

/// What a publisher needs, connections to all readers that there can be included.
pub(crate) fn publisher<T: Channel>() -> u64 {
    whole::<T>()
}

/// What a reader with room for `buffer` samples needs.
pub(crate) fn subscriber<T: Channel>(buffer: usize) -> u64 {
    let queues = ENTRY * (buffer + 1) + ENTRY * (buffer + BORROWED + 2);
    in_pages(queues + samples::<T>() + OVERHEAD)
}

/// How many samples a publisher must have room for, so that it never lacks one: what all readers
/// can have waiting and borrowed, what late joiners get, and the one being written.
pub(crate) fn samples<T: Channel>() -> usize {
    let (deep, shallow) = (T::DEEP_READERS, T::READERS - T::DEEP_READERS);
    deep * (depth::<T>() + BORROWED) + shallow * (1 + BORROWED) + history::<T>() + 1
}

fn whole<T: Channel>() -> u64 {
    let alignment = align_of::<Header>().max(align_of::<T>());
    let chunk = (size_of::<Header>() + size_of::<Serial>()).next_multiple_of(align_of::<T>())
        + size_of::<T>();
    let chunk = chunk.next_multiple_of(alignment);
    let data = in_pages(samples::<T>() * (chunk + FREE_ENTRY) + OVERHEAD);
    let (deep, shallow) = (T::DEEP_READERS as u64, (T::READERS - T::DEEP_READERS) as u64);
    data + deep * subscriber::<T>(depth::<T>()) + shallow * subscriber::<T>(1)
}

fn depth<T: Channel>() -> usize {
    match T::QOS {
        Qos::KeepLast { depth } | Qos::Reliable { depth } => depth,
    }
}

fn in_pages(bytes: usize) -> u64 {
    (bytes as u64).next_multiple_of(page())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::domain::Entry;
    use crate::operator::{OperatorLink, OperatorQueue};
    use crate::wake::Wake;
    use crate::{Domain, Instance, Samples};

    /// A publisher and all its readers.
    fn open<T: Channel>(domain: &Domain, ports: &mut Vec<Box<dyn std::any::Any>>) {
        ports.push(Box::new(domain.publisher::<T>().unwrap()));
        for reader in 0..T::READERS {
            let deep = reader < T::DEEP_READERS;
            let reading = if deep { Samples::All } else { Samples::Latest };
            ports.push(Box::new(domain.subscriber::<T>(reading).unwrap()));
        }
    }

    #[test]
    fn the_need_is_what_all_ports_take() {
        let name = format!("need-{}", std::process::id());
        let domain = Domain::create(&Instance::new(&name).unwrap()).unwrap();
        let mut ports: Vec<Box<dyn std::any::Any>> = Vec::new();
        open::<Feedback>(&domain, &mut ports);
        open::<Command>(&domain, &mut ports);
        open::<Setpoint>(&domain, &mut ports);
        open::<SentSetpoint>(&domain, &mut ports);
        open::<Progress>(&domain, &mut ports);
        open::<ControllerReport>(&domain, &mut ports);
        open::<DrivesReport>(&domain, &mut ports);
        open::<PlannerReport>(&domain, &mut ports);
        open::<JobOffer>(&domain, &mut ports);
        open::<SimulatedInputs>(&domain, &mut ports);
        open::<SlowInputs>(&domain, &mut ports);
        for wake in [Wake::Feedback, Wake::Command] {
            ports.push(Box::new(domain.listener(wake).unwrap()));
            ports.push(Box::new(domain.notifier(wake).unwrap()));
        }
        ports.push(Box::new(OperatorQueue::start(&domain).unwrap()));
        ports.push(Box::new(OperatorLink::start(&domain).unwrap()));
        let entries: Vec<Domain> = (0..6).map(|_| Entry::enter(&domain.entry()).unwrap()).collect();

        let (used, need) = (domain.room().used().unwrap(), pipeline());
        assert!(used <= need, "{used} of {need} bytes");
        assert!(need < used + used / 20, "{used} of {need} bytes");
        drop(entries);
    }
}
