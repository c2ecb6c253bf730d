//! A session with a machine that moves in the test's own time.

use std::path::PathBuf;

use grbl::machine::{Answer, Ask, JobState};
use grbl::session::Session;
use machine::Machine;
use machine::operating::{Input, InputFunction, Output, OutputFunction};
use operator::{AxisStatus, Probed, Status, Verb};

/// Step of the test's time [s].
const STEP: f64 = 0.01;

/// How long a job takes for each of its lines [s].
const LINE_TIME: f64 = 0.02;

/// The built-in machine with its home at 100, 100 mm of an area of 200 mm, with air and a probe.
pub(crate) fn machine() -> Machine {
    let mut machine = Machine::builtin();
    machine.area.lower = [0.0; 3];
    machine.area.upper = [0.2, 0.2, 0.0];
    machine.home = [0.1, 0.1, 0.0];
    machine.gcode.origins = [[0.0; 3]; 9];
    machine.gcode.air_assist = true;
    machine.operating.outputs =
        vec![Output { name: "air".into(), function: OutputFunction::Air, is_active_low: false }];
    machine.operating.inputs = vec![Input {
        name: "probe".into(),
        function: InputFunction::Probe,
        is_active_low: false,
        simulated: None,
    }];
    machine
}

/// A machine that answers at once, and moves as the test's time passes.
#[derive(Debug)]
pub(crate) struct FakeMachine {
    pub(crate) status: Status,
    /// All that was asked.
    pub(crate) asked: Vec<Ask>,
    /// Jobs that wait or are under way, with the time that they still take [s].
    pub(crate) jobs: Vec<(u64, f64)>,
    ended: Vec<(u64, String, Option<String>)>,
    next_job: u64,
    /// How the next job ends instead of well, at once.
    pub(crate) refuses: Option<String>,
    /// Where the probe touches along x, if it does [m].
    pub(crate) touches_at: Option<f64>,
    motion: f64,
    to: [f64; 3],
    end: &'static str,
}

impl FakeMachine {
    pub(crate) fn new() -> Self {
        let mut status =
            Status { state: "idle".into(), tool: [0.1, 0.1, 0.0], rate: 1.0, ..Status::default() };
        for name in ["x", "y"] {
            let axis =
                AxisStatus { position: 0.1, unit: "m".into(), homed: true, limits: [None; 2] };
            status.axes.insert(name.into(), axis);
        }
        status.outputs.insert("air".into(), false);
        Self {
            to: status.tool,
            status,
            asked: Vec::new(),
            jobs: Vec::new(),
            ended: Vec::new(),
            next_job: 1,
            refuses: None,
            touches_at: None,
            motion: 0.0,
            end: "reached",
        }
    }

    pub(crate) fn ask(&mut self, ask: &Ask) -> Answer {
        self.asked.push(ask.clone());
        self.status.requests += 1;
        let done = Answer::Done(self.status.requests);
        match ask {
            Ask::Verb { verb: Verb::Hold, .. } if self.status.state == "running" => {
                self.set("holding")
            }
            Ask::Verb { verb: Verb::Resume, .. } if self.status.state == "holding" => {
                self.set("running")
            }
            Ask::Verb { verb: Verb::Stop, .. } => {
                if matches!(self.status.state.as_str(), "running" | "holding") {
                    let (job, _) = self.jobs.remove(0);
                    self.ended.push((job, "stopped".into(), None));
                }
                self.rest("stopped");
            }
            Ask::Verb { verb: Verb::Reset, .. } => {
                self.status.fault = None;
                self.set("disabled");
            }
            Ask::Verb { verb: Verb::Enable, .. } => self.begin("enabling", self.status.tool, 0.05),
            Ask::Verb { verb: Verb::Disable, .. } => self.set("disabled"),
            Ask::Verb { .. } => {}
            Ask::Operate { verb: Verb::Home, .. } => {
                self.status.unhomed.clear();
                self.begin("homing", [0.1, 0.1, 0.0], 0.3);
            }
            Ask::Operate { verb: Verb::Jog, .. } => self.rest("stopped"),
            Ask::Operate { verb: Verb::Step, axes, value, second } => {
                let mut to = self.to;
                to[usize::from(axes[0] == "y")] += value;
                self.begin("jogging", to, value.abs() / second);
            }
            Ask::Operate { verb: Verb::Probe, value, second, .. } => {
                let mut to = self.to;
                to[0] += value;
                let touches = self.touches_at.filter(|at| (at - self.to[0]) * (at - to[0]) <= 0.0);
                to[0] = touches.unwrap_or(to[0]);
                self.begin("probing", to, value.abs() / second);
                self.end = if touches.is_some() { "reached" } else { "not_touched" };
                self.status.probed =
                    touches.map(|position| Probed { axis: "x".into(), position, unit: "m".into() });
            }
            Ask::Operate { .. } => {}
            Ask::Output { name, is_on } => {
                self.status.outputs.insert(name.clone(), *is_on);
            }
            Ask::Submit { file, .. } => {
                let job = self.next_job;
                self.next_job += 1;
                match self.refuses.take() {
                    Some(words) => self.ended.push((job, "refused".into(), Some(words))),
                    None => {
                        let lines = std::fs::read_to_string(file).unwrap().lines().count();
                        self.jobs.push((job, lines as f64 * LINE_TIME));
                    }
                }
                return Answer::Submitted(job);
            }
            Ask::Withdraw { job } => {
                if self.jobs.first().is_some_and(|(first, _)| first == job) {
                    self.rest("stopped");
                }
                self.jobs.retain(|(number, _)| number != job);
                self.ended.push((*job, "stopped".into(), None));
            }
        }
        done
    }

    fn set(&mut self, state: &str) {
        self.status.state = state.into();
    }

    fn begin(&mut self, state: &str, to: [f64; 3], time: f64) {
        (self.motion, self.to, self.end) = (time, to, "reached");
        self.set(state);
        self.status.motion_end = "none".into();
    }

    fn rest(&mut self, end: &str) {
        self.status.motion_end = end.into();
        (self.motion, self.to) = (0.0, self.status.tool);
        if self.status.state != "faulted" && self.status.state != "disabled" {
            self.set("idle");
        }
    }

    /// A fault of this name.
    pub(crate) fn fault(&mut self, code: &str) {
        self.status.fault = Some(code.into());
        self.jobs.drain(..).for_each(|(job, _)| self.ended.push((job, "faulted".into(), None)));
        self.set("faulted");
    }

    pub(crate) fn pass(&mut self, time: f64) {
        match self.status.state.as_str() {
            "idle" | "disabled" if !self.jobs.is_empty() => self.set("running"),
            "running" => match self.jobs.first_mut() {
                Some((_, left)) if *left > time => *left -= time,
                Some(_) => {
                    let (job, _) = self.jobs.remove(0);
                    self.ended.push((job, "completed".into(), None));
                    self.set("idle");
                }
                None => self.set("idle"),
            },
            "homing" | "jogging" | "probing" | "enabling" => {
                self.motion -= time;
                if self.motion <= 0.0 {
                    self.status.tool = self.to;
                    self.status.motion_end = self.end.into();
                    self.set("idle");
                }
            }
            _ => {}
        }
        self.status.job_number = self.jobs.first().map(|(job, _)| *job);
    }

    pub(crate) fn job(&self, number: u64) -> JobState {
        let ended = self.ended.iter().find(|(job, ..)| *job == number);
        match ended {
            Some((_, outcome, message)) => {
                JobState::Ended { outcome: outcome.clone(), message: message.clone() }
            }
            None => JobState::Goes,
        }
    }

    /// The programs that were handed over.
    pub(crate) fn programs(&self) -> Vec<String> {
        let files = self.asked.iter().filter_map(|ask| match ask {
            Ask::Submit { file, .. } => Some(file),
            _ => None,
        });
        files.map(|file| std::fs::read_to_string(file).unwrap()).collect()
    }
}

/// A session and its machine.
pub(crate) struct Bench {
    pub(crate) session: Session,
    pub(crate) machine: FakeMachine,
    pub(crate) now: f64,
    heard: String,
    _folder: tempfile::TempDir,
}

impl Bench {
    /// A client that has been greeted.
    pub(crate) fn new() -> Self {
        Self::of(machine())
    }

    pub(crate) fn of(machine: Machine) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let session = Session::new(machine, PathBuf::from(folder.path()));
        let (machine, heard) = (FakeMachine::new(), String::new());
        let mut bench = Self { session, machine, now: 0.0, heard, _folder: folder };
        bench.step();
        bench.session.connect(bench.now);
        bench.step();
        assert_eq!(bench.lines(), ["", "Grbl 1.1h ['$' for help]"]);
        bench
    }

    /// Sends bytes.
    pub(crate) fn send(&mut self, bytes: impl AsRef<[u8]>) {
        self.session.receive(bytes.as_ref(), self.now);
        self.settle();
    }

    /// Sends bytes, and gives the lines that come at once.
    pub(crate) fn ask(&mut self, bytes: impl AsRef<[u8]>) -> Vec<String> {
        self.send(bytes);
        self.lines()
    }

    /// Carries out what is asked, and hears what is said.
    fn settle(&mut self) {
        loop {
            let asks = self.session.take_asks();
            if asks.is_empty() {
                break;
            }
            for (ticket, ask) in asks {
                let answer = self.machine.ask(&ask);
                self.session.answered(ticket, answer, self.now);
            }
        }
        self.heard += std::str::from_utf8(&self.session.take_output()).unwrap();
    }

    fn step(&mut self) {
        self.now += STEP;
        self.machine.pass(STEP);
        self.session.observe(Some(self.machine.status.clone()), self.now);
        for job in self.session.jobs() {
            self.session.job(job, self.machine.job(job), self.now);
        }
        self.session.tick(self.now);
        self.settle();
    }

    /// Lets time pass [s].
    pub(crate) fn pass(&mut self, time: f64) {
        let steps = (time / STEP).round() as u64;
        (0..steps).for_each(|_| self.step());
    }

    /// The lines that have come since the last time.
    pub(crate) fn lines(&mut self) -> Vec<String> {
        std::mem::take(&mut self.heard).lines().map(str::to_owned).collect()
    }

    /// The state that a status report tells.
    pub(crate) fn state(&mut self) -> String {
        self.lines();
        let lines = self.ask("?");
        let report = lines.last().unwrap();
        report[1..report.find('|').unwrap()].to_owned()
    }
}
