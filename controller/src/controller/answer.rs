//! What the controller says: the command that answers a feedback, and the progress.

use super::Controller;
use crate::cascade::{Drive, Measurement, Reference};
use crate::exchange::Inputs;
use crate::outputs::JobOutputs;
use crate::state::State;
use crate::supervision::Finding;
use machine::ActuatorMode;
use messages::{
    Command, Fault, FaultCode, FaultQuantity, Feedback, Given, LaserCycle, MAX_AXES, MAX_EDGES,
    Nanoseconds, Progress,
};

/// Time between two progress samples.
pub(super) const PROGRESS_INTERVAL: Nanoseconds = Nanoseconds(5_000_000);

impl Controller {
    /// Writes the command.
    pub(super) fn command(&mut self, now: Nanoseconds, inputs: &Inputs<'_>, command: &mut Command) {
        let feedback = inputs.feedback;
        // First: light that cannot be told is a fault, which the rest of the command carries.
        let laser = self.light(now);
        *command = Command {
            epoch: feedback.epoch,
            cycle: feedback.cycle,
            reset: self.reset_ticket,
            stream: self.playing,
            stroke: u64::from(stroke(&laser)),
            received: inputs.received,
            published: now,
            mode: self.state.mode() as u32,
            state: self.state.to_wire() as u32,
            stream_time: self.player.now().time.seconds(),
            rate: self.player.now().rate,
            tool: self.feedforward.now().tool,
            homing: u64::from(self.asks()),
            laser,
            fault: self.fault,
            number: self.cycles,
            given: given(inputs),
            ..Command::default()
        };
        if self.playing != 0 {
            let lookahead = self.intake.lookahead();
            let sequence = self.player.after().time.sequence();
            command.setpoint_published = lookahead.setpoint(sequence).published;
        }
        self.close_loops(feedback, command);
        self.reference.command(command);
    }

    /// Switches the outputs of the cycle in which the command acts. What a job has switched on goes off with a fault,
    /// and while a door is open.
    pub(super) fn switch_outputs(&mut self) -> u64 {
        let is_played = matches!(self.state, State::Running | State::Holding(_) | State::Stopping);
        let job = match self.playing {
            0 => JobOutputs::None,
            _ if !is_played || self.safety.is_open() => JobOutputs::Held,
            _ => {
                let at = self.player.outputs_at().sequence();
                JobOutputs::On(self.intake.lookahead().setpoint(at).outputs)
            }
        };
        self.switching.cycle(job, self.state.to_wire(), self.state.mode())
    }

    /// What the laser shall do in the cycle in which the command acts.
    fn light(&mut self, now: Nanoseconds) -> LaserCycle {
        if self.safety.is_dark() {
            return LaserCycle::OFF;
        }
        if self.state == State::Pulsing {
            return self.pulse.cycle(self.machine.realtime.period.time());
        }
        if self.playing == 0 {
            return LaserCycle::OFF;
        }
        let Ok(laser) = self.light.due() else {
            let limit = MAX_EDGES as f64;
            let fault = Fault::new(FaultCode::SetpointLimit);
            let fault = fault.beyond(FaultQuantity::Edges, limit + 1.0, limit);
            self.fail(Finding::sound(fault), now);
            return LaserCycle::OFF;
        };
        // The player is dark unless it plays; a fault found after it went on makes it dark too.
        match self.state {
            State::Running | State::Holding(_) => laser,
            _ => LaserCycle::OFF,
        }
    }

    /// Writes the targets of all actuators, and the voltages of those whose loops are closed here.
    fn close_loops(&mut self, feedback: &Feedback, command: &mut Command) {
        let follows = self.state.follows();
        let drives = self.machine.actuators.iter().zip(&mut self.cascades).enumerate();
        for (index, (actuator, cascade)) in drives {
            let reference = self.feedforward.reference(index, actuator);
            let target = self.feedforward.target(index, actuator);
            let measured = Measurement {
                position: feedback.position[index],
                velocity: feedback.velocity[index],
                current: feedback.current[index],
            };
            let error = reference.position - measured.position;
            command.reference[index] = reference.position;
            command.position[index] = target.position;
            command.velocity[index] = target.velocity;
            command.effort[index] = target.effort;
            if !follows {
                // What holds the weight, in the cycle in which the power comes.
                if let (State::Enabling { .. }, Some(motor)) = (self.state, actuator.motor.dc()) {
                    let most = motor.voltage;
                    command.voltage[index] = reference.voltage.clamp(-most, most);
                }
                continue;
            }
            command.following_error[index] = error;
            // Its drive looks for its reference by itself: no loop is closed around that.
            if self.away >> index & 1 != 0 {
                continue;
            }
            let Some(cascade) = cascade else { continue };
            // In the time in which the position loop answers, a motor that creeps moves less than
            // a count. Friction holds it, but for a slip of a count now and then: what is within
            // two, the integral would only wind itself up with until the axis leaves. At rest, or
            // where no friction holds it, it is drawn to within one.
            let count = actuator.encoder.resolution();
            let fastest = self.feedforward.fastest(index);
            let slips = fastest > 0.0 && actuator.friction.coulomb > 0.0;
            let band = if slips { 2.0 * count } else { count };
            let creeps = fastest <= count * actuator.gains.position;
            let held_by_friction = creeps && error.abs() <= band;
            let constant = actuator.motor.dc().map_or(1.0, |motor| motor.torque_constant);
            cascade.heed_friction(fastest == 0.0, actuator.friction.coulomb / constant);
            let planned = Reference { current: target.effort / constant, ..reference };
            let drive = match actuator.mode {
                ActuatorMode::Voltage => cascade.step(&reference, &measured, !held_by_friction),
                ActuatorMode::Torque => {
                    let prediction = &mut self.predictions[index];
                    let slower = reference.velocity - measured.velocity;
                    let off = prediction.error(error, slower);
                    let [current, correction] = cascade.outer(&planned, off, !held_by_friction);
                    prediction.send(correction * constant);
                    command.effort[index] = current * constant;
                    Drive { current, voltage: 0.0 }
                }
                ActuatorMode::Velocity => {
                    command.velocity[index] = cascade.speed(target.velocity, error);
                    Drive { current: planned.current, voltage: 0.0 }
                }
                ActuatorMode::Position => Drive { current: planned.current, voltage: 0.0 },
            };
            command.voltage[index] = drive.voltage;
            if self.playing != 0 {
                self.statistics.drive(index, &drive);
            }
        }
    }

    /// How far the stream has come, and whether light was measured.
    pub(super) fn progress(&self, now: Nanoseconds, command: &Command, lit: bool) -> Progress {
        let lookahead = self.intake.lookahead();
        let playing = (self.playing != 0).then(|| self.player.now());
        let setpoint = playing.map(|playing| lookahead.setpoint(playing.time.sequence()));
        let speed = setpoint.map_or(0.0, |setpoint| setpoint.path_velocity * command.rate);
        let edges = command.laser.edges().iter().map(|edge| (edge.gate, edge.power));
        let lights = core::iter::once((command.laser.gate, command.laser.power)).chain(edges);
        let power = lights.filter(|(gate, _)| *gate != 0).map(|(_, power)| power);
        let mut position = [0.0; MAX_AXES];
        let angles = self.feedforward.now().angle;
        for (actuator, angle) in self.machine.actuators.iter().zip(&angles) {
            if let Some(position) = position.get_mut(actuator.axis) {
                *position += actuator.share * (angle * actuator.ratio);
            }
        }
        Progress {
            published: now,
            stream: lookahead.stream(),
            accepted: lookahead.accepted(),
            played: lookahead.played(),
            room: lookahead.room() as u64,
            stroke: command.stroke,
            line: setpoint.map_or(0, |setpoint| setpoint.line),
            finished_stream: self.intake.finished(),
            rate: command.rate,
            override_rate: self.player.asked_rate(),
            power_override: self.player.power_override(),
            rapid_override: self.player.asked_rapids(),
            tool: command.tool,
            speed,
            power: power.fold(0.0, f64::max),
            position,
            inputs: self.safety.inputs(),
            outputs: self.switching.on(),
            homed: self.reference.homed(),
            probed_axis: self.probing.found_axis(),
            probed: self.probing.found(),
            requests: self.requests,
            motion_end: self.motion_end as u32,
            state: command.state,
            completed: u32::from(self.completed),
            hold_cause: self.state.hold_cause() as u32,
            lit: u32::from(lit),
            fault: self.fault,
        }
    }
}

/// What the command is made of, beside the feedback and the setpoints.
fn given(inputs: &Inputs<'_>) -> Given {
    let Inputs { setpoints, request, peers, slow, .. } = inputs;
    Given {
        newest: setpoints.last().map_or(Nanoseconds(0), |setpoint| setpoint.published),
        setpoints: setpoints.len() as u32,
        lost: peers.lost(),
        slow: *slow,
        request: request.unwrap_or_default(),
    }
}

/// The first stroke that is marked in the cycle, 0 for none.
fn stroke(laser: &LaserCycle) -> u32 {
    let edges = laser.edges().iter().map(|edge| edge.gate);
    core::iter::once(laser.gate).chain(edges).find(|gate| *gate != 0).unwrap_or(0)
}
