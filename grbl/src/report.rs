//! What grbl tells of itself: status reports, `$G`, `$#` and `[PRB:`.

use std::fmt::Write;

use machine::Machine;
use machine::gcode_settings::LaserMode;
use machine::operating::InputFunction;
use operator::Status;
use planner::job::gcode::LineReader;

use crate::session::Overrides;
use crate::settings::{BUFFER, MACHINE_POSITION, Settings};

/// Metres in an inch.
const INCH: f64 = 0.0254;
/// Metres in a millimetre.
const MILLIMETRE: f64 = 1e-3;
/// Seconds in a minute.
const MINUTE: f64 = 60.0;

/// Reports from one with the work offset to the next, at rest and in motion.
const OFFSET_EVERY: [u32; 2] = [10, 30];
/// The same for the overrides.
const OVERRIDES_EVERY: [u32; 2] = [10, 20];

/// What a status report is of.
#[derive(Debug)]
pub struct Doing<'a> {
    /// What the machine says; `None` where it has never answered.
    pub status: Option<&'a Status>,
    /// The settings.
    pub settings: &'a Settings,
    /// What is in force.
    pub reader: &'a LineReader,
    /// The machine.
    pub machine: &'a Machine,
    /// The overrides.
    pub overrides: Overrides,
    /// Whether a person must unlock it.
    pub is_locked: bool,
    /// Whether it sleeps (`$SLP`).
    pub is_asleep: bool,
    /// Whether it only checks (`$C`).
    pub is_checking: bool,
    /// Whether a person has held it.
    pub is_paused: bool,
    /// Whether a client has said that the door is open.
    pub is_door: bool,
    /// Whether jogs are under way.
    pub is_jogging: bool,
    /// Whether a program is gathered, waits or is under way.
    pub has_work: bool,
    /// Lines of the job before the client's first.
    pub before: u64,
    /// Blocks and bytes that are free.
    pub room: [usize; 2],
}

impl Doing<'_> {
    /// The state, as grbl names it.
    pub fn state(&self) -> &'static str {
        let state = self.status.map_or("", |status| status.state.as_str());
        let moves = self.status.is_some_and(|status| status.speed.abs() > 0.0);
        let has_door = self.has_input(|function| *function == InputFunction::Door);
        if self.is_asleep {
            return "Sleep";
        }
        if self.is_checking {
            return "Check";
        }
        match state {
            // Nobody answers: nothing of what is asked will be done.
            "" => "Alarm",
            "homing" => "Home",
            "probing" | "pulsing" => "Run",
            _ if self.is_jogging || state == "jogging" => "Jog",
            "running" | "holding" | "stopping" | "idle" | "disabled" | "enabling"
                if self.is_door || has_door && state == "holding" =>
            {
                match (moves, has_door) {
                    (true, _) => "Door:2",
                    (false, true) => "Door:1",
                    (false, false) => "Door:0",
                }
            }
            "holding" | "stopping" if moves => "Hold:1",
            "holding" => "Hold:0",
            "running" => "Run",
            _ if self.is_locked => "Alarm",
            _ if self.is_paused => "Hold:0",
            _ if self.has_work || state == "stopping" => "Run",
            _ => "Idle",
        }
    }

    fn has_input(&self, is_meant: impl Fn(&InputFunction) -> bool) -> bool {
        let Some(status) = self.status else { return false };
        let mut inputs =
            self.machine.operating.inputs.iter().filter(|input| is_meant(&input.function));
        inputs.any(|input| status.inputs.get(&input.name) == Some(&true))
    }

    /// The letters of the inputs that are active.
    fn pins(&self) -> String {
        let axis = |letter: &str, function: &InputFunction| match function {
            InputFunction::Limit { axis, .. } | InputFunction::Home { axis, .. } => {
                self.machine.axes.get(*axis).is_some_and(|it| it.name == letter)
            }
            _ => false,
        };
        let mut pins = String::new();
        for (letter, name) in [('X', "x"), ('Y', "y"), ('Z', "z")] {
            if self.has_input(|function| axis(name, function)) {
                pins.push(letter);
            }
        }
        let others = [
            ('P', InputFunction::Probe),
            ('D', InputFunction::Door),
            ('R', InputFunction::EmergencyStop),
        ];
        for (letter, meant) in others {
            if self.has_input(|function| *function == meant) {
                pins.push(letter);
            }
        }
        pins
    }

    /// M3, M4 and M8 in force, as `A:` tells them; on the machine while it does something, else in the program.
    fn accessories(&self) -> String {
        let modals = self.reader.modals();
        let mut letters = String::new();
        match modals.laser {
            Some(LaserMode::Constant) => letters.push('S'),
            Some(LaserMode::Proportional) => letters.push('C'),
            None => {}
        }
        let air = self.machine.operating.outputs.iter();
        let mut air =
            air.filter(|output| output.function == machine::operating::OutputFunction::Air);
        let is_on = air.any(|output| {
            self.status.is_some_and(|status| status.outputs.get(&output.name) == Some(&true))
        });
        if is_on {
            letters.push('F');
        }
        letters
    }
}

/// Which parts of its reports a client has had.
#[derive(Debug, Clone, Default)]
pub struct Reporter {
    until_offset: u32,
    until_overrides: u32,
    offset: Option<[f64; 3]>,
    overrides: Option<Overrides>,
}

impl Reporter {
    /// The next report.
    pub fn report(&mut self, doing: &Doing<'_>) -> String {
        let state = doing.state();
        let settings = doing.settings;
        let tool = doing.status.map_or(doing.machine.home, |status| status.tool);
        let zero = doing.reader.zero();
        let is_busy = usize::from(!matches!(state, "Idle" | "Alarm" | "Sleep" | "Check"));
        let mut text = format!("<{state}");
        // Writing to a string does not fail.
        let _ = if settings.report & MACHINE_POSITION != 0 {
            write!(text, "|MPos:{}", place(settings, tool))
        } else {
            let work = core::array::from_fn(|axis| tool[axis] - zero[axis]);
            write!(text, "|WPos:{}", place(settings, work))
        };
        if settings.report & BUFFER != 0 {
            let [blocks, bytes] = doing.room;
            let _ = write!(text, "|Bf:{blocks},{bytes}");
        }
        let line = doing
            .status
            .and_then(|status| status.line)
            .map_or(0, |line| line.saturating_sub(doing.before));
        if line > 0 && doing.has_work {
            let _ = write!(text, "|Ln:{line}");
        }
        let (speed, power) = doing.status.map_or((0.0, 0.0), |status| (status.speed, status.power));
        let unit = if settings.in_inches { INCH } else { MILLIMETRE };
        let (feed, level) = (speed.abs() / unit * MINUTE, power * settings.full_scale);
        let _ = write!(text, "|FS:{feed:.0},{level:.0}");
        let pins = doing.pins();
        if !pins.is_empty() {
            let _ = write!(text, "|Pn:{pins}");
        }
        if self.offset != Some(zero) {
            self.until_offset = 0;
        }
        if self.overrides.is_some_and(|told| told != doing.overrides) {
            self.until_overrides = 0;
        }
        if self.until_offset == 0 {
            self.offset = Some(zero);
            self.until_offset = OFFSET_EVERY[is_busy];
            // They follow in the next report.
            self.until_overrides = self.until_overrides.max(1);
            let _ = write!(text, "|WCO:{}", place(settings, zero));
        } else if self.until_overrides == 0 {
            self.overrides = Some(doing.overrides);
            self.until_overrides = OVERRIDES_EVERY[is_busy];
            let Overrides { rate, rapid, power } = doing.overrides;
            let _ = write!(text, "|Ov:{rate},{rapid},{power}");
            let accessories = doing.accessories();
            if !accessories.is_empty() {
                let _ = write!(text, "|A:{accessories}");
            }
        }
        self.until_offset = self.until_offset.saturating_sub(1);
        self.until_overrides = self.until_overrides.saturating_sub(1);
        text.push('>');
        text
    }
}

/// Three lengths as a report has them.
fn place(settings: &Settings, place: [f64; 3]) -> String {
    let (unit, digits, last) =
        if settings.in_inches { (INCH, 4, 1e-4) } else { (MILLIMETRE, 3, 1e-3) };
    // No minus before a zero.
    let told = place.map(|length| {
        let value = length / unit;
        let value = if value.abs() < 0.5 * last { 0.0 } else { value };
        format!("{value:.digits$}")
    });
    told.join(",")
}

/// The answer to `$G`.
pub fn modes(reader: &LineReader, settings: &Settings) -> String {
    let modals = reader.modals();
    let unit = if modals.is_inch { INCH } else { MILLIMETRE };
    let system = match modals.system {
        system @ 54..=59 => format!("G{system}"),
        system => format!("G59.{}", system - 59),
    };
    let laser = match modals.laser {
        Some(LaserMode::Constant) => "M3",
        Some(LaserMode::Proportional) => "M4",
        None => "M5",
    };
    format!(
        "[GC:G{} {system} G{} G{} G{} G{} {laser} {} T0 F{:.0} S{:.0}]",
        modals.motion.unwrap_or(0),
        modals.plane,
        if modals.is_inch { 20 } else { 21 },
        if modals.is_incremental { 91 } else { 90 },
        if modals.is_inverse_time { 93 } else { 94 },
        if modals.air { "M8" } else { "M9" },
        modals.feed.unwrap_or(0.0) / unit * MINUTE,
        modals.level.unwrap_or(0.0) * settings.full_scale,
    )
}

/// The answer to `$#`.
pub fn places(reader: &LineReader, settings: &Settings, probed: ([f64; 3], bool)) -> Vec<String> {
    let origins = reader.origins();
    let mut lines: Vec<String> = (0..6)
        .map(|system| format!("[G{}:{}]", 54 + system, place(settings, origins[system])))
        .collect();
    for (code, kept) in ["G28", "G30"].into_iter().zip(reader.kept()) {
        lines.push(format!("[{code}:{}]", place(settings, kept)));
    }
    lines.push(format!("[G92:{}]", place(settings, reader.shift())));
    lines.push(format!("[TLO:{}]", if settings.in_inches { "0.0000" } else { "0.000" }));
    lines.push(probe(settings, probed.0, probed.1));
    lines
}

/// Where the probe has touched.
pub fn probe(settings: &Settings, at: [f64; 3], touched: bool) -> String {
    format!("[PRB:{}:{}]", place(settings, at), u8::from(touched))
}

/// A name without what ends a message.
pub fn plain(name: &str) -> String {
    let is_plain = |character: &char| !"[]:".contains(*character) && !character.is_control();
    name.chars().filter(is_plain).collect()
}
