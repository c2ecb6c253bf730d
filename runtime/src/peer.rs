//! Whether another process is alive, asked of the kernel and answered at once.
//!
//! A pidfd becomes readable when its process ends. Looking takes one system call and no
//! allocation, so a death is known in the next cycle without heartbeats. A stopped process counts
//! as alive: that is for the age of its samples to tell.

use std::io;
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use crossbeam::queue::ArrayQueue;
use messages::Nanoseconds;

use crate::clock;
use crate::domain::{Domain, Role};
use crate::instance::Instance;
use crate::membership;
use crate::service::ServiceError;

/// A year: longer than anybody waits [ns].
const LONG: i64 = 31_536_000_000_000_000;

/// How often the searching thread of [`Peers`] checks for a peer that is missing.
const SEARCH_PERIOD: Duration = Duration::from_millis(20);

/// A handle on one process.
#[derive(Debug)]
pub struct Peer {
    pid: i32,
    descriptor: OwnedFd,
}

impl Peer {
    /// The process with this pid.
    ///
    /// # Errors
    /// `ESRCH` without such a process.
    pub fn open(pid: i32) -> io::Result<Self> {
        // SAFETY: pidfd_open takes a number and flags, and gives a new descriptor or −1.
        #[allow(unsafe_code)]
        let descriptor = unsafe { libc::syscall(libc::SYS_pidfd_open, pid, 0) };
        if descriptor < 0 {
            return Err(io::Error::last_os_error());
        }
        // SAFETY: the kernel just gave this descriptor to us alone; it is close-on-exec.
        #[allow(unsafe_code)]
        let descriptor = unsafe { OwnedFd::from_raw_fd(descriptor as i32) };
        Ok(Self { pid, descriptor })
    }

    /// The living process with this role in an instance.
    pub(crate) fn find(instance: &Instance, role: Role) -> Option<Self> {
        let pid = membership::member_pid(instance, role)?;
        let peer = Self::open(pid).ok()?;
        // The number could have been given to another process before the descriptor was open.
        (membership::member_pid(instance, role) == Some(pid)).then_some(peer)
    }

    /// Its process id.
    pub fn pid(&self) -> i32 {
        self.pid
    }

    /// Whether it runs; an ended process is not alive even before it is reaped. Neither waits nor
    /// allocates.
    pub fn is_alive(&self) -> bool {
        !self.ended_within(Duration::ZERO)
    }

    /// Whether somebody has stopped it, by SIGSTOP or a debugger; `false` where that cannot be told.
    /// Reads a file: not for a cycle.
    pub fn is_stopped(&self) -> bool {
        let Ok(status) = std::fs::read_to_string(format!("/proc/{}/stat", self.pid)) else {
            return false;
        };
        // The name before it may have any characters, brackets too; proc_pid_stat(5).
        let state = status.rsplit(')').next().and_then(|rest| rest.split_whitespace().next());
        matches!(state, Some("T" | "t"))
    }

    /// Waits at most `patience` for its end, signals or not; whether it has ended.
    pub fn ended_within(&self, patience: Duration) -> bool {
        let until = clock::now() + Nanoseconds(i64::try_from(patience.as_nanos()).unwrap_or(LONG));
        let mut left = patience;
        loop {
            let mut entry =
                libc::pollfd { fd: self.descriptor.as_raw_fd(), events: libc::POLLIN, revents: 0 };
            let milliseconds = i32::try_from(left.as_millis()).unwrap_or(i32::MAX);
            // SAFETY: one valid pollfd whose descriptor `self` owns.
            #[allow(unsafe_code)]
            let ready = unsafe { libc::poll(&mut entry, 1, milliseconds) };
            let nanoseconds = (until - clock::now()).0;
            if ready >= 0 || nanoseconds <= 0 {
                return ready > 0;
            }
            left = Duration::from_nanos(nanoseconds.unsigned_abs());
        }
    }

    /// Sends it a signal; a process that has ended is not an error.
    pub fn signal(&self, number: i32) -> io::Result<()> {
        // SAFETY: pidfd_send_signal takes the descriptor that `self` owns, a number, no siginfo
        // and no flags.
        #[allow(unsafe_code)]
        let result = unsafe {
            libc::syscall(
                libc::SYS_pidfd_send_signal,
                self.descriptor.as_raw_fd(),
                number,
                std::ptr::null::<libc::siginfo_t>(),
                0,
            )
        };
        match io::Error::last_os_error() {
            _ if result == 0 => Ok(()),
            error if error.raw_os_error() == Some(libc::ESRCH) => Ok(()),
            error => Err(error),
        }
    }
}

/// What a cycle knows about a peer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PeerState {
    /// It has not been seen yet.
    Unknown,
    /// It runs.
    Alive,
    /// It was there and has ended, and no successor has come.
    Dead,
}

struct Watched {
    role: Role,
    peer: Option<Peer>,
    found: Arc<ArrayQueue<Peer>>,
    missing: Arc<AtomicBool>,
}

/// The peers that a cycle watches. A thread that is not real-time searches for those that are
/// missing, so successors of dead ones are found too.
pub struct Peers {
    watched: Vec<Watched>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Peers {
    /// Starts watching the processes with these roles in the domain. Call it before the thread
    /// becomes real-time.
    ///
    /// # Errors
    /// [`ServiceError::Thread`] when the searching thread could not be started.
    pub fn watch(domain: &Domain, roles: &[Role]) -> Result<Self, ServiceError> {
        let instance = domain.instance().clone();
        let stop = Arc::new(AtomicBool::new(false));
        let mut searches = Vec::new();
        let mut watched = Vec::new();
        for role in roles.iter().copied() {
            let found = Arc::new(ArrayQueue::new(1));
            let peer = Peer::find(&instance, role);
            let missing = Arc::new(AtomicBool::new(peer.is_none()));
            searches.push((role, found.clone(), missing.clone()));
            watched.push(Watched { role, peer, found, missing });
        }
        let stopped = stop.clone();
        let search = move || {
            while !stopped.load(Ordering::Relaxed) {
                for (role, found, missing) in &searches {
                    if missing.load(Ordering::Acquire)
                        && let Some(peer) = Peer::find(&instance, *role)
                    {
                        missing.store(false, Ordering::Release);
                        found.force_push(peer);
                    }
                }
                std::thread::park_timeout(SEARCH_PERIOD);
            }
        };
        let thread = std::thread::Builder::new()
            .name("peers".into())
            .spawn(search)
            .map_err(|source| ServiceError::thread("peers", source))?;
        Ok(Self { watched, stop, thread: Some(thread) })
    }

    /// How the peer with this role is now; one system call, no allocation. A role that is not
    /// watched is [`PeerState::Unknown`].
    pub fn state(&mut self, role: Role) -> PeerState {
        let Some(watched) = self.watched.iter_mut().find(|watched| watched.role == role) else {
            return PeerState::Unknown;
        };
        if let Some(peer) = watched.found.pop() {
            watched.peer = Some(peer);
        }
        match &watched.peer {
            None => PeerState::Unknown,
            Some(peer) if peer.is_alive() => PeerState::Alive,
            Some(_) => {
                watched.missing.store(true, Ordering::Release);
                PeerState::Dead
            }
        }
    }
}

impl Drop for Peers {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.thread().unpark();
            let _ = thread.join();
        }
    }
}

impl std::fmt::Debug for Peers {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.debug_list().entries(self.watched.iter().map(|watched| watched.role)).finish()
    }
}
