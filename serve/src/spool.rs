//! The files that were uploaded: a folder of the server's user alone, bounded in number and size.
//!
//! Each file is in a folder of its own, named by a random number, under the name that it came with: jobs are named
//! by their file.

use crate::access::random;
use schemars::JsonSchema;
use serde::Serialize;
use std::fs::{self, File};
use std::io::{self, Write};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::UNIX_EPOCH;

/// The largest file [bytes].
pub const LARGEST: usize = 64 << 20;

/// All files together [bytes].
const ALL: u64 = 512 << 20;

/// How many files.
const MOST: usize = 200;

/// The longest name [characters].
const LONGEST_NAME: usize = 80;

/// Digits of an id.
const ID_DIGITS: usize = 16;

/// A file that was uploaded.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, JsonSchema)]
pub struct SpooledFile {
    /// What it is asked for by.
    pub id: String,
    /// The name that it came with.
    pub name: String,
    /// Its size [bytes].
    pub size: u64,
    /// When it came, in seconds since 1970.
    pub uploaded: u64,
}

/// Why a file is not taken, or not there.
#[derive(Debug, thiserror::Error)]
pub enum SpoolError {
    /// There is none by this id.
    #[error("there is no uploaded file {0:?}; /api/v1/jobs lists them")]
    Unknown(String),
    /// A name that is none.
    #[error(
        "the name {0:?} is not usable: letters, digits, spaces and . _ - + ( ), with an ending such as .svg"
    )]
    Name(String),
    /// Nothing in it.
    #[error("the file is empty")]
    Empty,
    /// There is no room.
    #[error(
        "{files} files with {mebibytes} MiB are uploaded already, and no more fit: delete some"
    )]
    Full {
        /// How many there are.
        files: usize,
        /// How large they are together.
        mebibytes: u64,
    },
    /// The folder.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the operating system says.
        source: io::Error,
    },
}

/// The folder.
#[derive(Debug)]
pub struct Spool {
    folder: PathBuf,
    /// One upload or removal at a time.
    turn: Mutex<()>,
}

impl Spool {
    /// The spool in this folder, which is made when the first file comes.
    pub fn new(folder: PathBuf) -> Self {
        Self { folder, turn: Mutex::new(()) }
    }

    /// The files, the newest first.
    pub fn files(&self) -> Vec<SpooledFile> {
        let entries = fs::read_dir(&self.folder).into_iter().flatten().flatten();
        let mut files: Vec<SpooledFile> =
            entries.filter_map(|entry| found(&entry.path()).map(|(_, file)| file)).collect();
        files.sort_by(|one, other| (other.uploaded, &one.name).cmp(&(one.uploaded, &other.name)));
        files
    }

    /// Takes a file.
    ///
    /// # Errors
    /// A name that is none, no room, a folder that cannot be written.
    pub fn add(&self, name: &str, content: &[u8]) -> Result<SpooledFile, SpoolError> {
        let name = clean(name).ok_or_else(|| SpoolError::Name(name.chars().take(200).collect()))?;
        if content.is_empty() {
            return Err(SpoolError::Empty);
        }
        let _turn = self.turn();
        let files = self.files();
        let size: u64 = files.iter().map(|file| file.size).sum();
        if files.len() >= MOST || size + content.len() as u64 > ALL {
            return Err(SpoolError::Full { files: files.len(), mebibytes: size >> 20 });
        }
        let mut id = random().map_err(|source| self.failed(&self.folder, source))?;
        id.truncate(ID_DIGITS);
        let folder = self.folder.join(&id);
        let path = folder.join(&name);
        let write = || -> io::Result<()> {
            fs::DirBuilder::new().recursive(true).mode(0o700).create(&folder)?;
            let mut file = File::options();
            file.write(true).create_new(true).mode(0o600).open(&path)?.write_all(content)
        };
        if let Err(source) = write() {
            // Half a file is no file.
            let _ = fs::remove_dir_all(&folder);
            return Err(self.failed(&path, source));
        }
        let file = found(&folder).map(|(_, file)| file);
        file.ok_or(SpoolError::Unknown(id))
    }

    /// Where the file with this id is.
    ///
    /// # Errors
    /// There is none.
    pub fn path(&self, id: &str) -> Result<PathBuf, SpoolError> {
        let unknown = || SpoolError::Unknown(id.chars().take(ID_DIGITS).collect());
        let is_id = id.len() == ID_DIGITS && id.bytes().all(|byte| byte.is_ascii_hexdigit());
        let found = is_id.then(|| found(&self.folder.join(id))).flatten();
        found.map(|(path, _)| path).ok_or_else(unknown)
    }

    /// Removes the file with this id.
    ///
    /// # Errors
    /// There is none, or it cannot be removed.
    pub fn remove(&self, id: &str) -> Result<(), SpoolError> {
        let _turn = self.turn();
        let path = self.path(id)?;
        let folder = path.parent().unwrap_or(&path);
        fs::remove_dir_all(folder).map_err(|source| self.failed(folder, source))
    }

    fn turn(&self) -> MutexGuard<'_, ()> {
        self.turn.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn failed(&self, path: &Path, source: io::Error) -> SpoolError {
        SpoolError::Io { path: path.to_owned(), source }
    }
}

/// The file in the folder of an id.
fn found(folder: &Path) -> Option<(PathBuf, SpooledFile)> {
    let id = folder.file_name()?.to_str()?.to_owned();
    let entry = fs::read_dir(folder).ok()?.flatten().next()?;
    let metadata = fs::symlink_metadata(entry.path()).ok().filter(fs::Metadata::is_file)?;
    let uploaded =
        metadata.modified().ok()?.duration_since(UNIX_EPOCH).unwrap_or_default().as_secs();
    let name = entry.file_name().to_str()?.to_owned();
    Some((entry.path(), SpooledFile { id, name, size: metadata.len(), uploaded }))
}

/// A name that is one file's, whatever the sender wrote: its last part, without what file systems and shells take
/// for something else.
fn clean(name: &str) -> Option<String> {
    let last = name.rsplit(['/', '\\']).next()?;
    let allowed = |it: &char| it.is_alphanumeric() || " ._-+()".contains(*it);
    let cleaned: String = last.chars().filter(allowed).collect();
    let cleaned = cleaned.trim().trim_start_matches(['.', '-', ' ']);
    let (stem, ending) = cleaned.rsplit_once('.')?;
    let is_ending =
        (1..=8).contains(&ending.len()) && ending.bytes().all(|it| it.is_ascii_alphanumeric());
    if !is_ending || stem.trim().is_empty() {
        return None;
    }
    let room = LONGEST_NAME - ending.len() - 1;
    let stem: String = stem.trim().chars().take(room).collect();
    // A file name has at most 255 bytes, a character up to four.
    (stem.len() <= 240).then(|| format!("{stem}.{ending}"))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use std::os::unix::fs::MetadataExt;

    #[test]
    fn a_file_is_kept_under_its_name_for_its_user_alone_until_it_is_removed() {
        let below = tempfile::tempdir().unwrap();
        let spool = Spool::new(below.path().join("state/spool"));
        assert_eq!(spool.files(), []);
        let file = spool.add("../../My part.svg", b"<svg/>").unwrap();
        assert_eq!((file.name.as_str(), file.size), ("My part.svg", 6));
        let path = spool.path(&file.id).unwrap();
        assert!(path.starts_with(below.path().join("state/spool")), "{path:?}");
        assert_eq!(fs::read(&path).unwrap(), b"<svg/>");
        assert_eq!(fs::metadata(&path).unwrap().mode() & 0o777, 0o600);
        assert_eq!(fs::metadata(path.parent().unwrap()).unwrap().mode() & 0o777, 0o700);
        assert_eq!(spool.files(), std::slice::from_ref(&file));
        spool.remove(&file.id).unwrap();
        assert!(matches!(spool.path(&file.id), Err(SpoolError::Unknown(_))));
    }

    #[test]
    fn names_are_cleaned_or_refused() {
        for (name, expect) in [
            ("a.svg", Some("a.svg")),
            ("C:\\work\\plate 3.lbrn2", Some("plate 3.lbrn2")),
            ("...hidden.ngc", Some("hidden.ngc")),
            ("-rf.ngc", Some("rf.ngc")),
            ("a\0b\n$(rm).toml", Some("ab(rm).toml")),
            ("Grüße.svg", Some("Grüße.svg")),
            ("..", None),
            ("", None),
            ("noending", None),
            (".svg", None),
            ("x.s/vg", None),
            ("a.ending9letters", None),
        ] {
            assert_eq!(clean(name).as_deref(), expect, "{name:?}");
        }
        let long = clean(&format!("{}.svg", "x".repeat(300))).unwrap();
        assert_eq!(long.chars().count(), LONGEST_NAME);
    }

    #[test]
    fn an_id_is_no_path_and_what_is_no_upload_is_not_listed() {
        let below = tempfile::tempdir().unwrap();
        let spool = Spool::new(below.path().join("spool"));
        spool.add("a.svg", b"x").unwrap();
        fs::write(below.path().join("secret.svg"), "x").unwrap();
        fs::create_dir(below.path().join("spool/empty")).unwrap();
        for id in ["", "..", "../secret.svg", "empty", "0123456789abcdeg", "0123456789abcdef"] {
            assert!(matches!(spool.path(id), Err(SpoolError::Unknown(_))), "{id}");
            assert!(matches!(spool.remove(id), Err(SpoolError::Unknown(_))), "{id}");
        }
        assert_eq!(spool.files().len(), 1);
    }

    #[test]
    fn the_number_of_files_is_bounded() {
        let below = tempfile::tempdir().unwrap();
        let spool = Spool::new(below.path().join("spool"));
        for number in 0..MOST {
            spool.add(&format!("{number}.ngc"), b"M2\n").unwrap();
        }
        let error = spool.add("more.ngc", b"M2\n").unwrap_err().to_string();
        assert!(error.contains("200 files") && error.contains("delete"), "{error}");
        let oldest = spool.files().pop().unwrap();
        spool.remove(&oldest.id).unwrap();
        spool.add("more.ngc", b"M2\n").unwrap();
        assert!(matches!(spool.add("none.ngc", b""), Err(SpoolError::Empty)));
    }
}
