//! The end of a stretch, held to the limits before the next is known.

use machine::Mechanism;
use messages::time::SETPOINT_TIME;

use super::Planning;
use super::path_run::PathRun;
use super::speeds::limit_at;
use crate::joint_space::follow_flight::uses;
use crate::law::time_law::TimeLaw;
use crate::limits::limit_id::JointLimit;
use crate::limits::motion_limits::Scope;
use crate::limits::tightening::Tightening;

/// The last [`TAIL`] seconds of a stretch are sampled with the next stretch, when they can no longer be
/// changed. They are therefore checked when the stretch is planned, at [`TAIL_SAMPLES`] instants.
const TAIL: f64 = 4.0 * SETPOINT_TIME;
const TAIL_SAMPLES: u32 = 32;
/// The fraction that the tail may use of a joint's limit, and of a limit of the tool.
const TAIL_JOINTS: f64 = 0.9997;
const TAIL_TOOL: f64 = 1.0005;
/// The fraction that a stretch is planned for again if its tail uses more, and how often that is tried.
const TAIL_GOAL: f64 = 0.998;
pub(super) const TAIL_TRIALS: usize = 4;

impl<const N: usize, M: Mechanism<N>> Planning<'_, N, M> {
    /// Leaves less of what the end of `law` takes too much of. Says whether there was anything.
    pub(super) fn tighten_tail(
        &self,
        run: &PathRun<N>,
        law: &TimeLaw,
        shares: &mut Tightening,
    ) -> bool {
        let all = Tightening::all(N);
        let path = &self.limits.path;
        let begin = law.duration() - TAIL;
        let mut tool_uses = [0.0_f64; 3];
        let mut joint_uses = [[0.0_f64; JointLimit::COUNT]; N];
        for look in 0..=TAIL_SAMPLES {
            let time = begin + TAIL * f64::from(look) / f64::from(TAIL_SAMPLES);
            let now = law.at(time.max(0.0));
            let rates = [now.velocity, now.acceleration, now.jerk];
            let tool = run.path.tool(now.position, rates);
            let speed = limit_at(&run.speeds, now.position).speed;
            let used = [
                tool.velocity.norm() / speed,
                tool.acceleration.norm() / path.acceleration,
                tool.jerk.norm() / path.jerk,
            ];
            tool_uses.iter_mut().zip(used).for_each(|(most, used)| *most = most.max(used));
            if self.limits.scope == Scope::PathAlone {
                continue;
            }
            let after = run.trail.partition_point(|(at, _)| *at <= now.position);
            let near = &run.trail[after.max(1) - 1].1;
            let Some(used) = uses(&self.limits, near, &tool, &all) else { continue };
            let both = joint_uses.iter_mut().flatten().zip(used.iter().flatten());
            both.for_each(|(most, used)| *most = most.max(*used));
        }
        let mut is_beyond = false;
        let mut hold = |used: f64, most: f64, share: &mut f64| {
            if used > most {
                *share *= (TAIL_GOAL / used).max(0.5);
                is_beyond = true;
            }
        };
        hold(tool_uses[0], TAIL_TOOL, &mut shares.speed);
        hold(tool_uses[1], TAIL_TOOL, &mut shares.acceleration);
        hold(tool_uses[2], TAIL_TOOL, &mut shares.jerk);
        for (used, axis) in joint_uses.into_iter().zip(&mut shares.axes) {
            let [velocity, acceleration, jerk, torque, voltage] = used;
            hold(velocity, TAIL_JOINTS, &mut axis.velocity);
            hold(acceleration, TAIL_JOINTS, &mut axis.acceleration);
            hold(jerk, TAIL_JOINTS, &mut axis.jerk);
            hold(torque, TAIL_JOINTS, &mut axis.torque);
            hold(voltage, TAIL_JOINTS, &mut axis.voltage);
        }
        is_beyond
    }
}
