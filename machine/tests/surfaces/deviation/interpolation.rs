//! Joints between knots: straight, or along cubics that bend steadily.

use machine::kinematics::Joints;

/// What joins the knots.
///
/// There is no polynomial through all of them: on a circle on a cone one through 17 equidistant
/// knots is off by 82 to 150 mm.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Interpolation {
    /// Straight in the joints.
    Linear,
    /// Cubic pieces with steady second derivatives, which are 0 at both ends.
    NaturalCubic,
}

/// Joints as a function of a path's parameter.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Interpolated<const N: usize> {
    knots: Vec<(f64, Joints<N>)>,
    /// Second derivatives at the knots; zeros where the pieces are straight.
    bends: Vec<Joints<N>>,
}

impl<const N: usize> Interpolated<N> {
    /// Joins `knots`, each a parameter and the joints there, the parameters growing.
    pub(crate) fn new(knots: Vec<(f64, Joints<N>)>, interpolation: Interpolation) -> Self {
        let bends = match interpolation {
            Interpolation::Linear => vec![Joints::zeros(); knots.len()],
            Interpolation::NaturalCubic => natural_bends(&knots),
        };
        Self { knots, bends }
    }

    /// The knots, each a parameter and the joints there.
    pub(crate) fn knots(&self) -> &[(f64, Joints<N>)] {
        &self.knots
    }

    /// Number of pieces between the knots.
    pub(crate) fn segments(&self) -> usize {
        self.knots.len().saturating_sub(1)
    }

    /// Parameter and joints at a `share`, 0 to 1, of `segment`, which is below [`Self::segments`].
    pub(crate) fn at(&self, segment: usize, share: f64) -> (f64, Joints<N>) {
        let ((start, from), (end, to)) = (self.knots[segment], self.knots[segment + 1]);
        let (length, rest) = (end - start, 1.0 - share);
        let weight = |part: f64| (part * part - 1.0) * part * length * length / 6.0;
        let bend = self.bends[segment] * weight(rest) + self.bends[segment + 1] * weight(share);
        (start + length * share, from * rest + to * share + bend)
    }
}

/// Second derivatives that are 0 at both ends and make the first ones steady at each knot between:
/// `h₀·m₀ + 2·(h₀ + h₁)·m₁ + h₁·m₂ = 6·(slope₁ − slope₀)`, solved forwards and back.
fn natural_bends<const N: usize>(knots: &[(f64, Joints<N>)]) -> Vec<Joints<N>> {
    let mut bends = vec![Joints::zeros(); knots.len()];
    let mut shares = vec![0.0; knots.len()];
    for middle in 1..knots.len().saturating_sub(1) {
        let [before, here, after] = [knots[middle - 1], knots[middle], knots[middle + 1]];
        let (behind, ahead) = (here.0 - before.0, after.0 - here.0);
        let turn = (after.1 - here.1) / ahead - (here.1 - before.1) / behind;
        let pivot = 2.0 * (behind + ahead) - behind * shares[middle - 1];
        shares[middle] = ahead / pivot;
        bends[middle] = (turn * 6.0 - bends[middle - 1] * behind) / pivot;
    }
    for middle in (1..knots.len().saturating_sub(1)).rev() {
        bends[middle] = bends[middle] - bends[middle + 1] * shares[middle];
    }
    bends
}
