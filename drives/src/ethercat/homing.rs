//! How a drive finds its reference by itself (CiA 402-2, homing mode), seen from the bus.
//!
//! ```text
//! Following ──asked──► Entering ──6061h = 6──► Looking ──found──► Found ──►  Leaving ──6061h = the mode before──► Done
//!     ▲                    │                      │ taken back                ▲                                  │
//!     │                    └──taken back──► Leaving    └────────► Halting ────┘                                  │
//!     └───────────────────────────────────taken back─────────────────────────────────────────────────────────────┘
//! ```
//!
//! Of an axis with several drives those that have found theirs wait, at rest, for the others: places that are told from
//! the reference by one and not yet by another would be of no axis. Until it has come back to its mode, its target is where it is.

use messages::Nanoseconds;

use super::image::Said;

/// The mode of operation (6060h), and its bit among the supported ones (6502h).
pub(super) const MODE: i8 = 6;
pub(super) const SUPPORTED: u32 = 1 << 5;

/// Bits of the control word: begin, or go on; come to rest.
const START: u16 = 1 << 4;
const HALT: u16 = 1 << 8;

/// Bits of the status word: at rest, or there; found; failed.
const REACHED: u16 = 1 << 10;
const ATTAINED: u16 = 1 << 12;
const FAILED: u16 = 1 << 13;

/// Answers until what a drive says is of what it has been told: it is there in the next cycle, measured in the one
/// after that, and told with the next frame.
const ANSWERED: u32 = 4;
/// How long a drive may take to change its mode, or to come to rest.
const CHANGE: Nanoseconds = Nanoseconds(1_000_000_000);
const REST: Nanoseconds = Nanoseconds(3_000_000_000);

/// How far it has come; what is counted are answers of the drive.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    Following,
    Entering(u32),
    Looking(u32),
    Found,
    Halting(u32),
    Leaving(u32),
    Done,
}

/// What an answer of the drive means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Heard {
    /// Nothing more.
    Nothing,
    /// It has found its reference.
    Found,
    /// It has given up, or does not do as it is told.
    Failed,
}

/// The homing of one drive.
#[derive(Debug, Clone, Copy)]
pub(super) struct Homing {
    phase: Phase,
    change: u32,
    rest: u32,
}

impl Homing {
    /// In cycles of `period`, not begun.
    pub(super) fn new(period: Nanoseconds) -> Self {
        let cycles =
            |time: Nanoseconds| u32::try_from(time.0 / period.0.max(1)).unwrap_or(u32::MAX);
        Self { phase: Phase::Following, change: cycles(CHANGE), rest: cycles(REST) }
    }

    /// Whether the drive follows no target.
    pub(super) fn is_away(&self) -> bool {
        !matches!(self.phase, Phase::Following | Phase::Done)
    }

    /// An enabled drive is `asked` to look for its reference, or not any more: the bits that its control word has
    /// beside those of its state, and the mode that it shall be in, if not that of its targets.
    pub(super) fn ask(&mut self, asked: bool) -> (u16, Option<i8>) {
        self.phase = match (self.phase, asked) {
            (Phase::Following, true) => Phase::Entering(0),
            (Phase::Done, false) => Phase::Following,
            (Phase::Entering(_) | Phase::Found, false) => Phase::Leaving(0),
            (Phase::Looking(_), false) => Phase::Halting(0),
            (phase, _) => phase,
        };
        match self.phase {
            Phase::Following | Phase::Done | Phase::Leaving(_) => (0, None),
            Phase::Entering(_) => (0, Some(MODE)),
            Phase::Looking(_) | Phase::Found => (START, Some(MODE)),
            Phase::Halting(_) => (HALT, Some(MODE)),
        }
    }

    /// Whether it has found its reference, and waits.
    pub(super) fn has_found(&self) -> bool {
        self.phase == Phase::Found
    }

    /// It waits no longer.
    pub(super) fn leave(&mut self) {
        if self.has_found() {
            self.phase = Phase::Leaving(0);
        }
    }

    /// The drive is not enabled any more.
    pub(super) fn forget(&mut self) {
        self.phase = Phase::Following;
    }

    /// Takes in what a drive says whose targets belong to `mode`, and who is `asked` to look for its reference.
    pub(super) fn hear(&mut self, said: &Said, mode: i8) -> Heard {
        let is_at_rest = said.status & REACHED != 0;
        let mut heard = Heard::Nothing;
        self.phase = match self.phase {
            Phase::Entering(_) if said.mode == MODE => Phase::Looking(0),
            Phase::Entering(answers) if answers >= self.change => {
                heard = Heard::Failed;
                Phase::Leaving(0)
            }
            Phase::Entering(answers) => Phase::Entering(answers + 1),
            Phase::Looking(answers) if answers < ANSWERED => Phase::Looking(answers + 1),
            Phase::Looking(_) if said.status & FAILED != 0 => {
                heard = Heard::Failed;
                Phase::Halting(0)
            }
            Phase::Looking(_) if said.status & ATTAINED != 0 && is_at_rest => {
                heard = Heard::Found;
                Phase::Found
            }
            Phase::Halting(answers)
                if answers >= ANSWERED && is_at_rest || answers >= self.rest =>
            {
                Phase::Leaving(0)
            }
            Phase::Halting(answers) => Phase::Halting(answers.saturating_add(1)),
            Phase::Leaving(answers) if answers >= ANSWERED && said.mode == mode => Phase::Done,
            Phase::Leaving(answers) if answers == self.change => {
                heard = Heard::Failed;
                Phase::Leaving(answers + 1)
            }
            Phase::Leaving(answers) => Phase::Leaving(answers.saturating_add(1)),
            phase => phase,
        };
        heard
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD: Nanoseconds = Nanoseconds(1_000_000);

    fn said(mode: i8, status: u16) -> Said {
        Said { mode, status, ..Said::default() }
    }

    /// A drive that looks for its reference, its mode having been 8.
    fn looking() -> Homing {
        let mut homing = Homing::new(PERIOD);
        assert_eq!(homing.ask(true), (0, Some(6)));
        assert_eq!(homing.hear(&said(8, 0x1237), 8), Heard::Nothing);
        assert_eq!(homing.hear(&said(6, 0x0637), 8), Heard::Nothing);
        assert_eq!(homing.ask(true), (0x10, Some(6)));
        homing
    }

    #[test]
    fn a_reference_that_is_found_is_told_once_and_the_drive_comes_back() {
        let mut homing = looking();
        // What it says yet is of the time before, when it had found one too.
        for _ in 0..ANSWERED {
            assert_eq!(homing.hear(&said(6, 0x1637), 8), Heard::Nothing);
        }
        for status in [0x0237, 0x0237, 0x1237] {
            assert_eq!(homing.hear(&said(6, status), 8), Heard::Nothing);
            assert_eq!(homing.ask(true), (0x10, Some(6)));
        }
        assert_eq!(homing.hear(&said(6, 0x1637), 8), Heard::Found);
        // It waits for whoever looks beside it.
        for _ in 0..20 {
            assert_eq!(homing.ask(true), (0x10, Some(6)));
            assert_eq!(homing.hear(&said(6, 0x1637), 8), Heard::Nothing);
            assert!(homing.has_found() && homing.is_away());
        }
        homing.leave();
        assert_eq!((homing.ask(true), homing.is_away()), ((0, None), true));
        for _ in 0..=ANSWERED {
            assert_eq!(homing.hear(&said(8, 0x1237), 8), Heard::Nothing);
        }
        assert!(!homing.is_away());
        // Still asked for, it is not begun anew; asked for again, it is.
        assert_eq!((homing.ask(true), homing.is_away()), ((0, None), false));
        assert_eq!((homing.ask(false), homing.is_away()), ((0, None), false));
        assert_eq!((homing.ask(true), homing.is_away()), ((0, Some(6)), true));
    }

    #[test]
    fn one_that_is_taken_back_comes_to_rest_first() {
        let mut homing = looking();
        assert_eq!(homing.ask(false), (0x100, Some(6)));
        for _ in 0..20 {
            homing.hear(&said(6, 0x0237), 8);
            assert_eq!(homing.ask(false), (0x100, Some(6)));
        }
        homing.hear(&said(6, 0x0637), 8);
        assert_eq!(homing.ask(false), (0, None));
        for _ in 0..=ANSWERED {
            assert!(homing.is_away());
            homing.hear(&said(8, 0x1237), 8);
        }
        assert_eq!((homing.ask(false), homing.is_away()), ((0, None), false));
    }

    #[test]
    fn failures_are_told() {
        let mut homing = looking();
        for _ in 0..ANSWERED {
            assert_eq!(homing.hear(&said(6, 0x0237), 8), Heard::Nothing);
        }
        assert_eq!(homing.hear(&said(6, 0x2237), 8), Heard::Failed);
        let mut homing = Homing::new(PERIOD);
        homing.ask(true);
        let answers = (0..2000).map(|_| homing.hear(&said(8, 0x1237), 8));
        assert_eq!(
            answers.filter(|heard| *heard == Heard::Failed).count(),
            1,
            "it stays in its mode"
        );
    }
}
