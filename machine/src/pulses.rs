//! Whole pulses for a stepper: counting from home, what the rounding costs at the tool, and when
//! inside a cycle each pulse is due.
//!
//! A count is always that of the whole way from home. Rounded step by step it would lose what each
//! rounding leaves, and a rule of one pulse per cycle (source 004 eq. 4.30) lags without bound as
//! soon as more are due.

use crate::kinematics::Jacobian;

/// Above this many pulses a whole number is no longer exact.
const LARGEST: f64 = (1_u64 << f64::MANTISSA_DIGITS) as f64;

/// How a length is counted in pulses.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PulseScale {
    /// Pulses per length [1/m]. // K
    pub per_length: f64,
    /// The length at which the count is 0 [m].
    pub home: f64,
}

impl PulseScale {
    /// A motor of `steps` per turn, each divided into `microsteps`, that turns `gear` times for each
    /// turn of a screw of `lead` [m/turn].
    // Source 004 eq. 4.11, with n = 1/lead and the microsteps that it leaves out.
    pub fn of_screw(steps: f64, microsteps: f64, gear: f64, lead: f64, home: f64) -> Self {
        Self { per_length: steps * microsteps * gear / lead, home }
    }

    /// Pulses from home, not rounded, at `length` [m].
    pub fn course(&self, length: f64) -> f64 {
        self.per_length * (length - self.home)
    }

    /// Whole pulses from home at `length` [m].
    pub fn count(&self, length: f64) -> i64 {
        nearest(self.course(length))
    }

    /// The length at which a count stands [m].
    pub fn length(&self, count: i64) -> f64 {
        self.home + count as f64 / self.per_length
    }

    /// Pulses per time [1/s] at `velocity` [m/s], against the limit of a driver.
    pub fn rate(&self, velocity: f64) -> f64 {
        self.per_length * velocity
    }
}

/// The whole number of pulses nearest to `course`; a half rounds up.
pub fn nearest(course: f64) -> i64 {
    (course + 0.5).floor() as i64
}

/// How far rounding to whole pulses may put the tool off, to first order [m]: the worst corner of
/// half a pulse on each axis, `|J·(±½/K, ±½/K)|`.
pub fn quantisation_bound<const N: usize>(jacobian: &Jacobian<N>, per_length: &[f64; N]) -> f64 {
    let linear = jacobian.fixed_rows::<3>(0);
    // A corner and the one opposite are alike, so the last axis keeps its sign.
    let corners = 1_u32 << N.saturating_sub(1);
    (0..corners)
        .map(|corner| {
            let half = nalgebra::SVector::<f64, N>::from_fn(|axis, _| {
                let half = 0.5 / per_length[axis];
                if corner >> axis & 1 == 0 { half } else { -half }
            });
            (linear * half).norm()
        })
        .fold(0.0, f64::max)
}

/// One pulse inside a cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    /// When, as a share of the cycle, above 0 and up to 1.
    pub share: f64,
    /// The count from then on.
    pub count: i64,
}

/// The pulses of one cycle, in order of time: wherever the course passes a half-integer, and with
/// it the count.
///
/// The course runs from `from` to `to` [pulses], at first at `from_rate`, at last at `to_rate`
/// [pulses per cycle]; a cubic joins them, which is a line when both rates are `to − from`.
/// From one cycle to the next no pulse is lost or doubled: the count ends at [`nearest`] of `to`.
/// A course that is not a number, or beyond what can be counted, has no pulses.
pub fn crossings(from: f64, to: f64, from_rate: f64, to_rate: f64) -> Crossings {
    let climb = to - from;
    let course = Cubic {
        value: from,
        first: from_rate,
        second: 3.0 * climb - 2.0 * from_rate - to_rate,
        third: from_rate + to_rate - 2.0 * climb,
    };
    let countable = [from, to, from_rate, to_rate].iter().all(|value| value.abs() < LARGEST);
    let mut ends = [(1.0, to); 3];
    if countable {
        for (end, turn) in ends.iter_mut().zip(course.turns().into_iter().flatten()) {
            *end = (turn, course.at(turn));
        }
    }
    let piece = if countable { 0 } else { ends.len() };
    Crossings { course, ends, piece, share: 0.0, count: nearest(from) }
}

/// Gives the pulses of [`crossings`].
#[derive(Debug, Clone)]
pub struct Crossings {
    course: Cubic,
    /// Ends of the pieces between which the course only rises or only falls: share and value.
    ends: [(f64, f64); 3],
    piece: usize,
    share: f64,
    count: i64,
}

impl Iterator for Crossings {
    type Item = Crossing;

    fn next(&mut self) -> Option<Crossing> {
        while let Some(&(end, value)) = self.ends.get(self.piece) {
            let count = self.count as f64;
            let (threshold, step) = if count + 0.5 <= value {
                (count + 0.5, 1)
            } else if count - 0.5 > value {
                (count - 0.5, -1)
            } else {
                self.piece += 1;
                self.share = end;
                continue;
            };
            self.share = self.course.passes(threshold, self.share, end, step > 0);
            self.count += step;
            return Some(Crossing { share: self.share, count: self.count });
        }
        None
    }
}

/// `value + first·s + second·s² + third·s³`.
#[derive(Debug, Clone, Copy)]
struct Cubic {
    value: f64,
    first: f64,
    second: f64,
    third: f64,
}

impl Cubic {
    fn at(&self, share: f64) -> f64 {
        self.value + share * (self.first + share * (self.second + share * self.third))
    }

    fn slope(&self, share: f64) -> f64 {
        self.first + share * (2.0 * self.second + share * 3.0 * self.third)
    }

    /// Where it turns inside the cycle, in order.
    fn turns(&self) -> [Option<f64>; 2] {
        // The slope c + 2b·s + a·s², solved without cancellation.
        let (a, b, c) = (3.0 * self.third, self.second, self.first);
        let discriminant = b * b - a * c;
        if discriminant <= 0.0 {
            return [None; 2];
        }
        let sum = -(b + discriminant.sqrt().copysign(b));
        // A division by 0 gives what is not inside either.
        let inside = |turn: f64| (turn > 0.0 && turn < 1.0).then_some(turn);
        match (inside(sum / a), inside(c / sum)) {
            (Some(one), Some(other)) => [Some(one.min(other)), Some(one.max(other))],
            (one, other) => [one.or(other), None],
        }
    }

    /// Where between `from` and `end` it passes `threshold`, rising or falling all the way.
    ///
    /// Newton's steps, and halving where one would leave the bracket.
    fn passes(&self, threshold: f64, from: f64, end: f64, rising: bool) -> f64 {
        /// Share of a cycle below which no driver can tell two instants apart: 1 ns of 1 ms is 1e-6.
        const RESOLUTION: f64 = 1e-12;
        /// Halvings that bring any bracket below the resolution.
        const STEPS: usize = 40;
        let (mut low, mut high) = (from, end);
        let mut share = (low + high) / 2.0;
        for _ in 0..STEPS {
            let off = self.at(share) - threshold;
            if (off < 0.0) == rising {
                low = share;
            } else {
                high = share;
            }
            let newton = share - off / self.slope(share);
            let next = if newton >= low && newton <= high { newton } else { (low + high) / 2.0 };
            let moved = (next - share).abs();
            share = next;
            if moved < RESOLUTION {
                break;
            }
        }
        share
    }
}

#[cfg(test)]
mod tests {
    use super::{Crossing, crossings, nearest};

    #[test]
    fn a_line_passes_its_half_integers_evenly() {
        let found: Vec<Crossing> = crossings(0.25, 3.25, 3.0, 3.0).collect();
        assert_eq!(found.len(), 3);
        for (index, crossing) in found.iter().enumerate() {
            assert_eq!(crossing.count, index as i64 + 1);
            let expected = (index as f64 + 0.25) / 3.0;
            assert!((crossing.share - expected).abs() < 1e-12, "{crossing:?}");
        }
        // The same way back: the same instants in reverse.
        let back: Vec<Crossing> = crossings(3.25, 0.25, -3.0, -3.0).collect();
        assert_eq!(back.iter().map(|crossing| crossing.count).collect::<Vec<_>>(), [2, 1, 0]);
        for (there, here) in found.iter().zip(back.iter().rev()) {
            assert!((there.share + here.share - 1.0).abs() < 1e-12);
        }
    }

    /// 4s(1 − s) starts and ends at 0 and tops at 1 in the middle.
    #[test]
    fn a_course_that_turns_sends_the_pulse_back() {
        let found: Vec<Crossing> = crossings(0.0, 0.0, 4.0, -4.0).collect();
        let half = 0.5_f64.sqrt() / 2.0;
        assert_eq!(found.len(), 2);
        assert_eq!([found[0].count, found[1].count], [1, 0]);
        assert!((found[0].share - (0.5 - half)).abs() < 1e-9, "{found:?}");
        assert!((found[1].share - (0.5 + half)).abs() < 1e-9, "{found:?}");
    }

    /// A course with two turns, over many starts and rates: in order, on the course, each by one,
    /// and ending where the next cycle starts.
    #[test]
    fn no_pulse_is_lost_between_cycles() {
        let mut pulses = 0;
        for start in -8..8 {
            for climb in -9..9 {
                for rates in 0..49 {
                    let from = f64::from(start) * 0.37;
                    let to = from + f64::from(climb) * 0.71;
                    let (first, last) =
                        (f64::from(rates % 7 - 3) * 11.0, f64::from(rates / 7 - 3) * 13.0);
                    let (mut share, mut count) = (0.0, nearest(from));
                    for crossing in crossings(from, to, first, last) {
                        assert!(crossing.share >= share && crossing.share <= 1.0);
                        assert_eq!((crossing.count - count).abs(), 1);
                        let s = crossing.share;
                        let blend = s * s * (3.0 - 2.0 * s);
                        let course = from * (1.0 - blend)
                            + to * blend
                            + s * (1.0 - s) * (first * (1.0 - s) - last * s);
                        let threshold = (crossing.count + count) as f64 / 2.0;
                        assert!((course - threshold).abs() < 1e-9, "{course} {threshold}");
                        (share, count) = (crossing.share, crossing.count);
                        pulses += 1;
                    }
                    assert_eq!(count, nearest(to), "{from} {to} {first} {last}");
                }
            }
        }
        assert!(pulses > 50_000, "{pulses}");
    }

    #[test]
    fn a_half_is_sent_in_the_cycle_that_reaches_it() {
        assert_eq!(crossings(0.0, 0.5, 0.5, 0.5).last(), Some(Crossing { share: 1.0, count: 1 }));
        assert_eq!(crossings(0.5, 1.0, 0.5, 0.5).count(), 0);
        assert_eq!(crossings(1.0, 0.5, -0.5, -0.5).count(), 0);
        assert_eq!(crossings(0.5, 0.0, -0.5, -0.5).next().map(|pulse| pulse.count), Some(0));
    }

    #[test]
    fn what_is_not_a_number_has_no_pulses() {
        assert_eq!(crossings(f64::NAN, 1.0, 1.0, 1.0).count(), 0);
        assert_eq!(crossings(0.0, f64::INFINITY, 1.0, 1.0).count(), 0);
        assert_eq!(crossings(0.0, 5.0, f64::NAN, 5.0).count(), 0);
        assert_eq!(crossings(0.0, 1e300, 1.0, 1.0).count(), 0);
    }
}
