//! The board at its cable: what a master sends arrives through one line, the replies leave by another.

use messages::Nanoseconds;

use super::board::Board;
use super::faults::{Account, Direction, Faults, Line};
use super::rig::Rig;
use crate::cable::Hardware;

/// A board and both directions of its cable.
#[derive(Debug)]
pub struct Emulator {
    board: Board,
    inward: Line,
    outward: Line,
    /// Whether the master is handed what is damaged.
    deliver_corrupt: bool,
}

impl Emulator {
    /// `board` behind a cable with `faults`, on which a frame takes `flight` each way.
    pub fn new(board: Board, faults: &Faults, flight: Nanoseconds) -> Self {
        Self {
            board,
            inward: Line::new(Direction::ToBoard, faults, flight),
            outward: Line::new(Direction::ToMaster, faults, flight),
            deliver_corrupt: faults.deliver_corrupt,
        }
    }

    /// The master sends a datagram at `now`; times go on from call to call.
    pub fn send(&mut self, now: Nanoseconds, datagram: &[u8]) {
        self.advance(now);
        self.inward.send(now, datagram);
    }

    /// The next datagram that has come back by `now`.
    pub fn receive(&mut self, now: Nanoseconds) -> Option<Vec<u8>> {
        self.advance(now);
        loop {
            let frame = self.outward.receive(now)?;
            if !frame.damaged || self.deliver_corrupt {
                return Some(frame.bytes);
            }
        }
    }

    /// When the next frame arrives at either end, as far as is known.
    pub fn next(&self) -> Option<Nanoseconds> {
        [self.inward.next(), self.outward.next()].into_iter().flatten().min()
    }

    /// Lets the time go on to `now`: what arrives at the board until then is taken as it arrives.
    pub fn advance(&mut self, now: Nanoseconds) {
        while let Some(frame) = self.inward.receive(now) {
            self.board.advance(frame.due);
            if frame.damaged {
                self.board.note_damaged();
            } else if let Some(reply) = self.board.handle(frame.due, &frame.bytes) {
                self.outward.send(frame.due, reply);
            }
        }
        self.board.advance(now);
    }

    /// The board.
    pub fn board(&self) -> &Board {
        &self.board
    }

    /// The board, to drive its inputs.
    pub fn board_mut(&mut self) -> &mut Board {
        &mut self.board
    }

    /// What happened to the frames to the board, and to those back.
    pub fn accounts(&self) -> [Account; 2] {
        [self.inward.account(), self.outward.account()]
    }
}

impl Hardware for Emulator {
    fn send(&mut self, now: Nanoseconds, frame: &[u8]) {
        Self::send(self, now, frame);
    }

    fn receive(&mut self, now: Nanoseconds) -> Option<Vec<u8>> {
        Self::receive(self, now)
    }

    fn next(&self) -> Option<Nanoseconds> {
        Self::next(self)
    }

    fn advance(&mut self, now: Nanoseconds) {
        Self::advance(self, now);
    }

    fn lit(&self, now: Nanoseconds) -> Vec<[Nanoseconds; 2]> {
        self.board.record().lit(now)
    }

    fn tool(&self) -> Option<[f64; 3]> {
        self.board.rig().and_then(Rig::tool)
    }
}
