//! Making the calling thread real-time, as far as this computer and user allow.
//!
//! Nothing here fails: without privileges the pipeline runs all the same. What was refused is in
//! the facts, which travel with the reports; whoever concludes a run says it once, with the way to
//! get it ([`missing()`]).
//!
//! A SCHED_FIFO thread that never sleeps is stopped by the kernel for 50 ms every second (real-time
//! throttling), so a cycle may spin only briefly before its deadline.

use std::fs::File;
use std::io::{self, Write};

use core_affinity::CoreId;
use messages::report::refused;
use messages::{Nanoseconds, RealtimeFacts};

use crate::clock::SPIN_MARGIN;
use crate::core_lock::{CoreError, CoreLock};

mod missing;

pub use missing::missing;

/// Priority of the drives' cycle, above the controller on the same core.
pub const DRIVES_PRIORITY: i32 = 85;

/// Priority of the controller's cycle.
pub const CONTROLLER_PRIORITY: i32 = 80;

/// Stack that is touched ahead, so that a cycle meets no page fault there, in bytes.
const STACK: usize = 256 * 1024;

/// What locked memory may grow by after the set-up, in bytes.
const HEADROOM: u64 = 64 << 20;

/// Bits of the effective capabilities; capabilities(7).
const CAP_IPC_LOCK: u32 = 14;

/// Where a real-time thread runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Placement {
    /// The last CPU that the process may use, and only with a real-time priority: without, the
    /// scheduler finds better places than a fixed one.
    #[default]
    Automatic,
    /// This CPU.
    Core(usize),
}

/// What a thread asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RealtimeOptions {
    /// SCHED_FIFO priority 1..=99; `None` for the ordinary scheduler.
    pub priority: Option<i32>,
    /// Where to run.
    pub placement: Placement,
    /// Whether to lock the process's memory.
    pub lock_memory: bool,
}

/// What a thread got; keep it as long as the thread is real-time.
#[derive(Debug)]
pub struct Realtime {
    /// The facts, as reports carry them.
    pub facts: RealtimeFacts,
    /// While open, the CPUs stay out of deep sleep states.
    _awake: Option<File>,
}

impl Realtime {
    /// How long this thread's clock may spin before a deadline: [`SPIN_MARGIN`] with a
    /// real-time priority, else 0, because an ordinary thread would only spend its share of the
    /// CPU.
    pub fn spin_margin(&self) -> Nanoseconds {
        if self.facts.fifo == 1 { SPIN_MARGIN } else { Nanoseconds(0) }
    }

    /// Claims the core for this pipeline, if the thread really has a real-time priority on one;
    /// for drives, whose controller shares the core. Somebody who holds the core's name for nothing
    /// is noted in the facts.
    pub fn claim_core(&mut self) -> Result<Option<CoreLock>, CoreError> {
        let claim = match usize::try_from(self.facts.core) {
            Ok(core) if self.facts.fifo == 1 => CoreLock::claim(core)?,
            _ => return Ok(None),
        };
        if let Some(squatter) = claim.squatter() {
            self.facts.refused |= refused::CLAIM;
            self.facts.claim_pid = squatter.pid.unsigned_abs();
            self.facts.claim_user = squatter.user;
        }
        Ok(Some(claim))
    }
}

/// The last CPU that this process may use. Ask before pinning: afterwards only the pinned one is
/// allowed.
pub fn last_core() -> usize {
    core_affinity::get_core_ids()
        .and_then(|cores| cores.iter().map(|core| core.id).max())
        .unwrap_or(0)
}

/// Makes the calling thread real-time. All ports, helper threads and peers must be there already:
/// threads made later share its core, and memory mapped later is locked page by page.
pub fn enter_realtime(options: &RealtimeOptions) -> Realtime {
    let mut facts = RealtimeFacts { core: -1, ..RealtimeFacts::default() };
    if options.lock_memory {
        keep_heap();
        lock_memory(&mut facts);
        touch_stack();
    }
    if let Some(priority) = options.priority {
        take_priority(priority, &mut facts);
    }
    let core = match options.placement {
        Placement::Automatic => (facts.fifo == 1).then(last_core),
        Placement::Core(core) => Some(core),
    };
    if let Some(core) = core {
        pin(core, &mut facts);
    }
    tighten_timers();
    let awake = (facts.fifo == 1).then(forbid_deep_sleep).and_then(Result::ok);
    Realtime { facts, _awake: awake }
}

fn take_priority(priority: i32, facts: &mut RealtimeFacts) {
    facts.asked_priority = priority.unsigned_abs();
    match set_fifo(priority) {
        Ok(()) => {
            facts.fifo = 1;
            facts.priority = facts.asked_priority;
        }
        Err(error) => {
            facts.refused |= refused::PRIORITY;
            facts.priority_error = number_of(&error);
        }
    }
}

fn pin(core: usize, facts: &mut RealtimeFacts) {
    // Numbers beyond the mask's size would make it panic.
    let possible = core < libc::CPU_SETSIZE as usize;
    if possible && core_affinity::set_for_current(CoreId { id: core }) {
        facts.core = core as i32;
    } else {
        facts.refused |= refused::CORE;
        facts.asked_core = u32::try_from(core).unwrap_or(u32::MAX);
        facts.last_core = last_core() as u32;
    }
}

/// The operating system's number of an error, as the facts carry it.
fn number_of(error: &io::Error) -> u32 {
    error.raw_os_error().map_or(0, i32::unsigned_abs)
}

/// SCHED_FIFO for the calling thread; threads and processes that it starts are ordinary again.
pub(crate) fn set_fifo(priority: i32) -> io::Result<()> {
    let parameters = libc::sched_param { sched_priority: priority };
    let policy = libc::SCHED_FIFO | libc::SCHED_RESET_ON_FORK;
    // SAFETY: pid 0 is the calling thread; `parameters` is valid and only read.
    #[allow(unsafe_code)]
    match unsafe { libc::sched_setscheduler(0, policy, &parameters) } {
        -1 => Err(io::Error::last_os_error()),
        _ => Ok(()),
    }
}

/// Locks the memory, unless the limit says that a later allocation would be refused for it.
fn lock_memory(facts: &mut RealtimeFacts) {
    let mut limit = libc::rlimit { rlim_cur: 0, rlim_max: 0 };
    // SAFETY: `limit` is a valid rlimit for the kernel to fill.
    #[allow(unsafe_code)]
    let known = unsafe { libc::getrlimit(libc::RLIMIT_MEMLOCK, &mut limit) } == 0;
    let needed = virtual_memory() + HEADROOM;
    let unlimited = limit.rlim_cur == libc::RLIM_INFINITY || capable(CAP_IPC_LOCK);
    let error = if known && !unlimited && limit.rlim_cur < needed {
        0
    } else {
        // SAFETY: mlockall takes only flags.
        #[allow(unsafe_code)]
        match unsafe { libc::mlockall(libc::MCL_CURRENT | libc::MCL_FUTURE) } {
            0 => {
                facts.locked = 1;
                return;
            }
            _ => number_of(&io::Error::last_os_error()),
        }
    };
    facts.refused |= refused::MEMORY;
    facts.memory_error = error;
    facts.memory_limit = limit.rlim_cur;
    facts.memory_needed = needed;
}

/// The address space of this process in bytes, which is what the lock limit is compared with.
fn virtual_memory() -> u64 {
    let pages = std::fs::read_to_string("/proc/self/statm")
        .ok()
        .and_then(|text| text.split_whitespace().next()?.parse::<u64>().ok());
    // SAFETY: sysconf takes a constant and has no other preconditions.
    #[allow(unsafe_code)]
    let page = unsafe { libc::sysconf(libc::_SC_PAGESIZE) };
    pages.unwrap_or(0) * page.max(4096) as u64
}

/// Whether the process has an effective capability.
fn capable(capability: u32) -> bool {
    std::fs::read_to_string("/proc/self/status")
        .ok()
        .and_then(|text| {
            let line = text.lines().find_map(|line| line.strip_prefix("CapEff:"))?;
            u64::from_str_radix(line.trim(), 16).ok()
        })
        .is_some_and(|bits| bits >> capability & 1 == 1)
}

/// Keeps freed memory in the process, so that a block once used is there without a page fault.
fn keep_heap() {
    #[cfg(target_env = "gnu")]
    {
        // SAFETY: mallopt takes two numbers.
        #[allow(unsafe_code)]
        unsafe {
            libc::mallopt(libc::M_MMAP_MAX, 0);
            libc::mallopt(libc::M_TRIM_THRESHOLD, -1);
        }
    }
}

#[inline(never)]
fn touch_stack() {
    let mut stack = [0u8; STACK];
    for byte in stack.iter_mut().step_by(4096) {
        *byte = 1;
    }
    std::hint::black_box(&stack);
}

/// Without it an ordinary thread's sleeps end up to 50 µs late on purpose; timers(7).
fn tighten_timers() {
    // SAFETY: PR_SET_TIMERSLACK takes one number and concerns the calling thread only.
    #[allow(unsafe_code)]
    unsafe {
        libc::prctl(libc::PR_SET_TIMERSLACK, 1)
    };
}

/// Asks for a wake-up latency of 0 µs as long as the file is open; Linux PM QoS.
fn forbid_deep_sleep() -> io::Result<File> {
    let mut file = File::options().write(true).open("/dev/cpu_dma_latency")?;
    file.write_all(&0i32.to_ne_bytes())?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    fn entered(options: RealtimeOptions) -> Realtime {
        std::thread::spawn(move || enter_realtime(&options)).join().unwrap()
    }

    #[test]
    fn a_thread_that_asks_for_nothing_is_refused_nothing() {
        let placement = Placement::Automatic;
        let mut realtime =
            entered(RealtimeOptions { priority: None, placement, lock_memory: false });
        assert_eq!(realtime.facts, RealtimeFacts { core: -1, ..RealtimeFacts::default() });
        assert!(realtime.claim_core().unwrap().is_none());
        assert_eq!(realtime.spin_margin(), Nanoseconds(0));
    }

    #[test]
    fn what_is_asked_for_is_got_or_refused_with_a_reason() {
        let priority = Some(CONTROLLER_PRIORITY);
        let placement = Placement::Core(last_core());
        let facts = entered(RealtimeOptions { priority, placement, lock_memory: false }).facts;
        assert_eq!(facts.core, last_core() as i32);
        assert_eq!((facts.asked_priority, facts.priority), (80, 80 * facts.fifo));
        assert_eq!(facts.refused, refused::PRIORITY * (1 - facts.fifo));
        assert_eq!(facts.priority_error == 0, facts.fifo == 1);
    }

    #[test]
    fn a_cpu_that_does_not_exist_is_refused() {
        let placement = Placement::Core(100_000);
        let facts =
            entered(RealtimeOptions { priority: None, placement, lock_memory: false }).facts;
        assert_eq!((facts.core, facts.refused), (-1, refused::CORE));
        assert_eq!((facts.asked_core, facts.last_core), (100_000, last_core() as u32));
    }
}
