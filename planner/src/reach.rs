//! How fast the axes let the tool go along a stroke, place by place.

use machine::Mechanism;
use machine::kinematics::{JointMotion, Joints, KinematicsError};
use signals::math;

use crate::demand::{Demands, torque_and_slew};
use crate::jet::Jet;
use crate::law::Cell;
use crate::posture::Posture;
use crate::speed::CRAWL;
use crate::stroke::StrokePath;

/// Shares of an acceleration limit that a plateau and a ramp may use.
const ACCELERATION: [f64; 2] = [0.5, 0.4];

/// Shares of a jerk limit that a plateau, a ramp's acceleration while the path turns, and a ramp's
/// own jerk may use.
const JERK: [f64; 3] = [0.4, 0.3, 0.3];

/// Share of the largest steady speed that a plateau without ramps may use; the rest is for what lies
/// between two looks. Of an acceleration limit that is nine tenths.
const STEADY: f64 = 0.95;

/// Share of a motor's torque, and of its voltage across the inductance, for a ramp.
const MOTOR: [f64; 2] = [0.3, 0.15];

/// Length of a cell before it is divided [m], and the bounds of their number.
const CELL: f64 = 0.5e-3;
const CELLS: [f64; 2] = [8.0, 4000.0];

/// Change of a joint over half a cell [m or rad], and ratio of the speeds at its ends, above which
/// a cell is divided.
const TURN: f64 = 0.1;
const RATIO: f64 = 1.3;

/// The most divisions of a cell.
const DEEPEST: u32 = 14;

/// What the axes allow along a stroke.
#[derive(Debug, Clone)]
pub(crate) struct Reach {
    /// Where a staircase of speeds must stay.
    pub(crate) cells: Vec<Cell>,
    /// The largest constant speed [m/s].
    pub(crate) steady: f64,
}

/// What holds at one place.
#[derive(Debug, Clone, Copy)]
struct Look<const N: usize> {
    at: f64,
    posture: Posture<N>,
    steady: f64,
    cell: Cell,
}

/// Looks along `path`, which the joints enter at `start`.
pub(crate) fn reach<const N: usize, M: Mechanism<N>>(
    demands: &Demands<'_, N, M>,
    path: &StrokePath,
    start: &Posture<N>,
    top: f64,
) -> Result<Reach, KinematicsError> {
    let length = path.length();
    let count = (length / CELL).ceil().clamp(CELLS[0], CELLS[1]) as usize;
    let mut walk = Walk { demands, path, top, cells: Vec::with_capacity(2 * count) };
    let mut here = walk.look(0.0, start)?;
    let mut steady = here.steady;
    for index in 1..=count {
        here = walk.go(here, length * index as f64 / count as f64, 0, &mut steady)?;
    }
    Ok(Reach { cells: walk.cells, steady })
}

struct Walk<'a, const N: usize, M: Mechanism<N>> {
    demands: &'a Demands<'a, N, M>,
    path: &'a StrokePath,
    top: f64,
    cells: Vec<Cell>,
}

impl<const N: usize, M: Mechanism<N>> Walk<'_, N, M> {
    /// Goes on from `here` to the distance `end`.
    fn go(
        &mut self,
        here: Look<N>,
        end: f64,
        depth: u32,
        steady: &mut f64,
    ) -> Result<Look<N>, KinematicsError> {
        let middle = self.look((here.at + end) / 2.0, &here.posture)?;
        let far = self.look(end, &middle.posture)?;
        let apart =
            |one: &Look<N>, other: &Look<N>| (one.posture.joints - other.posture.joints).amax();
        let speeds = [here, middle, far].map(|look| look.cell.speed.min(self.top));
        let (least, most) = speeds
            .iter()
            .fold((f64::INFINITY, 0.0_f64), |(least, most), v| (least.min(*v), most.max(*v)));
        let even = most <= least * RATIO;
        let near = apart(&here, &middle).max(apart(&middle, &far)) <= TURN;
        if depth < DEEPEST && !(even && near) {
            let middle = self.go(here, middle.at, depth + 1, steady)?;
            return self.go(middle, end, depth + 1, steady);
        }
        for (one, other) in [(&here, &middle), (&middle, &far)] {
            let ramp =
                core::array::from_fn(|order| one.cell.ramp[order].min(other.cell.ramp[order]));
            let speed = one.cell.speed.min(other.cell.speed);
            let alone = one.cell.steady.min(other.cell.steady);
            self.cells.push(Cell { end: other.at, speed, steady: alone, ramp });
            *steady = steady.min(other.steady);
        }
        Ok(far)
    }

    fn look(&self, at: f64, from: &Posture<N>) -> Result<Look<N>, KinematicsError> {
        let demands = self.demands;
        let jet = self.path.at(at);
        let mut branch = from.branch;
        let tool = jet.motion(1.0, 0.0, 0.0);
        let motion = demands.follow(&tool, &mut branch, &from.joints)?;
        let posture = Posture { joints: motion.position, branch };
        let assembly = demands.assemble(&motion.position, branch, None)?;
        let steady = self.speed(&motion, 1.0, 1.0);
        let steady = demands.motor_rate(steady.min(self.top), &motion, &assembly)?;
        let shared = self.speed(&motion, ACCELERATION[0], JERK[0]).min(self.along_path(&jet));
        let speed = demands.motor_rate(shared.min(self.top), &motion, &assembly)?;
        if speed.is_nan() || speed < CRAWL {
            return Err(KinematicsError {
                code: "singular",
                axis: None,
                value: speed,
                limit: CRAWL,
                detail: "the axes allow no speed worth marking here",
            });
        }
        let alone = (steady * STEADY).max(speed);
        let mass = demands.mechanism.mass_matrix(&assembly);
        let ramp = self.ramp(&motion, &jet, speed, &mass.diagonal());
        Ok(Look { at, posture, steady, cell: Cell { end: at, speed, steady: alone, ramp } })
    }

    /// The largest steady speed within shares of the limits of the axes, from the joints' derivatives
    /// by arc length.
    fn speed(&self, by_length: &JointMotion<N>, acceleration: f64, jerk: f64) -> f64 {
        let mut speed = f64::INFINITY;
        for (index, axis) in self.demands.axes.iter().enumerate().take(N) {
            let limits = &axis.limits;
            speed = speed
                .min(limits.velocity / by_length.velocity[index].abs())
                .min(
                    (acceleration * limits.acceleration / by_length.acceleration[index].abs())
                        .sqrt(),
                )
                .min(math::cbrt(jerk * limits.jerk / by_length.jerk[index].abs()));
        }
        speed
    }

    /// The same for the tool itself.
    fn along_path(&self, jet: &Jet) -> f64 {
        let path = &self.demands.path;
        (ACCELERATION[0] * path.acceleration / jet.second.norm())
            .sqrt()
            .min(math::cbrt(JERK[0] * path.jerk / jet.third.norm()))
    }

    /// The largest acceleration and jerk of a ramp at up to `speed`.
    fn ramp(
        &self,
        by_length: &JointMotion<N>,
        jet: &Jet,
        speed: f64,
        inertia: &Joints<N>,
    ) -> [f64; 2] {
        let path = &self.demands.path;
        let bend = |jerk: f64, second: f64| JERK[1] * jerk / (3.0 * speed * second);
        let mut acceleration =
            (ACCELERATION[1] * path.acceleration).min(bend(path.jerk, jet.second.norm()));
        let mut jerk = JERK[2] * path.jerk;
        for (index, axis) in self.demands.axes.iter().enumerate().take(N) {
            let (limits, motor) = (&axis.limits, &axis.motor);
            let first = by_length.velocity[index].abs();
            let load = motor.rotor_inertia() / axis.ratio + axis.ratio * inertia[index];
            let [torque, slew] = torque_and_slew(motor).map(|most| most / load);
            acceleration = acceleration
                .min(ACCELERATION[1] * limits.acceleration / first)
                .min(MOTOR[0] * torque / first)
                .min(bend(limits.jerk, by_length.acceleration[index].abs()));
            jerk = jerk.min(JERK[2] * limits.jerk / first).min(MOTOR[1] * slew / first);
        }
        [acceleration, jerk]
    }
}
