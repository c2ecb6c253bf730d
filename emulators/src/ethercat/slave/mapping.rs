//! Which objects the process data carries: the lists (0x16xx, 0x1Axx) and their assignment (0x1C12, 0x1C13).
//!
//! ETG.1000.6: a list is changed while it is empty, its number of entries being written last; the lists
//! before their assignment; and both before there is process data.

use super::dictionary::{Access, Dictionary, Mappable, Object};
use super::fmmu::copy_bits;
use super::sdo::Abort;
use super::sii::{Pdo, PdoEntry};
use crate::ethercat::frame::{double_word, word};

/// Most objects in a list.
const MOST_ENTRIES: u8 = 16;

/// Most lists of a direction.
const MOST_LISTS: u8 = 4;

/// Most bytes of process data in a direction.
const MOST_BYTES: usize = 128;

/// The list of the lists to the slave.
const OUTPUTS: u16 = 0x1C12;

/// The list of the lists from the slave.
const INPUTS: u16 = 0x1C13;

/// Puts the lists of `pdos` into the dictionary, assigned, in such a way that a master can set them.
pub fn add(dictionary: &mut Dictionary, pdos: &[Pdo]) {
    let setup = |value: &[u8]| Object::new(value, Access::Setup, Mappable::No);
    // A master learns from it which sync manager is for what.
    for (sub, value) in [4, 1, 2, 3, 4].into_iter().enumerate() {
        dictionary.constant(0x1C00, sub as u8, &[value]);
    }
    for (assignment, output) in [(OUTPUTS, true), (INPUTS, false)] {
        let lists: Vec<_> = pdos.iter().filter(|pdo| pdo.output == output).collect();
        dictionary.add(assignment, 0, setup(&[lists.len() as u8]));
        for sub in 1..=MOST_LISTS {
            let list = lists.get(usize::from(sub) - 1).map_or(0, |pdo| pdo.index);
            dictionary.add(assignment, sub, setup(&list.to_le_bytes()));
        }
    }
    for pdo in pdos {
        dictionary.add(pdo.index, 0, setup(&[pdo.entries.len() as u8]));
        for sub in 1..=MOST_ENTRIES {
            let entry = pdo.entries.get(usize::from(sub) - 1).map_or(0, |entry| {
                u32::from(entry.index) << 16 | u32::from(entry.sub) << 8 | u32::from(entry.bits)
            });
            dictionary.add(pdo.index, sub, setup(&entry.to_le_bytes()));
        }
    }
}

/// Whether writing `bytes` to an object leaves the lists sound; all other objects do.
///
/// # Errors
/// If it does not.
pub fn check(dictionary: &Dictionary, index: u16, sub: u8, bytes: &[u8]) -> Result<(), Abort> {
    match index {
        OUTPUTS | INPUTS => check_assignment(dictionary, index, sub, bytes),
        0x1600..=0x17FF => check_list(dictionary, index, sub, bytes, Mappable::Output),
        0x1A00..=0x1BFF => check_list(dictionary, index, sub, bytes, Mappable::Input),
        _ => Ok(()),
    }
}

fn check_assignment(
    dictionary: &Dictionary,
    index: u16,
    sub: u8,
    bytes: &[u8],
) -> Result<(), Abort> {
    if sub > 0 {
        if dictionary.number(index, 0) != 0 {
            return Err(Abort::NotEmpty);
        }
        let list = word(bytes, 0);
        let range = if index == OUTPUTS { 0x1600..=0x17FF } else { 0x1A00..=0x1BFF };
        let known = range.contains(&list) && dictionary.read(list, 0).is_ok();
        return if known { Ok(()) } else { Err(Abort::Value) };
    }
    let count = bytes.first().copied().unwrap_or(0);
    if count > MOST_LISTS {
        return Err(Abort::Value);
    }
    let lists: Vec<u16> = (1..=count).map(|sub| dictionary.number(index, sub) as u16).collect();
    let twice =
        lists.iter().enumerate().any(|(at, list)| lists.iter().skip(at + 1).any(|it| it == list));
    if twice || lists.iter().any(|list| dictionary.read(*list, 0).is_err()) {
        return Err(Abort::Value);
    }
    let bits: usize = lists.iter().flat_map(|list| entries(dictionary, *list)).map(bits).sum();
    if bits > 8 * MOST_BYTES { Err(Abort::MappingTooLong) } else { Ok(()) }
}

fn check_list(
    dictionary: &Dictionary,
    index: u16,
    sub: u8,
    bytes: &[u8],
    mappable: Mappable,
) -> Result<(), Abort> {
    if assigned(dictionary, index) {
        return Err(Abort::NotEmpty);
    }
    if sub > 0 {
        if dictionary.number(index, 0) != 0 {
            return Err(Abort::NotEmpty);
        }
        return dictionary.may_map(entry(double_word(bytes, 0)), mappable);
    }
    let count = bytes.first().copied().unwrap_or(0);
    if count > MOST_ENTRIES {
        return Err(Abort::MappingTooLong);
    }
    for sub in 1..=count {
        let entry = entry(dictionary.number(index, sub));
        if entry.bits == 0 {
            return Err(Abort::NotMappable);
        }
        dictionary.may_map(entry, mappable)?;
    }
    Ok(())
}

/// Whether a list is in the assignment.
fn assigned(dictionary: &Dictionary, list: u16) -> bool {
    [OUTPUTS, INPUTS].into_iter().any(|index| {
        let count = dictionary.number(index, 0) as u8;
        (1..=count).any(|sub| dictionary.number(index, sub) == u32::from(list))
    })
}

fn entry(value: u32) -> PdoEntry {
    PdoEntry { index: (value >> 16) as u16, sub: (value >> 8) as u8, bits: value as u8 }
}

fn bits(entry: PdoEntry) -> usize {
    usize::from(entry.bits)
}

fn entries(dictionary: &Dictionary, list: u16) -> Vec<PdoEntry> {
    let count = dictionary.number(list, 0) as u8;
    (1..=count).map(|sub| entry(dictionary.number(list, sub))).collect()
}

/// What the process data carries in one direction, in its order.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Mapping {
    entries: Vec<PdoEntry>,
}

impl Mapping {
    /// What is mapped to the slave, or from it.
    pub fn of(dictionary: &Dictionary, output: bool) -> Self {
        let index = if output { OUTPUTS } else { INPUTS };
        let count = dictionary.number(index, 0) as u8;
        let lists = (1..=count).map(|sub| dictionary.number(index, sub) as u16);
        Self { entries: lists.flat_map(|list| entries(dictionary, list)).collect() }
    }

    /// Bytes of the process data.
    pub fn bytes(&self) -> usize {
        self.entries.iter().copied().map(bits).sum::<usize>().div_ceil(8)
    }

    /// Whether it carries an object.
    pub fn carries(&self, index: u16) -> bool {
        self.entries.iter().any(|entry| entry.index == index)
    }

    /// Puts the process data `from` a master into the objects.
    pub fn unpack(&self, from: &[u8], dictionary: &mut Dictionary) {
        let mut at = 0;
        for entry in &self.entries {
            let mut value = [0; 8];
            copy_bits(from, at, &mut value, 0, bits(*entry));
            dictionary.put(entry.index, entry.sub, &value);
            at += bits(*entry);
        }
    }

    /// Puts the objects into the process data to a master.
    pub fn pack(&self, dictionary: &Dictionary, to: &mut [u8]) {
        let mut at = 0;
        for entry in &self.entries {
            let value = dictionary.read(entry.index, entry.sub).unwrap_or_default();
            copy_bits(value, 0, to, at, bits(*entry));
            at += bits(*entry);
        }
    }
}
