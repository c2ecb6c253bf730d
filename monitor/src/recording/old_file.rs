//! `samples.bin`, as earlier versions recorded: the records as they stood in memory, behind a header that says what they are.
//! It is only read.

mod samples;

use super::CycleRecord;
use super::file::RecordingError;
use messages::time::Period;
use messages::{Nanoseconds, Sample, sample};
use samples::{OldCommand, OldFeedback, OldRecord};
use std::io::{self, Read};
use zerocopy::{FromZeros, IntoBytes};

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

    /// The header that such a file has, for cycles of this `period`.
    pub fn of(period: Period) -> Self {
        Self {
            magic: Self::MAGIC,
            layout: Self::LAYOUT,
            record_size: size_of::<OldRecord>() as u64,
            period: period.time(),
            feedback_layout: OldFeedback::LAYOUT,
            command_layout: OldCommand::LAYOUT,
            feedback: name_bytes(OldFeedback::NAME),
            command: name_bytes(OldCommand::NAME),
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

/// Reads a recording, record by record, as an iterator that ends at the first error.
#[derive(Debug)]
pub struct OldReader<R: Read> {
    reader: R,
    period: Period,
    count: u64,
    ended: bool,
}

impl<R: Read> OldReader<R> {
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
                OldFeedback::NAME,
                OldFeedback::LAYOUT,
            ),
            (
                &name_text(&header.command),
                header.command_layout,
                OldCommand::NAME,
                OldCommand::LAYOUT,
            ),
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
        let mut record = OldRecord::new_zeroed();
        let mut filled = 0;
        while let Some(rest) =
            record.as_mut_bytes().get_mut(filled..).filter(|rest| !rest.is_empty())
        {
            match self.reader.read(rest) {
                Ok(0) if filled == 0 => return Ok(None),
                Ok(0) => return Err(RecordingError::Truncated { record: self.count }),
                Ok(read) => filled += read,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error.into()),
            }
        }
        self.count += 1;
        let (feedback, command) = ((&record.feedback).into(), (&record.command).into());
        Ok(Some(CycleRecord { feedback, command }))
    }
}

impl<R: Read> Iterator for OldReader<R> {
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

    /// A file as it was written.
    fn written(count: u64) -> Vec<u8> {
        let mut bytes = Header::of(Period::OF_SETPOINTS).as_bytes().to_vec();
        for cycle in 0..count {
            let mut record = OldRecord::new_zeroed();
            record.feedback.cycle = Cycle(cycle);
            record.feedback.tool = [0.25 * cycle as f64, -1e-9, f64::MAX];
            record.command.cycle = Cycle(cycle);
            record.command.outputs = 5;
            record.command.stream_time = 1e-3 * cycle as f64;
            record.command.fault.code = 9;
            bytes.extend(record.as_bytes());
        }
        bytes
    }

    #[test]
    fn what_was_written_is_read() {
        let bytes = written(10);
        assert_eq!(&bytes[..8], b"GRAVERec");
        let records: Vec<_> = OldReader::new(&bytes[..]).unwrap().map(Result::unwrap).collect();
        assert_eq!(records.len(), 10);
        assert_eq!(records[3].feedback.tool, [0.75, -1e-9, f64::MAX]);
        let command = &records[3].command;
        assert_eq!((command.cycle, command.outputs, command.homing), (Cycle(3), 5, 0));
        assert_eq!((command.stream_time, command.fault.code), (3e-3, 9));
        let results: Vec<_> = OldReader::new(&bytes[..bytes.len() - 1]).unwrap().collect();
        assert_eq!(results.len(), 10);
        assert!(matches!(results[9], Err(RecordingError::Truncated { record: 9 })));
    }

    #[test]
    fn the_layouts_are_those_in_the_files_that_there_are() {
        let layouts = [OldFeedback::LAYOUT, OldCommand::LAYOUT];
        assert_eq!(layouts, [0x6102_41cc_40b1_2de3, 0x8bb3_55d6_a558_7792]);
        assert_eq!(size_of::<OldRecord>(), 2176);
    }

    #[test]
    fn strangers_are_refused() {
        let mut bytes = written(1);
        assert!(matches!(OldReader::new(&bytes[..5]), Err(RecordingError::NotARecording)));
        bytes[32] ^= 1; // the feedback's layout hash
        let error = OldReader::new(&bytes[..]).unwrap_err();
        assert!(error.to_string().contains(OldFeedback::NAME), "{error}");
        bytes[0] = b'X';
        assert!(matches!(OldReader::new(&bytes[..]), Err(RecordingError::NotARecording)));
    }
}
