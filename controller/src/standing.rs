//! What it takes to stand: the torque that gravity asks of the motors, and when axes that are being
//! enabled count as standing.

use core::fmt;

use machine::kinematics::{Joints, Mechanism};
use machine::{Axis, Machine, MechanismVisitor};
use messages::time::CYCLE_TIME;
use messages::{AxisArray, MAX_AXES};

/// Encoder counts that an axis at rest may be off, or move in a cycle.
pub const STANDING_COUNTS: f64 = 1.5;

/// Cycles after a brake has had its time in which it may still open: the power comes a cycle after it is
/// asked for, and brakes are no clocks.
const RELEASE_MARGIN: u32 = 2;

/// The machine at rest, as its file says it is.
pub struct Standing {
    axes: usize,
    gravity: Box<dyn Gravity>,
    /// What gravity took where it was asked for last [N·m].
    torque: AxisArray,
    /// What friction, brakes and teeth hold without power [N·m].
    unpowered: AxisArray,
    /// What moves the tool by the path's tolerance, some counts at least, and those counts [rad].
    tolerance: AxisArray,
    counts: AxisArray,
    release: u32,
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

impl Standing {
    /// Of this machine.
    pub fn new(machine: &Machine) -> Self {
        let (gravity, lever) = machine.mechanism.visit(AtHome(machine));
        let [mut tolerance, mut counts, mut unpowered] = [[0.0; MAX_AXES]; 3];
        for (index, axis) in machine.axes.iter().enumerate().take(MAX_AXES) {
            // Of an axis that moves no tool there the following error is left.
            let path = machine.path.tolerance / lever[index].max(f64::MIN_POSITIVE);
            let joint = path.min(axis.limits.following_error);
            counts[index] = STANDING_COUNTS * axis.encoder.resolution();
            tolerance[index] = counts[index].max(joint / axis.ratio);
            let teeth = axis.motor.stepper().map_or(0.0, |motor| motor.detent_torque);
            unpowered[index] = axis.friction.coulomb + axis.brake.torque + teeth;
        }
        let mut standing = Self {
            axes: machine.axes.len().min(MAX_AXES),
            gravity,
            torque: [0.0; MAX_AXES],
            unpowered,
            tolerance,
            counts,
            release: release(&machine.axes),
        };
        let home = machine.axes.iter().zip(&machine.home_joints);
        let mut angle = [0.0; MAX_AXES];
        angle.iter_mut().zip(home).for_each(|(angle, (axis, joint))| *angle = joint / axis.ratio);
        standing.torque(&angle);
        standing
    }

    /// Torques that hold the motors at `angle` [rad] against gravity [N·m]. Where the mechanism cannot
    /// be, those of the place before.
    pub fn torque(&mut self, angle: &AxisArray) -> &AxisArray {
        if let Some(torque) = self.gravity.torque(angle) {
            self.torque = torque;
        }
        &self.torque
    }

    /// The motor that is furthest from `place` [rad] in what it may be away, if it is further than that.
    ///
    /// That is what moves the tool by the path's tolerance, but some counts at least; and those alone for
    /// a motor that is not `held` and that nothing else holds against its weight.
    pub fn strayed(&self, place: &AxisArray, angle: &AxisArray, held: bool) -> Option<Strayed> {
        let of = |index: usize| {
            let sinks = !held && self.torque[index].abs() > self.unpowered[index];
            let limit = if sinks { self.counts[index] } else { self.tolerance[index] };
            Strayed { index, distance: (angle[index] - place[index]).abs(), limit }
        };
        let share = |strayed: &Strayed| strayed.distance / strayed.limit;
        (0..self.axes)
            .map(of)
            .filter(|strayed| share(strayed) > 1.0)
            .max_by(|one, other| share(one).total_cmp(&share(other)))
    }

    /// Cycles after the power for which a brake may hold; 0 of a machine without.
    pub fn release(&self) -> u32 {
        self.release
    }
}

impl fmt::Debug for Standing {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_struct("Standing").field("torque", &self.torque).finish_non_exhaustive()
    }
}

/// Cycles that the slowest brake of `axes` takes.
fn release(axes: &[Axis]) -> u32 {
    let brakes = axes.iter().map(|axis| &axis.brake).filter(|brake| brake.torque > 0.0);
    let slowest = brakes.map(|brake| brake.release).reduce(f64::max);
    slowest.map_or(0, |release| (release / CYCLE_TIME).ceil() as u32 + RELEASE_MARGIN)
}

/// A mechanism of any kind, asked for its weight.
trait Gravity: Send {
    /// Torques that hold motors at `angle` [rad]; `None` where the mechanism cannot be.
    fn torque(&self, angle: &AxisArray) -> Option<AxisArray>;
}

struct Weight<const N: usize, M: Mechanism<N>> {
    mechanism: M,
    ratio: [f64; N],
}

impl<const N: usize, M: Mechanism<N>> Gravity for Weight<N, M> {
    fn torque(&self, angle: &AxisArray) -> Option<AxisArray> {
        // What springs have the motors ahead moves no weight to speak of.
        let joints = Joints::from_fn(|row, _| self.ratio[row] * angle[row]);
        let chain = self.mechanism.solve(&joints, self.mechanism.branch(), None).ok()?;
        let effort = self.mechanism.gravity(&chain);
        let mut torque = [0.0; MAX_AXES];
        for (row, torque) in torque.iter_mut().enumerate().take(N) {
            *torque = self.ratio[row] * effort[row];
        }
        torque.iter().all(|torque| torque.is_finite()).then_some(torque)
    }
}

/// Gives the weight of the machine's mechanism, and the way of the tool per joint unit at home
/// [m/m or m/rad].
struct AtHome<'a>(&'a Machine);

impl MechanismVisitor for AtHome<'_> {
    type Output = (Box<dyn Gravity>, AxisArray);

    fn visit<const N: usize, M: Mechanism<N>>(self, mechanism: M) -> Self::Output {
        let Self(machine) = self;
        let joint = |row: usize| machine.home_joints.get(row).copied().unwrap_or(f64::NAN);
        let home = Joints::<N>::from_fn(|row, _| joint(row));
        let mut lever = [0.0; MAX_AXES];
        if let Ok(chain) = mechanism.solve(&home, mechanism.branch(), None) {
            let jacobian = mechanism.jacobian(&chain);
            for (row, lever) in lever.iter_mut().enumerate().take(N) {
                *lever = jacobian.fixed_view::<3, 1>(0, row).norm();
            }
        }
        let ratio = core::array::from_fn(|row| machine.axes.get(row).map_or(1.0, |it| it.ratio));
        (Box::new(Weight { mechanism, ratio }), lever)
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

    #[test]
    fn a_slide_bears_its_weight_and_turning_joints_nothing() {
        let machine = machine("serial.toml");
        let mut standing = Standing::new(&machine);
        // 0.5 kg on a screw of 10 mm/rev.
        let weight = 0.5 * 9.80665 * 10e-3 / core::f64::consts::TAU;
        for angle in [[0.0; MAX_AXES], [1.0, 40.0, -30.0, 0.0, 0.0, 0.0, 0.0, 0.0]] {
            let torque = standing.torque(&angle);
            assert!(torque[0].abs() + torque[1].abs() < 1e-12, "{torque:?}");
            assert!((torque[2] - weight).abs() < 1e-4 * weight, "{torque:?} not {weight}");
        }
        assert_eq!(standing.release(), 22, "20 ms");
        // 5 µm of the tool, on a screw of 10 mm/rev.
        let tolerance = 5e-6 / (10e-3 / core::f64::consts::TAU);
        let strayed = |distance: f64, held| {
            let angle = [0.0, 0.0, distance, 0.0, 0.0, 0.0, 0.0, 0.0];
            standing.strayed(&[0.0; MAX_AXES], &angle, held)
        };
        assert_eq!(strayed(0.99 * tolerance, true), None);
        assert_eq!(strayed(0.99 * tolerance, false), None, "its brake holds it");
        let beyond = strayed(-1.01 * tolerance, true).unwrap();
        assert_eq!(beyond.index, 2);
        assert!((beyond.distance - 1.01 * tolerance).abs() < 1e-12);
        assert!((beyond.limit - tolerance).abs() < 1e-12);
    }

    #[test]
    fn an_axis_that_nothing_holds_may_move_by_no_more_than_counts() {
        let mut machine = machine("serial.toml");
        machine.axes[2].brake.torque = 0.0;
        let standing = Standing::new(&machine);
        let two_counts = 2.0 * machine.axes[2].encoder.resolution();
        let angle = [0.0, 0.0, -two_counts, 0.0, 0.0, 0.0, 0.0, 0.0];
        let strayed = |held| standing.strayed(&[0.0; MAX_AXES], &angle, held);
        assert_eq!(strayed(true), None);
        assert_eq!(strayed(false).unwrap().index, 2);
    }

    #[test]
    fn what_cannot_be_keeps_the_torque_before() {
        let mut standing = Standing::new(&machine("tri_planar.toml"));
        let before = *standing.torque(&[f64::NAN; MAX_AXES]);
        assert!(before.iter().all(|torque| torque.is_finite()));
        assert!(before.iter().any(|torque| *torque != 0.0), "{before:?}");
    }

    #[test]
    fn a_machine_in_the_plane_bears_no_weight_and_waits_for_no_brake() {
        let mut standing = Standing::new(&Machine::builtin());
        assert_eq!(*standing.torque(&[3.0; MAX_AXES]), [0.0; MAX_AXES]);
        assert_eq!(standing.release(), 0);
    }
}
