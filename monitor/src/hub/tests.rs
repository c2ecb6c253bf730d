//! A hub in a domain of its own, with the test as everybody else.
#![allow(clippy::unwrap_used)]

use super::*;
use messages::Cycle;
use runtime::{Instance, Publisher, Role};
use std::sync::atomic::{AtomicU32, Ordering};

/// Writes down what it is told, in order.
#[derive(Default)]
struct Diary {
    told: Vec<String>,
}

impl Sink for Diary {
    fn offer(&mut self, offer: &JobOffer, batch: &Batch) -> Result<(), ServiceError> {
        let (stream, reports) = (offer.stream, batch.controller_reports.len());
        self.told.push(format!("offer {stream} knowing {reports} reports"));
        Ok(())
    }

    fn lose(&mut self, lost: Lost) {
        self.told.push(format!("lost {} and {}", lost.feedbacks, lost.commands));
    }

    fn take(&mut self, batch: &Batch) -> Result<(), ServiceError> {
        let cycles = batch.feedbacks.iter().map(|feedback| feedback.cycle.0.to_string());
        let cycles = cycles.collect::<Vec<_>>().join(" ");
        self.told.push(format!("cycles {cycles}, {} commands", batch.commands.len()));
        Ok(())
    }
}

struct Bench {
    feedbacks: Publisher<Feedback>,
    commands: Publisher<Command>,
    reports: Publisher<ControllerReport>,
    offers: Publisher<JobOffer>,
    hubs: Vec<Hub>,
    // Last, so that all else has let go of the domain.
    _domains: Vec<Domain>,
}

impl Bench {
    /// A domain with a hub for each of the roles.
    fn new(roles: &[Role]) -> Self {
        static NUMBER: AtomicU32 = AtomicU32::new(0);
        let number = NUMBER.fetch_add(1, Ordering::Relaxed);
        let name = format!("hub-test-{}-{number}", std::process::id());
        let instance = Instance::new(&name).unwrap();
        let holder = Domain::create(&instance).unwrap();
        let join = |role: &Role| Domain::join(&instance, *role).unwrap();
        let members: Vec<Domain> = roles.iter().map(join).collect();
        Self {
            feedbacks: holder.publisher().unwrap(),
            commands: holder.publisher().unwrap(),
            reports: holder.publisher().unwrap(),
            offers: holder.publisher().unwrap(),
            hubs: members.iter().map(|member| Hub::open(member).unwrap()).collect(),
            _domains: members.into_iter().chain([holder]).collect(),
        }
    }

    fn cycle(&mut self, cycle: u64) {
        let cycle = Cycle(cycle);
        self.feedbacks.publish(&Feedback { cycle, ..Feedback::default() }).unwrap();
        self.commands.publish(&Command { cycle, ..Command::default() }).unwrap();
    }
}

#[test]
fn every_sink_of_every_hub_is_told_everything_once() {
    let mut bench = Bench::new(&[Role::Monitor, Role::Observer]);
    (7..10).for_each(|cycle| bench.cycle(cycle));
    bench.reports.publish(&ControllerReport::default()).unwrap();
    bench.offers.publish(&JobOffer::new(3, "/run").unwrap()).unwrap();
    let expect = [
        "offer 3 knowing 1 reports",
        "cycles 7 8 9, 3 commands",
        "cycles 10, 1 commands",
        "cycles , 0 commands",
    ];
    let mut diaries = [Diary::default(), Diary::default(), Diary::default()];
    let [first, second, beside] = &mut diaries;
    bench.hubs[0].poll(&mut [first, second]).unwrap();
    bench.hubs[1].poll(&mut [beside]).unwrap();
    bench.cycle(10);
    for _ in 0..2 {
        bench.hubs[0].poll(&mut [first, second]).unwrap();
        bench.hubs[1].poll(&mut [beside]).unwrap();
    }
    diaries.iter().for_each(|diary| assert_eq!(diary.told, expect));
}

#[test]
fn what_a_hub_was_too_slow_for_is_told_as_lost() {
    let mut bench = Bench::new(&[Role::Monitor]);
    let depth = runtime::channel::DEEP as u64;
    let mut diary = Diary::default();
    bench.cycle(1);
    bench.hubs[0].poll(&mut [&mut diary]).unwrap();
    (2..2 + depth + 5).for_each(|cycle| bench.cycle(cycle));
    bench.hubs[0].poll(&mut [&mut diary]).unwrap();
    assert_eq!(diary.told[1], "lost 5 and 5");
    assert!(diary.told[2].starts_with("cycles 7 8 "), "{}", diary.told[2]);
}
