//! What it takes to stand: the torque that gravity asks of the motors, and when axes that are being
//! enabled count as standing.

use core::fmt;

use crate::planned::Planned;
use machine::kinematics::{Joints, Mechanism};
use machine::{Actuator, Machine, MechanismVisitor};
use messages::time::Period;
use messages::{ActuatorArray, MAX_ACTUATORS, Nanoseconds};

/// Encoder counts that an axis at rest may be off, or move in a millisecond.
pub const STANDING_COUNTS: f64 = 1.5;

/// Cycles after a brake has had its time in which it may still open: the power comes a cycle after it is
/// asked for, and brakes are no clocks.
const RELEASE_MARGIN: u64 = 2;

/// Time until a place at which the mechanism cannot be is tried again: it takes long to find that out.
const RETRY: Nanoseconds = Nanoseconds(100_000_000);

/// The machine at rest, as its file says it is.
pub struct Standing {
    actuators: usize,
    weight: Box<dyn Weight>,
    /// What the weight took where it was asked for last [N·m].
    torque: ActuatorArray,
    /// Way of the tool per radian of each motor there [m/rad].
    lever: ActuatorArray,
    /// The same at home.
    lever_at_home: ActuatorArray,
    /// What friction, brakes and teeth hold without power [N·m].
    unpowered: ActuatorArray,
    /// How far the tool may be away [m].
    tolerance: f64,
    /// How far a motor may be away that moves no tool, and the least that any may [rad].
    most: ActuatorArray,
    counts: ActuatorArray,
    /// Cycles in which the mechanism is not asked.
    pause: u64,
    retry: u64,
    release: u64,
}

/// A motor that is not in its place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strayed {
    /// Its index.
    pub index: usize,
    /// How far away it is [rad].
    pub distance: f64,
    /// How far away it may be [rad].
    pub limit: f64,
}

impl Strayed {
    fn share(&self) -> f64 {
        self.distance / self.limit
    }
}

impl Standing {
    /// Of this machine.
    pub fn new(machine: &Machine) -> Self {
        let period = machine.realtime.period;
        let [mut most, mut counts, mut unpowered] = [[0.0; MAX_ACTUATORS]; 3];
        for (index, (actuator, axis)) in machine.drives().enumerate().take(MAX_ACTUATORS) {
            most[index] = axis.limits.following_error / actuator.ratio.abs();
            counts[index] = STANDING_COUNTS * actuator.encoder.resolution();
            let teeth = actuator.motor.stepper().map_or(0.0, |motor| motor.detent_torque);
            unpowered[index] = actuator.friction.coulomb + actuator.brake.torque + teeth;
        }
        let mut standing = Self {
            actuators: machine.actuators.len().min(MAX_ACTUATORS),
            weight: machine.mechanism.visit(OfMechanism(machine)),
            torque: [0.0; MAX_ACTUATORS],
            lever: [0.0; MAX_ACTUATORS],
            lever_at_home: [0.0; MAX_ACTUATORS],
            unpowered,
            tolerance: machine.path.tolerance,
            most,
            counts,
            pause: 0,
            retry: period.cycles_for(RETRY),
            release: release(&machine.actuators, period),
        };
        let mut angle = [0.0; MAX_ACTUATORS];
        for (angle, actuator) in angle.iter_mut().zip(&machine.actuators) {
            let joint = machine.home_joints.get(actuator.axis).copied().unwrap_or_default();
            *angle = joint / actuator.ratio;
        }
        standing.torque(&angle);
        standing.lever_at_home = standing.lever;
        standing
    }

    /// Torques that hold the motors at `angle` [rad] against gravity [N·m]. Where the mechanism cannot
    /// be, those of the place before.
    pub fn torque(&mut self, angle: &ActuatorArray) -> &ActuatorArray {
        self.pause = self.pause.saturating_sub(1);
        if self.pause == 0 {
            match self.weight.at(angle) {
                Some(AtRest { torque, lever, .. }) => {
                    (self.torque, self.lever) = (torque, lever);
                }
                None => self.pause = self.retry,
            }
        }
        &self.torque
    }

    /// Gives `planned` the torque that its place takes, and where its tool is; whether the mechanism can be there.
    pub fn bear(&mut self, planned: &mut Planned) -> bool {
        let Some(AtRest { torque, lever, tool }) = self.weight.at(&planned.angle) else {
            planned.torque = self.torque;
            return false;
        };
        (self.torque, self.lever, planned.torque, planned.tool) = (torque, lever, torque, tool);
        true
    }

    /// The motor that has sunk furthest from `place` [rad], by more than some counts, of those that nothing
    /// holds against their weight without power.
    pub fn sunk(&self, place: &ActuatorArray, angle: &ActuatorArray) -> Option<Strayed> {
        let sinks = |index: &usize| self.torque[*index].abs() > self.unpowered[*index];
        let of = |index: usize| self.strayed_by(index, place, angle, self.counts[index]);
        worst((0..self.actuators).filter(sinks).map(of))
    }

    /// The motor that is furthest from `place` [rad] in what it may be away, if it is further than that:
    /// what moves the tool by the path's tolerance, here or at home, but some counts at least.
    pub fn strayed(&self, place: &ActuatorArray, angle: &ActuatorArray) -> Option<Strayed> {
        let of = |index: usize| {
            // Of an axis that moves no tool the following error is left.
            let lever = self.lever[index].max(self.lever_at_home[index]);
            let most = (self.tolerance / lever.max(f64::MIN_POSITIVE)).min(self.most[index]);
            self.strayed_by(index, place, angle, most.max(self.counts[index]))
        };
        worst((0..self.actuators).map(of))
    }

    fn strayed_by(
        &self,
        index: usize,
        place: &ActuatorArray,
        angle: &ActuatorArray,
        limit: f64,
    ) -> Strayed {
        Strayed { index, distance: (angle[index] - place[index]).abs(), limit }
    }

    /// Cycles after the power for which a brake may hold; 0 of a machine without.
    pub fn release(&self) -> u64 {
        self.release
    }
}

/// The one furthest beyond its limit.
fn worst(strayed: impl Iterator<Item = Strayed>) -> Option<Strayed> {
    strayed
        .filter(|strayed| strayed.share() > 1.0)
        .max_by(|one, other| one.share().total_cmp(&other.share()))
}

impl fmt::Debug for Standing {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Standing").field("torque", &self.torque).finish_non_exhaustive()
    }
}

/// Cycles that the slowest brake of `actuators` takes.
fn release(actuators: &[Actuator], period: Period) -> u64 {
    let brakes =
        actuators.iter().map(|actuator| &actuator.brake).filter(|brake| brake.torque > 0.0);
    let slowest = brakes.map(|brake| brake.release).reduce(f64::max);
    // None is no time at all, and lasts for no cycle.
    let cycles = |release: f64| match Nanoseconds::from_seconds(release) {
        Nanoseconds(0) => 0,
        time => period.cycles_for(time),
    };
    slowest.map_or(0, |release| cycles(release) + RELEASE_MARGIN)
}

/// A mechanism of any kind, asked for its weight.
trait Weight: Send {
    /// What motors at `angle` [rad] bear; `None` where the mechanism cannot be.
    fn at(&mut self, angle: &ActuatorArray) -> Option<AtRest>;
}

/// The mechanism at rest in one place.
struct AtRest {
    /// Torques that hold the motors [N·m].
    torque: ActuatorArray,
    /// Way of the tool per radian of each [m/rad].
    lever: ActuatorArray,
    /// Where the tool is, machine frame [m].
    tool: [f64; 3],
}

struct Of<const N: usize, M: Mechanism<N>> {
    mechanism: M,
    actuators: Vec<Actuator>,
    /// Where it was last: it goes on from there.
    near: Option<M::ChainState>,
}

impl<const N: usize, M: Mechanism<N>> Weight for Of<N, M> {
    fn at(&mut self, angle: &ActuatorArray) -> Option<AtRest> {
        // What springs have the motors ahead moves no weight to speak of.
        let mut joints = Joints::<N>::zeros();
        for (actuator, angle) in self.actuators.iter().zip(angle) {
            joints[actuator.axis] += actuator.share * (actuator.ratio * angle);
        }
        let chain = self.mechanism.solve(&joints, self.mechanism.branch(), self.near.as_ref());
        let chain = chain.ok()?;
        let (effort, jacobian) = (self.mechanism.gravity(&chain), self.mechanism.jacobian(&chain));
        let [mut torque, mut lever] = [[0.0; MAX_ACTUATORS]; 2];
        for (row, actuator) in self.actuators.iter().enumerate() {
            let Actuator { axis, ratio, share, .. } = *actuator;
            torque[row] = ratio * (share * effort[axis]);
            // Of several on an axis each counts as if it moved the joint alone.
            lever[row] = ratio.abs() * jacobian.fixed_view::<3, 1>(0, axis).norm();
        }
        let is_known = torque.iter().chain(&lever).all(|value| value.is_finite());
        is_known.then(|| {
            let tool = self.mechanism.pose(&chain).position.into();
            self.near = Some(chain);
            AtRest { torque, lever, tool }
        })
    }
}

/// Gives the weight of the machine's mechanism.
struct OfMechanism<'a>(&'a Machine);

impl MechanismVisitor for OfMechanism<'_> {
    type Output = Box<dyn Weight>;

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let own = |actuator: &&Actuator| actuator.axis < N;
        let actuators = self.0.actuators.iter().take(MAX_ACTUATORS).filter(own).cloned().collect();
        Box::new(Of { mechanism, actuators, near: None })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn machine(name: &str) -> Machine {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../machines");
        Machine::load(&folder.join(name), &[]).unwrap()
    }

    fn array(values: &[f64]) -> ActuatorArray {
        core::array::from_fn(|index| values.get(index).copied().unwrap_or_default())
    }

    #[test]
    fn a_slide_bears_its_weight_and_turning_joints_nothing() {
        let machine = machine("serial.toml");
        let mut standing = Standing::new(&machine);
        // 0.5 kg on a screw of 10 mm/rev.
        let weight = 0.5 * 9.80665 * 10e-3 / core::f64::consts::TAU;
        for angle in [[0.0; MAX_ACTUATORS], array(&[1.0, 40.0, -30.0])] {
            let torque = standing.torque(&angle);
            assert!(torque[0].abs() + torque[1].abs() < 1e-12, "{torque:?}");
            assert!((torque[2] - weight).abs() < 1e-4 * weight, "{torque:?} not {weight}");
        }
        assert_eq!(standing.release(), 22, "20 ms");
        // 5 µm of the tool, on a screw of 10 mm/rev.
        let tolerance = 5e-6 / (10e-3 / core::f64::consts::TAU);
        let angle = |distance: f64| array(&[0.0, 0.0, distance]);
        let strayed = |distance: f64| standing.strayed(&[0.0; MAX_ACTUATORS], &angle(distance));
        assert_eq!(strayed(0.99 * tolerance), None);
        let beyond = strayed(-1.01 * tolerance).unwrap();
        assert_eq!(standing.sunk(&[0.0; MAX_ACTUATORS], &angle(1.0)), None, "its brake holds it");
        assert_eq!(beyond.index, 2);
        assert!((beyond.distance - 1.01 * tolerance).abs() < 1e-12);
        assert!((beyond.limit - tolerance).abs() < 1e-12);
    }

    #[test]
    fn an_axis_that_nothing_holds_may_move_by_no_more_than_counts() {
        let mut machine = machine("serial.toml");
        machine.actuators[2].brake.torque = 0.0;
        let standing = Standing::new(&machine);
        let two_counts = 2.0 * machine.actuators[2].encoder.resolution();
        let angle = array(&[0.0, 0.0, -two_counts]);
        assert_eq!(standing.strayed(&[0.0; MAX_ACTUATORS], &angle), None);
        assert_eq!(standing.sunk(&[0.0; MAX_ACTUATORS], &angle).unwrap().index, 2);
    }

    #[test]
    fn what_cannot_be_keeps_the_torque_before() {
        let mut standing = Standing::new(&machine("tri_planar.toml"));
        let before = *standing.torque(&[f64::NAN; MAX_ACTUATORS]);
        assert!(before.iter().all(|torque| torque.is_finite()));
        assert!(before.iter().any(|torque| *torque != 0.0), "{before:?}");
    }

    #[test]
    fn a_machine_in_the_plane_bears_no_weight_and_waits_for_no_brake() {
        let mut standing = Standing::new(&Machine::builtin());
        assert_eq!(*standing.torque(&[3.0; MAX_ACTUATORS]), [0.0; MAX_ACTUATORS]);
        assert_eq!(standing.release(), 0);
    }
}
