//! A line of slaves: frames go through all of them and come back.

use drives::PlantOptions;
use machine::{DrivesKind, Machine};
use messages::Nanoseconds;
use messages::random::SplitMix64;

use super::drive::Drive;
use super::drive::switches::Switches;
use super::frame::{self, ETHERNET_HEADER, ETHERTYPE};
use super::plant::{Plant, PlantError};
use super::slave::clock::Clock;
use super::slave::{Passing, Slave};
use super::terminal::{CHANNELS, Kind, Terminal};
use super::wires::{Bundle, Light, LightEdge, MotorWires, Wires};

/// From one slave to the next.
const HOP: Nanoseconds = Nanoseconds(550);

/// The most that a slave's clock is wrong by [1e-9].
const DRIFT: f64 = 20_000.0;

/// What stands on the line, behind a drive for each of the machine's actuators in their order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    /// The terminals, in their order.
    pub terminals: Vec<Kind>,
    /// Chooses the clocks' drifts; 0 for clocks that all run right.
    pub seed: u64,
}

impl Default for Layout {
    /// An oversampled output for the gate, an analogue one for the power, then digital inputs and outputs.
    fn default() -> Self {
        let outputs = Kind::Outputs { gate: None };
        Self { terminals: vec![Kind::Oversampled, Kind::Analogue, Kind::Inputs, outputs], seed: 1 }
    }
}

/// A switch of the machine on an input terminal.
#[derive(Debug, Clone, Copy)]
struct Wired {
    /// Its bit among the machine's inputs; none where nothing that the motors do changes it.
    input: u64,
    /// Its wire.
    line: u64,
    is_active_low: bool,
}

/// The inputs of `machine` that it has on the terminals of `layout`.
fn wired(machine: &Machine, layout: &Layout) -> Vec<Wired> {
    let DrivesKind::Ethercat(bus) = &machine.drives.kind else { return Vec::new() };
    let inputs = machine.operating.bits().zip(&bus.inputs);
    let wired = inputs.filter_map(|((bit, input), place)| {
        let terminal = usize::from(place.slave).checked_sub(machine.actuators.len())?;
        let (before, own) = (layout.terminals.get(..terminal)?, layout.terminals.get(terminal)?);
        let is_input = *own == Kind::Inputs && place.bit < u16::from(CHANNELS);
        let line = u32::from(place.bit) + first_line(before, Kind::Inputs);
        let is_active_low = input.is_active_low;
        let bit = if input.simulated.is_some() { bit } else { 0 };
        let line = 1_u64.checked_shl(line).filter(|_| is_input)?;
        Some(Wired { input: bit, line, is_active_low })
    });
    wired.collect()
}

/// The wire of the first channel of a terminal of such a kind behind those that are `before` it.
fn first_line(before: &[Kind], kind: Kind) -> u32 {
    let is_alike =
        |other: &&Kind| core::mem::discriminant(*other) == core::mem::discriminant(&kind);
    u32::from(CHANNELS) * before.iter().filter(is_alike).count() as u32
}

/// The slaves with the machine that they drive. It has no time of its own: it goes on to the time that each
/// call gives it, in the emulator's time, from 0 on.
#[derive(Debug)]
pub struct Segment {
    slaves: Vec<Slave>,
    /// How many slaves the cable reaches.
    reached: usize,
    wires: Wires,
    /// The machine's switches that are on terminals.
    switches: Vec<Wired>,
    plant: Plant,
    now: Nanoseconds,
    /// When the plant is measured next.
    tick: Nanoseconds,
}

impl Segment {
    /// The slaves of `layout` with drives for `machine`, just powered.
    ///
    /// # Errors
    /// If the machine cannot be simulated, or has no servo motors.
    pub fn new(
        machine: &Machine,
        layout: &Layout,
        options: PlantOptions,
    ) -> Result<Self, PlantError> {
        let plant = Plant::new(machine, options)?;
        let has_power = layout.terminals.contains(&Kind::Analogue);
        let wires = Wires::new(Bundle {
            motors: vec![MotorWires::default(); machine.actuators.len()],
            light: Light::new(has_power),
            ..Bundle::default()
        });
        let mut random = SplitMix64::new(layout.seed);
        let mut clock = || {
            if layout.seed == 0 {
                return Clock::new(0, 0);
            }
            let start = random.between(0.0, 1e9) as i64;
            Clock::new(start, random.between(-DRIFT, DRIFT) as i64)
        };
        let mut slaves = Vec::new();
        for (index, actuator) in machine.actuators.iter().enumerate() {
            let axis = machine.axes.get(actuator.axis).ok_or(PlantError::Steppers)?;
            let home = machine.home_joints.get(actuator.axis).copied().unwrap_or(0.0);
            let switches = Switches::of(machine, index, (actuator, axis, home));
            let drive =
                Drive::new(wires.clone(), index, (actuator, axis), switches, plant.period());
            let drive = drive.ok_or(PlantError::Steppers)?;
            slaves.push(Slave::new(Box::new(drive), clock()));
        }
        for (index, kind) in layout.terminals.iter().enumerate() {
            let before = layout.terminals.get(..index).unwrap_or_default();
            let terminal = Terminal::new(*kind, wires.clone(), first_line(before, *kind));
            slaves.push(Slave::new(Box::new(terminal), clock()));
        }
        let reached = slaves.len();
        let (now, tick) = (Nanoseconds(0), Nanoseconds(0));
        let switches = wired(machine, layout);
        let mut segment = Self { slaves, reached, wires, switches, plant, now, tick };
        segment.link();
        // What nobody has touched yet is not active.
        segment.switch(|_: &Wired| true);
        Ok(segment)
    }

    /// Sends an Ethernet `frame` through the slaves at `now`; what comes back, `None` if nothing does.
    pub fn process(&mut self, frame: &[u8], now: Nanoseconds) -> Option<Vec<u8>> {
        let mut back = frame.to_vec();
        let kind = frame.get(ETHERNET_HEADER - 2..ETHERNET_HEADER)?;
        if kind != ETHERTYPE.to_be_bytes() || self.reached == 0 {
            return None;
        }
        self.process_payload(back.get_mut(ETHERNET_HEADER..)?, now);
        // The first slave marks what has passed it as sent from another station.
        back.iter_mut().skip(6).take(1).for_each(|byte| *byte |= 0x02);
        Some(back)
    }

    /// Sends what a frame carries, from its EtherCAT header on, through the slaves at `now`; whether a frame comes
    /// back. What is no sound frame comes back unchanged.
    pub fn process_payload(&mut self, payload: &mut [u8], now: Nanoseconds) -> bool {
        self.advance(now);
        let now = self.now;
        let reached = self.reached;
        for range in frame::datagrams(payload).unwrap_or_default() {
            let Some(mut datagram) = frame::datagram(payload, range) else { continue };
            for (position, slave) in self.slaves.iter_mut().take(reached).enumerate() {
                let hops = |count: usize| now + Nanoseconds(HOP.0 * count as i64);
                let back = 2 * (reached - 1) - position;
                let passing = Passing { out: hops(position), back: hops(back) };
                slave.pass(&mut datagram, passing);
            }
        }
        reached > 0
    }

    /// A frame with a wrong checksum passes: the slaves count it, and do nothing else.
    pub fn invalid_frame(&mut self, now: Nanoseconds) {
        self.advance(now);
        self.slaves.iter_mut().take(self.reached).for_each(Slave::invalid_frame);
    }

    /// Lets everything happen that is due up to `now`.
    pub fn advance(&mut self, now: Nanoseconds) {
        loop {
            let events = self
                .slaves
                .iter()
                .enumerate()
                .filter_map(|(index, slave)| slave.next_event(self.now).map(|at| (at, index)));
            let next = events.min().filter(|(at, _)| *at < self.tick);
            let at = next.map_or(self.tick, |(at, _)| at);
            if at > now {
                break;
            }
            self.now = self.now.max(at);
            match next.and_then(|(_, index)| self.slaves.get_mut(index)) {
                Some(slave) => slave.happen(self.now),
                None => self.step(),
            }
        }
        self.now = self.now.max(now);
        self.wires.lock().light.settle(self.now);
    }

    fn step(&mut self) {
        self.plant.step(&mut self.wires.lock());
        self.switch(|wired: &Wired| wired.input != 0);
        for slave in &mut self.slaves {
            slave.tick(self.tick);
        }
        self.tick = self.tick + self.plant.period();
    }

    /// Gives the wires of those switches that are `meant` the levels that the plant has them at.
    fn switch(&mut self, meant: impl Fn(&Wired) -> bool) {
        let active = self.plant.inputs();
        let mut wires = self.wires.lock();
        for Wired { input, line, is_active_low } in self.switches.iter().copied().filter(meant) {
            let level = (active & input != 0) != is_active_low;
            wires.inputs = if level { wires.inputs | line } else { wires.inputs & !line };
        }
    }

    /// The time that it has gone on to.
    pub fn now(&self) -> Nanoseconds {
        self.now
    }

    /// Cuts the cable behind the first `reached` slaves at `now`, or mends it: those behind get no frames.
    pub fn cut(&mut self, reached: usize, now: Nanoseconds) {
        self.advance(now);
        self.reached = reached.min(self.slaves.len());
        self.link();
    }

    /// Takes the power of the slave at `position` away at `now`, and gives it back.
    pub fn power_cycle(&mut self, position: usize, now: Nanoseconds) {
        self.advance(now);
        if let Some(slave) = self.slaves.get_mut(position) {
            slave.power_cycle(now);
        }
        self.link();
    }

    /// Lets the slave at `position` fall out of its operational state at `now`.
    pub fn leave(&mut self, position: usize, now: Nanoseconds) {
        self.advance(now);
        if let Some(slave) = self.slaves.get_mut(position) {
            slave.leave(now);
        }
    }

    fn link(&mut self) {
        let reached = self.reached;
        for (position, slave) in self.slaves.iter_mut().enumerate() {
            slave.link(position + 1 < reached);
        }
    }

    /// The slaves, in the order of the line.
    pub fn slaves(&self) -> &[Slave] {
        &self.slaves
    }

    /// Where the tool is [m], where the plant knows it.
    pub fn tool(&self) -> Option<[f64; 3]> {
        self.plant.tool(self.now - (self.tick - self.plant.period()))
    }

    /// The machine behind the drives.
    pub fn plant(&self) -> &Plant {
        &self.plant
    }

    /// All changes of the light so far.
    pub fn light(&self) -> Vec<LightEdge> {
        self.wires.lock().light.edges().to_vec()
    }

    /// The wires, to set inputs and to look at what the devices do.
    pub fn wires(&self) -> &Wires {
        &self.wires
    }
}
