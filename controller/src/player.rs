//! Plays the stream: which stream time belongs to which deadline, and how a hold, a resume, a
//! pause and a dry stream change that.
//!
//! Three instants are in the making. `now` belongs to the feedback that is being answered, `next`
//! to the deadline at which the answer takes effect, `after` to the one at which it ends. `next`
//! was promised by the previous command, so a decision taken now acts from `next` on: the gate at
//! once, the rate up to `after`. Drives with a [latency](crate::latency) have `next` and `after` so many cycles
//! later, and `now` stays that of the feedback.
//!
//! A hold closes the gate at `next`, with all light before that given, and brakes. The point where it closed stays the boundary of
//! the dark. A resume goes back the way that it takes to come up to full rate and a little more, and
//! lights exactly where light was first left out; where limits hinder the rate, below full rate and with
//! power in proportion. Where no light was left out, nothing is played again.

use crate::gate::{self, Strength, Stretch};
use crate::latency::Latencies;
use crate::light::Given;
use crate::lookahead::Lookahead;
use crate::motion_limits::{Course, MotionLimits};
use crate::ramp::{Pace, Ramp, Rate, Slew};
use crate::rapids::Rapids;
use crate::stream_time::{ONE, StreamTime};
use machine::Machine;
use messages::delay::Recent;
use messages::setpoint::flags;
use messages::{LaserCycle, Nanoseconds, TooManyEdges};

/// The overrides that can be asked for.
const OVERRIDES: core::ops::RangeInclusive<f64> = 0.1..=2.0;

/// Setpoints never played into while more may come: the neighbours of an interpolation, and those
/// whose motion the next ones tell.
const RESERVE: StreamTime = StreamTime(4 * ONE);

/// A stop that keeps the limits may take this many times the distance of one at the full ramp; then it ignores
/// them.
const HINDRANCE: i64 = 2;

/// Time after which a stop ignores the limits. Within the limits, planned motion stops in half of it.
const PATIENCE: Nanoseconds = Nanoseconds(400_000_000);

/// Setpoints in hand with which nothing can run dry: [`HINDRANCE`] times a stop from rate 1, and more.
const PLENTY: StreamTime = StreamTime(512 * ONE);

/// Setpoints that a rewind goes further back than the way up to rate, so that the rate is steady
/// where the light comes back.
const STEADY: StreamTime = StreamTime(6 * ONE);

/// One deadline and what of the stream belongs to it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Instant {
    /// Stream time.
    pub time: StreamTime,
    /// Rate there, 1 as planned.
    pub rate: f64,
    /// Its change over the cycle before [1/s].
    pub rate_change: f64,
}

/// What the player came upon.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Event {
    /// Nothing.
    None,
    /// The program pauses at `after`, and no light before it was left out.
    Paused,
    /// The stream ends at `after`.
    Ended,
    /// No more may be played without the distance to stop; braking.
    Starved,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Activity {
    /// Standing.
    Resting,
    /// Going forward; the slew is the one to and from rest until the rate is reached.
    Playing(Slew),
    /// Coming to rest, for so many cycles by now.
    Braking(u64),
    /// Going back in the dark, to rest at about this time.
    Rewinding(StreamTime),
    /// Coming to rest before going forward again.
    Turning,
}

/// The player.
#[derive(Debug, Clone)]
pub struct Player {
    pace: Pace,
    /// Cycles after which a stop ignores the limits.
    patience: u64,
    next: Instant,
    after: Instant,
    /// The instants that `next` has been, from the newest one back to that of the feedback.
    recent: Recent<Instant>,
    /// How far commands have come at most.
    reached: StreamTime,
    ramp: Ramp,
    activity: Activity,
    /// Whether the stretch from `next` to `after` may be lit.
    marking: bool,
    dark_until: StreamTime,
    /// Where light beyond `dark_until` was first left out.
    unlit_from: Option<StreamTime>,
    /// Whether the stream promises to be at rest here: its start, or a pause.
    at_planned_rest: bool,
    /// Pauses below this sequence number have been kept.
    paused_until: u64,
    limits: MotionLimits,
    /// The least power at which the source gives light, 0..=1.
    min_power: f64,
    /// The override asked for.
    asked: f64,
    rapids: Rapids,
    /// The most that the rate may be here, 1 outside slow rapids.
    most: f64,
    /// The override of the power.
    power: f64,
    /// The most power of a frame, 0..=1.
    frame_power: f64,
}

impl Player {
    /// For this machine, before the first setpoint of a stream, at the planned rate.
    pub fn new(machine: &Machine) -> Self {
        let period = machine.realtime.period;
        let pace = Pace::new(period);
        Self {
            rapids: Rapids::new(&pace, STEADY),
            most: 1.0,
            pace,
            patience: period.cycles_for(PATIENCE),
            next: Instant::default(),
            after: Instant::default(),
            recent: Recent::of(Instant::default(), Latencies::of(machine).ahead + 2),
            reached: StreamTime::default(),
            ramp: Ramp::new(),
            activity: Activity::Resting,
            marking: false,
            dark_until: StreamTime::default(),
            unlit_from: None,
            at_planned_rest: true,
            paused_until: 0,
            limits: MotionLimits::new(machine),
            min_power: machine.laser.min_power,
            asked: 1.0,
            power: 1.0,
            frame_power: machine.operating.safety.frame_power,
        }
    }

    /// Back to before the first setpoint; the overrides stay.
    pub fn rewind(&mut self) {
        (self.next, self.after) = Default::default();
        self.recent.fill(Instant::default());
        self.reached = StreamTime::default();
        self.ramp = Ramp::new();
        (self.activity, self.marking) = (Activity::Resting, false);
        (self.dark_until, self.unlit_from) = Default::default();
        (self.at_planned_rest, self.paused_until) = (true, 0);
        self.rapids.forget();
        self.most = 1.0;
    }

    /// Plays rapids at `rate` at most from now on. `false` and no change when it is not within 0.1..=1.
    #[must_use]
    pub fn ask_rapids(&mut self, rate: f64) -> bool {
        self.rapids.ask(rate)
    }

    /// The rate of rapids asked for.
    pub fn asked_rapids(&self) -> f64 {
        self.rapids.asked()
    }

    /// Plays at `rate` from now on, or as planned where that is more: to plan faster is the planner's.
    /// `false` and no change when it is not within 0.1..=2.
    #[must_use]
    pub fn ask_rate(&mut self, rate: f64) -> bool {
        let allowed = OVERRIDES.contains(&rate);
        if allowed {
            self.asked = rate;
        }
        allowed
    }

    /// Asks for `power` times the power that the stream asks for, full power at most. `false` and no change when it is not
    /// within 0.1..=2.
    #[must_use]
    pub fn ask_power(&mut self, power: f64) -> bool {
        let allowed = OVERRIDES.contains(&power);
        if allowed {
            self.power = power;
        }
        allowed
    }

    /// So many times the power that the stream asks for is given.
    pub fn power_override(&self) -> f64 {
        self.power
    }

    /// The power as the stream asks for it: what was asked for one job is not for the next.
    pub fn end_power_override(&mut self) {
        self.power = 1.0;
    }

    /// The rate asked for.
    pub fn asked_rate(&self) -> f64 {
        self.asked
    }

    /// The rate to play at.
    fn wanted(&self) -> Rate {
        Rate::nearest(self.asked.min(self.most))
    }

    /// The instant of the feedback.
    pub fn now(&self) -> Instant {
        *self.recent.back(self.recent.count() - 1)
    }

    /// The deadline at which the newest decision takes effect.
    pub fn next(&self) -> Instant {
        self.next
    }

    /// The deadline after that one.
    pub fn after(&self) -> Instant {
        self.after
    }

    /// Whether nothing moves, as far as commands have gone out.
    pub fn is_at_rest(&self) -> bool {
        self.is_resting() && self.now().time == self.after.time
    }

    /// Whether it waits for [`Self::resume`].
    pub fn is_resting(&self) -> bool {
        self.activity == Activity::Resting
    }

    /// Whether light was left out that the stream has not come back to yet.
    pub fn has_missed_light(&self) -> bool {
        self.unlit_from.is_some()
    }

    /// Closes the gate from `next` on and comes to rest along the path.
    pub fn hold(&mut self) {
        match self.activity {
            // `after` is what the coming `advance` makes `next`.
            Activity::Playing(_) => self.brake_in_the_dark(self.after.time),
            Activity::Rewinding(_) | Activity::Turning => self.activity = Activity::Braking(0),
            Activity::Resting | Activity::Braking(_) => {}
        }
    }

    /// Light from `from` on is not given, though it was to be: brakes, and goes back for it with a resume.
    pub fn lose(&mut self, from: StreamTime) {
        self.marking = false;
        self.activity = Activity::Braking(0);
        (self.dark_until, self.unlit_from) = (from, Some(from));
        // A pause behind it is kept once more, with that light given.
        self.paused_until = self.paused_until.min(from.sequence() + 1);
    }

    /// Whether light is due from `from` on before the stream has been played for `cycles` more.
    pub fn is_lit_soon(&self, from: StreamTime, cycles: u64, lookahead: &Lookahead) -> bool {
        let passed = StreamTime::in_cycles(cycles, self.pace.period());
        matches!(self.activity, Activity::Playing(_))
            && lookahead.is_lit(from, self.after.time + passed)
    }

    /// Brakes; the gate was last open before `from`.
    fn brake_in_the_dark(&mut self, from: StreamTime) {
        if from >= self.dark_until {
            self.dark_until = from;
            self.unlit_from = None;
        }
        self.activity = Activity::Braking(0);
    }

    /// Goes on from rest: at once where the stream itself rests, else from as far back as the
    /// light needs.
    pub fn resume(&mut self, lookahead: &Lookahead) {
        if !self.is_resting() {
            return;
        }
        let here = self.after.time;
        // Where the limits hinder it, light comes back before that, with its power in proportion.
        let start = Ramp::starting_distance(self.wanted(), &self.pace) + STEADY;
        let resting = self.at_planned_rest || lookahead.is_resting(here);
        let light_ahead = !resting && lookahead.may_be_lit(here, here + start);
        let light_from = self.unlit_from.or(light_ahead.then_some(here));
        match light_from.map(|light| light - start) {
            Some(back) if back < here => self.activity = Activity::Rewinding(back),
            _ => self.set_off(resting, lookahead),
        }
        self.at_planned_rest = false;
    }

    /// From rest forward: where the stream rests too, the rate may jump, to one with the distance to stop
    /// in hand.
    fn set_off(&mut self, resting: bool, lookahead: &Lookahead) {
        let even = Ramp::even(self.wanted());
        let stop = StreamTime(HINDRANCE * even.stopping_distance(&self.pace).0);
        let enough = lookahead.is_complete() || self.after.time + stop <= lookahead.end() - RESERVE;
        self.activity = if resting && enough {
            self.ramp = even;
            Activity::Playing(self.pace.gentle)
        } else {
            Activity::Playing(self.pace.stop)
        };
    }

    /// Goes on by one cycle.
    pub fn advance(&mut self, lookahead: &Lookahead) -> Event {
        if self.marking && self.unlit_from.is_some_and(|from| from < self.after.time) {
            self.unlit_from = None;
        }
        self.next = self.after;
        self.recent.push(self.next);
        self.reached = self.reached.max(self.recent.back(self.recent.count() - 2).time);
        self.marking = matches!(self.activity, Activity::Playing(_));
        let from = self.next.time;
        if self.activity == Activity::Resting {
            self.after = Instant { time: from, rate: 0.0, rate_change: 0.0 };
            return Event::None;
        }
        self.most = self.rapids.rate_at(from, lookahead);
        let before = self.ramp;
        let mut event = self.change_rate(lookahead, from);
        // There always is enough in hand to stop: nothing is played beyond it, whatever happens.
        let time = (from + self.ramp.advance(before, &self.pace)).min(lookahead.end().max(from));
        let reached = self.ramp.rate().value();
        self.after = Instant { time, rate: reached, rate_change: self.rate_change(reached) };
        if time < StreamTime::default() {
            // Back at the first setpoint, where the stream rests.
            self.stop_at(StreamTime::default());
            if matches!(self.activity, Activity::Braking(_)) {
                self.activity = Activity::Resting;
            } else {
                self.set_off(true, lookahead);
            }
        } else if let Some((sequence, found)) = self.planned_rest(lookahead) {
            // A planned rest on the way is as good a place to stop as any.
            let playing = matches!(self.activity, Activity::Playing(_));
            self.stop_at(StreamTime::of(sequence));
            self.activity = Activity::Resting;
            self.at_planned_rest = true;
            self.note_dark(lookahead);
            // Where light was left out before it, the stream will come here once more.
            if playing || self.unlit_from.is_none() {
                self.paused_until = sequence + 1;
                event = found;
            }
        } else if self.ramp.is_still() {
            match self.activity {
                Activity::Turning => {
                    self.set_off(lookahead.is_resting(self.after.time), lookahead);
                }
                Activity::Braking(_) => self.activity = Activity::Resting,
                _ => {}
            }
        }
        self.note_dark(lookahead);
        event
    }

    /// Remembers where light beyond `dark_until` is first left out.
    fn note_dark(&mut self, lookahead: &Lookahead) {
        if !self.marking && self.unlit_from.is_none() && self.is_light_due(lookahead) {
            self.unlit_from = Some(self.next.time.max(self.dark_until));
        }
    }

    /// Whether the stream has light between `next` and `after` that was not given before.
    fn is_light_due(&self, lookahead: &Lookahead) -> bool {
        // More of it than can be told is light too.
        self.light(lookahead).map_or(true, |cycle| cycle.is_lit())
    }

    /// One cycle of the rate, from `from` on, as the activity asks and the limits allow; and what comes
    /// of that.
    fn change_rate(&mut self, lookahead: &Lookahead, from: StreamTime) -> Event {
        let (before, pace) = (self.ramp, self.pace);
        let toward = |target: Rate, slew: Slew| {
            let course = Course { lookahead, limits: &self.limits, period: pace.period() };
            before.toward(target, slew, &pace, &course, from)
        };
        let end = lookahead.end() - RESERVE;
        let scarce = !lookahead.is_complete() && from + PLENTY > end;
        let stops = |ramp: Ramp, times: i64| {
            from + ramp.advance(before, &pace) + StreamTime(times * ramp.stopping_distance(&pace).0)
        };
        let mut event = Event::None;
        self.ramp = match self.activity {
            Activity::Playing(slew) => {
                // Rapids are dark: the rate may change as it does to and from rest.
                let slew = if self.rapids.asked() < 1.0 { pace.stop } else { slew };
                let ramp = toward(self.wanted(), slew);
                if scarce && stops(ramp, HINDRANCE) > end {
                    event = Event::Starved;
                    let ramp = toward(Rate::ZERO, pace.stop);
                    self.brake_in_the_dark(from);
                    self.marking = false;
                    ramp
                } else {
                    if ramp.is_even_at(self.wanted()) {
                        self.activity = Activity::Playing(self.pace.gentle);
                    }
                    ramp
                }
            }
            Activity::Rewinding(back) => {
                let ramp = toward(Rate(-Rate::ONE.0), pace.stop);
                if stops(ramp, 1) < back {
                    let ramp = toward(Rate::ZERO, pace.stop);
                    self.activity = Activity::Turning;
                    ramp
                } else {
                    ramp
                }
            }
            Activity::Braking(cycles) if cycles >= self.patience => {
                before.unhindered(Rate::ZERO, pace.stop)
            }
            Activity::Braking(cycles) => {
                self.activity = Activity::Braking(cycles + 1);
                toward(Rate::ZERO, pace.stop)
            }
            Activity::Resting | Activity::Turning => toward(Rate::ZERO, pace.stop),
        };
        // There is no more way to wait for room on, ahead or back.
        let too_far = scarce && stops(self.ramp, 1) > end;
        let beginning = lookahead.beginning();
        // Whoever goes forwards stops ahead.
        let goes_back = self.ramp.rate() < Rate::ZERO
            || matches!(self.activity, Activity::Rewinding(_) | Activity::Turning);
        let too_far_back = goes_back
            && beginning > StreamTime::default()
            && stops(self.ramp, 1) < beginning + RESERVE;
        if too_far || too_far_back {
            self.ramp = before.unhindered(Rate::ZERO, pace.stop);
        }
        if too_far_back && matches!(self.activity, Activity::Rewinding(_)) {
            self.activity = Activity::Turning;
        }
        event
    }

    /// The light from `next` to `after`.
    pub fn given(&self, lookahead: &Lookahead) -> Given {
        let dark = || Ok(gate::dark(lookahead, self.next.time));
        Given {
            laser: if self.marking { self.light(lookahead) } else { dark() },
            from: self.next.time,
            to: self.after.time,
            dark_until: self.dark_until,
        }
    }

    /// What the stream has of light between `next` and `after` that was not given before.
    fn light(&self, lookahead: &Lookahead) -> Result<LaserCycle, TooManyEdges> {
        let period = self.pace.period();
        let stretch = Stretch { from: self.next.time, to: self.after.time, period };
        let is_frame = lookahead.setpoint(self.next.time.sequence()).has(flags::FRAME);
        let most = if is_frame { self.frame_power } else { 1.0 };
        let strength = Strength { least: self.min_power, share: self.power, most };
        gate::laser(lookahead, stretch, self.dark_until, strength)
    }

    /// Where the digital outputs stand: they do not go back with a rewind.
    pub fn outputs_at(&self) -> StreamTime {
        self.reached
    }

    /// The setpoint where the stream itself rests that `after` has come to, and whether the program
    /// pauses or ends there.
    fn planned_rest(&self, lookahead: &Lookahead) -> Option<(u64, Event)> {
        let first = self.next.time.sequence() + 1;
        (first..=self.after.time.sequence()).find_map(|sequence| {
            let setpoint = lookahead.setpoint(sequence);
            let pauses = setpoint.has(flags::PAUSE) && sequence >= self.paused_until;
            let ends = lookahead.is_complete() && StreamTime::of(sequence) >= lookahead.end();
            let found = if ends { Event::Ended } else { Event::Paused };
            (pauses || ends).then_some((sequence, found))
        })
    }

    /// Rests at `time` at once; only where the stream rests.
    fn stop_at(&mut self, time: StreamTime) {
        self.ramp = Ramp::new();
        self.after = Instant { time, rate: 0.0, rate_change: 0.0 };
    }

    fn rate_change(&self, reached: f64) -> f64 {
        // Out of a planned rest the rate jumps, but nothing moves there.
        let from_rest = self.next.rate == 0.0 && reached.abs() > 0.05;
        if from_rest { 0.0 } else { (reached - self.next.rate) / self.pace.period().seconds() }
    }
}
