//! The laser over one cycle of the machine, from the laser over the stretch of stream played in it.

use crate::lookahead::Lookahead;
use crate::stream_time::StreamTime;
use messages::time::{Period, SETPOINT_PERIOD};
use messages::{GateEdge, LaserCycle, TooManyEdges};

/// A stretch of stream played in one cycle, at the rate it has on average.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stretch {
    /// Stream time at the start of the cycle.
    pub from: StreamTime,
    /// Stream time at its end; not before `from` when there is light to give.
    pub to: StreamTime,
    /// Period of the cycle.
    pub period: Period,
}

impl Stretch {
    /// Mean rate over the cycle.
    pub fn rate(self) -> f64 {
        (self.to - self.from).0 as f64 / StreamTime::in_cycles(1, self.period).0 as f64
    }
}

/// How much of the power that a stream asks for is given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Strength {
    /// The least power at which the source gives light, 0..=1.
    pub least: f64,
    /// So many times what the stream asks for.
    pub share: f64,
    /// The most that is given, 0..=1.
    pub most: f64,
}

/// The laser over `stretch`, dark before `dark_until`. Edges keep their stream time; power follows
/// the rate, so that each length of line gets the same light, and the override; down to the least: below it the source
/// might not light at all. The frequency is that of the setpoint in which the light may begin.
///
/// # Errors
/// More changes than a cycle can hold: none is left out silently.
pub fn laser(
    lookahead: &Lookahead,
    stretch: Stretch,
    dark_until: StreamTime,
    strength: Strength,
) -> Result<LaserCycle, TooManyEdges> {
    let rate = stretch.rate();
    if stretch.to <= stretch.from || stretch.to <= dark_until {
        return Ok(dark(lookahead, stretch.from));
    }
    let start = stretch.from.max(dark_until);
    let first = start.sequence();
    let last = StreamTime(stretch.to.0 - 1).sequence();
    let period = stretch.period.time().0 as f64;
    let planned = &lookahead.setpoint(first).laser;
    let mut cycle = LaserCycle { frequency: planned.frequency, ..LaserCycle::OFF };
    let whole = StreamTime::of(first + 1);
    if stretch.from == StreamTime::of(first)
        && stretch.from == start
        && stretch.to == whole
        && stretch.period == Period::OF_SETPOINTS
        && strength.share == 1.0
        && strength.most == 1.0
    {
        return Ok(*planned);
    }
    let setpoint = SETPOINT_PERIOD.0 as f64;
    // From stream time since the start of the stretch [setpoints] to time since the start of the cycle [ns].
    let offset = |into: f64| into * setpoint / rate;
    // What is on where the light may begin: the last edge that has passed by then.
    let passed = start.fraction() * setpoint;
    let (gate, power) = planned
        .edges()
        .iter()
        .take_while(|edge| f64::from(edge.offset) <= passed)
        .last()
        .map_or((planned.gate, planned.power), |edge| (edge.gate, edge.power));
    let share = rate * strength.share;
    let power_at_rate =
        |power: f64| (power * share).max(power.min(strength.least)).min(strength.most);
    if start == stretch.from {
        (cycle.gate, cycle.power) = (gate, power_at_rate(power));
    } else if gate != 0 {
        push(
            &mut cycle,
            period,
            offset((start - stretch.from).setpoints()),
            gate,
            power_at_rate(power),
        )?;
    }
    for sequence in first..=last {
        let laser = &lookahead.setpoint(sequence).laser;
        let into = (StreamTime::of(sequence) - stretch.from).setpoints();
        // A setpoint starts with what the one before ended with, unless the planner says otherwise.
        if sequence != first && (laser.gate, power_at_rate(laser.power)) != cycle.last() {
            push(&mut cycle, period, offset(into), laser.gate, power_at_rate(laser.power))?;
        }
        for edge in laser.edges() {
            let begun = sequence != first || f64::from(edge.offset) > passed;
            let at = offset(into + f64::from(edge.offset) / setpoint);
            if begun && at < period {
                push(&mut cycle, period, at, edge.gate, power_at_rate(edge.power))?;
            }
        }
    }
    Ok(cycle)
}

/// No light at this instant of the stream, its frequency as planned there.
pub fn dark(lookahead: &Lookahead, at: StreamTime) -> LaserCycle {
    let frequency = lookahead.setpoint(at.sequence()).laser.frequency;
    LaserCycle { frequency, ..LaserCycle::OFF }
}

/// Adds an edge, inside the cycle of this `period` [ns].
fn push(
    cycle: &mut LaserCycle,
    period: f64,
    offset: f64,
    gate: u32,
    power: f64,
) -> Result<(), TooManyEdges> {
    let offset = offset.round().clamp(0.0, period - 1.0) as u32;
    if cycle.push(GateEdge { offset, gate, power }) { Ok(()) } else { Err(TooManyEdges) }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::stream_time::ONE;
    use messages::Setpoint;

    /// Dark, then stroke 3 from 1.25 to 3.5 in stream time, at power 0.4.
    fn ring() -> Lookahead {
        let mut ring = Lookahead::new();
        for sequence in 0..8 {
            let mut setpoint = Setpoint { stream: 1, sequence, ..Setpoint::default() };
            match sequence {
                1 => {
                    assert!(setpoint.laser.push(GateEdge { offset: 250_000, gate: 3, power: 0.4 }))
                }
                2 => (setpoint.laser.gate, setpoint.laser.power) = (3, 0.4),
                3 => {
                    (setpoint.laser.gate, setpoint.laser.power) = (3, 0.4);
                    assert!(setpoint.laser.push(GateEdge { offset: 500_000, gate: 0, power: 0.0 }));
                }
                _ => {}
            }
            ring.accept(&setpoint).unwrap();
        }
        ring
    }

    /// As planned, from a source that gives no less than `least`.
    fn planned(least: f64) -> Strength {
        Strength { least, share: 1.0, most: 1.0 }
    }

    fn at(setpoints: f64) -> StreamTime {
        StreamTime((setpoints * ONE as f64).round() as i64)
    }

    /// Lit stream time and exposure over `[from, to)` in steps of `rate`.
    fn play(from: f64, to: f64, rate: f64, dark_until: f64) -> (f64, f64) {
        let ring = ring();
        let (mut lit, mut exposure, mut now) = (0.0, 0.0, at(from));
        while now < at(to) {
            let stretch = Stretch { from: now, to: now + at(rate), period: Period::OF_SETPOINTS };
            let cycle = laser(&ring, stretch, at(dark_until), planned(0.0)).unwrap();
            assert!(cycle.is_valid(SETPOINT_PERIOD), "{cycle:?}");
            let (mut since, mut gate, mut power) = (0.0, cycle.gate, cycle.power);
            let end = GateEdge { offset: 1_000_000, gate: 0, power: 0.0 };
            for edge in cycle.edges().iter().chain([&end]) {
                let time = f64::from(edge.offset) * 1e-6;
                if gate != 0 {
                    assert_eq!(gate, 3);
                    lit += (time - since) * rate;
                    exposure += (time - since) * power;
                }
                (since, gate, power) = (time, edge.gate, edge.power);
            }
            now = stretch.to;
        }
        (lit, exposure)
    }

    #[test]
    fn lit_stream_time_and_exposure_do_not_depend_on_the_rate() {
        for rate in [1.0, 0.5, 0.1, 0.3, 2.0, 1.7] {
            for from in [0.0, 0.25, 0.9] {
                let (lit, exposure) = play(from, 7.0, rate, 0.0);
                // Offsets are whole nanoseconds: 1e-6 of a cycle per edge.
                assert!((lit - 2.25).abs() < 1e-5, "{lit} at rate {rate} from {from}");
                assert!((exposure - 0.9).abs() < 1e-5, "{exposure} at rate {rate} from {from}");
            }
        }
    }

    #[test]
    fn lights_again_exactly_where_it_went_dark() {
        for dark_until in [1.1, 1.5, 2.0, 2.75, 3.5, 4.0] {
            for rate in [1.0, 0.37, 1.9] {
                let (lit, _) = play(0.3, 7.0, rate, dark_until);
                let expected = (3.5 - f64::max(1.25, dark_until)).max(0.0);
                assert!((lit - expected).abs() < 1e-5, "{lit} from {dark_until} at {rate}");
            }
        }
    }

    #[test]
    fn no_light_is_weaker_than_the_source_can_give_nor_stronger_than_planned_for_that() {
        let ring = ring();
        let told = |min_power: f64, rate: f64| {
            let (from, to) = (at(2.1), at(2.1 + rate));
            laser(
                &ring,
                Stretch { from, to, period: Period::OF_SETPOINTS },
                StreamTime(0),
                planned(min_power),
            )
            .unwrap()
            .power
        };
        let off = |min_power: f64, rate: f64, power: f64| (told(min_power, rate) - power).abs();
        for (min_power, rate, power) in
            [(0.1, 0.5, 0.2), (0.3, 0.5, 0.3), (0.3, 0.1, 0.3), (0.3, 0.9, 0.36), (0.7, 0.5, 0.4)]
        {
            assert!(off(min_power, rate, power) < 1e-9, "{min_power} at {rate}");
        }
        // Nothing is lit for that.
        let dark = Stretch { from: at(4.0), to: at(4.3), period: Period::OF_SETPOINTS };
        assert_eq!(laser(&ring, dark, StreamTime(0), planned(0.3)), Ok(LaserCycle::OFF));
    }

    #[test]
    fn an_override_of_the_power_scales_every_power_up_to_full() {
        let ring = ring();
        let whole = |from: f64, share: f64| {
            let stretch =
                Stretch { from: at(from), to: at(from + 1.0), period: Period::OF_SETPOINTS };
            laser(&ring, stretch, StreamTime(0), Strength { least: 0.05, share, most: 1.0 })
                .unwrap()
        };
        for (share, power) in [(0.5, 0.2), (1.5, 0.6), (2.0, 0.8), (0.1, 0.05), (1.0, 0.4)] {
            assert!((whole(2.0, share).power - power).abs() < 1e-12, "{share}");
            let lit = whole(1.0, share);
            assert_eq!((lit.gate, lit.edges().len(), lit.edges()[0].offset), (0, 1, 250_000));
            assert!((lit.edges()[0].power - power).abs() < 1e-12, "{share}");
        }
        let strong = Strength { least: 0.0, share: 9.0, most: 1.0 };
        let stretch = Stretch { from: at(2.0), to: at(3.0), period: Period::OF_SETPOINTS };
        assert_eq!(laser(&ring, stretch, StreamTime(0), strong).unwrap().power, 1.0);
        assert!(!whole(5.0, 2.0).is_lit(), "nothing is lit for it");
        for (share, most, power) in [(2.0, 0.5, 0.5), (1.0, 0.3, 0.3), (0.5, 0.3, 0.2)] {
            let strength = Strength { least: 0.0, share, most };
            let given = laser(&ring, stretch, StreamTime(0), strength).unwrap().power;
            assert!((given - power).abs() < 1e-12, "{share} up to {most}: {given}");
        }
    }

    #[test]
    fn as_planned_is_the_planners_own_cycle() {
        let ring = ring();
        for sequence in 0..7 {
            let stretch = Stretch {
                from: StreamTime::of(sequence),
                to: StreamTime::of(sequence + 1),
                period: Period::OF_SETPOINTS,
            };
            let cycle = laser(&ring, stretch, StreamTime(0), planned(0.3));
            assert_eq!(cycle, Ok(ring.setpoint(sequence).laser));
        }
    }

    #[test]
    fn backwards_and_at_rest_it_is_dark() {
        let ring = ring();
        for (from, to) in [(3.0, 2.0), (2.0, 2.0)] {
            let stretch = Stretch { from: at(from), to: at(to), period: Period::OF_SETPOINTS };
            assert_eq!(laser(&ring, stretch, StreamTime(0), planned(0.3)), Ok(LaserCycle::OFF));
        }
    }

    #[test]
    fn edges_that_do_not_fit_are_not_left_out() {
        let mut ring = Lookahead::new();
        for sequence in 0..3 {
            let mut setpoint = Setpoint { stream: 1, sequence, ..Setpoint::default() };
            for slot in 0..10 {
                let gate = 1 - slot % 2;
                let edge = GateEdge { offset: slot * 100_000, gate, power: f64::from(gate) };
                assert!(setpoint.laser.push(edge));
            }
            ring.accept(&setpoint).unwrap();
        }
        let stretch =
            |from, to| Stretch { from: at(from), to: at(to), period: Period::OF_SETPOINTS };
        let play = |from, to| laser(&ring, stretch(from, to), StreamTime(0), planned(0.0));
        assert_eq!(play(0.0, 1.0).unwrap().edges().len(), 10);
        assert_eq!(play(0.0, 2.0), Err(TooManyEdges));
    }
}
