//! Files below a folder, opened so that no name leads out of it: for names that strangers wrote.

use std::ffi::CString;
use std::fs::File;
use std::io;
use std::os::fd::{AsRawFd, FromRawFd, OwnedFd};
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Component, Path};

/// What a name may be, for people.
pub const ALLOWED: &str =
    "only files below its own folder may be opened: no absolute path, no `..` and no symbolic link";

/// Opens the regular file `name` below `folder` for reading. The kernel resolves the name in one step, so nothing
/// can be exchanged between a look and the opening. Symbolic links in `folder` itself are followed.
///
/// # Errors
/// [`io::ErrorKind::PermissionDenied`] with [`ALLOWED`] where the name leads out of the folder or through a symbolic
/// link; [`io::ErrorKind::InvalidInput`] for what is no regular file; else what the operating system says. A kernel
/// before 5.6 refuses all.
pub fn open(folder: &Path, name: &Path) -> io::Result<File> {
    let is_plain = |part| matches!(part, Component::Normal(_) | Component::CurDir);
    if !name.components().all(is_plain) {
        return Err(not_allowed());
    }
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let folder = File::options().read(true).custom_flags(libc::O_DIRECTORY).open(folder)?;
    let name = CString::new(name.as_os_str().as_bytes())?;
    let file = open_beneath(&folder, &name).map_err(|error| match error.raw_os_error() {
        Some(libc::ELOOP | libc::EXDEV) => not_allowed(),
        _ => error,
    })?;
    if !file.metadata()?.is_file() {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "it is no regular file"));
    }
    Ok(file)
}

fn not_allowed() -> io::Error {
    io::Error::new(io::ErrorKind::PermissionDenied, ALLOWED)
}

fn open_beneath(folder: &File, name: &CString) -> io::Result<File> {
    // A pipe or a device must not make the opening wait.
    let flags = libc::O_RDONLY | libc::O_CLOEXEC | libc::O_NONBLOCK | libc::O_NOCTTY;
    let resolve = libc::RESOLVE_BENEATH | libc::RESOLVE_NO_SYMLINKS | libc::RESOLVE_NO_MAGICLINKS;
    // SAFETY: the structure is of integers only, for which zero is a value; folder, name and structure live as long
    // as the call, which reads the size that it is told; a descriptor that it gives belongs to nobody else.
    #[allow(unsafe_code)]
    unsafe {
        let mut how: libc::open_how = std::mem::zeroed();
        how.flags = flags as u64;
        how.resolve = resolve;
        let descriptor = libc::syscall(
            libc::SYS_openat2,
            folder.as_raw_fd(),
            name.as_ptr(),
            &raw const how,
            size_of::<libc::open_how>(),
        );
        match libc::c_int::try_from(descriptor) {
            Ok(descriptor) if descriptor >= 0 => Ok(File::from(OwnedFd::from_raw_fd(descriptor))),
            _ => Err(io::Error::last_os_error()),
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use std::fs;
    use std::io::Read;
    use std::os::unix::fs::symlink;

    #[test]
    fn what_lies_below_is_opened() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("inner")).unwrap();
        fs::write(folder.path().join("inner/a.svg"), "drawing").unwrap();
        // The way to the folder may lead through a link.
        let way = folder.path().join("inner/way");
        symlink(folder.path(), &way).unwrap();
        for (folder, name) in [(folder.path(), "inner/a.svg"), (&way, "./inner/a.svg")] {
            let mut text = String::new();
            open(folder, Path::new(name)).unwrap().read_to_string(&mut text).unwrap();
            assert_eq!(text, "drawing");
        }
    }

    #[test]
    fn no_name_leads_out() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("folder");
        fs::create_dir(&folder).unwrap();
        let secret = root.path().join("secret");
        fs::write(&secret, "secret").unwrap();
        fs::write(folder.join("own"), "own").unwrap();
        symlink(&secret, folder.join("link")).unwrap();
        symlink("own", folder.join("link_to_own")).unwrap();
        symlink(root.path(), folder.join("way")).unwrap();
        let absolute = [secret.display().to_string(), folder.join("own").display().to_string()];
        let others = ["../secret", "x/../../secret", "link", "link_to_own", "way/secret", ".."];
        for name in absolute.iter().map(String::as_str).chain(others) {
            let error = open(&folder, Path::new(name)).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::PermissionDenied, "{name}: {error}");
            assert!(error.to_string().contains("no symbolic link"), "{name}: {error}");
        }
        let error = open(&folder, Path::new("none")).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::NotFound);
    }

    #[test]
    fn what_is_no_file_is_not_opened_and_not_waited_for() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status().unwrap();
        assert!(made.success());
        for name in ["pipe", "."] {
            let error = open(folder.path(), Path::new(name)).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::InvalidInput, "{name}: {error}");
        }
    }
}
