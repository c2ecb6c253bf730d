//! The port: what the machine file says, held to the bus that answers.

use std::net::ToSocketAddrs;

use ethercrab::PduStorage;
use machine::drives::{Ethercat, EthercatLink};
use machine::{Actuator, ActuatorMode, DrivesKind, Machine, Motor};
use messages::{LinkCounters, Nanoseconds};
use runtime::raw_frames::{ETHERCAT, RawFrames};

use super::cycle::BusCycle;
use super::link::UdpFrames;
use super::network::{self, Trouble, Wanted};
use super::wire::Wire;
use crate::link::Link;
use crate::port::{Actuation, ActuatorProfile, Measurement, Port, PortClock, PortError, Profile};

/// Frames under way at once, and bytes of each.
const FRAMES: usize = 8;
const BYTES: usize = PduStorage::element_size(1400);

/// How long a bus may take to be set up, once and in all tries.
const SET_UP: Nanoseconds = Nanoseconds(20_000_000_000);
/// How often it is tried: one lost frame ends a try.
const TRIES: u32 = 5;
/// From one look at a question to the next while the bus is set up.
const PATIENCE: Nanoseconds = Nanoseconds(200_000);

/// Drives and terminals on an EtherCAT bus.
pub struct EthercatPort {
    machine: Machine,
    bus: Ethercat,
    period: Nanoseconds,
    profile: Profile,
    link: Option<Box<dyn Link>>,
    cycle: Option<BusCycle>,
}

impl EthercatPort {
    /// The port that the machine file's [drives.ethercat] asks for, not open yet.
    ///
    /// # Errors
    /// Another kind of drives, a latency that no bus has, or different ones.
    pub fn of(machine: &Machine) -> Result<Self, PortError> {
        let DrivesKind::Ethercat(bus) = &machine.drives.kind else {
            return Err(PortError::Unsupported {
                what: "the machine file has no [drives.ethercat]".to_owned(),
                instead: "add it, with the interface of the bus".to_owned(),
            });
        };
        let period = machine.realtime.period.time();
        let gate_latency = machine.drives.gate_latency;
        let own = machine.actuators.iter().map(|actuator| actuator.latency);
        let all = own.chain(bus.gate.map(|_| gate_latency));
        let [least, most] = network::latencies(period).map(|time| time.seconds() * 1e6);
        let first = machine.actuators.first().map_or(gate_latency, |actuator| actuator.latency);
        for latency in all {
            if latency != first || network::shift(latency, period).is_none() {
                return Err(PortError::Mismatch {
                    found: format!("a latency of {} us", latency.seconds() * 1e6),
                    expected: format!(
                        "all drives and the gate on a bus act at its sync signal: write one latency for all in \
                         [drives.ethercat], from {least} us to {most} us, as `latency` and `gate_latency`"
                    ),
                });
            }
        }
        let samples = bus.gate.map_or(1, |gate| gate.oversampling.max(1));
        // Drives measure at the sync signal at which they take their targets, and the next frame fetches that.
        let actuator = |own: &Actuator| ActuatorProfile {
            modes: vec![ActuatorMode::Torque, ActuatorMode::Velocity, ActuatorMode::Position],
            latency: own.latency,
            age: match own.motor {
                Motor::Dc(_) => Nanoseconds(period.0 - own.latency.0),
                Motor::Stepper(_) => Nanoseconds(0),
            },
        };
        let profile = Profile {
            clock: PortClock::Bus,
            gate_resolution: Nanoseconds(period.0 / i64::from(samples)),
            gate_latency,
            actuators: machine.actuators.iter().map(actuator).collect(),
        };
        let (machine, bus) = (machine.clone(), bus.clone());
        Ok(Self { machine, bus, period, profile, link: None, cycle: None })
    }

    /// The same by another link than that of the machine file.
    #[must_use]
    pub fn with_link(mut self, link: Box<dyn Link>) -> Self {
        self.link = Some(link);
        self
    }

    fn connect(&mut self) -> Result<Box<dyn Link>, PortError> {
        if let Some(link) = self.link.take() {
            return Ok(link);
        }
        let system = |about: String, help: &'static str| {
            move |error: std::io::Error| PortError::System {
                about,
                reason: format!("{error}; {help}"),
            }
        };
        match &self.bus.link {
            EthercatLink::Interface(name) => {
                let about = format!("raw frames on the network interface {name}");
                let help =
                    "`ip link` lists the interfaces; raw frames need the capability CAP_NET_RAW";
                let frames = RawFrames::open(name, ETHERCAT).map_err(system(about, help))?;
                Ok(Box::new(frames))
            }
            EthercatLink::Udp(address) => {
                let about = format!("a socket for the bus at {address}");
                let help = "write an address and a port, such as 127.0.0.1:34980";
                let found = address.to_socket_addrs().map_err(system(about.clone(), help))?.next();
                let none = || std::io::Error::from(std::io::ErrorKind::NotFound);
                let first = found.ok_or_else(none).map_err(system(about.clone(), help))?;
                let frames = UdpFrames::open(first).map_err(system(about, help))?;
                Ok(Box::new(frames))
            }
        }
    }

    fn explain(&self, trouble: Trouble) -> PortError {
        match trouble {
            Trouble::Port(error) => error,
            Trouble::Bus(what, error) => PortError::State {
                what: format!("the bus at {}", self.place()),
                act: format!("come through {what}"),
                check: format!("{error}; look at the cables and the power of the slaves"),
            },
        }
    }

    fn place(&self) -> &str {
        match &self.bus.link {
            EthercatLink::Interface(name) => name,
            EthercatLink::Udp(address) => address,
        }
    }
}

impl Port for EthercatPort {
    fn profile(&self) -> &Profile {
        &self.profile
    }

    fn open(&mut self) -> Result<(), PortError> {
        let link = self.connect()?;
        let storage: &'static PduStorage<FRAMES, BYTES> = Box::leak(Box::new(PduStorage::new()));
        let split = storage.try_split();
        let (sender, receiver, frames) = split.map_err(|()| PortError::System {
            about: "room for frames".to_owned(),
            reason: "it is in use already".to_owned(),
        })?;
        let main = network::main_device(frames);
        let mut wire = Wire::new(sender, receiver, link);
        let shift = self.machine.actuators.first().map_or(Nanoseconds(0), |it| it.latency);
        let (bus, machine, period) = (&self.bus, &self.machine, self.period);
        let clock = wire.clock();
        let mut trouble = None;
        for _ in 0..TRIES {
            let wanted = Wanted { bus, machine, period, shift };
            let until = wire.now() + SET_UP;
            match wire.ask(network::set_up(main, wanted, &clock), until, PATIENCE) {
                Some(Ok(network)) if network.group.is_empty() => break,
                Some(Ok(network)) => {
                    let own = self.profile.actuators.iter_mut().zip(&network.drives);
                    own.for_each(|(own, drive)| own.modes.clone_from(&drive.modes));
                    let Some(offset) = network::offset(&network, &mut wire) else { continue };
                    let machine = (&self.machine, &self.bus);
                    self.cycle = Some(BusCycle::new((network, offset), wire, machine));
                    return Ok(());
                }
                Some(Err(Trouble::Port(error))) => return Err(error),
                Some(Err(error)) => trouble = Some(error),
                None => {}
            }
        }
        Err(match trouble {
            Some(trouble) => self.explain(trouble),
            None => PortError::NoAnswer {
                whom: format!("the bus at {}", self.place()),
                check: "look at the cables, and at the power of the first slave".to_owned(),
            },
        })
    }

    fn close(&mut self) -> Result<(), PortError> {
        match self.cycle.take().map(|mut cycle| cycle.close()) {
            None | Some(true) => Ok(()),
            Some(false) => Err(PortError::State {
                what: format!("the bus at {}", self.place()),
                act: "come to its initial state".to_owned(),
                check: "its watchdogs have stopped it; look at the cables, and at the power of the slaves"
                    .to_owned(),
            }),
        }
    }

    fn first_deadline(&self, from: Nanoseconds) -> Nanoseconds {
        self.cycle.as_ref().map_or(from, |cycle| cycle.first_deadline(from))
    }

    fn send(&mut self, actuation: &Actuation) {
        if let Some(cycle) = &mut self.cycle {
            cycle.send(actuation);
        }
    }

    fn receive(&mut self, measurement: &mut Measurement) {
        if let Some(cycle) = &mut self.cycle {
            cycle.receive(measurement);
        }
    }

    fn pass(&mut self, _actuation: &Actuation) {
        if let Some(cycle) = &mut self.cycle {
            cycle.pass();
        }
    }

    fn moved(&mut self, by: Nanoseconds) {
        if let Some(cycle) = &mut self.cycle {
            cycle.moved(by);
        }
    }

    fn link(&self) -> LinkCounters {
        let Some(cycle) = &self.cycle else { return LinkCounters::default() };
        LinkCounters { clock_error_max: cycle.clock_error_max(), ..*cycle.wire().counters() }
    }
}
