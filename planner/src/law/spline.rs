//! The quadratic spline of u̇² over the cells of a stretch.

/// The borders of the cells of a stretch. A function on them has one coefficient more than there
/// are borders; in cell i those at i, i + 1 and i + 2 count, and positive coefficients make a
/// positive function.
#[derive(Debug, Clone, Default)]
pub(super) struct Spline {
    /// Growing, from the start of the stretch [m].
    pub(super) borders: Vec<f64>,
}

impl Spline {
    /// The number of cells.
    pub(super) fn cells(&self) -> usize {
        self.borders.len().saturating_sub(1)
    }

    /// The number of coefficients.
    pub(super) fn coefficients(&self) -> usize {
        self.cells() + 2
    }

    /// The length of a cell [m].
    pub(super) fn length(&self, cell: usize) -> f64 {
        self.borders[cell + 1] - self.borders[cell]
    }

    /// The lengths of the cell before, the cell and the cell after [m]; 0 beyond the ends.
    fn lengths(&self, cell: usize) -> [f64; 3] {
        let before = if cell == 0 { 0.0 } else { self.length(cell - 1) };
        let after = if cell + 1 == self.cells() { 0.0 } else { self.length(cell + 1) };
        [before, self.length(cell), after]
    }

    /// The place in a cell [m].
    pub(super) fn place(&self, cell: usize, part: f64) -> f64 {
        self.borders[cell] + part * self.length(cell)
    }

    /// Where coefficient `index` counts most [m].
    pub(super) fn centre(&self, index: usize) -> f64 {
        let last = self.cells();
        let low = self.borders[index.saturating_sub(1).min(last)];
        let high = self.borders[index.min(last)];
        (low + high) / 2.0
    }

    /// The weights of the three coefficients of a cell in ü′, ü and u̇² at `part` of it, 0 to 1.
    pub(super) fn weights(&self, cell: usize, part: f64) -> [[f64; 3]; 3] {
        let [before, length, after] = self.lengths(cell);
        let (first, second) = (1.0 / (before + length), 1.0 / (length + after));
        let rest = 1.0 - part;
        let start = [length * first, before * first];
        let end = [after * second, length * second];
        [
            [first / length, -(first + second) / length, second / length],
            [-first * rest, first * rest - second * part, second * part],
            [
                start[0] * rest * rest,
                start[1] * rest * rest + 2.0 * part * rest + end[0] * part * part,
                end[1] * part * part,
            ],
        ]
    }

    /// (ü′, ü, u̇²) at `part` of a cell, 0 to 1.
    pub(super) fn state(&self, coefficients: &[f64], cell: usize, part: f64) -> [f64; 3] {
        let [before, length, after] = self.lengths(cell);
        let (low, middle, high) =
            (coefficients[cell], coefficients[cell + 1], coefficients[cell + 2]);
        let start = (length * low + before * middle) / (before + length);
        let end = (after * middle + length * high) / (length + after);
        let first = (middle - low) / (before + length);
        let second = (high - middle) / (length + after);
        let rest = 1.0 - part;
        [
            (second - first) / length,
            first * rest + second * part,
            start * rest * rest + 2.0 * part * rest * middle + end * part * part,
        ]
    }

    /// The time the cells take [s], near enough to compare two laws.
    pub(super) fn duration(&self, coefficients: &[f64]) -> f64 {
        const NODES: [(f64, f64); 3] =
            [(0.112_701_665, 5.0 / 18.0), (0.5, 8.0 / 18.0), (0.887_298_335, 5.0 / 18.0)];
        let mut total = 0.0;
        for cell in 0..self.cells() {
            for (part, weight) in NODES {
                let [_, _, square] = self.state(coefficients, cell, part);
                total += weight * self.length(cell) / square.max(1e-24).sqrt();
            }
        }
        total
    }
}

#[cfg(test)]
mod tests {
    use super::Spline;

    #[test]
    fn weights_and_states_agree_and_the_slope_is_the_derivative() {
        let spline = Spline { borders: vec![0.0, 0.1, 0.4, 0.5, 1.1] };
        let coefficients = [1.0, 3.0, 2.0, 5.0, 4.0, 4.5];
        for cell in 0..4 {
            for part in [0.0, 0.3, 1.0] {
                let state = spline.state(&coefficients, cell, part);
                let weights = spline.weights(cell, part);
                for (order, value) in state.iter().enumerate() {
                    let sum: f64 = (0..3).map(|k| weights[order][k] * coefficients[cell + k]).sum();
                    assert!((sum - value).abs() < 1e-9);
                }
                let step = 1e-6;
                let ahead = spline.state(&coefficients, cell, part + step)[2];
                let behind = spline.state(&coefficients, cell, part - step)[2];
                let slope = (ahead - behind) / (2.0 * step * spline.length(cell));
                assert!((slope / 2.0 - state[1]).abs() < 1e-5);
            }
        }
    }
}
