//! What the controller counts over one stream, for its report.

use crate::cascade::Drive;
use crate::digest::Digest;
use crate::feedforward::Planned;
use crate::player::Instant;
use machine::Machine;
use signals::{
    Command, ControllerReport, Cycle, Fault, Feedback, MAX_AXES, RealtimeFacts, Setpoint,
};

/// The running report of a stream.
#[derive(Debug, Clone)]
pub struct Statistics {
    machine: Machine,
    report: ControllerReport,
    digest: Digest,
}

impl Statistics {
    /// For this machine, before any stream.
    pub fn new(machine: &Machine) -> Self {
        Self {
            machine: machine.clone(),
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

    /// Counts one cycle: what was commanded, and how well the motors follow.
    pub fn cycle(&mut self, command: &Command, feedback: &Feedback, now: &Planned) {
        let report = &mut self.report;
        report.cycles += 1;
        report.count += 1;
        report.last_cycle = feedback.cycle;
        self.digest.add(command, self.machine.axes.len());
        for index in 0..self.machine.axes.len().min(MAX_AXES) {
            let error = (now.angle[index] - feedback.position[index]).abs();
            report.following_error_max[index] = report.following_error_max[index].max(error);
            report.following_error_squares[index] += error * error;
        }
    }

    /// Counts the current asked of the motor with this index.
    pub fn drive(&mut self, index: usize, drive: &Drive) {
        if let (Some(axis), Some(most)) =
            (self.machine.axes.get(index), self.report.effort_use.get_mut(index))
        {
            *most = most.max(drive.current.abs() / axis.motor.current);
        }
    }

    /// Counts what `setpoint`, played at the rate of `instant`, uses of the limits: as planned and
    /// scaled to the rate.
    pub fn setpoint(&mut self, setpoint: &Setpoint, instant: Instant) {
        let (report, path) = (&mut self.report, &self.machine.path);
        let rate = instant.rate.abs();
        let (square, cube) = (rate * rate, rate * rate * rate);
        let raise = |most: &mut f64, share: f64| *most = most.max(share);
        raise(
            &mut report.path_acceleration_use,
            setpoint.path_acceleration * square / path.acceleration,
        );
        raise(&mut report.path_jerk_use, setpoint.path_jerk * cube / path.jerk);
        for (index, axis) in self.machine.axes.iter().enumerate().take(MAX_AXES) {
            let limits = &axis.limits;
            raise(
                &mut report.velocity_use[index],
                setpoint.velocity[index].abs() * rate / limits.velocity,
            );
            raise(
                &mut report.acceleration_use[index],
                setpoint.acceleration[index].abs() * square / limits.acceleration,
            );
            raise(&mut report.jerk_use[index], setpoint.jerk[index].abs() * cube / limits.jerk);
        }
    }

    /// The report so far.
    pub fn report(&self) -> ControllerReport {
        ControllerReport { digest: self.digest.value(), ..self.report }
    }

    /// The final report.
    pub fn finish(&self, completed: bool, fault: Fault) -> ControllerReport {
        ControllerReport { is_final: 1, completed: u32::from(completed), fault, ..self.report() }
    }
}
