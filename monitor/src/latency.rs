//! Latency histograms per hop, and their interval log that the HdrHistogram tools read.

use crate::recording::CycleRecord;
use hdrhistogram::Histogram;
use hdrhistogram::serialization::V2DeflateSerializer;
use hdrhistogram::serialization::interval_log::{
    IntervalLogIterator, IntervalLogWriterBuilder, IntervalLogWriterError, LogEntry, Tag,
};
use messages::Nanoseconds;
use messages::hop::{Hop, latencies};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Read, Seek, SeekFrom, Write};
use std::path::Path;
use std::time::{Duration, SystemTime};

/// The longest latency told apart from longer ones [ns]: 100 s.
const LONGEST: u64 = 100_000_000_000;

/// Decimal digits that a histogram keeps of a latency: 0.1 %.
const DIGITS: u8 = 3;

/// The distribution of one hop's latency [ns].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct HopLatency {
    /// How many were measured.
    pub count: u64,
    /// The shortest.
    pub min: u64,
    /// The median.
    pub p50: u64,
    /// 99 of 100 are at most this.
    pub p99: u64,
    /// 999 of 1000 are at most this.
    pub p999: u64,
    /// The longest.
    pub max: u64,
}

impl HopLatency {
    /// The figures of a histogram.
    pub fn of(histogram: &Histogram<u64>) -> Self {
        Self {
            count: histogram.len(),
            min: histogram.min(),
            p50: histogram.value_at_quantile(0.5),
            p99: histogram.value_at_quantile(0.99),
            p999: histogram.value_at_quantile(0.999),
            max: histogram.max(),
        }
    }
}

/// One histogram per hop over a whole run, and one over the interval since the last
/// [`Self::write_interval`]. Recording never allocates.
#[derive(Debug)]
pub struct HopHistograms {
    total: [Histogram<u64>; Hop::ALL.len()],
    interval: [Histogram<u64>; Hop::ALL.len()],
    waiting: Option<CycleRecord>,
}

impl Default for HopHistograms {
    fn default() -> Self {
        Self {
            total: std::array::from_fn(|_| histogram()),
            interval: std::array::from_fn(|_| histogram()),
            waiting: None,
        }
    }
}

/// An empty histogram of 1 ns to 100 s, three digits.
fn histogram() -> Histogram<u64> {
    // The bounds are constants that the crate accepts; a test holds them to that.
    Histogram::new_with_bounds(1, LONGEST, DIGITS)
        .unwrap_or_else(|error| unreachable!("constant bounds refused: {error}"))
}

impl HopHistograms {
    /// Empty histograms.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes the next record. Its latencies count once the record after it has come, which tells
    /// when its command was applied.
    pub fn push(&mut self, record: &CycleRecord) {
        if let Some(answered) = self.waiting.replace(*record)
            && answered.is_answered()
        {
            for (hop, latency) in latencies(&answered.feedback, &answered.command, &record.feedback)
            {
                self.record(hop, latency);
            }
        }
    }

    /// Counts one latency; a negative one as 0, one beyond 100 s as 100 s.
    pub fn record(&mut self, hop: Hop, latency: Nanoseconds) {
        let value = u64::try_from(latency.0).unwrap_or(0);
        let index = hop as usize;
        for histograms in [&mut self.total, &mut self.interval] {
            if let Some(histogram) = histograms.get_mut(index) {
                histogram.saturating_record(value);
            }
        }
    }

    /// The figures of every hop that happened, by its name.
    pub fn summary(&self) -> BTreeMap<String, HopLatency> {
        self.named()
            .filter(|(_, histogram)| !histogram.is_empty())
            .map(|(hop, histogram)| (hop.name().to_owned(), HopLatency::of(histogram)))
            .collect()
    }

    /// Every hop with its histogram over the whole run, in the order of reports.
    pub fn named(&self) -> impl Iterator<Item = (Hop, &Histogram<u64>)> {
        Hop::ALL.into_iter().zip(&self.total)
    }

    /// Appends the interval since the last call to `log`, and empties it.
    ///
    /// # Errors
    /// Whatever the writer reports.
    pub fn write_interval<W: Write>(
        &mut self,
        log: &mut IntervalLog<W>,
        start: Duration,
        duration: Duration,
    ) -> io::Result<()> {
        for (hop, histogram) in Hop::ALL.into_iter().zip(&mut self.interval) {
            if !histogram.is_empty() {
                log.write(hop, histogram, start, duration)?;
                histogram.reset();
            }
        }
        Ok(())
    }
}

/// `latency.hlog`: HdrHistogram's interval log, one tagged line per hop and interval, V2
/// compressed, values in nanoseconds, times relative to the start of the log.
pub struct IntervalLog<W: Write> {
    writer: W,
    serializer: V2DeflateSerializer,
}

impl<W: Write> IntervalLog<W> {
    /// Starts a log in `writer` with the wall-clock time at which it begins.
    ///
    /// # Errors
    /// Whatever the writer reports.
    pub fn new(mut writer: W, begin: SystemTime) -> io::Result<Self> {
        let mut serializer = V2DeflateSerializer::new();
        // The readers of other languages look for this line before anything else.
        IntervalLogWriterBuilder::new()
            .add_comment("[Histogram log format version 1.3]")
            .add_comment("Graver: latency per hop [ns], the tag is the hop")
            .with_start_time(begin)
            .with_base_time(begin)
            .begin_log_with(&mut writer, &mut serializer)?;
        let legend = "\"StartTimestamp\",\"Interval_Length\",\"Interval_Max\",\
                      \"Interval_Compressed_Histogram\"";
        writeln!(writer, "{legend}")?;
        Ok(Self { writer, serializer })
    }

    /// Appends one hop over the interval that began at `start` after the start of the log.
    ///
    /// # Errors
    /// Whatever the writer reports.
    pub fn write(
        &mut self,
        hop: Hop,
        histogram: &Histogram<u64>,
        start: Duration,
        duration: Duration,
    ) -> io::Result<()> {
        let mut log = IntervalLogWriterBuilder::new()
            .begin_log_with(&mut self.writer, &mut self.serializer)?;
        log.write_histogram(histogram, start, duration, Tag::new(hop.name())).map_err(|error| {
            match error {
                IntervalLogWriterError::IoError(error) => error,
                IntervalLogWriterError::SerializeError(error) => io::Error::other(error),
            }
        })
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

/// Bytes at the beginning of a log that hold its start time, and more than a line of it has at its
/// end.
const HEAD: u64 = 512;
const LONGEST_LINE: u64 = 1 << 16;

impl IntervalLog<BufWriter<File>> {
    /// Begins a log in a file, in place of what may be there.
    ///
    /// # Errors
    /// Whatever the operating system reports.
    pub fn create(path: &Path) -> io::Result<Self> {
        Self::new(BufWriter::new(File::create(path)?), SystemTime::now())
    }

    /// Goes on with a log that another process left, a line that it did not complete cut off; gives
    /// the time since that log began. One without a beginning is begun anew.
    ///
    /// # Errors
    /// Whatever the operating system reports.
    pub fn resume(path: &Path) -> io::Result<(Self, Duration)> {
        let mut file =
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path)?;
        let Some(begin) = begin_of(&mut file)? else {
            return Ok((Self::create(path)?, Duration::ZERO));
        };
        let length = file.seek(SeekFrom::End(0))?;
        let tail = length.saturating_sub(LONGEST_LINE);
        file.seek(SeekFrom::Start(tail))?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes)?;
        let whole = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1);
        file.set_len(tail + whole as u64)?;
        file.seek(SeekFrom::End(0))?;
        let log = Self { writer: BufWriter::new(file), serializer: V2DeflateSerializer::new() };
        // A wall clock that was set back makes the log's times begin anew, no more.
        Ok((log, SystemTime::now().duration_since(begin).unwrap_or_default()))
    }
}

/// When the log in a file began, if it says so.
fn begin_of(file: &mut File) -> io::Result<Option<SystemTime>> {
    let mut head = Vec::new();
    file.take(HEAD).read_to_end(&mut head)?;
    let begin = IntervalLogIterator::new(&head).find_map(|entry| match entry {
        Ok(LogEntry::StartTime(begin)) => Some(SystemTime::UNIX_EPOCH + begin),
        _ => None,
    });
    Ok(begin)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use hdrhistogram::serialization::Deserializer;
    use messages::{Command, Cycle, Feedback};

    fn record(cycle: u64) -> CycleRecord {
        let start = 1_000_000_000 + cycle as i64 * 1_000_000;
        let at = |offset: i64| Nanoseconds(start + offset);
        CycleRecord {
            feedback: Feedback {
                cycle: Cycle(cycle),
                deadline: at(0),
                measured: at(2_000),
                published: at(5_000),
                exchange: Nanoseconds(3_000),
                command_cycle: Cycle(cycle.saturating_sub(1)),
                command_received: at(-1_000_000 + 60_000),
                command_published: at(-1_000_000 + 50_000),
                command_applied: at(1_000),
                ..Feedback::default()
            },
            command: Command {
                cycle: Cycle(cycle),
                received: at(20_000),
                published: at(50_000),
                setpoint_published: at(-80_000_000),
                mode: 4,
                ..Command::default()
            },
        }
    }

    #[test]
    fn every_hop_is_what_the_stamps_say() {
        let mut histograms = HopHistograms::new();
        (0..=1000).for_each(|cycle| histograms.push(&record(cycle)));
        let summary = histograms.summary();
        for (hop, expected) in [
            ("wake", 20_000),
            ("compute", 30_000),
            ("command", 10_000),
            ("exchange", 3_000),
            ("feedback", 15_000),
            ("loop", 999_000),
            ("setpoint", 80_020_000),
        ] {
            let latency = summary[hop];
            assert_eq!(latency.count, 1000, "{hop}");
            // Three digits: within 0.1 %.
            for value in [latency.min, latency.p50, latency.p999, latency.max] {
                assert!(value.abs_diff(expected) <= expected / 1000, "{hop}: {latency:?}");
            }
        }
    }

    #[test]
    fn out_of_range_is_kept_at_the_bound() {
        let mut histograms = HopHistograms::new();
        histograms.record(Hop::Loop, Nanoseconds(-5));
        histograms.record(Hop::Loop, Nanoseconds(i64::MAX));
        let latency = histograms.summary()["loop"];
        assert_eq!((latency.count, latency.min), (2, 0));
        assert!(latency.max >= LONGEST);
    }

    #[test]
    fn the_interval_log_reads_back() {
        let mut histograms = HopHistograms::new();
        let begin = SystemTime::UNIX_EPOCH + Duration::from_secs(1_700_000_000);
        let mut log = IntervalLog::new(Vec::new(), begin).unwrap();
        for second in 0..3 {
            (0..=100).for_each(|cycle| histograms.push(&record(1000 * second + cycle)));
            let start = Duration::from_secs(second);
            histograms.write_interval(&mut log, start, Duration::from_secs(1)).unwrap();
        }
        let bytes = log.finish().unwrap();
        let mut deserializer = Deserializer::new();
        let mut counts = BTreeMap::new();
        for entry in IntervalLogIterator::new(&bytes) {
            match entry.unwrap() {
                LogEntry::Interval(interval) => {
                    let text = interval.encoded_histogram();
                    let histogram: Histogram<u64> = {
                        use base64::Engine as _;
                        let bytes = base64::engine::general_purpose::STANDARD.decode(text).unwrap();
                        deserializer.deserialize(&mut bytes.as_slice()).unwrap()
                    };
                    let tag = interval.tag().unwrap().as_str().to_owned();
                    *counts.entry(tag).or_insert(0) += histogram.len();
                }
                LogEntry::StartTime(time) | LogEntry::BaseTime(time) => {
                    assert_eq!(time, Duration::from_secs(1_700_000_000));
                }
            }
        }
        assert_eq!(counts.len(), Hop::ALL.len());
        // The record that ends one second also answers for the last of the second before.
        assert_eq!(counts["wake"], 100 + 101 + 101);
    }

    #[test]
    fn a_successor_goes_on_with_the_log_of_its_predecessor() {
        let below = tempfile::tempdir().unwrap();
        let path = below.path().join("latency.hlog");
        let second = Duration::from_secs(1);
        let lines = |path: &Path| std::fs::read_to_string(path).unwrap().lines().count();
        let write = |mut log: IntervalLog<BufWriter<File>>, start: Duration| {
            let mut histograms = HopHistograms::new();
            (0..=100).for_each(|cycle| histograms.push(&record(cycle)));
            histograms.write_interval(&mut log, start, second).unwrap();
            log.finish().unwrap();
        };
        // Nothing there, or no more than a torn beginning: begun anew.
        for beginning in ["", "#[Histogram log"] {
            std::fs::write(&path, beginning).unwrap();
            let (log, since) = IntervalLog::resume(&path).unwrap();
            assert_eq!(since, Duration::ZERO);
            write(log, since);
        }
        let whole = lines(&path);
        let mut torn = std::fs::read(&path).unwrap();
        let kept = torn.len();
        torn.extend(b"Tag=wake,12.0,1.0");
        std::fs::write(&path, &torn).unwrap();
        let (log, since) = IntervalLog::resume(&path).unwrap();
        assert_eq!(std::fs::metadata(&path).unwrap().len(), kept as u64);
        write(log, since + second);
        assert_eq!(lines(&path), whole + Hop::ALL.len());
        let bytes = std::fs::read(&path).unwrap();
        let starts: Vec<_> = IntervalLogIterator::new(&bytes)
            .filter_map(|entry| match entry.unwrap() {
                LogEntry::Interval(interval) => Some(interval.start_timestamp()),
                _ => None,
            })
            .collect();
        assert_eq!(starts.len(), 2 * Hop::ALL.len());
        assert!(starts[..Hop::ALL.len()].iter().all(|start| *start == Duration::ZERO));
        assert!(starts[Hop::ALL.len()..].iter().all(|start| *start >= second));
    }
}
