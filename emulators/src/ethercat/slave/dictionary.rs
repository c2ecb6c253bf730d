//! A slave's objects: their values, who may write them, and whether process data can carry them.

use std::collections::BTreeMap;

use super::sdo::Abort;
use super::sii::PdoEntry;
use super::state::State;

/// Who may write an object, and when.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Access {
    /// The slave alone.
    ReadOnly,
    /// The master.
    ReadWrite,
    /// The master, before there is process data.
    Setup,
}

/// Which process data can carry an object.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mappable {
    /// None.
    No,
    /// That to the slave.
    Output,
    /// That from the slave.
    Input,
}

/// An object.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Object {
    value: Vec<u8>,
    access: Access,
    mappable: Mappable,
}

impl Object {
    /// A number of the size of `value`.
    pub fn new(value: &[u8], access: Access, mappable: Mappable) -> Self {
        Self { value: value.to_vec(), access, mappable }
    }
}

/// All objects of a slave, by index and subindex.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Dictionary {
    objects: BTreeMap<(u16, u8), Object>,
}

impl Dictionary {
    /// Adds an object.
    pub fn add(&mut self, index: u16, sub: u8, object: Object) {
        self.objects.insert((index, sub), object);
    }

    /// Adds a fixed number or text.
    pub fn constant(&mut self, index: u16, sub: u8, value: &[u8]) {
        self.add(index, sub, Object::new(value, Access::ReadOnly, Mappable::No));
    }

    /// The bytes of an object.
    ///
    /// # Errors
    /// If there is none.
    pub fn read(&self, index: u16, sub: u8) -> Result<&[u8], Abort> {
        match self.objects.get(&(index, sub)) {
            Some(object) => Ok(&object.value),
            None => Err(self.missing(index)),
        }
    }

    fn missing(&self, index: u16) -> Abort {
        let any = self.objects.range((index, 0)..=(index, u8::MAX)).next().is_some();
        if any { Abort::NoSubindex } else { Abort::NoObject }
    }

    /// Whether the master may write `bytes` to an object in `state`.
    ///
    /// # Errors
    /// If it may not.
    pub fn may_write(&self, index: u16, sub: u8, bytes: &[u8], state: State) -> Result<(), Abort> {
        let object = self.objects.get(&(index, sub)).ok_or_else(|| self.missing(index))?;
        match object.access {
            Access::ReadOnly => return Err(Abort::ReadOnly),
            Access::Setup if state != State::PreOp => return Err(Abort::State),
            Access::Setup | Access::ReadWrite => {}
        }
        match bytes.len().cmp(&object.value.len()) {
            core::cmp::Ordering::Less => Err(Abort::TooShort),
            core::cmp::Ordering::Greater => Err(Abort::TooLong),
            core::cmp::Ordering::Equal => Ok(()),
        }
    }

    /// Puts `bytes` into an object, whoever may; what is longer than the object is left out.
    pub fn put(&mut self, index: u16, sub: u8, bytes: &[u8]) {
        if let Some(object) = self.objects.get_mut(&(index, sub)) {
            object.value.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        }
    }

    /// The number in an object, as if it were unsigned; 0 if there is none.
    pub fn number(&self, index: u16, sub: u8) -> u32 {
        crate::ethercat::frame::double_word(self.read(index, sub).unwrap_or_default(), 0)
    }

    /// The signed number in an object of two or four bytes.
    pub fn signed(&self, index: u16, sub: u8) -> i32 {
        let bytes = self.read(index, sub).unwrap_or_default();
        match *bytes {
            [one] => i32::from(one as i8),
            [low, high] => i32::from(i16::from_le_bytes([low, high])),
            _ => self.number(index, sub) as i32,
        }
    }

    /// Whether process data in this direction can carry `entry`.
    ///
    /// # Errors
    /// If it cannot.
    pub fn may_map(&self, entry: PdoEntry, mappable: Mappable) -> Result<(), Abort> {
        if entry.index == 0 {
            return Ok(());
        }
        let object = self.objects.get(&(entry.index, entry.sub));
        let object = object.ok_or_else(|| self.missing(entry.index))?;
        let fits = object.mappable == mappable && object.value.len() * 8 == usize::from(entry.bits);
        if fits { Ok(()) } else { Err(Abort::NotMappable) }
    }
}
