//! A recording as a table of comma-separated values that any spreadsheet reads. SI units and
//! radians.

use super::CycleRecord;
use crate::trace::lit_share;
use messages::MAX_ACTUATORS;
use messages::feedback::status;
use messages::time::Period;
use std::io::{self, Write};

/// Writes one line a record under a line of column names.
///
/// `cycle` counts from the start of drives; `stream_time` [s], `rate` and `stroke` are the
/// command's. `lit` is the share of the time since the record before in which the laser marked, 0..=1; `frequency` is what its
/// source was asked for [pulses/s], 0 as it is set; `tool_x`,
/// `tool_y`, `tool_z` and `planned_…` are places in the machine frame [m]. Then per actuator reference
/// and position at the motor [rad], current measured [A] and voltage commanded, in volts.
///
/// What was not known is an empty field: the command's in a cycle that the controller did not
/// answer, the tool's without a tool position.
#[derive(Debug)]
pub struct TableWriter<W: Write> {
    writer: W,
    actuators: usize,
    period: Period,
}

impl<W: Write> TableWriter<W> {
    /// Writes the column names to `writer`, which should be buffered, for cycles of this `period`. `actuators` are the names of the
    /// machine's actuators; those beyond [`MAX_ACTUATORS`], which samples do not carry, are left out.
    ///
    /// # Errors
    /// Whatever the writer reports.
    pub fn new(mut writer: W, actuators: &[String], period: Period) -> io::Result<Self> {
        write!(writer, "cycle,stream_time,rate,stroke,lit,frequency,tool_x,tool_y,tool_z")?;
        write!(writer, ",planned_x,planned_y,planned_z")?;
        for name in actuators.iter().take(MAX_ACTUATORS) {
            write!(writer, ",{name}_reference,{name}_position,{name}_current,{name}_voltage")?;
        }
        writeln!(writer)?;
        Ok(Self { writer, actuators: actuators.len().min(MAX_ACTUATORS), period })
    }

    /// Appends a record.
    ///
    /// # Errors
    /// Whatever the writer reports.
    pub fn write(&mut self, record: &CycleRecord) -> io::Result<()> {
        let CycleRecord { feedback, command } = record;
        let answered = record.is_answered();
        write!(self.writer, "{}", feedback.cycle.0)?;
        self.field(answered, command.stream_time)?;
        self.field(answered, command.rate)?;
        self.field(answered, command.stroke)?;
        self.field(true, lit_share(&feedback.laser, self.period.of(feedback.elapsed())))?;
        self.field(true, feedback.laser.frequency)?;
        for value in feedback.tool {
            self.field(feedback.has(status::TOOL_KNOWN), value)?;
        }
        for value in command.tool {
            self.field(answered, value)?;
        }
        let columns = command
            .reference
            .iter()
            .zip(&feedback.position)
            .zip(feedback.current.iter().zip(&command.voltage));
        for ((reference, position), (current, voltage)) in columns.take(self.actuators) {
            self.field(answered, reference)?;
            self.field(true, position)?;
            self.field(true, current)?;
            self.field(answered, voltage)?;
        }
        writeln!(self.writer)
    }

    /// Flushes.
    ///
    /// # Errors
    /// Whatever the writer reports.
    pub fn finish(mut self) -> io::Result<()> {
        self.writer.flush()
    }

    fn field(&mut self, known: bool, value: impl std::fmt::Display) -> io::Result<()> {
        if known { write!(self.writer, ",{value}") } else { write!(self.writer, ",") }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use messages::{Command, Cycle};
    use zerocopy::FromZeros;

    fn table(records: &[CycleRecord]) -> Vec<Vec<String>> {
        let mut text = Vec::new();
        let mut table =
            TableWriter::new(&mut text, &["x".into(), "y".into()], Period::OF_SETPOINTS).unwrap();
        records.iter().for_each(|record| table.write(record).unwrap());
        table.finish().unwrap();
        let text = String::from_utf8(text).unwrap();
        text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
    }

    fn column(lines: &[Vec<String>], line: usize, name: &str) -> String {
        let column = lines[0].iter().position(|column| column == name).unwrap();
        lines[line][column].clone()
    }

    #[test]
    fn every_line_has_the_columns_of_the_first() {
        let mut record = CycleRecord::new_zeroed();
        record.feedback.cycle = Cycle(7);
        record.feedback.status = status::TOOL_KNOWN;
        record.feedback.tool = [0.1, 0.2, 0.0];
        record.feedback.laser.frequency = 20e3;
        record.command = Command { cycle: Cycle(7), rate: 0.5, ..Command::default() };
        record.command.voltage[1] = -3.5;
        let lines = table(&[record, record]);
        assert_eq!(lines.len(), 3);
        assert!(lines.iter().all(|line| line.len() == 20), "{lines:?}");
        for (name, value) in
            [("cycle", "7"), ("rate", "0.5"), ("frequency", "20000"), ("tool_y", "0.2")]
        {
            assert_eq!(column(&lines, 1, name), value);
        }
        assert_eq!(column(&lines, 2, "y_voltage"), "-3.5");
    }

    #[test]
    fn what_was_not_known_is_empty() {
        let mut record = CycleRecord::new_zeroed();
        record.feedback.cycle = Cycle(7);
        record.feedback.position[1] = 1.25;
        let lines = table(&[record]);
        assert_eq!(lines[1].len(), lines[0].len());
        for name in ["stream_time", "stroke", "tool_x", "planned_z", "x_reference", "y_voltage"] {
            assert_eq!(column(&lines, 1, name), "", "{name}");
        }
        assert_eq!(
            (column(&lines, 1, "y_position"), column(&lines, 1, "lit")),
            ("1.25".into(), "0".into())
        );
    }
}
