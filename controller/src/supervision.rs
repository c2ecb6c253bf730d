//! Whether what comes in can be trusted, and whether the motors follow.
//!
//! A finding says what is wrong and whether the axes can still be trusted to follow the plan. If
//! so they come to rest along the path, else the drives brake them.

use crate::ramp::{LARGEST_CHANGE, LARGEST_TURN};
use crate::reference::bit;
use crate::standing::STANDING_COUNTS;
use machine::trip::Limit;
use machine::trip::following::{CREEP, DISCONTINUITY, LEAD_STEP};
use machine::{Actuator, Axis, DcMotor, Machine, Timing};
use messages::feedback::status;
use messages::setpoint::flags;
use messages::time::{SETPOINT_PERIOD, SETPOINT_TIME};
use messages::{
    ActuatorArray, Cycle, Fault, FaultCode, FaultQuantity, Feedback, MAX_ACTUATORS, MAX_AXES,
    Nanoseconds, Setpoint,
};

/// Whether the axes can still be trusted to follow the plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Tracking {
    /// They can come to rest along the path.
    Sound,
    /// The drives must brake them.
    Lost,
}

/// Something wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finding {
    /// What.
    pub fault: Fault,
    /// What it means for the way to rest.
    pub tracking: Tracking,
}

impl Finding {
    /// A fault with which the axes can still come to rest along the path.
    pub fn sound(fault: Fault) -> Self {
        Self { fault, tracking: Tracking::Sound }
    }

    /// A fault after which the drives must brake the axes.
    pub fn lost(fault: Fault) -> Self {
        Self { fault, tracking: Tracking::Lost }
    }
}

/// What went by between two feedbacks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Elapsed {
    /// Cycles, at least 1.
    pub cycles: u64,
    /// How many of them drives began without a fresh command, and therefore in the dark. They are
    /// the last ones: whatever came between the two feedbacks, nobody answered.
    pub missed: u64,
}

impl Elapsed {
    /// One cycle, as it should be.
    pub const ONE: Self = Self { cycles: 1, missed: 0 };
}

/// Time in which a motor that stands moves by no more than [`STANDING_COUNTS`].
const STANDING_TIME: Nanoseconds = Nanoseconds(1_000_000);

/// The watch over feedback and motors.
#[derive(Debug, Clone)]
pub struct Supervision {
    axes: Vec<Axis>,
    actuators: Vec<Actuator>,
    timing: Timing,
    seen: Option<Seen>,
    /// Cycles since the last that was in time.
    late: u64,
    heating: ActuatorArray,
    standing: u64,
    /// How far each motor has moved in the window of time in which it is watched [rad].
    way: ActuatorArray,
    /// How old that window is, in cycles; 0 where the next cycle begins one.
    watched: u64,
}

#[derive(Debug, Clone, Copy)]
struct Seen {
    epoch: u64,
    cycle: Cycle,
    overruns: u64,
    missed: u64,
}

impl Supervision {
    /// Of this machine.
    pub fn new(machine: &Machine) -> Self {
        Self {
            axes: machine.axes.clone(),
            actuators: machine.actuators.clone(),
            timing: machine.realtime,
            way: [0.0; MAX_ACTUATORS],
            watched: 0,
            seen: None,
            late: 0,
            heating: [0.0; MAX_ACTUATORS],
            standing: 0,
        }
    }

    /// Forgets what was counted; the windings stay as warm as they are.
    pub fn reset(&mut self) {
        self.late = 0;
    }

    /// Cycles in a row in which no motor was found to move.
    pub fn standing(&self) -> u64 {
        self.standing
    }

    /// Takes a feedback: what went by since the last one.
    ///
    /// # Errors
    /// The same or an older cycle, a gap longer than the tolerated stall, another run of drives, a
    /// number that is not finite, or drives late for longer than that, with no cycle in time between.
    pub fn feedback(&mut self, feedback: &Feedback) -> Result<Elapsed, Finding> {
        let seen = Seen {
            epoch: feedback.epoch,
            cycle: feedback.cycle,
            overruns: feedback.overruns,
            missed: feedback.missed,
        };
        let before = self.seen.replace(seen);
        let same_run = before.filter(|before| before.epoch == seen.epoch);
        let gap = same_run.map_or(1, |before| seen.cycle.0.saturating_sub(before.cycle.0));
        self.watch_standing(feedback, gap);
        self.heat(feedback, gap);
        if let Some((index, value)) = not_finite(feedback, self.actuators.len()) {
            let fault = Fault::new(FaultCode::NotFinite).on_actuator(index);
            return Err(Finding::lost(fault.with(FaultQuantity::Number, value)));
        }
        let Some(before) = before else { return Ok(Elapsed::ONE) };
        let most = self.timing.feedback_gap();
        if before.epoch != seen.epoch || gap == 0 || gap > most {
            let (value, limit) = (gap as f64, most as f64);
            let fault = Fault::new(FaultCode::StaleFeedback);
            return Err(Finding::lost(fault.beyond(FaultQuantity::Cycles, value, limit)));
        }
        let overran = seen.overruns > before.overruns && !feedback.has(status::SLIPPING);
        self.late = if overran { self.late + gap } else { 0 };
        let tolerated = self.timing.stalled_cycles();
        if self.late > tolerated {
            let (value, limit) = (self.late as f64, tolerated as f64);
            let fault = Fault::new(FaultCode::Overrun);
            return Err(Finding::sound(fault.beyond(FaultQuantity::Overruns, value, limit)));
        }
        // Nobody answered the feedbacks in between.
        let missed = seen.missed.saturating_sub(before.missed).clamp(gap - 1, gap);
        Ok(Elapsed { cycles: gap, missed })
    }

    /// Whether drives says that something is wrong on its side, with the motors powered.
    ///
    /// # Errors
    /// Its own fault, or that its watchdog has stopped the axes.
    pub fn drives(&self, feedback: &Feedback) -> Result<(), Finding> {
        if feedback.fault.is_some() {
            return Err(Finding::lost(feedback.fault));
        }
        if feedback.has(status::WATCHDOG_TRIPPED) {
            return Err(Finding::lost(Fault::new(FaultCode::StaleCommand)));
        }
        if !feedback.has(status::POWERED) {
            return Err(Finding::lost(Fault::new(FaultCode::DriveFault)));
        }
        Ok(())
    }

    /// Whether the actuators follow `angle` [rad at the motor] inside the limits of their axes, those of
    /// one axis together, and are cool. Soft limits hold for the axes that have a bit in `bounded`.
    ///
    /// # Errors
    /// Following error, soft limit, racking or overload, with the actuator, or with the axis.
    pub fn motion(
        &self,
        feedback: &Feedback,
        angle: &ActuatorArray,
        bounded: u32,
    ) -> Result<(), Finding> {
        // A winding stays too warm until the axes rest: that must not hide the loss of an axis.
        let mut overload = None;
        for (axis_index, axis) in self.axes.iter().enumerate().take(MAX_AXES) {
            let limits = &axis.limits;
            let mut joint = 0.0;
            for (actuator, index) in
                axis.driven_by(&self.actuators).iter().zip(axis.actuators.clone())
            {
                let measured = feedback.position[index] * actuator.ratio;
                joint += actuator.share * measured;
                let error = (angle[index] * actuator.ratio - measured).abs();
                if error > limits.following_error || error.is_nan() {
                    let fault = Fault::new(FaultCode::FollowingError).on_actuator(index);
                    let quantity = FaultQuantity::FollowingError;
                    return Err(Finding::lost(fault.beyond(
                        quantity,
                        error,
                        limits.following_error,
                    )));
                }
                if let Some(limit) = actuator.motor.dc().and_then(DcMotor::heating_limit) {
                    let heating = self.heating[index];
                    if heating > limit.trip * limit.trip {
                        let fault = Fault::new(FaultCode::Overload).on_actuator(index);
                        let (quantity, value) = (FaultQuantity::Heating, heating.sqrt());
                        let finding = Finding::sound(fault.beyond(quantity, value, limit.trip));
                        overload.get_or_insert(finding);
                    }
                }
            }
            // A plan may go right up to the limit, and the axis follows it with some error.
            let [lower, upper] = limits.position;
            let margin = limits.following_error;
            let is_bounded = bounded & bit(axis_index) != 0;
            if is_bounded && (joint < lower - margin || joint > upper + margin) {
                let limit = if joint < lower { lower } else { upper };
                let fault = Fault::new(FaultCode::PositionLimit).on_axis(axis_index);
                return Err(Finding::lost(fault.beyond(FaultQuantity::Position, joint, limit)));
            }
            self.squareness(axis, &feedback.position)?;
        }
        overload.map_or(Ok(()), Err)
    }

    /// Whether the actuators of each axis are together, with the motors at `angle` [rad].
    ///
    /// # Errors
    /// One that is too far from another one of its axis.
    pub fn square(&self, angle: &ActuatorArray) -> Result<(), Finding> {
        self.axes.iter().try_for_each(|axis| self.squareness(axis, angle))
    }

    fn squareness(&self, axis: &Axis, angle: &ActuatorArray) -> Result<(), Finding> {
        let own = axis.driven_by(&self.actuators);
        if own.len() < 2 {
            return Ok(());
        }
        let limit = axis.limits.racking;
        let places =
            || axis.actuators.clone().zip(own).map(|(index, it)| (index, angle[index] * it.ratio));
        let lowest = places().fold(f64::INFINITY, |lowest, (_, place)| lowest.min(place));
        let highest = places().fold(f64::NEG_INFINITY, |highest, (_, place)| highest.max(place));
        let racking = highest - lowest;
        if racking <= limit {
            return Ok(());
        }
        // The one farther from where all of them are in the mean is more likely the one that is lost.
        let mean: f64 = places().zip(own).map(|((_, place), it)| it.share * place).sum();
        let off = |place: f64| (place - mean).abs();
        let (index, _) = places().fold((axis.actuators.start, -1.0), |worst, (index, place)| {
            if off(place) > worst.1 { (index, off(place)) } else { worst }
        });
        let fault = Fault::new(FaultCode::Racking).on_actuator(index);
        Err(Finding::lost(fault.beyond(FaultQuantity::Racking, racking, limit)))
    }

    /// Whether a setpoint can be played.
    ///
    /// # Errors
    /// A number that is not finite, or a value beyond its axis' limit.
    pub fn setpoint(&self, setpoint: &Setpoint) -> Result<(), Finding> {
        let scalars = [setpoint.path_velocity, setpoint.path_acceleration, setpoint.path_jerk];
        let not_finite = Fault::new(FaultCode::NotFinite);
        let mut of_the_tool = setpoint.tool.iter().chain(&scalars);
        if let Some(value) = of_the_tool.find(|value| !value.is_finite()) {
            return Err(Finding::sound(not_finite.with(FaultQuantity::Number, *value)));
        }
        if !setpoint.laser.is_valid(SETPOINT_PERIOD) {
            return Err(Finding::sound(impossible_light(setpoint)));
        }
        for (index, axis) in self.axes.iter().enumerate().take(MAX_AXES) {
            let limits = &axis.limits;
            let numbers = [
                setpoint.position[index],
                setpoint.velocity[index],
                setpoint.acceleration[index],
                setpoint.jerk[index],
            ];
            if let Some(value) = numbers.iter().find(|value| !value.is_finite()) {
                let fault = not_finite.on_axis(index).with(FaultQuantity::Number, *value);
                return Err(Finding::sound(fault));
            }
            let [position, velocity, acceleration, jerk] = numbers;
            let [lower, upper] = limits.position;
            let sizes = [
                (FaultQuantity::Velocity, velocity, axis.velocity_limit()),
                (FaultQuantity::Acceleration, acceleration, axis.acceleration_limit()),
                (FaultQuantity::Jerk, jerk, axis.jerk_limit()),
            ];
            let too_large = sizes.iter().find(|(_, value, limit)| value.abs() > limit.trip);
            let nearest = position.max(lower).min(upper);
            let broken = match too_large {
                None if (position - nearest).abs() <= Limit::ROUNDING.trip => continue,
                None => (FaultQuantity::Position, position, nearest),
                Some((quantity, value, limit)) => (*quantity, *value, limit.plan),
            };
            let (quantity, value, limit) = broken;
            let fault = Fault::new(FaultCode::SetpointLimit).on_axis(index);
            return Err(Finding::sound(fault.beyond(quantity, value, limit)));
        }
        self.efforts(setpoint)
    }

    /// Whether the motors can bear what `setpoint` asks of them.
    fn efforts(&self, setpoint: &Setpoint) -> Result<(), Finding> {
        for (index, actuator) in self.actuators.iter().enumerate().take(MAX_ACTUATORS) {
            let numbers = [
                setpoint.lead[index],
                setpoint.lead_momentum[index],
                setpoint.static_lead[index],
                setpoint.effort[index],
                setpoint.static_effort[index],
                setpoint.momentum[index],
            ];
            if let Some(value) = numbers.iter().find(|value| !value.is_finite()) {
                let fault = Fault::new(FaultCode::NotFinite).on_actuator(index);
                return Err(Finding::sound(fault.with(FaultQuantity::Number, *value)));
            }
            let effort = setpoint.effort[index];
            let limit = actuator.effort_limit(setpoint.velocity[actuator.axis] / actuator.ratio);
            if effort.abs() > limit.trip {
                let fault = Fault::new(FaultCode::SetpointLimit).on_actuator(index);
                let fault = fault.beyond(FaultQuantity::Torque, effort, limit.plan);
                return Err(Finding::sound(fault));
            }
        }
        Ok(())
    }

    /// Whether `setpoint` continues from `before`, or starts at rest without one, and rests where it
    /// promises to: at any rate, and while that changes.
    ///
    /// # Errors
    /// A jump of position or lead, motion or light at a planned rest; with the axis and joint units.
    pub fn continuity(
        &self,
        before: Option<&Setpoint>,
        setpoint: &Setpoint,
    ) -> Result<(), Finding> {
        let ends = setpoint.has(flags::LAST) || setpoint.has(flags::PAUSE);
        let starts = before.is_none();
        if ends && setpoint.laser.is_lit() {
            return Err(Finding::sound(impossible_light(setpoint)));
        }
        for (index, axis) in self.axes.iter().enumerate().take(MAX_AXES) {
            let unit = axis.limits.following_error;
            let before = before.unwrap_or(setpoint);
            let rests = ends || starts;
            let speeds = before.velocity[index] + setpoint.velocity[index];
            let moved = setpoint.position[index] - before.position[index];
            let jump = if starts { 0.0 } else { moved - speeds / 2.0 * SETPOINT_TIME };
            let creep = if rests { setpoint.velocity[index] * SETPOINT_TIME } else { 0.0 };
            let steps = [
                (FaultQuantity::Jump, jump, DISCONTINUITY * unit),
                (FaultQuantity::Creep, creep, CREEP * unit),
            ];
            let broken = steps.iter().find(|(_, value, limit)| value.abs() > *limit);
            if let Some((quantity, value, limit)) = broken {
                let fault = Fault::new(FaultCode::SetpointLimit).on_axis(index);
                return Err(Finding::sound(fault.beyond(*quantity, *value, *limit)));
            }
        }
        for (index, actuator) in self.actuators.iter().enumerate().take(MAX_ACTUATORS) {
            let limit = LEAD_STEP * self.axes[actuator.axis].limits.following_error;
            let before = before.unwrap_or(setpoint);
            let rests = ends || starts;
            let step =
                |of: fn(&Setpoint) -> &ActuatorArray| of(setpoint)[index] - of(before)[index];
            // What is left of the lead in a hold, and what a change of the rate adds to it.
            let at_rest = setpoint.lead[index] - setpoint.static_lead[index];
            let momentum = setpoint.lead_momentum[index];
            let leads = [
                step(|setpoint| &setpoint.lead),
                step(|setpoint| &setpoint.static_lead),
                if rests { at_rest } else { 0.0 },
                step(|setpoint| &setpoint.lead_momentum) * LARGEST_CHANGE,
                momentum * LARGEST_TURN,
            ];
            let lead = leads.into_iter().fold(0.0, |largest: f64, lead| {
                if lead.abs() > largest.abs() { lead } else { largest }
            });
            if lead.abs() > limit {
                let fault = Fault::new(FaultCode::SetpointLimit).on_actuator(index);
                return Err(Finding::sound(fault.beyond(FaultQuantity::LeadJump, lead, limit)));
            }
        }
        Ok(())
    }

    /// Warms the windings by the current measured for `cycles`, or lets them cool: powered or not,
    /// or they would stay warm for as long as a fault lasts.
    fn heat(&mut self, feedback: &Feedback, cycles: u64) {
        let time = self.timing.period.of(cycles).seconds().min(DcMotor::HEATING_TIME);
        for (heating, current) in self.heating.iter_mut().zip(&feedback.current) {
            if current.is_finite() {
                *heating = DcMotor::heated(*heating, *current, time, DcMotor::HEATING_TIME);
            }
        }
    }

    /// The first actuator that has moved by more than an encoder count or so within `STANDING_TIME` or a
    /// cycle, with its speed and what counts as standing [joint units/s].
    pub fn moving(&self) -> Option<(usize, f64, f64)> {
        let time = self.timing.period.seconds();
        let window = time.max(STANDING_TIME.seconds());
        let mut drives = self.actuators.iter().zip(&self.way).enumerate();
        drives.find_map(|(index, (actuator, way))| {
            let limit = STANDING_COUNTS * actuator.encoder.resolution();
            let stands = way.abs() <= limit;
            let ratio = actuator.ratio.abs();
            (!stands).then(|| (index, way.abs() / window * ratio, limit / window * ratio))
        })
    }

    /// Follows how far the motors are from where they were at the start of the window of time at hand: a
    /// window, because a motor that creeps moves a count in few of the cycles of a short period.
    fn watch_standing(&mut self, feedback: &Feedback, cycles: u64) {
        let time = self.timing.period.seconds();
        let speeds = &feedback.velocity;
        for (way, speed) in self.way.iter_mut().zip(speeds) {
            // As far as a cycle's mean speed goes: what was skipped is no longer than that.
            *way = if self.watched == 0 { 0.0 } else { *way } + speed * time;
        }
        let stands = self.moving().is_none();
        self.standing = if stands { self.standing.saturating_add(1) } else { 0 };
        self.watched += cycles;
        if !stands || self.watched >= self.timing.period.cycles_for(STANDING_TIME) {
            self.watched = 0;
        }
    }
}

/// A laser cycle that makes no sense, or light where the stream rests.
fn impossible_light(setpoint: &Setpoint) -> Fault {
    let sequence = setpoint.sequence as f64;
    Fault::new(FaultCode::SetpointLimit).with(FaultQuantity::Light, sequence)
}

/// The first measured number that is not finite, with its actuator.
fn not_finite(feedback: &Feedback, actuators: usize) -> Option<(usize, f64)> {
    (0..actuators.min(MAX_ACTUATORS)).find_map(|index| {
        let measured =
            [feedback.position[index], feedback.velocity[index], feedback.current[index]];
        measured.into_iter().find(|value| !value.is_finite()).map(|value| (index, value))
    })
}
