//! A child process that is given so much time and memory, for work on what strangers send.

use crate::descriptors;
use std::io::{self, Read};
use std::os::unix::process::{CommandExt, ExitStatusExt};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// How often the end of the child is looked for.
const LOOK_PERIOD: Duration = Duration::from_millis(5);

/// How much less of the processor it gets than those that move a machine.
const NICENESS: libc::c_int = 10;

/// What a child may use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bounds {
    /// From its start to its end.
    pub time: Duration,
    /// Address space, in bytes.
    pub memory: u64,
    /// Standard output, and as much standard error, in bytes.
    pub output: usize,
}

/// What a child that ended by itself left.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BoundedOutput {
    /// How it ended.
    pub status: ExitStatus,
    /// What it wrote on standard output.
    pub output: Vec<u8>,
    /// What it wrote on standard error.
    pub error: Vec<u8>,
}

/// Why there is no output.
#[derive(Debug, thiserror::Error)]
pub enum BoundedError {
    /// It could not be started or waited for.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// It took longer than it may, and was killed.
    #[error("it took longer than {} s", .0.as_secs_f64())]
    TooLong(Duration),
    /// Nobody waits for it any more, and it was killed.
    #[error("it was given up")]
    Abandoned,
    /// It wrote more than it may.
    #[error("it wrote more than {0} bytes")]
    TooMuch(usize),
    /// The kernel ended it, for want of memory as a rule.
    #[error("it was ended by signal {signal}; it may use {memory} bytes of memory")]
    Killed {
        /// The signal.
        signal: i32,
        /// What it may use.
        memory: u64,
    },
}

/// Runs `command` to its end, within these bounds, unless `is_abandoned` says that nobody waits. The child dies
/// with the thread that called this, and keeps nothing open of this process.
///
/// # Errors
/// A command that cannot be started, and one that broke a bound.
pub fn run(
    mut command: Command,
    bounds: &Bounds,
    is_abandoned: &dyn Fn() -> bool,
) -> Result<BoundedOutput, BoundedError> {
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let memory = bounds.memory;
    let confine = move || confine(memory);
    // SAFETY: the closure makes system calls on numbers only, all of them async-signal-safe.
    #[allow(unsafe_code)]
    unsafe {
        command.pre_exec(confine)
    };
    let mut child = Ended(command.spawn()?);
    let output = reader(child.0.stdout.take(), bounds.output)?;
    let error = reader(child.0.stderr.take(), bounds.output)?;
    let started = Instant::now();
    let status = loop {
        if let Some(status) = child.0.try_wait()? {
            break status;
        }
        if started.elapsed() > bounds.time {
            return Err(BoundedError::TooLong(bounds.time));
        }
        // A full pipe keeps it from its end.
        if output.is_finished() && error.is_finished() {
            break child.0.wait()?;
        }
        if is_abandoned() {
            return Err(BoundedError::Abandoned);
        }
        std::thread::sleep(LOOK_PERIOD);
    };
    let (output, error) = (read(output)?, read(error)?);
    if let Some(signal) = status.signal() {
        return Err(BoundedError::Killed { signal, memory });
    }
    if output.len() > bounds.output {
        return Err(BoundedError::TooMuch(bounds.output));
    }
    Ok(BoundedOutput { status, output, error })
}

/// A child that does not outlive this value.
struct Ended(Child);

impl Drop for Ended {
    fn drop(&mut self) {
        // One that has ended already is told nothing.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// In the child, before it becomes another program.
fn confine(memory: u64) -> io::Result<()> {
    let limit = |bytes: u64| libc::rlimit { rlim_cur: bytes, rlim_max: bytes };
    descriptors::close_on_exec();
    // SAFETY: system calls on numbers and on limits that live as long as the call.
    #[allow(unsafe_code)]
    unsafe {
        libc::prctl(libc::PR_SET_PDEATHSIG, libc::SIGKILL);
        libc::setpriority(libc::PRIO_PROCESS, 0, NICENESS);
        if libc::setrlimit(libc::RLIMIT_CORE, &limit(0)) != 0
            || libc::setrlimit(libc::RLIMIT_AS, &limit(memory)) != 0
        {
            return Err(io::Error::last_os_error());
        }
    }
    Ok(())
}

/// Reads one byte more than `most` at most: then the child waits, or is told by its next write that nobody reads.
fn reader<R: Read + Send + 'static>(
    pipe: Option<R>,
    most: usize,
) -> io::Result<JoinHandle<io::Result<Vec<u8>>>> {
    std::thread::Builder::new().name("bounded".into()).spawn(move || {
        let mut bytes = Vec::new();
        if let Some(pipe) = pipe {
            pipe.take(most as u64 + 1).read_to_end(&mut bytes)?;
        }
        Ok(bytes)
    })
}

fn read(reader: JoinHandle<io::Result<Vec<u8>>>) -> io::Result<Vec<u8>> {
    reader.join().unwrap_or_else(|_| Err(io::Error::other("the reading thread panicked")))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    const BOUNDS: Bounds =
        Bounds { time: Duration::from_secs(60), memory: 1 << 30, output: 1 << 16 };

    fn shell(script: &str) -> Command {
        let mut command = Command::new("/bin/sh");
        command.args(["-c", script]);
        command
    }

    fn run(script: &str, bounds: &Bounds) -> Result<BoundedOutput, BoundedError> {
        super::run(shell(script), bounds, &|| false)
    }

    #[test]
    fn what_ends_by_itself_leaves_its_output_and_its_code() {
        let left = run("echo out; echo err >&2; exit 3", &BOUNDS).unwrap();
        assert_eq!(left.status.code(), Some(3));
        assert_eq!((left.output.as_slice(), left.error.as_slice()), (&b"out\n"[..], &b"err\n"[..]));
    }

    #[test]
    fn what_takes_too_long_or_is_not_waited_for_is_killed() {
        let short = Bounds { time: Duration::from_millis(50), ..BOUNDS };
        let error = run("exec sleep 1000", &short).unwrap_err();
        assert!(matches!(error, BoundedError::TooLong(_)), "{error}");
        let error = super::run(shell("exec sleep 1000"), &BOUNDS, &|| true).unwrap_err();
        assert!(matches!(error, BoundedError::Abandoned), "{error}");
    }

    #[test]
    fn what_writes_without_end_is_ended() {
        let error = run("exec yes", &BOUNDS).unwrap_err();
        let is_ended = matches!(error, BoundedError::Killed { .. } | BoundedError::TooMuch(_));
        assert!(is_ended, "{error}");
    }

    #[test]
    fn what_takes_more_memory_than_it_may_does_not_get_it() {
        // dd takes a buffer of the size of a block.
        let script = "dd if=/dev/zero of=/dev/null bs=2G count=1";
        let left = run(script, &BOUNDS).unwrap();
        assert!(!left.status.success(), "{left:?}");
        let left = run(script, &Bounds { memory: 8 << 30, ..BOUNDS }).unwrap();
        assert!(left.status.success(), "{left:?}");
    }

    #[test]
    fn it_keeps_nothing_open_of_this_process() {
        let file = std::fs::File::open("/dev/null").unwrap();
        // SAFETY: the descriptor is open as long as `file`; only its flag is changed.
        #[allow(unsafe_code)]
        unsafe {
            libc::fcntl(std::os::fd::AsRawFd::as_raw_fd(&file), libc::F_SETFD, 0)
        };
        let left = run("ls /proc/self/fd", &BOUNDS).unwrap();
        let listed = String::from_utf8(left.output).unwrap();
        // 3 is the folder that ls reads.
        assert_eq!(listed.split_whitespace().collect::<Vec<_>>(), ["0", "1", "2", "3"]);
    }
}
