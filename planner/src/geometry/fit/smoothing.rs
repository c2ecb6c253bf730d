//! The smoothest curve within tolerance of a stretch of a polyline.
//!
//! A cubic spline makes Σ w·|x(uᵢ) − pᵢ|² + ∫ ℓ⁶·|x‴|² least: ℓ is the length over which the curve is stiff,
//! from the distance between its knots. Points that end up too far from the curve get more weight and all
//! is solved anew, each time with the points moved to their nearest places on the curve and the knots to the
//! curve's arc length.

use nalgebra::Vector3;

use crate::geometry::fit::banded::Banded;
use crate::geometry::fit::basis::{self, Local};
use crate::geometry::fit::knots;
use crate::geometry::fit::samples::{self, Sample, Start, Stretch};
use crate::geometry::jet::Jet;

/// The part of the tolerance the distance between curve and polyline may take.
pub(crate) const SHARE: f64 = 0.6;

/// The part of that share to which samples are held: between them the curve may be a little farther off.
const MARGIN: f64 = 0.95;

/// The part of the tolerance that may be taken where the stiff curve keeps it but noise makes less a wiggle.
const LOOSE: f64 = 0.9;

/// Solutions at most.
const ROUNDS: usize = 80;

/// Solutions before samples get more weight: the first knows neither the bow nor the arc length.
const UNWEIGHED: usize = 3;

/// The greatest distance must fall by this factor, or samples beyond the limit grow fewer, ...
const PROGRESS: f64 = 0.97;

/// ... within so many more solutions; else the curve is made less stiff.
const PATIENCE: usize = 3;

/// The weight of a sample in its weight at first, at most.
const HEAVIEST: f64 = 1024.0;

/// Knots are added where the stiff length in distances between knots is less than this.
const SLACK: f64 = 1.5;

/// The stiff length in distances between knots, at most.
const STIFFEST: f64 = 6.0;

/// The part of the distance allowed that the first stiffness is to take on a bow.
const AIM: f64 = 0.25;

/// Chords between bends to either side from which a bow's radius is taken.
const SPAN: usize = 2;

/// The curve's speed by its parameter is between this and its inverse.
const SLOWEST: f64 = 0.6;

/// The stiff length at a free end against that within the curve.
const END_STIFFNESS: f64 = 0.5;

/// By how much the stiff length may grow along the curve.
const TAPER: f64 = 0.25;

/// How often neighbouring stiff lengths are averaged.
const SMOOTHINGS: usize = 8;

/// Samples farther from the curve than so many times the limit make it less stiff.
const FAR: f64 = 3.0;

/// The factor by which the stiff length becomes less where samples are far.
const SOFTER: f64 = 0.7;

/// The knots keep their places once they are off the arc length by no more than this part.
const EVEN: f64 = 1e-3;

/// Finds smooth curves; holds the last one and the room for the next.
#[derive(Debug, Default)]
pub(crate) struct Smoother {
    /// What the curve must come near.
    samples: Vec<Sample>,
    /// Borders of the pieces [m].
    knots: Vec<f64>,
    /// The B-splines of every interval between knots.
    locals: Vec<Local>,
    /// At the start of every piece.
    jets: Vec<Jet>,
    /// The normal equations.
    banded: Banded,
    /// Parameters of the bends at first [m].
    places: Vec<f64>,
    /// Of each interval between knots, the length over which the curve is stiff there [m].
    stiff: Vec<f64>,
    /// Of each interval between knots, the third derivative of the bow the curve makes there [1/m²].
    bows: Vec<Vector3<f64>>,
}

impl Smoother {
    /// Smooths a stretch. If that cannot be, gives the number of the vertex where it should be cut.
    pub(crate) fn smooth(&mut self, stretch: &Stretch<'_>) -> Result<(), usize> {
        let mut limit = MARGIN * SHARE * stretch.tolerance;
        let loose = LOOSE * stretch.tolerance;
        let mut noisy = false;
        self.lay(stretch);
        self.stiffen(stretch);
        let (mut best, mut fewest, mut idle) = (f64::INFINITY, usize::MAX, 0);
        for round in 1..=ROUNDS {
            self.even(stretch);
            self.solve(stretch).ok_or(stretch.vertices.len() / 2)?;
            self.project(stretch.ends, limit);
            let (worst, many) = self.excess(limit);
            if round >= UNWEIGHED {
                noisy |= worst <= loose;
                if many == 0 && self.steady() {
                    return Ok(());
                }
                idle = if worst < PROGRESS * best || many < fewest { 0 } else { idle + 1 };
                (best, fewest) = (best.min(worst), fewest.min(many));
                self.weigh(limit);
            }
            if idle > PATIENCE {
                if noisy && limit < loose {
                    limit = loose;
                    self.samples.iter_mut().for_each(|sample| sample.weight = sample.least);
                } else {
                    self.soften(limit);
                    self.refine(limit, stretch.tolerance);
                }
                (best, fewest, idle) = (f64::INFINITY, usize::MAX, 0);
            } else {
                self.soften(FAR * limit);
            }
        }
        Err(self.worst())
    }

    /// The greatest distance of a sample from the curve [m], and how many are beyond the limit.
    fn excess(&self, limit: f64) -> (f64, usize) {
        self.samples.iter().fold((0.0, 0), |(worst, many), sample| {
            (sample.distance.max(worst), many + usize::from(sample.distance > limit))
        })
    }

    /// Borders of the pieces [m].
    pub(crate) fn knots(&self) -> &[f64] {
        &self.knots
    }

    /// The jet at the start of every piece.
    pub(crate) fn jets(&self) -> &[Jet] {
        &self.jets
    }

    /// The greatest distance of a vertex or a place along a chord from the curve [m].
    pub(crate) fn distance(&self) -> f64 {
        self.excess(0.0).0
    }

    /// The curve's end [m].
    pub(crate) fn length(&self) -> f64 {
        self.knots[self.knots.len() - 1]
    }

    /// The parameters of the vertices [m].
    pub(crate) fn parameters(&self) -> impl Iterator<Item = f64> + '_ {
        self.samples.iter().filter(|sample| sample.vertex).map(|sample| sample.u)
    }

    /// Lays knots and samples for a stretch.
    fn lay(&mut self, stretch: &Stretch<'_>) {
        self.places.clear();
        self.places.push(0.0);
        let mut place = 0.0;
        for ends in stretch.bends.windows(2) {
            place += (stretch.vertex(ends[1]) - stretch.vertex(ends[0])).norm();
            self.places.push(place);
        }
        knots::lay(&self.places, stretch.tolerance / 4.0, &mut self.knots);
        samples::lay(stretch, &self.places, &self.knots, &mut self.samples);
        self.jets.clear();
        basis::locals(&self.knots, &mut self.locals);
    }

    /// Moves the knots to the arc length of the curve there is, if they are off.
    fn even(&mut self, stretch: &Stretch<'_>) {
        if self.jets.is_empty() {
            return;
        }
        let ratios: Vec<f64> = self
            .knots
            .windows(2)
            .zip(&self.jets)
            .map(|(knots, jet)| stretch_of(jet, knots[1] - knots[0]))
            .collect();
        if self.samples.iter().any(|sample| sample.distance > FAR * SHARE * stretch.tolerance)
            || ratios.iter().all(|ratio| (ratio - 1.0).abs() <= EVEN)
        {
            return;
        }
        let mut interval = 0;
        let mut moved = Vec::with_capacity(self.knots.len());
        moved.push(0.0);
        for (ratio, knots) in ratios.iter().zip(self.knots.windows(2)) {
            moved.push(moved[moved.len() - 1] + ratio * (knots[1] - knots[0]));
        }
        for sample in &mut self.samples {
            while interval + 1 < ratios.len() && self.knots[interval + 1] <= sample.u {
                interval += 1;
            }
            sample.u = moved[interval] + ratios[interval] * (sample.u - self.knots[interval]);
        }
        self.knots = moved;
        basis::locals(&self.knots, &mut self.locals);
    }

    /// The curve for the weights, parameters and knots there are.
    fn solve(&mut self, stretch: &Stretch<'_>) -> Option<()> {
        let intervals = self.knots.len() - 1;
        self.banded.clear(intervals + 3);
        for j in 0..intervals {
            let width = self.knots[j + 1] - self.knots[j];
            let stiff = self.stiff[j];
            let cube = stiff * stiff * stiff;
            self.banded.add(j, &self.locals[j][3], cube * cube * width, self.bows[j]);
        }
        let mut interval = 0;
        for sample in &self.samples[1..] {
            while interval + 1 < intervals && self.knots[interval + 1] <= sample.u {
                interval += 1;
            }
            let values = basis::values(&self.locals[interval], sample.u - self.knots[interval]);
            self.banded.add(interval, &values, sample.weight, sample.point);
        }
        match &stretch.start {
            Start::Point(point) => self.banded.fix(0, *point),
            Start::Jet(jet) => {
                let leading = basis::leading(&self.knots, jet);
                (0..3).for_each(|i| self.banded.fix(i, leading[i]));
            }
        }
        if stretch.ends {
            self.banded.fix(intervals + 2, stretch.vertices[stretch.vertices.len() - 1]);
        }
        let coefficients = self.banded.solve()?;
        self.jets.clear();
        self.jets.extend(
            self.locals.iter().enumerate().map(|(j, local)| basis::jet(local, &coefficients[j..])),
        );
        for (j, jet) in self.jets.iter().enumerate() {
            let middle = basis::taylor(jet, (self.knots[j + 1] - self.knots[j]) / 2.0);
            self.bows[j] = -middle.first * middle.second.norm_squared();
        }
        let finite =
            |jet: &Jet| (jet.point + jet.first + jet.second + jet.third).norm().is_finite();
        self.jets.iter().all(finite).then_some(())
    }

    /// Sets how stiff the curve is, from the distances between the knots.
    fn stiffen(&mut self, stretch: &Stretch<'_>) {
        let tolerance = stretch.tolerance;
        self.stiff.clear();
        self.bows.clear();
        self.bows.resize(self.knots.len() - 1, Vector3::zeros());
        let radii = self.radii(stretch);
        let mut chord = 0;
        let last = self.knots.len() - 1;
        for j in 0..last {
            while chord + 1 < radii.len() && self.places[chord + 1] <= self.knots[j] {
                chord += 1;
            }
            // Noise may bring two bends close to each other: the mean of some widths counts.
            let (from, to) = (j.saturating_sub(SPAN), (j + SPAN + 1).min(last));
            let width = (self.knots[to] - self.knots[from]) / (to - from) as f64;
            self.stiff.push(stiff_length(width, radii[chord], tolerance));
        }
        self.taper();
        if let Start::Point(_) = stretch.start {
            self.stiff[0] *= END_STIFFNESS;
        }
        let last = self.stiff.len() - 1;
        self.stiff[last] *= END_STIFFNESS;
        self.taper();
        for _ in 0..SMOOTHINGS {
            let mut before = self.stiff[0];
            for j in 1..self.stiff.len() - 1 {
                let own = self.stiff[j];
                self.stiff[j] = (before + self.stiff[j + 1] + 2.0 * own) / 4.0;
                before = own;
            }
        }
    }

    /// The radius of the bow about each chord between bends [m], from the chords about it.
    fn radii(&self, stretch: &Stretch<'_>) -> Vec<f64> {
        let along: Vec<Vector3<f64>> = stretch
            .bends
            .windows(2)
            .map(|ends| stretch.vertices[ends[1]] - stretch.vertices[ends[0]])
            .map(|chord| chord / chord.norm().max(f64::MIN_POSITIVE))
            .collect();
        (0..along.len())
            .map(|k| {
                let (from, to) = (k.saturating_sub(SPAN), (k + SPAN).min(along.len() - 1));
                let middle = |k: usize| (self.places[k] + self.places[k + 1]) / 2.0;
                let turn = (along[to] - along[from]).norm();
                if turn > 0.0 { (middle(to) - middle(from)) / turn } else { f64::INFINITY }
            })
            .collect()
    }

    /// Lets the stiffness change slowly along the curve.
    fn taper(&mut self) {
        let way = |knots: &[f64], j: usize| TAPER * (knots[j + 1] - knots[j - 1]) / 2.0;
        for j in 1..self.stiff.len() {
            self.stiff[j] = self.stiff[j].min(self.stiff[j - 1] + way(&self.knots, j));
        }
        for j in (1..self.stiff.len()).rev() {
            self.stiff[j - 1] = self.stiff[j - 1].min(self.stiff[j] + way(&self.knots, j));
        }
    }

    /// Makes the curve less stiff where samples are farther from it than `limit` [m].
    fn soften(&mut self, limit: f64) {
        let (mut interval, mut any) = (0, false);
        let mut softened = usize::MAX;
        for sample in &self.samples {
            while interval + 1 < self.stiff.len() && self.knots[interval + 1] <= sample.u {
                interval += 1;
            }
            if sample.distance > limit && softened != interval {
                self.stiff[interval] *= SOFTER;
                (softened, any) = (interval, true);
            }
        }
        if any {
            self.taper();
        }
    }

    /// Moves the samples to their nearest places on the curve, in order, and measures their distances.
    fn project(&mut self, ends: bool, limit: f64) {
        let last = self.jets.len() - 1;
        let length = self.knots[last + 1];
        let count = self.samples.len();
        let (mut interval, mut reached) = (0, 0.0);
        for (i, sample) in self.samples.iter_mut().enumerate().skip(1) {
            while interval < last && self.knots[interval + 1] <= sample.u {
                interval += 1;
            }
            while interval > 0 && self.knots[interval] > sample.u {
                interval -= 1;
            }
            let jet = basis::taylor(&self.jets[interval], sample.u - self.knots[interval]);
            let away = sample.point - jet.point;
            let ahead = away.dot(&jet.first) / jet.first.norm_squared().max(0.01);
            let beside = (away - jet.first * ahead).norm();
            let wanted = if beside > FAR * limit { sample.u } else { sample.u + ahead };
            let u = if ends && i + 1 == count { length } else { wanted.clamp(reached, length) };
            let missed = (away - jet.first * (u - sample.u)).norm();
            sample.distance = if beside > FAR * limit { beside } else { missed };
            sample.u = u;
            reached = u;
        }
    }

    /// Whether the curve's speed by its parameter is near one everywhere.
    fn steady(&self) -> bool {
        let near = |jet: &Jet| (SLOWEST..1.0 / SLOWEST).contains(&jet.first.norm());
        self.jets.iter().zip(self.knots.windows(2)).all(|(jet, ends)| {
            let width = ends[1] - ends[0];
            [0.0, 0.25, 0.5, 0.75, 1.0].iter().all(|part| near(&basis::taylor(jet, part * width)))
        })
    }

    /// Gives samples too far from the curve more weight.
    fn weigh(&mut self, limit: f64) {
        for sample in &mut self.samples {
            let excess = sample.distance / limit;
            if excess > 1.0 && excess <= FAR {
                sample.weight =
                    (2.0 * excess * excess * sample.weight).min(HEAVIEST * sample.least);
            }
        }
    }

    /// Halves the intervals between knots that hold samples too far from the curve and are long against the
    /// stiffness.
    fn refine(&mut self, limit: f64, tolerance: f64) {
        let mut moved = Vec::with_capacity(2 * self.knots.len());
        let mut stiff = Vec::with_capacity(2 * self.stiff.len());
        let mut next = 0;
        for (j, ends) in self.knots.windows(2).enumerate() {
            let (mut bad, first) = (false, next);
            while next < self.samples.len() && self.samples[next].u <= ends[1] {
                bad |= self.samples[next].distance > limit;
                next += 1;
            }
            let width = ends[1] - ends[0];
            moved.push(ends[0]);
            stiff.push(self.stiff[j]);
            if bad && next > first + 1 && width > (tolerance / 2.0).max(self.stiff[j] / SLACK) {
                moved.push(ends[0] + width / 2.0);
                stiff.push(self.stiff[j]);
            }
        }
        moved.push(self.knots[self.knots.len() - 1]);
        if moved.len() > self.knots.len() {
            self.knots = moved;
            self.stiff = stiff;
            self.bows.clear();
            self.bows.resize(self.knots.len() - 1, Vector3::zeros());
            self.jets.clear();
            basis::locals(&self.knots, &mut self.locals);
        }
    }

    /// The number of the vertex farthest from the curve.
    fn worst(&self) -> usize {
        let (mut result, mut distance) = (0, 0.0);
        for (number, sample) in self.samples.iter().filter(|sample| sample.vertex).enumerate() {
            if sample.distance > distance {
                (result, distance) = (number, sample.distance);
            }
        }
        result
    }
}

/// The arc length of a piece that starts with `jet` and is `width` [m] long by its parameter, over that width.
fn stretch_of(jet: &Jet, width: f64) -> f64 {
    // Gauss's rule with three points.
    let speed = |part: f64| basis::taylor(jet, part * width).first.norm();
    let ends = speed(0.112_701_665_379_258_3) + speed(0.887_298_334_620_741_7);
    ((5.0 * ends + 8.0 * speed(0.5)) / 18.0).clamp(0.5, 2.0)
}

/// Over what length a curve is stiff [m] where it has a bow of `radius` [m] and knots `width` [m] apart.
fn stiff_length(width: f64, radius: f64, tolerance: f64) -> f64 {
    // Knots are at most 2·√(r·tolerance/2) apart on a bow of radius r, and stiffness over ℓ shrinks it by ℓ⁶/r⁵.
    let radius = radius.min(width * width / (2.0 * tolerance));
    let relative = AIM * SHARE * tolerance / radius;
    let sixth = messages::math::cbrt(relative.sqrt());
    (radius * sixth).min(STIFFEST * width)
}
