//! A linear programme whose rows each touch three neighbouring unknowns.

/// How many rows are worked on at once.
pub(super) const LANES: usize = 4;
/// One number of each of these rows.
pub(super) type Lanes = [f64; LANES];

/// Some rows that touch the same three unknowns, each `weights · y ≤ top`, and the solver's state
/// of them.
#[derive(Debug, Clone, Copy)]
pub(super) struct Group {
    pub(super) weights: [Lanes; 3],
    pub(super) top: Lanes,
    /// The room left.
    pub(super) room: Lanes,
    /// The price of the row.
    pub(super) price: Lanes,
    /// `top − weights · y − room`.
    pub(super) off: Lanes,
    /// Price by room.
    pub(super) ratio: Lanes,
    /// The second order of the step in room and price.
    pub(super) cross: Lanes,
    pub(super) room_step: Lanes,
    pub(super) price_step: Lanes,
}

impl Group {
    /// Rows that hold whatever the unknowns are.
    const EMPTY: Self = Self {
        weights: [[0.0; LANES]; 3],
        top: [1.0; LANES],
        room: [1.0; LANES],
        price: [0.0; LANES],
        off: [0.0; LANES],
        ratio: [0.0; LANES],
        cross: [0.0; LANES],
        room_step: [0.0; LANES],
        price_step: [0.0; LANES],
    };
}

/// The rows on the unknowns `first`, `first + 1` and `first + 2`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    pub(super) first: usize,
    /// Its groups, start and end.
    pub(super) groups: (usize, usize),
    /// Its part of the time, start and end.
    pub(super) terms: (usize, usize),
}

/// A part of the time: `length` by the root of `weights · y + fixed`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Term {
    pub(super) weights: [f64; 3],
    pub(super) fixed: f64,
    pub(super) length: f64,
}

impl Term {
    /// The change of the square of the speed for a step of the unknowns.
    pub(super) fn change(&self, step: [f64; 3]) -> f64 {
        let [one, two, three] = self.weights;
        one * step[0] + two * step[1] + three * step[2]
    }

    /// The square of the speed.
    pub(super) fn square(&self, y: [f64; 3]) -> f64 {
        self.change(y) + self.fixed
    }
}

/// Minimise the time, the sum of the terms, within the rows and `y ≥ 0`.
#[derive(Debug, Clone, Default)]
pub(super) struct Program {
    unknowns: usize,
    pub(super) terms: Vec<Term>,
    pub(super) groups: Vec<Group>,
    pub(super) blocks: Vec<Block>,
    /// The rows in the last group.
    filled: usize,
    rows: usize,
}

impl Program {
    /// Begins a programme of `unknowns`, at least three.
    pub(super) fn begin(&mut self, unknowns: usize) {
        self.unknowns = unknowns;
        self.terms.clear();
        self.groups.clear();
        self.blocks.clear();
        self.rows = 0;
    }

    /// The number of unknowns.
    pub(super) fn unknowns(&self) -> usize {
        self.unknowns
    }

    /// The number of rows.
    pub(super) fn rows(&self) -> usize {
        self.rows
    }

    /// Begins the rows on the unknowns from `first`.
    pub(super) fn block(&mut self, first: usize) {
        let start = self.groups.len();
        let terms = self.terms.len();
        self.blocks.push(Block { first, groups: (start, start), terms: (terms, terms) });
        self.filled = LANES;
    }

    /// Adds a part of the time to the block begun last.
    pub(super) fn term(&mut self, term: Term) {
        if let Some(block) = self.blocks.last_mut()
            && term.weights != [0.0; 3]
        {
            self.terms.push(term);
            block.terms.1 += 1;
        }
    }

    /// Adds a row to the block begun last; `weights` and `top` in any unit.
    pub(super) fn row(&mut self, weights: [f64; 3], top: f64) {
        let largest = weights.iter().fold(0.0_f64, |most, weight| most.max(weight.abs()));
        if largest == 0.0 {
            return;
        }
        if self.filled == LANES {
            self.groups.push(Group::EMPTY);
            self.filled = 0;
            if let Some(block) = self.blocks.last_mut() {
                block.groups.1 += 1;
            }
        }
        let scale = 1.0 / top.abs().max(1e-7 * largest);
        if let Some(group) = self.groups.last_mut() {
            for (lanes, weight) in group.weights.iter_mut().zip(weights) {
                lanes[self.filled] = weight * scale;
            }
            group.top[self.filled] = top * scale;
            self.filled += 1;
            self.rows += 1;
        }
    }

    /// The most that the rows let each unknown be, all broken by `broken` of their tops: those of which all
    /// weights are positive. `most` keeps what it is where none bounds an unknown.
    pub(super) fn largest(&self, broken: f64, most: &mut [f64]) {
        for block in &self.blocks {
            let most = &mut most[block.first..block.first + 3];
            for group in &self.groups[block.groups.0..block.groups.1] {
                for lane in 0..LANES {
                    let weights = [0, 1, 2].map(|k| group.weights[k][lane]);
                    if weights.iter().any(|weight| *weight < 0.0) {
                        continue;
                    }
                    for (most, weight) in most.iter_mut().zip(weights) {
                        // Of no weight it is no bound: what is divided by 0 is infinite.
                        *most = most.min((group.top[lane] + broken).max(0.0) / weight);
                    }
                }
            }
        }
    }

    /// The block whose rows cost most where no answer was found: there they exclude each other, and their prices
    /// grow without bound. Where they are broken most says less, as a step breaks one row for another.
    pub(super) fn dearest(&self) -> usize {
        let mut dearest = (f64::NEG_INFINITY, 0);
        for (index, block) in self.blocks.iter().enumerate() {
            let groups = &self.groups[block.groups.0..block.groups.1];
            let prices: f64 = groups.iter().flat_map(|group| group.price).sum();
            if prices > dearest.0 {
                dearest = (prices, index);
            }
        }
        dearest.1
    }

    /// The largest factor up to 1 by which `unknowns` can be multiplied to keep every row whose
    /// top is positive.
    pub(super) fn factor(&self, unknowns: &[f64]) -> f64 {
        let mut factor = 1.0_f64;
        for block in &self.blocks {
            let y = &unknowns[block.first..block.first + 3];
            for group in &self.groups[block.groups.0..block.groups.1] {
                for lane in 0..LANES {
                    let used: f64 = (0..3).map(|k| group.weights[k][lane] * y[k]).sum();
                    if used * factor > group.top[lane] && group.top[lane] > 0.0 {
                        factor = group.top[lane] / used;
                    }
                }
            }
        }
        factor
    }
}
