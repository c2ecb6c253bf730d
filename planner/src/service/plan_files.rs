//! What others read of a plan, in the run folder: it is written while the job is planned, and can be
//! read whenever that ends.

use crate::PlanFacts;
use crate::request::Refusal;
use messages::artwork::ArtworkLine;
use messages::finite::first_not_finite;
use messages::run_folder;
use runtime::{ServiceError, message};
use std::collections::VecDeque;
use std::fs::{self, File};
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How often the facts are written anew.
const INTERVAL: Duration = Duration::from_secs(1);

/// The files of a plan in a run folder. The artwork goes on in a spare folder where this takes no more: the marks are judged by it.
pub(super) struct PlanFiles {
    artwork: BufWriter<File>,
    /// Where the lines of each window begin that may still be taken back.
    begins: VecDeque<Begin>,
    end: Begin,
    folder: PathBuf,
    spare: PathBuf,
    noted: Option<Instant>,
    /// Whether the facts could not be written, which is said once.
    refused: bool,
}

/// A place in the artwork.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Begin {
    /// Whether it is in the spare folder.
    spared: bool,
    /// Bytes before it in its file.
    at: u64,
}

impl PlanFiles {
    /// Begins them in `folder`.
    pub(super) fn create(folder: &Path, spare: &Path) -> Result<Self, Refusal> {
        // What an earlier job left there.
        let _ = fs::remove_file(spare.join(run_folder::ARTWORK));
        let path = folder.join(run_folder::ARTWORK);
        let artwork = File::create(&path).map_err(|source| failed(path, source))?;
        Ok(Self {
            artwork: BufWriter::new(artwork),
            begins: VecDeque::new(),
            end: Begin { spared: false, at: 0 },
            folder: folder.to_owned(),
            spare: spare.to_owned(),
            noted: None,
            refused: false,
        })
    }

    /// Adds what is to be marked in the next window.
    pub(super) fn add(&mut self, lines: &[ArtworkLine]) -> Result<(), Refusal> {
        for line in lines {
            finite(line)?;
        }
        self.begins.push_back(self.end);
        match self.write(lines) {
            Ok(at) => self.end.at = at,
            Err(source) if self.end.spared => {
                return Err(failed(self.folder.join(run_folder::ARTWORK), source));
            }
            Err(source) => {
                let path = self.folder.join(run_folder::ARTWORK);
                let moved = self.move_out().and_then(|()| self.write(lines));
                message::tell(&format!("planner: {}: {source}", path.display()));
                self.end.at = moved.map_err(|_| failed(path, source))?;
            }
        }
        Ok(())
    }

    /// Appends lines; where the file ends then.
    fn write(&mut self, lines: &[ArtworkLine]) -> io::Result<u64> {
        for line in lines {
            serde_json::to_writer(&mut self.artwork, line)?;
            self.artwork.write_all(b"\n")?;
        }
        self.artwork.flush()?;
        self.artwork.stream_position()
    }

    /// Goes on in the spare folder.
    fn move_out(&mut self) -> io::Result<()> {
        let spare = BufWriter::new(File::create(self.spare.join(run_folder::ARTWORK))?);
        // What was buffered is written again.
        let (file, _) = std::mem::replace(&mut self.artwork, spare).into_parts();
        file.set_len(self.end.at)?;
        self.end = Begin { spared: true, at: 0 };
        // The newest window begins there.
        if let Some(begin) = self.begins.back_mut() {
            *begin = self.end;
        }
        Ok(())
    }

    /// Keeps the lines of the oldest window that may still be taken back.
    pub(super) fn keep(&mut self) {
        self.begins.pop_front();
    }

    /// Takes back the lines of the last `count` windows, none of which was kept.
    pub(super) fn take_back(&mut self, count: usize) -> Result<(), Refusal> {
        let first = self.begins.len().saturating_sub(count);
        let Some(begin) = self.begins.drain(first..).next() else { return Ok(()) };
        let path = self.folder.join(run_folder::ARTWORK);
        let mut cut = || -> io::Result<()> {
            let left = self.end.spared && !begin.spared;
            if left {
                // It goes on in the spare folder all the same: the other one may be full still.
                File::options().write(true).open(&path)?.set_len(begin.at)?;
            }
            self.end = Begin { spared: self.end.spared, at: if left { 0 } else { begin.at } };
            self.artwork.flush()?;
            self.artwork.get_ref().set_len(self.end.at)?;
            self.artwork.seek(SeekFrom::Start(self.end.at)).map(drop)
        };
        cut().map_err(|source| failed(path.clone(), source))
    }

    /// Writes what the plan comes to so far, now and then and as `is_last`.
    pub(super) fn note(
        &mut self,
        facts: &dyn Fn() -> PlanFacts,
        is_last: bool,
    ) -> Result<(), Refusal> {
        if !is_last && self.refused {
            return Ok(());
        }
        if !is_last && self.noted.is_some_and(|noted| noted.elapsed() < INTERVAL) {
            return Ok(());
        }
        self.noted = Some(Instant::now());
        let facts = facts();
        finite(&facts)?;
        let path = self.folder.join(run_folder::PLAN);
        let unfinished =
            self.folder.join(format!(".{}.{}.part", run_folder::PLAN, std::process::id()));
        // A reader sees the old content or the new.
        let write = || -> io::Result<()> {
            fs::write(&unfinished, serde_json::to_vec_pretty(&facts)?)?;
            fs::rename(&unfinished, &path)
        };
        if let Err(source) = write() {
            // Half a file on a full disk would only make it fuller.
            let _ = fs::remove_file(&unfinished);
            self.refused = true;
            // The marks need no plan.
            message::tell(&format!("planner: {}: {source}", path.display()));
        }
        Ok(())
    }
}

/// Refuses numbers that are not finite: JSON has none, and a reader would find null.
fn finite(value: &impl serde::Serialize) -> Result<(), Refusal> {
    match first_not_finite(value) {
        Some(place) => Err(Refusal::internal(format!("the plan has no finite number at {place}"))),
        None => Ok(()),
    }
}

fn failed(path: PathBuf, source: io::Error) -> Refusal {
    Refusal::internal(ServiceError::io(path, source))
}

/// Says in the run folder why the job was refused. Where that cannot be written, such as on a full
/// disk, it is said in `spare`, and where that cannot be written either, on standard error.
pub(super) fn write_refusal(folder: &Path, spare: &Path, refusal: &Refusal) {
    let text = serde_json::to_vec_pretty(refusal).unwrap_or_default();
    let places = [folder.join(run_folder::REFUSAL), spare.join(run_folder::REFUSAL)];
    if !places.iter().any(|place| fs::write(place, &text).is_ok()) {
        message::tell(refusal.text.trim());
    }
}
