//! Samples as messages of a recording: lossless, with nothing written for what is zero, unused or
//! told already.
//!
//! The list of a sample's fields in [`samples`] is all there is: writing, reading and the schema,
//! with the meaning and unit of each field, are made of it. Fields keep their numbers for ever.

pub mod difference;
pub mod samples;
pub mod schema;

use super::wire::{self, Malformed, Wire};
use messages::{Nanoseconds, Sample};

/// What the fields of a message are told against: a time of this cycle is a small number, and the
/// number of the cycle none.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Origin {
    /// The run of drives.
    pub epoch: u64,
    /// The cycle.
    pub cycle: u64,
    /// The deadline at which it begins [ns].
    pub deadline: i64,
}

/// The type of a field in a schema.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// A number of 0 or more.
    Number,
    /// A number with its sign.
    Signed,
    /// A double.
    Double,
    /// A list of doubles.
    Doubles,
    /// A list of numbers with their signs.
    Signeds,
    /// A text.
    Text,
    /// Another message.
    Message(&'static str),
    /// A list of other messages.
    Messages(&'static str),
}

/// A field of a message, as a schema tells it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FieldDescription {
    /// Its number.
    pub number: u32,
    /// Its name.
    pub name: &'static str,
    /// Its type.
    pub shape: Shape,
    /// What it means, with its unit.
    pub meaning: &'static str,
}

/// A sample that can stand in a recording.
pub trait Message: Sample {
    /// Its name in the schema.
    const TITLE: &'static str;

    /// Its fields.
    fn description() -> Vec<FieldDescription>;

    /// Appends its fields.
    fn put(&self, origin: &Origin, out: &mut Vec<u8>);

    /// What it is without any field.
    fn absent(origin: &Origin) -> Self;

    /// Takes one field; one that is not known is passed over.
    ///
    /// # Errors
    /// A field of another type.
    fn take(&mut self, number: u32, wire: Wire<'_>, origin: &Origin) -> Result<(), Malformed>;

    /// Reads a whole message.
    ///
    /// # Errors
    /// Bytes that are no such message.
    fn read(bytes: &[u8], origin: &Origin) -> Result<Self, Malformed> {
        let mut message = Self::absent(origin);
        for field in wire::fields(bytes) {
            let (number, wire) = field?;
            message.take(number, wire, origin)?;
        }
        Ok(message)
    }
}

/// What a field of a message can be.
pub trait Value {
    /// Its type.
    const SHAPE: Shape;

    /// Appends it under a number.
    fn put(&self, number: u32, out: &mut Vec<u8>);

    /// Takes it.
    ///
    /// # Errors
    /// Another type, or a number that is too large.
    fn take(&mut self, wire: Wire<'_>) -> Result<(), Malformed>;
}

macro_rules! numbers {
    ($($type:ty),*) => {
        $(impl Value for $type {
            const SHAPE: Shape = Shape::Number;

            fn put(&self, number: u32, out: &mut Vec<u8>) {
                wire::put_number(number, u64::from(*self), out);
            }

            fn take(&mut self, wire: Wire<'_>) -> Result<(), Malformed> {
                *self = wire.number()?.try_into().map_err(|_| Malformed)?;
                Ok(())
            }
        })*
    };
}

numbers!(u16, u32, u64);

impl Value for f64 {
    const SHAPE: Shape = Shape::Double;

    fn put(&self, number: u32, out: &mut Vec<u8>) {
        wire::put_double(number, *self, out);
    }

    fn take(&mut self, wire: Wire<'_>) -> Result<(), Malformed> {
        *self = wire.double()?;
        Ok(())
    }
}

impl Value for Nanoseconds {
    const SHAPE: Shape = Shape::Signed;

    fn put(&self, number: u32, out: &mut Vec<u8>) {
        wire::put_signed(number, self.0, out);
    }

    fn take(&mut self, wire: Wire<'_>) -> Result<(), Malformed> {
        self.0 = wire.signed()?;
        Ok(())
    }
}

impl<const N: usize> Value for [f64; N] {
    const SHAPE: Shape = Shape::Doubles;

    fn put(&self, number: u32, out: &mut Vec<u8>) {
        wire::put_doubles(number, self, out);
    }

    fn take(&mut self, wire: Wire<'_>) -> Result<(), Malformed> {
        wire::take_doubles(wire, self)
    }
}

impl<const N: usize> Value for [i64; N] {
    const SHAPE: Shape = Shape::Signeds;

    fn put(&self, number: u32, out: &mut Vec<u8>) {
        wire::put_signeds(number, self, out);
    }

    fn take(&mut self, wire: Wire<'_>) -> Result<(), Malformed> {
        wire::take_signeds(wire, self)
    }
}

/// Writes the [`Message`] of a sample from the list of its fields: number, name, how it is told, meaning.
///
/// `plain` is told as it is; `stamp`, `cycle` and `epoch` against the [`Origin`]; `message` is one inside.
macro_rules! message {
    ($sample:ident { $( $number:literal $field:ident $kind:ident $meaning:literal, )* }) => {
        impl Message for $sample {
            const TITLE: &'static str = stringify!($sample);

            fn description() -> Vec<FieldDescription> {
                let $sample { $($field,)* } = $sample::zeroed();
                vec![$(FieldDescription {
                    number: $number,
                    name: stringify!($field),
                    shape: message!(@shape $kind $field),
                    meaning: $meaning,
                },)*]
            }

            fn put(&self, origin: &Origin, out: &mut Vec<u8>) {
                let _ = origin;
                $( message!(@put $kind self.$field, $number, origin, out); )*
            }

            #[allow(unused_mut, reason = "a sample may have nothing that is told against the origin")]
            fn absent(origin: &Origin) -> Self {
                let mut absent = Self::zeroed();
                let _ = origin;
                $( message!(@absent $kind absent.$field, origin); )*
                absent
            }

            fn take(&mut self, number: u32, wire: Wire<'_>, origin: &Origin) -> Result<(), Malformed> {
                let _ = origin;
                match number {
                    $( $number => message!(@take $kind self.$field, wire, origin), )*
                    _ => Ok(()),
                }
            }
        }
    };
    (@shape plain $field:ident) => { shape_of(&$field) };
    (@shape message $field:ident) => { message_of(&$field) };
    (@shape $kind:ident $field:ident) => {{
        let _ = $field;
        Shape::Signed
    }};
    (@put plain $place:expr, $number:literal, $origin:ident, $out:ident) => {
        $place.put($number, $out)
    };
    (@put stamp $place:expr, $number:literal, $origin:ident, $out:ident) => {
        wire::put_signed($number, $place.0.wrapping_sub($origin.deadline), $out)
    };
    (@put cycle $place:expr, $number:literal, $origin:ident, $out:ident) => {
        wire::put_signed($number, $place.0.wrapping_sub($origin.cycle).cast_signed(), $out)
    };
    (@put epoch $place:expr, $number:literal, $origin:ident, $out:ident) => {
        wire::put_signed($number, $place.wrapping_sub($origin.epoch).cast_signed(), $out)
    };
    (@put message $place:expr, $number:literal, $origin:ident, $out:ident) => {
        put_part(&$place, $number, $origin, $out)
    };
    (@absent stamp $place:expr, $origin:ident) => { $place.0 = $origin.deadline };
    (@absent cycle $place:expr, $origin:ident) => { $place.0 = $origin.cycle };
    (@absent epoch $place:expr, $origin:ident) => { $place = $origin.epoch };
    (@absent $kind:ident $place:expr, $origin:ident) => {};
    (@take plain $place:expr, $wire:ident, $origin:ident) => { $place.take($wire) };
    (@take stamp $place:expr, $wire:ident, $origin:ident) => {{
        $place.0 = $wire.signed()?.wrapping_add($origin.deadline);
        Ok(())
    }};
    (@take cycle $place:expr, $wire:ident, $origin:ident) => {{
        $place.0 = $wire.signed()?.cast_unsigned().wrapping_add($origin.cycle);
        Ok(())
    }};
    (@take epoch $place:expr, $wire:ident, $origin:ident) => {{
        $place = $wire.signed()?.cast_unsigned().wrapping_add($origin.epoch);
        Ok(())
    }};
    (@take message $place:expr, $wire:ident, $origin:ident) => {{
        $place = Message::read($wire.bytes()?, $origin)?;
        Ok(())
    }};
}

use message;

fn shape_of<T: Value>(_: &T) -> Shape {
    T::SHAPE
}

fn message_of<T: Message>(_: &T) -> Shape {
    Shape::Message(T::TITLE)
}

/// Appends a message inside another one, unless it is zero.
fn put_part<T: Message>(part: &T, number: u32, origin: &Origin, out: &mut Vec<u8>) {
    if !is_zero(part) {
        wire::put_message(number, out, |out| part.put(origin, out));
    }
}

/// Whether all bits of a sample are 0.
pub(super) fn is_zero<T: Sample>(sample: &T) -> bool {
    sample.as_bytes().iter().all(|byte| *byte == 0)
}

#[cfg(test)]
mod tests;
