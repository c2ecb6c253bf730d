//! Where the tool was, and whether the laser was on, at every instant between the samples.
//!
//! Samples tell the tool once a cycle; gate edges fall between them. A cubic through the
//! neighbours closes the gap: with central differences for tangents its error is about
//! `jerk·h³/48`, 0.01 µm at 500 m/s³ and a cycle of 1 ms. Cycles that drives skipped make one long
//! interval with the one before them: 1.3 µm in 5 ms.

use crate::recording::CycleRecord;
use crate::recording::continuity::{Stamp, Succession};
use messages::feedback::status;
use messages::time::Period;
use messages::{ControllerState, LaserCycle, MAX_EDGES, Nanoseconds};
use nalgebra::Vector3;

/// Bits of a feedback's status that say: the cycle which begins with it is dark, whatever the
/// command in force says.
const KEPT_DARK: u32 = status::COMMAND_MISSED | status::WATCHDOG_TRIPPED | status::GATE_INHIBITED;

/// What one record tells about its deadline `t[k]` and the cycle before.
#[derive(Debug, Clone, Copy)]
pub struct Moment {
    /// `k`, in the run of drives, and the cycles since the moment before.
    pub stamp: Stamp,
    /// The period of the cycle.
    pub period: Period,
    /// The tool at `t[k]` [m].
    pub tool: Vector3<f64>,
    /// Whether `tool` is known.
    pub tool_known: bool,
    /// Where the plan had the tool at `t[k]` [m]; `None` in a cycle without an answer.
    pub planned: Option<Vector3<f64>>,
    /// What the laser did since the moment before.
    pub laser: LaserCycle,
    /// What the command which answered this feedback asks for.
    pub asked: Asked,
    /// Cycle of the command in force from `t[k]` on; `None` before the first.
    pub in_force: Option<u64>,
    /// Whether drives keeps the cycle from `t[k]` on dark, whatever that command asks for.
    pub kept_dark: bool,
}

/// What a command asks for in the cycle in which it acts.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Asked {
    /// The stream that it plays, 0 for none.
    pub stream: u64,
    /// Stream time at the feedback that it answers [s].
    pub stream_time: f64,
    /// Stroke to be marked, from 1; 0 for none.
    pub stroke: u64,
    /// The first light in the cycle, and the last.
    pub light: Option<(LitSpan, LitSpan)>,
    /// Whether the stream is being played, neither held nor given up.
    pub running: bool,
}

impl Asked {
    /// Whether light is asked for at the end of the cycle.
    pub fn stays_lit(&self) -> bool {
        self.light.is_some_and(|(_, last)| last.to == 1.0)
    }
}

impl Moment {
    /// The moment of a record, with the tool as drives reported it, of cycles of this `period`.
    pub fn of(record: &CycleRecord, period: Period) -> Self {
        let CycleRecord { feedback, command } = record;
        let asked = || {
            let light = LitSpans::of(&command.laser, period.time());
            let light = light.as_slice();
            Asked {
                stream: command.stream,
                stream_time: command.stream_time,
                stroke: command.stroke,
                light: light.first().copied().zip(light.last().copied()),
                running: command.state() == ControllerState::Running,
            }
        };
        let answered = record.is_answered();
        Self {
            stamp: Stamp::of(feedback),
            period,
            tool: Vector3::from(feedback.tool),
            tool_known: feedback.has(status::TOOL_KNOWN),
            planned: answered.then(|| Vector3::from(command.tool)),
            laser: feedback.laser,
            asked: if answered { asked() } else { Asked::default() },
            in_force: (feedback.command_received.0 != 0).then_some(feedback.command_cycle.0),
            kept_dark: feedback.status & KEPT_DARK != 0,
        }
    }
}

impl Moment {
    /// Stream time at `t[k]` [s]; `None` where the feedback was not answered.
    pub fn stream_time(&self) -> Option<f64> {
        self.planned.is_some().then_some(self.asked.stream_time)
    }
}

/// A sliding window over the moments; gives one [`Interval`] for each cycle.
#[derive(Debug, Default)]
pub struct ToolPath {
    /// The newest last; `None` before the first and after the last.
    window: [Option<Moment>; WINDOW],
}

/// Moments seen at once: three before the one that ends the interval, and one after it.
const WINDOW: usize = 5;

impl ToolPath {
    /// How `moment` would follow the newest; [`Succession::Next`] where there is none yet.
    pub fn succession(&self, moment: &Moment) -> Succession {
        let newest = self.window.last().copied().flatten();
        newest.map_or(Succession::Next, |newest| Succession::between(newest.stamp, moment.stamp))
    }

    /// Takes the next moment, and gives the interval that now has both its neighbours. After a gap
    /// in the records nothing is joined across it: what it gives is the last interval before the
    /// gap.
    pub fn push(&mut self, moment: Moment) -> Option<Interval> {
        if self.succession(&moment) == Succession::Next {
            return self.shift(Some(moment));
        }
        let last = self.finish();
        self.window = [None; WINDOW];
        self.shift(Some(moment));
        last
    }

    /// The last interval, once no moment follows.
    pub fn finish(&mut self) -> Option<Interval> {
        self.shift(None)
    }

    fn shift(&mut self, moment: Option<Moment>) -> Option<Interval> {
        self.window.rotate_left(1);
        if let Some(last) = self.window.last_mut() {
            *last = moment;
        }
        let [earliest, before, start, end, after] = self.window;
        Some(Interval { earliest, before, start: start?, end: end?, after })
    }
}

/// From one moment to the next, with its neighbours: one cycle `[t[k−1], t[k])`, or one with those
/// that drives skipped after it. Parts count through all of it.
#[derive(Debug, Clone, Copy)]
pub struct Interval {
    earliest: Option<Moment>,
    before: Option<Moment>,
    /// The moment at which it starts.
    pub start: Moment,
    /// The moment at which it ends, `t[k]`; its `laser` speaks of this interval.
    pub end: Moment,
    after: Option<Moment>,
}

impl Interval {
    /// How long it is [s].
    pub fn time(&self) -> f64 {
        self.span().seconds()
    }

    fn span(&self) -> Nanoseconds {
        self.end.period.of(self.end.stamp.elapsed)
    }

    /// The tool at `part` of the interval, 0 at its start and 1 at its end [m].
    pub fn tool(&self, part: f64) -> Vector3<f64> {
        let before = self.before.map(|moment| moment.tool);
        let after = self.after.map(|moment| moment.tool);
        hermite(before, self.start.tool, self.end.tool, after, self.neighbours(), part)
    }

    /// Tool minus plan at `part` of the interval [m]; `None` where the plan is not known.
    pub fn deviation(&self, part: f64) -> Option<Vector3<f64>> {
        let deviation = |moment: Moment| Some(moment.tool - moment.planned?);
        let before = self.before.and_then(deviation);
        let after = self.after.and_then(deviation);
        let (start, end) = (deviation(self.start)?, deviation(self.end)?);
        Some(hermite(before, start, end, after, self.neighbours(), part))
    }

    /// How long the intervals before and after are, in units of this one.
    fn neighbours(&self) -> [f64; 2] {
        let own = self.end.stamp.elapsed as f64;
        [self.start.stamp.elapsed, self.after.map_or(1, |after| after.stamp.elapsed)]
            .map(|other| other as f64 / own)
    }

    /// Whether it and its neighbours are one cycle each.
    fn is_even(&self) -> bool {
        let moments = [self.before, Some(self.start), Some(self.end), self.after];
        moments.iter().flatten().all(|moment| moment.stamp.elapsed == 1)
    }

    /// Whether the tool's place between its ends is known as well as at them: it takes a
    /// neighbour on both sides.
    pub fn is_surrounded(&self) -> bool {
        self.before.is_some() && self.after.is_some()
    }

    /// Whether a difference of fourth order can be taken at its start.
    pub fn is_wide(&self) -> bool {
        self.is_surrounded() && self.earliest.is_some()
    }

    /// Whether nothing was recorded right before it.
    pub fn is_first(&self) -> bool {
        self.before.is_none()
    }

    /// Distance of the tool's places at its two ends [m].
    pub fn chord(&self) -> f64 {
        (self.end.tool - self.start.tool).norm()
    }

    /// Which way the plan goes in this interval, or the tool where the plan is not known [m].
    pub fn planned_step(&self) -> Vector3<f64> {
        let planned = self.start.planned.zip(self.end.planned);
        let (start, end) = planned.unwrap_or((self.start.tool, self.end.tool));
        end - start
    }

    /// Speed of the tool at the start of the interval [m/s], by differences of fourth order where
    /// there are neighbours enough, a cycle apart each.
    pub fn speed_at_start(&self) -> f64 {
        if !self.is_even() {
            return (self.end.tool - self.start.tool).norm() / self.time();
        }
        let near = match self.before {
            Some(before) => self.end.tool - before.tool,
            None => (self.end.tool - self.start.tool) * 2.0,
        };
        let difference = match (self.earliest, self.after) {
            (Some(earliest), Some(after)) if self.before.is_some() => {
                (near * 8.0 - (after.tool - earliest.tool)) / 6.0
            }
            _ => near,
        };
        difference.norm() / (2.0 * self.end.period.seconds())
    }

    /// Whether the tool is known at both ends.
    pub fn tool_known(&self) -> bool {
        self.start.tool_known && self.end.tool_known
    }

    /// What the command in force at its start asks for; `None` where that command is not known.
    /// What is marked is what [`Interval::lit`] says.
    pub fn commanded(&self) -> Option<Asked> {
        let in_force = |moment: &Moment| Some(moment.stamp.cycle) == self.start.in_force;
        let mut answered = [self.before, self.earliest].into_iter().flatten();
        answered.find(in_force).filter(|moment| moment.planned.is_some()).map(|moment| moment.asked)
    }

    /// The same, `None` also where drives kept the cycle dark.
    pub fn due(&self) -> Option<Asked> {
        self.commanded().filter(|_| !self.start.kept_dark)
    }

    /// The parts of the interval with light.
    pub fn lit(&self) -> LitSpans {
        LitSpans::of(&self.end.laser, self.span())
    }
}

/// A lit part of an interval.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LitSpan {
    /// Where it begins, as a part of the interval, 0..=1.
    pub from: f64,
    /// Where it ends, above `from`.
    pub to: f64,
    /// The stroke that the light belongs to, from 1.
    pub stroke: u64,
}

/// The lit parts of an interval, in order; two that touch belong to different strokes.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct LitSpans {
    spans: [LitSpan; MAX_EDGES + 1],
    count: usize,
}

impl LitSpans {
    /// The lit parts of what the laser does in `time`; light takes an open gate and power.
    pub fn of(laser: &LaserCycle, time: Nanoseconds) -> Self {
        let whole = time.0 as f64;
        let light = |gate: u32, power: f64| if power > 0.0 { u64::from(gate) } else { 0 };
        let mut spans = Self::default();
        let (mut from, mut stroke) = (0.0, light(laser.gate, laser.power));
        for edge in laser.edges() {
            let to = (f64::from(edge.offset) / whole).min(1.0);
            spans.add(LitSpan { from, to, stroke });
            (from, stroke) = (to, light(edge.gate, edge.power));
        }
        spans.add(LitSpan { from, to: 1.0, stroke });
        spans
    }

    fn add(&mut self, span: LitSpan) {
        if span.stroke == 0 || span.to <= span.from {
            return;
        }
        let joined = self.count.checked_sub(1).and_then(|last| self.spans.get_mut(last));
        match joined {
            Some(last) if last.to >= span.from && last.stroke == span.stroke => last.to = span.to,
            _ => {
                if let Some(free) = self.spans.get_mut(self.count) {
                    *free = span;
                    self.count += 1;
                }
            }
        }
    }

    /// The spans.
    pub fn as_slice(&self) -> &[LitSpan] {
        self.spans.get(..self.count).unwrap_or(&[])
    }

    /// Whether the whole interval is lit for one stroke.
    pub fn is_whole(&self) -> bool {
        matches!(self.as_slice(), [span] if (span.from, span.to) == (0.0, 1.0))
    }

    /// Share of the interval that is lit, 0..=1.
    pub fn share(&self) -> f64 {
        // An empty sum of floats is −0, which a table would show.
        self.as_slice().iter().fold(0.0, |share, span| share + (span.to - span.from))
    }
}

/// The cubic from `start` to `end` whose tangents are central differences with the neighbours,
/// or the chord where a neighbour is missing. Neighbours may be as far away in time as `apart` says,
/// in units of the time from start to end: the differences are those of the parabola through three
/// points then.
fn hermite(
    before: Option<Vector3<f64>>,
    start: Vector3<f64>,
    end: Vector3<f64>,
    after: Option<Vector3<f64>>,
    apart: [f64; 2],
    part: f64,
) -> Vector3<f64> {
    let chord = end - start;
    let uneven = |outside: Vector3<f64>, apart: f64| {
        (chord * apart + outside * (1.0 / apart)) * (1.0 / (1.0 + apart))
    };
    let leaving = before.map_or(chord, |before| match apart[0] {
        1.0 => (end - before) * 0.5,
        apart => uneven(start - before, apart),
    });
    let arriving = after.map_or(chord, |after| match apart[1] {
        1.0 => (after - start) * 0.5,
        apart => uneven(after - end, apart),
    });
    let rest = 1.0 - part;
    start + chord * (part * part * (3.0 - 2.0 * part)) + leaving * (part * rest * rest)
        - arriving * (part * part * rest)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use messages::time::SETPOINT_TIME as CYCLE_TIME;
    use messages::{Cycle, Feedback, GateEdge};

    fn moment(cycle: u64, tool: Vector3<f64>) -> Moment {
        let feedback = Feedback { cycle: Cycle(cycle), ..Feedback::default() };
        Moment {
            period: Period::OF_SETPOINTS,
            stamp: Stamp::of(&feedback),
            tool,
            tool_known: true,
            planned: Some(tool),
            laser: LaserCycle::OFF,
            asked: Asked { stroke: cycle, ..Asked::default() },
            in_force: cycle.checked_sub(1),
            kept_dark: false,
        }
    }

    /// The tool on a path of constant jerk 500 m/s³ from 10 m/s², 0.25 m/s.
    fn path(time: f64) -> Vector3<f64> {
        Vector3::new(
            0.25 * time + 5.0 * time * time - 500.0 / 6.0 * time * time * time,
            0.1 * time,
            0.0,
        )
    }

    #[test]
    fn interpolation_error_is_far_below_a_micrometre() {
        let mut window = ToolPath::default();
        let mut worst = 0.0_f64;
        for cycle in 0..20 {
            if let Some(interval) = window.push(moment(cycle, path(cycle as f64 * CYCLE_TIME)))
                && interval.before.is_some()
            {
                for part in [0.0, 0.2, 0.5, 0.77, 1.0] {
                    let time = (interval.start.stamp.cycle as f64 + part) * CYCLE_TIME;
                    worst = worst.max((interval.tool(part) - path(time)).norm());
                }
                let time = interval.start.stamp.cycle as f64 * CYCLE_TIME;
                let velocity = 0.25 + 10.0 * time - 250.0 * time * time;
                let speed = (velocity * velocity + 0.01).sqrt();
                let tolerance = if interval.earliest.is_some() { 1e-9 } else { 1e-4 };
                assert!((interval.speed_at_start() - speed).abs() < tolerance);
            }
        }
        assert!(worst < 1.1e-8, "{worst:e}");
    }

    #[test]
    fn the_commanded_stroke_is_that_of_the_command_in_force() {
        // Every command names its own cycle as stroke; drives says which one it follows.
        for (in_force, expect) in [(None, 0), (Some(3), 0), (Some(4), 4), (Some(5), 5)] {
            let mut window = ToolPath::default();
            for cycle in 3..7 {
                let in_force = if cycle == 6 { in_force } else { None };
                window.push(Moment { in_force, ..moment(cycle, Vector3::zeros()) });
            }
            window.push(moment(7, Vector3::zeros()));
            // The cycle from 6 to 7, with two moments before it.
            let interval = window.finish().unwrap();
            let stroke = interval.commanded().map_or(0, |asked| asked.stroke);
            assert_eq!(stroke, expect, "{in_force:?}");
        }
    }

    #[test]
    fn nothing_is_joined_across_a_gap() {
        let mut window = ToolPath::default();
        assert!(window.push(moment(4, Vector3::zeros())).is_none());
        assert!(window.push(moment(5, Vector3::zeros())).is_none());
        assert_eq!(window.push(moment(6, Vector3::zeros())).unwrap().end.stamp.cycle, 5);
        // The last cycle before the gap, which waited for its neighbour.
        let last = window.push(moment(8, Vector3::zeros())).unwrap();
        assert_eq!((last.end.stamp.cycle, last.is_surrounded()), (6, false));
        assert!(window.push(moment(9, Vector3::zeros())).is_none());
        let first = window.push(moment(10, Vector3::zeros())).unwrap();
        assert_eq!((first.start.stamp.cycle, first.is_surrounded()), (8, false));
        assert_eq!(window.finish().unwrap().end.stamp.cycle, 10);
        assert!(window.finish().is_none());
    }

    #[test]
    fn skipped_cycles_are_one_long_interval() {
        // Five cycles left out after cycle 9; the light of that cycle goes out 30 µs after its end.
        let mut window = ToolPath::default();
        let mut worst = 0.0_f64;
        let mut long = None;
        for cycle in (0..10).chain(15..20) {
            let mut moment = moment(cycle, path(cycle as f64 * CYCLE_TIME));
            if cycle == 15 {
                moment.stamp.elapsed = 6;
                moment.laser = LaserCycle { gate: 7, power: 0.8, ..LaserCycle::OFF };
                assert!(moment.laser.push(GateEdge { offset: 1_030_000, gate: 0, power: 0.0 }));
            }
            let Some(interval) = window.push(moment) else { continue };
            let start = interval.start.stamp.cycle as f64;
            for part in [0.0, 0.1, 0.5, 0.9, 1.0] {
                let time = (start + part * interval.end.stamp.elapsed as f64) * CYCLE_TIME;
                if interval.before.is_some() {
                    worst = worst.max((interval.tool(part) - path(time)).norm());
                }
            }
            if interval.end.stamp.elapsed == 6 {
                long = Some(interval);
            }
        }
        // jerk·h³/48 over six cycles is 2.3 µm, and somewhat more between uneven neighbours.
        assert!(worst < 4e-6, "{worst:e}");
        let long = long.unwrap();
        assert_eq!(
            (long.start.stamp.cycle, long.end.stamp.cycle, long.time()),
            (9, 15, 6.0 * CYCLE_TIME)
        );
        let lit = LitSpan { from: 0.0, to: 1.03 / 6.0, stroke: 7 };
        assert_eq!(long.lit().as_slice(), [lit]);
        let chord = (long.end.tool - long.start.tool).norm() / long.time();
        assert_eq!(long.speed_at_start(), chord);
    }

    #[test]
    fn spans_follow_gate_and_power() {
        let check = |gate: u32, edges: &[(u32, u32, f64)], expect: &[(f64, f64, u64)]| {
            let mut laser = LaserCycle { gate, power: 0.8, ..LaserCycle::OFF };
            for &(offset, gate, power) in edges {
                assert!(laser.push(GateEdge { offset, gate, power }));
            }
            let spans = LitSpans::of(&laser, Period::OF_SETPOINTS.time());
            let found: Vec<_> =
                spans.as_slice().iter().map(|span| (span.from, span.to, span.stroke)).collect();
            assert_eq!(found, expect, "{gate} {edges:?}");
            assert_eq!(spans.is_whole(), matches!(expect, [(0.0, 1.0, _)]), "{gate} {edges:?}");
        };
        check(0, &[], &[]);
        check(7, &[], &[(0.0, 1.0, 7)]);
        check(7, &[(300_000, 0, 0.0)], &[(0.0, 0.3, 7)]);
        check(0, &[(300_000, 7, 0.5)], &[(0.3, 1.0, 7)]);
        check(7, &[(200_000, 7, 0.4), (500_000, 7, 0.0)], &[(0.0, 0.5, 7)]);
        check(7, &[(100_000, 0, 0.0), (100_000, 7, 0.5)], &[(0.0, 1.0, 7)]);
        check(
            0,
            &[(0, 7, 1.0), (250_000, 0, 0.0), (750_000, 7, 1.0)],
            &[(0.0, 0.25, 7), (0.75, 1.0, 7)],
        );
    }

    #[test]
    fn spans_of_two_strokes_touch_and_are_not_joined() {
        let spans = |gate: u32, edges: &[(u32, u32)]| {
            let mut laser = LaserCycle { gate, power: 0.8, ..LaserCycle::OFF };
            for &(offset, gate) in edges {
                assert!(laser.push(GateEdge { offset, gate, power: 0.8 }));
            }
            LitSpans::of(&laser, Period::OF_SETPOINTS.time())
        };
        let first = LitSpan { from: 0.0, to: 0.4, stroke: 7 };
        let second = LitSpan { from: 0.4, to: 1.0, stroke: 8 };
        for edges in [&[(400_000, 8)][..], &[(400_000, 0), (400_000, 8)]] {
            let spans = spans(7, edges);
            assert_eq!(spans.as_slice(), [first, second], "{edges:?}");
            assert!(!spans.is_whole() && spans.share() == 1.0, "{edges:?}");
        }
        // An edge at the very start of the cycle leaves nothing of the gate before it.
        let whole = LitSpan { from: 0.0, to: 1.0, stroke: 8 };
        assert_eq!(spans(7, &[(0, 8)]).as_slice(), [whole]);
    }
}
