//! Error diffusion: what a dot is too dark or too light is made good by those after it.

/// Rows that errors reach, that of the dot among them.
const REACH: usize = 3;

/// How the error of a dot is shared out.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kernel {
    /// Shares of five dots around the one above them, in this row and the two after it.
    shares: [[u8; 5]; REACH],
    /// What they are parts of.
    whole: u8,
}

impl Kernel {
    pub(super) const FLOYD_STEINBERG: Self =
        Self { shares: [[0, 0, 0, 7, 0], [0, 3, 5, 1, 0], [0; 5]], whole: 16 };
    pub(super) const JARVIS: Self =
        Self { shares: [[0, 0, 0, 7, 5], [3, 5, 7, 5, 3], [1, 3, 5, 3, 1]], whole: 48 };
    pub(super) const STUCKI: Self =
        Self { shares: [[0, 0, 0, 8, 4], [2, 4, 8, 4, 2], [1, 2, 4, 2, 1]], whole: 42 };
}

/// A kernel and the errors that later rows still get.
#[derive(Debug, Clone)]
pub(super) struct Diffusion {
    kernel: Kernel,
    /// Of this row and the two after it, two dots wider at each end.
    errors: [Vec<f64>; REACH],
}

impl Diffusion {
    pub(super) fn new(kernel: Kernel, columns: usize) -> Self {
        Self { kernel, errors: [(); REACH].map(|()| vec![0.0; columns + 4]) }
    }

    /// Dots of the next row: to the right in rows of even number, to the left in others.
    pub(super) fn row(&mut self, number: usize, values: &[f64], levels: &mut [u8]) {
        let is_back = number % 2 == 1;
        for step in 0..values.len() {
            let column = if is_back { values.len() - 1 - step } else { step };
            let wanted = values[column] + self.errors[0][column + 2];
            let is_marked = wanted < 0.5;
            levels[column] = if is_marked { 255 } else { 0 };
            let error = (wanted - if is_marked { 0.0 } else { 1.0 }) / f64::from(self.kernel.whole);
            for (errors, shares) in self.errors.iter_mut().zip(&self.kernel.shares) {
                let around = &mut errors[column..column + 5];
                for (place, share) in shares.iter().enumerate() {
                    let place = if is_back { 4 - place } else { place };
                    around[place] += error * f64::from(*share);
                }
            }
        }
        self.errors.rotate_left(1);
        self.errors[REACH - 1].fill(0.0);
    }
}
