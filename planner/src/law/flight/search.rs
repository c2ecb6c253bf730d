//! The shortest duration of a flight.
//!
//! [`programme`](super::programme) says whether a duration is feasible. Feasibility is not monotonic: a tool
//! that must keep its speed cannot use more time. So the search steps up from a lower bound, by how far the
//! limits are exceeded, and then interpolates between the last infeasible duration and the first feasible one.

use messages::math;

use super::cone::Task;
use super::frame::Frame;
use super::grid::{Grid, INTERVALS, Spacing};
use super::programme::{Answer, solve};
use super::{DirectionLimit, Flight, FlightLimits, LONGEST, ROUNDING, State};
use crate::law::profile::Ramp;

/// The search ends when the best duration is within this factor of one that is too short.
const NEAR: f64 = 1.005;

/// The first duration tried, as a multiple of the lower bound, at which the limits leave no room.
const BEGIN: f64 = 1.003;

/// Relative precision of the use of the limits while the duration is far from the answer.
const ROUGH: f64 = 0.1;

/// The same near the answer.
const FINE: f64 = 0.008;

/// The search gives up after [`STALLS`] steps in which the duration grew by more than the first factor, and the
/// use of the limits was still more than the second times that of the step before: an end itself is beyond a
/// limit.
const STALLED: [f64; 2] = [1.2, 0.99];
const STALLS: usize = 3;

/// How often the limits are reduced by a quarter, and bisections after the first trial that fits.
const LOWERINGS: usize = 30;
const BISECTIONS: usize = 5;

/// Trials for ends that are curved and at the largest speed.
const RETRIES: usize = 12;

/// A flight in the coordinates of its frame.
struct Found<const D: usize> {
    duration: f64,
    grid: Grid,
    answer: Answer<D>,
}

/// The ways to lower the limits: of the acceleration, and whether of speed and jerk too.
const WAYS: [[bool; 2]; 3] = [[false, false], [true, false], [true, true]];

/// The shortest flight within `limits`, or lower ones, that `fits`.
pub(super) fn fitting(
    from: &State,
    to: &State,
    limits: &FlightLimits,
    fits: &mut dyn FnMut(&Flight) -> bool,
) -> Option<Flight> {
    let full = shortest(from, to, limits, &[])?;
    if fits(&full) {
        return Some(full);
    }
    WAYS.into_iter().fold(None, |best, way| {
        let mut attempt = |part: f64| {
            let lower = lower(from, to, limits, part, way)?;
            let flight = shortest(from, to, &lower, &[])?;
            let good = fits(&flight);
            Some((flight, good))
        };
        shorter(best, lowered(&mut attempt))
    })
}

/// The flight of the largest part of the limits whose `attempt` is good, which it says with it.
fn lowered(attempt: &mut dyn FnMut(f64) -> Option<(Flight, bool)>) -> Option<Flight> {
    let mut high = 1.0;
    for _ in 0..LOWERINGS {
        let part = high * 0.75;
        let (flight, good) = attempt(part)?;
        if good {
            return Some(closer(attempt, flight, part, high));
        }
        high = part;
    }
    None
}

/// As `found` at the part `low`, nearer to `high`, which is too much.
fn closer(
    attempt: &mut dyn FnMut(f64) -> Option<(Flight, bool)>,
    mut found: Flight,
    mut low: f64,
    mut high: f64,
) -> Flight {
    for _ in 0..BISECTIONS {
        let part = (low + high) / 2.0;
        match attempt(part) {
            Some((flight, true)) => (low, found) = (part, flight),
            _ => high = part,
        }
    }
    found
}

/// The shorter of two, where there are any.
pub(super) fn shorter(one: Option<Flight>, other: Option<Flight>) -> Option<Flight> {
    match (one, other) {
        (Some(one), Some(other)) => Some(if other.duration < one.duration { other } else { one }),
        (one, other) => one.or(other),
    }
}

/// A `part` of `limits`, as far as the ends keep that.
fn lower(
    from: &State,
    to: &State,
    limits: &FlightLimits,
    part: f64,
    [with_speed, with_jerk]: [bool; 2],
) -> Option<FlightLimits> {
    let fast = from.velocity.norm().max(to.velocity.norm());
    let lateral = from.acceleration.norm().max(to.acceleration.norm());
    let acceleration = (limits.acceleration * part).max(lateral);
    let jerk = if with_jerk { limits.jerk * part } else { limits.jerk };
    let speed = if with_speed { (limits.speed * part).max(fast) } else { limits.speed };
    let lower = FlightLimits { speed, acceleration, jerk };
    (lower != *limits).then_some(lower)
}

/// The shortest flight within `limits` and those of `directions`; `None` where it would take too long.
pub(super) fn shortest(
    from: &State,
    to: &State,
    limits: &FlightLimits,
    directions: &[DirectionLimit],
) -> Option<Flight> {
    let way = to.position - from.position;
    let change = to.velocity - from.velocity;
    let curved = from.acceleration != to.acceleration;
    if way.norm() <= ROUNDING && change.norm() <= ROUNDING && !curved {
        return Some(Flight::nothing(from));
    }
    let straight = from.acceleration.norm() == 0.0 && !curved;
    if straight && from.velocity.norm() == 0.0 && to.velocity.norm() == 0.0 {
        return Some(Flight::straight(from, to, &limits.along(&way, directions)))
            .filter(|flight| flight.duration <= LONGEST);
    }
    if straight && change.norm() <= ROUNDING {
        let duration = way.dot(&from.velocity) / from.velocity.norm_squared();
        if duration > 0.0 && (way - from.velocity * duration).norm() <= ROUNDING {
            let accelerations = [from.acceleration].into_iter();
            return Some(Flight::through(from, to, &[duration], accelerations));
        }
    }
    within_speed(from, to, true, limits, directions)
}

/// The shortest flight at whose curved ends, too, the speed is kept.
///
/// The programme sees the speed between the ends only. Right at an end that is curved, and as fast
/// as may be, the first phase must slow down soon enough, which a lower speed after it makes it do.
fn within_speed(
    from: &State,
    to: &State,
    placed: bool,
    limits: &FlightLimits,
    directions: &[DirectionLimit],
) -> Option<Flight> {
    let frame = Frame::new(from, to);
    let mut inner = *limits;
    for _ in 0..RETRIES {
        let flight = if frame.flat {
            seek::<2, 6, 24, 4>(from, to, &frame, placed, &inner, directions)
        } else {
            seek::<3, 9, 36, 5>(from, to, &frame, placed, &inner, directions)
        };
        let flight = flight.filter(|flight| flight.keeps_speed(limits.speed));
        let straight = from.acceleration.norm() == 0.0 && to.acceleration.norm() == 0.0;
        if flight.is_some() || straight {
            return flight;
        }
        inner.speed *= 0.97;
    }
    None
}

/// From rest anywhere into `to`, over the breaks of a grid.
pub(super) fn free(
    to: &State,
    limits: &FlightLimits,
    directions: &[DirectionLimit],
) -> Option<Flight> {
    let from = State::rest(to.position);
    within_speed(&from, to, false, limits, directions)
}

/// The shortest flight in `frame`; `placed` where `from` is at its position.
fn seek<const D: usize, const W: usize, const R: usize, const C: usize>(
    from: &State,
    to: &State,
    frame: &Frame,
    placed: bool,
    limits: &FlightLimits,
    directions: &[DirectionLimit],
) -> Option<Flight> {
    let task = Task::<D> {
        velocity: [frame.down(&from.velocity), frame.down(&to.velocity)],
        acceleration: [frame.down(&from.acceleration), frame.down(&to.acceleration)],
        displacement: placed.then(|| frame.down(&(to.position - from.position))),
        limits: [limits.speed, limits.acceleration, limits.jerk],
        sides: directions.iter().filter_map(|side| side.down(frame)).collect(),
    };
    let change = to.velocity - from.velocity;
    let way = if change.norm() > ROUNDING { change } else { to.position - from.position };
    let search =
        Search::<D, W, R, C>::new(&task, from, to, placed, &limits.along(&way, directions));
    let found = search.run()?;
    let steps = &found.grid.steps;
    let coefficients = &found.answer.coefficients;
    let accelerations = (1..=INTERVALS).map(|index| {
        if index == INTERVALS {
            return to.acceleration;
        }
        let gap = found.grid.gap(index);
        let change = core::array::from_fn(|axis| {
            (coefficients[index][axis] - coefficients[index - 1][axis]) / gap
        });
        frame.up::<D>(&change)
    });
    let mut flight = Flight::through(from, to, steps, accelerations);
    if !placed {
        flight.end_at(to);
    }
    Some(flight)
}

impl Flight {
    /// Moves the whole so that it ends at `to`.
    pub(super) fn end_at(&mut self, to: &State) {
        let Some(last) = self.phases.last() else { return };
        let off = to.position - last.motion.after(self.duration - last.start).position;
        for phase in &mut self.phases {
            phase.motion.position += off;
        }
        self.end = *to;
    }
}

/// The search on the duration.
struct Search<'a, const D: usize, const W: usize, const R: usize, const C: usize> {
    task: &'a Task<D>,
    spacing: Spacing,
    /// No flight is shorter [s].
    least: f64,
    /// What the mean of both ends' velocities takes for the way, 0 for none [s].
    natural: f64,
}

/// Time that the tool needs at least [s].
fn least(from: &State, to: &State, placed: bool, limits: &FlightLimits) -> f64 {
    let FlightLimits { speed, acceleration, jerk } = *limits;
    let change = (to.velocity - from.velocity).norm();
    let curve = (to.acceleration - from.acceleration).norm();
    let straight = from.acceleration.norm() == 0.0 && curve == 0.0;
    let turning = if straight {
        Ramp::to_speed(change, acceleration, jerk).duration()
    } else {
        (change / acceleration).max(curve / jerk)
    };
    if !placed {
        return turning;
    }
    // |Δp| ≤ v·T + A·T²/4.
    let way = (to.position - from.position).norm();
    let fast = from.velocity.norm().max(to.velocity.norm());
    let going = 2.0 * way / (fast + (fast * fast + acceleration * way).sqrt());
    turning.max(going).max(way / speed)
}

/// By a velocity that changes evenly.
fn guess<const D: usize>(task: &Task<D>, grid: &Grid) -> [[f64; D]; INTERVALS] {
    let duration: f64 = grid.steps.iter().sum();
    let mut time = -grid.steps[0] / 2.0;
    core::array::from_fn(|index| {
        time += if index > 0 { grid.gap(index) } else { grid.steps[0] };
        let part = (time / duration).clamp(0.0, 1.0);
        let part = part * part * (3.0 - 2.0 * part);
        let [first, last] = &task.velocity;
        core::array::from_fn(|axis| first[axis] + part * (last[axis] - first[axis]))
    })
}

impl<'a, const D: usize, const W: usize, const R: usize, const C: usize> Search<'a, D, W, R, C> {
    fn new(
        task: &'a Task<D>,
        from: &State,
        to: &State,
        placed: bool,
        limits: &FlightLimits,
    ) -> Self {
        let FlightLimits { speed, acceleration, jerk } = *limits;
        let reach = |end: &State| {
            1.05 * Ramp::to_speed(speed + end.velocity.norm(), acceleration, jerk).duration()
        };
        let mean = (from.velocity + to.velocity) / 2.0;
        let natural = (to.position - from.position).dot(&mean) / mean.norm_squared();
        Self {
            task,
            spacing: Spacing { rise: acceleration / jerk, reach: [reach(from), reach(to)] },
            least: least(from, to, placed, limits),
            natural: if placed && natural > 0.0 && natural.is_finite() { natural } else { 0.0 },
        }
    }

    /// Tries `duration`, from the last that was tried, to `goal` as a part of the share.
    fn trial(&self, duration: f64, goal: f64, last: Option<&Found<D>>) -> Found<D> {
        let grid = Grid::new(duration, &self.spacing);
        let near = last.filter(|last| duration < 1.3 * last.duration);
        let answer = match near {
            Some(last) => {
                let off = 5.0 * (duration / last.duration - 1.0).abs();
                let off = off.max(last.answer.gap);
                solve::<D, W, R, C>(self.task, &grid, &last.answer.coefficients, off, goal)
            }
            None => solve::<D, W, R, C>(self.task, &grid, &guess(self.task, &grid), 1.0, goal),
        };
        Found { duration, grid, answer }
    }

    fn run(&self) -> Option<Found<D>> {
        let mut found = self.trial(self.least.max(1e-9) * BEGIN, ROUGH, None);
        let mut short = None;
        let mut stalled = 0;
        for _ in 0..100 {
            let Answer { share, gap, .. } = found.answer;
            let duration = found.duration;
            if duration > LONGEST && self.task.displacement.is_some() {
                return None;
            }
            // Where the least share is thought to be.
            let likely = share * (1.0 - 0.3 * gap);
            if likely <= 1.0 && gap > FINE {
                found = self.trial(duration, FINE, Some(&found));
                continue;
            }
            if share <= 1.0 {
                return Some(match short {
                    Some(short) => self.refine(short, found),
                    None => found,
                });
            }
            // More time makes no difference where it is an end that is beyond a limit.
            if let Some((before, other)) = short
                && duration > STALLED[0] * before
                && likely > STALLED[1] * other
            {
                stalled += 1;
                if stalled == STALLS {
                    return None;
                }
            }
            let power = match short {
                Some((before, other)) => {
                    let slope = math::ln(other / likely) / math::ln(duration / before);
                    (1.0 / slope).clamp(0.3, 1.0)
                }
                None => 0.45,
            };
            let growth = math::pow(likely * 1.002, power).clamp(1.003, 1.6);
            let next = duration * growth;
            let natural = self.natural > duration && self.natural < next;
            let next = if natural { self.natural } else { next };
            let goal = if gap <= FINE { FINE } else { ROUGH };
            let tried = self.trial(next, goal, Some(&found));
            short = Some((duration, likely));
            found = tried;
        }
        None
    }

    /// Between the duration and share that are too `short` and `long`, which is not.
    fn refine(&self, short: (f64, f64), long: Found<D>) -> Found<D> {
        let (mut low, mut share) = short;
        let mut found = long;
        for _ in 0..8 {
            let ratio = found.duration / low;
            if ratio < NEAR {
                break;
            }
            let (above, below) = (math::ln(share), -math::ln(found.answer.share.max(1e-9)));
            let slope = (above + below) / math::ln(ratio);
            if below / slope < NEAR - 1.0 && slope > 1.0 {
                break;
            }
            // A little towards the longer, so that it is long enough.
            let part = ((above + 0.002) / (above + below)).clamp(0.1, 0.9);
            let tried = self.trial(low * math::pow(ratio, part), FINE, Some(&found));
            if tried.answer.share <= 1.0 {
                found = tried;
            } else {
                (low, share) = (tried.duration, tried.answer.share);
            }
        }
        found
    }
}
