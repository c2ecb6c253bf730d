//! `samples.csv`: the records as a table that any spreadsheet reads. SI units and radians.

use super::CycleRecord;
use crate::trace::lit_share;
use std::io::{self, Write};

/// Writes one line per record under a line of column names.
///
/// `axes` are the names of the machine's axes; samples carry no more of them than
/// [`signals::MAX_AXES`]. Per axis: reference and position [rad], current [A] measured, voltage [V]
/// commanded. `lit` is the share of the finished cycle in which the laser marked, 0..=1.
///
/// # Errors
/// Whatever the writer reports.
pub fn write_table<'a>(
    writer: &mut impl Write,
    axes: &[String],
    records: impl IntoIterator<Item = &'a CycleRecord>,
) -> io::Result<()> {
    write!(writer, "cycle,stream_time,rate,stroke,lit,tool_x,tool_y,tool_z")?;
    write!(writer, ",planned_x,planned_y,planned_z")?;
    for axis in axes {
        write!(writer, ",{axis}_reference,{axis}_position,{axis}_current,{axis}_voltage")?;
    }
    writeln!(writer)?;
    for CycleRecord { feedback, command } in records {
        let lit = lit_share(&feedback.laser);
        write!(writer, "{},{},{}", feedback.cycle.0, command.stream_time, command.rate)?;
        write!(writer, ",{},{lit}", command.stroke)?;
        for value in feedback.tool.iter().chain(&command.tool) {
            write!(writer, ",{value}")?;
        }
        let columns = command
            .reference
            .iter()
            .zip(&feedback.position)
            .zip(feedback.current.iter().zip(&command.voltage));
        for (_, ((reference, position), (current, voltage))) in axes.iter().zip(columns) {
            write!(writer, ",{reference},{position},{current},{voltage}")?;
        }
        writeln!(writer)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use zerocopy::FromZeros;

    #[test]
    fn every_line_has_the_columns_of_the_first() {
        let mut record = CycleRecord::new_zeroed();
        record.feedback.tool = [0.1, 0.2, 0.0];
        record.command.voltage[1] = -3.5;
        let mut text = Vec::new();
        write_table(&mut text, &["x".into(), "y".into()], &[record, record]).unwrap();
        let text = String::from_utf8(text).unwrap();
        let lines: Vec<Vec<&str>> = text.lines().map(|line| line.split(',').collect()).collect();
        assert_eq!(lines.len(), 3);
        assert!(lines.iter().all(|line| line.len() == 19), "{text}");
        let column = lines[0].iter().position(|name| *name == "y_voltage").unwrap();
        assert_eq!(lines[2][column], "-3.5");
    }
}
