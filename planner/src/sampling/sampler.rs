//! The setpoint of every cycle: the tool's motion, the joints', the motors' lead and torque, the
//! laser.
//!
//! The trajectory is looked at four times a cycle, for the lead. The effort of a sample is the mean
//! over the cycle centred on it: the motor's torque steps with the jerk, up to a tenth of its
//! peak, and a value at one instant would lose or double up to half a cycle of such a step.

use std::sync::Arc;

use machine::kinematics::{JointMotion, Joints, KinematicsError, Pose, ToolMotion};
use machine::{Actuator, Axis, Friction, Mechanism, StepperMotor};
use messages::time::SETPOINT_TIME;
use messages::{AxisArray, GateEdge, Setpoint, setpoint::flags};

use crate::geometry::attitude::AttitudeLaw;
use crate::joint_space::configuration::{branches, follow, keeps_margins};
use crate::joint_space::joint_move::{JointLine, JointMove, JointsAt};
use crate::sampling::backlash::BacklashCompensation;
use crate::sampling::deflection::Deflection;
use crate::trajectory::{Cursor, Errand, Motion, Piece, Reference, Trajectory};

/// Looks at the trajectory in a cycle; even, so that a sample lies on one.
const STEPS: usize = 4;

/// Time between two looks [s].
const STEP: f64 = SETPOINT_TIME / STEPS as f64;

/// A stream ends once no motor is farther than this from where it will stay [joint units].
const SETTLED: f64 = 1e-9;

/// Nanoseconds in a cycle.
const CYCLE: i64 = messages::time::SETPOINT_PERIOD.0;

/// How long a piece is kept after its end [s].
const KEPT: f64 = 10.0 * SETPOINT_TIME;

/// Setpoints of a motion that becomes known piece by piece, in order.
#[derive(Clone)]
pub(crate) struct Sampler<const N: usize, M: Mechanism<N>> {
    mechanism: M,
    /// What is known of the motion from a little before the next sample on.
    trajectory: Trajectory,
    is_complete: bool,
    drives: Arc<[Drive]>,
    stream: u64,
    sequence: u64,
    /// Index of the next look, in steps of [`STEP`] from the first sample.
    look: i64,
    cursor: Cursor,
    /// Whether the joints go straight with a tool that is not turned, so that there is nothing to choose.
    is_plain: bool,
    /// Of a mechanism whose joints do not go straight with the tool: its branches, and the number of
    /// the one that the joints are on.
    branches: Vec<M::Branch>,
    branch: usize,
    joints: Joints<N>,
    assembly: M::ChainState,
    lead: Deflection<N>,
    gaps: BacklashCompensation<N>,
    actuators: Arc<[Actuator]>,
    /// Speed of the motor side [joint units/s], and effort on the load side, at the last look.
    motor_velocity: Joints<N>,
    effort: Joints<N>,
    laser: Gate,
    is_crowded: bool,
    next_output: usize,
    outputs: u64,
    next_frequency: usize,
    /// [pulses/s].
    frequency: f64,
    next_pause: usize,
    /// How far ahead of time the source is told [cycles].
    told_ahead: f64,
    end: i64,
    state: Stream,
    /// What a setpoint is before it is made.
    blank: Setpoint,
}

/// Where the stream is.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Stream {
    Running,
    /// Samples left after the motion has settled.
    Ended,
    /// A sample could not be made.
    Broken(KinematicsError),
}

/// What the effort of an actuator is made of.
#[derive(Debug, Clone, Copy)]
struct Drive {
    axis: usize,
    ratio: f64,
    /// Share of the effort of its joint.
    share: f64,
    inertia: f64,
    friction: Friction,
    stepper: Option<StepperMotor>,
}

impl Drive {
    fn of(actuator: &Actuator) -> Self {
        Self {
            axis: actuator.axis,
            ratio: actuator.ratio,
            share: actuator.share,
            inertia: actuator.motor.rotor_inertia(),
            friction: actuator.friction,
            stepper: actuator.motor.stepper().copied(),
        }
    }

    /// Adds to the lead of this actuator, the `index`th, what a stepper's magnetic axis must be ahead of its rotor, which
    /// moves at `velocity` [joint units/s]. A DC motor's angle is its rotor's.
    ///
    /// Like the rest of the lead it is then played with the square of the rate, the part of a
    /// change of rate taken at the stiffness around zero torque.
    fn lead_rotor(&self, index: usize, velocity: f64, setpoint: &mut Setpoint) {
        let Some(stepper) = &self.stepper else { return };
        let speed = velocity / self.ratio;
        let torque = setpoint.effort[index] + self.friction.torque(speed);
        // Beyond its torque there is no load angle: the checker refuses the sample for that torque.
        let angle = stepper
            .load_angle(torque, speed)
            .unwrap_or_else(|_| stepper.largest_load_angle().copysign(torque));
        setpoint.lead[index] += self.ratio * angle;
        let standing = stepper.load_angle(setpoint.static_effort[index], 0.0);
        setpoint.static_lead[index] += self.ratio * standing.unwrap_or(0.0);
        setpoint.lead_momentum[index] +=
            self.ratio * setpoint.momentum[index] / stepper.stiffness();
    }
}

/// The laser as the samples so far left it.
#[derive(Debug, Clone, Copy, Default)]
struct Gate {
    next: usize,
    power: f64,
    stroke: u64,
}

/// Why sampling stopped.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Unreachable {
    pub(crate) time: f64,
    pub(crate) cause: KinematicsError,
}

impl<const N: usize, M: Mechanism<N>> Sampler<N, M> {
    pub(crate) fn new(
        mechanism: M,
        axes: &[Axis],
        actuators: &[Actuator],
        rest: JointMove,
        attitude: AttitudeLaw,
        stream: u64,
    ) -> Result<Self, KinematicsError> {
        let motion = joint_motion(&rest.at(0.0));
        let branch = rest.branch;
        let branches = branches(&mechanism, &motion.position);
        let assembly = mechanism.solve(&motion.position, branches[branch], None)?;
        let effort = mechanism.inverse_dynamics(&assembly, &motion.velocity, &motion.acceleration);
        let lead = Deflection::new(&mechanism, effort, STEP);
        let gaps = BacklashCompensation::new(axes, actuators, &effort, STEP);
        let is_plain =
            mechanism.is_linear() && branches.len() == 1 && attitude == AttitudeLaw::Level;
        Ok(Self {
            mechanism,
            drives: actuators.iter().map(Drive::of).collect(),
            trajectory: Trajectory { attitude, ..Trajectory::default() },
            is_complete: false,
            stream,
            sequence: 0,
            look: -(STEPS as i64) / 2,
            cursor: Cursor::default(),
            is_plain,
            branches,
            branch,
            joints: motion.position,
            assembly,
            lead,
            gaps,
            actuators: actuators.into(),
            motor_velocity: Joints::zeros(),
            effort,
            laser: Gate::default(),
            is_crowded: false,
            next_output: 0,
            outputs: 0,
            next_frequency: 0,
            frequency: 0.0,
            next_pause: 0,
            told_ahead: 0.0,
            end: 0,
            state: Stream::Running,
            blank: Setpoint::default(),
        })
    }

    /// Waits with each sample until the motion is known for `time` [s] more, since the laser source is
    /// told so long before.
    pub(crate) fn tell_ahead(&mut self, time: f64) {
        self.told_ahead = time / SETPOINT_TIME;
    }

    /// Says of each sample whether what is lit shows where a job lies.
    pub(crate) fn show_frame(&mut self, is_frame: bool) {
        self.blank.flags = if is_frame { flags::FRAME } else { 0 };
    }

    /// Goes on with `more`, which begins where the motion known so far ends; `is_last` says that nothing
    /// comes after it.
    pub(crate) fn extend(&mut self, more: &Trajectory, is_last: bool) {
        self.forget();
        self.trajectory.append(more);
        self.is_complete = is_last;
        self.end = (self.trajectory.end() / SETPOINT_TIME).ceil() as i64;
    }

    /// Lets go what was sampled.
    fn forget(&mut self) {
        let before = self.sequence as f64 * SETPOINT_TIME - KEPT;
        let past = |piece: &Piece| piece.start + piece.duration < before;
        let count = self.trajectory.pieces.iter().take_while(|piece| past(piece)).count();
        let count = count.min(self.trajectory.pieces.len().saturating_sub(1));
        self.trajectory.pieces.drain(..count);
        self.cursor.piece = self.cursor.piece.saturating_sub(count);
        self.trajectory.laser.drain(..self.laser.next);
        self.laser.next = 0;
        self.trajectory.outputs.drain(..self.next_output);
        self.next_output = 0;
        self.trajectory.frequencies.drain(..self.next_frequency);
        self.next_frequency = 0;
        self.trajectory.pauses.drain(..self.next_pause);
        self.next_pause = 0;
    }

    /// Whether the motion and the light are known as far as the next sample needs them. The source is
    /// told ahead of time, so its changes lie before the motion that they belong to.
    fn is_known(&self) -> bool {
        let ahead = self.sequence as f64 + 1.0 + self.told_ahead;
        self.is_complete || self.trajectory.end() >= ahead * SETPOINT_TIME
    }

    /// Whether the laser changes more often in the cycle of the last sample than a setpoint can say.
    pub(crate) fn is_crowded(&self) -> bool {
        self.is_crowded
    }

    /// When the next sample is [s].
    pub(crate) fn time(&self) -> f64 {
        self.sequence as f64 * SETPOINT_TIME
    }

    /// Whether nothing comes after what is known of the motion.
    pub(crate) fn is_complete(&self) -> bool {
        self.is_complete
    }

    /// Whether the last setpoint has been made.
    pub(crate) fn has_ended(&self) -> bool {
        self.state != Stream::Running
    }

    /// The piece at `time` [s].
    pub(crate) fn piece_at(&self, time: f64) -> Option<&Piece> {
        self.trajectory.piece_at(time)
    }

    /// The tool's motion at `time` [s], near the last sample, turned as its place asks; `None` where the
    /// joints lead.
    ///
    /// # Errors
    /// Where there is no attitude.
    pub(crate) fn tool_at(&self, time: f64) -> Result<Option<ToolMotion>, KinematicsError> {
        match self.trajectory.at(time, &mut self.cursor.clone()) {
            Reference::Tool(tool) => self.trajectory.attitude.apply(&tool).map(Some),
            Reference::Joints(_) => Ok(None),
        }
    }

    /// How the joints stand, in which branch, and the solved chain, half a cycle after the last sample.
    pub(crate) fn stands(&self) -> (Joints<N>, M::Branch, M::ChainState) {
        (self.joints, self.branches[self.branch], self.assembly)
    }

    /// Why it ended early, if it did.
    pub(crate) fn broken(&self) -> Option<Unreachable> {
        match self.state {
            Stream::Broken(cause) => {
                Some(Unreachable { time: self.sequence as f64 * SETPOINT_TIME, cause })
            }
            Stream::Running | Stream::Ended => None,
        }
    }

    /// Where the tool is with the joints at `joints` [m or rad], near the last sample and on its
    /// branch.
    pub(crate) fn locate(&self, joints: &Joints<N>) -> Result<Pose, KinematicsError> {
        self.mechanism.locate(joints, self.branches[self.branch], Some(&self.assembly))
    }

    /// The mechanism with the joints at `joints` [m or rad], near the last sample and on its branch.
    pub(crate) fn solve(&self, joints: &Joints<N>) -> Result<M::ChainState, KinematicsError> {
        self.mechanism.solve(joints, self.branches[self.branch], Some(&self.assembly))
    }

    /// Goes on to the next look, and puts its motion into `setpoint`. Handed back, the motion would be
    /// copied four times a sample, for a third of all the time that sampling takes.
    #[inline(always)]
    fn advance(&mut self, setpoint: Option<&mut Setpoint>) -> Result<(), KinematicsError> {
        self.look += 1;
        let reference = self.trajectory.at(self.look as f64 * STEP, &mut self.cursor);
        let motion = match &reference {
            Reference::Tool(tool) if self.is_plain => {
                self.mechanism.joint_motion(tool, self.branches[self.branch], &self.joints)?
            }
            Reference::Tool(tool) => {
                let tool = &self.trajectory.attitude.apply(tool)?;
                follow(&self.mechanism, &self.branches, tool, &mut self.branch, &self.joints)?
            }
            Reference::Joints(at) => {
                self.branch = at.branch;
                joint_motion(at)
            }
        };
        let branch = self.branches[self.branch];
        let assembly = self.mechanism.solve(&motion.position, branch, Some(&self.assembly))?;
        let effort =
            self.mechanism.inverse_dynamics(&assembly, &motion.velocity, &motion.acceleration);
        // Inertia changes slowly beside the jerk: its own rate is left out where only a spring
        // without damper asks for it.
        self.lead.advance(&effort, || self.mechanism.mass_matrix(&assembly) * motion.jerk);
        self.gaps.advance(&self.actuators, &effort, motion.velocity.amax() > 0.0);
        self.joints = motion.position;
        self.assembly = assembly;
        self.effort = effort;
        self.motor_velocity = motion.velocity + self.lead.rate() + self.gaps.speed();
        setpoint.map_or(Ok(()), |setpoint| self.put(&reference, &motion, setpoint))
    }

    /// The tool's motion while the joints lead.
    fn tool(&self, at: &JointsAt, assembly: &M::ChainState) -> Result<ToolMotion, KinematicsError> {
        let branch = self.branches[at.branch];
        let line = JointLine::<N>::of(&at.from, &at.change);
        let (tool, _) = line.tool(&self.mechanism, branch, at.share, Some(assembly))?;
        Ok(tool)
    }

    /// Puts the motion of the next cycle into `setpoint`, which is zero.
    fn take(&mut self, setpoint: &mut Setpoint) -> Result<(), KinematicsError> {
        let before = self.motor_velocity;
        let mut at_sample = before;
        let mut mean = self.effort / 2.0;
        for step in 1..=STEPS {
            let is_sample = step == STEPS / 2;
            self.advance(is_sample.then_some(&mut *setpoint))?;
            mean += self.effort * if step == STEPS { 0.5 } else { 1.0 };
            if is_sample {
                at_sample = self.motor_velocity;
            }
        }
        mean /= STEPS as f64;
        let acceleration = (self.motor_velocity - before) / SETPOINT_TIME;
        for (index, drive) in self.drives.iter().enumerate() {
            let Drive { axis, ratio, share, inertia, .. } = *drive;
            setpoint.effort[index] =
                inertia * acceleration[axis] / ratio + ratio * (share * mean[axis]);
            drive.lead_rotor(index, at_sample[axis], setpoint);
        }
        Ok(())
    }

    /// Puts the motion at the last look into `setpoint`.
    #[inline]
    fn put(
        &self,
        reference: &Reference,
        motion: &JointMotion<N>,
        setpoint: &mut Setpoint,
    ) -> Result<(), KinematicsError> {
        let assembly = &self.assembly;
        let led;
        let tool = match reference {
            Reference::Tool(tool) => tool,
            Reference::Joints(at) => {
                led = self.tool(at, assembly)?;
                &led
            }
        };
        keeps_margins(&self.mechanism, assembly)?;
        let in_gap = self.gaps.value();
        let gravity = self.mechanism.gravity(assembly);
        let impulse = self.mechanism.mass_matrix(assembly) * motion.velocity;
        setpoint.tool = tool.position.into();
        setpoint.path_velocity = tool.velocity.norm();
        setpoint.path_acceleration = tool.acceleration.norm();
        setpoint.path_jerk = tool.jerk.norm();
        let copy = |array: &mut AxisArray, joints: &Joints<N>| {
            array[..N].copy_from_slice(joints.as_slice());
        };
        copy(&mut setpoint.position, &motion.position);
        copy(&mut setpoint.velocity, &motion.velocity);
        copy(&mut setpoint.acceleration, &motion.acceleration);
        copy(&mut setpoint.jerk, &motion.jerk);
        let lead = self.lead.value() + in_gap;
        let static_lead = self.lead.settled(&gravity) + in_gap;
        let lead_momentum = self.lead.settled(&impulse);
        for (index, drive) in self.drives.iter().enumerate() {
            let Drive { axis, ratio, share, inertia, .. } = *drive;
            setpoint.lead[index] = lead[axis];
            setpoint.static_lead[index] = static_lead[axis];
            setpoint.lead_momentum[index] = lead_momentum[axis];
            setpoint.static_effort[index] = ratio * (share * gravity[axis]);
            setpoint.momentum[index] =
                inertia * motion.velocity[axis] / ratio + ratio * (share * impulse[axis]);
        }
        Ok(())
    }

    /// Puts the laser in the cycle that starts with this sample, and the stroke it lights, into
    /// `setpoint`. A change that the cycle cannot hold is left to the next one, and told.
    fn light(&mut self, setpoint: &mut Setpoint) {
        self.is_crowded = false;
        let start = self.sequence as i64 * CYCLE;
        let cycle = &mut setpoint.laser;
        cycle.gate = gate(self.laser.power, self.laser.stroke);
        cycle.power = self.laser.power;
        setpoint.stroke = self.laser.stroke;
        while let Some(change) = self.trajectory.laser.get(self.laser.next) {
            let offset = change.time.0 - start;
            if offset >= CYCLE {
                break;
            }
            let edge = GateEdge {
                offset: u32::try_from(offset).unwrap_or(0),
                gate: gate(change.power, change.stroke),
                power: change.power,
            };
            if !cycle.push(edge) {
                self.is_crowded = true;
                break;
            }
            self.laser =
                Gate { next: self.laser.next + 1, power: change.power, stroke: change.stroke };
            if change.stroke != 0 {
                setpoint.stroke = change.stroke;
            }
        }
    }

    /// Outputs, frequency and flags of the sample at `time`.
    fn switch(&mut self, setpoint: &mut Setpoint, time: f64) {
        while let Some(&(from, outputs)) = self.trajectory.outputs.get(self.next_output) {
            if from > time {
                break;
            }
            self.outputs = outputs;
            self.next_output += 1;
        }
        setpoint.outputs = self.outputs;
        while let Some(&(from, frequency)) = self.trajectory.frequencies.get(self.next_frequency) {
            if from > time {
                break;
            }
            self.frequency = frequency;
            self.next_frequency += 1;
        }
        setpoint.laser.frequency = self.frequency;
        if let Some(&pause) = self.trajectory.pauses.get(self.next_pause)
            && pause <= time
        {
            self.next_pause += 1;
            setpoint.flags |= flags::PAUSE;
            // What follows may have begun by the end of the cycle.
            setpoint.line = self.trajectory.piece_at(pause).map_or(0, |piece| piece.line);
        }
    }

    /// Whether everything has come to rest.
    fn is_settled(&self) -> bool {
        self.sequence as i64 > self.end
            && (self.lead.value() - self.lead.settled(&self.effort)).amax() <= SETTLED
            && self.gaps.left() <= SETTLED
    }
}

impl<const N: usize, M: Mechanism<N>> Sampler<N, M> {
    /// Makes the next setpoint as the last of `setpoints`. Says whether there is one.
    pub(crate) fn push_to(&mut self, setpoints: &mut Vec<Setpoint>) -> bool {
        if !self.is_due() {
            return false;
        }
        let count = setpoints.len();
        setpoints.push(self.blank);
        let is_made = self.make(&mut setpoints[count]);
        setpoints.truncate(count + usize::from(is_made));
        is_made
    }

    /// About how many setpoints can be made of the motion that is known.
    pub(crate) fn due(&self) -> usize {
        let known = (self.trajectory.end() / SETPOINT_TIME - self.told_ahead).ceil();
        (known as u64).saturating_sub(self.sequence) as usize
    }

    fn is_due(&self) -> bool {
        self.state == Stream::Running && self.is_known()
    }

    /// Makes the next setpoint in `setpoint`, which is zero. Says whether it could be made.
    fn make(&mut self, setpoint: &mut Setpoint) -> bool {
        if let Err(cause) = self.take(setpoint) {
            self.state = Stream::Broken(cause);
            return false;
        }
        setpoint.stream = self.stream;
        setpoint.sequence = self.sequence;
        if let Some(piece) = self.trajectory.pieces.get(self.cursor.piece) {
            setpoint.line = piece.line;
            let flies = match piece.motion {
                Motion::Flight(_) | Motion::Joints(_) => true,
                Motion::Path { errand, .. } => errand == Errand::Rapid,
                Motion::Rest(_) => false,
            };
            setpoint.flags |= if flies { flags::RAPID } else { 0 };
        }
        self.light(setpoint);
        self.switch(setpoint, self.sequence as f64 * SETPOINT_TIME);
        if self.is_settled() {
            setpoint.flags |= flags::LAST;
            self.state = Stream::Ended;
        }
        self.sequence += 1;
        true
    }
}

impl<const N: usize, M: Mechanism<N>> Iterator for Sampler<N, M> {
    type Item = Setpoint;

    fn next(&mut self) -> Option<Setpoint> {
        if !self.is_due() {
            return None;
        }
        let mut setpoint = self.blank;
        if self.make(&mut setpoint) { Some(setpoint) } else { None }
    }
}

/// The joints of a mechanism with `N` axes.
fn joint_motion<const N: usize>(at: &JointsAt) -> JointMotion<N> {
    let of = |array: &messages::AxisArray| Joints::from_fn(|axis, _| array[axis]);
    JointMotion {
        position: of(&at.position),
        velocity: of(&at.velocity),
        acceleration: of(&at.acceleration),
        jerk: of(&at.jerk),
    }
}

/// The gate of a sample: open for `stroke` where there is power.
fn gate(power: f64, stroke: u64) -> u32 {
    if power > 0.0 { u32::try_from(stroke).unwrap_or(u32::MAX) } else { 0 }
}
