//! Plays the stream: which stream time belongs to which deadline, and how a hold, a resume, a
//! pause and a dry stream change that.
//!
//! Three instants are in the making. `now` belongs to the feedback that is being answered, `next`
//! to the deadline at which the answer takes effect, `after` to the one at which it ends. `next`
//! was promised by the previous command, so a decision taken now acts from `next` on: the gate at
//! once, the rate up to `after`.
//!
//! A hold closes the gate at `next` and brakes. The point where it closed stays the boundary of
//! the dark. A resume goes back far enough to be at full rate again where light was first left
//! out, and lights exactly there. Where none was left out, nothing is played again.

use crate::gate::{self, Stretch, TooManyEdges};
use crate::lookahead::Lookahead;
use crate::ramp::LARGEST_RATE;
use crate::ramp::{Ramp, Rate, Slew, rate_before};
use crate::stream_time::{ONE, StreamTime};
use crate::supervision::Elapsed;
use messages::LaserCycle;
use messages::setpoint::flags;
use messages::time::CYCLE_TIME;

/// The slowest that an override goes.
pub const SMALLEST_RATE: f64 = 0.1;

/// How far ahead rates are limited: slowing from the largest rate to the planned one may begin 878
/// setpoints before.
const HORIZON: StreamTime = StreamTime(960 * ONE);

/// Setpoints never played into while more may come: the neighbours of an interpolation.
const RESERVE: StreamTime = StreamTime(2 * ONE);

/// Setpoints that a rewind goes further back than the way up to rate, so that the rate is steady
/// where the light comes back.
const STEADY: StreamTime = StreamTime(4 * ONE);

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
    /// The program pauses at `after`.
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
    /// Coming to rest.
    Braking,
    /// Going back in the dark, to rest at about this time.
    Rewinding(StreamTime),
    /// Coming to rest before going forward again.
    Turning,
}

/// The player.
#[derive(Debug, Clone)]
pub struct Player {
    now: Instant,
    next: Instant,
    after: Instant,
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
    wanted: Rate,
}

impl Player {
    /// Before the first setpoint of a stream, at the planned rate.
    pub fn new() -> Self {
        Self {
            now: Instant::default(),
            next: Instant::default(),
            after: Instant::default(),
            ramp: Ramp::new(),
            activity: Activity::Resting,
            marking: false,
            dark_until: StreamTime::default(),
            unlit_from: None,
            at_planned_rest: true,
            paused_until: 0,
            wanted: Rate::ONE,
        }
    }

    /// Back to before the first setpoint; the wanted rate stays.
    pub fn rewind(&mut self) {
        *self = Self { wanted: self.wanted, ..Self::new() };
    }

    /// Plays at `rate` from now on, as far as the limits let it; `false` and no change when it is
    /// not within [`SMALLEST_RATE`]..=[`LARGEST_RATE`].
    #[must_use]
    pub fn set_rate(&mut self, rate: f64) -> bool {
        let allowed = (SMALLEST_RATE..=LARGEST_RATE).contains(&rate);
        if allowed {
            self.wanted = Rate::nearest(rate);
        }
        allowed
    }

    /// The rate asked for.
    pub fn wanted_rate(&self) -> f64 {
        self.wanted.value()
    }

    /// The instant of the feedback.
    pub fn now(&self) -> Instant {
        self.now
    }

    /// The deadline at which the command takes effect.
    pub fn next(&self) -> Instant {
        self.next
    }

    /// The deadline after that one.
    pub fn after(&self) -> Instant {
        self.after
    }

    /// Whether nothing moves, as far as commands have gone out.
    pub fn is_at_rest(&self) -> bool {
        self.is_resting() && self.now.time == self.after.time
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
            Activity::Rewinding(_) | Activity::Turning => self.activity = Activity::Braking,
            Activity::Resting | Activity::Braking => {}
        }
    }

    /// Of the `elapsed` cycles that the coming advances make up for, drives kept the last dark:
    /// brakes if light was lost in them, and gives the place where the first began.
    pub fn miss(&mut self, elapsed: Elapsed, lookahead: &Lookahead) -> Option<StreamTime> {
        // The command given last acts from `next` to `after`; for later cycles there was none.
        let sent = elapsed.missed >= elapsed.cycles && self.marking;
        let unsent = elapsed.cycles > 1 && matches!(self.activity, Activity::Playing(_));
        let cycles = elapsed.cycles.saturating_sub(1) as i64;
        let from = if sent { self.next.time } else { self.after.time };
        let from = from.max(self.dark_until);
        let to = self.after.time + StreamTime(cycles * LARGEST_RATE as i64 * ONE);
        let lost = elapsed.missed > 0 && (sent || unsent) && lookahead.is_lit(from, to);
        if !lost {
            return None;
        }
        self.brake_in_the_dark(from);
        self.marking = false;
        self.unlit_from = Some(from);
        Some(from)
    }

    /// The axes are off the plan at `next`, and need so many cycles to come back to it: brakes if light
    /// is due before that, and gives the place from which it is left out.
    pub fn unsettle(&mut self, cycles: u64, lookahead: &Lookahead) -> Option<StreamTime> {
        let from = self.next.time.max(self.dark_until);
        let playing = matches!(self.activity, Activity::Playing(_));
        let played = (cycles as f64 * self.after.rate.max(1.0)).ceil() as u64;
        if !playing || !lookahead.is_lit(from, self.after.time + StreamTime::of(played)) {
            return None;
        }
        self.brake_in_the_dark(from);
        self.marking = false;
        self.unlit_from = Some(from);
        Some(from)
    }

    /// Brakes; the gate was last open before `from`.
    fn brake_in_the_dark(&mut self, from: StreamTime) {
        if from >= self.dark_until {
            self.dark_until = from;
            self.unlit_from = None;
        }
        self.activity = Activity::Braking;
    }

    /// Goes on from rest: at once where the stream itself rests, else from as far back as the
    /// light needs.
    pub fn resume(&mut self, lookahead: &Lookahead) {
        if !self.is_resting() {
            return;
        }
        let here = self.after.time;
        let rate = self.rate_allowed(lookahead, here);
        let start = Ramp::starting_distance(rate, Slew::STOP) + STEADY;
        let resting = self.at_planned_rest || lookahead.is_resting(here);
        let light_ahead = !resting && lookahead.may_be_lit(here, here + start);
        let light_from = self.unlit_from.or(light_ahead.then_some(here));
        match light_from.map(|light| light - start) {
            Some(back) if back < here => self.activity = Activity::Rewinding(back),
            _ => self.set_off(lookahead, resting),
        }
        self.at_planned_rest = false;
    }

    /// From rest forward: where the stream rests too, the rate may jump.
    fn set_off(&mut self, lookahead: &Lookahead, resting: bool) {
        self.activity = if resting {
            self.ramp.jump(self.rate_allowed(lookahead, self.after.time));
            Activity::Playing(Slew::OVERRIDE)
        } else {
            Activity::Playing(Slew::STOP)
        };
    }

    /// Goes on by one cycle.
    pub fn advance(&mut self, lookahead: &Lookahead) -> Event {
        if self.marking && self.unlit_from.is_some_and(|from| from < self.after.time) {
            self.unlit_from = None;
        }
        self.now = self.next;
        self.next = self.after;
        self.marking = matches!(self.activity, Activity::Playing(_));
        let from = self.next.time;
        let mut event = Event::None;
        let rate = match self.activity {
            Activity::Resting => {
                self.after = Instant { time: from, rate: 0.0, rate_change: 0.0 };
                return event;
            }
            Activity::Playing(slew) => {
                let allowed = self.rate_allowed(lookahead, from);
                let rate = self.ramp.toward(allowed, slew);
                let reach = from + self.ramp.stopping_distance(rate, Slew::STOP) + RESERVE;
                if reach > lookahead.end() && !lookahead.is_complete() {
                    self.brake_in_the_dark(from);
                    self.marking = false;
                    event = Event::Starved;
                    self.ramp.toward(Rate::ZERO, Slew::STOP)
                } else {
                    if self.ramp.rate() == allowed.value() {
                        self.activity = Activity::Playing(Slew::OVERRIDE);
                    }
                    rate
                }
            }
            Activity::Rewinding(back) => {
                let rate = self.ramp.toward(Rate(-Rate::ONE.0), Slew::STOP);
                if from + self.ramp.stopping_distance(rate, Slew::STOP) < back {
                    self.activity = Activity::Turning;
                    self.ramp.toward(Rate::ZERO, Slew::STOP)
                } else {
                    rate
                }
            }
            Activity::Braking | Activity::Turning => self.ramp.toward(Rate::ZERO, Slew::STOP),
        };
        let time = from + self.ramp.advance(rate);
        let reached = self.ramp.rate();
        self.after = Instant { time, rate: reached, rate_change: self.rate_change(reached) };
        if time < StreamTime::default() {
            // Back at the first setpoint, where the stream rests.
            self.stop_at(StreamTime::default());
            if self.activity == Activity::Braking {
                self.activity = Activity::Resting;
            } else {
                self.set_off(lookahead, true);
            }
        } else if let Some(found) = self.planned_rest(lookahead) {
            // A planned rest on the way is as good a place to stop as any.
            let playing = matches!(self.activity, Activity::Playing(_));
            self.activity = Activity::Resting;
            self.at_planned_rest = true;
            if playing {
                event = found;
            }
        } else if self.ramp.is_still() {
            match self.activity {
                Activity::Turning => {
                    self.set_off(lookahead, lookahead.is_resting(self.after.time));
                }
                Activity::Braking => self.activity = Activity::Resting,
                _ => {}
            }
        }
        event
    }

    /// The laser from `next` to `after`.
    ///
    /// # Errors
    /// More edges than a cycle can hold.
    pub fn laser(&mut self, lookahead: &Lookahead) -> Result<LaserCycle, TooManyEdges> {
        let stretch = Stretch { from: self.next.time, to: self.after.time };
        let cycle = gate::laser(lookahead, stretch, self.dark_until);
        if self.marking {
            return cycle;
        }
        if cycle.map_or(true, |cycle| cycle.is_lit()) && self.unlit_from.is_none() {
            self.unlit_from = Some(stretch.from.max(self.dark_until));
        }
        Ok(LaserCycle::OFF)
    }

    /// Where the digital outputs stand: they do not go back with a rewind.
    pub fn outputs_at(&self) -> StreamTime {
        self.next.time.max(self.dark_until)
    }

    /// Whether `after` came to a setpoint where the stream itself rests; stops exactly there.
    fn planned_rest(&mut self, lookahead: &Lookahead) -> Option<Event> {
        let first = self.next.time.sequence() + 1;
        for sequence in first..=self.after.time.sequence() {
            let setpoint = lookahead.setpoint(sequence);
            let pauses = setpoint.has(flags::PAUSE) && sequence >= self.paused_until;
            let ends = lookahead.is_complete() && StreamTime::of(sequence) >= lookahead.end();
            if pauses || ends {
                self.paused_until = sequence + 1;
                self.stop_at(StreamTime::of(sequence));
                return Some(if ends { Event::Ended } else { Event::Paused });
            }
        }
        None
    }

    /// Rests at `time` at once; only where the stream rests.
    fn stop_at(&mut self, time: StreamTime) {
        self.ramp.jump(Rate::ZERO);
        self.after = Instant { time, rate: 0.0, rate_change: 0.0 };
    }

    fn rate_change(&self, reached: f64) -> f64 {
        // Out of a planned rest the rate jumps, but nothing moves there.
        let from_rest = self.next.rate == 0.0 && reached.abs() > 0.05;
        if from_rest { 0.0 } else { (reached - self.next.rate) / CYCLE_TIME }
    }

    fn rate_allowed(&self, lookahead: &Lookahead, from: StreamTime) -> Rate {
        if self.wanted <= Rate::ONE {
            return self.wanted;
        }
        let largest = lookahead.largest_rate(from, from + HORIZON, rate_before);
        self.wanted.min(Rate::below(largest))
    }
}

impl Default for Player {
    fn default() -> Self {
        Self::new()
    }
}
