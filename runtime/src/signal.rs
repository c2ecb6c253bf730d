//! Requests to end as a flag that loops poll: Ctrl-C, SIGTERM, and SIGHUP, which a closed
//! terminal sends. Also when the process was last stopped and continued.
//!
//! SIGPIPE stays ignored, as Rust's runtime leaves it: a reader that goes away is an error of the
//! write.
//!
//! SIGBUS is what a full /dev/shm raises where a page of shared memory is touched for the first
//! time. Ports have all their pages before they are used ([`crate::room`]); it can only strike who
//! is opening one while somebody else takes the memory under its hands. That process ends, after a
//! word about the cause; nobody has connected to it yet. Going on with a page of zeros instead would
//! not be sound: iceoryx2 0.10 follows pointers that lie in those pages.

use std::io;
use std::sync::atomic::{AtomicI32, AtomicI64, AtomicU32, Ordering};

use messages::Nanoseconds;

use crate::clock;

static COUNT: AtomicU32 = AtomicU32::new(0);
static LAST: AtomicI32 = AtomicI32::new(0);
static CONTINUED: AtomicI64 = AtomicI64::new(i64::MIN);

/// A request to end that came as a signal.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Termination {
    /// The newest signal: `SIGINT`, `SIGTERM` or `SIGHUP`.
    pub signal: i32,
    /// How many came so far; a second Ctrl-C means that the person is in a hurry.
    pub count: u32,
}

impl Termination {
    /// Whether it came because the terminal was closed.
    pub fn is_closed_terminal(&self) -> bool {
        self.signal == libc::SIGHUP
    }
}

extern "C" fn note(signal: libc::c_int) {
    // A terminal that closes sends it twice, and the second says nothing more.
    if signal == libc::SIGHUP && COUNT.load(Ordering::Relaxed) > 0 {
        return;
    }
    LAST.store(signal, Ordering::Relaxed);
    COUNT.fetch_add(1, Ordering::Release);
}

extern "C" fn note_continued(_: libc::c_int) {
    CONTINUED.store(clock::now().0, Ordering::Release);
}

/// Makes SIGINT, SIGTERM and SIGHUP set the flag instead of ending the process, and notes SIGCONT.
/// System calls that wait come back with `EINTR`, so that loops check the flag at once. A SIGHUP
/// that is ignored already, as under `nohup` and after [`outlive_terminal`], stays ignored. SIGBUS ends the process still, but says
/// why.
///
/// # Errors
/// Names the signal whose handler the operating system refused.
pub fn install() -> io::Result<()> {
    for signal in [libc::SIGINT, libc::SIGTERM, libc::SIGHUP] {
        let before = exchange(signal, None).map_err(|source| refused(signal, &source))?;
        if signal == libc::SIGHUP && before.sa_sigaction == libc::SIG_IGN {
            continue;
        }
        handle(signal, note)?;
    }
    handle(libc::SIGCONT, note_continued)?;
    handle(libc::SIGBUS, explain)
}

/// Lets a terminal that closes be nothing to this process, nor to those that it starts from now on: SIGHUP is ignored.
/// Call it before [`install`]. For what must not be lost with a window, such as a job that is marked.
///
/// # Errors
/// What the operating system says.
pub fn outlive_terminal() -> io::Result<()> {
    // SAFETY: all zeros is a valid sigaction (no flags, empty mask), completed below.
    #[allow(unsafe_code)]
    let mut action: libc::sigaction = unsafe { std::mem::zeroed() };
    action.sa_sigaction = libc::SIG_IGN;
    exchange(libc::SIGHUP, Some(&action)).map(drop).map_err(|source| refused(libc::SIGHUP, &source))
}

fn handle(signal: libc::c_int, handler: extern "C" fn(libc::c_int)) -> io::Result<()> {
    // SAFETY: all zeros is a valid sigaction (no flags, empty mask), completed below.
    #[allow(unsafe_code)]
    let mut action: libc::sigaction = unsafe { std::mem::zeroed() };
    action.sa_sigaction = handler as libc::sighandler_t;
    exchange(signal, Some(&action)).map(drop).map_err(|source| refused(signal, &source))
}

extern "C" fn explain(signal: libc::c_int) {
    const CAUSE: &[u8] = b"graver: the operating system had no page of memory to give (SIGBUS): \
                           /dev/shm is full; see `df /dev/shm`\n";
    // SAFETY: write, signal and raise are async-signal-safe. With the default action back, the
    // raised signal ends the process when this handler returns.
    #[allow(unsafe_code)]
    unsafe {
        libc::write(libc::STDERR_FILENO, CAUSE.as_ptr().cast(), CAUSE.len());
        libc::signal(signal, libc::SIG_DFL);
        libc::raise(signal);
    }
}

/// Sets the action of a signal, if one is given, and tells the one before. Handlers given here
/// must be async-signal-safe.
fn exchange(signal: libc::c_int, action: Option<&libc::sigaction>) -> io::Result<libc::sigaction> {
    let new = action.map_or(std::ptr::null(), std::ptr::from_ref);
    // SAFETY: all zeros is a valid sigaction, which the kernel overwrites.
    #[allow(unsafe_code)]
    let mut before: libc::sigaction = unsafe { std::mem::zeroed() };
    // SAFETY: both actions are valid or null; a new handler is async-signal-safe, see above.
    #[allow(unsafe_code)]
    match unsafe { libc::sigaction(signal, new, &mut before) } {
        0 => Ok(before),
        _ => Err(io::Error::last_os_error()),
    }
}

fn refused(signal: libc::c_int, source: &io::Error) -> io::Error {
    io::Error::new(source.kind(), format!("signal {signal} cannot be handled: {source}"))
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
