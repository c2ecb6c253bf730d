//! Images at another number of pixels: averages of areas where there are fewer, lines between pixels
//! where there are more.

use core::ops::Range;

/// An image of which rows are asked for at another size.
#[derive(Debug, Clone)]
pub(super) struct Resample<'a> {
    pixels: &'a [u8],
    columns: usize,
    rows: usize,
    marked_rows: usize,
    /// For each column the pixels that it takes and their weights.
    across: Vec<(Range<usize>, [f64; 2])>,
    /// A row of the image, resampled up and down alone.
    sums: Vec<f64>,
}

impl<'a> Resample<'a> {
    /// From (columns, rows) to others, all at least 1; as many pixels as the first say.
    pub(super) fn new(
        pixels: &'a [u8],
        (columns, rows): (usize, usize),
        marked: (usize, usize),
    ) -> Self {
        let across = (0..marked.0).map(|column| taken(column, columns, marked.0)).collect();
        Self { pixels, columns, rows, marked_rows: marked.1, across, sums: vec![0.0; columns] }
    }

    /// A row from the top, 0 black to 1 white.
    pub(super) fn row(&mut self, row: usize, values: &mut [f64]) {
        let (range, weights) = taken(row, self.rows, self.marked_rows);
        self.sums.fill(0.0);
        for line in range.clone() {
            let weight = weight(&range, weights, line) / 255.0;
            let pixels = &self.pixels[line * self.columns..(line + 1) * self.columns];
            for (sum, pixel) in self.sums.iter_mut().zip(pixels) {
                *sum += f64::from(*pixel) * weight;
            }
        }
        for (value, (range, weights)) in values.iter_mut().zip(&self.across) {
            let sums =
                range.clone().map(|column| self.sums[column] * weight(range, *weights, column));
            *value = sums.sum();
        }
    }
}

/// Which of `count` pixels the place `index` of `marked` ones takes, and the weights of the first and the
/// last of them. Between them weights are alike; all sum to 1.
fn taken(index: usize, count: usize, marked: usize) -> (Range<usize>, [f64; 2]) {
    if marked <= count {
        // In units of 1/marked of a pixel all ends are whole.
        let (from, to) = (index * count, (index + 1) * count);
        let (first, last) = (from / marked, (to - 1) / marked);
        let share = |part: usize| part as f64 / count as f64;
        if first == last {
            return (first..first + 1, [1.0, 1.0]);
        }
        let weights = [share((first + 1) * marked - from), share(to - last * marked)];
        (first..last + 1, weights)
    } else {
        // Between the middles of two pixels; outside of the outermost middles as those.
        let at = (index as f64 + 0.5) * count as f64 / marked as f64 - 0.5;
        let first = at.floor().clamp(0.0, (count - 1) as f64) as usize;
        let share = (at - first as f64).clamp(0.0, 1.0);
        if share == 0.0 || first + 1 == count {
            return (first..first + 1, [1.0, 1.0]);
        }
        (first..first + 2, [1.0 - share, share])
    }
}

fn weight(range: &Range<usize>, [first, last]: [f64; 2], at: usize) -> f64 {
    if at == range.start {
        first
    } else if at + 1 == range.end {
        last
    } else {
        // What the ends leave, shared alike.
        (1.0 - first - last) / (range.len() - 2) as f64
    }
}
