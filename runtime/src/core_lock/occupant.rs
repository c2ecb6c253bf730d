//! Whether a process has a real-time thread on a core, as the kernel tells everybody in /proc.

use std::fs;
use std::path::Path;

use crate::thread::DRIVES_PRIORITY;

/// What a process does on a core.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Occupation {
    /// It has a SCHED_FIFO thread that may run there, and is not stopped.
    RealTime,
    /// It has none, or is gone.
    None,
    /// The kernel does not tell: /proc hides other users' processes.
    Unknown,
}

/// What the process does on the core.
pub(super) fn occupation(pid: i32, core: usize) -> Occupation {
    let directory = Path::new("/proc").join(pid.to_string());
    let Ok(threads) = fs::read_dir(directory.join("task")) else {
        // Hidden processes and ended ones look the same; a signal that is not sent tells.
        return if exists(pid) { Occupation::Unknown } else { Occupation::None };
    };
    let mut unknown = false;
    for thread in threads.flatten() {
        match read(&thread.path()) {
            Some(found) if found.is_real_time_on(core) => return Occupation::RealTime,
            Some(_) => {}
            // Ended in between, or hidden.
            None => unknown |= thread.path().exists(),
        }
    }
    if unknown { Occupation::Unknown } else { Occupation::None }
}

/// Some process with a thread like that of drives on the core: of its priority, and pinned there.
pub(super) fn anybody(core: usize) -> Option<i32> {
    let own = std::process::id() as i32;
    let number = |entry: fs::DirEntry| entry.file_name().to_str()?.parse::<i32>().ok();
    let mut processes = fs::read_dir("/proc").ok()?.flatten().filter_map(number);
    processes.find(|pid| {
        *pid != own
            && fs::read_dir(format!("/proc/{pid}/task")).is_ok_and(|threads| {
                threads.flatten().filter_map(|thread| read(&thread.path())).any(|found| {
                    found.is_real_time_on(core)
                        && found.priority == DRIVES_PRIORITY
                        && found.cores == core.to_string()
                })
            })
    })
}

/// Whether there is a process with this number, of whatever user.
fn exists(pid: i32) -> bool {
    // SAFETY: signal 0 is not sent; the kernel only checks.
    #[allow(unsafe_code)]
    let result = unsafe { libc::kill(pid, 0) };
    result == 0 || std::io::Error::last_os_error().raw_os_error() == Some(libc::EPERM)
}

/// What the kernel says of a thread.
#[derive(Debug, PartialEq, Eq)]
struct Thread {
    state: char,
    policy: i32,
    priority: i32,
    /// The CPUs it may use, such as `0-2,5`.
    cores: String,
}

impl Thread {
    fn is_real_time_on(&self, core: usize) -> bool {
        let runs = !matches!(self.state, 'T' | 't' | 'Z' | 'X');
        runs && self.policy == libc::SCHED_FIFO && contains(&self.cores, core)
    }
}

fn read(directory: &Path) -> Option<Thread> {
    let stat = fs::read_to_string(directory.join("stat")).ok()?;
    let status = fs::read_to_string(directory.join("status")).ok()?;
    parse(&stat, &status)
}

/// Reads proc_pid_stat(5) and proc_pid_status(5).
fn parse(stat: &str, status: &str) -> Option<Thread> {
    // The name before it may have spaces and parentheses. What follows begins with field 3.
    let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
    let field = |number: usize| fields.get(number - 3).copied();
    let cores = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:"))?;
    Some(Thread {
        state: field(3)?.chars().next()?,
        priority: field(40)?.parse().ok()?,
        policy: field(41)?.parse().ok()?,
        cores: cores.trim().to_owned(),
    })
}

/// Whether a list such as `0-2,5` has the number.
fn contains(list: &str, number: usize) -> bool {
    list.split(',').any(|range| {
        let (first, last) = range.split_once('-').unwrap_or((range, range));
        let bounds = (first.parse::<usize>(), last.parse::<usize>());
        matches!(bounds, (Ok(first), Ok(last)) if (first..=last).contains(&number))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_of_cpus_is_read() {
        for (list, inside, outside) in
            [("0-3", 2, 4), ("0-2,5", 5, 3), ("7", 7, 0), ("0,2-4", 3, 1), ("", usize::MAX, 0)]
        {
            assert_eq!(contains(list, inside), !list.is_empty(), "{list}");
            assert!(!contains(list, outside), "{list}");
        }
    }

    #[test]
    fn a_thread_is_real_time_where_it_may_run_and_is_not_stopped() {
        let thread = |state: char, policy: i32, cores: &str| {
            let zeros = "0 ".repeat(36);
            let stat = format!("77 (a) b (c) {state} {zeros}85 {policy} 0 0\n");
            let status = format!("Name:\ta) b (c\nCpus_allowed:\tf\nCpus_allowed_list:\t{cores}\n");
            parse(&stat, &status)
        };
        let found = |state, policy, cores| {
            thread(state, policy, cores).is_some_and(|found| found.is_real_time_on(3))
        };
        assert!(found('S', libc::SCHED_FIFO, "3") && found('R', libc::SCHED_FIFO, "0-3"));
        assert!(!found('S', libc::SCHED_OTHER, "3") && !found('S', libc::SCHED_FIFO, "0-2"));
        assert!(!found('T', libc::SCHED_FIFO, "3") && !found('Z', libc::SCHED_FIFO, "3"));
        assert_eq!(thread('S', 1, "3").map(|found| found.priority), Some(85));
        assert_eq!(parse("77 (x) S 1", "Cpus_allowed_list:\t0\n"), None);
    }

    #[test]
    fn this_process_is_seen_and_one_that_is_gone_is_not() {
        let own = std::process::id() as i32;
        // No test of this process is in real time on a CPU that no computer has.
        assert_eq!(occupation(own, 100_000), Occupation::None);
        assert_eq!(occupation(i32::MAX, 0), Occupation::None);
        assert_eq!(anybody(100_000), None);
    }
}
