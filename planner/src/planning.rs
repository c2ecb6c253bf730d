//! The planning of a job, window by window: each is timed, sampled and checked before it is handed
//! on, and from the end of each there is a way to rest.

mod account;
mod ahead;
mod constant;
mod drawn;
mod entry;
mod estimate;
mod front;
mod height;
mod open_speeds;
pub(crate) mod operations;
pub(crate) mod outlet;
mod parts;
pub(crate) mod passing;
mod path_run;
mod paths;
mod plateau;
mod rate;
mod refusals;
pub(crate) mod run;
mod run_in_out;
mod speeds;
mod standing;
mod steps;
mod tail;
mod timing;
mod trials;
mod windows;

#[cfg(test)]
mod tests;

use std::collections::VecDeque;

use machine::kinematics::Joints;
use machine::{Machine, Mechanism, PathLimits, WorkArea};
use messages::artwork::ArtworkLine;
use messages::plan::Bounds;
use messages::time::SETPOINT_TIME;
use messages::{LaserCycle, Setpoint};
use nalgebra::Vector3;

use crate::drawing::{Note, Turns};
use crate::error::{Place, PlanError};
use crate::joint_space::configuration::Configuration;
use crate::joint_space::joint_move::JointMove;
use crate::law::optimum::Speeds;
use crate::light::exposure::{Light, told_ahead};
use crate::limits::limit_id::BindingTimes;
use crate::limits::motion_limits::{MotionLimits, Scope};
use crate::limits::tightening::Tightening;
use crate::sampling::sampler::{Sampler, Unreachable};
use crate::trajectory::{BEFORE, Motion, Piece, Trajectory};
use crate::verify::checker::{Checker, LimitViolation};
use crate::verify::interpolation::InterpolationCheck;
use account::{Account, Asked, Slowed};
use front::{Checkpoint, Front};
use operations::OperationQueue;
use passing::PassedOver;
use trials::{Failure, Trials};

/// Jobs that last longer are refused, most likely for a wrong number [s].
const LONGEST: f64 = 7.0 * 86_400.0;

/// For how long samples depend on the motion before them [s]: they are differences over earlier cycles and
/// a mean over one.
const REMEMBERED: f64 = 2.0 * SETPOINT_TIME;

/// Samples checked between two questions whether anybody still waits for the plan.
const ASK: u64 = 4096;

/// The most setpoints of a window: a motion that lasts longer is checked as a whole, and then sampled
/// again window by window.
const MOST_SETPOINTS: usize = 4096;

/// The rest before the first motion [s]: whole cycles, so that a source that is told ahead of the first
/// light is told at rest.
fn first_rest(machine: &Machine) -> f64 {
    BEFORE + (machine.laser.on_delay / SETPOINT_TIME).ceil() * SETPOINT_TIME
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
    /// What is marked on, where not in a plane.
    pub(crate) surface: Option<machine::surface::Surface>,
    /// Of the laser's pulses where nothing else is asked for [pulses/s], 0 as the source is set.
    pub(crate) frequency: f64,
    /// How long the job takes at the speeds asked for, if starts and turns took no time [s].
    pub(crate) estimate: f64,
    /// Whether nothing is lit.
    pub(crate) is_dry: bool,
    /// Whether what is lit shows where a job lies.
    pub(crate) is_frame: bool,
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
    power: Option<[f64; 2]>,
    shares: &'s Tightening,
    slowed: Vec<Slowed>,
    notes: Vec<Note>,
    bound: BindingTimes,
    speed: f64,
    is_fixed: bool,
}

impl Draft<'_> {
    /// Leaves the motion alone: nothing is lit, and nothing to be marked.
    fn darken(&mut self) {
        self.trajectory.laser.clear();
        self.strokes.clear();
        (self.length, self.speed, self.power) = (0.0, 0.0, None);
    }
}

/// Closes the gate of a setpoint.
fn darken(setpoint: &mut Setpoint) {
    let frequency = setpoint.laser.frequency;
    setpoint.laser = LaserCycle { frequency, ..LaserCycle::default() };
    setpoint.stroke = 0;
}

impl<'a, const N: usize, M: Mechanism<N>> Planning<'a, N, M> {
    /// Begins a job at rest.
    pub(crate) fn new(
        mechanism: &'a M,
        task: &'a Task<'a>,
        operations: OperationQueue<'a>,
        stream: u64,
    ) -> Result<Self, PlanError> {
        let Task { machine, limits, scope, attitude, surface, .. } = *task;
        let joints = Joints::<N>::from_fn(|axis, _| task.standing[axis]);
        let limits = MotionLimits::new(mechanism, machine, limits, &joints, attitude, scope);
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
        let mut sampler = Sampler::new(
            mechanism.clone(),
            &machine.axes,
            &machine.actuators,
            rest,
            attitude,
            stream,
        )
        .map_err(|cause| PlanError::Unreachable {
            line: 0,
            place: Place { stroke: 0, time: 0.0 },
            cause,
        })?;
        sampler.tell_ahead(told_ahead(&machine.laser));
        sampler.show_frame(task.is_frame);
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
            interpolation: interpolates.then(|| InterpolationCheck::new(tolerance, surface)),
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
            if begins_after(violation.time + SETPOINT_TIME / 2.0)
                || (is_the_same && trials.has_been_slowed())
            {
                return Err(Failure::Before(error));
            }
            if is_the_same {
                trials.slow();
            } else if !trials.tighten(violation, self.limits.axes, self.limits.actuators) {
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

    fn keep(&mut self, (mut draft, mut setpoints): (Draft<'_>, Vec<Setpoint>)) -> Window {
        if self.task.is_dry {
            draft.darken();
            setpoints.iter_mut().for_each(darken);
        }
        let Draft {
            trajectory, strokes, slowed, notes, bound, speed, length, asked, power, ..
        } = draft;
        let is_fixed = draft.is_fixed;
        let account = &mut self.account;
        account.note_slowed(&slowed);
        account.notes.extend(notes);
        account.shares.merge(&bound);
        account.speed = account.speed.max(speed);
        account.asked.add(asked.speed, asked.line);
        account.length += length;
        let points = strokes.iter().flat_map(|line| &line.stroke.points);
        points.for_each(|point| Bounds::widen(&mut account.bounds, point));
        for power in power.into_iter().flatten() {
            account::widen(&mut account.power, power);
        }
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

    /// What was passed over before the first stroke.
    pub(crate) fn passed_over(&self) -> PassedOver {
        self.operations.passed()
    }

    /// How much faster than the job asks for it is marked.
    pub(crate) fn rate(&self) -> f64 {
        self.rate
    }

    /// Lets a window that is planned again use less of what was broken. Says whether that is worth another
    /// trial.
    fn tighten(&self, trials: &mut Trials, violation: &LimitViolation) -> bool {
        trials.tighten(violation, self.limits.axes, self.limits.actuators)
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
            power: None,
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
        if let Some(lead_in) = self.front.lead_in.take() {
            draft.trajectory.pieces.push(lead_in);
            if self.task.frequency != 0.0 {
                draft.trajectory.frequencies.push((0.0, self.task.frequency));
            }
        }
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
            let drives = (self.limits.axes, self.limits.actuators);
            if let Err(violation) = front.checker.check(setpoint, drives, self.area) {
                return Err(self.limit(violation));
            }
            if let Some(interpolation) = &mut front.interpolation {
                let time = setpoint.sequence as f64 * SETPOINT_TIME;
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

    /// How far the tool has strayed between setpoints so far; `None` where it cannot.
    pub(crate) fn interpolation(&self) -> Option<messages::plan::InterpolationFacts> {
        self.front.interpolation.as_ref().map(|check| *check.found())
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
