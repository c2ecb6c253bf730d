//! What the facts of several threads lack for real time, in words.

use std::io;

use messages::RealtimeFacts;
use messages::report::refused;

/// What these threads, by name, were refused: one sentence for each kind of thing, with what it
/// means and what to change. Empty when all of them got what they asked for; a thread that asked
/// for no real-time scheduling is a sentence too.
pub fn missing(threads: &[(&str, RealtimeFacts)]) -> Vec<String> {
    let list = |of: &dyn Fn(&str, &RealtimeFacts) -> Option<String>| {
        join(threads.iter().filter_map(|(name, facts)| of(name, facts)).collect())
    };
    let unasked = list(&|name, facts| (facts.asked_priority == 0).then(|| name.to_owned()));
    let priority = list(&|name, facts| {
        let reason = reason(facts.priority_error);
        let detail = format!("{name} (SCHED_FIFO {}: {reason})", facts.asked_priority);
        (facts.refused & refused::PRIORITY != 0).then_some(detail)
    });
    let memory = list(&|name, facts| {
        let detail = format!("{name} ({})", memory_reason(facts));
        (facts.refused & refused::MEMORY != 0).then_some(detail)
    });
    let core = list(&|name, facts| {
        let (asked, last) = (facts.asked_core, facts.last_core);
        let detail = format!("{name} to CPU {asked} (it may use CPUs up to {last})");
        (facts.refused & refused::CORE != 0).then_some(detail)
    });
    let claim = list(&|_, facts| {
        let detail = squatted(facts.core, facts.claim_pid, facts.claim_user);
        (facts.refused & refused::CLAIM != 0).then_some(detail)
    });
    [
        unasked.map(|who| {
            format!(
                "no real-time scheduling was asked for {who}: expect late cycles under load; \
                 leave --no-realtime away"
            )
        }),
        priority.map(|who| {
            format!(
                "no real-time priority for {who}: expect late cycles under load; allow it with \
                 `LimitRTPRIO=90` in the unit, or the line `USER - rtprio 90` in \
                 /etc/security/limits.conf and a new login"
            )
        }),
        memory.map(|who| {
            format!(
                "memory is not locked for {who}: expect page faults in a cycle; raise the limit \
                 with `LimitMEMLOCK=infinity` in the unit, or the line `USER - memlock unlimited` \
                 in /etc/security/limits.conf and a new login"
            )
        }),
        core.map(|who| {
            format!(
                "not pinned: {who}: expect more latency; name another CPU with --core, or widen \
                 the unit's CPUAffinity"
            )
        }),
        claim.map(|who| {
            format!(
                "{who} without a real-time thread on it: another pipeline there is noticed all the \
                 same; have that process ended"
            )
        }),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// Who holds the name that claims a CPU.
fn squatted(core: i32, pid: u32, user: u32) -> String {
    let who = match (pid, user) {
        (0, u32::MAX) => "a process that does not say who it is".to_owned(),
        (0, user) => format!("a process of user {user}"),
        (pid, user) => format!("pid {pid} of user {user}"),
    };
    format!("the claim on CPU {core} is held by {who}")
}

fn memory_reason(facts: &RealtimeFacts) -> String {
    match facts.memory_error {
        0 => format!(
            "the limit is {} MiB, {} MiB are needed",
            facts.memory_limit >> 20,
            facts.memory_needed >> 20
        ),
        number => reason(number),
    }
}

fn reason(number: u32) -> String {
    io::Error::from_raw_os_error(number.cast_signed()).to_string()
}

/// `a`, `a and b`, `a, b and c`.
fn join(mut names: Vec<String>) -> Option<String> {
    let last = names.pop()?;
    Some(if names.is_empty() { last } else { format!("{} and {last}", names.join(", ")) })
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: RealtimeFacts = RealtimeFacts {
        fifo: 1,
        priority: 80,
        core: 1,
        locked: 1,
        refused: 0,
        asked_priority: 80,
        priority_error: 0,
        memory_error: 0,
        asked_core: 0,
        last_core: 0,
        memory_limit: 0,
        memory_needed: 0,
        claim_pid: 0,
        claim_user: 0,
    };

    fn check(threads: &[(&str, RealtimeFacts)], expect: &[&str]) {
        let said = missing(threads);
        assert_eq!(said.len(), expect.len(), "{said:?}");
        for (said, expect) in said.iter().zip(expect) {
            assert!(said.starts_with(expect), "{said}\n{expect}");
        }
    }

    #[test]
    fn each_kind_of_thing_is_said_once_with_what_each_thread_lacks() {
        let bare = RealtimeFacts {
            fifo: 0,
            priority: 0,
            locked: 0,
            refused: refused::PRIORITY | refused::MEMORY,
            priority_error: 1,
            memory_limit: 8 << 20,
            memory_needed: 300 << 20,
            ..GOOD
        };
        let full = RealtimeFacts { asked_priority: 85, memory_error: 12, ..bare };
        check(
            &[("controller", bare), ("drives", full)],
            &[
                "no real-time priority for controller (SCHED_FIFO 80: Operation not permitted (os \
                 error 1)) and drives (SCHED_FIFO 85: Operation not permitted (os error 1)): expect \
                 late cycles",
                "memory is not locked for controller (the limit is 8 MiB, 300 MiB are needed) and \
                 drives (Cannot allocate memory (os error 12)): expect page faults",
            ],
        );
        check(&[("controller", GOOD), ("drives", GOOD)], &[]);
        check(&[], &[]);
    }

    #[test]
    fn a_failed_pin_is_said() {
        let refused = refused::CORE;
        let lost = RealtimeFacts { core: -1, refused, asked_core: 9, last_core: 3, ..GOOD };
        check(
            &[("controller", GOOD), ("drives", lost)],
            &["not pinned: drives to CPU 9 (it may use CPUs up to 3): expect more latency"],
        );
    }

    #[test]
    fn who_holds_the_name_of_a_cpu_is_said() {
        let squatted = RealtimeFacts { refused: refused::CLAIM, claim_pid: 77, ..GOOD };
        let known = RealtimeFacts { claim_user: 1001, ..squatted };
        check(
            &[("controller", GOOD), ("drives", known)],
            &["the claim on CPU 1 is held by pid 77 of user 1001 without a real-time thread on it"],
        );
        let unknown = RealtimeFacts { claim_pid: 0, claim_user: u32::MAX, ..squatted };
        check(
            &[("drives", unknown)],
            &["the claim on CPU 1 is held by a process that does not say who it is without"],
        );
    }

    #[test]
    fn what_was_not_asked_for_is_said_without_a_refusal() {
        let plain = RealtimeFacts { core: -1, ..RealtimeFacts::default() };
        check(
            &[("controller", plain), ("drives", plain)],
            &["no real-time scheduling was asked for controller and drives: expect late cycles"],
        );
    }
}
