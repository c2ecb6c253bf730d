//! Realtime commands: single bytes that are taken out of whatever they stand in, and carried out at once.

use operator::{Status, Verb};

use super::{Overrides, Purpose, Session, Waiting};
use crate::codes::Alarm;
use crate::machine::Ask;

/// The longest line [bytes]: clusters of powers are longer than grbl's own 80.
const LONGEST_LINE: usize = 512;

/// Least and most of an override [percent].
const RANGE: (u8, u8) = (10, 200);

/// A realtime command.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Realtime {
    /// `?`
    Report,
    /// `~`
    Resume,
    /// `!`
    Hold,
    /// 0x18.
    Reset,
    /// 0x84.
    Door,
    /// 0x85.
    JogCancel,
    /// 0x90 to 0x94: back to 100 %, or more or less by so many percent.
    Rate(Option<i8>),
    /// 0x95 to 0x97: rapids at so many percent.
    Rapid(u8),
    /// 0x99 to 0x9D, as of the rate.
    Power(Option<i8>),
    /// 0x9E.
    LaserStop,
    /// 0xA0 and 0xA1.
    Air,
}

impl Realtime {
    /// The command that `byte` is, `None` of an unknown one and of text.
    fn of(byte: u8) -> Option<Self> {
        Some(match byte {
            b'?' => Self::Report,
            b'~' => Self::Resume,
            b'!' => Self::Hold,
            0x18 => Self::Reset,
            0x84 => Self::Door,
            0x85 => Self::JogCancel,
            0x90 => Self::Rate(None),
            0x91 => Self::Rate(Some(10)),
            0x92 => Self::Rate(Some(-10)),
            0x93 => Self::Rate(Some(1)),
            0x94 => Self::Rate(Some(-1)),
            0x95 => Self::Rapid(100),
            0x96 => Self::Rapid(50),
            0x97 => Self::Rapid(25),
            0x99 => Self::Power(None),
            0x9A => Self::Power(Some(10)),
            0x9B => Self::Power(Some(-10)),
            0x9C => Self::Power(Some(1)),
            0x9D => Self::Power(Some(-1)),
            0x9E => Self::LaserStop,
            0xA0 | 0xA1 => Self::Air,
            _ => return None,
        })
    }
}

/// What a byte comes to.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Unit {
    /// Nothing.
    None,
    /// A part of a line.
    Text,
    /// The end of this line.
    Line(Vec<u8>),
    /// The end of a line that was too long.
    TooLong,
    /// A realtime command.
    Realtime(Realtime),
}

/// Parts bytes into lines and realtime commands.
///
/// Some clients send a realtime command above 0x7F as UTF-8, `C2 85` for 0x85; and comments may have letters that UTF-8
/// writes with such bytes. So a byte above 0x7F that follows another one of UTF-8 is a command only after `C2`.
#[derive(Debug, Default)]
pub struct Splitter {
    line: Vec<u8>,
    is_too_long: bool,
    /// Whether the byte before was a CR.
    after_return: bool,
    /// Bytes of a character of UTF-8 that are still to come, and whether it began with C2.
    following: u8,
    is_control: bool,
}

impl Splitter {
    /// Bytes of the line that has not ended.
    pub fn length(&self) -> usize {
        self.line.len()
    }

    /// Takes the next byte.
    pub fn take(&mut self, byte: u8) -> Unit {
        let after_return = std::mem::replace(&mut self.after_return, byte == b'\r');
        if byte >= 0x80 {
            return self.above_ascii(byte);
        }
        self.following = 0;
        match byte {
            b'\n' if after_return => Unit::None,
            b'\r' | b'\n' => {
                let line = std::mem::take(&mut self.line);
                if std::mem::take(&mut self.is_too_long) { Unit::TooLong } else { Unit::Line(line) }
            }
            _ => match Realtime::of(byte) {
                Some(realtime) => {
                    if realtime == Realtime::Reset {
                        *self = Self::default();
                    }
                    Unit::Realtime(realtime)
                }
                None => {
                    self.add(byte);
                    Unit::Text
                }
            },
        }
    }

    fn above_ascii(&mut self, byte: u8) -> Unit {
        if self.following > 0 && byte < 0xC0 {
            self.following -= 1;
            // A blank that does not break a line is no switch of the air.
            let is_text = !self.is_control || byte >= 0xA0 && !self.line.is_empty();
            return match Realtime::of(byte).filter(|_| !is_text) {
                Some(realtime) => Unit::Realtime(realtime),
                None => Unit::Text,
            };
        }
        (self.following, self.is_control) = match byte {
            0xC2 => (1, true),
            0xC3..=0xDF => (1, false),
            0xE0..=0xEF => (2, false),
            0xF0..=0xF4 => (3, false),
            _ => (0, false),
        };
        match Realtime::of(byte) {
            Some(realtime) => Unit::Realtime(realtime),
            None => Unit::Text,
        }
    }

    fn add(&mut self, byte: u8) {
        if self.line.len() < LONGEST_LINE {
            self.line.push(byte);
        } else {
            self.is_too_long = true;
        }
    }
}

impl Session {
    pub(super) fn realtime(&mut self, realtime: Realtime) {
        match realtime {
            Realtime::Report => self.report(),
            Realtime::Hold => self.hold(),
            Realtime::Resume => {
                (self.is_paused, self.is_door, self.holds_next) = (false, false, false);
                self.ask_quietly(Verb::Resume, 0.0);
            }
            Realtime::Door => {
                self.is_door = true;
                self.hold();
            }
            Realtime::Reset => self.reset(),
            Realtime::JogCancel => self.cancel_jog(),
            Realtime::Rate(change) => {
                self.overrides.rate = changed(self.overrides.rate, change);
                self.ask_override(Verb::Override, self.overrides.rate);
            }
            Realtime::Power(change) => {
                self.overrides.power = changed(self.overrides.power, change);
                self.ask_override(Verb::Power, self.overrides.power);
            }
            Realtime::Rapid(percent) => {
                self.overrides.rapid = percent;
                self.ask_override(Verb::Rapid, percent);
            }
            // A hold is dark anyway.
            Realtime::LaserStop => {}
            Realtime::Air => self.toggle_air(),
        }
    }

    /// What stops the machine, from a client that only watches: everybody may stop it. Other commands are not for
    /// it, and whether this one was.
    pub fn stop_by_watcher(&mut self, realtime: Realtime, now: f64) -> bool {
        let words = match realtime {
            Realtime::Hold | Realtime::Door => "another client holds the machine",
            Realtime::Reset => "another client has reset the machine",
            Realtime::JogCancel => "another client has cancelled the jog",
            _ => return false,
        };
        self.now = now;
        self.message(words);
        self.realtime(realtime);
        self.go_on();
        true
    }

    /// Feed hold: of a job, or of what will be one; a jog is given up.
    fn hold(&mut self) {
        if self.is_asleep {
            return;
        }
        self.cancel_jog();
        self.is_paused = true;
        // A job that has not begun can't be held yet.
        self.holds_next = self.state() != "running";
        self.ask_quietly(Verb::Hold, 0.0);
    }

    /// Asks for what may have nothing to act on.
    pub(super) fn ask_quietly(&mut self, verb: Verb, value: f64) {
        self.tickets += 1;
        self.asks.push((self.tickets, Ask::Verb { verb, value }));
    }

    /// A reset: the light goes out with the next command, the axes come to rest, and all that was sent is forgotten.
    /// Faults, and what the machine knows of its place, stay.
    fn reset(&mut self) {
        self.ask_quietly(Verb::Stop, 0.0);
        self.orphan(Purpose::Line);
        self.orphan(Purpose::Jog);
        self.forget_lines();
        self.drop_work();
        (self.is_paused, self.is_door, self.is_checking, self.is_asleep) =
            (false, false, false, false);
        self.holds_next = false;
        if self.alarm.is_some_and(|alarm| alarm != Alarm::HardLimit) {
            self.alarm = None;
        }
        if self.overrides != Overrides::NONE {
            self.overrides = Overrides::NONE;
            self.ask_override(Verb::Override, 100);
            self.ask_override(Verb::Rapid, 100);
            self.ask_override(Verb::Power, 100);
        }
        self.reader.reset();
        self.greet();
    }

    fn ask_override(&mut self, verb: Verb, percent: u8) {
        let ask = Ask::Verb { verb, value: f64::from(percent) / 100.0 };
        self.ask(ask, Purpose::Override);
    }

    /// Takes over what is in force: others ask for overrides too, and that of the power ends with the job.
    pub(super) fn follow_overrides(&mut self, status: &Status) {
        let is_asked = self.purposes.iter().any(|(_, purpose)| *purpose == Purpose::Override);
        // What the machine has accepted shows in a status that counts it.
        let is_shown = status.requests.wrapping_sub(self.override_number) < u32::MAX / 2;
        if is_asked || !is_shown {
            return;
        }
        let percent = |value: f64, before: u8| match (value * 100.0).round() {
            percent if percent >= f64::from(RANGE.0) => percent.min(f64::from(RANGE.1)) as u8,
            _ => before,
        };
        self.overrides = Overrides {
            rate: percent(status.rate_override, self.overrides.rate),
            rapid: percent(status.rapid_override, self.overrides.rapid).min(100),
            power: percent(status.power_override, self.overrides.power),
        };
    }

    /// What was asked for `purpose` and is not answered yet is to be stopped if it begins all the same.
    fn orphan(&mut self, purpose: Purpose) {
        let tickets =
            self.purposes.iter().filter(|(_, of)| *of == purpose).map(|(ticket, _)| *ticket);
        self.orphans.extend(tickets);
    }

    pub(super) fn cancel_jog(&mut self) {
        let is_jogging = !self.jogs.is_empty() || !self.jogging.is_over();
        // Those that have not been taken yet are answered, and go nowhere.
        for line in &mut self.waiting {
            if let Waiting::Line(line) = line
                && is_jog(line)
            {
                self.waiting_bytes = self.waiting_bytes.saturating_sub(line.len());
                line.clear();
            }
        }
        self.jogs.clear();
        self.jogging = Default::default();
        self.orphan(Purpose::Jog);
        self.purposes.retain(|(_, purpose)| *purpose != Purpose::Jog);
        self.jog_end = None;
        if !is_jogging && self.state() != "jogging" {
            return;
        }
        for name in self.movers() {
            self.tickets += 1;
            let ask = Ask::Operate { verb: Verb::Jog, axes: vec![name], value: 0.0, second: 0.0 };
            self.asks.push((self.tickets, ask));
        }
    }

    fn toggle_air(&mut self) {
        let Some(name) = self.air_output() else { return };
        let is_on =
            self.status.as_ref().is_some_and(|status| status.outputs.get(&name) == Some(&true));
        self.ask(Ask::Output { name, is_on: !is_on }, Purpose::Free);
    }
}

/// An override after a change by so many percent, or back at 100 %.
fn changed(percent: u8, change: Option<i8>) -> u8 {
    match change {
        None => 100,
        Some(change) => percent.saturating_add_signed(change).clamp(RANGE.0, RANGE.1),
    }
}

/// Whether a line asks for a jog, as it is read: with spaces, and in either case.
fn is_jog(line: &[u8]) -> bool {
    let word = line.trim_ascii_start().strip_prefix(b"$");
    word.is_some_and(|word| {
        word.trim_ascii_start().first().is_some_and(|letter| letter.eq_ignore_ascii_case(&b'J'))
    })
}
