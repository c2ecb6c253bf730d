//! Memory: swap, huge pages, and the shared memory that channels are made of.

use super::finding::Finding;
use super::host::Host;
use runtime::fitness;
use std::os::unix::fs::MetadataExt;

/// Where shared memory shows as files.
pub(super) const SHARED_MEMORY: &str = "/dev/shm";

/// Permission bits of a folder in which everybody may make files and remove only his own.
const SHARED_MODE: u32 = 0o1777;

/// Whether memory that is not locked can leave the computer's memory.
pub(super) fn swap(host: &Host) -> Finding {
    const CHECK: &str = "swap";
    const WHY: &str = "planner and monitor are not locked in memory: paged out, they come late with setpoints and lose samples";
    let Some(swaps) = host.text("/proc/swaps") else {
        return Finding::unknown(CHECK, "/proc/swaps cannot be read", WHY);
    };
    let areas: Vec<_> =
        swaps.lines().skip(1).filter_map(|line| line.split_whitespace().next()).collect();
    if areas.is_empty() {
        return Finding::ok(CHECK, "none", WHY);
    }
    let remedy = "sudo swapoff -a; for good: remove the lines with swap from /etc/fstab";
    Finding::advice(CHECK, areas.join(", "), WHY, remedy)
}

/// Whether the kernel gathers pages into huge ones by itself.
pub(super) fn huge_pages(host: &Host) -> Finding {
    const CHECK: &str = "transparent huge pages";
    const WHY: &str = "the kernel stops a process while it moves its pages together";
    const FILE: &str = "/sys/kernel/mm/transparent_hugepage/enabled";
    let Some(modes) = host.text(FILE) else {
        return Finding::ok(CHECK, "the kernel has none", WHY);
    };
    let chosen = modes.split_whitespace().find(|word| word.starts_with('['));
    match chosen.map(|word| word.trim_matches(['[', ']'])) {
        Some("always") => {
            let remedy = format!("echo madvise | sudo tee {FILE}");
            Finding::advice(CHECK, "always", WHY, remedy)
        }
        Some(mode) => Finding::ok(CHECK, mode, WHY),
        None => Finding::unknown(CHECK, modes, WHY),
    }
}

/// Whether there is shared memory, and room in it.
pub(super) fn shared(host: &Host) -> Finding {
    const CHECK: &str = "/dev/shm";
    const WHY: &str = "the channels between the services lie there; a pipeline for which there is no room is not started";
    const MOUNT: &str = "sudo mount -o remount,mode=1777 /dev/shm";
    let path = host.path(SHARED_MEMORY);
    let Ok(folder) = std::fs::metadata(&path) else {
        let remedy = "sudo mount -t tmpfs -o mode=1777 tmpfs /dev/shm";
        return Finding::problem(CHECK, "there is no such folder", WHY, remedy);
    };
    let mode = folder.mode() & 0o7777;
    if mode != SHARED_MODE {
        let found = format!("its mode is {mode:o} instead of {SHARED_MODE:o}");
        return Finding::problem(CHECK, found, WHY, MOUNT);
    }
    let mounts = host.text("/proc/mounts").unwrap_or_default();
    let kind = mounts.lines().rev().find_map(|line| {
        let mut words = line.split_whitespace().skip(1);
        (words.next()? == SHARED_MEMORY).then(|| words.next()).flatten()
    });
    if kind != Some("tmpfs") {
        let found = format!("on {}, not tmpfs", kind.unwrap_or("the disk"));
        let remedy = "sudo mount -t tmpfs -o mode=1777 tmpfs /dev/shm";
        return Finding::advice(CHECK, found, WHY, remedy);
    }
    room(fitness::free(&path), fitness::pipeline_room())
}

fn room(free: Option<u64>, needed: u64) -> Finding {
    const CHECK: &str = "/dev/shm";
    const WHY: &str = "the channels between the services lie there; a pipeline for which there is no room is not started";
    let kibibytes = needed.div_ceil(1024);
    match free {
        None => Finding::unknown(CHECK, "its free space cannot be told", WHY),
        Some(free) if free < needed => Finding::problem(
            CHECK,
            format!("{} KiB are free, a pipeline needs {kibibytes} KiB", free / 1024),
            WHY,
            "ls -lS /dev/shm, and remove what is left over; or: sudo mount -o remount,size=64M /dev/shm",
        ),
        Some(free) => Finding::ok(
            CHECK,
            format!("{} MiB are free, a pipeline needs {kibibytes} KiB", free >> 20),
            WHY,
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::super::finding::Verdict;
    use super::*;

    #[test]
    fn shared_memory_needs_room_for_one_pipeline() {
        assert_eq!(room(Some(4095), 4096).verdict, Verdict::Problem);
        assert_eq!(room(Some(4096), 4096).verdict, Verdict::Ok);
        assert_eq!(room(None, 4096).verdict, Verdict::Unknown);
        let needed = fitness::pipeline_room();
        assert!((1 << 20..64 << 20).contains(&needed), "{needed}");
    }
}
