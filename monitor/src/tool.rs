//! Where the tool is by the motors, for drives that do not see it.
//!
//! The encoders tell the motors, and the mechanism tells the tool of them. Between motors and joints lie springs,
//! which give as the plan foresees it: the tool is off its plan by what the motors are off theirs,
//! `f(θ) − f(θ_reference)`. That also leaves out where an axis had its zero before it was homed; on a mechanism
//! whose tool does not go straight with its joints the difference is then taken at another place.

use crate::recording::CycleRecord;
use machine::kinematics::Joints;
use machine::{Actuator, Machine, Mechanism, MechanismVisitor};
use messages::feedback::status;
use messages::{ActuatorArray, MAX_AXES};
use nalgebra::Vector3;

/// A mechanism that tells where its tool is, its kind forgotten.
trait Forward {
    /// The tool with the axes at `joints` [m or rad], machine frame [m]; `None` where the chain cannot close.
    fn tool(&mut self, joints: &[f64; MAX_AXES]) -> Option<Vector3<f64>>;
}

struct Chain<const N: usize, M: Mechanism<N>> {
    mechanism: M,
    /// The newest one that closed: an iterative solution starts there.
    state: Option<M::ChainState>,
}

impl<const N: usize, M: Mechanism<N>> Forward for Chain<N, M> {
    fn tool(&mut self, joints: &[f64; MAX_AXES]) -> Option<Vector3<f64>> {
        let Self { mechanism, state } = self;
        let joints = Joints::<N>::from_fn(|axis, _| joints.get(axis).copied().unwrap_or(0.0));
        let solved = mechanism.solve(&joints, mechanism.branch(), state.as_ref()).ok()?;
        let tool = mechanism.pose(&solved).position;
        *state = Some(solved);
        Some(tool)
    }
}

struct Build;

impl MechanismVisitor for Build {
    type Output = Box<dyn Forward>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        Box::new(Chain { mechanism, state: None })
    }
}

/// Finds the tool of records in which drives does not tell it.
pub struct ToolFinder {
    mechanism: Box<dyn Forward>,
    actuators: Vec<Actuator>,
    /// From the tool that the references give to the planned one, as the newest answered record has it.
    given: Option<Vector3<f64>>,
}

impl core::fmt::Debug for ToolFinder {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter.debug_struct("ToolFinder").field("given", &self.given).finish_non_exhaustive()
    }
}

impl ToolFinder {
    /// For the mechanism and the actuators of `machine`.
    pub fn new(machine: &Machine) -> Self {
        Self {
            mechanism: machine.mechanism.visit(Build),
            actuators: machine.actuators.clone(),
            given: None,
        }
    }

    /// `record` with its tool as the motors tell it; `None` where drives tells it, or nobody can: before the first
    /// answered record, and where the mechanism does not close.
    pub fn find(&mut self, record: &CycleRecord) -> Option<CycleRecord> {
        if record.feedback.has(status::TOOL_KNOWN) {
            return None;
        }
        if record.is_answered() {
            let reference = self.tool(&record.command.reference)?;
            self.given = Some(Vector3::from(record.command.tool) - reference);
        }
        let tool = self.tool(&record.feedback.position)? + self.given?;
        let mut found = *record;
        found.feedback.tool = tool.into();
        found.feedback.status |= status::TOOL_KNOWN;
        Some(found)
    }

    /// The tool with the motors at `angles` [rad], springs left out.
    fn tool(&mut self, angles: &ActuatorArray) -> Option<Vector3<f64>> {
        let mut joints = [0.0; MAX_AXES];
        for (actuator, angle) in self.actuators.iter().zip(angles) {
            if let Some(joint) = joints.get_mut(actuator.axis) {
                *joint += actuator.share * (angle * actuator.ratio);
            }
        }
        self.mechanism.tool(&joints)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use messages::{Command, Cycle, Feedback};

    /// The built-in CoreXY `off` its references [rad], with the plan at `planned` [m].
    fn record(reference: [f64; 2], off: [f64; 2], planned: [f64; 3]) -> CycleRecord {
        let mut feedback = Feedback { cycle: Cycle(7), ..Feedback::default() };
        let mut command = Command { cycle: Cycle(7), tool: planned, ..Command::default() };
        for motor in 0..2 {
            command.reference[motor] = reference[motor];
            feedback.position[motor] = reference[motor] - off[motor];
        }
        CycleRecord { feedback, command }
    }

    #[test]
    fn the_tool_is_off_its_plan_by_what_the_motors_are_off_theirs() {
        let machine = Machine::builtin();
        let ratio = machine.actuators[0].ratio;
        let mut finder = ToolFinder::new(&machine);
        // The springs have the plan 30 µm from where the belts alone would put the tool.
        let found = finder.find(&record([4.0, 1.0], [0.0, 0.0], [0.1, 0.07, 0.0])).unwrap();
        assert_eq!(found.feedback.tool, [0.1, 0.07, 0.0]);
        let error = 1e-4 / ratio;
        // x is half the sum of the belts, so both of them move it alone.
        let found = finder.find(&record([4.0, 1.0], [error, error], [0.1, 0.07, 0.0])).unwrap();
        let [x, y, _] = found.feedback.tool;
        let moved = ((x - 0.1).abs() - 1e-4).abs() + (y - 0.07).abs();
        let other = ((y - 0.07).abs() - 1e-4).abs() + (x - 0.1).abs();
        assert!(moved.min(other) < 1e-12, "{:?}", found.feedback.tool);
        assert!(found.feedback.has(status::TOOL_KNOWN));
    }

    #[test]
    fn a_cycle_without_an_answer_goes_by_the_newest_one() {
        let machine = Machine::builtin();
        let mut finder = ToolFinder::new(&machine);
        let answered = record([4.0, 1.0], [0.0, 0.0], [0.1, 0.07, 0.0]);
        let alone = CycleRecord::unanswered(answered.feedback);
        assert_eq!(finder.find(&alone), None);
        assert!(finder.find(&answered).is_some());
        assert_eq!(finder.find(&alone).unwrap().feedback.tool, [0.1, 0.07, 0.0]);
    }

    #[test]
    fn what_drives_tells_is_left_alone() {
        let mut told = record([4.0, 1.0], [0.1, 0.0], [0.1, 0.07, 0.0]);
        told.feedback.status = status::TOOL_KNOWN;
        assert_eq!(ToolFinder::new(&Machine::builtin()).find(&told), None);
    }
}
