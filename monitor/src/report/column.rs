//! A column of numbers as a page holds it: few bytes, read by a dozen lines of script.
//!
//! Whole numbers are told by their differences, each difference as a natural number (0, −1, 1, −2, 2 become 0, 1,
//! 2, 3, 4), all lowest bytes first, then the next bytes; that is deflated, and written in base64. `bytes.js` reads
//! it.

use base64::Engine;
use base64::engine::general_purpose::STANDARD_NO_PAD;
use flate2::Compression;
use flate2::write::ZlibEncoder;
#[cfg(test)]
use serde::Deserialize;
use serde::Serialize;
use std::io::{self, Write};

/// A column, ready for the page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Column {
    /// How to read it.
    pub(super) layout: Layout,
    /// Base64 of what is deflated, without padding.
    pub(super) text: String,
}

/// How a column is to be read.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[cfg_attr(test, derive(Deserialize))]
pub(super) struct Layout {
    /// Numbers in it.
    pub(super) count: usize,
    /// Bytes of a difference, 1 to 4.
    pub(super) bytes: usize,
}

impl Column {
    /// Of these numbers. A difference beyond 31 bits is made up for by the next ones.
    ///
    /// # Errors
    /// What deflating reports; writing to memory reports nothing.
    pub(super) fn of(values: impl Iterator<Item = i64>) -> io::Result<Self> {
        let mut told = 0_i64;
        let differences: Vec<u32> = values
            .map(|value| {
                let difference = value.saturating_sub(told).clamp(-MOST, MOST);
                told += difference;
                let natural = if difference < 0 { -2 * difference - 1 } else { 2 * difference };
                u32::try_from(natural).unwrap_or(u32::MAX)
            })
            .collect();
        let largest = differences.iter().copied().max().unwrap_or(0);
        let bytes = (32 - largest.leading_zeros()).div_ceil(8).max(1) as usize;
        let mut deflated = ZlibEncoder::new(Vec::new(), Compression::new(LEVEL));
        for byte in 0..bytes {
            let plane: Vec<u8> =
                differences.iter().map(|natural| natural.to_le_bytes()[byte]).collect();
            deflated.write_all(&plane)?;
        }
        let layout = Layout { count: differences.len(), bytes };
        Ok(Self { layout, text: STANDARD_NO_PAD.encode(deflated.finish()?) })
    }
}

/// The largest difference.
const MOST: i64 = (1 << 31) - 1;

/// How hard to deflate: more takes twice the time for a few parts in a hundred.
const LEVEL: u32 = 5;

#[cfg(test)]
pub(super) mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use flate2::read::ZlibDecoder;
    use std::io::Read;

    /// What the page reads of a column.
    pub(in crate::report) fn read(layout: Layout, text: &str) -> Vec<i64> {
        let mut planes = Vec::new();
        let deflated = STANDARD_NO_PAD.decode(text).unwrap();
        ZlibDecoder::new(deflated.as_slice()).read_to_end(&mut planes).unwrap();
        assert_eq!(planes.len(), layout.count * layout.bytes);
        let mut told = 0_i64;
        (0..layout.count)
            .map(|index| {
                let byte = |plane: usize| i64::from(planes[plane * layout.count + index]);
                let natural: i64 = (0..layout.bytes).map(|plane| byte(plane) << (8 * plane)).sum();
                told += if natural % 2 == 1 { -(natural + 1) / 2 } else { natural / 2 };
                told
            })
            .collect()
    }

    #[test]
    fn numbers_are_read_as_they_were_written() {
        let check = |values: &[i64], bytes: usize| {
            let column = Column::of(values.iter().copied()).unwrap();
            assert_eq!(column.layout, Layout { count: values.len(), bytes });
            assert_eq!(read(column.layout, &column.text), values);
        };
        check(&[], 1);
        check(&[0, 5, -3, 120, 120], 1);
        check(&[1000, -1000, 300], 2);
        check(&[70_000_000, 0, -70_000_000], 4);
    }

    #[test]
    fn a_difference_that_is_too_large_is_made_up_for() {
        let far = 3 * MOST;
        let column = Column::of([0, far, far, far, far].into_iter()).unwrap();
        assert_eq!(read(column.layout, &column.text), [0, MOST, 2 * MOST, far, far]);
    }

    #[test]
    fn an_even_slope_takes_next_to_nothing() {
        let column = Column::of((0..100_000).map(|index| 17 * index)).unwrap();
        assert!(column.text.len() < 500, "{}", column.text.len());
    }
}
