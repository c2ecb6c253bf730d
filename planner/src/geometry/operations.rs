//! Operations made of a drawing's steps as they come, for every mechanism.

mod dark_ends;
mod flown_rows;
mod rasters;

use std::collections::VecDeque;
use std::sync::Arc;

use machine::surface::Surface;
use machine::{CornerMode, LaserSource, PathLimits};
use messages::time::Period;
use nalgebra::Vector3;

use dark_ends::without_dark_ends;
use flown_rows::flown_rows;
use rasters::{Extent, RowStep};

use super::operation::{Dot, OffSurface, Operation, OperationKind};
use crate::drawing::{Action, Corners, Curve, Note, Power, Step};
use crate::geometry::bezier;
use crate::geometry::contour::{Contour, Demand, GAP, Joining, Joint};
use crate::geometry::polyline::{Chord, Polyline, goes_straight};
use crate::geometry::posed_path::PosedPath;
use crate::geometry::projected;
use crate::geometry::track::Track;
use crate::job::{Marking, MarkingSpeed};
use crate::light::Policy;
use crate::light::exposure::change_speeds;

/// Shorter moves are not made [m].
const NOTHING: f64 = 1e-12;

/// Operations that are kept back, since what comes next may change them.
const KEPT: usize = 8;

/// How far the path may be from a drawn Bézier curve, where no smaller tolerance is asked for [m].
const TRACE_TOLERANCE: f64 = 5e-7;

/// The share of that by which the chords that a curve is fitted to may be off.
const CHORD_ERROR: f64 = 0.1;

/// Chords of a curve on a surface are no longer [m]: on a radius of 10 mm they are off by 0.03 µm.
const SURFACE_CHORD: f64 = 5e-5;

/// A path that weighs more is handed on in parts, which are gone without a stop between them.
const LONG_PATH: usize = 1 << 15;

/// Of so many corners it is kept what they allow.
const MOST_SHARP: usize = 10_000;

/// Makes operations of steps.
#[derive(Debug)]
pub(crate) struct Operations<'a> {
    limits: PathLimits,
    surface: Option<&'a Surface>,
    /// How corners are passed where the job says nothing.
    machine: CornerMode,
    source: LaserSource,
    /// The period of the control cycle.
    period: Period,
    marking: Marking,
    /// How far the path may be from the drawn line [m]; 0 where corners are exact.
    tolerance: f64,
    place: Vector3<f64>,
    polyline: Polyline,
    contour: Option<Contour>,
    done: VecDeque<Operation>,
    /// The last two paths, as they were drawn.
    before: [Option<Extent>; 2],
    /// The last lit step that may have led from one row of a raster to the next.
    row_step: Option<RowStep>,
    /// Whether the last operation only goes to the dark end of the path before it.
    leaves_dark_end: bool,
    is_finished: bool,
    /// Whether some power was raised to the least that the source gives.
    is_raised: bool,
    /// The speed that a corner must allow to be passed by lines whose speed is open [m/s].
    corners_at: f64,
    /// The speeds at which corners of open lines could be passed that are not: what they allow [m/s].
    pub(crate) sharp: Vec<f64>,
    /// What a person should know.
    pub(crate) notes: Vec<Note>,
}

impl<'a> Operations<'a> {
    /// Begins where the tool is before the first step; on a `surface` everything comes to lie on it.
    pub(crate) fn new(
        start: Vector3<f64>,
        limits: &PathLimits,
        machine: CornerMode,
        surface: Option<&'a Surface>,
    ) -> Self {
        Self {
            limits: *limits,
            surface,
            machine,
            source: LaserSource::IDEAL,
            period: Period::OF_SETPOINTS,
            marking: Marking::default(),
            tolerance: Corners::AsMachine.tolerance(machine, limits.tolerance),
            place: start,
            polyline: Polyline::default(),
            contour: None,
            done: VecDeque::new(),
            before: [None; 2],
            row_step: None,
            leaves_dark_end: false,
            is_finished: false,
            is_raised: false,
            corners_at: limits.speed,
            sharp: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// Lit by `source` in control cycles of `period`, as `marking` has it.
    pub(crate) fn lit_by(self, source: LaserSource, period: Period, marking: Marking) -> Self {
        Self { source, period, marking, ..self }
    }

    /// With corners that lines whose speed is open pass where they allow `speed` [m/s].
    pub(crate) fn corners_at(self, speed: f64) -> Self {
        Self { corners_at: speed, ..self }
    }

    /// The next operation that nothing to come changes; after [`Self::finish`] whatever is left.
    pub(crate) fn next(&mut self) -> Option<Operation> {
        let kept = if self.is_finished { 0 } else { KEPT };
        if self.done.len() > kept { self.done.pop_front() } else { None }
    }

    /// Takes the next step.
    ///
    /// # Errors
    /// The line of what goes beyond an edge of the surface, and by how much.
    pub(crate) fn push(&mut self, step: &Step) -> Result<(), OffSurface> {
        let line = step.line;
        match &step.action {
            Action::Mark { curve, speed, power } => {
                let policy = self.marking.policy(power);
                let power = self.steady(power.level, line);
                let demand = Demand { from: 0.0, power, speed: *speed, line };
                self.curve(curve, demand, Some(policy))
            }
            Action::Feed { curve, speed } => {
                let demand = Demand { from: 0.0, power: 0.0, speed: Some(*speed), line };
                self.curve(curve, demand, None)
            }
            Action::Trace { points, speed, power } => {
                let policy = self.marking.policy(power);
                let power = self.steady(power.level, line);
                let demand = Demand { from: 0.0, power, speed: *speed, line };
                self.trace(points, demand, policy)
            }
            Action::Follow { path, power } => self.follow(path, power),
            Action::Rapid { to } => self.rapid(*to, line),
            Action::Corners(corners) => {
                self.flush_polyline()?;
                self.tolerance = corners.tolerance(self.machine, self.limits.tolerance);
                Ok(())
            }
            Action::Dwell { time, lit: Some(power) } if *time > 0.0 && *power > 0.0 => {
                self.flush()?;
                let power = self.steady(*power, line);
                self.dot((*time, power), line)
            }
            Action::Dwell { time, .. } => {
                self.flush()?;
                self.done.push_back(Operation { kind: OperationKind::Rest(*time), line });
                Ok(())
            }
            Action::Output { bit, on } => {
                self.flush()?;
                let kind = OperationKind::Output { bit: *bit, on: *on };
                self.done.push_back(Operation { kind, line });
                Ok(())
            }
            Action::Frequency { value } => {
                self.flush()?;
                let kind = OperationKind::Frequency(*value);
                self.done.push_back(Operation { kind, line });
                Ok(())
            }
            Action::Pause => {
                self.flush()?;
                self.done.push_back(Operation { kind: OperationKind::Pause, line });
                Ok(())
            }
        }
    }

    /// Ends the drawing.
    ///
    /// # Errors
    /// As of [`Self::push`].
    pub(crate) fn finish(&mut self) -> Result<(), OffSurface> {
        self.is_finished = true;
        self.flush()
    }

    fn placed(&self, point: &Vector3<f64>, line: u64) -> Result<Vector3<f64>, OffSurface> {
        match self.surface {
            None => Ok(*point),
            Some(surface) => projected::place(point, surface).map_err(|cause| (line, cause)),
        }
    }

    /// Goes along a curve.
    fn curve(
        &mut self,
        curve: &Curve,
        demand: Demand,
        policy: Option<Policy>,
    ) -> Result<(), OffSurface> {
        let from = curve.from();
        let straight = matches!(curve, Curve::Line { .. }) && self.surface.is_none();
        if straight && (curve.to() - from).norm() <= NOTHING {
            return Ok(());
        }
        if (from - self.place).norm() > GAP {
            self.flush()?;
        }
        let ahead = match curve {
            Curve::Line { to, .. } => to - from,
            Curve::Arc { .. } => Track::new(curve).at(0.0).first,
        };
        self.let_free_move_go(&(from + ahead))?;
        if straight {
            let is_other = policy.is_some()
                && self.polyline.policy().is_some_and(|other| Some(other) != policy);
            if is_other || self.polyline.is_trace() {
                self.flush_polyline()?;
            }
            self.place = curve.to();
            self.polyline.push(from, Chord { to: curve.to(), demand, policy, is_free: false });
            self.hand_on_what_is_certain();
            return Ok(());
        }
        self.flush_polyline()?;
        self.place = curve.to();
        let track = Track::on(curve, self.surface).map_err(|cause| (demand.line, cause))?;
        if track.length() > NOTHING {
            self.add(&track, &[demand], policy);
        }
        Ok(())
    }

    /// Goes along a Bézier curve, by chords so near to it that the curve fitted to them is nearer than
    /// any other tolerance. What several in a row draw is fitted as one: it goes on smoothly where they
    /// do, however they are parametrised.
    fn trace(
        &mut self,
        points: &bezier::Points,
        demand: Demand,
        policy: Policy,
    ) -> Result<(), OffSurface> {
        let heading = bezier::heading(points);
        if heading == Vector3::zeros() {
            return Ok(());
        }
        if (points[0] - self.place).norm() > GAP {
            self.flush()?;
        }
        self.let_free_move_go(&(points[0] + heading))?;
        let is_other = self.polyline.policy().is_some_and(|other| other != policy);
        if is_other || self.polyline.is_of_chords() {
            self.flush_polyline()?;
        }
        self.place = points[3];
        let mut from = self.placed(&points[0], demand.line)?;
        let count = bezier::chords(points, TRACE_TOLERANCE * CHORD_ERROR);
        let count = match self.surface {
            None => count,
            // A surface bends chords that a flat drawing does not.
            Some(_) => count.max((bezier::length(points) / SURFACE_CHORD).ceil() as usize),
        };
        for point in bezier::samples(points, count) {
            let to = self.placed(&point, demand.line)?;
            self.polyline
                .push_trace(from, Chord { to, demand, policy: Some(policy), is_free: false });
            from = to;
        }
        self.hand_on_what_is_certain();
        Ok(())
    }

    /// Goes along a path through poses.
    fn follow(&mut self, path: &PosedPath, power: &Power) -> Result<(), OffSurface> {
        self.flush()?;
        let policy = Some(self.marking.policy(power));
        let mut from = 0.0;
        for (track, line) in &path.tracks {
            let power = self.steady(power.level, *line);
            let demand = Demand { from: 0.0, power, speed: None, line: *line };
            self.add(track, &[demand], policy);
            // Another contour begins at a corner that is not passed on the way.
            if let Some(contour) =
                self.contour.take_if(|contour| contour.length() <= track.length())
            {
                self.contour = Some(contour.turned(path.turning.clone(), from));
            }
            from += track.length();
        }
        self.place = path.end().unwrap_or(self.place);
        self.flush()
    }

    /// A free move: part of the path where it goes straight on, else a move of its own.
    fn rapid(&mut self, to: Vector3<f64>, line: u64) -> Result<(), OffSurface> {
        self.let_free_move_go(&to)?;
        let goes_on = if self.polyline.is_empty() {
            self.contour.as_ref().is_some_and(|contour| {
                (contour.end().point - self.place).norm() <= GAP
                    && goes_straight(&contour.heading(), &(to - self.place))
            })
        } else {
            self.polyline.goes_straight_to(&to)
        };
        let from = core::mem::replace(&mut self.place, to);
        if goes_on && self.surface.is_none() && (to - from).norm() > NOTHING {
            let demand = Demand { from: 0.0, power: 0.0, speed: None, line };
            self.polyline.push(from, Chord { to, demand, policy: None, is_free: true });
            self.hand_on_what_is_certain();
            return Ok(());
        }
        self.flush()?;
        let to = self.placed(&to, line)?;
        self.leave_dark_end(&to);
        self.done.push_back(Operation { kind: OperationKind::Rapid(to), line });
        Ok(())
    }

    /// Makes a free move at the end of the polyline a move of its own, unless the path goes straight
    /// on to `to`.
    fn let_free_move_go(&mut self, to: &Vector3<f64>) -> Result<(), OffSurface> {
        let is_free = self.polyline.last().is_some_and(|chord| chord.is_free);
        if is_free && !self.polyline.goes_straight_to(to) { self.flush() } else { Ok(()) }
    }

    fn dot(&mut self, exposure: (f64, f64), line: u64) -> Result<(), OffSurface> {
        let place = self.placed(&self.place.clone(), line)?;
        if let Some(Operation { kind: OperationKind::Dot(dot), .. }) = self.done.back_mut()
            && dot.at == place
        {
            dot.exposures.push(exposure);
            return Ok(());
        }
        let kind = OperationKind::Dot(Dot { at: place, exposures: vec![exposure] });
        self.done.push_back(Operation { kind, line });
        Ok(())
    }

    /// Ends the path that is open.
    fn flush(&mut self) -> Result<(), OffSurface> {
        // A free move at the end leads nowhere on the path.
        let free = self.polyline.last().is_some_and(|chord| chord.is_free);
        let free = if free { self.polyline.pop() } else { None };
        self.flush_polyline()?;
        if let Some(contour) = self.contour.take() {
            self.end(contour, false);
        }
        if let Some(Chord { to, demand, .. }) = free {
            self.leave_dark_end(&to);
            self.done.push_back(Operation { kind: OperationKind::Rapid(to), line: demand.line });
        }
        Ok(())
    }

    /// Adds to the path what of a long polyline is certain.
    fn hand_on_what_is_certain(&mut self) {
        let policy = self.polyline.policy();
        let tolerance = self.fit_tolerance();
        for (track, demands) in self.polyline.take_certain(tolerance) {
            if track.length() > NOTHING {
                self.add(&track, &demands, policy);
            }
        }
    }

    /// How far a fitted curve may be from the polyline [m]; `None` where nothing is fitted.
    fn fit_tolerance(&self) -> Option<f64> {
        match (self.tolerance > 0.0, self.polyline.is_trace()) {
            (true, true) => Some(self.tolerance.min(TRACE_TOLERANCE)),
            (false, true) => Some(TRACE_TOLERANCE),
            (true, false) => Some(self.tolerance),
            (false, false) => None,
        }
    }

    fn flush_polyline(&mut self) -> Result<(), OffSurface> {
        if self.polyline.is_empty() {
            return Ok(());
        }
        let policy = self.polyline.policy();
        let tolerance = self.fit_tolerance();
        for (track, demands) in self.polyline.take(tolerance) {
            if track.length() > NOTHING {
                self.add(&track, &demands, policy);
            }
        }
        Ok(())
    }

    /// Adds a curve to the path, or begins another path with it.
    fn add(&mut self, track: &Track, demands: &[Demand], policy: Option<Policy>) {
        let joining = self.joining(demands);
        if let Some(contour) = &mut self.contour {
            let fits = policy.is_none_or(|policy| policy == contour.policy);
            match if fits { contour.extend(track, demands, &joining) } else { Joint::Ends } {
                Joint::Passed => {
                    if contour.weight() > LONG_PATH {
                        let next = contour.split_last();
                        if let Some(part) = core::mem::replace(&mut self.contour, next) {
                            self.end(part, true);
                        }
                    }
                    return;
                }
                Joint::Slower(speed) if self.sharp.len() < MOST_SHARP => self.sharp.push(speed),
                Joint::Slower(_) | Joint::Ends => {}
            }
        }
        if let Some(contour) = self.contour.take() {
            self.end(contour, false);
        }
        let policy = policy.unwrap_or(Policy::Proportional);
        self.contour = Some(Contour::new(track.clone(), demands, policy));
    }

    /// How a curve with these demands may be joined to the contour that is open.
    fn joining(&self, demands: &[Demand]) -> Joining {
        let before = self.contour.as_ref().and_then(|contour| contour.demands().last());
        let asked = before.into_iter().chain(demands.first());
        let asked = asked.filter_map(|demand| self.asked_of(demand)).reduce(f64::max);
        Joining {
            rounds: self.tolerance > 0.0,
            tolerance: if self.tolerance > 0.0 { self.tolerance } else { self.limits.tolerance },
            limits: self.limits,
            asked: asked.filter(|asked| *asked > 0.0),
            open: self.corners_at,
        }
    }

    /// Hands on a path, or a part of one that `goes_on`.
    fn end(&mut self, contour: Contour, goes_on: bool) {
        let line = contour.line;
        let is_first = !contour.goes_on_from_before();
        if is_first && !goes_on && self.fly_rows(&contour) {
            return;
        }
        let extent = Extent::of(&contour);
        let (contour, left) = without_dark_ends(contour, goes_on, &self.limits);
        self.note_changes(&contour);
        if is_first {
            self.leave_approach();
            self.leave_row_step(&extent);
        }
        self.leaves_dark_end = left.is_some();
        self.before = if is_first && !goes_on { [self.before[1], Some(extent)] } else { [None; 2] };
        self.done.push_back(Operation { kind: OperationKind::Path(Arc::new(contour)), line });
        if let Some(to) = left {
            self.done.push_back(Operation { kind: OperationKind::Rapid(to), line });
        }
    }

    /// Hands on the rows of a path that they may be marked at speed in, each by itself; says whether it is one.
    fn fly_rows(&mut self, contour: &Contour) -> bool {
        let asked = |demand: &Demand| self.speed_of(demand);
        let rows =
            if self.surface.is_none() { flown_rows(contour, asked, &self.limits) } else { None };
        let Some((rows, end)) = rows else { return false };
        self.note_changes(contour);
        self.leave_approach();
        (self.before, self.leaves_dark_end) = ([None; 2], true);
        for row in rows {
            let line = row.demands().first().map_or(contour.line, |demand| demand.line);
            let kind = OperationKind::Path(Arc::new(row));
            self.done.push_back(Operation { kind, line });
        }
        self.done.push_back(Operation { kind: OperationKind::Rapid(end), line: contour.line });
        true
    }

    /// The speed that a demand asks for, as far as the machine has it [m/s]; `None` where it is left open.
    fn speed_of(&self, demand: &Demand) -> Option<f64> {
        self.asked_of(demand).map(|speed| speed.min(self.limits.speed))
    }

    /// The speed that a demand asks for [m/s]; `None` where it is left open.
    fn asked_of(&self, demand: &Demand) -> Option<f64> {
        match self.marking.speed {
            Some(MarkingSpeed::Constant(speed)) => Some(speed),
            Some(MarkingSpeed::Optimum) => None,
            None => demand.speed,
        }
    }

    /// The power asked for, or the least that the source gives.
    fn steady(&mut self, power: f64, line: u64) -> f64 {
        let least = self.source.min_power;
        if power <= 0.0 || power >= least {
            return power;
        }
        if !core::mem::replace(&mut self.is_raised, true) {
            let text = format!(
                "power of {:.3} is marked at {:.3} of full scale, the least that the laser gives \
                 (min_power)",
                power, least
            );
            self.notes.push(Note { line, text });
        }
        least
    }

    /// Tells of a path that is slowed since its light would change more often than a cycle can say.
    fn note_changes(&mut self, contour: &Contour) {
        let asked = |demand: &Demand| self.speed_of(demand).unwrap_or(self.limits.speed);
        let mut slowed = contour.demands().iter().zip(change_speeds(contour, self.period));
        if let Some((Demand { line, .. }, _)) = slowed.find(|(demand, most)| *most < asked(demand))
        {
            let cycle = self.period.max(Period::OF_SETPOINTS).seconds() * 1e3;
            let text = format!(
                "slowed here: the power changes more often than a {cycle} ms cycle can carry"
            );
            if !self.notes.iter().any(|note| note.text == text) {
                self.notes.push(Note { line: *line, text });
            }
        }
    }
}
