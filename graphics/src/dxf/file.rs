//! The sections of a DXF file: unit, layers, blocks and objects.

use std::collections::HashMap;

use super::codes::Pair;
use super::colours::{indexed, true_colour};
use super::frame::Space;
use super::record::Record;
use crate::ReadError;
use crate::read::notes::Notes;
use crate::shape::Colour;

/// What a file holds.
#[derive(Debug)]
pub(super) struct File<'p, 'a> {
    /// Metres in a unit of the drawing.
    pub(super) unit: f64,
    /// Layers by their names in capitals.
    pub(super) layers: HashMap<String, Layer>,
    /// Files of fonts by the names of their styles in capitals.
    pub(super) fonts: HashMap<String, String>,
    /// Blocks by their names in capitals.
    pub(super) blocks: HashMap<String, Block<'p, 'a>>,
    pub(super) entities: Vec<Record<'p, 'a>>,
}

#[derive(Debug)]
pub(super) struct Layer {
    pub(super) colour: Colour,
    pub(super) is_frozen: bool,
    pub(super) is_off: bool,
    pub(super) is_dashed: bool,
}

#[derive(Debug)]
pub(super) struct Block<'p, 'a> {
    pub(super) base: Space,
    pub(super) entities: Vec<Record<'p, 'a>>,
}

/// A name as it is compared.
pub(super) fn key(name: &str) -> String {
    name.to_uppercase()
}

/// Whether a name of a line type is one with gaps.
pub(super) fn is_dashed(name: &str) -> bool {
    !matches!(key(name).as_str(), "" | "CONTINUOUS" | "BYLAYER" | "BYBLOCK")
}

impl<'p, 'a> File<'p, 'a> {
    /// Sorts the pairs of a file.
    ///
    /// # Errors
    ///
    /// Where there is no section with objects.
    pub(super) fn new(pairs: &'p [Pair<'a>], notes: &mut Notes) -> Result<Self, ReadError> {
        let mut file = Self {
            unit: 1e-3,
            layers: HashMap::new(),
            fonts: HashMap::new(),
            blocks: HashMap::new(),
            entities: Vec::new(),
        };
        let (mut header, mut has_entities) = (&pairs[..0], false);
        let mut records = Record::all(pairs).peekable();
        while let Some(record) = records.next() {
            if record.kind != "SECTION" {
                continue;
            }
            let name = record.text(2).unwrap_or("");
            if name == "HEADER" {
                header = record.pairs;
                continue;
            }
            let mut own = Vec::new();
            while let Some(record) = records.next_if(|record| record.kind != "ENDSEC") {
                own.push(record);
            }
            // A file that programs joined of several has a section more than once.
            match name {
                "TABLES" => {
                    file.layers.extend(layers(&own));
                    file.fonts.extend(fonts(&own));
                }
                "BLOCKS" => file.blocks.extend(blocks(own)),
                "ENTITIES" => {
                    has_entities = true;
                    file.entities.append(&mut own);
                }
                _ => {}
            }
        }
        if !has_entities {
            return Err(ReadError::new(
                "the file has no section ENTITIES: it is no DXF drawing",
                "save the drawing as DXF, release 2000 or later",
            ));
        }
        file.unit = unit(header, notes);
        Ok(file)
    }
}

fn variable<'a>(header: &[Pair<'a>], name: &str) -> Option<Pair<'a>> {
    let place = header.iter().position(|pair| pair.is(9, name))?;
    header.get(place + 1).copied()
}

/// Metres in a unit of the drawing, by $INSUNITS.
fn unit(header: &[Pair<'_>], notes: &mut Notes) -> f64 {
    let given = variable(header, "$INSUNITS");
    let number = given.and_then(|pair| pair.whole()).unwrap_or(0);
    let line = given.map_or(0, |pair| u64::from(pair.line));
    let unit = match number {
        1 => 0.0254,
        2 => 0.3048,
        3 => 1609.344,
        4 => 1e-3,
        5 => 1e-2,
        6 => 1.0,
        7 => 1e3,
        8 => 25.4e-9,
        9 => 25.4e-6,
        10 => 0.9144,
        11 => 1e-10,
        12 => 1e-9,
        13 => 1e-6,
        14 => 0.1,
        15 => 10.0,
        16 => 100.0,
        21 => 1200.0 / 3937.0,
        _ => 0.0,
    };
    if unit > 0.0 {
        return unit;
    }
    let measurement = variable(header, "$MEASUREMENT").and_then(|pair| pair.whole());
    let text = match measurement {
        Some(0) => {
            "the file gives no unit and counts as an English drawing: its numbers are taken as \
             millimetres, scale by 25.4 if they are inches"
        }
        _ => "the file gives no unit: its numbers are taken as millimetres",
    };
    notes.add(text, line);
    1e-3
}

fn layers(records: &[Record<'_, '_>]) -> HashMap<String, Layer> {
    let layers = records.iter().filter(|record| record.kind == "LAYER");
    layers
        .filter_map(|record| {
            let number = record.whole(62).unwrap_or(7);
            let index = u8::try_from(number.unsigned_abs()).unwrap_or(7);
            let colour = record.whole(420).map_or_else(|| indexed(index), true_colour);
            let layer = Layer {
                colour,
                is_frozen: record.flags(70) & 1 != 0,
                is_off: number < 0,
                is_dashed: is_dashed(record.text(6).unwrap_or("")),
            };
            Some((key(record.text(2)?), layer))
        })
        .collect()
}

fn fonts(records: &[Record<'_, '_>]) -> HashMap<String, String> {
    let styles = records.iter().filter(|record| record.kind == "STYLE");
    let font = |record: &Record<'_, '_>| {
        Some((key(record.text(2)?), record.text(3).unwrap_or("").to_owned()))
    };
    styles.filter_map(font).collect()
}

fn blocks<'p, 'a>(records: Vec<Record<'p, 'a>>) -> HashMap<String, Block<'p, 'a>> {
    let mut blocks = HashMap::new();
    let mut open: Option<(String, Block<'p, 'a>)> = None;
    for record in records {
        match record.kind {
            "BLOCK" => {
                let base = record.space(10).unwrap_or_default();
                open = record.text(2).map(|name| (key(name), Block { base, entities: Vec::new() }));
            }
            "ENDBLK" => blocks.extend(open.take()),
            _ => {
                if let Some((_, block)) = &mut open {
                    block.entities.push(record);
                }
            }
        }
    }
    blocks
}
