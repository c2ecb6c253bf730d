//! Reading a recording, record by record, in bounded memory.

use super::{CYCLES, Description, EVENTS, LEAD, MACHINE, PROPERTIES, RecordingError};
use crate::recording::CycleRecord;
use crate::recording::events::Event;
use crate::recording::wire::Malformed;
use mcap::records::{Record, op};
use mcap::{MAGIC, parse_record};
use messages::time::Period;
use messages::{Nanoseconds, Setpoint};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufReader, ErrorKind, Read};
use std::path::Path;

/// The longest record that is read [bytes]: the description of a machine is far shorter.
const LONGEST: u64 = 64 << 20;

/// What stands in a recording, in order.
#[derive(Debug, Clone, PartialEq)]
pub enum Entry {
    /// A cycle of before the job, with the setpoints that the controller took in it.
    Lead(Box<CycleRecord>, Vec<Setpoint>),
    /// A record, with the same.
    Cycle(Box<CycleRecord>, Vec<Setpoint>),
    /// Something that happened.
    Event(Event),
}

/// A file between two of its records.
struct Records<R: Read> {
    reader: R,
    body: Vec<u8>,
}

/// What was found where a record should begin.
enum Next {
    Record(u8),
    /// Nothing: the file ends between two records.
    Nothing,
    /// Part of a record.
    Torn,
}

impl<R: Read> Records<R> {
    /// Reads the next record into `body`.
    fn next(&mut self) -> Result<Next, RecordingError> {
        let mut head = [0; 9];
        let read = fill(&mut self.reader, &mut head)?;
        let [opcode, length @ ..] = head;
        let length = u64::from_le_bytes(length);
        match read {
            0 => return Ok(Next::Nothing),
            9 => {}
            _ => return Ok(Next::Torn),
        }
        if length > LONGEST {
            let reason = format!("a record of {length} bytes");
            return Err(RecordingError::Damaged { record: 0, reason });
        }
        self.body.resize(length as usize, 0);
        let read = fill(&mut self.reader, &mut self.body)?;
        Ok(if read as u64 == length { Next::Record(opcode) } else { Next::Torn })
    }
}

/// Reads as much of `bytes` as there is.
fn fill(reader: &mut impl Read, bytes: &mut [u8]) -> io::Result<usize> {
    let mut filled = 0;
    while let Some(rest) = bytes.get_mut(filled..).filter(|rest| !rest.is_empty()) {
        match reader.read(rest) {
            Ok(0) => break,
            Ok(count) => filled += count,
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(filled)
}

/// Reads all that stands in a recording; an iterator that ends at the first error.
pub struct EntryReader<R: Read> {
    records: Records<R>,
    description: Description,
    topics: BTreeMap<u16, String>,
    /// Whether setpoints are read too.
    whole: bool,
    /// A message that was read with the description.
    pending: bool,
    /// The sequence number of the newest record.
    sequence: Option<u32>,
    count: u64,
    ended: bool,
}

impl EntryReader<BufReader<File>> {
    /// Opens a recording.
    ///
    /// # Errors
    /// [`RecordingError`] when the file cannot be read, or is no recording.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        Self::new(buffered(path)?)
    }
}

fn buffered(path: &Path) -> io::Result<BufReader<File>> {
    Ok(BufReader::with_capacity(1 << 16, File::open(path)?))
}

impl<R: Read> EntryReader<R> {
    /// Reads what the recording says of itself; `reader` should be buffered.
    ///
    /// # Errors
    /// [`RecordingError`] when this is no recording.
    pub fn new(mut reader: R) -> Result<Self, RecordingError> {
        let mut magic = [0; MAGIC.len()];
        let read = fill(&mut reader, &mut magic)?;
        if read < magic.len() && MAGIC.starts_with(magic.get(..read).unwrap_or(&[])) {
            return Err(RecordingError::Truncated { record: 0 });
        }
        if magic[..] != *MAGIC {
            return Err(RecordingError::NotARecording);
        }
        let mut found = Self {
            records: Records { reader, body: Vec::new() },
            description: Description::of(Period::OF_SETPOINTS),
            topics: BTreeMap::new(),
            whole: true,
            pending: false,
            sequence: None,
            count: 0,
            ended: false,
        };
        let mut described = false;
        while !found.ended && !found.pending {
            match found.records.next()? {
                Next::Record(op::MESSAGE) => found.pending = true,
                Next::Record(op::DATA_END) | Next::Nothing => found.ended = true,
                Next::Torn if !described => return Err(RecordingError::Truncated { record: 0 }),
                Next::Torn => break,
                Next::Record(opcode) => described |= found.describe(opcode)?,
            }
        }
        match described {
            true => Ok(found),
            // Cut between two records of the beginning.
            false if found.ended => Err(RecordingError::Truncated { record: 0 }),
            false => Err(RecordingError::NotARecording),
        }
    }

    /// Takes a record of the description; whether it is the one that says what the run is.
    fn describe(&mut self, opcode: u8) -> Result<bool, RecordingError> {
        let damaged = |error: mcap::McapError| RecordingError::Damaged {
            record: 0,
            reason: error.to_string(),
        };
        match parse_record(opcode, &self.records.body).map_err(damaged)? {
            Record::Channel(channel) => {
                self.topics.insert(channel.id, channel.topic);
            }
            Record::Attachment { header, data, .. } if header.name == MACHINE => {
                self.description.machine = String::from_utf8_lossy(&data).into_owned();
            }
            Record::Metadata(metadata) if metadata.name == PROPERTIES => {
                let text = |key: &str| metadata.metadata.get(key).map_or("", String::as_str);
                let number = |key: &str| text(key).parse::<u64>().ok();
                let period = text("period").parse().ok().map(Nanoseconds).and_then(Period::new);
                self.description.period = period.ok_or(RecordingError::NotARecording)?;
                self.description.stream = number("stream").unwrap_or(0);
                self.description.seed = number("seed").unwrap_or(0);
                self.description.simulated = text("clock") == "virtual";
                let names = text("actuators").split(',').filter(|name| !name.is_empty());
                self.description.actuators = names.map(str::to_owned).collect();
                return Ok(true);
            }
            _ => {}
        }
        Ok(false)
    }

    /// The same for the records alone, or for setpoints and what was before the job too.
    pub(super) fn reading(self, whole: bool) -> Self {
        Self { whole, ..self }
    }

    /// What the recording says of itself.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// How many records stand before the end of what was read, those of parts before it too.
    pub fn total(&self) -> u64 {
        self.sequence.map_or(0, |sequence| u64::from(sequence) + 1)
    }

    fn entry(&mut self) -> Result<Option<Entry>, RecordingError> {
        loop {
            let opcode = if std::mem::take(&mut self.pending) {
                op::MESSAGE
            } else {
                match self.records.next()? {
                    Next::Record(opcode) => opcode,
                    Next::Nothing | Next::Torn => {
                        return Err(RecordingError::Truncated { record: self.count });
                    }
                }
            };
            match opcode {
                op::DATA_END => return Ok(None),
                op::MESSAGE => {
                    if let Some(entry) = self.message()? {
                        return Ok(Some(entry));
                    }
                }
                _ => {
                    self.describe(opcode)?;
                }
            }
        }
    }

    /// The message in the body; `None` on a channel that is not known.
    fn message(&mut self) -> Result<Option<Entry>, RecordingError> {
        let count = self.count;
        let damaged = |error: mcap::McapError| RecordingError::Damaged {
            record: count,
            reason: error.to_string(),
        };
        let record = parse_record(op::MESSAGE, &self.records.body).map_err(damaged)?;
        let Record::Message { header, data } = record else { return Ok(None) };
        let malformed = RecordingError::damaged(self.count);
        let topic = self.topics.get(&header.channel_id).map(String::as_str);
        let whole = self.whole;
        let cycle = || -> Result<(Box<CycleRecord>, Vec<Setpoint>), Malformed> {
            let record = CycleRecord::take(&data, header.log_time)?;
            let setpoints = if whole { record.take_setpoints(&data)? } else { Vec::new() };
            Ok((Box::new(record), setpoints))
        };
        let entry = match topic {
            Some(CYCLES) => cycle().map(|(record, setpoints)| Entry::Cycle(record, setpoints)),
            Some(EVENTS) => Event::take(&data).map(Entry::Event),
            Some(LEAD) if whole => {
                cycle().map(|(record, setpoints)| Entry::Lead(record, setpoints))
            }
            _ => return Ok(None),
        };
        if topic == Some(CYCLES) {
            self.sequence = Some(header.sequence);
            self.count += 1;
        }
        entry.map(Some).map_err(malformed)
    }
}

impl<R: Read> Iterator for EntryReader<R> {
    type Item = Result<Entry, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ended {
            return None;
        }
        let entry = self.entry().transpose();
        self.ended = !matches!(entry, Some(Ok(_)));
        entry
    }
}

/// Reads the records of a recording; an iterator that ends at the first error.
pub struct RecordingReader<R: Read> {
    entries: EntryReader<R>,
}

impl RecordingReader<BufReader<File>> {
    /// Opens a recording.
    ///
    /// # Errors
    /// [`RecordingError`] when the file cannot be read, or is no recording.
    pub fn open(path: &Path) -> Result<Self, RecordingError> {
        Self::new(buffered(path)?)
    }
}

impl<R: Read> RecordingReader<R> {
    /// Reads what the recording says of itself; `reader` should be buffered.
    ///
    /// # Errors
    /// [`RecordingError`] when this is no recording.
    pub fn new(reader: R) -> Result<Self, RecordingError> {
        Ok(Self { entries: EntryReader::new(reader)?.reading(false) })
    }

    /// What the recording says of itself.
    pub fn description(&self) -> &Description {
        self.entries.description()
    }

    /// The period of the cycle.
    pub fn period(&self) -> Period {
        self.description().period
    }

    /// How many records stand before the end of what was read, those of parts before it too.
    pub fn total(&self) -> u64 {
        self.entries.total()
    }
}

impl<R: Read> Iterator for RecordingReader<R> {
    type Item = Result<CycleRecord, RecordingError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.entries.find_map(|entry| match entry {
            Ok(Entry::Cycle(record, _)) => Some(Ok(*record)),
            Ok(_) => None,
            Err(error) => Some(Err(error)),
        })
    }
}
