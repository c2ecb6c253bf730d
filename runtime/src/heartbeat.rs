//! Signs of life of a process's loop, for somebody who watches over it, such as systemd's watchdog.
//!
//! A beat is one addition in memory. Real-time cycles have none: their peers watch them far more closely.

use std::sync::atomic::{AtomicU32, AtomicU64, Ordering};

static BEATS: AtomicU64 = AtomicU64::new(0);
static BUSY: AtomicU32 = AtomicU32::new(0);

/// Says that the loop has come round.
pub fn beat() {
    BEATS.fetch_add(1, Ordering::Relaxed);
}

/// How often it has.
pub fn beats() -> u64 {
    BEATS.load(Ordering::Relaxed)
}

/// A long computation, in which the loop does not come round and all is well; as long as the value lives.
#[derive(Debug)]
pub struct Busy(());

/// Says that a long computation begins.
#[must_use]
pub fn busy() -> Busy {
    BUSY.fetch_add(1, Ordering::Relaxed);
    Busy(())
}

impl Drop for Busy {
    fn drop(&mut self) {
        BUSY.fetch_sub(1, Ordering::Relaxed);
        beat();
    }
}

/// Whether a long computation is under way.
pub fn is_busy() -> bool {
    BUSY.load(Ordering::Relaxed) > 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_computation_counts_as_life_until_it_ends() {
        let before = beats();
        beat();
        assert!(beats() > before && !is_busy());
        let outer = busy();
        let inner = busy();
        drop(outer);
        assert!(is_busy());
        drop(inner);
        assert!(!is_busy());
    }
}
