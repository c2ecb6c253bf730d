//! Joints between knots: straight, or along cubics that bend steadily.

use crate::kinematics::Joints;

/// What joins the knots.
///
/// There is no polynomial through all of them: on a circle on a cone one through 17 equidistant
/// knots is off by 82 to 150 mm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Interpolation {
    /// Straight in the joints.
    Linear,
    /// Cubic pieces with steady second derivatives, which are 0 at both ends.
    NaturalCubic,
    /// Cubic pieces with steady second derivatives, the first two of which are one cubic, and the last
    /// two: no end bends less than the curve does.
    NotAKnot,
}

/// Joints as a function of a path's parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Interpolated<const N: usize> {
    knots: Vec<(f64, Joints<N>)>,
    /// Second derivatives at the knots; zeros where the pieces are straight.
    bends: Vec<Joints<N>>,
}

impl<const N: usize> Interpolated<N> {
    /// Joins `knots`, each a parameter and the joints there, the parameters growing.
    pub fn new(knots: Vec<(f64, Joints<N>)>, interpolation: Interpolation) -> Self {
        let bends = match interpolation {
            Interpolation::Linear => vec![Joints::zeros(); knots.len()],
            Interpolation::NaturalCubic => bends(&knots, false),
            Interpolation::NotAKnot => bends(&knots, true),
        };
        Self { knots, bends }
    }

    /// The knots, each a parameter and the joints there.
    pub fn knots(&self) -> &[(f64, Joints<N>)] {
        &self.knots
    }

    /// Number of pieces between the knots.
    pub fn segments(&self) -> usize {
        self.knots.len().saturating_sub(1)
    }

    /// Parameter and joints at a `share`, 0 to 1, of `segment`, which is below [`Self::segments`].
    pub fn at(&self, segment: usize, share: f64) -> (f64, Joints<N>) {
        let ((start, from), (end, to)) = (self.knots[segment], self.knots[segment + 1]);
        let (length, rest) = (end - start, 1.0 - share);
        let weight = |part: f64| (part * part - 1.0) * part * length * length / 6.0;
        let bend = self.bends[segment] * weight(rest) + self.bends[segment + 1] * weight(share);
        (start + length * share, from * rest + to * share + bend)
    }
}

/// Second derivatives that make the first ones steady at each knot between:
/// `h₀·m₀ + 2·(h₀ + h₁)·m₁ + h₁·m₂ = 6·(slope₁ − slope₀)`, solved forwards and back. They are 0 at both
/// ends, or with `goes_on` such that the third derivative does not jump at the second knot and at the last
/// but one: `m₀ = m₁ + (m₁ − m₂)·h₀/h₁`, which is put into that row.
fn bends<const N: usize>(knots: &[(f64, Joints<N>)], goes_on: bool) -> Vec<Joints<N>> {
    let mut bends = vec![Joints::zeros(); knots.len()];
    let mut shares = vec![0.0; knots.len()];
    let Some(last) = knots.len().checked_sub(2).filter(|last| *last > 0) else { return bends };
    let span = |from: usize| knots[from + 1].0 - knots[from].0;
    for middle in 1..=last {
        let [before, here, after] = [knots[middle - 1], knots[middle], knots[middle + 1]];
        let (behind, ahead) = (span(middle - 1), span(middle));
        let turn = (after.1 - here.1) / ahead - (here.1 - before.1) / behind;
        let (mut below, mut pivot, mut above) = (behind, 2.0 * (behind + ahead), ahead);
        match (goes_on, middle == 1, middle == last) {
            // One parabola through three knots.
            (true, true, true) => pivot += behind + ahead,
            (true, true, false) => {
                pivot += behind * (1.0 + behind / ahead);
                above -= behind * behind / ahead;
            }
            (true, false, true) => {
                pivot += ahead * (1.0 + ahead / behind);
                below -= ahead * ahead / behind;
            }
            _ => {}
        }
        pivot -= below * shares[middle - 1];
        shares[middle] = above / pivot;
        bends[middle] = (turn * 6.0 - bends[middle - 1] * below) / pivot;
    }
    for middle in (1..last).rev() {
        bends[middle] = bends[middle] - bends[middle + 1] * shares[middle];
    }
    if goes_on {
        let beyond = |near: usize, far: usize, ratio: f64, bends: &[Joints<N>]| {
            bends[near] + (bends[near] - bends[far]) * ratio
        };
        let first = if last == 1 { bends[1] } else { beyond(1, 2, span(0) / span(1), &bends) };
        let end = match last {
            1 => bends[1],
            _ => beyond(last, last - 1, span(last) / span(last - 1), &bends),
        };
        (bends[0], bends[last + 1]) = (first, end);
    }
    bends
}
