//! Finds the slaves, holds them to the machine file and brings them to where they exchange process data, before
//! the clock starts.

use core::sync::atomic::{AtomicI64, Ordering};
use core::time::Duration;

use ethercrab::error::Error;
use ethercrab::subdevice_group::{PreOp, SafeOp};
use ethercrab::{
    DefaultLock, EtherCrabWireReadWrite, MainDevice, MainDeviceConfig, PduLoop, RetryBehaviour,
    SubDeviceGroup, SubDeviceRef, Timeouts,
};
use machine::drives::{Ethercat, EthercatBit, EthercatGate};
use machine::operating::{DriveHoming, Homing, HomingMethod};
use machine::{Actuator, ActuatorMode, Machine};
use messages::Nanoseconds;

use super::wire::Wire;
use super::{cia402, digital, homing, identity, image};
use crate::port::PortError;

/// The most slaves on a bus, and bytes of their process data.
const SLAVES: usize = 32;
const DATA: usize = 1024;

/// What the bus exchanges in a cycle.
pub type Group = SubDeviceGroup<SLAVES, DATA, DefaultLock, SafeOp>;
type Unconfigured = SubDeviceGroup<SLAVES, DATA, DefaultLock, PreOp>;

/// Registers of a slave's controller.
mod register {
    pub(super) const WATCHDOG_DIVIDER: u16 = 0x0400;
    pub(super) const WATCHDOG: u16 = 0x0420;
    pub(super) const SYSTEM_TIME: u16 = 0x0910;
    pub(super) const CYCLIC_UNIT: u16 = 0x0980;
    pub(super) const ACTIVATION: u16 = 0x0981;
    pub(super) const START: u16 = 0x0990;
    pub(super) const SYNC0: u16 = 0x09a0;
    pub(super) const SYNC1: u16 = 0x09a4;
    /// Control byte of a sync manager of the number given.
    pub(super) fn manager_control(number: u16) -> u16 {
        0x0804 + 8 * number
    }
}

/// Divider with which the watchdog counts in tenths of a millisecond.
const TENTHS: u16 = 2498;
/// The bit of a sync manager's control byte that lets the watchdog watch it.
const WATCHED: u8 = 0x40;
/// How long after they are set up the sync signals of a slave begin: signals that would have begun in the past never
/// come.
const AHEAD: i64 = 100_000_000;
/// How often the clock of the bus is read for the quickest answer.
const READINGS: u32 = 16;
/// How long a reading may take.
const READING: Nanoseconds = Nanoseconds(2_000_000);
/// Least part of a latency that is not a whole period, and most: a frame must be there before the targets come
/// into force, and the next one must not be.
const LATENCY: [f64; 2] = [0.3, 0.9];

/// What a drive tells of itself.
#[derive(Debug, Clone)]
pub struct DriveFacts {
    /// Its position on the bus.
    pub slave: usize,
    /// The modes that it has.
    pub modes: Vec<ActuatorMode>,
    /// The torque of which it counts thousandths [N·m].
    pub rated: f64,
}

/// A bus whose slaves are set up.
pub struct Network {
    /// The crate's side.
    pub main: &'static MainDevice<'static>,
    /// The slaves, in SAFE-OP.
    pub group: Group,
    /// The drives, in the order of the actuators.
    pub drives: Vec<DriveFacts>,
    /// The working counter of a cycle in which all slaves have taken part.
    pub whole: u16,
    /// The slave whose clock is that of the bus.
    pub reference: usize,
}

/// What is wrong, or the crate's own word for it.
#[derive(Debug)]
pub enum Trouble {
    /// The hardware is not as it should be.
    Port(PortError),
    /// An answer that did not come, or was a refusal, to what was asked of a slave.
    Bus(&'static str, Error),
}

impl From<PortError> for Trouble {
    fn from(error: PortError) -> Self {
        Self::Port(error)
    }
}

/// Names what was asked, for the error.
trait Asked<T> {
    fn asked(self, what: &'static str) -> Result<T, Trouble>;
}

impl<T> Asked<T> for Result<T, Error> {
    fn asked(self, what: &'static str) -> Result<T, Trouble> {
        self.map_err(|error| Trouble::Bus(what, error))
    }
}

/// What the bus shall be.
#[derive(Debug, Clone, Copy)]
pub struct Wanted<'a> {
    /// What the machine file says of it.
    pub bus: &'a Ethercat,
    /// The machine.
    pub machine: &'a Machine,
    /// The period of the cycle.
    pub period: Nanoseconds,
    /// From a deadline to the sync signal.
    pub shift: Nanoseconds,
}

/// The crate's side of a bus. It lives as long as the process, as the crate asks for.
pub fn main_device(frames: PduLoop<'static>) -> &'static MainDevice<'static> {
    let timeouts = Timeouts {
        pdu: Duration::from_millis(20),
        state_transition: Duration::from_secs(5),
        eeprom: Duration::from_millis(200),
        mailbox_echo: Duration::from_millis(200),
        mailbox_response: Duration::from_secs(2),
        ..Timeouts::default()
    };
    // A cycle gives up long before a question is asked again.
    let retry_behaviour = RetryBehaviour::Count(3);
    // The slaves' clocks are set one after the other, by as much apart: they come together step by step.
    let config = MainDeviceConfig { dc_static_sync_iterations: 10_000, retry_behaviour };
    Box::leak(Box::new(MainDevice::new(frames, timeouts, config)))
}

/// The distance of the sync signals from the deadlines that gives `latency`; `None` where none does.
pub fn shift(latency: Nanoseconds, period: Nanoseconds) -> Option<Nanoseconds> {
    let [least, most] = LATENCY.map(|part| (part * period.0 as f64) as i64);
    (least..=most).contains(&latency.0).then_some(latency)
}

/// The latencies that a bus can have [ns].
pub fn latencies(period: Nanoseconds) -> [Nanoseconds; 2] {
    LATENCY.map(|part| Nanoseconds((part * period.0 as f64) as i64))
}

/// Sets the bus up; `clock` is the time of the link [ns].
///
/// # Errors
/// A slave that is not there, is another than the machine file says, or does not do as it is told.
pub async fn set_up(
    main: &'static MainDevice<'static>,
    wanted: Wanted<'_>,
    clock: &AtomicI64,
) -> Result<Network, Trouble> {
    let now = || clock.load(Ordering::Relaxed).unsigned_abs();
    let mut group: Unconfigured = main.init_single_group(now).await.asked("finding the slaves")?;
    let slaves = group.len();
    let bus = wanted.bus;
    let gate = bus.gate.map(|gate| gate.slave);
    let bits = || bus.inputs.iter().chain(bus.outputs.iter().flatten()).map(|place| place.slave);
    let identities = bus.identities.iter().map(|identity| identity.slave);
    let named = bus.actuators.iter().copied().chain(gate).chain(bus.power);
    let named = named.chain(bits()).chain(identities);
    if let Some(missing) = named.into_iter().find(|slave| usize::from(*slave) >= slaves) {
        return Err(PortError::Mismatch {
            found: format!("there are {slaves} slaves on the bus"),
            expected: format!(
                "[drives.ethercat] names slave {missing}, counted from 0: look at the cables and the power of \
                 the slaves, or change the machine file"
            ),
        }
        .into());
    }
    identity::check(&found(main, &group), &bus.identities)?;
    let actuators = &wanted.machine.actuators;
    let mut drives = Vec::with_capacity(actuators.len());
    for (slave, actuator) in bus.actuators.iter().zip(actuators) {
        drives.push(set_up_drive(main, &group, usize::from(*slave), actuator, wanted).await?);
    }
    if let Some(EthercatGate { slave, oversampling, .. }) = bus.gate
        && oversampling > 1
    {
        set_oversampling(&mut group, main, usize::from(slave), oversampling)?;
    }
    for index in 0..slaves {
        let slave = group.subdevice(main, index).asked("looking at a slave")?;
        arm_watchdog(&slave, bus.watchdog).await?;
    }
    let reference = start_sync(main, &group, wanted, &drives).await?;
    let group = group.into_safe_op(main).await.asked("going to SAFE-OP")?;
    for drive in &drives {
        check_watchdog(main, &group, drive.slave, 2).await?;
    }
    let switched = bus.outputs.iter().flatten().map(|place| place.slave);
    for slave in gate.into_iter().chain(bus.power).chain(switched) {
        check_watchdog(main, &group, usize::from(slave), 0).await?;
    }
    digital::check(main, &group, wanted.machine, bus)?;
    let whole = group.iter(main).map(|slave| {
        let data = slave.io_raw();
        u16::from(!data.inputs().is_empty()) + 2 * u16::from(!data.outputs().is_empty())
    });
    let whole = whole.sum();
    Ok(Network { main, group, drives, whole, reference })
}

/// Time of the bus minus that of `wire` [ns], by the quickest of some answers; `None` without one.
pub fn offset(network: &Network, wire: &mut Wire) -> Option<i64> {
    let Network { main, group, reference, .. } = network;
    let clock_of = group.subdevice(main, *reference).ok()?;
    let mut best = None;
    for _ in 0..READINGS {
        let before = wire.now();
        let question = clock_of.register_read::<u64>(register::SYSTEM_TIME);
        let Some(Ok(time)) = wire.ask(question, before + READING, READING) else { continue };
        let after = wire.now();
        let took = after - before;
        if best.is_none_or(|(least, _)| took < least) {
            best = Some((took, (time as i64).wrapping_sub((before.0 + after.0) / 2)));
        }
    }
    best.map(|(_, offset)| offset)
}

/// Who the slaves are.
fn found(main: &'static MainDevice<'static>, group: &Unconfigured) -> Vec<identity::Found> {
    let each = group.iter(main).map(|slave| {
        let own = slave.identity();
        identity::Found {
            name: slave.name().to_owned(),
            vendor: own.vendor_id,
            product: own.product_id,
            revision: own.revision,
            serial: own.serial,
        }
    });
    each.collect()
}

/// Holds a drive to its actuator, and maps its process data.
async fn set_up_drive(
    main: &'static MainDevice<'static>,
    group: &Unconfigured,
    index: usize,
    actuator: &Actuator,
    Wanted { bus, machine, period, .. }: Wanted<'_>,
) -> Result<DriveFacts, Trouble> {
    let slave = group.subdevice(main, index).asked("looking at a drive")?;
    let name = slave.name().to_owned();
    let kind = slave.sdo_read::<u32>(0x1000, 0).await.unwrap_or(0);
    if kind & 0xffff != 402 {
        return Err(PortError::Mismatch {
            found: format!("slave {index} is \"{name}\", which is no drive of CiA 402"),
            expected: format!("the machine file has the actuator `{}` there", actuator.name),
        }
        .into());
    }
    let supported = slave.sdo_read::<u32>(0x6502, 0).await.asked("the modes of a drive")?;
    let modes = cia402::modes(supported);
    let Some((mode, _)) = cia402::mode(actuator.mode).filter(|_| modes.contains(&actuator.mode))
    else {
        let (actuator, mode) = (actuator.name.clone(), actuator.mode);
        return Err(PortError::Mode { actuator, mode, modes }.into());
    };
    let rated = slave.sdo_read::<u32>(0x6076, 0).await.asked("the rated torque of a drive")?;
    let counts = slave.sdo_read::<u32>(0x608f, 1).await;
    let turns = slave.sdo_read::<u32>(0x608f, 2).await;
    if let (Ok(counts), Ok(turns)) = (counts, turns) {
        let own = f64::from(counts) / f64::from(turns.max(1));
        if own != actuator.encoder.counts {
            return Err(PortError::Mismatch {
                found: format!(
                    "the encoder of drive {index}, \"{name}\", has {own} counts in a turn"
                ),
                expected: format!(
                    "the machine file has {} for `{}`: write what it has",
                    actuator.encoder.counts, actuator.name
                ),
            }
            .into());
        }
    }
    map(&slave, 0x1c12, 0x1600, &image::OUTPUTS).await?;
    let is_here = |place: &EthercatBit| usize::from(place.slave) == index;
    let digital = bus.inputs.iter().position(is_here);
    if let Some(input) = digital.and_then(|input| machine.operating.inputs.get(input))
        && slave.sdo_read::<u32>(0x60fd, 0).await.is_err()
    {
        return Err(PortError::Mismatch {
            found: format!("drive {index}, \"{name}\", tells no digital inputs (60FDh)"),
            expected: format!(
                "the machine file has the input `{}` there: name a terminal",
                input.name
            ),
        }
        .into());
    }
    let own = digital.map(|_| image::DIGITAL);
    let inputs: Vec<_> = image::INPUTS.into_iter().chain(own).collect();
    map(&slave, 0x1c13, 0x1a00, &inputs).await?;
    if let Some(homing) = machine.operating.homing(actuator.axis)
        && homing.method == HomingMethod::Drive
    {
        set_up_homing(&slave, index, supported, (actuator, homing)).await?;
    }
    slave.sdo_write(0x6060, 0, mode).await.asked("setting the mode of a drive")?;
    // A quick stop is a ramp, and the drive stays there.
    slave.sdo_write(0x605a, 0, 6_i16).await.asked("setting the quick stop of a drive")?;
    let (count, exponent) = power_of_ten(period);
    slave.sdo_write(0x60c2, 1, count).await.asked("setting the period of a drive")?;
    slave.sdo_write(0x60c2, 2, exponent).await.asked("setting the period of a drive")?;
    Ok(DriveFacts { slave: index, modes, rated: f64::from(rated) * 1e-3 })
}

/// Tells a drive how it shall find its reference by itself.
async fn set_up_homing<S>(
    slave: &SubDeviceRef<'_, S>,
    index: usize,
    supported: u32,
    (actuator, homing): (&Actuator, &Homing),
) -> Result<(), Trouble>
where
    S: core::ops::Deref<Target = ethercrab::SubDevice>,
{
    let DriveHoming { acceleration, .. } = homing.drive;
    let method = homing.drive.method_of(actuator);
    let refused = |found: String| PortError::Mismatch {
        found,
        expected: format!(
            "the machine file has `{}` find its reference by the drive: change its [axis] `homing`, by what the \
             drive's manual says",
            actuator.name
        ),
    };
    let name = slave.name();
    if supported & homing::SUPPORTED == 0 {
        return Err(
            refused(format!("drive {index}, \"{name}\", has no homing mode (6502h)")).into()
        );
    }
    if slave.sdo_write(0x6098, 0, method).await.is_err() {
        let found = format!(
            "drive {index}, \"{name}\", does not take the method {method} of homing (6098h)"
        );
        return Err(refused(found).into());
    }
    let counts = |joint: f64| {
        let counts = (joint / (actuator.encoder.resolution() * actuator.ratio)).abs().round();
        counts.clamp(1.0, f64::from(i32::MAX)) as u32
    };
    for (object, sub, value, what) in [
        (0x6099, 1_u8, counts(homing.speed), "speed of homing (6099h:01)"),
        (0x6099, 2, counts(homing.latch_speed), "slow speed of homing (6099h:02)"),
        (0x609a, 0, counts(acceleration), "acceleration of homing (609Ah)"),
        // The reference is where the drive counts from.
        (0x607c, 0, 0, "home offset (607Ch)"),
    ] {
        if slave.sdo_write(object, sub, value).await.is_err() {
            let found = format!("drive {index}, \"{name}\", does not take {value} as its {what}");
            return Err(refused(found).into());
        }
    }
    Ok(())
}

/// A period as drives are told it: so many times ten to so many seconds.
fn power_of_ten(period: Nanoseconds) -> (u8, i8) {
    let (mut count, mut exponent) = (period.0 / 1000, -6);
    while count > 0 && count % 10 == 0 {
        (count, exponent) = (count / 10, exponent + 1);
    }
    (u8::try_from(count).unwrap_or(u8::MAX), exponent)
}

/// Maps `entries` as the process data of one direction.
async fn map<S>(
    slave: &SubDeviceRef<'_, S>,
    assignment: u16,
    list: u16,
    entries: &[(u16, u8)],
) -> Result<(), Trouble>
where
    S: core::ops::Deref<Target = ethercrab::SubDevice>,
{
    const WHAT: &str = "mapping the process data of a drive";
    slave.sdo_write(assignment, 0, 0_u8).await.asked(WHAT)?;
    slave.sdo_write(list, 0, 0_u8).await.asked(WHAT)?;
    for (number, entry) in (1_u8..).zip(entries) {
        slave.sdo_write(list, number, image::entry(*entry)).await.asked(WHAT)?;
    }
    slave.sdo_write(list, 0, entries.len() as u8).await.asked(WHAT)?;
    slave.sdo_write(assignment, 1, list).await.asked(WHAT)?;
    slave.sdo_write(assignment, 0, 1_u8).await.asked(WHAT)
}

/// Tells the crate that the first output of a terminal has so many samples in a cycle.
fn set_oversampling(
    group: &mut Unconfigured,
    main: &'static MainDevice<'static>,
    index: usize,
    samples: u16,
) -> Result<(), Trouble> {
    let factor = u8::try_from(samples).map_err(|_| PortError::Unsupported {
        what: format!("{samples} samples in a cycle"),
        instead: "write 255 or less in [drives.ethercat.gate]".to_owned(),
    })?;
    let config: &'static [(u16, u8)] = Box::leak(Box::new([(0x1600, factor)]));
    if let Some(mut slave) = group.iter_mut(main).nth(index) {
        slave.set_oversampling(config);
    }
    Ok(())
}

/// Lets the slave stop by itself where process data do not come.
async fn arm_watchdog<S>(slave: &SubDeviceRef<'_, S>, time: Nanoseconds) -> Result<(), Trouble> {
    let tenths = (time.0 / 100_000).clamp(1, i64::from(u16::MAX)) as u16;
    write(slave, register::WATCHDOG_DIVIDER, TENTHS, "setting a watchdog").await?;
    write(slave, register::WATCHDOG, tenths, "setting a watchdog").await
}

async fn write<S, T: EtherCrabWireReadWrite>(
    slave: &SubDeviceRef<'_, S>,
    register: u16,
    value: T,
    what: &'static str,
) -> Result<(), Trouble> {
    slave.register_write(register, value).await.asked(what).map(|_| ())
}

/// That the watchdog watches the outputs of the slave, whose sync manager has this `number`.
async fn check_watchdog(
    main: &'static MainDevice<'static>,
    group: &Group,
    index: usize,
    number: u16,
) -> Result<(), Trouble> {
    let slave = group.subdevice(main, index).asked("looking at a slave")?;
    let control = slave.register_read::<u8>(register::manager_control(number)).await;
    let control = control.asked("reading a watchdog")?;
    let time = slave.register_read::<u16>(register::WATCHDOG).await.asked("reading a watchdog")?;
    if control & WATCHED != 0 && time > 0 {
        return Ok(());
    }
    Err(PortError::Unsupported {
        what: format!(
            "slave {index}, \"{}\", has no watchdog for its outputs: it would go on when this computer stops",
            slave.name()
        ),
        instead: "use one that has".to_owned(),
    }
    .into())
}

/// Starts the sync signals of all slaves that act by them; the slave whose clock is that of the bus.
async fn start_sync(
    main: &'static MainDevice<'static>,
    group: &Unconfigured,
    wanted: Wanted<'_>,
    drives: &[DriveFacts],
) -> Result<usize, Trouble> {
    const WHAT: &str = "setting the clocks";
    let period = wanted.period.0.unsigned_abs().max(1);
    let synced = drives.iter().map(|drive| (drive.slave, 1_u16));
    let gate = wanted.bus.gate.map(|gate| (usize::from(gate.slave), gate.oversampling.max(1)));
    let gate = gate.filter(|(_, samples)| *samples > 1);
    // The first slave with a clock gives the time of the bus.
    let reference = group.iter(main).position(|slave| slave.dc_support().any());
    let Some(reference) = reference else {
        return Err(PortError::Unsupported {
            what: "no slave on the bus has a distributed clock".to_owned(),
            instead: "use drives that have".to_owned(),
        }
        .into());
    };
    let clock_of = group.subdevice(main, reference).asked(WHAT)?;
    for (index, samples) in synced.chain(gate) {
        let slave = group.subdevice(main, index).asked(WHAT)?;
        let sync0 = (period / u64::from(samples)) as u32;
        let time = clock_of.register_read::<u64>(register::SYSTEM_TIME).await.asked(WHAT)?;
        let start = first_signal(time, wanted.period, wanted.shift);
        write(&slave, register::ACTIVATION, 0_u8, WHAT).await?;
        write(&slave, register::CYCLIC_UNIT, 0_u8, WHAT).await?;
        write(&slave, register::START, start, WHAT).await?;
        write(&slave, register::SYNC0, sync0, WHAT).await?;
        if samples > 1 {
            write(&slave, register::SYNC1, sync0 * u32::from(samples - 1), WHAT).await?;
        }
        let activation = if samples > 1 { 0x07_u8 } else { 0x03 };
        write(&slave, register::ACTIVATION, activation, WHAT).await?;
    }
    Ok(reference)
}

/// When the signals of a slave begin that is set up at `time` of the bus: `shift` after a multiple of the period, so
/// that those of all slaves come together.
fn first_signal(time: u64, period: Nanoseconds, shift: Nanoseconds) -> u64 {
    // The time of a bus is 64 bits that go round: it is reckoned as the number that the slaves compare.
    let ahead = (time as i64).wrapping_add(AHEAD);
    let deadline = ahead.wrapping_add(period.0).wrapping_sub(ahead.rem_euclid(period.0.max(1)));
    deadline.wrapping_add(shift.0) as u64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signals_begin_in_the_same_phase_whenever_they_are_set_up() {
        let [period, shift] = [1_000_000, 300_000].map(Nanoseconds);
        for time in [0, 1, 123_456_789, 5_000_000_000_u64, (-200_000_001_i64) as u64] {
            let start = first_signal(time, period, shift) as i64;
            assert_eq!((start - shift.0).rem_euclid(period.0), 0, "{time}");
            let ahead = start.wrapping_sub(time as i64);
            assert!((AHEAD..=AHEAD + 2 * period.0).contains(&ahead), "{time}: {ahead}");
        }
    }

    #[test]
    fn a_period_is_told_exactly() {
        let told = |time| power_of_ten(Nanoseconds(time));
        assert_eq!(told(1_000_000), (1, -3));
        assert_eq!(told(4_000_000), (4, -3));
        assert_eq!(told(250_000), (25, -5));
        assert_eq!(told(125_000), (125, -6));
    }

    #[test]
    fn a_latency_is_a_part_of_the_period() {
        let period = Nanoseconds(1_000_000);
        assert_eq!(shift(Nanoseconds(500_000), period), Some(Nanoseconds(500_000)));
        for latency in [0, 299_999, 900_001, 1_000_000, 2_000_000] {
            assert_eq!(shift(Nanoseconds(latency), period), None);
        }
    }
}
