//! The objects of a drive, with the values that it is delivered with.

use super::super::slave::dictionary::{Access, Dictionary, Mappable, Object};
use super::super::slave::mapping;
use super::super::slave::sii::{Identity, Pdo, PdoEntry};

/// The mode that follows positions (CSP).
pub const POSITION: i8 = 8;
/// The mode that follows speeds (CSV).
pub const VELOCITY: i8 = 9;
/// The mode that follows torques (CST).
pub const TORQUE: i8 = 10;
/// The mode that finds the home position.
pub const HOMING: i8 = 6;

/// What a drive's objects depend on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Values {
    /// Who it is.
    pub identity: Identity,
    /// Torque that 1000 stands for [mN·m].
    pub rated_torque: u32,
    /// Current of that torque [mA].
    pub rated_current: u32,
    /// Counts of a revolution.
    pub counts: u32,
    /// Following error that is a fault [counts].
    pub following_error: u32,
    /// What a ramp takes from the speed [counts/s²].
    pub deceleration: u32,
    /// A gentle speed [counts/s].
    pub homing_speed: u32,
}

/// The process data that the drive is delivered with: 6040, 607A and 6060; 6041, 6064 and 6061.
pub fn pdos() -> Vec<Pdo> {
    let entry = |(index, bits)| PdoEntry { index, sub: 0, bits };
    let list = |index, output, entries: &[(u16, u8)]| Pdo {
        index,
        manager: if output { 2 } else { 3 },
        output,
        entries: entries.iter().copied().map(entry).collect(),
    };
    vec![
        list(0x1600, true, &[(0x6040, 16), (0x607A, 32), (0x6060, 8)]),
        list(0x1A00, false, &[(0x6041, 16), (0x6064, 32), (0x6061, 8)]),
    ]
}

/// All objects.
pub fn dictionary(name: &str, values: &Values) -> Dictionary {
    let mut dictionary = Dictionary::default();
    let Identity { vendor, product, revision, serial } = values.identity;
    // A servo drive of CiA 402.
    dictionary.constant(0x1000, 0, &0x0002_0192_u32.to_le_bytes());
    dictionary.constant(0x1001, 0, &[0]);
    dictionary.constant(0x1008, 0, name.as_bytes());
    dictionary.constant(0x1009, 0, b"emulated");
    dictionary.constant(0x100A, 0, b"1.0");
    dictionary.constant(0x1018, 0, &[4]);
    for (sub, number) in (1..).zip([vendor, product, revision, serial]) {
        dictionary.constant(0x1018, sub, &number.to_le_bytes());
    }
    mapping::add(&mut dictionary, &pdos());
    synchronization(&mut dictionary);
    signals(&mut dictionary);
    settings(&mut dictionary, values);
    dictionary
}

fn synchronization(dictionary: &mut Dictionary) {
    for index in [0x1C32, 0x1C33] {
        dictionary.constant(index, 0, &[32]);
        // Free-running, with the sync manager, with SYNC0.
        dictionary.add(index, 1, Object::new(&[0, 0], Access::ReadWrite, Mappable::No));
        dictionary.constant(index, 2, &[0; 4]);
        dictionary.constant(index, 4, &0x0007_u16.to_le_bytes());
        dictionary.constant(index, 5, &125_000_u32.to_le_bytes());
        dictionary.constant(index, 6, &20_000_u32.to_le_bytes());
        dictionary.constant(index, 11, &[0; 2]);
        dictionary.constant(index, 12, &[0; 2]);
        dictionary.constant(index, 32, &[0]);
    }
    // How many cycles may lack new targets: three are added for one that does, one is taken for one that does not.
    dictionary.constant(0x10F1, 0, &[2]);
    dictionary.add(0x10F1, 2, Object::new(&20_u16.to_le_bytes(), Access::ReadWrite, Mappable::No));
}

/// What changes as the drive runs.
fn signals(dictionary: &mut Dictionary) {
    let inputs: [(u16, usize); 12] = [
        (0x603F, 2),
        (0x6041, 2),
        (0x6061, 1),
        (0x6062, 4),
        (0x6064, 4),
        (0x606B, 4),
        (0x606C, 4),
        (0x6074, 2),
        (0x6077, 2),
        (0x6078, 2),
        (0x60F4, 4),
        (0x60FD, 4),
    ];
    for (index, bytes) in inputs {
        let value = [0; 4];
        let value = value.get(..bytes).unwrap_or_default();
        dictionary.add(index, 0, Object::new(value, Access::ReadOnly, Mappable::Input));
    }
    let outputs: [(u16, usize); 8] = [
        (0x6040, 2),
        (0x6060, 1),
        (0x6071, 2),
        (0x607A, 4),
        (0x60B0, 4),
        (0x60B1, 4),
        (0x60B2, 2),
        (0x60FF, 4),
    ];
    for (index, bytes) in outputs {
        let value = [0; 4];
        let value = value.get(..bytes).unwrap_or_default();
        dictionary.add(index, 0, Object::new(value, Access::ReadWrite, Mappable::Output));
    }
    dictionary.constant(0x60FE, 0, &[2]);
    for sub in [1, 2] {
        dictionary.add(0x60FE, sub, Object::new(&[0; 4], Access::ReadWrite, Mappable::Output));
    }
}

fn settings(dictionary: &mut Dictionary, values: &Values) {
    let mut setting = |index, sub, value: &[u8]| {
        dictionary.add(index, sub, Object::new(value, Access::ReadWrite, Mappable::No));
    };
    // The bus is lost: a fault; a quick stop: the quick ramp; a fault: the quick ramp.
    setting(0x6007, 0, &1_i16.to_le_bytes());
    setting(0x605A, 0, &2_i16.to_le_bytes());
    setting(0x605E, 0, &2_i16.to_le_bytes());
    setting(0x6065, 0, &values.following_error.to_le_bytes());
    setting(0x6066, 0, &10_u16.to_le_bytes());
    setting(0x6072, 0, &1000_u16.to_le_bytes());
    setting(0x607C, 0, &[0; 4]);
    setting(0x6084, 0, &(values.deceleration / 4).max(1).to_le_bytes());
    setting(0x6085, 0, &values.deceleration.to_le_bytes());
    setting(0x6098, 0, &[37]);
    setting(0x6099, 1, &values.homing_speed.to_le_bytes());
    setting(0x6099, 2, &(values.homing_speed / 4).max(1).to_le_bytes());
    setting(0x609A, 0, &values.deceleration.to_le_bytes());
    // One millisecond: 1 times 10 to the minus 3.
    setting(0x60C2, 1, &[1]);
    setting(0x60C2, 2, &(-3_i8).to_le_bytes());
    dictionary.constant(0x6099, 0, &[2]);
    dictionary.constant(0x60C2, 0, &[2]);
    dictionary.constant(0x6075, 0, &values.rated_current.to_le_bytes());
    dictionary.constant(0x6076, 0, &values.rated_torque.to_le_bytes());
    dictionary.constant(0x608F, 0, &[2]);
    dictionary.constant(0x608F, 1, &values.counts.to_le_bytes());
    dictionary.constant(0x608F, 2, &1_u32.to_le_bytes());
    // Homing, CSP, CSV, CST.
    dictionary.constant(0x6502, 0, &0x03A0_u32.to_le_bytes());
}
