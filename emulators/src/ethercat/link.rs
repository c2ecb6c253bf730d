//! A segment at the end of a line, in memory: frames go in, and come back when it is time.

use std::collections::VecDeque;

use messages::Nanoseconds;

use super::Segment;
use super::faults::{Counts, Fate, Line, Rates};
use super::frame::ETHERNET_HEADER;
use crate::cable::Hardware;

/// A segment behind a line that may be bad. Frames are Ethernet frames, or the payloads of datagrams.
#[derive(Debug)]
pub struct Link {
    /// What is behind the line.
    pub segment: Segment,
    line: Line,
    coming: VecDeque<(Nanoseconds, Vec<u8>)>,
}

/// What a frame begins with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Framing {
    /// Its Ethernet header.
    Ethernet,
    /// The EtherCAT header: what a UDP datagram carries.
    Payload,
}

impl Link {
    /// `segment` behind a line of these `rates`.
    pub fn new(segment: Segment, rates: Rates, seed: u64) -> Self {
        Self { segment, line: Line::new(rates, seed), coming: VecDeque::new() }
    }

    /// The line is as good or bad as `rates` from now on.
    pub fn set_rates(&mut self, rates: Rates) {
        self.line.set_rates(rates);
    }

    /// What has happened to the frames so far.
    pub fn counts(&self) -> Counts {
        self.line.counts()
    }

    /// Sends a frame at `now`.
    pub fn send(&mut self, frame: &[u8], framing: Framing, now: Nanoseconds) {
        let fate = self.line.fate();
        match fate {
            Fate::LostOut => return self.segment.advance(now),
            Fate::CorruptedOut => return self.segment.invalid_frame(now),
            _ => {}
        }
        let back = match framing {
            Framing::Ethernet => self.segment.process(frame, now),
            Framing::Payload => {
                let mut payload = frame.to_vec();
                self.segment.process_payload(&mut payload, now).then_some(payload)
            }
        };
        let Some(mut back) = back else { return };
        match fate {
            Fate::LostBack => {}
            Fate::Late(by) => self.put(now + by, back),
            Fate::Twice => {
                self.put(now, back.clone());
                self.put(now, back);
            }
            Fate::CorruptedBack(byte) => {
                let header = if framing == Framing::Ethernet { ETHERNET_HEADER } else { 0 };
                back.iter_mut().skip(header + byte).take(1).for_each(|byte| *byte ^= 0x5A);
                self.put(now, back);
            }
            Fate::Whole | Fate::LostOut | Fate::CorruptedOut => self.put(now, back),
        }
    }

    fn put(&mut self, at: Nanoseconds, frame: Vec<u8>) {
        let behind = self.coming.iter().rposition(|(other, _)| *other <= at).map_or(0, |it| it + 1);
        self.coming.insert(behind, (at, frame));
    }

    /// The next frame that has come back by `now`.
    pub fn receive(&mut self, now: Nanoseconds) -> Option<Vec<u8>> {
        self.coming.front().filter(|(at, _)| *at <= now)?;
        self.coming.pop_front().map(|(_, frame)| frame)
    }

    /// When the next frame comes back.
    pub fn next(&self) -> Option<Nanoseconds> {
        self.coming.front().map(|(at, _)| *at)
    }
}

impl Hardware for Link {
    fn send(&mut self, now: Nanoseconds, frame: &[u8]) {
        Self::send(self, frame, Framing::Ethernet, now);
    }

    fn receive(&mut self, now: Nanoseconds) -> Option<Vec<u8>> {
        Self::receive(self, now)
    }

    fn next(&self) -> Option<Nanoseconds> {
        Self::next(self)
    }

    fn advance(&mut self, now: Nanoseconds) {
        self.segment.advance(now);
    }

    fn lit(&self, now: Nanoseconds) -> Vec<[Nanoseconds; 2]> {
        let (mut spans, mut since) = (Vec::new(), None);
        for edge in self.segment.light() {
            if edge.power > 0.0 {
                since.get_or_insert(edge.at);
            } else if let Some(from) = since.take() {
                spans.push([from, edge.at]);
            }
        }
        spans.extend(since.map(|from| [from, now]));
        spans
    }

    fn tool(&self) -> Option<[f64; 3]> {
        self.segment.tool()
    }
}
