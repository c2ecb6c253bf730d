//! `samples.bin`: the records as they stand in memory, behind a header that says what they are.

use super::CycleRecord;
use messages::time::Period;
use messages::{Command, Feedback, Nanoseconds, Sample, sample};
use std::fs::{File, OpenOptions};
use std::io::{self, BufReader, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::Path;
use zerocopy::{FromBytes, FromZeros, IntoBytes};

/// Bytes for a sample's name in the header, unused ones zero.
const NAME_LENGTH: usize = 32;

sample! {
    /// The header of `samples.bin`; numbers are little-endian, as in the records.
    Header = "graver.Recording.v2" {
        /// [`Header::MAGIC`].
        magic: u64,
        /// Hash over this header's own layout.
        layout: u64,
        /// Bytes of one record.
        record_size: u64,
        /// The period of the cycle.
        period: Nanoseconds,
        /// Layout hash of the feedback.
        feedback_layout: u64,
        /// Layout hash of the command.
        command_layout: u64,
        /// Name and version of the feedback, UTF-8.
        feedback: [u8; NAME_LENGTH],
        /// Name and version of the command, UTF-8.
        command: [u8; NAME_LENGTH],
    }
}

impl Header {
    /// The file's first eight bytes: `GRAVERec`.
    pub const MAGIC: u64 = u64::from_le_bytes(*b"GRAVERec");

    /// The header that this build writes, for cycles of this `period`.
    pub fn of(period: Period) -> Self {
        Self {
            magic: Self::MAGIC,
            layout: Self::LAYOUT,
            record_size: size_of::<CycleRecord>() as u64,
            period: period.time(),
            feedback_layout: Feedback::LAYOUT,
            command_layout: Command::LAYOUT,
            feedback: name_bytes(Feedback::NAME),
            command: name_bytes(Command::NAME),
        }
    }
}

fn name_bytes(name: &str) -> [u8; NAME_LENGTH] {
    let mut bytes = [0; NAME_LENGTH];
    for (to, from) in bytes.iter_mut().zip(name.bytes()) {
        *to = from;
    }
    bytes
}

fn name_text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).trim_end_matches('\0').to_owned()
}

/// Why a recording cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    /// The operating system refused.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// The file does not begin like a recording.
    #[error("not a recording: a samples.bin of Graver begins with \"GRAVERec\"")]
    NotARecording,
    /// The file was written by a build with other samples.
    #[error(
        "recorded with {recorded} (layout {recorded_layout:016x}), but this build has {expected} \
         (layout {expected_layout:016x}): read it with the build that wrote it"
    )]
    OtherLayout {
        /// The sample in the file.
        recorded: String,
        /// Its layout hash.
        recorded_layout: u64,
        /// The sample of this build.
        expected: String,
        /// Its layout hash.
        expected_layout: u64,
    },
    /// The file ends inside a record: whoever wrote it was stopped.
    #[error("the recording ends inside record {record}: its writer was killed")]
    Truncated {
        /// The incomplete record, from 0.
        record: u64,
    },
}

/// Writes a recording, record by record.
#[derive(Debug)]
pub struct RecordingWriter<W: Write> {
    writer: W,
}

impl<W: Write> RecordingWriter<W> {
    /// Writes the header to `writer`, which should be buffered, for cycles of this `period`, and flushes it:
    /// a recording that is still empty can be told from no recording.
    ///
    /// # Errors
    /// Whatever the writer reports.
    pub fn new(mut writer: W, period: Period) -> io::Result<Self> {
        writer.write_all(Header::of(period).as_bytes())?;
        writer.flush()?;
        Ok(Self { writer })
    }

    /// Appends to a recording that has its header already.
    pub fn append(writer: W) -> Self {
        Self { writer }
    }

    /// Appends records.
    ///
    /// # Errors
    /// Whatever the writer reports.
    pub fn write(&mut self, records: &[CycleRecord]) -> io::Result<()> {
        self.writer.write_all(records.as_bytes())
    }

    /// Hands on what is buffered.
    ///
    /// # Errors
    /// Whatever the writer reports.
    pub fn flush(&mut self) -> io::Result<()> {
        self.writer.flush()
    }

    /// Flushes, and gives the writer back.
    ///
    /// # Errors
    /// Whatever the writer reports.
    pub fn finish(mut self) -> io::Result<W> {
        self.writer.flush()?;
        Ok(self.writer)
    }
}

/// A recording that another process left, opened to be gone on with.
#[derive(Debug)]
pub struct Resumed {
    /// Appends to it.
    pub writer: RecordingWriter<BufWriter<File>>,
    /// Its last whole record, if it has any.
    pub last: Option<CycleRecord>,
    /// How many whole records it has.
    pub records: u64,
}

impl RecordingWriter<BufWriter<File>> {
    /// Begins a recording in a file, in place of what may be there, of cycles of this `period`.
    ///
    /// # Errors
    /// Whatever the operating system reports.
    pub fn create(path: &Path, period: Period) -> io::Result<Self> {
        Self::new(BufWriter::new(File::create(path)?), period)
    }

    /// Opens a recording to append to it. A last record that its writer did not complete is cut
    /// off; one that does not even have its header begins anew, of cycles of this `period`.
    ///
    /// # Errors
    /// [`RecordingError`] when the file is no recording of this build, or cannot be opened.
    pub fn resume(path: &Path, period: Period) -> Result<Resumed, RecordingError> {
        let mut file = OpenOptions::new().read(true).write(true).open(path)?;
        let (header, record) = (size_of::<Header>() as u64, size_of::<CycleRecord>() as u64);
        let Some(bytes) = file.metadata()?.len().checked_sub(header) else {
            return Ok(Resumed { writer: Self::create(path, period)?, last: None, records: 0 });
        };
        RecordingReader::new(BufReader::new(&file))?;
        let records = bytes / record;
        file.set_len(header + records * record)?;
        let mut last = None;
        if let Some(before) = records.checked_sub(1) {
            file.seek(SeekFrom::Start(header + before * record))?;
            let mut whole = CycleRecord::new_zeroed();
            file.read_exact(whole.as_mut_bytes())?;
            last = Some(whole);
        }
        file.seek(SeekFrom::End(0))?;
        Ok(Resumed { writer: Self::append(BufWriter::new(file)), last, records })
    }
}

/// Reads a recording, record by record, as an iterator that ends at the first error.
#[derive(Debug)]
pub struct RecordingReader<R: Read> {
    reader: R,
    period: Period,
    count: u64,
    ended: bool,
}

impl<R: Read> RecordingReader<R> {
    /// Reads and checks the header; `reader` should be buffered.
    ///
    /// # Errors
    /// [`RecordingError`] when this is no recording, or one of a build with other samples.
    pub fn new(mut reader: R) -> Result<Self, RecordingError> {
        let mut header = Header::zeroed();
        match reader.read_exact(header.as_mut_bytes()) {
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                return Err(RecordingError::NotARecording);
            }
            other => other?,
        }
        let expected = Header::of(Period::OF_SETPOINTS);
        if header.magic != expected.magic {
            return Err(RecordingError::NotARecording);
        }
        let parts = [
            ("graver.Recording", header.layout, Header::NAME, expected.layout),
            (
                &name_text(&header.feedback),
                header.feedback_layout,
                Feedback::NAME,
                Feedback::LAYOUT,
            ),
            (&name_text(&header.command), header.command_layout, Command::NAME, Command::LAYOUT),
        ];
        for (recorded, recorded_layout, name, expected_layout) in parts {
            if recorded_layout != expected_layout {
                return Err(RecordingError::OtherLayout {
                    recorded: recorded.to_owned(),
                    recorded_layout,
                    expected: name.to_owned(),
                    expected_layout,
                });
            }
        }
        let period = Period::new(header.period).ok_or(RecordingError::NotARecording)?;
        Ok(Self { reader, period, count: 0, ended: false })
    }

    /// The period of the recorded cycles.
    pub fn period(&self) -> Period {
        self.period
    }

    fn read(&mut self) -> Result<Option<CycleRecord>, RecordingError> {
        let mut bytes = [0_u8; size_of::<CycleRecord>()];
        let mut filled = 0;
        while let Some(rest) = bytes.get_mut(filled..).filter(|rest| !rest.is_empty()) {
            match self.reader.read(rest) {
                Ok(0) if filled == 0 => return Ok(None),
                Ok(0) => return Err(RecordingError::Truncated { record: self.count }),
                Ok(read) => filled += read,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error.into()),
            }
        }
        self.count += 1;
        Ok(Some(CycleRecord::read_from_bytes(&bytes).unwrap_or_else(|_| CycleRecord::new_zeroed())))
    }
}

impl<R: Read> Iterator for RecordingReader<R> {
    type Item = Result<CycleRecord, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ended {
            return None;
        }
        let record = self.read().transpose();
        self.ended = !matches!(record, Some(Ok(_)));
        record
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use messages::Cycle;

    fn written(count: u64) -> Vec<u8> {
        let mut writer = RecordingWriter::new(Vec::new(), Period::OF_SETPOINTS).unwrap();
        for cycle in 0..count {
            let mut record = CycleRecord::new_zeroed();
            record.feedback.cycle = Cycle(cycle);
            record.feedback.tool = [0.25 * cycle as f64, -1e-9, f64::MAX];
            record.command.cycle = Cycle(cycle);
            writer.write(&[record]).unwrap();
        }
        writer.finish().unwrap()
    }

    #[test]
    fn what_was_written_is_read_back() {
        let bytes = written(10);
        assert_eq!(&bytes[..8], b"GRAVERec");
        let records: Vec<_> =
            RecordingReader::new(&bytes[..]).unwrap().collect::<Result<_, _>>().unwrap();
        assert_eq!(records.len(), 10);
        assert_eq!(records[7].feedback.tool, [1.75, -1e-9, f64::MAX]);
    }

    #[test]
    fn a_file_cut_short_gives_its_whole_records_then_says_so() {
        let bytes = written(3);
        let results: Vec<_> = RecordingReader::new(&bytes[..bytes.len() - 1]).unwrap().collect();
        assert_eq!(results.len(), 3);
        assert!(matches!(results[2], Err(RecordingError::Truncated { record: 2 })));
    }

    #[test]
    fn a_successor_appends_after_the_last_whole_record() {
        let below = tempfile::tempdir().unwrap();
        let path = below.path().join("samples.bin");
        let bytes = written(4);
        let (header, record) = (size_of::<Header>(), size_of::<CycleRecord>());
        // Torn anywhere: inside a record, between two, inside the header.
        for (kept, whole) in [
            (bytes.len(), 4),
            (bytes.len() - 1, 3),
            (header + record + 1, 1),
            (header + record, 1),
            (header + 5, 0),
            (header, 0),
            (header - 1, 0),
            (0, 0),
        ] {
            std::fs::write(&path, &bytes[..kept]).unwrap();
            let Resumed { mut writer, last, records } =
                RecordingWriter::resume(&path, Period::OF_SETPOINTS).unwrap();
            assert_eq!(records, whole, "{kept}");
            assert_eq!(last.map(|last| last.feedback.cycle.0 + 1).unwrap_or(0), whole, "{kept}");
            let mut next = CycleRecord::new_zeroed();
            next.feedback.cycle = Cycle(100);
            writer.write(&[next]).unwrap();
            writer.finish().unwrap();
            let reader = RecordingReader::new(BufReader::new(File::open(&path).unwrap())).unwrap();
            let cycles: Vec<u64> = reader.map(|record| record.unwrap().feedback.cycle.0).collect();
            assert_eq!(cycles, (0..whole).chain([100]).collect::<Vec<_>>(), "{kept}");
        }
        std::fs::write(&path, vec![b'x'; 4000]).unwrap();
        let error = RecordingWriter::resume(&path, Period::OF_SETPOINTS).unwrap_err();
        assert!(matches!(error, RecordingError::NotARecording), "{error}");
        assert_eq!(std::fs::read(&path).unwrap(), vec![b'x'; 4000], "left alone");
        let error =
            RecordingWriter::resume(&below.path().join("none"), Period::OF_SETPOINTS).unwrap_err();
        assert!(matches!(error, RecordingError::Io(_)), "{error}");
    }

    #[test]
    fn strangers_are_refused() {
        let mut bytes = written(1);
        assert!(matches!(RecordingReader::new(&bytes[..5]), Err(RecordingError::NotARecording)));
        bytes[32] ^= 1; // the feedback's layout hash
        let error = RecordingReader::new(&bytes[..]).unwrap_err();
        assert!(error.to_string().contains(Feedback::NAME), "{error}");
        bytes[0] = b'X';
        assert!(matches!(RecordingReader::new(&bytes[..]), Err(RecordingError::NotARecording)));
    }
}
