//! The planning of a job, window by window: each is timed, sampled and checked before it is handed
//! on, and from the end of each there is a way to rest.

mod account;
mod ahead;
mod entry;
mod estimate;
mod height;
pub(crate) mod operations;
mod parts;
mod paths;
mod plateau;
mod refusals;
pub(crate) mod run;
mod run_in_out;
mod trials;
mod windows;

#[cfg(test)]
mod tests;

use std::collections::VecDeque;
use std::sync::Arc;

use machine::kinematics::Joints;
use machine::{Machine, Mechanism, PathLimits, WorkArea};
use messages::Setpoint;
use messages::artwork::ArtworkLine;
use messages::time::CYCLE_TIME;
use nalgebra::Vector3;

use crate::drawing::{Note, Turns};
use crate::error::{Place, PlanError};
use crate::geometry::contour::Contour;
use crate::geometry::operation::OperationKind;
use crate::joint_space::configuration::Configuration;
use crate::joint_space::joint_move::JointMove;
use crate::joint_space::route::{Router, still};
use crate::law::flight::State;
use crate::law::optimum::Speeds;
use crate::light::exposure::{Light, told_ahead};
use crate::limits::limit_id::{BindingTimes, LimitId};
use crate::limits::motion_limits::{MotionLimits, Scope};
use crate::limits::tightening::Tightening;
use crate::sampling::sampler::{Sampler, Unreachable};
use crate::trajectory::{BEFORE, Motion, Piece, Trajectory};
use crate::verify::checker::{Checker, LimitViolation};
use crate::verify::interpolation::InterpolationCheck;
use account::{Account, Asked, Slowed};
use operations::OperationQueue;
use paths::PathRun;
use refusals::too_short;
use trials::{Failure, Trials};
use windows::dot as dot_of;

/// Rest before and after an output changes [s]: a cycle each.
const OUTPUT_REST: f64 = CYCLE_TIME;

/// Rest before a pause [s], so that the springs of the transmission have settled.
const PAUSE_REST: f64 = 0.1;

/// Jobs that last longer are refused, most likely for a wrong number [s].
const LONGEST: f64 = 7.0 * 86_400.0;

/// For how long samples depend on the motion before them [s]: they are differences over earlier cycles and
/// a mean over one.
const REMEMBERED: f64 = 2.0 * CYCLE_TIME;

/// Samples checked between two questions whether anybody still waits for the plan.
const ASK: u64 = 4096;

/// The most setpoints of a window: a motion that lasts longer is checked as a whole, and then sampled
/// again window by window.
const MOST_SETPOINTS: usize = 4096;

/// The longest part of a rest that is one window [s].
const LONGEST_REST: f64 = 2.0;

/// The rest before the first motion [s]: whole cycles, so that a source that is told ahead of the first
/// light is told at rest.
fn first_rest(machine: &Machine) -> f64 {
    BEFORE + (machine.laser.on_delay / CYCLE_TIME).ceil() * CYCLE_TIME
}

/// What a job does, read and understood.
pub(crate) struct Task<'a> {
    pub(crate) machine: &'a Machine,
    pub(crate) limits: PathLimits,
    pub(crate) scope: Scope,
    pub(crate) speeds: Speeds,
    pub(crate) turns: Turns,
    /// Whether z is the tool's height over the work, below which it must not dip in the dark.
    pub(crate) z_is_height: bool,
    pub(crate) attitude: crate::geometry::attitude::AttitudeLaw,
    /// How long the job takes at the speeds asked for, if starts and turns took no time [s].
    pub(crate) estimate: f64,
    /// Where the tool is before it [m].
    pub(crate) start: Vector3<f64>,
    /// Where the joints stand [m or rad].
    pub(crate) standing: messages::AxisArray,
}

/// A stretch of a job that is planned, sampled and checked.
#[derive(Debug, Default)]
pub(crate) struct Window {
    /// Its setpoints, whole cycles; the rest of its time is sampled with the next.
    pub(crate) setpoints: Vec<Setpoint>,
    /// Its motion.
    pub(crate) trajectory: Trajectory,
    /// The lines and dots that begin in it, and parts of those that go on.
    pub(crate) strokes: Vec<ArtworkLine>,
    /// Stream time at its end [s], and an estimate of that at the end of the job.
    pub(crate) end: f64,
    pub(crate) estimate: f64,
    /// Up to when the motion must have been sampled before nothing of the window can be found to break a
    /// limit [s].
    pub(crate) needed: f64,
    /// Whether it is the way to rest that was planned with the window before, and the same whatever it may
    /// use of the limits.
    pub(crate) is_fixed: bool,
}

/// What the planning of a window changes.
#[derive(Clone)]
struct Front<const N: usize, M: Mechanism<N>> {
    now: Configuration<N>,
    /// The tool's state where it does not rest.
    moving: Option<State>,
    run: Option<PathRun<N>>,
    /// Whether that goes on in the next operation.
    goes_on: bool,
    /// How much longer it stands where it is [s].
    standing: f64,
    /// Number of the next operation, and parts of a path that was divided.
    next: usize,
    parts: VecDeque<Arc<Contour>>,
    time: f64,
    outputs: u64,
    light: Light,
    line: u64,
    sampler: Sampler<N, M>,
    checker: Checker,
    interpolation: Option<InterpolationCheck>,
    samples: u64,
    /// The first rest, which belongs to the first window.
    lead_in: Option<Piece>,
    /// How long the operations so far were estimated to take [s], and where the tool is after them
    /// [m].
    estimated: f64,
    place: Vector3<f64>,
    /// The least z that was written up to this path, and of it [m].
    lowest: [f64; 2],
}

/// Where planning can go back to.
#[derive(Clone)]
struct Checkpoint<const N: usize, M: Mechanism<N>> {
    front: Front<N, M>,
    account: Account,
}

impl<const N: usize, M: Mechanism<N>> Checkpoint<N, M> {
    /// Stream time at which the next window begins [s].
    fn time(&self) -> f64 {
        self.front.time
    }
}

/// A job under way.
pub(crate) struct Planning<'a, const N: usize, M: Mechanism<N>> {
    limits: MotionLimits<'a, N, M>,
    area: &'a WorkArea,
    task: &'a Task<'a>,
    operations: OperationQueue<'a>,
    front: Front<N, M>,
    pub(crate) account: Account,
    /// How much faster than the job asks for it is marked, 1 as it asks.
    rate: f64,
}

/// A window in the making.
struct Draft<'s> {
    trajectory: Trajectory,
    strokes: Vec<ArtworkLine>,
    length: f64,
    asked: Asked,
    shares: &'s Tightening,
    slowed: Vec<Slowed>,
    notes: Vec<Note>,
    bound: BindingTimes,
    speed: f64,
    is_fixed: bool,
}

impl<'a, const N: usize, M: Mechanism<N>> Planning<'a, N, M> {
    /// Begins a job at rest.
    pub(crate) fn new(
        mechanism: &'a M,
        task: &'a Task<'a>,
        operations: OperationQueue<'a>,
        stream: u64,
    ) -> Result<Self, PlanError> {
        let Task { machine, limits, scope, attitude, .. } = *task;
        let joints = Joints::<N>::from_fn(|axis, _| task.standing[axis]);
        let limits = MotionLimits::new(mechanism, &machine.axes, limits, &joints, attitude, scope);
        let now = Configuration { joints, branch: 0 };
        let rest = JointMove::standing(&joints, 0);
        let before = first_rest(machine);
        if before.is_nan() || before >= LONGEST {
            return Err(PlanError::TooLong { duration: before });
        }
        let lead_in = Piece {
            start: 0.0,
            duration: before,
            motion: Motion::Rest(rest.clone()),
            line: 0,
            stroke: 0,
        };
        let mut sampler = Sampler::new(mechanism.clone(), &machine.axes, rest, attitude, stream)
            .map_err(|cause| PlanError::Unreachable {
                line: 0,
                place: Place { stroke: 0, time: 0.0 },
                cause,
            })?;
        sampler.tell_ahead(told_ahead(&machine.laser));
        // On straight joints the cubic is the tool's own.
        let interpolates = scope == Scope::Machine && !mechanism.is_linear();
        let tolerance = limits.path.tolerance;
        let front = Front {
            now,
            moving: None,
            run: None,
            goes_on: false,
            standing: 0.0,
            next: 0,
            parts: VecDeque::new(),
            time: before,
            outputs: 0,
            light: Light::new(machine.laser),
            line: 0,
            sampler,
            checker: Checker::new(machine, limits.path, scope),
            interpolation: interpolates.then(|| InterpolationCheck::new(tolerance)),
            samples: 0,
            lead_in: Some(lead_in),
            estimated: 0.0,
            place: task.start,
            lowest: [task.start.z; 2],
        };
        let account = Account::default();
        Ok(Self { limits, area: &machine.area, task, operations, front, account, rate: 1.0 })
    }

    /// The next window from `checkpoint` on, where planning is, with less and less of the limits that it
    /// breaks, from `trials` on; `None` after the last. `may_go_back` says whether a window before can
    /// still be planned again.
    ///
    /// # Errors
    /// What no speed can do, with its place; or what only a window before can mend.
    fn next_window(
        &mut self,
        checkpoint: &Checkpoint<N, M>,
        trials: &mut Trials,
        may_go_back: bool,
        abandoned: &dyn Fn() -> bool,
    ) -> Result<Option<Window>, Failure> {
        if self.front.sampler.has_ended() {
            return Ok(None);
        }
        // What was broken last, and the first of it that the end of the window before has a part in.
        let mut before: Option<LimitViolation> = None;
        let mut early: Option<PlanError> = None;
        loop {
            if abandoned() {
                return Err(Failure::Here(PlanError::Abandoned));
            }
            let error = match self.attempt(trials.shares(), abandoned) {
                Ok(draft) => return Ok(Some(self.keep(draft))),
                Err(error) => error,
            };
            let PlanError::Limit { violation, .. } = &error else {
                return Err(match early {
                    Some(early) if error != PlanError::Abandoned => Failure::Before(early),
                    _ => Failure::Here(error),
                });
            };
            let may_mend = may_go_back && !violation.quantity.is_place();
            let begins_after =
                |time: f64| may_mend && !violation.quantity.is_light() && time < checkpoint.time();
            let is_early = begins_after(violation.time - REMEMBERED);
            let is_the_same = is_early && before.as_ref() == Some(violation);
            // Nothing of this window has a part in it, or nothing that it does mends it.
            if begins_after(violation.time + CYCLE_TIME / 2.0)
                || (is_the_same && trials.has_been_slowed())
            {
                return Err(Failure::Before(error));
            }
            if is_the_same {
                trials.slow();
            } else if !trials.tighten(violation, self.limits.axes) {
                return Err(match early {
                    Some(early) => Failure::Before(early),
                    None if may_mend => Failure::Before(error),
                    None => Failure::Here(error),
                });
            }
            before = Some(violation.clone());
            if is_early {
                early.get_or_insert(error);
            }
            self.front = checkpoint.front.clone();
        }
    }

    fn keep(&mut self, (draft, setpoints): (Draft<'_>, Vec<Setpoint>)) -> Window {
        let Draft { trajectory, strokes, slowed, notes, bound, speed, length, asked, .. } = draft;
        let is_fixed = draft.is_fixed;
        let account = &mut self.account;
        account.note_slowed(&slowed);
        account.notes.extend(notes);
        account.shares.merge(&bound);
        account.speed = account.speed.max(speed);
        account.asked.add(asked.speed, asked.line);
        account.length += length;
        account.strokes += strokes.iter().filter(|stroke| !stroke.goes_on).count() as u64;
        let (end, estimate) = (self.front.time, self.estimate());
        // Of a motion that goes on for many windows all samples but the last have been checked.
        let needed = if self.has_enough() { 0.0 } else { end + REMEMBERED };
        Window { setpoints, trajectory, strokes, end, estimate, needed, is_fixed }
    }

    /// Up to when the motion has been sampled and checked [s].
    fn sampled(&self) -> f64 {
        self.front.sampler.time()
    }

    /// From the first motion to the end of the last window [s].
    pub(crate) fn duration(&self) -> f64 {
        self.front.time - first_rest(self.task.machine)
    }

    /// Setpoints so far.
    pub(crate) fn samples(&self) -> u64 {
        self.front.samples
    }

    /// Whether its last setpoint has been made.
    pub(crate) fn is_complete(&self) -> bool {
        self.front.sampler.has_ended()
    }

    /// How much faster than the job asks for it is marked.
    pub(crate) fn rate(&self) -> f64 {
        self.rate
    }

    /// Where planning can be taken up again.
    fn checkpoint(&self) -> Checkpoint<N, M> {
        Checkpoint { front: self.front.clone(), account: self.account.clone() }
    }

    /// Goes back to where `checkpoint` was taken.
    fn restore(&mut self, checkpoint: Checkpoint<N, M>) {
        (self.front, self.account) = (checkpoint.front, checkpoint.account);
    }

    /// Lets a window that is planned again use less of what was broken. Says whether that is worth another
    /// trial.
    fn tighten(&self, trials: &mut Trials, violation: &LimitViolation) -> bool {
        trials.tighten(violation, self.limits.axes)
    }

    /// Lets go of what is needed no more when planning goes back to `oldest` at most.
    fn release(&mut self, oldest: &Checkpoint<N, M>) {
        self.operations.release(oldest.front.next);
    }

    /// Plans, samples and checks one window.
    fn attempt<'s>(
        &mut self,
        shares: &'s Tightening,
        abandoned: &dyn Fn() -> bool,
    ) -> Result<(Draft<'s>, Vec<Setpoint>), PlanError> {
        let mut draft = Draft {
            trajectory: Trajectory { attitude: self.task.attitude, ..Trajectory::default() },
            strokes: Vec::new(),
            length: 0.0,
            asked: Asked::default(),
            shares,
            slowed: Vec::new(),
            notes: Vec::new(),
            bound: BindingTimes::default(),
            speed: 0.0,
            is_fixed: false,
        };
        if !self.has_enough() {
            self.extend(&mut draft)?;
            if self.has_enough() {
                self.rehearse(abandoned)?;
            }
        }
        let setpoints = self.sample(MOST_SETPOINTS, abandoned)?;
        Ok((draft, setpoints))
    }

    /// Whether there is motion for more than one window.
    fn has_enough(&self) -> bool {
        self.front.sampler.due() > MOST_SETPOINTS
    }

    /// Adds motion to `draft` and to what is sampled, unless there is none left.
    fn extend(&mut self, draft: &mut Draft<'_>) -> Result<(), PlanError> {
        if self.front.sampler.is_complete() {
            return Ok(());
        }
        draft.trajectory.pieces.extend(self.front.lead_in.take());
        self.hold_height();
        let mut is_last = !self.advance(draft)?;
        // What takes no time is no window of its own: planning it again would mend nothing.
        while !is_last && draft.trajectory.pieces.is_empty() {
            is_last = !self.advance(draft)?;
        }
        let light = &mut self.front.light;
        draft.trajectory.laser =
            if is_last { light.take_all() } else { light.take(self.front.time) };
        let duration = self.front.time + self.front.standing;
        if duration > LONGEST || duration.is_nan() {
            return Err(PlanError::TooLong { duration });
        }
        self.front.sampler.extend(&draft.trajectory, is_last);
        Ok(())
    }

    /// Checks all samples of what is known of the motion, and keeps none: nothing of a motion may be
    /// handed on before all of it is known to keep the limits.
    fn rehearse(&mut self, abandoned: &dyn Fn() -> bool) -> Result<(), PlanError> {
        let front = self.front.clone();
        while !self.sample(MOST_SETPOINTS, abandoned)?.is_empty() {}
        self.front = front;
        Ok(())
    }

    /// Adds the next stretch of motion to `draft`. Says whether there was any left.
    fn advance(&mut self, draft: &mut Draft<'_>) -> Result<bool, PlanError> {
        if self.front.standing > 0.0 {
            self.stand(self.front.standing, draft);
            return Ok(true);
        }
        if self.front.run.is_some() {
            self.go_on(draft)?;
            return Ok(true);
        }
        if let Some(part) = self.front.parts.pop_front() {
            self.front.line = part.line;
            self.begin_path(part, draft)?;
            return Ok(true);
        }
        let Some(operation) = self.operations.get(self.front.next)?.cloned() else {
            self.halt(draft)?;
            return Ok(false);
        };
        self.front.next += 1;
        self.front.line = operation.line;
        match &operation.kind {
            OperationKind::Path(contour) => {
                let before = self.front.lowest[1].min(self.front.place.z);
                self.front.lowest = [before, f64::INFINITY];
                self.note_rapid(&contour.start().point);
                self.front.estimated += self.estimate_of(contour);
                self.go_as_low_as(contour);
                let contour = self.with_next_parts(contour.clone())?;
                self.front.place = contour.end().point;
                self.begin_path(contour, draft)?;
            }
            OperationKind::Rapid(to) => {
                self.note_rapid(to);
                self.go_to(*to, draft)?;
            }
            OperationKind::Rest(time) => {
                self.front.estimated += time;
                self.halt(draft)?;
                if *time > 0.0 {
                    self.stand(*time, draft);
                }
            }
            OperationKind::Dot(dot) => {
                self.note_rapid(&dot.at);
                self.go_to(dot.at, draft)?;
                let start = self.front.time;
                let light = &mut self.front.light;
                light.dot(start, &dot.exposures, operation.line).map_err(too_short)?;
                draft.strokes.push(dot_of(&dot.at, operation.line));
                let time = dot.exposures.iter().map(|(time, _)| time).sum();
                self.front.estimated += time;
                self.stand(time, draft);
            }
            OperationKind::Output { bit, on } => {
                self.halt(draft)?;
                let mask = 1_u64.checked_shl(*bit).unwrap_or(0);
                let outputs = self.front.outputs;
                self.front.outputs = if *on { outputs | mask } else { outputs & !mask };
                let change = (self.front.time + OUTPUT_REST, self.front.outputs);
                draft.trajectory.outputs.push(change);
                self.stand(2.0 * OUTPUT_REST, draft);
            }
            OperationKind::Pause => {
                self.halt(draft)?;
                // One cycle before the end, so that the sample that pauses is at rest.
                draft.trajectory.pauses.push(self.front.time + PAUSE_REST - CYCLE_TIME);
                self.stand(PAUSE_REST, draft);
            }
        }
        Ok(true)
    }

    /// Adds a piece of motion.
    fn push(&mut self, duration: f64, motion: Motion, stroke: u64, draft: &mut Draft<'_>) {
        let line = self.front.line;
        let start = self.front.time;
        match &motion {
            Motion::Flight(flight) => {
                let position = flight.at(duration / 2.0).position.into();
                draft.bound.add(LimitId::DARK_TURN, duration, line, position);
            }
            Motion::Joints(JointMove { law: Some(law), .. })
            | Motion::Path { law, is_lit: false, .. } => {
                for part in law.binding() {
                    draft.bound.add(LimitId(part.limit), part.duration, line, [0.0; 3]);
                }
            }
            _ => {}
        }
        draft.trajectory.pieces.push(Piece { start, duration, motion, line, stroke });
        self.front.time += duration;
    }

    /// Stands where the joints are, now and in as many of the next windows as `duration` takes [s].
    fn stand(&mut self, duration: f64, draft: &mut Draft<'_>) {
        let now = duration.min(LONGEST_REST);
        self.front.standing = duration - now;
        let rest = JointMove::standing(&self.front.now.joints, self.front.now.branch);
        let stroke = self.front.light.stroke;
        self.push(now, Motion::Rest(rest), stroke, draft);
    }

    /// Comes to rest, then goes to `to` in the dark.
    fn go_to(&mut self, to: Vector3<f64>, draft: &mut Draft<'_>) -> Result<(), PlanError> {
        self.halt(draft)?;
        let approach = self.router(draft.shares).approach(&still(to), &[]);
        let approach = approach.map_err(|cause| self.refusal(cause))?;
        if let Some((duration, motion)) = approach.motion {
            self.push(duration, motion, self.front.light.stroke, draft);
        }
        self.front.now = approach.start;
        self.settle_at(&still(to))?;
        Ok(())
    }

    /// Puts the joints where the tool's motion says, which the last move led to.
    fn settle_at(&mut self, tool: &machine::kinematics::ToolMotion) -> Result<(), PlanError> {
        let now = self.joints_at(tool, &self.front.now);
        self.front.now = now.map_err(|cause| self.refusal(cause))?;
        Ok(())
    }

    fn router<'r>(&'r self, shares: &'r Tightening) -> Router<'r, 'a, N, M> {
        Router { limits: &self.limits, area: self.area, shares, now: self.front.now }
    }

    /// Samples as far as the motion is known, `most` times at most, and checks each sample.
    fn sample(
        &mut self,
        most: usize,
        abandoned: &dyn Fn() -> bool,
    ) -> Result<Vec<Setpoint>, PlanError> {
        let mut setpoints = Vec::with_capacity(self.front.sampler.due().min(most));
        while setpoints.len() < most && self.front.sampler.push_to(&mut setpoints) {
            let Some(setpoint) = setpoints.last() else { break };
            self.front.samples += 1;
            if self.front.samples.is_multiple_of(ASK) && abandoned() {
                return Err(PlanError::Abandoned);
            }
            let front = &mut self.front;
            if front.sampler.is_crowded() {
                return Err(self.limit(LimitViolation::too_many_changes(setpoint)));
            }
            if let Err(violation) = front.checker.check(setpoint, self.limits.axes, self.area) {
                return Err(self.limit(violation));
            }
            if let Some(interpolation) = &mut front.interpolation {
                let time = setpoint.sequence as f64 * CYCLE_TIME;
                match interpolation.check(setpoint, &front.sampler) {
                    Ok(None) => {}
                    Ok(Some(violation)) => return Err(self.limit(violation)),
                    Err(cause) => return Err(self.unreachable(Unreachable { time, cause })),
                }
            }
        }
        match self.front.sampler.broken() {
            Some(found) => Err(self.unreachable(found)),
            None => Ok(setpoints),
        }
    }

    /// What of every limit has been used so far.
    pub(crate) fn utilization(&self) -> &messages::plan::LimitUtilization {
        self.front.checker.utilization()
    }

    /// What a person should know of the job so far.
    pub(crate) fn notes(&self) -> Vec<Note> {
        let mut notes = self.operations.notes().to_vec();
        notes.extend_from_slice(&self.account.notes);
        notes.extend(self.account.asked.note(self.task.speeds.most));
        notes.extend(self.account.slowed_note());
        notes
    }
}
