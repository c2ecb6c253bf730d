//! Channels within one process: qualities, layout check, wakes, operator requests, allocations.

#![allow(clippy::unwrap_used)]

mod scratch;

use std::time::{Duration, Instant};

use messages::{
    Command, Cycle, Feedback, JobOffer, Nanoseconds, OperatorReply, OperatorVerb, Progress,
    Setpoint,
};
use runtime::allocation::{Allocations, CountingAllocator};
use runtime::channel::{Channel, ChannelError, Qos, SETPOINTS_UNDER_WAY};
use runtime::operator::{OperatorError, OperatorLink, OperatorQueue};
use runtime::wake::Wake;
use runtime::{Domain, DomainError, Role, Samples, clock};
use scratch::Scratch;

#[global_allocator]
static ALLOCATOR: CountingAllocator = CountingAllocator;

fn feedback(cycle: u64) -> Feedback {
    Feedback {
        cycle: Cycle(cycle),
        position: [0.5; messages::MAX_ACTUATORS],
        ..Feedback::default()
    }
}

#[test]
fn a_published_sample_arrives_whole() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let drives = Domain::join(scratch.instance(), Role::Drives).unwrap();
    let controller = Domain::join(scratch.instance(), Role::Controller).unwrap();
    let mut publisher = drives.publisher::<Feedback>().unwrap();
    let mut subscriber = controller.subscriber::<Feedback>(Samples::Latest).unwrap();

    assert_eq!(subscriber.receive().unwrap(), None);
    assert!(publisher.publish(&feedback(7)).unwrap());
    assert_eq!(subscriber.receive().unwrap(), Some(feedback(7)));
    assert_eq!(subscriber.receive().unwrap(), None);
    drop(holder);
}

#[test]
fn a_cycle_sees_the_newest_and_a_monitor_every_sample() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let mut publisher = holder.publisher::<Command>().unwrap();
    let mut cycle = holder.subscriber::<Command>(Samples::Latest).unwrap();
    let mut monitor = holder.subscriber::<Command>(Samples::All).unwrap();
    let command = |cycle| Command { cycle: Cycle(cycle), ..Command::default() };

    for number in 0..100 {
        publisher.publish(&command(number)).unwrap();
    }
    assert_eq!(cycle.newest().unwrap(), Some(command(99)));
    let seen: Vec<u64> =
        std::iter::from_fn(|| monitor.receive().unwrap()).map(|command| command.cycle.0).collect();
    assert_eq!(seen, (0..100).collect::<Vec<_>>());
    assert_eq!(monitor.lost(), 0);
}

#[test]
fn a_slow_reader_counts_what_it_lost_and_stops_nobody() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let mut publisher = holder.publisher::<Progress>().unwrap();
    let mut reader = holder.subscriber::<Progress>(Samples::All).unwrap();
    let progress = |played| Progress { played, ..Progress::default() };

    publisher.publish(&progress(0)).unwrap();
    assert_eq!(reader.receive().unwrap(), Some(progress(0)));
    // The status channels hold 64 samples: of 200 more the first 136 give way.
    for played in 1..=200 {
        assert!(publisher.publish(&progress(played)).unwrap());
    }
    let seen: Vec<u64> =
        std::iter::from_fn(|| reader.receive().unwrap()).map(|progress| progress.played).collect();
    assert_eq!(seen, (137..=200).collect::<Vec<_>>());
    assert_eq!(reader.lost(), 136);
}

#[test]
fn a_late_reader_gets_the_newest_sample_before_the_next_one() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let mut publisher = holder.publisher::<JobOffer>().unwrap();
    let offer = JobOffer::new(1, "/tmp/job").unwrap();
    assert!(!publisher.publish(&JobOffer::new(0, "/tmp/old").unwrap()).unwrap());
    assert!(!publisher.publish(&offer).unwrap());

    let mut planner = holder.subscriber::<JobOffer>(Samples::All).unwrap();
    let next = JobOffer::new(2, "/tmp/next").unwrap();
    assert!(publisher.publish(&next).unwrap());
    assert_eq!(planner.receive().unwrap(), Some(offer));
    assert_eq!(planner.receive().unwrap(), Some(next));
    assert_eq!(planner.receive().unwrap(), None);
}

#[test]
fn a_silent_publisher_greets_a_late_reader_with_its_newest_sample_once() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let mut publisher = holder.publisher::<JobOffer>().unwrap();
    publisher.greet().unwrap();
    let offer = JobOffer::new(1, "/tmp/job").unwrap();
    publisher.publish(&JobOffer::new(0, "/tmp/old").unwrap()).unwrap();
    publisher.publish(&offer).unwrap();

    for reading in [Samples::Latest, Samples::All] {
        let mut reader = holder.subscriber::<JobOffer>(reading).unwrap();
        assert_eq!(reader.receive().unwrap(), None, "nobody has greeted {reading:?} yet");
        publisher.greet().unwrap();
        publisher.greet().unwrap();
        assert_eq!(reader.receive().unwrap(), Some(offer), "{reading:?}");
        assert_eq!(reader.receive().unwrap(), None, "{reading:?}");
        assert_eq!(reader.lost(), 0);
    }
    // On a channel that loses nothing there is no newest sample to give.
    let mut planner = holder.publisher::<Setpoint>().unwrap();
    let mut controller = holder.subscriber::<Setpoint>(Samples::All).unwrap();
    planner.greet().unwrap();
    assert_eq!(controller.receive().unwrap(), None);
}

#[test]
fn a_full_setpoint_channel_refuses_and_loses_nothing() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let mut planner = holder.publisher::<Setpoint>().unwrap();
    let setpoint = |sequence| Setpoint { stream: 1, sequence, ..Setpoint::default() };
    assert!(!planner.publish(&setpoint(0)).unwrap(), "no reader yet");

    let mut controller = holder.subscriber::<Setpoint>(Samples::All).unwrap();
    let mut sent = 0;
    while planner.publish(&setpoint(sent)).unwrap() {
        sent += 1;
    }
    assert_eq!(sent, SETPOINTS_UNDER_WAY as u64);
    assert!(!planner.publish(&setpoint(sent)).unwrap(), "still full");

    let mut expected = 0;
    while expected < sent {
        // One out makes room for one in.
        assert_eq!(controller.receive().unwrap(), Some(setpoint(expected)));
        expected += 1;
        if sent < 3000 {
            assert!(planner.publish(&setpoint(sent)).unwrap());
            sent += 1;
        }
    }
    assert_eq!(controller.receive().unwrap(), None);
    assert_eq!((expected, controller.lost()), (3000, 0));
}

mod other_build {
    //! What another build could have made of `Progress`: same name and size, other fields.

    use super::{Channel, Qos};

    messages::sample! {
        /// Has as many bytes as `messages::Progress`.
        Progress = "graver.Progress.v2" {
            /// All of them.
            words: [u64; size_of::<messages::Progress>() / 8],
        }
    }

    impl Channel for Progress {
        const SERVICE: &'static str = <messages::Progress as Channel>::SERVICE;
        const QOS: Qos = <messages::Progress as Channel>::QOS;
    }
}

#[test]
fn another_layout_under_the_same_name_is_refused() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    assert_eq!(size_of::<other_build::Progress>(), size_of::<Progress>());
    let error = holder.subscriber::<other_build::Progress>(Samples::All).unwrap_err();
    assert_eq!(error, ChannelError::Layout { channel: "progress", sample: "graver.Progress.v2" });
    assert!(holder.subscriber::<Progress>(Samples::All).is_ok());
}

#[test]
fn a_channel_has_one_publisher() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let first = holder.publisher::<Feedback>().unwrap();
    let error = holder.publisher::<Feedback>().unwrap_err();
    assert!(matches!(error, ChannelError::Refused { channel: "feedback", .. }), "{error}");
    drop(first);
    assert!(holder.publisher::<Feedback>().is_ok());
}

#[test]
fn a_new_publisher_is_no_loss() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let mut reader = holder.subscriber::<Feedback>(Samples::All).unwrap();
    for cycle in [5, 15, 10] {
        let mut publisher = holder.publisher::<Feedback>().unwrap();
        publisher.publish(&feedback(cycle)).unwrap();
        publisher.publish(&feedback(cycle + 1)).unwrap();
        assert_eq!(reader.newest().unwrap(), Some(feedback(cycle + 1)));
        assert_eq!(reader.lost(), 0);
    }
}

#[test]
fn a_wake_wakes_once_and_the_deadline_ends_the_wait() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let listener = holder.listener(Wake::Feedback).unwrap();
    let notifier = holder.notifier(Wake::Feedback).unwrap();
    let other = holder.listener(Wake::Command).unwrap();

    let soon = || clock::now() + Nanoseconds(2_000_000);
    let far = || clock::now() + Nanoseconds(60_000_000_000);
    assert!(!listener.wait_until(soon()).unwrap());
    notifier.notify().unwrap();
    assert!(listener.wait_until(far()).unwrap());
    assert!(!listener.wait_until(Nanoseconds(0)).unwrap());
    notifier.notify().unwrap();
    notifier.notify().unwrap();
    listener.drain().unwrap();
    assert!(!listener.wait_until(soon()).unwrap());
    assert!(!other.wait_until(Nanoseconds(0)).unwrap());
}

#[test]
fn one_allocation_for_each_publish_and_none_for_all_else() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let mut publisher = holder.publisher::<Feedback>().unwrap();
    let mut newest = holder.subscriber::<Feedback>(Samples::Latest).unwrap();
    let mut every = holder.subscriber::<Feedback>(Samples::All).unwrap();
    let notifier = holder.notifier(Wake::Feedback).unwrap();
    let listener = holder.listener(Wake::Feedback).unwrap();
    let queue = OperatorQueue::start(&holder).unwrap();
    let mut peers = runtime::peer::Peers::watch(&holder, &[Role::Domain]).unwrap();

    // The first publish, wake and receive make the connections.
    publisher.publish(&feedback(0)).unwrap();
    notifier.notify().unwrap();
    listener.drain().unwrap();
    newest.newest().unwrap();
    every.newest().unwrap();

    for cycle in 1..=1000 {
        let (sent, asked) = Allocations::during(|| publisher.publish(&feedback(cycle)));
        assert!(sent.unwrap());
        assert_eq!((asked.allocations, asked.releases), (1, 1), "publish of cycle {cycle}");

        let ((), asked) = Allocations::during(|| {
            notifier.notify().unwrap();
            assert!(listener.wait_until(clock::now() + Nanoseconds(1_000_000_000)).unwrap());
            assert!(!listener.wait_until(clock::now()).unwrap());
            assert_eq!(newest.newest().unwrap().unwrap().cycle, Cycle(cycle));
            assert_eq!(every.receive().unwrap().unwrap().cycle, Cycle(cycle));
            assert!(queue.take().is_none());
            assert_eq!(peers.state(Role::Domain), runtime::peer::PeerState::Alive);
        });
        assert_eq!(asked, Allocations::default(), "the rest of cycle {cycle}");
    }
}

#[test]
fn a_full_channel_allocates_no_more_than_a_publish() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let mut planner = holder.publisher::<Setpoint>().unwrap();
    let _controller = holder.subscriber::<Setpoint>(Samples::All).unwrap();
    while planner.publish(&Setpoint::default()).unwrap() {}
    let (sent, asked) = Allocations::during(|| planner.publish(&Setpoint::default()));
    assert!(!sent.unwrap());
    assert_eq!((asked.allocations, asked.releases), (1, 1));
}

#[test]
fn a_request_reaches_the_cycle_and_its_reply_the_operator() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let link = OperatorLink::start(&holder).unwrap();
    assert_eq!(link.request(OperatorVerb::Hold, 0.0), Err(OperatorError::NoController));

    let queue = OperatorQueue::start(&holder).unwrap();
    let short = Duration::from_millis(20);
    assert_eq!(
        link.request_within(OperatorVerb::Stop, 0.0, short),
        Err(OperatorError::NoAnswer(short))
    );
    assert_eq!(queue.take().map(|request| request.verb), Some(OperatorVerb::Stop as u32));

    std::thread::scope(|scope| {
        scope.spawn(|| {
            let started = Instant::now();
            let mut answered = 0;
            while answered < 3 && started.elapsed() < Duration::from_secs(20) {
                if let Some(request) = queue.take() {
                    answered += 1;
                    queue.answer(OperatorReply {
                        ticket: request.ticket,
                        accepted: 1,
                        state: request.verb,
                        value: request.value,
                        ..OperatorReply::default()
                    });
                }
                std::thread::sleep(Duration::from_millis(1));
            }
        });
        for value in [0.5, 1.0, 2.0] {
            let patience = Duration::from_secs(20);
            let reply = link.request_within(OperatorVerb::Override, value, patience).unwrap();
            assert_eq!((reply.accepted, reply.state, reply.value), (1, 7, value));
        }
    });
}

#[test]
fn another_thread_enters_and_makes_its_own_ports() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let mut reader = holder.subscriber::<Progress>(Samples::All).unwrap();
    let entry = holder.entry();
    let (send, publish) = std::sync::mpsc::channel();
    let thread = std::thread::spawn(move || {
        let domain = entry.enter().unwrap();
        assert_eq!(domain.role(), Role::Domain);
        let mut publisher = domain.publisher::<Progress>().unwrap();
        while let Ok(played) = publish.recv() {
            publisher.publish(&Progress { played, ..Progress::default() }).unwrap();
        }
    });
    send.send(3).unwrap();
    while reader.receive().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(1));
    }
    // What a publisher says last is still heard after it has gone.
    send.send(4).unwrap();
    send.send(5).unwrap();
    drop(send);
    thread.join().unwrap();
    let rest: Vec<u64> =
        std::iter::from_fn(|| reader.receive().unwrap()).map(|progress| progress.played).collect();
    assert_eq!((rest, reader.lost()), (vec![4, 5], 0));
}

#[test]
fn a_port_keeps_its_domain() {
    let scratch = Scratch::new();
    let holder = Domain::create(scratch.instance()).unwrap();
    let mut publisher = holder.publisher::<Progress>().unwrap();
    drop(holder);
    assert!(matches!(Domain::create(scratch.instance()), Err(DomainError::InUse { .. })));
    publisher.publish(&Progress::default()).unwrap();
    drop(publisher);
    scratch.assert_gone();
}
