//! The protobuf wire format, as much of it as recordings need: numbers, doubles, lists of them and
//! messages inside messages. What is zero takes no room.
//!
//! <https://protobuf.dev/programming-guides/encoding/>

/// Bytes that are no message of the expected kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a message in it is damaged")]
pub struct Malformed;

const VARINT: u64 = 0;
const FIXED: u64 = 1;
const BYTES: u64 = 2;

/// A field's value as it stands in the bytes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Wire<'a> {
    /// A number of variable length.
    Number(u64),
    /// Eight bytes, the bits of a double.
    Fixed(u64),
    /// A text, a list or a message.
    Bytes(&'a [u8]),
}

impl<'a> Wire<'a> {
    /// As a number.
    pub fn number(self) -> Result<u64, Malformed> {
        if let Self::Number(value) = self { Ok(value) } else { Err(Malformed) }
    }

    /// As a number with its sign.
    pub fn signed(self) -> Result<i64, Malformed> {
        self.number().map(unfold)
    }

    /// As a double.
    pub fn double(self) -> Result<f64, Malformed> {
        if let Self::Fixed(bits) = self { Ok(f64::from_bits(bits)) } else { Err(Malformed) }
    }

    /// As bytes.
    pub fn bytes(self) -> Result<&'a [u8], Malformed> {
        if let Self::Bytes(bytes) = self { Ok(bytes) } else { Err(Malformed) }
    }

    /// As a text.
    pub fn text(self) -> Result<&'a str, Malformed> {
        core::str::from_utf8(self.bytes()?).map_err(|_| Malformed)
    }
}

/// Appends a number of variable length.
fn put_varint(mut value: u64, out: &mut Vec<u8>) {
    while value >= 0x80 {
        out.push(value as u8 | 0x80);
        value >>= 7;
    }
    out.push(value as u8);
}

fn take_varint(bytes: &mut &[u8]) -> Result<u64, Malformed> {
    let mut value = 0;
    for shift in (0..64).step_by(7) {
        let (first, rest) = bytes.split_first().ok_or(Malformed)?;
        *bytes = rest;
        value |= u64::from(first & 0x7f) << shift;
        if *first < 0x80 {
            return Ok(value);
        }
    }
    Err(Malformed)
}

/// Numbers with a sign, so that small ones are short.
fn fold(value: i64) -> u64 {
    ((value << 1) ^ (value >> 63)) as u64
}

fn unfold(value: u64) -> i64 {
    (value >> 1) as i64 ^ -((value & 1) as i64)
}

fn put_tag(number: u32, kind: u64, out: &mut Vec<u8>) {
    put_varint(u64::from(number) << 3 | kind, out);
}

/// Appends a number, unless it is 0.
pub fn put_number(number: u32, value: u64, out: &mut Vec<u8>) {
    if value != 0 {
        put_tag(number, VARINT, out);
        put_varint(value, out);
    }
}

/// Appends a number with its sign, unless it is 0.
pub fn put_signed(number: u32, value: i64, out: &mut Vec<u8>) {
    put_number(number, fold(value), out);
}

/// Appends a double, unless all its bits are 0.
pub fn put_double(number: u32, value: f64, out: &mut Vec<u8>) {
    if value.to_bits() != 0 {
        put_tag(number, FIXED, out);
        out.extend(value.to_bits().to_le_bytes());
    }
}

/// Appends a text, a list or a message, also an empty one.
pub fn put_bytes(number: u32, bytes: &[u8], out: &mut Vec<u8>) {
    put_tag(number, BYTES, out);
    put_varint(bytes.len() as u64, out);
    out.extend(bytes);
}

/// Appends what `write` appends, as one message.
pub fn put_message(number: u32, out: &mut Vec<u8>, write: impl FnOnce(&mut Vec<u8>)) {
    put_tag(number, BYTES, out);
    // Its length stands before it and is known after it: nearly always one byte or two.
    let begin = out.len();
    write(out);
    let length = (out.len() - begin) as u64;
    let body = out.len();
    put_varint(length, out);
    let prefix = out.len() - body;
    if let Some(part) = out.get_mut(begin..) {
        part.rotate_right(prefix);
    }
}

/// Appends doubles, without the zeros at their end.
pub fn put_doubles(number: u32, values: &[f64], out: &mut Vec<u8>) {
    let count = values.iter().rposition(|value| value.to_bits() != 0).map_or(0, |last| last + 1);
    if count > 0 {
        put_tag(number, BYTES, out);
        put_varint(8 * count as u64, out);
        values.iter().take(count).for_each(|value| out.extend(value.to_bits().to_le_bytes()));
    }
}

/// Appends numbers with their signs, without the zeros at their end.
pub fn put_signeds(number: u32, values: &[i64], out: &mut Vec<u8>) {
    let count = values.iter().rposition(|value| *value != 0).map_or(0, |last| last + 1);
    if count > 0 {
        let list = values.iter().take(count);
        put_message(number, out, |out| list.for_each(|value| put_varint(fold(*value), out)));
    }
}

/// Takes doubles into `values`; those that are not told stay as they are.
pub fn take_doubles(wire: Wire<'_>, values: &mut [f64]) -> Result<(), Malformed> {
    let bytes = wire.bytes()?;
    let (words, rest) = bytes.as_chunks::<8>();
    if !rest.is_empty() || words.len() > values.len() {
        return Err(Malformed);
    }
    values.iter_mut().zip(words).for_each(|(value, word)| *value = f64::from_le_bytes(*word));
    Ok(())
}

/// Takes numbers with their signs into `values`; those that are not told stay as they are.
pub fn take_signeds(wire: Wire<'_>, values: &mut [i64]) -> Result<(), Malformed> {
    let mut bytes = wire.bytes()?;
    let mut values = values.iter_mut();
    while !bytes.is_empty() {
        *values.next().ok_or(Malformed)? = unfold(take_varint(&mut bytes)?);
    }
    Ok(())
}

/// The fields of a message, in their order.
pub fn fields(mut bytes: &[u8]) -> impl Iterator<Item = Result<(u32, Wire<'_>), Malformed>> {
    std::iter::from_fn(move || {
        let field = (!bytes.is_empty()).then(|| take_field(&mut bytes))?;
        if field.is_err() {
            bytes = &[];
        }
        Some(field)
    })
}

fn take_field<'a>(bytes: &mut &'a [u8]) -> Result<(u32, Wire<'a>), Malformed> {
    let tag = take_varint(bytes)?;
    let number = u32::try_from(tag >> 3).map_err(|_| Malformed)?;
    let wire = match tag & 7 {
        VARINT => Wire::Number(take_varint(bytes)?),
        FIXED => {
            let (word, rest) = bytes.split_first_chunk::<8>().ok_or(Malformed)?;
            *bytes = rest;
            Wire::Fixed(u64::from_le_bytes(*word))
        }
        BYTES => {
            let length = usize::try_from(take_varint(bytes)?).map_err(|_| Malformed)?;
            let (body, rest) = bytes.split_at_checked(length).ok_or(Malformed)?;
            *bytes = rest;
            Wire::Bytes(body)
        }
        _ => return Err(Malformed),
    };
    Ok((number, wire))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn bytes_are_those_of_the_specification() {
        let mut out = Vec::new();
        put_number(1, 150, &mut out);
        put_signed(2, -2, &mut out);
        put_bytes(2, b"testing", &mut out);
        put_double(3, 1.0, &mut out);
        put_message(3, &mut out, |out| put_number(1, 150, out));
        let expect =
            b"\x08\x96\x01\x10\x03\x12\x07testing\x19\0\0\0\0\0\0\xf0\x3f\x1a\x03\x08\x96\x01";
        assert_eq!(out, expect);
    }

    #[test]
    fn numbers_of_every_length_come_back() {
        for bits in 0..64 {
            for value in [1_u64 << bits, (1 << bits) - 1, u64::MAX >> bits] {
                let mut out = Vec::new();
                put_number(7, value, &mut out);
                put_signed(8, value as i64, &mut out);
                let told: Vec<_> = fields(&out).map(Result::unwrap).collect();
                let mut expect =
                    vec![(7, Wire::Number(value)), (8, Wire::Number(fold(value as i64)))];
                expect.retain(|_| value != 0);
                assert_eq!(told, expect);
                assert!(told.iter().skip(1).all(|(_, wire)| wire.signed() == Ok(value as i64)));
            }
        }
    }

    #[test]
    fn lists_end_at_their_last_number_that_is_not_zero() {
        let mut out = Vec::new();
        put_doubles(1, &[0.0, -0.0, 0.0, 0.0], &mut out);
        put_signeds(2, &[-300, 0, 5, 0], &mut out);
        put_doubles(3, &[0.0; 4], &mut out);
        let told: Vec<_> = fields(&out).map(Result::unwrap).collect();
        assert_eq!(told.len(), 2);
        let (mut doubles, mut numbers) = ([0.0; 4], [0; 4]);
        take_doubles(told[0].1, &mut doubles).unwrap();
        take_signeds(told[1].1, &mut numbers).unwrap();
        assert_eq!(doubles.map(f64::to_bits), [0.0, -0.0, 0.0, 0.0].map(f64::to_bits));
        assert_eq!(numbers, [-300, 0, 5, 0]);
        assert_eq!(take_doubles(told[0].1, &mut [0.0]), Err(Malformed));
        assert_eq!(take_signeds(told[1].1, &mut [0; 2]), Err(Malformed));
    }

    #[test]
    fn what_is_cut_anywhere_is_malformed_or_ends_between_fields() {
        let mut out = Vec::new();
        put_number(1, 1 << 40, &mut out);
        put_double(2, 2.5, &mut out);
        put_message(3, &mut out, |out| out.extend([7; 300]));
        let (second, third) = (7, 16);
        for length in 0..out.len() {
            let whole = fields(&out[..length]).all(|field| field.is_ok());
            assert_eq!(whole, [0, second, third].contains(&length), "{length}");
        }
        assert!(fields(&[0xff; 30]).any(|field| field.is_err()));
    }
}
