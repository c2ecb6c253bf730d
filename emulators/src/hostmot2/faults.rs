//! What happens to frames on their way, by a seed: lost, late, doubled, damaged, or none at all.

use std::collections::VecDeque;

use messages::Nanoseconds;
use messages::random::SplitMix64;

/// How often what happens to a frame, each as a fraction of all frames in a direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Faults {
    /// Lost.
    pub loss: f64,
    /// Later by [`Faults::delay`].
    pub late: f64,
    /// How much later.
    pub delay: Nanoseconds,
    /// Arriving twice.
    pub duplicate: f64,
    /// Arriving with a bit changed or cut short. The board's network chip sees it by the check sum and drops
    /// the frame, and counts it.
    pub corrupt: f64,
    /// Whether what is damaged on the way to the master is handed to it all the same, against every check
    /// sum: for proofs that a master does not trust a reply.
    pub deliver_corrupt: bool,
    /// From when on the board neither hears nor answers.
    pub silent_from: Option<Nanoseconds>,
    /// From when on the board hears, and does not answer.
    pub mute_from: Option<Nanoseconds>,
    /// From when to when the cable is cut.
    pub cut: Option<[Nanoseconds; 2]>,
    /// Chooses the frames.
    pub seed: u64,
}

impl Default for Faults {
    fn default() -> Self {
        Self {
            loss: 0.0,
            late: 0.0,
            delay: Nanoseconds(3_000_000),
            duplicate: 0.0,
            corrupt: 0.0,
            deliver_corrupt: false,
            silent_from: None,
            mute_from: None,
            cut: None,
            seed: 1,
        }
    }
}

impl Faults {
    /// Whether no frame passes at `now` towards the board.
    fn deaf(&self, now: Nanoseconds) -> bool {
        self.silent_from.is_some_and(|from| now >= from)
            || self.cut.is_some_and(|[from, to]| (from..to).contains(&now))
    }

    /// Whether no frame passes at `now` towards the master.
    fn mute(&self, now: Nanoseconds) -> bool {
        self.deaf(now) || self.mute_from.is_some_and(|from| now >= from)
    }
}

/// Which way frames go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// From the master to the board.
    ToBoard,
    /// From the board to the master.
    ToMaster,
}

/// What happened to the frames of a direction.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Account {
    /// Handed in.
    pub sent: u64,
    /// Lost, in a cut as well.
    pub lost: u64,
    /// Held back.
    pub late: u64,
    /// Doubled.
    pub duplicated: u64,
    /// Damaged.
    pub corrupted: u64,
}

/// A frame on its way.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// When it arrives.
    pub due: Nanoseconds,
    /// What it carries.
    pub bytes: Vec<u8>,
    /// Whether it is damaged.
    pub damaged: bool,
}

/// One direction of the cable.
#[derive(Debug, Clone)]
pub struct Line {
    direction: Direction,
    faults: Faults,
    flight: Nanoseconds,
    random: SplitMix64,
    /// In the order of their arrival.
    frames: VecDeque<Frame>,
    account: Account,
}

impl Line {
    /// A line on which a frame takes `flight` where nothing happens to it.
    pub fn new(direction: Direction, faults: &Faults, flight: Nanoseconds) -> Self {
        let stream = match direction {
            Direction::ToBoard => 0,
            Direction::ToMaster => 0x5bd1_e995,
        };
        Self {
            direction,
            faults: faults.clone(),
            flight,
            random: SplitMix64::new(faults.seed ^ stream),
            frames: VecDeque::new(),
            account: Account::default(),
        }
    }

    /// Hands a frame in at `now`.
    pub fn send(&mut self, now: Nanoseconds, bytes: &[u8]) {
        self.account.sent += 1;
        // As many numbers for every frame, so that one kind of fault does not change which frames another
        // falls on.
        let [loss, late, duplicate, corrupt] = [(); 4].map(|()| self.random.fraction());
        let place = self.random.bits();
        let Faults { delay, .. } = self.faults;
        let cut = match self.direction {
            Direction::ToBoard => self.faults.deaf(now),
            Direction::ToMaster => self.faults.mute(now),
        };
        if cut || loss < self.faults.loss {
            self.account.lost += 1;
            return;
        }
        let mut frame = Frame { due: now + self.flight, bytes: bytes.to_vec(), damaged: false };
        if late < self.faults.late {
            self.account.late += 1;
            frame.due = frame.due + delay;
        }
        if corrupt < self.faults.corrupt {
            self.account.corrupted += 1;
            frame.damaged = true;
            damage(&mut frame.bytes, place);
        }
        if duplicate < self.faults.duplicate {
            self.account.duplicated += 1;
            self.put(frame.clone());
        }
        self.put(frame);
    }

    /// The next frame that has arrived by `now`.
    pub fn receive(&mut self, now: Nanoseconds) -> Option<Frame> {
        if self.next()? > now {
            return None;
        }
        self.frames.pop_front()
    }

    /// When the next frame arrives.
    pub fn next(&self) -> Option<Nanoseconds> {
        self.frames.front().map(|frame| frame.due)
    }

    /// What happened so far.
    pub fn account(&self) -> Account {
        self.account
    }

    fn put(&mut self, frame: Frame) {
        let after = self.frames.iter().rposition(|other| other.due <= frame.due);
        self.frames.insert(after.map_or(0, |index| index + 1), frame);
    }
}

/// Changes a bit, or cuts the end off.
fn damage(bytes: &mut Vec<u8>, place: u64) {
    let length = bytes.len() as u64;
    if length == 0 {
        return;
    }
    if place >> 63 == 0 {
        bytes.truncate((place % length) as usize);
    } else if let Some(byte) = bytes.get_mut((place % length) as usize) {
        *byte ^= 1 << (place >> 32 & 7);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn arrivals(faults: &Faults, frames: u16) -> (Vec<(i64, u16)>, Account) {
        let mut line = Line::new(Direction::ToMaster, faults, Nanoseconds(10));
        let mut arrived = Vec::new();
        for number in 0..frames {
            let now = Nanoseconds(i64::from(number) * 1_000_000);
            line.send(now, &number.to_le_bytes());
            while let Some(frame) = line.receive(now + Nanoseconds(999_999)) {
                let bytes = frame.bytes.first_chunk().copied().unwrap_or([0xff; 2]);
                arrived.push((frame.due.0, u16::from_le_bytes(bytes)));
            }
        }
        (arrived, line.account())
    }

    #[test]
    fn frames_arrive_where_nothing_happens() {
        let (arrived, account) = arrivals(&Faults::default(), 3);
        assert_eq!(arrived, [(10, 0), (1_000_010, 1), (2_000_010, 2)]);
        assert_eq!(account, Account { sent: 3, ..Account::default() });
    }

    #[test]
    fn a_late_frame_is_overtaken() {
        let faults = Faults { late: 0.2, ..Faults::default() };
        let (arrived, account) = arrivals(&faults, 1000);
        assert!((150..250).contains(&account.late), "{account:?}");
        let overtaken = arrived.windows(2).any(|pair| pair[1].1 < pair[0].1);
        assert!(overtaken && arrived.is_sorted_by_key(|(due, _)| *due));
    }

    #[test]
    fn the_seed_says_which_frames() {
        let faults = Faults { loss: 0.01, duplicate: 0.01, seed: 7, ..Faults::default() };
        let (first, account) = arrivals(&faults, 5000);
        assert_eq!(first, arrivals(&faults, 5000).0);
        assert_ne!(first, arrivals(&Faults { seed: 8, ..faults }, 5000).0);
        let expected = 5000 - account.lost + account.duplicated;
        assert_eq!(first.len() as u64, expected);
        assert!((20..90).contains(&account.lost) && (20..90).contains(&account.duplicated));
    }

    #[test]
    fn a_cut_cable_carries_nothing() {
        let cut = Some([Nanoseconds(1_500_000), Nanoseconds(3_500_000)]);
        let (arrived, account) = arrivals(&Faults { cut, ..Faults::default() }, 5);
        assert_eq!(arrived.iter().map(|(_, number)| *number).collect::<Vec<_>>(), [0, 1, 4]);
        assert_eq!(account.lost, 2);
    }
}
