//! An oscilloscope over the signals: what it is asked for, and what it shows next.

use crate::ring::Ring;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The most signals that are shown at once.
pub const MOST_SIGNALS: usize = 8;

/// The longest time that is shown [s].
pub const LONGEST: f64 = 10.0;

/// Without a trigger something is shown so often in automatic mode [s].
const AUTO_AFTER: f64 = 0.1;

/// Bytes that one page is sent in a second, about: a long time is shown less often.
const BYTES_PER_SECOND: f64 = 4e6;

/// What a page wants to see: its message `scope`.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ScopeRequest {
    /// Up to eight signals by name.
    pub signals: Vec<String>,
    /// What to wait for; null shows the newest.
    #[serde(default)]
    pub trigger: Option<Trigger>,
    /// What is shown while nothing triggers.
    #[serde(default)]
    pub mode: Mode,
    /// How much time is shown [s], 10 at most.
    pub seconds: f64,
    /// Where in that time the trigger is, 0 (at its begin) to 1.
    #[serde(default)]
    pub position: f64,
}

/// What to wait for.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Trigger {
    /// The signal by name.
    pub signal: String,
    /// The level that it passes, in its unit.
    pub level: f64,
    /// The direction in which it passes it.
    #[serde(default)]
    pub edge: Edge,
}

/// A direction.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Edge {
    /// From below the level to it or above.
    #[default]
    Rising,
    /// From above the level to it or below.
    Falling,
}

/// What is shown while nothing triggers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// The newest.
    #[default]
    Auto,
    /// Nothing new.
    Normal,
    /// Nothing new, and nothing after the first that triggers.
    Single,
}

/// What stands before the numbers of a frame.
#[derive(Debug, Clone, PartialEq, Serialize, JsonSchema)]
pub struct FrameHeader {
    /// Counts the frames since the request, from 1.
    pub id: u64,
    /// From sample to sample [s].
    pub period: f64,
    /// When the first sample was, as seen from the trigger; without one, from the newest sample [s].
    pub start: f64,
    /// The signals by name, in order.
    pub signals: Vec<String>,
    /// How many samples each has.
    pub samples: usize,
    /// Whether the trigger was found.
    pub triggered: bool,
}

/// What is shown of the ring: its header, and the numbers signal after signal.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// What it is.
    pub header: FrameHeader,
    /// Signal after signal.
    pub numbers: Vec<f32>,
}

impl Frame {
    /// As it goes over the wire: length of the header, header, numbers, little-endian.
    pub fn bytes(&self) -> Vec<u8> {
        let header = serde_json::to_vec(&self.header).unwrap_or_default();
        let mut bytes = Vec::with_capacity(4 + header.len() + 4 * self.numbers.len());
        bytes.extend((header.len() as u32).to_le_bytes());
        bytes.extend(header);
        self.numbers.iter().for_each(|number| bytes.extend(number.to_le_bytes()));
        bytes
    }
}

/// A page's scope.
#[derive(Debug)]
pub struct Scope {
    request: ScopeRequest,
    /// Places of the signals in a cycle.
    places: Vec<usize>,
    trigger: Option<usize>,
    /// Samples before the trigger, and from it on.
    before: u64,
    after: u64,
    period: f64,
    frames: u64,
    /// The first cycle that may trigger, or from which on nothing has been shown.
    armed: u64,
    /// The ring's end when something was shown last.
    shown: u64,
    is_done: bool,
}

impl Scope {
    /// A scope of these signals, in cycles of this period [s].
    ///
    /// # Errors
    /// What of the request cannot be shown.
    pub fn new(request: ScopeRequest, names: &[String], period: f64) -> Result<Self, String> {
        let place = |name: &String| {
            let found = names.iter().position(|it| it == name);
            found.ok_or_else(|| format!("there is no signal {name:?}; /api/v1/signals lists them"))
        };
        if request.signals.is_empty() || request.signals.len() > MOST_SIGNALS {
            let count = request.signals.len();
            return Err(format!(
                "signals: {count} are asked for; 1 to {MOST_SIGNALS} can be shown"
            ));
        }
        if !(request.seconds > 0.0 && request.seconds <= LONGEST) {
            let seconds = request.seconds;
            return Err(format!("seconds: {seconds} is not above 0 and at most {LONGEST}"));
        }
        if !(0.0..=1.0).contains(&request.position) {
            return Err(format!("position: {} is not from 0 to 1", request.position));
        }
        let places = request.signals.iter().map(place).collect::<Result<_, _>>()?;
        let trigger = request.trigger.as_ref().map(|it| place(&it.signal)).transpose()?;
        let samples = ((request.seconds / period).round() as u64).max(2);
        let before = ((samples - 1) as f64 * request.position).round() as u64;
        let after = samples - before;
        Ok(Self {
            request,
            places,
            trigger,
            before,
            after,
            period,
            frames: 0,
            armed: 0,
            shown: 0,
            is_done: false,
        })
    }

    /// What is shown next, if there is something new; the newest, however much was missed.
    pub fn next(&mut self, ring: &Ring) -> Option<Frame> {
        if ring.end() < self.shown {
            // Drives have started anew.
            (self.armed, self.shown) = (0, 0);
        }
        let samples = self.before + self.after;
        let bytes = (samples as usize * self.places.len() * size_of::<f32>()) as f64;
        let pause = (bytes / BYTES_PER_SECOND / self.period) as u64;
        let is_due = ring.end() >= self.shown + pause.max(1);
        if self.is_done || !is_due || ring.end() - ring.begin() < 2 {
            return None;
        }
        if let Some(found) = self.triggered(ring) {
            self.is_done = self.request.mode == Mode::Single;
            self.armed = found + self.after;
            return Some(self.frame(ring, found - self.before, Some(self.before as usize)));
        }
        let waited = (AUTO_AFTER / self.period) as u64 + self.after;
        let is_late = self.trigger.is_none() || ring.end() >= self.shown + waited;
        let takes_newest = match self.request.mode {
            Mode::Auto => is_late,
            // Without a trigger there is nothing to wait for.
            Mode::Single => self.trigger.is_none(),
            Mode::Normal => false,
        };
        if takes_newest && ring.end() >= ring.begin() + samples {
            self.is_done = self.request.mode == Mode::Single;
            return Some(self.frame(ring, ring.end() - samples, None));
        }
        None
    }

    /// The newest cycle that triggers and of which all is there that is shown.
    fn triggered(&mut self, ring: &Ring) -> Option<u64> {
        let signal = self.trigger?;
        let (level, edge) = self.request.trigger.as_ref().map(|it| (it.level as f32, it.edge))?;
        let first = self.armed.max(ring.begin() + self.before).max(ring.begin() + 1);
        // What is not whole yet is looked at again.
        let last = ring.end().saturating_sub(self.after);
        let passes = |cycle: &u64| {
            let (from, to) = (ring.value(cycle - 1, signal), ring.value(*cycle, signal));
            match edge {
                Edge::Rising => from < level && to >= level,
                Edge::Falling => from > level && to <= level,
            }
        };
        let found = match self.request.mode {
            Mode::Single => (first..=last).find(passes),
            _ => (first..=last).rev().find(passes),
        };
        // All before it has been looked through.
        if found.is_none() && last >= first {
            self.armed = last + 1;
        }
        found
    }

    fn frame(&mut self, ring: &Ring, first: u64, trigger: Option<usize>) -> Frame {
        self.frames += 1;
        self.shown = ring.end();
        let samples = (self.before + self.after) as usize;
        let zero = trigger.unwrap_or(samples - 1);
        let header = FrameHeader {
            id: self.frames,
            period: self.period,
            start: -(zero as f64) * self.period,
            signals: self.request.signals.clone(),
            samples,
            triggered: trigger.is_some(),
        };
        let cycles = first..first + samples as u64;
        let values = |place: &usize| {
            let place = *place;
            cycles.clone().map(move |cycle| ring.value(cycle, place))
        };
        Frame { header, numbers: self.places.iter().flat_map(values).collect() }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    const PERIOD: f64 = 1e-3;

    /// Signal `wave` is 1 in cycles 100 to 109 of every 200, else 0; `count` is the cycle.
    fn ring(cycles: u64) -> Ring {
        let mut ring = Ring::new(2, 10_000);
        extend(&mut ring, 0..cycles);
        ring
    }

    fn extend(ring: &mut Ring, cycles: std::ops::Range<u64>) {
        for cycle in cycles {
            let wave = if (100..110).contains(&(cycle % 200)) { 1.0 } else { 0.0 };
            ring.push(cycle, [wave, cycle as f64].into_iter());
        }
    }

    fn scope(mode: Mode, edge: Option<Edge>, seconds: f64, position: f64) -> Scope {
        let trigger = edge.map(|edge| Trigger { signal: "wave".to_owned(), level: 0.5, edge });
        let signals = vec!["count".to_owned(), "wave".to_owned()];
        let request = ScopeRequest { signals, trigger, mode, seconds, position };
        Scope::new(request, &["wave".to_owned(), "count".to_owned()], PERIOD).unwrap()
    }

    #[test]
    fn a_frame_has_the_trigger_where_it_was_asked_for_and_every_cycle_of_the_time() {
        let mut scope = scope(Mode::Normal, Some(Edge::Rising), 0.05, 0.2);
        let frame = scope.next(&ring(1000)).unwrap();
        let FrameHeader { samples, start, triggered, id, .. } = frame.header;
        assert_eq!((samples, start, triggered, id), (50, -10.0 * PERIOD, true, 1));
        // The newest that is whole: 900 is passed at 1000 - 40 or before.
        let (count, wave) = frame.numbers.split_at(50);
        assert_eq!(count, (890..940).map(|it| it as f32).collect::<Vec<_>>());
        assert_eq!((wave[9], wave[10], wave[19], wave[20]), (0.0, 1.0, 1.0, 0.0));
    }

    #[test]
    fn a_falling_edge_is_another_one() {
        let mut scope = scope(Mode::Normal, Some(Edge::Falling), 0.02, 0.0);
        let frame = scope.next(&ring(1000)).unwrap();
        assert_eq!(frame.numbers[0], 910.0);
    }

    #[test]
    fn normal_waits_auto_does_not_and_single_shows_one() {
        let mut ring = ring(90);
        let mut normal = scope(Mode::Normal, Some(Edge::Rising), 0.02, 0.5);
        let mut auto = scope(Mode::Auto, Some(Edge::Rising), 0.02, 0.5);
        let mut single = scope(Mode::Single, Some(Edge::Rising), 0.02, 0.5);
        assert_eq!(normal.next(&ring), None);
        assert_eq!(single.next(&ring), None);
        extend(&mut ring, 90..200);
        let (first, only) = (normal.next(&ring).unwrap(), single.next(&ring).unwrap());
        assert_eq!(first, only);
        assert!(auto.next(&ring).unwrap().header.triggered);
        extend(&mut ring, 200..500);
        assert_eq!(single.next(&ring), None);
        assert_eq!(normal.next(&ring).unwrap().numbers[10], 300.0);
        // Nothing triggers any more: automatic mode shows the newest after a while.
        for cycle in 500..800 {
            ring.push(cycle, [0.0, cycle as f64].into_iter());
        }
        assert_eq!(normal.next(&ring), None);
        assert!(auto.next(&ring).unwrap().header.triggered, "the one at 300");
        for cycle in 800..1000 {
            ring.push(cycle, [0.0, cycle as f64].into_iter());
        }
        let newest = auto.next(&ring).unwrap();
        assert!(!newest.header.triggered);
        assert_eq!(newest.numbers[..20].last(), Some(&999.0));
    }

    #[test]
    fn without_a_trigger_the_newest_is_shown_and_a_new_clock_begins_anew() {
        let mut scope = scope(Mode::Auto, None, 0.01, 0.0);
        let mut ring = ring(100);
        assert_eq!(scope.next(&ring).unwrap().numbers[9], 99.0);
        assert_eq!(scope.next(&ring), None, "nothing new");
        extend(&mut ring, 5..30);
        assert_eq!(scope.next(&ring).unwrap().numbers[9], 29.0);
    }

    #[test]
    fn what_cannot_be_shown_is_refused_with_the_limit() {
        let names = ["wave".to_owned()];
        let request = |signals: usize, seconds: f64, position: f64| ScopeRequest {
            signals: vec!["wave".to_owned(); signals],
            trigger: None,
            mode: Mode::Auto,
            seconds,
            position,
        };
        for (request, word) in [
            (request(0, 1.0, 0.0), "signals"),
            (request(9, 1.0, 0.0), "8"),
            (request(1, 10.1, 0.0), "10"),
            (request(1, f64::NAN, 0.0), "seconds"),
            (request(1, 1.0, 1.5), "position"),
            (ScopeRequest { signals: vec!["no".to_owned()], ..request(1, 1.0, 0.0) }, "no signal"),
        ] {
            let error = Scope::new(request, &names, PERIOD).unwrap_err();
            assert!(error.contains(word), "{error}");
        }
    }

    #[test]
    fn the_bytes_of_a_frame_are_its_header_and_its_numbers() {
        let mut scope = scope(Mode::Auto, None, 0.01, 0.0);
        let bytes = scope.next(&ring(100)).unwrap().bytes();
        let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
        let header: serde_json::Value = serde_json::from_slice(&bytes[4..4 + length]).unwrap();
        assert_eq!(header["samples"], 10);
        assert_eq!(header["start"], -9.0 * PERIOD);
        assert_eq!(bytes.len(), 4 + length + 2 * 10 * 4);
        let first = f32::from_le_bytes(bytes[4 + length..][..4].try_into().unwrap());
        assert_eq!(first, 90.0);
    }
}
