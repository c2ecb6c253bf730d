//! Where two samples differ, in words.

use super::{Message, Origin, Shape};
use crate::recording::wire::{self, Wire};
use std::collections::BTreeMap;

/// The first field in which two samples differ.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// Its name.
    pub field: String,
    /// What was recorded.
    pub recorded: String,
    /// What is found instead.
    pub found: String,
}

impl core::fmt::Display for Difference {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self { field, recorded, found } = self;
        write!(formatter, "{field} is {found}, recorded was {recorded}")
    }
}

/// The first field in which `found` differs from `recorded`; `None` where every bit is the same. Times and
/// cycles are told against the origin.
pub fn difference<M: Message>(recorded: &M, found: &M, origin: &Origin) -> Option<Difference> {
    if recorded.as_bytes() == found.as_bytes() {
        return None;
    }
    let encoded = [recorded, found].map(|sample| {
        let mut bytes = Vec::new();
        sample.put(origin, &mut bytes);
        bytes
    });
    let [recorded, found] = encoded.each_ref().map(|bytes| {
        wire::fields(bytes).filter_map(Result::ok).collect::<BTreeMap<u32, Wire<'_>>>()
    });
    let differs = M::description().into_iter().find_map(|field| {
        let (was, is) = (recorded.get(&field.number), found.get(&field.number));
        (was != is).then(|| Difference {
            field: field.name.to_owned(),
            recorded: text(was, field.shape),
            found: text(is, field.shape),
        })
    });
    // Every field is described; this stands for one that is not.
    let unknown = || Difference {
        field: M::TITLE.to_owned(),
        recorded: "other bits".to_owned(),
        found: "other bits".to_owned(),
    };
    Some(differs.unwrap_or_else(unknown))
}

/// A value as people read it; digits enough to tell any two doubles apart.
fn text(wire: Option<&Wire<'_>>, shape: Shape) -> String {
    let Some(wire) = wire else { return "0".to_owned() };
    match (wire, shape) {
        (_, Shape::Signed) => wire.signed().map_or_else(|it| it.to_string(), |it| it.to_string()),
        (Wire::Number(value), _) => value.to_string(),
        (Wire::Fixed(bits), _) => format!("{:?}", f64::from_bits(*bits)),
        (Wire::Bytes(bytes), Shape::Doubles) => {
            let (words, _) = bytes.as_chunks::<8>();
            let values: Vec<f64> = words.iter().map(|word| f64::from_le_bytes(*word)).collect();
            format!("{values:?}")
        }
        (Wire::Bytes(bytes), _) => {
            let hex: Vec<String> = bytes.iter().map(|byte| format!("{byte:02x}")).collect();
            hex.join(" ")
        }
    }
}
