//! What an emulator says of itself at its end, as JSON.

use std::io::Write as _;
use std::path::Path;

use serde::Serialize;

use super::emulator::Emulator;
use super::faults::Account;
use super::layout::STEPGENS;

/// The report; times in seconds since power-on.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// How long it was powered [s].
    pub time: f64,
    /// Frames to the board.
    pub to_board: Frames,
    /// Frames to the master.
    pub to_master: Frames,
    /// When the watchdog bit [s].
    pub bites: Vec<f64>,
    /// The longest that the watchdog waited to be fed without biting [s].
    pub longest_wait: f64,
    /// When it was lit, from and to [s].
    pub lit: Vec<[f64; 2]>,
    /// Steps that left the board, by step generator.
    pub steps: [f64; STEPGENS],
    /// How often a rate was written that pulse and pause of its steps do not allow.
    pub too_fast: u64,
    /// Where the tool is in the machine frame [m], where there is a machine.
    pub tool: Option<[f64; 3]>,
    /// The first fault of the machine's motors, as its number; 0 for none.
    pub fault: u32,
}

/// What happened to the frames of a direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Frames {
    /// Handed in.
    pub sent: u64,
    /// Lost.
    pub lost: u64,
    /// Late.
    pub late: u64,
    /// Doubled.
    pub duplicated: u64,
    /// Damaged.
    pub corrupted: u64,
}

impl From<Account> for Frames {
    fn from(account: Account) -> Self {
        let Account { sent, lost, late, duplicated, corrupted } = account;
        Self { sent, lost, late, duplicated, corrupted }
    }
}

impl Report {
    /// The report of `emulator`.
    pub fn of(emulator: &Emulator) -> Self {
        let board = emulator.board();
        let [to_board, to_master] = emulator.accounts().map(Frames::from);
        let record = board.record();
        let stepgens = &board.modules().stepgens;
        Self {
            time: board.now().seconds(),
            to_board,
            to_master,
            bites: record.bites.iter().map(|at| at.seconds()).collect(),
            longest_wait: board.modules().watchdog.longest().seconds(),
            lit: record.lit(board.now()).iter().map(|span| span.map(|at| at.seconds())).collect(),
            steps: core::array::from_fn(|index| stepgens.delivered(index)),
            too_fast: stepgens.too_fast(),
            tool: board.rig().and_then(super::rig::Rig::tool),
            fault: board.rig().map_or(0, |rig| rig.fault().code),
        }
    }

    /// Writes it to `path`, or to standard output for `-`.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn write(&self, path: &Path) -> std::io::Result<()> {
        let mut text = serde_json::to_string_pretty(self)?;
        text.push('\n');
        if path.as_os_str() == "-" {
            return std::io::stdout().write_all(text.as_bytes());
        }
        std::fs::write(path, text)
    }
}
