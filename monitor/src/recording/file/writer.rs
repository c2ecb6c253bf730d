//! Writing a recording.

use super::{CYCLES, Description, EVENTS, LEAD, MACHINE, PROPERTIES};
use crate::recording::CycleRecord;
use crate::recording::events::EventFinder;
use crate::recording::level::Level;
use crate::recording::message::schema::{CYCLE, EVENT, PACKAGE, descriptor_set};
use mcap::records::MessageHeader;
use mcap::{Attachment, McapError, WriteOptions, Writer};
use messages::{Sample, Setpoint};
use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;

/// Writes a recording, or a part of one.
pub struct RecordingWriter {
    writer: Writer<BufWriter<File>>,
    level: Level,
    description: Description,
    cycles: u16,
    events: u16,
    lead: u16,
    finder: EventFinder,
    /// Records before and in this part.
    count: u64,
    /// Bytes of messages in this part.
    size: u64,
    message: Vec<u8>,
}

impl std::fmt::Debug for RecordingWriter {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { level, count, size, .. } = self;
        write!(formatter, "RecordingWriter {{ {level:?}, {count} records, {size} bytes }}")
    }
}

impl RecordingWriter {
    /// Begins a recording in a file, in place of what may be there: a recording that is still empty can be told
    /// from no recording.
    ///
    /// # Errors
    /// Whatever the operating system reports.
    pub fn create(path: &Path, description: &Description, level: Level) -> io::Result<Self> {
        Self::continued(path, description, level, 0)
    }

    /// Begins a part of a recording that has `count` records already.
    ///
    /// # Errors
    /// Whatever the operating system reports.
    pub fn continued(
        path: &Path,
        description: &Description,
        level: Level,
        count: u64,
    ) -> io::Result<Self> {
        let options = WriteOptions::new()
            .profile(PACKAGE)
            .library(concat!("graver ", env!("CARGO_PKG_VERSION")))
            .compression(None)
            // A reader gets everything that was written, wherever the file ends.
            .use_chunks(false)
            .calculate_data_section_crc(false);
        let file = BufWriter::new(File::create(path)?);
        let mut writer = options.create(file).map_err(failed)?;
        describe(&mut writer, description).map_err(failed)?;
        let mut channel = |topic: &str, schema: &str| -> Result<u16, McapError> {
            let name = format!("{PACKAGE}.{schema}");
            let schema = writer.add_schema(&name, "protobuf", &descriptor_set())?;
            writer.add_channel(schema, topic, "protobuf", &BTreeMap::new())
        };
        let cycles = channel(CYCLES, CYCLE).map_err(failed)?;
        let events = channel(EVENTS, EVENT).map_err(failed)?;
        let lead = channel(LEAD, CYCLE).map_err(failed)?;
        writer.flush().map_err(failed)?;
        Ok(Self {
            writer,
            level,
            description: description.clone(),
            cycles,
            events,
            lead,
            finder: EventFinder::default(),
            count,
            size: 0,
            message: Vec::new(),
        })
    }

    /// What the recording says of itself.
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Records so far, of parts before it too.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Bytes of messages in this part.
    pub fn size(&self) -> u64 {
        self.size
    }

    /// Appends records, as many of them as the level keeps, and what happens in them; what the controller got in them is
    /// not known.
    ///
    /// # Errors
    /// Whatever the operating system reports.
    pub fn write(&mut self, records: &[CycleRecord]) -> io::Result<()> {
        records.iter().try_for_each(|record| self.write_cycle(record, &[]))
    }

    /// Appends a record with the setpoints that the controller took in it, as far as the level keeps them.
    ///
    /// # Errors
    /// Whatever the operating system reports.
    pub fn write_cycle(&mut self, record: &CycleRecord, setpoints: &[Setpoint]) -> io::Result<()> {
        let time = record.origin().deadline.cast_unsigned();
        if self.level >= Level::Events {
            for event in self.finder.push(record) {
                self.put(self.events, time, |out| event.put(out))?;
            }
        }
        if self.level.keeps(record, self.description.period) {
            // Of some of the cycles nobody can play anything.
            let setpoints = if self.level == Level::Full { setpoints } else { &[] };
            self.put(self.cycles, time, |out| record.put(setpoints, out))?;
            self.count += 1;
        }
        Ok(())
    }

    /// Appends a cycle of before the job, by its deadline [ns] and its message.
    ///
    /// # Errors
    /// Whatever the operating system reports.
    pub fn write_lead(&mut self, deadline: i64, message: &[u8]) -> io::Result<()> {
        if self.level < Level::Full {
            return Ok(());
        }
        self.put(self.lead, deadline.cast_unsigned(), |out| out.extend(message))
    }

    fn put(
        &mut self,
        channel_id: u16,
        log_time: u64,
        write: impl FnOnce(&mut Vec<u8>),
    ) -> io::Result<()> {
        self.message.clear();
        write(&mut self.message);
        // The number of the record, also of what belongs to it.
        let sequence = self.count as u32;
        let header = MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
        self.size += self.message.len() as u64 + HEADER;
        self.writer.write_to_known_channel(&header, &self.message).map_err(failed)
    }

    /// Hands on what is buffered.
    ///
    /// # Errors
    /// Whatever the operating system reports.
    pub fn flush(&mut self) -> io::Result<()> {
        self.writer.flush().map_err(failed)
    }

    /// Writes the end of the file, with which readers find their way quickly.
    ///
    /// # Errors
    /// Whatever the operating system reports.
    pub fn finish(mut self) -> io::Result<()> {
        self.writer.finish().map_err(failed)?;
        let file = self.writer.into_inner();
        file.into_inner().map(drop).map_err(io::IntoInnerError::into_error)
    }
}

/// Bytes of a message beside its data.
const HEADER: u64 = 31;

fn describe(writer: &mut Writer<BufWriter<File>>, it: &Description) -> Result<(), McapError> {
    let properties = [
        ("period", it.period.time().0.to_string()),
        ("stream", it.stream.to_string()),
        ("clock", if it.simulated { "virtual" } else { "monotonic" }.to_owned()),
        ("seed", it.seed.to_string()),
        ("actuators", it.actuators.join(",")),
        ("feedback", messages::Feedback::NAME.to_owned()),
        ("command", messages::Command::NAME.to_owned()),
    ];
    let metadata = properties.map(|(key, value)| (key.to_owned(), value)).into();
    writer.write_metadata(&mcap::records::Metadata { name: PROPERTIES.to_owned(), metadata })?;
    if !it.machine.is_empty() {
        writer.attach(&Attachment {
            log_time: 0,
            create_time: 0,
            name: MACHINE.to_owned(),
            media_type: "application/json".to_owned(),
            data: Cow::Borrowed(it.machine.as_bytes()),
        })?;
    }
    Ok(())
}

fn failed(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        other => io::Error::other(other),
    }
}
