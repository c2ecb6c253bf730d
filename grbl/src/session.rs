//! The protocol: bytes of a client and what the machine says go in, bytes for the client and requests come out.
//!
//! It does no input or output but for the files of its programs, and knows no clock: who drives it says the time. What a
//! person would lose with a connection (work offsets, what is in force, jobs) belongs to the session, which outlives its
//! clients.
//!
//! Lines are answered in order, one `ok` or `error:N` each. A line that waits for the machine *holds*: it and those
//! behind it are answered later. A line that holds never waits for one that the client has not sent: see
//! [`Session::tick`].

mod hand;
mod lines;
mod procedure;
mod program;
mod realtime;
mod system;

use std::collections::{BTreeSet, VecDeque};

use ::machine::Machine;
use ::machine::gcode_settings::{Dialect, WordMeanings};
use operator::{Status, Verb};
use planner::job::gcode::LineReader;

use crate::codes::{Alarm, ErrorCode};
use crate::machine::{Answer, Ask, JobState};
use crate::report::{Doing, Reporter};
use crate::settings::Settings;
use crate::spool::{Spool, SpoolFolder};

use procedure::{Follow, Outcome, Procedure, Step, is_busy};
pub use realtime::{Realtime, Splitter, Unit};

/// What it says first, and after a reset.
pub const GREETING: &str = "Grbl 1.1h ['$' for help]";

/// Bytes of lines that a client may have under way, as `Bf:` and `[OPT:` tell.
pub const WINDOW: usize = 128;

/// Blocks that `Bf:` and `[OPT:` tell.
pub const BLOCKS: usize = 15;

/// How long a client that may go on says nothing when its program has ended [s].
const SILENCE: f64 = 0.5;

/// The same after a single line that only moves in the dark [s].
const SHORT_SILENCE: f64 = 0.15;

/// How long a machine that does not answer counts as doing what it did [s].
const MACHINE_PATIENCE: f64 = 2.0;

/// Bytes that are kept at most for a client that does not read.
const MOST_OUTPUT: usize = 1 << 20;

/// A line that was received and not answered.
#[derive(Debug)]
enum Waiting {
    Line(Vec<u8>),
    /// One that was too long, or one too many.
    Dropped,
}

/// What the first line waits for.
#[derive(Debug, Clone, PartialEq)]
enum Held {
    /// That all jobs have ended and the machine stands, and for so long after it [s].
    Rest { dwell: f64, since: Option<f64> },
    /// The same, but released by the next line.
    Dwell { dwell: f64, since: Option<f64> },
    /// That requests are carried out.
    Procedure,
    /// Room for another jog.
    JogRoom,
}

/// A request that is asked for, and what it is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Purpose {
    /// Nobody waits for it.
    Free,
    /// The line that is held.
    Line,
    /// The jog under way.
    Jog,
    /// A job.
    Submit,
    /// Another override.
    Override,
}

/// A job of this session.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct OwnJob {
    /// `None` until the machine has answered.
    number: Option<u64>,
    ticket: u64,
    /// Lines before the client's first.
    before: u64,
}

/// Percents of the overrides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Overrides {
    /// Of the rate.
    pub rate: u8,
    /// Of rapids.
    pub rapid: u8,
    /// Of the power.
    pub power: u8,
}

impl Overrides {
    /// As planned.
    pub const NONE: Self = Self { rate: 100, rapid: 100, power: 100 };
}

/// One machine's grbl.
#[derive(Debug)]
pub struct Session {
    machine: Machine,
    settings: Settings,
    reader: LineReader,
    splitter: Splitter,
    spools: SpoolFolder,
    spool: Option<Gathered>,
    jobs: VecDeque<OwnJob>,
    waiting: VecDeque<Waiting>,
    waiting_bytes: usize,
    held: Option<Held>,
    procedure: Procedure,
    jogs: VecDeque<hand::Jog>,
    jogging: Procedure,
    /// Where the newest jog leads, machine frame [m].
    jog_end: Option<[f64; 3]>,
    output: Vec<u8>,
    asks: Vec<(u64, Ask)>,
    purposes: Vec<(u64, Purpose)>,
    /// Requests for motion that a reset or a jog cancel has forgotten, and that are not answered yet.
    orphans: BTreeSet<u64>,
    tickets: u64,
    status: Option<Status>,
    /// When the machine answered last [s].
    answered: f64,
    overrides: Overrides,
    /// The number of the newest request for an override that the machine has accepted.
    override_number: u32,
    /// Whether a client has unlocked a machine that is not homed.
    is_unlocked: bool,
    /// An alarm of the session itself.
    alarm: Option<Alarm>,
    /// The fault that was told.
    told_fault: Option<String>,
    is_paused: bool,
    /// Whether a job that begins is to be held at once.
    holds_next: bool,
    is_door: bool,
    is_checking: bool,
    is_asleep: bool,
    /// Where the probe touched last, machine frame [m], and whether it did.
    probed: ([f64; 3], bool),
    /// The axis that probes, and whether it must touch.
    probing: Option<(usize, bool)>,
    reporter: Reporter,
    now: f64,
    /// When the last byte came that is no realtime command [s].
    heard: f64,
    is_connected: bool,
}

/// A program that is being gathered.
#[derive(Debug)]
struct Gathered {
    spool: Spool,
    /// Whether anything of it moves, lights or pauses.
    has_work: bool,
    /// Whether anything of it is lit, or more than one line has work.
    is_more: bool,
    /// Lines that were refused, and the first of them.
    refused: u64,
    first_refused: Option<(u64, String)>,
}

impl Session {
    /// For `machine`, whose programs are kept in the folder at `spools`.
    pub fn new(mut machine: Machine, spools: std::path::PathBuf) -> Self {
        let full_scale = machine.gcode.words.full_scale;
        machine.gcode.words = WordMeanings { full_scale, ..Dialect::Grbl.meanings() };
        let settings = Settings::of(&machine);
        let mut reader = LineReader::new(&machine);
        reader.reset();
        Self {
            settings,
            reader,
            splitter: Splitter::default(),
            spools: SpoolFolder::new(spools),
            spool: None,
            jobs: VecDeque::new(),
            waiting: VecDeque::new(),
            waiting_bytes: 0,
            held: None,
            procedure: Procedure::default(),
            jogs: VecDeque::new(),
            jogging: Procedure::default(),
            jog_end: None,
            output: Vec::new(),
            asks: Vec::new(),
            purposes: Vec::new(),
            orphans: BTreeSet::new(),
            tickets: 0,
            status: None,
            answered: 0.0,
            overrides: Overrides::NONE,
            override_number: 0,
            is_unlocked: false,
            alarm: None,
            told_fault: None,
            is_paused: false,
            holds_next: false,
            is_door: false,
            is_checking: false,
            is_asleep: false,
            probed: ([0.0; 3], false),
            probing: None,
            reporter: Reporter::default(),
            now: 0.0,
            heard: 0.0,
            is_connected: false,
            machine,
        }
    }

    /// A client is there: it is greeted. Nothing on the machine changes.
    pub fn connect(&mut self, now: f64) {
        self.now = now;
        self.is_connected = true;
        self.reporter = Reporter::default();
        self.greet();
    }

    /// The client has gone. Its jobs go on, its jogs do not; a program of which it has not sent the end is thrown away.
    pub fn disconnect(&mut self, now: f64) {
        self.now = now;
        self.cancel_jog();
        self.is_connected = false;
        self.splitter = Splitter::default();
        self.forget_lines();
        if let Some(gathered) = self.spool.take() {
            gathered.spool.discard();
        }
        self.output.clear();
    }

    fn greet(&mut self) {
        self.output.extend_from_slice(b"\r\n");
        self.line(GREETING);
        if self.is_locked() {
            self.line("[MSG:'$H'|'$X' to unlock]");
        }
    }

    /// Takes what the machine says; `None` where nobody answers.
    pub fn observe(&mut self, status: Option<Status>, now: f64) {
        self.now = now;
        if status.is_none() && now - self.answered > MACHINE_PATIENCE {
            self.status = None;
        }
        if let Some(status) = status {
            self.answered = now;
            self.note_fault(&status);
            if status.unhomed.is_empty() {
                self.is_unlocked = false;
            }
            self.follow_overrides(&status);
            if self.holds_next && status.state == "running" {
                self.holds_next = false;
                self.ask_quietly(Verb::Hold, 0.0);
            }
            self.status = Some(status);
        }
        self.go_on();
    }

    /// Takes what came of the request with the number `ticket`.
    pub fn answered(&mut self, ticket: u64, answer: Answer, now: f64) {
        self.now = now;
        let place = self.purposes.iter().position(|(number, _)| *number == ticket);
        if self.orphans.remove(&ticket) && matches!(answer, Answer::Done(_)) {
            // It was on its way while a reset forgot it.
            self.ask_quietly(Verb::Stop, 0.0);
        }
        if let Some(place) = place {
            let (_, purpose) = self.purposes.swap_remove(place);
            match purpose {
                Purpose::Free | Purpose::Override => match answer {
                    Answer::Refused(words) => self.message(&words),
                    Answer::Done(number) if purpose == Purpose::Override => {
                        self.override_number = number;
                    }
                    _ => {}
                },
                Purpose::Line => {
                    let outcome = self.procedure.answered(ticket, &answer);
                    self.end_procedure(outcome);
                }
                Purpose::Jog => {
                    let outcome = self.jogging.answered(ticket, &answer);
                    self.end_jog(outcome);
                }
                Purpose::Submit => self.submitted(ticket, answer),
            }
        }
        self.go_on();
    }

    /// Takes where a job of this session is.
    pub fn job(&mut self, number: u64, state: JobState, now: f64) {
        self.now = now;
        self.job_goes(number, state);
        self.go_on();
    }

    /// Whether it waits for something of the machine.
    pub fn is_active(&self) -> bool {
        !self.jobs.is_empty() || !self.jogging.is_over() || self.spool.is_some()
    }

    /// Jobs of this session that are under way or wait, by number.
    pub fn jobs(&self) -> Vec<u64> {
        self.jobs.iter().filter_map(|job| job.number).collect()
    }

    /// Time goes on. A line that is held, a full window and silence begin the program that was gathered.
    pub fn tick(&mut self, now: f64) {
        self.now = now;
        self.go_on();
    }

    /// What the client is to be sent.
    pub fn take_output(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.output)
    }

    /// Requests to the machine, each with its number.
    pub fn take_asks(&mut self) -> Vec<(u64, Ask)> {
        std::mem::take(&mut self.asks)
    }

    /// Asks the machine for something.
    fn ask(&mut self, ask: Ask, purpose: Purpose) -> u64 {
        self.tickets += 1;
        self.asks.push((self.tickets, ask));
        self.purposes.push((self.tickets, purpose));
        self.tickets
    }

    fn ask_verb(&mut self, verb: Verb, value: f64) {
        self.ask(Ask::Verb { verb, value }, Purpose::Free);
    }

    // What it knows.

    fn state(&self) -> &str {
        self.status.as_ref().map_or("", |status| status.state.as_str())
    }

    /// Whether a person has to unlock it first.
    fn is_locked(&self) -> bool {
        let is_unhomed = self.status.as_ref().is_some_and(|status| !status.unhomed.is_empty());
        self.alarm.is_some()
            || matches!(self.state(), "faulted" | "halted")
            || is_unhomed && !self.is_unlocked
    }

    /// Where the tool is, machine frame [m].
    fn tool(&self) -> [f64; 3] {
        self.status.as_ref().map_or(self.machine.home, |status| status.tool)
    }

    /// Tells a fault that is new.
    fn note_fault(&mut self, status: &Status) {
        if status.fault == self.told_fault {
            return;
        }
        self.told_fault.clone_from(&status.fault);
        let Some(code) = &status.fault else { return };
        let detail =
            status.faults.last().map_or_else(|| code.clone(), |fault| fault.detail.clone());
        self.message(&format!("fault: {detail}; $X clears it"));
        let alarm = Alarm::of_fault(code);
        self.line(&format!("ALARM:{}", alarm as u8));
        self.drop_work();
        self.fail_held();
    }

    /// Raises an alarm of the session.
    fn raise(&mut self, alarm: Alarm) {
        self.alarm = Some(alarm);
        self.line(&format!("ALARM:{}", alarm as u8));
        self.line("[MSG:'$H'|'$X' to unlock]");
    }

    /// Answers the held line with an error: what it waits for will not come.
    fn fail_held(&mut self) {
        if self.held.take().is_some() {
            self.procedure = Procedure::default();
            self.purposes.retain(|(_, purpose)| *purpose != Purpose::Line);
            self.error(ErrorCode::Locked);
        }
    }

    /// Gives up what was gathered, what waits and the jogs.
    fn drop_work(&mut self) {
        if let Some(gathered) = self.spool.take() {
            gathered.spool.discard();
        }
        let jobs: Vec<u64> = self.jobs();
        self.jobs.clear();
        for job in jobs {
            self.ask(Ask::Withdraw { job }, Purpose::Free);
        }
        self.jogs.clear();
        self.jogging = Procedure::default();
        self.jog_end = None;
        // A job whose number is not known yet is taken back as soon as it is.
    }

    /// A status report.
    fn report(&mut self) {
        let mut reporter = std::mem::take(&mut self.reporter);
        let text = reporter.report(&self.doing());
        self.reporter = reporter;
        self.line(&text);
    }

    /// A status report for somebody who only watches.
    pub fn watched(&self, reporter: &mut Reporter) -> String {
        reporter.report(&self.doing())
    }

    fn doing(&self) -> Doing<'_> {
        let spools = self.spool.as_ref().is_some_and(|gathered| gathered.has_work);
        let before = self.jobs.front().map_or(0, |job| job.before);
        Doing {
            status: self.status.as_ref(),
            settings: &self.settings,
            reader: &self.reader,
            machine: &self.machine,
            overrides: self.overrides,
            is_locked: self.is_locked(),
            is_asleep: self.is_asleep,
            is_checking: self.is_checking,
            is_paused: self.is_paused,
            is_door: self.is_door,
            is_jogging: !self.jogs.is_empty() || !self.jogging.is_over(),
            has_work: spools
                || !self.jobs.is_empty()
                || matches!(self.held, Some(Held::Rest { .. } | Held::Dwell { .. })),
            before,
            room: [BLOCKS - self.jogs.len().min(BLOCKS), self.room()],
        }
    }
}

/// The distance between two places [m].
fn distance(one: [f64; 3], other: [f64; 3]) -> f64 {
    let square: f64 = one.iter().zip(other).map(|(one, other)| (one - other) * (one - other)).sum();
    square.sqrt()
}
