//! A servo drive of CiA 402 with its motor: CSP, CSV, CST and homing.

pub mod cia402;
mod cycle;
pub mod homing;
pub mod objects;
pub mod servo;
pub mod switches;
pub mod trajectory;

use machine::{Actuator, Axis};
use messages::Nanoseconds;

use super::device::{Device, Loss};
use super::slave::clock::Sync;
use super::slave::dictionary::Dictionary;
use super::slave::mapping::Mapping;
use super::slave::sdo::Abort;
use super::slave::sii::{Description, Identity, Manager, Use};
use super::slave::state::Code;
use super::wires::Wires;
use cia402::Machine;
use homing::{Homed, Homing, Method};
use objects::Values;
use servo::Servo;
use switches::Switches;
use trajectory::{Ramp, Segment};

/// What the drives call themselves.
const NAMES: [&str; 2] = ["GVD-402", "Emulated CiA 402 servo drive"];

/// Vendor of all emulated devices: no vendor of that number exists.
pub const VENDOR: u32 = 0x0000_E402;

/// Product code of a drive.
pub const PRODUCT: u32 = 0x0000_0402;

/// Bytes of each mailbox.
const MAILBOX: u16 = 128;

/// Fault of a following error.
const FOLLOWING_ERROR: u16 = 0x8611;
/// Fault of the bus.
const COMMUNICATION: u16 = 0x7500;
/// Fault of missing targets.
const SYNCHRONIZATION: u16 = 0x8700;

/// A drive.
#[derive(Debug)]
pub struct Drive {
    identity: Identity,
    dictionary: Dictionary,
    wires: Wires,
    motor: usize,
    servo: Servo,
    /// Period of its loops [s].
    step: f64,
    switches: Switches,
    machine: Machine,
    mode: i8,
    /// Where it shall be in CSP; speed and torque in the other modes.
    segment: Segment,
    ramp: Option<Ramp>,
    homing: Option<Homing>,
    /// How the newest homing ended.
    homed: Homed,
    /// Speed of a homing [rad/s].
    pace: f64,
    /// What is added to the encoder's counts.
    offset: i64,
    /// What stood in the way of following for how long [s].
    astray: f64,
    code: u16,
    emergency: Option<u16>,
    missed: u16,
    ticked: Nanoseconds,
}

impl Drive {
    /// The drive of the motor `index` of `actuator`, which drives `axis`, with these `switches` and loops that run
    /// every `period`; `None` if it has no servo motor.
    pub fn new(
        wires: Wires,
        index: usize,
        (actuator, axis): (&Actuator, &Axis),
        switches: Switches,
        period: Nanoseconds,
    ) -> Option<Self> {
        let servo = Servo::new(actuator, period.seconds())?;
        let count = actuator.count();
        let in_counts = |joint: f64| (joint / count).clamp(0.0, 2e9) as u32;
        let rated = servo.largest_torque();
        let identity =
            Identity { vendor: VENDOR, product: PRODUCT, revision: 1, serial: index as u32 + 1 };
        let values = Values {
            identity,
            rated_torque: (rated * 1000.0).round().max(1.0) as u32,
            rated_current: (rated / servo.torque(1.0) * 1000.0) as u32,
            counts: actuator.encoder.counts as u32,
            following_error: in_counts(axis.limits.following_error),
            deceleration: in_counts(axis.limits.acceleration).max(1),
            homing_speed: in_counts(axis.limits.velocity / 20.0).max(4),
        };
        Some(Self {
            identity,
            dictionary: objects::dictionary(NAMES[1], &values),
            wires,
            motor: index,
            servo,
            step: period.seconds(),
            switches,
            machine: Machine::default(),
            mode: 0,
            segment: Segment::rest(Nanoseconds(0), 0.0),
            ramp: None,
            homing: None,
            homed: Homed::Not,
            pace: 0.0,
            offset: 0,
            astray: 0.0,
            code: 0,
            emergency: None,
            missed: 0,
            ticked: Nanoseconds(0),
        })
    }
}

impl Device for Drive {
    fn description(&self) -> Description {
        let manager = |purpose, start, length| Manager { purpose, start, length };
        Description {
            identity: self.identity,
            names: NAMES,
            managers: vec![
                manager(Use::MailboxOut, 0x1000, MAILBOX),
                manager(Use::MailboxIn, 0x1080, MAILBOX),
                manager(Use::Outputs, 0x1100, 7),
                manager(Use::Inputs, 0x1400, 7),
            ],
            pdos: objects::pdos(),
        }
    }

    fn dictionary(&mut self) -> Option<&mut Dictionary> {
        Some(&mut self.dictionary)
    }

    fn check(&self, index: u16, _: u8, value: &[u8]) -> Result<(), Abort> {
        let small = value.first().copied().unwrap_or(0) as i8;
        let possible = match index {
            0x6060 => small == 0 || is_mode(small),
            0x6098 => Method::of(small).is_some(),
            0x605A => matches!(small, 0..=3 | 5..=7),
            0x6007 => matches!(small, 0..=3),
            0x6084 | 0x6085 | 0x6099 | 0x609A => value.iter().any(|byte| *byte != 0),
            _ => true,
        };
        if possible { Ok(()) } else { Err(Abort::Value) }
    }

    fn sizes(&self, sync: Option<Sync>) -> Result<[usize; 2], Code> {
        if sync.is_some_and(|sync| sync.cycle() < Nanoseconds(125_000)) {
            return Err(Code::SyncPeriod);
        }
        Ok([true, false].map(|output| Mapping::of(&self.dictionary, output).bytes()))
    }

    fn start(&mut self, at: Nanoseconds) {
        self.missed = 0;
        self.segment = Segment::rest(at, self.angle());
    }

    fn outputs(&mut self, data: &[u8], at: Nanoseconds, sync: Option<Sync>) {
        self.missed = self.missed.saturating_sub(1);
        Mapping::of(&self.dictionary, true).unpack(data, &mut self.dictionary);
        let period = sync.map_or_else(|| self.interpolation_time(), |sync| sync.cycle().seconds());
        self.take_targets(at, period);
    }

    fn missed(&mut self, _: Nanoseconds, _: Sync) -> Result<(), Code> {
        self.missed = self.missed.saturating_add(3);
        let told = self.dictionary.number(0x1C32, 11).wrapping_add(1) as u16;
        self.dictionary.put(0x1C32, 11, &told.to_le_bytes());
        let limit = self.dictionary.number(0x10F1, 2);
        let beyond = limit > 0 && u32::from(self.missed) > limit;
        if beyond { Err(Code::Synchronization) } else { Ok(()) }
    }

    fn inputs(&mut self, data: &mut [u8], at: Nanoseconds) {
        self.tell(at);
        Mapping::of(&self.dictionary, false).pack(&self.dictionary, data);
    }

    fn stop(&mut self, _: Nanoseconds, loss: Loss) {
        let code = match loss {
            Loss::Power => return self.power_off(),
            Loss::Synchronization => SYNCHRONIZATION,
            Loss::Asked | Loss::Watchdog => COMMUNICATION,
        };
        if !self.is_powered() {
            return;
        }
        match self.dictionary.signed(0x6007, 0) {
            0 => {}
            2 => self.machine.disable(),
            3 => self.machine.stop(),
            _ => self.fail(code),
        }
    }

    fn tick(&mut self, at: Nanoseconds) {
        self.run(at);
    }

    fn emergency(&mut self) -> Option<(u16, u8)> {
        // The error register: a fault of the bus, or of the device.
        self.emergency.take().map(|code| (code, if code == COMMUNICATION { 0x10 } else { 0x20 }))
    }
}

/// Whether a drive has a mode.
fn is_mode(mode: i8) -> bool {
    use objects::{HOMING, POSITION, TORQUE, VELOCITY};
    [HOMING, POSITION, VELOCITY, TORQUE].contains(&mode)
}
