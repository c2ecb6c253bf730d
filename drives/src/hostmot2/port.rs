//! The port: what the machine file says, held to the board that answers.

use std::net::{SocketAddr, ToSocketAddrs};

use machine::drives::{Hostmot2, Hostmot2Actuator, Xy2Frame};
use machine::{ActuatorMode, DrivesKind, Machine};
use messages::{LinkCounters, Nanoseconds};

use super::arming::{BoardClock, Pins, Watchdog};
use super::asking::Asking;
use super::axes::Drive;
use super::config::{Config, Connection};
use super::digital::Digital;
use super::gate::Gate;
use super::idrom::{Board, BoardError, Kind};
use super::lbp16::{self, Reply, Request};
use super::pwm::Pwms;
use super::session::{Counters, Parts, Session, Trouble};
use crate::fired::Fired;
use crate::link::{Link, UdpLink};
use crate::port::{Actuation, ActuatorProfile, Measurement, Port, PortClock, PortError, Profile};

/// An edge of the gate is at most half of it away: clocks of 10 ns, and what the board's clock is off by.
const GATE_RESOLUTION: Nanoseconds = Nanoseconds(1000);
/// What of a period the gate and the mirrors may be later than the deadline: a request must be there before,
/// and the one after next must not be.
const LATENCY: [f64; 2] = [0.1, 0.9];
/// Cycles in a turn of the board's clock at least, and watchdog's times.
const TURN: [f64; 2] = [8.0, 2.0];
/// Pin functions of a one-shot's second timer.
const SECOND_TIMER: u8 = 4;

/// Why a board cannot be opened; each says what would be right.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum OpenError {
    /// Nobody answers.
    #[error(
        "the board at {0} does not answer: check its power, the cable, the address of the network interface \
         beside it, and that no firewall stands between"
    )]
    Silent(String),
    /// It is not what is asked for.
    #[error("{0}; change [drives.hostmot2], or load firmware that has it")]
    Board(BoardError),
    /// The operating system refuses something.
    #[error("{about}: {reason}")]
    System {
        /// What was asked of it.
        about: String,
        /// Its answer, and what would help.
        reason: String,
    },
    /// A latency that no board has.
    #[error("{what} has a latency of {found} us: write {expected} in [drives.hostmot2]")]
    Latency {
        /// Whose.
        what: String,
        /// The latency [µs].
        found: f64,
        /// What can be.
        expected: String,
    },
    /// As many connections as actuators are needed.
    #[error("{connections} actuators are connected, and the machine has {actuators}")]
    Count {
        /// Connections.
        connections: usize,
        /// Actuators.
        actuators: usize,
    },
}

/// A HostMot2 board as drives.
pub struct Hostmot2Port {
    machine: Machine,
    config: Config,
    profile: Profile,
    link: Option<Box<dyn Link>>,
    session: Option<Session>,
}

impl Hostmot2Port {
    /// The port of `machine`, connected as `config` says, not open yet.
    ///
    /// # Errors
    /// A latency that no board can have, or another number of actuators.
    pub fn new(machine: &Machine, config: Config) -> Result<Self, OpenError> {
        let (connections, actuators) = (config.actuators.len(), machine.actuators.len());
        if connections != actuators {
            return Err(OpenError::Count { connections, actuators });
        }
        let profile = profile(&config);
        let port = Self { machine: machine.clone(), config, profile, link: None, session: None };
        port.check_latencies()?;
        Ok(port)
    }

    /// The same by another link than a socket.
    #[must_use]
    pub fn with_link(mut self, link: Box<dyn Link>) -> Self {
        self.link = Some(link);
        self
    }

    /// The port that the machine file's [drives.hostmot2] asks for, not open yet.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn of(machine: &Machine) -> Result<Self, PortError> {
        let DrivesKind::Hostmot2(table) = &machine.drives.kind else {
            return Err(PortError::Unsupported {
                what: "the machine file has no [drives.hostmot2]".to_owned(),
                instead: "add it, with the board's address".to_owned(),
            });
        };
        Self::new(machine, config(machine, table)).map_err(OpenError::into)
    }

    /// Finds the board, holds it to what is connected, and arms its watchdog, before the clock starts.
    ///
    /// # Errors
    /// A board that is not there, or lacks something.
    fn find(&mut self) -> Result<(), OpenError> {
        let link = self.connect()?;
        let session = self.set_up(link).map_err(|error| self.explain(error))?;
        self.session = Some(session);
        Ok(())
    }

    /// Leaves the board dark, with all its pins inputs and the watchdog off.
    ///
    /// # Errors
    /// A board that does not answer; its watchdog makes its pins inputs, then.
    fn leave(&mut self) -> Result<(), OpenError> {
        let Some(mut session) = self.session.take() else { return Ok(()) };
        let Parts { link, watchdog, pins, gate, pwms, .. } = session.parts();
        let mut asking = Asking::new(link.as_mut());
        let done = asking.ask(|request| {
            gate.iter().for_each(|gate| gate.dark(request));
            pwms.iter().for_each(|pwms| pwms.enable(request, 0));
            pins.release(request);
            watchdog.disarm(request);
        });
        done.map(|_| ()).map_err(|error| self.explain(error))
    }

    /// What was counted on the way to the board.
    pub fn counters(&self) -> Counters {
        self.session.as_ref().map(Session::counters).unwrap_or_default()
    }

    /// Why the board has stopped the machine by itself, if it has.
    pub fn trouble(&self) -> Option<Trouble> {
        self.session.as_ref().and_then(Session::trouble)
    }

    fn period(&self) -> f64 {
        self.machine.realtime.period.seconds()
    }

    fn check_latencies(&self) -> Result<(), OpenError> {
        let period = self.machine.realtime.period.time();
        let [least, most] = LATENCY.map(|share| Nanoseconds((share * period.0 as f64) as i64));
        let check = |what: String, latency: Nanoseconds, [least, most]: [Nanoseconds; 2]| {
            if (least..=most).contains(&latency) {
                return Ok(());
            }
            let [found, least, most] = [latency, least, most].map(|time| time.seconds() * 1e6);
            let expected = format!("{least} us to {most} us");
            Err(OpenError::Latency { what, found, expected })
        };
        if !self.config.gate.is_empty() {
            check("the laser's gate".to_owned(), self.config.gate_latency, [least, most])?;
        }
        for ((on, latency), actuator) in self.config.actuators.iter().zip(&self.machine.actuators) {
            let range = match on {
                Connection::Stepgen { .. } => [Nanoseconds(0), period],
                Connection::Xy2mod { .. } => [least, most],
                Connection::Pwm { .. } => [Nanoseconds(0); 2],
            };
            check(format!("the actuator `{}`", actuator.name), *latency, range)?;
        }
        Ok(())
    }

    fn connect(&mut self) -> Result<Box<dyn Link>, OpenError> {
        if let Some(link) = self.link.take() {
            return Ok(link);
        }
        let address = resolve(&self.config.address)?;
        let link = UdpLink::open(address).map_err(|error| OpenError::System {
            about: format!("a socket for the board at {address}"),
            reason: error.to_string(),
        })?;
        Ok(Box::new(link))
    }

    fn explain(&self, error: BoardError) -> OpenError {
        match error {
            BoardError::Silent => OpenError::Silent(self.config.address.clone()),
            error => OpenError::Board(error),
        }
    }

    /// Finds the board and sets it up.
    fn set_up(&self, mut link: Box<dyn Link>) -> Result<Session, BoardError> {
        let board = Board::read(link.as_mut())?;
        let Machine { actuators, axes, laser, realtime, .. } = &self.machine;
        let period = self.period();
        let mut drives = Vec::with_capacity(actuators.len());
        for (on, actuator) in self.config.actuators.iter().zip(actuators) {
            let Some(axis) = axes.get(actuator.axis) else { continue };
            let home = self.machine.home_joints.get(actuator.axis).copied().unwrap_or(0.0);
            drives.push(Drive::new(&board, on, actuator, axis, period, home / actuator.ratio)?);
        }
        let mut pins = Pins::new(&board)?;
        for (on, _) in &self.config.actuators {
            let (kind, unit) = match *on {
                Connection::Stepgen { stepgen, .. } => (Kind::Stepgen, stepgen),
                Connection::Pwm { pwm, .. } => (Kind::Pwm, pwm),
                Connection::Xy2mod { xy2mod, .. } => (Kind::Xy2mod, xy2mod),
            };
            board.outputs(kind, unit).for_each(|pin| pins.output(pin));
        }
        let mut gate = None;
        for shot in &self.config.gate {
            let module = board.module(Kind::Oneshot, *shot)?;
            pins.gate(board.output(Kind::Oneshot, *shot, SECOND_TIMER)?);
            gate = Some(Gate::new(module, &self.config.gate, realtime.period.time().0 as f64));
        }
        let power = self.config.power;
        if let Some(power) = power {
            board.module(Kind::Pwm, power)?;
            board.outputs(Kind::Pwm, power).for_each(|pin| pins.output(pin));
        }
        let wired = (self.config.inputs.as_slice(), self.config.outputs.as_slice());
        let digital = Digital::new(&board, &mut pins, &self.machine.operating, wired)?;
        let units: Vec<u32> = drives.iter().filter_map(Drive::pwm).chain(power).collect();
        let pwms = match units.first() {
            Some(first) => Some(Pwms::new(board.module(Kind::Pwm, *first)?, units)),
            None => None,
        };
        let watchdog = Watchdog::new(board.module(Kind::Watchdog, 0)?, self.config.watchdog);

        let mut asking = Asking::new(link.as_mut());
        let dpll = board.module(Kind::Dpll, 0)?;
        let size = asking.settled(|request| BoardClock::ask_size(&dpll, request))?;
        let [cycles, watchdogs] = TURN;
        let turn = (cycles * period).max(watchdogs * self.config.watchdog.seconds());
        let clock = BoardClock::new(dpll, turn, Reply(&size).word() & 0xff);

        let mirrors = self.config.actuators.iter();
        let mirrors = mirrors.filter(|(on, _)| matches!(on, Connection::Xy2mod { .. }));
        let mirrors: Vec<Nanoseconds> = mirrors.map(|(_, latency)| *latency).collect();
        let waits = !mirrors.is_empty();
        // Any number but that of another session: 0 is what a board has after power-on.
        let name = asking.now().0 as u32 | 1;
        asking.ask(|request| {
            request.write_session(name);
            clock.arm(request);
            gate.iter().for_each(|gate: &Gate| gate.dark(request));
            pwms.iter().for_each(|pwms| pwms.arm(request));
            drives.iter().for_each(|drive| drive.arm(request, waits));
        })?;
        asking.ask(|request| pins.arm(request))?;
        let levels = asking.settled(|request| pins.ask(request))?;
        let mut reply = Reply(&levels);
        let levels: Vec<u32> = (0..pins.ports()).map(|_| reply.word()).collect();
        if let Some(pin) = pins.lit(&levels) {
            return Err(BoardError::Inconsistent {
                board: board.name.clone(),
                what: format!(
                    "the gate's pin {pin} is low while it is dark: it needs a pull-up, and nothing else \
                     that pulls it down"
                ),
            });
        }
        let places = asking.settled(|request: &mut Request| {
            drives.iter().for_each(|drive| drive.ask(request));
        })?;
        let mut reply = Reply(&places);
        for drive in &mut drives {
            drive.read(&mut reply, f64::MAX);
            drive.home();
        }
        asking.ask(|request| watchdog.arm(request))?;

        let mirror = mirrors.into_iter().max().unwrap_or_default();
        Ok(Session::new(Parts {
            fired: Fired::new(laser, self.config.gate_latency, realtime.period),
            digital,
            name,
            gate_latency: self.config.gate_latency.seconds(),
            mirror_latency: mirror.seconds(),
            period: realtime.period.time(),
            link,
            watchdog,
            clock,
            pins,
            gate,
            pwms,
            power,
            drives,
        }))
    }
}

impl Port for Hostmot2Port {
    fn profile(&self) -> &Profile {
        &self.profile
    }

    fn open(&mut self) -> Result<(), PortError> {
        Ok(self.find()?)
    }

    fn close(&mut self) -> Result<(), PortError> {
        Ok(self.leave()?)
    }

    fn send(&mut self, actuation: &Actuation) {
        if let Some(session) = &mut self.session {
            session.send(actuation);
        }
    }

    fn receive(&mut self, measurement: &mut Measurement) {
        if let Some(session) = &mut self.session {
            session.receive(measurement);
        }
    }

    fn pass(&mut self, _actuation: &Actuation) {
        if let Some(session) = &mut self.session {
            session.pass();
        }
    }

    fn link(&self) -> LinkCounters {
        let Counters { sent, lost, late, duplicated, corrupted } = self.counters();
        LinkCounters {
            sent,
            lost,
            late,
            duplicated,
            corrupted,
            bridged: lost,
            ..LinkCounters::default()
        }
    }
}

impl From<OpenError> for PortError {
    fn from(error: OpenError) -> Self {
        match error {
            OpenError::Silent(address) => Self::NoAnswer {
                whom: format!("the board at {address}"),
                check: "check its power, the cable, the address of the network interface beside it, and that no \
                        firewall stands between"
                    .to_owned(),
            },
            OpenError::System { about, reason } => Self::System { about, reason },
            OpenError::Board(error) => Self::Mismatch {
                found: error.to_string(),
                expected: "change [drives.hostmot2], or load firmware that has it".to_owned(),
            },
            OpenError::Latency { what, found, expected } => Self::Mismatch {
                found: format!("{what} has a latency of {found} us"),
                expected: format!("write {expected} in [drives.hostmot2]"),
            },
            OpenError::Count { connections, actuators } => Self::Mismatch {
                found: format!("{connections} actuators are connected"),
                expected: format!("the machine has {actuators}"),
            },
        }
    }
}

/// What a board connected by `config` is.
fn profile(config: &Config) -> Profile {
    let own = |(on, latency): &(Connection, Nanoseconds)| ActuatorProfile {
        modes: match on {
            Connection::Stepgen { .. } | Connection::Xy2mod { .. } => vec![ActuatorMode::Position],
            Connection::Pwm { .. } => vec![ActuatorMode::Voltage],
        },
        latency: *latency,
        // Encoders and counted pulses are read by the request of the deadline.
        age: Nanoseconds(0),
    };
    Profile {
        clock: PortClock::Ours,
        gate_resolution: GATE_RESOLUTION,
        gate_latency: config.gate_latency,
        actuators: config.actuators.iter().map(own).collect(),
    }
}

/// What `machine` says in its `table`.
fn config(machine: &Machine, table: &Hostmot2) -> Config {
    let connection = |on: &Hostmot2Actuator| match *on {
        Hostmot2Actuator::Stepgen { stepgen, encoder } => Connection::Stepgen { stepgen, encoder },
        Hostmot2Actuator::Pwm { pwm, encoder } => Connection::Pwm { pwm, encoder },
        Hostmot2Actuator::Xy2mod { xy2mod, axis, full_scale, frame } => {
            Connection::Xy2mod { xy2mod, channel: axis, full_scale, long: frame == Xy2Frame::Long }
        }
    };
    let actuators = table.actuators.iter().zip(&machine.actuators);
    Config {
        address: table.address.clone(),
        watchdog: table.watchdog,
        // Four, two for each second cycle, from the one that is named.
        gate: table.gate.iter().flat_map(|first| *first..first + 4).collect(),
        gate_latency: machine.drives.gate_latency,
        power: table.power,
        actuators: actuators.map(|(on, it)| (connection(on), it.latency)).collect(),
        inputs: table.inputs.clone(),
        outputs: table.outputs.clone(),
    }
}

/// The address of the board that `text` names, with the port of LBP16 where it has none.
fn resolve(text: &str) -> Result<SocketAddr, OpenError> {
    let found = match text.parse::<std::net::IpAddr>() {
        Ok(address) => Ok(Some(SocketAddr::new(address, lbp16::PORT))),
        Err(_) if text.contains(':') => text.to_socket_addrs().map(|mut all| all.next()),
        Err(_) => (text, lbp16::PORT).to_socket_addrs().map(|mut all| all.next()),
    };
    let reason = match found {
        Ok(Some(address)) => return Ok(address),
        Ok(None) => "it has no address".to_owned(),
        Err(error) => error.to_string(),
    };
    Err(OpenError::System {
        about: format!("the board's address `{text}`"),
        reason: format!(
            "{reason}; write an address as in \"192.168.1.121\" or \"127.0.0.1:27181\""
        ),
    })
}
