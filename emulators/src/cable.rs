//! A cable in virtual time between a port and emulated hardware, and the two at deadlines: what tests stand on.
//!
//! Nothing here reads a clock: time goes on where a test or the port says so, so that a run is repeated bit for bit.

use std::sync::{Arc, Mutex, PoisonError};

use drives::link::Link;
use drives::{Actuation, Freshness, Measurement, Port, PortError, Profile};
use machine::Machine;
use messages::{CommandMode, LaserCycle, LinkCounters, Nanoseconds};

/// Emulated hardware at the end of a cable. Times go on from call to call.
pub trait Hardware: Send {
    /// The port sends `frame` at `now`.
    fn send(&mut self, now: Nanoseconds, frame: &[u8]);

    /// The next frame that has come back by `now`.
    fn receive(&mut self, now: Nanoseconds) -> Option<Vec<u8>>;

    /// When the next frame comes, as far as is known.
    fn next(&self) -> Option<Nanoseconds>;

    /// Lets happen what is due by `now`.
    fn advance(&mut self, now: Nanoseconds);

    /// From when to when there was light so far, in order; light that is there at `now` ends there.
    fn lit(&self, now: Nanoseconds) -> Vec<[Nanoseconds; 2]>;

    /// Where the tool is [m].
    fn tool(&self) -> Option<[f64; 3]>;
}

/// Something that happens to hardware, at the time that it is told.
pub type Event<H> = Box<dyn FnOnce(&mut H, Nanoseconds) + Send>;

struct World<H> {
    hardware: H,
    now: Nanoseconds,
    /// What is to happen, and when.
    events: Vec<(Nanoseconds, Event<H>)>,
}

impl<H: Hardware> World<H> {
    /// Goes on to `at`, with what happens until then in its time.
    fn go_to(&mut self, at: Nanoseconds) {
        while let Some(first) = (0..self.events.len()).min_by_key(|index| self.due(*index))
            && self.due(first) <= Some(at)
        {
            let (due, event) = self.events.swap_remove(first);
            self.now = self.now.max(due);
            self.hardware.advance(self.now);
            event(&mut self.hardware, self.now);
        }
        self.now = self.now.max(at);
        self.hardware.advance(self.now);
    }

    fn due(&self, event: usize) -> Option<Nanoseconds> {
        self.events.get(event).map(|(at, _)| *at)
    }
}

/// A cable to hardware, with the time of both.
pub struct Cable<H>(Arc<Mutex<World<H>>>);

impl<H> Clone for Cable<H> {
    fn clone(&self) -> Self {
        Self(Arc::clone(&self.0))
    }
}

impl<H> core::fmt::Debug for Cable<H> {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter.debug_struct("Cable").finish_non_exhaustive()
    }
}

impl<H: Hardware> Cable<H> {
    /// A cable to `hardware`, at time 0.
    pub fn new(hardware: H) -> Self {
        Self(Arc::new(Mutex::new(World { hardware, now: Nanoseconds(0), events: Vec::new() })))
    }

    fn look<T>(&self, look: impl FnOnce(&mut World<H>) -> T) -> T {
        look(&mut self.0.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// What `look` finds in the hardware at its time, or does to it.
    pub fn with<T>(&self, look: impl FnOnce(&mut H, Nanoseconds) -> T) -> T {
        self.look(|world| look(&mut world.hardware, world.now))
    }

    /// Lets the time go on to `at`.
    pub fn go_to(&self, at: Nanoseconds) {
        self.look(|world| world.go_to(at));
    }

    /// At `at`, `event` happens to the hardware.
    pub fn plan(&self, at: Nanoseconds, event: impl FnOnce(&mut H, Nanoseconds) + Send + 'static) {
        self.look(|world| world.events.push((at, Box::new(event))));
    }

    /// From when to when there was light so far, in order [ns].
    pub fn lit(&self) -> Vec<[i64; 2]> {
        let spans = self.with(|hardware, now| hardware.lit(now));
        spans.into_iter().map(|span| span.map(|at| at.0)).collect()
    }
}

impl<H: Hardware> Link for Cable<H> {
    fn send(&mut self, datagram: &[u8]) {
        self.with(|hardware, now| hardware.send(now, datagram));
    }

    fn receive(&mut self, buffer: &mut [u8], until: Nanoseconds) -> Option<usize> {
        self.look(|world| {
            loop {
                if let Some(frame) = world.hardware.receive(world.now) {
                    let length = frame.len().min(buffer.len());
                    let (from, to) = (frame.get(..length)?, buffer.get_mut(..length)?);
                    to.copy_from_slice(from);
                    return Some(length);
                }
                let next = world.hardware.next().filter(|next| *next <= until);
                world.go_to(next.unwrap_or(until));
                next?;
            }
        })
    }

    fn now(&self) -> Nanoseconds {
        self.look(|world| world.now)
    }
}

/// A port at the deadlines of its cable's time. It is a port itself, each send of which comes at the next deadline,
/// so that whatever drives a port in virtual time drives hardware; it tells where the tool truly is, which hardware
/// cannot know.
pub struct Bench<P, H> {
    /// The machine that is driven.
    pub machine: Machine,
    /// The cable to its hardware.
    pub cable: Cable<H>,
    /// The port, open.
    pub port: P,
    /// The next deadline.
    pub deadline: Nanoseconds,
    /// What was measured in the newest [`Self::cycle`].
    pub measurement: Measurement,
    /// Where the tool was at the newest deadline [m].
    pub tool: Option<[f64; 3]>,
    period: Nanoseconds,
}

impl<P, H> core::fmt::Debug for Bench<P, H> {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter.debug_struct("Bench").field("deadline", &self.deadline).finish_non_exhaustive()
    }
}

impl<P: Port, H: Hardware> Bench<P, H> {
    /// Opens `port`, which is on `cable`, for `machine`, and holds it to that; the first deadline follows after two
    /// periods at the most.
    ///
    /// # Errors
    /// What the port says.
    pub fn open(machine: Machine, cable: Cable<H>, mut port: P) -> Result<Self, PortError> {
        port.open()?;
        drives::port::check(port.profile(), &machine)?;
        let period = machine.realtime.period.time();
        let deadline = port.first_deadline(cable.now() + period);
        let measurement = Measurement::default();
        Ok(Self { machine, cable, port, deadline, measurement, tool: None, period })
    }

    /// One cycle; the deadline that it began at [ns].
    pub fn cycle(&mut self, actuation: &Actuation) -> i64 {
        let at = self.deadline;
        let mut measurement = self.measurement;
        self.exchange(actuation, &mut measurement);
        self.measurement = measurement;
        at.0
    }

    /// So many cycles of the same.
    pub fn cycles(&mut self, actuation: &Actuation, cycles: u32) {
        for _ in 0..cycles {
            self.cycle(actuation);
        }
    }

    /// The angle of a motor at home [rad].
    pub fn home(&self, actuator: usize) -> f64 {
        let Some(own) = self.machine.actuators.get(actuator) else { return 0.0 };
        self.machine.home_joints.get(own.axis).map_or(0.0, |joint| joint / own.ratio)
    }

    /// What the motors shall do: all stand at home but the first, which turns from there by `angle` [rad] at `speed`
    /// [rad/s].
    pub fn driven(&self, angle: f64, speed: f64, laser: LaserCycle) -> Actuation {
        let mode = CommandMode::Driven;
        let mut actuation =
            Actuation { freshness: Freshness::Fresh, mode, laser, ..Actuation::DISABLED };
        let motors = self.machine.actuators.len();
        for (index, position) in actuation.position.iter_mut().enumerate().take(motors) {
            *position = self.home(index) + if index == 0 { angle } else { 0.0 };
        }
        let [first, ..] = &mut actuation.velocity;
        *first = speed;
        actuation
    }

    /// The port dies with its process: time goes on for so many cycles without it.
    pub fn die(&mut self, cycles: u32) {
        self.deadline = self.deadline + Nanoseconds(self.period.0 * i64::from(cycles));
        self.cable.go_to(self.deadline);
    }
}

impl<P: Port, H: Hardware> Port for Bench<P, H> {
    fn profile(&self) -> &Profile {
        self.port.profile()
    }

    fn close(&mut self) -> Result<(), PortError> {
        self.port.close()
    }

    fn send(&mut self, actuation: &Actuation) {
        self.cable.go_to(self.deadline);
        self.tool = self.cable.with(|hardware, _| hardware.tool());
        self.port.send(actuation);
        self.deadline = self.deadline + self.period;
    }

    fn receive(&mut self, measurement: &mut Measurement) {
        self.port.receive(measurement);
        measurement.tool = self.tool;
    }

    fn pass(&mut self, actuation: &Actuation) {
        self.cable.go_to(self.deadline);
        self.port.pass(actuation);
        self.deadline = self.deadline + self.period;
    }

    fn moved(&mut self, by: Nanoseconds) {
        self.deadline = self.deadline + by;
        self.port.moved(by);
    }

    fn link(&self) -> LinkCounters {
        self.port.link()
    }
}
