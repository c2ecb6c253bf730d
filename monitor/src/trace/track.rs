//! The way of the tool in space and time, thinned to a bounded number of points.

/// Where the tool was at a time, and what it did from there on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackPoint {
    /// Time since the first record [s].
    pub time: f64,
    /// Where the tool was [m].
    pub tool: [f64; 3],
    /// Tool minus plan [m]; zeros where the plan is not known.
    pub deviation: [f32; 3],
    /// What goes on from here to the next point.
    pub light: Light,
}

/// What the laser does between two points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Light {
    /// The tool moves in the dark.
    Dark,
    /// The laser marks a stroke, from 1, with this power, as a fraction of full scale.
    Lit {
        /// The stroke.
        stroke: u32,
        /// The power.
        power: f32,
    },
    /// Nobody knows: the points are not joined.
    Unknown,
}

impl Light {
    /// Whether it is the same run of light, or of dark.
    fn goes_on(self, other: Self) -> bool {
        match (self, other) {
            (Self::Dark, Self::Dark) => true,
            (Self::Lit { stroke, .. }, Self::Lit { stroke: next, .. }) => stroke == next,
            _ => false,
        }
    }

    /// Whether the laser marks.
    pub fn is_lit(self) -> bool {
        matches!(self, Self::Lit { .. })
    }
}

/// The way of the tool. At first every point is kept; when there are too many, those go that lie where the
/// points beside them have the tool at that time, within a tolerance that grows.
#[derive(Debug, Clone, Default)]
pub struct Track {
    points: Vec<TrackPoint>,
    thinning: Thinning,
}

/// The tolerance that is tried first [m].
const FIRST_TOLERANCE: f64 = 1e-7;

/// Beyond this tolerance every second point goes, wherever it lies [m].
const LAST_TOLERANCE: f64 = 1e-3;

impl Track {
    /// The most points kept.
    pub const CAPACITY: usize = 1 << 19;

    /// Appends a point, not earlier than the one before.
    pub fn add(&mut self, point: TrackPoint) {
        self.thinning.add(point, &mut self.points);
        if self.points.len() >= Self::CAPACITY {
            self.thin(Self::CAPACITY / 4 * 3);
        }
    }

    /// The points.
    pub fn points(&self) -> &[TrackPoint] {
        &self.points
    }

    /// How far the tool can have been from the straight line between two points, at any time between [m].
    pub fn tolerance(&self) -> f64 {
        self.thinning.tolerance
    }

    /// The same in at most `most` points.
    #[must_use]
    pub fn thinned(&self, most: usize) -> Self {
        let mut thinned = self.clone();
        thinned.thinning.flush(&mut thinned.points);
        if thinned.points.len() > most {
            thinned.thin(most);
        }
        thinned
    }

    /// The same without the points that are within `tolerance` [m] of the way between others, in at most
    /// `most` points.
    #[must_use]
    pub fn thinned_within(mut self, tolerance: f64, most: usize) -> Self {
        self.thinning.flush(&mut self.points);
        let tolerance = tolerance.max(self.thinning.tolerance);
        self.thin_once(tolerance);
        self.thinned(most)
    }

    fn thin(&mut self, most: usize) {
        self.thinning.flush(&mut self.points);
        let mut tolerance = self.thinning.tolerance.max(0.5 * FIRST_TOLERANCE);
        while self.points.len() > most {
            tolerance *= 2.0;
            if tolerance > LAST_TOLERANCE {
                tolerance = LAST_TOLERANCE;
                self.points = std::mem::take(&mut self.points).into_iter().step_by(2).collect();
            } else {
                self.thin_once(tolerance);
            }
        }
        // The last point may be joined to the next one as it was.
        let anchor = self.points.last().copied();
        self.thinning = Thinning { tolerance, anchor, ..Thinning::default() };
    }

    fn thin_once(&mut self, tolerance: f64) {
        let mut thinning = Thinning { tolerance, ..Thinning::default() };
        for point in std::mem::take(&mut self.points) {
            thinning.add(point, &mut self.points);
        }
        thinning.flush(&mut self.points);
        self.thinning = thinning;
    }
}

/// Leaves out points that lie on the straight way, in space and time, between those kept: all slopes from the
/// point kept last that meet what was left out since form a cone, and the next point must lie in it.
#[derive(Debug, Clone)]
struct Thinning {
    /// [m]; 0 keeps all.
    tolerance: f64,
    /// The point kept last.
    anchor: Option<TrackPoint>,
    /// The newest point, not kept yet.
    held: Option<TrackPoint>,
    low: [f64; 3],
    high: [f64; 3],
}

impl Default for Thinning {
    fn default() -> Self {
        Self {
            tolerance: 0.0,
            anchor: None,
            held: None,
            low: [f64::NEG_INFINITY; 3],
            high: [f64::INFINITY; 3],
        }
    }
}

impl Thinning {
    fn add(&mut self, point: TrackPoint, kept: &mut Vec<TrackPoint>) {
        if let Some(held) = self.held
            && !self.meets(&point)
        {
            self.keep(held, kept);
        }
        match self.anchor {
            Some(anchor) if self.tolerance > 0.0 && anchor.light.goes_on(point.light) => {
                self.narrow(&anchor, &point);
                self.held = Some(point);
            }
            _ => {
                self.flush(kept);
                self.keep(point, kept);
            }
        }
    }

    fn flush(&mut self, kept: &mut Vec<TrackPoint>) {
        if let Some(held) = self.held {
            self.keep(held, kept);
        }
    }

    fn keep(&mut self, point: TrackPoint, kept: &mut Vec<TrackPoint>) {
        kept.push(point);
        let tolerance = self.tolerance;
        *self = Self { tolerance, anchor: Some(point), ..Self::default() };
    }

    /// The slopes from `anchor` to `point`, `off` beside it.
    fn slopes(anchor: &TrackPoint, point: &TrackPoint, off: f64) -> [f64; 3] {
        let time = (point.time - anchor.time).max(1e-9);
        std::array::from_fn(|axis| (point.tool[axis] + off - anchor.tool[axis]) / time)
    }

    /// Whether the straight way from the anchor to `point` passes what was left out.
    fn meets(&self, point: &TrackPoint) -> bool {
        let Some(anchor) = &self.anchor else { return false };
        let bounds = self.low.iter().zip(&self.high);
        let slopes = Self::slopes(anchor, point, 0.0);
        slopes.iter().zip(bounds).all(|(slope, (low, high))| (low..=high).contains(&slope))
    }

    fn narrow(&mut self, anchor: &TrackPoint, point: &TrackPoint) {
        let low = Self::slopes(anchor, point, -self.tolerance);
        let high = Self::slopes(anchor, point, self.tolerance);
        for axis in 0..3 {
            self.low[axis] = self.low[axis].max(low[axis]);
            self.high[axis] = self.high[axis].min(high[axis]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use messages::math;

    fn point(time: f64, tool: [f64; 3], stroke: u32) -> TrackPoint {
        let light = if stroke > 0 { Light::Lit { stroke, power: 0.5 } } else { Light::Dark };
        TrackPoint { time, tool, deviation: [0.0; 3], light }
    }

    /// Where the straight ways between the points have the tool at `time`.
    fn at(points: &[TrackPoint], time: f64) -> [f64; 3] {
        let next = points.partition_point(|point| point.time <= time).clamp(1, points.len() - 1);
        let (from, to) = (&points[next - 1], &points[next]);
        let part = (time - from.time) / (to.time - from.time);
        std::array::from_fn(|axis| from.tool[axis] + part * (to.tool[axis] - from.tool[axis]))
    }

    #[test]
    fn a_short_run_keeps_every_point() {
        let mut track = Track::default();
        let points: Vec<_> =
            (0..5000).map(|step| point(f64::from(step) * 1e-3, [0.0; 3], 1)).collect();
        points.iter().for_each(|point| track.add(*point));
        assert_eq!((track.points(), track.tolerance()), (points.as_slice(), 0.0));
    }

    #[test]
    fn what_is_left_out_lies_on_the_way_between_what_is_kept() {
        let mut track = Track::default();
        let place = |step: u32| {
            let (sine, cosine) = math::sin_cos(f64::from(step) * 1e-2);
            [0.01 * cosine, 0.01 * sine, 1e-8 * f64::from(step)]
        };
        let steps = Track::CAPACITY as u32 * 2;
        for step in 0..steps {
            track.add(point(f64::from(step) * 1e-3, place(step), 1 + step / 100_000));
        }
        let end = f64::from(steps) * 1e-3;
        track.add(TrackPoint { light: Light::Unknown, ..point(end, place(steps), 0) });
        let points = track.points();
        assert!(points.len() < Track::CAPACITY, "{}", points.len());
        let tolerance = track.tolerance();
        assert!(tolerance > 0.0 && tolerance < 1e-5, "{tolerance}");
        // What was thinned with smaller tolerances before adds to the last one.
        for step in (0..steps).step_by(777) {
            let found = at(points, f64::from(step) * 1e-3);
            for (found, expect) in found.iter().zip(place(step)) {
                assert!((found - expect).abs() <= 2.0 * tolerance, "{step} {found} {expect}");
            }
        }
        // The start of every stroke is kept.
        let strokes = points.windows(2).filter(|pair| !pair[0].light.goes_on(pair[1].light));
        assert_eq!(strokes.count(), (steps as usize - 1) / 100_000 + 1);
        assert_eq!(points.last().map(|last| last.light), Some(Light::Unknown));
    }

    #[test]
    fn memory_is_bounded_however_often_the_light_changes() {
        let mut track = Track::default();
        for step in 0..3 * Track::CAPACITY as u32 {
            track.add(point(f64::from(step), [0.0; 3], step % 2));
        }
        assert!(track.points().len() <= Track::CAPACITY);
        let thinned = track.thinned(1000);
        assert!(thinned.points().len() <= 1000, "{}", thinned.points().len());
    }
}
