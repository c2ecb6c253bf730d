//! Ctrl-C as a flag, in a process of its own because the handler is the process's.

#![allow(clippy::unwrap_used)]

use runtime::clock;
use runtime::peer::Peer;
use runtime::signal::{self, Termination};

#[test]
fn a_signal_sets_the_flag_and_a_second_one_counts() {
    signal::install().unwrap();
    assert_eq!(signal::termination(), None);
    let own = Peer::open(std::process::id() as i32).unwrap();
    for (count, number) in [(1, libc::SIGTERM), (2, libc::SIGINT)] {
        own.signal(number).unwrap();
        // Sent to the process: any of its threads may take it.
        while signal::termination().is_none_or(|termination| termination.count < count) {
            std::thread::yield_now();
        }
        assert_eq!(signal::termination(), Some(Termination { signal: number, count }));
    }
    assert_eq!(signal::continued(), None);
    let before = clock::now();
    own.signal(libc::SIGCONT).unwrap();
    while signal::continued().is_none() {
        std::thread::yield_now();
    }
    assert!(signal::continued().is_some_and(|at| before <= at && at <= clock::now()));
}
