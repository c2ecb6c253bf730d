//! Where the knots of a smooth curve lie: close where the polyline bends on a small scale, wide elsewhere.

/// Intervals between knots to a chord between bends.
const PER_CHORD: f64 = 1.0;

/// By how much the distance between knots may grow with the way from a bend.
const GROWTH: f64 = 0.5;

/// Lays knots along the chords between bends: `bends` holds their places along the way [m], rising from 0.
/// No two knots are closer than `least` [m]; `knots` is emptied first.
pub(crate) fn lay(bends: &[f64], least: f64, knots: &mut Vec<f64>) {
    let scales = scales(bends);
    knots.clear();
    knots.push(bends[0]);
    for (ends, scale) in bends.windows(2).zip(scales.windows(2)) {
        divide(
            ends[0],
            ends[1],
            &|at: f64| {
                (scale[0] + GROWTH * (at - ends[0])).min(scale[1] + GROWTH * (ends[1] - at))
                    / PER_CHORD
            },
            knots,
        );
    }
    thin(least, knots);
}

/// The distance wanted between knots at each bend [m].
fn scales(bends: &[f64]) -> Vec<f64> {
    let mut scales: Vec<f64> = (0..bends.len())
        .map(|i| {
            let before = if i > 0 { bends[i] - bends[i - 1] } else { f64::INFINITY };
            let after = bends.get(i + 1).map_or(f64::INFINITY, |next| next - bends[i]);
            before.min(after)
        })
        .collect();
    for i in 1..bends.len() {
        scales[i] = scales[i].min(scales[i - 1] + GROWTH * (bends[i] - bends[i - 1]));
    }
    for i in (1..bends.len()).rev() {
        scales[i - 1] = scales[i - 1].min(scales[i] + GROWTH * (bends[i] - bends[i - 1]));
    }
    scales
}

/// Halves a stretch until it suits the distance wanted in its middle; adds the knots but the first.
fn divide(from: f64, to: f64, wanted: &impl Fn(f64) -> f64, knots: &mut Vec<f64>) {
    let middle = from + (to - from) / 2.0;
    if to - from > 1.5 * wanted(middle) && middle > from && middle < to {
        divide(from, middle, wanted, knots);
        divide(middle, to, wanted, knots);
    } else {
        knots.push(to);
    }
}

/// Drops knots closer than `least` to the one before them, but keeps the last.
fn thin(least: f64, knots: &mut Vec<f64>) {
    let last = knots[knots.len() - 1];
    let mut kept = knots[0];
    knots.retain(|&knot| {
        let keep = knot == kept || (knot - kept >= least && last - knot >= least);
        if keep {
            kept = knot;
        }
        keep
    });
    knots.dedup();
    knots.push(last);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn knots_are_close_at_close_bends_and_wide_far_from_them() {
        let mut knots = Vec::new();
        lay(&[0.0, 1e-4, 2e-4, 0.05, 0.0501], 1e-6, &mut knots);
        let widths: Vec<f64> = knots.windows(2).map(|ends| ends[1] - ends[0]).collect();
        assert!(widths[0] <= 1.01e-4 && widths[widths.len() - 1] <= 1.01e-4);
        assert!(widths.iter().any(|&width| width > 5e-3));
        assert!(knots.len() < 30, "{}", knots.len());
    }

    #[test]
    fn no_knots_lie_closer_than_asked_for() {
        let mut knots = Vec::new();
        lay(&[0.0, 1e-9, 1e-3, 1e-3, 2e-3], 1e-5, &mut knots);
        assert!(knots.windows(2).all(|ends| ends[1] - ends[0] >= 1e-5), "{knots:?}");
    }
}
