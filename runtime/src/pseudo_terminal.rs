//! A pseudo terminal in the place of a serial port; pty(7).
//!
//! Software that speaks to a serial port opens a link that leads to it. Whoever has it open is at the other end; when the
//! last one closes it, the connection has ended.

use std::ffi::CStr;
use std::fs::{self, File};
use std::io::{self, Read, Write};
use std::os::fd::{AsRawFd, FromRawFd};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// How long a read waits at most before it says that it was interrupted.
const READ_PATIENCE: Duration = Duration::from_millis(200);

/// A terminal of our own. Dropping it removes its link.
#[derive(Debug)]
pub struct PseudoTerminal {
    ours: File,
    /// What the link leads to.
    device: PathBuf,
    link: PathBuf,
}

/// Our end of a terminal that somebody has open.
#[derive(Debug)]
pub struct TerminalEnd(File);

impl PseudoTerminal {
    /// Makes a terminal, raw, for this user, and a link to it at `link`; one that is there already is replaced.
    ///
    /// # Errors
    /// No terminal, or something at `link` that is no link.
    pub fn open(link: &Path) -> io::Result<Self> {
        let ours = make()?;
        let device = device(&ours)?;
        make_raw(&device)?;
        match fs::symlink_metadata(link) {
            Ok(found) if !found.file_type().is_symlink() => {
                let message =
                    format!("{} is there and is no link: name another path", link.display());
                return Err(io::Error::new(io::ErrorKind::AlreadyExists, message));
            }
            Ok(_) => fs::remove_file(link)?,
            Err(_) => {}
        }
        std::os::unix::fs::symlink(&device, link).map_err(|error| {
            io::Error::new(error.kind(), format!("{}: {error}", link.display()))
        })?;
        Ok(Self { ours, device, link: link.to_owned() })
    }

    /// Whether somebody has it open; waits at most `patience` if nobody has.
    pub fn is_opened(&self, patience: Duration) -> bool {
        let is_opened = events(&self.ours, Duration::ZERO) & libc::POLLHUP == 0;
        if !is_opened {
            std::thread::sleep(patience);
        }
        is_opened
    }

    /// Our end of it.
    ///
    /// # Errors
    /// No file descriptor left.
    pub fn end(&self) -> io::Result<TerminalEnd> {
        self.ours.try_clone().map(TerminalEnd)
    }
}

impl Drop for PseudoTerminal {
    fn drop(&mut self) {
        if fs::read_link(&self.link).is_ok_and(|device| device == self.device) {
            // A link that cannot be removed leads nowhere.
            let _ = fs::remove_file(&self.link);
        }
    }
}

impl Read for TerminalEnd {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let events = events(&self.0, READ_PATIENCE);
        if events & libc::POLLIN != 0 {
            return self.0.read(into);
        }
        if events & libc::POLLHUP != 0 { Ok(0) } else { Err(io::ErrorKind::Interrupted.into()) }
    }
}

impl Write for TerminalEnd {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.0.flush()
    }
}

/// What there is to say of `file` within `patience`; poll(2).
fn events(file: &File, patience: Duration) -> i16 {
    let mut entry = libc::pollfd { fd: file.as_raw_fd(), events: libc::POLLIN, revents: 0 };
    let milliseconds = i32::try_from(patience.as_millis()).unwrap_or(i32::MAX);
    // SAFETY: one valid pollfd whose descriptor `file` owns.
    #[allow(unsafe_code)]
    unsafe {
        libc::poll(&mut entry, 1, milliseconds);
    }
    entry.revents
}

fn make() -> io::Result<File> {
    let flags = libc::O_RDWR | libc::O_NOCTTY | libc::O_CLOEXEC;
    // SAFETY: no preconditions; a descriptor that is not negative is open and nobody else's.
    #[allow(unsafe_code)]
    let ours = unsafe {
        let descriptor = libc::posix_openpt(flags);
        if descriptor < 0 {
            return Err(io::Error::last_os_error());
        }
        File::from_raw_fd(descriptor)
    };
    // SAFETY: the descriptor is one of a terminal that `ours` owns.
    #[allow(unsafe_code)]
    let unlocked =
        unsafe { libc::grantpt(ours.as_raw_fd()) == 0 && libc::unlockpt(ours.as_raw_fd()) == 0 };
    if unlocked { Ok(ours) } else { Err(io::Error::last_os_error()) }
}

/// The path of its other end.
fn device(ours: &File) -> io::Result<PathBuf> {
    let mut name = [0; 64];
    // SAFETY: `name` has the length that is told.
    #[allow(unsafe_code)]
    let error = unsafe { libc::ptsname_r(ours.as_raw_fd(), name.as_mut_ptr(), name.len()) };
    if error != 0 {
        return Err(io::Error::from_raw_os_error(error));
    }
    // SAFETY: ptsname_r has ended the name with a zero within `name`.
    #[allow(unsafe_code)]
    let name = unsafe { CStr::from_ptr(name.as_ptr()) };
    Ok(PathBuf::from(name.to_string_lossy().into_owned()))
}

/// Lets every byte through as it is, without echo.
fn make_raw(device: &Path) -> io::Result<()> {
    use std::os::unix::fs::OpenOptionsExt;
    let theirs =
        File::options().read(true).write(true).custom_flags(libc::O_NOCTTY).open(device)?;
    // SAFETY: a termios is numbers only, for which zero is a value.
    #[allow(unsafe_code)]
    let mut settings: libc::termios = unsafe { std::mem::zeroed() };
    // SAFETY: the descriptor is open, `settings` is a termios for the kernel to fill and to read.
    #[allow(unsafe_code)]
    let done = unsafe {
        let read = libc::tcgetattr(theirs.as_raw_fd(), &mut settings);
        libc::cfmakeraw(&mut settings);
        read == 0 && libc::tcsetattr(theirs.as_raw_fd(), libc::TCSANOW, &settings) == 0
    };
    if done { Ok(()) } else { Err(io::Error::last_os_error()) }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    const SOON: Duration = Duration::from_millis(1);

    fn open(link: &Path) -> File {
        use std::os::unix::fs::OpenOptionsExt;
        File::options().read(true).write(true).custom_flags(libc::O_NOCTTY).open(link).unwrap()
    }

    #[test]
    fn bytes_go_both_ways_as_they_are_and_the_end_is_seen() {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("port");
        let terminal = PseudoTerminal::open(&link).unwrap();
        assert!(!terminal.is_opened(SOON));
        for _ in 0..2 {
            let mut theirs = open(&link);
            assert!(terminal.is_opened(SOON));
            let (mut reader, mut writer) = (terminal.end().unwrap(), terminal.end().unwrap());
            let sent = b"?\n\r\x18\x85$$\x04";
            theirs.write_all(sent).unwrap();
            let mut read = [0; 32];
            let length = reader.read(&mut read).unwrap();
            assert_eq!(&read[..length], sent);
            writer.write_all(b"ok\r\n").unwrap();
            let length = theirs.read(&mut read).unwrap();
            assert_eq!(&read[..length], b"ok\r\n", "without echo");
            assert_eq!(reader.read(&mut read).unwrap_err().kind(), io::ErrorKind::Interrupted);
            drop(theirs);
            assert_eq!(reader.read(&mut read).unwrap(), 0);
            assert!(!terminal.is_opened(SOON));
        }
        drop(terminal);
        assert!(fs::symlink_metadata(&link).is_err());
    }

    #[test]
    fn a_link_is_replaced_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("port");
        std::os::unix::fs::symlink("/nowhere", &link).unwrap();
        drop(PseudoTerminal::open(&link).unwrap());
        fs::write(&link, "mine").unwrap();
        assert!(PseudoTerminal::open(&link).unwrap_err().to_string().contains("is no link"));
        assert_eq!(fs::read_to_string(&link).unwrap(), "mine");
    }
}
