//! A bounded ring of events: how a cycle says what happened without waiting for who writes it
//! down.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use crossbeam::queue::ArrayQueue;

/// A ring of fixed-size events; clones are further handles on the same ring.
#[derive(Debug)]
pub struct EventRing<E: Copy> {
    queue: Arc<ArrayQueue<E>>,
    dropped: Arc<AtomicU64>,
}

impl<E: Copy> EventRing<E> {
    /// A ring with room for `capacity` events, at least 1.
    pub fn new(capacity: usize) -> Self {
        Self {
            queue: Arc::new(ArrayQueue::new(capacity.max(1))),
            dropped: Arc::new(AtomicU64::new(0)),
        }
    }

    /// Puts an event in; when the ring is full the event is dropped and counted, because the first
    /// events of a disturbance tell the most. Neither waits nor allocates.
    pub fn push(&self, event: E) {
        if self.queue.push(event).is_err() {
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// The oldest event.
    pub fn pop(&self) -> Option<E> {
        self.queue.pop()
    }

    /// Events dropped since the ring was made.
    pub fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }
}

impl<E: Copy> Clone for EventRing<E> {
    fn clone(&self) -> Self {
        Self { queue: self.queue.clone(), dropped: self.dropped.clone() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_ring_keeps_the_first_events_and_counts_the_others() {
        let ring = EventRing::new(3);
        let writer = ring.clone();
        for event in 0..5 {
            writer.push(event);
        }
        assert_eq!(std::iter::from_fn(|| ring.pop()).collect::<Vec<_>>(), [0, 1, 2]);
        assert_eq!(ring.dropped(), 2);
        writer.push(9);
        assert_eq!((ring.pop(), ring.pop(), ring.dropped()), (Some(9), None, 2));
    }
}
