//! When requests reach the board, by the board's own clock.
//!
//! The board's DPLL runs free here, as a clock that goes round in some ten cycles. Each reply tells where it
//! stood when the request arrived. Requests leave at the deadlines, some later than they should, so the
//! earliest arrivals of a window are those of a computer and a network in time: they are the grid that the
//! gate's edges stand on. Neither a late request nor a late start moves an edge.

/// Arrivals from which one correction is made.
const WINDOW: u32 = 64;
/// The most that the grid moves by a correction in one cycle [s].
const SLEW: f64 = 50e-9;
/// A correction beyond this is a step, not a drift [s]: the first ones are.
const STEP: f64 = 20e-6;
/// By how much a request may be earlier than all before it [s].
const EARLIEST: f64 = 100e-6;
/// What of a window's error is taken for the clocks' difference of rate.
const RATE_GAIN: f64 = 0.25;
/// The most by which the two clocks may differ.
const RATE_LIMIT: f64 = 200e-6;

/// The arrivals as they should be, in turns of the board's clock.
#[derive(Debug, Clone, Copy)]
pub struct Grid {
    /// Time of a turn [s].
    turn: f64,
    /// Turns in a cycle by the nominal rates.
    nominal: f64,
    /// What the board's clock is faster by.
    rate: f64,
    /// Where the arrival of the newest request is due, 0..1; `None` before the first reply.
    due: Option<f64>,
    /// What the corrections still have to move [s].
    pending: f64,
    /// The earliest arrivals of the window: the second one counts, since a reply may have been damaged.
    earliest: [f64; 2],
    arrivals: u32,
    settled: bool,
}

impl Grid {
    /// A grid of cycles of `period` [s], on a clock whose turn takes `turn` [s].
    pub fn new(turn: f64, period: f64) -> Self {
        let nominal = period / turn;
        Self {
            turn,
            nominal,
            rate: 0.0,
            due: None,
            pending: 0.0,
            earliest: [f64::MAX; 2],
            arrivals: 0,
            settled: false,
        }
    }

    /// A cycle begins.
    pub fn advance(&mut self) {
        let slew = self.pending.clamp(-SLEW, SLEW);
        self.pending -= slew;
        if let Some(due) = &mut self.due {
            *due = fraction(*due + self.nominal * (1.0 + self.rate) + slew / self.turn);
        }
    }

    /// The request of this cycle arrived where the board's clock stood at `phase`, 0..1; how late it was [s].
    pub fn arrive(&mut self, phase: f64) -> f64 {
        let Some(due) = self.due else {
            self.due = Some(phase);
            return 0.0;
        };
        let late = between(due, phase) * self.turn;
        let [first, second] = self.earliest;
        self.earliest = [first.min(late), first.max(late).min(second)];
        self.arrivals += 1;
        if self.arrivals == WINDOW {
            self.correct();
        }
        late
    }

    /// Where the board's clock stands `time` [s] after this cycle's arrival is due, 0..1, and so much of a
    /// period later; `None` before the first reply.
    pub fn phase(&self, time: f64) -> Option<f64> {
        Some(fraction(self.due? + time / self.turn))
    }

    /// Whether the first window is over, so that instants can be told.
    pub fn is_settled(&self) -> bool {
        self.settled
    }

    /// Whether a request can have arrived where the board's clock stood at `phase`, 0..1: not much earlier than
    /// any before, and not after its cycle.
    pub fn believes(&self, phase: f64) -> bool {
        let Some(due) = self.due.filter(|_| self.settled) else { return true };
        let late = between(due, phase) * self.turn;
        (-EARLIEST..self.nominal * self.turn).contains(&late)
    }

    /// Forgets all arrivals.
    pub fn restart(&mut self) {
        *self = Self::new(self.turn, self.nominal * self.turn);
    }

    /// Time of a turn [s].
    pub fn turn(&self) -> f64 {
        self.turn
    }

    fn correct(&mut self) {
        let [_, error] = self.earliest;
        (self.earliest, self.arrivals) = ([f64::MAX; 2], 0);
        self.settled = true;
        if error.abs() > STEP {
            if let Some(due) = &mut self.due {
                *due = fraction(*due + error / self.turn);
            }
            self.pending = 0.0;
            return;
        }
        self.pending = error;
        let cycles = f64::from(WINDOW);
        let rate = RATE_GAIN * error / (cycles * self.nominal * self.turn);
        self.rate = (self.rate + rate).clamp(-RATE_LIMIT, RATE_LIMIT);
    }
}

/// From `from` to `to` the short way round, −0.5..0.5.
fn between(from: f64, to: f64) -> f64 {
    let turns = to - from;
    turns - turns.round()
}

fn fraction(turns: f64) -> f64 {
    turns - turns.floor()
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::random::SplitMix64;

    /// The error of the grid [s] after `cycles`, where requests are late by up to 300 µs at random and the
    /// board's clock is fast by `drift`.
    fn error(drift: f64, cycles: u32) -> f64 {
        let (turn, period) = (11e-3, 1e-3);
        let mut grid = Grid::new(turn, period);
        let mut random = SplitMix64::new(7);
        let mut worst: f64 = 0.0;
        for cycle in 0..cycles {
            grid.advance();
            let on_time = 0.3 + f64::from(cycle) * period * (1.0 + drift) / turn;
            let late = random.fraction() * random.fraction() * 300e-6;
            grid.arrive(fraction(on_time + late / turn));
            if cycle + 1000 > cycles {
                let off = grid.phase(0.0).map_or(1.0, |phase| between(on_time, phase) * turn);
                worst = worst.max(off.abs());
            }
        }
        worst
    }

    #[test]
    fn it_follows_the_earliest_arrivals_whatever_the_clocks_differ_by() {
        for drift in [0.0, 50e-6, -50e-6, 100e-6] {
            let error = error(drift, 5000);
            assert!(error < 6e-6, "{drift}: {error}");
        }
    }

    #[test]
    fn without_jitter_it_is_exact() {
        let mut grid = Grid::new(11e-3, 1e-3);
        for cycle in 0..1000 {
            grid.advance();
            let late = grid.arrive(fraction(f64::from(cycle) / 11.0));
            assert!(late.abs() < 1e-12, "{late}");
        }
    }
}
