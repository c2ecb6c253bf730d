//! Jobs that a machine has taken, on its disk: a folder for each, named by the job's number, with its ticket and its file.
//!
//! What is in it after a loss of power is whole: a job is there when its ticket is, which comes last.

use crate::name::is_id;
use operator::fleet::JobTicket;
use serde::{Deserialize, Serialize};
use std::fs::{self, File};
use std::io::{self, Write};
use std::os::unix::fs::{DirBuilderExt, OpenOptionsExt};
use std::path::{Path, PathBuf};

/// Jobs that have ended and are kept, so that they can be repeated at the machine.
const MOST_ENDED: usize = 100;

/// The longest name of a file [bytes].
const LONGEST_NAME: usize = 200;

/// The ticket of a job, and the folder of its file, in the job's folder.
const TICKET: &str = "job.json";
const FILE: &str = "file";

/// A job in the spool.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(crate) struct Kept {
    /// What it is.
    pub(crate) ticket: JobTicket,
    /// Whether it has ended, or is not this machine's.
    pub(crate) is_over: bool,
}

/// The folder.
#[derive(Debug, Clone)]
pub(crate) struct Spool {
    folder: PathBuf,
}

impl Spool {
    /// The spool in this folder, which is made when the first job comes.
    pub(crate) fn new(folder: PathBuf) -> Self {
        Self { folder }
    }

    /// Where the file of a job is.
    pub(crate) fn file(&self, ticket: &JobTicket) -> PathBuf {
        self.folder.join(&ticket.id).join(FILE).join(&ticket.name)
    }

    /// Keeps a job, whose ticket has been checked. It is on the disk when this returns; one that is there already is kept as it is.
    ///
    /// # Errors
    /// What the operating system says.
    pub(crate) fn keep(&self, ticket: &JobTicket, content: &[u8]) -> io::Result<()> {
        if self.find(&ticket.id).is_some() {
            return Ok(());
        }
        let folder = self.folder.join(&ticket.id);
        // What is left of a job that was not kept whole.
        remove(&folder)?;
        let write = || -> io::Result<()> {
            fs::DirBuilder::new().recursive(true).mode(0o700).create(folder.join(FILE))?;
            write_whole(&self.file(ticket), content)?;
            File::open(folder.join(FILE))?.sync_all()?;
            self.write_ticket(&Kept { ticket: ticket.clone(), is_over: false })?;
            File::open(&self.folder)?.sync_all()
        };
        write().inspect_err(|_| {
            // Half a job on a full disk would only make it fuller.
            let _ = remove(&folder);
        })
    }

    fn write_ticket(&self, kept: &Kept) -> io::Result<()> {
        let folder = self.folder.join(&kept.ticket.id);
        let unfinished = folder.join("job.json.new");
        remove_file(&unfinished)?;
        write_whole(&unfinished, &serde_json::to_vec(kept)?)?;
        fs::rename(&unfinished, folder.join(TICKET))?;
        File::open(&folder)?.sync_all()
    }

    /// Notes that a job is over.
    ///
    /// # Errors
    /// What the operating system says.
    pub(crate) fn end(&self, id: &str) -> io::Result<()> {
        match self.find(id) {
            Some(kept) if !kept.is_over => self.write_ticket(&Kept { is_over: true, ..kept }),
            _ => Ok(()),
        }
    }

    /// Removes a job.
    ///
    /// # Errors
    /// What the operating system says.
    pub(crate) fn remove(&self, id: &str) -> io::Result<()> {
        if is_id(id) { remove(&self.folder.join(id)) } else { Ok(()) }
    }

    /// The job with this number.
    pub(crate) fn find(&self, id: &str) -> Option<Kept> {
        let text = is_id(id).then(|| fs::read(self.folder.join(id).join(TICKET)).ok()).flatten()?;
        serde_json::from_slice(&text).ok().filter(|kept: &Kept| kept.ticket.id == id)
    }

    /// All jobs that are not over.
    pub(crate) fn open(&self) -> Vec<Kept> {
        let mut open: Vec<Kept> = self.all().into_iter().filter(|kept| !kept.is_over).collect();
        open.sort_by(|one, other| one.ticket.submitted.total_cmp(&other.ticket.submitted));
        open
    }

    /// Removes the oldest jobs that are over and that nobody `needs`, so that not too many are kept.
    pub(crate) fn prune(&self, needs: &dyn Fn(&Path) -> bool) {
        let ended =
            self.all().into_iter().filter(|kept| kept.is_over && !needs(&self.file(&kept.ticket)));
        let mut ended: Vec<Kept> = ended.collect();
        ended.sort_by(|one, other| other.ticket.submitted.total_cmp(&one.ticket.submitted));
        for kept in ended.iter().skip(MOST_ENDED) {
            // It is tried again with the next job.
            let _ = self.remove(&kept.ticket.id);
        }
    }

    fn all(&self) -> Vec<Kept> {
        let entries = fs::read_dir(&self.folder).into_iter().flatten().flatten();
        entries.filter_map(|entry| self.find(entry.file_name().to_str()?)).collect()
    }
}

/// The number of the job whose file in the spool `folder` this is.
pub(crate) fn id_of(folder: &Path, file: &str) -> Option<String> {
    let folder = std::path::absolute(folder).ok()?;
    let inside = Path::new(file).strip_prefix(folder).ok()?;
    let id = inside.components().next()?.as_os_str().to_str()?;
    is_id(id).then(|| id.to_owned())
}

/// Whether `name` is that of a file, on every system, with an ending.
///
/// # Errors
/// Why it is not.
pub(crate) fn check_name(name: &str) -> Result<(), String> {
    let allowed = |it: char| it.is_alphanumeric() || " ._-+()".contains(it);
    let begins = name.chars().next().is_some_and(|it| it.is_alphanumeric() || it == '_');
    let ending = name.rsplit_once('.').map(|(_, ending)| ending);
    let ends = ending.is_some_and(|it| {
        (1..=8).contains(&it.len()) && it.bytes().all(|it| it.is_ascii_alphanumeric())
    });
    if begins && ends && name.len() <= LONGEST_NAME && name.chars().all(allowed) {
        return Ok(());
    }
    let shown: String = name.chars().take(LONGEST_NAME).collect();
    Err(format!(
        "{shown:?} is no name of a job's file: letters, digits, spaces and . _ - + ( ), a letter or digit first, and an \
         ending such as .svg"
    ))
}

fn write_whole(path: &Path, content: &[u8]) -> io::Result<()> {
    let mut file = File::options().write(true).create_new(true).mode(0o600).open(path)?;
    file.write_all(content)?;
    file.sync_all()
}

/// Removes a folder, if it is there.
fn remove(folder: &Path) -> io::Result<()> {
    gone(fs::remove_dir_all(folder))
}

fn remove_file(file: &Path) -> io::Result<()> {
    gone(fs::remove_file(file))
}

fn gone(removed: io::Result<()>) -> io::Result<()> {
    match removed {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use std::os::unix::fs::MetadataExt;

    fn ticket(number: u64) -> JobTicket {
        let (id, name) = (format!("{number:016x}"), "plate 1.svg".to_owned());
        JobTicket { id, name, submitted: number as f64, ..JobTicket::default() }
    }

    #[test]
    fn a_job_is_kept_whole_for_its_user_alone_until_it_is_over() {
        let below = tempfile::tempdir().unwrap();
        let spool = Spool::new(below.path().join("state/fleet"));
        assert_eq!(spool.open(), []);
        let one = ticket(1);
        spool.keep(&one, b"<svg/>").unwrap();
        // A second delivery changes nothing.
        spool.keep(&one, b"other").unwrap();
        let file = spool.file(&one);
        assert_eq!(fs::read(&file).unwrap(), b"<svg/>");
        assert_eq!(fs::metadata(&file).unwrap().mode() & 0o777, 0o600);
        assert_eq!(
            id_of(&below.path().join("state/fleet"), file.to_str().unwrap()),
            Some(one.id.clone())
        );
        assert_eq!(id_of(below.path(), "/elsewhere/0000000000000001/file"), None);
        spool.keep(&ticket(2), b"x").unwrap();
        let open =
            |spool: &Spool| spool.open().into_iter().map(|kept| kept.ticket).collect::<Vec<_>>();
        assert_eq!(open(&spool), [one.clone(), ticket(2)]);
        spool.end(&one.id).unwrap();
        assert_eq!(open(&spool), [ticket(2)]);
        assert!(file.exists(), "it can be repeated");
        spool.remove(&ticket(2).id).unwrap();
        assert!(spool.find(&ticket(2).id).is_none());
    }

    #[test]
    fn what_was_not_kept_whole_is_not_there_and_is_kept_anew() {
        let below = tempfile::tempdir().unwrap();
        let spool = Spool::new(below.path().to_owned());
        let job = ticket(3);
        fs::create_dir_all(spool.file(&job).parent().unwrap()).unwrap();
        fs::write(spool.file(&job), "half").unwrap();
        assert_eq!(spool.open(), []);
        spool.keep(&job, b"whole").unwrap();
        assert_eq!(fs::read(spool.file(&job)).unwrap(), b"whole");
        for id in ["..", "", "job.json"] {
            assert!(spool.find(id).is_none());
            spool.remove(id).unwrap();
        }
        assert!(below.path().exists());
    }

    #[test]
    fn the_oldest_that_are_over_make_room_unless_somebody_needs_them() {
        let below = tempfile::tempdir().unwrap();
        let spool = Spool::new(below.path().to_owned());
        for number in 0..MOST_ENDED as u64 + 3 {
            spool.keep(&ticket(number), b"x").unwrap();
            if number != 1 {
                spool.end(&ticket(number).id).unwrap();
            }
        }
        let needed = spool.file(&ticket(0));
        spool.prune(&|file| file == needed);
        let left = |number: u64| spool.find(&ticket(number).id).is_some();
        assert!(left(0) && left(1) && !left(2) && left(3));
    }

    #[test]
    fn names_of_files_are_of_files() {
        for name in ["a.svg", "Grüße 2 (neu).lbrn2", "_x.ngc"] {
            assert_eq!(check_name(name), Ok(()));
        }
        for name in [
            "",
            "..",
            "a",
            "a/b.svg",
            "../a.svg",
            "-rf.ngc",
            ".a.svg",
            "a\n.svg",
            "a.ending9letters",
            " .svg",
        ] {
            assert!(check_name(name).unwrap_err().contains("ending"), "{name:?}");
        }
        assert!(check_name(&format!("{}.svg", "x".repeat(300))).is_err());
    }
}
