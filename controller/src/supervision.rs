//! Whether what comes in can be trusted, and whether the motors follow.
//!
//! A finding says what is wrong and whether the axes can still be trusted to follow the plan. If
//! so they come to rest along the path, else the drives brake them.

use crate::ramp::{LARGEST_CHANGE, LARGEST_TURN};
use crate::standing::STANDING_COUNTS;
use machine::trip::Limit;
use machine::trip::following::{CREEP, DISCONTINUITY, LEAD_STEP};
use machine::{Axis, DcMotor, Machine, StallTolerance};
use messages::feedback::status;
use messages::setpoint::flags;
use messages::time::CYCLE_TIME;
use messages::{AxisArray, Cycle, Fault, FaultCode, FaultQuantity, Feedback, MAX_AXES, Setpoint};

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

/// The watch over feedback and motors.
#[derive(Debug, Clone)]
pub struct Supervision {
    axes: Vec<Axis>,
    tolerance: StallTolerance,
    seen: Option<Seen>,
    /// Cycles since the last that was in time.
    late: u64,
    heating: AxisArray,
    standing: u32,
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
            tolerance: machine.stall,
            seen: None,
            late: 0,
            heating: [0.0; MAX_AXES],
            standing: 0,
        }
    }

    /// Forgets what was counted; the windings stay as warm as they are.
    pub fn reset(&mut self) {
        self.late = 0;
    }

    /// Cycles in a row in which no axis moved by more than an encoder count or so.
    pub fn standing(&self) -> u32 {
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
        self.watch_standing(feedback);
        let same_run = before.filter(|before| before.epoch == seen.epoch);
        let gap = same_run.map_or(1, |before| seen.cycle.0.saturating_sub(before.cycle.0));
        self.heat(feedback, gap);
        if let Some((index, value)) = not_finite(feedback, self.axes.len()) {
            let fault = Fault::new(FaultCode::NotFinite).on(index);
            return Err(Finding::lost(fault.with(FaultQuantity::Number, value)));
        }
        let Some(before) = before else { return Ok(Elapsed::ONE) };
        let most = self.tolerance.feedback_gap();
        if before.epoch != seen.epoch || gap == 0 || gap > most {
            let (value, limit) = (gap as f64, most as f64);
            let fault = Fault::new(FaultCode::StaleFeedback);
            return Err(Finding::lost(fault.beyond(FaultQuantity::Cycles, value, limit)));
        }
        let overran = seen.overruns > before.overruns && !feedback.has(status::SLIPPING);
        self.late = if overran { self.late + gap } else { 0 };
        if self.late > self.tolerance.cycles() {
            let (value, limit) = (self.late as f64, self.tolerance.cycles() as f64);
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

    /// Whether the axes follow `angle` [rad at the motor] inside their limits, and are cool.
    ///
    /// # Errors
    /// Following error, soft limit or overload, with the axis.
    pub fn motion(&self, feedback: &Feedback, angle: &AxisArray) -> Result<(), Finding> {
        // A winding stays too warm until the axes rest: that must not hide the loss of an axis.
        let mut overload = None;
        for (index, axis) in self.axes.iter().enumerate().take(MAX_AXES) {
            let limits = &axis.limits;
            let measured = feedback.position[index] * axis.ratio;
            let error = (angle[index] * axis.ratio - measured).abs();
            if error > limits.following_error || error.is_nan() {
                let fault = Fault::new(FaultCode::FollowingError).on(index);
                let quantity = FaultQuantity::FollowingError;
                return Err(Finding::lost(fault.beyond(quantity, error, limits.following_error)));
            }
            // A plan may go right up to the limit, and the axis follows it with some error.
            let [lower, upper] = limits.position;
            let margin = limits.following_error;
            if measured < lower - margin || measured > upper + margin {
                let limit = if measured < lower { lower } else { upper };
                let fault = Fault::new(FaultCode::PositionLimit).on(index);
                return Err(Finding::lost(fault.beyond(FaultQuantity::Position, measured, limit)));
            }
            if let Some(limit) = axis.motor.dc().and_then(DcMotor::heating_limit) {
                let heating = self.heating[index];
                if heating > limit.trip * limit.trip {
                    let fault = Fault::new(FaultCode::Overload).on(index);
                    let (quantity, value) = (FaultQuantity::Heating, heating.sqrt());
                    let finding = Finding::sound(fault.beyond(quantity, value, limit.trip));
                    overload.get_or_insert(finding);
                }
            }
        }
        overload.map_or(Ok(()), Err)
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
        if !setpoint.laser.is_valid() {
            return Err(Finding::sound(impossible_light(setpoint)));
        }
        for (index, axis) in self.axes.iter().enumerate().take(MAX_AXES) {
            let limits = &axis.limits;
            let numbers = [
                setpoint.position[index],
                setpoint.velocity[index],
                setpoint.acceleration[index],
                setpoint.jerk[index],
                setpoint.lead[index],
                setpoint.lead_momentum[index],
                setpoint.static_lead[index],
                setpoint.effort[index],
                setpoint.static_effort[index],
                setpoint.momentum[index],
            ];
            if let Some(value) = numbers.iter().find(|value| !value.is_finite()) {
                let fault = not_finite.on(index).with(FaultQuantity::Number, *value);
                return Err(Finding::sound(fault));
            }
            let [position, velocity, acceleration, jerk, _, _, _, effort, ..] = numbers;
            let [lower, upper] = limits.position;
            let sizes = [
                (FaultQuantity::Velocity, velocity, axis.velocity_limit()),
                (FaultQuantity::Acceleration, acceleration, axis.acceleration_limit()),
                (FaultQuantity::Jerk, jerk, axis.jerk_limit()),
                (FaultQuantity::Torque, effort, axis.effort_limit(velocity / axis.ratio)),
            ];
            let too_large = sizes.iter().find(|(_, value, limit)| value.abs() > limit.trip);
            let nearest = position.max(lower).min(upper);
            let broken = match too_large {
                None if (position - nearest).abs() <= Limit::ROUNDING.trip => continue,
                None => (FaultQuantity::Position, position, nearest),
                Some((quantity, value, limit)) => (*quantity, *value, limit.plan),
            };
            let (quantity, value, limit) = broken;
            let fault = Fault::new(FaultCode::SetpointLimit).on(index);
            return Err(Finding::sound(fault.beyond(quantity, value, limit)));
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
            let jump = if starts { 0.0 } else { moved - speeds / 2.0 * CYCLE_TIME };
            let creep = if rests { setpoint.velocity[index] * CYCLE_TIME } else { 0.0 };
            let step = |of: fn(&Setpoint) -> &AxisArray| of(setpoint)[index] - of(before)[index];
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
            let steps = [
                (FaultQuantity::Jump, jump, DISCONTINUITY * unit),
                (FaultQuantity::LeadJump, lead, LEAD_STEP * unit),
                (FaultQuantity::Creep, creep, CREEP * unit),
            ];
            let broken = steps.iter().find(|(_, value, limit)| value.abs() > *limit);
            if let Some((quantity, value, limit)) = broken {
                let fault = Fault::new(FaultCode::SetpointLimit).on(index);
                return Err(Finding::sound(fault.beyond(*quantity, *value, *limit)));
            }
        }
        Ok(())
    }

    /// Warms the windings by the current measured for `cycles`, or lets them cool: powered or not,
    /// or they would stay warm for as long as a fault lasts.
    fn heat(&mut self, feedback: &Feedback, cycles: u64) {
        let time = (cycles as f64 * CYCLE_TIME).min(DcMotor::HEATING_TIME);
        for (heating, current) in self.heating.iter_mut().zip(&feedback.current) {
            if current.is_finite() {
                *heating = DcMotor::heated(*heating, *current, time, DcMotor::HEATING_TIME);
            }
        }
    }

    /// The first axis that moves by more than an encoder count or so in a cycle, with its speed and what
    /// counts as standing [joint units/s].
    pub fn moving(&self, feedback: &Feedback) -> Option<(usize, f64, f64)> {
        self.axes.iter().zip(&feedback.velocity).enumerate().find_map(|(index, (axis, speed))| {
            let limit = STANDING_COUNTS * axis.encoder.resolution();
            let stands = speed.abs() * CYCLE_TIME <= limit;
            (!stands).then(|| (index, speed.abs() * axis.ratio, limit / CYCLE_TIME * axis.ratio))
        })
    }

    fn watch_standing(&mut self, feedback: &Feedback) {
        let stands = self.moving(feedback).is_none();
        self.standing = if stands { self.standing.saturating_add(1) } else { 0 };
    }
}

/// A laser cycle that makes no sense, or light where the stream rests.
fn impossible_light(setpoint: &Setpoint) -> Fault {
    let sequence = setpoint.sequence as f64;
    Fault::new(FaultCode::SetpointLimit).with(FaultQuantity::Light, sequence)
}

/// The first measured number that is not finite, with its axis.
fn not_finite(feedback: &Feedback, axes: usize) -> Option<(usize, f64)> {
    (0..axes.min(MAX_AXES)).find_map(|index| {
        let measured =
            [feedback.position[index], feedback.velocity[index], feedback.current[index]];
        measured.into_iter().find(|value| !value.is_finite()).map(|value| (index, value))
    })
}
