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
}

impl Wire {
    /// The frames of `sender` and `receiver` on `link`.
    pub fn new(sender: PduTx<'static>, receiver: PduRx<'static>, link: Box<dyn Link>) -> Self {
        let (counters, answered) = (LinkCounters::default(), None);
        let time = Arc::new(AtomicI64::new(link.now().0));
        Self { sender, receiver, link, counters, answered, time, buffer: [0; LONGEST] }
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

    /// A cycle passed without an answer.
    pub fn lost(&mut self) {
        self.counters.lost += 1;
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
            let link = &mut self.link;
            let sent = frame.send_blocking(|bytes| {
                link.send(bytes);
                Ok(bytes.len())
            });
            self.counters.sent += u64::from(sent.is_ok());
        }
    }

    /// Takes the next frame in; whether there was one.
    fn listen(&mut self, until: Nanoseconds) -> bool {
        let Some(length) = self.link.receive(&mut self.buffer, until) else { return false };
        let frame = self.buffer.get(..length).unwrap_or_default();
        let index = frame.get(INDEX).copied();
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
