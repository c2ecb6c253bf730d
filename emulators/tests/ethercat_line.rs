//! The emulated segment behind a bad line: what is lost, late, doubled or damaged is counted, and nothing else changes.

use emulators::ethercat::faults::Rates;
use emulators::ethercat::{Framing, Layout, Link, Segment};
use machine::Machine;
use messages::Nanoseconds;

/// A read of two bytes at `offset` of the slave at `position`, as a UDP datagram carries it.
fn read(position: u16, offset: u16) -> Vec<u8> {
    let mut payload = vec![14, 0x10, 1, 0];
    payload.extend(0_u16.wrapping_sub(position).to_le_bytes());
    payload.extend(offset.to_le_bytes());
    payload.extend([2, 0, 0, 0, 0, 0, 0, 0]);
    payload
}

fn link(rates: Rates) -> Link {
    let machine = Machine::builtin();
    let segment = Segment::new(&machine, &Layout::default(), drives::PlantOptions::default());
    Link::new(segment.expect("a segment of the built-in machine"), rates, 3)
}

/// Whether a frame that came back is one that was sent, carried out once.
fn is_whole(back: &[u8]) -> bool {
    let mut sent = read(0, 0x0300);
    sent[4..6].copy_from_slice(&6_u16.to_le_bytes());
    back.len() == sent.len() && back[..12] == sent[..12] && back[14..] == [1, 0]
}

#[test]
fn a_good_line_brings_every_frame_back_once() {
    let mut link = link(Rates::default());
    for cycle in 1..100 {
        let now = Nanoseconds(cycle * 1_000_000);
        link.send(&read(0, 0x0300), Framing::Payload, now);
        assert!(link.receive(now).is_some_and(|back| is_whole(&back)));
        assert_eq!(link.receive(now), None);
    }
}

#[test]
fn a_bad_line_does_what_it_counts() {
    let delay = Nanoseconds(3_000_000);
    let rates = Rates { lost: 0.1, late: 0.1, delay, duplicated: 0.1, corrupted: 0.1 };
    let mut link = link(rates);
    let (mut whole, mut damaged, mut late) = (0, 0, 0);
    for cycle in 1..=1010_i64 {
        let now = Nanoseconds(cycle * 1_000_000);
        if cycle <= 1000 {
            link.send(&read(0, 0x0300), Framing::Payload, now);
        }
        late += u64::from(link.next().is_some_and(|at| at == now + delay));
        while let Some(back) = link.receive(now) {
            if is_whole(&back) {
                whole += 1;
            } else {
                damaged += 1;
            }
        }
    }
    let counts = link.counts();
    assert_eq!(counts.frames, 1000);
    assert!(counts.lost > 60 && counts.late > 60 && counts.duplicated > 60, "{counts:?}");
    assert!(late > 0);
    assert_eq!(whole, 1000 - counts.lost - counts.corrupted + counts.duplicated, "{counts:?}");
    // Those that were damaged on the way out stand in the slaves' counters; the others came back.
    link.send(&read(0, 0x0300), Framing::Payload, Nanoseconds(2_000_000_000));
    let counted =
        link.segment.slaves().iter().map(|slave| slave.invalid_frames()).collect::<Vec<_>>();
    assert!(
        counted.iter().all(|count| u64::from(*count) + damaged == counts.corrupted),
        "{counted:?} {damaged}"
    );
}
