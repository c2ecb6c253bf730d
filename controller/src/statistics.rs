//! What the controller counts over one stream, for its report.

use crate::cascade::Drive;
use crate::digest::Digest;
use crate::planned::Planned;
use crate::player::Instant;
use machine::{Actuator, Axis, Machine};
use messages::{
    Command, ControllerReport, Cycle, Fault, Feedback, MAX_ACTUATORS, MAX_AXES, RealtimeFacts,
    Setpoint,
};

/// An angle beyond every motor's, whose square is still a number [rad].
const BEYOND_ANGLE: f64 = 1e100;

/// The running report of a stream.
#[derive(Debug, Clone)]
pub struct Statistics {
    per_path_acceleration: f64,
    per_path_jerk: f64,
    axes: Vec<Shares>,
    /// Reciprocal current limits of the motors, 0 of a stepper.
    per_current: Vec<f64>,
    report: ControllerReport,
    digest: Digest,
}

/// Reciprocal limits of one axis.
#[derive(Debug, Clone, Copy)]
struct Shares {
    per_velocity: f64,
    per_acceleration: f64,
    per_jerk: f64,
}

impl Statistics {
    /// For this machine, before any stream.
    pub fn new(machine: &Machine) -> Self {
        let shares = |axis: &Axis| Shares {
            per_velocity: 1.0 / axis.velocity_limit().plan,
            per_acceleration: 1.0 / axis.acceleration_limit().plan,
            per_jerk: 1.0 / axis.jerk_limit().plan,
        };
        let per_current =
            |actuator: &Actuator| actuator.motor.dc().map_or(0.0, |motor| 1.0 / motor.current);
        Self {
            per_path_acceleration: 1.0 / machine.path.acceleration,
            per_path_jerk: 1.0 / machine.path.jerk,
            axes: machine.axes.iter().map(shares).collect(),
            per_current: machine.actuators.iter().map(per_current).collect(),
            report: ControllerReport::default(),
            digest: Digest::new(),
        }
    }

    /// Says how the controller's thread was set up.
    pub fn set_realtime(&mut self, facts: RealtimeFacts) {
        self.report.realtime = facts;
    }

    /// Starts counting for `stream`.
    pub fn begin(&mut self, stream: u64, cycle: Cycle) {
        let realtime = self.report.realtime;
        self.report =
            ControllerReport { stream, first_cycle: cycle, realtime, ..Default::default() };
        self.digest = Digest::new();
    }

    /// Counts one cycle: what was commanded with this override of the power, and how well the motors follow.
    pub fn cycle(&mut self, command: &Command, feedback: &Feedback, now: &Planned, power: f64) {
        let report = &mut self.report;
        if command.laser.is_lit() {
            let [least, most] = report.power_override;
            let is_first = most == 0.0;
            report.power_override =
                [if is_first { power } else { least.min(power) }, most.max(power)];
        }
        report.count += 1;
        report.last_cycle = feedback.cycle;
        // With those in between that drives skipped.
        report.cycles = (feedback.cycle.0 + 1).saturating_sub(report.first_cycle.0);
        self.digest.add(command, self.per_current.len());
        for index in 0..self.per_current.len().min(MAX_ACTUATORS) {
            let error = (now.angle[index] - feedback.position[index]).abs();
            // What is no angle ends the run as a fault, and would leave no number in the summary.
            if error > BEYOND_ANGLE || error.is_nan() {
                continue;
            }
            report.following_error_max[index] = report.following_error_max[index].max(error);
            report.following_error_squares[index] += error * error;
        }
    }

    /// Counts the current asked of the motor with this index.
    pub fn drive(&mut self, index: usize, drive: &Drive) {
        if let (Some(per_current), Some(most)) =
            (self.per_current.get(index), self.report.effort_use.get_mut(index))
        {
            *most = most.max(drive.current.abs() * per_current);
        }
    }

    /// Counts what `setpoint`, played at the rate of `instant`, uses of the limits: acceleration is
    /// `a·r² + v·ṙ`, jerk `j·r³ + 3·a·r·ṙ`; the part `v·r̈` is left out, 16 % of the limit at most
    /// in a hold at 0.25 m/s. Along the path the sizes are added: an upper bound.
    pub fn setpoint(&mut self, setpoint: &Setpoint, instant: Instant) {
        let report = &mut self.report;
        let (rate, change) = (instant.rate, instant.rate_change);
        let (square, cube) = (rate * rate, rate * rate * rate);
        let twist = 3.0 * rate * change;
        let raise = |most: &mut f64, share: f64| *most = most.max(share);
        let (velocity, acceleration) = (setpoint.path_velocity, setpoint.path_acceleration);
        let along = acceleration * square + velocity * change.abs();
        raise(&mut report.path_acceleration_use, along * self.per_path_acceleration);
        let along = setpoint.path_jerk * cube.abs() + acceleration * twist.abs();
        raise(&mut report.path_jerk_use, along * self.per_path_jerk);
        for (index, axis) in self.axes.iter().enumerate().take(MAX_AXES) {
            let velocity = setpoint.velocity[index];
            let acceleration = setpoint.acceleration[index];
            let jerk = setpoint.jerk[index] * cube + acceleration * twist;
            raise(&mut report.velocity_use[index], (velocity * rate).abs() * axis.per_velocity);
            let total = acceleration * square + velocity * change;
            raise(&mut report.acceleration_use[index], total.abs() * axis.per_acceleration);
            raise(&mut report.jerk_use[index], jerk.abs() * axis.per_jerk);
        }
    }

    /// The report so far, or the final one of the stream that ended last; its stream is 0 before
    /// the first.
    pub fn report(&self) -> ControllerReport {
        ControllerReport { digest: self.digest.value(), ..self.report }
    }

    /// The final report; [`Self::report`] repeats it until the next stream begins.
    pub fn finish(&mut self, completed: bool, fault: Fault) -> ControllerReport {
        let report = &mut self.report;
        (report.is_final, report.completed, report.fault) = (1, u32::from(completed), fault);
        self.report()
    }
}
