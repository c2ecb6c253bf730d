//! Directories that nobody else can have put in our way.
//!
//! Names in /dev/shm are anybody's to take. A directory counts as ours only when it is a true
//! directory, no link, that belongs to us and that nobody else may enter: then nothing in it is
//! another user's doing.

use std::fs::{self, Permissions};
use std::io;
use std::os::unix::fs::{DirBuilderExt, MetadataExt, PermissionsExt};
use std::path::{Path, PathBuf};

use super::user;

/// Permission bits of everybody but the owner.
const OTHERS: u32 = 0o077;

/// Permission bits of the owner.
const OWNER: u32 = 0o700;

/// What stands at the place of a directory.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Place {
    /// Nothing.
    Free,
    /// A directory of our own that is closed to others.
    Ours,
    /// Something else, in words that go on after its name.
    Taken(String),
}

/// Looks at the place, following no link.
pub(crate) fn inspect(path: &Path) -> io::Result<Place> {
    let found = match fs::symlink_metadata(path) {
        Ok(found) => found,
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Place::Free),
        Err(error) => return Err(error),
    };
    let mode = found.mode() & 0o777;
    Ok(if !found.is_dir() {
        let kind = if found.is_symlink() { "a symbolic link" } else { "no directory" };
        Place::Taken(format!("is {kind}, made by user {}", found.uid()))
    } else if found.uid() != user() {
        Place::Taken(format!("belongs to user {}", found.uid()))
    } else if mode & OTHERS != 0 || mode & OWNER != OWNER {
        Place::Taken(format!("is yours, but its mode is {mode:03o} instead of 700"))
    } else {
        Place::Ours
    })
}

/// Creates a directory for us alone, whatever the process's mask takes away, and what is missing
/// above it. One that is there already is left as it is.
pub(crate) fn create_private(path: &Path) -> io::Result<()> {
    let mut created = fs::DirBuilder::new().mode(OWNER).create(path);
    if let (Err(error), Some(parent)) = (&created, path.parent())
        && error.kind() == io::ErrorKind::NotFound
    {
        fs::create_dir_all(parent)?;
        created = fs::DirBuilder::new().mode(OWNER).create(path);
    }
    match created {
        Ok(()) => fs::set_permissions(path, Permissions::from_mode(OWNER)),
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists => Ok(()),
        Err(error) => Err(error),
    }
}

/// A name that was passed over, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct PassedOver {
    pub(crate) path: PathBuf,
    pub(crate) what: String,
}

impl std::fmt::Display for PassedOver {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{:?} {}", self.path, self.what)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    /// A directory of this test's own, removed at its end.
    struct Scratch(PathBuf);

    impl Scratch {
        fn new(name: &str) -> Self {
            let path = std::env::temp_dir().join(format!("graver-{name}-{}", std::process::id()));
            fs::create_dir(&path).unwrap();
            Self(path)
        }
    }

    impl Drop for Scratch {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn only_a_true_directory_of_our_own_that_is_closed_counts_as_ours() {
        let scratch = Scratch::new("look");
        let at = |name: &str| scratch.0.join(name);
        assert_eq!(inspect(&at("none")).unwrap(), Place::Free);
        create_private(&at("ours")).unwrap();
        assert_eq!(inspect(&at("ours")).unwrap(), Place::Ours);

        let taken = |what: &str| Place::Taken(what.into());
        std::os::unix::fs::symlink(at("ours"), at("link")).unwrap();
        let link = format!("is a symbolic link, made by user {}", user());
        assert_eq!(inspect(&at("link")).unwrap(), taken(&link));
        fs::write(at("file"), "").unwrap();
        let file = format!("is no directory, made by user {}", user());
        assert_eq!(inspect(&at("file")).unwrap(), taken(&file));
        fs::set_permissions(at("ours"), Permissions::from_mode(0o750)).unwrap();
        let open = "is yours, but its mode is 750 instead of 700";
        assert_eq!(inspect(&at("ours")).unwrap(), taken(open));
    }

    #[test]
    fn what_is_missing_above_is_made_and_what_is_there_is_kept() {
        let scratch = Scratch::new("create");
        let deep = scratch.0.join("a/b");
        create_private(&deep).unwrap();
        assert_eq!(inspect(&deep).unwrap(), Place::Ours);
        fs::set_permissions(&deep, Permissions::from_mode(0o711)).unwrap();
        create_private(&deep).unwrap();
        assert_eq!(fs::metadata(&deep).unwrap().mode() & 0o777, 0o711);
    }
}
