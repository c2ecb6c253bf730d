//! The setpoints that travel ahead of time, in a fixed ring, with some of the past kept for going
//! back along the stream.

use crate::motion_limits::Motion;
use crate::stream_time::StreamTime;
use messages::Setpoint;
use messages::setpoint::flags;

/// Setpoints in the ring; a power of two.
pub const CAPACITY: usize = 2048;

/// Played setpoints that stay, for a resume to go back to.
pub const HISTORY: usize = 640;

/// Lead below which a transmission counts as relaxed [m or rad]: a tenth of any encoder count.
const RELAXED: f64 = 1e-7;

/// Setpoints that share one summary.
const BLOCK: usize = 64;

const BLOCKS: usize = CAPACITY / BLOCK;

/// Setpoints on either side that the motion at one is taken from.
const NEIGHBOURS: u64 = 2;

/// A setpoint did not continue the stream.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("setpoint {sequence} of stream {stream} where {expected} was due")]
pub struct StreamBroken {
    /// The stream of the setpoint.
    pub stream: u64,
    /// Its sequence number.
    pub sequence: u64,
    /// The sequence number that would have been right.
    pub expected: u64,
}

/// The ring.
#[derive(Debug)]
pub struct Lookahead {
    setpoints: Box<[Setpoint; CAPACITY]>,
    motions: Box<[Motion; CAPACITY]>,
    /// Which blocks of setpoints have light.
    lit: [bool; BLOCKS],
    stream: u64,
    accepted: u64,
    played: u64,
    complete: bool,
}

impl Lookahead {
    /// An empty ring, its memory touched.
    pub fn new() -> Self {
        Self {
            setpoints: boxed(Setpoint::default()),
            motions: boxed(Motion::default()),
            lit: [false; BLOCKS],
            stream: 0,
            accepted: 0,
            played: 0,
            complete: false,
        }
    }

    /// Empties the ring and waits for the first setpoint of `stream`, 0 for any.
    pub fn clear(&mut self, stream: u64) {
        (self.stream, self.accepted, self.played, self.complete) = (stream, 0, 0, false);
    }

    /// Takes the next setpoint of the stream.
    ///
    /// # Errors
    /// A gap, a repetition, another stream, or no room.
    pub fn accept(&mut self, setpoint: &Setpoint) -> Result<(), StreamBroken> {
        let continues = setpoint.sequence == self.accepted
            && (setpoint.stream == self.stream || self.stream == 0);
        if !continues || setpoint.stream == 0 || self.complete || self.room() == 0 {
            return Err(StreamBroken {
                stream: setpoint.stream,
                sequence: setpoint.sequence,
                expected: self.accepted,
            });
        }
        self.stream = setpoint.stream;
        let slot = self.accepted as usize % CAPACITY;
        self.setpoints[slot] = *setpoint;
        let lit = &mut self.lit[slot / BLOCK];
        *lit = setpoint.laser.is_lit() || *lit && !slot.is_multiple_of(BLOCK);
        self.accepted += 1;
        self.complete = setpoint.has(flags::LAST);
        let known = self.motions_known();
        for sequence in self.accepted.saturating_sub(NEIGHBOURS + 1)..known {
            self.motions[sequence as usize % CAPACITY] = self.motion_at(sequence);
        }
        Ok(())
    }

    /// Setpoints whose motion is known: what comes after the newest is not, unless it is the last.
    fn motions_known(&self) -> u64 {
        self.accepted.saturating_sub(if self.complete { 0 } else { NEIGHBOURS })
    }

    fn motion_at(&self, sequence: u64) -> Motion {
        let [two_before, before] = [2, 1].map(|cycles| sequence.saturating_sub(cycles));
        let around = [two_before, before, sequence, sequence + 1, sequence + 2];
        Motion::amid(around.map(|sequence| self.setpoint(sequence)))
    }

    /// The stream in the ring, 0 for none.
    pub fn stream(&self) -> u64 {
        self.stream
    }

    /// Setpoints taken so far.
    pub fn accepted(&self) -> u64 {
        self.accepted
    }

    /// Setpoints whose time has passed.
    pub fn played(&self) -> u64 {
        self.played
    }

    /// Whether the stream's last setpoint is in the ring.
    pub fn is_complete(&self) -> bool {
        self.complete
    }

    /// How many more setpoints there is room for.
    pub fn room(&self) -> usize {
        (CAPACITY - HISTORY).saturating_sub((self.accepted - self.played) as usize)
    }

    /// The time up to `now` has passed; going back along the stream takes nothing back.
    pub fn pass(&mut self, now: StreamTime) {
        self.played = self.played.max(now.sequence()).min(self.accepted);
    }

    /// The instant of the newest setpoint.
    pub fn end(&self) -> StreamTime {
        StreamTime::of(self.accepted.saturating_sub(1))
    }

    /// The instant of the oldest setpoint still held.
    pub fn beginning(&self) -> StreamTime {
        StreamTime::of(self.accepted.saturating_sub(CAPACITY as u64))
    }

    /// The setpoint with this number, or the nearest one held.
    pub fn setpoint(&self, sequence: u64) -> &Setpoint {
        &self.setpoints[self.nearest(sequence)]
    }

    /// The motion at the setpoint with this number, or at the nearest of which it is known.
    pub fn motion(&self, sequence: u64) -> &Motion {
        let newest = self.motions_known().saturating_sub(1);
        &self.motions[self.nearest(sequence.min(newest))]
    }

    /// Whether there may be light between `from` and `to`, or up to a block outside.
    pub fn may_be_lit(&self, from: StreamTime, to: StreamTime) -> bool {
        let block = |sequence: u64| sequence / BLOCK as u64;
        let last = block(to.min(self.end()).sequence());
        let first = block(from.max(self.beginning()).sequence());
        (first..=last).any(|index| self.lit[index as usize % BLOCKS])
    }

    /// Whether any setpoint from the one at or before `from` to `to` has light; a look at each, for
    /// short stretches.
    pub fn is_lit(&self, from: StreamTime, to: StreamTime) -> bool {
        let last = to.min(self.end()).sequence();
        (from.sequence()..=last).any(|sequence| self.setpoint(sequence).laser.is_lit())
    }

    /// Whether the stream itself is at rest at `time`, its transmissions relaxed.
    pub fn is_resting(&self, time: StreamTime) -> bool {
        let sequence = time.sequence();
        [sequence, sequence + 1].map(|sequence| self.setpoint(sequence)).iter().all(|setpoint| {
            let motion = setpoint.velocity.iter().chain(&setpoint.acceleration);
            motion.chain(&setpoint.jerk).all(|value| *value == 0.0)
                && setpoint.lead.iter().all(|lead| lead.abs() < RELAXED)
        })
    }

    fn nearest(&self, sequence: u64) -> usize {
        let newest = self.accepted.saturating_sub(1);
        let oldest = self.accepted.saturating_sub(CAPACITY as u64);
        sequence.clamp(oldest, newest) as usize % CAPACITY
    }
}

impl Default for Lookahead {
    fn default() -> Self {
        Self::new()
    }
}

/// `value` everywhere, made on the heap: the ring is larger than some stacks.
fn boxed<T: Copy + core::fmt::Debug>(value: T) -> Box<[T; CAPACITY]> {
    let Ok(array) = vec![value; CAPACITY].into_boxed_slice().try_into() else {
        unreachable!("the length is the array's")
    };
    array
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn setpoint(stream: u64, sequence: u64) -> Setpoint {
        Setpoint { stream, sequence, ..Setpoint::default() }
    }

    fn take(ring: &mut Lookahead, sequence: u64) -> Result<(), StreamBroken> {
        ring.accept(&setpoint(7, sequence))
    }

    #[test]
    fn refuses_what_does_not_continue_the_stream() {
        let mut ring = Lookahead::new();
        take(&mut ring, 0).unwrap();
        take(&mut ring, 1).unwrap();
        for (stream, sequence) in [(7, 1), (7, 3), (8, 2), (0, 2)] {
            let refused = ring.accept(&setpoint(stream, sequence));
            assert_eq!(refused, Err(StreamBroken { stream, sequence, expected: 2 }));
        }
        let last = Setpoint { flags: flags::LAST, ..setpoint(7, 2) };
        ring.accept(&last).unwrap();
        assert!(take(&mut ring, 3).is_err());
    }

    #[test]
    fn keeps_the_past_and_says_how_much_room_is_left() {
        let mut ring = Lookahead::new();
        for sequence in 0..5000_u64 {
            if ring.room() == 0 {
                ring.pass(StreamTime::of(sequence - 100));
            }
            take(&mut ring, sequence).unwrap();
            let oldest = ring.played().saturating_sub(HISTORY as u64);
            assert_eq!(ring.setpoint(oldest).sequence, oldest);
            assert_eq!(ring.setpoint(sequence).sequence, sequence);
            assert_eq!(ring.setpoint(sequence + 9).sequence, sequence);
        }
        ring.pass(StreamTime::of(10));
        assert!(ring.played() > 10, "going back takes nothing back");
    }

    #[test]
    fn knows_which_blocks_have_light_and_forgets_old_ones() {
        let mut ring = Lookahead::new();
        for sequence in 0..3000_u64 {
            ring.pass(StreamTime::of(sequence));
            let mut setpoint = setpoint(7, sequence);
            setpoint.laser.gate = u32::from(sequence == 200);
            ring.accept(&setpoint).unwrap();
            if sequence == 1000 {
                let may_be_lit =
                    |from, to| ring.may_be_lit(StreamTime::of(from), StreamTime::of(to));
                assert!(may_be_lit(100, 300) && !may_be_lit(300, 900));
            }
        }
        assert!(!ring.may_be_lit(StreamTime::of(1300), StreamTime::of(2990)));
    }
}
