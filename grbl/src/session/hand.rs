//! What moves without a program: jogs, and the probe.

use machine::operating::OutputFunction;
use messages::MotionEnd;
use operator::Verb;

use super::{BLOCKS, Follow, Held, Outcome, Procedure, Purpose, Session, Step, distance, system};
use crate::codes::ErrorCode;
use crate::machine::Ask;

/// Names of the tool's directions.
const DIRECTIONS: [&str; 3] = ["x", "y", "z"];

/// Of its largest speed what moves by hand may have: a little less than the controller's 0.85, so that the last digit of
/// what is told does not matter.
const BY_HAND: f64 = 0.8499;

/// Shorter ways are none [m].
const NO_WAY: f64 = 1e-9;

/// Beyond the area by less is rounding [m].
pub(super) const ROUNDING: f64 = 1e-6;

/// A way that is asked for by `$J=`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Jog {
    from: [f64; 3],
    to: [f64; 3],
    /// [m/s].
    speed: f64,
}

impl Session {
    /// `$J=`: its own modal state, its own queue.
    pub(super) fn jog_line(&mut self, words: &[u8]) {
        let is_jogging =
            !self.jogs.is_empty() || !self.jogging.is_over() || self.state() == "jogging";
        let is_free =
            self.rests() && !self.spool.as_ref().is_some_and(|gathered| gathered.has_work);
        if self.is_locked() {
            return self.refuse_line(ErrorCode::Locked, "locked: $X or $H unlocks");
        }
        if self.is_paused || !is_jogging && !is_free {
            return self.refuse_line(ErrorCode::NotIdle, "held, or a job is under way");
        }
        if !is_jogging {
            self.sync();
        }
        let from = self.jog_end.unwrap_or_else(|| self.tool());
        if words.iter().any(|byte| byte.is_ascii_alphabetic() && !b"GXYZFN".contains(byte)) {
            return self.refuse_line(
                ErrorCode::BadJog,
                "a jog has X, Y, Z, F, G20, G21, G53, G90 and G91",
            );
        }
        if !words.iter().any(|byte| b"XYZ".contains(byte)) {
            return self.refuse_line(ErrorCode::BadJog, "a jog needs X, Y or Z");
        }
        let (to, speed) = match self.reader.jog(words, from) {
            Ok(way) => way,
            Err(error) => {
                let code = match ErrorCode::of(&error) {
                    ErrorCode::ModalGroup | ErrorCode::AxisConflict | ErrorCode::Unsupported => {
                        ErrorCode::BadJog
                    }
                    code => code,
                };
                return self.refuse_line(code, &format!("{}; {}", error.message, error.help));
            }
        };
        if distance(from, to) < NO_WAY {
            return self.ok();
        }
        let movers = self.movers();
        let moves = |axis: &usize| (to[*axis] - from[*axis]).abs() >= NO_WAY;
        if let Some(axis) =
            (0..3).filter(moves).find(|axis| !movers.contains(&DIRECTIONS[*axis].to_owned()))
        {
            let words =
                format!("the tool of this machine is not moved along {} by hand", DIRECTIONS[axis]);
            return self.refuse_line(ErrorCode::BadJog, &words);
        }
        if let Some(words) = self.beyond(&[to, to]) {
            return self.refuse_line(ErrorCode::Travel, &words);
        }
        if self.is_checking {
            return self.ok();
        }
        self.jogs.push_back(Jog { from, to, speed });
        self.jog_end = Some(to);
        if self.jogs.len() < BLOCKS {
            self.ok();
        } else {
            self.held = Some(Held::JogRoom);
        }
    }

    /// The first place of a box that is beyond the area, in words; `None` where none is.
    pub(super) fn beyond(&self, bounds: &[[f64; 3]; 2]) -> Option<String> {
        let area = &self.machine.area;
        let has_height = self.machine.gcode.z == machine::ZMeaning::Focus;
        (0..if has_height { 3 } else { 2 }).find_map(|axis| {
            let name = ["X", "Y", "Z"][axis];
            let zero = self.reader.zero()[axis];
            let place = |value: f64| format!("{:.3}", (value - zero) * 1e3);
            let (lower, upper) = (area.lower[axis], area.upper[axis]);
            let found = if bounds[0][axis] < lower - ROUNDING {
                (bounds[0][axis], lower)
            } else if bounds[1][axis] > upper + ROUNDING {
                (bounds[1][axis], upper)
            } else {
                return None;
            };
            Some(format!(
                "{name} {} mm is beyond the area, which ends at {name} {} mm (work coordinates; {:.3} mm of the machine)",
                place(found.0),
                place(found.1),
                found.1 * 1e3
            ))
        })
    }

    /// Begins the next jog when the one before it has ended.
    pub(super) fn next_jog(&mut self) {
        if self.is_paused {
            return;
        }
        if self.jogging.is_over() {
            let Some(jog) = self.jogs.pop_front() else {
                return;
            };
            self.jogging = self.jog_steps(jog);
        }
        self.next_jog_step();
        self.release();
    }

    fn next_jog_step(&mut self) {
        if self.jogging.under_way.is_some() {
            return;
        }
        if let Some(step) = self.jogging.steps.pop_front() {
            let ticket = self.ask(step.ask, Purpose::Jog);
            self.jogging.under_way = Some((step.follow, ticket, None));
        }
    }

    /// The motions of a jog: one axis after the other, or together where each has a joint of its own.
    fn jog_steps(&self, jog: Jog) -> Procedure {
        let mut steps = Vec::new();
        if self.state() == "disabled" {
            steps.push(system::verb(Verb::Enable, Follow::Enabled));
        }
        let length = distance(jog.from, jog.to);
        let ways: Vec<(usize, f64)> = (0..3)
            .map(|axis| (axis, jog.to[axis] - jog.from[axis]))
            .filter(|(_, way)| way.abs() >= NO_WAY)
            .collect();
        let own_joint =
            |axis: usize| self.machine.axes.iter().any(|it| it.name == DIRECTIONS[axis]);
        let are_together = ways.len() > 1 && ways.iter().all(|(axis, _)| own_joint(*axis));
        let last = ways.len().saturating_sub(1);
        for (index, (axis, way)) in ways.into_iter().enumerate() {
            let share = if are_together { way.abs() / length } else { 1.0 };
            let speed = (jog.speed * share).min(self.fastest(axis));
            let ask = Ask::Operate {
                verb: Verb::Step,
                axes: vec![DIRECTIONS[axis].to_owned()],
                value: way,
                second: speed,
            };
            // Those that go together are waited for together.
            let follow = if are_together && index < last { Follow::Answer } else { Follow::Motion };
            steps.push(Step { ask, follow });
        }
        Procedure::of(steps)
    }

    /// How fast the tool may go along x, y or z [m/s].
    fn fastest(&self, axis: usize) -> f64 {
        let number = 110 + axis as u16;
        let told = self.settings.all().into_iter().find(|(it, _)| *it == number);
        let per_minute = told.and_then(|(_, value)| value.parse::<f64>().ok());
        per_minute.map_or(f64::INFINITY, |value| value / 60e3 * BY_HAND)
    }

    pub(super) fn end_jog(&mut self, outcome: Outcome) {
        match outcome {
            Outcome::Goes => {}
            Outcome::Done => {
                if self.jogs.is_empty() {
                    self.jog_end = None;
                }
            }
            Outcome::Failed(words) => {
                self.jogs.clear();
                self.jogging = Procedure::default();
                self.jog_end = None;
                if words != MotionEnd::Stopped.name() {
                    self.message(&format!("jog: {}", system::end_words(&words)));
                }
            }
        }
    }

    /// `G38.2` to `G38.5`: moves one axis until the probe touches.
    pub(super) fn probe_line(&mut self, line: &[u8], must_touch: bool) {
        if !self.is_idle() {
            return self.refuse_line(ErrorCode::NotIdle, "only while the machine is idle");
        }
        self.sync();
        let from = self.tool();
        let text = String::from_utf8_lossy(line).to_ascii_uppercase();
        let words: String =
            ["G38.2", "G38.3"].iter().fold(text, |text, code| text.replace(code, ""));
        let (to, speed) = match self.reader.jog(words.as_bytes(), from) {
            Ok(way) => way,
            Err(error) => {
                let words = format!("{}; {}", error.message, error.help);
                return self.refuse_line(ErrorCode::of(&error), &words);
            }
        };
        let ways: Vec<usize> =
            (0..3).filter(|axis| (to[*axis] - from[*axis]).abs() >= NO_WAY).collect();
        let [axis] = ways[..] else {
            let words = "a probe moves one axis: write G38.2 with X, Y or Z, and F";
            return self.refuse_line(ErrorCode::NoAxis, words);
        };
        if let Some(words) = self.beyond(&[to, to]) {
            return self.refuse_line(ErrorCode::Travel, &words);
        }
        if self.is_checking {
            return self.ok();
        }
        let mut steps = Vec::new();
        if self.state() == "disabled" {
            steps.push(system::verb(Verb::Enable, Follow::Enabled));
        }
        let ask = Ask::Operate {
            verb: Verb::Probe,
            axes: vec![DIRECTIONS[axis].to_owned()],
            value: to[axis] - from[axis],
            second: speed.min(self.fastest(axis)),
        };
        steps.push(Step { ask, follow: Follow::Motion });
        self.probing = Some((axis, must_touch));
        self.begin(Procedure::of(steps));
    }

    /// Notes where the probe has touched, or that it has not; whether there was a probe at all.
    pub(super) fn take_probe(&mut self, touched: bool) -> bool {
        let Some((axis, _)) = self.probing.take() else { return false };
        let mut place = self.tool();
        let probed = self.status.as_ref().and_then(|status| status.probed.as_ref());
        if let Some(probed) = probed.filter(|it| touched && it.axis == DIRECTIONS[axis]) {
            place[axis] = probed.position;
        }
        self.probed = (place, touched);
        true
    }

    /// What the tool is moved by, by hand.
    pub(super) fn movers(&self) -> Vec<String> {
        let known = self.status.iter().flat_map(|status| status.axes.keys());
        DIRECTIONS
            .iter()
            .filter(|name| known.clone().any(|it| it == *name))
            .map(|name| (*name).to_owned())
            .collect()
    }

    /// The output that is the air assist, if there is one.
    pub(super) fn air_output(&self) -> Option<String> {
        let outputs = self.machine.operating.outputs.iter();
        let mut air = outputs.filter(|output| output.function == OutputFunction::Air);
        air.next().map(|output| output.name.clone())
    }
}
