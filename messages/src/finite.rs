//! Whether an answer holds finite numbers alone.
//!
//! JSON has no NaN and no infinity, and writers of it put `null` in their place: an answer that looks
//! like one and is none. [`first_not_finite`] looks through any value before it is written, and says
//! where the first such number stands.

use core::fmt::{self, Write as _};

use serde::Serialize;
use serde::ser::{self, Serializer};

/// Where in `value` the first number stands that is not finite, such as `axes/0/velocity`; `None`
/// where there is none.
pub fn first_not_finite(value: &impl Serialize) -> Option<String> {
    value.serialize(Search).err().map(|found| found.path.trim_start_matches('/').to_owned())
}

/// Writes nothing, and ends at the first number that is not finite.
#[derive(Clone, Copy)]
struct Search;

/// A number that is not finite, and the keys that lead to it.
#[derive(Debug, Default)]
struct Found {
    path: String,
}

impl Found {
    fn below(self, key: impl fmt::Display) -> Self {
        Self { path: format!("/{key}{}", self.path) }
    }
}

impl fmt::Display for Found {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.path)
    }
}

impl core::error::Error for Found {}

impl ser::Error for Found {
    /// A type that cannot be written at all is for its writer to report.
    fn custom<T: fmt::Display>(_message: T) -> Self {
        Self::default()
    }
}

/// Looks through the parts of a list or table.
struct Parts {
    index: usize,
    key: String,
}

impl Parts {
    const START: Self = Self { index: 0, key: String::new() };

    fn element<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Found> {
        let index = self.index;
        self.index += 1;
        value.serialize(Search).map_err(|found| found.below(index))
    }

    fn entry<T: Serialize + ?Sized>(&mut self, key: &str, value: &T) -> Result<(), Found> {
        value.serialize(Search).map_err(|found| found.below(key))
    }
}

/// The methods of [`Serializer`] for values that hold no number with a fraction.
macro_rules! passes {
    ($($method:ident($($argument:ty),*);)*) => {
        $(fn $method(self, $(_: $argument),*) -> Result<(), Found> { Ok(()) })*
    };
}

impl Serializer for Search {
    type Ok = ();
    type Error = Found;
    type SerializeSeq = Parts;
    type SerializeTuple = Parts;
    type SerializeTupleStruct = Parts;
    type SerializeTupleVariant = Parts;
    type SerializeMap = Parts;
    type SerializeStruct = Parts;
    type SerializeStructVariant = Parts;

    passes! {
        serialize_bool(bool);
        serialize_i8(i8);
        serialize_i16(i16);
        serialize_i32(i32);
        serialize_i64(i64);
        serialize_u8(u8);
        serialize_u16(u16);
        serialize_u32(u32);
        serialize_u64(u64);
        serialize_char(char);
        serialize_str(&str);
        serialize_bytes(&[u8]);
        serialize_none();
        serialize_unit();
        serialize_unit_struct(&'static str);
        serialize_unit_variant(&'static str, u32, &'static str);
    }

    fn serialize_f32(self, value: f32) -> Result<(), Found> {
        self.serialize_f64(f64::from(value))
    }

    fn serialize_f64(self, value: f64) -> Result<(), Found> {
        if value.is_finite() { Ok(()) } else { Err(Found::default()) }
    }

    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Result<(), Found> {
        value.serialize(self)
    }

    fn serialize_newtype_struct<T: Serialize + ?Sized>(
        self,
        _name: &'static str,
        value: &T,
    ) -> Result<(), Found> {
        value.serialize(self)
    }

    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _name: &'static str,
        _index: u32,
        variant: &'static str,
        value: &T,
    ) -> Result<(), Found> {
        value.serialize(self).map_err(|found| found.below(variant))
    }

    fn serialize_seq(self, _length: Option<usize>) -> Result<Parts, Found> {
        Ok(Parts::START)
    }

    fn serialize_tuple(self, _length: usize) -> Result<Parts, Found> {
        Ok(Parts::START)
    }

    fn serialize_tuple_struct(self, _name: &'static str, _length: usize) -> Result<Parts, Found> {
        Ok(Parts::START)
    }

    fn serialize_tuple_variant(
        self,
        _name: &'static str,
        _index: u32,
        _variant: &'static str,
        _length: usize,
    ) -> Result<Parts, Found> {
        Ok(Parts::START)
    }

    fn serialize_map(self, _length: Option<usize>) -> Result<Parts, Found> {
        Ok(Parts::START)
    }

    fn serialize_struct(self, _name: &'static str, _length: usize) -> Result<Parts, Found> {
        Ok(Parts::START)
    }

    fn serialize_struct_variant(
        self,
        _name: &'static str,
        _index: u32,
        _variant: &'static str,
        _length: usize,
    ) -> Result<Parts, Found> {
        Ok(Parts::START)
    }
}

/// The traits of lists, by the name of their method.
macro_rules! lists {
    ($($list:ident $method:ident;)*) => {
        $(impl ser::$list for Parts {
            type Ok = ();
            type Error = Found;

            fn $method<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Found> {
                self.element(value)
            }

            fn end(self) -> Result<(), Found> {
                Ok(())
            }
        })*
    };
}

/// The traits of tables with fixed keys.
macro_rules! tables {
    ($($table:ident;)*) => {
        $(impl ser::$table for Parts {
            type Ok = ();
            type Error = Found;

            fn serialize_field<T: Serialize + ?Sized>(
                &mut self,
                key: &'static str,
                value: &T,
            ) -> Result<(), Found> {
                self.entry(key, value)
            }

            fn end(self) -> Result<(), Found> {
                Ok(())
            }
        })*
    };
}

lists! {
    SerializeSeq serialize_element;
    SerializeTuple serialize_element;
    SerializeTupleStruct serialize_field;
    SerializeTupleVariant serialize_field;
}

tables! {
    SerializeStruct;
    SerializeStructVariant;
}

/// A key as a text.
struct Key<'a, T: ?Sized>(&'a T);

impl<T: Serialize + ?Sized> fmt::Display for Key<'_, T> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.serialize(formatter)
    }
}

impl ser::SerializeMap for Parts {
    type Ok = ();
    type Error = Found;

    /// A key is a text in JSON; others are told by their number.
    fn serialize_key<T: Serialize + ?Sized>(&mut self, key: &T) -> Result<(), Found> {
        self.key.clear();
        if write!(self.key, "{}", Key(key)).is_err() {
            self.key = self.index.to_string();
        }
        self.index += 1;
        Ok(())
    }

    fn serialize_value<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Found> {
        let key = core::mem::take(&mut self.key);
        self.entry(&key, value)
    }

    fn end(self) -> Result<(), Found> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use serde::Serialize;

    use super::first_not_finite;

    #[derive(Serialize)]
    struct Axis {
        name: &'static str,
        limits: [Option<f64>; 2],
        share: f32,
    }

    #[derive(Serialize)]
    #[serde(untagged)]
    enum Answer {
        Axes { axes: Vec<Axis>, margin: BTreeMap<String, f64> },
    }

    #[derive(Serialize)]
    enum Tagged {
        Pair(f64, f64),
        One(f64),
        Named { value: f64 },
    }

    fn answer(change: impl Fn(&mut Axis, &mut BTreeMap<String, f64>)) -> Answer {
        let mut axis = Axis { name: "x", limits: [Some(1.0), None], share: 0.5 };
        let mut margin = BTreeMap::from([("center".to_owned(), 1e-300)]);
        change(&mut axis, &mut margin);
        let first = Axis { name: "a", limits: [None, None], share: 0.0 };
        Answer::Axes { axes: vec![first, axis], margin }
    }

    #[test]
    fn an_answer_of_finite_numbers_passes_and_what_is_absent_is_no_number() {
        assert_eq!(first_not_finite(&answer(|_, _| {})), None);
        assert_eq!(first_not_finite(&(f64::MAX, f64::MIN, f64::MIN_POSITIVE, -0.0)), None);
        assert_eq!(first_not_finite(&("NaN", u64::MAX, i8::MIN, true, ())), None);
    }

    #[test]
    fn a_number_that_is_not_finite_is_found_wherever_it_stands() {
        for number in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let found = first_not_finite(&answer(|axis, _| axis.limits[0] = Some(number)));
            assert_eq!(found.as_deref(), Some("axes/1/limits/0"));
            let found = first_not_finite(&answer(|axis, _| axis.share = number as f32));
            assert_eq!(found.as_deref(), Some("axes/1/share"));
            let found = first_not_finite(&answer(|_, margin| {
                margin.insert("center".to_owned(), number);
            }));
            assert_eq!(found.as_deref(), Some("margin/center"));
            let tagged = [
                (Tagged::Pair(0.0, number), "1"),
                (Tagged::One(number), "One"),
                (Tagged::Named { value: number }, "value"),
            ];
            for (value, place) in tagged {
                assert_eq!(first_not_finite(&value).as_deref(), Some(place));
            }
            let keyed = BTreeMap::from([(7_u32, number)]);
            assert_eq!(first_not_finite(&keyed).as_deref(), Some("7"));
            assert_eq!(first_not_finite(&number).as_deref(), Some(""));
        }
    }
}
