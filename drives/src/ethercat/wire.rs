//! The frames of `ethercrab` on a link, by one thread and within a budget of time.
//!
//! The crate's own tasks end for good at a frame that is late or lost. Here a question is a future that is
//! polled between sending and receiving, and is dropped when its time is over: its frame is free again then, and
//! what comes back of it later is known as late.

use core::future::Future;
use core::pin::pin;
use core::sync::atomic::{AtomicI64, Ordering};
use core::task::{Context, Poll, Waker};
use std::sync::Arc;

use ethercrab::{PduRx, PduTx, ReceiveAction};
use messages::{LinkCounters, Nanoseconds};

use super::link::HEADER;
use crate::link::Link;

/// Longest Ethernet frame, without its checksum.
const LONGEST: usize = 1518;

/// Where a frame has the index of its first datagram.
const INDEX: usize = HEADER + 3;

/// Bytes of a datagram's header, and of the counter behind its data.
const DATAGRAM: usize = 10;
const COUNTER: usize = 2;

/// The length of a datagram's data in its header, the bit that slaves change left out, and that another follows.
const LENGTH: u16 = 0x07ff;
const UNCHANGED: u16 = 0xbfff;
const MORE: u16 = 0x8000;

/// Whether `answer` can be what came of `question`: slaves change addresses, data and counters of a frame, and nothing
/// else of it.
fn answers(question: &[u8], answer: &[u8]) -> bool {
    let header = HEADER..HEADER + 2;
    if question.get(header.clone()) != answer.get(header.clone()) {
        return false;
    }
    let mut at = header.end;
    loop {
        let heads = [question, answer].map(|frame| frame.get(at..at + DATAGRAM));
        let [Some(asked), Some(told)] = heads else { return false };
        let lengths = [asked, told].map(|head| match *head {
            [command, index, _, _, _, _, low, high, ..] => {
                (command, index, u16::from_le_bytes([low, high]) & UNCHANGED)
            }
            _ => (0, 0, 0),
        });
        let [(_, _, length), _] = lengths;
        if lengths.first() != lengths.last() {
            return false;
        }
        if length & MORE == 0 {
            return true;
        }
        at += DATAGRAM + usize::from(length & LENGTH) + COUNTER;
    }
}

/// Both ends of the crate's frames, and the link.
pub struct Wire {
    sender: PduTx<'static>,
    receiver: PduRx<'static>,
    link: Box<dyn Link>,
    counters: LinkCounters,
    /// Index of the newest frame that was answered.
    answered: Option<u8>,
    /// The link's time at the newest look at it [ns].
    time: Arc<AtomicI64>,
    buffer: [u8; LONGEST],
    /// The newest frame, and its length.
    newest: [u8; LONGEST],
    length: usize,
    /// Whether what came back of it was damaged.
    is_damaged: bool,
}

impl Wire {
    /// The frames of `sender` and `receiver` on `link`.
    pub fn new(sender: PduTx<'static>, receiver: PduRx<'static>, link: Box<dyn Link>) -> Self {
        let (counters, answered) = (LinkCounters::default(), None);
        let time = Arc::new(AtomicI64::new(link.now().0));
        let (buffer, newest) = ([0; LONGEST], [0; LONGEST]);
        Self {
            sender,
            receiver,
            link,
            counters,
            answered,
            time,
            buffer,
            newest,
            length: 0,
            is_damaged: false,
        }
    }

    /// What was counted.
    pub fn counters(&self) -> &LinkCounters {
        &self.counters
    }

    /// The link's time at the newest look at it [ns], for questions that ask for it.
    pub fn clock(&self) -> Arc<AtomicI64> {
        Arc::clone(&self.time)
    }

    /// The link's time.
    pub fn now(&self) -> Nanoseconds {
        self.link.now()
    }

    /// Asks `question`, for as long as `until`; `None` when it was not answered by then. Looks at the question
    /// again each time a frame comes, and after `patience` without one.
    pub fn ask<F: Future>(
        &mut self,
        question: F,
        until: Nanoseconds,
        patience: Nanoseconds,
    ) -> Option<F::Output> {
        let mut question = pin!(question);
        let mut context = Context::from_waker(Waker::noop());
        loop {
            self.time.store(self.link.now().0, Ordering::Relaxed);
            if let Poll::Ready(answer) = question.as_mut().poll(&mut context) {
                return Some(answer);
            }
            self.transmit();
            let now = self.link.now();
            if now >= until {
                return None;
            }
            self.listen((now + patience).min(until));
        }
    }

    /// Takes in what has come since, which nobody waits for any more.
    pub fn drain(&mut self) {
        while self.listen(self.link.now()) {}
    }

    /// A cycle passed without an answer; one that came back damaged is counted as that.
    pub fn lost(&mut self) {
        self.counters.lost += u64::from(!self.is_damaged);
    }

    /// A cycle passed without a measurement of its own.
    pub fn bridged(&mut self) {
        self.counters.bridged += 1;
    }

    /// An answer was not what it should be.
    pub fn corrupted(&mut self) {
        self.counters.corrupted += 1;
    }

    fn transmit(&mut self) {
        while let Some(frame) = self.sender.next_sendable_frame() {
            let Self { link, newest, length, .. } = self;
            let sent = frame.send_blocking(|bytes| {
                link.send(bytes);
                *length = bytes.len().min(newest.len());
                newest.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
                Ok(bytes.len())
            });
            self.is_damaged = false;
            self.counters.sent += u64::from(sent.is_ok());
        }
    }

    /// Takes the next frame in; whether there was one.
    fn listen(&mut self, until: Nanoseconds) -> bool {
        let Some(length) = self.link.receive(&mut self.buffer, until) else { return false };
        let frame = self.buffer.get(..length).unwrap_or_default();
        let index = frame.get(INDEX).copied();
        let question = self.newest.get(..self.length).unwrap_or_default();
        if index == question.get(INDEX).copied() && !answers(question, frame) {
            self.is_damaged = true;
            self.counters.corrupted += 1;
            return true;
        }
        match self.receiver.receive_frame(frame) {
            Ok(ReceiveAction::Processed) => self.answered = index,
            Ok(ReceiveAction::Ignored) => {}
            Err(_) if index.is_some() && index == self.answered => self.counters.duplicated += 1,
            Err(_) => self.counters.late += 1,
        }
        true
    }
}

impl core::fmt::Debug for Wire {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter.debug_struct("Wire").field("counters", &self.counters).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A frame of two datagrams, of three bytes and of one.
    fn frame() -> Vec<u8> {
        let mut frame = vec![0xff; HEADER];
        frame.extend([28, 0x10]);
        frame.extend([14, 7, 1, 0, 0x10, 9, 3, 0x80, 0, 0, 1, 2, 3, 0, 0]);
        frame.extend([12, 7, 0, 0, 0, 1, 1, 0, 0, 0, 9, 0, 0]);
        frame
    }

    #[test]
    fn slaves_change_addresses_data_and_counters_and_nothing_else() {
        let sent = frame();
        let second = HEADER + 2 + DATAGRAM + 3 + COUNTER;
        let kept = [HEADER + 2, second].map(|head| [head, head + 1, head + 6, head + 7]);
        for at in 0..sent.len() {
            let mut came = sent.clone();
            came[at] ^= 0x5a;
            let is_kept = [HEADER, HEADER + 1].contains(&at) || kept.as_flattened().contains(&at);
            assert_eq!(answers(&sent, &came), !is_kept, "byte {at}");
        }
        assert!(!answers(&sent, &sent[..sent.len() - 13]));
    }
}
