//! A drawing on paper as setpoints: what the joints would do if they followed it, with transmissions that
//! do not bend.

use machine::kinematics::{Joints, KinematicsError};
use machine::{Actuator, Machine, Mechanism, MechanismVisitor};
use messages::Setpoint;
use messages::setpoint::flags;
use messages::time::SETPOINT_TIME;

use super::Paper;
use crate::error::{Place, PlanError};
use crate::joint_space::configuration::{branches, follow};

/// Setpoints, or why the next one is none.
type Samples<'a> = Box<dyn Iterator<Item = Result<Setpoint, PlanError>> + 'a>;

impl Paper {
    /// Its setpoints on `machine`, one a millisecond from the start on and one at the end, numbered
    /// `stream`. The motors' lead is 0, their effort that of load and rotor, and the laser is on or off
    /// through a whole cycle.
    ///
    /// # Errors
    /// The first place that the tool cannot be at.
    pub fn setpoints<'a>(
        &'a self,
        machine: &'a Machine,
        stream: u64,
    ) -> Result<Box<dyn Iterator<Item = Setpoint> + 'a>, PlanError> {
        let samples = || machine.mechanism.visit(Sampling { paper: self, machine, stream });
        samples().try_for_each(|sample| sample.map(|_| ()))?;
        Ok(Box::new(samples().map_while(Result::ok)))
    }

    /// How many milliseconds it takes, the last one perhaps in part.
    fn cycles(&self) -> u64 {
        (self.facts.time / SETPOINT_TIME).ceil() as u64
    }
}

struct Sampling<'a> {
    paper: &'a Paper,
    machine: &'a Machine,
    stream: u64,
}

impl<'a> MechanismVisitor for Sampling<'a> {
    type Output = Samples<'a>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let Self { paper, machine, stream } = self;
        let home = Joints::<N>::from_fn(|axis, _| machine.home_joints[axis]);
        let branches = branches(&mechanism, &home);
        let (mut branch, mut joints, mut near) = (0, home, None);
        let last = paper.cycles();
        Box::new((0..=last).map(move |sequence| {
            let time = (sequence as f64 * SETPOINT_TIME).min(paper.facts.time);
            let (tool, stroke, is_lit) = paper.at(time);
            let unreachable = |cause: KinematicsError| PlanError::Unreachable {
                line: 0,
                place: Place { stroke, time },
                cause,
            };
            let motion =
                follow(&mechanism, &branches, &tool, &mut branch, &joints).map_err(unreachable)?;
            let chain = mechanism
                .solve(&motion.position, branches[branch], near.as_ref())
                .map_err(unreachable)?;
            let effort = mechanism.inverse_dynamics(&chain, &motion.velocity, &motion.acceleration);
            (joints, near) = (motion.position, Some(chain));
            let mut setpoint = Setpoint { stream, sequence, stroke, ..Setpoint::default() };
            setpoint.tool = tool.position.into();
            setpoint.path_velocity = tool.velocity.norm();
            setpoint.path_acceleration = tool.acceleration.norm();
            setpoint.path_jerk = tool.jerk.norm();
            for axis in 0..N {
                setpoint.position[axis] = motion.position[axis];
                setpoint.velocity[axis] = motion.velocity[axis];
                setpoint.acceleration[axis] = motion.acceleration[axis];
                setpoint.jerk[axis] = motion.jerk[axis];
            }
            for (number, of) in machine.actuators.iter().enumerate() {
                let Actuator { axis, ratio, share, .. } = *of;
                setpoint.effort[number] = ratio * (share * effort[axis])
                    + of.motor.rotor_inertia() * motion.acceleration[axis] / ratio;
            }
            setpoint.laser.gate =
                if is_lit { u32::try_from(stroke.max(1)).unwrap_or(u32::MAX) } else { 0 };
            setpoint.laser.power = if is_lit { 1.0 } else { 0.0 };
            if sequence == last {
                setpoint.flags |= flags::LAST;
            }
            Ok(setpoint)
        }))
    }
}
