//! What the report draws of a run, thinned as it is collected: an hour takes the memory of a
//! second, and no extreme is lost.

pub mod envelope;
pub mod event;
pub mod track;

use crate::marks::tool_path::{Interval, LitSpan, LitSpans, Moment, ToolPath};
use crate::recording::CycleRecord;
use crate::recording::continuity::Succession;
use envelope::Envelope;
use event::Events;
use messages::hop::{Hop, latencies};
use messages::time::Period;
use messages::{LaserCycle, MAX_ACTUATORS, Nanoseconds};
use track::{Light, Track, TrackPoint};

/// Share of `time` in which the laser marked, 0..=1.
pub fn lit_share(laser: &LaserCycle, time: Nanoseconds) -> f64 {
    LitSpans::of(laser, time).share()
}

/// The longest time of skipped cycles that the curves show as a gap; a longer one looks no different.
const LONGEST_GAP: Nanoseconds = Nanoseconds(60_000_000_000);

/// The most straight parts of a lit or dark stretch of an interval.
const MOST_PARTS: u64 = 50;

/// The curves of a run over time and the way of its tool. All of them tell time from the first record on, in
/// which cycles that nobody recorded have their place.
#[derive(Debug)]
pub struct Trace {
    /// The period of the cycle.
    pub period: Period,
    path: ToolPath,
    waiting: Option<CycleRecord>,
    timed: bool,
    actuators: usize,
    /// Cycles before the next record.
    recorded: u64,
    /// Cycles before the next interval.
    passed: u64,
    /// Where the newest interval ends.
    tail: Option<TrackPoint>,
    /// The way of the tool.
    pub track: Track,
    /// What happened to the stream.
    pub events: Events,
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
            actuators: MAX_ACTUATORS,
            recorded: 0,
            passed: 0,
            tail: None,
            track: Track::default(),
            events: Events::default(),
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

    /// The same, of a machine with so many actuators.
    #[must_use]
    pub fn with_actuators(self, actuators: usize) -> Self {
        Self { actuators: actuators.min(MAX_ACTUATORS), ..self }
    }

    /// Time from the first record to the last [s].
    pub fn time(&self) -> f64 {
        self.period.of(self.passed).seconds()
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
        let skipped = u64::from(feedback.skipped).min(self.period.cycles_for(LONGEST_GAP));
        self.recorded += absent + skipped;
        for _ in 0..skipped {
            let curves = [&mut self.following_error, &mut self.current, &mut self.voltage];
            curves.into_iter().flatten().for_each(|envelope| envelope.push(None));
            if self.timed {
                self.latency.iter_mut().for_each(|envelope| envelope.push(None));
            }
        }
        for index in 0..self.actuators {
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
            self.passed += absent + 1;
            self.end_track();
        }
        self.events.push(self.recorded, record);
        self.recorded += 1;
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
        self.end_track();
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
        let elapsed = interval.end.stamp.elapsed.min(self.period.cycles_for(LONGEST_GAP));
        for _ in 1..elapsed {
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
            self.draw(interval, &lit, brightest);
        } else {
            self.end_track();
        }
        self.passed += elapsed;
    }

    fn draw(&mut self, interval: &Interval, lit: &LitSpans, power: f64) {
        let mut done = 0.0;
        for &LitSpan { from, to, stroke } in lit.as_slice() {
            if from > done {
                self.draw_part(interval, done, from, Light::Dark);
            }
            let stroke = u32::try_from(stroke).unwrap_or(u32::MAX);
            self.draw_part(interval, from, to, Light::Lit { stroke, power: power as f32 });
            done = to;
        }
        if done < 1.0 {
            self.draw_part(interval, done, 1.0, Light::Dark);
        }
    }

    /// Draws from part `from` to part `to` of an interval; its end is the next one's beginning.
    fn draw_part(&mut self, interval: &Interval, from: f64, to: f64, light: Light) {
        let begin = self.period.of(self.passed).seconds();
        let point = |part: f64, light: Light| {
            let deviation: [f64; 3] = interval.deviation(part).unwrap_or_default().into();
            TrackPoint {
                time: begin + part * interval.time(),
                tool: interval.tool(part).into(),
                deviation: deviation.map(|along| along as f32),
                light,
            }
        };
        // Cycles that drives skipped make a long interval: what lies between is not straight.
        let parts = interval.end.stamp.elapsed.min(MOST_PARTS);
        for step in 0..parts {
            let part = from + (to - from) * (step as f64 / parts as f64);
            self.track.add(point(part, light));
        }
        self.tail = Some(point(to, Light::Unknown));
    }

    /// Ends a stretch without a gap, at the end of its last interval.
    fn end_track(&mut self) {
        if let Some(tail) = self.tail.take() {
            self.track.add(tail);
        }
    }
}
