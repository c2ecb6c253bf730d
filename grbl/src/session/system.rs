//! Lines that begin with `$`.

use operator::Verb;

use super::{BLOCKS, Follow, Held, Procedure, Purpose, Session, Step, WINDOW};
use crate::codes::{Alarm, ErrorCode};
use crate::machine::Ask;
use crate::report;

/// What `$` answers.
const HELP: &str = "[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]";

impl Session {
    /// What a line that begins with `$` asks for; `text` is what follows that.
    pub(super) fn system(&mut self, text: &str) {
        if let Some(answer) = self.query(text) {
            answer.iter().for_each(|line| self.line(line));
            return self.ok();
        }
        let upper = text.to_ascii_uppercase();
        if let Some(jog) = upper.strip_prefix("J=") {
            return self.jog_line(jog.as_bytes());
        }
        // All others want a machine that does nothing, but for those that unlock it.
        if !matches!(upper.as_str(), "X" | "H") && !upper.starts_with('H') && !self.is_idle() {
            return self.refuse_line(ErrorCode::NotIdle, "only while the machine is idle");
        }
        match upper.as_str() {
            "X" => self.unlock(),
            "C" => self.check_mode(),
            "SLP" => {
                self.is_asleep = true;
                self.ask_verb(Verb::Disable, 0.0);
                self.ok();
            }
            "RST=$" | "RST=#" | "RST=*" => self.restore(&upper[4..]),
            _ if upper == "H" || upper.len() == 2 && upper.starts_with('H') => {
                self.home(&upper[1..])
            }
            _ if upper.starts_with('N') => self.startup_line(&upper[1..]),
            _ => self.set(text),
        }
    }

    /// The lines that answer a question, without the `ok`; `None` of what is no question.
    pub fn query(&self, text: &str) -> Option<Vec<String>> {
        Some(match text.to_ascii_uppercase().as_str() {
            "" => vec![HELP.to_owned()],
            "$" => self
                .settings
                .all()
                .iter()
                .map(|(number, value)| format!("${number}={value}"))
                .collect(),
            "I" => vec![
                format!("[VER:1.1h.20190825:{}]", report::plain(&self.machine.name)),
                format!("[OPT:VL,{BLOCKS},{WINDOW}]"),
            ],
            "G" => vec![report::modes(&self.reader, &self.settings)],
            "#" => report::places(&self.reader, &self.settings, self.probed),
            "N" => vec!["$N0=".to_owned(), "$N1=".to_owned()],
            _ => return None,
        })
    }

    /// Whether the machine does nothing, and nothing waits.
    pub(super) fn is_idle(&self) -> bool {
        let spools = self.spool.as_ref().is_some_and(|gathered| gathered.has_work);
        self.rests() && !spools
    }

    fn set(&mut self, text: &str) {
        let parts = text.split_once('=');
        let number = parts.and_then(|(number, _)| number.trim().parse::<u16>().ok());
        let Some((number, (_, value))) = number.zip(parts) else {
            return self.refuse_line(ErrorCode::BadStatement, &format!("${text} is not known"));
        };
        match self.settings.set(number, value) {
            Ok(()) => {
                if number == 30 {
                    self.scale(self.settings.full_scale);
                }
                self.ok();
            }
            Err((code, words)) => self.refuse_line(code, &words),
        }
    }

    /// Another S word is full power from now on.
    fn scale(&mut self, full_scale: f64) {
        self.machine.gcode.words.full_scale = full_scale;
        self.reader.set_full_scale(full_scale);
    }

    fn startup_line(&mut self, text: &str) {
        match text.split_once('=') {
            Some(("0" | "1", "")) => self.ok(),
            _ => {
                let words =
                    "startup lines are not run: the machine file says how the machine starts";
                self.refuse_line(ErrorCode::BadStatement, words);
            }
        }
    }

    fn restore(&mut self, what: &str) {
        if what != "#" {
            self.settings.restore();
            self.scale(self.settings.full_scale);
        }
        if what != "$" {
            self.reader.set_origins(self.machine.gcode.origins);
            self.reader.clear_shift();
            self.reader.forget_kept();
        }
        self.message("Restoring defaults");
        self.ok();
        self.reader.reset();
        self.greet();
    }

    fn check_mode(&mut self) {
        self.is_checking = !self.is_checking;
        let words = if self.is_checking { "Enabled" } else { "Disabled" };
        self.message(words);
        self.ok();
        if !self.is_checking {
            // As a reset does, so that nothing of what was checked stays in force.
            self.reader.reset();
            self.sync();
            self.greet();
        }
    }

    /// `$X`: a fault is cleared, and a machine that is not homed may be moved.
    fn unlock(&mut self) {
        let was_locked = self.is_locked();
        self.alarm = None;
        self.is_unlocked = true;
        if was_locked {
            self.message("Caution: Unlocked");
        }
        if matches!(self.state(), "faulted" | "halted") {
            let steps = [verb(Verb::Reset, Follow::Answer), verb(Verb::Enable, Follow::Enabled)];
            let is_halted = self.state() == "halted";
            return self.begin(Procedure::of(steps.into_iter().take(if is_halted {
                1
            } else {
                2
            })));
        }
        self.ok();
    }

    /// `$H`, `$HX`: of all axes, or of one.
    fn home(&mut self, axis: &str) {
        if !self.rests() || self.spool.as_ref().is_some_and(|gathered| gathered.has_work) {
            return self.refuse_line(ErrorCode::NotIdle, "only while the machine is idle");
        }
        let axes: Vec<String> =
            axis.chars().map(|letter| letter.to_ascii_lowercase().to_string()).collect();
        let finds = |index: usize| self.machine.operating.homing(index).is_some();
        let names = self.machine.axes.iter().enumerate().filter(|(index, _)| finds(*index));
        let names: Vec<&String> = names.map(|(_, axis)| &axis.name).collect();
        let has_axis = |name: &String| self.machine.axes.iter().any(|axis| axis.name == *name);
        if let Some(name) = axes.iter().find(|name| !has_axis(name)) {
            return self.refuse_line(ErrorCode::BadStatement, &format!("there is no axis {name}"));
        }
        let is_found = if axes.is_empty() {
            names.is_empty()
        } else {
            !names.iter().any(|name| axes.contains(name))
        };
        self.alarm = None;
        let mut steps = Vec::new();
        if self.state() == "faulted" || self.state() == "halted" {
            steps.push(verb(Verb::Reset, Follow::Answer));
        }
        if self.state() == "faulted" || self.state() == "disabled" {
            steps.push(verb(Verb::Enable, Follow::Enabled));
        }
        if is_found {
            self.message("the axes know their place: there is nothing to find");
        } else {
            let ask = Ask::Operate { verb: Verb::Home, axes, value: 0.0, second: 0.0 };
            steps.push(Step { ask, follow: Follow::Motion });
        }
        self.begin(Procedure::of(steps));
    }

    /// Carries out the steps that the line waits for.
    pub(super) fn begin(&mut self, procedure: Procedure) {
        self.procedure = procedure;
        self.held = Some(Held::Procedure);
        if self.procedure.is_over() {
            return self.end_procedure(super::Outcome::Done);
        }
        self.next_step();
    }

    fn next_step(&mut self) {
        if self.procedure.under_way.is_some() {
            return;
        }
        if let Some(step) = self.procedure.steps.pop_front() {
            let ticket = self.ask(step.ask, Purpose::Line);
            self.procedure.under_way = Some((step.follow, ticket, None));
        }
    }

    pub(super) fn end_procedure(&mut self, outcome: super::Outcome) {
        match outcome {
            super::Outcome::Goes => self.next_step(),
            super::Outcome::Done => {
                let was_probing = self.take_probe(true);
                if self.held.take().is_some() {
                    if was_probing {
                        let (place, touched) = self.probed;
                        self.line(&report::probe(&self.settings, place, touched));
                    } else {
                        self.sync();
                    }
                    self.ok();
                }
            }
            super::Outcome::Failed(words) => {
                let was_probing = self.take_probe(false);
                self.procedure = Procedure::default();
                if self.held.take().is_none() {
                    return;
                }
                self.message(end_words(&words));
                match (was_probing, words.as_str()) {
                    (true, "not_touched") => {
                        let (place, touched) = self.probed;
                        self.line(&report::probe(&self.settings, place, touched));
                        self.raise(Alarm::NoTouch);
                    }
                    (true, words) if words.contains("touches already") => {
                        self.raise(Alarm::ProbeTouches)
                    }
                    (false, "door_open") => self.raise(Alarm::HomingDoor),
                    (false, "stopped") => self.raise(Alarm::HomingReset),
                    (false, "soft_limit" | "out_of_reach" | "not_touched") => {
                        self.raise(Alarm::NoSwitch)
                    }
                    _ => {}
                }
                self.error(ErrorCode::Locked);
            }
        }
    }

    /// Follows what was begun by what the machine says.
    pub(super) fn follow_motions(&mut self) {
        let Some(status) = self.status.take() else { return };
        let line = self.procedure.seen(&status);
        let jog = self.jogging.seen(&status);
        self.status = Some(status);
        if line != super::Outcome::Goes
            || self.procedure.under_way.is_none() && !self.procedure.steps.is_empty()
        {
            self.end_procedure(line);
        }
        self.end_jog(jog);
    }
}

/// How a motion ended that did not reach its end, in words.
pub(super) fn end_words(end: &str) -> &str {
    match end {
        "stopped" => "stopped",
        "soft_limit" => "stopped at the soft limit",
        "door_open" => "stopped because the door was opened",
        "not_touched" => "the probe did not touch on its way",
        "out_of_reach" => "stopped where the mechanism cannot go on",
        "disabled" => "the motors are not powered",
        words => words,
    }
}

/// A step that is a verb.
pub(super) fn verb(verb: Verb, follow: Follow) -> Step {
    Step { ask: Ask::Verb { verb, value: 0.0 }, follow }
}
