//! What was written is read, wherever the file was cut.
#![allow(clippy::unwrap_used)]

use super::reader::{Entry, EntryReader, RecordingReader};
use super::writer::RecordingWriter;
use super::*;
use crate::recording::CycleRecord;
use crate::recording::level::Level;
use messages::Setpoint;
use messages::random::SplitMix64;
use zerocopy::{FromZeros as _, IntoBytes as _};

/// A record of which every bit is random, but that its stamps say what cycle it is.
fn noise(random: &mut SplitMix64) -> CycleRecord {
    let mut record = CycleRecord::new_zeroed();
    record.as_mut_bytes().chunks_mut(8).for_each(|word| {
        // As many zeros as there are in a true one.
        if random.below(3) == 0 {
            let noise = random.below(u64::MAX).to_le_bytes();
            word.iter_mut().zip(noise).for_each(|(byte, noise)| *byte = noise);
        }
    });
    record
}

fn description() -> Description {
    Description {
        stream: 7,
        simulated: true,
        seed: 3,
        actuators: vec!["x".into(), "y.left".into()],
        machine: "{\"file\": null}".into(),
        ..Description::of(Period::OF_SETPOINTS)
    }
}

#[test]
fn every_bit_comes_back() {
    let below = tempfile::tempdir().unwrap();
    let path = below.path().join("samples.mcap");
    let mut random = SplitMix64::new(4);
    let mut records: Vec<_> = (0..300).map(|_| noise(&mut random)).collect();
    records.extend([CycleRecord::new_zeroed(); 2]);
    let mut writer = RecordingWriter::create(&path, &description(), Level::Full).unwrap();
    writer.write(&records).unwrap();
    writer.finish().unwrap();
    let reader = RecordingReader::open(&path).unwrap();
    assert_eq!(reader.description(), &description());
    let read: Vec<_> = reader.map(Result::unwrap).collect();
    assert_eq!(read.len(), records.len());
    for (read, written) in read.iter().zip(&records) {
        assert_eq!(read.as_bytes(), written.as_bytes());
    }
}

#[test]
fn what_the_controller_got_comes_back_with_its_cycle() {
    let below = tempfile::tempdir().unwrap();
    let path = below.path().join("samples.mcap");
    let mut random = SplitMix64::new(9);
    let mut setpoint = || {
        let mut setpoint = Setpoint::new_zeroed();
        setpoint.as_mut_bytes().fill_with(|| random.below(256) as u8);
        setpoint
    };
    let setpoints = [setpoint(), setpoint(), setpoint()];
    let [before, record] = [noise(&mut random), noise(&mut random)];
    let mut writer = RecordingWriter::create(&path, &description(), Level::Full).unwrap();
    let mut message = Vec::new();
    before.put(&setpoints[2..], &mut message);
    writer.write_lead(before.origin().deadline, &message).unwrap();
    writer.write_cycle(&record, &setpoints[..2]).unwrap();
    writer.finish().unwrap();
    let entries = EntryReader::open(&path).unwrap().map(Result::unwrap);
    let entries: Vec<_> = entries.filter(|entry| !matches!(entry, Entry::Event(_))).collect();
    let [Entry::Lead(lead, third), Entry::Cycle(cycle, taken)] = &entries[..] else {
        panic!("{entries:?}")
    };
    assert_eq!(lead.as_bytes(), before.as_bytes());
    assert_eq!(cycle.as_bytes(), record.as_bytes());
    assert_eq!(
        (third.as_bytes(), taken.as_bytes()),
        (setpoints[2..].as_bytes(), setpoints[..2].as_bytes())
    );
    // Who asks for records gets those of the job.
    let records: Vec<_> = RecordingReader::open(&path).unwrap().map(Result::unwrap).collect();
    assert_eq!(records.as_bytes(), [record].as_bytes());
}

#[test]
fn a_file_cut_at_any_byte_gives_its_whole_records() {
    let below = tempfile::tempdir().unwrap();
    let path = below.path().join("samples.mcap");
    let mut random = SplitMix64::new(5);
    let records: Vec<_> = (0..4).map(|_| noise(&mut random)).collect();
    let mut writer = RecordingWriter::create(&path, &description(), Level::Full).unwrap();
    let mut ends = vec![];
    for record in &records {
        writer.write(&[*record]).unwrap();
        writer.flush().unwrap();
        ends.push(path.metadata().unwrap().len() as usize);
    }
    writer.finish().unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let all = |bytes: &[u8]| -> Vec<_> {
        RecordingReader::new(bytes).map_or_else(|_| Vec::new(), |reader| reader.collect())
    };
    let dense = ends[0] - 1500..(ends[3] + 300).min(bytes.len());
    for length in (0..bytes.len()).step_by(101).chain(dense) {
        let read = all(&bytes[..length]);
        let whole = ends.iter().filter(|end| **end <= length).count();
        assert_eq!(read.iter().filter(|record| record.is_ok()).count(), whole, "{length}");
        for (read, written) in read.iter().filter_map(|read| read.as_ref().ok()).zip(&records) {
            assert_eq!(read.as_bytes(), written.as_bytes());
        }
        let torn = |error: &RecordingError| matches!(error, RecordingError::Truncated { .. });
        assert!(read.iter().filter_map(|read| read.as_ref().err()).all(torn), "{length}");
    }
    assert!(all(&bytes).iter().all(Result::is_ok));
}

#[test]
fn strangers_are_refused() {
    for bytes in [&b"GRAVERec and what stood behind it"[..], &[0; 100]] {
        let error = RecordingReader::new(bytes).map(drop).unwrap_err();
        assert!(matches!(error, RecordingError::NotARecording), "{error}");
    }
}
