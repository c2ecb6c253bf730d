//! How the ends of a stretch tie the coefficients of its spline to the unknowns of a programme.

use super::spline::Spline;

/// What ties one end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Tie {
    /// A launch cell of this length [m] between rest and the spline.
    Launch(f64),
    /// u̇² [m²/s²] and ü, positive where the speed grows into the stretch [m/s²].
    Fixed(f64, f64),
}

/// Coefficient j of a spline is `factors[j] · y[unknowns[j]] + fixed[j]`.
#[derive(Debug, Clone, Default)]
pub(super) struct Ties {
    pub(super) unknowns: Vec<usize>,
    pub(super) factors: Vec<f64>,
    pub(super) fixed: Vec<f64>,
    /// The number of unknowns, at least three.
    pub(super) count: usize,
}

impl Ties {
    /// Ties the coefficients of `spline` at both `ends`; an unknown of 1 makes the coefficients
    /// `columns`.
    pub(super) fn tie(&mut self, spline: &Spline, ends: [Tie; 2], columns: &[f64]) {
        let count = spline.coefficients();
        let cells = spline.cells();
        self.factors.clear();
        self.factors.extend_from_slice(columns);
        self.fixed.clear();
        self.fixed.resize(count, 0.0);
        let lengths = [spline.length(0), spline.length(cells - 1)];
        let mut shift = [0, 0];
        for end in 0..2 {
            let outer = if end == 0 { 0 } else { count - 1 };
            let inner = if end == 0 { 1 } else { count - 2 };
            match ends[end] {
                Tie::Launch(length) => {
                    // The launch ends with ü = ⅔·u̇²/length.
                    let growth = 1.0 + 2.0 / 3.0 * lengths[end] / length;
                    self.factors[inner] = growth * self.factors[outer];
                    shift[end] = 1;
                }
                Tie::Fixed(square, acceleration) => {
                    self.fixed[outer] = square;
                    self.fixed[inner] = square + acceleration * lengths[end];
                    self.factors[outer] = 0.0;
                    self.factors[inner] = 0.0;
                    shift[end] = 2;
                }
            }
        }
        self.count = count - shift[0] - shift[1];
        self.unknowns.clear();
        let last = self.count - 1;
        self.unknowns.extend((0..count).map(|index| index.saturating_sub(shift[0]).min(last)));
    }

    /// The coefficients of the unknowns `values`.
    pub(super) fn coefficients(&self, values: &[f64], coefficients: &mut Vec<f64>) {
        coefficients.clear();
        let all = self.unknowns.iter().zip(&self.factors).zip(&self.fixed);
        coefficients
            .extend(all.map(|((&unknown, factor), fixed)| factor * values[unknown] + fixed));
    }
}
