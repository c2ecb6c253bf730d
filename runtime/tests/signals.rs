//! Requests to end as a flag. Handlers belong to the process, so each test has one of its own: this
//! binary again, running [`signalled_process`] with a script in the environment.

#![allow(clippy::unwrap_used)]

use std::os::unix::process::ExitStatusExt;
use std::process::{Command, Output};

use runtime::clock;
use runtime::peer::Peer;
use runtime::signal::{self, Termination};

const SCRIPT: &str = "GRAVER_TEST_SIGNALS";

/// Runs the script in a process of its own, started by a shell that has set `trap`.
fn play(script: &str, trap: &str) -> Output {
    Command::new("sh")
        .args(["-c", &format!("{trap}\nexec \"$0\" \"$@\"")])
        .arg(std::env::current_exe().unwrap())
        .args(["--exact", "signalled_process", "--nocapture", "--test-threads=1"])
        .env(SCRIPT, script)
        .output()
        .unwrap()
}

fn check(script: &str, trap: &str) {
    let output = play(script, trap);
    assert!(output.status.success(), "{script}: {output:?}");
}

/// In a child: plays its script. Without the environment it is an empty test.
#[test]
fn signalled_process() {
    let Ok(script) = std::env::var(SCRIPT) else { return };
    let own = Peer::open(std::process::id() as i32).unwrap();
    match script.as_str() {
        "ends" => {
            default_hang_up();
            signal::install().unwrap();
            assert_eq!(signal::termination(), None);
            for (count, number) in [(1, libc::SIGHUP), (2, libc::SIGTERM), (3, libc::SIGINT)] {
                own.signal(number).unwrap();
                assert_eq!(told(count), Termination { signal: number, count });
            }
            // A terminal that closes sends it once more: that is no haste.
            own.signal(libc::SIGHUP).unwrap();
            own.signal(libc::SIGTERM).unwrap();
            assert_eq!(told(4), Termination { signal: libc::SIGTERM, count: 4 });
        }
        "nohup" => {
            signal::install().unwrap();
            own.signal(libc::SIGHUP).unwrap();
            own.signal(libc::SIGTERM).unwrap();
            assert_eq!(told(1), Termination { signal: libc::SIGTERM, count: 1 });
        }
        "outlives" => {
            default_hang_up();
            signal::outlive_terminal().unwrap();
            signal::install().unwrap();
            own.signal(libc::SIGHUP).unwrap();
            own.signal(libc::SIGTERM).unwrap();
            assert_eq!(told(1), Termination { signal: libc::SIGTERM, count: 1 });
        }
        "pipe" => {
            signal::install().unwrap();
            own.signal(libc::SIGPIPE).unwrap();
            own.signal(libc::SIGTERM).unwrap();
            assert_eq!(told(1).signal, libc::SIGTERM);
        }
        "bus" => {
            signal::install().unwrap();
            own.signal(libc::SIGBUS).unwrap();
            loop {
                std::thread::yield_now();
            }
        }
        "continues" => {
            signal::install().unwrap();
            assert_eq!(signal::continued(), None);
            let before = clock::now();
            own.signal(libc::SIGCONT).unwrap();
            while signal::continued().is_none() {
                std::thread::yield_now();
            }
            assert!(signal::continued().is_some_and(|at| before <= at && at <= clock::now()));
        }
        other => panic!("{other}"),
    }
}

/// Sent to the process, a signal may be taken by any of its threads: waits for the count.
fn told(count: u32) -> Termination {
    loop {
        match signal::termination() {
            Some(termination) if termination.count >= count => return termination,
            _ => std::thread::yield_now(),
        }
    }
}

/// A shell cannot undo that a signal was ignored when it was started.
fn default_hang_up() {
    // SAFETY: the default action replaces whatever this test was started with.
    #[allow(unsafe_code)]
    unsafe {
        libc::signal(libc::SIGHUP, libc::SIG_DFL)
    };
}

#[test]
fn each_request_to_end_sets_the_flag_and_counts() {
    check("ends", "");
}

#[test]
fn a_hang_up_that_is_ignored_stays_ignored() {
    check("nohup", "trap '' HUP");
}

#[test]
fn a_process_that_outlives_its_terminal_hears_no_hang_up() {
    check("outlives", "");
}

#[test]
fn a_reader_that_went_away_is_no_request_to_end() {
    check("pipe", "");
}

#[test]
fn a_page_that_cannot_be_had_ends_the_process_with_a_word_about_the_cause() {
    let output = play("bus", "ulimit -c 0");
    assert_eq!(output.status.signal(), Some(libc::SIGBUS));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("/dev/shm is full; see `df /dev/shm`"), "{said}");
}
