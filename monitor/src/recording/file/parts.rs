//! A recording in its parts: `samples.mcap`, `samples.1.mcap` and so on in a run folder.
//!
//! A part is closed when it has grown large, and when another process goes on with the recording. Where there is a quota the oldest
//! part makes room.

use super::reader::{Entry, EntryReader, RecordingReader};
use super::writer::RecordingWriter;
use super::{Description, RecordingError};
use crate::recording::CycleRecord;
use crate::recording::continuity::Stamp;
use crate::recording::level::Level;
use crate::run_folder::RunFolder;
use messages::time::Period;
use messages::{Setpoint, run_folder};
use std::collections::VecDeque;
use std::fs::{self, File};
use std::io::{self, BufReader};
use std::path::{Path, PathBuf};

/// Bytes of a part that is closed: a successor reads one to find its end.
const PART: u64 = 128 << 20;

/// How much of a recording stays.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Extent {
    /// How much of each cycle.
    pub level: Level,
    /// How many bytes all of it may have; the oldest part makes room. `None` is as many as there are.
    pub quota: Option<u64>,
}

/// The parts of a recording in `folder` that are there, in their order.
pub fn of(folder: &Path) -> Vec<PathBuf> {
    numbered(folder).into_iter().map(|(_, path)| path).collect()
}

fn numbered(folder: &Path) -> Vec<(u64, PathBuf)> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let part = |path: PathBuf| Some((number(path.file_name()?.to_str()?)?, path));
    let mut parts: Vec<_> = entries.filter_map(|entry| part(entry.path())).collect();
    parts.sort();
    parts
}

/// The number of the part with this file name; the first is 0.
fn number(name: &str) -> Option<u64> {
    let (stem, extension) = run_folder::SAMPLES.split_once('.')?;
    let middle = name.strip_prefix(stem)?.strip_suffix(extension)?;
    match middle {
        "." => Some(0),
        _ => {
            let digits = middle.strip_prefix('.')?.strip_suffix('.')?;
            let number = digits.parse().ok().filter(|number| *number > 0)?;
            (format!("{number}") == digits).then_some(number)
        }
    }
}

fn name(number: u64) -> String {
    match (number, run_folder::SAMPLES.split_once('.')) {
        (1.., Some((stem, extension))) => format!("{stem}.{number}.{extension}"),
        _ => run_folder::SAMPLES.to_owned(),
    }
}

/// Reads all parts in a row; as an iterator their records, until the first error. A record that stands in two parts is
/// read once.
pub struct PartsReader {
    waiting: VecDeque<PathBuf>,
    current: EntryReader<BufReader<File>>,
    path: PathBuf,
    newest: Option<Stamp>,
    /// Whether it reads more than the records.
    whole: bool,
}

impl PartsReader {
    /// Opens the recording in a folder.
    ///
    /// # Errors
    /// [`RecordingError`] when there is none, or it cannot be read.
    pub fn open(folder: &Path) -> Result<Self, RecordingError> {
        Self::open_both(folder, None)
    }

    /// Opens the recording in a folder that goes on in another one.
    ///
    /// # Errors
    /// [`RecordingError`] when there is none, or it cannot be read.
    pub fn open_both(folder: &Path, then: Option<&Path>) -> Result<Self, RecordingError> {
        let mut waiting: VecDeque<PathBuf> = of(folder).into();
        waiting.extend(then.map(of).unwrap_or_default());
        loop {
            let path = waiting.pop_front().unwrap_or_else(|| folder.join(run_folder::SAMPLES));
            match EntryReader::open(&path) {
                // Not even its beginning could be written.
                Err(RecordingError::Truncated { .. }) if !waiting.is_empty() => {}
                current => {
                    let current = current?.reading(false);
                    return Ok(Self { current, waiting, path, newest: None, whole: false });
                }
            }
        }
    }

    /// One part, or a recording by any name, alone.
    ///
    /// # Errors
    /// [`RecordingError`] when it cannot be read.
    pub fn of_file(path: &Path) -> Result<Self, RecordingError> {
        let current = EntryReader::open(path)?.reading(false);
        let (waiting, path) = (VecDeque::new(), path.to_owned());
        Ok(Self { current, waiting, path, newest: None, whole: false })
    }

    /// What the recording says of itself.
    pub fn description(&self) -> &Description {
        self.current.description()
    }

    /// The period of the cycle.
    pub fn period(&self) -> Period {
        self.description().period
    }

    /// The part that is being read.
    pub fn path(&self) -> &Path {
        &self.path
    }
}

impl PartsReader {
    /// All that stands in it, in order, until the first error.
    pub fn entries(self) -> impl Iterator<Item = Result<Entry, RecordingError>> {
        let mut reader = Self { whole: true, current: self.current.reading(true), ..self };
        std::iter::from_fn(move || reader.entry())
    }

    fn entry(&mut self) -> Option<Result<Entry, RecordingError>> {
        loop {
            match self.current.next() {
                Some(Ok(Entry::Cycle(record, setpoints))) => {
                    let stamp = Stamp::of(&record.feedback);
                    if !self.newest.is_some_and(|newest| newest.has_come_to(stamp)) {
                        self.newest = Some(stamp);
                        return Some(Ok(Entry::Cycle(record, setpoints)));
                    }
                }
                // A part that its writer did not close ends where the next one begins.
                None | Some(Err(RecordingError::Truncated { .. })) if !self.waiting.is_empty() => {
                    let path = self.waiting.pop_front()?;
                    let opened = EntryReader::open(&path).map(|it| it.reading(self.whole));
                    match opened {
                        Ok(reader) => (self.current, self.path) = (reader, path),
                        Err(RecordingError::Truncated { .. }) if !self.waiting.is_empty() => {}
                        Err(error) => return Some(Err(error)),
                    }
                }
                other => return other,
            }
        }
    }
}

impl Iterator for PartsReader {
    type Item = Result<CycleRecord, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            match self.entry()? {
                Ok(Entry::Cycle(record, _)) => return Some(Ok(*record)),
                Ok(_) => {}
                Err(error) => return Some(Err(error)),
            }
        }
    }
}

/// A recording that another process left, to be gone on with.
#[derive(Debug)]
pub struct Resumed {
    /// Goes on with it in a new part.
    pub writer: PartsWriter,
    /// Its last whole record, if it has any.
    pub last: Option<CycleRecord>,
    /// How many whole records it has.
    pub records: u64,
}

/// Writes a recording into a run folder, part after part.
#[derive(Debug)]
pub struct PartsWriter {
    folder: RunFolder,
    extent: Extent,
    /// `None` where nothing is to be recorded.
    writer: Option<RecordingWriter>,
    number: u64,
    /// Parts that are closed, with their sizes.
    closed: VecDeque<(PathBuf, u64)>,
    part: u64,
}

impl PartsWriter {
    /// Begins a recording, in place of what may be there.
    ///
    /// # Errors
    /// Whatever the operating system reports.
    pub fn create(
        folder: &RunFolder,
        description: &Description,
        extent: Extent,
    ) -> io::Result<Self> {
        for path in of(folder.path()) {
            fs::remove_file(path)?;
        }
        Self::begin(folder, description, extent, (0, 0), VecDeque::new())
    }

    /// Goes on with the recording that another process left in a folder.
    ///
    /// # Errors
    /// [`RecordingError`] when what is there is no recording, or cannot be read or written.
    pub fn resume(
        folder: &RunFolder,
        description: &Description,
        extent: Extent,
    ) -> Result<Resumed, RecordingError> {
        let parts = numbered(folder.path());
        let (mut last, mut records) = (None, 0);
        for (_, path) in parts.iter().rev() {
            (last, records) = last_of(path)?;
            if last.is_some() {
                break;
            }
        }
        let next = parts.last().map_or(0, |(number, _)| number + 1);
        let size = |path: PathBuf| (path.metadata().map_or(0, |file| file.len()), path);
        let closed = parts.into_iter().map(|(_, path)| size(path)).map(|(size, path)| (path, size));
        let writer = Self::begin(folder, description, extent, (next, records), closed.collect())?;
        Ok(Resumed { writer, last, records })
    }

    fn begin(
        folder: &RunFolder,
        description: &Description,
        extent: Extent,
        (number, count): (u64, u64),
        closed: VecDeque<(PathBuf, u64)>,
    ) -> io::Result<Self> {
        // A quota is kept to half a part.
        let part = extent.quota.map_or(PART, |quota| (quota / 2).min(PART));
        let path = folder.file(&name(number));
        let writer = (extent.level > Level::Off)
            .then(|| RecordingWriter::continued(&path, description, extent.level, count))
            .transpose()?;
        Ok(Self { folder: folder.clone(), extent, writer, number, closed, part })
    }

    /// Appends a record with the setpoints that the controller took in it, as far as the level keeps them.
    ///
    /// # Errors
    /// Whatever the operating system reports.
    pub fn write_cycle(&mut self, record: &CycleRecord, setpoints: &[Setpoint]) -> io::Result<()> {
        let Some(writer) = &mut self.writer else { return Ok(()) };
        writer.write_cycle(record, setpoints)?;
        if writer.size() >= self.part { self.rotate() } else { Ok(()) }
    }

    /// Appends a cycle of before the job, by its deadline [ns] and its message.
    ///
    /// # Errors
    /// Whatever the operating system reports.
    pub fn write_lead(&mut self, deadline: i64, message: &[u8]) -> io::Result<()> {
        self.writer.as_mut().map_or(Ok(()), |writer| writer.write_lead(deadline, message))
    }

    /// Bytes of all parts.
    pub fn size(&self) -> u64 {
        let closed: u64 = self.closed.iter().map(|(_, size)| size).sum();
        closed + self.writer.as_ref().map_or(0, RecordingWriter::size)
    }

    /// Where the part is that is being written.
    pub fn path(&self) -> PathBuf {
        self.folder.file(&name(self.number))
    }

    /// Hands on what is buffered.
    ///
    /// # Errors
    /// Whatever the operating system reports.
    pub fn flush(&mut self) -> io::Result<()> {
        self.writer.as_mut().map_or(Ok(()), RecordingWriter::flush)
    }

    /// Closes the recording.
    ///
    /// # Errors
    /// Whatever the operating system reports.
    pub fn finish(&mut self) -> io::Result<()> {
        self.writer.take().map_or(Ok(()), RecordingWriter::finish)
    }

    /// Closes the part and begins the next one; what is beyond the quota goes.
    fn rotate(&mut self) -> io::Result<()> {
        let Some(writer) = self.writer.take() else { return Ok(()) };
        let (description, count) = (writer.description().clone(), writer.count());
        self.closed.push_back((self.folder.file(&name(self.number)), writer.size()));
        writer.finish()?;
        if let Some(quota) = self.extent.quota {
            let mut size: u64 = self.part + self.closed.iter().map(|(_, size)| size).sum::<u64>();
            while size > quota
                && let Some((path, part)) = self.closed.pop_front()
            {
                fs::remove_file(path)?;
                size -= part;
            }
        }
        self.number += 1;
        let path = self.folder.file(&name(self.number));
        let level = self.extent.level;
        self.writer = Some(RecordingWriter::continued(&path, &description, level, count)?);
        Ok(())
    }
}

/// The last whole record of a part, and how many there are up to it.
fn last_of(path: &Path) -> Result<(Option<CycleRecord>, u64), RecordingError> {
    let mut reader = match RecordingReader::open(path) {
        Err(RecordingError::Truncated { .. }) => return Ok((None, 0)),
        other => other?,
    };
    let mut last = None;
    for record in &mut reader {
        match record {
            Ok(record) => last = Some(record),
            Err(RecordingError::Truncated { .. }) => break,
            Err(error) => return Err(error),
        }
    }
    Ok((last, reader.total()))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use messages::{Cycle, Feedback};

    fn record(cycle: u64) -> CycleRecord {
        CycleRecord::unanswered(Feedback { cycle: Cycle(cycle), ..Feedback::default() })
    }

    fn write(writer: &mut PartsWriter, records: &[CycleRecord]) {
        records.iter().for_each(|record| writer.write_cycle(record, &[]).unwrap());
    }

    fn cycles(folder: &Path) -> Vec<u64> {
        let reader = PartsReader::open(folder).unwrap();
        reader
            .map_while(|record| match record {
                Ok(record) => Some(record.feedback.cycle.0),
                Err(RecordingError::Truncated { .. }) => None,
                Err(error) => panic!("{error}"),
            })
            .collect()
    }

    #[test]
    fn only_parts_have_numbers() {
        for (name_of, expect) in [
            ("samples.mcap", Some(0)),
            ("samples.1.mcap", Some(1)),
            ("samples.20.mcap", Some(20)),
            ("samples.0.mcap", None),
            ("samples.01.mcap", None),
            ("samples.x.mcap", None),
            ("samples.bin", None),
            ("samplesmcap", None),
            ("my.samples.mcap", None),
        ] {
            assert_eq!(number(name_of), expect, "{name_of}");
            assert!(expect.is_none_or(|number| name(number) == name_of));
        }
    }

    #[test]
    fn a_successor_goes_on_after_the_last_whole_record_wherever_the_file_was_cut() {
        let below = tempfile::tempdir().unwrap();
        let folder = RunFolder::create_at(below.path()).unwrap();
        let (description, extent) = (Description::of(Period::OF_SETPOINTS), Extent::default());
        let mut writer = PartsWriter::create(&folder, &description, extent).unwrap();
        write(&mut writer, &[1, 2, 3].map(record));
        writer.flush().unwrap();
        let path = folder.file(run_folder::SAMPLES);
        let bytes = fs::read(&path).unwrap();
        drop(writer);
        let begin = bytes.len() - 200;
        for kept in (0..20).chain(begin..=bytes.len()) {
            create_torn(&folder, &bytes[..kept]);
            let whole = cycles_in(&bytes[..kept]);
            let resumed = PartsWriter::resume(&folder, &description, extent);
            let Resumed { mut writer, last, records } = resumed.unwrap();
            assert_eq!(last.map_or(0, |last| last.feedback.cycle.0), whole.len() as u64, "{kept}");
            assert_eq!(records, whole.len() as u64);
            write(&mut writer, &[record(100)]);
            writer.finish().unwrap();
            if kept > 0 && !whole.is_empty() {
                let expect: Vec<u64> = whole.into_iter().chain([100]).collect();
                assert_eq!(cycles(folder.path()), expect, "{kept}");
            }
            // A third one counts what both have.
            let third = PartsWriter::resume(&folder, &description, extent).unwrap();
            assert_eq!((third.records, third.last.unwrap().feedback.cycle.0), (records + 1, 100));
        }
        fs::write(&path, [b'x'; 4000]).unwrap();
        fs::remove_file(folder.file("samples.1.mcap")).unwrap();
        fs::remove_file(folder.file("samples.2.mcap")).unwrap();
        let error = PartsWriter::resume(&folder, &description, extent).unwrap_err();
        assert!(matches!(error, RecordingError::NotARecording), "{error}");
        assert_eq!(fs::read(&path).unwrap(), [b'x'; 4000], "left alone");
    }

    fn create_torn(folder: &RunFolder, bytes: &[u8]) {
        of(folder.path()).into_iter().for_each(|path| fs::remove_file(path).unwrap());
        fs::write(folder.file(run_folder::SAMPLES), bytes).unwrap();
    }

    fn cycles_in(bytes: &[u8]) -> Vec<u64> {
        let Ok(reader) = RecordingReader::new(bytes) else { return Vec::new() };
        reader.map_while(Result::ok).map(|record| record.feedback.cycle.0).collect()
    }

    #[test]
    fn the_oldest_part_makes_room_where_there_is_a_quota() {
        let below = tempfile::tempdir().unwrap();
        let folder = RunFolder::create_at(below.path()).unwrap();
        let description = Description::of(Period::OF_SETPOINTS);
        let extent = Extent { quota: Some(40_000), ..Extent::default() };
        let mut writer = PartsWriter::create(&folder, &description, extent).unwrap();
        (1..=3000).for_each(|cycle| write(&mut writer, &[record(cycle)]));
        writer.finish().unwrap();
        let cycles = cycles(folder.path());
        assert!(cycles[0] > 1500 && cycles.len() > 200, "{} from {}", cycles.len(), cycles[0]);
        assert_eq!(*cycles.last().unwrap(), 3000);
        assert!(cycles.windows(2).all(|pair| pair[1] == pair[0] + 1));
        assert!(of(folder.path()).len() <= 3);
    }

    #[test]
    fn a_level_keeps_what_its_name_says() {
        for (level, expect) in [
            (Level::Full, Some(1000)),
            (Level::Decimated, Some(100)),
            (Level::Events, Some(0)),
            (Level::Off, None),
        ] {
            let below = tempfile::tempdir().unwrap();
            let folder = RunFolder::create_at(below.path()).unwrap();
            let description = Description::of(Period::OF_SETPOINTS);
            let extent = Extent { level, quota: None };
            let mut writer = PartsWriter::create(&folder, &description, extent).unwrap();
            let records: Vec<_> = (1..=1000).map(record).collect();
            write(&mut writer, &records);
            writer.finish().unwrap();
            let kept =
                folder.file(run_folder::SAMPLES).exists().then(|| cycles(folder.path()).len());
            assert_eq!(kept, expect, "{level:?}");
        }
    }
}
