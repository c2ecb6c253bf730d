//! What this user may do: limits, a real-time priority, locked memory.

use super::finding::Finding;
use super::host::Host;
use runtime::fitness;
use runtime::thread::DRIVES_PRIORITY;

/// Memory that a service locks at most, with what it may grow by, in bytes.
const LOCKED: u64 = 256 << 20;

/// Files that a service has open at most, and then some.
const FILES: u64 = 1024;

/// Bits of the effective capabilities; capabilities(7).
const CAP_IPC_LOCK: u32 = 14;
const CAP_SYS_NICE: u32 = 23;

/// What the three limits that matter are.
pub(super) fn limits(host: &Host) -> Vec<Finding> {
    let limits = host.text("/proc/self/limits").unwrap_or_default();
    let limit = |name: &str| soft_limit(&limits, name);
    vec![
        priority_limit(limit("Max realtime priority"), capable(host, CAP_SYS_NICE)),
        memory_limit(limit("Max locked memory"), capable(host, CAP_IPC_LOCK)),
        files_limit(limit("Max open files")),
    ]
}

fn priority_limit(limit: Option<u64>, is_capable: bool) -> Finding {
    const CHECK: &str = "limit of priority";
    const WHY: &str = "without a real-time priority any program that computes makes cycles late";
    let needed = DRIVES_PRIORITY.unsigned_abs();
    match limit {
        _ if is_capable => Finding::ok(CHECK, "CAP_SYS_NICE: none", WHY),
        None => Finding::unknown(CHECK, "/proc/self/limits cannot be read", WHY),
        Some(limit) if limit >= u64::from(needed) => Finding::ok(CHECK, written(limit), WHY),
        Some(limit) => Finding::problem(
            CHECK,
            format!("{limit}; {needed} is needed"),
            WHY,
            "echo \"$USER - rtprio 90\" | sudo tee -a /etc/security/limits.d/graver.conf, and log in again; in a unit: LimitRTPRIO=90",
        ),
    }
}

fn memory_limit(limit: Option<u64>, is_capable: bool) -> Finding {
    const CHECK: &str = "limit of locked memory";
    const WHY: &str =
        "memory that is not locked can be paged out, and fetching it back takes milliseconds";
    match limit {
        _ if is_capable => Finding::ok(CHECK, "CAP_IPC_LOCK: none", WHY),
        None => Finding::unknown(CHECK, "/proc/self/limits cannot be read", WHY),
        Some(u64::MAX) => Finding::ok(CHECK, "unlimited", WHY),
        Some(limit) if limit >= LOCKED => Finding::ok(CHECK, mebibytes(limit), WHY),
        Some(limit) => Finding::problem(
            CHECK,
            format!("{}; {} are needed", mebibytes(limit), mebibytes(LOCKED)),
            WHY,
            "echo \"$USER - memlock unlimited\" | sudo tee -a /etc/security/limits.d/graver.conf, and log in again; in a unit: LimitMEMLOCK=infinity",
        ),
    }
}

fn files_limit(limit: Option<u64>) -> Finding {
    const CHECK: &str = "limit of open files";
    const WHY: &str = "each channel takes files of every process that has a port on it";
    match limit {
        None => Finding::unknown(CHECK, "/proc/self/limits cannot be read", WHY),
        Some(limit) if limit >= FILES => Finding::ok(CHECK, written(limit), WHY),
        Some(limit) => Finding::problem(
            CHECK,
            format!("{limit}; {FILES} are enough"),
            WHY,
            format!("ulimit -n {FILES}; in a unit: LimitNOFILE={FILES}"),
        ),
    }
}

/// Whether a thread gets SCHED_FIFO, tried.
pub(super) fn real_time_priority(host: &Host) -> Finding {
    const CHECK: &str = "SCHED_FIFO";
    const WHY: &str =
        "limits are not all: a control group without time for real-time tasks refuses it too";
    if !host.is_this_one() {
        return Finding::unknown(CHECK, "not tried for another computer", WHY);
    }
    match fitness::try_priority(DRIVES_PRIORITY) {
        Ok(()) => Finding::ok(CHECK, format!("priority {DRIVES_PRIORITY} was given"), WHY),
        Err(error) => Finding::problem(
            CHECK,
            format!("priority {DRIVES_PRIORITY} was refused: {error}"),
            WHY,
            "echo \"$USER - rtprio 90\" | sudo tee -a /etc/security/limits.d/graver.conf, and log in again; in a container: --cap-add SYS_NICE",
        ),
    }
}

/// Whether memory can be locked, tried.
pub(super) fn locked_memory(host: &Host) -> Finding {
    const CHECK: &str = "mlockall";
    const WHY: &str = "a page that is not there when a cycle touches it makes that cycle late";
    if !host.is_this_one() {
        return Finding::unknown(CHECK, "not tried for another computer", WHY);
    }
    let size = mebibytes(LOCKED);
    match fitness::try_locking_memory(LOCKED) {
        Ok(()) => Finding::ok(CHECK, format!("{size} were locked"), WHY),
        Err(error) => Finding::problem(
            CHECK,
            format!("{size} were refused: {error}"),
            WHY,
            "echo \"$USER - memlock unlimited\" | sudo tee -a /etc/security/limits.d/graver.conf, and log in again; in a container: --ulimit memlock=-1",
        ),
    }
}

/// The soft limit of this name; `u64::MAX` for none.
fn soft_limit(limits: &str, name: &str) -> Option<u64> {
    let rest = limits.lines().find_map(|line| line.strip_prefix(name))?;
    match rest.split_whitespace().next()? {
        "unlimited" => Some(u64::MAX),
        number => number.parse().ok(),
    }
}

/// Whether this process has an effective capability.
fn capable(host: &Host, capability: u32) -> bool {
    let status = host.text("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("CapEff:"));
    let bits = line.and_then(|bits| u64::from_str_radix(bits.trim(), 16).ok());
    bits.is_some_and(|bits| bits >> capability & 1 == 1)
}

fn written(limit: u64) -> String {
    if limit == u64::MAX { "unlimited".to_owned() } else { limit.to_string() }
}

fn mebibytes(bytes: u64) -> String {
    format!("{} MiB", bytes >> 20)
}

#[cfg(test)]
mod tests {
    use super::super::finding::Verdict;
    use super::*;

    #[test]
    fn limits_are_read_from_the_columns_of_the_kernel() {
        let text = "Limit                     Soft Limit           Hard Limit           Units     \n\
                    Max open files            1024                 524288               files     \n\
                    Max locked memory         unlimited            unlimited            bytes     \n\
                    Max realtime priority     0                    0                    \n";
        assert_eq!(soft_limit(text, "Max open files"), Some(1024));
        assert_eq!(soft_limit(text, "Max locked memory"), Some(u64::MAX));
        assert_eq!(soft_limit(text, "Max realtime priority"), Some(0));
        assert_eq!(soft_limit(text, "Max nice priority"), None);
    }

    #[test]
    fn a_limit_binds_only_who_has_no_capability() {
        assert_eq!(priority_limit(Some(0), false).verdict, Verdict::Problem);
        assert_eq!(priority_limit(Some(84), false).verdict, Verdict::Problem);
        assert_eq!(priority_limit(Some(85), false).verdict, Verdict::Ok);
        assert_eq!(priority_limit(Some(0), true).verdict, Verdict::Ok);
        assert_eq!(memory_limit(Some(8 << 20), false).verdict, Verdict::Problem);
        assert_eq!(memory_limit(Some(8 << 20), true).verdict, Verdict::Ok);
        assert_eq!(memory_limit(Some(u64::MAX), false).found, "unlimited");
        assert_eq!(files_limit(Some(256)).verdict, Verdict::Problem);
        assert_eq!(files_limit(None).verdict, Verdict::Unknown);
    }
}
