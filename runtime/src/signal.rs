//! Ctrl-C and SIGTERM as a flag that loops look at, and when the process was last stopped and
//! continued.

use std::io;
use std::sync::atomic::{AtomicI32, AtomicI64, AtomicU32, Ordering};

use signals::Nanoseconds;

use crate::clock;

static COUNT: AtomicU32 = AtomicU32::new(0);
static LAST: AtomicI32 = AtomicI32::new(0);
static CONTINUED: AtomicI64 = AtomicI64::new(i64::MIN);

/// A request to end that came as a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Termination {
    /// The newest signal, `SIGINT` or `SIGTERM`.
    pub signal: i32,
    /// How many came so far; a second Ctrl-C means that the person is in a hurry.
    pub count: u32,
}

extern "C" fn note(signal: libc::c_int) {
    LAST.store(signal, Ordering::Relaxed);
    COUNT.fetch_add(1, Ordering::Release);
}

extern "C" fn note_continued(_: libc::c_int) {
    CONTINUED.store(clock::now().0, Ordering::Release);
}

/// Makes SIGINT and SIGTERM set the flag instead of ending the process, and notes SIGCONT. System
/// calls that wait come back with `EINTR`, so that loops look at the flag at once.
pub fn install() -> io::Result<()> {
    handle(libc::SIGINT, note)?;
    handle(libc::SIGTERM, note)?;
    handle(libc::SIGCONT, note_continued)
}

fn handle(signal: libc::c_int, handler: extern "C" fn(libc::c_int)) -> io::Result<()> {
    // SAFETY: all zeros is a valid sigaction (no flags, empty mask), completed below.
    #[allow(unsafe_code)]
    let mut action: libc::sigaction = unsafe { std::mem::zeroed() };
    action.sa_sigaction = handler as libc::sighandler_t;
    // SAFETY: the handlers only read the clock and store to atomics, which is async-signal-safe;
    // the old action is not asked for.
    #[allow(unsafe_code)]
    if unsafe { libc::sigaction(signal, &action, std::ptr::null_mut()) } != 0 {
        return Err(io::Error::last_os_error());
    }
    Ok(())
}

/// When the process was last continued after it had been stopped (SIGSTOP, SIGTSTP), if it was.
pub fn continued() -> Option<Nanoseconds> {
    let at = CONTINUED.load(Ordering::Acquire);
    (at != i64::MIN).then_some(Nanoseconds(at))
}

/// The request to end, if one came.
pub fn termination() -> Option<Termination> {
    match COUNT.load(Ordering::Acquire) {
        0 => None,
        count => Some(Termination { signal: LAST.load(Ordering::Relaxed), count }),
    }
}
