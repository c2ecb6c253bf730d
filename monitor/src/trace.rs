//! What the report draws of a run, thinned as it is collected: an hour takes the memory of a
//! second, and no extreme is lost.

pub mod envelope;
pub mod outline;

use crate::marks::tool_path::{Interval, LitSpan, LitSpans, Moment, ToolPath};
use crate::recording::CycleRecord;
use crate::recording::continuity::Succession;
use envelope::Envelope;
use messages::hop::{Hop, latencies};
use messages::time::Period;
use messages::{LaserCycle, MAX_ACTUATORS, Nanoseconds};
use outline::{Outline, OutlinePoint};

/// Share of `time` in which the laser marked, 0..=1.
pub fn lit_share(laser: &LaserCycle, time: Nanoseconds) -> f64 {
    LitSpans::of(laser, time).share()
}

/// The longest time of skipped cycles that the curves show as a gap; a longer one looks no different.
const LONGEST_GAP: Nanoseconds = Nanoseconds(60_000_000_000);

/// The curves of a run over time and its paths in the plane.
#[derive(Debug)]
pub struct Trace {
    /// The period of the cycle.
    pub period: Period,
    path: ToolPath,
    waiting: Option<CycleRecord>,
    timed: bool,
    /// Paths of the tool with the laser on, from edge to edge.
    pub marked: Outline,
    /// Paths of the tool in the dark.
    pub dark: Outline,
    /// Distance of the tool from the plan while lit [m].
    pub deviation_lit: Envelope,
    /// Distance of the tool from the plan in the dark, while a stream is played [m].
    pub deviation_dark: Envelope,
    /// Speed of the tool [m/s].
    pub speed: Envelope,
    /// Power of the laser at its largest in the cycle, fraction of full scale.
    pub power: Envelope,
    /// Reference minus feedback per actuator [rad at the motor].
    pub following_error: [Envelope; MAX_ACTUATORS],
    /// Measured current per actuator [A].
    pub current: [Envelope; MAX_ACTUATORS],
    /// Commanded voltage per actuator, in volts.
    pub voltage: [Envelope; MAX_ACTUATORS],
    /// Latency per hop, in the order of [`Hop::ALL`], in seconds; empty in virtual time.
    pub latency: [Envelope; Hop::ALL.len()],
}

impl Trace {
    /// An empty trace of cycles of this `period`; `timed` tells whether the samples' stamps are those of a
    /// real clock.
    pub fn new(timed: bool, period: Period) -> Self {
        Self {
            period,
            path: ToolPath::default(),
            waiting: None,
            timed,
            marked: Outline::default(),
            dark: Outline::default(),
            deviation_lit: Envelope::default(),
            deviation_dark: Envelope::default(),
            speed: Envelope::default(),
            power: Envelope::default(),
            following_error: std::array::from_fn(|_| Envelope::default()),
            current: std::array::from_fn(|_| Envelope::default()),
            voltage: std::array::from_fn(|_| Envelope::default()),
            latency: std::array::from_fn(|_| Envelope::default()),
        }
    }

    /// Takes the next record. Over cycles that nobody recorded the curves have a gap.
    pub fn push(&mut self, record: &CycleRecord) {
        let CycleRecord { feedback, command } = record;
        let moment = Moment::of(record, self.period);
        let succession = self.path.succession(&moment);
        let absent = match succession {
            Succession::After(gap) => gap.cycles(),
            Succession::Next | Succession::Apart => 0,
        };
        self.of_records().for_each(|envelope| envelope.skip(absent));
        let answered = record.is_answered();
        for _ in 0..u64::from(feedback.skipped).min(self.period.cycles_for(LONGEST_GAP)) {
            let curves = [&mut self.following_error, &mut self.current, &mut self.voltage];
            curves.into_iter().flatten().for_each(|envelope| envelope.push(None));
            if self.timed {
                self.latency.iter_mut().for_each(|envelope| envelope.push(None));
            }
        }
        for index in 0..MAX_ACTUATORS {
            let pick = |values: &messages::ActuatorArray| values.get(index).copied();
            let curves = [
                (&mut self.following_error, answered, &command.following_error),
                (&mut self.current, true, &feedback.current),
                (&mut self.voltage, answered, &command.voltage),
            ];
            for (envelopes, known, values) in curves {
                if let Some(envelope) = envelopes.get_mut(index) {
                    envelope.push(pick(values).filter(|_| known));
                }
            }
        }
        if self.timed {
            self.push_latency(record);
        }
        if let Some(interval) = self.path.push(moment) {
            self.interval(&interval);
        }
        if succession != Succession::Next {
            // A cycle needs the records at both its ends: one more of them is not known.
            self.of_intervals().for_each(|envelope| envelope.skip(absent + 1));
            self.marked.end();
            self.dark.end();
        }
    }

    /// The curves with a value for each record.
    fn of_records(&mut self) -> impl Iterator<Item = &mut Envelope> {
        let latency = self.latency.iter_mut().filter(|_| self.timed);
        let motors = self.following_error.iter_mut().chain(&mut self.current);
        motors.chain(&mut self.voltage).chain(latency)
    }

    /// The curves with a value for each cycle between two records.
    fn of_intervals(&mut self) -> impl Iterator<Item = &mut Envelope> {
        [&mut self.deviation_lit, &mut self.deviation_dark, &mut self.speed, &mut self.power]
            .into_iter()
    }

    /// Ends the trace: the last cycle has no neighbour to wait for.
    pub fn finish(&mut self) {
        if let Some(interval) = self.path.finish() {
            self.interval(&interval);
        }
        self.marked.end();
        self.dark.end();
    }

    fn push_latency(&mut self, record: &CycleRecord) {
        let mut values = [None; Hop::ALL.len()];
        if let Some(answered) = self.waiting.replace(*record)
            && answered.is_answered()
        {
            for (hop, latency) in latencies(&answered.feedback, &answered.command, &record.feedback)
            {
                if let Some(value) = values.get_mut(hop as usize) {
                    *value = Some(latency.seconds());
                }
            }
        }
        for (envelope, value) in self.latency.iter_mut().zip(values) {
            envelope.push(value);
        }
    }

    fn interval(&mut self, interval: &Interval) {
        for _ in 1..interval.end.stamp.elapsed.min(self.period.cycles_for(LONGEST_GAP)) {
            let curves = [
                &mut self.power,
                &mut self.speed,
                &mut self.deviation_lit,
                &mut self.deviation_dark,
            ];
            curves.into_iter().for_each(|envelope| envelope.push(None));
        }
        let laser = &interval.end.laser;
        let power = laser.edges().iter().map(|edge| (edge.gate, edge.power));
        let brightest = std::iter::once((laser.gate, laser.power))
            .chain(power)
            .filter(|(gate, _)| *gate != 0)
            .fold(0.0_f64, |brightest, (_, power)| brightest.max(power));
        self.power.push(Some(brightest));
        let known = interval.tool_known();
        self.speed.push(known.then(|| interval.speed_at_start()));
        let lit = interval.lit();
        let deviation = interval.deviation(1.0).filter(|_| known).map(|distance| distance.norm());
        let any = !lit.as_slice().is_empty();
        self.deviation_lit.push(deviation.filter(|_| any));
        self.deviation_dark.push(deviation.filter(|_| !any && interval.end.planned.is_some()));
        if known {
            self.draw(interval, &lit);
        }
    }

    fn draw(&mut self, interval: &Interval, lit: &LitSpans) {
        let mut done = 0.0;
        for &LitSpan { from, to, .. } in lit.as_slice() {
            if from > done {
                self.marked.end();
                draw_part(&mut self.dark, interval, done, from);
            }
            if from > 0.0 {
                self.dark.end();
            }
            draw_part(&mut self.marked, interval, from, to);
            done = to;
        }
        if done < 1.0 {
            self.marked.end();
            draw_part(&mut self.dark, interval, done, 1.0);
        } else {
            self.dark.end();
        }
    }
}

fn draw_part(outline: &mut Outline, interval: &Interval, from: f64, to: f64) {
    for part in [from, 0.5 * (from + to), to] {
        let tool = interval.tool(part);
        let deviation = interval.deviation(part).unwrap_or_default();
        outline.add(OutlinePoint { tool: [tool.x, tool.y], deviation: [deviation.x, deviation.y] });
    }
}
