//! How finely a law is worked out, and what it took.

/// How finely a law is worked out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Settings {
    /// The time of a cell [s]; 2 to 4 ms.
    pub cell_time: f64,
    /// The most programmes, 1 or more.
    pub rounds: usize,
    /// At how many places each cell is looked at in the end; 0 is no look.
    pub checks: usize,
    /// The precision of a programme's objective, relative.
    pub precision: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self { cell_time: 3e-3, rounds: 4, checks: 4, precision: 1e-4 }
    }
}

/// What a law took to work out.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Effort {
    /// The number of cells.
    pub cells: usize,
    /// The rows of the last programme.
    pub rows: usize,
    /// The programmes.
    pub rounds: usize,
    /// The steps of all programmes.
    pub steps: usize,
    /// The largest part of a limit used between the places at which it was held; 1 is all.
    pub most: f64,
}
