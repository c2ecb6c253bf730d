//! What changes of a path under way when the job shall be marked faster or slower.

use std::sync::Arc;

use machine::Mechanism;

use super::Planning;
use crate::law::End;
use crate::limits::along::SpeedLimit;
use crate::limits::tightening::Tightening;

/// How much longer than it takes at full acceleration a change of speed may take.
const GENTLE: f64 = 1.5;

impl<const N: usize, M: Mechanism<N>> Planning<'_, N, M> {
    /// Marks at `rate` times the speeds asked for from here on, 1 as the job has them.
    pub(crate) fn set_rate(&mut self, rate: f64) {
        if rate == self.rate {
            return;
        }
        self.rate = rate;
        let Some(mut run) = self.front.run.take() else { return };
        let mut speeds = self.limits_for(&run.contour, run.most);
        if let Some(speed) = run.even
            && !self.front.goes_on
        {
            // Near its end a path at one speed is ended at it, of which it is known that it can be left.
            let most = speeds.iter().map(|limit| limit.speed).fold(speed, f64::max);
            if run.path.length() - run.at < self.way_to_slow_down(most) {
                self.front.run = Some(run);
                return;
            }
        }
        if let End::Moving { speed, acceleration } = run.begin {
            // What it still gains before its acceleration is gone.
            let quickening = acceleration.max(0.0);
            let gained = quickening * quickening / self.limits.path.jerk;
            let to = run.at + self.way_to_slow_down(speed + gained);
            keep_up(&mut speeds, run.at, to, speed + gained);
        }
        run.least_reach = self.least_reach(&speeds);
        run.speeds = Arc::new(speeds);
        run.even = None;
        if !self.front.goes_on && matches!(run.exit, End::Moving { .. }) {
            self.choose_exit(&mut run, &Tightening::none(N));
        }
        self.front.run = Some(run);
    }

    /// A way on which the tool surely comes from `speed` to any lower one, or from any lower one to it
    /// [m].
    fn way_to_slow_down(&self, speed: f64) -> f64 {
        let limits = &self.limits.path;
        let time = speed / limits.acceleration + limits.acceleration / limits.jerk;
        GENTLE * speed * time
    }
}

/// Lets the speeds from `from` to `to` [m] be at least `least` [m/s]: what the tool has it cannot lose at
/// once.
fn keep_up(speeds: &mut Vec<SpeedLimit>, from: f64, to: f64, least: f64) {
    let mut kept = Vec::with_capacity(speeds.len() + 2);
    for (index, limit) in speeds.iter().enumerate() {
        let end = speeds.get(index + 1).map_or(f64::INFINITY, |next| next.from);
        for (start, stop) in [(limit.from, from), (limit.from.max(from), to), (to, end)] {
            let (start, stop) = (start.max(limit.from), stop.min(end));
            if stop <= start {
                continue;
            }
            let is_kept = start >= from && stop <= to;
            let speed = if is_kept { limit.speed.max(least) } else { limit.speed };
            kept.push(SpeedLimit { from: start, speed, ..*limit });
        }
    }
    *speeds = kept;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits::limit_id::LimitId;

    #[test]
    fn a_speed_that_the_tool_has_is_kept_for_a_while() {
        let limit = |from, speed| SpeedLimit { from, speed, source: LimitId::FEED };
        let mut speeds = vec![limit(0.0, 1.0), limit(2.0, 3.0)];
        keep_up(&mut speeds, 1.0, 2.5, 2.0);
        let expected = [limit(0.0, 1.0), limit(1.0, 2.0), limit(2.0, 3.0), limit(2.5, 3.0)];
        assert_eq!(speeds, expected);
    }
}
