//! A line that is marked at one speed, as far as the time of a drawing depends on that speed.

use machine::PathLimits;
use messages::math;

use super::{Near, Speeds};
use crate::geometry::contour::Contour;
use crate::geometry::jet::Jet;
use crate::law::flight::{DirectionLimit, FlightLimits, State};

/// A line that is entered and left at the speed that it is marked at.
pub(super) struct Line {
    /// What is marked at the open speed [m].
    open: f64,
    /// Speeds [m/s] and lengths [m] of all else.
    others: Vec<[f64; 2]>,
    /// The largest speed at its bends, and that the joints allow [m/s].
    top: f64,
    /// Its start, and its end backwards: where a run-in begins, and a run-out backwards in time.
    pub(super) ends: [LineEnd; 2],
}

/// An end of a line, seen into the line.
pub(super) struct LineEnd {
    pub(super) jet: Jet,
    /// What is asked for there [m/s]; `None` for the open speed.
    pub(super) asked: Option<f64>,
    /// The largest speed of the line [m/s].
    pub(super) top: f64,
    /// What is left of the tool's limits along it.
    pub(super) limits: FlightLimits,
    /// What the joints leave there, as far as it is less than the tool's limits.
    pub(super) directions: Vec<DirectionLimit>,
}

/// What the tool may do in the dark.
pub(super) fn in_the_dark(limits: &PathLimits) -> FlightLimits {
    let PathLimits { speed, rapid, acceleration, jerk, .. } = *limits;
    FlightLimits { speed: rapid.max(speed), acceleration, jerk }
}

impl Line {
    pub(super) fn new(
        contour: &Contour,
        limits: &PathLimits,
        near: &Near<'_>,
        speeds: &Speeds,
    ) -> Self {
        let all = in_the_dark(limits);
        let end = contour.end();
        let top = contour.top_speed(limits).min(top_of_joints(contour, &all, near));
        let lit = || contour.demands().iter().filter(|demand| demand.power > 0.0);
        let asked = [lit().next(), lit().next_back()]
            .map(|demand| demand.and_then(|demand| speeds.named(demand.speed)));
        let jets = [contour.start(), Jet { first: -end.first, ..end }];
        let ends = [0, 1].map(|end| LineEnd::new(jets[end], asked[end], top, &all, near));
        let (mut open, mut others) = (0.0, Vec::new());
        for (demand, to) in contour.stretches() {
            let length = to - demand.from;
            match (demand.power > 0.0, speeds.named(demand.speed)) {
                (true, None) => open += length,
                (true, Some(asked)) => others.push([asked.min(speeds.most), length]),
                (false, _) => {
                    others.push([demand.speed.unwrap_or(limits.rapid).min(limits.rapid), length]);
                }
            }
        }
        Self { open, others, top, ends }
    }

    /// The time along it, `open` being the open speed [m/s], [s].
    pub(super) fn time(&self, open: f64) -> f64 {
        let others = self.others.iter().map(|[speed, length]| length / speed.min(self.top));
        self.open / open.min(self.top) + others.sum::<f64>()
    }

    /// The largest speed at which what is open of it can be marked [m/s]; 0 where nothing is open.
    pub(super) fn open_top(&self) -> f64 {
        if self.open > 0.0 { self.top } else { 0.0 }
    }
}

impl LineEnd {
    fn new(jet: Jet, asked: Option<f64>, top: f64, all: &FlightLimits, near: &Near<'_>) -> Self {
        let directions = near(&jet.point);
        let limits = all.along(&jet.first, &directions);
        let binds = |side: &DirectionLimit| {
            side.speed < all.speed || side.acceleration < all.acceleration || side.jerk < all.jerk
        };
        let directions = directions.into_iter().filter(binds).collect();
        Self { jet, asked, top, limits, directions }
    }

    /// The speed of its line there [m/s].
    pub(super) fn speed(&self, open: f64, most: f64) -> f64 {
        self.asked.unwrap_or(open).min(most).min(self.top)
    }

    /// The tool's state there at `speed` [m/s], into the line.
    pub(super) fn state(&self, speed: f64) -> State {
        State {
            velocity: self.jet.first * speed,
            acceleration: self.jet.second * (speed * speed),
            ..State::rest(self.jet.point)
        }
    }
}

/// The largest constant speed along `contour` that the joints allow [m/s], looked at here and there.
fn top_of_joints(contour: &Contour, all: &FlightLimits, near: &Near<'_>) -> f64 {
    /// Places between the ends.
    const LOOKS: u32 = 8;
    (0..=LOOKS)
        .map(|look| {
            let jet = contour.at(contour.length() * f64::from(look) / f64::from(LOOKS));
            let directions = near(&jet.point);
            let infinite = FlightLimits { speed: f64::INFINITY, ..*all };
            let along = infinite.along(&jet.first, &directions).speed / jet.first.norm();
            // V²·p″ and V³·p‴, of which nothing is infinite.
            let across = all.along(&jet.second, &directions).acceleration / jet.second.norm();
            let wound = all.along(&jet.third, &directions).jerk / jet.third.norm();
            along.min(across.sqrt()).min(math::cbrt(wound))
        })
        .fold(f64::INFINITY, f64::min)
}
